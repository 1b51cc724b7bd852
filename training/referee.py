"""Fit what each ground counts for the referee, and show what its thresholds would do.

`python training/referee.py WEIGHTS.npz VOICE,VOICE,...` reads the voices named, which the network must not have been
trained on, fits the points of `instruct/referee.py` (logistic regression), and prints them with what would come of
thresholds, each voice judged by points that were fitted on the others. A reading is right if the policy made of it
passes the check of what its writer meant. Held-out voices are not read.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent / "corpus"))

from answers import passes
from check import Example, examples, path_of
from realised import setting

from ovita.errors import OvitaError
from ovita.instruct.chunks import chunks
from ovita.instruct.encoder import Network
from ovita.instruct.frames import Reading
from ovita.instruct.learned import LearnedReader
from ovita.instruct.meaning import same
from ovita.instruct.numerals import written_out
from ovita.instruct.referee import POINTS, both_readings
from ovita.instruct.rules import read
from ovita.instruct.understanding import in_units
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory
from ovita.request import Request
from ovita.writers.generate import reply_for

RIDGE = 1.0


def candidates(line: Example, learned: LearnedReader) -> list[tuple[list[float], bool]]:
    """The grounds of each reader's reading of a line, and whether the reading is right; one that both share once."""
    path, scene = setting(line.frames, line.objects)
    text = written_out(line.sentence)
    said, _ = chunks(text, scene, path.positions)
    heard = learned.hear(text, scene, path.positions)
    one, other = (
        in_units(reading, said, path.positions)
        for reading in (read(text, scene, path.positions), learned.reading(heard))
    )
    weighed = {"rules": heard.weigh(one.frames), "learned": heard.weigh(other.frames)}
    both = both_readings(said, one, other, weighed)
    found = []
    for by, reading in both.candidates.items():
        values = both.grounds(by)
        found.append(([values[name] for name in POINTS], right(line, reading, path, scene)))
    return found


def right(line: Example, reading: Reading, path: Trajectory, scene: Scene) -> bool:
    """Whether a reading is what the corpus says, or does the same; what no frame can say has to be noticed."""
    if line.besides and not reading.besides:
        return False
    if line.outcome != "do" or same(reading.frames, line.frames):
        return line.outcome == "do"
    try:
        reply = reply_for(reading.frames, Request(line.sentence, path, scene))
    except (OvitaError, ValueError, IndexError):
        return False
    return reply.kind == "policy" and passes(line, reply, path, scene)


def fitted(rows: list[tuple[list[float], bool]]) -> np.ndarray:
    """The points (P,) that explain which readings are right, by Newton's method with a ridge on all but the first."""
    x, y = np.array([r for r, _ in rows]), np.array([float(t) for _, t in rows])
    points = np.zeros(x.shape[1])
    ridge = RIDGE * (np.arange(len(points)) > 0)
    for _ in range(50):
        p = 1.0 / (1.0 + np.exp(-x @ points))
        slope = x.T @ (p - y) + ridge * points
        points -= np.linalg.solve((x * (p * (1.0 - p))[:, None]).T @ x + np.diag(ridge + 1e-6), slope)
    return points


def main(weights: str, voices: str) -> None:
    """Fit, and print the points and the outcomes by threshold."""
    with np.load(weights) as arrays:
        learned = LearnedReader(Network({key: arrays[key] for key in arrays.files}))
    lines = [
        (line, candidates(line, learned))
        for voice in voices.split(",")
        for line in examples(path_of(voice))
        if line.before is None and not line.problem
    ]
    for name, value in zip(POINTS, fitted([c for _, found in lines for c in found]), strict=True):
        print(f'    "{name}": {value:.2f},')
    judged: list[tuple[Example, float, bool]] = []
    for voice in {line.voice for line, _ in lines}:
        points = fitted([c for line, found in lines for c in found if line.voice != voice])
        for line, found in lines:
            if line.voice == voice:
                scored = [(float(1.0 / (1.0 + np.exp(-np.dot(c, points)))), t) for c, t in found]
                judged.append((line, *max(scored, default=(0.0, False))))
    for do in (0.7, 0.8, 0.85, 0.9, 0.95):
        for show in (0.15, 0.3):
            counts = Counter(_outcome(line, p, meant, do, show) for line, p, meant in judged)
            print(do, show, {name: f"{n / len(judged):.1%}" for name, n in sorted(counts.items())})


def _outcome(line: Example, p: float, meant: bool, do: float, show: float) -> str:
    if p >= do:
        return "right" if meant else "silently wrong" if line.outcome == "do" else "improper executed"
    if p >= show:
        return "right after one yes" if meant else "shown and wrong"
    return "declined or asked" if line.outcome == "do" else "rightly declined"


if __name__ == "__main__":
    main(*sys.argv[1:])
