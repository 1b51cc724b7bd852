"""Fit the learned reader's confidence on voices that its network was not trained on, or measure it on held-out ones.

`python training/calibrate.py WEIGHTS fold:K/N --to src/ovita/instruct/weights.npz` reads the voices that `train.py
--without fold:K/N` left out, prints how right each confidence turned out, and writes the weights with the calibration.
`python training/calibrate.py WEIGHTS held_out` only prints counts, with the confidence that the weights hold.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import augment
import numpy as np
from augment import check
from evaluate_feedback import outcome

from ovita.instruct.encoder import Network
from ovita.instruct.frames import Reading
from ovita.instruct.learned import FEATURES, LearnedReader
from ovita.instruct.meaning import same
from ovita.instruct.notation import show


def judged(example: check.Example, reading: Reading) -> str:
    """How a reading compares with the corpus: right, wrong, asked, declined, or executed where nothing can be done."""
    done = bool(reading.frames or reading.edits)
    if example.outcome != "do":
        return "executed" if done else "right"
    if not done:
        return "asked" if reading.question else "declined"
    if example.before is None:
        alike = same(reading.frames, example.frames) and bool(reading.besides) == bool(example.besides)
        return "right" if alike else "wrong"
    return "right" if outcome(example, reading) == "right" else "wrong"


def fit(x: np.ndarray, y: np.ndarray, penalty: float = 2.0) -> dict[str, Any]:
    """Logistic regression by Newton's method."""
    mean, scale = x.mean(0), np.maximum(x.std(0), 1e-6)
    z = np.c_[(x - mean) / scale, np.ones(len(x))]
    w = np.zeros(z.shape[1])
    ridge = np.diag([penalty] * (z.shape[1] - 1) + [1e-6])
    for _ in range(30):
        p = 1 / (1 + np.exp(-z @ w))
        w -= np.linalg.solve(z.T @ (z * (p * (1 - p))[:, None]) + ridge, z.T @ (p - y) + ridge @ w)
    return {"mean": mean, "scale": scale, "weights": w[:-1], "bias": w[-1]}


def sure_of(x: np.ndarray, calibration: dict[str, Any]) -> np.ndarray:
    """Confidences of rows of features."""
    z = (x - calibration["mean"]) / calibration["scale"] @ calibration["weights"] + calibration["bias"]
    return np.asarray(1 / (1 + np.exp(-z)))


def crossed(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The confidence of each row by a fit to the other half of the rows."""
    halves = np.arange(len(y)) % 2 == 0
    sure = np.zeros(len(y))
    for half in (halves, ~halves):
        sure[half] = sure_of(x[half], fit(x[~half], y[~half].astype(float)))
    return sure


def report(counts: dict[str, Counter[str]], sure: np.ndarray, right: np.ndarray, done: np.ndarray) -> None:
    """Print counts by kind of sentence, a table of confidences, and what thresholds let through."""
    for row, count in counts.items():
        shares = "  ".join(f"{kind} {n / count.total():.1%}" for kind, n in count.most_common())
        print(f"{row:12} {count.total():5}  {shares}")
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
        band = done & (sure >= low) & (sure < high)
        print(f"{low:.2f}-{high:.2f}  {band.sum():5}  {right[band].mean() if band.any() else 0:.1%}")
    for least in (0.5, 0.7, 0.8, 0.9, 0.95):
        band = done & (sure >= least)
        print(f">= {least:.2f}: right {(band & right).sum()} wrong {(band & ~right).sum()} of {len(right)}")


def read_all(
    reader: LearnedReader, paths: Sequence[Path]
) -> tuple[list[tuple[check.Example, Reading, Any]], list[str]]:
    """Every line of some voices with its reading, its features and how it was judged."""
    lines = [line for path in paths for line in check.examples(path) if not line.problem]
    read = [reader.explain(reader.hear(e.sentence, augment.scene_of(e.objects), None, e.before)) for e in lines]
    rows = [(e, reading, features) for e, (reading, features) in zip(lines, read, strict=True)]
    return rows, [judged(e, reading) for e, reading, _ in rows]


def main() -> None:
    """Read, fit, print, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("weights", type=Path)
    parser.add_argument("voices", help="the voices that it was not trained on, or fold:K/N of all, or held_out")
    parser.add_argument("--to", type=Path)
    parser.add_argument("--list", type=Path, help="write the sentences that were read wrongly")
    options = parser.parse_args()
    held_out = options.voices == "held_out"
    if held_out and (options.list or options.to):
        parser.error("sentences of held-out voices are not printed, and nothing is fitted to them")
    with np.load(options.weights) as file:
        arrays = {name: file[name] for name in file.files}
    reader = LearnedReader(Network(arrays))
    folders = (check.HELD_OUT,) if held_out else check.TRAINED
    paths = sorted(path for folder in folders for path in folder.glob("*.txt"))
    if options.voices.startswith("fold:"):
        k, n = map(int, options.voices.removeprefix("fold:").split("/"))
        paths = paths[k::n]
    elif not held_out:
        paths = [path for path in paths if path.stem in options.voices.split(",")]
    rows, kinds = read_all(reader, paths)
    counts: dict[str, Counter[str]] = {}
    for (e, _, _), kind in zip(rows, kinds, strict=True):
        row = e.outcome if e.outcome != "do" else "first" if e.before is None else "feedback"
        counts.setdefault(row, Counter())[kind] += 1
        if held_out:
            counts.setdefault(e.voice, Counter())[kind] += 1
    x = np.array([features for _, _, features in rows])
    right = np.array([kind == "right" for kind in kinds])
    done = np.array([bool(reading.frames or reading.edits) for _, reading, _ in rows])
    if held_out:
        sure = np.array([reader.sure(features) for _, _, features in rows])
    else:
        sure = crossed(x, right)
    report(counts, sure, right, done)
    if held_out:
        return
    calibration = fit(x, right.astype(float))
    print({name: round(float(w), 2) for name, w in zip(FEATURES, calibration["weights"], strict=True)})
    if options.to:
        kept = {name: value for name, value in arrays.items() if not name.startswith("calibration")}
        np.savez_compressed(options.to, **kept, **{f"calibration.{k}": np.array(v) for k, v in calibration.items()})
    if options.list:
        wrong = [
            f"{features[0]:.2f} {kind} {e.sentence} | {e.reading} || "
            + show(reading.frames or reading.edits)
            + reading.question
            + reading.improper
            for (e, reading, features), kind in zip(rows, kinds, strict=True)
            if kind != "right"
        ]
        options.list.write_text("\n".join(wrong))


if __name__ == "__main__":
    main()
