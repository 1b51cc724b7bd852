"""Running a policy where it can compute and nothing else."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from ovita.errors import (
    IsolationUnavailable,
    PolicyCrashed,
    PolicyError,
    PolicyOutputInvalid,
    PolicyRejected,
    PolicyTimeout,
    RequestError,
)
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory
from ovita.policy import frames
from ovita.policy.allowed import scipy_parts
from ovita.policy.frames import CHECKED, ENDED, FLOODED, LOCKED, TIMED_OUT, Request
from ovita.policy.inputs import scene_to_json
from ovita.policy.output import to_trajectory
from ovita.policy.policy import Policy
from ovita.policy.processes import POOL, Answer
from ovita.policy.spawn import once
from ovita.toolkit import CATALOGUE, Expectation

Isolation = Literal["strict", "degraded"]


@dataclass(frozen=True)
class SandboxLimits:
    """What a policy may use up.

    Args:
        wall_s: Time [s], ended by a signal that cannot be caught.
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
        isolation: "strict" or "degraded": how it was locked in.
        elapsed_ms: Time from the call to the result [ms].
    """

    trajectory: Trajectory
    contacts: tuple[str, ...] = ()
    expectations: tuple[Expectation, ...] = ()
    prints: str = ""
    isolation: str = "strict"
    elapsed_ms: float = 0.0


LIMITS = SandboxLimits()


def run(
    policy: Policy,
    trajectory: Trajectory,
    scene: Scene,
    *,
    limits: SandboxLimits = LIMITS,
    isolation: Isolation = "strict",
) -> Rollout:
    """Run a policy on a trajectory in a scene.

    Safe to call from several threads; each call blocks until the policy has ended.

    Args:
        policy: What to run.
        trajectory: Its input.
        scene: Its input.
        limits: Time and memory.
        isolation: "strict": a process that the kernel locks in (Landlock and seccomp on Linux). "degraded": a fresh
            process, the allowlist check and the limits of the operating system. A policy of toolkit calls only runs
            degraded without asking where strict isolation is not to be had.

    Raises:
        PolicyRejected: It contains what a policy may not.
        PolicyCrashed: It raised.
        PolicyTimeout: It took too long or too much memory.
        PolicyOutputInvalid: Its result is not a trajectory.
        IsolationUnavailable: This machine lacks what strict isolation needs; the message says what.
    """
    return _run(policy, trajectory, scene, limits=limits, isolation=isolation)


def close() -> None:
    """Stop the worker processes; the next run starts them again."""
    POOL.close()


def missing() -> tuple[str, ...]:
    """What this machine lacks for strict isolation; empty where nothing is missing."""
    from ovita.policy.lockdown import missing_locks

    return missing_locks()


def _run(
    policy: Policy,
    trajectory: Trajectory,
    scene: Scene,
    *,
    limits: SandboxLimits = LIMITS,
    isolation: Isolation = "strict",
    checked: bool = True,
    locked: bool = True,
) -> Rollout:
    """As `run`; for tests of the sandbox alone, `checked=False` leaves the allowlist out and `locked=False` the kernel.

    Leaving one out is refused where the other is not there to hold.
    """
    started = time.perf_counter()
    if isolation == "strict" and (lacking := missing()):
        if not policy.toolkit_only:
            raise IsolationUnavailable(
                f"this machine cannot lock a policy in: it lacks {' and '.join(lacking)}; "
                "isolation='degraded' runs it with an allowlist check and limits only"
            )
        isolation = "degraded"
    if not checked and (isolation != "strict" or not locked):
        raise RequestError("the allowlist check can be left out only where the kernel holds")
    body = frames.pack_payload({"source": policy.source, "scene": scene_to_json(scene)}, _table(trajectory, policy))
    flags = CHECKED * checked | LOCKED * locked
    head = Request(int(limits.wall_s * 1000), limits.memory_mb, scipy_parts(policy.source), flags, len(body))
    answer = POOL.ask(head, body) if isolation == "strict" else once(head, body)
    rows, header = _read(answer, limits)
    result = to_trajectory(rows, trajectory, scene)
    return Rollout(
        result,
        _contacts(header, scene),
        _expectations(header),
        frames.clean_text(header.get("prints"), frames.MAX_PRINTS),
        isolation,
        (time.perf_counter() - started) * 1000.0,
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


def _read(answer: Answer, limits: SandboxLimits) -> tuple[Array, dict[str, Any]]:
    """The rows and what came with them, or the error that the answer stands for."""
    reply = answer.reply
    if reply.ended == TIMED_OUT:
        raise PolicyTimeout(f"it ran longer than {limits.wall_s:g} s")
    if reply.ended == FLOODED:
        raise PolicyOutputInvalid(f"its result is larger than {frames.MAX_RESULT >> 20} MiB")
    if reply.ended != ENDED or not answer.data:
        raise _killed(reply.code, limits)
    try:
        header, rows = frames.unpack_payload(answer.data, max_json=frames.MAX_JSON)
    except frames.BadFrame:
        raise PolicyOutputInvalid("its result came back garbled") from None
    status = header.get("status")
    if status == "ok":
        return rows, header
    message = frames.clean_text(header.get("message"), frames.MAX_MESSAGE)
    line = header.get("line")
    line = line if type(line) is int and 0 < line <= frames.MAX_JSON else None
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
    for item in items[: frames.MAX_EXPECTATIONS] if isinstance(items, list) else []:
        match item:
            case {"kind": str() as kind, "arguments": dict() as arguments, "text": str() as text}:
                if f"expect_{kind}" in CATALOGUE and _is_plain(arguments):
                    found.append(Expectation(kind, arguments, frames.clean_text(text, frames.MAX_MESSAGE)))
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
            return value == frames.clean_text(value, frames.MAX_MESSAGE)
    return True
