"""Robots that move about: a drone and a skid-steered rover.

The drone has the geometric tracking controller of Lee, Leok and McClamroch (CDC 2010) on its rotors' thrusts; the rover
is a path follower whose wheels slip.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ovita.paths.trajectory import Array, Trajectory
from ovita.sim.models import DroneLimits, RobotModel, RoverLimits
from ovita.sim.placement import Base
from ovita.sim.timing import ControlPlan, Hold, Piece, Unreachable, joined, route, still, stretches, timed
from ovita.sim.world import SimWorld

DRONE_STOP, DRONE_SPACING = np.radians(100.0), 0.03
ROVER_STOP, ROVER_SPACING = np.radians(40.0), 0.05
"""Turns at which a robot rests [rad], and the spacing of its route's samples [m]."""


class Drone:
    """Follows a trajectory through the air, in the simulator's coordinates, with a heading that stays, its base's."""

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
        self.intent = self._plan(robot, trajectory)

    def pose(self, data: Any, step: int) -> None:
        """Hover at the plan's pose."""
        data.qpos[:3] = self.intent.plan.coordinates[step]
        data.qpos[3:7] = np.cos(self._yaw / 2), 0.0, 0.0, np.sin(self._yaw / 2)

    def act(self, data: Any, step: int) -> bool:
        """Thrusts of the rotors."""
        plan, gains = self.intent.plan, self.limits
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
        for piece in route(trajectory, corner=robot.corner, stop_angle=DRONE_STOP, spacing=DRONE_SPACING):
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


LEVEL = 0.05
"""A waypoint farther than this above or below the ground cannot be reached [m]."""

ALONG, ACROSS, HEADING = 3.0, 5.0, 5.0
"""Gains: speed by distance behind [1/s], heading by distance aside [1/m], turning by heading [1/s]."""

STRAIGHT = 0.15
"""A change of heading up to this is steered while it drives off instead of being turned on the spot [rad]."""

CRAWL = 0.005
"""Below this speed the distance aside no longer matters, since the rover cannot go sideways [m/s]."""


class Rover:
    """Follows a trajectory on the ground, in the simulator's coordinates, from its base.

    Sharp corners are turned on the spot, others are rounded; TOPP-RA slows the path down where the speed, the turning
    rate or their derivatives would be too high. The rover then catches up with the plan along its heading and steers
    back onto the path like Stanley (Hoffmann et al., ACC 2007); its wheels are driven for a track wider by the slip
    factor.
    """

    def __init__(self, robot: RobotModel, stage: SimWorld, trajectory: Trajectory, base: Base) -> None:
        assert isinstance(robot.limits, RoverLimits)
        self.stage, self.limits, self.base = stage, robot.limits, base
        stage.check_free(robot)
        self._left = [stage.actuator(robot, name) for name in robot.limits.left]
        self._right = [stage.actuator(robot, name) for name in robot.limits.right]
        self.intent = self._plan(robot, trajectory)

    def pose(self, data: Any, step: int) -> None:
        """Set the rover on the ground at the plan's pose."""
        x, y, yaw = self.intent.plan.coordinates[step]
        data.qpos[:3] = x, y, self.stage.ground + self.stage.model.qpos0[2]
        data.qpos[3:7] = np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)

    def act(self, data: Any, step: int) -> bool:
        """Wheel speeds from the tracking law."""
        plan, limits = self.intent.plan, self.limits
        x, y, yaw = plan.coordinates[step]
        dx, dy, turn = plan.rates[step]
        speed = np.hypot(dx, dy)
        w, _, _, qz = data.qpos[3:7]
        heading = 2.0 * np.arctan2(qz, w)
        cos, sin = np.cos(heading), np.sin(heading)
        ex, ey = x - data.qpos[0], y - data.qpos[1]
        ahead, aside = cos * ex + sin * ey, cos * ey - sin * ex
        off = (yaw - heading + np.pi) % (2 * np.pi) - np.pi
        forward = speed * np.cos(off) + ALONG * ahead
        forward = min(max(forward, -limits.max_speed), limits.max_speed)
        off += np.arctan(ACROSS * aside) * speed / (speed + CRAWL)
        turning = turn + HEADING * np.sin(off)
        turning = min(max(turning, -limits.max_turn), limits.max_turn)
        half = 0.5 * limits.track * limits.slip * turning
        data.ctrl[self._left] = (forward - half) / limits.wheel_radius
        data.ctrl[self._right] = (forward + half) / limits.wheel_radius
        return True

    def _plan(self, robot: RobotModel, trajectory: Trajectory) -> ControlPlan:
        limits = self.limits
        height = trajectory.positions[:, 2] - self.stage.ground
        flat = trajectory.with_(positions=trajectory.positions * [1.0, 1.0, 0.0])
        far = [(i, off) for i, off in enumerate(height.tolist()) if abs(off) > LEVEL]
        why = "it is {:.2f} m {} the ground"
        unreachable = tuple(
            Unreachable(i, abs(off), why.format(abs(off), "above" if off > 0 else "below")) for i, off in far
        )
        pose = np.array([*trajectory.positions[0, :2], self.base.yaw])
        velocity = np.array([limits.max_speed, limits.max_speed, limits.max_turn])
        acceleration = np.array([limits.acceleration, limits.acceleration, limits.turn_acceleration])
        done: list[Piece] = []
        turns = 0
        for piece in route(flat, corner=robot.corner, stop_angle=ROVER_STOP, spacing=ROVER_SPACING):
            if isinstance(piece, Hold):
                done.append(still(piece.duration, piece.where, pose))
                continue
            facing = np.unwrap(np.arctan2(piece.tangents[:, 1], piece.tangents[:, 0]))
            spot = _turn(pose, float(facing[0]), float(piece.where[0]), limits)
            if spot is not None:
                done.append(spot)
                turns += 1
            facing += pose[2] + _wrapped(facing[0] - pose[2]) - facing[0]
            path = np.column_stack([piece.points[:, :2], facing])
            allowed = np.minimum(piece.speeds, limits.max_speed)
            done.append(timed(piece.arc, piece.where, path, allowed, velocity, acceleration))
            pose = path[-1]
        step = self.stage.model.opt.timestep
        plan = joined(done or [still(step, (0, len(flat) - 1), pose)], step)
        fast = np.hypot(plan.rates[:, 0], plan.rates[:, 1]) > 0.98 * limits.max_speed
        touched = stretches("speed", fast, plan.where)
        touched += stretches("turning rate", np.abs(plan.rates[:, 2]) > 0.98 * limits.max_turn, plan.where)
        notes = (f"It turned on the spot {turns} times.",) if turns > 1 else ()
        return ControlPlan(plan, unreachable, touched, notes)


def _turn(pose: Array, heading: float, where: float, limits: RoverLimits) -> Piece | None:
    """Turn on the spot towards `heading`, or None where that is not needed."""
    angle = _wrapped(heading - pose[2])
    if abs(angle) < STRAIGHT:
        return None
    arc = np.linspace(0.0, abs(angle), 41)
    poses = pose + np.sign(angle) * arc[:, None] * [0.0, 0.0, 1.0]
    top, there = np.full(len(arc), 0.7 * limits.max_turn), np.full(len(arc), where)
    wide = np.array([1.0, 1.0, limits.max_turn])
    return timed(arc, there, poses, top, wide, np.array([1.0, 1.0, 0.5 * limits.turn_acceleration]))


def _wrapped(angle: float) -> float:
    return float((angle + np.pi) % (2 * np.pi) - np.pi)
