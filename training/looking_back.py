"""Fit what each fact counts that tells feedback from instructions.

`python training/looking_back.py` reads the training voices: feedback that is read rightly looks back, and first
requests, said after the feedback's frames of the same voice, do not. The plain feedback of the tests does, and their
paraphrases of instructions, of which every second is read, do not. It prints the points of
`instruct/looking_back.py` (logistic regression), and how many utterances they would take as feedback, each sixth of the
voices judged by points that were fitted on the others.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from evaluate_feedback import CORPUS, Example, examples, outcome
from referee import fitted

from ovita.instruct import edits as E
from ovita.instruct import frames as F
from ovita.instruct.feedback import retrospect
from ovita.instruct.looking_back import FACTS, LIKELY, Retrospect
from ovita.instruct.notation import parse
from ovita.instruct.rules import read
from ovita.paths.scene import Scene, SceneObject

PARAPHRASES = Path(__file__).parents[1] / "tests" / "instruct" / "paraphrases.txt"
FOLDS = 6
COUNTED = 4
"""How often a paraphrase counts: all have one kind of turn before them, and there are few."""


def considered(sentence: str, objects: tuple[str, ...], before: tuple[F.SemanticFrame, ...]) -> Retrospect | None:
    """An utterance beside the instruction that it would be; None where nothing in it can be feedback."""
    scene = Scene(tuple(SceneObject(name, [0.1 * i, 0.3, 0.2]) for i, name in enumerate(objects)))
    found = retrospect(sentence, scene, before, None, lambda text, earlier: read(text, scene, None, earlier))
    mere = all(isinstance(edit, E.Also) for edit in found.best.edits) and not found.best.question
    return None if mere else found


def of_voice(lines: list[Example]) -> Iterator[tuple[list[float], bool]]:
    """Facts of the utterances of a voice, and whether the feedback that they can be is meant."""
    told = [line for line in lines if line.before]
    for i, line in enumerate(lines):
        fitting = [one.before for one in told if {n for f in one.before or () for n in f.named} <= {*line.objects}]
        if line.before is None and (i % 3 or not fitting):
            continue
        before = line.before or (fitting[i % len(fitting)] if line.before is None else ())
        found = considered(line.sentence, line.objects, before or ()) if before else None
        if found is not None and (line.before is None or not found.best.question):
            meant = line.before is not None and outcome(line, F.Reading(edits=found.best.edits)) == "right"
            yield facts(found), meant


def facts(found: Retrospect) -> list[float]:
    """The facts of an utterance, in the order of FACTS."""
    return [float(fact(found)) for _, fact in FACTS.values()]


def paraphrases() -> Iterator[list[float]]:
    """Facts of every second paraphrase."""
    before = parse("move left=0.2m; closer cup by=0.1m; pace faster @near=bottle", ("cup", "bottle"))
    lines = PARAPHRASES.read_text(encoding="utf-8").splitlines()
    for line in [line for line in lines if line.strip() and line[0] not in "#="][1::2]:
        found = considered(line, ("cup", "table", "bottle"), before)
        if found is not None:
            yield facts(found)


def plain() -> Iterator[list[float]]:
    """Facts of the plain feedback of the tests, after the frames of what was said before it."""
    sys.path.insert(0, str(PARAPHRASES.parents[1]))
    from dialogue.feedback_sentences import FOURTH, ROWS, SECOND, THIRD

    objects = ("cup", "table", "bottle")
    scene = Scene(tuple(SceneObject(name, [0.1 * i, 0.3, 0.2]) for i, name in enumerate(objects)))
    for first, sentence, wanted in (*ROWS, *SECOND, *THIRD, *FOURTH):
        before = tuple(frame for said in first for frame in read(said, scene).frames)
        found = considered(sentence, objects, before) if before and "status" not in wanted else None
        if found is not None:
            yield facts(found)


def main() -> None:
    """Fit, and print the points and the counts."""
    voices = []
    for path in sorted((CORPUS / "voices").glob("*.txt")):
        voices.append(list(of_voice([line for line in examples(path) if not line.problem and line.outcome == "do"])))
    said = [*[(row, False) for row in paraphrases()] * COUNTED, *((row, True) for row in plain())]
    for name, points in zip(FACTS, fitted([row for voice in voices for row in voice] + said), strict=True):
        print(f'    "{name}": ({points:.2f},')
    judged: list[tuple[float, bool]] = []
    for k in range(FOLDS):
        others = [row for i, voice in enumerate(voices) if i % FOLDS != k for row in voice]
        points = fitted([*others, *said])
        judged += [
            (float(1 / (1 + np.exp(-np.dot(row, points)))), meant) for voice in voices[k::FOLDS] for row, meant in voice
        ]
    for least in sorted({0.2, 0.25, 0.3, 0.4, 0.5, LIKELY}):
        kept, taken = (sum(p > least and meant == wanted for p, meant in judged) for wanted in (True, False))
        right = sum(meant for _, meant in judged)
        print(f"{least}: {kept} of {right} meant as feedback, {taken} of {len(judged) - right} others taken as such")


if __name__ == "__main__":
    main()
