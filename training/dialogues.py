"""What feedback comes to in a dialogue, judged by executable checks.

`python training/dialogues.py [voices|held_out|FOLDER] [--every N]`: for each line of feedback of the corpus a session
is begun with the frames of the turn before, the utterance is said to the built-in writer, and the trajectory that
stands after it is judged by what the line's edits come to. Right, right after one yes, shown but not meant, asked or
declined, and silently wrong, voice by voice; it prints no sentence.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent / "corpus"))

from answers import row
from check import Example, examples
from realised import after_feedback, setting

from ovita.bench.expected import expected
from ovita.dialogue.session import Session
from ovita.errors import OvitaError
from ovita.instruct import edits as E
from ovita.instruct import frames as F
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory
from ovita.writers.generate import FramesWriter

CORPUS = Path(__file__).parent / "corpus"


def judged(line: Example) -> str:
    """What one line of feedback amounts to; "not begun" where its first turn cannot be carried out."""
    trajectory, scene = _setting(line)
    session = Session(trajectory, scene, writer=FramesWriter(line.before or ()))
    if not session.say("the turn before").usable:
        return "not begun"
    session.writer = "builtin"
    before = session.current
    try:
        result = session.say(line.sentence)
    except OvitaError:
        return "asked or declined"
    shown = session.pending is not None
    if shown:
        session.say("yes")
    if session.current is before and not result.usable:
        return "asked or declined"
    if _meant(line, session, before):
        return "after a yes" if shown else "right"
    return "shown, not meant" if shown else "silently wrong"


def _meant(line: Example, session: Session, before: Trajectory) -> bool:
    commands = {edit.command for edit in line.edits if isinstance(edit, E.Command)}
    after = () if commands & {"undo", "restart"} else after_feedback(line, session.original, session.scene)
    stands = session.original if not after else before if commands else None
    if stands is not None:
        return np.array_equal(session.current.to_array(), stands.to_array())
    last = session.adaptation
    asked = session.current if last is None or last.proposed is None else last.proposed  # before the limits
    again, also = (all(isinstance(edit, kind) for edit in line.edits) for kind in (E.Again, E.Also))
    if again:
        return _passes(line.before or (), before, asked, session.scene)
    further = after[len(line.before or ()) :] if also and last is not None and not last.lost else ()
    return _passes(after, session.original, asked, session.scene) or (
        bool(further) and _passes(further, before, asked, session.scene)
    )


def _passes(frames: Sequence[F.SemanticFrame], begun: Trajectory, asked: Trajectory, scene: Scene) -> bool:
    try:
        return bool(expected(frames, begun, scene).judge(begun, asked, scene).passed)
    except (OvitaError, ValueError):
        return False


def _setting(line: Example) -> tuple[Trajectory, Scene]:
    """A path and a scene that suit the frames before the feedback and those after it."""
    before = line.before or ()
    return setting((*before, *after_feedback(line, *setting(before, line.objects))), line.objects)


def _redoes(line: Example) -> bool:
    """Whether it brings back what was undone, of which a session with one turn has nothing."""
    return any(isinstance(edit, E.Command) and edit.command == "redo" for edit in line.edits)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("where", nargs="?", default="held_out")
    parser.add_argument("--every", type=int, default=1, help="only every so many-th line")
    options = parser.parse_args()
    folder = CORPUS / options.where if options.where in ("voices", "held_out") else Path(options.where)
    total: Counter[str] = Counter()
    for path in sorted(folder.glob("*.txt")):
        lines = [
            line for line in examples(path) if line.edits and line.before and not line.problem and not _redoes(line)
        ]
        counts = Counter(judged(line) for line in lines[:: options.every])
        total += counts
        print(row(path.stem, counts), flush=True)
    print(row("all", total), f" not begun {total['not begun']}")


if __name__ == "__main__":
    main()
