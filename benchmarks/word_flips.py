"""One word of an instruction turned round: does the result turn round with it, or is it refused?

    python benchmarks/word_flips.py                    500 pairs of instructions, seed 1
    python benchmarks/word_flips.py --n 100 --seed 7   other ones
    python benchmarks/word_flips.py --wrong            also print every pair of which one side is done wrong

Each pair is an instruction and the same with one word turned round: left/right, closer/farther, first/last, at least/at
most, with and without "not" or "-", start/goal, above/below, before/after, up/down, faster/slower. Both are adapted,
and each result is measured here, with numpy alone, in the direction that its words ask for. A side is right, refused
(a question, words that were not placed, infeasible, or said to be not as meant), or wrong: called done, although the
measurement is not what the words ask for. A pair is as good as its worse side.
"""

from __future__ import annotations

import argparse
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ovita import Request, Scene, SceneObject, Trajectory, adapt

Array = NDArray[np.float64]
AXES = {"left": (-1, 0, 0), "right": (1, 0, 0), "forward": (0, 1, 0), "backward": (0, -1, 0)}
AXES |= {"up": (0, 0, 1), "down": (0, 0, -1), "higher": (0, 0, 1), "lower": (0, 0, -1)}
OPPOSITE = {"left": "right", "right": "left", "up": "down", "down": "up", "forward": "backward", "backward": "forward"}
DONE = ("ok", "done", "limited")


@dataclass(frozen=True)
class Case:
    """A path, its objects, and what came of an instruction: arrays (N, 4) and (M, 4)."""

    scene: Scene
    old: Array
    new: Array

    def shift(self, direction: str, part: slice | Array = slice(None)) -> float:
        """Mean displacement of some waypoints along a direction [m]; NaN where waypoints came or went."""
        if len(self.old) != len(self.new):
            return float("nan")
        return float(((self.new - self.old)[part, :3] @ np.array(AXES[direction])).mean())

    def end(self, direction: str, which: str) -> float:
        """Displacement of an end along a direction [m]."""
        k = 0 if which == "start" else -1
        return float((self.new[k, :3] - self.old[k, :3]) @ np.array(AXES[direction]))

    def moved(self, which: str) -> float:
        """How far an end moved [m]."""
        k = 0 if which == "start" else -1
        return float(np.linalg.norm(self.new[k, :3] - self.old[k, :3]))

    def gaps(self, name: str) -> tuple[float, float]:
        """Smallest distance of the path's segments to an object's centre, before and after [m]."""
        centre = self.scene[name].position
        return tuple(float(np.linalg.norm(dense(rows) - centre, axis=1).min()) for rows in (self.old, self.new))  # type: ignore[return-value]

    def pace(self, part: slice | Array = slice(None)) -> float:
        """Mean speed of some waypoints, relative to what it was; NaN where waypoints came or went."""
        if len(self.old) != len(self.new):
            return float("nan")
        return float(self.new[part, 3].mean() / self.old[part, 3].mean())

    def nearest(self, name: str) -> int:
        """The waypoint that was nearest to an object."""
        return int(np.linalg.norm(self.old[:, :3] - self.scene[name].position, axis=1).argmin())


Holds = Callable[[Case], bool]


@dataclass(frozen=True)
class Pair:
    """An instruction and the one with one word turned round, each with what must hold of its result."""

    flip: str
    family: str
    one: tuple[str, Holds]
    other: tuple[str, Holds]


def dense(rows: Array) -> Array:
    """Points along the segments of a path, 12 on each."""
    t = np.linspace(0.0, 1.0, 12, endpoint=False)[:, None]
    points = rows[:-1, None, :3] + t * (rows[1:, None, :3] - rows[:-1, None, :3])
    return np.concatenate([points.reshape(-1, 3), rows[-1:, :3]])


def situation(rng: np.random.Generator) -> tuple[Trajectory, Scene]:
    """A winding path of about two metres with three objects beside it."""
    n = int(rng.integers(30, 61))
    t = np.linspace(0.0, 1.0, n)
    x = 0.15 * np.sin(2 * np.pi * (t * rng.uniform(0.5, 1.2) + rng.uniform()))
    z = 0.5 + 0.12 * np.sin(2 * np.pi * (t * rng.uniform(0.4, 1.0) + rng.uniform()))
    speeds = 0.4 + 0.05 * np.sin(3 * t + rng.uniform())
    rows = np.column_stack([x, 2.0 * t, z, speeds])
    names = rng.permutation(["cup", "laptop", "box", "plate", "lamp", "toolbox"])[:3]
    objects = []
    for name, at in zip(names, (0.25, 0.5, 0.75), strict=True):
        k = round(at * (n - 1))
        side = rng.choice([-1.0, 1.0]) * rng.uniform(0.3, 0.45)
        beneath = rng.random() < 0.35
        offset = [0.1 * side, 0.0, -rng.uniform(0.2, 0.35)] if beneath else [side, 0.0, rng.uniform(-0.05, 0.05)]
        centre = rows[k, :3] + offset
        size = None if rng.random() < 0.3 else np.round(rng.uniform(0.06, 0.14, 3), 3)
        objects.append(SceneObject(str(name), np.round(centre, 3), size))
    return Trajectory.from_array(np.round(rows, 4)), Scene(tuple(objects))


class Grammar:
    """Draws pairs of instructions about one situation."""

    def __init__(self, rng: np.random.Generator, trajectory: Trajectory, scene: Scene) -> None:
        self.rng, self.scene, self.rows = rng, scene, trajectory.to_array()

    def pick(self, *options: Any) -> Any:
        """One of some options."""
        return options[int(self.rng.integers(len(options)))]

    def amount(self) -> tuple[str, float]:
        """A length in words, and in metres."""
        value = self.pick(0.05, 0.08, 0.1, 0.12, 0.15, 0.2)
        return self.pick(f"{value:g} m", f"{100 * value:g} cm"), value

    def thing(self) -> str:
        return str(self.pick(*self.scene.names))

    def height(self) -> float:
        z = self.rows[:, 2]
        return round(float(self.rng.uniform(z.min() + 0.03, z.max() - 0.03)), 2)

    # directions

    def shifted(self, words: tuple[str, str], flip: str) -> Pair:
        said, a = self.amount()
        verb = self.pick("go", "move", "shift the path", "move the whole path", "shift it", "translate the trajectory")
        form = self.pick("{verb} {d} by {said}", "{verb} {said} {d}", "{verb} {d} a bit", "{verb} {d}")
        if words == ("left", "right"):
            form = self.pick(form, "{verb} {said} to the {d}", "{verb} to the {d} by {said}")

        def side(d: str) -> tuple[str, Holds]:
            stated = "{said}" in form
            return form.format(
                verb=verb, d=d, said=said
            ), lambda c: abs(c.shift(d) - a) < 0.02 if stated else c.shift(d) > 0.01

        return Pair(flip, "shift", side(words[0]), side(words[1]))

    def left_right(self) -> Iterator[Callable[[], Pair]]:
        yield lambda: self.shifted(("left", "right"), "left/right")
        yield lambda: self.part_shifted("left/right", ("left", "right"))
        yield lambda: self.end_shifted("left/right", ("left", "right"))
        yield lambda: self.beyond("left/right", ("left", "right"))
        yield self.side_of
        yield self.not_side_of
        yield self.opposite_parts
        yield self.turned
        yield self.which_object
        yield self.object_on_side

    def up_down(self) -> Iterator[Callable[[], Pair]]:
        yield lambda: self.shifted(("up", "down"), "up/down")
        yield lambda: self.part_shifted("up/down", ("up", "down"))
        yield lambda: self.end_shifted("up/down", ("up", "down"))
        yield lambda: self.beyond("up/down", ("up", "down"))
        yield self.raised
        yield self.raised_over
        yield self.raised_over
        yield self.also
        yield self.opposite_heights

    def part_shifted(self, flip: str, words: tuple[str, str]) -> Pair:
        said, a = self.amount()
        n = len(self.rows)
        k = int(self.rng.integers(6, n // 3))
        unit = self.pick("half", "third", f"{k} waypoints", "quarter of the path")
        count = {"half": n // 2, "third": n // 3, "quarter of the path": n // 4}.get(unit, k)
        ends = ("first", "last")
        d, end = self.pick(*words), self.pick(*ends)
        form = self.pick("move the {end} {unit} {d} by {said}", "shift the {end} {unit} {said} {d}")
        if words == ("left", "right"):
            form = self.pick(form, "shift the {end} {unit} {said} to the {d}")

        def side(end: str, d: str) -> tuple[str, Holds]:
            def holds(c: Case) -> bool:
                inner, outer = slice(0, max(count - 4, 1)), slice(count + 5, n)
                if end == "last":
                    inner, outer = slice(min(n - count + 4, n - 1), n), slice(0, n - count - 5)
                return c.shift(d, inner) > 0.7 * a and abs(c.shift(d, outer)) < 0.3 * a

            return form.format(end=end, unit=unit, d=d, said=said), holds

        if flip == "first/last":
            return Pair(flip, "part shifted", side("first", d), side("last", d))
        return Pair(flip, "part shifted", side(end, words[0]), side(end, words[1]))

    def end_shifted(self, flip: str, words: tuple[str, str]) -> Pair:
        said, a = self.amount()
        d, end = self.pick(*words), self.pick("start", "goal")
        form = self.pick(
            "move the {end} {said} {d}",
            "shift the {end} {d} by {said}",
            "the {end} should be {said} further {d}",
            "only move the {end}, {said} {d}",
        )

        def side(end: str, d: str) -> tuple[str, Holds]:
            rest = "goal" if end == "start" else "start"
            return form.format(
                end=end, d=d, said=said
            ), lambda c: abs(c.end(d, end) - a) < 0.02 and c.moved(rest) < 0.2 * a

        if flip == "start/goal":
            return Pair(flip, "end shifted", side("start", d), side("goal", d))
        return Pair(flip, "end shifted", side(end, words[0]), side(end, words[1]))

    def beyond(self, flip: str, words: tuple[str, str]) -> Pair:
        said, a = self.amount()
        form = self.pick("after the goal go {d} by {said}", "after reaching the goal, move {said} {d}")

        def side(d: str) -> tuple[str, Holds]:
            return form.format(d=d, said=said), lambda c: abs(c.end(d, "goal") - a) < 0.02 and c.moved("start") < 0.01

        return Pair(flip, "after the goal", side(words[0]), side(words[1]))

    def side_of(self) -> Pair:
        name = self.thing()
        form = self.pick("stay to the {d} of the {o}", "keep to the {d} of the {o}", "always stay {d} of the {o}")

        def side(d: str) -> tuple[str, Holds]:
            axis = np.array(AXES[d])
            at = float(self.scene[name].position @ axis)
            return form.format(d=d, o=name), lambda c: bool((c.new[:, :3] @ axis >= at - 0.005).all())

        return Pair("left/right", "side of an object", side("left"), side("right"))

    def not_side_of(self) -> Pair:
        name = self.thing()
        form = self.pick(
            "do not go {d} of the {o}", "never pass to the {d} of the {o}", "don't go to the {d} of the {o}"
        )

        def side(d: str) -> tuple[str, Holds]:
            axis = np.array(AXES[d])
            return form.format(d=d, o=name), lambda c: self._not_beyond(c, name, axis)

        return Pair("left/right", "not on a side", side("left"), side("right"))

    @staticmethod
    def _not_beyond(c: Case, name: str, axis: Array) -> bool:
        """Whether the path, where it passes an object, is not on one side of it."""
        k = int(np.abs(dense(c.new)[:, 1] - c.scene[name].position[1]).argmin())
        return float((dense(c.new)[k] - c.scene[name].position) @ axis) <= 0.005

    def opposite_parts(self) -> Pair:
        said, a = self.amount()
        n = len(self.rows)
        form, quarter = self.pick(
            ("go {d} by {said} in the first half and {e} by {said} in the second half", n // 2),
            ("move {d} at the start and {e} at the end", n // 8),
            ("shift the first third {said} to the {d} and the last third {said} to the {e}", n // 3),
        )

        def side(d: str, e: str) -> tuple[str, Holds]:
            stated = "{said}" in form
            least = 0.6 * a if stated else 0.01
            first, last = slice(0, max(quarter - 4, 2)), slice(n - max(quarter - 4, 2), n)
            return form.format(d=d, e=e, said=said), lambda c: c.shift(d, first) > least and c.shift(e, last) > least

        return Pair("left/right", "two parts, two ways", side("left", "right"), side("right", "left"))

    def turned(self) -> Pair:
        degrees = self.pick(15, 20, 30)

        def side(d: str) -> tuple[str, Holds]:
            def holds(c: Case) -> bool:
                before, after = (rows[-1, :2] - rows[0, :2] for rows in (c.old, c.new))
                angle = np.degrees(np.arctan2(after[1], after[0]) - np.arctan2(before[1], before[0]))
                return abs(angle - (degrees if d == "left" else -degrees)) < 2

            return f"rotate the path by {degrees} degrees to the {d}", holds

        return Pair("left/right", "rotated", side("left"), side("right"))

    def raised(self) -> Pair:
        said, a = self.amount()
        words = self.pick(("raise", "lower"), ("lift", "lower"))
        rest = self.pick("the path by {said}", "the whole trajectory by {said}", "it by {said}", "the path slightly")

        def side(verb: str, d: str) -> tuple[str, Holds]:
            stated = "{said}" in rest
            return (
                f"{verb} {rest.format(said=said)}",
                lambda c: abs(c.shift(d) - a) < 0.02 if stated else c.shift(d) > 0.01,
            )

        return Pair("up/down", "raised", side(words[0], "up"), side(words[1], "down"))

    def raised_over(self) -> Pair:
        said, a = self.amount()
        name = self.thing()
        form = self.pick(
            "{verb} the path by {said} over the {o}",
            "{verb} the path by {said} near the {o}",
            "{verb} by {said} above the {o}",
            "go {said} {word} over the {o}",
            "go {word} by {said} when passing the {o}",
        )

        def side(verb: str, word: str, d: str) -> tuple[str, Holds]:
            def holds(c: Case) -> bool:
                k = c.nearest(name)
                return c.shift(d, slice(k, k + 1)) > 0.5 * a

            return form.format(verb=verb, word=word, said=said, o=name), holds

        return Pair("up/down", "raised at an object", side("raise", "higher", "up"), side("lower", "lower", "down"))

    def also(self) -> Pair:
        said, a = self.amount()
        name = self.thing()
        form = self.pick(
            "stay away from the {o}. go {d} by {said}",
            "avoid the {o} and go {d} by {said}",
            "go {d} by {said} and keep farther from the {o}",
        )

        def side(d: str) -> tuple[str, Holds]:
            def holds(c: Case) -> bool:
                before, after = c.gaps(name)
                return c.end(d, "goal") > 0.5 * a and after > before + 0.005

            return form.format(o=name, d=d, said=said), holds

        return Pair("up/down", "two wishes", side("up"), side("down"))

    # closer, farther

    def closer_farther(self) -> Iterator[Callable[[], Pair]]:
        yield self.approached
        yield self.approached
        yield self.approached_by
        yield lambda: self.end_approached("closer/farther")
        yield self.middle_approached
        yield self.bounded_gap
        yield self.gap_times
        yield self.part_approached

    def approached(self) -> Pair:
        name = self.thing()
        near, far = self.pick(
            ("go closer to the {o}", "go farther from the {o}"),
            ("move nearer to the {o}", "move farther away from the {o}"),
            ("pass a bit closer to the {o}", "pass a bit farther from the {o}"),
            ("come closer to the {o}", "stay farther away from the {o}"),
            ("decrease the distance to the {o}", "increase the distance to the {o}"),
            ("get slightly closer to the {o}", "get slightly farther from the {o}"),
            ("approach the {o}", "avoid the {o}"),
        )
        size = self.scene[name].radius

        def holds_near(c: Case) -> bool:
            before, after = c.gaps(name)
            return size * 0.5 - 1e-6 <= after < before - 0.005

        return Pair(
            "closer/farther",
            "approached",
            (near.format(o=name), holds_near),
            (far.format(o=name), lambda c: c.gaps(name)[1] > c.gaps(name)[0] + 0.005),
        )

    def approached_by(self) -> Pair:
        name = self.thing()
        said, a = self.pick(("5 cm", 0.05), ("0.08 m", 0.08), ("0.1 m", 0.1))
        form = self.pick("go {said} {w} the {o}", "move {w} the {o} by {said}", "pass the {o} {said} {short}")

        def side(w: str, short: str, sign: float) -> tuple[str, Holds]:
            def holds(c: Case) -> bool:
                before, after = c.gaps(name)
                return abs(sign * (after - before) - a) < 0.03

            return form.format(said=said, w=w, short=short, o=name), holds

        return Pair(
            "closer/farther", "approached by", side("closer to", "closer", -1), side("farther from", "farther away", 1)
        )

    def end_approached(self, flip: str) -> Pair:
        name = self.thing()
        said, a = self.amount()
        w, end = self.pick("closer to", "away from"), self.pick("start", "goal")
        form = self.pick("move the {end} {said} {w} the {o}", "bring the {end} {said} {w} the {o}")

        def side(end: str, w: str) -> tuple[str, Holds]:
            k, sign = (0 if end == "start" else -1), (-1 if w == "closer to" else 1)

            def holds(c: Case) -> bool:
                before, after = (float(np.linalg.norm(r[k, :3] - c.scene[name].position)) for r in (c.old, c.new))
                rest = "goal" if end == "start" else "start"
                return abs(sign * (after - before) - a) < 0.02 and c.moved(rest) < 0.2 * a

            return form.format(end=end, said=said, w=w, o=name), holds

        if flip == "start/goal":
            return Pair(flip, "end approached", side("start", w), side("goal", w))
        return Pair(flip, "end approached", side(end, "closer to"), side(end, "away from"))

    def middle_approached(self) -> Pair:
        name = str(self.scene.names[1])
        said, a = self.pick(("5 cm", 0.05), ("0.1 m", 0.1))
        form = self.pick("move the middle of the path {said} {w} the {o}", "bring the middle part {said} {w} the {o}")

        def side(w: str, sign: float) -> tuple[str, Holds]:
            def holds(c: Case) -> bool:
                before, after = c.gaps(name)
                return sign * (after - before) > 0.3 * a and c.moved("start") + c.moved("goal") < 0.02

            return form.format(said=said, w=w, o=name), holds

        return Pair("closer/farther", "middle approached", side("closer to", -1), side("away from", 1))

    def bounded_gap(self) -> Pair:
        name = self.thing()
        a = self.pick(0.5, 0.6, 0.8)

        def at_most(c: Case) -> bool:
            r = c.scene[name].radius
            return bool((np.linalg.norm(c.new[:, :3] - c.scene[name].position, axis=1) <= a + r + 0.02).all())

        return Pair(
            "closer/farther",
            "bounded distance",
            (f"never come closer than {a:g} m to the {name}", lambda c: c.gaps(name)[1] >= a - 0.01),
            (f"never go farther than {a:g} m from the {name}", at_most),
        )

    # bounds

    def least_most(self) -> Iterator[Callable[[], Pair]]:
        yield self.gap_bounds
        yield self.gap_bounds
        yield self.height_bounds
        yield self.height_bounds
        yield self.speed_bounds
        yield self.speed_bounds
        yield self.part_speed_bounds

    def gap_bounds(self) -> Pair:
        name = self.thing()
        a = self.pick(0.5, 0.6, 0.7, 0.8)
        form = self.pick(
            "keep {b} {a:g} m from the {o}",
            "pass the {o} at a distance of {b} {a:g} m",
            "stay {b} {a:g} m away from the {o}",
            "the distance to the {o} must be {b} {a:g} m",
        )

        def at_most(c: Case) -> bool:
            r = c.scene[name].radius
            return bool((np.linalg.norm(c.new[:, :3] - c.scene[name].position, axis=1) <= a + r + 0.02).all())

        return Pair(
            "at least/at most",
            "distance",
            (form.format(b="at least", a=a, o=name), lambda c: c.gaps(name)[1] >= a - 0.01),
            (form.format(b="at most", a=a, o=name), at_most),
        )

    def height_bounds(self) -> Pair:
        z = self.height()
        form = self.pick(
            "stay {b} {z:g} m above the ground",
            "keep a height of {b} {z:g} m",
            "fly {b} {z:g} m high",
            "the height must be {b} {z:g} m",
        )
        return Pair(
            "at least/at most",
            "height",
            (form.format(b="at least", z=z), lambda c: bool(c.new[:, 2].min() >= z - 0.005)),
            (form.format(b="at most", z=z), lambda c: bool(c.new[:, 2].max() <= z + 0.005)),
        )

    def speed_bounds(self) -> Pair:
        v = self.pick(0.38, 0.4, 0.42)
        low, high = self.pick(
            ("keep the speed at least {v:g} m/s", "keep the speed at most {v:g} m/s"),
            ("drive at least {v:g} m/s", "drive at most {v:g} m/s"),
            ("the minimum speed is {v:g} m/s", "the maximum speed is {v:g} m/s"),
            ("the speed must be at least {v:g} m/s", "the speed must be at most {v:g} m/s"),
        )
        return Pair(
            "at least/at most",
            "speed",
            (low.format(v=v), lambda c: bool(c.new[:, 3].min() >= v - 0.005)),
            (high.format(v=v), lambda c: bool(c.new[:, 3].max() <= v + 0.005)),
        )

    def above_below(self) -> Iterator[Callable[[], Pair]]:
        yield self.above_height
        yield self.above_height
        yield self.over_under
        yield self.over_under
        yield self.stays_above
        yield self.end_above

    def above_height(self) -> Pair:
        z = self.height()
        form = self.pick(
            "stay {w} {z:g} m",
            "never go {w} {z:g} m",
            "the path must be {w} {z:g} m",
            "don't go {w} {z:g} m",
            "do not fly {w} {z:g} m",
            "keep {w} {z:g} m",
        )
        denied = form.startswith(("never", "do not", "don't"))

        def low(c: Case) -> bool:
            return bool(c.new[:, 2].min() >= z - 0.005)

        def high(c: Case) -> bool:
            return bool(c.new[:, 2].max() <= z + 0.005)

        return Pair(
            "above/below",
            "height",
            (form.format(w="above", z=z), high if denied else low),
            (form.format(w="below", z=z), low if denied else high),
        )

    def over_under(self) -> Pair:
        name = self.thing()
        said, _ = self.amount()
        form = self.pick("pass {w} the {o}", "go {w} the {o}", "pass {said} {w} the {o}", "fly {said} {w} the {o}")

        def side(w: str, sign: float) -> tuple[str, Holds]:
            def holds(c: Case) -> bool:
                away = dense(c.new) - c.scene[name].position
                k = int(np.linalg.norm(away[:, :2], axis=1).argmin())
                return float(np.linalg.norm(away[k, :2])) < 0.06 and sign * away[k, 2] > 0.02

            return form.format(w=w, said=said, o=name), holds

        return Pair("above/below", "an object", side("above", 1), side("below", -1))

    def stays_above(self) -> Pair:
        name = self.thing()
        form = self.pick("stay {w} the {o}", "always keep {w} the {o}")

        def side(w: str, sign: float) -> tuple[str, Holds]:
            z = self.scene[name].position[2]
            return form.format(w=w, o=name), lambda c: bool((sign * (c.new[:, 2] - z) >= -0.005).all())

        return Pair("above/below", "stay above an object", side("above", 1), side("below", -1))

    # places

    def first_last(self) -> Iterator[Callable[[], Pair]]:
        yield lambda: self.part_shifted("first/last", ("left", "right"))
        yield lambda: self.part_shifted("first/last", ("up", "down"))
        yield lambda: self.part_paced("first/last")
        yield self.trimmed
        yield self.two_paces

    def part_paced(self, flip: str) -> Pair:
        n = len(self.rows)
        k = int(self.rng.integers(6, n // 3))
        unit = self.pick("half", "third", f"{k} waypoints")
        count = {"half": n // 2, "third": n // 3}.get(unit, k)
        word, end = self.pick("slower", "faster"), self.pick("first", "last")
        form = self.pick("go {word} in the {end} {unit}", "{verb} in the {end} {unit}", "drive the {end} {unit} {word}")

        def side(end: str, word: str) -> tuple[str, Holds]:
            def holds(c: Case) -> bool:
                inner, outer = slice(0, count), slice(count + 2, n)
                if end == "last":
                    inner, outer = slice(n - count, n), slice(0, n - count - 2)
                changed = c.pace(inner) < 0.98 if word == "slower" else c.pace(inner) > 1.02
                return changed and abs(c.pace(outer) - 1) < 0.05

            verb = "slow down" if word == "slower" else "speed up"
            return form.format(word=word, verb=verb, end=end, unit=unit), holds

        if flip == "first/last":
            return Pair(flip, "part's speed", side("first", word), side("last", word))
        return Pair(flip, "part's speed", side(end, "faster"), side(end, "slower"))

    def trimmed(self) -> Pair:
        k = self.pick(3, 5, 8, 10)
        verb = self.pick("remove", "drop", "cut off", "delete")

        def first(c: Case) -> bool:
            return len(c.new) == len(c.old) - k and np.allclose(c.new[:, :3], c.old[k:, :3], atol=1e-3)

        def last(c: Case) -> bool:
            return len(c.new) == len(c.old) - k and np.allclose(c.new[:, :3], c.old[:-k, :3], atol=1e-3)

        one, other = f"{verb} the first {k} waypoints", f"{verb} the last {k} waypoints"
        return Pair("first/last", "trimmed", (one, first), (other, last))

    def two_paces(self) -> Pair:
        n = len(self.rows)
        form = self.pick(
            "go slower in the {a} half and faster in the {b} half",
            "speed up in the {b} half, slow down in the {a} half",
        )

        def side(a: str, b: str) -> tuple[str, Holds]:
            begin, end = slice(0, n // 2 - 2), slice(n // 2 + 2, n)
            slow, fast = (begin, end) if a == "first" else (end, begin)
            return form.format(a=a, b=b), lambda c: c.pace(slow) < 0.98 and c.pace(fast) > 1.02

        return Pair("first/last", "two speeds", side("first", "last"), side("last", "first"))

    def start_goal(self) -> Iterator[Callable[[], Pair]]:
        yield lambda: self.end_shifted("start/goal", self.pick(("left", "right"), ("up", "down")))
        yield lambda: self.end_approached("start/goal")
        yield self.end_placed
        yield self.waited
        yield self.end_kept
        yield self.end_paced
        yield self.from_object

    def end_placed(self) -> Pair:
        name = self.thing()
        form = self.pick("move the {end} to the {o}", "the {end} should be at the {o}", "set the {end} to the {o}")

        def side(end: str) -> tuple[str, Holds]:
            k = 0 if end == "start" else -1
            reach = self.scene[name].radius + 0.06
            return (
                form.format(end=end, o=name),
                lambda c: (
                    float(np.linalg.norm(c.new[k, :3] - c.scene[name].position)) < reach
                    and c.moved("goal" if end == "start" else "start") < 0.02
                ),
            )

        return Pair("start/goal", "end placed", side("start"), side("goal"))

    def waited(self) -> Pair:
        seconds = self.pick(2, 3, 5)
        form = self.pick("wait {s} s at the {end}", "pause for {s} seconds at the {end}", "stop for {s} s at the {end}")

        def side(end: str) -> tuple[str, Holds]:
            k = 0 if end == "start" else -1
            rest = -1 if end == "start" else 0

            def holds(c: Case) -> bool:
                here, there = (
                    int((np.linalg.norm(c.new[:, :3] - c.old[i, :3], axis=1) < 1e-3).sum()) for i in (k, rest)
                )
                return here > 3 and there <= 2

            return form.format(s=seconds, end=end), holds

        return Pair("start/goal", "waited", side("start"), side("goal"))

    def end_kept(self) -> Pair:
        said, a = self.amount()
        d = self.pick("left", "right", "up", "down")
        form = self.pick(
            "keep the {end} fixed and shift the rest {d} by {said}",
            "do not move the {end}, but shift the rest by {said} {d}",
            "shift the path {d} by {said} but keep the {end} where it is",
        )

        def side(end: str) -> tuple[str, Holds]:
            rest = "goal" if end == "start" else "start"
            return form.format(end=end, d=d, said=said), lambda c: c.moved(end) < 0.01 and c.end(d, rest) > 0.7 * a

        return Pair("start/goal", "end kept", side("start"), side("goal"))

    def end_paced(self) -> Pair:
        n = len(self.rows)
        word = self.pick("slower", "faster")
        form = self.pick("go {word} at the {end}", "{verb} near the {end}", "drive {word} close to the {end}")

        def side(end: str) -> tuple[str, Holds]:
            here, there = slice(0, n // 10), slice(n - n // 10, n)
            if end == "goal":
                here, there = there, here
            verb = "slow down" if word == "slower" else "speed up"

            def holds(c: Case) -> bool:
                changed = c.pace(here) < 0.98 if word == "slower" else c.pace(here) > 1.02
                return changed and abs(c.pace(there) - 1) < 0.05

            return form.format(word=word, verb=verb, end=end), holds

        return Pair("start/goal", "end's speed", side("start"), side("goal"))

    def before_after(self) -> Iterator[Callable[[], Pair]]:
        yield self.paced_before
        yield self.paced_before
        yield self.shifted_before
        yield self.two_paces_at
        yield self.trimmed_before

    def paced_before(self) -> Pair:
        name = str(self.scene.names[1])
        word = self.pick("slower", "faster")
        form = self.pick("go {word} {w} the {o}", "{verb} {w} the {o}", "drive {word} {w} passing the {o}")

        def side(w: str) -> tuple[str, Holds]:
            def holds(c: Case) -> bool:
                k, n = c.nearest(name), len(c.old)
                begin, end = slice(0, max(k - 4, 1)), slice(min(k + 5, n - 1), n)
                here, there = (begin, end) if w == "before" else (end, begin)
                changed = c.pace(here) < 0.98 if word == "slower" else c.pace(here) > 1.02
                return changed and abs(c.pace(there) - 1) < 0.05

            verb = "slow down" if word == "slower" else "speed up"
            return form.format(word=word, verb=verb, w=w, o=name), holds

        return Pair("before/after", "speed", side("before"), side("after"))

    def shifted_before(self) -> Pair:
        name = str(self.scene.names[1])
        said, a = self.amount()
        d = self.pick("left", "right", "up", "down")
        form = self.pick(
            "go {d} by {said} {w} the {o}", "shift the path {said} {d} {w} the {o}", "{w} the {o}, move {d} by {said}"
        )

        def side(w: str) -> tuple[str, Holds]:
            def holds(c: Case) -> bool:
                k, n = c.nearest(name), len(c.old)
                begin, end = slice(0, max(k - 5, 1)), slice(min(k + 6, n - 1), n)
                here, there = (begin, end) if w == "before" else (end, begin)
                return c.shift(d, here) > 0.6 * a and abs(c.shift(d, there)) < 0.2 * a

            return form.format(d=d, said=said, w=w, o=name), holds

        return Pair("before/after", "shift", side("before"), side("after"))

    def two_paces_at(self) -> Pair:
        name = str(self.scene.names[1])
        one, other = self.pick(
            ("speed up until the {o}, then slow down", "slow down until the {o}, then speed up"),
            ("go faster before the {o} and slower after it", "go faster after the {o} and slower before it"),
            ("slow down after the {o}, speed up before it", "slow down before the {o}, speed up after it"),
        )

        def side(text: str, fast: str) -> tuple[str, Holds]:
            def holds(c: Case) -> bool:
                k, n = c.nearest(name), len(c.old)
                begin, end = c.pace(slice(0, max(k - 4, 1))), c.pace(slice(min(k + 5, n - 1), n))
                quick, slow = (begin, end) if fast == "before" else (end, begin)
                return quick > 1.02 and slow < 0.98

            return text.format(o=name), holds

        return Pair("before/after", "two speeds", side(one, "before"), side(other, "after"))

    # speeds

    def faster_slower(self) -> Iterator[Callable[[], Pair]]:
        yield self.paced
        yield self.paced_near
        yield lambda: self.part_paced("faster/slower")
        yield self.paced_by
        yield self.paced_bounds
        yield self.graded
        yield self.not_so

    def paced(self) -> Pair:
        quick, slow = self.pick(
            ("go faster", "go slower"),
            ("speed up", "slow down"),
            ("move a bit faster", "move a bit slower"),
            ("drive much faster", "drive much slower"),
            ("increase the speed", "decrease the speed"),
            ("twice as fast", "half as fast"),
        )
        return Pair("faster/slower", "whole", (quick, lambda c: c.pace() > 1.02), (slow, lambda c: c.pace() < 0.98))

    def paced_near(self) -> Pair:
        name = self.thing()
        form = self.pick(
            "{verb} near the {o}", "go {word} close to the {o}", "{verb} when passing the {o}", "be {word} near the {o}"
        )

        def side(verb: str, word: str, up: bool) -> tuple[str, Holds]:
            def holds(c: Case) -> bool:
                k = c.nearest(name)
                change = c.pace(slice(k, k + 1))
                return change > 1.02 if up else change < 0.98

            return form.format(verb=verb, word=word, o=name), holds

        return Pair("faster/slower", "near", side("speed up", "faster", True), side("slow down", "slower", False))

    def paced_by(self) -> Pair:
        how = self.pick("by 20 %", "by 0.1 m/s", "by half", "by 50 percent")
        return Pair(
            "faster/slower",
            "by an amount",
            (f"increase the speed {how}", lambda c: c.pace() > 1.1),
            (f"reduce the speed {how}", lambda c: c.pace() < 0.9),
        )

    def paced_bounds(self) -> Pair:
        v = self.pick(0.38, 0.4, 0.42)
        form = self.pick("never go {w} than {v:g} m/s", "do not move {w} than {v:g} m/s", "go no {w} than {v:g} m/s")
        return Pair(
            "faster/slower",
            "bounds",
            (form.format(w="faster", v=v), lambda c: bool(c.new[:, 3].max() <= v + 0.005)),
            (form.format(w="slower", v=v), lambda c: bool(c.new[:, 3].min() >= v - 0.005)),
        )

    def graded(self) -> Pair:
        name = str(self.scene.names[1])

        def side(word: str, sign: float) -> tuple[str, Holds]:
            def holds(c: Case) -> bool:
                gap = np.linalg.norm(c.old[:, :3] - c.scene[name].position, axis=1)
                near = gap < np.quantile(gap, 0.25)
                return np.abs(c.new[:, :3] - c.old[:, :3]).max() < 0.02 and sign * (c.pace(near) - c.pace(~near)) > 0.02

            return f"the closer to the {name}, the {word}", holds

        return Pair("faster/slower", "graded", side("faster", 1), side("slower", -1))

    # negations

    def negated(self) -> Iterator[Callable[[], Pair]]:
        yield self.not_closer
        yield self.not_directed
        yield self.not_paced
        yield self.not_over
        yield self.minus
        yield self.not_end
        yield self.not_there
        yield self.not_avoided

    def not_closer(self) -> Pair:
        name = self.thing()
        verb = self.pick("go closer to", "approach", "touch", "go near", "move toward")
        no = self.pick("do not", "never", "don't")
        return Pair(
            "not/-",
            "not closer",
            (f"{verb} the {name}", lambda c: c.gaps(name)[1] < c.gaps(name)[0] - 0.005),
            (f"{no} {verb} the {name}", lambda c: c.gaps(name)[1] > c.gaps(name)[0] - 0.002),
        )

    def not_directed(self) -> Pair:
        d = self.pick("left", "right", "up", "down")
        no = self.pick("do not", "never", "don't")
        return Pair(
            "not/-",
            "not a direction",
            (f"go {d}", lambda c: c.shift(d) > 0.01),
            (f"{no} go {d}", lambda c: bool(c.shift(d) <= 1e-6)),
        )

    def not_paced(self) -> Pair:
        name = self.thing()
        verb, up = self.pick(("slow down", False), ("speed up", True), ("stop", False))
        no = self.pick("do not", "never", "don't")

        def done(c: Case) -> bool:
            if verb == "stop":
                return bool(c.new[:, 3].min() < 0.05)
            k = c.nearest(name)
            return c.pace(slice(k, k + 1)) > 1.02 if up else c.pace(slice(k, k + 1)) < 0.98

        def undone(c: Case) -> bool:
            if len(c.new) != len(c.old):
                return False
            k = c.nearest(name)
            change = c.pace(slice(k, k + 1))
            return change <= 1.001 if up else change >= 0.999

        return Pair(
            "not/-", "not the speed", (f"{verb} near the {name}", done), (f"{no} {verb} near the {name}", undone)
        )

    def not_over(self) -> Pair:
        name = self.thing()
        verb, no = self.pick("fly over", "go above", "pass over"), self.pick("do not", "never")

        def over(c: Case) -> bool:
            away = dense(c.new) - c.scene[name].position
            k = int(np.linalg.norm(away[:, :2], axis=1).argmin())
            return float(np.linalg.norm(away[k, :2])) < 0.06 and float(away[k, 2]) > 0.02

        return Pair(
            "not/-",
            "not over",
            (f"{verb} the {name}", over),
            (f"{no} {verb} the {name}", lambda c: not over(c)),
        )

    def minus(self) -> Pair:
        said, a = self.pick(("0.1", 0.1), ("0.2", 0.2), ("0.15 m", 0.15))
        axis = self.pick("x", "y", "z")
        k = "xyz".index(axis)
        form = self.pick(
            "shift the path by {s} in {axis}",
            "move it {s} along {axis}",
            "move {s} along the {axis} axis",
            "add {s} to {axis}",
        )

        def side(s: str, value: float) -> tuple[str, Holds]:
            return form.format(
                s=s, axis=axis
            ), lambda c: len(c.new) == len(c.old) and bool(np.allclose((c.new - c.old)[:, k], value, atol=0.01))

        return Pair("not/-", "sign", side(said, a), side(f"-{said}", -a))

    def not_end(self) -> Pair:
        said, a = self.amount()
        end, d = self.pick("start", "goal"), self.pick("left", "right", "up", "down")
        no = self.pick("do not", "don't", "never")
        return Pair(
            "not/-",
            "not an end",
            (f"move the {end} {d} by {said}", lambda c: c.end(d, end) > 0.7 * a),
            (f"{no} move the {end} {d}", lambda c: c.end(d, end) < 1e-3),
        )

    def which_object(self) -> Pair:
        names = sorted(self.scene.names, key=lambda name: float(self.scene[name].position[0]))
        verb = self.pick("go closer to", "approach", "move toward")

        def side(word: str, name: str) -> tuple[str, Holds]:
            return f"{verb} the {word} object", lambda c: c.gaps(name)[1] < c.gaps(name)[0] - 0.005

        return Pair("left/right", "which object", side("leftmost", names[0]), side("rightmost", names[-1]))

    def object_on_side(self) -> Pair:
        name = self.thing()
        form = self.pick("keep the {o} on your {d}", "pass with the {o} on the {d} side", "leave the {o} on the {d}")

        def side(d: str) -> tuple[str, Holds]:
            def holds(c: Case) -> bool:
                k = int(np.abs(dense(c.new)[:, 1] - c.scene[name].position[1]).argmin())
                return float((c.scene[name].position - dense(c.new)[k]) @ np.array(AXES[d])) > -0.005

            return form.format(o=name, d=d), holds

        return Pair("left/right", "object on a side", side("left"), side("right"))

    def opposite_heights(self) -> Pair:
        name = str(self.scene.names[1])
        form = self.pick(
            "go {d} before the {o} and {e} after it",
            "go {d} until the {o}, then {e}",
            "go {d} in the first half and {e} in the last half",
        )

        def side(d: str, e: str) -> tuple[str, Holds]:
            def holds(c: Case) -> bool:
                k = c.nearest(name) if "{o}" in form else len(c.old) // 2
                return c.shift(d, slice(0, k - 5)) > 0.01 and c.shift(e, slice(k + 6, None)) > 0.01

            return form.format(d=d, e=e, o=name), holds

        words = self.pick(("up", "down"), ("higher", "lower"))
        return Pair("up/down", "two parts, two ways", side(*words), side(words[1], words[0]))

    def gap_times(self) -> Pair:
        name = self.thing()
        form = self.pick("{verb} the distance to the {o}", "pass the {o} at {half} the distance")

        def side(verb: str, half: str, near: bool) -> tuple[str, Holds]:
            def holds(c: Case) -> bool:
                before, after = c.gaps(name)
                return after < before - 0.01 if near else after > before + 0.01

            return form.format(verb=verb, half=half, o=name), holds

        return Pair("closer/farther", "times", side("halve", "half", True), side("double", "twice", False))

    def part_approached(self) -> Pair:
        at = int(self.rng.integers(2))
        name = str(self.scene.names[2 * at])
        part = ("first", "last")[at]
        form = self.pick("go {w} the {o} in the {part} half", "in the {part} half, go {w} the {o}")

        def side(w: str, near: bool) -> tuple[str, Holds]:
            def holds(c: Case) -> bool:
                before, after = c.gaps(name)
                still = c.moved("goal" if part == "first" else "start") < 0.05
                return still and (after < before - 0.005 if near else after > before + 0.005)

            return form.format(w=w, o=name, part=part), holds

        return Pair("closer/farther", "part approached", side("closer to", True), side("farther from", False))

    def part_speed_bounds(self) -> Pair:
        v = self.pick(0.38, 0.4, 0.42)
        n = len(self.rows)
        part = self.pick("first", "last")
        here = slice(0, n // 2 - 1) if part == "first" else slice(n // 2 + 1, n)
        form = self.pick("drive {b} {v:g} m/s in the {part} half", "in the {part} half keep the speed {b} {v:g} m/s")
        return Pair(
            "at least/at most",
            "part's speed",
            (form.format(b="at least", v=v, part=part), lambda c: bool(c.new[here, 3].min() >= v - 0.005)),
            (form.format(b="at most", v=v, part=part), lambda c: bool(c.new[here, 3].max() <= v + 0.005)),
        )

    def end_above(self) -> Pair:
        name = self.thing()
        said, a = self.amount()
        form = self.pick("move the {end} {said} {w} the {o}", "the {end} should be {said} {w} the {o}")
        end = self.pick("start", "goal")
        k = 0 if end == "start" else -1

        def side(w: str, sign: float) -> tuple[str, Holds]:
            def holds(c: Case) -> bool:
                away = c.new[k, :3] - c.scene[name].position
                return sign * away[2] > 0.6 * a and float(np.linalg.norm(away[:2])) < 0.05

            return form.format(end=end, said=said, w=w, o=name), holds

        return Pair("above/below", "an end", side("above", 1), side("below", -1))

    def from_object(self) -> Pair:
        name = str(self.scene.names[1])
        word = self.pick("slower", "faster")

        def side(text: str, early: bool) -> tuple[str, Holds]:
            def holds(c: Case) -> bool:
                k, n = c.nearest(name), len(c.old)
                begin, end = c.pace(slice(0, max(k - 4, 1))), c.pace(slice(min(k + 5, n - 1), n))
                here, there = (begin, end) if early else (end, begin)
                return abs(there - 1) < 0.05 and (here < 0.98 if word == "slower" else here > 1.02)

            return text.format(word=word, o=name), holds

        return Pair(
            "start/goal",
            "between an end and an object",
            side("go {word} between the start and the {o}", True),
            side("go {word} between the goal and the {o}", False),
        )

    def trimmed_before(self) -> Pair:
        name = str(self.scene.names[1])
        form = self.pick("remove the waypoints {w} the {o}", "cut off everything {w} the {o}")

        def side(w: str) -> tuple[str, Holds]:
            def holds(c: Case) -> bool:
                k, n = c.nearest(name), len(c.old)
                left = c.old[k:] if w == "before" else c.old[: k + 1]
                fits = abs(len(c.new) - len(left)) <= 2 and len(c.new) < n
                kept = -1 if w == "before" else 0
                return fits and bool(np.allclose(c.new[kept, :3], c.old[kept, :3], atol=1e-3))

            return form.format(w=w, o=name), holds

        return Pair("before/after", "trimmed", side("before"), side("after"))

    def not_so(self) -> Pair:
        form = self.pick("not so {w}", "don't go so {w}", "do not drive so {w}", "go less {w}")
        return Pair(
            "faster/slower",
            "not so fast",
            (form.format(w="slow"), lambda c: c.pace() > 1.02),
            (form.format(w="fast"), lambda c: c.pace() < 0.98),
        )

    def not_there(self) -> Pair:
        name = str(self.scene.names[1])
        verb, up = self.pick(("slow down", False), ("speed up", True))
        place = self.pick("near the {o}", "in the first half")
        no = self.pick("{verb}, but not {place}", "{verb} everywhere except {place}", "{verb}, just not {place}")
        where = place.format(o=name)

        def side(inside: bool) -> Holds:
            def holds(c: Case) -> bool:
                n, k = len(c.old), c.nearest(name)
                here = slice(k, k + 1) if "{o}" in place else slice(0, n // 2 - 1)
                there = slice(0, 2) if "{o}" in place else slice(n // 2 + 1, n)
                inner, outer = c.pace(here), c.pace(there)
                changed, same = (inner, outer) if inside else (outer, inner)
                return abs(same - 1) < 0.02 and (changed > 1.02 if up else changed < 0.98)

            return holds

        return Pair(
            "not/-", "not there", (f"{verb} {where}", side(True)), (no.format(verb=verb, place=where), side(False))
        )

    def not_avoided(self) -> Pair:
        name = self.thing()
        verb = self.pick("avoid", "stay away from", "move away from")
        no = self.pick("do not", "don't")
        return Pair(
            "not/-",
            "not avoided",
            (f"{verb} the {name}", lambda c: c.gaps(name)[1] > c.gaps(name)[0] + 0.005),
            (f"{no} {verb} the {name}", lambda c: c.gaps(name)[1] <= c.gaps(name)[0] + 0.002),
        )

    @property
    def flips(self) -> tuple[Callable[[], Iterator[Callable[[], Pair]]], ...]:
        """The kinds of flips, each with its families."""
        return (
            self.left_right, self.up_down, self.closer_farther, self.least_most, self.above_below,
            self.first_last, self.start_goal, self.before_after, self.faster_slower, self.negated,
        )  # fmt: skip


def outcome(text: str, holds: Holds, trajectory: Trajectory, scene: Scene) -> tuple[str, str]:
    """What came of an instruction: "right", "refused" or "wrong", and the plan."""
    result = adapt(Request(text, trajectory, scene), writer="builtin")
    if result.status not in DONE or not all(promise.held for promise in result.postconditions):
        return "refused", result.question or " ".join(result.unplaced) or result.status
    case = Case(scene, trajectory.to_array(), result.adapted.to_array())
    return ("right" if holds(case) else "wrong"), " ".join(result.plan)


def pairs(n: int, seed: int) -> Iterator[tuple[Pair, Trajectory, Scene]]:
    """Pairs of instructions, the kinds of flips in turn."""
    for i in range(n):
        rng = np.random.default_rng([seed, i])
        trajectory, scene = situation(rng)
        grammar = Grammar(rng, trajectory, scene)
        families = list(grammar.flips[i % len(grammar.flips)]())
        yield grammar.pick(*families)(), trajectory, scene


def judged(n: int, seed: int) -> Iterator[tuple[Pair, list[tuple[str, str]]]]:
    """Each pair with what came of its two sides."""
    for pair, trajectory, scene in pairs(n, seed):
        yield pair, [outcome(*side, trajectory, scene) for side in (pair.one, pair.other)]


def main() -> None:
    """Run the benchmark and print its table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--n", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--wrong", action="store_true", help="print every pair of which one side is done wrong")
    parser.add_argument("--refused", action="store_true", help="print every side that is refused")
    options = parser.parse_args()
    table: dict[str, Counter[str]] = defaultdict(Counter)
    for pair, sides in judged(options.n, options.seed):
        kinds = {kind for kind, _ in sides}
        verdict = next(kind for kind in ("wrong", "refused", "right") if kind in kinds)
        table[pair.flip][verdict] += 1
        table["all"][verdict] += 1
        for (text, _), (kind, why) in zip((pair.one, pair.other), sides, strict=True):
            if (options.wrong and kind == "wrong") or (options.refused and kind == "refused"):
                print(f"{kind:8}{pair.family:22}{text!r} -> {why}")
    print(f"{'flip':18}{'pairs':>7}{'right':>7}{'refused':>9}{'wrong':>7}")
    for flip, counts in sorted(table.items(), key=lambda item: (item[0] == "all", item[0])):
        row = [counts[kind] for kind in ("right", "refused", "wrong")]
        print(f"{flip:18}{sum(row):7}{row[0]:7}{row[1]:9}{row[2]:7}")


if __name__ == "__main__":
    main()
