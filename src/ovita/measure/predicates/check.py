"""Checks as data: a kind, its arguments and, for combinations, the checks they combine."""

from __future__ import annotations

import functools
import inspect
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Concatenate, ParamSpec

from ovita.measure.predicates.pair import Pair
from ovita.paths.part import PathPart
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory

JSON = Any
"""What a JSON file can hold: None, bool, int, float, str, lists and string-keyed mappings of these."""

P = ParamSpec("P")


@dataclass(frozen=True)
class CheckResult:
    """The outcome of a check.

    Args:
        passed: Whether the adaptation did what was asked.
        sentence: What was measured, with numbers; for a failed check, feedback that a person could give.
    """

    passed: bool
    sentence: str


@dataclass(frozen=True)
class Check:
    """A predicate over an original trajectory, an adapted one and the scene, as JSON-able data.

    Args:
        kind: Name of a predicate, or "all_of", "any_of" or "not_".
        arguments: What the predicate is called with, by name.
        children: The checks that a combination combines.

    Raises:
        ValueError: If the kind is unknown, or the arguments or children do not fit it.
    """

    kind: str
    arguments: Mapping[str, JSON] = field(default_factory=dict)
    children: tuple[Check, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "arguments", {k: _plain(v) for k, v in self.arguments.items()})
        object.__setattr__(self, "children", tuple(self.children))
        if self.kind in _COMBINATIONS:
            if self.arguments or not self.children or (self.kind == "not_" and len(self.children) != 1):
                wanted = "exactly one child" if self.kind == "not_" else "at least one child"
                raise ValueError(f"{self.kind} takes {wanted} and no arguments")
            return
        if self.kind not in _PREDICATES:
            raise ValueError(f"unknown check {self.kind!r}; known are {', '.join(sorted(kinds()))}")
        if self.children:
            raise ValueError(f"{self.kind} takes no children; combine checks with all_of, any_of and not_")
        try:
            inspect.signature(_PREDICATES[self.kind]).bind(None, **self.arguments)
        except TypeError as error:
            raise ValueError(f"{self.kind}: {error}") from None

    def __hash__(self) -> int:
        return hash(json.dumps(self.to_dict(), sort_keys=True))

    def judge(self, original: Trajectory, adapted: Trajectory, scene: Scene) -> CheckResult:
        """Measure an adaptation.

        Args:
            original: N waypoints.
            adapted: M waypoints.
            scene: Whose objects and frame the check speaks of.

        Raises:
            UnknownObject: If the check names an object that the scene does not have.
        """
        return self.judge_pair(Pair(original.to_array(), adapted.to_array(), scene))

    def judge_pair(self, pair: Pair) -> CheckResult:
        """Measure an adaptation whose waypoints have been matched already."""
        if self.kind not in _COMBINATIONS:
            return _PREDICATES[self.kind](pair, **self.arguments)
        return _COMBINATIONS[self.kind]([child.judge_pair(pair) for child in self.children])

    def to_dict(self) -> dict[str, JSON]:
        """The check as a JSON document: "kind", and "arguments" and "children" where it has any."""
        result: dict[str, JSON] = {"kind": self.kind}
        if self.arguments:
            result["arguments"] = dict(self.arguments)
        if self.children:
            result["children"] = [child.to_dict() for child in self.children]
        return result

    @classmethod
    def from_dict(cls, document: Mapping[str, JSON]) -> Check:
        """The check that `to_dict` wrote.

        Raises:
            ValueError: If the document does not describe a check.
        """
        if not isinstance(document, Mapping) or not isinstance(document.get("kind"), str):
            raise ValueError("a check is a mapping with a key 'kind'")
        unknown = set(document) - {"kind", "arguments", "children"}
        if unknown:
            raise ValueError(f"a check has no key {sorted(unknown)[0]!r}; it has kind, arguments and children")
        children = tuple(cls.from_dict(child) for child in document.get("children", ()))
        return cls(document["kind"], document.get("arguments", {}), children)


def predicate(judge: Callable[Concatenate[Pair, P], CheckResult]) -> Callable[P, Check]:
    """Make a check of a function that measures a pair; the result builds the check from the other arguments.

    The function's name becomes the kind; arguments left at their defaults are not stored.
    """
    kind = judge.__name__
    signature = inspect.signature(judge)
    public = signature.replace(parameters=list(signature.parameters.values())[1:], return_annotation=Check)
    _PREDICATES[kind] = judge

    @functools.wraps(judge)
    def build(*args: P.args, **kwargs: P.kwargs) -> Check:
        try:
            given = public.bind(*args, **kwargs).arguments
        except TypeError as error:
            raise ValueError(f"{kind}: {error}") from None
        defaults = public.parameters
        return Check(kind, {name: value for name, value in given.items() if value != defaults[name].default})

    vars(build).pop("__wrapped__")
    vars(build)["__signature__"] = public
    return build


def say(passed: bool, wish: str, fact: str) -> CheckResult:
    """A check result whose sentence is the fact, preceded by the request if it failed."""
    return CheckResult(bool(passed), fact[:1].upper() + fact[1:] + "." if passed else f"Please {wish}: {fact}.")


def kinds() -> tuple[str, ...]:
    """Every kind of check, combinations included."""
    return (*_PREDICATES, *_COMBINATIONS)


def all_of(*checks: Check) -> Check:
    """Every check passes; the sentence of a failure joins those of the failed ones."""
    return Check("all_of", {}, checks)


def any_of(*checks: Check) -> Check:
    """At least one check passes; a failure speaks for the first, so put the usual reading first."""
    return Check("any_of", {}, checks)


def not_(check: Check) -> Check:
    """The check fails."""
    return Check("not_", {}, (check,))


def _all(verdicts: list[CheckResult]) -> CheckResult:
    passed = all(v.passed for v in verdicts)
    return CheckResult(passed, " ".join(dict.fromkeys(v.sentence for v in verdicts if v.passed == passed)))


def _any(verdicts: list[CheckResult]) -> CheckResult:
    return next((v for v in verdicts if v.passed), verdicts[0])


def _not(verdicts: list[CheckResult]) -> CheckResult:
    inner = verdicts[0]
    return CheckResult(not inner.passed, f"Please undo that: {inner.sentence}" if inner.passed else inner.sentence)


def _plain(value: Any) -> JSON:
    if isinstance(value, PathPart):
        return _plain(value.to_json())
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, tuple | list):
        return [_plain(v) for v in value]
    if value is None or isinstance(value, bool | int | float | str):
        return value
    raise ValueError(f"a check's arguments are JSON values; {value!r} is none")


_PREDICATES: dict[str, Callable[..., CheckResult]] = {}
_COMBINATIONS: dict[str, Callable[[list[CheckResult]], CheckResult]] = {"all_of": _all, "any_of": _any, "not_": _not}
