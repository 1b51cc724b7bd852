"""Fit what speaks for an instruction, for the rules' feedback and for the network's, and show what comes of it.

`python training/feedback_points.py VOICE,VOICE,...` reads the voices named, which the network must not have been
trained on: their feedback, and every third of their first requests and all that is improper, said after the frames of
some feedback of the same voice. It prints the points of
`instruct/looking_back.GROUNDS` (conditional logistic regression: of the ways to take an utterance, those that are right
are to be the likeliest), and how many would be taken rightly, each voice judged by points that were fitted on the
others. What the rules alone decide is left out.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from evaluate_feedback import Example, examples, outcome, path_of
from realised import setting

from ovita.instruct import frames as F
from ovita.instruct.edits import Also
from ovita.instruct.looking_back import EVEN, GROUNDS, Hearing, Retrospect, ways
from ovita.instruct.understanding import overheard

RIDGE = 1.0
WEIGHTS = {"feedback": 1.0, "first requests": 0.4, "improper": 0.3}
"""How much an utterance of each kind counts."""

NAMES = [(who, name) for who, grounds in GROUNDS.items() for name in grounds]


@dataclass(frozen=True)
class Row:
    """An utterance after a turn.

    Args:
        voice: Who says it.
        kind: "feedback", "first requests" or "improper".
        grounds: What speaks for each way to take it (K, G).
        right: Which ways are right (K,).
    """

    voice: str
    kind: str
    grounds: np.ndarray
    right: np.ndarray


def rows(voice: str) -> Iterator[Row]:
    """The utterances of a voice for which the network is asked."""
    lines = [line for line in examples(path_of(voice)) if not line.problem]
    told = [line for line in lines if line.before]
    for i, line in enumerate(lines):
        fitting = [one.before for one in told if {n for f in one.before or () for n in f.named} <= {*line.objects}]
        if line.before and line.edits:
            yield from _row(line, line.before)
        elif line.before is None and fitting and (i % 3 == 0 or line.outcome == "improper"):
            yield from _row(line, fitting[i % len(fitting)] or ())


def _row(line: Example, before: Sequence[F.SemanticFrame]) -> Iterator[Row]:
    path, scene = setting((*before, *line.frames), line.objects)
    found, heard = overheard(line.sentence, scene, tuple(before), path.positions)
    if heard is None:
        return
    kind = "feedback" if line.edits else "improper" if line.outcome == "improper" else "first requests"
    yield _weighed(line.voice, kind, found, heard, lambda reading: _is_right(line, reading or found.fresh, not reading))


def _weighed(
    voice: str, kind: str, found: Retrospect, heard: Hearing, is_right: Callable[[F.Reading | None], bool]
) -> Row:
    """An utterance with what speaks for each way to take it."""
    readings = ways(found, heard)
    grounds = np.zeros((len(readings), len(NAMES)))
    for k, who in enumerate(readings):
        for name, (_, fact) in GROUNDS[who].items():
            grounds[k, NAMES.index((who, name))] = float(fact(found, heard))
    return Row(voice, kind, grounds, np.array([is_right(reading) for reading in readings.values()]))


def _is_right(line: Example, reading: F.Reading, instruction: bool) -> bool:
    """Whether a way to take a line comes to what its writer noted; how a first request is read is not judged here."""
    if line.edits:
        also = tuple(Also(frame=frame) for frame in reading.frames)
        return outcome(line, F.Reading(edits=also) if instruction else reading) == "right"
    also = tuple(Also(frame=frame) for frame in line.frames)
    return instruction or [*reading.edits] == [*also]


def fitted(data: Sequence[Row]) -> np.ndarray:
    """The points (G,), by Newton's method with a ridge."""
    told = [row for row in data if row.right.any() and not row.right.all()]
    grounds = np.zeros((len(told), len(GROUNDS), len(NAMES)))
    there, right = np.zeros(grounds.shape[:2]), np.zeros(grounds.shape[:2])
    for i, row in enumerate(told):
        grounds[i, : len(row.right)], there[i, : len(row.right)], right[i, : len(row.right)] = row.grounds, 1, row.right
    weights = np.array([WEIGHTS[row.kind] for row in told])
    points = np.zeros(len(NAMES))
    for _ in range(60):
        odds = there * np.exp(grounds @ points)
        likely = odds / odds.sum(axis=1, keepdims=True)
        wanted = odds * right / (odds * right).sum(axis=1, keepdims=True)
        slope = np.einsum("n,nk,nkg->g", weights, wanted - likely, grounds) - RIDGE * points
        mean = np.einsum("nk,nkg->ng", likely, grounds)
        curve = np.einsum("n,nk,nkg,nkh->gh", weights, likely, grounds, grounds, optimize=True)
        curve += RIDGE * np.eye(len(points)) - (weights[:, None] * mean).T @ mean
        step = np.linalg.solve(curve, slope)
        points += step * min(1.0, 3.0 / max(np.abs(step).max(), 1e-9))
    return points


def main(voices: str) -> None:
    """Fit, and print the points and the counts."""
    data = [row for voice in voices.split(",") for row in rows(voice)]
    for (who, name), value in zip(NAMES, fitted(data), strict=True):
        print(f"{who:12} {name:24} {value:.2f}")
    counts: dict[str, Counter[str]] = {
        "feedback": Counter(),
        "first requests": Counter(),
        "improper": Counter(),
    }
    for voice in {row.voice for row in data}:
        points = fitted([row for row in data if row.voice != voice])
        for row in [row for row in data if row.voice == voice]:
            sums = row.grounds @ points
            best = int(np.argmax(sums))
            likely = 1.0 / np.exp(sums - sums[best]).sum()
            how = "right" if row.right[best] else "otherwise"
            counts[row.kind][how if best == 0 or likely >= EVEN else f"{how}, shown first"] += 1
    for kind, found in counts.items():
        shares = ", ".join(f"{count / found.total():.1%} {how}" for how, count in found.most_common())
        print(f"{kind}: {found.total()}, {shares}")


if __name__ == "__main__":
    main(*sys.argv[1:])
