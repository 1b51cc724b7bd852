import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest
from depth_pictures import Thing, picture, tilted

from ovita.errors import SceneError
from ovita.paths.scene import matrix
from ovita.perceive import Found, View, perceive
from ovita.perceive.looks import Look, Wanted, assign

_spec = importlib.util.spec_from_file_location(
    "benchmark_of_perception", Path(__file__).parents[2] / "benchmarks" / "perceive.py"
)
benchmark = importlib.util.module_from_spec(_spec)
sys.modules[_spec.name] = benchmark
_spec.loader.exec_module(benchmark)

CUP = Thing("cylinder", (0.0, 0.12, 0.05), (0.08, 0.08, 0.1), colour="red")
BOX = Thing("box", (0.1, -0.12, 0.04), (0.1, 0.14, 0.08), 0.4, "blue")
BALL = Thing("sphere", (-0.14, -0.02, 0.035), (0.07, 0.07, 0.07), colour="yellow")
TABLE = [CUP, BOX, BALL]


def off(seen, thing):
    """Errors of centre and of the sorted sizes [m]."""
    return np.linalg.norm(seen.position - thing.position), np.abs(np.sort(seen.size) - np.sort(thing.size)).max()


@pytest.mark.parametrize("yaw", [0.0, 0.5, 1.2])
def test_a_box_on_a_table_is_found_where_it_is(yaw):
    box = Thing("box", (0.05, -0.04, 0.06), (0.16, 0.1, 0.12), yaw)
    (seen,) = perceive([picture([box], noise=0.0025)]).things
    center, size = off(seen, box)
    assert center < 0.004 and size < 0.006
    assert seen.extra["shape"] == "box" and seen.extra["points"] > 100
    turn = matrix(seen.orientation).T @ box.rotation
    assert np.degrees(np.arccos(np.abs(turn).max(axis=0).min())) < 1.0


@pytest.mark.parametrize(
    "thing",
    [
        CUP,
        BALL,
        Thing("cylinder", (0.0, 0.0, 0.04), (0.08, 0.08, 0.2), turn=tilted("y", 90)),
        Thing("box", (0.0, 0.0, 0.09), (0.12, 0.1, 0.1), turn=tilted("y", 30)),
        Thing("box", (0.0, 0.0, 0.02), (0.2, 0.14, 0.04), 0.3),
    ],
    ids=["cup", "ball", "lying", "tilted", "flat"],
)
def test_the_shape_that_explains_the_pixels_is_chosen(thing):
    (seen,) = perceive([picture([thing], eye=(-0.45, -0.6, 0.5), noise=0.0015, size=(240, 180))]).things
    center, size = off(seen, thing)
    assert seen.extra["shape"] == thing.kind
    assert center < 0.008 and size < 0.012
    assert seen.extra.get("tilted", False) == (thing.turn is not None and thing.kind == "box")


def test_two_views_are_merged_and_each_thing_says_what_it_rests_on():
    views = [picture(TABLE, noise=0.002), picture(TABLE, eye=(0.1, -0.75, 0.55), noise=0.002, seed=1)]
    seen = perceive(views)
    assert len(seen.things) == 3
    one = perceive(views[:1]).scene
    for item in seen.things:
        assert item.extra["seen_by"] == 2
        assert item.extra["spread_mm"] < 5
        assert item.extra["points"] > min(o.extra["points"] for o in one)
    cup = seen.scene["red cylinder"]
    assert off(cup, CUP)[0] < 0.004


def test_names_go_to_what_looks_like_them_and_are_not_guessed():
    seen = perceive([picture(TABLE)], names=["red cup", "carton=blue", "ball", "green bottle"])
    assert set(seen.scene.names) == {"red cup", "carton", "ball", "table"}
    assert off(seen.scene["carton"], BOX)[0] < 0.01
    assert [each.split(":")[0] for each in seen.missing] == ["green bottle"]


def test_alike_things_are_numbered_and_an_ambiguous_name_is_refused():
    two = [Thing("box", (0.0, y, 0.04), (0.08, 0.08, 0.08), colour="red") for y in (-0.15, 0.15)]
    seen = perceive([picture(two)], names=["box"])
    assert seen.scene.names == ("red box", "red box 2", "table")
    assert len(seen.missing) == 1 and "any of" in seen.missing[0]


def test_without_colours_things_are_called_by_their_shape():
    view = picture([BALL])
    (seen,) = perceive([View(view.depth, view.intrinsics, view.pose)]).things
    assert seen.name == "ball" and "colour" not in seen.extra


def test_without_a_support_shapes_are_fitted_in_space():
    box = Thing("box", (0.0, 0.0, 0.1), (0.12, 0.16, 0.1), turn=tilted("x", 35))
    seen = perceive([picture([box], table=False, noise=0.001)])
    (item,) = seen.scene
    assert seen.support is None and "no level support" in seen.notes[0]
    assert off(item, box)[0] < 0.01 and off(item, box)[1] < 0.02


def test_what_nothing_explains_gets_the_box_around_it():
    parts = [Thing("box", (0.0, y, 0.15), (0.05, 0.05, 0.3)) for y in (-0.12, 0.12)]
    parts.append(Thing("box", (0.0, 0.0, 0.03), (0.05, 0.24, 0.06)))
    seen = perceive([picture(parts, noise=0.001)])
    (item,) = seen.things
    assert item.extra["shape"] == "irregular" and "no box, cylinder or ball" in " ".join(seen.notes)
    assert item.size == pytest.approx([0.05, 0.29, 0.3], abs=0.06)


def test_what_is_seen_in_part_is_said():
    cut = picture([Thing("box", (0.0, 0.42, 0.05), (0.12, 0.2, 0.1))])
    assert "cut off by the edge" in " ".join(perceive([cut]).notes)


def test_a_wall_and_what_stands_beside_the_table_are_left_out():
    wall = Thing("box", (1.6, 0.0, 0.5), (0.02, 6.0, 3.0), colour="green")
    seen = perceive([picture([CUP, wall], target=(0.2, 0.0, 0.1))])
    assert [item.name for item in seen.things] == ["red cylinder"]
    assert any("left out" in note for note in seen.notes)


def test_a_detector_names_things_by_box_or_mask_and_too_few_pixels_are_refused_by_name():
    view = picture(TABLE)
    column, row = view.project(np.array([CUP.position]))[0]

    class Fake:
        name = "fake"

        def find(self, view, names, text):
            near = np.zeros(view.shape, dtype=bool)
            near[:5, :5] = True
            return (
                Found("mug", box=(column - 14, row - 16, column + 14, row + 16)),
                Found("fly", mask=near),
            )

    seen = perceive([view], detector=Fake())
    assert [item.name for item in seen.things] == ["mug"]
    assert off(seen.scene["mug"], CUP)[0] < 0.006
    assert seen.refused[0].startswith("fly: ")


def test_the_same_pictures_give_the_same_scene():
    views = [picture(TABLE, noise=0.003)]
    assert perceive(views).scene == perceive(views).scene


@pytest.mark.parametrize("plane, says", [("level", "auto, none"), (float("nan"), "not a height")])
def test_a_plane_that_cannot_be_is_refused(plane, says):
    with pytest.raises(SceneError, match=says):
        perceive([picture([CUP])], plane=plane)


def test_no_view_is_refused():
    with pytest.raises(SceneError, match="no view"):
        perceive([])


def test_the_height_of_the_support_can_be_given():
    seen = perceive([picture([CUP])], plane=0.0)
    assert off(seen.scene["red cylinder"], CUP)[0] < 0.004


@pytest.mark.parametrize("frame, turn", [("rfu", [[0, -1, 0], [1, 0, 0], [0, 0, 1]]), ("ned", np.diag([1, -1, -1]))])
def test_any_frame_of_the_world_will_do(frame, turn):
    view, move = picture([CUP, BOX]), np.eye(4)
    move[:3, :3] = turn
    seen = perceive([View(view.depth, view.intrinsics, move @ view.pose, view.rgb)], frame=frame).scene
    assert seen.frame.name == frame
    for name, thing in (("red cylinder", CUP), ("blue box", BOX)):
        assert np.linalg.norm(seen[name].position - turn @ np.array(thing.position)) < 0.004
        assert np.sort(seen[name].size) == pytest.approx(np.sort(thing.size), abs=0.006)


def test_a_colour_that_is_a_fruit_as_well_is_a_colour_behind_the_sign():
    assert Wanted.parse("carton=orange") == Wanted("carton", ("orange",), ())
    assert Wanted.parse("orange") == Wanted("orange", (), ("sphere",))


@pytest.mark.parametrize("edge", [62, 66, 70])
def test_what_a_picture_without_depth_at_its_side_cuts_is_cut(edge):
    """As --crop leaves it, and as stereo cameras do at their left side."""
    view = picture(TABLE, noise=0.002)
    column, row = view.project(np.array([CUP.position]))[0].astype(int)
    depth = view.depth.copy()
    depth[:, :column], depth[: row - 40], depth[row + 40 :], depth[:, column + edge :] = (np.nan,) * 4
    scene = perceive([View(depth, view.intrinsics, view.pose, view.rgb)]).scene
    assert scene["red cylinder"].extra["cut"] and scene["table"].extra["cut"]


def test_a_leaning_sheet_is_not_made_of_two_things_that_touch():
    pair = [Thing("box", (0, 0, 0.02), (0.06, 0.06, 0.04)), Thing("box", (0.061, 0, 0.03), (0.06, 0.06, 0.06))]
    view = picture(pair, eye=(-0.7, 0.0, 0.51), size=(640, 480))
    depth = benchmark.spoiled(view.depth, np.random.default_rng(1))
    (seen,) = perceive([View(depth, view.intrinsics, view.pose, view.rgb)]).things
    assert seen.extra["shape"] == "irregular" and np.abs(seen.position - (0.03, 0.0, 0.03)).max() < 0.008


def test_a_post_that_another_thing_hides_in_part_is_no_disc_on_its_edge():
    pillar = Thing("cylinder", (0.2, -0.9, 0.5), (0.36, 0.36, 1.0))
    post = Thing("box", (1.4, -1.0, 0.45), (0.06, 0.06, 0.9), colour="blue")
    eyes, look = ((-2.8, -0.3, 1.7), (0.4, 2.9, 1.9)), {"target": (0.3, 0.0, 0.1), "size": (640, 480)}
    things = perceive([picture([pillar, post], eye, noise=0.0025, seed=1, **look) for eye in eyes]).things
    (seen,) = (item for item in things if item.extra["colour"] == "blue")
    assert len(things) == 2 and seen.size[:2].max() < 0.25


@pytest.mark.parametrize("pixels", [(slice(60, 61), slice(None)), (slice(60, 61), slice(80, 81))], ids=["row", "pixel"])
def test_a_picture_with_hardly_any_depth_shows_nothing(pixels):
    view = picture(TABLE)
    depth = np.full(view.shape, np.nan)
    depth[pixels] = view.depth[pixels]
    assert not perceive([View(depth, view.intrinsics, view.pose)]).things


def test_what_is_no_ball_is_not_called_one_beside_a_ball():
    looks = [Look("green", "irregular"), Look("yellow", "sphere"), Look("red", "cylinder")]
    assert assign(["ball"], looks) == ({1: "ball"}, ())
    assert assign(["ball"], looks[::2]) == ({0: "ball"}, ())


def test_a_name_that_is_given_twice_is_said():
    given, left = assign(["red cup", "red cup"], [Look("red", "cylinder")])
    assert not given and all("another name fits red cylinder as well" in one for one in left)
