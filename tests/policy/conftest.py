import sys
from pathlib import Path

import numpy as np
import pytest

from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory

sys.path.insert(0, str(Path(__file__).parent))

LINUX = sys.platform.startswith("linux")


@pytest.fixture
def line() -> Trajectory:
    """A hundred waypoints from the origin to (1, 0.5, 0.2), speeding up."""
    return Trajectory(np.linspace([0.0, 0, 0], [1.0, 0.5, 0.2], 100), np.linspace(0.1, 0.4, 100))


@pytest.fixture
def table() -> Scene:
    return Scene(
        (
            SceneObject("Red Cup", np.array([0.5, 0.3, 0.1]), np.array([0.1, 0.1, 0.2])),
            SceneObject("laptop", np.array([0.9, 0.1, 0.0])),
        ),
        environment="a table",
    )
