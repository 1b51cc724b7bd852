"""Do promises hold when they should? Right and wrong edits for each kind of postcondition, judged.

    python benchmarks/promises.py               300 right and 300 wrong edits of each kind
    python benchmarks/promises.py --write       and put the table into docs/trust.md
    python benchmarks/promises.py --show moved  the edits of a kind that were judged falsely

What is right and what is wrong follows from how an edit is made, by code of its own here and not by the toolkit's
operations. Right edits are made as people and models make them: in full, with kept ends, blended, on a part, resampled,
with waits, and moved by up to 1.4 cm by limits. Wrong edits go the other way, do half of it, do it elsewhere, or not at
all.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ovita.paths.geometry import closest_to_point
from ovita.paths.scene import DIRECTIONS, RFU, Scene, SceneObject
from ovita.paths.trajectory import Array, arc_length, interpolate, source_indices
from ovita.toolkit import CATALOGUE, judge

COUNT = 300
PAGE = Path(__file__).parents[1] / "docs" / "trust.md"
BEGIN, END = "<!-- promises: benchmarks/promises.py --write -->", "<!-- promises end -->"
Case = tuple[Any, Array, Array, Scene]


class Draw:
    """A random path among objects, and the ways to change it."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng, self.n = rng, int(rng.integers(25, 120))
        u, size = np.linspace(0.0, 1.0, self.n), rng.uniform(0.6, 3.0)
        turns = rng.normal(0.0, 0.25, (3, 3)) * (rng.random() < 0.7)
        path = np.outer(u, unit(rng.normal(size=3) * [1, 1, 0.3]))
        path += sum(np.outer(np.sin(np.pi * (k + 1) * u + k), turns[k]) / (k + 1) for k in range(3))
        if rng.random() < 0.4:
            path[:, 2] = 0.0
        path *= size / arc_length(path)[-1]
        speeds = np.full(self.n, rng.uniform(0.1, 0.6))
        if rng.random() < 0.5:
            speeds *= np.sqrt(np.clip(np.minimum(u, 1.0 - u) / 0.15, 0.01, 1.0))
        self.rows = np.column_stack([path, speeds])
        self.u, self.size = u, size
        i = int(rng.integers(self.n // 5, 4 * self.n // 5))
        self.place = path[i] + unit(np.cross(rng.normal(size=3), headed(path, i))) * size * rng.uniform(0.12, 0.35)
        edges = rng.uniform(0.02, 0.1, 3) * size if rng.random() < 0.6 else None
        other = path[int(rng.integers(self.n))] + unit(rng.normal(size=3)) * size * 0.3
        self.target = SceneObject("cup", self.place, edges)
        self.scene = Scene((self.target, SceneObject("box", other)))
        self.nearest, at = closest_to_point(path, self.place)
        self.i = round(at)

    def part(self, i: int | None = None, share: float = 0.3) -> Array:
        """A mask of a stretch around waypoint i."""
        i = int(self.rng.integers(self.n)) if i is None else i
        half = max(int(self.n * self.rng.uniform(share, share + 0.15)), 3)
        return np.abs(np.arange(self.n) - i) <= half

    def bump(self, i: int, width: float = 0.3) -> Array:
        """Weights (N,) around waypoint i, 1 there and 0 at the ends."""
        gap = np.abs(self.u - self.u[i]) / width
        return np.where(gap < 1.0, (1.0 + np.cos(np.pi * np.minimum(gap, 1.0))) / 2.0, 0.0)

    def shifted(self, shift: Array, weights: Array | float = 1.0) -> Array:
        """The path moved by a vector (3,) times weights (N,)."""
        rows = self.rows.copy()
        rows[:, :3] += np.multiply.outer(np.broadcast_to(weights, self.n), shift)
        return rows

    def faster(self, factor: float, part: Array | None = None) -> Array:
        """The path with other speeds."""
        rows = self.rows.copy()
        rows[slice(None) if part is None else part, 3] *= factor
        return rows

    def disturbed(self, rows: Array, limits: float = 0.0) -> Array:
        """The same edit as somebody else would hand it in: resampled, with a wait, moved a little by limits [m]."""
        rng = self.rng
        if limits and rng.random() < 0.4:
            wave = np.sin(np.linspace(0.0, rng.uniform(2.0, 9.0), len(rows)) + rng.uniform(0.0, 6.0))
            rows = rows + np.outer(wave, np.append(unit(rng.normal(size=3)) * rng.uniform(0.0, limits), 0.0))
        if rng.random() < 0.25:
            at = int(rng.integers(1, len(rows) - 1))
            rows = np.insert(rows, at + 1, np.repeat(rows[at : at + 1] * [1, 1, 1, 0], 5, axis=0), axis=0)
        elif rng.random() < 0.25:
            count = int(len(rows) * rng.uniform(0.7, 1.6))
            rows = interpolate(rows, source_indices(rows[:, :3], count, "arc_length"))
        return rows


def unit(vector: Array) -> Array:
    """A vector of length 1."""
    return np.asarray(vector / max(float(np.linalg.norm(vector)), 1e-9))


def headed(path: Array, i: int) -> Array:
    """The direction of a path (N, 3) at waypoint i."""
    return unit(path[min(i + 1, len(path) - 1)] - path[max(i - 1, 0)])


def expect(kind: str, *args: Any, **kwargs: Any) -> Any:
    """A promise of that kind."""
    return CATALOGUE[f"expect_{kind}"](*args, **kwargs)


def approach(sign: float) -> Callable[[Draw, bool], Case]:
    """Closer (-1) or farther (1)."""
    kind = "farther" if sign > 0 else "closer"

    def draw(d: Draw, right: bool) -> Case:
        towards, rng = unit(d.place - d.rows[d.i, :3]), d.rng
        most = 0.6 * d.nearest if sign < 0 else d.nearest
        amount = float(rng.uniform(0.4, 1.0) * most)
        by = amount if rng.random() < 0.5 else None
        where = d.part(d.i) if rng.random() < 0.3 else None
        promise = expect(kind, d.target, by, where=where)
        # Away from the object the whole path goes, toward it the nearest stretch is enough.
        weights = d.bump(d.i) if sign < 0 else 1.0
        way = -sign * towards
        if right:
            rows = d.shifted(way * amount * rng.uniform(1.0, 1.2), weights)
            if sign < 0 and rng.random() < 0.4:
                far = 1.0 - np.clip(2.5 * d.bump(d.i), 0.0, 1.0)
                rows[:, :3] += np.outer(far, -towards * amount)  # farther on average, and yet closer
            if sign > 0:
                short = d.nearest + amount * 1.02 - closest_to_point(rows[:, :3], d.place)[0]
                while short > 0.0:  # other parts of a bent path may now be the nearest
                    rows[:, :3] = d.place + (rows[:, :3] - d.place) * (1.0 + short / d.nearest)
                    short = d.nearest + amount * 1.02 - closest_to_point(rows[:, :3], d.place)[0]
            return promise, d.rows, d.disturbed(rows, 0.005), d.scene
        how = rng.choice(["back", "none", "half" if by else "back", "speed"])
        if how in ("none", "speed"):
            return promise, d.rows, d.disturbed(d.faster(0.7 if how == "speed" else 1.0)), d.scene
        if how == "half":
            return promise, d.rows, d.disturbed(d.shifted(way * min(0.5 * amount, amount - 0.03), d.bump(d.i))), d.scene
        if sign < 0:
            return promise, d.rows, d.disturbed(away(d, amount)), d.scene
        return promise, d.rows, d.disturbed(d.shifted(-way * min(amount, 0.6 * d.nearest), d.bump(d.i))), d.scene

    return draw


def away(d: Draw, amount: float) -> Array:
    """The path blown up about the target until it is that much farther."""
    rows = d.rows.copy()
    rows[:, :3] = d.place + (rows[:, :3] - d.place) * (1.0 + amount / d.nearest)
    return rows


def distance(d: Draw, right: bool) -> Case:
    """At least from the surface, or at most from the centre."""
    rng = d.rng
    radius = d.target.radius if d.target.dimensions is not None else 0.0
    if rng.random() < 0.25:
        asked = float(d.nearest * rng.uniform(0.3, 0.9) + 0.02)
        point = d.place.tolist()
        by = d.nearest - asked * (rng.uniform(0.95, 1.05) if right else rng.choice([0.6, 1.0 / 0.6]))
        by -= 0.0 if right else np.sign(d.nearest - by - asked) * 0.02
        rows = d.shifted(unit(d.place - closest(d)) * by, d.bump(d.i))
        got = closest_to_point(rows[:, :3], d.place)[0]
        if right != (abs(got - asked) < 0.01 + 0.09 * asked):
            rows = d.shifted(np.zeros(3)) if not right else rows
            asked = got if right else 2.0 * d.nearest + 0.05
        return expect("distance", point, nearest=asked), d.rows, rows, d.scene
    if rng.random() < 0.7:
        asked = float(d.nearest * rng.uniform(0.9, 1.4))
        promise = expect("distance", d.target, asked)
        rows = d.rows.copy()
        off = rows[:, :3] - d.place
        length = np.linalg.norm(off, axis=1, keepdims=True)
        if right:
            sphere = (asked + radius) * 1.03
            rows[:, :3] = d.place + off * np.maximum(sphere / length, 1.0)
            fine = interpolate(rows, source_indices(rows[:, :3], 600, "index"))
            rows = fine[:: max(600 // d.n, 1)] if rng.random() < 0.3 else fine
            if closest_to_point(rows[:, :3], d.place)[0] < asked + radius:
                rows = fine
        else:
            body = d.target.cuboid if d.target.dimensions is not None else None
            gap = body.closest(rows[:, :3])[0] if body else d.nearest
            promise = expect("distance", d.target, float(max(gap * rng.uniform(1.1, 2.0), 0.0) + 0.01))
        return promise, d.rows, d.disturbed(rows), d.scene
    most = float(np.linalg.norm(d.rows[:, :3] - d.place, axis=1).max())
    asked = most * rng.uniform(0.4, 0.8)
    rows = d.rows.copy()
    factor = asked / most if right else rng.uniform(1.2 * asked / most, 1.1)
    rows[:, :3] = d.place + (rows[:, :3] - d.place) * factor
    return expect("distance", d.target, at_most=asked), d.rows, d.disturbed(rows, 0.005 * right), d.scene


def moved(d: Draw, right: bool) -> Case:
    """An offset, everywhere or on a part."""
    rng = d.rng
    words = {w: float(rng.uniform(0.04, 0.3)) for w in rng.choice(["left", "front", "up"], rng.integers(1, 3), False)}
    shift = RFU.offset(**words)
    part = d.part() if rng.random() < 0.4 else None
    promise = expect("moved", **words, where=part)
    weights = np.ones(d.n) if part is None else part.astype(float)
    if right:
        how = rng.choice(["full", "ends", "blend"])
        if how == "ends" and part is None:
            weights = np.clip(np.minimum(d.u, 1.0 - d.u) / 0.2, 0.0, 1.0)
        if how == "blend" and part is not None:
            inside = np.flatnonzero(part)
            edge = np.minimum(inside - inside[0] + 1, inside[-1] + 1 - inside) / max(len(inside) / 4.0, 1.0)
            weights[inside] = np.clip(edge, 0.0, 1.0)
        return promise, d.rows, d.disturbed(d.shifted(shift * rng.uniform(0.96, 1.04), weights), 0.005), d.scene
    how = rng.choice(["none", "back", "half", "across", "elsewhere"])
    if how == "elsewhere" and part is not None and not part.all():
        return promise, d.rows, d.shifted(shift, ~part), d.scene
    across = np.roll(shift, 1) if len(words) == 1 else -shift
    change = {"none": 0.0 * shift, "back": -shift, "half": 0.5 * shift, "across": across}.get(how, 0.3 * shift)
    if how == "half":
        change = shift * min(0.5, 1.0 - 0.02 / min(words.values()))
    return promise, d.rows, d.disturbed(d.shifted(change, weights)), d.scene


def same_path(d: Draw, right: bool) -> Case:
    """Other speeds only."""
    part = d.part(d.i)
    if d.rng.random() < 0.3 and not part.all():
        promise, shift = expect("same_path", part), unit(d.rng.normal(size=3)) * (0.05 + 0.05 * d.size)
        return promise, d.rows, d.shifted(shift, ~part if right else d.bump(d.i)), d.scene
    if right:
        return expect("same_path"), d.rows, d.disturbed(d.faster(d.rng.uniform(0.3, 2.0)), 0.004), d.scene
    size = 0.03 + 0.03 * d.size
    if d.rng.random() < 0.3:
        return expect("same_path"), d.rows, d.disturbed(d.rows[: int(0.8 * d.n)]), d.scene
    return expect("same_path"), d.rows, d.disturbed(d.shifted(unit(d.rng.normal(size=3)) * size, d.bump(d.i))), d.scene


def end(kind: str) -> Callable[[Draw, bool], Case]:
    """The start or the goal, at an object, moved, or kept."""

    def draw(d: Draw, right: bool) -> Case:
        rng, row = d.rng, 0 if kind == "start" else -1
        fade = np.clip(1.0 - (d.u if row == 0 else 1.0 - d.u) / 0.5, 0.0, 1.0) ** 2
        words = {str(rng.choice(DIRECTIONS)): float(rng.uniform(0.06, 0.3))}
        how = rng.choice(["object", "offset", "stay"])
        promise = {
            "object": lambda: expect(kind, d.target),
            "offset": lambda: expect(kind, **words),
            "stay": lambda: expect(kind),
        }[str(how)]()
        goal = {"object": d.place - d.rows[row, :3], "offset": RFU.offset(**words), "stay": np.zeros(3)}[str(how)]
        if right:
            off = unit(rng.normal(size=3)) * rng.uniform(0.0, 0.014)
            rows = d.shifted(goal + off, fade)
            if how == "stay":
                rows[:, :3] += np.outer(d.bump(d.n // 2, 0.4), RFU.offset(**words))
            return promise, d.rows, d.disturbed(rows), d.scene
        miss = unit(rng.normal(size=3)) * max(0.05, 0.4 * float(np.linalg.norm(goal)))
        choice = rng.choice(["miss", "none" if how != "stay" else "miss", "other end" if how != "stay" else "miss"])
        if choice == "other end":
            return promise, d.rows, d.shifted(goal, fade[::-1]), d.scene
        return promise, d.rows, d.disturbed(d.shifted(goal + miss if choice == "miss" else 0.0 * goal, fade)), d.scene

    return draw


def visits(d: Draw, right: bool) -> Case:
    """The path comes by."""
    within = float(d.rng.uniform(0.02, 0.5) * d.nearest)
    off = d.rng.uniform(0.0, 0.95) * within if right else min(1.3 * within + 0.02, d.nearest)
    way = unit(d.place - closest(d)) * (d.nearest - off)
    rows = d.shifted(way, d.bump(d.i))
    if right and closest_to_point(rows[:, :3], d.place)[0] > within:
        rows[d.i, :3] = d.place
    if not right and closest_to_point(rows[:, :3], d.place)[0] < 1.2 * within + 0.015:
        rows = d.rows.copy()
        within = min(within, 0.7 * d.nearest)
    if d.rng.random() < 0.4:  # a place beside an object, or above it
        offset = RFU.words(d.rng.normal(size=3) * 0.1)
        other = SceneObject("post", d.place - RFU.offset(**offset))
        scene = Scene((other,))
        return expect("visits", other, within, **offset), d.rows, d.disturbed(rows) if not right else rows, scene
    return expect("visits", d.target, within), d.rows, d.disturbed(rows) if not right else rows, d.scene


def closest(d: Draw) -> Array:
    """The point of the path nearest to the target."""
    return interpolate(d.rows[:, :3], np.array([closest_to_point(d.rows[:, :3], d.place)[1]]))[0]


def pace(sign: float) -> Callable[[Draw, bool], Case]:
    """Faster (1) or slower (-1)."""

    def draw(d: Draw, right: bool) -> Case:
        part = d.part() if d.rng.random() < 0.5 else None
        promise = expect("faster" if sign > 0 else "slower", part)
        factor = float(d.rng.uniform(1.1, 2.0)) ** sign
        if right:
            return promise, d.rows, d.disturbed(d.faster(factor, part), 0.01), d.scene
        how = d.rng.choice(["back", "none", "shift", "elsewhere"])
        if how == "elsewhere" and part is not None and not part.all():
            return promise, d.rows, d.faster(factor, ~part), d.scene
        rows = d.faster(1.0 / factor, part) if how == "back" else d.rows
        return promise, d.rows, d.shifted(np.array([0.0, 0.1, 0.0])) if how == "shift" else rows, d.scene

    return draw


def speed(d: Draw, right: bool) -> Case:
    """So many metres a second."""
    asked = float(d.rng.uniform(0.08, 0.8))
    part = d.part() if d.rng.random() < 0.4 else None
    rows = d.rows.copy()
    chosen = np.ones(d.n, dtype=bool) if part is None else part
    off = d.rng.uniform(0.95, 1.05) if right else d.rng.choice([0.7, 1.35]) + d.rng.uniform(-0.05, 0.05)
    rows[chosen, 3] = asked * off + (0.02 * np.sign(off - 1.0) if not right else 0.0)
    if right and part is None and d.rng.random() < 0.4:
        rows[:, 3] *= np.sqrt(np.clip(np.minimum(d.u, 1.0 - d.u) / 0.2, 0.0, 1.0))  # from rest and back to rest
    return expect("speed", asked, part), d.rows, rows, d.scene


def stop(d: Draw, right: bool) -> Case:
    """At an object, or at the end."""
    rows, at_end = d.rows.copy(), d.rng.random() < 0.3
    rows[:, 3] = np.maximum(rows[:, 3], 0.05)
    i = d.n - 1 if at_end else d.i
    if not right:
        rows[-1, 3] = 0.05
        far = np.flatnonzero(np.abs(arc_length(rows[:, :3]) - arc_length(rows[:, :3])[i]) > 0.3 * d.size)
        reach = np.linalg.norm(rows[far, :3] - d.place, axis=1) > d.nearest + 0.06 + 2.0 * d.size / d.n
        far = far[reach & (far < d.n - 1)]
        if len(far) and d.rng.random() < 0.6:
            rows[d.rng.choice(far), 3] = 0.0
    else:
        s = arc_length(rows[:, :3])
        rows[:, 3] *= np.sqrt(np.clip(np.abs(s - s[i]) / (0.15 * d.size), 0.0, 1.0))
        if not at_end and d.rng.random() < 0.5:
            rows = rows[: i + 1]
        elif d.rng.random() < 0.5:
            rows = np.insert(rows, i + 1, np.repeat(rows[i : i + 1], 6, axis=0), axis=0)
            if not at_end and d.rng.random() < 0.3:  # led on beyond its goal, and nearer by the place
                rows = np.vstack([rows, [*(0.7 * d.place + 0.3 * rows[i, :3]), 0.2], rows[0]])
    return expect("stop") if at_end else expect("stop", d.target), d.rows, rows, d.scene


def same_speed(d: Draw, right: bool) -> Case:
    """Another path, passed as fast as before."""
    part = d.part() if d.rng.random() < 0.5 else None
    promise = expect("same_speed", part)
    if right:
        elsewhere = d.faster(1.5, ~part) if part is not None else d.rows
        elsewhere[:, :3] += np.outer(d.bump(d.i), unit(d.rng.normal(size=3)) * 0.1)
        return promise, d.rows, elsewhere, d.scene
    factor = float(d.rng.uniform(1.12, 2.0)) ** d.rng.choice([-1.0, 1.0])
    return promise, d.rows, d.disturbed(d.faster(factor, part)), d.scene


def side(d: Draw, right: bool) -> Case:
    """On one side of the origin or of an object, all along, on a part, or where the path passes it."""
    rng, word = d.rng, str(d.rng.choice(DIRECTIONS))
    axis = RFU.offset(**{word: 1.0})
    of = d.target if rng.random() < 0.6 else None
    centre = d.place if of is not None else np.zeros(3)
    box = d.target.dimensions
    half = float(np.abs(axis) @ box) / 2.0 if of is not None and box is not None else 0.0
    how = str(rng.choice(["at_least", "at_most", "over"] if of is not None else ["at_least", "at_most", "exact"]))
    amount, slack = float(rng.uniform(0.0, 0.3) * d.size), 0.02 + 0.03 * d.size
    rows = d.rows.copy()
    along = (rows[:, :3] - centre) @ axis
    if how == "over":
        # Somewhere it passes the centre within the radius aside; there it lies high enough, elsewhere anywhere.
        radius = float(rng.uniform(0.03, 0.15) * d.size)
        aside = (centre - rows[d.i, :3]) - ((centre - rows[d.i, :3]) @ axis) * axis
        rows[:, :3] += np.outer(d.bump(d.i, 0.4), aside)
        near = d.bump(d.i, 0.05) > 0.0
        off = (rows[:, :3] - centre) - np.outer((rows[:, :3] - centre) @ axis, axis)
        near |= np.linalg.norm(off, axis=1) <= 1.5 * radius + 2.0 * d.size / d.n
        height = half + amount if right else half + amount - slack
        rows[near, :3] += np.outer(height - (rows[near, :3] - centre) @ axis, axis)
        return expect("side", word, amount, of=of, within=radius), d.rows, rows, d.scene
    part = d.part() if rng.random() < 0.4 else None
    chosen = np.ones(d.n, dtype=bool) if part is None else part
    if how == "exact":
        wanted = np.full(d.n, amount) if right else along + np.sign(along - amount) * slack
        off = 0.9 * slack * np.sign(rng.normal()) if right else 0.0
        rows[chosen, :3] += np.outer((wanted - along)[chosen], axis)
        rows[:, :3] += off * 0.2 * axis if slack * 0.18 < 0.01 else 0.0
        return expect("side", word, amount, amount, where=part), d.rows, rows, d.scene
    inner = np.flatnonzero(chosen)
    if how == "at_least":
        limit = half + amount
        wanted = np.maximum(along, limit) if right else along
        wanted[inner] += 0.0 if right else min(limit - slack - along[inner].min(), 0.0)
    else:
        limit = amount
        wanted = np.minimum(along, limit) if right else along
        wanted[inner] += 0.0 if right else max(limit + slack - along[inner].max(), 0.0)
    rows[chosen, :3] += np.outer((wanted - (rows[:, :3] - centre) @ axis)[chosen], axis)
    return expect("side", word, **{how: amount}, of=of, where=part), d.rows, rows, d.scene


def speed_bound(d: Draw, right: bool) -> Case:
    """Never faster or never slower than so many metres a second."""
    rows, most = d.rows.copy(), bool(d.rng.random() < 0.5)
    part = d.part() if d.rng.random() < 0.4 else None
    chosen = np.ones(d.n, dtype=bool) if part is None else part
    speeds = rows[chosen, 3]
    asked = float(np.median(speeds) * d.rng.uniform(0.6, 1.4))
    promise = expect("speed", where=part, **{"at_most" if most else "at_least": asked})
    if right:
        rows[chosen, 3] = np.minimum(speeds, asked) if most else np.maximum(speeds, asked)
        if not most and d.rng.random() < 0.5:  # with a stop, braked for and left again
            s = arc_length(rows[:, :3])
            rows[:, 3] *= np.sqrt(np.clip(np.abs(s - s[d.i]) / (0.15 * d.size), 0.0, 1.0))
        return promise, d.rows, rows, d.scene
    k = int(d.rng.choice(np.flatnonzero(chosen)))
    rows[k, 3] = asked * 1.2 + 0.01 if most else max(asked * 0.8 - 0.01, 0.01)
    return promise, d.rows, rows, d.scene


def length(d: Draw, right: bool) -> Case:
    """So many times as long, or longer or shorter."""
    how, rows = str(d.rng.choice(["times", "longer_by", "shorter_by"])), d.rows.copy()
    middle, steps = rows[:, :3].mean(axis=0), np.diff(rows[:, :3], axis=0)
    old = float(np.sqrt((steps**2).sum(axis=1)).sum())
    if how == "times":
        asked = float(d.rng.uniform(1.2, 2.5)) ** d.rng.choice([-1.0, 1.0])
        made = asked * d.rng.uniform(0.93, 1.07) if right else float(d.rng.choice([1.0, 1.0 / asked, asked**0.4]))
        rows[:, :3] = middle + made * (rows[:, :3] - middle)
        return expect("length", times=asked), d.rows, rows, d.scene
    amount = float(d.rng.choice([0.0, d.rng.uniform(0.1, 0.5) * old]))
    sign = 1.0 if how == "longer_by" else -1.0
    if right:
        made = max(amount, 0.05 * old) * d.rng.uniform(0.95, 1.5)
    else:
        made = float(d.rng.choice([0.0, -max(amount, 0.05 * old), 0.5 * amount if amount > 0.05 else 0.0]))
    rows[:, :3] = middle + max(1.0 + sign * made / old, 0.1) * (rows[:, :3] - middle)
    return expect("length", **{how: amount}), d.rows, d.disturbed(rows, 0.0) if not right else rows, d.scene


def smoother(d: Draw, right: bool) -> Case:
    """Less jitter, on the whole path or on a part."""
    rng, rough = d.rng, d.rows.copy()
    rough[1:-1, :3] += rng.normal(0.0, rng.uniform(0.15, 0.6) * d.size / d.n, (d.n - 2, 3))
    part = d.part() if rng.random() < 0.3 else None
    chosen = np.ones(d.n, dtype=bool) if part is None else part
    promise = expect("smoother", part)

    def averaged(times: int, rows: Array) -> Array:
        rows = rows.copy()
        for _ in range(times):
            rows[1:-1, :3] = (rows[:-2, :3] + 2.0 * rows[1:-1, :3] + rows[2:, :3]) / 4.0
        return rows

    if right:
        calm = d.rows if rng.random() < 0.3 else averaged(int(rng.integers(1, 12)), rough)
        rows = np.where(chosen[:, None], calm, rough)
        return promise, rough, rows if part is not None else d.disturbed(rows), d.scene
    how = str(rng.choice(["none", "rougher", "shift", "elsewhere", "kink"]))
    if how == "elsewhere" and part is not None and not part.all():
        away = np.convolve(part, np.ones(5), "same") < 0.5
        return promise, rough, np.where(away[:, None], averaged(6, rough), rough), d.scene
    rows = rough.copy()
    if how == "rougher":
        rows[1:-1, :3] += rng.normal(0.0, 0.5 * d.size / d.n, (d.n - 2, 3))
    elif how == "shift":
        rows[:, :3] += rng.normal(0.0, 0.1 * d.size, 3)
    elif how == "kink":  # calm but for one sharp corner that was not there
        rows = averaged(8, rough)
        i = int(rng.choice(np.flatnonzero(chosen[1:-1]))) + 1
        rows[i, :3] -= 6.0 * d.size / d.n * headed(rows[:, :3], i)
    return promise, rough, rows, d.scene


def waypoints(d: Draw, right: bool) -> Case:
    """So many waypoints."""
    asked = int(d.rng.choice([d.n // 2, 2 * d.n, d.rng.integers(2, 300)]))
    off = 0 if right else int(d.rng.choice([-1, 1, d.n - asked or 1]))
    count = max(asked + off, 2) if right or asked + off >= 2 else asked + 1
    rows = interpolate(d.rows, source_indices(d.rows[:, :3], count, "arc_length"))
    return expect("waypoints", asked), d.rows, rows, d.scene


def acceleration(d: Draw, right: bool) -> Case:
    """Faster or slower by so many metres a second in each second."""
    rows, s = d.rows.copy(), arc_length(d.rows[:, :3])
    rows[:, 3] = float(d.rng.uniform(0.1, 0.6))
    old = rows.copy()
    part = d.part() if d.rng.random() < 0.4 else None
    chosen = np.ones(d.n, dtype=bool) if part is None else part
    rate = float(d.rng.uniform(0.03, 0.6)) * float(d.rng.choice([-1.0, 1.0]))
    reach = float(np.ptp(s[chosen]))
    rate = max(rate, -0.9 * rows[0, 3] ** 2 / (2.0 * reach)) if d.rng.random() < 0.7 else rate
    rate = rate if abs(rate) > 0.02 else 0.03
    promise = expect("acceleration", rate, part)

    def law(by: float, where: Array) -> Array:
        made, first = rows.copy(), np.flatnonzero(where)[0]
        squared = rows[first, 3] ** 2 + 2.0 * by * (s - s[first])
        made[where, 3] = np.sqrt(np.maximum(squared[where], 0.0))
        return made

    if right:
        made = law(rate * d.rng.uniform(0.96, 1.04), chosen)
        return promise, old, d.disturbed(made) if part is None else made, d.scene
    how = str(d.rng.choice(["none", "back", "half", "elsewhere", "all at once"]))
    if how == "elsewhere" and part is not None and not part.all():
        return promise, old, law(rate, ~part), d.scene
    if how == "all at once":
        rows[chosen, 3] *= 1.3 if rate > 0 else 0.7
        return promise, old, rows, d.scene
    by = {"back": -rate, "half": 0.5 * rate}.get(how, 0.0)
    return promise, old, law(by, chosen) if by and abs(by - rate) > 0.012 else rows, d.scene


KINDS: dict[str, Callable[[Draw, bool], Case]] = {
    "closer": approach(-1.0),
    "farther": approach(1.0),
    "distance": distance,
    "moved": moved,
    "same_path": same_path,
    "same_speed": same_speed,
    "side": side,
    "start": end("start"),
    "goal": end("goal"),
    "visits": visits,
    "slower": pace(-1.0),
    "faster": pace(1.0),
    "speed": speed,
    "speed at_most/at_least": speed_bound,
    "stop": stop,
    "length": length,
    "smoother": smoother,
    "waypoints": waypoints,
    "acceleration": acceleration,
}


def falsely(kind: str, count: int, right: bool, first: int = 0) -> list[str]:
    """What was measured of the edits of a kind that were judged falsely."""
    found = []
    for seed in range(first, first + count):
        case = KINDS[kind](Draw(np.random.default_rng([seed, right])), right)
        outcome = judge(*case)
        if outcome.held != right:
            found.append(f"seed {seed}: {case[0].text}: {outcome.sentence}")
    return found


def table(count: int = COUNT, first: int = 0) -> str:
    """The rates by kind, as Markdown."""
    lines = ["| promise | right edits flagged | wrong edits passed |", "|---|---|---|"]
    sums = np.zeros(2, dtype=int)
    for kind in KINDS:
        counts = [len(falsely(kind, count, right, first)) for right in (True, False)]
        sums += counts
        lines.append(f"| `expect_{kind}` | {counts[0]} of {count} | {counts[1]} of {count} |")
    whole = count * len(KINDS)
    return "\n".join([*lines, f"| all | {sums[0] / whole:.2%} | {sums[1] / whole:.2%} |"])


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--count", type=int, default=COUNT)
    parser.add_argument("--first", type=int, default=0, help="first seed; another one makes other edits")
    parser.add_argument("--show", choices=tuple(KINDS))
    parser.add_argument("--write", action="store_true", help="put the table into docs/trust.md")
    options = parser.parse_args()
    if options.show:
        for right in (True, False):
            print(
                "right, flagged:" if right else "wrong, passed:",
                *falsely(options.show, options.count, right, options.first),
                sep="\n  ",
            )
        return
    text = table(options.count, options.first)
    print(text)
    if options.write:
        page = PAGE.read_text(encoding="utf-8")
        before, _, rest = page.partition(BEGIN)
        PAGE.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{rest.partition(END)[2]}", encoding="utf-8")


if __name__ == "__main__":
    main()
