"""Normalise feedback: correct spelling, drop courtesies, read degrees and amounts."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache

from ovita.instruct.lexicon import CONNECTIVES, filler, phrases, stems
from ovita.instruct.numbers import NUMBER_WORDS, UNITS, unit_at
from ovita.instruct.scale import Degree
from ovita.instruct.tokens import distance
from ovita.paths.scene import Scene, canonical

SHORT = (
    (r"\b(that|it|what|there)'?s\b(?! (?:own|place))", r"\1 is"),
    (r"\bwon'?t\b", "will not"),
    (r"\b(do|does|did|is|was|were|would|should|could)n'?t\b", r"\1 not"),
    (r"\bi'd\b", "i would"),
    (r"\bi'm\b", "i am"),
    (r"\blet'?s\b", "let us"),
    (r"\bas well\b", "too"),
    (r"[ ,]+for (?:my|our) (?:taste|liking)\b", ""),
)
"""Contractions and what they stand for."""

FEEDBACK_WORDS = frozenset(
    """more less bit little slightly touch tad somewhat much lot way far further farther even still yet enough quite so
    too half double twice triple times third quarter instead rather only just again undo redo revert restore cancel
    forget discard drop skip without except back start over reset original scratch never mind other way direction
    opposite wrong same also everywhere perfect great good fine nice excellent exactly right correct thanks thank you
    keep leave alone was were before stop slow fast slower faster close closer high higher low lower strong stronger
    weak weaker big bigger small smaller meant mean said not no yes ok okay another one ones that it this as of and
    shift shifting move offset speed pace slowing slowdown last previous everything all first end undone please sorry
    once repeat turn change changes two three reduce increase""".split()
)
"""Words that feedback is made of: a misspelt word is read as the one of these that it resembles most."""

_COURTESY = (
    r"please|pls|kindly|thanks|thank you|thx|could you|can you|would you|will you|i would like(?: you)? to|"
    r"i would like(?: it)?|i would prefer(?: it)?|i want(?: you to| it)?|i think|i guess|i believe|"
    r"hmm+|hm+|um+|uh+|uhm|oh|ah|oops|hey|well|actually|maybe|perhaps|wait|sorry|my mistake|pardon|"
    r"if you (?:do not mind|can|could|would)|if possible|for me|to me|now|let us|then|so|yes|yeah|alright|ok|okay"
)
_LEAD = re.compile(rf"^(?:(?:{_COURTESY})\b[ ,.!?;]*)+")
_TAIL = re.compile(rf"(?:[ ,.!?;]+(?:{_COURTESY.replace('now|', '').replace('|then|so', '')}))+$")
_NO = re.compile(
    r"^(?:no+|nope|nah|not like that|not there|that is (?:not right|wrong)|wrong (?:object|one|place|thing|spot))"
    r"\b[ ,.!?;:]+(?=\S)"
)
_INSTEAD = re.compile(r"(?<=\S)[ ,]+(?:instead|rather)$")
_REST = re.compile(
    r"[ ,.;]+(?:(?:and|but) )?(?:keep|leave) (?:all |everything )?(?:the rest|the other things?|else)"
    r"(?: as it is| the same| unchanged| alone| like that)?$"
)


@dataclass(frozen=True)
class Utterance:
    """Feedback without what says nothing.

    Args:
        text: The words that are left, lower case, single spaces, commas kept.
        corrects: Whether it began with "no" or the like, or ended with "sorry" or "instead".
        denied: What follows a "no" without a comma, as in "no shift", or "".
    """

    text: str
    corrects: bool = False
    denied: str = ""


def plain(said: str, scene: Scene) -> Utterance:
    """Strip courtesies and correct spellings; what is left may be empty."""
    text = " ".join(said.lower().replace("’", "'").split())
    for short, full in SHORT:
        text = re.sub(short, full, text)
    corrects = bool(re.search(r"\b(?:sorry|oops|actually)\b", text))
    text = _spelt(text, scene)
    denied = ""
    while True:
        before = text
        text = text.strip(" ,.!?;:-")
        text = _TAIL.sub("", _LEAD.sub("", text)) or text
        text = _REST.sub("", text)
        shorter = _INSTEAD.sub("", _NO.sub("", text))
        denied = shorter if text == f"no {shorter}" else denied
        corrects, text = corrects or shorter != text, shorter
        text = re.sub(r"^(?:but|and)\b(?! near| also| the | at | around)[ ,]*(?=\S)", "", text)
        if text == before:
            return Utterance(re.sub(r"[!?;:]+", "", text), corrects, denied)


def _spelt(text: str, scene: Scene) -> str:
    known = _known() | {word for item in scene for word in canonical(item.name).split()}
    return re.sub(r"[a-z]{4,}", lambda match: _corrected(match.group(), known), text)


def _corrected(word: str, known: frozenset[str] | set[str]) -> str:
    if any(stem in known for stem in stems(word)):
        return word
    slips = 2 if len(word) >= 8 else 1
    near = [known for known in FEEDBACK_WORDS if len(known) > 2 and distance(word, known) <= slips]
    return min(near, key=lambda known: (sorted(known) != sorted(word), known[0] != word[0], known), default=word)


@cache
def _known() -> frozenset[str]:
    """Words that are spelt right."""
    listed = {word for phrase in phrases() for word in phrase}
    courtesies = set(re.findall(r"[a-z]+", _COURTESY)) | {"like", "mistake", "mind", "prefer"}
    units = {word for unit in UNITS for word in unit}
    return frozenset({*FEEDBACK_WORDS, *listed, *filler(), *CONNECTIVES, *units, *NUMBER_WORDS, *courtesies})


NUMBER = r"(-?\d*\.?\d+) ?(m/s|cm/s|%|[a-z]+)?"
_SLIGHT = re.compile(
    r"\b(?:a (?:little |tiny |wee )?bit|a little|little bit|slightly|a touch|a tad|somewhat|little|bit)\b"
)
_LARGE = re.compile(
    r"\b(?:(?:very |so )?much|a lot|lots|far|way|considerably|significantly|a great deal|loads)\b(?=.* )"
)
_NOT_SO = re.compile(r"\b(?:not (?:quite )?(?:so|as|that|too|this)|too|so)\b")
_NOT_ENOUGH = re.compile(r"\bnot (?:\w+ )??(?:enough)\b|\b(?:does|is|was) not (?:\w+ )??(?:enough)\b|\btoo little\b")
_MORE = re.compile(
    r"\b(?:more|further|farther|stronger|harder|bigger|larger|longer|wider|increase|extra|even|still|yet)\b"
)
_LESS = re.compile(r"\b(?:less|smaller|weaker|softer|gentler|shorter|narrower|reduce|decrease|lessen|fewer|cut)\b")
_EMPTY = frozenset(
    """it that this these of as the a an to by in is was be do make go get move turn shall much far again please just
    only some any quite now and on than there rather try have give keep back long take want need hard
    put would at for way lot bit""".split()
)
_BACK = re.compile(r"\b(?:more|less|even|still|yet|enough|too|so|that|this|it)\b")
_ADJECTIVES = {
    "fast": "faster",
    "quick": "faster",
    "quickly": "faster",
    "slow": "slower",
    "slowly": "slower",
    "high": "higher",
    "low": "lower",
    "close": "closer",
    "near": "closer",
}

_LOOKS_BACK = re.compile(
    r"\b(?:that|this|enough|too|even|still|yet|again|as (?:much|far|many)|so much|not (?:so|as))\b"
    r"|\b(?:bit|little|slightly|much|lot) more\b|(?<!and )\bmore$|^(?:double|halve|triple) it$"
)
"""What makes feedback of a sentence that would do as an instruction too."""

_LEADS = frozenset(
    """a more less much even still some slightly somewhat little bit not too so far way lot that it this only just
    further farther closer nearer higher lower slower faster quicker another by bigger smaller longer shorter wider
    quite now the to""".split()
)
"""First words of sentences that are no instruction, although the built-in writer could read them as one."""


@dataclass(frozen=True)
class Cues:
    """What a sentence says about how much.

    Args:
        factor: A stated factor on the effect.
        added: A stated amount on top of the effect, with its unit.
        more: Whether it says more.
        less: Whether it says less.
        judged: Whether it judges the result as too much ("too fast", "not so far").
        not_enough: Whether it judges the result as too little.
        degree: By how much.
        long: Whether it is about how long something lasts.
        looks_back: Whether it refers to what was done.
        words: The words that are left.
    """

    factor: float | None
    added: tuple[float, str] | None
    more: bool
    less: bool
    judged: bool
    not_enough: bool
    degree: Degree
    long: bool
    looks_back: bool
    words: tuple[str, ...]

    @property
    def clear(self) -> bool:
        """Whether a number says how much."""
        return self.factor is not None or self.added is not None

    @property
    def bare(self) -> bool:
        """Whether nothing but a degree is left: "slower", "a bit to the left"."""
        return not (self.clear or self.more or self.less or self.judged or self.not_enough)


def read_cues(said: str) -> Cues:
    """Take the words that say how much from a sentence."""
    looks_back = bool(_BACK.search(said))
    factor, added, text = _explicit(said)
    not_enough = bool(_NOT_ENOUGH.search(text))
    text = _NOT_ENOUGH.sub(lambda m: " ".join(w for w in m[0].split() if w in _ADJECTIVES), text)
    text, slight = _SLIGHT.subn(" ", text)
    judged = bool(_NOT_SO.search(text)) and not not_enough
    large = bool(re.search(r"\b(?:way|far|much) too\b", text) if judged else _LARGE.search(text))
    text = _NOT_SO.sub(" ", text)
    more, less = bool(_MORE.search(text)), bool(_LESS.search(text))
    text = _LESS.sub(" ", _MORE.sub(" ", text))
    text = re.sub(r"\bslow(?:ing|ed)? (?:down|up)\b", "slower", re.sub(r"\bspeed(?:ing)? up\b", "faster", text))
    words = [_ADJECTIVES.get(w, w) for w in re.findall(r"[^\W_]+", text)]
    return Cues(
        factor,
        added,
        more,
        less,
        judged,
        not_enough,
        "slight" if slight else "large" if large else "moderate",
        bool(re.search(r"\b(?:long|longer|shorter)\b", said)),
        looks_back,
        tuple(w for w in words if w not in _EMPTY),
    )


def is_instruction(said: str, cues: Cues) -> bool:
    """Whether a sentence does not look back, so that it counts as an instruction if it is understood as one."""
    looks_back = cues.judged or cues.not_enough or bool(_LOOKS_BACK.search(said))
    return not looks_back and said.split(" ")[0] not in _LEADS


def quantity_of(number: str, unit: str | None) -> tuple[float, str] | None:
    """A number in SI units with its dimension, or None if the unit is none."""
    if not unit:
        return float(number), ""
    name, factor, _ = unit_at((unit,), 0)
    return (float(number) * factor, name) if name else None


def _without(text: str, match: re.Match[str], instead: str = " ") -> str:
    return text[: match.start()] + instead + text[match.end() :]


def _explicit(text: str) -> tuple[float | None, tuple[float, str] | None, str]:
    """Take a stated factor or amount; return it and the text without it."""
    for word, number in NUMBER_WORDS.items():
        text = re.sub(rf"\b{word} (?=times)", f"{number:g} ", text)
    of = (
        r"(?: (?:of (?:that|it|this)|as (?:much|far|strong|big|fast|slow|high|low|close|many|long|wide|large)"
        r"|that|it|this|of(?= the)|so much))?"
    )
    for pattern, value in (
        (r"\b(?:by )?(?:(?:a |one )?half|halve)", 0.5),
        (r"\b(?:a|one) third", 1 / 3),
        (r"\b(?:a|one) quarter", 0.25),
    ):
        match = re.search(pattern + of + r"\b(?! (?:more|less))", text)
        if match and not re.search(r"\b(?:first|second|last) (?:half|third|quarter)", text):
            rest = re.sub(
                r"\b(?:way |far |much )?too (?:much|far|strong|big)\b",
                " ",
                _without(text, match),
            )
            return value, None, rest
    match = re.search(r"\b(?:twice|double|two times)" + of + r"\b", text)
    if match:
        return 2.0, None, _without(text, match)
    match = re.search(r"\b(?:triple" + of + r"|(\d*\.?\d+) times" + of + r")(?: more)?\b", text)
    if match:
        return float(match[1] or 3), None, _without(text, match)
    match = re.search(r"(?:by )?(\d*\.?\d+) ?(?:%|percent) (more|less|further|of (?:that|it))", text)
    if match:
        share = float(match[1]) / 100
        factor = 1 - share if match[2] == "less" else share if match[2].startswith("of") else 1 + share
        return factor, None, _without(text, match)
    match = re.search(r"\bby (\d*\.?\d+) ?(?:%|percent)", text)
    if match and (_MORE.search(text) or _LESS.search(text)):
        share = float(match[1]) / 100
        factor = 1 - share if _LESS.search(text) else 1 + share
        return factor, None, _without(text, match)
    match = re.search(r"^(?:increase|reduce|decrease) (?:it|that|this) by " + NUMBER + "$", text)
    if match and (quantity := quantity_of(match[1], match[2])):
        return None, quantity, text.split(" ")[0]
    match = re.search(
        r"\banother "
        + NUMBER
        + r"|(?:by )?"
        + NUMBER
        + r" (?:more|further|farther|extra|less|too \w+|higher|lower|closer|nearer)\b",
        text,
    )
    if match:
        quantity = quantity_of(match[1] or match[3], match[2] or match[4])
        if quantity:
            word = " more " if match[1] else " " + match[0].split()[-1] + " "
            word = " less " if " too " in match[0] else word
            return None, quantity, _without(text, match, word)
    return None, None, text
