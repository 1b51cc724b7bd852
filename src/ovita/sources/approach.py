"""The way of an arm from where it is to where a motion starts: planned, slow, and clear of everything."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ovita.errors import RequestError
from ovita.io.messages import JointMotion
from ovita.paths.robot import UNLIMITED, Robot
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, arc_length
from ovita.sim import Base
from ovita.sim.models import ArmLimits, RobotModel, mujoco
from ovita.sim.placement import WorldTransform
from ovita.sim.timing import joined, timed
from ovita.sim.world import build
from ovita.sources.joints import Cell, rounded
from ovita.sources.places import Anchor
from ovita.sources.planner import PlanRequest

SHARE = 0.25
"""Of the joints' speeds and accelerations that an approach uses."""

TIP_SPEED = 0.25
"""Highest speed of the tip on an approach [m/s]; that of manual reduced speed in ISO 10218-1."""

STEP = 0.02
"""Between two points [s]."""


def approach(
    motion: JointMotion,
    state: Array,
    model: RobotModel,
    scene: Scene,
    base: Base,
    robot: Robot | None,
    *,
    seed: int = 0,
    seconds: float = 20.0,
) -> JointMotion:
    """A motion from a state (J,) [rad] to where another starts, with it behind: one motion that starts at the state.

    RRT-Connect finds the way, which keeps the margin to every object, the floor and the arm itself and stays in the
    robot's workspace (`sources.joints`); TOPP-RA passes it at a quarter of the joints' limits and at most 0.25 m/s.

    Raises:
        RequestError: If the arm touches something at either end, or no way is found in that time.
    """
    limits = robot or UNLIMITED
    goal = motion.positions[0]
    here, there = (_tip(model, scene, base, joints) for joints in (state, goal))
    request = PlanRequest(
        scene, limits, Anchor(here, "where the arm is"), Anchor(there, "the start"), seed=seed, time_limit=seconds
    )
    cell = Cell.of(request, model, base)
    for joints, anchor in ((state, request.start), (goal, request.goal)):
        problem = cell.problem(joints.tolist())
        if problem is not None:
            margin = f"with the margin of {limits.obstacle_margin:g} m to objects"
            raise RequestError(f"no approach: at {anchor.label}, {problem} ({margin}); move it by hand")
    way = cell.way(state, [goal], seed=seed + 1, seconds=seconds, progress=None)
    if way is None:
        raise RequestError(
            f"no approach from where the arm is to the start was found in {seconds:g} s; on the straight way "
            f"{cell.blocked(state, goal)}; move the arm by hand, or the objects"
        )
    return motion.after(_slow(cell, rounded(cell, way), motion))


def _slow(cell: Cell, rows: Array, motion: JointMotion) -> JointMotion:
    """A way (M, J) as a motion at the speed of an approach."""
    assert isinstance(cell.model.limits, ArmLimits)
    arc = arc_length(rows)
    tips = np.array([cell.tip(row) for row in rows])
    top = cell.request.robot.max_speed
    allowed = min(TIP_SPEED, top or TIP_SPEED) / np.maximum(np.gradient(arc_length(tips), arc), 1e-3)
    velocity, acceleration = (SHARE * np.array(v) for v in (cell.limits.velocity, cell.limits.acceleration))
    plan = joined([timed(arc, np.linspace(0.0, 1.0, len(arc)), rows, allowed, velocity, acceleration)], STEP)
    rates, pushes = plan.rates.copy(), plan.accelerations.copy()
    rates[[0, -1]] = pushes[[0, -1]] = 0.0
    return replace(motion, positions=plan.coordinates, times=plan.times, velocities=rates, accelerations=pushes)


def _tip(model: RobotModel, scene: Scene, base: Base, joints: Array) -> Array:
    """Where the tip is at some joints, (3,) [m] in the scene's coordinates."""
    world = WorldTransform(scene.frame)
    stage = build(model, Scene(), world.base(base), 0.0)
    data = mujoco.MjData(stage.model)
    data.qpos[:] = joints
    mujoco.mj_kinematics(stage.model, data)
    return np.array(data.site_xpos[stage.tip] * world.signs)
