"""Running a robot along a trajectory."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ovita.errors import RequestError, TrajectoryError, needs
from ovita.paths.robot import Box, Robot, Shell
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory
from ovita.sim.arm import Arm, Orientation
from ovita.sim.disturbances import CALM, Disturbances, Plant
from ovita.sim.models import RobotModel, load_model, mujoco
from ovita.sim.placement import Base, WorldTransform, arm_base, floor_under, start_base
from ovita.sim.report import Log, Report, assess
from ovita.sim.timing import Controller, MotionPlan
from ovita.sim.vehicles import Drone, Rover
from ovita.sim.world import Motion, SimWorld, build

FRAME_RATE = 50.0
FRAMES = 10_000
"""Most frames of a motion; longer ones are sampled more rarely."""

SETTLE = 0.4
"""Time for a rover to come to rest on its wheels before it starts [s]."""

CONTROLLERS: dict[str, Callable[[RobotModel, SimWorld, Trajectory, Base, Orientation], Controller]] = {
    "arm": lambda robot, stage, path, base, orientation: Arm(robot, stage, path, orientation),
    "rover": lambda robot, stage, path, base, orientation: Rover(robot, stage, path, base),
    "drone": lambda robot, stage, path, base, orientation: Drone(robot, stage, path, base),
}

Name = str | os.PathLike[str] | RobotModel


@dataclass(frozen=True)
class Simulation:
    """One simulated motion.

    Args:
        motion: Poses over time, in the scene's coordinates.
        states: (T, Q) MuJoCo's positions at the motion's times.
        frames: (T,) the plan's steps at the motion's times.
    """

    motion: Motion
    report: Report
    stage: SimWorld
    states: Array
    plan: MotionPlan
    frames: Array


@dataclass(frozen=True)
class _Ready:
    model: RobotModel
    path: Trajectory
    world: WorldTransform
    base: Base
    stage: SimWorld
    controller: Controller


def simulate(
    trajectory: Trajectory,
    scene: Scene | None = None,
    robot: Name = "iiwa",
    *,
    base: Base | None = None,
    limits: Robot | None = None,
    orientation: Orientation = "auto",
    solid: bool = False,
    contacts: Sequence[str] = (),
    disturbances: Disturbances = CALM,
    progress: Callable[[float], None] | None = None,
) -> Simulation:
    """Let a robot follow a trajectory in MuJoCo.

    Args:
        trajectory: In the scene's coordinates.
        scene: Its objects become bodies.
        robot: A shipped robot's name, a .toml file, or a model.
        base: Pose of the robot's base in scene coordinates; None chooses it, see `place`.
        limits: The robot limits that the trajectory was adapted to; their workspace is shown, and where it is a shell
            an arm is placed in its centre if that suits.
        orientation: Of an arm's tip: "auto" follows the trajectory's orientations if there are any, "free" leaves it
            open, "keep" holds it as at the start.
        solid: Whether objects push back. Otherwise contact is detected and reported, but not felt.
        contacts: Objects that are meant to be touched.
        disturbances: Noise, delay, lag, payload and wind, which the robot's controller knows nothing of.
        progress: Called with the share done, 0..1.

    Raises:
        RobotError: If the robot is unknown or its files are malformed.
        RequestError: If the base is out of reach of the whole trajectory.
        TrajectoryError: If the trajectory goes nowhere.
        MissingExtra: If the simulator is not installed.
    """
    scene = scene or Scene()
    ready = _ready(trajectory, scene, robot, base, limits, orientation, solid)
    free = ready.model.controller != "arm"
    plant = None if disturbances.calm else Plant(ready.stage, disturbances, ready.world.signs, free)
    log = _run(ready.stage, ready.controller, plant, progress)
    oriented = not free and orientation == "auto" and trajectory.orientations is not None
    meant, intent = {scene[name].name for name in contacts if name in scene}, ready.controller.intent
    report = assess(ready.model, intent, log, ready.path, ready.base, oriented=oriented, meant=meant)
    if plant is not None:
        report = replace(report, notes=(disturbances.told, *report.notes))
    states, frames = np.array(log.states), np.array(log.frames)
    return Simulation(_motion(ready, log), report, ready.stage, states, intent.plan, frames)


def preview(
    trajectory: Trajectory,
    scene: Scene | None = None,
    robot: Name = "iiwa",
    *,
    base: Base | None = None,
    limits: Robot | None = None,
    orientation: Orientation = "auto",
) -> Motion:
    """How a robot means to follow a trajectory, without physics: fast enough to be drawn while someone waits.

    The arguments and errors are those of `simulate`. A drone is drawn upright.
    """
    ready = _ready(trajectory, scene or Scene(), robot, base, limits, orientation, False)
    model, steps = ready.stage.model, len(ready.controller.intent.plan)
    data = mujoco.MjData(model)
    log = Log(np.empty((steps, 3)), np.empty((0, 9)), np.zeros(0))
    every = _every(model.opt.timestep, steps)
    for step in sorted({*range(0, steps, every), steps - 1}):
        ready.controller.pose(data, step)
        mujoco.mj_kinematics(model, data)
        _record(log, data, step, ready.stage)
    return _motion(ready, log)


def place(trajectories: Sequence[Trajectory], scene: Scene, robot: Name, limits: Robot | None = None) -> Base | None:
    """A base for an arm from which it reaches most waypoints of several trajectories, in the scene's coordinates.

    None for robots that move about, which start where their trajectory does.

    Raises:
        RobotError: If the robot is unknown or its files are malformed.
        MissingExtra: If the simulator is not installed.
    """
    require()
    model = robot if isinstance(robot, RobotModel) else load_model(robot)
    if model.controller != "arm":
        return None
    world = WorldTransform(scene.frame)
    paths = [world.trajectory(t).positions for t in trajectories]
    return world.base(_place(model, paths, world.scene(scene), None, _turned(limits, world), world)[0])


def require(*packages: str) -> None:
    """Check that packages of the extra `sim` are installed; without a name, the simulator's.

    Raises:
        MissingExtra: If one is not.
    """
    for package in packages or ("mujoco", "toppra", "mink", "daqp"):
        with needs(package, "sim"):
            __import__(package)


def _ready(
    trajectory: Trajectory,
    scene: Scene,
    robot: Name,
    base: Base | None,
    limits: Robot | None,
    orientation: Orientation,
    solid: bool,
) -> _Ready:
    require()
    model = robot if isinstance(robot, RobotModel) else load_model(robot)
    world = WorldTransform(scene.frame)
    path, around, within = world.trajectory(trajectory), world.scene(scene), _turned(limits, world)
    if path.duration <= 0:
        raise TrajectoryError("the trajectory goes nowhere: all waypoints are at one place and there is no dwell")
    asked = None if base is None else world.base(base)
    stood, ground = _place(model, [path.positions], around, asked, within, world)
    stage = build(model, around, stood, ground, solid=solid, workspace=within)
    controller = CONTROLLERS[model.controller](model, stage, path, stood, orientation)
    missed = controller.intent.unreachable
    if len(missed) == len(path):
        nearest = min(missed, key=lambda item: item.distance)
        where = f"no waypoint is within reach of the {model.title} at {world.base(stood).describe()}"
        far = f"waypoint {nearest.waypoint + 1}, {nearest.distance:.2f} m away: {nearest.reason}"
        raise RequestError(f"{where}; the nearest is {far}; choose another --base")
    return _Ready(model, path, world, world.base(stood), stage, controller)


def _place(
    model: RobotModel,
    paths: Sequence[Array],
    scene: Scene,
    base: Base | None,
    limits: Robot | None,
    world: WorldTransform,
) -> tuple[Base, float]:
    """Base and height of the ground for paths (N, 3), in the simulator's coordinates."""
    low = float(min(path[:, 2].min() for path in paths))
    floor = floor_under(low, scene)
    if model.controller == "arm":
        chosen = base or _arm_base(model, paths, scene, limits)
        return chosen, min(chosen.z, floor)
    rolls = model.controller == "rover"
    start = start_base(paths[0], float(np.median(paths[0][:, 2])) if rolls else min(low - 0.03, floor))
    start = start if rolls else replace(start, yaw=0.0, how="under the start of the trajectory")
    if base is None:
        return start, start.z
    away = float(np.hypot(base.x - start.x, base.y - start.y))
    if away > 0.05:
        start = world.base(start)
        where = f"the base is {away:.2f} m from the start of the trajectory; a {model.controller} starts there"
        hint = f"--base {start.x:.3f},{start.y:.3f},z,yaw for another height of the ground or another heading"
        raise RequestError(f"{where}, so leave --base out, or give {hint}")
    return base, base.z


def _arm_base(model: RobotModel, paths: Sequence[Array], scene: Scene, limits: Robot | None) -> Base:
    return arm_base(list(paths), scene, limits, *build(model, Scene(), Base(), 0.0).shoulder()[1:])


def _turned(limits: Robot | None, world: WorldTransform) -> Robot | None:
    """The workspace in the simulator's coordinates."""
    if limits is None or limits.workspace is None:
        return None
    space = limits.workspace
    if isinstance(space, Shell):
        return replace(limits, workspace=replace(space, center=tuple((np.array(space.center) * world.signs).tolist())))
    ends = np.array([space.lower, space.upper]) * world.signs
    low, high = (tuple(end.tolist()) for end in (ends.min(axis=0), ends.max(axis=0)))
    return replace(limits, workspace=Box(low, high))


def _every(timestep: float, steps: int) -> int:
    return max(1, round(1.0 / FRAME_RATE / timestep), int(np.ceil(steps / FRAMES)))


def _run(stage: SimWorld, controller: Controller, plant: Plant | None, progress: Callable[[float], None] | None) -> Log:
    model, data = (stage.model, mujoco.MjData(stage.model)) if plant is None else (plant.model, plant.data)
    controller.pose(data, 0)
    if stage.rolls:
        mujoco.mj_step(model, data, int(SETTLE / model.opt.timestep))
    steps = len(controller.intent.plan)
    every = _every(model.opt.timestep, steps)
    log = Log(np.empty((steps, 3)), np.empty((steps, 9)), np.zeros(steps, dtype=bool))
    for step in range(steps):
        mujoco.mj_step1(model, data)
        log.weak[step] = not controller.act(data if plant is None else plant.sense(), step)
        if plant is not None:
            plant.drive()
        log.tips[step] = data.site_xpos[stage.tip]
        log.turns[step] = data.site_xmat[stage.tip]
        if step % every == 0 or step == steps - 1:
            _record(log, data, step, stage)
            if progress is not None:
                progress((step + 1) / steps)
        if data.ncon:
            _touches(stage, data, step, log.contacts)
        mujoco.mj_step2(model, data)
    return log


def _record(log: Log, data: Any, step: int, stage: SimWorld) -> None:
    bodies = list(stage.bodies)
    log.frames.append(step)
    log.states.append(data.qpos.copy())
    log.poses.append((data.xpos[bodies], data.xquat[bodies]))
    log.tips[step] = data.site_xpos[stage.tip]


def _touches(stage: SimWorld, data: Any, step: int, found: dict[tuple[str, ...], tuple[int, int, float]]) -> None:
    """Note contacts of the robot with objects, its own links, or the floor (which wheels are meant to touch)."""
    for (a, b), distance in zip(data.contact.geom.tolist(), data.contact.dist.tolist(), strict=True):
        on_floor = stage.floor in (a, b)
        if on_floor and stage.rolls:
            continue
        name = stage.objects.get(a) or stage.objects.get(b) or ("floor" if on_floor else "")
        key = (name,) if name else ("itself", *sorted((stage.link(a), stage.link(b))))
        first, _, depth = found.get(key, (step, step, 0.0))
        found[key] = (first, step, max(depth, -distance))


def _motion(ready: _Ready, log: Log) -> Motion:
    plan, world, frames = ready.controller.intent.plan, ready.world, np.array(log.frames)
    places, turns = (np.array(part) for part in zip(*log.poses, strict=True))
    poses, where = (places * world.signs, world.turned(turns)), plan.where[frames]
    asked, tips = ready.path.time_at(where), log.tips[frames] * world.signs
    return Motion(ready.stage.names, plan.times[frames], *poses, where, asked, tips, ready.stage.shapes())
