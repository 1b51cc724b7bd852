"""Where feedback is about: the parts of the path that an utterance names, and what is restricted to them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

from ovita.instruct import edits as E
from ovita.instruct.remarks import Candidate, Phrase, Remark, steps_of
from ovita.paths.part import WHOLE, PathPart
from ovita.units import find

SHARES = {"half": 0.5, "third": 1 / 3, "quarter": 0.25, "fifth": 0.2, "tenth": 0.1}

TURNS = frozenset("change changes turn step edit one instruction modification".split())


def places(said: Remark) -> Iterator[Candidate]:
    """Only in a part of the path, or everywhere but there."""
    only, but = said.cued("only"), said.cued("except")
    known = {name for frame in said.before for name in frame.named}
    parts = [part for part in parts_in(said) if only or but or not set(part[2][0].items) & known]
    if not parts or not said.before or said.cued("vague"):
        return
    leading = any(p.text == "but" for p in said.active[:1]) and said.cued("not")
    open_ = [] if leading else [p for p in parts if not p[1]]
    pieces = tuple(piece for part in parts for piece in part[2])
    i = said.targets[-1]
    on = said.on(i) if len(said.targets) == 1 else ""
    if also := [] if only or any(p.items for p in pieces) else said.cued("also"):  # "over the last part too"
        further = replace(said.before[i], part=parts[-1][0])
        yield Candidate((E.Also(frame=further),), (*pieces, *also), 0.8)
    clauses = {p.clause for p in pieces}
    drops = [p for p in said.cued("undo") if len(said.before) == 1 and p.clause in clauses]
    drops = [] if any(steps_of(p) for p in pieces) else drops
    if but or drops or (not open_ and not only):
        edits = tuple(E.Except(on=on, part=part) for part in dict.fromkeys(part[0] for part in parts))
        yield Candidate(edits, (*pieces, *but, *drops, *said.cued("not")), 0.6)
    corrects = len(parts) > len(open_) or said.before[i].part != WHOLE
    if open_ and (only or corrects or not but):
        edit = E.Restrict(on=on, part=open_[-1][0])
        used = (*pieces, *only, *said.cued("meant", "not"))
        yield Candidate((edit,), used, 0.8 if only else 0.0 if corrects else -1.5)


def everywhere(said: Remark) -> Iterator[Candidate]:
    """On the whole path, where a part was said before."""
    whole = said.cued("whole")
    if whole and said.before and said.before[said.targets[-1]].part != WHOLE:
        yield Candidate((E.Restrict(on=said.on(said.targets[-1]), part=WHOLE),), tuple(whole), 0.0)


def parts_in(said: Remark) -> Iterator[tuple[PathPart, bool, tuple[Phrase, ...]]]:
    """The parts of the path that are named, whether "not" stands before them, and their pieces."""
    pieces = said.active
    for i, piece in enumerate(pieces):
        before = pieces[max(i - 3, 0) : i]
        said_not = said.negated(piece) or any("not" in p.text.split() for p in before[-1:])
        words = {p.concept for p in before}
        behind = pieces[i + 1 : i + 4]
        if piece.items:
            kind = next((k for k in ("after", "before") if k in words), "near")
            kind = "before" if "up to" in " ".join(p.text for p in before) else kind
            lead = tuple(p for p in before if p.concept in ("after", "before", "near", "around", "when", "pass"))
            two = [p for p in behind if p.items]
            if "between" in words and two:
                yield PathPart("between", (piece.items[0], two[0].items[0])), said_not, (piece, two[0], *before)
                return
            if "between" not in words:
                yield _at(kind, piece.items), said_not, (piece, *lead)
        elif _stretches(piece, behind):
            part, used = _stretch(piece, behind)
            yield part, said_not, (piece, *used)
        elif piece.concept == "waypoints" and behind and behind[0].number and i + 2 < len(pieces):
            last = next((p for p in pieces[i + 2 : i + 4] if p.number), None)
            if last is not None and last.number is not None:
                low, high = behind[0].number.value - 1, last.number.value - 1
                yield PathPart("range", amount=low, until=high), said_not, (piece, behind[0], last)
        elif piece.concept in ("up", "down") and any(p.concept in ("when", "only") for p in before):
            yield PathPart("heading", direction=piece.concept), said_not, (piece, *before)


def _at(kind: str, items: Sequence[str]) -> PathPart:
    parts = tuple(PathPart(kind, (name,)) for name in items)
    return parts[0] if len(parts) == 1 else PathPart("either", parts=parts)


def _stretch(piece: Phrase, behind: Sequence[Phrase]) -> tuple[PathPart, tuple[Phrase, ...]]:
    kind = {"start": "first", "goal": "last"}.get(piece.concept, piece.concept)
    if kind == "second":
        return (PathPart("last", amount=0.5, unit="share") if behind[0].concept == "half" else PathPart("middle")), (
            behind[0],
        )
    share = next((p for p in behind[:1] if p.concept in SHARES), None)
    number = next((p for p in behind[:1] if p.number), None)
    if share is not None:
        return PathPart(kind, amount=SHARES[share.concept], unit="share"), (share,)
    if number is not None and number.number is not None:
        units: dict[str, Any] = {"%": "share", "m": "m", "s": "s"}
        return PathPart(kind, amount=number.number.value, unit=units.get(number.number.unit, "waypoints")), tuple(
            behind
        )
    unit = find(behind[0].text) if behind else None
    if unit is not None and unit.dimension == "m" and not behind[0].concept:
        return PathPart(kind, amount=unit.factor, unit="m"), (behind[0],)
    return (PathPart("middle") if kind == "middle" else PathPart(kind, unit="share")), ()


def _stretches(piece: Phrase, behind: Sequence[Phrase]) -> bool:
    """Whether a stretch of the path begins there: "the last third", "the second half"."""
    if piece.concept == "second":
        return any(p.concept in ("half", "third") for p in behind[:1])
    return piece.concept in ("first", "last", "middle", "start", "goal") and not {p.text for p in behind[:1]} & TURNS
