"""Checks as data: a kind, its arguments and the checks they combine; and the pair of trajectories that they measure."""

from __future__ import annotations

import functools
import inspect
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Concatenate, ParamSpec, TypeAlias

import numpy as np

from ovita.paths.correspondence import Correspondence, correspond
from ovita.paths.geometry import Mask, extent, path_distances, project
from ovita.paths.part import PathPart, locate, named
from ovita.paths.scene import DIRECTIONS, Scene, SceneObject
from ovita.paths.trajectory import Array, Trajectory, interpolate, source_indices
from ovita.text import sentence
from ovita.toolkit.approach import extent as extent_along
from ovita.toolkit.arguments import OffsetLimits, spelled_out

NOTICEABLE = 0.01
"""A change of place counts from this share of the original's extent on."""

FINE = 2000
"""Points at which a path is looked at, evenly along it."""

EDGE = 0.05
"""What lies within this share of the extent is at the same place for a person who looks at a plot."""


Where: TypeAlias = PathPart | Mapping[str, Any] | None
"""The part of the original path that a check looks at: a `PathPart` or its JSON document; None means all of it."""


class Pair:
    """Two trajectories to compare.

    Args:
        original: (N, 4): x, y, z [m], speed [m/s].
        adapted: (M, 4).
        scene: Whose objects and frame are meant.
    """

    def __init__(self, original: Array, adapted: Array, scene: Scene) -> None:
        self.original, self.adapted, self.scene = original, adapted, scene

    @cached_property
    def extent(self) -> float:
        """Diagonal of the box around the original path [m]; 1 if it has none."""
        return extent(self.original[:, :3]) or 1.0

    @cached_property
    def noticeable(self) -> float:
        """The smallest change of place that counts [m]."""
        return NOTICEABLE * self.extent

    @cached_property
    def trajectory(self) -> Trajectory:
        """The original."""
        return Trajectory.from_array(self.original)

    @cached_property
    def match(self) -> Correspondence:
        """Which waypoints belong together."""
        return correspond(self.original, self.adapted)

    @cached_property
    def source(self) -> Array:
        """Fractional indices (N,) into the adapted waypoints; NaN where a waypoint has no counterpart."""
        return self.match.forward

    @cached_property
    def matched(self) -> Array:
        """The adapted row of each original waypoint (N, 4), NaN where there is none."""
        return self.match.of_original(self.adapted)

    @cached_property
    def found(self) -> Mask:
        """Which original waypoints have a counterpart (N,)."""
        return np.isfinite(self.source)

    @cached_property
    def shift(self) -> Array:
        """Displacement of each original waypoint (N, 3) [m], NaN where it has no counterpart."""
        return self.matched[:, :3] - self.original[:, :3]

    @cached_property
    def fine(self) -> Array:
        """Points (2000, 3) [m] along the adapted path, evenly by arc length."""
        return interpolate(self.adapted[:, :3], source_indices(self.adapted[:, :3], FINE, "arc_length"))

    @cached_property
    def tail(self) -> Array:
        """The adapted rows from the old goal on (K, 4), K >= 1."""
        if self.found[-1] and len(self.adapted) != len(self.original):
            begin = round(float(self.source[-1]))
        else:
            gap = np.linalg.norm(self.adapted[:, :3] - self.original[-1, :3], axis=1)
            late = np.flatnonzero(gap <= gap.min() + 2 * self.noticeable)
            begin = int(late[0])
        return self.adapted[begin:]

    @cached_property
    def off_path(self) -> Array:
        """Distance (M,) of each adapted waypoint to the original path [m]."""
        return path_distances(self.original[:, :3], self.adapted[:, :3])

    @cached_property
    def uncovered(self) -> Array:
        """Distance (N,) of each original waypoint to the adapted path [m]."""
        return path_distances(self.adapted[:, :3], self.original[:, :3])

    @cached_property
    def seen_after(self) -> Pair:
        """The same pair with the original's waypoints where they are now: for places that the path came to."""
        rows = np.where(self.found[:, None], self.matched, self.original)
        rows[:, 3] = self.original[:, 3]
        return Pair(rows, self.adapted, self.scene)

    def leeway(self, points: Array) -> Array:
        """How far the limits may have pushed the original path aside at points (K, 3) of it to spare objects, (K,) [m].

        An object's bounding sphere and 2 % of the extent around it may be cleared, and the path before and after it
        may be bent, by half of what it is nearer than 10 % of the extent.
        """
        result = np.zeros(len(points))
        for item in self.scene:
            inside = item.radius - np.linalg.norm(points - item.position, axis=1)
            bent = (inside + 10 * self.noticeable) / 2.0
            result = np.maximum.reduce([result, inside + 2 * self.noticeable, bent])
        return result

    def place(self, what: Any) -> tuple[Array, str]:
        """The point (3,) [m] that an argument means, and how to name it.

        Args:
            what: An object's name, three coordinates [m], "start" or "goal" (of the original), or
                {"between": [a, b]}, the midpoint of two places.

        Raises:
            UnknownObject: If the scene has no such object.
        """
        name = f"the old {what}" if what in ("start", "goal") else named(what)
        if isinstance(what, str) and what not in ("start", "goal"):
            name = f"the {self.scene[what].name}"
        return locate(what, self.trajectory, self.scene), name

    def item(self, what: Any) -> SceneObject | None:
        """The object that an argument names; None where it means a place."""
        return self.scene[what] if isinstance(what, str) and what in self.scene else None

    def reach(self, what: Any, axis: Array) -> float:
        """How far what an argument means reaches beyond its centre along a unit vector (3,) [m]."""
        item = self.item(what)
        return 0.0 if item is None else extent_along(item, axis)

    def stretch(self, where: Where) -> Array:
        """The adapted positions (K, 3) [m], K >= 2, of a part of the original; of all of it where nothing is left."""
        _, rows = (self.original, self.adapted) if where is None else self.part(where)
        rows = rows if len(rows) else self.adapted
        return rows[[0, *range(len(rows))], :3]  # the first twice, so that a single one is a segment, too

    def part(self, where: Where) -> tuple[Array, Array]:
        """The waypoints of a part that are left: original rows (K, 4) and the adapted rows (K, 4) that they became."""
        mask = selected(self, where) & self.found
        return self.original[mask], self.matched[mask]

    def along(self, word: str) -> Array:
        """Displacement (N,) of each original waypoint along a direction word [m]."""
        return np.asarray(self.shift @ self.scene.frame.direction(word))


def selected(pair: Pair, where: Where) -> Mask:
    """Which original waypoints a part of the path means, (N,).

    Raises:
        ValueError: If `where` describes no part of a path.
        UnknownObject: If it names an object that the scene does not have.
    """
    return PathPart.from_json(where).mask(pair.trajectory, pair.scene)


def said(where: Where) -> str:
    """A part of the path in words, beginning with a blank; "" for everything."""
    words = PathPart.from_json(where).words()
    return f" {words}" if words else ""


def feet(path: Array, points: Array) -> Array:
    """The nearest points (M, 3) on a polyline (N, 3) to points (M, 3)."""
    return interpolate(path, project(path, points)[1])


JSON = Any
"""What a JSON file can hold: None, bool, int, float, str, lists and string-keyed mappings of these."""

P = ParamSpec("P")

BUILDERS: dict[str, Callable[..., Check]] = {}
"""The functions that build the checks of one predicate, by its name."""


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
        elif self.kind not in _PREDICATES:
            raise ValueError(f"unknown check {self.kind!r}; known are {', '.join(sorted(kinds()))}")
        elif self.children:
            raise ValueError(f"{self.kind} takes no children; combine checks with all_of, any_of and not_")
        elif not (taken := _taken(self.kind))[0] <= self.arguments.keys() <= taken[1]:
            _bind(self.kind, **self.arguments)

    def __hash__(self) -> int:
        return hash(json.dumps(self.to_dict(), sort_keys=True))

    def judge(self, original: Trajectory, adapted: Trajectory, scene: Scene) -> CheckResult:
        """Measure an adaptation.

        Raises:
            UnknownObject: If the check names an object that the scene does not have.
        """
        return self.judge_pair(Pair(original.to_array(), adapted.to_array(), scene))

    def judge_pair(self, pair: Pair) -> CheckResult:
        """Measure an adaptation whose waypoints have been matched already."""
        if self.kind not in _COMBINATIONS:
            return _PREDICATES[self.kind](pair, **self.arguments)
        return _COMBINATIONS[self.kind]([child.judge_pair(pair) for child in self.children])

    def passes(self, pair: Pair) -> bool:
        """Whether `judge_pair` passes; looks no further than it must."""
        if self.kind in ("all_of", "any_of"):
            combine = all if self.kind == "all_of" else any
            return combine(child.passes(pair) for child in self.children)
        return self.judge_pair(pair).passed

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
    whole = spelled_out(inspect.signature(judge))
    public = whole.replace(parameters=list(whole.parameters.values())[1:], return_annotation=Check)
    _PREDICATES[kind], _SIGNATURES[kind] = judge, public

    @functools.wraps(judge)
    def build(*args: P.args, **kwargs: P.kwargs) -> Check:
        given, defaults = _bind(kind, *args, **kwargs), public.parameters
        return Check(kind, {name: value for name, value in given.items() if value != defaults[name].default})

    vars(build).pop("__wrapped__")
    vars(build)["__signature__"] = public
    BUILDERS[kind] = build
    return build


GONE, FEW = "none of those waypoints is left", "too few waypoints are left"
"""Facts about a part of the path that cannot be measured any more."""


def say(passed: bool, wish: str, fact: str) -> CheckResult:
    """A check result whose sentence is the fact, preceded by the request if it failed."""
    return CheckResult(bool(passed), sentence(fact) if passed else f"Please {wish}: {fact}.")


def stated(metres: OffsetLimits) -> dict[str, float]:
    """The direction words to which an amount is given."""
    return {word: amount for word in DIRECTIONS if (amount := metres.get(word)) is not None}  # type: ignore[misc]


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


def _bind(kind: str, *args: Any, **kwargs: Any) -> dict[str, Any]:
    """Arguments by name, where they fit a predicate."""
    try:
        return _SIGNATURES[kind].bind(*args, **kwargs).arguments
    except TypeError as error:
        raise ValueError(f"{kind}: {error}") from None


@functools.cache
def _taken(kind: str) -> tuple[frozenset[str], frozenset[str]]:
    """The names of a predicate's arguments without defaults, and of all."""
    parameters = _SIGNATURES[kind].parameters
    return frozenset(name for name, p in parameters.items() if p.default is p.empty), frozenset(parameters)


_PREDICATES: dict[str, Callable[..., CheckResult]] = {}
_SIGNATURES: dict[str, inspect.Signature] = {}
_COMBINATIONS: dict[str, Callable[[list[CheckResult]], CheckResult]] = {"all_of": _all, "any_of": _any, "not_": _not}
