"""From a proposed trajectory to one that keeps the limits, with a verdict on every one of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ovita.limits import custom, diagnosis, paper
from ovita.limits.custom import ConvexSet, KeepOut
from ovita.limits.path import PAD, PathProblem, ball, bounds, flatten, keep_out
from ovita.limits.problem import (
    TOLERANCE,
    ConstraintCheck,
    ConstraintOptions,
    Obstacle,
    Solution,
    Status,
    Verdict,
    in_the_way,
    obstacles_of,
)
from ovita.limits.qp import Weights, smooth_axes
from ovita.limits.route import Blocked, legal_path
from ovita.limits.sequential import STEPS, improve
from ovita.limits.verify import FLAT, Dynamics, Measure, Worst, bend_speed, compare, dynamics, measure_all, plane
from ovita.paths.geometry import lengths, path_distances
from ovita.paths.robot import Robot, Shell
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory, arc_length
from ovita.text import called_as

RANGE = (1e-3, 1e1)
"""Of the ratio lambda_smooth / lambda_dev; the paper's range."""


@called_as("constrain(proposed, scene, robot, original=before)")
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

    Nothing is touched when every limit holds and no smoothing is asked for; a path that runs along the
    original is never moved (unless `repair_original` or smoothing is asked for), only its speeds are limited.

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
        ConstraintDefinitionError: If a pinned waypoint does not exist, or a custom constraint is none.
        MissingExtra: If method "paper" is to search its weights and optuna is not installed.
    """
    return _Task(proposed, scene, robot, original, tuple(contacts), options or ConstraintOptions()).solve()


TIP_ONLY = (
    "Only the tip's path was checked, not the arm's joints: ovita simulate says whether they reach it, and what its"
    " links touch."
)


@dataclass(frozen=True)
class _Task:
    proposed: Trajectory
    scene: Scene
    robot: Robot
    original: Trajectory
    contacts: tuple[str, ...]
    options: ConstraintOptions

    def solve(self) -> Solution:
        for candidate in self.options.custom:
            custom.check(candidate)
        if not self.options.enabled:
            return self.answer(self.proposed, self.judge(self.proposed), "off")
        if self.options.method == "paper":
            return self.as_published()
        if not self.pressing and not self.options.lambda_smooth:
            status: Status = "preexisting" if self.broken else "satisfied"
            return self.answer(self.proposed, self.judge(self.proposed), status)
        return self.repaired()

    def repaired(self) -> Solution:
        """The nearest trajectory that keeps the limits, or the best effort."""
        options, notes = self.options, tuple[str, ...]()
        if options.lambda_smooth == "auto":
            options, notes = choose_smoothing(self.proposed, self.problem(options), options)
        smooth = bool(options.lambda_smooth)
        untouched = _runs_along(self.proposed.positions, self.original.positions)
        keep_path = untouched and not options.repair_original and not smooth
        move = not keep_path and (smooth or any(m.geometric for m in self.pressing))
        for height in self.heights if move else (None,):
            problem = self.problem(options, height)
            result, blocked = self.reached(problem, move=move)
            after = self.judge(result)
            broken = [m for m, check in zip(self.measured[0], after, strict=True) if not check.held]
            left = [m for m in broken if not (m.excused(result) or (keep_path and m.geometric))]
            if not left:
                status: Status = "preexisting" if broken else "repaired" if self.broken else "satisfied"
                return self.answer(result, after, status, notes=notes)
        conflicts = diagnosis.explain(problem, self.robot, after, blocked, self.options)
        return self.answer(result, after, "infeasible", conflicts, notes)

    def reached(self, problem: PathProblem, *, move: bool) -> tuple[Trajectory, tuple[Blocked, ...]]:
        """The proposal, moved if need be and slowed, and what stays blocked."""
        positions, blocked = self.proposed.positions, tuple[Blocked, ...]()
        if move:
            positions, blocked = solve_with_dwells(problem, int(self.options.steps))
        return self.proposed.with_(positions=positions, speeds=self.speeds(positions, problem.weights)), blocked

    @cached_property
    def broken(self) -> list[Measure]:
        """The limits that the proposal breaks."""
        return [m for m, (amount, _) in zip(*self.measured, strict=True) if amount > TOLERANCE]

    @cached_property
    def pressing(self) -> list[Measure]:
        """Those of them that it breaks worse than the original path."""
        return [m for m in self.broken if not m.excused(self.proposed)]

    @property
    def heights(self) -> tuple[float | None, ...]:
        """Planes to try, each by its height z [m]: that of a planar robot, or of a level change, then none."""
        own = plane(self.robot, self.original)
        heights = np.concatenate([self.original.positions[:, 2], self.proposed.positions[:, 2]])
        if own is None and np.ptp(heights) <= FLAT:
            own = float(heights[0])
        return (own,) if own is None or self.robot.planar else (own, None)

    def as_published(self) -> Solution:
        """The paper's module, judged by ours."""
        result, notes = paper.solve(self.proposed, self.scene, self.robot, self.contacts, self.options)
        after = self.judge(result)
        if all(check.held for check in after):
            return self.answer(result, after, "repaired" if self.broken else "satisfied", notes=notes)
        left = ", ".join(dict.fromkeys(f"'{c.subject}'" if c.subject else c.name for c in after if not c.held))
        conflict = f"The published module leaves a limit broken ({left}); method 'verified' looks further."
        return self.answer(result, after, "infeasible", (conflict,), notes)

    def problem(self, options: ConstraintOptions, level: float | None = None) -> PathProblem:
        """The path's part of the problem, on the plane z = level [m] if it is given."""
        lower, upper = bounds(self.robot)
        if self._stays_above_ground(lower, upper, level):
            lower[2] = 0.0
        if level is not None and lower[2] <= level <= upper[2]:
            lower[2] = upper[2] = level
        empty = lower > upper  # margins that eat the workspace up: its middle is the best effort
        lower[empty] = upper[empty] = (lower[empty] + upper[empty]) / 2.0
        smooth = 0.0 if options.lambda_smooth == "auto" else options.lambda_smooth
        regions = [*ball(self.robot), *(c for c in options.custom if isinstance(c, ConvexSet))]
        return PathProblem(
            reference=self.proposed.positions,
            weights=Weights(options.lambda_dev, smooth, options.lambda_shape),
            lower=lower,
            upper=upper,
            bodies=flatten(self.bodies(options), lower, upper),
            regions=tuple(region.shrunk(PAD) for region in regions),
            pins=options.pins(len(self.proposed)),
            rows=tuple(c.rows for c in options.custom if not isinstance(c, KeepOut | ConvexSet)),
        )

    def _stays_above_ground(self, lower: Array, upper: Array, level: float | None) -> bool:
        """Whether z = 0 is the floor where no workspace has one, so that nothing is put right underground."""
        upright = self.scene.frame.direction("up")[2] > 0.5
        above = self.proposed.positions[:, 2].min() >= 0.0 and upper[2] > 0.0 and (level is None or level >= 0.0)
        return bool(upright and above and np.isneginf(lower[2]))

    def bodies(self, options: ConstraintOptions) -> list[Obstacle]:
        """What every segment must stay out of."""
        bodies = [*keep_out(self.robot), *(c.body for c in options.custom if isinstance(c, KeepOut))]
        if options.obstacles:
            granted = None if options.repair_original else self.original.positions
            shape = options.obstacle_shape
            path = self.proposed.positions
            bodies += obstacles_of(
                self.scene, self.robot, contacts=self.contacts, path=path, shape=shape, original=granted
            )
        return bodies

    def speeds(self, positions: Array, weights: Weights) -> Array:
        """Speeds after the requested smoothing, lowered to every limit."""
        top = np.inf if self.robot.max_speed is None else self.robot.max_speed
        speeds = self.proposed.speeds
        if weights.smooth:
            plain = Weights(weights.dev, weights.smooth)
            speeds = smooth_axes(speeds[:, None], plain, np.zeros(1), np.full(1, top))[:, 0]
        granted = None if self.options.repair_original else self.original
        return limit_speeds(speeds, positions, dynamics(self.robot, self.options, granted))

    def judge(self, result: Trajectory) -> tuple[ConstraintCheck, ...]:
        """Measure every limit, independently of the solver."""
        measures, before = self.measured
        after = before if result is self.proposed else [m.worst(result) for m in measures]
        return compare(measures, self.original, before, after)

    @cached_property
    def measured(self) -> tuple[list[Measure], list[Worst]]:
        """Every limit, and its violation by the proposal."""
        measures = measure_all(self.scene, self.robot, self.proposed, self.original, self.contacts, self.options)
        return measures, [m.worst(self.proposed) for m in measures]

    @property
    def exempt(self) -> tuple[str, ...]:
        """The objects that are meant to be touched and are no obstacles."""
        left = {item.name for item in in_the_way(self.scene, self.robot, self.contacts, self.proposed.positions)}
        return tuple(dict.fromkeys(name for c in self.contacts if (name := self.scene[c].name) not in left))

    def answer(
        self,
        result: Trajectory,
        checks: tuple[ConstraintCheck, ...],
        status: Status,
        conflicts: tuple[str, ...] = (),
        notes: tuple[str, ...] = (),
    ) -> Solution:
        """The solution with its verdict."""
        shift = lengths(result.positions - self.proposed.positions)
        changed = (shift > 0) | (result.speeds != self.proposed.speeds)
        undone = None
        if len(self.proposed) == len(self.original):
            wanted = float(np.linalg.norm(self.proposed.positions - self.original.positions))
            undone = min(float(np.linalg.norm(shift)) / wanted, 1.0) if wanted > 0 else None
        if isinstance(self.robot.workspace, Shell) and status in ("satisfied", "repaired"):
            notes = (*notes, TIP_ONLY)
        verdict = Verdict(
            status=status,
            checks=checks,
            exempt=self.exempt,
            conflicts=conflicts,
            max_shift=float(shift.max()),
            waypoints_changed=int(changed.sum()),
            undone=undone,
            notes=notes,
        )
        return Solution(result, verdict)


def _runs_along(path: Array, original: Array) -> bool:
    """Whether a path (N, 3) [m] leaves another one nowhere: it may stand still longer, end sooner, or run backwards."""
    if np.array_equal(path, original):
        return True
    between = (path[1:] + path[:-1]) / 2.0
    return bool(path_distances(original, np.concatenate([path, between])).max() <= SAME)


SAME = 1e-9
"""How far off another path a point is still on it [m]."""


def solve_with_dwells(problem: PathProblem, steps: int = STEPS) -> tuple[Array, tuple[Blocked, ...]]:
    """As `solve_path`; waypoints that repeat the one before them, a dwell, move as one and stay equal bit by bit."""
    same = (problem.reference[1:] == problem.reference[:-1]).all(axis=1)
    if not same.any() or same.all():
        return solve_path(problem, steps)
    new = np.concatenate([[True], ~same])
    group = np.cumsum(new) - 1
    firsts = np.flatnonzero(new)
    pins = tuple(sorted({int(group[i]) for i in problem.pins}))
    path, blocked = solve_path(replace(problem, reference=problem.reference[new], pins=pins), steps)
    return path[group], tuple(replace(b, first=int(firsts[b.first]), last=int(firsts[b.last])) for b in blocked)


def solve_path(problem: PathProblem, steps: int = STEPS) -> tuple[Array, tuple[Blocked, ...]]:
    """The path nearest to the reference (in the sense of the objective) that is legal, and what stays blocked.

    Four steps: smooth and bound each axis (`qp.smooth_axes`), move into the convex sets, find a way around every
    body (`route.legal_path`), and pull the path back to the reference as far as the limits let it (`sequential`).
    """
    pinned, weights = problem.pinned, problem.weights
    if weights.smooth:
        weights = Weights(weights.dev, weights.smooth)
    base = smooth_axes(problem.reference, weights, problem.lower, problem.upper, pinned)
    outside = ~pinned & ~problem.inside(base)
    start = base.copy()
    if outside.any():
        start[outside] = problem.project(base[outside])
    if problem.rows:
        start = improve(replace(problem, bodies=()), base, start, steps)
    start, blocked = legal_path(problem, start)
    if np.array_equal(start, base) and not problem.rows:
        return base, blocked
    return improve(problem, base, start, steps), blocked


def choose_smoothing(
    proposed: Trajectory, problem: PathProblem, options: ConstraintOptions
) -> tuple[ConstraintOptions, tuple[str, ...]]:
    """The options with lambda_smooth chosen by `options.trials` evaluations of the criterion, and a note.

    Only the ratio lambda_smooth / lambda_dev matters. The paper searches it for the smallest deviation from the
    proposal, which always prefers no smoothing. This criterion has an optimum, each term without unit:

        |x - x_ref|^2 / |D1 x_ref|^2  +  |D2 x|^2 / |D2 x_ref|^2  +  sum of squared depths in obstacles / |D1 x_ref|^2

    deviation in units of a step, roughness D2 (differences of steps) as a share of what it was, and what the obstacles
    will undo. It is evaluated for the solution without obstacles, which costs microseconds, on a logarithmic grid.
    """
    score, trials = smoothing_criterion(proposed, problem), max(options.trials, 2)
    best = float(min(np.geomspace(*RANGE, trials), key=score))
    note = f"Smoothing was chosen: lambda_smooth / lambda_dev = {best:.3g}, the best of {trials}."
    return replace(options, lambda_smooth=best * options.lambda_dev), (note,)


def smoothing_criterion(proposed: Trajectory, problem: PathProblem) -> Callable[[float], float]:
    """The score of a ratio lambda_smooth / lambda_dev, lower is better; see `choose_smoothing`."""
    reference = proposed.to_array()
    steps = float((np.diff(reference, axis=0) ** 2).sum()) or 1.0
    bends = float((np.diff(reference, 2, axis=0) ** 2).sum()) or 1.0
    lower, upper = np.append(problem.lower, 0.0), np.append(problem.upper, np.inf)

    def score(ratio: float) -> float:
        x = smooth_axes(reference, Weights(1.0, float(ratio), 0.0), lower, upper)
        depth = np.maximum(problem.depth(x[:, :3]), 0.0)
        deviation = float(((x - reference) ** 2).sum()) / steps
        roughness = float((np.diff(x, 2, axis=0) ** 2).sum()) / bends
        return deviation + roughness + float((depth**2).sum()) / steps

    return score


def limit_speeds(speeds: Array, positions: Array, limits: Dynamics) -> Array:
    """The speeds (N,) [m/s] at positions (N, 3) [m], raised to the least one and then lowered to every limit.

    Standstill stays, and so does the path.
    """
    legal = np.maximum(speeds, 0.0) if (speeds < 0).any() else speeds
    if limits.least > 0.0:
        legal = np.where((legal > 0.0) & (legal < limits.least), limits.least, legal)
    if np.isfinite(limits.top):
        legal = np.minimum(legal, limits.top)
    if np.isfinite(limits.across):
        legal = np.minimum(legal, bend_speed(positions, limits.across))
    if np.isfinite(limits.along):
        # w_{i+1} <= w_i + 2 a ds is  w_i <= min over j <= i of (w_j + 2 a (s_i - s_j)), and the same backwards.
        gain = 2.0 * limits.along * arc_length(positions)
        squares = legal**2
        reachable = gain + np.minimum.accumulate(squares - gain)
        reachable = np.minimum(squares, reachable)
        stoppable = np.minimum.accumulate((reachable + gain)[::-1])[::-1] - gain
        lowered = np.sqrt(np.maximum(np.minimum(reachable, stoppable), 0.0))
        legal = np.where(lowered < legal * (1.0 - 1e-12), lowered, legal)
    return np.asarray(legal)
