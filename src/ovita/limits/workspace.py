"""The workspace as the solver sees it: bounds on each axis, a ball to stay in, a ball to keep out of.

Paper: a box lower + delta <= x_i <= upper - delta, or a spherical shell r_min + delta <= |x_i - c| <= r_max - delta.
The box and the ball of r_max are convex: if two waypoints are inside, so is the segment between them. The ball of
r_min is an obstacle like any other.
"""

from __future__ import annotations

import numpy as np

from ovita.limits.convex_sets import Ball
from ovita.limits.obstacles import Obstacle
from ovita.paths.robot import Box, Robot, Shell
from ovita.paths.trajectory import Array


def bounds(robot: Robot) -> tuple[Array, Array]:
    """Lowest and highest legal coordinate, (3,) and (3,) [m]; infinite where the workspace has no flat wall."""
    if not isinstance(robot.workspace, Box):
        return np.full(3, -np.inf), np.full(3, np.inf)
    lower = np.asarray(robot.workspace.lower) + robot.margin
    upper = np.asarray(robot.workspace.upper) - robot.margin
    flat = np.abs(upper - lower) < 1e-12
    middle = (lower + upper) / 2.0
    return np.where(flat, middle, lower), np.where(flat, middle, upper)


def ball(robot: Robot) -> Ball | None:
    """The ball that the path must stay in: a manipulator's reach less the margin."""
    if not isinstance(robot.workspace, Shell):
        return None
    return Ball(robot.workspace.center, robot.workspace.r_max - robot.margin, "reach")


def keep_out(robot: Robot) -> tuple[Obstacle, ...]:
    """The inner sphere of a shell as an obstacle, if there is one."""
    shell = robot.workspace
    if not isinstance(shell, Shell) or shell.r_min <= 0:
        return ()
    radius = shell.r_min + robot.margin
    return (Obstacle(np.asarray(shell.center), np.eye(3), np.zeros(3), radius, "workspace", "workspace"),)
