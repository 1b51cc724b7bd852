"""A multirotor: the geometric tracking controller of Lee, Leok and McClamroch (CDC 2010) on its rotors' thrusts."""

from __future__ import annotations

from typing import Any

import numpy as np

from ovita.paths.trajectory import Array, Trajectory
from ovita.sim.models import DroneLimits, RobotModel
from ovita.sim.placement import Base
from ovita.sim.timing import ControlPlan, Hold, Piece, joined, route, still, stretches, timed
from ovita.sim.world import SimWorld

STOP_ANGLE = np.radians(100.0)
SPACING = 0.03


class Drone:
    """Follows a trajectory through the air, with a heading that stays.

    Args:
        robot: With `DroneLimits`.
        stage: With the drone in it.
        trajectory: In the simulator's coordinates.
        base: Its heading is the drone's.
    """

    def __init__(self, robot: RobotModel, stage: SimWorld, trajectory: Trajectory, base: Base) -> None:
        assert isinstance(robot.limits, DroneLimits)
        self.stage, self.limits = stage, robot.limits
        stage.check_free(robot)
        model = stage.model
        self._mass = float(model.body_subtreemass[stage.bodies[0]])
        self._inertia = np.array(model.body_inertia[stage.bodies[0]])
        self._gravity = -float(model.opt.gravity[2])
        self._mix = np.linalg.pinv(_wrench(model))
        self._low, self._high = model.actuator_ctrlrange.T
        self._ahead = np.array([np.cos(base.yaw), np.sin(base.yaw), 0.0])
        self._yaw = base.yaw
        self._intent = self._plan(robot, trajectory)

    @property
    def intent(self) -> ControlPlan:
        """The plan, in x, y and z."""
        return self._intent

    def pose(self, data: Any, step: int) -> None:
        """Hover at the plan's pose."""
        data.qpos[:3] = self._intent.plan.coordinates[step]
        data.qpos[3:7] = np.cos(self._yaw / 2), 0.0, 0.0, np.sin(self._yaw / 2)

    def act(self, data: Any, step: int) -> bool:
        """Thrusts of the rotors."""
        plan, gains = self._intent.plan, self.limits
        push = plan.accelerations[step] + gains.position_gain * (plan.coordinates[step] - data.qpos[:3])
        push += gains.velocity_gain * (plan.rates[step] - data.qvel[:3])
        push[2] += self._gravity
        rotation = data.xmat[self.stage.bodies[0]].reshape(3, 3)
        up = push / np.linalg.norm(push)
        side = _cross(up, self._ahead)
        side /= np.linalg.norm(side)
        wanted = np.column_stack([_cross(side, up), side, up])
        off = wanted.T @ rotation
        tilt = 0.5 * np.array([off[2, 1] - off[1, 2], off[0, 2] - off[2, 0], off[1, 0] - off[0, 1]])
        rates = data.qvel[3:6]
        spin = -gains.attitude_gain * tilt - gains.rate_gain * rates
        torque = self._inertia * spin + _cross(rates, self._inertia * rates)
        thrust = self._mass * float(push @ rotation[:, 2])
        rotors = self._mix @ np.array([thrust, *torque])
        data.ctrl[:] = np.minimum(np.maximum(rotors, self._low), self._high)
        return bool((rotors <= self._high).all())

    def _plan(self, robot: RobotModel, trajectory: Trajectory) -> ControlPlan:
        limits = self.limits
        share = limits.acceleration * np.array([np.sqrt(0.5), np.sqrt(0.5), 1.0])
        velocity = np.full(3, limits.max_speed)
        done: list[Piece] = []
        place = trajectory.positions[0]
        for piece in route(trajectory, corner=robot.corner, stop_angle=STOP_ANGLE, spacing=SPACING):
            if isinstance(piece, Hold):
                done.append(still(piece.duration, piece.where, place))
                continue
            allowed = np.minimum(piece.speeds, limits.max_speed)
            done.append(timed(piece.arc, piece.where, piece.points, allowed, velocity, share))
            place = piece.points[-1]
        plan = joined(done, self.stage.model.opt.timestep)
        speed = np.linalg.norm(plan.rates, axis=1)
        touched = stretches("speed", speed > 0.98 * limits.max_speed, plan.where)
        fastest = float(trajectory.speeds.max())
        notes = []
        if fastest > limits.max_speed:
            notes.append(f"The trajectory asks for {fastest:g} m/s; this drone flies at most {limits.max_speed:g} m/s.")
        if limits.endurance is not None and plan.times[-1] > limits.endurance:
            notes.append(f"The battery of this drone lasts for {limits.endurance:g} s of flight.")
        return ControlPlan(plan, (), touched, tuple(notes))


def _wrench(model: Any) -> Array:
    """Upward force and torques about the body's axes (4, R) per unit of each rotor's thrust."""
    sites = model.actuator_trnid[:, 0]
    force, moment = model.actuator_gear[:, :3], model.actuator_gear[:, 3:]
    torque = np.cross(model.site_pos[sites], force) + moment
    return np.vstack([force[:, 2], torque.T])


def _cross(a: Array, b: Array) -> Array:
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
