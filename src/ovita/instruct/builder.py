"""A policy being composed from frames: steps as data, parameters that know their slot, parts of the path as masks."""

from __future__ import annotations

import keyword
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ovita.errors import OvitaError
from ovita.instruct import frames as F
from ovita.instruct.frames import Quantity, SemanticFrame
from ovita.instruct.lexicon import END_SHARE, Scale, end_share, nice
from ovita.limits.problem import from_object
from ovita.paths.geometry import Mask, closest_to_point, runs
from ovita.paths.part import PathPart
from ovita.paths.robot import Robot
from ovita.paths.scene import DIRECTIONS, OPPOSITE, Frame, Scene, SceneObject, canonical
from ovita.paths.trajectory import Array, Trajectory, interpolate
from ovita.policy import Parameter
from ovita.policy.policy import TooMuch, prove_statements, run_proof
from ovita.policy.source import MAX_NOTE, Role, Value
from ovita.text import clean_text
from ovita.toolkit import CATALOGUE, Recorder

STILL = (F.Keep, F.Pace, F.Wait, F.StopAt, F.Resample)
"""Frames that do not change where the path goes."""

RESERVED = frozenset({"traj", "scene", "original", "given", "part", "np", "math"})
NOTHING: Mapping[str, str] = {}
SHARES = {"first": END_SHARE, "last": END_SHARE, "middle": 1 / 3, "turns": 0.25}
"""How much of the waypoints a part of the path means where it is left open."""


SPARE = 0.02
"""Room beyond the least that a robot keeps from an object, for the bends on the way there [m]."""


@dataclass(frozen=True)
class PolicyStep:
    """One step of a policy.

    Args:
        code: Its statements.
        plan: One sentence for people, or "".
        promises: Its postconditions, each by what it is about: a later one about the same takes its place.
        holds: Whether the path already does it.
    """

    code: tuple[str, ...] = ()
    plan: str = ""
    promises: Mapping[str, str] = field(default_factory=dict)
    holds: bool = False


@dataclass
class PolicyBuilder:
    """A policy being composed; its steps are printed once, by `source`.

    `shifts` names the parameters that shift the whole path, by direction, so that later steps can allow for them;
    along the directions in `exact` the amount is stated or the height is kept; `kept` is what stays as it is.
    """

    trajectory: Trajectory
    scene: Scene
    effort: int = 1
    robot: Robot | None = None
    frames: Sequence[SemanticFrame] = ()
    steps: list[PolicyStep] = field(default_factory=list)
    parameters: dict[str, Parameter] = field(default_factory=dict)
    objects: dict[str, SceneObject] = field(default_factory=dict)
    masks: dict[str, tuple[str, str]] = field(default_factory=dict)
    shifts: dict[str, list[str]] = field(default_factory=dict)
    exact: set[str] = field(default_factory=set)
    kept: set[str] = field(default_factory=set)
    assumptions: list[str] = field(default_factory=list)
    contacts: list[str] = field(default_factory=list)
    question: str = ""
    frame: int = 0
    distances: list[tuple[SceneObject, float, str]] = field(default_factory=list)
    goal_moved: bool = False
    _waiting: list[str] = field(default_factory=list)
    _rows: tuple[int, Array] | None = None

    def room(self, item: SceneObject) -> float:
        """How far beyond what is known of an object's surface the robot's centre has to stay [m]."""
        if self.robot is None:
            return 0.0
        own = 0.0 if item.dimensions is not None else self.robot.object_size / 2.0
        return nice(own + from_object(item, self.robot, "box").keep + SPARE)

    def has(self, *kinds: type[SemanticFrame]) -> bool:
        """Whether there are frames of some kinds."""
        return any(isinstance(frame, kinds) for frame in self.frames)

    @property
    def moving(self) -> int:
        """How many frames change where the path goes."""
        return sum(not isinstance(frame, STILL) for frame in self.frames)

    @property
    def alone(self) -> bool:
        """Whether the path is changed by one frame at most, and not cut short besides."""
        return self.moving <= 1 and not (len(self.frames) > 1 and self.has(F.StopAt, F.Trim))

    @property
    def scale(self) -> Scale:
        """How far words of degree reach in this scene."""
        return Scale.of(self.trajectory)

    @property
    def plan(self) -> list[str]:
        """What the policy does, a sentence for each step."""
        return [step.plan for step in self.steps if step.plan]

    @property
    def held(self) -> list[str]:
        """The sentences of the plan that the path already fulfils."""
        return [step.plan for step in self.steps if step.holds]

    @property
    def promises(self) -> dict[str, str]:
        """The postconditions, by what they are about."""
        found: dict[str, str] = {}
        for step in self.steps:
            for about, code in step.promises.items():
                found.pop(about, None)
                found |= {about: code} if code else {}
        return found

    def add(
        self, code: str, plan: str = "", *promises: str, holds: bool = False, ends: Mapping[str, str] = NOTHING
    ) -> None:
        """Add a step with postconditions; those in `ends` take the place of earlier ones about the same."""
        lines = (*self._waiting, *([code] if code else []))
        self._waiting.clear()
        self.steps.append(PolicyStep(lines, plan, {p: p for p in promises if p} | dict(ends), holds))

    def before(self, code: str) -> None:
        """Put a statement in front of the next step."""
        self._waiting.append(code)

    def knob(
        self,
        name: str,
        value: Value,
        role: Role,
        meaning: str,
        slot: str,
        *,
        unit: str = "m",
        about: str = "",
        direction: str = "",
    ) -> str:
        """Add a parameter that stands for a slot of the present frame, under a free name; return that name."""
        free, n = name, 2
        while not self._is_free(free):
            free, n = f"{name}_{n}", n + 1
        meaning = clean_text(" ".join(meaning.split()), MAX_NOTE)
        self.parameters[free] = Parameter(free, value, unit, meaning, role, about, direction, f"{self.frame}.{slot}")
        return free

    def ref(self, item: SceneObject) -> str:
        """The variable that holds an object."""
        for name, known in self.objects.items():
            if known is item:
                return name
        plain = "".join(c if c.isascii() and c.isalnum() else "_" for c in canonical(item.name))
        name = "_".join(filter(None, plain.split("_"))) or "item"
        name = f"the_{name}" if name[0].isdigit() else name
        while not self._is_free(name):
            name += "_"
        self.objects[name] = item
        return name

    def _is_free(self, name: str) -> bool:
        taken = name in self.parameters or name in self.objects or name in CATALOGUE or name in RESERVED
        return not (taken or keyword.iskeyword(name) or name.removeprefix("part_").isdigit())

    def assume(self, text: str) -> None:
        """Add an assumption, once."""
        if text not in self.assumptions:
            self.assumptions.append(text)

    def ask(self, question: str) -> None:
        """Ask back instead of writing a policy; the first question counts."""
        self.question = self.question or question

    def rows(self) -> Array:
        """The trajectory (N, 4+) as the steps so far leave it."""
        done = sum(len(step.code) for step in self.steps)
        if not done:
            return self.trajectory.to_array()
        if self._rows is None or self._rows[0] != done:
            try:
                rows, _ = self.run()
            except (TooMuch, OvitaError):
                rows = self.trajectory.to_array()
            self._rows = done, np.asarray(rows)
        return self._rows[1]

    def run(self) -> tuple[Any, Recorder]:
        """What the steps so far make of the trajectory, unchecked, and their postconditions.

        Raises:
            TooMuch: If they are not proven, and so belong into the sandbox.
            PolicyCrashed: If one fails.
        """
        proof = prove_statements(tuple(self.parameters), self.statements())
        if proof is None:
            raise TooMuch
        values = {name: parameter.value for name, parameter in self.parameters.items()}
        return run_proof(proof, self.trajectory.to_array(), self.scene, values)

    @property
    def positions(self) -> Array:
        """The path (N, 3) [m] as the steps so far leave it."""
        return self.rows()[:, :3]

    def item(self, place: F.Place) -> SceneObject | None:
        """The object that a place is; None for an end, the middle, a waypoint, a midpoint or no place."""
        return self.scene[place] if isinstance(place, str) and place not in ("", *F.SPOTS) else None

    def axis(self, direction: str) -> Array:
        """The unit vector (3,) of a direction word."""
        return self.scene.frame.direction(direction)

    def passing(self, point: Array) -> Array:
        """The place (3,) on the path that is nearest to a point (3,) [m], as the steps so far leave it."""
        positions = self.positions
        return np.asarray(interpolate(positions, np.array([closest_to_point(positions, point)[1]]))[0])

    def word(self, direction: str) -> str:
        """A direction or an axis of the frame, such as "-x", as a direction word."""
        return direction_word(self.scene.frame, direction)

    def metres(self, q: Quantity, whole: float, what: str) -> float:
        """A quantity as a length [m]; shares and multiples are of the whole. Asks where it is none."""
        if q.unit in ("%", "x"):
            return q.value * whole
        if q.unit not in ("m", ""):
            self.ask(f"How many metres are {q.said or f'{q.value:g} {q.unit}'}, {what}?")
        elif not q.unit and abs(q.value) > max(2.0 * float(np.abs(self.positions).max()), 4.0 * self.scale.extent):
            self.ask(f"{q.value:g} m {what} is far beyond this path: in which unit is it?")
        elif not q.unit:
            self.assume(f"{q.value:g} is in metres")
        return q.value

    def hold(self) -> str:
        """The argument that keeps later steps from disturbing exact amounts, or ""."""
        words = sorted(self.exact)
        return f", hold={words[0]!r}" if len(words) == 1 else f", hold={words!r}" if words else ""

    def shifted(self, direction: str) -> str:
        """The shift of the whole path along a direction as an expression, such as "up - down", or ""."""
        along = [f" + {name}" for name in self.shifts.get(direction, [])]
        against = [f" - {name}" for name in self.shifts.get(OPPOSITE[direction], [])]
        return "".join([*along, *against])

    def part(self, part: PathPart) -> tuple[str, str]:
        """The name of a part's mask and words for the end of a sentence; both "" for the whole path.

        As long as no step has changed the number of waypoints, the mask is that of the given trajectory, so that a
        shift does not change which part a later step is about.
        """
        if not part:
            return "", ""
        same = len(self.rows()) == len(self.trajectory)
        key = repr(part)  # a midpoint among its places has no hash
        if key not in self.masks or not same:
            code, words = mask_code(self, part, "original" if same else "traj")
            name = f"part_{len(self.masks) + 1}" if self.masks else "part"
            self.before(f"{name} = {code}")
            self.masks[key] = name, f" {words}"
        name, words = self.masks[key]
        return name, words

    def waypoints(self, part: PathPart) -> Mask:
        """Which waypoints of the given trajectory a part means, as `part` has it."""
        if part.kind == "indices" and not part.ranges:
            return np.zeros(len(self.trajectory), dtype=bool)
        return resolved(self, part).mask(self.trajectory, self.scene)

    def source(self, summary: str) -> str:
        """The policy's source."""
        lines = ["def adapt(", "    traj,", "    scene,"]
        lines += ["    *,"] if self.parameters else []
        lines += [f"    {p.name}={p.value!r},  # {p.comment}" for p in self.parameters.values()]
        lines += ["):", f'    """{" ".join(summary.split())}"""']
        return "\n".join([*lines, *(f"    {line}" for line in self.statements()), ""])

    def statements(self) -> list[str]:
        """The statements of the policy's function."""
        body = [line for step in self.steps for line in step.code] + list(self.promises.values())
        start = ["original = traj"] if any("original" in line for line in body) else []
        named = [f"{name} = scene[{item.name!r}]" for name, item in self.objects.items()]
        return [*named, *start, *body, "return traj"]


def direction_word(frame: Frame, direction: str) -> str:
    """A direction or an axis, such as "-x", as one of a frame's direction words."""
    if direction in DIRECTIONS:
        return direction
    vector = np.array([float(axis == direction[-1]) for axis in "xyz"])
    (word,) = frame.words(-vector if direction.startswith("-") else vector)
    return word


def short(value: float) -> float:
    """A number to six digits, as code shows it."""
    return float(f"{value:.6g}")


def aiming(aim: str) -> str:
    """The argument of a call that says what of an object is meant, or ""."""
    return f", aim={aim!r}" if aim else ""


def argument(mask: str) -> str:
    """A mask as a further argument, or ""."""
    return f", where={mask}" if mask else ""


def resolved(builder: PolicyBuilder, part: PathPart) -> PathPart:
    """A part of the path with what it leaves open filled in."""
    if part.parts:
        return PathPart(part.kind, parts=tuple(resolved(builder, inner) for inner in part.parts))
    if part.kind in SHARES and part.amount is None:
        return PathPart(part.kind, amount=SHARES[part.kind], unit="share")
    if part.kind in ("beyond", "heading"):
        return PathPart(part.kind, amount=part.amount or 0.0, direction=builder.word(part.direction))
    if part.kind == "near":
        return _resolved_near(builder, part)
    place = part.places[0] if part.kind in ("after", "before") else None
    share = _SHARE_AT.get(place) if isinstance(place, str) else None
    if share is None:
        return part
    low, high = (share, None) if part.kind == "after" else (0.0, share)
    return PathPart("range", amount=low, until=high, unit="share")


def _resolved_near(builder: PolicyBuilder, part: PathPart) -> PathPart:
    stretch = {"start": "first", "goal": "last", "middle": "middle"}.get(part.places[0])
    if stretch == "middle" or (stretch and part.amount is None):
        return PathPart(stretch, amount=SHARES[stretch], unit="share")
    if part.amount is not None:
        return part
    reach = builder.scale.near(builder.trajectory.positions, builder.scene[part.places[0]])
    return PathPart("near", part.places, reach)


_SHARE_AT = {"start": 0.0, "goal": 1.0, "middle": 0.5}
"""How far along the path its ends and its middle are."""


def mask_code(builder: PolicyBuilder, part: PathPart, traj: str = "traj") -> tuple[str, str]:
    """Code of the mask of a part of the path, and words for it; asks back where it selects nothing."""
    part, was = resolved(builder, part), part
    if part.kind not in ("outside", "both", "either") and not builder.waypoints(part).any():
        _ask_for(builder, part)
    code = _CODE.get(part.kind)
    if code is None or (part.kind in ("first", "last") and part.unit in ("m", "s")):
        return _listed(builder, part, traj)
    return code(builder, part, was, traj)


def _ask_for(builder: PolicyBuilder, part: PathPart) -> None:
    if part.kind == "near" and part.places[0] in builder.scene:
        item = builder.scene[part.places[0]]
        gap = float(item.distance(builder.trajectory.positions).min())
        builder.ask(
            f"No waypoint is within {part.amount:.3g} m of {item.name}, the closest is {gap:.3g} m away:"
            " how near should count?"
        )
    elif part.kind == "range" and part.unit == "waypoints":
        last = len(builder.trajectory)
        builder.ask(
            f"The path has {last} waypoints, counted from 1: which ones are meant by {(part.amount or 0) + 1:g} and on?"
        )
    elif part.kind == "indices" and not part.ranges:
        builder.ask("Nothing is selected: which part of the path is meant?")
    else:
        builder.ask(f"No part of the path is {part.words()}: which part is meant?")


def _near(builder: PolicyBuilder, part: PathPart, was: PathPart, traj: str) -> tuple[str, str]:
    place, value = part.places[0], part.amount or 0.0
    if place in ("start", "goal"):
        at, name = f"{traj}[{0 if place == 'start' else -1}, :3]", f"the {place}"
    else:
        at, name = builder.ref(builder.scene[place]), builder.scene[place].name
    if was.amount is None:
        builder.assume(f'"near {name}" is within {value:g} m of its centre')
    known = "" if place in ("start", "goal") else name
    free, meaning = f"{at}_radius" if known else "radius", f"distance to {name} that counts as near"
    radius = builder.knob(free, value, "radius", meaning, "part", about=known)
    return f"near({traj}, {at}, within={radius})", f"within {value:g} m of {name}"


def _end(builder: PolicyBuilder, part: PathPart, was: PathPart, traj: str) -> tuple[str, str]:
    kind, amount = part.kind, part.amount or 0.0
    side = "start" if kind == "first" else "end"
    if part.unit == "share":
        share = round(amount, 4)
        if was.amount is None:
            builder.assume(end_share(kind))
        name = builder.knob(f"{kind}_share", share, "share", f"share of the waypoints at the {side}", "part", unit="")
        return f"{kind}({traj}, fraction={name})", f"for the {kind} {share:.0%} of the waypoints"
    count = min(max(int(amount), 1), len(builder.trajectory))
    name = builder.knob(f"{kind}_waypoints", count, "of", f"number of waypoints at the {side}", "part", unit="")
    return f"{kind}({traj}, {name})", f"for the {kind} {count} waypoints"


def _middle(builder: PolicyBuilder, part: PathPart, was: PathPart, traj: str) -> tuple[str, str]:
    if was.amount is None:
        builder.assume('"the middle" is the middle third of the waypoints')
    share = part.amount if part.unit == "share" else (part.amount or 1.0) / len(builder.trajectory)
    return _listed(builder, PathPart("middle", amount=share), traj, f"in the middle {share:.0%} of the path")


def _range(builder: PolicyBuilder, part: PathPart, was: PathPart, traj: str) -> tuple[str, str]:
    if part.unit != "waypoints":
        return _listed(builder, part, traj)
    chosen = np.flatnonzero(part.mask(builder.trajectory, builder.scene))
    begin, end = (int(chosen[0]), int(chosen[-1])) if len(chosen) else (0, 0)
    builder.assume("waypoints are counted from 1")
    a = builder.knob("first_index", begin, "at", "index of the first waypoint, from 0", "part", unit="")
    b = builder.knob("last_index", end, "at", "index of the last waypoint, from 0", "part", unit="")
    words = f"at waypoint {begin + 1}" if begin == end else f"from waypoint {begin + 1} to {end + 1}"
    return f"between({traj}, {a}, {b})", words


def _along(builder: PolicyBuilder, part: PathPart, was: PathPart, traj: str) -> tuple[str, str]:
    at, name = _spot(builder, part.places[0])
    if part.kind == "between":
        other, second = _spot(builder, part.places[1])
        return f"between({traj}, {at}, {other})", f"between {name} and {second}"
    span = f"{at}, 1.0" if part.kind == "after" else f"0.0, {at}"
    return f"between({traj}, {span})", f"{part.kind} {name}"


def _spot(builder: PolicyBuilder, place: object) -> tuple[str, str]:
    if isinstance(place, Mapping):
        a, b = (builder.scene[name] for name in place["between"])
        return f"midpoint({builder.ref(a)}, {builder.ref(b)})", f"the midpoint of {a.name} and {b.name}"
    if place in F.SPOTS:
        return str(_SHARE_AT[str(place)]), f"the {place}"
    item = builder.scene[str(place)]
    return builder.ref(item), item.name


def _heading(builder: PolicyBuilder, part: PathPart, was: PathPart, traj: str) -> tuple[str, str]:
    return f"where_rising({traj}, {part.direction!r})", f"where it heads {part.direction}"


def _beyond(builder: PolicyBuilder, part: PathPart, was: PathPart, traj: str) -> tuple[str, str]:
    axis = builder.axis(part.direction)
    k = int(np.flatnonzero(axis)[0])
    sign = "" if axis[k] > 0 else "-"
    amount = part.amount or 0.0
    meaning = f"how far {part.direction} the part begins"
    name = builder.knob(f"{part.direction}_of", amount, "at", meaning, "part", direction=part.direction)
    return f"{sign}{traj}[:, {k}] > {name}", f"further {part.direction} than {amount:g} m"


def _every(builder: PolicyBuilder, part: PathPart, was: PathPart, traj: str) -> tuple[str, str]:
    k = int(np.clip(part.amount or 1, 1, len(builder.trajectory)))
    return f"every({traj}, {k})", f"at every {k}. waypoint"


def _outside(builder: PolicyBuilder, part: PathPart, was: PathPart, traj: str) -> tuple[str, str]:
    inside, words = mask_code(builder, was.parts[0], traj)
    if builder.waypoints(part.parts[0]).all():
        builder.ask(f"That is the whole path ({words}): what is left?")
    return f"~({inside})", f"everywhere except {words.removeprefix('for ')}"


def _joined(builder: PolicyBuilder, part: PathPart, was: PathPart, traj: str) -> tuple[str, str]:
    codes, words = zip(*(mask_code(builder, inner, traj) for inner in was.parts), strict=True)
    sign, word = (" & ", ", ") if part.kind == "both" else (" | ", " and ")
    if part.kind == "both" and not builder.question and not builder.waypoints(part).any():
        builder.ask(f"No part of the path is {word.join(words)}: which part is meant?")
    return sign.join(f"({code})" for code in codes), word.join(words)


def _listed(builder: PolicyBuilder, part: PathPart, traj: str, words: str = "") -> tuple[str, str]:
    """A part by the indices that it means on the given trajectory."""
    part = resolved(builder, part)
    found = list(runs(builder.waypoints(part)))
    code = " | ".join(f"between({traj}, {a}, {b})" for a, b in found) or f"{traj}[:, 3] < 0.0"
    if part.kind in ("first", "last"):
        count = found[0][1] - found[0][0] + 1 if found else 0
        builder.assume(f"the {part.kind} {part.amount:g} {part.unit} are {count} waypoints")
        words = f"for the {part.kind} {part.amount:g} {part.unit}"
    return code, words or part.words()


_CODE: Mapping[str, Callable[[PolicyBuilder, PathPart, PathPart, str], tuple[str, str]]] = {
    "near": _near, "first": _end, "last": _end, "middle": _middle, "range": _range, "between": _along,
    "after": _along, "before": _along, "heading": _heading, "beyond": _beyond, "every": _every,
    "outside": _outside, "both": _joined, "either": _joined,
}  # fmt: skip
