"""What the LaTTe-style model learns from: LaTTe's grammar with its labels, and verified samples in many voices.

Both come as `Samples`: arrays in the box in which the network sees a path (`ovita.baselines.latte.Seen`), with the
places of sentences and objects' names in lists of unique texts, so that each text is embedded once.
"""

from __future__ import annotations

import hashlib
import sys
from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, fields
from itertools import chain, islice
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from ovita.augment import formats
from ovita.baselines.latte import OBJECTS, WAYPOINTS, PathBox, Seen, seen
from ovita.bench.expected import expected
from ovita.bench.generate import SETTINGS, random_scene
from ovita.instruct import frames as F
from ovita.instruct.notation import show
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory

sys.path.insert(0, str(Path(__file__).parent / "corpus"))
from augment import NOUNS
from check import Example
from realised import carried_out, sentences


@dataclass(frozen=True)
class Samples:
    """Samples with what should come out.

    Args:
        path, objects, present, scale: As in `Seen`, but locality, half extent and pace as they are.
        change: What is added to the path (N, 40, 4).
        text: The place of each sentence in `texts` (N,).
        names: The place of each object's name in `texts` (N, 6); 0 where there is none.
        texts: Unique texts.
    """

    path: Any
    objects: Any
    present: Any
    scale: Any
    change: Any
    text: Any
    names: Any
    texts: Any

    def __len__(self) -> int:
        return len(self.text)

    def of(self, rows: Any) -> Samples:
        """Some of the samples."""
        arrays = {f.name: getattr(self, f.name) for f in fields(self)}
        return Samples(**{name: a if name == "texts" else a[rows] for name, a in arrays.items()})

    def save(self, to: Path) -> None:
        """As an .npz file."""
        np.savez_compressed(to, **{f.name: np.asarray(getattr(self, f.name)) for f in fields(self)})

    @classmethod
    def load(cls, path: Path) -> Samples:
        """From an .npz file."""
        with np.load(path) as saved:
            return cls(**{f.name: saved[f.name] for f in fields(cls)})

    def digest(self) -> str:
        """The first digits of the SHA-256 of all arrays."""
        joined = hashlib.sha256()
        for part in fields(self):
            joined.update(np.ascontiguousarray(getattr(self, part.name)).tobytes())
        return joined.hexdigest()[:16]


class Texts:
    """Unique texts in the order in which they came."""

    def __init__(self) -> None:
        self.place: dict[str, int] = {"": 0}

    def of(self, text: str) -> int:
        """The place of a text."""
        return self.place.setdefault(text, len(self.place))


# (a) LaTTe's grammar and labels, from the paper and from what its public repository describes

MANNER = {"a bit": 0.7, "a little": 0.7, "": 1.0, "much": 1.5, "a lot": 1.5, "very": 1.5}
SIDES = {
    "left": (-1, 0, 0), "right": (1, 0, 0), "front": (0, 1, 0), "back": (0, -1, 0), "top": (0, 0, 1),
    "upper part": (0, 0, 1), "bottom": (0, 0, -1), "bottom part": (0, 0, -1),
}  # fmt: skip
PULL, SPRING, BEND, PUSH = 0.05, 0.1, 0.5, 0.02
"""Weights of the pull to the original, of the springs between neighbours, of the curvature, and of the outer force."""

GAIN = 0.1
"""Factor on the outer force with which Cartesian labels have the mean size of the authors' own, 0.04 of their box."""

SPEED = 0.15
"""Change of the speed at an object's centre."""

HALF = 0.3
"""Half of the box in which LaTTe's scenes lie."""


def commands() -> list[tuple[str, str, Any, float]]:
    """LaTTe's commands as (text, kind, sense, weight); "{}" stands for the object.

    Its commands for the speed without an object have labels that do not depend on the sense; here they do.
    """
    found: list[tuple[str, str, Any, float]] = []
    for manner, weight in MANNER.items():
        for sign, way in ((1, "closer to"), (-1, "further away from")):
            found += [(f"{verb} {manner} {way} the {{}}", "distance", sign, weight)
                      for verb in ("stay", "pass", "walk", "drive")]  # fmt: skip
        for sign, how, change in ((1, "faster", "increase"), (-1, "slower", "reduce")):
            says = [f"{verb} {manner} {how}" for verb in ("walk", "drive", "go")] + [f"{change} the speed {manner}"]
            places = [f"{when} passing {near} the {{}}" for when in ("when", "while")
                      for near in ("close to", "next to", "near", "nearby")]  # fmt: skip
            places += ["in the surrounding of the {}", "in the proximity of the {}", ""]
            found += [(f"{said} {place}", "speed", sign, weight) for said in says for place in places]
    found += [("keep a smaller distance from the {}", "distance", 1, 1.0)]
    found += [("keep a bigger distance from the {}", "distance", -1, 1.0)]
    for side, way in SIDES.items():
        found += [(f"{verb} {side}", "cartesian", way, 1.0) for verb in ("", "stay on the", "go to the")]
    found += [(f"{verb} down", "cartesian", (0, 0, -1), 1.0) for verb in ("go", "stay")]
    return [(" ".join(text.split()), kind, sense, weight) for text, kind, sense, weight in found]


def walks(rng: np.random.Generator, n: int) -> Any:
    """Random walks of unit steps along the axes, splined through 3 to 15 knots to 40 waypoints (n, 40, 4)."""
    found = np.zeros((n, WAYPOINTS, 4))
    knots = rng.integers(3, 16, size=n)
    for m in np.unique(knots):
        rows = np.flatnonzero(knots == m)
        axes, signs = rng.integers(0, 3, (len(rows), 100)), rng.choice([-1.0, 1.0], (len(rows), 100))
        pace = rng.choice([-1.0, 1.0], (len(rows), 100, 1))
        steps = np.concatenate([np.eye(3)[axes] * signs[..., None], pace], axis=-1)
        ends = rng.integers(50, 101, size=len(rows))
        at = np.round(np.linspace(0, 1, m)[None] * (ends[:, None] - 1)).astype(int)
        through = np.take_along_axis(np.cumsum(steps, axis=1), at[..., None], axis=1)
        found[rows] = CubicSpline(np.linspace(0, 1, m), through, axis=1)(np.linspace(0, 1, WAYPOINTS))
    return found


def _fitted(rows: Any, rng: np.random.Generator) -> tuple[Any, Any]:
    """Walks and up to six objects in LaTTe's box, positions on one scale, speeds between 0 and 0.6."""
    n = len(rows)
    low, high = rows[..., :3].min(axis=1, keepdims=True), rows[..., :3].max(axis=1, keepdims=True)
    scale = np.maximum((high - low).max(axis=-1, keepdims=True), 1e-6) / (2 * HALF)
    places = (rows[..., :3] - (low + high) / 2) / scale
    speed = rows[..., 3]
    speed = (speed - speed.min(axis=1, keepdims=True)) / np.maximum(np.ptp(speed, axis=1, keepdims=True), 1e-6)
    speed = np.clip(0.05 + 0.55 * speed, 0.0, 0.6)
    return np.concatenate([places, speed[..., None]], axis=-1), rng.uniform(-HALF, HALF, size=(n, OBJECTS, 3))


def _labels(path: Any, target: Any, kind: Any, sense: Any, weight: Any, locality: Any) -> Any:
    """LaTTe's changes (n, 40, 4) of paths: the rest position of its forces, the start fixed, the end free.

    The authors take 1,000 small steps of these forces; here their rest position is computed at once, in two rounds, as
    the force of a distance depends on where the path is.
    """
    one = np.eye(WAYPOINTS)
    first, second = np.diff(one, axis=0), np.diff(one, n=2, axis=0)
    stiff = PULL * one + SPRING * first.T @ first + BEND * second.T @ second
    give = np.zeros_like(stiff)
    give[1:, 1:] = np.linalg.inv(stiff[1:, 1:])
    shift = np.zeros_like(path[..., :3])
    for _ in range(2):
        to = target[:, None] - (path[..., :3] + shift)
        d = np.linalg.norm(to, axis=-1, keepdims=True)
        pulled = sense[:, None, :1] * to / np.maximum(d, 1e-6) * ((d > 0.05) & (d < locality[:, None, None]))
        force = np.where((kind == "distance")[:, None, None], pulled, sense[:, None, :])
        force = np.where((kind == "speed")[:, None, None], 0.0, force) * weight[:, None, None]
        shift = give @ (PUSH * GAIN * force)
    near = np.clip(1.0 - d[..., 0] / locality[:, None], 0.0, 1.0)
    near = np.where(np.isnan(target[:, :1]), 1.0, near)
    change = SPEED * weight[:, None] * sense[:, :1] * near
    change = np.where((kind == "speed")[:, None], np.maximum(change, -path[..., 3]), 0.0)
    return np.concatenate([np.nan_to_num(shift), change[..., None]], axis=-1)


def grammar(n: int, seed: int, pool: int = 10_000) -> Samples:
    """Samples of LaTTe's grammar: changes drawn evenly among distance, speed and Cartesian ones."""
    rng = np.random.default_rng([seed, 17])
    pool = min(pool, n)
    by_kind: dict[str, list[Any]] = defaultdict(list)
    for command in commands():
        by_kind[command[1]].append(command)
    kinds = sorted(by_kind)
    drawn = [by_kind[kinds[i % 3]][rng.integers(len(by_kind[kinds[i % 3]]))] for i in range(pool)]
    meant = rng.choice(NOUNS, size=pool)
    path, places = _fitted(walks(rng, n), rng)
    which = rng.permutation(np.arange(n) % pool)
    count, slot = rng.integers(2, OBJECTS + 1, size=n), rng.integers(0, OBJECTS, size=n)
    slot %= count
    texts = Texts()
    names = np.array([[texts.of(str(x)) for x in rng.choice(NOUNS, OBJECTS, replace=False)] for _ in range(n)])
    text = np.array([texts.of(drawn[i][0].format(name)) for i, name in enumerate(meant)])[which]
    for i in range(n):  # the object that is meant, once
        name = texts.of(str(meant[which[i]]))
        names[i][names[i] == name] = names[i, slot[i]]
        names[i, slot[i]] = name
    present = np.arange(OBJECTS)[None] < count[:, None]
    kind = np.array([drawn[i][1] for i in which])
    sense = np.array([np.resize(np.array(drawn[i][2], dtype=float), 3) for i in which])
    target = places[np.arange(n), slot].copy()
    target[np.array(["{}" not in drawn[i][0] for i in which])] = np.nan
    locality = rng.uniform(0.3, 0.9, size=n)
    weight = np.array([drawn[i][3] for i in which])
    change = _labels(path, target, kind, sense, weight, locality)
    pace = path[..., 3].mean(axis=1)
    path[..., 3] /= pace[:, None]
    change[..., 3] /= pace[:, None]
    path[..., :3], change[..., :3], places = path[..., :3] / HALF, change[..., :3] / HALF, places / HALF
    scale = np.column_stack([locality, np.full(n, np.log10(HALF)), np.log10(pace)])
    f = np.float32
    return Samples(path.astype(f), places.astype(f), present, scale.astype(f), change.astype(f), text,
                   np.where(present, names, 0), np.array(list(texts.place)))  # fmt: skip


# (b) verified samples in the wording of many voices


@dataclass(frozen=True)
class Wording:
    """How a voice says some frames: the sentence, the objects' names in the order of the frames, and other names."""

    sentence: str
    named: tuple[str, ...]
    others: tuple[str, ...]


def wordings(lines: Sequence[Example]) -> dict[str, list[tuple[Example, Wording]]]:
    """Lines of the corpus by what they mean, objects' names left out."""
    found: dict[str, list[tuple[Example, Wording]]] = defaultdict(list)
    for line in lines:
        named = tuple(dict.fromkeys(name for frame in line.frames for name in frame.named if name in line.objects))
        key = show(line.frames)
        for i, name in enumerate(sorted(named, key=len, reverse=True)):
            key = key.replace(name.replace(" ", "_"), f"<{named.index(name)}>" if i >= 0 else "")
        others = tuple(name for name in line.objects if name not in named)
        if len(named) <= OBJECTS:
            found[key].append((line, Wording(line.sentence, named, others)))
    return found


def scene_for(rng: np.random.Generator, line: Example, named: Sequence[str]) -> tuple[Trajectory, Scene] | None:
    """A random path and scene in which a line makes sense: of a scale that suits its lengths and speeds."""
    setting = SETTINGS[str(rng.choice(["tabletop", "tabletop", "drone", "ground", "arm"]))]
    path, scene = random_scene(rng, setting, "train")
    rest = [name for name in line.objects if name not in named]
    rng.shuffle(rest)
    names = [*named, *rest][: len(scene)]
    if not names or len(names) < len(named):
        return None
    stated = [(f, q) for f in line.frames for q in f.quantities.values()]
    lengths = [abs(q.value) for f, q in stated if q.unit == "m" and not isinstance(f, F.Height)]
    paces = [abs(q.value) for f, q in stated if q.unit == "m/s" and q.value]
    size = float(np.ptp(path.positions, axis=0).max())
    factor = rng.uniform(4.0, 10.0) * max(lengths) / size if lengths and max(lengths) > 0 else 1.0
    speed = rng.uniform(0.7, 2.0) * paces[0] / float(path.speeds.mean()) if paces else 1.0
    path = Trajectory(path.positions * factor, path.speeds * speed)
    items = [
        SceneObject(name, item.position * factor, None if item.dimensions is None else item.dimensions * factor)
        for name, item in zip(names, scene.objects, strict=False)
    ]
    return path, Scene(tuple(items[i] for i in rng.permutation(len(items))), scene.frame)


def verified(rng: np.random.Generator, line: Example, named: Sequence[str]) -> tuple[Seen, Any, Scene] | None:
    """A scene for a line and the change that does what it asks for; None if its check does not hold at 40 waypoints."""
    drawn = scene_for(rng, line, named)
    if drawn is None:
        return None
    path, scene = drawn
    _, adapted = carried_out(line.frames, path, scene)
    if adapted is None:
        return None
    old, new = (t.resample(WAYPOINTS, by="index") for t in (path, adapted))
    check = expected(line.frames, old, scene)
    if check.judge(old, old, scene).passed or not check.judge(old, new, scene).passed:
        return None
    found = changed(path, adapted, scene)
    return None if found is None else (*found, scene)


def changed(path: Trajectory, adapted: Trajectory, scene: Scene) -> tuple[Seen, Any] | None:
    """A path as the network sees it and its change to the adapted one; None if that is out of all proportion."""
    what = seen(path, scene)
    change = PathBox.of(path, scene).rows(adapted) - what.path[0]
    return (what, change) if np.isfinite(change).all() and np.abs(change).max() < 4.0 else None


def voices(n: int, seed: int, lines: Sequence[Example], most: int = 4) -> Iterator[dict[str, Any]]:
    """Verified samples in the wording of the corpus' training voices, at most so many wordings of one motion."""
    by_meaning = wordings(lines)
    keys = [key for key in sorted(by_meaning) for _ in by_meaning[key]]
    rng = np.random.default_rng([seed, 18])
    made = 0
    while made < n:
        said = by_meaning[keys[rng.integers(len(keys))]]
        line, wording = said[rng.integers(len(said))]
        try:
            found = verified(rng, line, wording.named)
        except (ValueError, IndexError, KeyError, ArithmeticError):
            continue
        if found is None:
            continue
        what, change, scene = found
        for k in rng.permutation(len(said))[:most]:
            other = said[k][1]
            new = dict(zip(wording.named, other.named, strict=True))
            spare = [name for name in other.others if name not in new.values()]
            rng.shuffle(spare)
            names = [new.get(item.name) or (spare.pop() if spare else item.name) for item in scene]
            made += 1
            yield {"what": what, "change": change, "text": other.sentence, "names": names}
            if made == n:
                return


def spoken(n: int, seed: int, lines: Sequence[Example]) -> Samples:
    """`voices` as arrays."""
    return gathered(voices(n, seed, lines))


def augmented(folder: Path, n: int, families: Collection[str] = ()) -> Samples:
    """The first n wordings of the training split of a dataset that `ovita augment` wrote.

    All samples come with their first wording before any comes with its second, so that many motions are among a few.
    """
    rounds: list[list[dict[str, Any]]] = []
    for sample in formats.read(folder):
        scene = sample.task.scene
        wanted = sample.split == "train" and (not families or sample.family in families) and len(scene) <= OBJECTS
        found = changed(sample.task.trajectory, sample.adapted, scene) if wanted else None
        if found is None:
            continue
        for k, text in enumerate((sample.instruction, *sample.paraphrases)):
            if k == len(rounds):
                rounds.append([])
            rounds[k].append({"what": found[0], "change": found[1], "text": text, "names": list(scene.names)})
        if rounds and len(rounds[0]) >= n:
            break
    return gathered(islice(chain.from_iterable(rounds), n))


def gathered(drawn: Iterable[dict[str, Any]]) -> Samples:
    """Samples as arrays."""
    texts, rows = Texts(), list(drawn)
    names = np.zeros((len(rows), OBJECTS), dtype=int)
    for i, row in enumerate(rows):
        names[i, : len(row["names"])] = [texts.of(name.lower()) for name in row["names"]]
    text = np.array([texts.of(row["text"]) for row in rows])
    parts = {name: np.concatenate([getattr(r["what"], name) for r in rows]) for name in ("path", "objects", "present")}
    scale = np.concatenate([row["what"].scale for row in rows])
    change = np.stack([row["change"] for row in rows]).astype(np.float32)
    return Samples(**parts, scale=scale, change=change, text=text, names=names, texts=np.array(list(texts.place)))


def corpus(held_out: bool) -> list[Example]:
    """The lines of the training voices that ask for something; every twentieth voice is kept for validation."""
    lines = list(sentences())
    kept = {voice for i, voice in enumerate(sorted({line.voice for line in lines})) if i % 20 == 7}
    return [line for line in lines if (line.voice in kept) == held_out]
