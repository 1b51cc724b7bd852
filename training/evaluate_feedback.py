"""Measure the reader of feedback on the corpus: right, asked and wrong by voice; it prints no sentence.

`python training/evaluate_feedback.py [voices|held_out]`. A reading is right if it gives the frames that the written
edits give, and the same commands; taking all of the last turn away and undoing it are the same. What is no feedback is
an instruction, done after the frames before, as in a session.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

CORPUS = Path(__file__).parent / "corpus"
sys.path.insert(0, str(CORPUS))

from check import Example, examples, path_of  # noqa: E402, F401

from ovita.instruct import edits as E  # noqa: E402
from ovita.instruct import frames as F  # noqa: E402
from ovita.instruct.editing import Values, apply, slots  # noqa: E402
from ovita.instruct.meaning import same  # noqa: E402
from ovita.instruct.understanding import feedback, read  # noqa: E402
from ovita.paths.part import PathPart  # noqa: E402
from ovita.paths.scene import Scene, SceneObject  # noqa: E402

AMOUNTS = {"m": 0.1, "%": 0.5, "s": 2.0, "turns": 2.0, "deg": 30.0, "waypoints": 40.0}


def values_of(frames: Sequence[F.SemanticFrame]) -> Values:
    """Amounts as they would be realised for the slots that frames leave open."""
    found: dict[str, F.Quantity] = {}
    for i, frame in enumerate(frames):
        for slot, units in slots(frame).items():
            if slot in frame.quantities:
                continue
            if isinstance(frame, F.Pace):
                found[f"{i}.{slot}"] = F.Quantity(1.5 if frame.change == "faster" else 0.5, "x", "to")
            else:
                found[f"{i}.{slot}"] = F.Quantity(AMOUNTS.get(units[0], 3.0), units[0])
    return found


def plain(edits: Iterable[E.Edit]) -> list[E.Edit]:
    """Edits in the form that equal ones share: thirds in two digits, a dropped turn as undone."""
    found: list[E.Edit] = []
    for edit in edits:
        if isinstance(edit, E.Rescale) and edit.factor:
            edit = replace(edit, factor=round(edit.factor, 2))
        if isinstance(edit, E.Restrict | E.Except):
            edit = replace(edit, part=_in_digits(edit.part))
        if isinstance(edit, E.Also):
            edit = replace(edit, frame=replace(edit.frame, part=_in_digits(edit.frame.part)))
        found.append(E.Command(command="undo") if isinstance(edit, E.Drop) and not edit.on else edit)
    return found


def _in_digits(part: PathPart) -> PathPart:
    amount = round(part.amount, 2) if part.amount is not None and part.unit == "share" else part.amount
    return replace(part, amount=amount, parts=tuple(map(_in_digits, part.parts)))


def outcome(line: Example, reading: F.Reading | None) -> str:
    """How a reading compares: "right", "asked", "none" or "wrong"."""
    if line.outcome != "do":
        return "right" if reading is None or reading.question else "wrong"
    if reading is None:
        return "none"
    if reading.question:
        return "asked"
    before, scene = line.before or (), Scene()
    wanted, found = plain(line.edits), plain(reading.edits)
    commands = [[e.command for e in edits if isinstance(e, E.Command)] for edits in (wanted, found)]
    values = values_of(before)
    right = commands[0] == commands[1] and same(
        apply(wanted, before, scene, values), apply(found, before, scene, values)
    )
    return "right" if right and found else "wrong"


def reading_of(line: Example) -> F.Reading | None:
    """What a session makes of a line of feedback: edits, or an instruction after the frames before."""
    scene = Scene(tuple(SceneObject(name, [0.1 * i, 0.3, 0.2]) for i, name in enumerate(line.objects)))
    found = feedback(line.sentence, scene, line.before or (), None)
    fresh = F.Reading() if found is not None else read(line.sentence, scene)
    if not fresh.frames or fresh.unread or fresh.question or fresh.improper:
        return found
    return F.Reading(edits=tuple(E.Also(frame=frame) for frame in fresh.frames))


def measured(folder: Path, every: int = 1) -> dict[str, Counter[str]]:
    """Outcomes by voice, of every so many lines."""
    found: dict[str, Counter[str]] = {}
    for path in sorted(folder.glob("*.txt")):
        counts = found.setdefault(path.stem, Counter())
        for line in [one for one in examples(path) if one.before is not None and not one.problem][::every]:
            counts[outcome(line, reading_of(line))] += 1
    return found


def main(folder: str = "voices") -> None:
    """Print the outcomes."""
    total: Counter[str] = Counter()
    for voice, counts in measured(CORPUS / folder).items():
        print(f"{voice:18} {counts['right']:4} of {counts.total():4} right; {dict(counts)}")
        total += counts
    print(f"{'all':18} {total['right']:4} of {total.total():4} right ({total['right'] / total.total():.1%}); {total}")


if __name__ == "__main__":
    main(*sys.argv[1:])
