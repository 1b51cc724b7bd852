"""Planning in the joint space of an arm: RRT-Connect over its joints, valid where the simulated arm touches nothing.

The whole arm keeps clear of the objects (grown by the robot's margin), of the floor and of itself; its tip keeps the
robot's distance and workspace as any path does. Goals are postures found by inverse kinematics from several starts.
The way is shortened, rounded, and passed as fast as the joints' limits and the robot's speed allow (TOPP-RA).
Extras `planning` and `sim`.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from ovita.io.messages import JointMotion
from ovita.limits import ConstraintOptions, verify
from ovita.limits.path import bounds, keep_out
from ovita.limits.problem import is_support, obstacles_of
from ovita.limits.solve import limit_speeds
from ovita.limits.verify import dynamics
from ovita.paths.geometry import path_distances
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Array, Trajectory, arc_length
from ovita.sim import Base, WorldTransform, load_model, place, require
from ovita.sim.arm import DAMPING, STIFFNESS, Kinematics
from ovita.sim.models import ArmLimits, RobotModel, mujoco
from ovita.sim.placement import floor_under
from ovita.sim.timing import timed
from ovita.sim.world import SimWorld, build
from ovita.sources.planner import Plan, PlanRequest, Progress
from ovita.sources.sampling import clearance_of, shortened, solve
from ovita.text import length, number, point

STARTS = 24
"""Postures from which inverse kinematics tries to reach a place."""

ENOUGH = 4
"""Goal postures that are enough."""

REACHED = 1e-3
"""An error of the tip that counts as none [m]."""

STEP = 0.03
"""Largest change of any joint between two checks of a motion [rad]."""

FINE = 0.02
"""Distance of the samples of the timed motion in joint space [rad]."""

ROUND = 6
"""Samples on either side over which corners are rounded."""

SHORTCUTS = 24


@dataclass(frozen=True)
class JointPlanner:
    """Plans for all joints of an arm; see the module.

    Args:
        arm: A simulated arm's name or .toml file.
        base: Where it stands in scene coordinates; None chooses it as `sim.place` does.
    """

    arm: str = "iiwa"
    base: Base | None = None
    name: str = "joint"

    def plan(self, request: PlanRequest, progress: Progress | None = None) -> Plan:
        """Plan from place to place.

        Raises:
            MissingExtra: If the simulation or ompl is not installed.
        """
        require()
        started = time.perf_counter()
        cell = Cell.of(request, load_model(self.arm), self.base)
        rng = np.random.default_rng(request.seed)
        found = cell.postures(request.start.position, rng, None)
        if not found:
            return self._failed(request, started, f"no posture of the arm reaches the start, {request.start.label}")
        rows: list[Array] = [found[0][None]]
        for leg, (a, b) in enumerate(pairwise(request.anchors)):
            if progress is not None:
                progress(f"joint: from {a.label} to {b.label}")
            goals = cell.postures(b.position, rng, rows[-1][-1])
            if not goals:
                return self._failed(request, started, f"no posture of the arm reaches {b.label} without a contact")
            left = request.time_limit - (time.perf_counter() - started)
            way = cell.way(rows[-1][-1], goals, seed=request.seed + 1 + leg, seconds=left, progress=progress)
            if way is None:
                told = f"no way of the arm was found from {a.label} to {b.label} in {number(request.time_limit)} s"
                return self._failed(request, started, told)
            rows.append(way[1:])
        return _timed(self.name, request, cell, np.vstack(rows), started)

    def _failed(self, request: PlanRequest, started: float, why: str) -> Plan:
        text = f"{why[:1].upper()}{why[1:]}; allow more time, move the base or the objects, or name another place."
        return Plan(self.name, request, problems=(text,), seconds=time.perf_counter() - started)


class Cell:
    """An arm among the objects of a scene, asked for contacts.

    Args:
        base: Where it stands in scene coordinates.
        stage: The simulator's world; the objects are grown by the robot's margin.
    """

    def __init__(self, request: PlanRequest, model: RobotModel, base: Base, stage: SimWorld) -> None:
        assert isinstance(model.limits, ArmLimits)
        self.request, self.model, self.base, self.stage, self.limits = request, model, base, stage, model.limits
        self.world = WorldTransform(request.scene.frame)
        self.data: Any = mujoco.MjData(stage.model)
        self.box = (stage.model.jnt_range[:, 0].copy(), stage.model.jnt_range[:, 1].copy())
        robot = request.robot
        self.clearance = clearance_of(robot, [*keep_out(robot), *obstacles_of(request.scene, robot)], None)
        self.lower, self.upper = bounds(robot)
        corners = self.world.trajectory(Trajectory(request.corners, np.zeros(len(request.corners))))
        self.kinematics = Kinematics(stage, model.limits, corners, "free")

    @classmethod
    def of(cls, request: PlanRequest, model: RobotModel, base: Base | None) -> Cell:
        """The cell of a request, the arm placed where it reaches most of the straight way."""
        chosen = base or _base_of(request, model)
        grown = replace(request.scene, objects=tuple(_grown(o, request.robot.obstacle_margin) for o in request.scene))
        return cls(request, model, chosen, stage_of(model, grown, chosen, request))

    def tip(self, joints: Sequence[float] | Array) -> Array:
        """Where the tip is, (3,) [m] in the scene's coordinates; moves the simulated arm there."""
        self.data.qpos[:] = joints
        mujoco.mj_kinematics(self.stage.model, self.data)
        return np.array(self.data.site_xpos[self.stage.tip] * self.world.signs)

    def free(self, joints: Sequence[float]) -> bool:
        """Whether a posture touches nothing and its tip is where a path may be."""
        tip = self.tip(joints)
        if (tip < self.lower - 1e-6).any() or (tip > self.upper + 1e-6).any() or self.clearance(tip.tolist()) < 0.0:
            return False
        mujoco.mj_comPos(self.stage.model, self.data)
        mujoco.mj_collision(self.stage.model, self.data)
        return not self.data.ncon

    def problem(self, joints: Sequence[float]) -> str | None:
        """What speaks against a posture, in words: where the tip is, or which link is too near to what, and where."""
        if self.free(joints):
            return None
        tip = self.tip(joints)
        here = f"its tip at {point(np.round(tip, 2))}"
        if (tip < self.lower - 1e-6).any() or (tip > self.upper + 1e-6).any():
            return f"{here} is out of the workspace"
        if self.clearance(tip.tolist()) < 0.0:
            near = min(self.request.scene, key=lambda item: float(item.clearance(tip[None])[0]), default=None)
            return f"{here} is out of the workspace{f' or too near to {near.name}' if near else ''}"
        contact = self.data.contact[int(np.argmin(self.data.contact.dist))]
        first, second = (self._named(int(geom)) for geom in contact.geom)
        where = point(np.round(contact.pos * self.world.signs, 2))
        return f"{first} and {second} are too near to each other at {where}"

    def _named(self, geom: int) -> str:
        stage = self.stage
        return stage.objects.get(geom) or ("the floor" if geom == stage.floor else stage.link(geom))

    def blocked(self, a: Array, b: Array) -> str | None:
        """What speaks against a straight motion of the joints first."""
        count = int(np.ceil(np.abs(b - a).max() / STEP)) + 1
        rows = (a + share * (b - a) for share in np.linspace(0.0, 1.0, count))
        return next((told for told in (self.problem(row.tolist()) for row in rows) if told), None)

    def passable(self, a: Sequence[float], b: Sequence[float]) -> bool:
        """Whether a straight motion of the joints is free, checked every `STEP`."""
        first, second = np.asarray(a), np.asarray(b)
        count = int(np.ceil(np.abs(second - first).max() / STEP)) + 1
        order = np.argsort([bin(k)[:1:-1] for k in range(1, count + 1)], kind="stable")  # coarse first
        shares = (order + 1) / count
        return all(self.free(first + share * (second - first)) for share in shares)

    def postures(self, position: Array, rng: np.random.Generator, near: Array | None) -> list[Array]:
        """Postures (J,) [rad] that bring the tip to a place (3,) [m] without a contact, up to `ENOUGH`."""
        target = (position * self.world.signs)[None]
        low, high = self.box
        tried = [*([near] if near is not None else []), *(np.array(p) for p in self.limits.postures)]
        tried += [rng.uniform(0.7 * low, 0.7 * high) for _ in range(STARTS)]
        found: list[Array] = []
        for guess in tried:
            joints = np.clip(self.kinematics.follow(target, None, guess)[0], low, high)
            reached = float(np.linalg.norm(self.tip(joints) - position)) < REACHED
            if reached and self.free(joints):
                found.append(joints)
            if len(found) >= ENOUGH or (found and near is None):
                break
        return found

    def way(
        self, start: Array, goals: Sequence[Array], *, seed: int, seconds: float, progress: Progress | None
    ) -> Array | None:
        """Postures (K, J) from the start to one of the goals, straight motions between them, or None."""
        near = min(goals, key=lambda goal: float(np.abs(goal - start).max()))
        if self.passable(start.tolist(), near.tolist()):
            return np.array([start, near])
        ends, left = [goal.tolist() for goal in goals], max(seconds, 0.01)
        how: Any = {"seed": seed, "seconds": left, "passable": self.passable, "progress": progress}
        path = solve("rrt_connect", self.box, self.free, start.tolist(), ends, **how)
        return None if path is None else shortened(path, self.passable, SHORTCUTS)


def stage_of(model: RobotModel, scene: Scene, base: Base, request: PlanRequest) -> SimWorld:
    """The simulator's world with an arm on its base and the objects of a scene."""
    world = WorldTransform(scene.frame)
    around, stood = world.scene(scene), world.base(base)
    low = float((request.corners * world.signs)[:, 2].min())
    return build(model, around, stood, min(stood.z, floor_under(low, world.scene(request.scene))))


def _grown(item: SceneObject, margin: float) -> SceneObject:
    """An object with a margin all around; a support as it is, since arms grasp what stands on it."""
    return item if is_support(item) else replace(item, dimensions=item.size + 2.0 * margin)


def _timed(name: str, request: PlanRequest, cell: Cell, corners: Array, started: float) -> Plan:
    """The way as a motion of the joints and a path of the tip, within the limits, verified."""
    joints = rounded(cell, corners)
    arc = arc_length(joints)
    tips = np.array([cell.tip(row) for row in joints])
    steps = np.gradient(arc_length(tips), arc)
    allowed = request.cruise / np.maximum(steps, 1e-3)
    velocity, acceleration = np.array(cell.limits.velocity), np.array(cell.limits.acceleration)
    piece = timed(arc, np.linspace(0.0, 1.0, len(arc)), joints, allowed, velocity, acceleration)
    tips[0], tips[-1] = request.start.position, request.goal.position
    options = ConstraintOptions(fix_start=True, fix_goal=True, repair_original=True)
    speeds = limit_speeds(piece.speeds * steps, tips, dynamics(request.robot, options))
    path = Trajectory(tips, speeds)
    checks = verify(path, request.scene, request.robot, proposed=path, original=path, options=options)
    broken = [(f"{c.name} limit ({c.limit})", f"{number(c.violation_after)} {c.unit}") for c in checks if not c.held]
    problems = tuple(f"The tip breaks the {limit} by {amount}; try another seed." for limit, amount in broken)
    times = np.maximum.accumulate(path.times + 1e-6 * np.arange(len(path)))
    motion = JointMotion(cell.stage.joints, joints, times, None, request.scene.frame)
    b = cell.base
    where = f"The {cell.model.title} stands at --base {b.x:.3f},{b.y:.3f},{b.z:.3f},{b.yaw:.3f}."
    passed = [float(path_distances(tips, anchor.position[None])[0]) for anchor in request.via]
    by = [f"Its tip passes {a.label} at {length(d)}." for a, d in zip(request.via, passed, strict=True) if d > 0.005]
    seconds = time.perf_counter() - started
    return Plan(name, request, path, checks, problems, (where, *by), seconds, motion)


def rounded(cell: Cell, corners: Array) -> Array:
    """Samples (M, J) along a way with rounded corners, as far as that touches nothing."""
    arc = arc_length(corners)
    even = np.linspace(0.0, arc[-1], max(int(np.ceil(arc[-1] / FINE)), 8) + 1)
    rows = np.column_stack([np.interp(even, arc, corners[:, j]) for j in range(corners.shape[1])])
    window = np.bartlett(2 * ROUND + 3)[1:-1]
    window /= window.sum()
    before = 2.0 * rows[0] - rows[ROUND:0:-1]
    behind = 2.0 * rows[-1] - rows[-2 : -ROUND - 2 : -1]
    padded = np.vstack([before, rows, behind])
    smooth = np.column_stack([np.convolve(padded[:, j], window, mode="valid") for j in range(rows.shape[1])])
    smooth[0], smooth[-1] = rows[0], rows[-1]
    fine = all(cell.passable(a, b) for a, b in pairwise(smooth.tolist()))
    return smooth if fine else rows


def touched(plan: Plan, arm: str = "iiwa", base: Base | None = None) -> tuple[dict[str, float], float]:
    """What a simulated arm touches when it follows a plan's joints in physics, by depth [m], and its worst error [rad].

    The objects have their own size; torques cancel gravity and inertia and pull onto the motion.
    """
    assert plan.motion is not None
    request, model = plan.request, load_model(arm)
    stage = stage_of(model, request.scene, base or _base_of(request, model), request)
    data: Any = mujoco.MjData(stage.model)
    times, rows = plan.motion.times, plan.motion.positions
    dt = float(stage.model.opt.timestep)
    moments = np.arange(0.0, float(times[-1]) + 0.2, dt)
    wanted = np.column_stack([np.interp(moments, times, rows[:, j]) for j in range(rows.shape[1])])
    rates = np.gradient(wanted, dt, axis=0)
    data.qpos[:] = wanted[0]
    torque, worst = np.zeros(stage.model.nv), 0.0
    found: dict[str, float] = {}
    low, high = stage.model.actuator_ctrlrange.T
    for q, v in zip(wanted, rates, strict=True):
        mujoco.mj_step1(stage.model, data)
        error = q - data.qpos
        worst = max(worst, float(np.abs(error).max()))
        mujoco.mj_mulM(stage.model, data, torque, STIFFNESS * error + DAMPING * (v - data.qvel))
        data.ctrl[:] = np.clip(torque + data.qfrc_bias - data.qfrc_passive, low, high)
        for (a, b), depth in zip(data.contact.geom.tolist(), (-data.contact.dist).tolist(), strict=True):
            what = stage.objects.get(a) or stage.objects.get(b) or ("floor" if stage.floor in (a, b) else "itself")
            found[what] = max(found.get(what, 0.0), depth)
        mujoco.mj_step2(stage.model, data)
    return found, worst


def _base_of(request: PlanRequest, model: RobotModel) -> Base:
    """Where an arm reaches most of the straight way."""
    line = Trajectory(request.corners, np.full(len(request.corners), 0.1)).resample(20)
    base = place([line], request.scene, model, request.robot)
    assert base is not None
    return base
