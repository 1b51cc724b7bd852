"""What every browser test waits for."""


def ready(page):
    """Wait until the page is built and drawn, and close the notice that there is no graphics card."""
    page.wait_for_selector("text=What should change?")
    page.wait_for_selector("text=Distance to the nearest object")
    notice = page.locator(".mantine-Notification-root", has_text="Software WebGL")
    notice.wait_for(timeout=10_000)
    notice.locator("button").click()
    notice.wait_for(state="hidden")
    return page
