"""Every error that ovita raises on purpose.

    OvitaError
    ├── InputError                 what the caller gave cannot be used
    │   ├── TrajectoryError        a value of a trajectory (carries key and index)
    │   ├── SceneError             a value of a scene
    │   │   └── UnknownObject      a name that no object of the scene bears
    │   ├── RobotError             a robot preset or robot file
    │   ├── FormatError            a file: names the file, the key and the index
    │   └── RequestError           an instruction or an option
    ├── PolicyError                an adaptation policy cannot be used (goes back to its writer)
    │   ├── PolicyRejected         the check found code that a policy may not contain
    │   ├── PolicyCrashed          it raised while running
    │   ├── PolicyTimeout          it ran too long or used too much memory
    │   └── PolicyOutputInvalid    it returned something that is not a trajectory
    ├── WriterError                a policy writer could not answer
    │   ├── MissingKey             no API key for that writer
    │   └── UnusableReply          it answered, but not with an answer; asking again may help
    ├── DownloadError              a model's file cannot be fetched
    ├── LinkError                  a robot or a bus does not answer, or does not take what is sent
    ├── IsolationUnavailable       this machine cannot provide the requested isolation
    ├── ConstraintDefinitionError  limits that contradict themselves
    ├── NoRenderer                 no offscreen OpenGL for a video (in `sim.render`)
    └── MissingExtra               an optional package is not installed

Input errors raise early, at the caller. Policy and writer errors are caught by `adapt`, which turns them
into the `status` of an `Adaptation`; so is infeasibility, which is never an exception.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator, Sequence
from typing import Literal


class OvitaError(Exception):
    """Base of every error that ovita raises on purpose; its text is one sentence for a person."""


class InputError(OvitaError):
    """What the caller gave cannot be used."""


class TrajectoryError(InputError):
    """A trajectory is malformed.

    Args:
        problem: What is wrong, with the remedy where there is one.
        key: The array at fault, such as "positions".
        index: The waypoint at fault, counted from 0.
    """

    def __init__(self, problem: str, *, key: str | None = None, index: int | None = None) -> None:
        self.problem, self.key, self.index = problem, key, index
        super().__init__(problem if index is None else f"waypoint {index}: {problem}")


class SceneError(InputError):
    """A scene is malformed."""

    def __init__(self, problem: str, *, key: str | None = None, index: int | None = None) -> None:
        self.problem, self.key, self.index = problem, key, index
        super().__init__(problem)


class UnknownObject(SceneError):
    """No object of the scene bears this name."""

    def __init__(self, name: str, available: Sequence[str]) -> None:
        self.name, self.available = name, tuple(available)
        known = ", ".join(repr(n) for n in self.available)
        others = f"its objects are {known}" if known else "it holds no objects"
        super().__init__(f"the scene has no object {name!r}; {others}", key="objects")


class RobotError(InputError):
    """A robot preset or a robot file cannot be used."""


class FormatError(InputError):
    """A file cannot be read or written.

    Args:
        file: Path as the user gave it.
        problem: What is wrong, with the remedy.
        key: The key or column at fault.
        index: The row, waypoint or object at fault, counted from 0.
    """

    def __init__(self, file: str, problem: str, *, key: str | None = None, index: int | None = None) -> None:
        self.file, self.problem, self.key, self.index = file, problem, key, index
        where = "" if key is None else f" {key}" + ("" if index is None else f"[{index}]")
        super().__init__(f"{file}:{where} {problem}")


class RequestError(InputError):
    """An instruction or an option cannot be used."""


class PolicyError(OvitaError):
    """An adaptation policy cannot be used.

    Args:
        problem: What is wrong, in words that also help the model that wrote the policy.
        line: Line of the policy's source, counted from 1.
    """

    kind = "invalid"

    def __init__(self, problem: str, *, line: int | None = None) -> None:
        self.problem, self.line = problem, line
        super().__init__(problem if line is None else f"line {line}: {problem}")

    @property
    def reason(self) -> str:
        """What is wrong, for people who did not write the policy: without the line and the name of the exception."""
        return re.sub(r"^\w*(?:Error|Exception): ", "", self.problem)


class PolicyRejected(PolicyError):
    """The check found something that a policy may not contain."""

    kind = "rejected"


class PolicyCrashed(PolicyError):
    """The policy raised while it ran."""

    kind = "crashed"


class PolicyTimeout(PolicyError):
    """The policy ran too long or used too much memory."""

    kind = "timeout"


class PolicyOutputInvalid(PolicyError):
    """The policy returned something that is not a trajectory."""

    kind = "output"


WriterFailure = Literal["overloaded", "no_answer", "no_access", "other"]
"""Why a writer gave no answer: its server has too much to do, nothing came in time, there is no key, quota or model, or
the writer itself failed."""


class WriterError(OvitaError):
    """A policy writer could not answer.

    Args:
        problem: One sentence for a person.
        failure: Why, for programs.
    """

    def __init__(self, problem: str, failure: WriterFailure = "other") -> None:
        self.failure: WriterFailure = failure
        super().__init__(problem)

    @property
    def unreached(self) -> bool:
        """Whether the failure says nothing about the writer's ability: it was never reached, or had no time."""
        return self.failure != "other"

    @property
    def passing(self) -> bool:
        """Whether asking again later may help."""
        return self.failure in ("overloaded", "no_answer")


class MissingKey(WriterError):
    """A writer needs an API key that is not set.

    Args:
        writer: The writer as it was named, such as "openai:gpt-5".
        variable: The environment variable that would hold the key.
        instead: The option that does without a key.
    """

    def __init__(self, writer: str, variable: str, instead: str = "--writer builtin") -> None:
        self.writer, self.variable = writer, variable
        problem = f"{writer} needs an API key: set {variable}, or use {instead}, which needs none"
        super().__init__(problem, "no_access")


class UnusableReply(WriterError):
    """A writer answered with something that is no answer: empty, cut off, or unreadable."""


class DownloadError(OvitaError):
    """A model's file cannot be fetched."""


class LinkError(OvitaError):
    """A robot or a bus does not answer, or rejects what is sent to it."""


class IsolationUnavailable(OvitaError):
    """This machine cannot provide the requested isolation of a policy."""


class ConstraintDefinitionError(OvitaError):
    """Limits that contradict themselves."""


class MissingExtra(OvitaError):
    """An optional package is not installed.

    Args:
        package: The package that could not be imported.
        extra: The extra of ovita that brings it.
    """

    def __init__(self, package: str, extra: str) -> None:
        self.package, self.extra = package, extra
        super().__init__(f"this needs {package}: pip install 'ovita[{extra}]'")


@contextlib.contextmanager
def needs(package: str, extra: str) -> Iterator[None]:
    """Turn a failed import inside the block into a `MissingExtra`."""
    try:
        yield
    except ImportError:
        raise MissingExtra(package, extra) from None
