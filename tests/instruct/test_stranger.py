"""What strangers' walks found: bounds that exclude each other, things not to touch, places before things, heights."""

import numpy as np
import pytest

from ovita import Scene, SceneObject, Trajectory, adapt
from ovita.dialogue.session import Session
from ovita.instruct.notation import show
from ovita.paths.scene import Frame
from ovita.paths.trajectory import interpolate

N = 60


def path(corners, speed):
    corners = np.asarray(corners, dtype=float)
    s = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))]
    rows = np.column_stack([np.interp(np.linspace(0, s[-1], N), s, corners[:, k]) for k in range(3)])
    return Trajectory.from_array(np.column_stack([rows, np.full(N, speed)]))


TABLE = (
    path([[-0.4, -0.3, 0.3], [0, 0, 0.35], [0.4, 0.3, 0.3]], 0.2),
    Scene(
        (
            SceneObject("kettle", [0.05, 0.22, 0.12], [0.14, 0.14, 0.24]),
            SceneObject("plate", [-0.15, -0.05, 0.01], [0.24, 0.24, 0.02]),
            SceneObject("cup", [0.2, 0, 0.05], [0.08, 0.08, 0.1]),
            SceneObject("bowl", [0.25, 0.32, 0.04], [0.16, 0.16, 0.08]),
        )
    ),
    None,
)
YARD = (
    path([[-2.9, 0, 0], [-1, 0.2, 0], [1, -0.2, 0], [2.9, 0, 0]], 0.6),
    Scene(
        (
            SceneObject("dog", [-0.1, 0.9, 0.3], [0.7, 0.3, 0.6]),
            SceneObject("shelf", [2.6, 1.5, 0.8], [0.5, 1.2, 1.6]),
            SceneObject("bin", [1.4, -1.0, 0.4], [0.5, 0.5, 0.8]),
        ),
        Frame("flu"),
    ),
    "rover",
)
HALL = (
    path([[-2.9, 0, 1.2], [-1, 0.6, 1.5], [1, 0.2, 1.2], [2.9, 1, 1.2]], 0.8),
    Scene(
        (
            SceneObject("sofa", [-0.1, 1.6, 0.4], [1.8, 0.8, 0.8]),
            SceneObject("child", [1.1, -1.2, 0.55], [0.4, 0.4, 1.1]),
            SceneObject("lamp", [-1.3, -0.6, 1.6], [0.3, 0.3, 0.4]),
            SceneObject("box", [1.9, -0.3, 0.3], [0.6, 0.6, 0.6]),
        ),
        Frame("flu"),
    ),
    "drone",
)


def said(sentence, where=TABLE):
    trajectory, scene, robot = where
    return adapt(trajectory, sentence, scene=scene, robot=robot, writer="builtin")


def understood(sentence, where=TABLE):
    """The reading, whether it is done at once or waits for a yes, with its path."""
    result = said(sentence, where)
    return result.proposal or result


def dense(trajectory):
    """The path at 30 places a segment."""
    return interpolate(trajectory.positions, np.linspace(0, len(trajectory) - 1, 30 * (len(trajectory) - 1) + 1))


def gap(trajectory, item):
    """The least distance to an upright box, by code of its own."""
    beyond = np.abs(dense(trajectory) - item.position) - np.asarray(item.dimensions) / 2
    return float(np.linalg.norm(np.maximum(beyond, 0.0), axis=1).min())


@pytest.mark.parametrize(
    ("sentence", "where"),
    [
        ("speed above 0.5 and below 0.2", HALL),
        ("keep the speed above 0.9 but below 0.4", HALL),
        ("speed over 0.3, under 0.1", TABLE),
        ("keep your speed higher than 1 m/s and lower than 0.5 m/s", HALL),
        ("go faster than 0.9 m/s but slower than 0.5 m/s", HALL),
        ("stay lower than 0.8 and stay above 1.2", HALL),
        ("fly lower than 0.8 m and higher than 1.2 m", HALL),
        ("stay higher than 1.4, but lower than 1.0", HALL),
    ],
)
def test_bounds_that_exclude_each_other_are_never_done(sentence, where):
    result = said(sentence, where)
    assert not result.usable and (result.proposal is not None or result.message)


@pytest.mark.parametrize(
    ("sentence", "frames"),
    [
        ("speed above 0.1 and below 0.2", "pace at_least=0.1m/s; pace at_most=0.2m/s"),
        ("stay lower than 0.8", "height at_most=0.8m"),
        ("fly higher than 1.2 m", "height at_least=1.2m"),
        ("stay over 1 m from the child", "clearance child at_least=1m"),
        ("keep over half a metre away from the child", "clearance child at_least=0.5m"),
    ],
)
def test_bounds_by_comparison_are_bounds(sentence, frames):
    assert show(understood(sentence, HALL).frames).replace("0.8;", "0.8m;") in (
        frames, frames.replace("m/s", ""), frames.replace("0.8m", "0.8")
    )  # fmt: skip


@pytest.mark.parametrize(
    ("before", "sentence"),
    [
        ("slow down near the cup", "not quite that slow near the cup"),
        ("slow down near the cup", "not that slow near the cup"),
        ("slow down near the cup", "it need not be that slow near the cup"),
    ],
)
def test_not_that_slow_is_less_slow(before, sentence):
    trajectory, scene, _ = TABLE
    session = Session(trajectory, scene, writer="builtin")
    slow = session.say(before).adapted.speeds.min()
    result = session.say(sentence)
    assert slow < (result.proposal or result).adapted.speeds.min() <= 0.2


@pytest.mark.parametrize(
    ("sentence", "name", "where", "shift"),
    [
        ("go left by 0.2 and do not touch the kettle", "kettle", TABLE, [-0.2, 0, 0]),
        ("go up 5 cm without touching the kettle", "kettle", TABLE, [0, 0, 0.05]),
        ("move right by 0.1 without hitting the cup", "cup", TABLE, [0.1, 0, 0]),
        ("move 3 cm forward, taking care not to touch the bowl", "bowl", TABLE, [0, 0.03, 0]),
        ("go left by 0.4 and don't bump into the dog", "dog", YARD, [0, 0.4, 0]),
        ("fly lower by 0.3 and make sure not to hit the sofa", "sofa", HALL, [0, 0, -0.3]),
        ("climb half a metre without brushing the lamp", "lamp", HALL, [0, 0, 0.5]),
    ],
)
def test_what_is_not_to_be_touched_is_passed_clear_of_and_the_other_wish_is_kept(sentence, name, where, shift):
    result = understood(sentence, where)
    assert any(f.NAME == "clearance" and f.objects == (name,) for f in result.frames), show(result.frames)
    moved = result.adapted.positions - result.original.positions
    assert np.median(moved, axis=0) == pytest.approx(shift, abs=0.02)
    assert gap(result.adapted, where[1][name]) > 0.04


def test_not_touching_a_thing_that_is_in_the_way_bends_the_path_around_it():
    result = understood("go down by 0.2 and do not touch the plate")
    assert gap(result.adapted, TABLE[1]["plate"]) >= 0.049
    result = understood("move forward by 20 cm, but mind the kettle")
    assert gap(result.adapted, TABLE[1]["kettle"]) >= 0.049


@pytest.mark.parametrize(
    ("sentence", "name", "distance", "where"),
    [
        ("stop half a metre before the dog", "dog", 0.5, YARD),
        ("halt 60 cm in front of the shelf", "shelf", 0.6, YARD),
        ("end 60 cm short of the child", "child", 0.6, HALL),
        ("stop 0.4 m before the box", "box", 0.4, HALL),
        ("stop 10 cm before the bowl", "bowl", 0.1, TABLE),
        ("stop 15 cm from the kettle", "kettle", 0.15, TABLE),
    ],
)
def test_a_stop_before_a_thing_is_so_far_from_its_surface(sentence, name, distance, where):
    result = understood(sentence, where)
    item = where[1][name]
    beyond = np.maximum(np.abs(result.adapted.positions[-1] - item.position) - np.asarray(item.dimensions) / 2, 0)
    assert np.linalg.norm(beyond) == pytest.approx(distance, abs=0.01)
    assert gap(result.adapted, item) == pytest.approx(distance, abs=0.01)
    assert result.adapted.speeds[-1] == 0


def test_a_path_that_starts_nearer_than_the_stop_asks():
    assert said("stop 3 m before the dog", YARD).status == "needs_clarification"


@pytest.mark.parametrize(
    ("sentence", "to", "off", "where"),
    [
        ("get to the shelf without going near the dog", "shelf", "dog", YARD),
        ("reach the shelf while staying away from the dog", "shelf", "dog", YARD),
        ("fly to the box but do not go near the child", "box", "child", HALL),
    ],
)
def test_where_to_go_and_what_to_keep_away_from_are_told_apart(sentence, to, off, where):
    frames = understood(sentence, where).frames
    assert [f.NAME for f in frames] == ["end", "closer"]
    assert frames[0].place == to and frames[1].objects == (off,) and frames[1].sense == "farther"


@pytest.mark.parametrize(("sentence", "name"), [("skim over the plate", "plate"), ("skim over the bowl", "bowl")])
def test_skimming_is_a_low_pass_over_it_and_no_jump(sentence, name):
    result = understood(sentence)
    item = TABLE[1][name]
    fine = dense(result.adapted)
    over = fine[np.linalg.norm(fine[:, :2] - item.position[:2], axis=1).argmin()]
    assert 0.04 < over[2] - item.position[2] - item.dimensions[2] / 2 < 0.08
    assert not any("jump" in warning for warning in result.warnings)


@pytest.mark.parametrize(
    ("sentence", "height", "where"),
    [
        ("fly at the height of the sofa", 0.4, HALL),
        ("stay level with the lamp", 1.6, HALL),
        ("go as high as the box", 0.3, HALL),
        ("move at the same height as the kettle", 0.12, TABLE),
    ],
)
def test_the_height_of_a_thing_is_that_of_its_centre_and_said(sentence, height, where):
    result = understood(sentence, where)
    assert np.median(result.adapted.positions[:, 2]) == pytest.approx(height, abs=0.01)
    assert any("that of its centre" in assumption for assumption in result.assumptions)


def test_an_end_at_the_height_of_a_thing_goes_up_or_down_only():
    result = understood("end at the height of the sofa", HALL)
    moved = result.adapted.positions[-1] - result.original.positions[-1]
    assert moved == pytest.approx([0, 0, -0.8], abs=0.02)


def test_a_height_with_a_number_is_still_a_number():
    assert show(understood("the goal should be at a height of 0.5 m").frames) == "end goal level=0.5m"


@pytest.mark.parametrize(
    ("sentence", "by"),
    [
        ("back up 30 cm at the end", 0.3),
        ("reverse by 40 cm after reaching the goal", 0.4),
        ("at the end back up by half a metre", 0.5),
    ],
)
def test_backing_up_at_the_end_is_back_along_the_path(sentence, by):
    result = understood(sentence, YARD)
    old, new = result.original.positions, result.adapted.positions
    assert result.adapted.length == pytest.approx(result.original.length + by, abs=0.02)
    assert np.linalg.norm(new[-1] - old[-1]) == pytest.approx(by, abs=0.02) and new[-1, 0] < old[-1, 0]
    assert np.linalg.norm(dense(result.original) - new[-1], axis=1).min() < 0.01
    assert result.adapted.speeds[len(old) - 1] == 0


@pytest.mark.parametrize(
    ("sentence", "name", "where"),
    [
        ("go left of the bowl, not right of it", "bowl", TABLE),
        ("pass left of the dog, not right", "dog", YARD),
        ("pass the cup on the left, not on the right", "cup", TABLE),
        ("pass the kettle on the left, never on the right", "kettle", TABLE),
    ],
)
def test_a_side_and_not_the_other_leaves_the_ends_where_they_are(sentence, name, where):
    result = understood(sentence, where)
    assert show(result.frames) == f"side {name} left"
    ends = result.adapted.positions[[0, -1]] - result.original.positions[[0, -1]]
    assert np.abs(ends).max() < 0.02


@pytest.mark.parametrize(
    ("sentence", "frames"),
    [
        ("give the kettle ten more centimetres of room", "farther kettle by=0.1m"),
        ("leave 3 extra cm of space around the cup", "farther cup by=3cm"),
        ("give the cup another 5 cm of room", "farther cup by=5cm"),
        ("raise it by three extra centimetres", "move up=0.03m"),
        ("stay 10 more cm away from the bowl", "farther bowl by=10cm"),
    ],
)
def test_so_many_more_centimetres_are_centimetres(sentence, frames):
    assert show(understood(sentence).frames) == frames


def test_a_bare_number_far_beyond_the_path_is_asked_about():
    assert said("left 40, kettle off 40").status != "done"


@pytest.mark.parametrize("verb", ["bend", "curve"])
def test_a_part_that_is_bent_to_a_side_is_all_of_it(verb):
    result = understood(f"{verb} the second half to the right by 10 cm")
    moved = (result.adapted.positions - result.original.positions)[:, 0]
    assert np.median(moved[N // 2 + 5 : -3]) == pytest.approx(0.1, abs=0.01)


def test_everything_but_the_goal_leaves_the_goal_alone():
    result = understood("move everything except the goal 4 cm up")
    moved = (result.adapted.positions - result.original.positions)[:, 2]
    assert moved[-1] == pytest.approx(0, abs=1e-9) and moved[: N // 2] == pytest.approx(0.04, abs=1e-6)
    assert max(result.adapted.positions[:, 2].tolist()) < 0.4 and not any("jump" in w for w in result.warnings)


def test_a_place_that_is_left_out_is_not_kept_away_from():
    assert show(understood("slow down, just not near the plate").frames) == "pace slower @!near=plate"


@pytest.mark.parametrize(
    ("sentence", "least", "most", "where"),
    [
        ("never higher than the kettle", -1, 0.24, TABLE),
        ("stay at least as high as the kettle", 0.24, 9, TABLE),
        ("don't fly lower than the sofa", 0.8, 9, HALL),
        ("fly 30 cm lower than the lamp", 1.1, 1.1, HALL),
    ],
)
def test_bounds_and_heights_by_a_thing_count_from_its_top_or_bottom(sentence, least, most, where):
    height = dense(understood(sentence, where).adapted)[:, 2]
    assert height.min() >= least - 0.01 and height.max() <= most + 0.01


def test_clear_by_a_distance_is_a_distance_to_keep():
    assert show(understood("stay clear of the lamp by 50 cm", HALL).frames) == "clearance lamp at_least=50cm"


@pytest.mark.parametrize(
    "sentence",
    ["don't stop at the bin", "at the bin please not pause, and faster at the hedge", "past the bin without lingering"],
)
def test_a_stop_that_is_denied_is_never_done(sentence):
    result = said(sentence, YARD)
    plan = (result.proposal or result).plan
    assert plan and not any(word in " ".join(plan).lower().replace("no stop", "") for word in ("wait", "stop", "hover"))


def test_farther_from_a_person_on_a_ramp_does_not_go_under_the_ground():
    scene = Scene((SceneObject("person", [2.5, -1, 0.9], [0.5, 0.4, 1.8]),))
    result = adapt(
        path([[0, 0, 0], [2, 0, 0], [3, 0, 0.4], [6, 0, 0.4]], 0.5), "stay farther from the person", scene=scene
    )
    where = result.adapted.positions
    assert where[:, 2].min() >= 0.0 and where[:, 1].max() > 0.2


def test_to_hover_at_what_hangs_on_a_wall_is_to_wait_where_the_path_passes_it():
    wall, crack = SceneObject("wall", [3, 1.6, 2], [6, 0.4, 4]), SceneObject("crack", [3, 1.4, 2], [0.2, 0.02, 0.3])
    trajectory = path([[0, 0, 2], [6, 0, 2]], 0.5)
    result = adapt(trajectory, "hover at the crack for 3 seconds", scene=Scene((wall, crack)))
    assert result.status == "done" and np.abs(result.adapted.positions[:, 1]).max() < 1e-6
    assert np.allclose(result.adapted.positions[result.adapted.dwells], [3, 0, 2], atol=0.06)
