"""Robots that follow a trajectory in simulation: an arm, a rover, a drone (extra `sim`).

    from ovita import sim

    result = sim.simulate(trajectory, scene, "iiwa")      # or "jackal", "crazyflie", or a .toml file of one's own
    result.report.status                                  # "followed", "slowed", "contact", "off course", "unreachable"
    result.report.sentences()                             # tracking error, unreachable waypoints, limits, contacts

`simulate` is pure: the same input gives the same output, nothing is written, and no screen or OpenGL is needed.

To draw the robot, take `result.motion`, or `sim.preview(trajectory, scene, robot)`, which leaves physics out and is
quicker. Both are a `Motion`, plain arrays:

    motion.bodies      names of the B bodies
    motion.times       (T,) seconds of the simulated motion
    motion.asked       (T,) the time at which the trajectory itself is there, for a playhead on the trajectory
    motion.positions   (T, B, 3) metres, in the scene's own coordinates, like the trajectory's positions
    motion.wxyz        (T, B, 4) unit quaternions
    motion.shapes      what each body looks like: `Shape`s with body, kind, size, position, wxyz and rgba
    motion.at(time, clock="trajectory")    positions (B, 3) and quaternions (B, 4) at one time of the playhead

A shape's pose is relative to its body: the shape is at `positions[t, shape.body]` moved by `shape.position` turned by
`wxyz[t, shape.body]`. `save_video` renders videos, which does need OpenGL (EGL or OSMesa). `docs/robots.md` shows how
to add a robot.
"""

from __future__ import annotations

from ovita.sim.disturbances import Disturbances
from ovita.sim.models import SHIPPED, STAND_INS, RobotModel, load_model
from ovita.sim.placement import Base, WorldTransform
from ovita.sim.report import FAILED, Contact, Report, Tracking
from ovita.sim.simulate import Simulation, place, preview, require, simulate
from ovita.sim.timing import Touched, Unreachable
from ovita.sim.video import Pane, check_video, save_video
from ovita.sim.world import Motion, Shape

__all__ = [
    "FAILED",
    "SHIPPED",
    "STAND_INS",
    "Base",
    "Contact",
    "Disturbances",
    "Motion",
    "Pane",
    "Report",
    "RobotModel",
    "Shape",
    "Simulation",
    "Touched",
    "Tracking",
    "Unreachable",
    "WorldTransform",
    "check_video",
    "load_model",
    "place",
    "preview",
    "require",
    "save_video",
    "simulate",
]
