"""A policy being composed from frames: steps as data, parameters that know their slot, parts of the path as masks."""

from __future__ import annotations

import keyword
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain, count
from typing import Any

import numpy as np

from ovita.errors import OvitaError
from ovita.instruct import frames as F
from ovita.instruct.degrees import END_SHARE, Degree, Scale, nice
from ovita.instruct.frames import Quantity, SemanticFrame
from ovita.instruct.stretches import contested, left_out, near_without_stays
from ovita.limits.problem import from_object, kind_of
from ovita.paths.geometry import Mask, closest_to_point, lengths, runs
from ovita.paths.part import PathPart, both, outside
from ovita.paths.robot import UNLIMITED, Robot
from ovita.paths.scene import DIRECTIONS, Frame, Scene, SceneObject, canonical
from ovita.paths.trajectory import Array, Trajectory, arc_length, interpolate
from ovita.policy import Parameter
from ovita.policy.policy import TooMuch, prove_statements, run_proof
from ovita.policy.source import MAX_NOTE, Role, Value
from ovita.text import clean_text, listed, waypoints
from ovita.toolkit import CATALOGUE, Recorder
from ovita.toolkit.approach import stays
from ovita.toolkit.arguments import headings

STILL = (F.Keep, F.Pace, F.Wait, F.StopAt, F.Resample)
"""Frames that do not change where the path goes."""

LEVELLED, UNMOVED = (F.Shift, F.Height, F.OneHeight), 1e-6
"""Frames about how high or far over a part of the path is, and what is no shift [m]."""

RESERVED = frozenset({"traj", "scene", "original", "given", "np", "math"})
NOTHING: Mapping[str, str] = {}
SHARES = {
    "first": (END_SHARE, "at the start", "first"),
    "last": (END_SHARE, "at the end", "last"),
    "middle": (1 / 3, "in the middle", "middle"),
    "turns": (0.25, "in turns", "most bent"),
}
"""How much of the waypoints a part of the path means where it is left open, how it is said, and which ones."""

STRETCHES = {"start": "first", "goal": "last", "middle": "middle"}
"""What is near the ends and the middle of the path."""

SPARE = 0.02
"""Room beyond the least that a robot keeps from an object, for the bends on the way there [m]."""


@dataclass
class PolicyBuilder:
    """A policy being composed; it is printed once, by `source`.

    `plan` is what it does, a sentence for each step, and `held` those of them that the path fulfils already; `promises`
    are its postconditions, by what they are about, and `steps` after how many lines of code each was made. `shifts`
    names the parameters that shift the whole path, by direction; along the directions in `exact` the amount is stated
    or the height is kept; `kept` is what stays.
    """

    trajectory: Trajectory
    scene: Scene
    effort: int = 1
    robot: Robot | None = None
    frames: Sequence[SemanticFrame] = ()
    code: list[str] = field(default_factory=list)
    plan: list[str] = field(default_factory=list)
    held: list[str] = field(default_factory=list)
    promises: dict[str, str] = field(default_factory=dict)
    steps: dict[str, int] = field(default_factory=dict)
    parameters: dict[str, Parameter] = field(default_factory=dict)
    objects: dict[str, SceneObject] = field(default_factory=dict)
    masks: dict[str, tuple[str, str]] = field(default_factory=dict)
    shifts: dict[str, list[str]] = field(default_factory=dict)
    exact: set[str] = field(default_factory=set)
    kept: set[str] = field(default_factory=set)
    assumptions: list[str] = field(default_factory=list)
    question: str = ""
    frame: int = 0
    distances: list[tuple[SceneObject, float, str]] = field(default_factory=list)
    passed: list[tuple[Array, str]] = field(default_factory=list)
    limits: list[tuple[float, Role, str]] = field(default_factory=list)
    goal_moved: bool = False
    _taken: set[str] = field(default_factory=lambda: {*CATALOGUE, *RESERVED, *keyword.kwlist})
    _rows: tuple[int, Array] | None = None

    def room(self, item: SceneObject) -> float:
        """How far beyond what is known of an object's surface the robot's centre has to stay [m]."""
        if self.robot is None:
            return 0.0
        own = 0.0 if item.dimensions is not None else self.robot.object_size / 2.0
        return nice(own + from_object(item, self.robot, "box").keep + SPARE)

    def leeway(self, item: SceneObject) -> float:
        """How much closer to a person or an animal the path may come [m]; infinite for a thing."""
        if kind_of(item.name, item.extra) is None:
            return math.inf
        body = from_object(item, self.robot or UNLIMITED, "box", self.trajectory.positions)
        return float(body.closest(self.positions)[0])

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

    def stay(self) -> dict[str, str]:
        """Postconditions that the ends stay, where no other step moves them."""
        return {"start": "expect_start()", "goal": "expect_goal()"} if self.alone else {}

    def rest_stays(self, where: str) -> str:
        """The postcondition that the path outside a part is as before, where no other step changes it; or ""."""
        return f"expect_same_path(~{where})" if where and self.alone else ""

    @property
    def scale(self) -> Scale:
        """How far words of degree reach in this scene."""
        return Scale.of(self.trajectory)

    def step(self, frame: SemanticFrame) -> float:
        """How far a frame's word of degree reaches [m]."""
        return self.scale.step(degree(frame))

    @property
    def tolerance(self) -> float:
        """How near counts as passing through a place [m]."""
        return nice(0.02 * self.scale.extent)

    def add(
        self, code: str, plan: str = "", *promises: str, holds: bool = False, ends: Mapping[str, str] = NOTHING
    ) -> None:
        """Add a step with postconditions; those in `ends` take the place of earlier ones about the same."""
        self.code += [code] if code else []
        self.plan += [plan] if plan else []
        self.held += [plan] if holds else []
        for about, promise in (dict(zip(promises, promises, strict=True)) | dict(ends)).items():
            self.promises.pop(about, None)
            self.promises |= {about: promise} if promise else {}
            self.steps[about] = len(self.code)

    def add_within(
        self, part: PathPart, call: str, plan: str, *promises: str, ends: Mapping[str, str] = NOTHING
    ) -> None:
        """Add a step by a call that changes the whole path, undone outside a part."""
        where, words = self.part(part)
        if where:
            self.code.append("given = traj")
            call, ends = f"keep_unchanged({call}, given, ~{where})", NOTHING
        self.add(f"traj = {call}", f"{plan}{words}.", *promises, self.rest_stays(where), ends=ends)

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
        free, meaning = self._free(name), clean_text(" ".join(meaning.split()), MAX_NOTE)
        self.parameters[free] = Parameter(free, value, unit, meaning, role, about, direction, f"{self.frame}.{slot}")
        return free

    def ref(self, item: SceneObject) -> str:
        """The variable that holds an object."""
        for name, known in self.objects.items():
            if known is item:
                return name
        plain = "".join(c if c.isascii() and c.isalnum() else "_" for c in canonical(item.name))
        name = "point" if item.name.startswith("(") else "_".join(filter(None, plain.split("_"))) or "item"
        name = self._free(f"the_{name}" if name[0].isdigit() or name in self._taken else name)
        self.objects[name] = item
        return name

    def _free(self, name: str) -> str:
        """A name like this one that nothing else has; from now on it is taken."""
        names = chain([name], (f"{name}_{n}" for n in count(2)))
        free = next(name for name in names if name not in self._taken)
        self._taken.add(free)
        return free

    def assume(self, text: str) -> None:
        """Add an assumption, once."""
        if text not in self.assumptions:
            self.assumptions.append(text)

    def ask(self, question: str) -> None:
        """Ask back instead of writing a policy; the first question counts."""
        self.question = self.question or question

    def rows(self) -> Array:
        """The trajectory (N, 4+) as the steps so far leave it."""
        if not self.code:
            return self.trajectory.to_array()
        if self._rows is None or self._rows[0] != len(self.code):
            try:
                rows, _ = self.run()
            except (TooMuch, OvitaError):
                rows = self.trajectory.to_array()
            self._rows = len(self.code), np.asarray(rows)
        return self._rows[1]

    def run(self, lines: int | None = None) -> tuple[Any, Recorder]:
        """What the steps so far, or their first lines, make of the trajectory, unchecked, and their postconditions.

        Raises:
            TooMuch: If they are not proven, and so belong into the sandbox.
            PolicyCrashed: If one fails.
        """
        proof = prove_statements(tuple(self.parameters), self.statements(lines))
        if proof is None:
            raise TooMuch
        values = {name: parameter.value for name, parameter in self.parameters.items()}
        return run_proof(proof, self.trajectory.to_array(), self.scene, values)

    def after(self, call: str) -> Array:
        """The path (M, 3) [m] that a call would make of what the steps so far leave."""
        self.code.append(f"traj = {call}")
        positions, self._rows = self.positions, None
        self.code.pop()
        return positions

    def shifts_by(self, call: str) -> Array:
        """How far each waypoint would go by a call that keeps their number (N,) [m]; 0 where it fails."""
        before, after = self.positions, self.after(call)
        return np.asarray(np.linalg.norm(after - before, axis=1) if len(after) == len(before) else np.zeros(1))

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

    def metres(self, q: Quantity, whole: float | None = None) -> float:
        """A quantity as a length [m], a share of the whole, or of the path's extent; asks where it is none."""
        if q.unit in ("%", "x"):
            return q.value * (self.scale.extent if whole is None else whole)
        if q.unit not in ("m", ""):
            self.ask(f"How many metres are {q.said or f'{q.value:g} {q.unit}'}?")
        return q.value

    def length(self, q: Quantity | None, usual: float, what: str, whole: float | None = None) -> float:
        """A length that is stated, or the usual one, which is told [m]."""
        if q is not None:
            return self.metres(q, whole)
        self.assume(f"{what} is {usual:g} m in this scene")
        return usual

    def hold(self) -> str:
        """The argument that keeps later steps from disturbing exact amounts, or ""."""
        words = sorted(self.exact)
        return f", hold={words[0]!r}" if len(words) == 1 else f", hold={words!r}" if words else ""

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
            code = mask_code(self, part, "original" if same else "traj")
            name = self._free("part")
            taken = self._contested(part) if same else []
            self.code.append(" & ".join([f"{name} = {code}", *(f"~between(original, {a}, {b})" for a, b in taken)]))
            self.masks[key] = name, f" {_words(resolved(self, part))}"
        return self.masks[key]

    def _contested(self, part: PathPart) -> Sequence[tuple[int, int]]:
        """The waypoints of a part of the present frame that other frames have, as ranges."""
        own = [frame for frame in self.frames[self.frame : self.frame + 1] if frame.part == part]
        return contested(own[0], self.frames, self.trajectory, self.scene, self.waypoints) if own else []

    def eased(self, part: PathPart, call: str) -> str:
        """A call that moves a part, which the path beside it follows only as far as to the parts of other frames."""
        beside = [f.part for f in self.frames if f.part != part and isinstance(f, LEVELLED)]
        if not part or not beside or len(self.positions) != len(self.trajectory):
            return call
        mine, s = self._selected(part), arc_length(self.positions)
        follows = (self.shifts_by(call) > UNMOVED) & ~mine
        others = [self._selected(other) & ~mine for other in beside]
        reached = np.logical_or.reduce([other for other in others if (follows & other).any()], initial=False)
        if not np.any(reached):
            return call
        edges = s[mine]
        after = np.searchsorted(edges, s[reached])
        around = [edges[np.clip(after + step, 0, len(edges) - 1)] for step in (-1, 0)]
        gap = min(float(np.abs(s[reached] - edge).min()) for edge in around)
        return f"{call[:-1]}, ease={math.floor(1e4 * gap / s[-1]) / 1e4:g})"

    def _selected(self, part: PathPart) -> Mask:
        """The waypoints that the mask of a part selects; what is outside another part begins right beside it."""
        return ~self._selected(part.parts[0]) if part.kind == "outside" else self.waypoints(part)

    def waypoints(self, part: PathPart) -> Mask:
        """Which waypoints of the given trajectory a part means, as `part` has it."""
        return resolved(self, part).mask(self.trajectory, self.scene)

    def source(self, summary: str) -> str:
        """The policy's source."""
        lines = ["def adapt(", "    traj,", "    scene,"]
        lines += ["    *,"] if self.parameters else []
        lines += [f"    {p.name}={p.value!r},  # {p.comment}" for p in self.parameters.values()]
        lines += ["):", f'    """{" ".join(summary.split())}"""']
        return "\n".join([*lines, *(f"    {line}" for line in self.statements()), ""])

    def statements(self, lines: int | None = None) -> list[str]:
        """The statements of the policy's function, or its first lines of code alone."""
        body = [*self.code, *self.promises.values()] if lines is None else self.code[:lines]
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


def degree(frame: SemanticFrame) -> Degree:
    """How much, where no number says so."""
    return frame.degree or "moderate"


def short(value: float) -> float:
    """A number to six digits, as code shows it."""
    return float(f"{value:.6g}")


def argument(mask: str) -> str:
    """A mask as a further argument, or ""."""
    return f", where={mask}" if mask else ""


def resolved(builder: PolicyBuilder, part: PathPart, *, left_out: bool = False) -> PathPart:
    """A part of the path, or what is left out of one, with what it leaves open filled in, which is told."""
    if part.parts:
        out = left_out or part.kind == "outside"
        inside = tuple(resolved(builder, inner, left_out=out) for inner in part.parts)
        return _end_of_part(builder, replace(part, parts=inside))
    if part.direction:
        return replace(part, amount=part.amount or 0.0, direction=builder.word(part.direction))
    if part.kind in SHARES and part.amount is None:
        share, said, which = SHARES[part.kind]
        if part.kind in ("first", "last") and (metres := builder.scale.end(builder.trajectory.positions)) is not None:
            builder.assume(f'"{said}" is the {which} {metres:g} m')
            return replace(part, amount=metres, unit="m")
        builder.assume(f'"{said}" is the {which} {share:.0%} of the waypoints')
        return replace(part, amount=share, unit="share")
    if part.kind == "indices" and not part.ranges:
        return replace(part, count=len(builder.trajectory))
    if part.kind == "near":
        return _resolved_near(builder, part, part.places[0], left_out)
    if part.kind == "between":
        return _without_stops(builder, _led_between(builder, part))
    return part


def _end_of_part(builder: PolicyBuilder, part: PathPart) -> PathPart:
    """The last metres of what is before a place, or the first of what is after it; any other part as it is."""
    kinds = [inner.kind for inner in part.parts]
    if part.kind != "both" or kinds not in (["last", "before"], ["first", "after"]):
        return part
    end, side = part.parts
    if end.unit not in ("m", "s") and part.mask(builder.trajectory, builder.scene).any():
        return part  # in the second half, and before the cup
    chosen = np.flatnonzero(side.mask(builder.trajectory, builder.scene))
    if len(chosen) < 2:
        return part
    inside = chosen[end.mask(builder.trajectory[chosen[0] : chosen[-1] + 1], builder.scene)]
    return PathPart("range", amount=float(inside[0]), until=float(inside[-1])) if len(inside) else part


def _shifts(builder: PolicyBuilder) -> bool:
    """Whether the present frame takes a part of the path elsewhere."""
    return any(isinstance(one, F.Shift | F.Height) for one in builder.frames[builder.frame : builder.frame + 1])


def _without_stops(builder: PolicyBuilder, part: PathPart) -> PathPart:
    """A part between two objects for a shift, without the stops at its ends."""
    chosen = np.flatnonzero(part.mask(builder.trajectory, builder.scene))
    moves = chosen[~stays(builder.trajectory.to_array())[chosen]] if _shifts(builder) else chosen
    if part.kind != "between" or len(moves) < 2 or (moves[0], moves[-1]) == (chosen[0], chosen[-1]):
        return part
    return PathPart("range", amount=float(moves[0]), until=float(moves[-1]))


def _led_between(builder: PolicyBuilder, part: PathPart) -> PathPart:
    """A part between two objects; where the path passes through between them, all of it that is beside both."""
    items = [builder.item(place) for place in part.places if isinstance(place, str)]
    path = builder.trajectory.positions
    sides = [item.cuboid.signed(path) for item in items if item is not None]
    if len(sides) < 2:
        return part
    (gap, away), (other, back) = sides
    apart = np.where((away * back).sum(axis=1) < FACING, np.maximum(gap, 0.0) + np.maximum(other, 0.0), np.inf)
    inside = apart <= BY * apart.min()
    across = np.abs((headings(path) * (away - back)).sum(axis=1)) / np.maximum(lengths(away - back), 1e-9)
    span = part.mask(builder.trajectory, builder.scene)
    within = bool((span | ~inside).all()) and arc_length(path[span])[-1] > apart.min() / 2.0
    if not np.isfinite(apart).any() or across[inside].mean() > LEADS or within:
        return part  # from the one to the other
    for a, b in runs(~inside):  # a gap of a few waypoints is none
        inside[a : b + 1] |= 0 < a and b < len(path) - 1 and b - a < HOLE
    builder.assume(f"{part.words()} is {listed([waypoints(a, b) for a, b in runs(inside)])}")
    return PathPart("indices", ranges=tuple(runs(inside)), count=len(path))


FACING, LEADS = -0.5, 0.5
"""The cosine from which on a waypoint has two objects on two sides, and that by which a path leads to one of them."""

BY, HOLE = 1.25, 3
"""How many times as wide as the narrowest a gap between two objects may be to be the gap, too, and the fewest
waypoints that are none of it in between."""


def _resolved_near(builder: PolicyBuilder, part: PathPart, place: str, left_out: bool) -> PathPart:
    if place in STRETCHES:
        amount = None if place == "middle" else part.amount
        return resolved(builder, PathPart(STRETCHES[place], amount=amount, unit="m"))
    if part.amount is not None:
        return replace(part, of=part.of or "surface")  # a distance that is said is to the surface, as everywhere
    if left_out and (told := next((f.part for f in builder.frames if _is_told(f.part, place)), None)):
        return resolved(builder, told)  # "within a metre of it at most 0.4; outside of that as it is"
    item = builder.scene[place]
    usual = builder.scale.near(builder.trajectory.positions, item)
    shifted = _shifts(builder) and not left_out
    path, up = builder.trajectory, builder.axis("up")
    reach, rest = near_without_stays(item, usual, path, up) if shifted else (usual, ())
    wide = bool(item.core(builder.trajectory.positions).half.max() > 0.0)
    builder.assume(f'"near {item.name}" is within {reach:g} m of {"the middle of its body" if wide else "its centre"}')
    if rest:
        builder.assume(f"start, goal and stops that are not at {item.name} stay")
    there = PathPart("near", (item.name,), reach, of="centre")
    return both(there, outside(PathPart("indices", ranges=rest, count=len(builder.trajectory)))) if rest else there


def _is_told(part: PathPart, place: str) -> bool:
    """Whether a part says how near a place it is."""
    return part.kind == "near" and part.places == (place,) and part.amount is not None


def _words(part: PathPart) -> str:
    """Words for a part of the path, at the end of a sentence."""
    if part.kind == "near":
        return f"within {part.amount:g} m of {part.places[0]}"
    if part.kind == "outside":
        return f"everywhere except {_words(part.parts[0])}"
    if part.parts:
        return (", " if part.kind == "both" else " and ").join(map(_words, part.parts))
    return "selected" if part.kind == "indices" and not part.ranges else part.words()


def mask_code(builder: PolicyBuilder, part: PathPart, traj: str = "traj") -> str:
    """Code of the mask of a part of the path; asks back where it selects nothing."""
    part = resolved(builder, part)
    if builder.waypoints(part).any():
        return _CODE.get(part.kind, _listed)(builder, part, traj)
    if part.kind == "near":
        path = builder.trajectory.positions
        gap = float(builder.scene[part.places[0]].core(path, part.of).depth(path).min())
        builder.ask(f"No waypoint is {_words(part)}, the closest is {gap:.3g} m away: how near should count?")
    builder.ask(f"No part of the path is {_words(part)}: which part is meant?")
    return f"{traj}[:, 3] < 0.0"


def _near(builder: PolicyBuilder, part: PathPart, traj: str) -> str:
    item = builder.scene[part.places[0]]
    at, meaning = builder.ref(item), f"distance to {item.name} that counts as near"
    radius = builder.knob(f"{at}_radius", part.amount or 0.0, "radius", meaning, "part", about=item.name)
    of = ', of="surface"' if part.of == "surface" and item.dimensions is not None else ""
    return f"near({traj}, {at}, within={radius}{of})"


def _end(builder: PolicyBuilder, part: PathPart, traj: str) -> str:
    kind, amount, side = part.kind, part.amount or 0.0, "start" if part.kind == "first" else "end"
    if part.unit == "share":
        meaning = f"share of the waypoints at the {side}"
        name = builder.knob(f"{kind}_share", round(amount, 4), "share", meaning, "part", unit="")
        return f"{kind}({traj}, fraction={name})"
    if part.unit != "waypoints":
        return _of_what_is_left(builder, part, traj) if kind == "last" else _listed(builder, part, traj)
    most = min(int(amount), len(builder.trajectory))
    name = builder.knob(f"{kind}_waypoints", most, "of", f"number of waypoints at the {side}", "part", unit="")
    return f"{kind}({traj}, {name})"


def _of_what_is_left(builder: PolicyBuilder, part: PathPart, traj: str) -> str:
    """The last metres or seconds, of a path that was cut of what is left."""
    rows = builder.rows()
    if len(rows) >= len(builder.trajectory):
        return _listed(builder, part, traj)
    left = Trajectory.from_array(rows)
    return f"last({traj}, {int(part.mask(left, builder.scene).sum())})"


def _range(builder: PolicyBuilder, part: PathPart, traj: str) -> str:
    if part.unit != "waypoints":
        return _listed(builder, part, traj)
    chosen = np.flatnonzero(builder.waypoints(part))
    builder.assume("waypoints are counted from 1")
    a, b = (
        builder.knob(f"{which}_index", int(chosen[i]), "at", f"index of the {which} waypoint, from 0", "part", unit="")
        for which, i in (("first", 0), ("last", -1))
    )
    return f"between({traj}, {a}, {b})"


def _along(builder: PolicyBuilder, part: PathPart, traj: str) -> str:
    at = [_place(builder, place) for place in part.places]
    span = {"after": [*at, "1.0"], "before": ["0.0", *at]}.get(part.kind, at)
    code = f"between({traj}, {', '.join(span)})"
    others = left_out(part, builder.frames, builder.trajectory, builder.scene)
    return " & ~".join([code, *(_CODE[other.kind](builder, other, traj) for other in others)])


def _place(builder: PolicyBuilder, place: Any) -> str:
    if isinstance(place, Mapping):
        return f"midpoint({', '.join(builder.ref(builder.scene[name]) for name in place['between'])})"
    return builder.ref(builder.scene[place])


def _beyond(builder: PolicyBuilder, part: PathPart, traj: str) -> str:
    axis = builder.axis(part.direction)
    k = int(np.flatnonzero(axis)[0])
    meaning = f"how far {part.direction} the part begins"
    name = builder.knob(f"{part.direction}_of", part.amount or 0.0, "at", meaning, "part", direction=part.direction)
    return f"{'' if axis[k] > 0 else '-'}{traj}[:, {k}] > {name}"


def _joined(builder: PolicyBuilder, part: PathPart, traj: str) -> str:
    if part.kind == "both":
        return " & ".join(f"({mask_code(builder, inner, traj)})" for inner in part.parts)
    there = [inner for inner in part.parts if builder.waypoints(inner).any()]  # the path does not come near the others
    return " | ".join(f"({mask_code(builder, inner, traj)})" for inner in there)


def _listed(builder: PolicyBuilder, part: PathPart, traj: str) -> str:
    """A part by the indices that it means on the given trajectory."""
    return " | ".join(f"between({traj}, {a}, {b})" for a, b in runs(builder.waypoints(part)))


_CODE: Mapping[str, Callable[[PolicyBuilder, PathPart, str], str]] = {
    "near": _near,
    "range": _range,
    "beyond": _beyond,
    "heading": lambda builder, part, traj: f"where_rising({traj}, {part.direction!r})",
    "every": lambda builder, part, traj: f"every({traj}, {int(part.amount or 1)})",
    "outside": lambda builder, part, traj: f"~({mask_code(builder, part.parts[0], traj)})",
    **dict.fromkeys(("first", "last"), _end),
    **dict.fromkeys(("between", "after", "before"), _along),
    **dict.fromkeys(("both", "either"), _joined),
}
