"""Grow the forest by which the referee decides, and show what its thresholds would do.

`python training/referee.py WEIGHTS.npz VOICE,VOICE,... [OUT.npz]` reads the voices named, which the network must not
have been trained on, prints what the referee would do with each voice by a forest that was grown on others, and writes
one that was grown on all. A reading is right if the policy made of it passes the check of what its writer meant.
Held-out voices are not read. Needs scikit-learn (the `train` extra).
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent / "corpus"))

from answers import passes
from check import Example, examples
from realised import setting

from ovita.errors import OvitaError
from ovita.instruct import referee
from ovita.instruct.chunks import Chunk, chunks
from ovita.instruct.encoder import Network
from ovita.instruct.forest import Forest
from ovita.instruct.frames import Reading, same
from ovita.instruct.learned import LearnedReader
from ovita.instruct.rules import read
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory
from ovita.request import Request
from ovita.writers.generate import reply_for

VOICES = Path(__file__).parent / "corpus" / "voices"
FOLDS = 9
RARE = 25
"""How often a value has to be other than 0 to count."""

GROWN = dict(
    max_iter=400, learning_rate=0.03, max_leaf_nodes=12, min_samples_leaf=15, l2_regularization=10.0, max_features=0.1,
    random_state=1,
)  # fmt: skip


@dataclass(frozen=True)
class Line:
    """A sentence of the corpus as the two readers read it.

    Args:
        example: What was said, and what its writer meant.
        said: In chunks.
        rules: What the rules read.
        learned: What the network reads.
        weighed: How likely the network holds both.
        candidates: The grounds of each reader's reading, and whether it is right; one that both share once.
    """

    example: Example
    said: Sequence[Chunk]
    rules: Reading
    learned: Reading
    weighed: dict[Any, Any]
    candidates: tuple[tuple[dict[str, float], bool], ...]


def lines(voices: Sequence[str], learned: LearnedReader) -> Iterator[Line]:
    """Every first request of some voices."""
    for voice in voices:
        for example in examples(VOICES / f"{voice}.txt"):
            if example.before is None and not example.problem:
                yield line(example, learned)


def line(example: Example, learned: LearnedReader) -> Line:
    """One sentence, read by both readers and judged."""
    path, scene = setting(example.frames, example.objects)
    said, _ = chunks(example.sentence, scene, path.positions)
    heard = learned.hear(example.sentence, scene, path.positions)
    one, other = read(example.sentence, scene, path.positions), learned.reading(heard)
    weighed: dict[Any, Any] = {"rules": heard.weigh(one.frames), "learned": heard.weigh(other.frames)}
    found: list[tuple[dict[str, float], bool]] = []
    readings: tuple[tuple[referee.Who, Reading], ...] = (("rules", one), ("learned", other))
    for by, reading in readings:
        if reading.frames and not (reading.question or reading.improper) and not (found and found[0][0]["agree"]):
            values = referee.grounds(said, by, one, other, weighed)
            found.append((values, right(example, reading, path, scene)))
    return Line(example, said, one, other, weighed, tuple(found))


def right(example: Example, reading: Reading, path: Trajectory, scene: Scene) -> bool:
    """Whether a reading is what the corpus says, or does the same."""
    if example.outcome != "do" or same(reading.frames, example.frames):
        return example.outcome == "do"
    try:
        reply = reply_for(reading.frames, Request(example.sentence, path, scene))
    except (OvitaError, ValueError, IndexError):
        return False
    return reply.kind == "policy" and passes(example, reply, path, scene)


def grown(found: Sequence[Line]) -> Forest:
    """The forest that tells right readings from wrong ones."""
    from sklearn.ensemble import HistGradientBoostingClassifier

    rows = [candidate for one in found for candidate in one.candidates]
    counts = Counter(name for values, _ in rows for name, value in values.items() if value)
    names = tuple(sorted(name for name, n in counts.items() if n >= RARE))
    x = np.array([[values.get(name, 0.0) for name in names] for values, _ in rows])
    model = HistGradientBoostingClassifier(**GROWN).fit(x, np.array([t for _, t in rows]))
    trees = [tree[0].nodes for tree in model._predictors]
    roots = np.cumsum([0, *(len(tree) for tree in trees[:-1])])
    nodes = np.concatenate(trees)
    shift = np.repeat(roots, [len(tree) for tree in trees])
    leaf = nodes["is_leaf"].astype(bool)
    return Forest(
        names,
        roots.astype(np.int32),
        np.where(leaf, -1, nodes["feature_idx"]).astype(np.int16),
        nodes["num_threshold"].astype(np.float32),
        (nodes["left"] + shift).astype(np.int32),
        (nodes["right"] + shift).astype(np.int32),
        np.where(leaf, nodes["value"], 0.0).astype(np.float32),
        float(model._baseline_prediction.ravel()[0]),
    )


def outcome(one: Line, trees: Forest) -> str:
    """What the referee does with a sentence, and whether that is right."""
    found = referee.judged(one.said, one.rules, one.learned, one.weighed, trees)
    path, scene = setting(one.example.frames, one.example.objects)
    proper = one.example.outcome == "do"
    if found.outcome not in ("do", "needs_confirmation"):
        return "asked or declined" if proper else "rightly refused"
    meant = right(one.example, found.reading, path, scene)
    if found.outcome == "do":
        return "right" if meant else "silently wrong" if proper else "improper executed"
    return "right after one yes" if meant else "shown and wrong" if proper else "rightly refused"


def main(weights: str, names: str, to: str = "") -> None:
    """Read, show what would come of it, grow and write."""
    with np.load(weights) as arrays:
        learned = LearnedReader(Network({key: arrays[key] for key in arrays.files}))
    voices = names.split(",")
    found = list(lines(voices, learned))
    counts: Counter[str] = Counter()
    for k in range(FOLDS):
        mine = voices[k::FOLDS]
        trees = grown([one for one in found if one.example.voice not in mine])
        counts.update(outcome(one, trees) for one in found if one.example.voice in mine)
    print({name: f"{n / len(found):.1%}" for name, n in sorted(counts.items())})
    if to:
        kept = vars(grown(found)) | {}
        np.savez_compressed(to, **{**kept, "names": np.array("\n".join(kept["names"]))})


if __name__ == "__main__":
    main(*sys.argv[1:])
