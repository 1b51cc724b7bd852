"""Fit the learned reader's confidence on voices that its network was not trained on.

`python training/calibrate.py WEIGHTS fold:K/N --to calibration.json` reads the voices that `train.py --without
fold:K/N` left out, prints how right each confidence turned out, and writes what `train.py --calibration` takes.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import augment
import numpy as np
from augment import check

from ovita.instruct.edits import Edit
from ovita.instruct.encoder import Network
from ovita.instruct.frames import Reading, canonical, same
from ovita.instruct.learned import FEATURES, LearnedReader
from ovita.instruct.notation import show


def same_edits(one: Sequence[Edit], other: Sequence[Edit]) -> bool:
    """Whether two lists of edits are the same in any order."""
    left, right = (
        sorted(repr(canonical(e.frame)) if hasattr(e, "frame") else show([e]) for e in edits) for edits in (one, other)
    )
    return left == right


def judged(example: check.Example, reading: Reading) -> str:
    """How a reading compares with the corpus: right, wrong, asked, declined, or executed where nothing can be done."""
    done = bool(reading.frames or reading.edits)
    if example.outcome != "do":
        return "executed" if done else "right"
    if not done:
        return "asked" if reading.question else "declined"
    if example.before is None:
        return "right" if same(reading.frames, example.frames) else "wrong"
    return "right" if same_edits(reading.edits, example.edits) else "wrong"


def fit(x: np.ndarray, y: np.ndarray, penalty: float = 2.0) -> dict[str, Any]:
    """Logistic regression by Newton's method."""
    mean, scale = x.mean(0), np.maximum(x.std(0), 1e-6)
    z = np.c_[(x - mean) / scale, np.ones(len(x))]
    w = np.zeros(z.shape[1])
    ridge = np.diag([penalty] * (z.shape[1] - 1) + [1e-6])
    for _ in range(30):
        p = 1 / (1 + np.exp(-z @ w))
        w -= np.linalg.solve(z.T @ (z * (p * (1 - p))[:, None]) + ridge, z.T @ (p - y) + ridge @ w)
    return {"mean": mean.tolist(), "scale": scale.tolist(), "weights": w[:-1].tolist(), "bias": float(w[-1])}


def main() -> None:
    """Read, fit, print, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("weights", type=Path)
    parser.add_argument("fold")
    parser.add_argument("--to", type=Path)
    parser.add_argument("--list", type=Path, help="write the sentences that were read wrongly")
    options = parser.parse_args()
    k, n = map(int, options.fold.removeprefix("fold:").split("/"))
    with np.load(options.weights) as file:
        reader = LearnedReader(Network({name: file[name] for name in file.files}))
    counts: dict[str, Counter[str]] = {}
    features, right, done, lines = [], [], [], []
    for i, path in enumerate(sorted(check.FOLDERS[0].glob("*.txt"))):
        if i % n != k:
            continue
        for e in check.examples(path):
            if e.problem:
                continue
            reading, found = reader.explain(e.sentence, augment.scene_of(e.objects), None, e.before)
            kind = judged(e, reading)
            row = e.outcome if e.outcome != "do" else "first" if e.before is None else "feedback"
            counts.setdefault(row, Counter())[kind] += 1
            features.append(found)
            right.append(kind == "right")
            done.append(bool(reading.frames or reading.edits))
            if kind != "right":
                said = show(reading.frames or reading.edits) + reading.question + reading.improper
                lines.append(f"{np.exp(found[0]):.2f} {kind} {e.sentence} | {e.reading} || {said}")
    x, y, did = np.array(features), np.array(right), np.array(done)
    calibration = fit(x, y.astype(float))
    halves = np.arange(len(y)) % 2 == 0
    sure = np.zeros(len(y))
    for half in (halves, ~halves):  # each half by the fit of the other one
        c = fit(x[~half], y[~half].astype(float))
        sure[half] = 1 / (1 + np.exp(-((x[half] - c["mean"]) / c["scale"] @ np.array(c["weights"]) + c["bias"])))
    for row, count in counts.items():
        print(
            f"{row:9} {count.total():5}  " + "  ".join(f"{k} {v / count.total():.1%}" for k, v in count.most_common())
        )
    print("confidence  done  right")
    for low, high in (
        (0, 0.2),
        (0.2, 0.4),
        (0.4, 0.6),
        (0.6, 0.8),
        (0.8, 0.9),
        (0.9, 0.95),
        (0.95, 0.98),
        (0.98, 1.01),
    ):
        band = did & (sure >= low) & (sure < high)
        print(f"{low:.2f}-{high:.2f}  {band.sum():5}  {y[band].mean() if band.any() else 0:.1%}")
    for least in (0.5, 0.7, 0.8, 0.9, 0.95):
        band = did & (sure >= least)
        print(f">= {least:.2f}: right {(band & y).sum()} wrong {(band & ~y).sum()} of {len(y)}")
    print({name: round(w, 2) for name, w in zip(FEATURES, calibration["weights"], strict=True)})
    if options.to:
        options.to.write_text(json.dumps(calibration))
    if options.list:
        options.list.write_text("\n".join(lines))


if __name__ == "__main__":
    main()
