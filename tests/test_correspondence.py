"""Which waypoint came from which: one answer for promises, verdicts and reports."""

import numpy as np
import pytest

from ovita import toolkit as tk
from ovita.measure import compare
from ovita.measure.predicates import Pair
from ovita.paths.correspondence import correspond
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory
from ovita.toolkit.catalogue import Expectation
from ovita.toolkit.judging import judge

T = np.linspace(0, 1, 60)
PATH = np.column_stack([T, 0.2 * np.sin(4 * T), 0.1 + 0.05 * np.cos(6 * T), np.full(60, 0.3)])
RAISED = PATH + np.where(np.arange(60) < 20, 0.2, 0.0)[:, None] * [0, 0, 1, 0]
RING = 0.1 * np.column_stack([np.sin(T * 2 * np.pi), np.cos(T * 2 * np.pi) - 1, 0 * T, 0 * T])[1:-1:4]


def waiting(rows, at, steps):
    rows = np.insert(rows, [at + 1] * steps, rows[at], axis=0)
    rows[at : at + steps + 1, 3] = 0
    return rows


def looped(rows, *at):
    for i in sorted(at, reverse=True):
        rows = np.insert(rows, [i + 1] * len(RING), rows[i] + RING, axis=0)
    return rows


@pytest.mark.parametrize(
    ("adapted", "method", "moved", "removed", "added"),
    [
        (PATH[10:], "kept waypoints", 0.0, ((0, 9),), ()),
        (PATH[5:50], "kept waypoints", 0.0, ((0, 4), (50, 59)), ()),
        (tk.extend(RAISED, 0.3), "kept waypoints", 0.2, (), "after"),
        (tk.spiral(PATH, "goal", radius=0.1), "kept waypoints", 0.0, (), "after"),
        (looped(PATH, 9, 39), "kept waypoints", 0.0, (), "loops"),
        (waiting(PATH, 20, 30), "index without dwells", 0.0, (), ()),
        (waiting(RAISED, 20, 30), "index without dwells", 0.2, (), ()),
        (PATH[::2], "kept waypoints", 0.0, ((59, 59),), ()),
        (np.insert(PATH, range(1, 60), (PATH[1:] + PATH[:-1]) / 2, axis=0), "kept waypoints", 0.0, (), ()),
        (tk.resample(PATH, 41), "arc length", 0.0, (), ()),
        (tk.resample(PATH + np.array([0, 0, 0.1, 0]), 83), "arc length", 0.1, (), ()),
        (tk.resample(RAISED, 77), "arc length", 0.2, (), ()),
        (RAISED, "index", 0.2, (), ()),
    ],
)
def test_what_belongs_together(adapted, method, moved, removed, added):
    found = correspond(PATH, adapted)
    assert found.method == method
    assert found.forward.shape == (60,) and found.backward.shape == (len(adapted),)
    for shift in (
        found.of_original(adapted)[found.kept, :3] - PATH[found.kept, :3],
        adapted[found.old, :3] - found.of_adapted(PATH)[found.old, :3],
    ):
        assert np.linalg.norm(shift, axis=1).max() == pytest.approx(moved, abs=0.006)
    assert found.removed == removed
    k = len(RING)
    there = {"after": ((60, len(adapted) - 1),), "loops": ((10, 9 + k), (40 + k, 39 + 2 * k))}
    assert found.added == (there[added] if added else ())


def test_a_path_without_length_is_matched_somehow():
    found = correspond(PATH, PATH[:1].repeat(2, axis=0))
    assert found.forward.shape == (60,) and found.backward.shape == (2,)


def test_both_directions_agree_where_both_are_known():
    found = correspond(PATH, waiting(tk.extend(RAISED, 0.3), 20, 7))
    there = found.forward[found.kept]
    assert np.interp(there, np.flatnonzero(found.old), found.backward[found.old]) == pytest.approx(
        np.flatnonzero(found.kept)
    )


def test_a_place_behind_a_wait_lies_behind_all_of_it():
    found = correspond(PATH, waiting(PATH, 20, 30))
    assert found.forward[[19, 20, 21]].tolist() == [19, 20, 51] and (found.backward[20:51] == 20).all()


@pytest.mark.parametrize(
    ("adapted", "moved"), [(PATH[10:], 0.0), (tk.extend(RAISED, 0.3), 0.2), (tk.spiral(PATH, "goal", radius=0.1), 0.0)]
)
def test_promises_verdicts_and_report_agree_on_how_far_the_path_moved(adapted, moved):
    scene = Scene()
    original, changed = Trajectory.from_array(PATH), Trajectory.from_array(adapted)
    assert compare(original, changed, scene).displacement.max == pytest.approx(moved, abs=1e-9)
    pair = Pair(PATH, adapted, scene)
    assert np.linalg.norm(pair.shift[pair.found], axis=1).max() == pytest.approx(moved, abs=1e-9)
    first = {"count": 60, "ranges": [[0, 19]]}
    outcome = judge(Expectation("moved", {"offset": {"up": moved}, "where": first}, ""), PATH, adapted, scene)
    assert outcome.held and outcome.change == (pytest.approx(moved) if moved else None)


def test_a_straight_path_moved_along_itself_and_extended_has_moved():
    line = np.column_stack([np.arange(21) / 20, np.zeros(21), np.zeros(21)])
    longer = np.column_stack([np.arange(27) / 20, np.zeros(27), np.zeros(27)])
    found = correspond(line, longer - [0.2, 0, 0])
    assert found.forward.tolist() == [*range(21)] and found.added == ((21, 26),)
    assert correspond(line, line[3:18]).removed == ((0, 2), (18, 20))


def test_masks_travel_both_ways():
    adapted = waiting(PATH[10:], 20, 5)
    found = correspond(PATH, adapted)
    mask = np.arange(60) >= 30
    assert found.carried(mask).sum() == 35 and (found.carried_back(found.carried(mask)) == mask).all()
