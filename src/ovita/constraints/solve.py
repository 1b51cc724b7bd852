"""From a proposed trajectory to one that keeps the limits, with a verdict on every one of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ovita.constraints import workspace
from ovita.constraints.limits import lower_speeds
from ovita.constraints.obstacles import Obstacle, build
from ovita.constraints.problem import ConstraintCheck, ConstraintOptions, Solution, Status, Verdict
from ovita.constraints.qp import QPSolution, Rows, Weights, solve_qp
from ovita.constraints.verify import verify
from ovita.robot import Robot
from ovita.scene import Scene
from ovita.trajectory import Array, Trajectory

STEPS = 20
"""Most quadratic programs in a row."""

PAD = 5e-6
"""How much further than asked the solver stays away, so that rounding cannot break a limit [m]."""


def constrain(
    proposed: Trajectory,
    scene: Scene,
    robot: Robot,
    *,
    original: Trajectory,
    contacts: Sequence[str] = (),
    options: ConstraintOptions | None = None,
) -> Solution:
    """Bring a proposed trajectory within the limits, moving it as little as possible.

    Nothing is touched when every limit holds and no smoothing is asked for; a path that equals the original's bit
    by bit is never moved (unless `repair_original` or smoothing is asked for), only its speeds are limited.

    Args:
        proposed: What the policy made.
        scene: Its objects are obstacles.
        robot: Whose limits.
        original: The trajectory before the change.
        contacts: Names of objects that are meant to be touched, which are no obstacles.
        options: How to enforce the limits.

    Returns:
        A trajectory with as many waypoints, orientations untouched, and the verdict on it.

    Raises:
        UnknownObject: If a contact is not in the scene.
        ConstraintDefinitionError: If a pinned waypoint does not exist.
    """
    options = options or ConstraintOptions()
    exempt = tuple(dict.fromkeys(scene[name].name for name in contacts))

    def judge(result: Trajectory) -> tuple[ConstraintCheck, ...]:
        return verify(result, scene, robot, proposed=proposed, original=original, contacts=contacts, options=options)

    def answer(result: Trajectory, checks: tuple[ConstraintCheck, ...], status: Status) -> Solution:
        conflicts = explain(checks) if status == "infeasible" else ()
        return Solution(result, _verdict(result, proposed, original, checks, status, exempt, conflicts))

    checks = judge(proposed)
    if not options.enabled:
        return answer(proposed, checks, "off")
    untouched = np.array_equal(proposed.positions, original.positions)
    keep_path = untouched and not options.repair_original and not options.lambda_smooth
    broken = [check for check in checks if not check.held]
    if not broken and not options.lambda_smooth:
        return answer(proposed, checks, "satisfied")
    positions = proposed.positions
    if not keep_path and (options.lambda_smooth or any(check.geometric for check in broken)):
        obstacles = build(scene, robot, contacts=contacts, shape=options.obstacle_shape) if options.obstacles else ()
        positions = _path(proposed.positions, robot, (*workspace.keep_out(robot), *obstacles), options)
    speeds = lower_speeds(
        proposed.speeds,
        positions,
        max_speed=robot.max_speed,
        max_acceleration=options.max_acceleration,
        max_lateral_acceleration=options.max_lateral_acceleration,
    )
    result = proposed.with_(positions=positions, speeds=speeds)
    after = judge(result)
    if all(check.held for check in after):
        return answer(result, after, "repaired" if broken else "satisfied")
    only_old = keep_path and all(check.held or check.geometric for check in after)
    return answer(result, after, "preexisting" if only_old else "infeasible")


def explain(checks: Sequence[ConstraintCheck]) -> tuple[str, ...]:
    """Sentences on the limits that could not be kept."""
    return tuple(
        f"The {check.name} limit ({check.limit}{' of ' + repr(check.subject) if check.subject else ''}) cannot hold; "
        f"relax it, free pinned waypoints, or ask for another path."
        for check in checks
        if not check.held
    )


def _path(reference: Array, robot: Robot, obstacles: Sequence[Obstacle], options: ConstraintOptions) -> Array:
    n = len(reference)
    pins = list(options.pins(n))
    low, high = workspace.bounds(robot)
    lower, upper = np.tile(low, (n, 1)), np.tile(high, (n, 1))
    lower[pins] = upper[pins] = reference[pins]
    smooth = 0.0 if options.lambda_smooth == "auto" else options.lambda_smooth
    weights = Weights(options.lambda_dev, smooth, options.lambda_shape)
    x = workspace.project(robot, reference)
    x[pins] = reference[pins]
    for _ in range(STEPS):
        rows = Rows.join(_ball_rows(x, robot), *(_planes(body, x) for body in obstacles))
        free = ~np.isin(rows.waypoints, pins)
        rows = Rows(rows.waypoints[free], rows.normals[free], rows.offsets[free])
        found: QPSolution = solve_qp(
            reference, weights, lower=lower, upper=upper, rows=rows, slack=1e4 * options.lambda_dev
        )
        if found.x is None:
            break
        step = float(np.abs(found.x - x).max())
        x = found.x
        if step < 1e-7:
            break
    return x


def _ball_rows(x: Array, robot: Robot) -> Rows:
    outer = workspace.ball(robot)
    if outer is None:
        return Rows.none()
    center, radius = outer
    offset = x - center
    distance = np.linalg.norm(offset, axis=1)
    near = np.flatnonzero(distance > 0.9 * radius)
    normals = -offset[near] / distance[near, None]
    return Rows(near, normals, normals @ center - radius + PAD)


def _planes(body: Obstacle, x: Array) -> Rows:
    """Half-spaces that keep every near segment out of an obstacle, each imposed on both ends of the segment."""
    start, end = x[:-1], x[1:]
    near = body.near(start, end, 2.0 * body.reach)
    if not len(near):
        return Rows.none()
    distance, t = body.along(start[near], end[near])
    normals = body.signed(start[near] + t[:, None] * (end[near] - start[near]))[1]
    deep = distance < 0
    for run in _runs(near[deep]):
        normals[np.isin(near, run)] = _way_out(body, x, run)
    offsets = body.support(normals) + PAD
    return Rows(np.concatenate([near, near + 1]), np.tile(normals, (2, 1)), np.tile(offsets, 2))


def _way_out(body: Obstacle, x: Array, run: NDArray[np.intp]) -> Array:
    """A unit normal across the path along which a run of crossing segments leaves an obstacle."""
    chord = x[run[-1] + 1] - x[run[0]]
    length = float(np.linalg.norm(chord))
    along = chord / length if length > 0 else np.zeros(3)
    offset = (x[run] + x[run + 1]).mean(axis=0) / 2.0 - body.center
    across = offset - (offset @ along) * along
    if np.linalg.norm(across) < 1e-3 * body.reach:
        axis = body.rotation[:, np.argmin(np.abs(along @ body.rotation))]
        across = axis - (axis @ along) * along
    return np.asarray(across / np.linalg.norm(across))


def _runs(indices: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    return [run for run in np.split(indices, np.flatnonzero(np.diff(indices) > 1) + 1) if len(run)]


def _verdict(
    result: Trajectory,
    proposed: Trajectory,
    original: Trajectory,
    checks: tuple[ConstraintCheck, ...],
    status: Status,
    exempt: tuple[str, ...],
    conflicts: tuple[str, ...],
) -> Verdict:
    shift = np.linalg.norm(result.positions - proposed.positions, axis=1)
    changed = (shift > 0) | (result.speeds != proposed.speeds)
    undone = None
    if len(proposed) == len(original):
        wanted = float(np.linalg.norm(proposed.positions - original.positions))
        undone = min(float(np.linalg.norm(shift)) / wanted, 1.0) if wanted > 0 else None
    return Verdict(
        status=status,
        checks=checks,
        exempt=exempt,
        conflicts=conflicts,
        max_shift=float(shift.max()),
        waypoints_changed=int(changed.sum()),
        undone=undone,
    )
