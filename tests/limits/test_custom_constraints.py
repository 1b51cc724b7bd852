"""Constraints of the user's own, regions as data, and constraints that packages offer."""

from dataclasses import dataclass
from importlib.metadata import EntryPoint

import numpy as np
import pytest

from ovita.errors import ConstraintDefinitionError
from ovita.limits import ConstraintOptions, constrain
from ovita.limits.custom import Ball, Cylinder, KeepOut, Polytope, load, region
from ovita.limits.qp import Rows
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory

OPEN = Robot("open", None, max_speed=None)


def line(n=41):
    x = np.column_stack([np.linspace(-0.5, 0.5, n), np.zeros(n), np.linspace(0, 0.5, n)])
    return Trajectory(x, np.full(n, 0.5))


def solve(t, *custom, scene=None, **more):
    original = t.with_(positions=t.positions + 0.01)
    return constrain(t, scene or Scene(), OPEN, original=original, options=ConstraintOptions(custom=custom, **more))


@dataclass(frozen=True)
class BelowShelf:
    height: float
    name = "below the shelf"
    unit = "m"
    limit = "under the shelf"

    def margin(self, trajectory):
        return self.height - trajectory.positions[:, 2]

    def rows(self, path):
        n = len(path)
        return Rows(np.arange(n), np.tile([0.0, 0.0, -1.0], (n, 1)), np.full(n, -self.height))


@dataclass(frozen=True)
class Level:
    """The gripper's own z axis points up; moving the path cannot help."""

    name = "level gripper"
    unit = "rad"
    limit = "tilted by at most 0.2 rad"

    def margin(self, trajectory):
        if trajectory.orientations is None:
            return np.full(len(trajectory), 0.2)
        _, x, y, _ = trajectory.orientations.T
        return 0.2 - np.arccos(np.clip(1 - 2 * (x * x + y * y), -1, 1))

    def rows(self, path):
        return Rows.none()


def test_a_constraint_of_the_users_own():
    scene = Scene((SceneObject("cup", [0.0, 0.0, 0.25], [0.1, 0.1, 0.1]),))
    found = solve(line(), BelowShelf(0.3), scene=scene)
    assert found.verdict.status == "repaired"
    assert found.trajectory.positions[:, 2].max() <= 0.3 + 1e-6
    check = next(c for c in found.verdict.checks if c.name == "below the shelf")
    assert check.violation_before == pytest.approx(0.2)
    assert check.where_before == 40


def test_a_constraint_that_can_only_be_measured():
    assert solve(line(), Level()).verdict.status == "satisfied"
    q = np.tile([np.cos(0.3), np.sin(0.3), 0.0, 0.0], (41, 1))
    tilted = Trajectory(line().positions, line().speeds, q)
    found = solve(tilted, Level())
    assert found.verdict.status == "infeasible"
    assert "level gripper" in found.verdict.conflicts[0]
    assert np.array_equal(found.trajectory.positions, tilted.positions)


REGIONS = [
    Ball((0.1, 0.0, 0.2), 0.3),
    Cylinder((0.0, 0.0, 0.0), 0.25, (0.1, 0.0, 1.0)),
    Polytope(((1, 1, 0), (-1, 0, 0), (0, 0, 2.0)), (0.3, 0.4, 0.6)),
]


@pytest.mark.parametrize("where", REGIONS, ids=lambda r: r.name)
def test_regions_are_met_and_geometry_agrees(where):
    rng = np.random.default_rng(0)
    points = rng.uniform(-1, 1, (200, 3))
    inside = where.project(points)
    assert where.excess(inside).max() <= 1e-9
    kept = where.excess(points) <= 0
    assert inside[kept] == pytest.approx(points[kept], abs=1e-12)
    normals, offsets = where.cut(points)
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1.0)
    assert (inside @ normals.T >= offsets - 1e-9).all(), "every cut contains the whole region"
    assert where.margin(Trajectory(points, np.zeros(200))) == pytest.approx(-where.excess(points))
    for scene in (Scene(), Scene((SceneObject("cup", [0.05, 0.02, 0.25], [0.1, 0.1, 0.1]),))):
        found = solve(line(), where, scene=scene)
        assert found.verdict.status == "repaired", found.verdict.sentences()
        assert where.excess(found.trajectory.positions).max() <= 1e-6


def test_two_regions_at_once():
    found = solve(line(), Ball((0, 0, 0.2), 0.4), Polytope(((0, 0, 1),), (0.3,)))
    assert found.verdict.status == "repaired"


def test_keep_out():
    box = KeepOut((-0.1, -0.1, 0.1), (0.1, 0.2, 0.4), "the tank")
    found = solve(line(), box, fix_start=True, fix_goal=True)
    assert found.verdict.status == "repaired"
    assert box.margin(found.trajectory).min() >= -1e-6
    pinned = solve(line(), box, pinned=(20,))
    assert pinned.verdict.status == "infeasible"
    assert "'the tank'" in pinned.verdict.conflicts[0]


def test_regions_from_data():
    assert region({"kind": "cylinder", "center": [0, 0, 0], "radius": 0.5}) == Cylinder((0, 0, 0), 0.5)
    assert isinstance(region({"kind": "keep-out", "lower": [0, 0, 0], "upper": [1, 1, 1]}), KeepOut)
    assert isinstance(region({"kind": "polytope", "normals": [[1, 0, 0]], "offsets": [1.0]}), Polytope)
    for bad in (
        {"kind": "cone"},
        {},
        {"kind": "ball", "center": [0, 0, 0]},
        {"kind": "ball", "center": [0, 0, 0], "radius": -1},
    ):
        with pytest.raises(ConstraintDefinitionError):
            region(bad)


def test_what_is_no_constraint_is_refused():
    with pytest.raises(ConstraintDefinitionError, match="needs name, unit, limit"):
        solve(line(), object())


def test_constraints_that_packages_offer(monkeypatch):
    offered = {"tank": EntryPoint("tank", "ovita.limits.custom:KeepOut", "ovita.limits")}
    for module in ("ovita.plugins", "ovita.limits.custom"):
        monkeypatch.setattr(f"{module}.entries", lambda kind: offered if kind == "limits" else {})
    assert load("tank", lower=(0, 0, 0), upper=(1, 1, 1)) == KeepOut((0, 0, 0), (1, 1, 1))
    with pytest.raises(ConstraintDefinitionError, match="on offer: tank"):
        load("well")
