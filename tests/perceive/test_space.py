"""Things in point clouds, where there is no picture."""

from __future__ import annotations

import numpy as np
import pytest
from depth_pictures import Thing, picture

from ovita.errors import SceneError
from ovita.io.clouds import PointCloud
from ovita.perceive.assemble import perceive_clouds
from ovita.perceive.space import CELL, joined_cells

CUP = Thing("cylinder", (0.0, 0.2, 0.06), (0.08, 0.08, 0.12), colour="red")
BOOK = Thing("box", (0.1, -0.15, 0.03), (0.2, 0.12, 0.06), 0.4, "blue")
BALL = Thing("sphere", (-0.15, 0.0, 0.05), (0.1, 0.1, 0.1), colour="green")


def cloud_of(*eyes, things=(CUP, BOOK, BALL), colours=True, noise=0.001):
    views = [picture(things, eye, size=(240, 180)) for eye in eyes]
    rng = np.random.default_rng(3)
    points = np.concatenate([view.points.reshape(-1, 3) for view in views])
    points = points + noise * rng.standard_normal(points.shape)
    return PointCloud(points, np.concatenate([view.rgb.reshape(-1, 3) for view in views]) if colours else None)


ROUND = ((-0.7, 0.0, 0.6), (0.6, 0.5, 0.6), (0.5, -0.6, 0.6))


def test_things_around_which_a_camera_went():
    seen = perceive_clouds([cloud_of(*ROUND)], names=["cup=red", "book=blue box", "ball"])
    assert set(seen.scene.names) == {"cup", "book", "ball", "floor"}
    for name, thing in (("cup", CUP), ("book", BOOK), ("ball", BALL)):
        found = seen.scene[name]
        assert np.linalg.norm(found.position - thing.position) < 0.01, name
        assert np.abs(np.sort(found.size) - np.sort(thing.size)).max() < 0.02, name
    assert seen.scene["cup"].extra["shape"] == "cylinder" and seen.scene["ball"].extra["shape"] == "sphere"
    assert seen.support is not None and abs(seen.support.offset) < 0.005


def test_one_side_is_enough_to_find_them():
    seen = perceive_clouds([cloud_of(ROUND[0], colours=False)])
    assert len(seen.things) == 3 and all("colour" not in item.extra for item in seen.things)
    for thing in (CUP, BOOK, BALL):
        assert min(np.linalg.norm(item.position - thing.position) for item in seen.scene) < 0.04


def test_clouds_of_several_sensors_are_one():
    seen = perceive_clouds([cloud_of(eye) for eye in ROUND])
    assert len(seen.things) == 3


def test_without_a_support_and_what_is_too_large():
    wall = Thing("box", (1.0, 0.0, 1.0), (0.05, 3.0, 2.0), colour="yellow")
    cloud = cloud_of(*ROUND, things=(CUP, wall))
    floating = PointCloud(cloud.points[cloud.points[:, 2] > 0.01])
    seen = perceive_clouds([floating], plane="none")
    assert len(seen.scene) == 1 and seen.support is None
    assert any("as large as a wall" in note for note in seen.notes)


def test_nothing_there():
    flat = PointCloud(np.random.default_rng(1).uniform(-1, 1, (5000, 3)) * [1, 1, 0])
    assert perceive_clouds([flat]).things == ()
    with pytest.raises(SceneError, match="no point cloud"):
        perceive_clouds([])


def test_cells_join_across_corners_and_not_across_gaps():
    line = np.arange(8)[:, None] * [CELL, CELL, CELL] + CELL / 2
    far = line[-1:] + np.array([3 * CELL, 0.0, 0.0])
    owner = joined_cells(np.vstack([line, far, line[:1]]))
    assert len(set(owner[:8])) == 1 and owner[8] != owner[0] and owner[9] == owner[0]
    assert len(joined_cells(np.zeros((0, 3)))) == 0
