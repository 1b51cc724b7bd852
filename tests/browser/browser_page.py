"""What browser tests share: what they wait for, and what no page may do."""

import time


def ready(page, bare=False):
    """Wait until the page is built and drawn, and hide the notice that there is no graphics card.

    Args:
        page: Of the studio.
        bare: Whether what is open has no trajectory yet.
    """
    page.wait_for_selector("text=From where to where?" if bare else "text=What should change?")
    page.wait_for_function("() => ovitaTimeline.state().paths.length")
    notice = page.locator(".mantine-Notification-root", has_text="Software WebGL")
    notice.wait_for()
    notice.evaluate("node => { node.style.display = 'none' }")
    return page


def until(condition, seconds=20.0):
    ends = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < ends, "it did not happen"
        time.sleep(0.1)


def at_rest(page, seconds=0.8):
    """Wait until the camera has come to rest: the page tells of its own size late, and then it looks anew.

    The page hears of it later still, and looks for the line under the pointer by what it heard.
    """
    seen, since = None, 0.0

    def rests():
        nonlocal seen, since
        camera, now = page.view.client.camera, time.monotonic()
        heard = page.evaluate(
            "() => { const box = ovitaTimeline.scene()?.getBoundingClientRect(), { camera } = ovitaTimeline.state();"
            " return [camera && camera.position, JSON.stringify([camera, box])]; }"
        )
        state = (*camera.position, *camera.look_at, camera.image_width, camera.image_height, heard[1])
        if state != seen or heard[0] is None or abs(camera.position - heard[0]).max() > 1e-6:
            seen, since = state, now
        return now - since > seconds

    until(rests)
    return page


def tab(page, name):
    page.get_by_text(name, exact=True).locator("visible=true").first.click()


def fits(page):
    """Nothing is wider than the panel that it is in, and no panel is wider than the window."""
    wide = page.evaluate(
        "() => [...document.querySelectorAll('.ov')].filter(e => e.offsetParent && e.scrollWidth > e.clientWidth + 1)"
        ".map(e => e.innerText.slice(0, 80))"
    )
    assert wide == []
    assert page.evaluate("() => document.documentElement.scrollWidth <= window.innerWidth")
