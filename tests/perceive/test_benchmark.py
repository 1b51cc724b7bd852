"""The benchmark's own measures, on pictures that are cast without a renderer."""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest
from depth_pictures import Thing, picture

from ovita.paths.scene import SceneObject
from ovita.perceive import View, perceive

FILE = Path(__file__).parents[2] / "benchmarks" / "perceive.py"


@pytest.fixture(scope="module")
def bench():
    spec = importlib.util.spec_from_file_location("perceive_benchmark", FILE)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    yield module
    del sys.modules[spec.name]


def test_things_stand_on_the_ground_and_apart(bench):
    for seed in range(20):
        rng = np.random.default_rng(seed)
        truths = bench.things(rng, room=bool(seed % 2))
        ground = 0.0 if seed % 2 else bench.TABLE
        for one in truths:
            corners = np.array(np.meshgrid(*[(-0.5, 0.5)] * 3)).reshape(3, -1).T * one.size @ one.rotation.T
            assert one.center[2] + corners[:, 2].min() == pytest.approx(ground, abs=1e-9) or one.kind == "cylinder"
        for i, one in enumerate(truths):
            assert all(np.linalg.norm(one.center[:2] - o.center[:2]) > 0.03 for o in truths[:i])


def test_errors_forgive_how_axes_are_called_and_nothing_else(bench):
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    truth = bench.Truth("box", np.array([0.1, 0.2, 0.3]), turn, np.array([0.1, 0.2, 0.3]), "red")
    same = SceneObject("a", truth.center, np.array([0.2, 0.1, 0.3]))
    assert bench.errors(truth, same)[:3] == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    half = np.radians(5.0)
    turned = SceneObject(
        "a", truth.center + np.array([0.0, 0.0, 0.01]), np.array([0.2, 0.13, 0.3]), [np.cos(half), 0, 0, np.sin(half)]
    )
    assert bench.errors(truth, turned)[:3] == pytest.approx((0.01, 0.01, 10.0), abs=1e-6)


def test_found_and_invented_are_counted(bench):
    truths = [bench.Truth("box", np.array([x, 0.0, 0.0]), np.eye(3), np.full(3, 0.1), "red") for x in (0.0, 1.0)]
    seen = [SceneObject("a", np.array([0.01, 0.0, 0.0]), np.full(3, 0.1)), SceneObject("b", np.array([5.0, 0.0, 0.0]))]
    tally = bench.Tally()
    bench.count(tally, truths, [True, True], seen)
    assert (tally.asked, tally.found, tally.told, tally.invented) == (2, 1, 2, 1)


def test_shapes_beat_principal_components_on_the_same_picture(bench):
    things = [
        Thing("box", (0.1, -0.15, 0.06), (0.1, 0.14, 0.12), 0.4),
        Thing("cylinder", (0.0, 0.15, 0.07), (0.08, 0.08, 0.14)),
    ]
    clean = picture(things, size=(240, 180))
    alone = [picture([one], size=(240, 180), table=False).seen for one in things]
    mask = np.where(alone[0], 0, np.where(alone[1], 1, -1))
    noisy = clean.depth + 0.0025 * clean.depth**2 * np.random.default_rng(1).standard_normal(clean.shape)
    view = View(noisy, clean.intrinsics, clean.pose, clean.rgb)
    truths = [bench.Truth(t.kind, np.array(t.position), t.rotation, np.array(t.size), "red") for t in things]
    shot = bench.Shot(clean.rgb, clean.depth, mask, clean.pose)
    ours, theirs = bench.Tally(), bench.Tally()
    bench.count(ours, truths, [True, True], perceive([view]).things)
    bench.count(theirs, truths, [True, True], [b for b in bench.by_pca(truths, [shot], [view]) if b is not None])
    assert ours.found == 2 and ours.invented == 0 and max(ours.center) < 0.006
    assert np.median(theirs.center) > 2 * np.median(ours.center)
    assert bench.row("ovita", ours).count("|") == bench.HEAD.splitlines()[0].count("|")
