"""Places in words: "the box", "10 cm above the plate", "left of the bottle", "between the posts", "0.3,0.1,0.2".

`read_place` says which place is meant, `locate` where that is for a robot: beside or above an object that is an
obstacle the point keeps the robot's distance and a little more.
"""

from __future__ import annotations

import re
from collections.abc import Container, Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from ovita.errors import RequestError
from ovita.instruct.encoder import network
from ovita.instruct.lexicon import concepts, terms
from ovita.instruct.numerals import Amount, amount_at, unit_at
from ovita.instruct.objects import WORD, Catalog, Mention, singular
from ovita.instruct.spelling import respelt
from ovita.limits.path import bounds, flatten, keep_out
from ovita.limits.problem import TOLERANCE, Obstacle, from_object, is_support, obstacles_of
from ovita.paths.robot import Box, Robot
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Array
from ovita.text import listed, number, point, the

Relation = Literal["at", "over", "under", "left", "right", "front", "back", "beside", "between"]

APPROACH = 0.05
"""How far beyond the robot's distance a place at an object lies [m]."""

AROUND = 16
"""Directions that are tried for a place beside an object."""

Side = Literal["left", "right", "front", "back"]
SIDES: tuple[Side, ...] = ("left", "right", "front", "back")


def way_words(name: str) -> frozenset[str]:
    """The words and phrases of a class of `instruct/ways/*.txt`."""
    return frozenset(concepts(folder="ways")[name])


def _relations(prefix: str = "") -> dict[str, Relation]:
    """The phrases of relations whose classes begin with some words, with theirs."""
    found: dict[str, Relation] = {}
    for relation in get_args(Relation):
        found |= dict.fromkeys(concepts(folder="ways").get(f"{prefix}{relation}", ()), relation)
    for phrase in concepts(folder="ways").get(f"{prefix}side", ()):
        found |= {phrase.format("left"): "left", phrase.format("right"): "right"}
    return found


PHRASES, BEHIND, BARE, SEEN, OWNED = map(_relations, ("", "behind ", "bare ", "seen ", "owned "))
AWAY, ARTICLES, HAVING = way_words("away"), way_words("article"), way_words("having")

NAME = 4
"""Words of the name of a thing, at most."""

BARE_METRES = 3.0
"""A number without a unit, in front of a place, is in metres up to this one."""

POINTED = frozenset("from to stop stopping end ending finish finishing".split())
"""Words behind which "there" is a place of the way."""

PASSED = frozenset("pass passing take taking leave leaving keep keeping".split())
"""Words behind which "it" is what the way passes on a side that follows."""

CLOSING = frozenset(", ; . : ! ? ( ) and then".split())
"""What may follow a side for which nothing else stands: "pass the wall left"."""

_NUMBER = r"-?(?:\d+(?:\.\d+)?|\.\d+)(?:e[+-]?\d+)?"
_AXES = r"[,;\s]*".join(rf"{axis}\s*[=:]?\s*{_NUMBER}" for axis in "xyz")
_SNIPPET = re.compile(
    rf"(?<![\w.])(?P<triple>[(\[]?\s*{_NUMBER}\s*,\s*{_NUMBER}\s*,\s*{_NUMBER}\s*[)\]]?"
    rf"|(?:[(\[]|(?<=point ))\s*{_NUMBER}[\s,;]+{_NUMBER}[\s,;]+{_NUMBER}(?:\s*[)\]]|(?![\w.]))"
    rf"|[(\[]?{_AXES}[)\]]?(?![\w.]))"
    rf"|(?P<arrow>-+>|=>|→|>(?!=))|{WORD.pattern}",
    re.IGNORECASE,
)
"""A triple of coordinates, an arrow, or a piece that any reader cuts a sentence into."""


@dataclass(frozen=True)
class Snippet:
    """A word, mark, arrow or triple of coordinates of a text, with where it stands."""

    text: str
    span: tuple[int, int]
    point: tuple[float, float, float] | None = None


@dataclass(frozen=True, eq=False)
class Location:
    """A place as it was said.

    Args:
        relation: To the objects.
        objects: One; two for "between".
        distance: From the surface [m], or None where it is left open.
        point: Coordinates [m], or None.
        unclear: What several objects, or none, fit; else "".
        seen: Whether the relation is the side of the robot on its way that the object is to be on.
        away: Level direction (3,) of the place, for a side of the robot that is none of the scene's, or None.
        height: Over the ground, which counts instead of that of the place [m], or None.
    """

    relation: Relation = "at"
    objects: tuple[SceneObject, ...] = ()
    distance: float | None = None
    point: tuple[float, float, float] | None = None
    unclear: str = ""
    seen: bool = False
    away: tuple[float, float, float] | None = None
    height: float | None = None

    @property
    def label(self) -> str:
        """In words."""
        return self._place + ("" if self.height is None else f" at a height of {number(self.height)} m")

    @property
    def _place(self) -> str:
        if self.point is not None:
            return point(self.point)
        names = listed(the(item.name) for item in self.objects)
        far = "" if self.distance is None else f"{number(self.distance)} m "
        how = "" if self.relation == "at" and not far else TOLD[self.relation] if self.away is None else "beside "
        return f"{far}{how}{names}"


TOLD: dict[Relation, str] = {
    "at": "from ", "over": "above ", "under": "under ", "beside": "beside ", "between": "between ",
    "left": "left of ", "right": "right of ", "front": "in front of ", "back": "behind ",
}  # fmt: skip
"""Relations in words."""


@dataclass(frozen=True, eq=False)
class Anchor:
    """A point that a planned path starts at, passes or ends at.

    Args:
        position: (3,) [m].
        label: In words, such as "above the box".
        objects: Names of the objects that it is told by.
    """

    position: Array
    label: str
    objects: tuple[str, ...] = ()


def phrase_at(words: Sequence[str], i: int, phrases: Container[str]) -> tuple[str, int]:
    """The longest of some phrases that begins at word i, and how many words it takes; ("", 0) for none."""
    for count in range(min(8, len(words) - i), 0, -1):
        said = " ".join(words[i : i + count])
        if said in phrases:
            return said, count
    return "", 0


TURNED = ("left", "right")
"""Sides that depend on where one is headed."""


class Text:
    """A text cut into pieces, with the ways to refer to the objects of a scene."""

    def __init__(self, text: str, scene: Scene, path: Array | None = None) -> None:
        self.text, self.scene = _settled(_spaced(text.replace("’", "'"), scene)), scene
        self.catalog = Catalog(scene, path)
        self.pieces = _cut(self.text)
        said = [piece.text.lower() for piece in self.pieces]
        right, notes = respelt(said, self.catalog)
        known = network().known if said != right else frozenset[str]()
        self.words = [word if word in known else other for word, other in zip(said, right, strict=True)]
        kept = tuple(f"read {word!r} as" for word in said if word in known)
        self.notes = [note for note in notes if not note.startswith(kept)]

    def __len__(self) -> int:
        return len(self.pieces)

    def place_at(self, i: int) -> tuple[Location, int] | None:
        """The place that is told from piece i on and the piece behind it, or None."""
        if self.words[i] in ("through", "thru") and (pair := self._pair(i + 1)) is not None:
            return pair
        if (coordinates := self._point(self._after_articles(i))) is not None:
            return coordinates
        distance, said, at = self._relation(i)
        relation = PHRASES.get(said, "at")
        if relation == "between" or said.endswith("middle of"):
            pair = self.between(at)
            if relation == "between" or pair is not None:
                return pair
        if distance is None and said and (coordinates := self._point(self._after_articles(at))) is not None:
            return coordinates
        if distance is not None and not said:
            return None
        found = self.object_at(at) or self._meant(at, bool(said))
        if found is None:
            return None
        place, end = self.sided(replace(found[0], relation=relation, distance=distance), found[1])
        alone = not said and (i == 0 or self.words[i - 1] in (",", ";", ".", ":"))  # "bottle on the left"
        behind = BEHIND.get(phrase_at(self.words, found[1], BEHIND)[0]) == place.relation
        return (replace(place, seen=True) if alone and behind and place.relation in TURNED else place), end

    def _relation(self, i: int) -> tuple[float | None, str, int]:
        """The distance [m] and the relation that are told from piece i on, and the piece behind them."""
        at = self._after_articles(i)
        far = self._distance(i)  # "a metre above" has an article of its own
        distance, at = far if far[0] is not None else self._distance(at)
        tried = [(i, PHRASES), (at, PHRASES)] if distance is None else [(at, PHRASES), (at, AWAY)]
        for begin, phrases in tried:  # in "the right of", "right" is no article
            said, used = phrase_at(self.words, begin, phrases)
            if used:
                return distance, said, begin + used
        return distance, "", i if distance is None else at

    def _meant(self, i: int, related: bool) -> tuple[Location, int] | None:
        """What "above it", "pass it on the left" and "from there" mean: the object that was named last before."""
        said = self.words[i] if 0 < i < len(self) else ""
        if i > 1 and self.words[i - 1] == "at" and self.words[i - 2].endswith(("'re", "'m", "is", "are")):
            return None  # "while you're at it"
        there = said == "there" and self.words[i - 1] in POINTED and "where" not in self.words[i : i + 6]
        sided = related or (self.words[i - 1] in PASSED and phrase_at(self.words, i + 1, BEHIND)[1] > 0)
        if not there and not (said in ("it", "them") and sided):
            return None
        place = self.meant_at(i)
        return (place, i + 1) if place is not None else None

    def meant_at(self, i: int) -> Location | None:
        """The object that was named last before piece i."""
        before = (self.object_at(k) for k in range(i - 1, -1, -1) if self._mention(k) is not None)
        return next((place[0] for place in before if place is not None and not place[0].unclear), None)

    def _point(self, i: int) -> tuple[Location, int] | None:
        """The coordinates at piece i, with their unit."""
        if i >= len(self) or self.pieces[i].point is None:
            return None
        unit, factor, used = unit_at(self.words, i + 1) if i + 1 < len(self) else ("", 1.0, 0)
        if unit != "m":
            factor, used = 1.0, 0
        x, y, z = (factor * value for value in self.pieces[i].point or ())
        return Location(point=(x, y, z)), i + 1 + used

    def sided(self, place: Location, end: int) -> tuple[Location, int]:
        """A place at an object with the side that is told behind it: "the lamp on its left"."""
        if place.relation not in ("at", "beside") or not place.objects:
            return place, end
        owned = OWNED.get(self.words[end]) if end < len(self) and self.words[end - 1].endswith("'s") else None
        if owned is not None:
            return replace(place, relation=owned), end + 1 + (self.words[end + 1 : end + 2] == ["side"])
        for phrases in (BARE, SEEN, BEHIND):
            said, used = phrase_at(self.words, end, phrases)
            if used and self._complete(phrases, end + used):
                relation, before = phrases[said], self.words[max(end - 5, 0) : end]
                kept = phrases is BEHIND and relation in ("left", "right") and not HAVING.isdisjoint(before)
                side = replace(place, relation=relation, seen=phrases is SEEN or kept)  # "leave the lamp on the left"
                return self._far_from(side, end + used)
        return place, end

    def _complete(self, phrases: Container[str], end: int) -> bool:
        """Whether a side that is told behind an object ends at a piece: "on the left", and not "on the left of it"."""
        if phrases is BARE:
            return self._closed(end)
        return phrases is SEEN or self.words[end : end + 1] not in (["of"], ["side"])

    def _far_from(self, place: Location, end: int) -> tuple[Location, int]:
        """A place behind an object, on the side that is far from another one if that is told: "from the cup"."""
        other = self.object_at(end + 1) if self.words[end : end + 1] == ["from"] else None
        if place.relation != "back" or other is None or not other[0].objects:
            return place, end
        away = place.objects[0].position - other[0].objects[0].position
        far = max(SIDES, key=lambda side: float(self.scene.frame.direction(side) @ away))
        return replace(place, relation=far), other[1]

    def _distance(self, i: int) -> tuple[float | None, int]:
        amount = amount_at(self.words, i) if i < len(self) else None
        if amount is None or not (amount.unit == "m" or self._in_metres(amount, i + amount.used)):
            return None, i
        return amount.value, i + amount.used

    def _in_metres(self, amount: Amount, behind: int) -> bool:
        """Whether a number without a unit is a distance in metres: "0.05 above the cup"."""
        related = behind < len(self) and PHRASES.get(phrase_at(self.words, behind, PHRASES)[0], "at") != "at"
        return not amount.unit and amount.value < BARE_METRES and related

    def _after_articles(self, i: int) -> int:
        while i < len(self) and self._is_article(i):
            i += 1
        return i

    def _is_article(self, i: int) -> bool:
        """Whether a word is an article, and no name such as "A"."""
        return self.words[i] in ARTICLES and not self._is_letter(i)

    def is_article_at(self, i: int) -> bool:
        """Whether the word at piece i says nothing of a place."""
        return self._is_article(i)

    def _is_letter(self, i: int) -> bool:
        """Whether a word is the name of an object that is spelt as an article: "from A to B"."""
        said = self.pieces[i].text
        named = len(said) == 1 and said.isupper() and self.scene.find(said) is not None
        behind = self.words[i + 1] if i + 1 < len(self) else ""
        return named and (not behind.isalpha() or len(behind) == 1 or not self._mention(i + 1))

    def object_at(self, i: int) -> tuple[Location, int] | None:
        """The object that is named from piece i on, articles aside, and where its name ends."""
        while i < len(self) and self._is_article(i) and (self.words[i] == "a" or self._mention(i) is None):
            i += 1  # the first word of a name may be an article or a side: "right post"
        mention = self.catalog.mention_at(self.words, i, ()) if i < len(self) and self.words[i][0].isalnum() else None
        mention = mention or self._one_word_of_one(i)
        if mention is None:
            return None
        end = i + mention.used
        unclear = ""
        again = self._named_before(i) & {item.name for item in mention.items} if mention.unclear else set()
        if len(again) == 1:
            return Location(objects=(self.scene[again.pop()],)), end  # "past the north pier, slow near the pier"
        if mention.unclear or len(mention.items) != 1:
            which = " or ".join(repr(item.name) for item in mention.items) or "none fits"
            unclear = f"Which object is {' '.join(self.words[i:end])!r}: {which}?"
        return Location(objects=mention.items[:1], unclear=unclear), end

    def _one_word_of_one(self, i: int) -> Mention | None:
        """An object by a word of its name that no other one has, behind an article: "the scale", "the marbles"."""
        begins = i == 0 and [*self.words[1:2]] in (["to"], ["->"])  # "arch to booth"
        ends = i > 0 and self.words[i - 1] in ("to", "at", "from", "->") and self._closed(i + 1)  # "at reception"
        if not (begins or ends) and not (0 < i < len(self) and self._is_article(i - 1)):
            return None
        word, names = singular(self.words[i]), self.catalog.words
        items = tuple(item for item in self.scene if word in map(singular, names[item.name]))
        last = len(items) == 1 and word == singular(names[items[0].name][-1])
        return Mention(items, 1) if last or (len(items) == 1 and (word,) not in terms()) else None

    def _closed(self, i: int) -> bool:
        """Whether nothing, a mark or a word that ties stands at piece i."""
        return i >= len(self) or self.words[i] in CLOSING

    def named_again(self, i: int) -> tuple[Location, int] | None:
        """The object that a name from piece i on means only since it was named in full before, and where it ends."""
        said = self.catalog.mention_at(self.words, i, ()) if self.words[i][0].isalnum() else None
        inside = any((whole := self._mention(k)) and k + whole.used > i for k in range(max(i - NAME, 0), i))
        found = self.object_at(i) if said and said.unclear and not inside else None
        return None if found is None or found[0].unclear else found

    def _named_before(self, i: int) -> set[str]:
        """The names of the objects that are told one by one in front of piece i."""
        mentions = ((k, self._mention(k)) for k in range(i) if self.words[k][0].isalnum())
        return {said.items[0].name for k, said in mentions if said and len(said.items) == 1 and k + said.used <= i}

    def _mention(self, i: int) -> Mention | None:
        """The mention of an object that begins with piece i itself, or None."""
        mention = self.catalog.mention_at(self.words, i, ())
        return None if mention is None or mention.unclear else mention

    def between(self, i: int) -> tuple[Location, int] | None:
        """Between the two that are named from piece i on: "the box and the cup", "the posts", "the gate"."""
        both = self._pair(i)
        if both is not None:
            return both
        first = self.object_at(i)
        joined = first is not None and self.words[first[1] : first[1] + 1] in (["and"], ["n"], ["&"])
        second = self.object_at(first[1] + 1) if first is not None and joined else None
        if first is None or second is None:
            return None
        pair = (*first[0].objects, *second[0].objects)
        return Location("between", pair, unclear=first[0].unclear or second[0].unclear), second[1]

    def _pair(self, i: int) -> tuple[Location, int] | None:
        """The only two objects that a noun fits: "the two posts", or "the gate" of a left and a right one."""
        i = self._after_articles(i)
        i += self.words[i : i + 1] in (["two"], ["both"])
        i = self._after_articles(i)
        if i >= len(self):
            return None
        noun = singular(self.words[i])
        mention = self._mention(i)
        items = [item for item in self.scene if noun in self.catalog.words[item.name]]
        pair, used = (tuple(items), 1) if mention is None else (mention.items, mention.used)
        return (Location("between", pair), i + used) if len(pair) == 2 else None


_DRAWN = re.compile(r"([^\W\d_])\1{2,}")
_ITS = re.compile(
    r"\b((?:when|while|if|because|cos|since|as) )its(?= (?:near|close|at|by|on|over|going|past|in)\b)", re.I
)
_AXIS = re.compile(r"\b([xyz])_?(max|min)\b", re.I)
_THE = re.compile(r"\bt'(?=[a-z]{3})", re.I)
SHORTHAND = {"frm": "from", "o'": "of", "thru": "through", "b4": "before", "til": "until"}
_UNIT = r"(?:metre|meter|foot|feet|yard|second|minute|m|cm)"
_ASIDES = tuple(
    (re.compile(pattern, re.IGNORECASE), kept)
    for pattern, kept in (
        (r"(,?) (?:like|i'd say|let's say),? (?=\d|half an? |an? (?:half|good )?" + _UNIT + r"\b)", r"\1 "),
        (r"\b(an?) (?:good|full|solid|whole|decent) (?=(?:half an? )?" + _UNIT + r"\b|\d)", r"\1 "),
        (r",? if (?:you (?:can|could|please|would|will|may|like|don't mind|wouldn't mind)|(?:at all )?possible"
         r"|it's (?:possible|ok|okay)|that's (?:possible|ok|okay))(?=[,.;!?]|$)", ""),
        (r"\b(?:an?|one) (met(?:re|er)) and (?:a )?half\b", r"one and a half \1s"),
        (r"\b(\w+) (met(?:re|er))s and (?:a )?half\b", r"\1 and a half \2s"),
        (r",? i (?:think|guess|suppose|reckon)(?=[,.;!?]|$)", ""),
        (r"\b((?:fast|slow|high|low|close|near|furth|farth)er|more|less) then\b", r"\1 than"),
    )
)  # fmt: skip
"""What people put around an amount or behind a wish without asking for anything by it, and what is left of it."""

_SHORT = re.compile(rf"(?<![\w/])({'|'.join(SHORTHAND)})(?=\s)", re.IGNORECASE)


def _spaced(text: str, scene: Scene) -> str:
    """A text with the names of a scene's objects that are written with underscores, such as "bin_A", as words."""
    for name in (name for name in scene.names if "_" in name):
        text = re.sub(rf"\b{re.escape(name)}\b", name.replace("_", " "), text, flags=re.IGNORECASE)
    return text


def _settled(text: str) -> str:
    """A text without drawn-out letters and the shorthand of messages: "pleeease", "frm"."""
    text = _AXIS.sub(r"\1 \2", text)
    for pattern, kept in _ASIDES:
        text = pattern.sub(kept, text)
    text = _THE.sub("the ", _ITS.sub(r"\1it's", _DRAWN.sub(r"\1", text)))
    return _SHORT.sub(lambda found: SHORTHAND[found[0].lower()], text)


def _cut(text: str) -> list[Snippet]:
    pieces = []
    for found in _SNIPPET.finditer(text):
        place: tuple[float, float, float] | None = None
        if found["triple"] is not None:
            x, y, z = (float(value) for value in re.findall(_NUMBER, found["triple"].lower()))
            place = (x, y, z)
        pieces.append(Snippet("->" if found["arrow"] else found[0].strip(), found.span(), place))
    return pieces


def mentioned_in(words: str, scene: Scene) -> list[str]:
    """The objects that some words mention."""
    text = Text(words, scene)
    found = (text.object_at(k) for k in range(len(text)))
    return [item.name for place in found if place is not None and not place[0].unclear for item in place[0].objects]


def read_place(text: str, scene: Scene) -> Location:
    """Read a place in words or as coordinates.

    Raises:
        RequestError: If it is none, or the words fit several objects.
    """
    named = scene.find(text)
    if named is not None:
        return Location(objects=(named,))
    pieces = Text(text, scene)
    found = pieces.place_at(0) if len(pieces) else None
    if found is None or found[1] != len(pieces):
        names = ", ".join(repr(name) for name in scene.names)
        if not names:
            raise RequestError(f"{text!r} is no place: give x,y,z in metres, as the scene holds no objects")
        raise RequestError(
            f"{text!r} is no place: give x,y,z in metres or an object of the scene ({names}), "
            f"such as 'box', 'above the box' or '0.1 m left of the box'"
        )
    if found[0].unclear:
        raise RequestError(found[0].unclear)
    return found[0]


def locate(said: Location, scene: Scene, robot: Robot, toward: Array | None = None) -> Anchor:
    """Where a place is for a robot.

    Args:
        said: The place.
        scene: With all obstacles.
        robot: Its distance to obstacles, workspace, and whether it stays on a plane.
        toward: Where the path comes from or goes to (3,) [m]; chooses among the sides of an object.

    Raises:
        RequestError: If there is no such place, such as above an object for a robot on the ground.
    """
    there = _located(replace(said, height=None), scene, robot, toward)
    if said.height is None or robot.planar:
        return there
    up = scene.frame.direction("up")
    position = there.position + (said.height - float(there.position @ up)) * up
    return replace(there, position=position, label=f"{there.label} at a height of {number(said.height)} m")


def _located(said: Location, scene: Scene, robot: Robot, toward: Array | None) -> Anchor:
    names = tuple(item.name for item in said.objects)
    if said.point is not None:
        return Anchor(np.array(said.point), said.label)
    if said.relation == "between":
        middle = (said.objects[0].position + said.objects[1].position) / 2.0
        return Anchor(_on_plane(middle, robot), said.label, names)
    item = said.objects[0]
    if said.relation in ("over", "under") and robot.planar:
        raise RequestError(f"{robot.name} stays on the ground, so it cannot be {said.label}; name a side of it")
    if said.relation in ("at", "beside"):
        return _free_place(said, item, scene, robot, toward)
    word = {"over": "up", "under": "down"}.get(said.relation, said.relation)
    direction = scene.frame.direction(word) if said.away is None else np.array(said.away)
    return Anchor(_beside(item, robot, direction, said.distance), said.label, names)


def _beside(item: SceneObject, robot: Robot, direction: Array, distance: float | None) -> Array:
    """The point at a distance [m] from an object's surface in some direction."""
    low_down = is_support(item)  # a robot may come down to it, so no distance is too small
    body = from_object(replace(item, extra={}) if low_down else item, robot, "box")
    wanted = APPROACH if distance is None else distance - body.radius
    wanted = wanted if low_down else max(wanted, 0.0)
    low, high = 0.0, float(body.support(direction[None])[0] - direction @ body.center) + max(wanted, 0.0)
    for _ in range(50):  # the distance grows along the ray, since the body is convex
        middle = (low + high) / 2.0
        near = float(body.signed((body.center + middle * direction)[None])[0][0]) < wanted
        low, high = (middle, high) if near else (low, middle)
    return _on_plane(body.center + high * direction, robot)


def _on_plane(position: Array, robot: Robot) -> Array:
    """The position on the plane that a planar robot keeps to, by its workspace; any other as it is."""
    if not robot.planar:
        return position
    lower, upper = bounds(robot)
    flat = position.copy()
    flat[2] = lower[2] if np.isfinite(lower[2]) and lower[2] == upper[2] else np.clip(0.0, lower[2], upper[2])
    return flat


def _free_place(said: Location, item: SceneObject, scene: Scene, robot: Robot, toward: Array | None) -> Anchor:
    """Above an object, or at the side of it that is nearest to where the path comes from, if that is legal."""
    over = not robot.planar and said.relation != "beside"
    above = [_beside(item, robot, scene.frame.direction("up"), said.distance)] if over else []
    tried = [*above, *sides_of(said, scene, robot, toward)]
    best = next((place for place in tried if not troubles(place, scene, robot)), tried[0])
    label = f"above {the(item.name)}" if above and best is tried[0] else f"beside {the(item.name)}"
    return Anchor(best, label, (item.name,))


def sides_of(said: Location, scene: Scene, robot: Robot, toward: Array | None) -> list[Array]:
    """Places (3,) [m] around an object, the nearest to where the path comes from first."""
    right, front = (scene.frame.direction(word) for word in ("right", "front"))
    angles = np.linspace(0.0, 2.0 * np.pi, AROUND, endpoint=False)
    directions = np.cos(angles)[:, None] * right + np.sin(angles)[:, None] * front
    item = said.objects[0]
    sides = [_low_enough(_beside(item, robot, direction, said.distance), robot) for direction in directions]
    if toward is not None:
        sides.sort(key=lambda place: round(float(np.linalg.norm(place - toward)), 9))
    return sides


def _low_enough(position: Array, robot: Robot) -> Array:
    """A place beside the middle of something tall, lower where a workspace ends below that."""
    top = robot.workspace.upper[2] - robot.margin if isinstance(robot.workspace, Box) else np.inf
    return np.array([*position[:2], min(position[2], top)])


def troubles(position: Array, scene: Scene, robot: Robot) -> list[str]:
    """Why a point cannot be on a legal path, each as the end of a sentence that begins with it; none if it can."""
    said = []
    if robot.workspace is not None:
        outside = robot.margin - float(robot.workspace.inside(position[None])[0])
        if outside > TOLERANCE:
            where = robot.workspace.describe()
            said.append(f"lies {number(outside)} m outside the workspace ({where}, margin {robot.margin:g} m)")
    for body in obstacles(scene, robot):
        depth = -float(body.signed(position[None])[0][0])
        if depth > TOLERANCE and body.what == "obstacle":
            said.append(f"lies {number(depth)} m inside {body.name!r} with its margin of {number(body.keep)} m")
    return said


def obstacles(scene: Scene, robot: Robot) -> tuple[Obstacle, ...]:
    """What a path must keep out of: the objects with the distance to keep, and the middle of a shell."""
    return flatten([*keep_out(robot), *obstacles_of(scene, robot)], *bounds(robot))
