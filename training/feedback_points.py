"""Fit what speaks for taking an utterance after a turn as an instruction, and show what comes of it.

`python training/feedback_points.py VOICE,VOICE,...` reads the voices named, which the network must not have been
trained on: their feedback, and every third of their first requests and all that is improper, said after the frames of
some feedback of the same voice. It prints the points of `instruct/looking_back.GROUNDS` (logistic regression on the
utterances that are right in one of the two ways only), and how many would be taken rightly, each voice judged by points
that were fitted on the others.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from evaluate_feedback import Example, examples, outcome, path_of
from realised import setting

from ovita.instruct import frames as F
from ovita.instruct.edits import Also
from ovita.instruct.looking_back import EVEN, grounds
from ovita.instruct.understanding import overheard

RIDGE = 1.0
WEIGHTS = {"feedback": 1.0, "first requests": 0.6, "improper": 0.3}
"""How much an utterance of each kind counts."""


@dataclass(frozen=True)
class Row:
    """An utterance after a turn.

    Args:
        voice: Who says it.
        kind: "feedback", "first requests" or "improper".
        facts: What speaks for an instruction (G,).
        right: Whether it is right as an instruction, and as feedback.
    """

    voice: str
    kind: str
    facts: dict[str, float]
    right: tuple[bool, bool]


def rows(voice: str) -> Iterator[Row]:
    """The utterances of a voice that may be meant as feedback."""
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
    heard = overheard(line.sentence, scene, tuple(before), path.positions)
    if heard.edits.edits:
        kind = "feedback" if line.edits else "improper" if line.outcome == "improper" else "first requests"
        yield Row(line.voice, kind, grounds(heard), (_is_right(line, heard.alone, True), _is_right(line, heard.edits)))


def _is_right(line: Example, reading: F.Reading, instruction: bool = False) -> bool:
    """Whether a way to take a line comes to what its writer noted; how a first request is read is not judged here."""
    if line.edits:
        also = tuple(Also(frame=frame) for frame in reading.frames)
        return outcome(line, F.Reading(edits=also) if instruction else reading) == "right"
    also = tuple(Also(frame=frame) for frame in line.frames)
    return instruction or [*reading.edits] == [*also]


def fitted(data: Sequence[Row]) -> np.ndarray:
    """The points (G,), by Newton's method with a ridge."""
    told = [row for row in data if row.right[0] != row.right[1]]
    facts = np.array([[*row.facts.values()] for row in told])
    wanted = np.array([float(row.right[0]) for row in told])
    weights = np.array([WEIGHTS[row.kind] for row in told])
    points = np.zeros(facts.shape[1])
    for _ in range(40):
        likely = 1.0 / (1.0 + np.exp(-facts @ points))
        slope = facts.T @ (weights * (wanted - likely)) - RIDGE * points
        curve = facts.T @ (facts * (weights * likely * (1.0 - likely))[:, None]) + RIDGE * np.eye(len(points))
        points += np.linalg.solve(curve, slope)
    return points


def main(voices: str) -> None:
    """Fit, and print the points and the counts."""
    data = [row for voice in voices.split(",") for row in rows(voice)]
    for name, value in zip(data[0].facts, fitted(data), strict=True):
        print(f'"{name}": {value:.2f},')
    counts: dict[str, Counter[str]] = {kind: Counter() for kind in WEIGHTS}
    for voice in {row.voice for row in data}:
        points = fitted([row for row in data if row.voice != voice])
        for row in (row for row in data if row.voice == voice):
            instruction = 1.0 / (1.0 + np.exp(-np.array([*row.facts.values()]) @ points)) > EVEN
            counts[row.kind]["right" if row.right[0 if instruction else 1] else "otherwise"] += 1
    for kind, found in counts.items():
        print(kind, found.total(), ", ".join(f"{count / found.total():.1%} {how}" for how, count in found.items()))


if __name__ == "__main__":
    main(*sys.argv[1:])
