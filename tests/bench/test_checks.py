"""Each kind of check passes a right adaptation and fails wrong ones: nothing done, the opposite, the wrong object."""

import json

import numpy as np
import pytest
from check_table import COMBINED, KEEPING, ROWS, SCENE, TABLE, ring
from handmade import line, pace, pull, shift, wait
from hypothesis import given, settings
from hypothesis import strategies as st

from ovita import toolkit as tk
from ovita.errors import UnknownObject
from ovita.measure import predicates as ck
from ovita.measure.predicates import asked
from ovita.paths.correspondence import correspond
from ovita.paths.scene import Frame, Scene, SceneObject
from ovita.paths.trajectory import Trajectory

EVERY = TABLE + KEEPING + COMBINED


def judged(check, edit, rows=ROWS, scene=SCENE):
    return check.judge(Trajectory.from_array(rows), Trajectory.from_array(edit(rows, scene)), scene)


def unchanged(rows, scene):
    return rows


def name(entry):
    check, _, _ = entry
    return check.kind


@pytest.mark.parametrize("entry", EVERY, ids=name)
def test_right_passes_and_wrong_fails(entry):
    check, right, wrong = entry
    verdict = judged(check, right)
    assert verdict.passed, verdict.sentence
    for what, edit in wrong.items():
        verdict = judged(check, edit)
        assert not verdict.passed, f"{what}: {verdict.sentence}"
        assert verdict.sentence.startswith("Please ")


@pytest.mark.parametrize("entry", TABLE + COMBINED, ids=name)
def test_doing_nothing_fails(entry):
    assert not judged(entry[0], unchanged).passed


@pytest.mark.parametrize("entry", KEEPING, ids=name)
def test_doing_nothing_passes_what_asks_to_keep_something(entry):
    assert judged(entry[0], unchanged).passed


def test_every_kind_is_in_a_table():
    used = {check.kind for check, _, _ in EVERY} | {"not_"}
    assert used == set(ck.kinds()) - set(vars(asked))  # those are in tests/bench/test_expected.py


def test_not_passes_what_the_other_fails():
    check = ck.not_(ck.closer("cup"))
    assert judged(check, pull("cup", 0.1, -1)).passed
    assert not judged(check, pull("cup", 0.1)).passed


@pytest.mark.parametrize("entry", EVERY, ids=name)
def test_a_check_survives_json(entry):
    check = entry[0]
    again = ck.Check.from_dict(json.loads(json.dumps(check.to_dict())))
    assert again == check and hash(again) == hash(check)


@pytest.mark.parametrize("count", [37, 50, 83, 200])
@pytest.mark.parametrize(
    "entry",
    [
        e
        for e in TABLE
        if e[0].kind in ("moved", "closer", "farther", "min_distance", "passes_through", "slower", "faster")
    ],
    ids=name,
)
def test_the_number_of_waypoints_does_not_matter(entry, count):
    check, right, wrong = entry
    verdict = judged(check, lambda rows, scene: tk.resample(right(rows, scene), count))
    assert verdict.passed, verdict.sentence
    for edit in wrong.values():
        assert not judged(check, lambda rows, scene, edit=edit: tk.resample(edit(rows, scene), count)).passed


@pytest.mark.parametrize(
    "entry", [e for e in TABLE if e[0].kind in ("moved", "closer", "slower", "goal_moved")], ids=name
)
def test_a_wait_changes_no_other_verdict(entry):
    check, right, wrong = entry
    assert judged(check, lambda rows, scene: wait("lamp", 12)(right(rows, scene), scene)).passed
    for edit in wrong.values():
        assert not judged(check, lambda rows, scene, edit=edit: wait("lamp", 12)(edit(rows, scene), scene)).passed


def test_an_extension_leaves_the_rest_matched():
    check = ck.all_of(ck.moved(left=0.2), ck.goal_moved("up", only=False))
    assert judged(check, lambda r, s: line((0, 0, 0.3))(shift("left", metres=0.2)(r, s), s)).passed


def test_a_loop_in_the_middle_leaves_the_rest_matched():
    source = correspond(ROWS, ring(1)(ROWS, SCENE)).forward
    assert np.isfinite(source).all() and source[0] == 0 and source[-1] == len(ring(1)(ROWS, SCENE)) - 1
    assert np.allclose(ring(1)(ROWS, SCENE)[source.astype(int)], ROWS)


def test_a_path_pushed_out_of_an_object_is_the_same_path():
    scene = Scene((SceneObject("ball", ROWS[20, :3]),))
    moved = tk.keep_distance(ROWS, scene["ball"].position, at_least=0.05)
    assert judged(ck.same_path(), lambda r, s: moved, scene=scene).passed
    assert not judged(ck.same_path(), lambda r, s: tk.keep_distance(r, ROWS[20, :3], at_least=0.15), scene=scene).passed


def test_directions_follow_the_scene_frame():
    scene = Scene(SCENE.objects, Frame("flu"))
    assert judged(ck.moved(left=0.2), shift("front", metres=0.2), scene=scene).passed
    assert not judged(ck.moved(left=0.2), shift("left", metres=0.2), scene=scene).passed


def test_what_is_near_may_be_judged_after_the_path_moved():
    check = ck.faster(where=ck.near("lamp", 0.25))
    assert judged(check, lambda r, s: pace(1.5, "lamp", 0.25)(pull("lamp", 0.2)(r, s), s)).passed


@given(amount=st.floats(0.05, 0.5), word=st.sampled_from(["left", "right", "front", "back", "up", "down"]))
@settings(max_examples=20, deadline=None)
def test_any_stated_shift_is_told_from_others(amount, word):
    check = ck.moved(**{word: amount})
    assert judged(check, shift(word, metres=amount)).passed
    assert not judged(check, shift(word, metres=-amount)).passed
    assert not judged(check, shift(word, metres=1.5 * amount)).passed
    assert not judged(check, shift(word, metres=0.5 * amount)).passed


@given(factor=st.floats(0.2, 0.9), scale=st.floats(0.1, 100.0))
@settings(max_examples=20, deadline=None)
def test_speeds_are_judged_in_any_unit(factor, scale):
    rows = ROWS * [1, 1, 1, scale]
    assert judged(ck.slower(factor=factor), pace(factor), rows).passed
    assert not judged(ck.slower(factor=factor), pace(1 / factor), rows).passed


@given(scale=st.floats(0.2, 20.0), sign=st.sampled_from([1.0, -1.0]))
@settings(max_examples=20, deadline=None)
def test_distances_are_judged_at_any_scale(scale, sign):
    rows = ROWS * [scale, scale, scale, 1]
    scene = Scene(tuple(SceneObject(item.name, item.position * scale) for item in SCENE))
    edit = pull("cup", 0.08, sign)
    assert judged(ck.closer("cup"), edit, rows, scene).passed == (sign > 0)
    assert judged(ck.farther("cup"), edit, rows, scene).passed == (sign < 0)


@pytest.mark.parametrize(
    "make",
    [
        lambda: ck.Check("teleported"),
        lambda: ck.Check("closer", {"target": "cup"}),
        lambda: ck.Check("closer", {}),
        lambda: ck.Check("closer", {"place": SCENE["cup"]}),
        lambda: ck.Check("closer", {"place": "cup"}, (ck.slower(),)),
        lambda: ck.Check("all_of"),
        lambda: ck.Check("not_", {}, (ck.slower(), ck.faster())),
        lambda: ck.Check.from_dict({"arguments": {}}),
        lambda: ck.Check.from_dict({"kind": "slower", "args": {}}),
        lambda: ck.moved("left", sideways=1.0),
    ],
)
def test_a_malformed_check_is_refused(make):
    with pytest.raises(ValueError):
        make()


def test_an_unknown_object_is_an_error_that_names_those_there_are():
    with pytest.raises(UnknownObject, match="cup"):
        judged(ck.closer("teapot"), unchanged)


def test_a_failure_reads_as_feedback_with_numbers():
    sentence = judged(ck.closer("cup"), pull("cup", 0.08, -1)).sentence
    assert sentence.startswith("Please come closer to the cup: the nearest distance to the cup went from 0.2")
    both = judged(ck.all_of(ck.moved(left=0.2), ck.slower()), unchanged).sentence
    assert both.count("Please") == 2


ODD = {
    "two waypoints": ROWS[[0, -1]],
    "two equal waypoints": ROWS[[3, 3]],
    "standing still": np.tile(ROWS[5], (30, 1)),
    "at rest": ROWS * [1, 1, 1, 0],
    "straight": np.column_stack([np.linspace(ROWS[0, :3], ROWS[-1, :3], 20), np.ones(20)]),
    "vertical": np.column_stack([np.zeros((20, 2)), np.linspace(0, 1, 20), np.ones(20)]),
    "every waypoint twice": np.repeat(ROWS, 2, axis=0),
    "huge": ROWS * 1e6,
    "tiny": ROWS * 1e-6,
    "long": tk.resample(ROWS, 1500),
}


@pytest.mark.parametrize("entry", EVERY, ids=name)
def test_odd_trajectories_get_a_verdict(entry):
    for rows in ODD.values():
        for original, adapted in ((ROWS, rows), (rows, ROWS), (rows, rows)):
            verdict = judged(entry[0], lambda r, s, adapted=adapted: adapted, original)
            assert isinstance(verdict.passed, bool) and verdict.sentence.endswith(".")


@pytest.mark.parametrize("left", [0, 1])
def test_a_part_of_which_little_or_nothing_is_left_is_judged(left):
    where, rows = ck.last(10), ROWS[: len(ROWS) - 10 + left]
    near, scaled = ck.min_distance("cup", 0.01, where=where), asked.scaled(1.5, where=where, about="cup")
    verdicts = [judged(check, lambda *_: rows) for check in (near, asked.passes_at("cup", 0.01, where=where), scaled)]
    assert not verdicts[2].passed and all("nan" not in verdict.sentence for verdict in verdicts)
    assert left or "none of those waypoints is left" in verdicts[2].sentence


def test_a_path_that_came_no_closer_blames_no_object_that_is_not_there():
    alone = Scene((SCENE["cup"],), SCENE.frame)
    verdict = judged(ck.closer("cup"), pull("cup", 0.05, -1.0), scene=alone)
    assert not verdict.passed and "changed more" not in verdict.sentence
