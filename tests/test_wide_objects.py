"""Wide objects: what is near them, and which way is nearer or farther, is told from the middle of their body."""

import numpy as np

from ovita.paths.part import near
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.toolkit import closer, farther
from ovita.toolkit import near as mask_near

X = np.linspace(-5.0, 5.0, 101)
PATH = Trajectory(np.column_stack([X, np.full(101, 1.0), np.ones(101)]), np.full(101, 0.5))
WALL = SceneObject("wall", [0.0, 0.0, 1.0], [8.0, 0.2, 2.0])
CUBE = SceneObject("cube", [0.0, 0.0, 1.0], [0.4, 0.4, 0.4])


def test_all_that_runs_along_a_wall_is_near_it():
    scene, rows = Scene((WALL, CUBE)), PATH.to_array()
    along = near("wall", 1.2).mask(PATH, scene)
    assert along[np.abs(X) < 3.8].all() and not along[np.abs(X) > 4.8].any()
    assert np.array_equal(mask_near(rows, WALL, 1.2), along)
    assert np.abs(X[mask_near(rows, CUBE, 1.2)]).max() < 0.7


def test_a_path_comes_straight_to_a_wall_and_goes_straight_from_it():
    rows, middle = PATH.to_array(), np.abs(X) < 2.0
    for moved in (closer(rows, WALL, 0.3), farther(rows, WALL, 0.3)):
        assert np.allclose(moved[middle, 0], X[middle]) and np.allclose(np.abs(moved[middle, 1] - 1.0), 0.3)
