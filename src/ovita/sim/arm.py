"""An arm: differential inverse kinematics, joint limits, and computed torques."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from ovita.errors import RobotError
from ovita.paths.geometry import Mask
from ovita.paths.scene import quaternion
from ovita.paths.trajectory import Array, Trajectory
from ovita.sim import timing
from ovita.sim.models import ArmLimits, RobotModel, mujoco
from ovita.sim.world import SimWorld

Orientation = Literal["auto", "free", "keep"]

STOP_ANGLE = np.radians(100.0)
SPACING = 0.005
NEAR = 1e-3
"""A waypoint farther than this from the nearest point that the arm reaches counts as unreachable [m]."""

CLOSE, STUCK = 1e-4, 1e-8
"""Within CLOSE of a point [m], or when a step gains less than STUCK [m], one more step is made: it squares the error,
so that what is left does not show up as noise in the joints' accelerations."""

RELAX = 0.5
"""Along this length of path the arm relaxes towards its posture, as far as the tip leaves it free [m]."""

LEVENBERG = 1.0
"""Damping by the squared error, so that the arm does not swing where it stretches towards a point beyond reach."""

STIFFNESS, DAMPING = 900.0, 60.0
"""Of the computed torque: acceleration per rad [1/s^2] and per rad/s [1/s] of error."""


class Arm:
    """Follows a trajectory with its tip.

    Inverse kinematics is solved by mink along the path, each solution from the one before, as a quadratic program under
    the joints' positions and steps; the posture that reaches most waypoints is kept. TOPP-RA then slows the path down
    where a joint would be too fast. The torques cancel gravity and inertia and pull back onto the plan.

    Args:
        trajectory: In the simulator's coordinates.
        orientation: "auto" keeps to the trajectory's orientations if it has any and is else free; "free" ignores them;
            "keep" holds the tip as it is at the start.
    """

    def __init__(
        self, robot: RobotModel, stage: SimWorld, trajectory: Trajectory, orientation: Orientation = "auto"
    ) -> None:
        assert isinstance(robot.limits, ArmLimits)
        self.stage, self.limits = stage, robot.limits
        _check(robot, robot.limits, stage.model.nv)
        pieces = timing.route(trajectory, corner=robot.corner, stop_angle=STOP_ANGLE, spacing=SPACING)
        self.kinematics = Kinematics(stage, robot.limits, trajectory, orientation)
        first, unreachable = self.kinematics.choose()
        self.intent = self._plan(pieces, trajectory, first, unreachable)
        self._torque = np.zeros(stage.model.nv)
        self._low, self._high = stage.model.actuator_ctrlrange.T

    def pose(self, data: Any, step: int) -> None:
        """Set the joints to the plan."""
        data.qpos[:] = self.intent.plan.coordinates[step]

    def act(self, data: Any, step: int) -> bool:
        """Computed torque: M(q) (q'' + kp e + kd e') + bias."""
        plan = self.intent.plan
        wanted = plan.accelerations[step] + STIFFNESS * (plan.coordinates[step] - data.qpos)
        wanted += DAMPING * (plan.rates[step] - data.qvel)
        mujoco.mj_mulM(self.stage.model, data, self._torque, wanted)
        torque = self._torque + data.qfrc_bias - data.qfrc_passive
        data.ctrl[:] = np.minimum(np.maximum(torque, self._low), self._high)
        return bool((np.abs(data.ctrl - torque) <= 1e-9).all())

    def _plan(
        self,
        pieces: list[timing.Move | timing.Hold],
        trajectory: Trajectory,
        joints: Array,
        unreachable: tuple[timing.Unreachable, ...],
    ) -> timing.ControlPlan:
        velocity, acceleration = np.array(self.limits.velocity), np.array(self.limits.acceleration)
        done: list[timing.Piece] = []
        for piece in pieces:
            if isinstance(piece, timing.Hold):
                done.append(timing.still(piece.duration, piece.where, joints))
                continue
            path = self.kinematics.follow(piece.points, trajectory.orientations_at(piece.where), joints)
            path[0], joints = joints, path[-1]
            done.append(timing.timed(piece.arc, piece.where, path, piece.speeds, velocity, acceleration))
        plan = timing.joined(done, self.stage.model.opt.timestep)
        limits: list[timing.Touched] = []
        at_end, fast = _at_limit(self.stage, plan.coordinates), np.abs(plan.rates) > 0.98 * velocity
        for j, name in enumerate(self.stage.joints):
            limits += timing.stretches(f"{name} position", at_end[:, j], plan.where)
            limits += timing.stretches(f"{name} speed", fast[:, j], plan.where)
        return timing.ControlPlan(plan, unreachable, tuple(limits))


class Kinematics:
    """Inverse kinematics of an arm on its base along a trajectory in the simulator's coordinates; see `Arm`."""

    def __init__(self, stage: SimWorld, limits: ArmLimits, trajectory: Trajectory, orientation: Orientation) -> None:
        import mink

        self._mink = mink
        self.stage, self.trajectory, self.postures = stage, trajectory, [np.array(p) for p in limits.postures]
        self.keep, self.turned = orientation == "keep", trajectory.orientations is not None and orientation == "auto"
        self.configuration = mink.Configuration(stage.model)
        frame = stage.model.site(stage.tip).name
        weight = 0.2 if self.keep or self.turned else 0.0
        self._reach = mink.FrameTask(frame, "site", position_cost=1.0, orientation_cost=weight, lm_damping=LEVENBERG)
        self._only_reach = mink.FrameTask(frame, "site", position_cost=1.0, orientation_cost=0.0, lm_damping=LEVENBERG)
        self._posture = mink.PostureTask(stage.model, cost=1e-3)
        names = [stage.model.joint(j).name for j in range(stage.model.njnt)]
        self._bounds = [
            mink.ConfigurationLimit(stage.model),
            mink.VelocityLimit(stage.model, dict(zip(names, limits.velocity, strict=True))),
        ]
        self._rest = self.postures[0]
        self._held: Array | None = None

    def choose(self) -> tuple[Array, tuple[timing.Unreachable, ...]]:
        """Joints (J,) [rad] at the start of the best posture, and the waypoints that it cannot reach."""
        points = self.trajectory.positions
        best: tuple[tuple[int, int, float], Array, Array, Array] | None = None
        for posture in self.postures:
            path = self._from(posture)
            left = np.array([self._miss(q, p) for q, p in zip(path, points, strict=True)])
            missed, struck = int((left > NEAR).sum()), sum(self._struck(q) for q in path)
            cost = missed, struck, float(np.abs(np.diff(path, axis=0)).max(axis=1).sum())
            if best is None or cost < best[0]:
                best = cost, path, left, posture
            if missed == struck == 0:
                break
        assert best is not None
        _, path, left, self._rest = best
        self._hold(path[0])
        far = np.flatnonzero(left > NEAR).tolist()
        return path[0], tuple(timing.Unreachable(i, float(left[i]), self._reason(path[i], points[i])) for i in far)

    def _from(self, posture: Array) -> Array:
        """Joints (N, J) [rad] along the trajectory, begun near a posture."""
        points, turns = self.trajectory.positions, self.trajectory.orientations
        self._rest = posture
        self._posture.set_target(posture)
        turn = turns[0] if self.turned and turns is not None else None
        first = self._solve(points[0], turn, posture, 200, settle=1e-6)
        self._hold(first)
        return self.follow(points, turns, first)

    def _hold(self, joints: Array) -> None:
        """Keep the tip turned as it is with these joints, if it is to be kept."""
        if self.keep:
            self.configuration.update(joints)
            self._held = self._turn()

    def follow(self, points: Array, turns: Array | None, start: Array) -> Array:
        """Joints (M, J) [rad] along points (M, 3) [m] with orientations (M, 4), each solved from the one before."""
        path = np.empty((len(points), len(start)))
        low, high = self.stage.model.jnt_range.T
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        guess = start
        for i, point in enumerate(points):
            turn = self._held if self.keep else turns[i] if self.turned and turns is not None else None
            now = path[i - 1] if i else start
            share = 1.0 - np.exp(-steps[i - 1] / RELAX) if i else 0.0
            self._posture.set_target(now + share * (self._rest - now))
            path[i] = guess = self._solve(point, turn, guess, 30)
            if 0 < i < len(points) - 1 and steps[i - 1] > 0:
                ahead = path[i] + (path[i] - path[i - 1]) * min(steps[i] / steps[i - 1], 2.0)
                guess = np.where(self.stage.model.jnt_limited, np.clip(ahead, low, high), ahead)
        return path

    def _solve(self, point: Array, turn: Array | None, start: Array, steps: int, settle: float = np.inf) -> Array:
        mink = self._mink
        self.configuration.update(start)
        rotation = mink.SO3.identity() if turn is None else mink.SO3(np.asarray(turn))
        target = mink.SE3.from_rotation_and_translation(rotation, point)
        self._only_reach.set_target(target)
        if turn is None:
            self._approach([self._only_reach, self._posture], point, steps, settle=settle)
        else:
            self._reach.set_target(target)
            self._approach([self._reach, self._posture], point, steps, settle=1e-6)
            self._approach([self._only_reach], point, steps, settle=np.inf)
        return np.array(self.configuration.q)

    def _approach(self, tasks: list[Any], point: Array, steps: int, *, settle: float) -> None:
        """Step until the tip is at the point and the last step is below `settle` [rad], or nothing gets better."""
        before, last, near = np.inf, np.inf, False
        for _ in range(steps):
            miss = float(np.linalg.norm(self.configuration.data.site_xpos[self.stage.tip] - point))
            if last <= settle and (miss < CLOSE or abs(before - miss) < STUCK):
                if near:
                    return
                near = True
            velocity = self._mink.solve_ik(
                self.configuration, tasks, dt=1.0, solver="daqp", damping=1e-10, limits=self._bounds
            )
            self.configuration.integrate_inplace(velocity, 1.0)
            before, last = miss, float(np.abs(velocity).max())

    def _turn(self) -> Array:
        return quaternion(self.configuration.data.site_xmat[self.stage.tip].reshape(3, 3))

    def _struck(self, joints: Array) -> bool:
        """Whether the arm touches the floor or itself."""
        self.configuration.update(joints)
        mujoco.mj_collision(self.stage.model, self.configuration.data)
        geoms = self.configuration.data.contact.geom.tolist()
        return any(a not in self.stage.objects and b not in self.stage.objects for a, b in geoms)

    def _miss(self, joints: Array, point: Array) -> float:
        self.configuration.update(joints)
        return float(np.linalg.norm(self.configuration.data.site_xpos[self.stage.tip] - point))

    def _reason(self, joints: Array, point: Array) -> str:
        shoulder, _, reach = self.stage.shoulder()
        self.configuration.update(joints)
        distance = float(np.linalg.norm(point - self.configuration.data.xanchor[shoulder]))
        if distance > reach:
            return f"it is {distance:.3f} m from the shoulder and the arm is {reach:.3f} m long"
        stuck = [name for name, at_end in zip(self.stage.joints, _at_limit(self.stage, joints), strict=True) if at_end]
        if stuck:
            return f"joint {', '.join(stuck)} at its limit"
        return f"it is {distance:.3f} m from the shoulder, and no posture of the arm brings its tip there"


def _at_limit(stage: SimWorld, joints: Array) -> Mask:
    """Which joints (..., J) are at an end of their range."""
    low, high = stage.model.jnt_range.T
    return np.asarray(((joints < low + 1e-3) | (joints > high - 1e-3)) & (stage.model.jnt_limited > 0))


def _check(robot: RobotModel, limits: ArmLimits, joints: int) -> None:
    for key in ("velocity", "acceleration"):
        if len(getattr(limits, key)) != joints:
            raise RobotError(f"{robot.name}: {key} has {len(getattr(limits, key))} values, the arm has {joints} joints")
    if not limits.postures or any(len(posture) != joints for posture in limits.postures):
        raise RobotError(f"{robot.name}: give at least one posture, with a value for each of the {joints} joints")
