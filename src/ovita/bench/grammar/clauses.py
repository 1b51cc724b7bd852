"""Clauses: one wish each, as words, as a check, and as an edit that fulfils it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.random import Generator

from ovita.bench.grammar.lexicon import CLAUSES, DEGREES, METRES, PLACES, SIDES, SPEEDS, Phrases, Split
from ovita.instruct.scale import Degree, Scale
from ovita.measure import predicates as checks
from ovita.measure.predicates import Check
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Array, Trajectory
from ovita.toolkit import Recorder, namespace

Slot = Literal["path", "speed", "end", "count"]

Amount = Literal["little", "much"]

_SCALE_OF: Mapping[Amount | None, Degree] = {None: "moderate", "little": "slight", "much": "large"}


@dataclass(frozen=True)
class Clause:
    """One wish.

    Args:
        name: A key of `MAKERS`.
        text: As a person says it.
        kind: The kind of instruction.
        slot: What it changes; clauses of one instruction change different things.
        check: What holds once it is fulfilled.
        edit: Fulfils it: waypoints (N, 4) to (M, 4).
    """

    name: str
    text: str
    kind: str
    slot: Slot
    check: Check
    edit: Callable[[Array], Array]


class Maker:
    """Draws clauses for one scene.

    Args:
        rng: Source of chance.
        trajectory: What the clauses are about.
        scene: Its surroundings.
        split: Whose words are used.
        flat: Whether the robot cannot move up and down.
    """

    def __init__(self, rng: Generator, trajectory: Trajectory, scene: Scene, split: Split, *, flat: bool) -> None:
        self.rng, self.trajectory, self.scene, self.split = rng, trajectory, scene, split
        self.rows, self.scale = trajectory.to_array(), Scale.of(trajectory)
        self.do: dict[str, Any] = dict(namespace(scene.frame, Recorder()))
        self.sides = tuple(side for side in SIDES if not (flat and side in ("up", "down")))

    def make(self, name: str) -> Clause:
        """Draw a clause of that name."""
        return MAKERS[name](self, name)

    def _one(self, phrases: Phrases) -> str:
        options = phrases[self.split]
        return options[int(self.rng.integers(len(options)))]

    def _say(self, name: str, **values: str) -> str:
        return " ".join(self._one(CLAUSES[name]).format(**values).split())

    def _say_degree(self, name: str, **values: str) -> tuple[str, Amount | None]:
        """A phrase, and the degree that it states."""
        phrase = self._one(CLAUSES[name])
        degrees: tuple[Amount | None, ...] = (None, "little", "much")
        degree = degrees[int(self.rng.integers(3))] if "{degree}" in phrase else None
        text = phrase.format(degree=self._one(DEGREES[degree]) if degree else "", **values)
        return " ".join(text.split()), degree

    def _object(self) -> SceneObject:
        return self.scene.objects[int(self.rng.integers(len(self.scene)))]

    def _side(self) -> str:
        return str(self.rng.choice(np.array(self.sides)))

    def _metres(self, low: float, high: float) -> float:
        """A length between two shares of the extent, to two digits."""
        value = float(self.rng.uniform(low, high)) * self.scale.extent
        return float(f"{value:.2g}") if value < 1 else round(value, 1)

    def approach(self, name: str) -> Clause:
        """Closer or farther."""
        item = self._object()
        text, degree = self._say_degree(name, obj=item.name)
        step = self.scale.step(_SCALE_OF[degree])
        build = checks.closer if name == "closer" else checks.farther
        check = build(item.name, amount=degree)
        return Clause(name, text, "distance", "path", check, lambda rows: self.do[name](rows, item, step))

    def pace(self, name: str) -> Clause:
        """Slower or faster near an object."""
        item = self._object()
        text, degree = self._say_degree(name, obj=item.name)
        radius = self.scale.near(self.trajectory.positions, item)
        build = checks.slower if name == "slower" else checks.faster
        check = build(where=checks.near(item.name), amount=degree, only=True)
        factor = _factor(name, degree)
        return Clause(name, text, "speed", "speed", check, lambda rows: self._scaled(rows, factor, item, radius))

    def pace_all(self, name: str) -> Clause:
        """Slower or faster everywhere."""
        base = name.removesuffix("_all")
        build = checks.slower if base == "slower" else checks.faster
        text, degree = self._say_degree(name)
        factor = _factor(base, degree)
        check = build(amount=degree)
        return Clause(name, text, "speed", "speed", check, lambda rows: self.do["scale_speed"](rows, factor))

    def pace_within(self, name: str) -> Clause:
        """Slower or faster within metres of an object."""
        item, base = self._object(), name.removesuffix("_within")
        distances = np.sort(item.distance(self.trajectory.positions))
        radius = float(f"{distances[int(self.rng.uniform(0.15, 0.4) * len(distances))] * 1.02:.2g}")
        build = checks.slower if base == "slower" else checks.faster
        check = build(where=checks.near(item.name, within=radius), only=True)
        text = self._say(name, n=self._one(METRES).format(radius), obj=item.name)
        factor = _factor(base, None)
        return Clause(name, text, "speed", "speed", check, lambda rows: self._scaled(rows, factor, item, radius))

    def toward(self, name: str) -> Clause:
        """To one side, by an amount left open."""
        side = self._side()
        text = self._say(name, place=self._one(PLACES[side]))
        step = self.scale.step("moderate")
        return Clause(name, text, "cartesian", "path", checks.moved(side), lambda r: self.do["move"](r, **{side: step}))

    def shift(self, name: str) -> Clause:
        """To one side by metres."""
        side, amount = self._side(), self._metres(0.06, 0.2)
        text = self._say(name, side=self._one(SIDES[side]), n=self._one(METRES).format(amount))
        check = checks.moved(**_words(side, amount))
        return Clause(name, text, "cartesian", "path", check, lambda r: self.do["move"](r, **{side: amount}))

    def shift_part(self, name: str) -> Clause:
        """The first or last waypoints to one side by metres."""
        side, amount = self._side(), self._metres(0.06, 0.15)
        part, k = str(self.rng.choice(np.array(["first", "last"]))), int(self.rng.integers(5, 13))
        where = (checks.first if part == "first" else checks.last)(k)
        text = self._say(
            name,
            part=self._one(CLAUSES[part]),
            k=str(k),
            side=self._one(SIDES[side]),
            n=self._one(METRES).format(amount),
        )
        far = (checks.last if part == "first" else checks.first)(len(self.rows) - 3 * k)
        check = checks.all_of(checks.moved(**_words(side, amount), where=where), checks.kept(far))
        return Clause(
            name,
            text,
            "cartesian",
            "path",
            check,
            lambda r: self.do["move"](r, **{side: amount}, where=self.do[part](r, k)),
        )

    def keep_away(self, name: str) -> Clause:
        """At least so many metres from an object."""
        item = self._object()
        closest = float(item.clearance(self.trajectory.positions).min())
        distance = float(f"{closest + float(self.rng.uniform(0.04, 0.12)) * self.scale.extent:.2g}")
        text = self._say(name, n=self._one(METRES).format(distance), obj=item.name)
        check = checks.min_distance(item.name, distance)
        return Clause(
            name, text, "distance", "path", check, lambda r: self.do["keep_distance"](r, item, at_least=distance)
        )

    def constant(self, name: str) -> Clause:
        """One speed."""
        value = float(f"{float(self.rows[:, 3].mean()) * self.rng.uniform(0.6, 1.4):.2g}")
        text = self._say(name, v=self._one(SPEEDS).format(value))
        check = checks.constant_speed(value)
        return Clause(name, text, "speed", "speed", check, lambda rows: self.do["set_speed"](rows, value))

    def scale_speed(self, name: str) -> Clause:
        """A factor on the speed."""
        factor = float(self.rng.choice(np.array([0.25, 0.5, 0.75, 1.25, 1.5])))
        check = checks.slower(factor=factor) if factor < 1 else checks.faster(factor=factor)
        text = self._say(name, factor=f"{factor:g}")
        return Clause(name, text, "speed", "speed", check, lambda rows: self.do["scale_speed"](rows, factor))

    def stop(self, name: str) -> Clause:
        """A stop near an object."""
        item = self._object()
        text = self._say(name, obj=item.name)
        return Clause(name, text, "stop", "end", checks.stops(item.name), lambda rows: self.do["stop_at"](rows, item))

    def wait(self, name: str) -> Clause:
        """A wait near an object."""
        item, steps = self._object(), int(self.rng.integers(5, 21))
        text = self._say(name, k=str(steps), obj=item.name)
        check = checks.dwells(steps, near=item.name)
        return Clause(name, text, "stop", "end", check, lambda rows: self.do["dwell"](rows, item, steps))

    def endpoint(self, name: str) -> Clause:
        """The goal or the start to one side by metres."""
        side, amount = self._side(), self._metres(0.06, 0.15)
        text = self._say(name, side=self._one(SIDES[side]), n=self._one(METRES).format(amount))
        check = (checks.goal_moved if name == "goal" else checks.start_moved)(**_words(side, amount))
        return Clause(name, text, "ends", "path", check, lambda r: self.do[f"move_{name}"](r, **{side: amount}))

    def extend(self, name: str) -> Clause:
        """On beyond the goal."""
        amount = self._metres(0.1, 0.25)
        text = self._say(name, n=self._one(METRES).format(amount))
        return Clause(name, text, "ends", "path", checks.extended(by=amount), lambda r: self.do["extend"](r, amount))

    def count(self, name: str) -> Clause:
        """More or fewer waypoints."""
        n = len(self.rows) * 2 if name == "denser" else len(self.rows) // 2
        check = checks.more_waypoints() if name == "denser" else checks.fewer_waypoints()
        return Clause(name, self._say(name), "waypoints", "count", check, lambda rows: self.do["resample"](rows, n))

    def _scaled(self, rows: Array, factor: float, item: SceneObject, radius: float) -> Array:
        result: Array = self.do["scale_speed"](rows, factor, where=self.do["near"](rows, item, within=radius))
        return result


MAKERS: Mapping[str, Callable[[Maker, str], Clause]] = {
    "closer": Maker.approach,
    "farther": Maker.approach,
    "slower": Maker.pace,
    "faster": Maker.pace,
    "slower_all": Maker.pace_all,
    "faster_all": Maker.pace_all,
    "toward": Maker.toward,
    "shift": Maker.shift,
    "shift_part": Maker.shift_part,
    "keep_away": Maker.keep_away,
    "constant": Maker.constant,
    "scale_speed": Maker.scale_speed,
    "slower_within": Maker.pace_within,
    "faster_within": Maker.pace_within,
    "stop": Maker.stop,
    "wait": Maker.wait,
    "goal": Maker.endpoint,
    "start": Maker.endpoint,
    "extend": Maker.extend,
    "denser": Maker.count,
    "sparser": Maker.count,
}
"""Every clause that can be drawn."""

FAMILIES: Mapping[str, tuple[str, ...]] = {
    "latte": ("closer", "farther", "slower", "faster", "slower_all", "faster_all", "toward"),
    "numeric": (
        "shift", "shift_part", "keep_away", "constant", "scale_speed", "slower_within", "faster_within", "stop",
        "wait", "goal", "start", "extend", "denser", "sparser",
    ),
    "multi": (),
}  # fmt: skip
"""The clauses of one-clause instructions; "multi" joins two or three of both."""

TOGETHER: tuple[tuple[tuple[str, ...], tuple[str, ...]], ...] = (
    (("closer", "farther", "toward", "shift", "keep_away", "goal", "start", "extend"),
     ("slower", "faster", "constant", "scale_speed", "slower_within", "faster_within")),
    (("closer", "farther", "toward", "shift", "goal", "start"), ("wait", "stop")),
)  # fmt: skip
"""Pairs of clauses that do not contradict each other, whatever they are about."""


def _factor(name: str, degree: Amount | None) -> float:
    slower, faster = {None: (0.6, 1.4), "little": (0.8, 1.2), "much": (0.4, 1.7)}[degree]
    return slower if name == "slower" else faster


def _words(side: str, amount: float) -> dict[str, Any]:
    return {side: amount}
