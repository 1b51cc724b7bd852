import numpy as np
import pytest

from ovita.paths.scene import Scene, SceneObject

CUP = SceneObject("cup", [0.5, 0.3, 0.0], [0.06, 0.06, 0.1])
BOX = SceneObject("box", [1.0, 0.0, 0.2])


@pytest.fixture
def line():
    """A straight path of 21 waypoints along +x, 1 m, at 0.5 m/s."""
    rows = np.zeros((21, 4))
    rows[:, 0] = np.linspace(0.0, 1.0, 21)
    rows[:, 3] = 0.5
    return rows


@pytest.fixture
def cup():
    return CUP


@pytest.fixture
def scene():
    return Scene((CUP, BOX))
