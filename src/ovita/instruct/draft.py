"""A policy being written: its knobs, lines, expectations, plan and assumptions, and the words for parts of the path."""

from __future__ import annotations

import keyword
import re
from dataclasses import dataclass, field, replace

import numpy as np

from ovita.instruct.intents import Region
from ovita.instruct.scale import END_SHARE, Scale, end_share, nice
from ovita.paths.frame import OPPOSITE
from ovita.paths.scene import Scene, SceneObject, canonical
from ovita.paths.trajectory import Array, Trajectory
from ovita.policy import Parameter
from ovita.policy.policy import MAX_NOTE, Role
from ovita.policy.syntax import Value
from ovita.policy.wire import clean_text
from ovita.toolkit import CATALOGUE

RESERVED = frozenset({"traj", "scene", "np", "math"})


@dataclass
class IntentDraft:
    """A policy being written.

    `positions` follows the shifts of the whole path written so far, and `shifts` names their knobs by direction, so
    that later steps can allow for them; along the directions in `exact` the instruction states the amount.
    """

    trajectory: Trajectory
    scene: Scene
    scale: Scale
    positions: Array
    shifts: dict[str, list[str]] = field(default_factory=dict)
    exact: set[str] = field(default_factory=set)
    parameters: dict[str, Parameter] = field(default_factory=dict)
    objects: dict[str, SceneObject] = field(default_factory=dict)
    body: list[str] = field(default_factory=list)
    promises: dict[str, str] = field(default_factory=dict)
    plan: list[str] = field(default_factory=list)
    assumptions: list[str] = field(default_factory=list)
    contacts: list[str] = field(default_factory=list)
    effort: int = 1
    fixed: set[str] = field(default_factory=set)
    parts: int = 0
    goal_moved: bool = False
    question: str = ""
    held: list[str] = field(default_factory=list)

    @classmethod
    def of(cls, trajectory: Trajectory, scene: Scene) -> IntentDraft:
        """An empty draft for a trajectory in its scene."""
        return cls(trajectory, scene, Scale.of(trajectory), np.array(trajectory.positions))

    def knob(
        self,
        name: str,
        value: Value,
        role: Role,
        meaning: str = "",
        *,
        unit: str = "",
        about: str = "",
        direction: str = "",
    ) -> str:
        """Add a parameter under a free name and return that name."""
        free, n = name, 2
        while not self._is_free(free):
            free, n = f"{name}_{n}", n + 1
        meaning = clean_text(one_line(meaning), MAX_NOTE)
        self.parameters[free] = Parameter(free, value, unit, meaning, role, about, direction)
        return free

    def over(self, name: str, height: float, side: str, item: SceneObject) -> str:
        """Add the parameter of a height [m] above the top or centre of an object and return its name."""
        meaning = f"height above the {side} of {item.name}"
        return self.knob(name, height, "to", meaning, unit="m", about=item.name, direction="up")

    def ref(self, item: SceneObject) -> str:
        """The variable that holds an object."""
        for name, known in self.objects.items():
            if known is item:
                return name
        name = re.sub(r"\W+", "_", canonical(item.name), flags=re.ASCII).strip("_") or "item"
        name = f"the_{name}" if name[0].isdigit() else name
        while not self._is_free(name):
            name += "_"
        self.objects[name] = item
        return name

    def part(self, where: str) -> str:
        """Give a mask a name in the policy and return it; "" stays ""."""
        if not where:
            return ""
        self.parts += 1
        name = "part" if self.parts == 1 else f"part_{self.parts}"
        self.body.append(f"{name} = {where}")
        return name

    def promise(self, code: str, about: str = "") -> None:
        """Add a postcondition; it takes the place of an earlier one that is about the same."""
        self.promises.pop(about or code, None)
        self.promises[about or code] = code

    def hold(self) -> str:
        """The argument that keeps later steps from disturbing exact amounts, or ""."""
        words = sorted(self.exact)
        return f", hold={words[0]!r}" if len(words) == 1 else f", hold={words!r}" if words else ""

    def _is_free(self, name: str) -> bool:
        taken = name in self.parameters or name in self.objects or name in CATALOGUE or name in RESERVED
        return not (taken or keyword.iskeyword(name))

    def distance(self, item: SceneObject) -> float:
        """Closest approach of the path to an object's centre, as far as known [m]."""
        return float(item.distance(self.positions).min())

    def shifted(self, direction: str) -> str:
        """The shift of the whole path along a direction as an expression, such as "up - down", or ""."""
        along = [f" + {name}" for name in self.shifts.get(direction, [])]
        against = [f" - {name}" for name in self.shifts.get(OPPOSITE[direction], [])]
        return "".join([*along, *against])

    def assume(self, text: str) -> None:
        """Add an assumption, once."""
        if text not in self.assumptions:
            self.assumptions.append(text)

    def do(self, sentence: str, *, holds: bool = False) -> None:
        """Add a sentence to the plan; return whether the path already does it."""
        self.plan.append(sentence)
        self.held += [sentence] if holds else []

    def ask(self, question: str) -> None:
        """Ask back instead of writing a policy; the first question counts."""
        self.question = self.question or question

    def source(self, summary: str) -> str:
        """The policy's source."""
        lines = ["def adapt(", "    traj,", "    scene,"]
        lines += ["    *,"] if self.parameters else []
        lines += [f"    {p.name}={p.value!r},  # {p.comment}" for p in self.parameters.values()]
        lines += ["):", f'    """{one_line(summary)}"""']
        lines += [f"    {name} = scene[{item.name!r}]" for name, item in self.objects.items()]
        lines += [f"    {line}" for line in [*self.body, *self.promises.values()]]
        return "\n".join([*lines, "    return traj", ""])


def mask(draft: IntentDraft, region: Region) -> tuple[str, str]:
    """Code and words for a part of the path; both "" for the whole."""
    kind = region.kind
    if kind == "whole":
        return "", ""
    if region.outside:
        inside, told = mask(draft, replace(region, outside=False))
        return f"~({inside})", f"everywhere except {told.removeprefix('for ')}"
    if kind == "near":
        _ask_if_far(draft, region)
        masks, words = zip(*(_near(draft, item, region.amount) for item in region.items), strict=True)
        return " | ".join(masks), " and ".join(words)
    if kind == "range":
        return _range(draft, region)
    if kind in ("but_first", "but_last"):
        stated = _in_waypoints(draft, replace(region, kind=kind.removeprefix("but_")))
        left = max(len(draft.trajectory) - int(stated.amount or 0), 1)
        kind = "last" if kind == "but_first" else "first"
        region = Region(kind, amount=left, counted=True)
    if kind in ("first", "last"):
        return _at_an_end(draft, region, kind)
    if kind == "middle" and region.amount is not None:
        margin = (1.0 - region.amount) / 2
        part = f"in the middle {region.amount:.0%} of the path"
        return f"between(traj, {margin:.3g}, {1 - margin:.3g})", part
    if kind == "middle":
        draft.assume('"the middle" is the middle third of the waypoints')
        return "between(traj, 0.33, 0.67)", "in the middle of the path"
    if kind == "between":
        a, b = region.items
        return f"between(traj, {draft.ref(a)}, {draft.ref(b)})", f"between {a.name} and {b.name}"
    if kind == "heading":
        _ask_if_none(draft, draft.positions[1:] - draft.positions[:-1], region.direction, 0.0, "heads")
        return f"where_rising(traj, {region.direction!r})", f"where it heads {region.direction}"
    if kind == "beyond":
        axis = draft.scene.frame.direction(region.direction)
        k = int(np.flatnonzero(axis)[0])
        sign = "" if axis[k] > 0 else "-"
        _ask_if_none(draft, draft.positions, region.direction, region.amount or 0.0, f"is beyond {region.amount:g} m")
        meaning = f"how far {region.direction} the part begins"
        name = draft.knob(f"{region.direction}_of", region.amount, "at", meaning, unit="m", direction=region.direction)
        return f"{sign}traj[:, {k}] > {name}", f"further {region.direction} than {region.amount:g} m"
    if kind == "every":
        return f"every(traj, {int(region.amount or 1)})", f"at every {int(region.amount or 1)}. waypoint"
    item = region.items[0]
    span = f"{draft.ref(item)}, 1.0" if kind == "after" else f"0.0, {draft.ref(item)}"
    return f"between(traj, {span})", f"{kind} {item.name}"


def _at_an_end(draft: IntentDraft, region: Region, kind: str) -> tuple[str, str]:
    """The first or last waypoints: so many of them, a share, a length or a time."""
    region = _in_waypoints(draft, region)
    if region.counted:
        meaning = f"number of waypoints at the {_side(kind)}"
        n = draft.knob(f"{kind}_waypoints", int(region.amount or 1), "of", meaning)
        return f"{kind}(traj, {n})", f"for the {kind} {int(region.amount or 1)} waypoints"
    share = round(region.amount or END_SHARE, 4)
    if region.amount is None:
        draft.assume(end_share(kind))
    name = draft.knob(f"{kind}_share", share, "share", f"share of the waypoints at the {_side(kind)}")
    return f"{kind}(traj, fraction={name})", f"for the {kind} {share:.0%} of the waypoints"


def _ask_if_far(draft: IntentDraft, region: Region) -> None:
    """Ask back where no waypoint is within the stated distance of any of a region's objects."""
    item = min(region.items, key=draft.distance)
    gap = draft.distance(item)
    if region.amount is not None and gap > region.amount:
        draft.ask(
            f"No waypoint is within {region.amount:g} m of {item.name}, the closest is {gap:.3g} m away:"
            " how near should count?"
        )


def _ask_if_none(draft: IntentDraft, vectors: Array, direction: str, limit: float, words: str) -> None:
    """Ask back where no vector goes further along a direction than a limit [m]."""
    if not (vectors @ draft.scene.frame.direction(direction) > limit + 1e-9).any():
        draft.ask(f"No part of the path {words} {direction}: which part is meant?")


def _range(draft: IntentDraft, region: Region) -> tuple[str, str]:
    """Waypoints by number, counted from 1."""
    last = len(draft.trajectory)
    if (region.amount or 1) > last:
        draft.ask(f"The path has {last} waypoints, counted from 1: which one is meant by {region.amount:g}?")
    begin = int(np.clip(region.amount or 1, 1, last))
    end = last if region.until is None else int(np.clip(region.until, begin, last))
    draft.assume("waypoints are counted from 1")
    a = draft.knob("first_index", begin - 1, "at", "index of the first waypoint, from 0")
    b = draft.knob("last_index", end - 1, "at", "index of the last waypoint, from 0")
    return f"between(traj, {a}, {b})", f"from waypoint {begin} to {end}"


def _in_waypoints(draft: IntentDraft, region: Region) -> Region:
    """Convert a length in metres or seconds to a number of waypoints."""
    if region.unit not in ("m", "s"):
        return region
    trajectory = draft.trajectory
    if region.unit == "s":
        times = trajectory.times
    else:
        times = trajectory.arc_length
    measured = times if region.kind == "first" else times[-1] - times
    count = max(int((measured <= (region.amount or 0.0) + 1e-9).sum()), 1)
    draft.assume(f"the {region.kind} {region.amount:g} {region.unit} are {count} waypoints")
    return replace(region, amount=count, counted=True, unit="")


def _near(draft: IntentDraft, item: SceneObject, radius: float | None) -> tuple[str, str]:
    value = radius
    if value is None:
        bounds = [p.value for p in draft.parameters.values() if p.role == "at_least" and p.about == item.name]
        kept = max((float(v) for v in bounds if isinstance(v, int | float)), default=0.0)
        body = item.radius if kept and item.dimensions is not None else 0.0
        value = draft.scale.near(draft.positions, item, kept + body)
        draft.assume(f'"near {item.name}" is within {value:g} m of its centre')
    elif draft.distance(item) > value:
        draft.assume(
            f"no waypoint is within {value:g} m of {item.name} (the closest is {draft.distance(item):.3g} m away)"
        )
    ref = draft.ref(item)
    meaning = f"distance to {item.name} that counts as near"
    name = draft.knob(f"{ref}_radius", value, "radius", meaning, unit="m", about=item.name)
    return f"near(traj, {ref}, within={name})", f"within {value:g} m of {item.name}"


def _side(kind: str) -> str:
    return "start" if kind == "first" else "end"


def argument(where: str) -> str:
    """A mask as a further argument, or ""."""
    return f", where={where}" if where else ""


def suffix(part: str) -> str:
    """The words for a part of the path behind a sentence, or ""."""
    return f" {part}" if part else ""


def above(d: IntentDraft, item: SceneObject, stated: float | None, *, below: bool = False) -> float:
    """Height above (or below) an object's centre that "so much above it" means [m]: counted from its top (bottom)."""
    side, end = ("below", "bottom") if below else ("above", "top")
    top = 0.0 if item.dimensions is None else float(np.abs(item.rotation[2]) @ item.size) / 2
    if stated is None:
        height = nice(top + item.radius + d.scale.step("slight"))
        d.assume(f'"{side} {item.name}" is {height:g} m {side} its centre')
        return height
    height = float(f"{top + stated:.6g}")
    if top:
        d.assume(f"{stated:g} m {side} {item.name} is counted from its {end}, {height:g} m {side} its centre")
    return height


def one_line(text: str) -> str:
    """Text without line breaks and control characters, so that an object's name stays inside its comment."""
    return re.sub(r"[\x00-\x1f\x7f-\x9f\u2028\u2029]+", " ", text)
