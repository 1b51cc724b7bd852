"""`ovita read`: what the reader makes of a sentence, word by word, and what the referee says to it."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import click
from click import option

from ovita.cli.common import say, shipped_task
from ovita.io import load_bare, open_task
from ovita.text import quoted

if TYPE_CHECKING:
    from ovita.instruct.frames import Reading
    from ovita.instruct.referee import Understanding

OUTCOMES = {"do": "do it", "needs_confirmation": "show it and ask", "ask": "ask back", "decline": "decline"}
"""What each verdict means."""


@click.command()
@click.argument("utterance")
@option("--scene", "scene_file", metavar="FILE", help="Whose objects may be named. [the shipped table-top scene]")
@option("--before", metavar="FRAMES", default="", help="What was done so far, in the notation, for feedback.")
@option("--json", "as_json", is_flag=True, help="Print it as JSON.")
def command(utterance: str, scene_file: str | None, before: str, as_json: bool) -> None:
    """Read UTTERANCE and show how it is understood; nothing is adapted.

    Shows the classes of its words, the frames that are read
    (training/corpus/NOTATION.md), with what they leave unused, and the verdict, with how likely it is meant: do it,
    show it and ask, ask back, or decline.
    """
    from ovita.instruct import notation
    from ovita.instruct.chunks import chunks
    from ovita.instruct.understanding import understand

    task = shipped_task() if scene_file is None else load_bare(scene_file) or open_task(scene_file)
    earlier = notation.parse(before, task.scene.names)
    verdict = understand(utterance, task.scene, task.trajectory, earlier)
    said = chunks(utterance, task.scene, task.trajectory.positions)
    words = [{"text": c.text, "class": c.kind, "span": list(c.span), "names": list(c.names)} for c in said]
    if as_json:
        shown = {"utterance": utterance, "words": words, **document(verdict)}
        click.echo(json.dumps(shown, ensure_ascii=False))
        return
    say("Words     " + "  ".join(f"{word['text']} [{word['class']}]" for word in words))
    say(f"Read      {line(verdict.reading)}")
    say(f"Verdict   {OUTCOMES[verdict.outcome]} ({verdict.confidence:.2f})")
    say(*(f"          {text}" for text in _reasons(verdict)))


def line(reading: Reading) -> str:
    """A reading on one line: frames in the notation, confidence, and what is left."""
    from ovita.instruct.notation import show

    left = {"not read": quoted(reading.unread), "asks": reading.question, "declines": reading.improper}
    told = "; ".join([f"{reading.confidence:.2f}", *(f"{what}: {words}" for what, words in left.items() if words)])
    return f"{show(reading.frames or reading.edits) or 'nothing'}  ({told})"


def _reasons(verdict: Understanding) -> list[str]:
    unused = [f"Not used: {quoted(verdict.unused)}."] if verdict.unused else []
    said = [text for text in (verdict.reading.question, verdict.reading.improper) if text]
    return [*unused, *verdict.doubts, *said]


def document(verdict: Understanding) -> dict[str, Any]:
    """A verdict and its readings as JSON values."""
    said: dict[str, Any] = {"outcome": verdict.outcome, "likely": round(verdict.confidence, 4)}
    said |= {"unused": list(verdict.unused), "doubts": list(verdict.doubts)}
    return {"verdict": said | _reading(verdict.reading)}


def _reading(reading: Reading) -> dict[str, Any]:
    from ovita.instruct.notation import show

    own = {key: value for key, value in asdict(reading).items() if key not in ("frames", "edits")}
    return {"frames": show(reading.frames), "edits": show(reading.edits), **own}
