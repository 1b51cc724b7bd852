"""Datasets without end: random scenes, instructions from a grammar, and checks that a known edit fulfils.

The words are in lexicon.toml. The words of the held-out split and those of the train split tell a writer that
understands from one that knows the phrases.
"""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.random import Generator
from scipy.interpolate import CubicSpline

from ovita.bench.dataset import Sample
from ovita.errors import OvitaError, RequestError
from ovita.instruct.degrees import Degree, Scale
from ovita.io import Task, load_robot, save_task
from ovita.io.files import make_folder
from ovita.limits import constrain
from ovita.measure import predicates as checks
from ovita.measure.predicates import Check
from ovita.paths.geometry import extent, path_distances
from ovita.paths.scene import Frame, Scene, SceneObject
from ovita.paths.trajectory import Array, Trajectory, interpolate, source_indices
from ovita.toolkit import Recorder, namespace

Split = Literal["train", "heldout"]

Phrases = Mapping[Split, Sequence[str]]

_LEXICON: Mapping[str, Any] = tomllib.loads((files("ovita.bench") / "lexicon.toml").read_text(encoding="utf-8"))

DEGREES: Mapping[str, Phrases] = _LEXICON["degrees"]
SIDES: Mapping[str, Phrases] = _LEXICON["sides"]
PLACES: Mapping[str, Phrases] = _LEXICON["places"]
CLAUSES: Mapping[str, Phrases] = _LEXICON["clauses"]
NAMES: Phrases = _LEXICON["names"]
JOINS: Phrases = _LEXICON["joins"]
METRES: Phrases = _LEXICON["metres"]
SPEEDS: Phrases = _LEXICON["speeds"]


def words(text: str) -> frozenset[str]:
    """Return the words of a phrase in lower case, without placeholders and numbers."""
    return frozenset(re.findall(r"[a-z]+(?:-[a-z]+)*", re.sub(r"\{[^}]*\}", " ", text.lower())))


def vocabulary(split: Split) -> frozenset[str]:
    """Return every word that an instruction of a split can have, objects' names left out."""
    tables = (*DEGREES.values(), *SIDES.values(), *PLACES.values(), *CLAUSES.values(), JOINS, METRES, SPEEDS)
    return frozenset().union(*(words(phrase) for table in tables for phrase in table[split]))


# Scenes


@dataclass(frozen=True)
class Setting:
    """The scale of a robot's scenes.

    Args:
        robot: Preset whose limits hold, or "none".
        center: Middle of the box that the path fills [m].
        half: Half of the box's edges [m]; 0 keeps the path flat.
        waypoints: Fewest and most waypoints.
        speed: Lowest and highest mean speed [m/s].
        sizes: Smallest and largest edge of an object [m], or None for objects without dimensions.
    """

    robot: str
    center: tuple[float, float, float]
    half: tuple[float, float, float]
    waypoints: tuple[int, int]
    speed: tuple[float, float]
    sizes: tuple[float, float] | None
    frames: tuple[str, ...] = ("rfu",)


SETTINGS: Mapping[str, Setting] = {
    "tabletop": Setting("none", (0.0, 0.0, 0.0), (0.3, 0.3, 0.3), (40, 40), (0.1, 0.5), None),
    "drone": Setting("drone", (0.0, 0.0, 1.0), (1.8, 1.8, 0.7), (40, 90), (0.2, 0.6), (0.1, 0.4), ("rfu", "flu")),
    "ground": Setting("ground", (0.0, 0.0, 0.0), (1.8, 1.8, 0.0), (40, 80), (0.15, 0.6), (0.1, 0.4), ("rfu", "flu")),
    "arm": Setting("arm", (0.1, 0.0, 0.6), (0.18, 0.3, 0.25), (40, 100), (0.05, 0.3), (0.03, 0.08), ("rfu", "flu")),
}
"""The robots' scales, with the limits of the presets of the same robots."""


def random_scene(rng: Generator, setting: Setting, split: Split) -> tuple[Trajectory, Scene]:
    """A smooth path with a varying speed, and two to six objects beside it."""
    positions = _path(rng, setting)
    n = len(positions)
    s = np.linspace(0.0, 1.0, n)
    wave = 1.0 + 0.3 * np.sin(2 * np.pi * (rng.uniform(0.5, 1.5) * s + rng.uniform()))
    speeds = np.round(rng.uniform(*setting.speed) * wave, 4)
    names = rng.permutation(np.array(NAMES[split]))[: rng.integers(2, 7)]
    objects = [_object(rng, setting, positions, str(name)) for name in names]
    frame = Frame(str(rng.choice(np.array(setting.frames))))
    return Trajectory(positions, speeds), Scene(tuple(item for item in objects if item is not None), frame)


def _path(rng: Generator, setting: Setting) -> Array:
    """A spline through a random walk, scaled to fill 60 to 100 % of the box, evenly spaced."""
    knots = np.cumsum(rng.normal(size=(int(rng.integers(4, 8)), 3)), axis=0)
    # A drift keeps the path from curling up, so that most of it is away from any one object.
    knots += np.linspace(0.0, 1.0, len(knots))[:, None] * rng.normal(size=3) * len(knots)
    fine = CubicSpline(np.arange(len(knots)), knots)(np.linspace(0, len(knots) - 1, 600))
    fine -= (fine.min(axis=0) + fine.max(axis=0)) / 2.0
    half = np.asarray(setting.half)
    flat = half == 0.0
    fine[:, flat] = 0.0
    reach = np.abs(fine).max(axis=0)
    fine *= rng.uniform(0.6, 1.0) * float((half[~flat] / reach[~flat]).min())
    spaced = interpolate(fine, source_indices(fine, int(rng.integers(*setting.waypoints, endpoint=True)), "arc_length"))
    return np.asarray(np.round(spaced + np.asarray(setting.center), 5))


def _object(rng: Generator, setting: Setting, positions: Array, name: str) -> SceneObject | None:
    """An object at 8 to 30 % of the extent beside the path, clear of it; None if no place was found."""
    size_of_path = extent(positions)
    for _ in range(20):
        size = None if setting.sizes is None else np.round(rng.uniform(*setting.sizes, size=3), 3)
        away = rng.normal(size=3)
        away[np.asarray(setting.half) == 0.0] = 0.0
        away *= rng.uniform(0.08, 0.3) * size_of_path / np.linalg.norm(away)
        place = np.round(positions[rng.integers(len(positions))] + away, 4)
        radius = 0.05 if size is None else float(np.linalg.norm(size)) / 2.0
        if float(path_distances(positions, place[None])[0]) >= radius + 0.05 * size_of_path:
            return SceneObject(name, place, size)
    return None


# Clauses

Slot = Literal["path", "speed", "end", "count"]

Amount = Literal["little", "much"]

_SCALE_OF: Mapping[Amount | None, Degree] = {None: "moderate", "little": "slight", "much": "large"}


@dataclass(frozen=True)
class Clause:
    """A clause of an instruction: what it changes, what holds once it is fulfilled, and an edit that fulfils it."""

    name: str
    kind: str
    slot: Slot
    text: str
    check: Check
    edit: Callable[[Array], Array]


Drawn = tuple[str, Check, Callable[[Array], Array]]
"""Text, check and edit of a clause."""


class ClauseMaker:
    """Draws clauses for one scene, in the words of a split; a robot that is `flat` cannot move up and down."""

    def __init__(self, rng: Generator, trajectory: Trajectory, scene: Scene, split: Split, *, flat: bool) -> None:
        self.rng, self.trajectory, self.scene, self.split = rng, trajectory, scene, split
        self.rows, self.scale = trajectory.to_array(), Scale.of(trajectory)
        self.do: dict[str, Any] = dict(namespace(scene.frame, Recorder()))
        self.sides = tuple(side for side in SIDES if not (flat and side in ("up", "down")))

    def make(self, name: str) -> Clause:
        """Draw a clause of that name."""
        kind, slot, draw = MAKERS[name]
        return Clause(name, kind, slot, *draw(self, name))

    def _one(self, phrases: Phrases) -> str:
        return phrases[self.split][int(self.rng.integers(len(phrases[self.split])))]

    def _say(self, name: str, **values: str) -> str:
        return " ".join(self._one(CLAUSES[name]).format(**values).split())

    def _say_degree(self, name: str, **values: str) -> tuple[str, Amount | None]:
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

    def approach(self, name: str) -> Drawn:
        """Closer or farther."""
        item = self._object()
        text, degree = self._say_degree(name, obj=item.name)
        step = self.scale.step(_SCALE_OF[degree])
        return text, getattr(checks, name)(item.name, amount=degree), lambda rows: self.do[name](rows, item, step)

    def pace(self, name: str) -> Drawn:
        """Slower or faster near an object."""
        item = self._object()
        text, degree = self._say_degree(name, obj=item.name)
        radius = self.scale.near(self.trajectory.positions, item)
        build, factor = _pace(name, degree)
        check = build(where=checks.near(item.name), amount=degree, only=True)
        return text, check, lambda rows: self._scaled(rows, factor, item, radius)

    def pace_all(self, name: str) -> Drawn:
        """Slower or faster everywhere."""
        text, degree = self._say_degree(name)
        build, factor = _pace(name, degree)
        return text, build(amount=degree), lambda rows: self.do["scale_speed"](rows, factor)

    def pace_within(self, name: str) -> Drawn:
        """Slower or faster within metres of an object."""
        item = self._object()
        distances = np.sort(item.distance(self.trajectory.positions))
        radius = float(f"{distances[int(self.rng.uniform(0.15, 0.4) * len(distances))] * 1.02:.2g}")
        build, factor = _pace(name, None)
        check = build(where=checks.near(item.name, within=radius), only=True)
        text = self._say(name, n=self._one(METRES).format(radius), obj=item.name)
        return text, check, lambda rows: self._scaled(rows, factor, item, radius)

    def toward(self, name: str) -> Drawn:
        """To one side, by an amount left open."""
        side = self._side()
        text = self._say(name, place=self._one(PLACES[side]))
        step = self.scale.step("moderate")
        return text, checks.moved(side), lambda rows: self.do["move"](rows, **{side: step})

    def shift(self, name: str) -> Drawn:
        """To one side by metres."""
        text, by = self._shifted(name, 0.06, 0.2)
        return text, checks.moved(**by), lambda rows: self.do["move"](rows, **by)

    def shift_part(self, name: str) -> Drawn:
        """The first or last waypoints to one side by metres."""
        side, amount = self._side(), self._metres(0.06, 0.15)
        part, k = str(self.rng.choice(np.array(["first", "last"]))), int(self.rng.integers(5, 13))
        here, there = (checks.first, checks.last) if part == "first" else (checks.last, checks.first)
        words = {"part": self._one(CLAUSES[part]), "k": str(k), "side": self._one(SIDES[side])}
        text = self._say(name, **words, n=self._one(METRES).format(amount))
        by: dict[str, Any] = {side: amount}
        check = checks.all_of(checks.moved(**by, where=here(k)), checks.kept(there(len(self.rows) - 3 * k)))
        return text, check, lambda rows: self.do["move"](rows, **by, where=self.do[part](rows, k))

    def keep_away(self, name: str) -> Drawn:
        """At least so many metres from an object."""
        item = self._object()
        closest = float(item.clearance(self.trajectory.positions).min())
        distance = float(f"{closest + float(self.rng.uniform(0.04, 0.12)) * self.scale.extent:.2g}")
        text = self._say(name, n=self._one(METRES).format(distance), obj=item.name)
        check = checks.min_distance(item.name, distance)
        return text, check, lambda rows: self.do["keep_distance"](rows, item, at_least=distance)

    def constant(self, name: str) -> Drawn:
        """One speed."""
        value = float(f"{float(self.rows[:, 3].mean()) * self.rng.uniform(0.6, 1.4):.2g}")
        text = self._say(name, v=self._one(SPEEDS).format(value))
        return text, checks.constant_speed(value), lambda rows: self.do["set_speed"](rows, value)

    def scale_speed(self, name: str) -> Drawn:
        """A factor on the speed."""
        factor = float(self.rng.choice(np.array([0.25, 0.5, 0.75, 1.25, 1.5])))
        check = checks.slower(factor=factor) if factor < 1 else checks.faster(factor=factor)
        return self._say(name, factor=f"{factor:g}"), check, lambda rows: self.do["scale_speed"](rows, factor)

    def stop(self, name: str) -> Drawn:
        """A stop near an object."""
        item = self._object()
        return self._say(name, obj=item.name), checks.stops(item.name), lambda rows: self.do["stop_at"](rows, item)

    def wait(self, name: str) -> Drawn:
        """A wait near an object."""
        item, steps = self._object(), int(self.rng.integers(5, 21))
        text = self._say(name, k=str(steps), obj=item.name)
        return text, checks.dwells(steps, near=item.name), lambda rows: self.do["dwell"](rows, item, steps)

    def endpoint(self, name: str) -> Drawn:
        """The goal or the start to one side by metres."""
        text, by = self._shifted(name, 0.06, 0.15)
        return text, getattr(checks, f"{name}_moved")(**by), lambda rows: self.do[f"move_{name}"](rows, **by)

    def extend(self, name: str) -> Drawn:
        """On beyond the goal."""
        amount = self._metres(0.1, 0.25)
        text = self._say(name, n=self._one(METRES).format(amount))
        return text, checks.extended(by=amount), lambda rows: self.do["extend"](rows, amount)

    def count(self, name: str) -> Drawn:
        """More or fewer waypoints."""
        n = len(self.rows) * 2 if name == "denser" else len(self.rows) // 2
        check = checks.more_waypoints() if name == "denser" else checks.fewer_waypoints()
        return self._say(name), check, lambda rows: self.do["resample"](rows, n)

    def _shifted(self, name: str, low: float, high: float) -> tuple[str, dict[str, Any]]:
        """A phrase about one side and a length between two shares of the extent, and that shift [m]."""
        side, amount = self._side(), self._metres(low, high)
        text = self._say(name, side=self._one(SIDES[side]), n=self._one(METRES).format(amount))
        return text, {side: amount}

    def _scaled(self, rows: Array, factor: float, item: SceneObject, radius: float) -> Array:
        return np.asarray(self.do["scale_speed"](rows, factor, where=self.do["near"](rows, item, within=radius)))


_DRAWN_BY: Mapping[tuple[str, Slot, Callable[[ClauseMaker, str], Drawn]], tuple[str, ...]] = {
    ("distance", "path", ClauseMaker.approach): ("closer", "farther"),
    ("speed", "speed", ClauseMaker.pace): ("slower", "faster"),
    ("speed", "speed", ClauseMaker.pace_all): ("slower_all", "faster_all"),
    ("cartesian", "path", ClauseMaker.toward): ("toward",),
    ("cartesian", "path", ClauseMaker.shift): ("shift",),
    ("cartesian", "path", ClauseMaker.shift_part): ("shift_part",),
    ("distance", "path", ClauseMaker.keep_away): ("keep_away",),
    ("speed", "speed", ClauseMaker.constant): ("constant",),
    ("speed", "speed", ClauseMaker.scale_speed): ("scale_speed",),
    ("speed", "speed", ClauseMaker.pace_within): ("slower_within", "faster_within"),
    ("stop", "end", ClauseMaker.stop): ("stop",),
    ("stop", "end", ClauseMaker.wait): ("wait",),
    ("ends", "path", ClauseMaker.endpoint): ("goal", "start"),
    ("ends", "path", ClauseMaker.extend): ("extend",),
    ("waypoints", "count", ClauseMaker.count): ("denser", "sparser"),
}

MAKERS = {name: how for how, names in _DRAWN_BY.items() for name in names}
"""Every clause that can be drawn: its kind, what it changes, and who draws it."""

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


def _pace(name: str, degree: Amount | None) -> tuple[Callable[..., Check], float]:
    """The check of a clause named "slower..." or "faster...", and the factor on the speed that fulfils it."""
    slower, faster = {None: (0.6, 1.4), "little": (0.8, 1.2), "much": (0.4, 1.7)}[degree]
    return (checks.slower, slower) if name.startswith("slower") else (checks.faster, faster)


# Samples

TRIES = 200
"""Draws before a sample is given up."""


def generate(
    n: int, *, seed: int = 0, split: Split = "train", families: Sequence[str] = (), robots: Sequence[str] = ()
) -> Iterator[Sample]:
    """Draw samples, each with a check that doing nothing fails and that a known edit passes within the robot's limits.

    Sample i depends on the seed, the split and i only, not on n.

    Args:
        n: How many.
        seed: Of the random numbers.
        split: Whose words are used; held-out instructions have words that no train instruction has.
        families: Of `FAMILIES`; all if empty.
        robots: Of `SETTINGS`; all if empty.

    Raises:
        RequestError: If a family or a robot is unknown.
    """
    chosen = _among("family", families, tuple(FAMILIES))
    scales = _among("robot", robots, tuple(SETTINGS))
    for i in range(n):
        rng = np.random.default_rng([seed, 0 if split == "train" else 1, i])
        family, scale = chosen[i % len(chosen)], scales[(i // len(chosen)) % len(scales)]
        yield _sample(rng, family, scale, split, i, seed)


def write_dataset(folder: str | os.PathLike[str], samples: Iterable[Sample]) -> int:
    """Write drawn samples as scene files with the further keys check, kind, subset and source; return how many.

    Raises:
        RequestError: If the folder holds other .json files.
        FormatError: If a file cannot be written.
    """
    root = Path(folder)
    if root.exists() and any(root.rglob("*.json")):
        raise RequestError(f"{root} holds .json files already, which would become part of the dataset; name another")
    count = 0
    for sample in samples:
        file = root / f"{sample.id}.json"
        make_folder(file.parent)
        save_task(file, sample.task)
        count += 1
    return count


def _sample(rng: Generator, family: str, scale: str, split: Split, index: int, seed: int) -> Sample:
    setting = SETTINGS[scale]
    for _ in range(TRIES):
        trajectory, scene = random_scene(rng, setting, split)
        if len(scene) < 2:
            continue
        clauses = _draw(rng, ClauseMaker(rng, trajectory, scene, split, flat=setting.half[2] == 0.0), family)
        check = _whole(clauses)
        if not _sound(clauses, check, trajectory, scene, setting):
            continue
        text = clauses[0].text + "".join(str(rng.choice(np.array(JOINS[split]))) + c.text for c in clauses[1:])
        kind = clauses[0].kind if len(clauses) == 1 else "several"
        extra = {
            "check": check.to_dict(),
            "kind": kind,
            "subset": family,
            "source": {"generator": "ovita bench", "split": split, "seed": seed, "index": index, "scale": scale},
        }
        name = f"{family}/{scale}_{index:05d}"
        robot = None if setting.robot == "none" else setting.robot
        return Sample(name, family, kind, check, task=Task(trajectory, scene, text, extra, robot=robot))
    raise AssertionError(f"no {family} sample at the scale {scale} was found in {TRIES} draws")


def _draw(rng: Generator, maker: ClauseMaker, family: str) -> list[Clause]:
    if family != "multi":
        names = FAMILIES[family]
        return [maker.make(names[int(rng.integers(len(names)))])]
    left, right = TOGETHER[0] if rng.uniform() < 0.7 else TOGETHER[1]
    return [maker.make(str(rng.choice(np.array(part)))) for part in (left, right)]


def _whole(clauses: Sequence[Clause]) -> Check:
    """Every clause, and that what no clause is about stays as it was."""
    slots = {clause.slot for clause in clauses}
    parts = [clause.check for clause in clauses]
    if slots == {"speed"}:
        parts.append(checks.same_path())
    if slots == {"path"} and all(clause.name != "extend" for clause in clauses):
        parts.append(checks.speeds_kept())
    return parts[0] if len(parts) == 1 else checks.all_of(*parts)


def _sound(clauses: Sequence[Clause], check: Check, trajectory: Trajectory, scene: Scene, setting: Setting) -> bool:
    """Whether doing nothing fails, each clause is needed, and the clauses' own edits pass, limits included."""
    if any(clause.check.judge(trajectory, trajectory, scene).passed for clause in clauses):
        return False
    rows = trajectory.to_array()
    try:
        for clause in clauses:
            rows = clause.edit(rows)
        answer = Trajectory.from_array(rows)
        if not check.judge(trajectory, answer, scene).passed:
            return False
        solution = constrain(answer, scene, load_robot(setting.robot), original=trajectory)
    except OvitaError:
        return False
    limits_hold = solution.verdict.status in ("satisfied", "repaired")
    return limits_hold and check.judge(trajectory, solution.trajectory, scene).passed


def _among(what: str, given: Sequence[str], known: tuple[str, ...]) -> tuple[str, ...]:
    unknown = [name for name in given if name not in known]
    if unknown:
        raise RequestError(f"there is no {what} {unknown[0]!r}; choose from {', '.join(known)}")
    return tuple(dict.fromkeys(given)) or known
