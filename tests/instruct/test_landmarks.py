"""Points of the compass: which directions they are in a frame, and that it is always shown first."""

import numpy as np
import pytest

from ovita.instruct.landmarks import on_axes
from ovita.instruct.notation import show
from ovita.instruct.referee import understand
from ovita.paths.scene import Frame, Scene, SceneObject
from ovita.paths.trajectory import Trajectory

SILO = SceneObject("silo", np.array([0.5, 0.3, 0.0]), [0.1, 0.1, 0.1])
PATH = Trajectory(np.column_stack([np.linspace(0.0, 1.0, 30), np.zeros(30), np.zeros(30)]), np.full(30, 0.2))


@pytest.mark.parametrize(
    ("frame", "north", "east"), [("rfu", "front", "right"), ("flu", "left", "front"), ("ned", "front", "right")]
)
def test_a_point_of_the_compass_is_a_direction_of_the_frame(frame, north, east):
    turned, taken = on_axes("north of it, then eastwards", Scene((SILO,), Frame(frame)))
    assert turned == f"{north} of it, then {east}"
    assert f"north is {north}" in taken and f"east is {east}" in taken


def test_the_name_of_an_object_is_no_point_of_the_compass():
    scene = Scene((SceneObject("north gate", np.zeros(3)),))
    assert on_axes("stop at the north gate", scene) == ("stop at the north gate", "")


def test_it_is_shown_first_with_what_it_was_taken_for():
    found = understand("move 2 m north", Scene((SILO,)), PATH)
    assert show(found.reading.frames) == "move front=2m"
    assert found.outcome == "needs_confirmation" and any("north is front" in doubt for doubt in found.doubts)
