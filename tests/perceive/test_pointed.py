"""What stands in a rectangle that a person drew over a picture."""

import numpy as np
import pytest
from depth_pictures import Thing, picture

from ovita.paths.scene import Frame, SceneObject
from ovita.perceive import perceive
from ovita.perceive.pointed import look_in, pixels_in, rectangle_of

CUP = Thing("cylinder", (0.0, 0.12, 0.05), (0.08, 0.08, 0.1), colour="red")
LEFT = Thing("box", (0.0, 0.05, 0.04), (0.08, 0.1, 0.08), colour="blue")
RIGHT = Thing("box", (0.0, -0.05, 0.03), (0.08, 0.1, 0.06), colour="green")
FAR = Thing("box", (0.05, -0.15, 0.04), (0.1, 0.1, 0.08), 0.3, "blue")
FLU = Frame("flu")


def around(view, thing):
    return rectangle_of(view, SceneObject("a", thing.position, thing.size))


def test_a_loose_rectangle_takes_the_thing_in_it():
    view = picture([CUP, FAR], noise=0.002)
    x0, y0, x1, y1 = around(view, CUP)
    found = look_in([view], (x0 - 4, y0 - 3, x1 + 4, y1 + 5), FLU)
    assert np.linalg.norm(found.position - CUP.position) < 0.005 and found.extra["shape"] == "cylinder"


def test_things_that_touch_are_parted_by_a_rectangle():
    view = picture([LEFT, RIGHT], size=(240, 180), noise=0.001)
    assert len(perceive([view]).things) == 1, "depth alone cannot part them"
    found = look_in([view], around(view, LEFT), FLU)
    assert np.linalg.norm(found.position - LEFT.position) < 0.02 and found.size == pytest.approx(LEFT.size, abs=0.03)


def test_the_other_views_are_asked_as_well():
    views = [picture([CUP, FAR], noise=0.002), picture([CUP, FAR], eye=(0.1, -0.75, 0.55), noise=0.002, seed=1)]
    found = look_in(views, around(views[0], CUP), FLU)
    assert found.extra["seen_by"] == 2 and np.linalg.norm(found.position - CUP.position) < 0.004


def test_a_rectangle_without_anything_in_it():
    assert look_in([picture([CUP])], (0.0, 0.0, 9.0, 9.0), FLU) is None
    assert not pixels_in((0.0, 0.0, 9.0, 9.0), np.zeros((12, 16), dtype=int)).any()
