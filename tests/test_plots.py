import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("matplotlib")
pytest.importorskip("plotly")

from ovita import plots
from ovita.errors import FormatError, MissingExtra
from ovita.limits import ConstraintCheck
from ovita.paths.robot import Box, Robot, Shell
from ovita.paths.scene import Frame, Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.plots import geometry

EVIL = "<script>alert(1)</script>"
MAGIC = {".png": b"\x89PNG\r\n", ".svg": b"<?xml", ".pdf": b"%PDF-"}


def arc(height: float = 0.4) -> Trajectory:
    turn = np.linspace(0.0, np.pi, 31)
    positions = np.stack([np.cos(turn), np.sin(turn), height * np.sin(turn)], axis=1)
    return Trajectory(positions, 0.2 + 0.3 * np.sin(turn))


def moved(path: Trajectory) -> Trajectory:
    rows = path.to_array()
    rows[:, 0] -= 0.2
    rows[10:15, 3] *= 0.5
    rows = np.insert(rows, [21] * 5, rows[20], axis=0)
    rows[20:26, 3] = 0.0
    return Trajectory.from_array(rows)


TURN = (np.cos(0.4), 0.0, 0.0, np.sin(0.4))
SCENE = Scene(
    (
        SceneObject("table", (0.0, 0.5, -0.1), (1.0, 0.5, 0.05), TURN),
        SceneObject("cup", (0.1, 0.5, 0.0)),
        SceneObject("far tree", (80.0, 0.0, 0.0)),
    )
)


class Tags(HTMLParser):
    """The tags and attributes of a page; scripts are skipped as a browser would not take them for tags."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.seen: list[tuple[str, dict[str, str | None]]] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.seen.append((tag, dict(attrs)))


def texts(figure) -> str:
    return "\n".join(t.get_text() for t in [*figure.texts, *(t for a in figure.axes for t in [a.xaxis.label])])


@pytest.mark.parametrize("suffix", MAGIC)
def test_a_figure_is_saved_by_its_suffix(tmp_path: Path, suffix: str) -> None:
    figure = plots.figure(arc(), moved(arc()), SCENE, robot=Robot.preset("arm"), proposed=arc(0.5), title="Go left")
    target = tmp_path / f"picture{suffix.upper()}"
    plots.save(target, figure)
    assert target.read_bytes().startswith(MAGIC[suffix])
    assert [p.name for p in tmp_path.iterdir()] == [target.name]


@pytest.mark.parametrize("name", ["picture.bmp", "picture"])
def test_an_unknown_suffix_is_one_sentence(tmp_path: Path, name: str) -> None:
    with pytest.raises(FormatError, match=r"written as \.png, \.svg, \.pdf"):
        plots.save(tmp_path / name, plots.figure(arc(), arc(), Scene()))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("height", "view", "space"), [(0.4, "auto", True), (0.0, "auto", False), (0.0, "3d", True), (0.4, "top", False)]
)
def test_a_planar_path_is_seen_from_above(height: float, view: str, space: bool) -> None:
    figure = plots.figure(arc(height), moved(arc(height)), SCENE, view=view)
    assert hasattr(figure.axes[0], "get_zlim") is space
    assert len(figure.axes) == 3


@pytest.mark.parametrize(
    ("frame", "across", "along"),
    [
        ("rfu", "x [m] (right)", "y [m] (front)"),
        ("flu", "y [m] (left)", "x [m] (front)"),
        ("ned", "y [m] (right)", "x [m] (front)"),
    ],
)
def test_from_above_right_is_right_in_every_frame(frame: str, across: str, along: str) -> None:
    axes = plots.figure(arc(0.0), arc(0.0), Scene((), Frame(frame))).axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == (across, along)
    assert axes.get_xlim()[0] > axes.get_xlim()[1] if frame == "flu" else axes.get_xlim()[0] < axes.get_xlim()[1]
    assert axes.get_ylim()[0] < axes.get_ylim()[1]


def test_both_scales_are_equal_and_everything_is_inside() -> None:
    figure = plots.figure(arc(0.0), moved(arc(0.0)), SCENE)
    axes = figure.axes[0]
    figure.draw_without_rendering()
    (x0, x1), (y0, y1), box = axes.get_xlim(), axes.get_ylim(), axes.get_window_extent()
    assert (x1 - x0) / box.width == pytest.approx((y1 - y0) / box.height, rel=1e-3)
    assert x0 < -1.2 and x1 > 1.0 and y0 < 0.0 and y1 > 1.0


def test_a_far_object_is_named_but_does_not_shrink_the_rest() -> None:
    figure = plots.figure(arc(), arc(), SCENE)
    assert "Too far away to be shown: far tree." in texts(figure)
    assert figure.axes[0].get_xlim()[1] < 3.0
    assert "Too far away to be shown: far tree." in plots.interactive(arc(), arc(), SCENE)


def test_names_neither_overlap_nor_cover_the_paths() -> None:
    crowd = [SceneObject(f"object {i}", (0.02 * i, 0.5, 0.0)) for i in range(6)]
    figure = plots.figure(arc(), moved(arc()), Scene(tuple(crowd)))
    figure.draw_without_rendering()
    boxes = [t.get_window_extent() for t in figure.texts if t.get_text().startswith("object")]
    assert len(boxes) == 6
    assert not any(a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[i + 1 :])


def test_placed_labels_stay_in_the_area() -> None:
    box = (np.array([95.0, 95.0]), np.array([100.0, 100.0]))
    (spot,) = geometry.place_labels([box], [(40.0, 10.0)], np.zeros((0, 2)), (np.zeros(2), np.full(2, 100.0)))
    assert spot.middle[0] + 20.0 <= 101.0 and spot.middle[1] + 5.0 <= 101.0


def test_the_legend_tells_what_is_drawn() -> None:
    check = ConstraintCheck("workspace", "", "inside the box", 0.1, 0.1, where_after=3)
    robot = Robot("box", Box((-1.0, -1.0, -0.2), (1.0, 1.0, 0.3)))
    figure = plots.figure(arc(), moved(arc()), SCENE, robot=robot, proposed=arc(0.5), violations=[check])
    told = {t.get_text() for t in figure.legends[0].get_texts()}
    assert {"before", "after", "start", "goal", "stop", "slower", "workspace", "limit broken"} <= told
    assert {t.get_text() for t in plots.figure(arc(), arc(), SCENE).legends[0].get_texts()} == {
        "before", "after", "start", "goal",
    }  # fmt: skip


@pytest.mark.parametrize("name", ["$x^", "杯子 \U0001f600", "two\nlines\ttab\x07", EVIL, "n" * 300])
def test_any_name_and_title_can_be_drawn(tmp_path: Path, name: str) -> None:
    scene = Scene((SceneObject(name, (0.0, 0.5, 0.0)),))
    plots.save(tmp_path / "p.png", plots.figure(arc(), moved(arc()), scene, title=name * 3))


@pytest.mark.parametrize(
    "path",
    [
        Trajectory(np.zeros((2, 3)), np.zeros(2)),
        Trajectory(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), np.zeros(2)),
        Trajectory(np.array([[1e4, 0.0, 0.0], [1e4 + 1e-3, 0.0, 0.0]]), np.ones(2)),
    ],
)
def test_degenerate_paths_are_drawn(tmp_path: Path, path: Trajectory) -> None:
    plots.save(tmp_path / "p.png", plots.figure(path, path, SCENE, robot=Robot.preset("drone")))
    assert plots.interactive(path, path, SCENE, robot=Robot.preset("drone"))


def test_the_page_is_self_contained() -> None:
    page = plots.interactive(arc(), moved(arc()), SCENE, robot=Robot.preset("arm"), title="Go left", notes=["one"])
    tags = Tags(page).seen
    assert {tag for tag, _ in tags} <= {
        "html", "head", "meta", "title", "style", "body", "h1", "div", "script", "ul", "li", "p",
    }  # fmt: skip
    assert not [a for _, a in tags if {"src", "href", "action"} & set(a)]
    (policy,) = [a["content"] for _, a in tags if a.get("http-equiv") == "Content-Security-Policy"]
    assert policy is not None and "default-src 'none'" in policy and "http" not in policy
    assert "form-action 'none'" in policy and '"modeBarButtonsToRemove": ["sendChartToCloud"]' in page
    assert "<h1>Go left</h1>" in page and "<li>one</li>" in page


def test_untrusted_text_stays_text() -> None:
    scene = Scene((SceneObject(EVIL, (0.0, 0.5, 0.0)), SceneObject(EVIL + "far", (99.0, 0.0, 0.0))))
    page = plots.interactive(arc(), moved(arc()), scene, title=EVIL, notes=[EVIL, "</ul><img src=x onerror=y>"])
    assert EVIL not in page and "&lt;script&gt;alert(1)&lt;/script&gt;" in page
    harmless = plots.interactive(arc(), moved(arc()), SCENE, title="t", notes=["a", "b"])
    scripts = [sum(tag == "script" for tag, _ in Tags(p).seen) for p in (page, harmless)]
    assert scripts[0] == scripts[1]
    assert not any(tag == "img" for tag, _ in Tags(page).seen)


def test_the_buttons_hide_what_they_say() -> None:
    from ovita.plots.browser import go

    figure = go.Figure([go.Scatter(meta="before"), go.Scatter(meta="after"), go.Mesh3d(meta="object")])
    from ovita.plots.browser import _buttons

    shown = {b["label"]: b["args"][1] for b in _buttons(figure)["buttons"]}
    assert shown == {"both": [True] * 3, "before": [True, False, True], "after": [False, True, True]}


def test_corners_of_a_turned_cuboid_keep_its_size_and_centre() -> None:
    points = geometry.corners(SCENE.objects[0])
    np.testing.assert_allclose(points.mean(axis=0), SCENE.objects[0].position, atol=1e-12)
    np.testing.assert_allclose(SCENE.objects[0].clearance(points), 0.0, atol=1e-12)
    flat = geometry.corners(SceneObject("leaf", (0, 0, 0), (0.0, 0.0, 0.0)), 0.1)
    np.testing.assert_allclose(np.ptp(flat, axis=0), 0.1)


@pytest.mark.parametrize("workspace", [Box((-3, -3, -3), (3, 3, 3)), Shell((0, 0, 0), 0.5, 3.0)])
def test_workspace_lines_lie_on_its_border_and_in_the_picture(workspace: Box | Shell) -> None:
    whole = np.full(3, 10.0)
    lines = geometry.workspace_lines(workspace, -whole, whole)
    assert lines
    np.testing.assert_allclose(workspace.inside(np.concatenate(lines)), 0.0, atol=1e-9)
    part = np.concatenate(geometry.workspace_lines(workspace, np.zeros(3), np.full(3, 3.5)))
    assert np.nanmin(part) >= -1e-9
    assert geometry.workspace_lines(workspace, np.full(3, 4.0), np.full(3, 5.0)) == []


@pytest.mark.parametrize(("package", "name"), [("matplotlib", "figure"), ("plotly", "interactive")])
def test_a_missing_library_is_named_with_its_extra(package: str, name: str) -> None:
    code = (
        f"import sys; sys.modules[{package!r}] = None\n"
        "from ovita import plots\nfrom ovita.errors import MissingExtra\n"
        f"try:\n    plots.{name}\nexcept MissingExtra as error:\n    print(error.package, error.extra)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == [package, "plot"]
    assert issubclass(MissingExtra, Exception)


def test_importing_the_package_loads_no_drawing_library() -> None:
    code = "import sys\nfrom ovita import plots\nprint({'matplotlib', 'plotly'} & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == "set()"
