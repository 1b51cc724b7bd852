"""The constraint module as a planner: the straight way, moved as little as the limits need.

It goes around obstacles by a visibility graph and pulls the path back to the straight line as far as the limits let it
(see `limits.solve`), so it is deterministic and takes milliseconds. Where so few waypoints cannot go around something,
they are spread along the shortest legal polyline instead.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ovita.limits.path import PathProblem, ball, bounds
from ovita.limits.qp import Weights
from ovita.limits.route import find_route
from ovita.paths.trajectory import Array
from ovita.sources.places import obstacles
from ovita.sources.planner import Plan, PlanRequest, Progress, finished


@dataclass(frozen=True)
class LimitsPlanner:
    """Plans by repairing the straight way; see the module."""

    name: str = "limits"

    def plan(self, request: PlanRequest, progress: Progress | None = None) -> Plan:
        """Plan; seed and time limit do not matter."""
        started = time.perf_counter()
        if progress is not None:
            progress("going around obstacles")
        found = finished(request, request.corners, range(len(request.anchors)), self.name, started)
        if found.ok:
            return found
        route = legal_polyline(request)
        if route is None:
            return replace(found, seconds=time.perf_counter() - started)
        again = finished(request, *route, self.name, started)
        return again if again.ok else replace(found, seconds=again.seconds)


def legal_polyline(request: PlanRequest) -> tuple[Array, list[int]] | None:
    """The shortest legal polyline (K, 3) [m] and which of its vertices are start, via points and goal, or None."""
    robot, corners = request.robot, request.corners
    lower, upper = bounds(robot)
    if robot.planar:
        lower[2] = upper[2] = corners[0, 2]
    problem = PathProblem(corners, Weights(), lower, upper, obstacles(request.scene, robot), ball(robot))
    rows, anchors = [corners[:1]], [0]
    for a, b in pairwise(corners):
        between = find_route(problem, a, b)
        if isinstance(between, str):
            return None
        rows += [between, b[None]]
        anchors.append(anchors[-1] + len(between) + 1)
    return np.vstack(rows), anchors
