"""What samples are drawn from: a trajectory in its scene with its robot, at random or from files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from ovita.augment.legal import Legality
from ovita.bench.generate import SETTINGS, random_scene
from ovita.instruct.scale import Scale
from ovita.io import Task, load_robot
from ovita.paths.geometry import closest_to_point
from ovita.paths.robot import Robot
from ovita.paths.trajectory import Array

TRIES = 50
"""Scenes drawn before the last one is taken whatever its original does to the limits."""


@dataclass(frozen=True)
class Ground:
    """A trajectory in a scene, which samples are drawn from.

    Args:
        name: Such as "random:drone/00012"; samples of one ground share their split.
        task: The trajectory, its scene and the name of its robot.
        robot: The robot's limits.
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
