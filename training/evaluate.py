"""How well the learned reader reads the corpus, voice by voice.

`python training/evaluate.py [--voices train|held_out] [--list KIND] [--voice NAME]`

Right, right but with words left unread, asked back, declined, or silently wrong, judged by `frames.same` against the
corpus' reading. A sentence that asks for nothing (`?`, `!`) is right if nothing is done about it. Sentences of held-out
voices are never printed.
"""

from __future__ import annotations

import argparse
import random
import sys
import time
from collections import Counter, defaultdict
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent / "corpus"))

from check import Example, examples
from realised import alike

from ovita.instruct import notation
from ovita.instruct.frames import Reading
from ovita.instruct.learned import LearnedReader
from ovita.instruct.meaning import same
from ovita.paths.scene import Scene, SceneObject

FOLDERS = {"train": "voices", "held_out": "held_out"}
KINDS = ("right", "unread", "asked", "declined", "wrong")


def scene_of(names: tuple[str, ...]) -> Scene:
    """A scene with objects of these names on a circle."""
    angles = np.linspace(0.0, 2.0 * np.pi, len(names), endpoint=False)
    return Scene(
        tuple(SceneObject(n, np.array([np.cos(a), np.sin(a), 0.5])) for n, a in zip(names, angles, strict=True))
    )


def judged(line: Example, reading: Reading) -> str:
    """One of KINDS: how a reading compares with the corpus'."""
    done = bool(reading.frames) and not (reading.question or reading.improper)
    if line.outcome != "do":
        return "wrong" if done and not reading.unread else "right"
    matches = same(reading.frames, line.frames) or alike(reading.frames, line.frames, line.objects)
    if reading.question:
        return "asked"
    if not done:
        return "declined"
    if matches:
        return "unread" if reading.unread else "right"
    return "declined" if reading.unread else "wrong"


def main() -> None:
    """Print the counts by voice, and the lines of one kind where they are asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--voices", default="train", choices=tuple(FOLDERS))
    parser.add_argument("--voice", default="", help="only this one")
    parser.add_argument("--list", default="", help="print the lines of these kinds, such as wrong,declined")
    parser.add_argument("--sample", type=int, default=0, help="at most so many of them, drawn at random")
    options = parser.parse_args()
    if options.voices == "held_out" and options.list:
        parser.error("sentences of held-out voices are not printed")
    reader = LearnedReader()
    folder = Path(__file__).parent / "corpus" / FOLDERS[options.voices]
    total: Counter[str] = Counter()
    improper: Counter[str] = Counter()
    shown: dict[str, list[str]] = defaultdict(list)
    times: list[float] = []
    for path in sorted(folder.glob("*.txt")):
        if options.voice and path.stem not in options.voice.split(","):
            continue
        counts: Counter[str] = Counter()
        for line in examples(path):
            if line.before is not None or line.problem:
                continue
            began = time.process_time()
            reading = reader.read(line.sentence, scene_of(line.objects))
            times.append(time.process_time() - began)
            kind = judged(line, reading)
            counts[kind] += 1
            improper[kind] += line.outcome != "do"
            said = notation.show(reading.frames) or "-"
            extra = f" unread={','.join(reading.unread)}" * bool(reading.unread)
            extra += f" ?{reading.question}" * bool(reading.question) + f" !{reading.improper}" * bool(reading.improper)
            shown[kind].append(
                f"{line.voice}:{line.number} {kind}\n  {line.sentence}\n   gold {line.reading}\n   read {said}{extra}"
            )
        total += counts
        print(_row(path.stem, counts))
    print(_row("all", total))
    refused = improper.total()
    if refused:
        print(f"of these to be refused: {refused}, executed {improper['wrong']} ({improper['wrong'] / refused:.1%})")
    if times:
        print(f"reading: median {np.median(times) * 1e3:.1f} ms, p95 {np.percentile(times, 95) * 1e3:.1f} ms")
    for kind in filter(None, options.list.split(",")):
        lines = shown[kind]
        if options.sample and len(lines) > options.sample:
            lines = random.Random(options.sample).sample(lines, options.sample)
        print("\n".join(lines))


def _row(name: str, counts: Counter[str]) -> str:
    n = max(counts.total(), 1)
    return f"{name:18} {counts.total():5}  " + "  ".join(f"{k} {counts[k] / n:6.1%}" for k in KINDS)


if __name__ == "__main__":
    main()
