"""Turns of phrase that no reader takes word by word, put in words that mean the same: "down the middle"."""

from __future__ import annotations

import re
from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from importlib.resources import files

from ovita.instruct.objects import head_of
from ovita.paths.scene import Scene


def _wound(found: re.Match[str]) -> str:
    """A part of the path that is to wind, in words for that part: "turn the last stretch into a corkscrew"."""
    part = found["part"].lower()
    if part in ("down", "up") or part.startswith(("climb", "ris", "ascent", "desc", "fall")):
        return f"a spiral in the {'descent' if part.startswith(('down', 'desc', 'fall')) else 'climb'}"
    return f"a spiral in the {part if part.endswith(('half', 'third', 'quarter')) else 'last quarter'}"


def _lasting(found: re.Match[str]) -> str:
    """A stop that is to last so long: "increase the hover time at pier 2 to five seconds"."""
    return f"wait {found['q']}{found['at'] or ''}"


def _paced(found: re.Match[str]) -> str:
    """How many times as fast something is that takes so many per cent longer, or less time."""
    sign = 1 if found["more"].lower() in ("longer", "more time") else -1
    return f"go at {1.0 / max(1.0 + sign * float(found['q']) / 100.0, 0.01):.4g} times the speed"


def _arriving(found: re.Match[str]) -> str:
    """Sooner at the goal, or later."""
    return f"go {found['much'] or ''}{'faster' if found['soon'] else 'slower'}"


def _halved(found: re.Match[str]) -> str:
    """Half of an amount that was said before: "at 0.4 m/s, near the cup at half of that"."""
    return f"{found['lead']}{float(found['n']) / 2.0:g} {found['unit']}"


def _a_share(found: re.Match[str]) -> str:
    """A share of the speed as a number: "a quarter of the original speed"."""
    return f"at {SHARES_OF[found['share'].lower()]:g}% of the speed"


SHARES_OF = {"half": 50.0, "third": 33.3, "quarter": 25.0, "fifth": 20.0, "tenth": 10.0}
"""Per cent by the words for them."""


def _stopping(found: re.Match[str]) -> str:
    """A stop that is too long, or too short: "the stop at the rack is too long, half of that will do"."""
    much = (found["much"] or ("half" if found["way"].lower() == "long" else "twice")).lower()
    return f"wait {much} as long {found['at']}"


def _slowly(found: re.Match[str]) -> str:
    """Longer beside a thing that it passes: "spend twice as long scanning the shelf"."""
    return f"go {'twice' if found['how'].lower() == 'half' else 'half'} as fast near "


MEANT: Mapping[str, Callable[[re.Match[str]], str]] = {
    "wound": _wound, "lasting": _lasting, "paced": _paced, "arriving": _arriving, "halved": _halved,
    "stopping": _stopping, "slowly": _slowly,
    "a_share": _a_share,
}  # fmt: skip
"""What stands as "@name" in the files of turns of phrase."""

_MACRO = re.compile(r"\{([A-Z_]+)\}")


@dataclass(frozen=True)
class Phrasing:
    """A turn of phrase as a pattern, in which {THING} is any object's name, and what stands in its place."""

    said: str
    meant: str

    @cached_property
    def pattern(self) -> re.Pattern[str]:
        """Its pattern; of an object's name, anything counts as one."""
        return re.compile(self.said.replace("{THING}", r"\S.*?"), re.IGNORECASE)

    def put(self, text: str, pattern: re.Pattern[str]) -> str:
        """A text with what is meant in place of what a pattern finds."""
        if self.meant.startswith("@"):
            return pattern.sub(MEANT[self.meant[1:]], text)
        return pattern.sub(re.sub(r"^_|_$", " ", self.meant), text)


@cache
def turns(file: str) -> tuple[Phrasing, ...]:
    """The turns of phrase of a file, "plain" or "things"."""
    rows = [row for row in _rows(file) if not _MACRO_ROW.match(row)]
    said_and_meant = zip(rows[::2], rows[1::2], strict=True)
    return tuple(Phrasing(filled(said), meant.strip().removeprefix("=>").strip()) for said, meant in said_and_meant)


def filled(pattern: str) -> str:
    """A pattern with what stands for its {NAME}s in the file of plain words."""
    while (full := _MACRO.sub(lambda found: _macros().get(found[1], found[0]), pattern)) != pattern:
        pattern = full
    return pattern


@cache
def _macros() -> Mapping[str, str]:
    found = filter(None, map(_MACRO_ROW.match, _rows("plain")))
    return {row["name"]: row["pattern"] for row in found}


_MACRO_ROW = re.compile(r"(?P<name>[A-Z_]+) = (?P<pattern>.*)")


@cache
def _rows(file: str) -> tuple[str, ...]:
    text = files("ovita.instruct").joinpath(f"turns/{file}.txt").read_text(encoding="utf-8")
    return tuple(row for row in text.splitlines() if row and not row.startswith("#"))


_COMPLAINT = re.compile(
    r"^(?P<lead>\W*)(?P<who>it|this|that|he|she|you|the (?:robot|arm|drone|rover|thing|machine))"
    r"(?: (?:always|really|just|practically|sort of|kind of|still))? "
    r"(?:(?P<fast>rush|dash|rac|bolt|shoot|tear|hurtl|whizz|zoom|speed)|(?P<slow>crawl|creep|dawdl|plod|drag|stall|lag)"
    r"|(?P<how>jerk|jolt|shak|wobbl|rattl|judder|stutter|sway))(?P<form>e?s|e|ing)?"
    r"(?: (?:off|away|along|through))?\b(?P<where>[^.,;!?]*)(?P<rest>.*)$",
    re.IGNORECASE | re.DOTALL,
)
_REMEDY = re.compile(
    r"\b(?:slow|fast|quick|gent|pace|speed|hurry|easy|calm|soft|careful|at \d|m/s|met(?:re|er)s? (?:a|per) second)",
    re.IGNORECASE,
)


def _complained(found: re.Match[str]) -> str:
    """What is to be done about a speed that somebody complains of: what they say themselves, or the opposite of it."""
    rest = found["rest"].lstrip(" .,;!?")
    if found["who"].lower() != "you" and found["form"] not in ("s", "es", "ing"):
        return found[0]  # "that crawl space"
    if found["how"]:
        return found["lead"] + rest if rest else found[0]
    if _REMEDY.search(rest) and not re.search(r"\bthere\b", rest, re.IGNORECASE):
        return found["lead"] + rest
    return f"{found['lead']}{'slower' if found['fast'] else 'faster'}{found['where']}{found['rest']}"


def plainer(text: str, scene: Scene) -> str:
    """An utterance with plain words for turns of phrase, and "and" for an "or" between two objects.

    Args:
        text: As it was said or typed.
        scene: With the names of objects.
    """
    for turn in turns("plain"):
        text = turn.put(text, turn.pattern)
    text = _numbered(_COMPLAINT.sub(_complained, text), scene)
    for turn in turns("things") if scene.names else ():
        if turn.pattern.search(text):  # the patterns of a scene's names are many, and take long to compile
            text = turn.put(text, re.compile(turn.said.replace("{THING}", _names(scene)), re.IGNORECASE))
    return text


_COUNTS = ("one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")


def _numbered(text: str, scene: Scene) -> str:
    """An utterance with the names of objects that are numbered: "the second pylon", "pylons 1 and 2"."""
    names = {name.lower() for name in scene.names}
    for kind in {name.rpartition(" ")[0] for name in names if name[-1:].isdigit() and " " in name}:
        text = _counted(text, kind, names)
    for number, word in enumerate(("first", "second", "third", "fourth", "fifth"), 1):
        for kind in {name.rpartition(" ")[0] for name in names if name.endswith(f" {number}")} - {""}:
            said = rf"\b(?:the )?{word} {re.escape(kind)}\b(?! \d)"
            text = text if f"{word} {kind}" in names else re.sub(said, f"{kind} {number}", text, flags=re.IGNORECASE)
    return text


def _counted(text: str, kind: str, names: Container[str]) -> str:
    """An utterance with the names of objects of a kind whose numbers are words, or stand in a list or further on."""
    for number, word in enumerate(_COUNTS, 1):
        if f"{kind} {number}" in names and f"{kind} {word}" not in names:
            text = re.sub(rf"\b{re.escape(kind)} {word}\b", f"{kind} {number}", text, flags=re.IGNORECASE)
    span = rf"\b{re.escape(kind)}s? (?P<a>\d+) (?:to|through|-) (?P<b>\d+)\b"
    text = re.sub(span, lambda found: _from_to(found, kind, names), text, flags=re.IGNORECASE)
    pair = rf"\b{re.escape(kind)}s? (?P<one>\d+),? (?P<and>and|or) (?P<two>\d+)(?! ?{filled('{UNIT}')}\b)\b"
    text = re.sub(pair, rf"{kind} \g<one> \g<and> {kind} \g<two>", text, flags=re.IGNORECASE)
    same = rf"(?P<more>[^.;]*?),? (?:it|that)(?:'s| is) {re.escape(kind)} (?P<n>\d+)"
    named = rf"\b(?:the|our|my|that) {re.escape(kind)}\b(?! \d){same}"
    return re.sub(named, rf"{kind} \g<n>\g<more>", text, flags=re.IGNORECASE)


def _from_to(found: re.Match[str], kind: str, names: Container[str]) -> str:
    """All objects of a kind from a number to another: "panels 2 to 4"."""
    listed = [f"{kind} {number}" for number in range(int(found["a"]), int(found["b"]) + 1)]
    return " and ".join(listed) if listed and all(name in names for name in listed) else found[0]


def without_cargo(text: str, scene: Scene) -> str:
    """An utterance without words that are no objects though their names have them: "carry the vial" beside a vial rack.

    Args:
        text: As it was said or typed.
        scene: With the names of objects.
    """
    hold, much = filled("{HOLD}"), filled("{MUCH}")
    last = {head_of(name.lower().split()) for name in scene.names}
    for word in sorted({word.lower() for name in scene.names for word in name.split()[:-1] if len(word) > 2} - last):
        whole = "|".join(re.escape(name) for name in scene.names if word in name.lower().split())
        carried = rf"\b(?P<verb>{hold}) (?:the|my|our) (?!(?:{whole})\b){re.escape(word)}\b"
        text = re.sub(carried, r"\g<verb> it", text, flags=re.IGNORECASE)
        # as a verb: "paint slower" beside a paint pot
        done = rf"^(?P<lead>\W*(?:please )?){re.escape(word)} (?={much}(?:slow|fast|quick|gentl|careful|more|less))"
        text = re.sub(done, r"\g<lead>", text, flags=re.IGNORECASE)
    named = {word.lower() for name in scene.names for word in name.split()}
    for verbs, things in ((rf"(?:{hold}|raise|lower)", MOUNTED), ("(?:carry|bring|hold|transport)", CARRIED)):
        unknown = "|".join(sorted(things - named))
        text = re.sub(rf"\b(?P<verb>{verbs}) (?:the|my|our) (?:{unknown})\b", r"\g<verb> it", text, flags=re.IGNORECASE)
    return text


MOUNTED = frozenset("camera tray brush nozzle tool sensor probe lens pen pencil scanner sprayer payload load".split())
CARRIED = frozenset(
    "glass cup mug plate bowl spoon fork vial bottle jar box parcel package tea coffee soup food".split()
)
"""What a robot has at its end, and what it carries, where the scene has no object of that name."""

_AS_NOW = r"\b(?:instead of|rather than) (?:the )?(?:{N}|{WORD})(?: ?{UNIT})?(?!\w|\.\d)(?: {NOW})?"


_THE_SAME = re.compile(
    r"^\W*(?:please )?(?:do |go |fly |drive |run |make )?(?:exactly |just )?the same(?: \w+)?,? but ", re.IGNORECASE
)

_LEFT_THERE = re.compile(r"\b(?:leave|drop)\b", re.IGNORECASE)  # where that is tells where the path ends


_OLD = re.compile(
    r"\bthe (?:old|previous|current|present|former) (?=(?:goal|end|end ?point|destination|start|finish)\b)",
    re.IGNORECASE,
)
_TOO_FAR = re.compile(r"\btoo far (?:over |out )?(?:to the )?(?P<way>left|right)\b", re.IGNORECASE)


_NOT_DOING = re.compile(r",? ?\b(?:instead of|rather than) (?!being\b)\w+ing\b [^.;!?,]*,? ?", re.IGNORECASE)
_SIDE_OF = re.compile(
    r"(?P<side>\b(?:left|right)(?:[- ]hand)?(?: side)?) of the "
    r"(?P<of>corridor|hallway|hall|road|street|lane|track|room|aisle|path|way)\b",
    re.IGNORECASE,
)


def without_now(text: str, scene: Scene) -> str:
    """A first instruction without what it says of how things are: "wait 10 seconds instead of 3", "at A, not at B".

    Args:
        text: As it was said or typed.
        scene: With the names of objects.
    """
    text = _THE_SAME.sub("", re.sub(filled(_AS_NOW), "", text, flags=re.IGNORECASE))
    text = _OLD.sub("the ", text)
    known = {word.lower() for name in scene.names for word in name.split()}
    text = _SIDE_OF.sub(lambda found: found[0] if found["of"].lower() in known else found["side"], text)
    text = _NOT_DOING.sub("", text)
    text = re.sub(
        rf",? ?\b(?:and |but )?never mind (?:about )?{_names(scene)}(?=\s*(?:$|[.,;!?]))", "", text, flags=re.I
    )
    ignored = rf"^\W*(?:forget|never mind|ignore)(?: about)? {_names(scene)}(?: and {_names(scene)})?[.;]\s*(?=\w)"
    text = (
        re.sub(ignored, "", text, flags=re.IGNORECASE) if re.match(r"\W*(?:forget|never|ignore)", text, re.I) else text
    )
    text = _TOO_FAR.sub(lambda found: f"further {'right' if found['way'].lower() == 'left' else 'left'}", text)
    if len(scene) < 2 or _LEFT_THERE.search(text):
        return text
    name = _names(scene)
    at = filled("(?: {AT}| to| past| round| around)?")
    contrast = rf"(?P<one>{name}),? (?:instead of|rather than|(?:and )?not){at} {name}"
    return re.sub(contrast, r"\g<one>", text, flags=re.IGNORECASE)


def _names(scene: Scene) -> str:
    """A pattern of the objects' names and each of their longer words, with an article."""
    names = {*scene.names, *(word for name in scene.names for word in name.split() if len(word) > 2)}
    return rf"(?:(?:the|my|our|his|her|your) )?(?:{'|'.join(sorted(map(re.escape, names), key=len, reverse=True))})\b"


_PASSED_IT = re.compile(
    r"\b(pass|passing|past|near|by|around|over|under|beside|behind|next to|close to) it\b", re.IGNORECASE
)


_THERE = re.compile(
    r"(?P<do>\b(?:wait|stop|pause|hover|hold|stay|linger|dwell|rest|remain|hang"
    r"|slower|faster|higher|lower|slow down|speed up|closer|speed|pace)\b[^.,;!?]*?) "
    r"there\b(?! (?:is|are|was|were)\b)",
    re.IGNORECASE,
)


_ONLY_THERE = re.compile(r",? ?\b(?:but|and) only there\b", re.IGNORECASE)  # where it is said before
_THAT_PART = re.compile(
    r"\b(?:over|on|in|along|for|through|during) (?:that|this) (?:same )?(?:bit|part|stretch|piece|section|leg)\b",
    re.IGNORECASE,
)
_OWN_PLACE = re.compile(r"\b(?:end|goal|finish|start|beginning|middle)\b[^.;!?]*\bthere\b", re.IGNORECASE)
_ELSE = re.compile(r"\b(?:everywhere|anywhere) else\b|\belsewhere\b|\b(?:on|for) the rest\b(?! of)", re.IGNORECASE)
_HOVER = re.compile(r"\bhover(?=[^.,;!?]*\bthere\b)", re.IGNORECASE)  # where it is, not so high over the thing
_THERE_ON = re.compile(r"\bfrom there on(?:wards?)?\b", re.IGNORECASE)
_WAY_IN = re.compile(
    r"\bon (?:the|its) way (?P<way>in|out)\b(?! (?:of|to|from)\b)"
    r"(?:,? (?:but )?not (?:(?:on )?the way (?:out|in)"
    r"|(?:once|when|after) (?:you're|you are|it's|it is) past (?:it|the [\w -]+)))?",
    re.IGNORECASE,
)
_WAYS = {"in": "before", "out": "after"}
_FROM_THERE = re.compile(r"\bfrom there (?=to\b)", re.IGNORECASE)


def with_place(text: str, place: str, scene: Scene) -> str:
    """An utterance with a place for its "there", unless it names an object itself: "wait there for 3 seconds"."""
    text = _ONLY_THERE.sub("", _THAT_PART.sub("there", text))
    by, _, thing = place.partition(" ")
    if by in ("at", "near") and thing.startswith("the "):
        text = _WAY_IN.sub(lambda found: f"{_WAYS[found['way'].lower()]} {thing}", text)
    if any(word.lower() in text.lower() for word in (*scene.names, "instead", "not ", "only")):
        return text
    if _OWN_PLACE.search(text):
        return text
    text = _ELSE.sub(f"everywhere except {place}", text)
    text = _HOVER.sub("wait", text)
    if place.startswith("at the "):
        text = _FROM_THERE.sub(f"from {place.removeprefix('at ')} ", text)
        text = _THERE_ON.sub(f"after {place.removeprefix('at ')}", text)
    return _THERE.sub(lambda found: f"{found['do']} {place}", text)


_THING = re.compile(r"\b(?:(?:the|that|this) (?:thing|object|one)|that|it)\b", re.IGNORECASE)


def with_thing(text: str, name: str) -> tuple[str, ...]:
    """An utterance with the name of the thing that it left open, in its place and at its end."""
    asked = text.rstrip(" .!?")
    return (_THING.sub(f"the {name}", asked, count=1), f"{asked} the {name}", f"{asked} from the {name}")


_BOTH = re.compile(r"\b(?:both of them|them both|the two of them|these two|those two|both)\b", re.IGNORECASE)


def with_both(text: str, names: Sequence[str], scene: Scene) -> str:
    """An utterance with the names of two things for "both of them", unless it names an object itself."""
    if len(names) != 2 or any(known.lower() in text.lower() for known in scene.names):
        return text
    return _BOTH.sub(f"the {names[0]} and the {names[1]}", text, count=1)


def with_name(text: str, name: str, scene: Scene) -> str:
    """An utterance with a name for an "it" that is a thing, not the path: "slower while you pass it".

    It stays as it is where it names an object itself.
    """
    if any(known.lower() in text.lower() for known in scene.names):
        return text
    return _PASSED_IT.sub(rf"\1 the {name}", text)
