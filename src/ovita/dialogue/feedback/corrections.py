"""Feedback that corrects where, which and which way: "only near the cup", "the other cup", "no, right"."""

from __future__ import annotations

import re

from ovita.dialogue.feedback.context import Context
from ovita.dialogue.feedback.resolution import SENSE, Resolution
from ovita.dialogue.feedback.rewording import (
    SpokenClause,
    direction_of,
    moved,
    region_words,
    replaced,
    understood_as,
    words_as_parts,
)
from ovita.dialogue.feedback.utterance import Utterance
from ovita.instruct.intents import WHOLE
from ovita.instruct.tokens import tokenize
from ovita.paths.frame import OPPOSITE
from ovita.paths.scene import SceneObject, canonical

_FLIP = re.compile(
    r"(?:(?:in|to|into) )?(?:the )?(?:other|opposite|wrong|reverse|contrary) (?:way|direction|side)(?: round| around)?"
    r"|(?:do )?(?:exactly )?the (?:opposite|reverse|contrary)"
    r"|(?:that is |it is )(?:the )?wrong (?:way|direction)(?: round)?"
    r"|opposite|the wrong way round|the other way (?:round|around)"
)
_WHOLE = re.compile(
    r"(?:on |over |for |along )?"
    r"(?:everywhere|all of it|(?:the )?(?:whole|entire|complete) (?:path|trajectory|way|thing|route)"
    r"|all along(?: the path)?|all over|the whole|not (?:just|only) .+)"
)
_ONLY = re.compile(
    r"(?:only|just|but only|but just|do (?:it|that) only|not everywhere,? (?:only|just)?) ?(.+)|(.+) (?:only|alone)"
)
_ALSO = re.compile(
    r"(?:and |also |do (?:it|that|this|so) )*(?:also |and )(?:do (?:it|that|this|so) )?(.+?)(?: too| as well)?"
    r"|(?:and )?(?:do (?:it|that|this|so) )?(.+?) (?:too|as well|also)"
)
_SAME = re.compile(
    r"(?:and |also |now )*(?:do |make )?(?:the )?same(?: thing)?"
    r" (?:for|at|with|near|around|to|by|on|again for|again at) (?:the )?(.+?)"
    r"(?: too| as well| please)?|(?:and |now )?(?:for )?(?:the )?(.+?) (?:the same|likewise)|what about (?:the )?(.+)"
)
_OTHER = re.compile(r"(?:(?:i (?:meant|mean|want|wanted) )?(?:near |at )?(?:the )?other|(?:the )?wrong) (\w+)")
_END = re.compile(r"(?:the )?(?:start|goal|end|beginning)(?: point)?")
_INSTEAD = re.compile(r"(?:the |near the |at the )?(.+?),? (?:instead of|rather than|and not|not) (?:the )?(.+)")
_NOT_BUT = re.compile(
    r"not (?:near |at |to )?(?:the )?(.+?)(?:,| but| rather)(?: but| rather)? (?:near |at |to )?(?:the )?(.+)"
)
_MEANT = re.compile(r"(?:i (?:meant|mean|said|want|wanted|was talking about)|rather|it should be|make it|try) (.+)")

_COMPARES = re.compile(r"\b(?:higher|lower|closer|nearer|further|farther|faster|slower|more|less)\b")
"""Words that make an amount of "make it ...", which is relative to the present one."""

_TURNED = (
    ("slower", "speed up"),
    ("faster", "slow down"),
    ("closer", "away from"),
    ("away", "closer to"),
    ("increase", "decrease"),
    ("decrease", "increase"),
    ("double", "halve"),
    ("half", "double"),
    ("more", "less"),
    ("fewer", "more"),
    ("clockwise", "counterclockwise"),
    ("anticlockwise", "clockwise"),
    ("lower", "raise"),
    ("raise", "lower"),
)


def corrected(said: Utterance, c: Context) -> Resolution | None:
    """Read feedback that says where, which object or which way instead."""
    text = said.text
    if _FLIP.fullmatch(text):
        return _flipped(c)
    if not c.parts:
        return None
    if _WHOLE.fullmatch(text.replace(",", "")):
        return _placed("", c)
    for reading in (_the_other, _a_not_b, _same_for, _also, _only, _meant):
        found = reading(said, c)
        if found is not None:
            return found
    return None


def _only(said: Utterance, c: Context) -> Resolution | None:
    match = _ONLY.fullmatch(said.text)
    return _placed(match[1] or match[2], c) if match else None


def _meant(said: Utterance, c: Context) -> Resolution | None:
    """I meant the table; no, right; no, near the bottle; no, the first half."""
    match = _MEANT.fullmatch(said.text)
    if not (match or said.corrects or re.fullmatch(r"(?:the )?[^\W\d]+ one|(?:both|all) .+", said.text)):
        return None
    if match and _COMPARES.search(match[1]) and not said.corrects:
        return None
    words = re.sub(r" (?:i mean|i meant|instead|then|rather)$", "", match[1] if match else said.text)
    found = _turned_to(words, c) or _other_end(words, c) or _swapped_to(words, c) or _placed(words, c)
    return found or (_action_instead(words, c) if said.corrects else None)


def _other_end(words: str, c: Context, *, on_current: bool = False) -> Resolution | None:
    """The goal in place of the start, or the other way round."""
    if not _END.fullmatch(words):
        return None
    turned = {"start": "goal", "goal": "start"}
    wanted = "start" if re.search("start|beginning", words) else "goal"
    ends = [part for part in c.parts if any(piece.family == turned[wanted] for piece in part.pieces)]
    parts = [replaced(p, c.scene, lambda t: wanted if t.value == turned[wanted] else None) or p for p in ends]
    if on_current:
        return c.rewritten(parts, on_current=True) if parts else None
    others = [part for part in c.parts if part not in ends]
    return c.rewritten([*others, *parts]) if parts else None


def _action_instead(words: str, c: Context) -> Resolution | None:
    """Left by 0.3 instead; no, speed up; closer to the bottle instead: in place of the clause that it puts right."""
    new = words_as_parts(re.sub(r" there$", "", words), c.scene)
    if new is None or len(new) != 1 or len(new[0].pieces) != 1:
        return None
    piece = new[0].pieces[0]
    alike = [i for i, part in enumerate(c.parts) if len(part.pieces) == 1 and part.pieces[0].family == piece.family]
    if not alike and len(c.parts) == 1:
        return c.rewritten(new)
    if len(alike) != 1:
        return None
    old, place = c.parts[alike[0]].pieces[0], alike[0]
    stated = piece.intent.amount is not None or any(metres is not None for _, metres in piece.intent.directions)
    part: SpokenClause | None = new[0]
    if not stated and piece.items and len(_items(c)) == 1 and piece.sense in ("", old.sense):
        return _swap(_items(c)[0], piece.items[0], c) if len(piece.items) == 1 else None
    if piece.intent.region == WHOLE != old.intent.region:
        part = moved(new[0], region_words(c.parts[place], old, c.scene), c.scene)
    return c.rewritten([*c.parts[:place], part, *c.parts[place + 1 :]]) if part else None


def _turned_to(words: str, c: Context) -> Resolution | None:
    """Another direction."""
    tokens = [t for t in tokenize(words, c.scene)[0] if t.kind not in ("filler", "break", "join")]
    if len(tokens) != 1 or direction_of(tokens[0]) == "":
        return None
    new = direction_of(tokens[0])
    named = [word for part in c.parts for piece in part.pieces for word in piece.directions]
    old = OPPOSITE[new] if OPPOSITE[new] in named else named[0] if len(named) == 1 else ""
    parts = [replaced(p, c.scene, lambda t: new if direction_of(t) == old else None) or p for p in c.parts]
    return c.rewritten(parts) if old and new not in named else None


def _flipped(c: Context) -> Resolution | None:
    """All directions turned round; where there are none, slower is faster and closer is away."""
    parts = tuple(replaced(p, c.scene, lambda t: OPPOSITE.get(direction_of(t))) for p in c.parts)
    if not any(parts):
        turned = dict(_TURNED)
        parts = tuple(
            replaced(p, c.scene, lambda t: turned.get(t.value) if t.kind == "concept" else None) for p in c.parts
        )
    changed = [p or old for p, old in zip(parts, c.parts, strict=True)]
    return c.rewritten(changed) if any(parts) else _negated(c)


def _negated(c: Context) -> Resolution | None:
    """Shifts and angles with the other sign."""
    knobs = [k for k in c.knobs if k.primary and k.family in ("shift", "rotate", "tilt") and not k.is_factor]
    values = {k.name: -k.value for k in knobs}
    if not knobs or len({k.group for k in knobs}) > 1:
        return None
    turned = ", ".join(f"{k.name} {k.shown(k.value)} -> {k.shown(values[k.name])}" for k in knobs)
    return Resolution("tune", c.took(turned), values)


def _the_other(said: Utterance, c: Context) -> Resolution | None:
    match = _OTHER.fullmatch(said.text)
    return _swap_other(match[1], c) if match else None


def _swap_other(word: str, c: Context, *, on_current: bool = False) -> Resolution | None:
    used = _items(c)
    heads = {canonical(item.name).split()[-1] for item in used}
    wanted = heads if word in ("one", "object", "thing") else {word}
    others = [i for i in c.scene if canonical(i.name).split()[-1] in wanted and i not in used]
    if not others and word in ("one", "object", "thing"):
        others = [i for i in c.scene if i not in used]
    if len(used) != 1 or not others:
        return None
    if len(others) > 1:
        names = " or ".join(repr(item.name) for item in others)
        return Resolution("ask", c.took("another object"), question=f"Which one: {names}?")
    return _swap(used[0], others[0], c, on_current=on_current)


def _a_not_b(said: Utterance, c: Context) -> Resolution | None:
    """The bottle instead of the cup; not the cup, the bottle."""
    match = _NOT_BUT.fullmatch(said.text)
    new, old = (match[2], match[1]) if match else ("", "")
    if match is None:
        match = _INSTEAD.fullmatch(said.text)
        new, old = (match[1], match[2]) if match else ("", "")
    news, olds = c.objects(new), c.objects(old)
    if len(news) == 1 and len(olds) == 1 and any(olds[0] is item for item in _items(c)):
        return _swap(olds[0], news[0], c)
    return _meant(Utterance(new, corrects=True), c) if match and (c.objects(old) or _names_change(old, c)) else None


def _names_change(words: str, c: Context) -> bool:
    return any(direction_of(t) or t.value in SENSE for t in tokenize(words, c.scene)[0])


def _swapped_to(words: str, c: Context) -> Resolution | None:
    words = re.sub(r"^(?:near|at|by|to|around|for) (?=the |\w)", "", words)
    news, used = c.objects(words), _items(c)
    if len(news) == 1 and len(used) == 1 and news[0] is not used[0]:
        return _swap(used[0], news[0], c)
    return None


def _same_for(said: Utterance, c: Context) -> Resolution | None:
    """The same for the bottle, as a further turn."""
    match = _SAME.fullmatch(said.text)
    words = next((g for g in match.groups() if g), "") if match else ""
    return _further(words, c) if words else None


def _also(said: Utterance, c: Context) -> Resolution | None:
    """Also near the table, as a further turn."""
    match = _ALSO.fullmatch(said.text)
    if match is None:
        return None
    words = match[1] or match[2]
    if not _OTHER.fullmatch(words) and understood_as(words, c.scene) and not c.objects(_bare(words)):
        return None
    return _further(words, c)


def _further(words: str, c: Context) -> Resolution | None:
    other = _OTHER.fullmatch(words)
    if other:
        return _swap_other(other[1], c, on_current=True)
    if _END.fullmatch(words) and (found := _other_end(words, c, on_current=True)):
        return found
    news, used = c.objects(_bare(words)), _items(c)
    if len(news) == 1 and len(used) == 1 and news[0] is not used[0]:
        return _swap(used[0], news[0], c, on_current=True)
    return _placed(words, c, on_current=True)


def _bare(words: str) -> str:
    return re.sub(r"^(?:near|at|by|to|around|for|with|from|towards|toward|over) ", "", words)


def _swap(old: SceneObject, new: SceneObject, c: Context, *, on_current: bool = False) -> Resolution | None:
    """The last turn about another object; as a further turn only those clauses that are about one."""
    parts: list[SpokenClause] = []
    for part in c.parts:
        found = replaced(part, c.scene, lambda t: new.name if len(t.items) == 1 and t.items[0] is old else None)
        if found or not on_current:
            parts.append(found or part)
    return c.rewritten(parts, on_current=on_current) if parts else None


def _items(c: Context) -> list[SceneObject]:
    found: list[SceneObject] = []
    for part in c.parts:
        for piece in part.pieces:
            found += [item for item in piece.items if not any(item is known for known in found)]
    return found


def _placed(words: str, c: Context, *, on_current: bool = False) -> Resolution | None:
    """The last turn on another part of the path; "" is the whole path."""
    changed: list[tuple[int, SpokenClause]] = []
    for i, part in enumerate(c.parts):
        placed = moved(part, words, c.scene)
        if placed is not None:
            changed.append((i, placed))
    if len(changed) > 1:
        changed = [(i, p) for i, p in changed if c.parts[i].pieces[0].intent.region != WHOLE] or changed
    if len(changed) > 1:
        listed = " or ".join(repr(c.parts[i].text) for i, _ in changed)
        return Resolution("ask", c.took("another part of the path"), question=f"Which do you mean: {listed}?")
    if not changed:
        return None
    place, part = changed[0]
    if on_current:
        return c.rewritten([part], on_current=True)
    return c.rewritten([*c.parts[:place], part, *c.parts[place + 1 :]])
