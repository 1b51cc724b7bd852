"""Which of the changes feedback is about, where its words settle that: by number, by name, by direction, or all."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

from ovita.instruct import edits as E
from ovita.instruct import frames as F
from ovita.instruct.editing import OPPOSITE, directions_of, is_called, slots
from ovita.instruct.objects import head_of, singular
from ovita.instruct.remarks import SENSES, Remark, heading, words_in
from ovita.instruct.revised import held_in
from ovita.paths.part import WHOLE, PathPart
from ovita.paths.scene import Scene, canonical

NUMBERED = {"first": 1, "second": 2, "third": 3, "fourth": 4}
COUNTS = {"both": 2, "two": 2, "2": 2, "twice": 2, "three": 3, "3": 3, "four": 4, "4": 4}
"""Words for one of the turns, and for how many of them."""

CHANGES = frozenset("one turn step change thing request wish edit instruction".split())
"""Words for what was done in a turn."""

EVERYWHERE = frozenset("everywhere throughout whole entire all".split())
ALONG = frozenset("path way route trajectory time along over it make do that on the of in for".split()) | EVERYWHERE
"""Words for the whole path, and those beside them that say no more."""

DENYING = frozenset("not no without never".split())

_OTHER = re.compile(r"\b(?:(?:the|that|this|a) )?(other|wrong) (\w+)\b", re.IGNORECASE)


def other_one(text: str, scene: Scene, before: Sequence[F.SemanticFrame]) -> str:
    """Feedback with "the other cup", "the wrong cup" as the name of the one thing of that kind that was not meant.

    Args:
        text: As it was said.
        scene: Whose objects it may name.
        before: The frames that it is about.
    """
    found = _OTHER.search(text)
    meant = {name for frame in before for name in frame.named}
    if found is None or not meant:
        return text
    noun, words = singular(found[2].lower()), {*text.lower().split()}
    instead = words <= {*found[0].lower().split(), *INSTEAD} or found[1].lower() == "wrong"
    kinds = {*map(_kind, meant)}
    kinds &= kinds if noun == "one" else {noun}
    others = [item.name for item in scene if _kind(item.name) in kinds and item.name not in meant]
    if len(others) != 1:
        return text
    return f"{text[: found.start()]}{'I meant ' * instead}the {others[0]}{text[found.end() :]}"


INSTEAD = frozenset("no no, not please one oops sorry sorry, wait i mean meant, meant".split())
"""Words beside "the other one" with which it is meant instead of what was said, not besides."""


def _kind(name: str) -> str:
    """The noun in an object's name."""
    return head_of(canonical(name).split())


def settled(reading: F.Reading, said: Remark) -> F.Reading:
    """Feedback about what its words name, where they say it plainly.

    Args:
        reading: As it was read.
        said: The utterance against the frames before it.
    """
    plain: Sequence[E.Edit] = ()
    if len(reading.edits) <= 2 or all(isinstance(edit, E.Drop | E.Command) for edit in reading.edits):
        plain = next(filter(None, (rule(reading.edits, said) for rule in PLAINLY)), ())
    if plain:
        return replace(reading, edits=tuple(plain), unread=(), question="", confidence=max(reading.confidence, CLEAR))
    edits = tuple(_so_many(edit, said) for edit in reading.edits) if len(reading.edits) == 1 else reading.edits
    edits = tuple(_called(_at_its_end(_instead(_compared(edit, said), said), said), said) for edit in edits)
    return replace(reading, edits=edits)


def _turn_given_up(edits: Sequence[E.Edit], said: Remark) -> Sequence[E.Edit]:
    """Without one of the turns, by its number: "forget the first one"."""
    given_up = edits and all(isinstance(edit, E.Drop | E.Command) for edit in edits)
    turn = _numbered(said) if given_up else 0
    return [E.Drop(on=f"turn {turn}")] if turn else []


def _mere_no(edits: Sequence[E.Edit], said: Remark) -> Sequence[E.Edit]:
    """A step back, where only no is said: "please don't"."""
    words = words_in(said.pieces)
    return [E.Command(command="undo")] if DENYING & {*words} and REFUSING.issuperset(words) else []


def _only_there(edits: Sequence[E.Edit], said: Remark) -> Sequence[E.Edit]:
    """Only in the part that was taken for the one to leave out: "not everywhere, only over the bottle"."""
    words = words_in(said.pieces)
    match edits:
        case [E.Except(on=on, part=part)] if "not everywhere" in " ".join(words) and "only" in words:
            return [E.Restrict(on=on, part=part)]
    return []


def _everywhere(edits: Sequence[E.Edit], said: Remark) -> Sequence[E.Edit]:
    """On the whole path, where nothing else is said."""
    words, placed = words_in(said.pieces), _last_placed(said)
    if placed is None or EVERYWHERE.isdisjoint(words) or not ALONG.issuperset(words):
        return []
    return [E.Restrict(on=said.on(placed), part=WHOLE)]


def _other_part(edits: Sequence[E.Edit], said: Remark) -> Sequence[E.Edit]:
    """In the other half, where nothing else is said."""
    words, placed = words_in(said.pieces), _last_placed(said)
    if placed is None or "other" not in words or PARTS.isdisjoint(words) or not OTHER_PART.issuperset(words):
        return []
    part = said.before[placed].part
    kind = OTHER_KIND.get(part.kind, "")
    return [E.Restrict(on=said.on(placed), part=replace(part, kind=kind))] if kind else []


def _last_placed(said: Remark) -> int | None:
    """The number of the last change of a part of the path; None of none."""
    return next((i for i in reversed(range(len(said.before))) if said.before[i].part), None)


def _but_both_ends(edits: Sequence[E.Edit], said: Remark) -> Sequence[E.Edit]:
    """Without both ends, where one was read and both are named."""
    ends = [edit for edit in edits if isinstance(edit, E.Except) and edit.part.kind in ("first", "last")]
    if not ends or len(ends) < len(edits) or not _both_ends(said):
        return []
    return [replace(ends[0], part=replace(ends[0].part, kind=kind)) for kind in ("first", "last")]


OTHER_KIND = {"first": "last", "last": "first", "before": "after", "after": "before"}
PARTS = frozenset("half third quarter end part".split())
OTHER_PART = PARTS | frozenset("no not the other in on please i meant mean sorry of it , . !".split())
"""The part that another is not, words for parts, and all words of an utterance that means the other one."""


def _ends_kept(edits: Sequence[E.Edit], said: Remark) -> Sequence[E.Edit]:
    """What leaves the ends that are named where they were, of the one change: "the end should stay where it was"."""
    ends = [end for end in ("start", "goal") if _both_ends(said) or end in {p.concept for p in said.pieces}]
    told = any(p.number or p.items or heading(p) for p in said.pieces)
    if not ends or told or STAYS.isdisjoint(words_in(said.pieces)) or len(said.before) != 1 or said.before[0].part:
        return []
    kinds = {"start": "first", "goal": "last"}
    return [E.Except(part=PathPart(kinds[end])) for end in ends]


def _another_so_much(edits: Sequence[E.Edit], said: Remark) -> Sequence[E.Edit]:
    """So much more of the only amount there is: "another 3 cm"."""
    numbers = [piece.number for piece in said.pieces if piece.number]
    rest = {word for piece in said.pieces if not piece.number for word in piece.text.split()}
    if len(said.before) != 1 or len(numbers) != 1 or not rest & ANOTHER or not rest <= ANOTHER | BESIDES:
        return []
    slot = next((slot for slot, units in slots(said.before[0]).items() if numbers[0].unit in units), "")
    return [E.Set(slot=slot, quantity=numbers[0], step=1)] if slot and numbers[0].unit else []


ANOTHER, BESIDES = frozenset(("another", "extra", "additional")), frozenset("please , . ! and by an".split())
"""Words for an amount that is added, and those beside it."""

STAYS = frozenset("stay stays keep leave remain remains".split())
"""Words for what is not to move."""


def _both_ends(said: Remark) -> bool:
    """Whether both ends of the path are named."""
    named = {piece.concept for piece in said.pieces}
    return {"start", "goal"} <= named or "ends" in words_in(said.pieces)


def unasked(reading: F.Reading, said: Remark) -> F.Reading:
    """Feedback that the reader asks about, or is not sure of, where its words can mean only one thing.

    That is more or less of the only change, and a plain number for the slot that has one.
    """
    words, named = words_in(said.pieces), said.meant(said.pieces)
    if not reading.edits and "again" in words and REPEATING.issuperset(words):
        return replace(reading, edits=(E.Again(),), question="", confidence=CLEAR)
    if not reading.edits and (len(said.before) == 1 or len(named) == 1) and (edit := _of_the_one(said, words)):
        return replace(reading, edits=(edit,), question="", confidence=max(reading.confidence, CLEAR))
    match reading.edits:
        case (E.Set(slot=slot),) if PLAIN.issuperset(word for word in words if word.isalpha()):
            having = [f for f in said.before if slot in (*f.quantities, *directions_of(f))] or said.before
            return replace(reading, confidence=max(reading.confidence, CLEAR)) if len(having) == 1 else reading
    return reading


def _of_the_one(said: Remark, words: Sequence[str]) -> E.Edit | None:
    """More or less of the only change."""
    more, less = said.cued("more"), said.cued("less")
    if bool(more) == bool(less) or any(piece.number or piece.items for piece in said.pieces):
        return None
    on = said.on((said.meant(said.pieces) or [0])[0])
    return E.Rescale(on=on, change="more" if more else "less", degree="slight" if said.cued("slight") else None)


CLEAR = 0.9
"""How sure what words plainly say is."""

REPEATING = frozenset("again once more please the same do it that and . ! ,".split())
REFUSING = frozenset("not no never do please nope nah i did mean that this , . !".split())
PLAIN = frozenset(
    """make it that this set to by more less increase decrease reduce raise lower please another instead use try only
    just change put at m cm mm s percent metres meters metre seconds times and the a x""".split()
)
"""Words of a mere repetition, of a mere no, and those beside a plain number."""


def _so_many(edit: E.Edit, said: Remark) -> E.Edit:
    """So many steps back or forth as are counted: "undo both"."""
    plain = (p for p in said.pieces if p.number is None or p.number.unit in ("", "step", "x"))
    counts = [COUNTS[word] for piece in plain for word in piece.text.split() if word in COUNTS]
    several = isinstance(edit, E.Command) and edit.command in ("undo", "redo") and edit.steps == 1 and len(counts) == 1
    return replace(edit, steps=counts[0]) if several else edit  # type: ignore[call-arg]


def _numbered(said: Remark) -> int:
    """The number of the turn that is given up: "forget the first one", "only the first" of two; 0 for none."""
    told: dict[bool, list[int]] = {True: [], False: []}
    for before, piece, behind in zip(said.pieces, said.pieces[1:], (*said.pieces[2:], None), strict=False):
        number = NUMBERED.get(piece.text.split()[-1], 0)
        if number and before.text in ("the", "my", "that") and (behind is None or behind.text in ENDING):
            clause = {word for p in said.pieces if p.clause == piece.clause for word in p.text.split()}
            if clause.isdisjoint(LIKED):
                told[not clause.isdisjoint(STAYING)].append(number)
    if len(told[False]) == 1:
        return told[False][0]
    return 3 - told[True][0] if len(told[True]) == 1 and len(said.before) == 2 and told[True][0] < 3 else 0


ENDING = CHANGES | frozenset(", . ! ? ; i again out please".split())
LIKED = frozenset("fine good right perfect great lovely nice".split())
STAYING = frozenset("only just keep".split())
"""Words behind a number of a turn, and in clauses of what was right and of what is to stay."""


def _without_ways(edits: Sequence[E.Edit], said: Remark) -> Sequence[E.Edit]:
    """Without directions among several, where nothing else is said: "not forward", "only left"."""
    ways = {way for frame in said.before for way in directions_of(frame)}
    pieces = [piece for piece in said.pieces if piece.content and piece.text not in DENYING]
    words, named = {*words_in(said.pieces)}, [heading(piece) for piece in pieces if not piece.cues & {"only", "not"}]
    if not named or not all(named) or not {*named} < ways:
        return []
    gone = named if DENYING & words else sorted(ways - {*named}) if words & {"only", "just"} else []
    return [E.Drop(on=way) for way in gone]


def _compared(edit: E.Edit, said: Remark) -> E.Edit:
    """A change as more or less, by the comparative that says it: "lower it again" of what went up."""
    if isinstance(edit, E.Again):
        less = _compared(E.Rescale(on=edit.on), said)
        return less if isinstance(less, E.Rescale) and less.change == "less" else edit
    if not isinstance(edit, E.Rescale):
        return edit
    if edit.factor is not None:
        paced = any(isinstance(frame, F.Pace) for frame in said.before)
        left = paced and "of what it was" in " ".join(words_in(said.pieces))
        return E.Set(on=edit.on, slot="to", quantity=F.Quantity(edit.factor, "x", "to")) if left else edit
    about = [frame for frame in said.before if not edit.on or is_called(frame, edit.on)]
    if edit.change and not TURNING.isdisjoint(words_in(said.pieces)):
        return edit
    senses = {sense for frame in about for sense in _senses(frame)}
    for sense in (SENSES.get(piece.concept, "") for piece in said.pieces if piece.text.endswith("er")):
        if sense in senses or OPPOSITE.get(sense, sense) in senses:
            return replace(edit, change="more" if sense in senses else "less")
    return edit


TURNING = frozenset("too not less enough so never no much as".split())
"""Words that turn a comparative round: "not so slow"."""


def _turned_round(edits: Sequence[E.Edit], said: Remark) -> Sequence[E.Edit]:
    """The other way round, where the opposite of a change is said, and itself denied: "no, slower, not faster"."""
    plain, denied = set[str](), set[str]()
    for before, piece in pairwise((None, *said.pieces)):
        if piece is not None and (sense := SENSES.get(piece.concept, "")):
            (denied if before is not None and before.text == "not" else plain).add(sense)
    about = [i for i, frame in enumerate(said.before) if denied & _senses(frame)]
    turned = len(denied) == len(about) == 1 and {OPPOSITE.get(sense) for sense in plain} == denied
    return [E.Flip(on=said.on(about[0]))] if turned else []


def _another_thing(edits: Sequence[E.Edit], said: Remark) -> Sequence[E.Edit]:
    """Another thing in place of the last that was named, where only that is said: "I meant the bottle"."""
    content = [piece for piece in said.pieces if piece.content and not piece.cues & {"meant", "not", "only"}]
    things = [piece for piece in content if piece.items]
    known = [i for i, frame in enumerate(said.before) if frame.named]
    if not said.cued("meant") or len(things) != 1 or len(content) != 1 or not known or len(things[0].items) != 1:
        return []
    return [E.Replace(on=said.on(known[-1]), objects=things[0].items)]


def _at_its_end(edit: E.Edit, said: Remark) -> E.Edit:
    """An exception at the end of the path that is named, and a change of the end that is."""
    ends = {piece.concept for piece in said.pieces} & {"start", "goal"}
    if len(ends) != 1 or len(words_in(said.pieces)) > CURT:
        return edit
    (end,) = ends
    if isinstance(edit, E.Except) and edit.part.kind in ("first", "last"):
        return replace(edit, part=replace(edit.part, kind="first" if end == "start" else "last"))
    moved = [i for i, frame in enumerate(said.before) if isinstance(frame, F.MoveEnd) and frame.end == end]
    return replace(edit, on=said.on(moved[0])) if isinstance(edit, E.Rescale) and len(moved) == 1 else edit


CURT = 9
"""Words of an utterance that is so short that an end which it names is what it is about."""


def _called(edit: E.Edit, said: Remark) -> E.Edit:
    """Another value of a frame that is called so, or else of the one that has the slot."""
    numbers = [piece.number for piece in said.pieces if piece.number]
    if (
        isinstance(edit, E.Set)
        and edit.slot in ("radius", "size")
        and len(numbers) == 1
        and _counts_turns(numbers[0], said)
    ):
        return replace(edit, slot="turns", quantity=replace(numbers[0], role="by"))
    if not isinstance(edit, E.Set) or not edit.on or any(is_called(frame, edit.on) for frame in said.before):
        return edit
    having = [i for i, frame in enumerate(said.before) if edit.slot in dict(held_in(frame))]
    return replace(edit, on=said.on(having[0])) if len(having) == 1 else edit


def _counts_turns(number: F.Quantity, said: Remark) -> bool:
    """Whether a bare number is one of turns, where turns are counted: "make it three"."""
    counted = any(isinstance(frame, F.Figure) and frame.turns is not None for frame in said.before)
    return counted and not number.unit and number.value in range(1, 11)


def _instead(edit: E.Edit, said: Remark) -> E.Edit:
    """Another value for the slot whose old value is said beside it: "15 cm instead of 10 cm"."""
    numbers = [piece.number for piece in said.pieces if piece.number]
    if not isinstance(edit, E.Set) or len(numbers) != 2 or edit.step:
        return edit
    had = [(i, slot, q) for i, frame in enumerate(said.before) for slot, q in dict(held_in(frame)).items()]
    old = [(i, slot) for i, slot, q in had if any(math.isclose(q.value, n.value) and _alike(n, q) for n in numbers)]
    others = [n for n in numbers if not any(math.isclose(q.value, n.value) for _, _, q in had)]
    if len(old) != 1 or len(others) != 1 or not math.isclose(others[0].value, edit.quantity.value):
        return edit
    return replace(edit, on=said.on(old[0][0]), slot=old[0][1])


def _alike(number: F.Quantity, had: F.Quantity) -> bool:
    return number.unit in ("", had.unit)


def _senses(frame: F.SemanticFrame) -> set[str]:
    """What there is more of where a frame's amount grows; of a time that the way takes that is slowness."""
    if isinstance(frame, F.Pace) and frame.amount is not None and frame.change in ("set", "cap", "floor"):
        slow = frame.amount.unit == "s" or (frame.amount.unit in ("x", "%") and frame.amount.value < 1.0)
        return {"slower" if slow else "faster"}
    return {*directions_of(frame), str(getattr(frame, "change", "")), str(getattr(frame, "sense", ""))} - {""}


PLAINLY = (
    _turn_given_up, _mere_no, _ends_kept, _another_so_much, _another_thing, _turned_round, _without_ways, _everywhere,
    _other_part, _only_there, _but_both_ends,
)  # fmt: skip
"""What words say by themselves, whatever was read; the first that does counts."""
