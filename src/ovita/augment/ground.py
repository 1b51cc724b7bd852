"""What samples are drawn from: a trajectory in its scene with its robot, at random or from files.

Its limits are looked at first by bounds that are cheap and safe, and enforced only where these fail.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from ovita.bench.generate import SETTINGS, random_scene
from ovita.instruct.degrees import Scale
from ovita.io import Task, load_robot
from ovita.limits.problem import ConstraintOptions, Obstacle, obstacles_of
from ovita.limits.solve import limit_speeds
from ovita.limits.verify import dynamics, too_bent, too_quick
from ovita.measure.predicates.check import Pair
from ovita.paths.geometry import closest_to_point, lengths
from ovita.paths.robot import Box, Robot
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory
from ovita.policy.sandbox import reach

TRIES = 50
"""Scenes drawn before the last one is taken whatever its original does to the limits."""

ROUNDING = 1e-12
"""How far a speed may be beyond a limit to which it was lowered [m/s]; `limits` lets a millionth pass."""


@dataclass(frozen=True)
class Legality:
    """The limits that a robot and a scene impose on changes of a trajectory."""

    original: Trajectory
    scene: Scene
    robot: Robot

    def holds(self, proposed: Trajectory, contacts: Sequence[str] = ()) -> bool:
        """Whether every limit surely holds; False means that `constrain` has to look.

        Where it is True, `limits.constrain` finds every limit satisfied and leaves the trajectory as it is.
        """
        return self.steady(proposed) and self.clear(proposed.positions, contacts)

    def clear(self, positions: Array, contacts: Sequence[str] = ()) -> bool:
        """Whether a path (N, 3) [m] surely is in the workspace and clear of the objects."""
        return self._inside(positions) and self._clear(positions, contacts)

    def steady(self, proposed: Trajectory) -> bool:
        """Whether the limits on speeds surely hold, and a robot that drives stays on its plane."""
        heights = proposed.positions[:, 2]
        if self.robot.min_speed > 0.0 or (self.robot.planar and not (heights == self.original.positions[0, 2]).all()):
            return False
        return self._paced(proposed)

    def slowed(self, proposed: Trajectory) -> Trajectory | None:
        """As `limits.constrain` lowers the speeds on a legal path; None where that has to look itself."""
        if self.robot.min_speed > 0.0 or not self.unbroken:
            return None
        limits = dynamics(self.robot, ConstraintOptions())
        slower = proposed.with_(speeds=limit_speeds(proposed.speeds, proposed.positions, limits))
        return slower if self.steady(slower) else None

    @cached_property
    def unbroken(self) -> bool:
        """Whether the original surely keeps every limit, so that it excuses nothing."""
        return self.holds(self.original)

    def _inside(self, positions: Array) -> bool:
        """Whether the path is in the workspace; that is convex but for a shell's core, which a step could cut."""
        space = self.robot.workspace
        if space is None:
            return True
        depth = float(space.inside(positions).min()) - self.robot.margin
        if isinstance(space, Box):
            return depth >= 0.0
        return depth >= 0.5 * float(lengths(np.diff(positions, axis=0)).max(initial=0.0))

    def _paced(self, proposed: Trajectory) -> bool:
        robot = self.robot
        if robot.max_speed is not None and float(proposed.speeds.max()) > robot.max_speed:
            return False
        along, across = robot.max_acceleration, robot.max_lateral_acceleration
        if along is not None and float(too_quick(proposed, along).max(initial=0.0)) > ROUNDING:
            return False
        return across is None or float(too_bent(proposed, across).max(initial=0.0)) <= ROUNDING

    @cached_property
    def _bodies(self) -> tuple[tuple[Obstacle, ...], Array, Array]:
        """The obstacles with the centres (K, 3) and radii (K,) of balls that hold them with the distance to keep."""
        bodies = obstacles_of(self.scene, self.robot)
        centres = np.array([body.center for body in bodies]).reshape(-1, 3)
        radii = np.array([float(np.linalg.norm(body.half)) + body.radius for body in bodies])
        return bodies, centres, radii

    def _clear(self, positions: Array, contacts: Sequence[str]) -> bool:
        """Whether every segment is clear of every obstacle: of the balls around them, else of the bodies themselves."""
        bodies, centres, radii = self._bodies
        if not bodies:
            return True
        start, end = positions[:-1], positions[1:]
        middles, half = (start + end) / 2.0, 0.5 * lengths(end - start)
        offsets = middles[:, None, :] - centres[None]
        reach = np.sqrt(np.einsum("nkd,nkd->nk", offsets, offsets)) - half[:, None]
        near = reach < radii[None] + 1e-9
        for k in np.flatnonzero(near.any(axis=0)):
            if bodies[k].name not in contacts:
                some = near[:, k]
                if bodies[k].hit(start[some], end[some], 1e-9).any():
                    return False
        return True


@dataclass(frozen=True)
class Ground:
    """A trajectory in a scene, which samples are drawn from.

    Args:
        name: Such as "random:drone/00012"; samples of one ground share their split.
        task: The trajectory, its scene and the name of its robot.
        visit: How many blocks of samples were drawn from it before this one.
    """

    name: str
    task: Task
    robot: Robot
    visit: int = 0

    @cached_property
    def extent(self) -> float:
        """Diagonal of the box around the path [m]."""
        return Scale.of(self.task.trajectory).extent

    @cached_property
    def flat(self) -> bool:
        """Whether the robot stays on a plane."""
        return self.robot.planar

    @cached_property
    def distances(self) -> Mapping[str, Array]:
        """The sorted distances (N,) of the waypoints from each object's centre [m]."""
        path = self.task.trajectory.positions
        return {item.name: np.sort(item.distance(path)) for item in self.task.scene}

    @cached_property
    def closest(self) -> Mapping[str, float]:
        """How near the path comes to each object's surface, or to the centre of one without dimensions [m]."""
        path = self.task.trajectory.positions
        return {
            item.name: item.cuboid.closest(path)[0]
            if item.dimensions is not None
            else closest_to_point(path, item.position)[0]
            for item in self.task.scene
        }

    @cached_property
    def rows(self) -> Array:
        """The trajectory (N, 4) as policies get it; not to be changed."""
        return self.task.trajectory.to_array()

    @cached_property
    def unchanged(self) -> Pair:
        """The trajectory beside itself, by which a check is judged that doing nothing must not pass."""
        return Pair(self.rows, self.rows, self.task.scene)

    @cached_property
    def reach(self) -> tuple[Array, float]:
        """The middle of the scene (3,) [m], and how far from it a policy's path may lie [m]."""
        return reach(self.task.trajectory, self.task.scene)

    @cached_property
    def legality(self) -> Legality:
        """The limits that hold here."""
        return Legality(self.task.trajectory, self.task.scene, self.robot)


class GroundPool(Protocol):
    """Grounds by the number of the block that is drawn from them; it is pickled to the workers."""

    def ground(self, seed: int, block: int) -> Ground:
        """The ground of a block, which depends on the seed and the block alone."""
        ...

    def describe(self) -> Sequence[Mapping[str, str]]:
        """Each source with its name and what identifies it, for the manifest."""
        ...

    @property
    def repeats(self) -> bool:
        """Whether later blocks come back to a ground, so that near duplicates may lie in different blocks."""
        ...


@dataclass(frozen=True)
class RandomScenes:
    """Random scenes of the benchmark's generator, one a block.

    Args:
        scales: Of `SETTINGS`: tabletop, drone, ground, arm; taken in turn.
        waypoints: How many each path has; None takes the scale's own range.
    """

    scales: tuple[str, ...] = tuple(SETTINGS)
    waypoints: int | None = None

    @property
    def repeats(self) -> bool:
        """No scene is drawn twice."""
        return False

    def describe(self) -> Sequence[Mapping[str, str]]:
        """The generator and its scales."""
        count = "" if self.waypoints is None else f", {self.waypoints} waypoints"
        return [{"name": f"random:{scale}", "what": f"ovita.bench.generate{count}"} for scale in self.scales]

    def ground(self, seed: int, block: int) -> Ground:
        """A scene whose original keeps the limits."""
        scale = self.scales[block % len(self.scales)]
        setting = SETTINGS[scale]
        if self.waypoints is not None:
            setting = replace(setting, waypoints=(self.waypoints, self.waypoints))
        rng = np.random.default_rng([seed, 18, block])
        robot = load_robot(setting.robot)
        for _ in range(TRIES):
            trajectory, scene = random_scene(rng, setting, "heldout" if block % 2 else "train")
            task = Task(trajectory, scene, robot=None if setting.robot == "none" else setting.robot)
            ground = Ground(f"random:{scale}/{block:08d}", task, robot)
            if len(scene) >= 2 and ground.legality.holds(trajectory):
                break
        return ground


@dataclass(frozen=True)
class Tasks:
    """Trajectories that are given, taken in turn, block after block.

    Args:
        tasks: Each with the name of its source, and what identifies its content.
    """

    tasks: tuple[tuple[str, Task, str], ...]

    @property
    def repeats(self) -> bool:
        """Each task is drawn from again and again."""
        return True

    def describe(self) -> Sequence[Mapping[str, str]]:
        """The files."""
        return [{"name": name, "what": what} for name, _, what in self.tasks]

    def ground(self, seed: int, block: int) -> Ground:
        """The task whose turn it is."""
        name, task, _ = self.tasks[block % len(self.tasks)]
        return Ground(name, task, load_robot(task.robot or "none"), block // len(self.tasks))


@dataclass(frozen=True)
class Mixed:
    """Several pools, taken in turn."""

    pools: tuple[GroundPool, ...]

    @property
    def repeats(self) -> bool:
        """Whether one of them does."""
        return any(pool.repeats for pool in self.pools)

    def describe(self) -> Sequence[Mapping[str, str]]:
        """All of them."""
        return [one for pool in self.pools for one in pool.describe()]

    def ground(self, seed: int, block: int) -> Ground:
        """That of the pool whose turn it is."""
        return self.pools[block % len(self.pools)].ground(seed, block // len(self.pools))
