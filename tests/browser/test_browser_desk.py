"""Keys, help, a lost server and a phone, as a person meets them."""

import numpy as np
from browser_page import at_rest, tab, until


def say(page, text):
    box = page.locator("form input").first
    box.fill(text)
    box.press("Enter")


def turns(page):
    return len(page.view.controller.session.steps)


def alive(page):
    """Whether the timeline's buttons can be pressed: [True] where all can, [False] where none can."""
    return page.evaluate("() => [...new Set([...document.querySelectorAll('#dock button')].map(b => !b.disabled))]")


def keeps_focus(page, node):
    """Whether a node keeps the focus: what is drawn anew loses it, and a slow page draws late."""
    node.focus()
    page.wait_for_timeout(700)
    return node.evaluate("node => node === document.activeElement")


def chosen(page):
    return page.locator("[role=tab][aria-selected=true]").all_inner_texts()


def test_keys_help_and_words(start, browser):
    studio = start()
    page = browser(studio)
    say(page, "Go left by 0.2")
    until(lambda: turns(page) == 1)

    page.wait_for_selector("text=shift to the left")
    slider = page.locator("[role=slider]:visible").first
    slider.focus()
    at_rest(page)
    eye = np.array(page.view.client.camera.position)
    for _ in range(6):
        page.keyboard.press("ArrowRight")
    until(lambda: turns(page) == 2)
    assert np.allclose(page.view.client.camera.position, eye, atol=1e-6)
    page.wait_for_selector("text=left 0.2 \u2192")

    box = page.locator("form input").first
    box.focus()
    page.keyboard.press("Control+z")
    until(lambda: turns(page) == 1)
    page.keyboard.press("Control+y")
    until(lambda: turns(page) == 2)
    page.wait_for_selector("button.turn[data-do='go 2'][aria-current]")  # the list that is shown is the new one
    until(lambda: keeps_focus(page, page.locator("button.turn").last))
    page.keyboard.press("Space")
    until(lambda: turns(page) == 0)
    assert page.view.player.moment == 0.0
    page.view.timeline._select([10, 20])
    page.keyboard.press("?")
    page.wait_for_selector("#ovita-help[open]")
    page.keyboard.press("Escape")
    page.wait_for_selector("#ovita-help[open]", state="detached")
    page.wait_for_timeout(300)
    assert page.view.controller.selected == (10, 20), "Esc closes the list and nothing else"
    page.locator("body").press("Escape")
    until(lambda: page.view.controller.selected is None)
    tab(page, "Robot")
    page.wait_for_timeout(700)

    box.fill("half a sen")
    port = studio.port
    studio.stop()
    page.wait_for_selector("text=The studio does not answer")
    until(lambda: alive(page) == [False])
    again = start(port=port)
    page.wait_for_selector("#ovita-lost", state="detached")
    tab(page, "dark")
    until(lambda: again.views and again.views[0].space.dark)
    until(lambda: alive(page) == [True] and "Robot" in chosen(page))
    until(lambda: page.locator("form input").first.input_value() == "half a sen", 40.0)
    assert not page.broken


def test_a_phone_shows_the_path(start, browser):
    page = browser(start(), 390, 844)
    place = page.locator("canvas").first.bounding_box()
    sheet = page.locator(".mantine-Paper-root:has(.bridge)").first.bounding_box()
    assert place["y"] + place["height"] <= sheet["y"] + 2 and place["height"] >= 300 and sheet["width"] >= 389
    tab(page, "Edit")
    page.wait_for_timeout(700)
    page.set_viewport_size({"width": 1120, "height": 640})
    until(lambda: "Edit" in chosen(page) and len(chosen(page)) == 3)
    assert not page.broken


HEARS = """() => {
window.SpeechRecognition = class {
  start() { setTimeout(() => { this.onresult({ results: [[{ transcript: "go up " }], [{ transcript: "by 0.1" }]] });
    this.onend(); }, 50); }
  stop() {}
};
}"""


def looking(page):
    """Which way the camera looks; it goes back where the path needs more room."""
    camera = page.view.client.camera
    away = np.array(camera.position) - camera.look_at
    return away / np.linalg.norm(away)


def test_by_voice_and_by_arrows(start, browser):
    page = browser(start())
    page.evaluate(HEARS)
    page.wait_for_timeout(700)
    assert not page.get_by_role("button", name="speak").is_visible(), "off until it is asked for"
    tab(page, "View")
    page.get_by_label("a button to speak").check()
    tab(page, "Say")
    page.get_by_role("button", name="speak").click()
    until(lambda: page.locator("form input").first.input_value() == "go up by 0.1")
    assert turns(page) == 0, "what was heard is sent by hand"
    page.locator("form input").first.press("Enter")
    until(lambda: turns(page) == 1)

    page.view.hand.pick(20)
    page.wait_for_timeout(2000)  # until the arrows are drawn
    turned = looking(page)
    place = page.view.controller.session.current.positions[20]
    tip = place + np.array([0.0, 0.0, 0.17 * page.view.space.stage.size])
    seen = "p => ovitaTimeline.seen(p, ovitaTimeline.scene().getBoundingClientRect()).slice(0, 2)"
    low, high = (np.array(page.evaluate(seen, p.tolist())) for p in (place, tip))
    grip = low + 0.7 * (high - low)
    page.mouse.move(*grip)
    page.wait_for_timeout(300)
    page.mouse.down()
    for k in range(1, 9):
        page.mouse.move(*(grip + k / 8 * (high - low)))
        page.wait_for_timeout(40)
    page.mouse.up()
    until(lambda: turns(page) == 2)
    up = page.view.controller.session.current.positions[20] - place
    assert up[2] > 0.05 and np.abs(up[:2]).max() < 0.02
    assert page.view.controller.session.steps[-1].said.startswith("moved waypoint 21 0.")
    assert np.allclose(looking(page), turned, atol=0.02), "the arrows turn no camera"
    page.keyboard.press("Control+KeyZ")
    until(lambda: turns(page) == 1)
    assert not page.broken
