"""The Look panel: pictures in, what is accepted becomes one turn that can be undone."""

from __future__ import annotations

import importlib.util
import io
import json
import re
from pathlib import Path

import numpy as np
import pytest

from ovita.errors import FormatError, RequestError, SceneError
from ovita.paths.scene import Scene, SceneObject
from ovita.perceive.pointed import rectangle_of
from ovita.perceive.update import update
from ovita.studio.look import accepted, lookable, moved_box, picture_html, role_of

images = pytest.importorskip("PIL.Image", reason="needs pillow (extra perceive)")

_spec = importlib.util.spec_from_file_location(
    "depth_pictures", Path(__file__).parents[1] / "perceive" / "depth_pictures.py"
)
assert _spec is not None and _spec.loader is not None
pictures = importlib.util.module_from_spec(_spec)
import sys  # noqa: E402

sys.modules.setdefault("depth_pictures", pictures)
_spec.loader.exec_module(pictures)

CUP = pictures.Thing("box", (0.0, 0.15, 0.06), (0.08, 0.08, 0.12), colour="red")
BOOK = pictures.Thing("box", (0.05, -0.15, 0.03), (0.16, 0.1, 0.06), 0.4, "blue")


def png(pixels: np.ndarray) -> bytes:
    stream = io.BytesIO()
    images.fromarray(pixels).save(stream, "PNG")
    return stream.getvalue()


@pytest.fixture(scope="module")
def files() -> dict[str, bytes]:
    view = pictures.picture([CUP, BOOK])
    about = {"intrinsics": view.intrinsics.tolist(), "pose": view.pose.tolist()}
    depth = np.nan_to_num(view.depth * 1000.0).round().astype(np.uint16)
    return {"shot.png": png(view.rgb), "far.png": png(depth), "my camera.json": json.dumps(about).encode()}


def looked(tab, files, **more):
    for name, content in {**files, **more}.items():
        tab.upload(name, content, button="Upload for looking")
        tab.wait(lambda name=name: name in tab.text())
    tab.click("Look")


def test_look_rename_drop_take_undo(start, visit, files):
    studio = start()
    tab = visit(studio)
    names = lambda: studio.views[0].controller.session.scene.names  # noqa: E731
    before = names()
    looked(tab, files)
    tab.wait(lambda: tab.find("take blue box") and tab.find("take red box") and tab.find("name of table"))
    assert "red box is new" in tab.text()
    assert '<svg class="boxes"' in tab.text() and "data:image/jpeg;base64," in tab.text()
    tab.set("name of red box", "my mug")
    tab.set("take blue box", False)
    tab.set("take table", False)
    tab.click("Take into the scene")
    tab.wait(lambda: any("my mug taken into the scene" in notice for notice in tab.notices))
    assert names() == (*before, "my mug"), "the box that was not taken is not there"
    tab.set("history", "Undo")
    tab.wait(lambda: names() == before)


def test_a_dragged_box_is_measured_anew(start, visit, files):
    studio = start()
    tab = visit(studio)
    looked(tab, files)
    tab.wait(lambda: tab.find("take blue box") and tab.find("name of table"))
    tab.set("name of red box", "my mug")
    left = number_of(tab, "red box")
    there = rectangle_of(pictures.picture([CUP, BOOK]), SceneObject("a", BOOK.position, BOOK.size))
    tab.set("moved", f"box {left}: " + " ".join(f"{edge:.0f}" for edge in there))
    tab.wait(lambda: any("red box is now" in notice for notice in tab.notices))
    tab.set("take blue box", False)
    tab.set("take table", False)
    tab.click("Take into the scene")
    tab.wait(lambda: "my mug" in studio.views[0].controller.session.scene.names)
    mug = studio.views[0].controller.session.scene["my mug"]
    assert mug.extra["colour"] == "blue" and np.linalg.norm(mug.position - np.array(BOOK.position)) < 0.01
    tab.set("moved", "box 1: 0 0 12 9")
    tab.wait(lambda: any("nothing stands out in that box" in notice for notice in tab.notices))
    tab.set("moved", "box 9: 0 0 12 9")
    tab.wait(lambda: any("moves no box" in notice for notice in tab.notices))


def number_of(tab, name):
    """The number of the box that bears a name."""
    return int(re.search(rf'data-box="(\d+)"[^>]*><title>{name}<', tab.text())[1])


@pytest.mark.parametrize(
    "text, says",
    [("box 0: 1 1 9 9", "moves no box"), ("box 1: 9 9 1 1", "holds no pixel"), ("box 1: 1 2 3", "moves no box")],
)
def test_a_text_that_moves_no_box_is_refused(text, says):
    with pytest.raises(RequestError, match=says):
        moved_box(text, 3)


def test_a_name_in_the_picture_is_text():
    view = pictures.picture([CUP])
    drawn = picture_html(view, [SceneObject("<script>alert(1)</script>", CUP.position, CUP.size)])
    assert "<script>" not in drawn and moved_box("box 1: 10 20 30.5 40", 1) == (0, (10.0, 20.0, 30.5, 40.0))


def test_small_boxes_lie_over_large_ones_and_what_things_stand_on_has_none():
    view, far = pictures.picture([CUP, BOOK]), CUP.position
    items = [SceneObject("cup", far, CUP.size), SceneObject("tray", far, np.array([0.4, 0.4, 0.02]))]
    table = SceneObject("table", np.zeros(3), np.array([3.0, 3.0, 0.02]), extra={"kind": "support"})
    drawn = picture_html(view, [*items, table])
    assert re.findall(r"<title>(.*?)</title>", drawn) == ["tray", "cup"]
    assert picture_html(view, items, 1) != picture_html(view, items, 2), "or a box that was refused stays where it was"


def test_what_is_offered_and_what_is_wrong(start, visit, files, tmp_path):
    folder = tmp_path / "table"
    folder.mkdir()
    for name, role in (("shot.png", "rgb.png"), ("far.png", "depth.png"), ("my camera.json", "camera.json")):
        (folder / role).write_bytes(files[name])
    tab = visit(start(tmp_path))
    assert tab.value("pictures") == "table"
    tab.click("Look")
    tab.wait(lambda: tab.find("take red box"))
    tab.upload("notes.txt", b"hello", button="Upload for looking")
    tab.wait(lambda: any("nothing to look at" in notice for notice in tab.notices))
    looked(tab, {name: files[name] for name in ("far.png",)}, **{"bad.json": b'{"fx": 1}'})
    tab.wait(lambda: any("bad.json" in notice for notice in tab.notices))


def test_lookable_and_roles(tmp_path, files):
    assert role_of("shot.png", files["shot.png"]) == "picture" and role_of("far.png", files["far.png"]) == "depth"
    assert role_of("a.npy", b"") == "depth" and role_of("camera.json", b"") == "camera"
    with pytest.raises(FormatError, match="nothing to look at"):
        role_of("a.exe", b"")
    (tmp_path / "view").mkdir()
    (tmp_path / "view" / "camera.json").write_text("{}")
    (tmp_path / "a.npz").write_bytes(b"")
    (tmp_path / "scene.json").write_text("{}")
    assert list(lookable([str(tmp_path)])) == ["a.npz", "view"] and lookable([str(tmp_path / "scene.json")]) == {}


def box(name, x, **extra):
    return SceneObject(name, np.array([x, 0.0, 0.05]), np.array([0.1, 0.1, 0.1]), extra={"seen_by": 1, **extra})


def test_only_what_is_accepted_changes():
    before = Scene((box("cup", 0.0, colour="red"), box("bin", 1.0, colour="blue")))
    change = update(before, Scene((box("red box", 0.2, colour="red"), box("green box", 2.0, colour="green"))))
    all_ = accepted(before, change, {"cup": "mug", "green box": "crate"}, ())
    assert all_.names == ("mug", "bin", "crate") and all_["mug"].position[0] == pytest.approx(0.2)
    none = accepted(before, change, {}, ["bin"])
    assert none.names == ("cup",) and none["cup"].position[0] == 0.0
    with pytest.raises(SceneError, match="two objects"):
        accepted(before, change, {"cup": "bin"}, ())
