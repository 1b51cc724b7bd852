"""Keys, help, a lost server and a phone, as a person meets them."""

import numpy as np
from browser_page import until


def say(page, text):
    box = page.locator("form input").first
    box.fill(text)
    box.press("Enter")


def turns(page):
    return len(page.view.controller.session.steps)


def test_keys_help_and_words(start, browser):
    studio = start()
    page = browser(studio)
    say(page, "Go left by 0.2")
    until(lambda: turns(page) == 1)

    page.wait_for_selector("text=shift to the left")
    slider = page.locator("[role=slider]:visible").first
    slider.focus()
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
    page.locator("button.turn").last.focus()
    page.keyboard.press("Space")
    until(lambda: turns(page) == 0)
    assert page.view.player.moment == 0.0
    page.keyboard.press("?")
    page.wait_for_selector("#ovita-help[open]")
    page.keyboard.press("Escape")

    box.fill("half a sen")
    port = studio.port
    studio.stop()
    page.wait_for_selector("text=The studio does not answer")
    again = start(port=port)
    page.wait_for_selector("#ovita-lost", state="detached")
    until(lambda: again.views)
    until(lambda: page.locator("form input").first.input_value() == "half a sen", 40.0)
    assert not page.broken


def test_a_phone_shows_the_path(start, browser):
    page = browser(start(), 390, 844)
    place = page.locator("canvas").first.bounding_box()
    sheet = page.locator(".mantine-Paper-root:has(.bridge)").first.bounding_box()
    assert place["y"] + place["height"] <= sheet["y"] + 2 and place["height"] >= 300 and sheet["width"] >= 389
