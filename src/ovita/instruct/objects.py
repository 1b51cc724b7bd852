"""Object references: by name, kind, colour or shape, by a superlative, as a group, or as "it"."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ovita.instruct.lexicon import concept_at, is_filler, is_known, sorts_of
from ovita.instruct.numerals import NUMBER_WORDS
from ovita.limits.problem import is_support, kind_of
from ovita.paths.scene import POINT, Scene, SceneObject, canonical
from ovita.paths.trajectory import Array

WORD = re.compile(
    rf"{POINT.pattern}|"
    r"\d+[.,]\d+|\d+|\.\d+|m/s(?:\^?2|²)|m/s|cm/s|mm/s|km/h|[^\W\d_]+(?:['’][^\W\d_]+)?|%|°|[.,;:!?()]|[-+_/]"
)  # the pieces that a sentence, a name and a description are cut into


NAMED = 5
"""Words of a name whose last word, or others, may stand for it; what is longer is a text, known by all of it."""

SKIPPED = frozenset("the a an this that these those of our my".split())
SAME: tuple[frozenset[str], ...] = tuple(
    frozenset(words.split())
    for words in (
        "round circular spherical ball circle sphere",
        "grey gray",
        "big large",
        "small little tiny",
        "metal metallic steel iron",
        "wooden wood",
        "rectangular square boxy cubic cube box",
    )
)
"""Words that describe the same."""


def traits(scene: Scene, words: Mapping[str, tuple[str, ...]]) -> dict[str, set[str]]:
    """The descriptive words of each object: from its name, a line "name: ..." of the description, and its phrases."""
    found = {name: set(_but_head(told)) if len(told) <= NAMED else set() for name, told in words.items()}
    for line in scene.environment.lower().splitlines():
        subject, colon, told = line.partition(":")
        named = _named_in(_words_of(subject), scene, words) if colon else []
        if len(named) == 1:
            found[named[0].name] |= _traits_of(_words_of(told))
            continue
        for phrase in re.split(r"[.;,]|\band (?=the )|\bwhile\b|\bwhereas\b", line):
            pieces = _words_of(phrase)
            about = _named_in(pieces, scene, words)
            if len(about) == 1:
                found[about[0].name] |= _traits_of(_said_of(pieces, pieces.index(head_of(words[about[0].name]))))
    return {name: told - {head_of(words[name])} for name, told in found.items()}


def head_of(words: Sequence[str]) -> str:
    """The noun in the words of a name: the last, but for a number or a letter behind it ("pylon 2"); "" of none."""
    return next((word for word in reversed(words) if len(word) > 1 and not word.isdigit()), "".join(words[-1:]))


def _but_head(words: Sequence[str]) -> list[str]:
    head = head_of(words)
    return [word for word in words if word != head]


def _traits_of(words: Sequence[str]) -> set[str]:
    return {word for word in words if len(word) > 2 and _describes(word)}


def _words_of(text: str) -> list[str]:
    return [singular(w) for w in WORD.findall(text) if w[0].isalnum()]


def _named_in(pieces: list[str], scene: Scene, words: Mapping[str, tuple[str, ...]]) -> list[SceneObject]:
    """The objects that a phrase names: by their whole names, else by their heads."""
    about = [item for item in scene if words[item.name] and head_of(words[item.name]) in pieces]
    return [item for item in about if set(words[item.name]) <= set(pieces)] or about


def _said_of(pieces: list[str], head: int) -> list[str]:
    """The words right before a noun, up to an article, and those behind its "is" or "with"."""
    before: list[str] = []
    for word in reversed(pieces[max(head - 3, 0) : head]):
        if word in SKIPPED or is_filler(word):
            break
        before.append(word)
    behind = pieces[head + 1 :]
    return before + (
        behind[1:] if behind and behind[0] in ("is", "are", "was", "has", "look", "looks", "with", "of", "made") else []
    )


def _describes(word: str) -> bool:
    """Whether a word of a description is a trait, rather than a word of the grammar or of motion."""
    if any(word in same for same in SAME):
        return True
    return word != "and" and not is_filler(word) and not concept_at((word,), 0)[0]


def name_words(item: SceneObject) -> tuple[str, ...]:
    """The words of an object's name, cut as a sentence is cut."""
    return tuple(w for w in WORD.findall(canonical(item.name)) if w[0].isalnum())


def singular(word: str) -> str:
    """A noun without its plural s and without a possessive."""
    word = re.sub(r"['’]s?$", "", word)
    if word in IRREGULAR:
        return IRREGULAR[word]
    if len(word) > 4 and word.endswith(("xes", "ches", "shes", "sses", "atoes")):
        return word[:-2]
    return word[:-1] if len(word) > 3 and word.endswith("s") and not word.endswith("ss") else word


IRREGULAR = {
    "people": "person", "children": "child", "men": "man", "women": "woman", "mice": "mouse", "geese": "goose",
    "shelves": "shelf", "knives": "knife", "leaves": "leaf", "loaves": "loaf", "scarves": "scarf", "wolves": "wolf",
}  # fmt: skip
"""Plurals that end otherwise than in s."""

GENERIC = frozenset("object obstacle thing item one landmark entity".split())
QUANTIFIERS = frozenset("all both every each any either".split())
LINKS = (
    "that is", "that are", "which is", "which are", "that looks", "made of", "made from", "with the", "with a", "in",
    "that has a",
)  # fmt: skip
SHAPED = frozenset("shaped coloured colored looking colour color shape made like".split())
BEFORE_IT = frozenset(
    """near to from at around by past over above below under behind beside toward towards through via against after
    before until""".split()
)

OF_IT = ("clear of", "left of", "right of", "front of", "top of")

Measure = Callable[[SceneObject], float]


@dataclass(frozen=True)
class Mention:
    """Objects that some words mean.

    Args:
        items: The objects; several for a group, or for words that fit several.
        used: How many words.
        unclear: Whether one object was meant but several fit, or none does.
    """

    items: tuple[SceneObject, ...]
    used: int
    unclear: bool = False


class Catalog:
    """The ways to refer to the objects of a scene.

    Args:
        scene: The scene.
        path: Positions (N, 3) [m] that "nearest to the goal" and the like are measured from, or None.
    """

    def __init__(self, scene: Scene, path: Array | None = None) -> None:
        self.scene, self.path = scene, path
        self.things = tuple(item for item in scene if not is_support(item))  # "everything" leaves out what it stands on
        self.words = {item.name: name_words(item) for item in scene}
        self.heads: dict[str, list[SceneObject]] = {}
        for item in scene:
            if 0 < len(self.words[item.name]) <= NAMED:
                self.heads.setdefault(head_of(self.words[item.name]), []).append(item)
        self.sorts: dict[str, list[SceneObject]] = {}
        for item in scene:
            for sort in sorts_of([singular(word) for word in self.words[item.name]]):
                self.sorts.setdefault(sort, []).append(item)
        self.names = self._all_names()
        self.longest = max((len(name) for name in self.names), default=0)
        self.traits = traits(scene, self.words)
        known = set().union(*self.traits.values())
        self.vocabulary = known | {other for same in SAME if same & known for other in same}

    def _all_names(self) -> dict[tuple[str, ...], SceneObject]:
        """The objects by their names, by these in one word ("toolbox"), and by a last word that only one has."""
        names = {self.words[item.name]: item for item in self.scene if self.words[item.name]}
        names = {("".join(words),): item for words, item in names.items()} | names
        for head, items in self.heads.items():
            if head in NUMBERED:
                continue
            if len(items) == 1 and not concept_at((head,), 0)[0] and not is_filler(head):
                names.setdefault((head,), items[0])
            elif len(items) == 1 and is_filler(head) and head not in ROBOT:
                names.setdefault(("the", head), items[0])  # "the leg" of a path, where no object has one
        return self._the_person() | names

    def _the_person(self) -> dict[tuple[str, ...], SceneObject]:
        """The only person there is, by all words for one."""
        people = [item for item in self.scene if _is_person(item)]
        if len(people) != 1:
            return {}
        words = (*PEOPLE, *(ANYBODY if head_of(self.words[people[0].name]) in PEOPLE else ()))
        return {(whose, word): people[0] for word in words for whose in ("the", "my", "our", "his", "her", "that")}

    def mention_at(self, words: Sequence[str], i: int, earlier: tuple[SceneObject, ...]) -> Mention | None:
        """The objects that the words from i on mean, or None.

        Args:
            words: The sentence, lower case.
            i: Where the mention would begin.
            earlier: The objects that were named last.
        """
        if POINT.fullmatch(words[i]):
            return Mention((self.scene[words[i]],), 1)
        described, named = self._described(words, i, earlier), self._named(words, i)
        if named is not None and (described is None or described.unclear or named.used >= described.used):
            return named
        if described is not None:
            same = self._named(words, i + 1) if words[i] in SKIPPED else None
            longer = same is not None and same.used + 1 >= described.used
            return replace(same, used=same.used + 1) if same and longer else described  # the second bracket, by name
        items = self._pronoun(words, i, earlier)
        return Mention(items, 1) if items else None

    def _pronoun(self, words: Sequence[str], i: int, earlier: tuple[SceneObject, ...]) -> tuple[SceneObject, ...]:
        """What was named last, for "near it"; all that may be in the way, for "away from everything"; or ()."""
        before = words[i - 1] if i else ""
        if words[i] in ("it", "them"):
            return earlier if before in BEFORE_IT or " ".join(words[i - 2 : i]) in OF_IT else ()
        everything = words[i] in ("everything", "anything") and before in ("from", "near", "than")
        return self.things if everything else ()

    def _named(self, words: Sequence[str], i: int) -> Mention | None:
        best: Mention | None = None
        collected: list[str] = []
        for used in range(1, min(max(self.longest, 2), len(words) - i) + 1):
            word = words[i + used - 1]
            if not word[0].isalnum():
                break
            collected.append(word)
            joined = ("".join(collected),)  # "tool box" for a toolbox
            for form in (tuple(collected), (*collected[:-1], singular(word)), joined):
                if form in self.names:
                    best = Mention((self.names[form],), used)
        return best

    def _described(self, words: Sequence[str], i: int, earlier: tuple[SceneObject, ...]) -> Mention | None:
        """The red one; both boxes; the tallest obstacle; the object nearest to the goal."""
        reader = _Phrase(self, words, i)
        items = reader.read()
        if items is None:
            return None
        items = self._picked(reader, items, earlier)
        wanted = reader.expected if reader.expected is not None or reader.many else 1
        unclear = not items or (wanted is not None and len(items) != wanted)
        return Mention(tuple(items), reader.at - i, unclear)

    def _picked(self, reader: _Phrase, items: list[SceneObject], earlier: tuple[SceneObject, ...]) -> list[SceneObject]:
        """Of the objects that fit a noun phrase: the others, the nearest or tallest, the second one."""
        if reader.other:
            items = [item for item in items if not any(item is known for known in earlier)]
        if reader.key is not None and items:
            items = [max(items, key=reader.key)]
        if reader.ordinal is not None:
            items = sorted(items, key=self._along)[reader.ordinal : reader.ordinal + 1 or None]
        return items

    def _along(self, item: SceneObject) -> float:
        return 0.0 if self.path is None else float(np.argmin(item.distance(self.path)))

    def is_noun(self, word: str) -> bool:
        """Whether a word, in the singular or the plural, means objects of some kind."""
        return self.of_kind(singular(word)) is not None or singular(word) in self.sorts

    def of_kind(self, noun: str) -> Sequence[SceneObject] | None:
        """The objects of the kind that a noun means; None where it means none."""
        return self.things if noun in GENERIC else self.heads.get(noun)

    def fits(self, item: SceneObject, trait: str) -> bool:
        """Whether a word describes an object, by its name or by the scene's description."""
        told = self.traits[item.name] | set(self.words[item.name])
        return trait in told or any(trait in same and same & told for same in SAME)

    def measure(self, word: str) -> Measure | None:
        """What a superlative compares, so that the largest value wins; None for other words."""
        if word in TOWARDS:
            axis = self.scene.frame.direction(TOWARDS[word])
            return lambda item: float(item.position @ axis)
        up = self.scene.frame.direction("up")
        sizes: dict[str, Measure] = {
            "tall": lambda item: float(np.abs(item.rotation.T @ up) @ item.size),
            "big": lambda item: float(np.prod(item.size)),
            "wide": lambda item: float(item.size[:2].max()),
        }
        sign, name = SIZED.get(word, (0.0, ""))
        return (lambda item: sign * sizes[name](item)) if name else None

    def nearness(self, words: Sequence[str], i: int) -> tuple[Measure, int] | None:
        """Read "nearest [to the goal]": the measure and the words taken."""
        sign = NEARNESS.get("".join(words[i : i + 1]), 0.0)
        at = next((k for k in range(i + 1, len(words)) if words[k] not in BEFORE_SPOT), len(words))
        if not sign or self.path is None:
            return None
        target, used = self._spot(words, at) if at > i + 1 else (self.path, 0)
        if target is None:
            return None
        points = target
        return (lambda item: sign * float(item.distance(points).min())), at + used - i

    def _spot(self, words: Sequence[str], at: int) -> tuple[Array | None, int]:
        """What something is nearest to, as positions (N, 3) [m], and the words taken; None for nothing known."""
        word = "".join(words[at : at + 1])
        if self.path is None or not word:
            return None, 0
        if word in SPOTS:
            named = words[at + 1 : at + 2] in (["position"], ["point"])
            return self.path[SPOTS[word]][None], 1 + named
        if word in ("path", "trajectory", "robot", "route", "me", "you"):
            return self.path, 1
        mention = self._named(words, at)
        return (None, 0) if mention is None else (mention.items[0].position[None], mention.used)


def _is_person(item: SceneObject) -> bool:
    kind = kind_of(item.name, item.extra)
    return kind is not None and kind.name == "person"


NUMBERED = frozenset("one two three four five six seven eight nine ten".split())
"""Words that are numbers even where an object's name ends in them: the bicycle built for two."""

PEOPLE = ("person", "man", "woman", "guy", "lady", "human")
"""Words that fit any person, whatever the scene calls it."""

ANYBODY = (
    "kid", "child", "boy", "girl", "son", "daughter", "worker", "operator", "colleague", "visitor", "pedestrian",
    "customer", "patient", "mother", "father", "mom", "mum", "dad", "wife", "husband", "friend", "technician",
)  # fmt: skip
"""Words that fit a person of whom the scene says no more than that."""

ROBOT = frozenset(
    """robot arm drone gripper tool tip machine vehicle platform rover system device craft path part parts bit spot
    place piece position way run line course""".split()
)
"""Words that mean the robot or its path even where an object's name ends in them."""

NEARNESS = {"nearest": -1.0, "closest": -1.0, "farthest": 1.0, "furthest": 1.0}
BEFORE_SPOT = ("to", "from", "away", "the", "by")
SPOTS = dict.fromkeys("goal end destination target".split(), -1) | dict.fromkeys("start beginning origin".split(), 0)
"""Words for the ends of the path, as indices."""


TOWARDS = {
    "leftmost": "left", "rightmost": "right", "frontmost": "front", "foremost": "front",
    **dict.fromkeys(("topmost", "highest", "uppermost"), "up"),
    **dict.fromkeys(("bottommost", "lowest", "lowermost"), "down"),
    **dict.fromkeys(("rearmost", "backmost", "hindmost"), "back"),
}  # fmt: skip
"""Superlatives of places, and the direction in which they lie."""

SIZED = {
    **dict.fromkeys(("tallest", "taller"), (1.0, "tall")), **dict.fromkeys(("shortest", "shorter"), (-1.0, "tall")),
    **dict.fromkeys(("biggest", "largest", "bulkiest", "hugest", "bigger", "larger"), (1.0, "big")),
    **dict.fromkeys(("smallest", "tiniest", "littlest", "smaller"), (-1.0, "big")),
    **dict.fromkeys(("widest", "longest", "wider", "longer"), (1.0, "wide")),
    **dict.fromkeys(("narrowest", "narrower"), (-1.0, "wide")),
}  # fmt: skip
"""Superlatives of sizes, and comparatives that pick one of two, and what they compare."""


COUNTED = {"first": 0, "second": 1, "third": 2, "last": -1}
"""Ordinals before a noun, as indices along the path."""


class _Phrase:
    """A noun phrase: quantifier, superlative, traits, noun, and postmodifiers."""

    def __init__(self, catalog: Catalog, words: Sequence[str], i: int) -> None:
        self.catalog, self.words, self.at = catalog, words, i
        self.many = self.other = False
        self.expected: int | None = None
        self.key: Measure | None = None
        self.ordinal: int | None = None
        self.traits: list[str] = []

    def word(self) -> str:
        return "".join(self.words[self.at : self.at + 1])

    def skip(self) -> None:
        while self.word() in SKIPPED:
            self.at += 1

    def read(self) -> list[SceneObject] | None:
        """The objects that fit, or None if this is no description of an object."""
        begin = self.at
        self.skip()
        quantified = self._quantifier()
        self.skip()
        self._modifiers()
        noun, plural = singular(self.word()), self.word() != singular(self.word())
        of_kind = self.catalog.of_kind(noun)
        of_sort = of_kind is None and self._may_be_sort(noun, begin)
        of_kind = self.catalog.sorts.get(noun) if of_sort else of_kind
        if of_kind is None or (noun == "one" and not self._tells_one()):
            return None
        self.at += 1
        self._behind()
        self.many = self.many or plural
        items = [item for item in of_kind if all(self.catalog.fits(item, trait) for trait in self.traits)]
        mere = not (noun in GENERIC or of_sort or quantified or plural or self._told())
        return None if mere and len(items) == 1 else items

    def _may_be_sort(self, noun: str, begin: int) -> bool:
        """Whether a noun may be a sort of things: not "a light touch", nor a word of the language alone."""
        any_one = {"a", "an"} & {*self.words[max(begin - 1, 0) : begin + 1]}
        return not any_one and (self.at > begin or self.word() != noun or not is_known(noun))

    def _told(self) -> bool:
        """Whether something besides a noun has been said of the objects."""
        return bool(self.traits) or self.key is not None or self.ordinal is not None or self.other

    def _tells_one(self) -> bool:
        """Whether "one" is an object; "the second one" of things of several kinds may be anything."""
        counted = self.ordinal is not None and not self.traits and len(self.catalog.heads) > 1
        return self._told() and not counted

    def _quantifier(self) -> bool:
        word = self.word()
        if word in QUANTIFIERS:
            self.at += 1
            self.many = True
            self.expected = 2 if word in ("both", "either") else None
            self.skip()
            word = self.word()
        following = self._peek()
        plural = singular(following) != following and self.catalog.is_noun(following)
        if plural and (count := NUMBER_WORDS.get(word, 0)) >= 2:
            self.at += 1
            self.many, self.expected = True, int(count)
        return self.many

    def _modifiers(self) -> None:
        while self.at < len(self.words) and self._modifier():
            self.at += 1

    def _modifier(self) -> bool:
        """Read one word before the noun; whether there was one."""
        word = self.word()
        near = self.catalog.nearness(self.words, self.at)
        key = self.catalog.measure(word) or (near[0] if near is not None and near[1] == 1 else None)
        if key is not None:
            self.key = key
        elif word == "other":
            self.other = True
        elif word in COUNTED and self.catalog.is_noun(self._peek()):
            self.ordinal = COUNTED[word]
        elif word in self.catalog.vocabulary and not self._is_noun_here():
            self._trait()
        else:
            return False
        return True

    def _trait(self) -> None:
        """Read a word that describes, and a "shaped" or "coloured" behind it; `at` stays on the last one."""
        self.traits.append(self.word())
        while self._peek() in SHAPED:
            self.at += 1

    def _peek(self) -> str:
        return "".join(self.words[self.at + 1 : self.at + 2])

    def _is_noun_here(self) -> bool:
        """Whether the word at hand is the noun itself: a head with no further noun behind it."""
        behind = self._peek()
        described = behind in SHAPED or behind in self.catalog.vocabulary
        return singular(self.word()) in self.catalog.heads and not (described or self.catalog.is_noun(behind))

    def _behind(self) -> None:
        """Read "that is red", "made of glass", "nearest to the goal", "on the left"."""
        begin, text = self.at, " ".join(self.words[self.at : self.at + 8])
        link = next((link for link in LINKS if text.startswith(link + " ")), "")
        if link:
            self.at += len(link.split())
            self.skip()
        near = self.catalog.nearness(self.words, self.at)
        if link and self.word() in self.catalog.vocabulary:
            self._trait()
            self.at += 1
        elif near is not None:
            self.key, self.at = near[0], self.at + near[1]
        else:
            self.at = begin
