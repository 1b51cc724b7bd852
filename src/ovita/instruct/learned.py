"""The learned reader: what a small network thinks that a sentence asks for, and how sure it may be.

The network points at objects and amounts; what stands there is read by the same readers as everywhere. How likely a
reading is right was calibrated on voices that it had not been trained on (`training/calibrate.py`).
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np

from ovita import text as words_of
from ovita.instruct.editing import directions_of
from ovita.instruct.editing import slots as slots_of
from ovita.instruct.edits import Also
from ovita.instruct.encoder import QUERIES, Network, Output, concepts_of, encode, network
from ovita.instruct.frames import Quantity, Reading, SemanticFrame, name_of
from ovita.instruct.notation import DIRECTIONS
from ovita.instruct.sketch import Referent, Sketch, sketch
from ovita.instruct.slots import ACTIONS, AMOUNTS, CHOICES, HEADS, TRAINED, TURNS, Atom, Unfit, items_of
from ovita.instruct.together import aimed, held_along
from ovita.instruct.whereabouts import placed
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array

_FIGURES = ("circle", "spiral", "eight", "zigzag", "wave", "shake")
WITH_PART = ("place", "toward", "outside")
OF_ACTION: dict[str, tuple[str, ...]] = {
    "pace": ("choice", "role", "step", "degree", "part"),
    "move": ("direction", "degree", "part"),
    "end": ("choice", "relation", "direction", "step", "degree", "spot"),
    **dict.fromkeys(("closer", "farther", "smooth"), ("degree", "part")),
    "clearance": ("role", "part"),
    "height": ("role", "spot", "step", "part"),
    "via": ("relation", "degree"),
    "avoid": ("relation",),
    **dict.fromkeys(("side", "tilt"), ("direction",)),
    "keep": ("choice", "part"),
    "waypoints": ("choice", "step", "part"),
    "stop": ("spot",),
    "wait": ("spot", "step"),
    "extend": ("direction", "spot", "step"),
    "bound": ("direction", "spot"),
    **dict.fromkeys(_FIGURES, ("spot", "sense", "degree", "part")),
    **dict.fromkeys(("wave", "zigzag"), ("spot", "direction", "degree", "part")),
    "spiral": ("spot", "sense", "step", "degree", "part"),
    **dict.fromkeys(("mirror", "trim"), ("choice", "spot")),
    "rotate": ("sense", "spot"),
    "resize": ("choice", "degree", "spot"),
    "curve": ("choice", "degree", "part"),
    **dict.fromkeys(("straighten", "level", "nonstop"), ("part",)),
    "arrive": ("direction", "spot"),
    **dict.fromkeys(("quadrant", "ask", "improper", "undo", "redo"), ("choice",)),
    "scale": ("choice", "degree", "on"),
    "set": ("choice", "direction", "step", "on"),
    "replace": ("choice", "direction", "spot", "on"),
    **dict.fromkeys(("restrict", "except"), ("part", "on")),
    **dict.fromkeys(("flip", "drop", "again"), ("on",)),
}  # fmt: skip
"""The heads that count for an action besides the action itself."""

_ONE_AMOUNT = ("move", "extend", "bound", "end", "tilt", "rotate", "waypoints", "height", "resize", "trim", "pace",
               "arrive", "set", "scale")  # fmt: skip
_OF_OBJECTS = ("closer", "farther", "clearance", "via", "side", "hop", "avoid")
POINTS: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(_ONE_AMOUNT, ("amount",)),
    **dict.fromkeys(_OF_OBJECTS, ("amount", "objects1", "objects2", "objects3")),
    **dict.fromkeys(_FIGURES, ("radius", "size", "turns", "rise")),
    "hover": ("amount", "duration", "objects1"),
    "stop": ("amount",),
    "wait": ("amount", "duration"),
    "replace": ("objects1", "objects2"),
}
"""What each action may point at, besides its place and its part of the path."""

_FIRST = ("none", "ask", "improper", *TRAINED)
Allowed: TypeAlias = Mapping[tuple[str, str], Sequence[str]]
"""The classes that a head may say for an action."""

ALLOWED: Allowed = {
    ("clearance", "role"): ("at_least", "at_most", "at"),
    ("height", "role"): ("to", "at_least", "at_most"),
    ("pace", "role"): ("by", "to"),
    **{(action, "direction"): DIRECTIONS for action in ("move", "tilt", "bound", "arrive")},
    ("side", "direction"): (*DIRECTIONS, "other"),
    **{(action, "direction"): ("", *DIRECTIONS) for action in ("end", "extend", "set", "replace")},
    ("end", "relation"): ("", "to", "toward", "away"),
    ("via", "relation"): ("", "over", "under", "between"),
    ("avoid", "relation"): ("over", "under", "between"),
    ("end", "spot"): ("", "object", "start", "goal", "middle", "objects"),
    ("replace", "spot"): ("", "start", "goal"),
    **{(action, "spot"): ("", "object") for action in ("extend", "bound", "arrive", "height")},
    **{(action, "direction"): ("", "up") for action in ("wave", "zigzag")},
    ("wait", "step"): ("0", "1"),
    **{(action, "step"): ("0", "-1") for action in ("extend", "height", "spiral", "pace", "waypoints", "end")},
    **{(action, "choice"): words for action, words in CHOICES.items()},
}  # fmt: skip
"""What a head may say for an action, where that is not everything."""

NEEDED: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(("closer", "farther", "via", "side", "hop", "hover", "avoid"), ("objects1",)),
    "clearance": ("objects1",),
    "set": ("amount",),
}  # fmt: skip
"""Pointers without which an action is nothing."""

NEEDED_BY: dict[tuple[str, str], tuple[str, ...]] = {
    ("relation", "between"): ("objects2",),
    **{("spot", spot): ("objects1",) for spot in ("object", "objects")},
    **{("part", kind): ("places1",) for kind in ("near", "after", "before")},
    ("choice", "objects"): ("objects1",),
    ("part", "between"): ("places1", "places2"),
    **{("part", kind): ("part",) for kind in ("from", "every")},
    ("part", "range"): ("part", "until"),
}
"""Pointers without which a class of a head is nothing."""

QUESTIONS = {
    "which": "which object is meant",
    "where": "which way or which place is meant",
    "how much": "how much is meant",
    "what": "what exactly should change",
}
IMPROPER = {
    "unrelated": "this is not about the path",
    "contradiction": "this contradicts itself",
    "nonsense": "nothing in this says how the path should change",
    "cannot": "this is more than the built-in reader can say about a path",
    "question": "this asks about the path and changes nothing",
}
BESIDES = {
    "": "",
    **dict.fromkeys(CHOICES["improper"], "one of the wishes is not about the path, and is left out"),
    "cannot": "one of the wishes is more than the built-in reader can say about a path, and is left out",
    "question": "what is asked about the path is not answered here",
}
"""What is said of a wish beside others that no frame can say, by its kind."""

FEATURES = (
    "likelihood", "weakest", "certainty", "words left", "refused", "misread", "refusal", "doubted", "entropy",
    "actions", "end",
)  # fmt: skip
"""What the confidence is calibrated on."""

LEAST = 1e-6
"""No class is held to be less likely than this."""


@dataclass(frozen=True)
class Choice:
    """What was read off the network.

    Args:
        atoms: What is asked for.
        likelihoods: How likely each choice was that they needed.
        used: The mentions that they point at.
        besides: What is asked for besides that no atom can say, as in IMPROPER, or "".
    """

    atoms: tuple[Atom, ...]
    likelihoods: tuple[float, ...]
    used: frozenset[int]
    besides: str = ""


@dataclass(frozen=True)
class NetworkReading:
    """What the network says of a sentence.

    Args:
        seen: The sentence with what it mentions.
        output: Probabilities of all classes and pointers.
        before: Frames of the turns in force, or None for a first request.
    """

    seen: Sketch
    output: Output
    before: Sequence[SemanticFrame] | None = None


class LearnedReader:
    """Reads sentences by the network that the package brings, or by another one.

    Args:
        net: The network; by default that of the package, loaded when the first sentence is read.
    """

    def __init__(self, net: Network | None = None) -> None:
        self._net = net

    @property
    def net(self) -> Network:
        """The network, loaded at the first use."""
        if self._net is None:
            self._net = network()
        return self._net

    def read(
        self, text: str, scene: Scene, positions: Array | None = None, before: Sequence[SemanticFrame] | None = None
    ) -> Reading:
        """What a sentence asks for.

        Args:
            text: As written.
            scene: Whose objects may be named.
            positions: The path (N, 3) [m], for "the object nearest to the goal".
            before: Frames of the turns in force; then the sentence may also change them (`Reading.edits`).
        """
        return self.reading(self.hear(text, scene, positions, before))

    def hear(
        self, text: str, scene: Scene, positions: Array | None = None, before: Sequence[SemanticFrame] | None = None
    ) -> NetworkReading:
        """What the network says of a sentence, from which readings are taken."""
        seen = sketch(text, scene, positions, before, self.net.known)
        return NetworkReading(seen, self.net.read(encode(seen, self.net.splitter)), before)

    def reading(self, heard: NetworkReading) -> Reading:
        """The likeliest reading, with its calibrated confidence."""
        reading, features = self.explain(heard)
        if reading.improper == IMPROPER["contradiction"] and (otherwise := _not_refused(heard.output)) is not None:
            other, of_other = self.explain(replace(heard, output=otherwise))
            if (other.frames or other.edits) and not other.unread:  # rarely does one contradict oneself
                return replace(other, confidence=round(min(self.sure(of_other), DOUBTFUL), 4))
        return replace(reading, confidence=round(self.sure(features), 4))

    def runners_up(self, heard: NetworkReading) -> list[Reading]:
        """Other readings, the likeliest first: each with one choice made otherwise."""
        forced = [NetworkReading(heard.seen, output, heard.before) for output in _otherwise(heard)]
        rated = [(math.prod(choose(one.output, heard.seen, heard.before).likelihoods), one) for one in forced]
        return [self.reading(one) for _, one in sorted(rated, key=lambda pair: -pair[0])]

    def explain(self, heard: NetworkReading) -> tuple[Reading, Array]:
        """The reading before its confidence is calibrated, and the features (F,) that it is calibrated on."""
        seen, before = heard.seen, heard.before
        choice = choose(heard.output, seen, before)
        outcome = refusal(choice, seen)
        items: tuple[Any, ...] = ()
        misread = False
        if not outcome:
            try:
                read = items_of(choice.atoms, before or ())
                items = placed(read, seen)
            except Unfit as error:
                misread, outcome = True, {"question": f"{error}?"}
        left = unused(seen, choice)
        features = _features(heard.output, choice, left, bool(outcome), misread)
        if items:
            outcome |= {"unread": left, "besides": BESIDES[choice.besides], "notes": seen.notes}
        items = _aimed(items, seen)
        if before is None:
            return Reading(_as_said(items, choice.used, seen), **outcome), features
        edits = tuple(Also(frame=item) if isinstance(item, SemanticFrame) else item for item in items)
        return Reading(edits=edits, **outcome), features

    def sure(self, features: Array) -> float:
        """How likely a reading is right, by its features; not calibrated without the network's calibration."""
        extra = self.net.extra
        if "calibration.weights" not in extra:
            return float(features[0])
        z = float((features - extra["calibration.mean"]) / extra["calibration.scale"] @ extra["calibration.weights"])
        return float(1 / (1 + np.exp(-z - float(extra["calibration.bias"]))))


CONTRADICTORY, DOUBTFUL = 0.97, 0.5
"""How sure the network has to be that words contradict themselves, and how sure another reading may be at most."""


def _not_refused(output: Output) -> Output | None:
    """The network's output without the classes that refuse, where these are not all but certain."""
    shares, refusing = output.heads["action"].copy(), [HEADS["action"].index(word) for word in ("ask", "improper")]
    if shares[0, refusing].sum() >= CONTRADICTORY:
        return None
    shares[0, refusing] = 0.0
    return replace(output, heads={**output.heads, "action": shares})


POSSIBLE = 0.1
"""How likely a class has to be to be chosen in place of the likeliest one."""


def _otherwise(heard: NetworkReading) -> Iterator[Output]:
    """The network's output with one class for sure that is among the three likeliest of its head, but not the first."""
    output = heard.output
    atoms = choose(output, heard.seen, heard.before).atoms
    for q in range(min(len(atoms) + 1, QUERIES)):
        action = atoms[q].label("action") if q < len(atoms) else ""
        heads = ("action", *OF_ACTION.get(action, ()))
        for head in heads + WITH_PART * ("part" in heads):
            shares = output.heads[head]
            for i in np.argsort(-shares[q])[1:3]:
                if shares[q, i] >= POSSIBLE:
                    sure = shares.copy()
                    sure[q] = np.where(np.arange(sure.shape[1]) == i, shares[q], 0.0)
                    yield replace(output, heads={**output.heads, head: sure})


def _features(output: Output, choice: Choice, left: Collection[str], refused: bool, misread: bool) -> Array:
    """The values of FEATURES."""
    likely = float(np.prod(choice.likelihoods))
    actions = output.heads["action"][: len(choice.atoms) + 1].max(axis=1)  # the last one is that there are no more
    refusal = sum(float(output.heads["action"][0][HEADS["action"].index(word)]) for word in ("ask", "improper"))
    doubted = sum(value < DOUBTED for value in choice.likelihoods)
    shares = [heads[: len(choice.atoms)] for heads in output.heads.values()]
    entropy = -sum(float((share * np.log(share + LEAST)).sum()) for share in shares)
    told = [likely, min(choice.likelihoods), _certainty(likely), min(len(left), MOST_LEFT), refused, misread]
    ends = [_certainty(float(actions.min())), _certainty(float(actions[-1]))]
    return np.array([*told, math.log(refusal + REFUSAL), doubted, entropy, *ends], dtype=float)


def _certainty(likelihood: float) -> float:
    """How sure something is that is so likely, on a scale without an end at 1."""
    return -math.log1p(0.001 - min(likelihood, 0.999))


REFUSAL, DOUBTED = 1e-5, 0.9
"""What is added to the likelihood of a refusal before its logarithm, and below which likelihood a choice is doubted."""

MOST_LEFT = 4
"""More words left than so many say no more."""


def _aimed(items: Iterable[Any], seen: Sketch) -> tuple[Any, ...]:
    """Items whose frames hold what of an object the words before it say is meant."""
    named = [(m.items, m.words) for m in seen.mentions if m.items and m.words is not None]
    spoken = [(piece.text.lower(), piece.words) for piece in seen.pieces if piece.words is not None]
    return tuple(aimed([i], spoken, named)[0] if isinstance(i, SemanticFrame) else i for i in items)


def _as_said(items: Iterable[Any], used: Collection[int], seen: Sketch) -> tuple[SemanticFrame, ...]:
    """The frames of a first request, with what holds all along and where the words stand that they are read from."""
    spans = tuple(sorted(m.words for i in used if (m := seen.mentions[i]).words is not None))
    said = [piece.text.lower() for piece in seen.pieces]
    return tuple(replace(held_along(item, said), words=spans) for item in items)


def refusal(choice: Choice, seen: Sketch) -> dict[str, Any]:
    """The slots of a reading that asks back or finds nothing to do; empty where there is something to do."""
    first = choice.atoms[0].label("action") if choice.atoms else "none"
    why = choice.atoms[0].label("choice") if choice.atoms else "nonsense"
    if (first, why) == ("improper", "object"):
        return {"question": QUESTIONS["which"] + "?"}
    if first in ("improper", "none"):
        return {"improper": IMPROPER.get(why, IMPROPER["nonsense"]), "asks": why == "question"}
    pointed = range(len(seen.mentions)) if (first, why) == ("ask", "which") else sorted(choice.used)
    unclear = [seen.mentions[i] for i in pointed if seen.mentions[i].unclear]
    if unclear and unclear[0].items:
        return _which_of(unclear[0].items)
    return {"question": QUESTIONS.get(why, QUESTIONS["what"]) + "?"} if first == "ask" or unclear else {}


def _which_of(names: tuple[str, ...]) -> dict[str, Any]:
    """The question which of several objects is meant."""
    listed = words_of.listed([words_of.the(name) for name in names], "or")
    return {"question": f"which is meant, {listed}?", "asked": names}


def choose(output: Output, seen: Sketch, before: Sequence[SemanticFrame] | None) -> Choice:
    """The likeliest atoms of a sentence."""
    allowed_here = {**ALLOWED, **_of_what_stood(before or (), seen)}
    atoms: list[Atom] = []
    likelihoods: list[float] = []
    used: set[int] = set()
    besides = ""
    for q in range(len(output.heads["action"])):
        allowed = _FIRST if seen.before is None else ACTIONS
        action, likely = _best(output, "action", q, [a for a in allowed if q == 0 or a != "ask"])
        likelihoods.append(likely)
        if action == "none" or (q and action == "improper"):
            noticed = q and output.heads["action"][q][HEADS["action"].index("improper")] >= NOTICED
            besides = _best(output, "choice", q, CHOICES["improper"])[0] if noticed else ""
            break
        atom, more = _atom(output, q, action, seen, allowed_here, used)
        likelihoods += more
        if atom not in atoms:
            atoms.append(atom)
    return Choice(tuple(atoms), tuple(likelihoods), frozenset(used), besides)


def _of_what_stood(before: Sequence[SemanticFrame], seen: Sketch) -> Allowed:
    """What words and frames before leave: what edits may be about, slots to set, a part where a thing is named."""
    ways = (way for frame in before for way in directions_of(frame) if way in DIRECTIONS)
    names = ("", *dict.fromkeys((*map(name_of, before), *ways)))
    whole, *parts = HEADS["part"]
    named = any(mention.is_object and mention.words for mention in seen.mentions)
    return {
        **{(action, "on"): names for action, heads in OF_ACTION.items() if "on" in heads},
        **{(action, "part"): parts if named else (whole, *parts) for action in ("restrict", "except")},
        ("set", "choice"): _settable(before),
        ("drop", "on"): (*names, *TURNS[: len(before)]),
        **_of_small_words(seen),
    }


def _settable(before: Sequence[SemanticFrame]) -> list[str]:
    """The slots of frames, and roles of amounts, that feedback may set."""
    held = {slot for frame in before for slot in slots_of(frame)} | {"direction"}
    return [slot for slot in CHOICES["set"] if slot in held or slot in HEADS["role"] or slot == "of"]


def _of_small_words(seen: Sketch) -> Allowed:
    """What two words leave: "bigger, ten percent" is no tenth, "every waypoint from 12 to 18" no twelfth one."""
    told = {*concepts_of(seen.pieces)}
    every = any(a.text.lower() == "every" and b.mention < 0 for a, b in pairwise(seen.pieces))
    larger = not told.isdisjoint(("more", "stretch")) and told.isdisjoint(("fewer", "shrink"))
    found: dict[tuple[str, str], Sequence[str]] = {("resize", "choice"): ("larger",)} if larger else {}
    if every:
        found |= {(action, "part"): [part for part in HEADS["part"] if part != "every"] for action in WITH_PARTS}
    return found


WITH_PARTS = tuple(
    action for action, heads in OF_ACTION.items() if "part" in heads and action not in ("restrict", "except")
)
"""What may be about a part of the path."""

NOTICED = 0.1
"""How likely a wish beside the others that no atom can say has to be to be told of."""


def _best(output: Output, head: str, q: int, allowed: Sequence[str] | None = None) -> tuple[str, float]:
    """The likeliest of the classes that are allowed, and its share of all."""
    shares, classes = output.heads[head][q], HEADS[head]
    indices = range(len(classes)) if allowed is None else [classes.index(word) for word in allowed]
    best = max(indices, key=lambda i: float(shares[i]))
    return classes[best], float(shares[best])


def _atom(
    output: Output, q: int, action: str, seen: Sketch, allowed: Allowed, used: set[int]
) -> tuple[Atom, list[float]]:
    """The likeliest atom of an action, and how likely each of its choices is; `used` gets what it points at."""
    labels, likelihoods = _labels(output, q, action, seen, allowed)
    amounts: dict[str, Quantity] = {}
    names: dict[str, list[str]] = {"objects": [], "places": []}
    needed = _needed(action, labels)
    taken: dict[str, set[int]] = {"objects": set(), "places": set(), "amounts": set()}
    for pointer in _pointers(action, labels):
        kind = "amounts" if pointer in AMOUNTS else pointer[:-1]
        unfit = {i for i, m in enumerate(seen.mentions) if not m.is_object and not _fits(m.unit, pointer, labels)}
        mention, likely = _pointed(output, pointer, q, pointer in needed, taken[kind] | unfit)
        likelihoods.append(likely)
        if mention < 0:
            continue
        used.add(mention)
        taken[kind].add(mention)
        if kind == "amounts":
            amounts[pointer] = seen.mentions[mention].quantity
        else:
            names[kind] += seen.mentions[mention].items
    objects, places = (tuple(dict.fromkeys(found)) for found in names.values())
    return Atom(labels, amounts, objects, places), likelihoods


def _labels(output: Output, q: int, action: str, seen: Sketch, allowed: Allowed) -> tuple[dict[str, str], list[float]]:
    """The likeliest classes of the heads that count for an action, and how likely each is."""
    labels = {"action": action}
    likelihoods: list[float] = []
    for head in OF_ACTION.get(action, ()):
        labels[head], likely = _best(output, head, q, allowed.get((action, head)))
        likelihoods.append(likely)
    if labels.get("part", "whole") != "whole":
        for head in WITH_PART:
            labels[head], likely = _best(output, head, q)
            likelihoods.append(likely)
    if action == "replace" and labels["choice"] == "direction" and not labels["direction"]:
        labels["choice"] = "objects"
    if action == "quadrant":
        labels["choice"] = _quadrant(seen, labels["choice"])
    return labels, likelihoods


def _quadrant(seen: Sketch, guess: str) -> str:
    """The number of the quadrant, which the network cannot see where it is in digits."""
    said = [
        f"{m.value:g}" for m in seen.mentions if not m.is_object and m.words and f"{m.value:g}" in ("1", "2", "3", "4")
    ]
    return said[0] if said else guess


def _needed(action: str, labels: Mapping[str, str]) -> set[str]:
    """The pointers without which an atom is nothing."""
    return {*NEEDED.get(action, ()), *(pointer for said in labels.items() for pointer in NEEDED_BY.get(said, ()))}


def _pointers(action: str, labels: Mapping[str, str]) -> list[str]:
    found = list(POINTS.get(action, ()))
    spot = labels.get("spot", "")
    if spot in ("object", "objects"):
        found += ["objects1", "objects2"][: 1 + (spot == "objects")]
    elif spot == "amount":
        found.append("spot")
    part = labels.get("part", "whole")
    if part in ("near", "first", "last", "middle", "range", "from", "every", "beyond", "turns"):
        found.append("part")
    if part == "range":
        found.append("until")
    if part in ("near", "between", "after", "before") and labels.get("place") not in ("start", "goal"):
        found += ["places1", "places2", "places3"]
    return list(dict.fromkeys(found))


def _fits(unit: str, pointer: str, labels: Mapping[str, str]) -> bool:
    """Whether an amount in a unit may be what a pointer of an atom points at."""
    of = labels.get("part" if pointer == "part" else "action", "")
    units = MEASURED_IN.get((of, pointer)) or MEASURED_IN.get(("", pointer))
    return units is None or unit in ("", "step", *units)


LENGTHS = ("move", "end", "clearance", "via", "hop", "hover", "height", "bound", "stop", "wait")
MEASURED_IN: Mapping[tuple[str, str], tuple[str, ...]] = {
    **{(action, "amount"): ("m",) for action in LENGTHS},
    **{(action, "amount"): ("m", "%", "x") for action in ("closer", "farther")},
    **{(action, "amount"): ("deg",) for action in ("rotate", "tilt")},
    ("pace", "amount"): ("m/s", "%", "x", "m/s2", "s", "m"),
    ("resize", "amount"): ("%", "x"),
    **{("", pointer): ("m",) for pointer in ("radius", "size", "rise")},
    **{(kind, "part"): ("m",) for kind in ("near", "beyond")},
    ("", "duration"): ("s",),
    ("", "turns"): ("x", "turns"),
}
"""The units of what a pointer points at, by action or by kind of part, where not every one will do; a speed may be said
in metres."""


def _pointed(output: Output, pointer: str, q: int, needed: bool, others: Collection[int]) -> tuple[int, float]:
    """The likeliest mention of a pointer but for some, or -1; of a needed one never -1 while there is any."""
    shares, mentions = output.pointers[pointer][q], (-1, *output.candidates[pointer])
    open_ = [i for i, mention in enumerate(mentions) if mention not in others and (i or not needed)] or [0]
    best = max(open_, key=lambda i: float(shares[i]))
    return mentions[best], float(shares[best])


LEFT_WORDS = {
    "direction": ("left", "right", "front", "back", "up", "down", "raise", "lower"),
    "speed": ("faster", "slower", "speed", "ramp_up", "ramp_down"),
    "figure": (*_FIGURES, "hop", "hover", "mirror", "rotate", "tilt", "smooth", "wait", "reverse"),
}
"""Concepts that a reading should not pass over."""

_OF_SPEED = {"pace", "keep", "stop", "wait", "hover", "scale", "set"}


def unused(seen: Sketch, choice: Choice) -> tuple[str, ...]:
    """Content words that nothing was read from: amounts, objects, words of direction, of speed and of figures."""
    actions = {atom.label("action") for atom in choice.atoms}
    wanted = {*LEFT_WORDS["figure"]}
    if not _directed(choice):
        wanted.update(LEFT_WORDS["direction"])
    if not actions & _OF_SPEED:
        wanted.update(LEFT_WORDS["speed"])
    marks = _unpointed(seen, choice)
    amounts = [] if actions & {"undo", "redo"} else [_said_as(m) for m in marks if not m.is_object]
    objects = [name for m in marks for name in m.items[:1]]
    return (*amounts, *objects, *(word for concept, word in _concepts(seen) if concept in wanted - actions))


def _said_as(amount: Referent) -> str:
    """An amount for people: "0.15 m", "50 %"."""
    value = amount.value * 100 if amount.unit == "%" else amount.value
    return f"{value:g} {amount.unit}".strip()


PARTED = frozenset("first second last other final initial latter former middle".split())
"""Words before a share that is a part of the path."""


def _unpointed(seen: Sketch, choice: Choice) -> list[Referent]:
    """What the sentence mentions and nothing points at, nor at another mention of it; not a figure's eight."""
    eight = any(atom.label("action") == "eight" for atom in choice.atoms)
    pointed = {name for i in choice.used for name in seen.mentions[i].items}
    mentions = [seen.mentions[i] for i in sorted(_speaking(seen) - choice.used)]
    return [m for m in mentions if pointed.isdisjoint(m.items) and not (eight and m.value == 8.0)]


def _speaking(seen: Sketch) -> set[int]:
    """The mentions of a sentence but for those that may well mean nothing and are no part: "the second half"."""
    parts = {b.mention for a, b in pairwise(seen.pieces) if a.text.lower() in PARTED}
    said = {f.mention for f in seen.pieces if f.mention >= 0}
    return {i for i in said if i in parts or not seen.mentions[i].weak}


def _concepts(seen: Sketch) -> list[tuple[str, str]]:
    """The concepts of a sentence's words, each with its first word."""
    told = concepts_of(seen.pieces)
    begins = [i for i, concept in enumerate(told) if concept and (i == 0 or told[i - 1] != concept)]
    return [(told[i], seen.pieces[i].text) for i in begins]


def _directed(choice: Choice) -> bool:
    """Whether some atom has a direction, or its frame is about heights, sides or ends."""
    along = {"height", "mirror", "rotate", "tilt", "hop", "hover", "return", "reverse"}
    ways, parts = ("direction", "toward"), ("rising", "falling")
    atoms = choice.atoms
    return any(any(map(a.label, ways)) or a.label("part") in parts or a.label("action") in along for a in atoms)
