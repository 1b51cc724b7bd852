"""Waypoints as plain rows and named columns, in the layout of the public OVITA files."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import chain
from typing import Annotated, Any

import numpy as np

from ovita.errors import FormatError, TrajectoryError
from ovita.io.documents import LARGEST, Choices, Number, Table, listing, number_problem, read_by, show, validated
from ovita.paths.geometry import Mask, runs
from ovita.paths.trajectory import TIMESTEP, Array, Trajectory, first_bad, interpolate

DEFAULT_SPEED = 0.1
"""Speed of every waypoint of a file that gives neither speeds nor times [m/s]."""

COLUMNS = ("x", "y", "z", "speed", "qw", "qx", "qy", "qz")
"""A waypoint: position [m], speed [m/s], orientation as a unit quaternion wxyz."""

_ALIASES = {"velocity": "speed", "v": "speed", "time": "t"}
_QUATERNION = COLUMNS[4:]
_KNOWN = (*COLUMNS, "t")
_WIDTHS = {3: COLUMNS[:3], 4: COLUMNS[:4], 8: COLUMNS}


def trajectory_rows(trajectory: Trajectory) -> list[list[float]]:
    """Rows [x, y, z, speed] or, with orientations, [x, y, z, speed, qw, qx, qy, qz]; floats are kept exactly."""
    return trajectory_table(trajectory).rows.tolist()  # type: ignore[no-any-return]


def trajectory_table(trajectory: Trajectory) -> Table:
    """The same rows, on their way into a file."""
    turned = [] if trajectory.orientations is None else [trajectory.orientations]
    return Table(np.column_stack([trajectory.to_array(), *turned]))


def trajectory_from_rows(rows: object, *, key: str = "trajectory", timestep: float = TIMESTEP) -> Trajectory:
    """Build a trajectory from parsed rows, as `read_rows` does, without the notes.

    Raises:
        TrajectoryError: If a row is malformed; names the row.
    """
    return read_rows(rows, key=key, timestep=timestep)[0]


def read_rows(
    rows: object, *, key: str | None = "trajectory", timestep: float = TIMESTEP
) -> tuple[Trajectory, tuple[str, ...]]:
    """Build a trajectory from parsed rows, and say what had to be assumed.

    A row is [x, y, z], [x, y, z, speed], [x, y, z, speed, qw, qx, qy, qz], or an object with these names (`velocity`
    and `v` also mean speed; `t` [s] may stand for it). Messages call the list `key`; a dwell waypoint lasts `timestep`
    [s].
    """
    if not isinstance(rows, (list, tuple)):
        raise TrajectoryError(f"is {show(rows)}, expected a list of rows [x, y, z, speed]", key=key)
    if not rows:
        raise TrajectoryError("is empty; give at least 2 rows [x, y, z, speed]", key=key)
    if not isinstance(rows[0], (Mapping, list, tuple)):
        raise TrajectoryError(f"is {show(rows[0])}, expected a row [x, y, z, speed]", key=key, index=0)
    names, lists = (_of_dicts if isinstance(rows[0], Mapping) else _of_lists)(rows, key)
    table = _table(lists, names, key)
    return from_columns(dict(zip(names, table.T, strict=True)), key=key, timestep=timestep)


TrajectoryRows = Annotated[Trajectory, read_by(lambda rows: read_rows(rows, key=None)[0])]
"""A trajectory as rows [x, y, z, speed(, qw, qx, qy, qz)], without its timestep, for pydantic models."""


def covariance_rows(rows: object, file: str, count: int) -> Array:
    """The covariances of positions that a file holds beside its waypoints: rows xx, xy, xz, yy, yz, zz (N, 6) [m2]."""
    values = validated(list[list[Number]], rows, file, "covariance")
    if len(values) != count or any(len(row) != 6 for row in values):
        problem = f"is no list of {count} rows xx, xy, xz, yy, yz, zz; generate it anew"
        raise FormatError(file, problem, key="covariance")
    return np.array(values)


def column_name(name: str) -> str:
    """The canonical name of a column: lower case, without blanks, `velocity` and `v` as speed, `time` as t."""
    plain = name.strip().lower()
    return _ALIASES.get(plain, plain)


def from_columns(
    columns: Mapping[str, Array], *, key: str | None = None, timestep: float | None = TIMESTEP
) -> tuple[Trajectory, tuple[str, ...]]:
    """Build a trajectory from columns (N,) under their canonical names, and say what had to be assumed.

    Args:
        columns: x, y, z [m]; speed [m/s] or t [s] or neither; qw, qx, qy, qz or none of them. Others are ignored.
        key: What a message calls the waypoints; by default, the column at fault.
        timestep: Duration of one dwell waypoint [s]; None takes it from the dwells if there are times.
    """
    _check_complete(columns, key)
    positions = np.column_stack([columns[name] for name in COLUMNS[:3]])
    if len(positions) < 2:
        raise TrajectoryError(f"has {len(positions) or 'no'} waypoint; a trajectory needs at least 2", key=key)
    turns = [columns[name] for name in _QUATERNION if name in columns]
    unknown = [name or "(without a name)" for name in columns if name not in _KNOWN]
    notes = (f"ignored what no trajectory can carry: {listing(unknown)}",) if unknown else ()
    speeds, timestep, remarks = _speeds(columns, positions, key, timestep)
    try:
        built = Trajectory(positions, speeds, np.column_stack(turns) if turns else None, timestep)
    except TrajectoryError as error:
        of_column = {"speeds": "speed", "orientations": "qw"}.get(error.key or "", error.key)
        raise TrajectoryError(error.problem, key=key or of_column, index=error.index) from None
    return built, notes + remarks


def _check_complete(columns: Mapping[str, Array], key: str | None) -> None:
    """Refuse columns that lack a coordinate or a part of the quaternion, or hold what is not finite."""
    known = [name for name in _KNOWN if name in columns]
    missing = [name for name in COLUMNS[:3] if name not in known]
    if missing:
        raise TrajectoryError(f"has no {', '.join(missing)}, only {listing(columns)}; x, y and z are needed", key=key)
    turns = [name for name in known if name in _QUATERNION]
    if 0 < len(turns) < 4:
        problem = f"has only {', '.join(turns)} of the quaternion qw, qx, qy, qz; give all or none"
        raise TrajectoryError(problem, key=key)
    for name, bad in ((name, first_bad(columns[name])) for name in known):
        if bad is not None:
            raise TrajectoryError(f"{name} is {columns[name][bad]}, not a finite number", key=key or name, index=bad)


def _speeds(
    columns: Mapping[str, Array], positions: Array, key: str | None, timestep: float | None
) -> tuple[Array, float, tuple[str, ...]]:
    """Speeds (N,) [m/s], the timestep [s], and what was assumed for them."""
    fixed = TIMESTEP if timestep is None else timestep
    if "speed" in columns:
        notes = ("ignored the times t, because speeds are given",) if "t" in columns else ()
        return columns["speed"], fixed, notes
    if "t" not in columns:
        note = f"no speeds are given; assumed {DEFAULT_SPEED:g} m/s at every waypoint"
        return np.full(len(positions), DEFAULT_SPEED), fixed, (note,)
    speeds, dwell, remarks = speeds_from_times(positions, columns["t"], key or "t")
    return speeds, dwell if timestep is None else timestep, ("derived the speeds from the times t", *remarks)


def pose_columns(positions: Array, turns: Array | None) -> dict[str, Array]:
    """Positions (N, 3) [m] and quaternions (N, 4) wxyz as columns (N,) by name."""
    columns = dict(zip(COLUMNS[:3], positions.T, strict=True))
    return columns if turns is None else columns | dict(zip(_QUATERNION, turns.T, strict=True))


def turns_of(trajectory: Trajectory) -> tuple[Array, bool]:
    """Orientations (N, 4) wxyz, and whether they are its own; without any, the identity."""
    own = trajectory.orientations
    return (np.tile([1.0, 0.0, 0.0, 0.0], (len(trajectory), 1)), False) if own is None else (own, True)


def poses_of(trajectory: Trajectory) -> tuple[Array, bool]:
    """Poses x, y, z, qx, qy, qz, qw (N, 7), and whether they are its own; without orientations, the identity."""
    turns, own = turns_of(trajectory)
    return np.column_stack([trajectory.positions, turns[:, [1, 2, 3, 0]]]), own


def excerpt(path: Trajectory, choices: Choices) -> Trajectory:
    """The part of a path that is to be read, by the times at which it passes its waypoints."""
    if choices.span is None:
        return path
    choices.during(np.linspace(0.0, path.duration, 1000))
    ends = path.at(np.clip(choices.span, 0.0, path.duration))
    inner = np.flatnonzero((ends.where[0] < np.arange(len(path))) & (np.arange(len(path)) < ends.where[1]))
    where = np.concatenate([ends.where[:1], inner, ends.where[1:]])
    speeds = np.concatenate([ends.speeds[:1], path.speeds[inner], ends.speeds[1:]])
    return Trajectory(interpolate(path.positions, where), speeds, path.orientations_at(where), path.timestep)


def _of_lists(rows: Sequence[Any], key: str | None) -> tuple[tuple[str, ...], Iterable[Sequence[object]]]:
    width = len(rows[0])
    if not set(map(type, rows)) <= {list, tuple}:
        i = next(i for i, row in enumerate(rows) if not isinstance(row, (list, tuple)))
        raise TrajectoryError(f"is {show(rows[i])}, expected a row of {width} numbers like the first", key=key, index=i)
    if width not in _WIDTHS:
        layouts = "3 (x, y, z), 4 (x, y, z, speed) or 8 (x, y, z, speed, qw, qx, qy, qz)"
        raise TrajectoryError(f"holds {_count(width)}, expected {layouts}", key=key, index=0)
    if set(map(len, rows)) != {width}:
        i = next(i for i, row in enumerate(rows) if len(row) != width)
        problem = f"holds {_count(len(rows[i]))} where the first row holds {width}; give every row the same"
        raise TrajectoryError(problem, key=key, index=i)
    return _WIDTHS[width], rows


def _of_dicts(rows: Sequence[Any], key: str | None) -> tuple[tuple[str, ...], Iterable[Sequence[object]]]:
    keys = tuple(rows[0])
    names = tuple(column_name(str(name)) for name in keys)
    twice = [name for i, name in enumerate(names) if name in names[:i]]
    if twice:
        raise TrajectoryError(f"gives {twice[0]} twice; its keys are {listing(map(str, keys))}", key=key, index=0)
    _check_keys(rows, set(keys), key)
    known = {k: n for k, n in zip(keys, names, strict=True) if n in _KNOWN}
    ignored = [name for name in names if name not in _KNOWN]
    # What is ignored may be anything, so it becomes a column of zeros that only lends its name to the note.
    zero = [0.0] * len(ignored)
    return (*known.values(), *ignored), [[row[k] for k in known] + zero for row in rows]


def _check_keys(rows: Sequence[Any], expected: set[Any], key: str | None) -> None:
    for i, row in enumerate(rows):
        if not isinstance(row, Mapping):
            raise TrajectoryError(f"is {show(row)}, expected an object like the first row", key=key, index=i)
        if row.keys() != expected:
            lacks, more = sorted(expected - row.keys()), sorted(row.keys() - expected)
            what = f"lacks {listing(lacks)}" if lacks else f"has {listing(more)}"
            raise TrajectoryError(f"{what}, unlike the first row; give every row the same keys", key=key, index=i)


def _table(rows: Iterable[Sequence[object]], names: Sequence[str], key: str | None) -> Array:
    """Rows of equal length as an array (N, D); only if that fails are they walked one by one to find the culprit."""
    rows = list(rows)
    flat: list[Any] = list(chain.from_iterable(rows))
    if set(map(type, flat)) <= {int, float}:
        try:
            table = np.array(flat, dtype=np.float64).reshape(len(rows), len(names))
        except OverflowError:
            pass
        else:
            if (np.abs(table) <= LARGEST).all():
                return table
    for i, row in enumerate(rows):
        for name, value in zip(names, row, strict=True):
            problem = number_problem(value)
            if problem:
                raise TrajectoryError(f"{name} {problem}", key=key, index=i)
    return np.array([[float(value) for value in row] for row in rows])  # type: ignore[arg-type]


def _count(n: int) -> str:
    return "1 number" if n == 1 else f"{n} numbers"


SMOOTHNESS = 0.02
"""Weight of the speeds' second differences against the fit of the times; 1/64 passes alternating noise unamplified."""

TOLERANCE = 0.05
"""Relative error of a segment's duration from which on it is remarked."""

_ROUNDS = 50


def speeds_from_times(positions: Array, times: Array, key: str = "t") -> tuple[Array, float, tuple[str, ...]]:
    """Find speeds with which a trajectory reaches its waypoints (N, 3) [m] at given times (N,) [s], which increase.

    Times that came from a trajectory give its speeds back, see `chained_speeds`. For others the time law
    v_i + v_i+1 = 2 ds_i / dt_i, a chain, would turn noise into oscillation. So their speeds minimise

        sum_i ((v_i + v_i+1) / 2 - m_i)^2 / m_i^2  +  SMOOTHNESS * sum_i (v_i-1 - 2 v_i + v_i+1)^2 / max(m)^2

    with the mean speeds m_i = ds_i / dt_i and v >= 0, and are then scaled so that the time spent moving is met
    exactly. A repeated position is a dwell: its speed is 0.

    Returns:
        The speeds (N,) [m/s], the duration of one dwell waypoint [s] (the mean one; the default timestep if there
        is no dwell), and remarks on what could not be met.
    """
    dt = np.diff(times)
    if (dt <= 0).any():
        i = int(np.argmax(dt <= 0)) + 1
        problem = f"is at {times[i]:.9g} s, not after the {times[i - 1]:.9g} s before it; times must increase strictly"
        raise TrajectoryError(problem, key=key, index=i)
    ds = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    with np.errstate(over="ignore"):
        mean = ds / dt
    if (mean > LARGEST).any():
        i = int(np.argmax(mean > LARGEST)) + 1
        raise TrajectoryError(f"moves {ds[i - 1]:g} m in {dt[i - 1]:g} s; check the times", key=key, index=i)
    moving = ds > 0
    dwells = dt[~moving]
    timestep = float(dwells.mean()) if len(dwells) else TIMESTEP
    uneven = bool(len(dwells)) and float(np.abs(dwells - timestep).max()) > 0.01 * timestep
    remarks = [f"the dwells differ in length; each now lasts their mean, {timestep:.3g} s"] if uneven else []
    if not moving.any():
        return np.zeros(len(positions)), timestep, tuple(remarks)
    rest = np.concatenate([[not moving[0]], ~moving])
    speeds = _rescued(_fit(mean, moving, rest), mean, moving)
    chained = chained_speeds(ds, dt)
    if chained is not None and no_rougher(chained, speeds):
        return chained, timestep, tuple(remarks)
    spent = 2.0 * ds[moving] / (speeds[:-1] + speeds[1:])[moving]
    factor = float(spent.sum() / dt[moving].sum())
    error = float(np.abs(spent / factor / dt[moving] - 1.0).max())
    if error > TOLERANCE:
        remarks.append(f"the times are too uneven for smooth speeds; single segments are off by up to {error:.0%}")
    return speeds * factor, timestep, tuple(remarks)


def _fit(mean: Array, moving: Mask, rest: Mask) -> Array:
    """Minimise the sum above with v = 0 where `rest`; negative speeds are set to 0 and the others solved again."""
    # scipy.linalg takes longer to import than a file to read, and only files with times need it.
    from scipy.linalg import solveh_banded

    n, top = len(rest), float(mean.max())
    weight = np.where(moving, 0.25 / np.maximum(mean / top, 0.02) ** 2, 0.0)
    smooth = SMOOTHNESS * (moving[:-1] & moving[1:])
    bands = np.zeros((3, n))
    for row, first, values in (
        *((0, 0, weight), (0, 1, weight), (1, 0, weight)),
        *((0, 0, smooth), (0, 1, 4.0 * smooth), (0, 2, smooth)),
        *((1, 0, -2.0 * smooth), (1, 1, -2.0 * smooth), (2, 0, smooth)),
    ):
        bands[row, first : first + len(values)] += values
    bands[0] += 1e-12
    pull = 2.0 * weight * mean / top
    target = np.append(pull, 0.0) + np.append(0.0, pull)
    fixed = rest.copy()
    speeds = np.zeros(n)
    for _ in range(_ROUNDS):
        speeds = solveh_banded(_without(bands, fixed), np.where(fixed, 0.0, target), lower=True)
        negative = (speeds < 0) & ~fixed
        if not negative.any():
            break
        fixed |= negative
    return np.asarray(np.where(fixed, 0.0, np.maximum(speeds, 0.0)) * top)


def _without(bands: Array, fixed: Mask) -> Array:
    """The banded matrix with the rows and columns of fixed unknowns replaced by those of the identity."""
    reduced = np.where(fixed, [[1.0], [0.0], [0.0]], bands)
    for k in (1, 2):
        reduced[k, :-k][fixed[k:]] = 0.0
    return reduced


def _rescued(speeds: Array, mean: Array, moving: Mask) -> Array:
    """Give segments that move, but ended up with no speed at either end, their mean speed at both."""
    stuck = np.flatnonzero(moving & (speeds[:-1] + speeds[1:] < 1e-3 * mean))
    rescued = speeds.copy()
    rescued[stuck + 1] = np.maximum(speeds[stuck + 1], 2.0 * mean[stuck])
    return rescued


_ROUGHER = 1.7
_GRAIN = 1e-4


def chained_speeds(ds: Array, dt: Array) -> Array | None:
    """Speeds (N,) [m/s] that give segments (N-1,) [m] exactly their durations (N-1,) [s], or None.

    The law dt = 2 ds / (v_i + v_i+1) is a chain v_i+1 = 2 ds/dt - v_i with one free value c, so that all solutions
    are v_i = u_i + (-1)^i c. A dwell (ds = 0) sets the speed after it to 0 and so fixes c there; elsewhere c is the
    one for which the second differences have the smallest sum of magnitudes, their median: it is the exact one
    where the speeds are linear over most waypoints. Times that came from somewhere else make the chain oscillate; if
    its speeds turn negative, the answer is None.
    """
    speeds = np.zeros(len(ds) + 1)
    for first, last in runs(ds > 0):
        chain = _chain(ds[first : last + 1] / dt[first : last + 1], free=first == 0)
        if chain is None:
            return None
        speeds[first : last + 2] = chain
    return speeds


def no_rougher(chained: Array, fitted: Array) -> bool:
    """Whether speeds (N,) that meet their times exactly are hardly rougher than speeds (N,) that only fit them.

    So they are for times that came from the time law, where the fit rounds corners off; the noise of a clock makes the
    chain oscillate, twice as rough for 10 waypoints and ever more for longer paths.
    """
    rough, smooth = (float(np.abs(np.diff(speeds, 2)).sum()) for speeds in (chained, fitted))
    return rough <= _ROUGHER * smooth + _GRAIN * float(chained.max()) * len(chained)


def timed(trajectory: Trajectory) -> tuple[Trajectory, Array, tuple[str, ...]]:
    """A trajectory, the times (N,) [s] of its waypoints, which increase strictly, and remarks.

    A waypoint that repeats the one before it while moving takes no time, and is left out.
    """
    durations = trajectory.durations
    keep = np.concatenate([[True], durations > 0])
    if keep.all():
        return trajectory, trajectory.times, ()
    if keep.sum() < 2:
        keep[-1] = True
    turns = trajectory.orientations
    turns = None if turns is None else turns[keep]
    kept = Trajectory(trajectory.positions[keep], trajectory.speeds[keep], turns, trajectory.timestep)
    left = f"left out {int((~keep).sum())} of {len(keep)} waypoints, which repeat the one before and take no time"
    return kept, kept.times, (left,)


def _chain(mean: Array, free: bool) -> Array | None:
    """Speeds (n+1,) of neighbouring segments with mean speeds (n,); `free` if the first speed is not known to be 0."""
    scale = float(mean.max())
    signs = np.where(np.arange(len(mean) + 1) % 2 == 0, 1.0, -1.0)
    speeds = signs * np.concatenate([[0.0], np.cumsum(-signs[:-1] * 2.0 * mean)])
    if free:
        best = _straightest(np.diff(speeds, 2), signs[:-2], scale) if len(mean) > 1 else float(mean[0])
        lowest, highest = float((-speeds[::2]).max()), float(speeds[1::2].min())
        speeds = speeds + signs * min(max(best, lowest), highest)
    if (speeds < -1e-6 * scale).any():
        return None
    return np.asarray(np.maximum(speeds, 0.0))


def _straightest(bends: Array, signs: Array, scale: float) -> float:
    """The c for which |bends + 4 signs c| has the smallest sum; of two equally good ones, that with more zeros."""
    wanted = np.sort(-signs * bends / 4.0)
    middle = wanted[(len(wanted) - 1) // 2 : len(wanted) // 2 + 1]
    straight = [int((np.abs(wanted - c) < 1e-9 * scale).sum()) for c in middle]
    return float(middle[int(np.argmax(straight))])
