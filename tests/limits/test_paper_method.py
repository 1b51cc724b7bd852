"""The published module, its weights, and what our verification says of it."""

import importlib
import importlib.util

import numpy as np
import pytest

from ovita.errors import MissingExtra
from ovita.limits import ConstraintOptions, constrain, paper
from ovita.limits.paper import linearise
from ovita.paths.robot import Robot, Shell
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory

OPEN = Robot("open", None)
BY_HAND = ConstraintOptions(method="paper", trials=0, lambda_smooth=0.1)
needs_optuna = pytest.mark.skipif(importlib.util.find_spec("optuna") is None, reason="optuna is not installed")


def line(n=30, y=0.0):
    return Trajectory(np.column_stack([np.linspace(-0.5, 0.5, n), np.full(n, y), np.zeros(n)]), np.full(n, 0.5))


def solve(t, scene, robot=OPEN, options=BY_HAND):
    return constrain(t, scene, robot, original=line(3), options=options)


def test_smoothing_does_not_mix_coordinates():
    t = Trajectory(np.column_stack([np.linspace(0, 1, 30), np.full(30, 5.0), np.full(30, 2.0)]), np.full(30, 0.5))
    found = solve(t, Scene(), options=ConstraintOptions(method="paper", trials=0, lambda_smooth=1.0)).trajectory
    assert found.positions[:, 1:] == pytest.approx(t.positions[:, 1:], abs=1e-6)
    assert found.speeds == pytest.approx(t.speeds, abs=1e-6)


def test_linearisation_agrees_with_finite_differences():
    rng = np.random.default_rng(0)
    x = rng.normal(size=(20, 3))
    scene = Scene((SceneObject("o", [0.3, 0.1, -0.2], [0.2, 0.1, 0.1]),))
    rows = linearise(x, scene, OPEN, (), ConstraintOptions())
    radius = np.linalg.norm([0.2, 0.1, 0.1]) / 2

    def square(p):
        return ((p - [0.3, 0.1, -0.2]) ** 2).sum(axis=1) - radius**2 - OPEN.obstacle_margin**2

    at = (rows.normals[:, :3] * x).sum(axis=1) - rows.offsets
    assert at == pytest.approx(square(x))
    step = 1e-6
    numeric = np.stack([(square(x + step * e) - square(x - step * e)) / (2 * step) for e in np.eye(3)], axis=1)
    assert rows.normals[:, :3] == pytest.approx(numeric, abs=1e-6)


def test_its_answer_is_judged_like_any_other():
    beside = Scene((SceneObject("cup", [0.0, 0.1, 0.0], [0.1, 0.1, 0.1]),))
    assert solve(line(), beside).verdict.status in ("satisfied", "repaired")
    through = solve(line(n=6), Scene((SceneObject("plate", [0.0, 0.0, 0.0], [0.01, 0.02, 0.02]),)))
    assert through.verdict.status == "infeasible"
    assert "published module" in through.verdict.conflicts[0]


def test_no_solution_is_a_status():
    robot = Robot("arm", Shell((0, 0, 0), 0.15, 1.2))
    options = ConstraintOptions(method="paper", trials=0, fix_start=True)
    far = line().with_(positions=line().positions + np.array([5, 0, 0]))
    found = solve(far, Scene(), robot, options)
    assert found.verdict.status == "infeasible"
    assert "The published quadratic program has no solution." in found.verdict.notes


@needs_optuna
@pytest.mark.filterwarnings("default")
def test_the_search_for_weights_is_seeded():
    options = ConstraintOptions(method="paper", trials=8)
    scene = Scene((SceneObject("cup", [0.0, 0.1, 0.0], [0.1, 0.1, 0.1]),))
    first = solve(line(), scene, options=options)
    assert first.trajectory == solve(line(), scene, options=options).trajectory
    assert "8 trials chose lambda_dev" in first.verdict.notes[0]


def test_without_optuna_the_remedy_is_named(monkeypatch):
    def missing(name):
        raise ImportError(name)

    monkeypatch.setattr(paper.importlib, "import_module", missing)
    with pytest.raises(MissingExtra, match=r"ovita\[tuning\]"):
        solve(line(), Scene(), options=ConstraintOptions(method="paper"))


def noisy(n=60):
    rng = np.random.default_rng(3)
    t = np.linspace(0, 3, n)
    x = np.column_stack([t, np.sin(t), 0 * t]) * 0.3
    return Trajectory(x + rng.normal(size=(n, 3)) * 0.01, np.full(n, 0.5))


def test_smoothing_is_chosen_by_a_criterion_with_an_optimum():
    t = noisy()
    found = solve(t, Scene(), options=ConstraintOptions(lambda_smooth="auto"))
    assert "lambda_smooth / lambda_dev" in found.verdict.notes[0]
    assert 0 < found.verdict.max_shift < 0.1
    smooth = noisy()
    smooth = smooth.with_(positions=np.column_stack([np.linspace(0, 1, 60), np.zeros((60, 2))]))
    less = solve(smooth, Scene(), options=ConstraintOptions(lambda_smooth="auto"))
    assert less.verdict.max_shift < found.verdict.max_shift
