"""Running a policy where it can compute and nothing else, and taking only a trajectory from it.

A policy that is proven to be toolkit calls only runs in this process (`ovita.policy.policy`); every other one in a
process that the kernel locks in (`ovita.policy.processes`).
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, Literal, cast, get_args

import numpy as np
from numpy.typing import NDArray

from ovita.errors import (
    IsolationUnavailable,
    PolicyCrashed,
    PolicyError,
    PolicyOutputInvalid,
    PolicyRejected,
    PolicyTimeout,
    RequestError,
    TrajectoryError,
)
from ovita.paths.geometry import lengths
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory, arc_length, nlerp
from ovita.policy import wire
from ovita.policy.policy import Policy, TooMuch, run_proven
from ovita.policy.source import entry_of, stated, to_rows
from ovita.text import clean_text
from ovita.toolkit import CATALOGUE, Expectation, Recorder

Isolation = Literal["auto", "strict", "degraded"]
"""How a policy is kept from doing harm.

"auto": one that is proven to be toolkit calls only runs in this process, every other one as in "strict".
"strict": every policy runs in a process that the kernel locks in (Landlock and seccomp on Linux).
"degraded": every policy runs in a fresh process, behind the allowlist check and the limits of the operating system.
"""


@dataclass(frozen=True)
class SandboxLimits:
    """What a policy may use up.

    Args:
        wall_s: Time [s], ended by a signal that cannot be caught; longer for more than 200,000 waypoints.
        memory_mb: Memory beyond what Python and numpy take [MiB].

    Raises:
        RequestError: If a limit is not positive, or beyond an hour or a TiB.
    """

    wall_s: float = 5.0
    memory_mb: int = 1024

    def __post_init__(self) -> None:
        if not 0.01 <= self.wall_s <= 3600.0:
            raise RequestError(f"the time limit must be 0.01 to 3600 s, not {self.wall_s!r}")
        if not 1 <= self.memory_mb <= 1 << 20:
            raise RequestError(f"the memory limit must be 1 to {1 << 20} MiB, not {self.memory_mb!r}")


@dataclass(frozen=True)
class Rollout:
    """What a policy did.

    Args:
        trajectory: Its result.
        contacts: Objects that it means to touch or to pass through.
        expectations: Postconditions that it states.
        prints: What it printed, cleaned and shortened.
        isolation: "strict", "degraded", or "in process" for a policy that is proven to be toolkit calls only.
        elapsed_ms: Time from the call to the result [ms].
        corners: Whether it draws a figure that has corners.
    """

    trajectory: Trajectory
    contacts: tuple[str, ...] = ()
    expectations: tuple[Expectation, ...] = ()
    prints: str = ""
    isolation: str = "strict"
    elapsed_ms: float = 0.0
    corners: bool = False


MAX_EXTENT = 100.0
"""How many times the size of the scene a policy's path may reach."""

MIN_REACH = 10.0
"""What a policy's path may always reach from the middle of the scene [m]."""

MAX_SPEED_FACTOR = 1000.0
"""How many times the original's highest speed a policy may ask for."""

MIN_TOP_SPEED = 100.0
"""Speed that a policy may always ask for [m/s]."""

LIMITS = SandboxLimits()

_USUAL_ROWS = 200_000


def known_isolation(isolation: object) -> Isolation:
    """The isolation, if there is one of that name.

    Raises:
        RequestError: If there is none, so that a misspelt one never runs with less than was meant.
    """
    if isinstance(isolation, str) and isolation in get_args(Isolation):
        return cast(Isolation, isolation)
    raise RequestError(f"isolation {isolation!r} is unknown; use 'auto', 'strict' or 'degraded'")


def run(
    policy: Policy,
    trajectory: Trajectory,
    scene: Scene,
    *,
    limits: SandboxLimits = LIMITS,
    isolation: Isolation = "auto",
) -> Rollout:
    """Run a policy on a trajectory in a scene.

    Safe to call from several threads; each call blocks until the policy has ended. Other
    `limits` than the usual ones make a process of its own necessary.

    Raises:
        RequestError: There is no such isolation.
        PolicyRejected: It contains what a policy may not.
        PolicyCrashed: It raised.
        PolicyTimeout: It took too long or too much memory.
        PolicyOutputInvalid: Its result is not a trajectory.
        IsolationUnavailable: This machine lacks what strict isolation needs; the message says what.
    """
    return _run(policy, trajectory, scene, limits=limits, isolation=isolation)


def close() -> None:
    """Stop the worker processes; the next run starts them again."""
    from ovita.policy.processes import POOL

    POOL.close()


def missing() -> tuple[str, ...]:
    """What this machine lacks for strict isolation; empty if nothing."""
    from ovita.policy.lockdown import missing_locks

    return missing_locks()


def _run(
    policy: Policy,
    trajectory: Trajectory,
    scene: Scene,
    *,
    limits: SandboxLimits = LIMITS,
    isolation: Isolation = "auto",
    checked: bool = True,
    locked: bool = True,
) -> Rollout:
    """As `run`; for tests of the sandbox alone, `checked=False` leaves the allowlist out and `locked=False` the kernel.

    Leaving one out is refused where the other is not there to hold.
    """
    started = time.perf_counter()
    isolation = known_isolation(isolation)
    table = _table(trajectory, policy)
    if isolation == "auto" and checked and locked and limits == LIMITS:
        with suppress(TooMuch):
            result, recorder = run_proven(policy.tree, table, scene)
            rows = to_rows(result, table[:, :4], f"the result of {entry_of(policy.tree).name}")
            return _rollout(rows, _plainly_stated(recorder), trajectory, scene, "in process", started)
    where = "degraded" if isolation == "degraded" else "strict"
    if where == "strict" and (lacking := missing()):
        raise IsolationUnavailable(
            f"this machine cannot lock a policy in: it lacks {' and '.join(lacking)}; "
            "isolation='degraded' runs it with an allowlist check and limits only"
        )
    if not checked and (where != "strict" or not locked):
        raise RequestError("the allowlist check can be left out only where the kernel holds")
    limits = replace(limits, wall_s=limits.wall_s * max(1.0, len(table) / _USUAL_ROWS))
    rows, header = _in_a_process(policy, table, scene, limits, where, wire.CHECKED * checked | wire.LOCKED * locked)
    return _rollout(rows, header, trajectory, scene, where, started)


def _in_a_process(
    policy: Policy, table: Array, scene: Scene, limits: SandboxLimits, where: str, flags: int
) -> tuple[Array, dict[str, Any]]:
    """Rows and postconditions of a policy run in its own process."""
    from ovita.policy.check import scipy_parts
    from ovita.policy.environment import scene_to_json
    from ovita.policy.processes import POOL, once

    body = wire.pack_payload({"source": policy.source, "scene": scene_to_json(scene)}, table)
    head = wire.JobHeader(int(limits.wall_s * 1000), limits.memory_mb, scipy_parts(policy.source), flags, len(body))
    return _read(POOL.ask(head, body) if where == "strict" else once(head, body), limits)


def _plainly_stated(recorder: Recorder) -> Any:
    """What a policy stated in this process, as it would come back in a job's payload."""
    try:
        return json.loads(json.dumps(stated(recorder), allow_nan=False))
    except (TypeError, ValueError, RecursionError):
        raise PolicyOutputInvalid(wire.NOT_PLAIN) from None


def _rollout(
    rows: Array, header: Mapping[str, Any], trajectory: Trajectory, scene: Scene, isolation: str, started: float
) -> Rollout:
    return Rollout(
        to_trajectory(rows, trajectory, scene),
        _contacts(header, scene),
        _expectations(header),
        clean_text(header.get("prints"), wire.MAX_PRINTS),
        isolation,
        (time.perf_counter() - started) * 1000.0,
        header.get("corners") is True,
    )


def _table(trajectory: Trajectory, policy: Policy) -> Array:
    rows = trajectory.to_array()
    if trajectory.orientations is not None and policy.carries_columns:
        return np.column_stack([rows, trajectory.orientations])
    return rows


_KINDS: Mapping[str, type[PolicyError]] = {
    "rejected": PolicyRejected,
    "crashed": PolicyCrashed,
    "memory": PolicyTimeout,
    "output": PolicyOutputInvalid,
}


def _read(end: wire.JobEnd, limits: SandboxLimits) -> tuple[Array, dict[str, Any]]:
    """The rows and what came with them.

    Raises:
        PolicyError: If the policy failed.
    """
    if end.ended == wire.TIMED_OUT:
        raise PolicyTimeout(f"it ran longer than {limits.wall_s:g} s")
    if end.ended == wire.FLOODED:
        raise PolicyOutputInvalid(f"its result is larger than {wire.MAX_RESULT >> 20} MiB")
    if end.ended != wire.ENDED or not end.data:
        raise _killed(end.code, limits)
    try:
        header, rows = wire.unpack_payload(end.data, max_json=wire.MAX_JSON)
    except wire.BadFrame:
        raise PolicyOutputInvalid("its result came back garbled") from None
    status = header.get("status")
    if status == "ok":
        return rows, header
    message = clean_text(header.get("message"), wire.MAX_MESSAGE)
    line = header.get("line")
    line = line if type(line) is int and 0 < line <= wire.MAX_JSON else None
    if status == "isolation":
        raise IsolationUnavailable(f"a lock of the sandbox did not close ({message}), so the policy was not run")
    raise _KINDS.get(str(status), PolicyCrashed)(message or "it failed without a word", line=line)


def _killed(code: int, limits: SandboxLimits) -> PolicyError:
    if code in (-9, -24, 71):
        return PolicyTimeout(f"it used more time or memory than it may ({limits.wall_s:g} s, {limits.memory_mb} MiB)")
    how = f"signal {-code}" if code < 0 else f"exit code {code}"
    return PolicyCrashed(f"it brought the interpreter down ({how})")


def _contacts(header: Mapping[str, Any], scene: Scene) -> tuple[str, ...]:
    names = header.get("contacts")
    found = names if isinstance(names, list) else []
    return tuple(name for name in scene.names if name in found)


def _expectations(header: Mapping[str, Any]) -> tuple[Expectation, ...]:
    items = header.get("expectations")
    found = []
    for item in items[: wire.MAX_EXPECTATIONS] if isinstance(items, list) else []:
        match item:
            case {"kind": str() as kind, "arguments": dict() as arguments, "text": str() as text}:
                if f"expect_{kind}" in CATALOGUE and _is_plain(arguments):
                    found.append(Expectation(kind, arguments, clean_text(text, wire.MAX_MESSAGE)))
    return tuple(found)


def _is_plain(value: object, depth: int = 6) -> bool:
    """Whether a JSON value is shallow and holds no text that could do harm on a terminal."""
    if depth == 0:
        return False
    match value:
        case dict():
            return all(_is_plain(v, depth - 1) for item in value.items() for v in item)
        case list():
            return all(_is_plain(v, depth - 1) for v in value)
        case str():
            return value == clean_text(value, wire.MAX_MESSAGE)
    return True


def to_trajectory(
    rows: Array, original: Trajectory, scene: Scene, within: tuple[Array, float] | None = None
) -> Trajectory:
    """Turn rows that nobody vouches for into a trajectory.

    Positions may lie at most 100 times the size of the scene from its middle (the diagonal and the centre of the box
    around the original path and all objects), and always up to 10 m; speeds may be 1000 times the original's highest,
    and always up to 100 m/s.

    Args:
        rows: (M, 4) or (M, 8).
        original: Gives orientations and the time step: row by row if the counts agree, else along the path.
        scene: Its objects count for the size of the scene.
        within: What `reach` says of both, where that is known.

    Raises:
        PolicyOutputInvalid: Naming the first waypoint that is wrong.
    """
    if rows.ndim != 2 or rows.shape[1] not in (4, 8) or not 2 <= len(rows) <= wire.MAX_ROWS:
        raise PolicyOutputInvalid(
            f"the policy returned {len(rows)} waypoints of {rows.shape[-1]} values; "
            f"it must return 2 to {wire.MAX_ROWS} of x, y, z, speed"
        )
    speeds = np.where((rows[:, 3] < 0) & (rows[:, 3] > -1e-9), 0.0, rows[:, 3])
    top = max(MIN_TOP_SPEED, MAX_SPEED_FACTOR * float(original.speeds.max()))
    centre, farthest = within or reach(original, scene)
    away = lengths(rows[:, :3] - centre)
    _refuse(np.asarray(~np.isfinite(rows).all(axis=1)), lambda i: f"is {rows[i, :4].tolist()}, which is not finite")
    _refuse(speeds < 0, lambda i: f"has the negative speed {speeds[i]:g} m/s")
    _refuse(speeds > top, lambda i: f"has the speed {speeds[i]:g} m/s; {top:g} is the most")
    _refuse(away > farthest, lambda i: f"is {away[i]:g} m from the middle of the scene; {farthest:g} m is the most")
    try:
        return Trajectory(rows[:, :3], speeds, _orientations(rows, original), original.timestep)
    except TrajectoryError as error:
        raise PolicyOutputInvalid(str(error)) from None


def _refuse(bad: NDArray[np.bool_], problem: Callable[[int], str]) -> None:
    if bad.any():
        i = int(np.argmax(bad))
        raise PolicyOutputInvalid(f"waypoint {i} of the result {problem(i)}")


def reach(original: Trajectory, scene: Scene) -> tuple[Array, float]:
    """The middle of the scene (3,) [m], and how far from it a policy's path may lie [m]."""
    corners = [original.positions, *(item.position[None] + sign * item.radius for item in scene for sign in (-1, 1))]
    points = np.concatenate(corners)
    low, high = points.min(axis=0), points.max(axis=0)
    return (low + high) / 2.0, max(MIN_REACH, MAX_EXTENT * float(np.linalg.norm(high - low)))


def _orientations(rows: Array, original: Trajectory) -> Array | None:
    if original.orientations is None:
        return None
    if rows.shape[1] == 8:
        return rows[:, 4:]
    if len(rows) == len(original):
        return original.orientations
    return nlerp(original.orientations, _source(rows[:, :3], original))


def _source(positions: Array, original: Trajectory) -> Array:
    """Fractional indices into the original that lie equally far along the path, as a share of its length."""
    s, old = arc_length(positions), original.arc_length
    if s[-1] <= 0 or old[-1] <= 0:
        return np.linspace(0.0, len(original) - 1.0, len(positions))
    keep = np.concatenate([[True], np.diff(old) > 0])
    indices = np.arange(len(old), dtype=float)[keep]
    return np.asarray(np.interp(s / s[-1], old[keep] / old[-1], indices))
