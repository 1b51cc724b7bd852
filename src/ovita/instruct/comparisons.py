# ruff: noqa: E501
"""Patterns of what is measured by something else: bounds on both sides, a side and not the other, heights of things, stops before them, what is not to be touched."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import cast

from ovita.instruct.chunks import Build, Chunk, kinds, merged, numbers
from ovita.instruct.frames import Quantity, Role

OTHER = {"left": "right", "front": "back", "up": "down", "over": "under"}
OTHER |= {b: a for a, b in OTHER.items()}
HOW = dict.fromkeys("over up faster raise".split(), "at_least") | dict.fromkeys(
    "under down lower slower".split(), "at_most"
)
KNOCKING = frozenset("knock knocking bump bumping run running drive driving".split())
"""Words of other meanings that say a collision after a "not"."""


def _bound(chunk: Chunk, role: str, kind: str = "", **more: str) -> Chunk:
    q = replace(chunk.number, role=cast(Role, role), **more)  # type: ignore[arg-type]
    return replace(chunk, kind=kind or chunk.kind, q=q, value=role)


def _one_side(found: Sequence[Chunk]) -> list[Chunk] | None:
    """Left of it, not right of it: the other side that is denied says nothing more."""
    sides = [c for c in found if c.kind in OTHER]
    denied = merged(sides[:1], sides[0].kind, span=found[-1].span, value="flipped")
    return [*found[: kinds(found).index("never")], denied] if OTHER[sides[0].kind] == sides[1].kind else None


def _two_speeds(found: Sequence[Chunk]) -> list[Chunk]:
    """Speed above this and below that."""
    ways = [HOW.get(c.kind, c.kind) for c in found if c.kind in (*HOW, "at_most", "at_least")]
    speeds = [c for c in found if c.q is not None]
    one, other = (_bound(speed, way, "Qv", unit="m/s") for way, speed in zip(ways, speeds, strict=True))
    return [found[0], one, Chunk("and", "", found[0].span), found[0], other]


def _back_along(found: Sequence[Chunk]) -> list[Chunk] | None:
    """Back up by 30 cm at the end: back along the path."""
    back = next(c for c in found if c.kind in ("back", "reverse"))
    q = numbers(found)[0]
    meant = back.text.lower().startswith(("back up", "backing up", "back off", "back out", "reverse"))
    return [merged([back], "extend"), merged(found, "Qm", q=replace(q, value=-q.value, said=""))] if meant else None


def _height_of(found: Sequence[Chunk]) -> Chunk:
    """A height measured by a thing: as high as it, at least, or so much lower than it."""
    q = next((c.q for c in found if c.q is not None), Quantity(0.0, "m", "to"))
    how = next((HOW[c.kind] for c in found if c.kind in HOW), "")
    if any(c.kind == "never" for c in found):
        return merged(found, "Hof", q=replace(q, role="at_least" if how == "at_most" else "at_most"))
    bound = next((c.kind for c in found if c.kind in ("at_least", "at_most")), how if not q.value else "")
    sign = -1.0 if how == "at_most" and q.value else 1.0
    return merged(found, "Hof", q=Quantity(sign * q.value, "m", cast(Role, bound or "to")))


def _clear(found: Sequence[Chunk]) -> list[Chunk]:
    """What is not to be touched."""
    return [merged(found[:-1], "clear", value="flipped"), merged(found[-1:], "obj", value="")]


def _clear_by(found: Sequence[Chunk]) -> list[Chunk] | None:
    """Clear of it by 50 cm: a distance to keep, and not how much farther."""
    if "clear" not in found[0].text.lower():
        return None
    return [merged(found, "within_of", q=replace(numbers(found)[0], role="at_least"))]


HIGHER = "over|under|up|down|raise|lower|faster|slower"


def _behind(found: Sequence[Chunk]) -> list[Chunk] | None:
    """Higher behind the shelf: after it on the way."""
    behind = found[-1].text.lower() in ("behind", "in back of")
    return [*found[:-1], merged(found[-1:], "after")] if behind else None


COMPARED: tuple[tuple[str, Build], ...] = (
    (f"speed keep? {HIGHER} than? Qn|Qv and|comma keep|speed? {HIGHER} than? Qn|Qv", _two_speeds),
    ("speed at_most|at_least Qn|Qv and at_most|at_least Qn|Qv", _two_speeds),
    ("DIR|over|under of|to|from? OBJ comma|and? never pass? on|to|at|in? DIR|over|under of|to|from? OBJ?", _one_side),
    ("OBJ on|to|at DIR comma|and? never pass? on|to|at? DIR of|to|from? OBJ?", _one_side),
    ("pass DIR comma|and? never pass? on|to|at? DIR", _one_side),
    ("back|reverse by? Qm once? at|on|in|near|after goal", _back_along),
    ("at|on|in|near|after goal comma? back|reverse by? Qm", _back_along),
    ("up|down|raise|lower|slower|faster by? Qm|Qn? once? back (?=OBJ)", _behind),
    ("back (?=OBJ (?:comma )?(?:Qm (?:up|down) |raise |lower |slower |faster |up |down ))", _behind),
    ("stop|endup|goal Qm before pass|touch? to|of? OBJ", lambda f: [merged(f[:1], "stop"), merged(f[1:], "short")]),
    ("stop Qm from|in? front? of|to? OBJ", lambda f: [f[0], merged(f[1:], "short")]),
    ("never keep? up|down|raise|lower than OBJ", _height_of),
    ("Qm? up|down|raise|lower than OBJ", _height_of),
    ("at_least|at_most? level|height of|with|to? OBJ", _height_of),
    ("never|avoid touch|collide to|on|at|by|with|over? OBJ", _clear),
    ("never dec|inc|path|speed over? OBJ", lambda f: _clear(f) if f[1].text.lower() in KNOCKING else None),
    ("keep OBJ", lambda f: _clear(f) if "touch" in f[0].text.lower() else None),
    ("farther of|from|to? OBJ by? at_least? Qm", _clear_by),
)
"""Rows of classes, as in `constituents`, and what becomes of them."""
