"""Pictures, cameras and units that are not what they are said to be: one sentence each, and none where all is right."""

import numpy as np
import pytest
from depth_pictures import Thing, picture

from ovita.perceive import View, perceive

CUP = Thing("cylinder", (0.0, 0.12, 0.05), (0.08, 0.08, 0.1), colour="red")
BOX = Thing("box", (0.1, -0.12, 0.04), (0.1, 0.14, 0.08), 0.4, "blue")
GOOD = picture([CUP, BOX], noise=0.002, size=(240, 180))
LOW = picture([CUP, BOX], eye=(0.1, -0.75, 0.4), noise=0.002, size=(240, 180), seed=1)


def changed(view, *, pose=None, depth=None, rgb=None, frame="flu", **options):
    """What is noted of a view with something else in it."""
    given = View(
        view.depth if depth is None else depth,
        view.intrinsics,
        view.pose if pose is None else pose,
        view.rgb if rgb is None else rgb,
        "look",
    )
    return " / ".join(perceive([given], frame=frame, **options).notes)


def moved(view, scale):
    pose = view.pose.copy()
    pose[:3, 3] *= scale
    return pose


def turned(view, degrees):
    pose, angle = view.pose.copy(), np.radians(degrees)
    lean = np.array([[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]])
    pose[:3, :3] = pose[:3, :3] @ lean
    return pose


@pytest.mark.parametrize("view", [GOOD, LOW], ids=["from behind", "from the right"])
def test_nothing_is_doubted_where_all_is_right(view):
    assert changed(view) == ""


GL = np.diag([1.0, -1.0, -1.0, 1.0])


@pytest.mark.parametrize(
    "change, says",
    [
        ({"pose": moved(GOOD, 1000.0)}, "stands 922 m from the world's zero; is its pose in millimetres"),
        ({"pose": np.linalg.inv(GOOD.pose)}, "would if it was inverted"),
        ({"pose": GOOD.pose @ GL}, 'would if it had "axes": "opengl"'),
        ({"pose": np.eye(4)}, "is the identity"),
        ({"pose": turned(GOOD, 6.0)}, "leans by 6.0 degrees"),
        ({"frame": "ned"}, "--frame"),
        ({"depth": 10.0 * GOOD.depth}, "farther than usual cameras measure well"),
        ({"depth": 0.1 * GOOD.depth}, "nearer than usual cameras measure"),
        ({"rgb": LOW.rgb}, "have no edges where its depth has steps"),
        ({"rgb": np.roll(GOOD.rgb, 25, axis=1)}, "have no edges where its depth has steps"),
        ({"plane": 0.5}, "nothing at the height that was given"),
    ],
    ids=["mm", "inverted", "opengl", "identity", "leaning", "frame", "x10", "x0.1", "other", "shifted", "plane"],
)
def test_what_is_strange_is_said(change, says):
    assert says in changed(GOOD, **change)


def test_a_unit_that_would_put_the_support_at_zero_is_named():
    far = picture([Thing("box", (0.3, 0.0, 0.2), (0.4, 0.4, 0.4))], eye=(-1.2, 0.0, 1.5), size=(240, 180))
    assert "would be at 0 if the depth were 0.1 times as large" in changed(far, depth=10.0 * far.depth)


def test_things_too_large_to_be_true_are_named():
    big = picture([Thing("box", (0.3, 0.0, 0.2), (0.4, 0.4, 0.4))], eye=(-1.2, 0.0, 1.5), size=(240, 180))
    assert "long; is the unit of the depth right" in changed(big, depth=8.0 * big.depth, pose=moved(big, 8.0))
