"""The studio as a person sees it."""

import io
import json
import os
import time
from pathlib import Path

import numpy as np
import pytest
from browser_page import fits, tab, until

from ovita.writers.base import Reply

IMAGES = Path(__file__).parents[2] / "docs" / "images"
PICTURES = bool(os.environ.get("OVITA_PICTURES"))
SAY = "Go left by 0.2 and slow down near the cup"


def seen(page):
    """The picture of the scene between the panels and above the timeline, (H, W, 3)."""
    import imageio.v3 as images

    size = page.viewport_size
    below = page.evaluate("document.getElementById('dock').getBoundingClientRect().top")
    area = {"x": 360, "y": 60, "width": size["width"] - 770, "height": below - 62}
    return np.asarray(images.imread(io.BytesIO(page.screenshot(clip=area)))).astype(int)[..., :3]


def red(page):
    """How many pixels are as red as the adapted line."""
    r, g, b = np.moveaxis(seen(page), 2, 0)
    return int(((r > 170) & (g < 70) & (b < 80)).sum())


def say(page, text):
    box = page.locator("form input").first
    box.fill(text)
    box.press("Enter")


def left(page):
    """How far the red line's start is to the left of the blue line's [m]."""
    session = page.view.controller.session
    return float(session.original.positions[0, 0] - session.current.positions[0, 0])


def turns(page):
    return len(page.view.controller.session.steps)


def test_a_person_adapts_a_trajectory(studio, browser):
    page = browser(studio)
    assert page.title() == "ovita studio"
    page.wait_for_selector("text=Change how the robot moves by saying so.")
    before, empty = seen(page), red(page)

    say(page, SAY)
    page.wait_for_selector("text=Multiply the speed by 0.5")
    until(lambda: red(page) > empty + 300)
    assert np.abs(seen(page) - before).max(axis=2).mean() > 0.5
    assert left(page) == pytest.approx(0.2)
    assert page.view.space._lines["adapted"].visible

    number = page.locator("input[value='0.2']:visible").first
    number.fill("0.35")
    until(lambda: abs(left(page) - 0.35) < 1e-9)
    page.wait_for_selector("text=0.35 m left")

    say(page, "go up by 0.1")
    until(lambda: turns(page) == 3)
    assert left(page) == pytest.approx(0.35)
    page.get_by_role("textbox", name="feedback on").or_(page.locator("input[value^='current:']")).first.click()
    page.get_by_role("option", name="original").click()
    page.wait_for_selector("text=all of it is applied to the blue line")
    say(page, "go up by 0.1")
    until(lambda: turns(page) == 4)
    assert left(page) == pytest.approx(0.35)
    assert page.view.controller.session.steps[-1].feedback_on == "original"

    for number in (3, 2, 1, 0):
        page.locator("button.mantine-Button-root", has_text="Undo").first.click()
        until(lambda number=number: turns(page) == number)
    until(lambda: red(page) <= empty + 50)

    player = page.view.player
    page.locator("form input").first.click()
    page.keyboard.type("a b")
    assert player.moment == 0.0
    page.locator("form input").first.fill("")
    page.mouse.click(500, 200)
    page.keyboard.press("Space")
    until(lambda: player.moment > 0.0)
    page.keyboard.press("Control+Shift+KeyZ")
    until(lambda: turns(page) == 1)
    page.keyboard.press("Control+KeyZ")
    until(lambda: turns(page) == 0)

    say(page, "moonwalk to the fridge")
    page.wait_for_selector("text=I do not know 'moonwalk', 'fridge'")
    assert not page.broken
    host = studio.url.partition("//")[2].rstrip("/")
    assert all(host in url or url.startswith(("data:", "blob:")) for url in page.asked), page.asked


def test_reload_a_bad_upload_and_a_restart(start, browser):
    studio = start()
    page = browser(studio)
    say(page, SAY)
    page.wait_for_selector("text=Multiply the speed by 0.5")
    page.reload()
    page.wait_for_selector("text=Multiply the speed by 0.5")
    until(lambda: [round(view.controller.session.current.positions[0, 0], 9) for view in studio.views] == [-0.55])

    tab(page, "Files")
    page.locator("input[type=file]").first.set_input_files(
        {"name": "broken.json", "mimeType": "application/json", "buffer": b"{oops"}
    )
    page.wait_for_selector("text=broken.json: this is not JSON")
    until(lambda: not page.locator(".mantine-Notification-root:visible", has_text="Uploading").count())
    assert turns_of(studio) == [1]
    rows = [[0.1 * i, 0.0, 0.2, 0.2] for i in range(7)]
    good = json.dumps({"trajectory": rows}).encode()
    page.locator("input[type=file]").first.set_input_files(
        {"name": "good.json", "mimeType": "application/json", "buffer": good}
    )
    page.wait_for_selector("text=7 waypoints")
    page.wait_for_selector("text=Go back to it")

    port = studio.port
    studio.stop()
    again = start(port=port)
    page.goto(again.url)
    page.wait_for_selector("text=7 waypoints")


def free_of_panels(page):
    """Whether the player covers nothing of the right side."""
    bar = page.get_by_role("button", name="Play").last.bounding_box()
    return bar["x"] + bar["width"] < page.get_by_text("compared with").bounding_box()["x"]


def turns_of(studio):
    return sorted(len(view.controller.session.steps) for view in studio.views)


class Unsure:
    """Is certain of nothing."""

    name = "builtin"

    def write(self, prompt):
        code = "def adapt(traj, scene, *, left=0.2):\n    expect_moved(left=left)\n    return move(traj, left=left)\n"
        return Reply("policy", ("Shift the path 0.2 m to the left.",), code, unplaced=("feed",), confirm=True)


def test_a_proposal_is_amber_and_accept_does_it(studio, browser):
    page = browser(studio)
    page.view.controller.session.writer = Unsure()

    def amber():
        r, g, b = np.moveaxis(seen(page), 2, 0)
        return int(((r > 220) & (g > 150) & (g < 210) & (b < 60)).sum())

    before = amber()
    say(page, "left 20 cm, feed 0.7")
    page.wait_for_selector("text=Not used: 'feed'.")
    until(lambda: amber() > before + 200)
    shown = amber()
    assert turns(page) == 0 and red(page) == 0
    page.get_by_role("button", name="Accept").click()
    until(lambda: turns(page) == 1 and red(page) > 200)
    assert left(page) == pytest.approx(0.2) and amber() < shown - 150 and not page.broken


def test_two_persons_do_not_see_each_other_and_nothing_is_cut_off(studio, browser):
    """With OVITA_PICTURES set, the pictures of the documentation are taken."""
    mine, yours = browser(studio, 1280, 800), browser(studio, 1024, 700)
    until(lambda: free_of_panels(yours))
    keep(mine, "studio-first")
    say(mine, SAY)
    mine.wait_for_selector("text=Multiply the speed by 0.5")
    mine.mouse.move(640, 260)
    until(lambda: red(mine) > 300)
    assert red(yours) < 100 and yours.get_by_text(SAY).count() == 0
    assert (turns(mine), turns(yours)) == (1, 0)
    yours.close()

    for width, height in ((1280, 800), (1920, 1080), (1024, 700)):
        mine.set_viewport_size({"width": width, "height": height})
        tab(mine, "Say")
        tab(mine, "Changes")
        tab(mine, "Parameters")
        until(lambda: red(mine) > 100)
        time.sleep(1.0 if PICTURES else 0.1)
        fits(mine)
        if width > 1024:
            keep(mine, f"studio-{width}x{height}")
        for name in ("Plan", "Explanation", "Constraints", "Code", "Edit", "View", "Files", "Set up"):
            tab(mine, name)
            mine.wait_for_timeout(50)
            fits(mine)


@pytest.mark.skipif(not PICTURES, reason="a picture for the documentation only")
def test_picture_with_a_robot(studio, browser):
    page = browser(studio, 1280, 800)
    say(page, SAY)
    page.wait_for_selector("text=Multiply the speed by 0.5")
    tab(page, "Robot")
    page.locator("input[value='none']:visible").first.click()
    page.get_by_role("option", name="arm").click()
    time.sleep(6)
    page.get_by_role("button", name="Play").last.click()
    time.sleep(3)
    page.get_by_role("button", name="Pause").click()
    page.mouse.move(640, 200)
    time.sleep(1)
    keep(page, "studio-robot")


@pytest.mark.skipif(not PICTURES, reason="pictures for the documentation only")
@pytest.mark.parametrize(("name", "width", "height", "dark"), [("dark", 1366, 768, True), ("phone", 390, 844, False)])
def test_pictures_in_the_dark_and_of_a_phone(studio, browser, name, width, height, dark):
    page = browser(studio, width, height)
    say(page, SAY)
    page.wait_for_selector("text=Multiply the speed by 0.5")
    if dark:
        page.locator("[data-do='dark']").click()
    time.sleep(5)
    keep(page, f"studio-{name}")


def keep(page, name):
    """Save a picture with 256 colours, a third as large as with all."""
    if PICTURES:
        from PIL import Image

        picture = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
        few = picture.quantize(256, method=Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
        few.save(IMAGES / f"{name}.png", optimize=True)
