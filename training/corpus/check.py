"""Check the notation of the corpus: counts by voice, and every line that cannot be read.

`python training/corpus/check.py [FOLDER ...]`
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from ovita.errors import InputError
from ovita.instruct.edits import Edit
from ovita.instruct.frames import SemanticFrame, name_of
from ovita.instruct.notation import parse, parse_edits

HERE = Path(__file__).parent
DRAWN = HERE / "drawn"
"""Voices that say readings which were drawn for them, in any order."""

TRAINED = (HERE / "voices", DRAWN)
"""Voices to train and tune on: of their own wishes, and of readings that were drawn for them."""

HELD_OUT = HERE / "held_out"
"""Voices that nothing is trained or tuned on."""


@dataclass(frozen=True)
class Example:
    """A line of a voice.

    Args:
        voice: Who says it.
        number: The line.
        objects: The scene's objects.
        sentence: What is said.
        before: Frames of the turn before it, or None for a first request.
        reading: What is meant, in the notation.
        frames: The frames of a first request.
        edits: The edits of feedback.
        outcome: "do", "ask" or "improper".
        besides: What a wish beside the frames is that no frame can say: "unrelated", "cannot" or "question", or "".
        problem: Why the notation cannot be read, or "".
    """

    voice: str
    number: int
    objects: tuple[str, ...]
    sentence: str
    before: tuple[SemanticFrame, ...] | None
    reading: str
    frames: tuple[SemanticFrame, ...] = ()
    edits: tuple[Edit, ...] = ()
    outcome: str = "do"
    besides: str = ""
    problem: str = ""


def examples(path: Path) -> Iterator[Example]:
    """The lines of a voice, in order."""
    objects: tuple[str, ...] = ()
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
        if line.startswith("# scene:"):
            objects = tuple(name.strip() for name in line.partition(":")[2].split(","))
        if not line.strip() or line.startswith("#"):
            continue
        said, bar, reading = line.rpartition(" | ")
        before, arrow, sentence = said.partition(" => ")
        sentence = sentence if arrow else said
        common = (path.stem, number, objects, sentence.strip())
        if not bar:
            yield Example(*common, None, reading, problem="no ' | '")
            continue
        try:
            earlier = parse(before, objects) if arrow else None
            if reading[:1] in "?!":
                yield Example(*common, earlier, reading, outcome="ask" if reading[0] == "?" else "improper")
            elif arrow:
                yield Example(*common, earlier, reading, edits=parse_edits(reading, objects))
            else:
                frames, _, besides = reading.partition("; !")
                yield Example(*common, None, reading, frames=parse(frames, objects), besides=besides.strip())
        except InputError as error:
            yield Example(*common, None, reading, problem=str(error))


def path_of(voice: str) -> Path:
    """The file of a voice that may be trained and tuned on."""
    return next(path for folder in TRAINED if (path := folder / f"{voice}.txt").exists())


def main(*folders: Path) -> int:
    """Print the counts and what is wrong; 1 if anything is."""
    counts: Counter[str] = Counter()
    wrong: list[str] = []
    total = 0
    for path in sorted(path for folder in folders or (*TRAINED, HELD_OUT) for path in folder.glob("*.txt")):
        lines = list(examples(path))
        bad = [f"{path.name}:{line.number}: {line.problem}" for line in lines if line.problem]
        print(f"{path.stem:16} {len(lines):5} sentences, {len(bad)} to look at")
        total += len(lines)
        wrong += bad
        for line in lines:
            counts.update(name_of(frame) for frame in line.frames)
            counts.update(edit.NAME for edit in line.edits)
            counts[line.outcome] += line.outcome != "do"
    print(f"{total} sentences; " + ", ".join(f"{name} {count}" for name, count in counts.most_common()))
    print("\n".join(wrong))
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main(*map(Path, sys.argv[1:])))
