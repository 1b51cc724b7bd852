"""What every browser test waits for."""


def ready(page):
    """Wait until the page is built and drawn, and hide the notice that there is no graphics card."""
    page.wait_for_selector("text=What should change?")
    page.wait_for_selector("text=Distance to the nearest object")
    notice = page.locator(".mantine-Notification-root", has_text="Software WebGL")
    notice.wait_for()
    notice.evaluate("node => { node.style.display = 'none' }")
    return page
