"""The limits on one ground: looked at first by bounds that are cheap and safe, and enforced only where these fail."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ovita.limits import constrain
from ovita.limits.obstacles import Obstacle, build
from ovita.limits.speed import too_bent, too_quick
from ovita.paths.geometry import lengths
from ovita.paths.robot import Box, Robot
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory


@dataclass(frozen=True)
class Legality:
    """The limits that a robot and a scene impose on changes of a trajectory.

    Args:
        original: The trajectory before the change.
        scene: Its objects are obstacles.
        robot: Whose limits.
    """

    original: Trajectory
    scene: Scene
    robot: Robot

    def holds(self, proposed: Trajectory, contacts: Sequence[str] = ()) -> bool:
        """Whether every limit surely holds; False means that `constrain` has to look.

        Where it is True, `limits.constrain` finds every limit satisfied and leaves the trajectory as it is.
        """
        positions = proposed.positions
        if self.robot.min_speed > 0.0 or not self._inside(positions) or not self._paced(proposed):
            return False
        if self.robot.planar and not np.array_equal(positions[:, 2], np.full(len(positions), self._level)):
            return False
        return self._clear(positions, contacts)

    def enforced(self, proposed: Trajectory, contacts: Sequence[str] = ()) -> tuple[Trajectory, str]:
        """The trajectory within the limits, and the status of the verdict on it, as `limits.constrain` has them."""
        if self.holds(proposed, contacts):
            return proposed, "satisfied"
        solution = constrain(proposed, self.scene, self.robot, original=self.original, contacts=contacts)
        return solution.trajectory, solution.verdict.status

    def only_speeds(self, proposed: Trajectory, contacts: Sequence[str] = ()) -> bool:
        """Whether the path surely keeps the limits, so that speeds are all that may have to be lowered."""
        return self._inside(proposed.positions) and self._clear(proposed.positions, contacts)

    @property
    def _level(self) -> float:
        return float(self.original.positions[0, 2])

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
        if along is not None and float(too_quick(proposed, along).max(initial=0.0)) > 0.0:
            return False
        return across is None or float(too_bent(proposed, across).max(initial=0.0)) <= 0.0

    @cached_property
    def _bodies(self) -> tuple[tuple[Obstacle, ...], Array, Array]:
        """The obstacles with the centres (K, 3) and radii (K,) of balls that hold them with the distance to keep."""
        bodies = build(self.scene, self.robot)
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
                if float(bodies[k].along(start[some], end[some])[0].min()) < 1e-9:
                    return False
        return True
