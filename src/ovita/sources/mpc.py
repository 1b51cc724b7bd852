"""Model predictive control: what a rover or drone would really drive along a legal reference; the rollout is the plan.

The reference is planned by the constraint module with some room more around obstacles. At each step the controller
minimises the error to the reference and the effort over a horizon,

    sum_k |z_k - r_k|_Q^2 + |u_k|_R^2   subject to   z_k+1 = A_k z_k + B_k u_k + c_k,   |u_k| <= u_max,
                                                     v.z_k <= v_max,   n.z_k >= support of each obstacle near r_k (soft)

as a dense quadratic program in the inputs (PIQP), and applies the first input to the model: a double integrator for a
drone, a unicycle, linearised along the reference, for a rover. The reference waits where the robot falls behind.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from ovita.limits import ConstraintOptions, constrain, verify
from ovita.limits.problem import Obstacle
from ovita.paths.geometry import lengths, path_distances
from ovita.paths.robot import Robot
from ovita.paths.trajectory import TIMESTEP, Array, Trajectory
from ovita.sim.models import DroneLimits, RoverLimits, load_model
from ovita.sources.places import obstacles
from ovita.sources.planner import LimitsPlanner, Plan, PlanRequest, Progress
from ovita.text import length

HORIZON = 15
"""Steps of `TIMESTEP` that the controller looks ahead."""

ROOMS = (0.04, 0.0)
"""How much more than asked for the reference keeps from obstacles [m], tried in order."""

LAG = 0.08
"""The reference waits for a robot that is so far behind [m]."""

SHARE = 0.9
"""Of the robot's limits that the controller uses, so that the sampled rollout keeps them too."""

ARRIVED = 0.002
"""A robot within five times this of the goal [m], slower than ten times this [m/s], is there."""

CLOSE, PRICE = 0.4, 1e3
"""Obstacles within CLOSE [m] of the reference count; breaking their planes costs PRICE per metre."""


@dataclass(frozen=True)
class DoubleIntegrator:
    """A drone: position and velocity (6,), its input the acceleration (3,)."""

    acceleration: float
    top: float

    @property
    def weights(self) -> tuple[Array, Array]:
        """Q of the state's error (n,) and R of the inputs (m,)."""
        return np.array([60.0] * 3 + [4.0] * 3), np.full(3, 0.02)

    @property
    def most(self) -> Array:
        """Largest inputs (m,)."""
        return np.full(3, self.acceleration / np.sqrt(3.0))

    def state(self, path: Trajectory, moments: Array, rate: float) -> Array:
        """States (K, n) that the path asks for at some moments, at a share of its speed."""
        at = path.at(moments)
        ahead = path.at(moments + 0.05 * TIMESTEP).positions - path.at(moments - 0.05 * TIMESTEP).positions
        directions = ahead / np.maximum(lengths(ahead), 1e-12)[:, None]
        return np.hstack([at.positions, rate * at.speeds[:, None] * directions])

    def linear(self, z: Array) -> tuple[Array, Array, Array]:
        """A (n, n), B (n, m) and c (n,) of the model near a state."""
        a, b = np.eye(6), np.zeros((6, 3))
        a[:3, 3:] = TIMESTEP * np.eye(3)
        b[:3], b[3:] = 0.5 * TIMESTEP**2 * np.eye(3), TIMESTEP * np.eye(3)
        return a, b, np.zeros(6)

    def step(self, z: Array, u: Array) -> Array:
        """The state one timestep later."""
        a, b, _ = self.linear(z)
        return np.asarray(a @ z + b @ u)

    def speed(self, z: Array) -> tuple[Array, float]:
        """The speed's gradient (n,) and its largest value [m/s]."""
        size = float(np.linalg.norm(z[3:]))
        return np.concatenate([np.zeros(3), z[3:] / max(size, 1e-9)]), self.top

    def behind(self, z: Array, r: Array) -> float:
        """How well the robot keeps up with a state of the reference: 1 it does, 0 the reference has to wait."""
        return float(np.clip(1.0 - np.linalg.norm(z[:3] - r[:3]) / LAG, 0.0, 1.0))


@dataclass(frozen=True)
class Unicycle:
    """A rover: x, y, heading and speed (4,); its inputs acceleration and turning rate (2,)."""

    acceleration: float
    top: float
    turning: float
    level: float

    @property
    def weights(self) -> tuple[Array, Array]:
        """Q and R."""
        return np.array([60.0, 60.0, 4.0, 4.0]), np.array([0.02, 0.05])

    @property
    def most(self) -> Array:
        """Largest inputs."""
        return np.array([self.acceleration, self.turning])

    def state(self, path: Trajectory, moments: Array, rate: float) -> Array:
        """What the path asks for."""
        at = path.at(moments)
        ahead = path.at(moments + 0.5 * TIMESTEP).positions - path.at(moments - 0.5 * TIMESTEP).positions
        moving = lengths(ahead) > 1e-9
        heading = np.arctan2(ahead[:, 1], ahead[:, 0])
        first = int(np.argmax(moving)) if moving.any() else 0
        for k in range(len(heading)):  # where it stands, the heading is that of the last step
            heading[k] = heading[k] if moving[k] else heading[max(k - 1, first) if k else first]
        return np.column_stack([at.positions[:, :2], np.unwrap(heading), rate * at.speeds])

    def linear(self, z: Array) -> tuple[Array, Array, Array]:
        """The model near a state."""
        dt, (_, _, heading, v) = TIMESTEP, z
        cos, sin = np.cos(heading), np.sin(heading)
        a, b = np.eye(4), np.zeros((4, 2))
        a[0, 2:], a[1, 2:] = (-v * sin * dt, cos * dt), (v * cos * dt, sin * dt)
        b[3, 0], b[2, 1] = dt, dt
        return a, b, np.array([v * sin * heading * dt, -v * cos * heading * dt, 0.0, 0.0])

    def step(self, z: Array, u: Array) -> Array:
        """One timestep on."""
        fine, parts = TIMESTEP / 10.0, 10
        for _ in range(parts):
            x, y, heading, v = z
            v_next = max(v + fine * u[0], 0.0)
            middle, way = heading + 0.5 * fine * u[1], fine * 0.5 * (v + v_next)
            z = np.array([x + way * np.cos(middle), y + way * np.sin(middle), heading + fine * u[1], v_next])
        return z

    def speed(self, z: Array) -> tuple[Array, float]:
        """The speed, linear in the state."""
        return np.array([0.0, 0.0, 0.0, 1.0]), self.top

    def behind(self, z: Array, r: Array) -> float:
        """1 where it keeps up, 0 where the reference has to wait."""
        off = float(np.clip(1.0 - np.linalg.norm(z[:2] - r[:2]) / LAG, 0.0, 1.0))
        return off * max(float(np.cos(z[2] - r[2])), 0.0)


VehicleModel: TypeAlias = DoubleIntegrator | Unicycle
"""A model in discrete time with a state z (n,) whose first entries are the position, and inputs u (m,)."""


@dataclass(frozen=True)
class TrackingPlanner:
    """Plans what a controlled rover or drone does; see the module."""

    name: str = "mpc"

    def plan(self, request: PlanRequest, progress: Progress | None = None) -> Plan:
        """Plan; the trajectory has a waypoint every timestep."""
        started = time.perf_counter()
        if progress is not None:
            progress("planning the reference")
        reference = _reference(request)
        if reference.trajectory is None or not reference.ok:
            return replace(reference, planner=self.name, seconds=time.perf_counter() - started)
        vehicle = _vehicle(request.robot, request)
        bodies = obstacles(request.scene, request.robot)
        most = min(4.0 * reference.trajectory.duration + 10.0, 600.0)
        states = rollout(vehicle, reference.trajectory, bodies, most, started + request.time_limit, progress)
        if states is None:
            why = f"The controller did not come to the goal within {most:.0f} s on the way or the time limit"
            return Plan(self.name, request, problems=(f"{why}; allow more.",), seconds=time.perf_counter() - started)
        return _measured(self.name, request, vehicle, reference.trajectory, states, started)


def _reference(request: PlanRequest) -> Plan:
    """A legal way with some room to err, if there is one."""
    robot = request.robot
    vehicle = _limits(robot)
    acceleration = SHARE * 0.5 * min(robot.max_acceleration or np.inf, vehicle.acceleration)
    bends = min(robot.max_lateral_acceleration or np.inf, 0.5 * vehicle.acceleration)
    careful = replace(robot, max_acceleration=acceleration, max_lateral_acceleration=bends)
    for room in ROOMS:
        margins = {name: getattr(robot, name) + room for name in ("obstacle_margin", "person_margin")}
        roomy = replace(request, robot=replace(careful, **margins), speed=SHARE * request.cruise)
        found = LimitsPlanner().plan(roomy)
        if found.ok:
            break
    return replace(found, request=request)


def _limits(robot: Robot) -> RoverLimits | DroneLimits:
    """The simulated vehicle that stands for a robot."""
    limits = load_model("jackal" if robot.planar else "crazyflie").limits
    assert isinstance(limits, RoverLimits | DroneLimits)
    return limits


def _vehicle(robot: Robot, request: PlanRequest) -> VehicleModel:
    limits = _limits(robot)
    acceleration = SHARE * min(robot.max_acceleration or np.inf, limits.acceleration)
    top = SHARE * min(robot.max_speed or np.inf, limits.max_speed)
    if isinstance(limits, RoverLimits):
        return Unicycle(acceleration, top, SHARE * limits.max_turn, float(request.start.position[2]))
    return DoubleIntegrator(acceleration, top)


def rollout(
    vehicle: VehicleModel,
    path: Trajectory,
    bodies: Sequence[Obstacle],
    most: float,
    until: float,
    progress: Progress | None = None,
) -> Array | None:
    """States (T, n) of a vehicle that follows a path, one a `TIMESTEP`, or None if it does not arrive.

    The path goes from rest to rest. It gives up after the longest drive, `most` [s], or at a time of
    `time.perf_counter`, `until` [s].
    """
    ahead: Array = TIMESTEP * np.arange(1, HORIZON + 1, dtype=np.float64)
    z = vehicle.state(path, np.zeros(1), 0.0)[0]
    states, clock, rate = [z], 0.0, 1.0
    for k in range(int(most / TIMESTEP)):
        asked = vehicle.state(path, clock + rate * ahead, rate)
        z = vehicle.step(z, _control(vehicle, z, asked, path, clock + rate * ahead, bodies))
        states.append(z)
        rate = max(vehicle.behind(z, vehicle.state(path, np.array([clock + rate * TIMESTEP]), rate)[0]), 0.05)
        clock += rate * TIMESTEP
        if clock >= path.duration and _arrived(states, path.positions[-1]):
            return np.array(states)
        if progress is not None and k % 50 == 0:
            progress(f"mpc: {clock:.1f} of {path.duration:.1f} s")
        if time.perf_counter() > until:
            return None
    return None


def _arrived(states: Sequence[Array], goal: Array) -> bool:
    """Whether the last state is at the goal, nearly at rest."""
    dims = 2 if len(states[-1]) == 4 else 3
    moved = float(np.linalg.norm(states[-1][:dims] - states[-2][:dims])) / TIMESTEP
    away = float(np.linalg.norm(states[-1][:dims] - goal[:dims]))
    return away < 5.0 * ARRIVED and moved < 10.0 * ARRIVED


def _control(
    vehicle: VehicleModel, z: Array, asked: Array, path: Trajectory, moments: Array, bodies: Sequence[Obstacle]
) -> Array:
    """The first input of the quadratic program over the horizon."""
    import piqp

    n, m = len(z), len(vehicle.most)
    turned = asked.copy()
    if n == 4:  # headings within half a turn of the robot's
        turned[:, 2] += 2.0 * np.pi * np.round((z[2] - asked[0, 2]) / (2.0 * np.pi))
    free, gain = np.zeros((HORIZON, n)), np.zeros((HORIZON, n, HORIZON * m))
    last, effect = z, np.zeros((n, HORIZON * m))
    for k in range(HORIZON):
        a, b, c = vehicle.linear(turned[k])
        last, effect = a @ last + c, a @ effect
        effect[:, k * m : (k + 1) * m] += b
        free[k], gain[k] = last, effect
    q, r = (np.tile(weight, HORIZON) for weight in vehicle.weights)
    stacked, error = gain.reshape(-1, HORIZON * m), (free - turned).ravel()
    rows, lows = _rows(vehicle, free, gain, turned, path, moments, bodies)
    soft = len(rows) - HORIZON
    size = HORIZON * m + soft
    p, cost = np.zeros((size, size)), np.full(size, PRICE)
    p[: HORIZON * m, : HORIZON * m] = stacked.T @ (q[:, None] * stacked) + np.diag(r)
    cost[: HORIZON * m] = stacked.T @ (q * error)
    p[HORIZON * m :, HORIZON * m :] = 1e-6 * np.eye(soft)
    g = np.hstack([rows, np.vstack([np.zeros((HORIZON, soft)), np.eye(soft)])])
    bound = np.concatenate([np.tile(vehicle.most, HORIZON), np.full(soft, np.inf)])
    least = np.concatenate([-np.tile(vehicle.most, HORIZON), np.zeros(soft)])
    solver = piqp.DenseSolver()
    solver.setup(np.asfortranarray(p), cost, None, None, np.asfortranarray(g), lows, None, least, bound)
    if solver.solve() != piqp.PIQP_SOLVED:
        return np.zeros(m) if n != 4 else np.array([-vehicle.most[0], 0.0])  # brake
    return np.asarray(np.clip(np.array(solver.result.x)[:m], -vehicle.most, vehicle.most))


def _rows(
    vehicle: VehicleModel,
    free: Array,
    gain: Array,
    asked: Array,
    path: Trajectory,
    moments: Array,
    bodies: Sequence[Obstacle],
) -> tuple[Array, Array]:
    """Rows (HORIZON + S, inputs) and their lowest values: speeds, then the planes of obstacles near the reference."""
    rows, lows = [], []
    for k in range(HORIZON):
        gradient, top = vehicle.speed(asked[k])
        rows.append(-gradient @ gain[k])
        lows.append(gradient @ free[k] - top)
    at = path.at(moments).positions
    dims = 2 if free.shape[1] == 4 else 3
    for body in bodies:
        distance, normals = body.signed(at)
        for k in np.flatnonzero(distance < CLOSE).tolist():
            normal = normals[k]
            if np.linalg.norm(normal[:dims]) < 1e-6:
                continue
            inside = float(body.support(normal[None])[0]) - float(normal[dims:] @ at[k, dims:])
            rows.append(normal[:dims] @ gain[k][:dims])
            lows.append(inside - float(normal[:dims] @ free[k][:dims]))
    return np.array(rows), np.array(lows)


def _measured(
    name: str, request: PlanRequest, vehicle: VehicleModel, reference: Trajectory, states: Array, started: float
) -> Plan:
    """The rollout as a trajectory, within the limits, verified, with its tracking error told."""
    if isinstance(vehicle, Unicycle):
        positions = np.column_stack([states[:, :2], np.full(len(states), vehicle.level)])
        speeds = states[:, 3]
    else:
        positions, speeds = states[:, :3], lengths(states[:, 3:6])
    still = lengths(np.diff(positions, axis=0)) < 1e-5
    keep = np.concatenate([[True], ~still])
    positions, speeds = positions[keep], speeds[keep]
    positions[0], speeds[0] = request.start.position, 0.0
    positions = np.vstack([positions, request.goal.position])
    rolled = Trajectory(positions, np.append(speeds, 0.0))
    error = float(path_distances(reference.positions, rolled.positions).max())
    options = ConstraintOptions(fix_start=True, fix_goal=True, repair_original=True)
    solution = constrain(rolled, request.scene, request.robot, original=rolled, options=options)
    path = solution.trajectory
    checks = verify(path, request.scene, request.robot, proposed=rolled, original=rolled, options=options)
    problems = () if all(check.held for check in checks) else solution.verdict.conflicts
    moved = solution.verdict.max_shift
    passed = [float(path_distances(path.positions, anchor.position[None])[0]) for anchor in request.via]
    notes = [f"The rollout stays within {length(error)} of its reference."]
    notes += [f"It passes {a.label} at {length(d)}." for a, d in zip(request.via, passed, strict=True) if d > 0.01]
    notes += [f"The limits moved it by up to {length(moved)}."] if moved > 1e-6 else []
    return Plan(name, request, path, checks, problems, tuple(notes), time.perf_counter() - started)
