"""Feedback that says how much: "a bit more", "half of that", "slower still", "make it 0.3", "10 cm more"."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from ovita.dialogue.feedback.context import Context, Knob
from ovita.dialogue.feedback.resolution import Reference, Resolution
from ovita.dialogue.feedback.rewording import following, words_as_parts
from ovita.dialogue.feedback.utterance import NUMBER, Cues, Utterance, is_instruction, quantity_of, read_cues
from ovita.paths.frame import OPPOSITE

MORE = {"slight": 1.25, "moderate": 1.5, "large": 2.0}
"""What "a bit more", "more" and "much more" multiply an effect by; "less" divides by the same."""

_ORDINARY = {"slower": "slow down", "faster": "speed up"}


@dataclass(frozen=True)
class MoreOrLess:
    """How much more or less of what.

    Args:
        factor: On the effect, or None.
        added: Added to the effect, with its unit, or None.
        more: Whether more of it is wanted; where `wanted` has a sense, of that sense.
        wanted: What it is about.
        judged: Whether the words judge the result ("too fast"), so that they are no instruction of their own.
        degree: By how much, where neither a factor nor an amount says so.
    """

    factor: float | None
    added: tuple[float, str] | None
    more: bool
    wanted: Reference
    judged: bool = False
    degree: str = "moderate"


def amounts(said: Utterance, c: Context) -> Resolution | None:
    """Read feedback about how much."""
    return _instead(said, c) or _set(said, c) or _more_or_less(said, c)


def _instead(said: Utterance, c: Context) -> Resolution | None:
    """0.3 instead of 0.2; 0.3, not 0.2; not 0.2 but 0.3."""
    lead = r"^(?:make (?:it|that) |use |i (?:meant|said|want(?:ed)?) |take |rather )?(?:by |to )?"
    forward = re.search(lead + NUMBER + r",? (?:instead of|rather than|and not|not) (?:by )?" + NUMBER + "$", said.text)
    backward = re.search(r"^not (?:by )?" + NUMBER + r",? (?:but|rather) (?:by )?" + NUMBER + "$", said.text)
    if forward:
        new, old = (forward[1], forward[2]), (forward[3], forward[4])
    elif backward:
        new, old = (backward[3], backward[4]), (backward[1], backward[2])
    else:
        return None
    was, now = quantity_of(*old), quantity_of(*new)
    if was is None or now is None:
        return None
    knobs = [k for k in c.knobs if abs(k.value - was[0]) <= 1e-9 * max(1.0, abs(was[0]))]
    return _set_to(knobs, now, c)


def _set(said: Utterance, c: Context) -> Resolution | None:
    """Make it 0.3; 30 cm; no, 0.3; I meant 0.1; 0.15 is enough; make the shift 0.3; set left to 0.3."""
    text = said.text.replace(",", "")
    bare = re.fullmatch(
        r"(?:(?:i (?:meant|said|want(?:ed)?)|use|try|take|go with|rather|better|only|just|with|by|not that much) )*"
        r"(?:(?:make|set|put|turn|change|let|have) (?:it|that|this)(?: be)? "
        r"|(?:increase|reduce|decrease) (?:it|that|this) (?=to ))?"
        r"(?:only |just |to |at |by |exactly |about |=)*"
        + NUMBER
        + r"(?: (?:instead|only|rather|is enough|is plenty|would be enough"
        r"|is fine|would be better|is better|will do|in total))?",
        text,
    )
    named = re.fullmatch(
        r"(?:make|set|turn the|change|put|let|adjust) (?:the )?([a-z_ ]+?)(?: be)? (?:to |at |of |by |= ?)?" + NUMBER,
        text,
    ) or re.fullmatch(r"(?:with |the )*([a-z_ ]+?)(?: should be| must be| is| ?=) ?" + NUMBER, text)
    if bare:
        quantity = quantity_of(bare[1], bare[2])
        return _set_to([k for k in c.knobs if k.primary and k.fits(c.named)], quantity, c) if quantity else None
    if named is None:
        return None
    reference, quantity = c.reference(named[1]), quantity_of(named[2], named[3])
    if not reference or quantity is None or (words_as_parts(said.text, c.scene) and not reference.names):
        return None
    if reference.sense or (not reference.names and (reference.directions or "speed" in reference.families)):
        return None
    return _set_to([k for k in c.knobs if k.fits(reference)], quantity, c) or _earlier(
        c, reference, lambda knob: quantity[0] if _unit_fits(knob, quantity[1]) else None
    )


def _set_to(knobs: Sequence[Knob], quantity: tuple[float, str], c: Context) -> Resolution | None:
    value, unit = quantity
    fitting = [k for k in knobs if _unit_fits(k, unit)]
    if not fitting:
        return None
    if len(fitting) > 1:
        return _which(fitting, c)
    knob = fitting[0]
    new = round(value) if isinstance(knob.parameter.value, int) else value
    if knob.value < 0 < new:
        new = -new
    return _tuned({knob.name: new}, [knob], c)


def _unit_fits(knob: Knob, unit: str) -> bool:
    mine = knob.parameter.unit
    return (
        not unit
        or unit == mine
        or (unit == "x" and knob.is_factor and knob.value > 1)
        or (unit == "%" and mine in ("", "x", "factor", "ratio"))
    )


def _more_or_less(said: Utterance, c: Context) -> Resolution | None:
    amount = _read(said, c)
    if amount is None:
        return None
    wanted = amount.wanted or c.named
    knobs = [k for k in c.knobs if k.fits(wanted)]
    if not knobs:
        return _earlier(c, wanted, lambda knob: _changed(knob, amount)) or _ordinary(amount, c)
    if len({k.family for k in knobs}) > 1 or (len({k.group for k in knobs}) > 1 and knobs[0].family != "shift"):
        return _which(knobs, c)
    values = _values(knobs, lambda knob: _changed(knob, amount))
    return _tuned(values, knobs, c) if values else None


def _values(knobs: Sequence[Knob], value: Callable[[Knob], float | int | None]) -> dict[str, float | int]:
    """New values by name, or none at all if one of the knobs cannot have one."""
    found = {knob.name: value(knob) for knob in knobs}
    known = {name: new for name, new in found.items() if new is not None}
    return known if len(known) == len(found) else {}


def _along(knob: Knob, wanted: Reference) -> bool:
    """Whether more of what is wanted is more of the knob."""
    return not wanted.sense or not knob.sense or wanted.sense == knob.sense


def _changed(knob: Knob, amount: MoreOrLess) -> float | int | None:
    """The new value of a parameter after the requested change, or None if the unit does not fit it."""
    along = _along(knob, amount.wanted)
    more = amount.more == along
    if amount.added is not None:
        value, unit = amount.added
        if not _unit_fits(knob, unit) or knob.is_factor:
            return None
        size = max(abs(knob.value) + (value if more else -value), 0.0)
        return knob.rounded(-size if knob.value < 0 else size)
    if amount.factor is None:
        k = MORE[amount.degree]
        return knob.times(k if more else 1 / k)
    return knob.times(amount.factor if along or not amount.factor else 1 / amount.factor)


def _read(said: Utterance, c: Context) -> MoreOrLess | None:
    """Take the words of amount from a sentence; None if other words are left, or nothing says how much."""
    cues = read_cues(said.text)
    reference = c.reference(" ".join(cues.words))
    if reference is None or (is_instruction(said.text, cues) and words_as_parts(said.text, c.scene)):
        return None
    if cues.long:
        reference = replace(reference, families=reference.families | {"wait", "extend"})
    if "far" in said.text.split() and reference.items and not reference.sense:
        reference = replace(reference, sense="away")
    if cues.bare:
        return _comparative(said, cues, reference, c)
    upward = cues.not_enough or (not cues.judged and (cues.more or (bool(reference) and not cues.less)))
    if not cues.judged and not reference.sense:
        about = {"distance", "gap", "clearance", "space"} & set(cues.words), {"speed", "pace"} & set(cues.words)
        if any(about) and not (cues.more or cues.less):
            return None if about[1] and not cues.clear else MoreOrLess(cues.factor, cues.added, True, reference)
        if any(about):
            sense = ("away" if upward else "closer") if about[0] else ("faster" if upward else "slower")
            reference, upward = replace(reference, sense=sense), True
    if cues.clear and not cues.looks_back and cues.words and not reference:
        return None
    return MoreOrLess(cues.factor, cues.added, upward, reference, cues.judged or cues.not_enough, cues.degree)


def _comparative(said: Utterance, cues: Cues, reference: Reference, c: Context) -> MoreOrLess | None:
    """Slower; a bit closer; much higher; faster again: of the last turn, where it has a knob for it."""
    if not reference or re.search(r"\b(?:only|just|without|no|the slow|the speed)", said.text):
        return None
    if re.search(r"\b(?:again|back)\b", said.text):
        return _back(MoreOrLess(None, None, True, reference, degree=cues.degree), c)
    if not (reference.sense or cues.degree != "moderate") or len(cues.words) > 2:
        return None
    if not any(k.fits(reference) and _along(k, reference) for k in c.knobs):
        return None
    return MoreOrLess(None, None, True, reference, degree=cues.degree)


def _back(amount: MoreOrLess, c: Context) -> MoreOrLess | None:
    """Faster again, lower it again: less of what was done before."""
    wanted = amount.wanted
    against = frozenset(OPPOSITE[word] for word in wanted.directions)
    turned = replace(wanted, directions=against)
    if against and any(k.fits(turned) for k in c.knobs):
        return replace(amount, more=False, wanted=turned)
    return amount if wanted.sense and any(k.fits(wanted) and not _along(k, wanted) for k in c.knobs) else None


def _earlier(c: Context, wanted: Reference, value: Callable[[Knob], float | int | None]) -> Resolution | None:
    """Turn a knob of an earlier turn; then all turns are put into one instruction for the original."""
    if not wanted:
        return None
    for i in reversed(range(len(c.history) - 1)):
        knobs = [k for k in c.knobs_at(i) if k.fits(wanted)]
        parts = c.parts_at(i)
        if not knobs or parts is None:
            continue
        values = _values(knobs, value)
        turned = tuple(part.turned(values) for part in parts)
        return c.rewritten(turned, meaning=_turns(values, knobs), turn=i) if values else None
    return None


def _ordinary(amount: MoreOrLess, c: Context) -> Resolution | None:
    """An instruction of its own: "not so fast" where no speed was changed, "too high" where nothing was lifted."""
    if not amount.judged or amount.wanted.items or amount.wanted.families or amount.factor or amount.added:
        return None
    sense, directions = amount.wanted.sense, sorted(amount.wanted.directions)
    opposite = {"slower": "faster", "faster": "slower"}
    if sense in _ORDINARY:
        text = _ORDINARY[sense if amount.more else opposite[sense]]
    elif len(directions) == 1:
        text = "go " + (directions[0] if amount.more else OPPOSITE[directions[0]])
    else:
        return None
    text += " a little" if amount.degree != "large" else ""
    return Resolution("rewrite", c.took(text), instruction=text, begins="current")


def _tuned(values: dict[str, float | int], knobs: Sequence[Knob], c: Context) -> Resolution:
    return Resolution("tune", c.took(_turns(values, knobs)), {**values, **following(c.last, c.scene, values)})


def _turns(values: dict[str, float | int], knobs: Sequence[Knob]) -> str:
    return ", ".join(
        f"{k.name} {k.shown(k.value)} -> {k.shown(values[k.name])}"
        + (f" ({k.parameter.meaning})" if k.parameter.meaning else "")
        for k in knobs
    )


def _which(knobs: Sequence[Knob], c: Context) -> Resolution:
    """Ask which knob is meant."""
    listed = [f"{k.name} ({k.parameter.meaning or k.family}, now {k.shown(k.value)})" for k in knobs]
    question = f"Which do you mean: {', '.join(listed[:-1])} or {listed[-1]}?"
    return Resolution("ask", c.took("a question of which knob"), question=question)
