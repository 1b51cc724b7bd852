"""Where trajectories come from, in a browser: a scene without one, planned from words, and a pen that shows one."""

import io
import json

import numpy as np
from browser_page import tab, until

THINGS = {"box": (0.3, -0.3, 0.05, 0.12, 0.10, 0.10), "plate": (0.3, 0.3, 0.01, 0.22, 0.22, 0.02),
          "bottle": (0.3, 0.0, 0.13, 0.07, 0.07, 0.26)}  # fmt: skip


def picture(page):
    """The scene between the panels, (H, W, 3)."""
    import imageio.v3 as images

    area = {"x": 360, "y": 60, "width": page.viewport_size["width"] - 770, "height": page.viewport_size["height"] - 240}
    return np.asarray(images.imread(io.BytesIO(page.screenshot(clip=area)))).astype(int)[..., :3]


def changed(before, after):
    """Where two pictures differ, in the page's coordinates (K, 2)."""
    rows, columns = np.nonzero(np.abs(after - before).max(axis=2) > 60)
    return np.stack([columns + 360, rows + 60], axis=1)


def densest(places, reach=6):
    """Where most of some places (K, 2) lie: a page that saves time draws every edge a little differently."""
    near = (np.abs(places[:, None] - places[None]) <= reach).all(axis=2)
    return np.median(places[near[near.sum(axis=1).argmax()]], axis=0)


def say(page, text):
    box = page.locator("form input").first
    box.fill(text)
    box.press("Enter")


def bare(folder):
    objects = [dict(zip("xyz", t[:3], strict=True), name=n, dimensions=t[3:]) for n, t in THINGS.items()]
    file = folder / "bare.json"
    file.write_text(json.dumps({"objects": objects, "robot": "arm"}))
    return file


def test_a_scene_without_a_trajectory_gets_one_by_words(start, browser, tmp_path):
    page = browser(start(bare(tmp_path)), bare=True)
    before = picture(page)
    say(page, "go to the plate")
    page.wait_for_selector("text=Where does it start?")
    say(page, "the box")
    page.wait_for_selector("text=Plan the way from above the box to above the plate")
    until(lambda: not page.view.controller.session.bare)
    path = page.view.controller.session.original.positions
    assert np.allclose(path[[0, -1], :2], [THINGS["box"][:2], THINGS["plate"][:2]])
    until(lambda: len(changed(before, picture(page))) > 200)
    say(page, "slowly")
    page.wait_for_selector("text=Multiply the speed by 0.5")
    assert not page.broken


def dragged(page, x, y):
    """Press at a place, move, and let go."""
    page.mouse.move(x - 1, y)
    page.wait_for_timeout(300)
    page.mouse.move(x, y)
    page.wait_for_timeout(300)
    page.mouse.down()
    page.wait_for_timeout(300)
    for k in range(1, 13):
        page.mouse.move(x + 12 * k, y - 3 * k)
        page.wait_for_timeout(60)
    page.mouse.up()
    page.wait_for_timeout(1500)


def test_a_pen_that_is_dragged_shows_a_movement(start, browser, tmp_path):
    page = browser(start())
    tab(page, "Edit")
    button = page.get_by_role("button", name="Take the pen")
    button.scroll_into_view_if_needed()
    before = picture(page)
    button.click()
    page.get_by_role("button", name="Put the pen away").wait_for()
    until(lambda: len(changed(before, picture(page))) > 20)
    dragged(page, *densest(changed(before, picture(page))))
    until(lambda: page.view.pen.strokes)
    page.wait_for_selector("text=1 demonstration")
    (task,) = page.view.pen.strokes
    positions = task.trajectory.positions
    assert len(positions) > 3 and np.ptp(positions, axis=0)[:2].max() > 0.05 and np.ptp(positions[:, 2]) < 1e-6
    assert not page.broken
