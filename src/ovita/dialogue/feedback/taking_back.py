"""Feedback that undoes, repeats or accepts: "undo that", "forget the shift", "again", "perfect"."""

from __future__ import annotations

import re

from ovita.dialogue.feedback.context import Context, Knob, all_parts
from ovita.dialogue.feedback.resolution import Reference, Resolution
from ovita.dialogue.feedback.rewording import SpokenClause, worded
from ovita.dialogue.feedback.utterance import Utterance
from ovita.instruct.numbers import NUMBER_WORDS

_LAST = r"(?: (?:the )?(?:last|latest|previous) (?:one|turn|change|step|thing|edit|instruction|modification))"
_THAT = r"(?: (?:that|it|this)(?: (?:change|again|one|turn|step))?)"
UNDO = re.compile(
    rf"(?:undo|revert|cancel|forget|discard|scrap)"
    rf"(?:{_THAT}|{_LAST}| the last| about (?:that|it)| please)?"
    r"|(?:go |take )?back"
    r"|go back(?: (?:to|one) (?:before|(?:the )?(?:previous|last)(?: (?:one|version|state))?|step))?"
    r"|(?:take|put) (?:that|it|this)(?: \w+)? back|take back (?:that|the last (?:one|change|step))"
    r"|never ?mind|(?:make it )?(?:as|like) (?:it was )?before|that was (?:wrong|a mistake)"
    r"|(?:it|that|this) was (?:better|fine|good|right|nicer) before"
    r"|(?:the )?previous (?:one|version)|i d(?:id|o) not (?:mean|want|like) (?:that|this|it)"
    r"|(?:do )?not(?: that| do that)?|(?:no )?undo"
)
UNDO_MANY = re.compile(
    r"(?:undo|revert|take back|forget|go back|back)(?: the)?(?: last)? (\w+)"
    r"(?: of (?:them|these|those))?(?: (?:steps|turns|changes|times|ones|things))?"
)
RESTART = re.compile(
    r"(?:let us )?(?:start|begin) (?:over|again|afresh|anew|from scratch|from the beginning|from the original)"
    r"|(?:from|back to) scratch|reset(?: (?:it|that|all|everything))?(?: to the original)?"
    r"|(?:undo|forget|cancel|discard|revert|drop) (?:all|everything|it all|all of (?:it|that|them)"
    r"|all (?:the )?changes)"
    r"|(?:go |get )?back to (?:the )?original(?: (?:path|trajectory|one))?"
    r"|(?:the )?original(?: (?:path|one))?(?: again)?"
    r"|(?:restore|use|take) (?:the )?original(?: (?:path|trajectory|one))?"
)
ORDINAL = re.compile(
    r"(?:undo|forget|drop|without|remove|cancel|revert|take back)(?: the)? (first|second|third|fourth|fifth)"
    r" (?:one|turn|step|change|instruction|thing)"
)
REDO = re.compile(r"redo(?: that| it| this)?|(?:bring|put|get) (?:it|that) back(?: again)?|restore (?:it|that)")
AGAIN = re.compile(
    r"(?:do |try )?(?:it |that |this |the same )?(?:once )?(?:again|once more|one more time|another time)"
    r"|(?:the )?same again|do (?:it|that) twice|(?:repeat|redo)(?: that| it| this)?(?: (?:again|once more))?"
    r"|(?:and )?the same(?: (?:again|once more))"
)
_PRAISE = frozenset(
    "perfect great good fine nice excellent exactly correct super awesome cool wonderful better".split()
)
_ACCEPT = re.compile(
    r"(?:keep|leave) (?:it|that|this)(?: (?:like|as) (?:that|this|it is|is))?|that is it|done"
    r"|that is (?:exactly |just )?what i (?:wanted|meant|want|had in mind)"
    r"|i like (?:it|that)(?: .*)?"
    r"|(?:just )?like that|love it|that is right|right like that|(?:thanks|thank you|ok|okay|yes|yeah|alright|sure)"
    r"|(?:that )?(?:will|would) do|as it is|no changes?(?: .*)?"
)
_POLITE = frozenset(
    """that is it looks look very really now so much thanks thank you ok okay yes to me for this all just
    like works well job work the one result path trajectory quite pretty already seems absolutely and
    a enough""".split()
)

_CHANGE = r"(?: (?:part|change|changes|thing|bit|clause|modification|step))?"
DROP = re.compile(
    rf"(?:undo|forget|drop|remove|cancel|skip|without|except|lose|take back|get rid of|delete|revert|discard|omit"
    rf"|leave out|leave away|take out|(?:everything|all) (?:but|except)|no|not|stop|do not|no more|without any"
    rf"|not with)"
    rf"(?: about)?(?: the| that| any)? (.+?){_CHANGE}"
)
RESTORE = re.compile(
    r"(?:keep|leave|have|put|set|restore|with|make)? ?(?:the )?(.+?)"
    r" (?:as (?:it was|they were|before|it was before|in the original|originally)|like before"
    r"|where (?:it was|they were)|alone|unchanged|untouched"
    r"|(?:back )?to what it was|(?:be )?the same(?: as before)?)"
    r"|(?:bring|put|set|get|have) (?:the )?(.+?) back"
    r"|(?:(?:keep|use|at|with|back to|restore|want) )?(?:the )?(?:original|normal|old|previous|usual) (.+)"
)
WAS_FINE = re.compile(r"(?:the )?(.+?) (?:was|were) (?:fine|good|ok|okay|better|right|perfect|great)(?: before)?")
BUT_NOT = re.compile(r"(?:keep|leave|i like|good) .+? but (?:not|without|drop|undo|forget|remove|lose) (?:the )?(.+)")
KEEP_ONLY = re.compile(
    r"(?:only|just)(?: keep| do)? (?:the )?(.+?)(?: part| change| bit)?|(?:keep|do) (?:only|just) (?:the )?(.+?)"
)


def taken_back(said: Utterance, c: Context) -> Resolution | None:
    """Read feedback that takes a turn back, brings it back, repeats it or accepts it."""
    text = said.text.replace(",", "")
    if RESTART.fullmatch(text):
        return Resolution("restart", c.took("start over from the original trajectory"))
    many = UNDO_MANY.fullmatch(text)
    if many:
        count = {**NUMBER_WORDS, "both": 2.0}.get(many[1], float(many[1]) if many[1].isdigit() else 0.0)
        if count >= 1:
            steps = sum(past.steps for past in c.history[-int(count) :])
            return Resolution("undo", c.took(f"take the last {int(count)} turns back"), steps=steps)
    segments = [segment.strip() for segment in re.split(r"[,.]+", said.text) if segment.strip()]
    if segments and all(UNDO.fullmatch(segment) for segment in segments):
        return Resolution("undo", c.took("take the last turn back"), steps=1)
    if AGAIN.fullmatch(text) and text != "redo":
        return Resolution("again", c.took(f"once more: {c.last.instruction.strip()}"))
    back = brought_back(said, c.said)
    if back is not None:
        return back
    words = text.split()
    praised = any(w in _PRAISE for w in words) and all(w in _PRAISE or w in _POLITE for w in words)
    if praised or _ACCEPT.fullmatch(text):
        return Resolution("accept", c.took("it is right as it is; nothing is changed"))
    return None


def brought_back(said: Utterance, words: str) -> Resolution | None:
    """Read feedback that brings back what was taken back."""
    if not REDO.fullmatch(said.text.replace(",", "")):
        return None
    return Resolution("redo", f"took {' '.join(words.split())!r} as: bring back what was taken back")


def dropped(said: Utterance, c: Context) -> Resolution | None:
    """Read "undo the speed", "forget the shift", "keep the speed as it was", "only the slowing down"."""
    text = said.text.replace(",", "")
    ordinal = ORDINAL.fullmatch(text)
    if ordinal:
        return _without_turn("first second third fourth fifth".split().index(ordinal[1]), c)
    restore = RESTORE.fullmatch(text) or WAS_FINE.fullmatch(text)
    drop = BUT_NOT.fullmatch(text) or DROP.fullmatch(f"no {said.denied}" if said.denied else text)
    only = KEEP_ONLY.fullmatch(text)
    if restore:
        reference = c.reference(next(group for group in restore.groups() if group))
        return _without(reference, c, everywhere=True) if reference else None
    if drop:
        reference = c.reference(drop[1])
        if reference and not reference.sense and re.match(r"(?:drop|lose)\b", text):
            return None  # "drop the pace" is an instruction
        return _without(reference, c, everywhere=False) if reference else None
    if only:
        reference = c.reference(only[1] or only[2])
        return _only(reference, c) if reference else None
    return None


def _fits(part: SpokenClause, reference: Reference) -> bool:
    return bool(part.pieces) and all(
        reference.fits(p.family, p.directions, p.items, sense=p.sense) for p in part.pieces
    )


def _without_turn(turn: int, c: Context) -> Resolution | None:
    """All turns but one."""
    if turn >= len(c.history):
        return None
    gone = c.history[turn]
    meaning = f"without {gone.instruction!r}"
    if len(c.history) == 1 or turn == len(c.history) - 1:
        return Resolution("undo", c.took(meaning), steps=gone.steps)
    return c.rewritten((), meaning=meaning, turn=turn)


def _without(reference: Reference, c: Context, *, everywhere: bool) -> Resolution | None:
    """The turns without the clauses that a reference means; of another writer's policy, without their effect."""
    kept: dict[int, tuple[SpokenClause, ...]] = {}
    gone: list[str] = []
    for i in reversed(range(len(c.history))):
        parts = c.parts_at(i) or ()
        left = tuple(part for part in parts if not _fits(part, reference))
        if len(left) < len(parts):
            kept[i] = left
            gone += [part.text for part in parts if part not in left]
            if not everywhere:
                break
    meaning = "without " + " and without ".join(repr(text) for text in gone)
    if not kept:
        return _neutral(reference, c)
    first = min(kept)
    if not any(kept.values()) and len(kept) == len(c.history) - first:
        steps = sum(past.steps for past in c.history[first:])
        return Resolution("undo", c.took(meaning), steps=steps)
    if first == len(c.history) - 1:
        return c.rewritten(kept[first], meaning=meaning)
    everything = all_parts(c.history, c.scene, kept)
    wording = worded(everything, c.history[0].start, c.scene) if everything else None
    if wording is None:
        return None
    return Resolution("rewrite", c.took(meaning), wording.values, wording.instruction, "original")


def _neutral(reference: Reference, c: Context) -> Resolution | None:
    """Knobs set to the value with which they do nothing."""
    return _switched_off([knob for knob in c.knobs if knob.fits(reference)], c)


def _switched_off(fitting: list[Knob], c: Context) -> Resolution | None:
    values = {k.name: k.rounded(k.neutral) for k in fitting if k.neutral is not None}
    if not fitting or len(values) < len(fitting):
        return None
    turned = ", ".join(f"{k.name} {k.shown(k.value)} -> {k.shown(values[k.name])}" for k in fitting)
    return Resolution("tune", c.took(turned), values)


def _only(reference: Reference, c: Context) -> Resolution | None:
    """The last turn with nothing but the clauses that a reference means."""
    left = tuple(part for part in c.parts if _fits(part, reference))
    if left and len(left) < len(c.parts):
        return c.rewritten(left)
    others = [knob for knob in c.knobs if knob.primary and not knob.fits(reference)]
    if not others or not any(knob.fits(reference) for knob in c.knobs):
        return None
    return _switched_off(others, c)
