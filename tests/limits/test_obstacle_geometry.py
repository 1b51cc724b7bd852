"""Distances of points and segments to oriented cuboids and spheres, against brute force and finite differences."""

import numpy as np
import pytest
from constraint_scenes import segment_distances

from ovita.errors import UnknownObject
from ovita.limits.problem import Obstacle, obstacles_of
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene, SceneObject


def random_body(rng, sphere=False):
    rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    half = np.zeros(3) if sphere else rng.uniform(0.02, 0.4, 3)
    return Obstacle(rng.normal(size=3) * 0.2, rotation, half, rng.uniform(0.01, 0.3))


@pytest.mark.parametrize("sphere", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_segment_distance_is_exact(seed, sphere):
    rng = np.random.default_rng(seed)
    body = random_body(rng, sphere)
    start, end = rng.uniform(-0.8, 0.8, (2, 200, 3))
    distance, t = body.along(start, end)
    for i in range(len(start)):
        brute = segment_distances(body, np.stack([start[i], end[i]]), 2000)[0]
        assert distance[i] <= brute + 1e-9
        assert distance[i] == pytest.approx(brute, abs=2e-3)
    at = body.signed(start + t[:, None] * (end - start))[0]
    assert at == pytest.approx(distance, abs=1e-9)
    assert np.array_equal(body.hit(start, end, 1e-3), distance < 1e-3)


def test_degenerate_segments():
    body = Obstacle(np.zeros(3), np.eye(3), np.full(3, 0.5), 0.0)
    points = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 0.5, 0.5]])
    assert body.along(points, points)[0] == pytest.approx([-0.5, 0.5, 0.0])
    parallel = body.along(np.array([[-2.0, 0.7, 0.0]]), np.array([[2.0, 0.7, 0.0]]))
    assert parallel[0] == pytest.approx([0.2])


@pytest.mark.parametrize("seed", range(5))
def test_normals_are_gradients_and_planes_separate(seed):
    rng = np.random.default_rng(seed)
    body = random_body(rng, sphere=seed % 2 == 0)
    points = rng.uniform(-1.5, 1.5, (100, 3))
    distance, normals = body.signed(points)
    outside = distance > 0.05
    step = 1e-6
    numeric = np.stack(
        [(body.signed(points + step * e)[0] - body.signed(points - step * e)[0]) / (2 * step) for e in np.eye(3)],
        axis=1,
    )
    assert numeric[outside] == pytest.approx(normals[outside], abs=1e-4)
    # the tangent plane at the nearest point has the point beyond it and the whole body behind it
    gap = (points * normals).sum(axis=1) - body.support(normals)
    assert gap[outside] == pytest.approx(distance[outside], abs=1e-9)
    inside = points[distance < 0]
    if len(inside):
        assert (inside @ normals[outside].T <= body.support(normals[outside]) + 1e-9).all()


def test_sieve_misses_nothing():
    rng = np.random.default_rng(0)
    body = random_body(rng)
    start, end = rng.uniform(-2, 2, (2, 500, 3))
    close = np.flatnonzero(body.along(start, end)[0] < 0.1)
    assert set(close) <= set(body.near(start, end, 0.1))


def test_objects_become_obstacles():
    scene = Scene((SceneObject("cup", [1, 0, 0]), SceneObject("table", [0, 0, 0], [1, 2, 0.1])))
    robot = Robot("r", None, obstacle_margin=0.03, object_size=0.08)
    cup, table = obstacles_of(scene, robot)
    assert cup.half == pytest.approx(0.04)
    assert table.radius == pytest.approx(0.03)
    sphere = obstacles_of(scene, robot, shape="sphere")[1]
    assert sphere.radius == pytest.approx(np.linalg.norm([1, 2, 0.1]) / 2 + 0.03)
    assert [b.name for b in obstacles_of(scene, robot, contacts=["the Cup"])] == ["table"]
    with pytest.raises(UnknownObject):
        obstacles_of(scene, robot, contacts=["plate"])
