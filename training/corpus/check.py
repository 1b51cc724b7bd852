"""Check the notation of the corpus: counts by voice, and every line that cannot be read."""

from __future__ import annotations

import re
import sys
from collections import Counter
from pathlib import Path

FOLDER = Path(__file__).parent / "voices"
DIRECTIONS = {"left", "right", "front", "back", "up", "down", "x", "-x", "y", "-y", "z", "-z"}
QUANTITY = re.compile(r"[-+~]?[0-9.]+(?:-[0-9.]+)?[A-Za-z%/'\"0-9]*")
FLAGS = {
    "more",
    "fewer",
    "larger",
    "smaller",
    "cw",
    "ccw",
    "faster",
    "slower",
    "set",
    "constant",
    "rampup",
    "rampdown",
    "turns",
    "accelerate",
    "start",
    "goal",
    "ends",
    "speed",
    "path",
    "height",
    "rest",
    "shape",
    "x",
    "y",
    "less",
}
SLOTS = {
    "by",
    "to",
    "toward",
    "away",
    "at",
    "for",
    "deg",
    "at_least",
    "at_most",
    "of",
    "about",
    "turns",
    "radius",
    "size",
    "waves",
    "rise",
    "over",
    "under",
    "between",
    "first",
    "last",
    "after",
    "before",
    "merge",
    "speed",
}
FRAMES = {
    "move",
    "end",
    "closer",
    "farther",
    "clearance",
    "via",
    "side",
    "pace",
    "keep",
    "stop",
    "wait",
    "extend",
    "smooth",
    "waypoints",
    "circle",
    "spiral",
    "eight",
    "zigzag",
    "wave",
    "shake",
    "hop",
    "hover",
    "mirror",
    "rotate",
    "tilt",
    "resize",
    "curve",
    "straighten",
    "height",
    "bound",
    "reverse",
    "return",
    "trim",
    "quadrant",
}
PARTS = {
    "near",
    "first",
    "last",
    "middle",
    "between",
    "after",
    "before",
    "range",
    "rising",
    "falling",
    "start",
    "goal",
    "every",
    "beyond",
    "turns",
    "selection",
}
EDITS = {
    "scale",
    "set",
    "flip",
    "replace",
    "restrict",
    "except",
    "drop",
    "again",
    "also",
    "undo",
    "redo",
    "restart",
    "accept",
    "explain",
}


def problem(frame: str, objects: set[str]) -> str:
    """What is wrong with one frame or edit, or ""."""
    name, *words = frame.split()
    if name not in FRAMES | EDITS:
        return f"unknown frame {name!r}"
    if name in EDITS:
        return ""
    for word in words:
        key, _, value = word.lstrip("@!").partition("=")
        if word.startswith("@"):
            if key not in PARTS:
                return f"unknown part {word!r}"
        elif value and key not in SLOTS | DIRECTIONS:
            return f"unknown slot {word!r}"
        elif not value and key not in FLAGS | DIRECTIONS | objects and not QUANTITY.fullmatch(key):
            if not set(key.split("+")) <= objects:
                return f"{key!r} is neither an object of the scene nor a word of the notation"
    return ""


def read(path: Path) -> tuple[list[tuple[str, str]], list[str]]:
    """The sentences of a voice with their readings, and what is wrong with its lines."""
    pairs, wrong, objects = [], [], set[str]()
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
        if line.startswith("# scene:"):
            objects = {name.strip().replace(" ", "_") for name in line.partition(":")[2].split(",")}
        if not line.strip() or line.startswith("#"):
            continue
        sentence, bar, reading = line.rpartition(" | ")
        if not bar:
            wrong.append(f"{path.name}:{number}: no ' | '")
            continue
        pairs.append((sentence, reading))
        if reading[:1] in "?!":
            continue
        found = [problem(frame.strip(), objects) for frame in reading.split(";") if frame.strip()]
        wrong += [f"{path.name}:{number}: {said}" for said in found if said]
    return pairs, wrong


def main() -> int:
    """Print the counts and what is wrong; 1 if anything is."""
    frames: Counter[str] = Counter()
    wrong: list[str] = []
    total = 0
    for path in sorted(FOLDER.glob("*.txt")):
        pairs, bad = read(path)
        wrong += bad
        total += len(pairs)
        print(f"{path.stem:16} {len(pairs):5} sentences, {len(bad)} to look at")
        frames.update(frame.split()[0] for _, reading in pairs for frame in reading.split(";") if frame.strip())
    print(f"{total} sentences; " + ", ".join(f"{name} {count}" for name, count in frames.most_common()))
    print("\n".join(wrong))
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
