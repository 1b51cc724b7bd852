"""The Look tab as a person uses it: boxes over the picture that are dragged, resized, renamed and accepted."""

import importlib.util
import json
import sys
from pathlib import Path

import numpy as np
import pytest
from browser_page import fits, tab, until

images = pytest.importorskip("PIL.Image", reason="needs pillow (extra perceive)")


def _pictures():
    file = Path(__file__).parents[1] / "perceive" / "depth_pictures.py"
    spec = importlib.util.spec_from_file_location("depth_pictures", file)
    made = sys.modules.setdefault("depth_pictures", importlib.util.module_from_spec(spec))
    spec.loader.exec_module(made)
    return made


pictures = _pictures()
CUP = pictures.Thing("box", (0.0, 0.17, 0.06), (0.08, 0.08, 0.12), colour="red")
BOOK = pictures.Thing("box", (0.05, -0.15, 0.03), (0.16, 0.1, 0.06), 0.4, "blue")
LEFT = pictures.Thing("box", (-0.15, 0.04, 0.04), (0.08, 0.08, 0.08), colour="yellow")
RIGHT = pictures.Thing("box", (-0.15, -0.04, 0.04), (0.08, 0.08, 0.08), colour="green")


@pytest.fixture
def folder(tmp_path):
    """A picture of a cup, a book, and two boxes that touch."""
    view = pictures.picture([CUP, BOOK, LEFT, RIGHT], size=(320, 240))
    place = tmp_path / "desk"
    place.mkdir()
    images.fromarray(view.rgb).save(place / "rgb.png")
    np.save(place / "depth.npy", view.depth)
    about = {"intrinsics": view.intrinsics.tolist(), "pose": view.pose.tolist()}
    (place / "camera.json").write_text(json.dumps(about))
    return place


def box(page, name):
    """The box over the picture that bears a name, as x, y, width, height on the screen."""
    place = page.locator("svg.boxes rect", has_text=name).bounding_box()
    return np.array([place[key] for key in ("x", "y", "width", "height")])


def drag(page, start, end):
    """Press, move, let go, and wait until the picture was drawn anew."""
    page.evaluate("document.querySelector('svg.boxes').dataset.old = '1'")
    page.mouse.move(*start)
    page.mouse.down()
    page.mouse.move(*(0.5 * (np.asarray(start) + end)))
    page.mouse.move(*end)
    page.mouse.up()
    page.wait_for_selector("svg.boxes:not([data-old])")


def middle(place):
    return place[:2] + 0.5 * place[2:]


def size_of(page, name):
    (row,) = [row for row in page.view.looking._rows if row.item.name == name]
    return row.item


def test_boxes_are_dragged_resized_renamed_and_accepted(start, browser, folder):
    page = browser(start(folder))
    names = lambda: page.view.controller.session.scene.names  # noqa: E731
    before = names()
    tab(page, "Look")
    page.get_by_role("button", name="Look", exact=True).locator("visible=true").click()
    page.get_by_role("button", name="Take into the scene").wait_for()
    page.locator("svg.boxes").scroll_into_view_if_needed()
    assert page.locator("svg.boxes rect").count() == 3, "the table has no box"
    fits(page)

    book = box(page, "blue box")
    drag(page, middle(box(page, "red box")), middle(book))
    page.wait_for_selector("text=red box is now")
    moved = size_of(page, "red box")
    assert np.linalg.norm(moved.position - BOOK.position) < 0.01 and moved.extra["colour"] == "blue"
    assert np.abs(box(page, "red box") - book).max() < 6

    (pair,) = (
        row.item.name for row in page.view.looking._rows if row.item.name not in ("red box", "blue box", "table")
    )
    there = box(page, pair)
    assert size_of(page, pair).size[:2].max() == pytest.approx(0.16, abs=0.01), "things that touch are one thing"
    edge = there[:2] + there[2:] * (1.0, 0.4)
    drag(page, edge, edge - there[2:] * (0.5, 0.0))
    page.wait_for_selector(f"text={pair} is now")
    half = size_of(page, pair)
    assert half.position[1] == pytest.approx(LEFT.position[1], abs=0.012) and half.size[:2].max() < 0.11

    kept = box(page, pair)
    drag(page, middle(kept), middle(kept) + np.array([0.0, 70.0]))
    page.wait_for_selector("text=nothing stands out in that box")
    assert np.abs(box(page, pair) - kept).max() < 1

    row = page.get_by_label("name of red box").or_(page.locator("input[value='red box']:visible")).first
    row.fill("my mug")
    page.get_by_text("take blue box").locator("visible=true").click()
    page.get_by_text("take table").locator("visible=true").click()
    page.get_by_role("button", name="Take into the scene").click()
    until(lambda: set(names()) == {*before, "my mug", pair})
    assert not page.broken
