"""From the corpus to examples for the learned reader: alignment of slots to mentions, and variation of sentences."""

from __future__ import annotations

import math
import random
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "corpus"))
import check
from atoms import atoms_of

from ovita.instruct import remarks, slots
from ovita.instruct.encoder import QUERIES, concepts_of
from ovita.instruct.frames import Quantity, SemanticFrame
from ovita.instruct.lexicon import ALIKE, concept_at, concepts
from ovita.instruct.notation import parse
from ovita.instruct.numerals import written_out
from ovita.instruct.sketch import LETTERS, UNCLEAR, UNITS, Fragment, Referent, Sketch, sketch
from ovita.instruct.slots import Atom
from ovita.paths.scene import Scene, SceneObject

UNKNOWN = -2
"""Target of a pointer whose words were not found: nothing is learned from it."""


@dataclass(frozen=True)
class Sample:
    """A sentence in marks with what each atom should be.

    Args:
        voice: Who said it.
        line: Where it stands.
        sketch: The sentence.
        atoms: What it asks for.
        pointers: For each atom the mention of each pointer; -1 for none, `UNKNOWN` where it was not found.
        first: Whether it is a first request.
    """

    voice: str
    line: int
    sketch: Sketch
    atoms: tuple[Atom, ...]
    pointers: tuple[dict[str, int], ...]
    first: bool


def scene_of(objects: Sequence[str]) -> Scene:
    """A scene with these objects side by side."""
    return Scene(tuple(SceneObject(name, (0.3 * i, 0.2 * (-1) ** i, 0.0)) for i, name in enumerate(objects)))


def outcome_atom(example: check.Example) -> Atom:
    """The atom of a sentence that cannot be done."""
    words = example.reading[1:].strip().lower()
    if example.outcome == "improper":
        return _improper(words)
    choice = "what"
    if words.startswith("which") and not any(w in words for w in ("way", "direction", "side")):
        choice = "which"
    elif any(w in words for w in ("direction", "which way", "where", "side", "up or down", "left or right")):
        choice = "where"
    elif any(w in words for w in ("how", "amount", "value", "unit")):
        choice = "how much"
    return Atom({"action": "ask", "choice": choice})


def _improper(words: str) -> Atom:
    choice = next((c for c in slots.CHOICES["improper"] if c in words), "nonsense")
    return Atom({"action": "improper", "choice": choice})


def samples(path: Path, known: frozenset[str], misses: list[str] | None = None) -> Iterator[Sample]:
    """The lines of a voice that atoms can say."""
    for example in check.examples(path):
        if not example.problem:
            yield from readable(example, known, misses)


def readable(example: check.Example, known: frozenset[str], misses: list[str] | None = None) -> Iterator[Sample]:
    """The example as a sample, if atoms can say it."""
    try:
        atoms = atoms_of(example.frames or example.edits) if example.outcome == "do" else (outcome_atom(example),)
    except slots.Unfit:
        return
    if example.besides and len(atoms) < QUERIES:
        atoms = (*atoms, _improper(example.besides))
    if atoms:
        yield sample_of(example, atoms, known, misses)


def later_turns(path: Path, known: frozenset[str], rng: random.Random) -> Iterator[Sample]:
    """The first requests of a voice said once more, each after another one of the same scene that it is not about.

    They still ask for what they say: the network learns that not all that follows a turn is about it.
    """
    first = [e for e in check.examples(path) if e.before is None and not e.problem]
    for example in first:
        said = {frame.NAME for frame in example.frames}
        others = [
            e.frames
            for e in first
            if e.frames and e.objects == example.objects and said.isdisjoint(frame.NAME for frame in e.frames)
        ]
        if others:
            yield from readable(replace(example, before=rng.choice(others)), known)


def sample_of(
    example: check.Example, atoms: tuple[Atom, ...], known: frozenset[str], misses: list[str] | None = None
) -> Sample:
    """A line with its slots aligned to what its words mention."""
    seen = sketch(written_out(example.sentence), scene_of(example.objects), None, example.before, known)
    used: set[int] = set()
    pointers = []
    atoms = tuple(_as_said(atom, seen.mentions, example.before or ()) for atom in atoms)
    for atom in atoms:
        found = dict.fromkeys(slots.POINTERS, -1)
        for name, quantity in atom.amounts.items():
            found[name] = amount_mention(seen.mentions, quantity, used, example.before or ())
            if found[name] == UNKNOWN and not quantity.value:
                found[name] = -1  # of no height and no distance no word says a number
            if found[name] == UNKNOWN and misses is not None:
                misses.append(
                    f"{example.voice}:{example.number} {example.sentence} | {name}={quantity.said or quantity.value}"
                )
        for names, prefix in ((atom.objects, "objects"), (atom.places, "places")):
            at = 1
            left = list(names)
            while left and at <= 3:
                mention = object_mention(seen.mentions, left, used)
                found[f"{prefix}{at}"] = mention
                if mention == UNKNOWN:
                    if misses is not None:
                        misses.append(f"{example.voice}:{example.number} {example.sentence} | {left}")
                    left = left[1:]
                else:
                    left = [name for name in left if name not in seen.mentions[mention].items]
                at += 1
        pointers.append(found)
    return Sample(example.voice, example.number, seen, atoms, tuple(pointers), example.before is None)


def _as_said(atom: Atom, mentions: Sequence[Referent], before: Sequence[SemanticFrame]) -> Atom:
    """A factor of 1.2 that was said as "20 % larger", and a value that was said as so much more, as such."""
    wanted, action = atom.amounts.get("amount"), atom.label("action")
    said = [m for m in mentions if not m.is_object and m.words is not None]
    across = _across(atom, said)
    if (
        wanted is None
        or across is not atom
        or any(math.isclose(m.value, abs(wanted.value), rel_tol=0.035) for m in said)
    ):
        return across
    if action in ("pace", "waypoints") and wanted.unit in ("x", "%"):
        return _as_divisor(atom, said)
    if action == "resize" and not atom.label("choice") and wanted.unit in ("x", "%"):
        return _as_share(atom, said, "larger", "smaller")
    if action == "scale" and not atom.label("choice"):
        return _as_share(atom, said, "more", "less")
    return _as_step(atom, said, before) if action == "set" and atom.label("step") == "0" else atom


def _across(atom: Atom, said: Sequence[Referent]) -> Atom:
    """An atom with a radius as one with the width, if that was said."""
    setting = atom.label("action") == "set" and atom.label("choice") == "radius"
    radius = atom.amounts.get("amount" if setting else "radius")
    if radius is None or any(_fits(m, radius) >= 3 for m in said):
        return atom
    width = replace(radius, value=2.0 * radius.value, said="")
    if not any(_fits(m, width) >= 3 for m in said):
        return atom
    if setting:
        return replace(atom, labels=atom.labels | {"choice": "size"}, amounts=atom.amounts | {"amount": width})
    amounts = {name: quantity for name, quantity in atom.amounts.items() if name != "radius"}
    return replace(atom, amounts=amounts | {"size": width})


def _as_divisor(atom: Atom, said: Sequence[Referent]) -> Atom:
    """An atom with a factor as one with what the time or the number is divided by, if that was said."""
    factor = atom.amounts["amount"].value
    for mention in said:
        if mention.unit in ("%", "x", "") and factor and math.isclose(1.0 / factor, mention.value, rel_tol=0.035):
            amounts = atom.amounts | {"amount": Quantity(mention.value, "x")}
            return replace(atom, labels=atom.labels | {"step": "-1"}, amounts=amounts)
    return atom


def _as_share(atom: Atom, said: Sequence[Referent], more: str, less: str) -> Atom:
    """An atom with a factor as one with the share that it is more or less, if that was said."""
    factor = atom.amounts["amount"].value
    for mention in said:
        if mention.unit in ("%", "x") and math.isclose(abs(factor - 1), mention.value, rel_tol=0.035):
            share = {"amount": Quantity(mention.value, "%")}
            labels = atom.labels | {"choice": more if factor > 1 else less}
            return replace(atom, labels=labels, amounts=atom.amounts | share)
    return atom


def _as_step(atom: Atom, said: Sequence[Referent], before: Sequence[SemanticFrame]) -> Atom:
    """An atom that sets a value as one that sets so much more or less than before, if that was said."""
    wanted = atom.amounts["amount"]
    offsets = (q for frame in before for _, q in getattr(frame, "offset", ()) if q is not None)
    for old in (*(q for frame in before for q in frame.quantities.values()), *offsets):
        by = replace(wanted, value=abs(wanted.value - old.value), said="")
        if by.unit == old.unit and by.value and any(_fits(m, by) >= 3 for m in said):
            step = "1" if wanted.value > old.value else "-1"
            return replace(atom, labels=atom.labels | {"step": step}, amounts=atom.amounts | {"amount": by})
    return atom


def amount_mention(
    mentions: Sequence[Referent], wanted: Quantity, used: set[int], before: Sequence[SemanticFrame]
) -> int:
    """The mention that a quantity was read from; marks it as used."""
    best, score = UNKNOWN, 0
    for i, mention in enumerate(mentions):
        if mention.is_object:
            continue
        fit = 4 * _fits(mention, wanted)
        fit = fit + (i not in used) - (2 if mention.words is None else 0) if fit else 0
        if fit > score:
            best, score = i, fit
    used.add(best)
    return best


def _fits(mention: Referent, wanted: Quantity) -> int:
    close = math.isclose(mention.value, abs(wanted.value), rel_tol=0.035)
    shares = ("%", "x", "")
    number = wanted.said.lstrip("~+-").rstrip("abcdefghijklmnopqrstuvwxyzA%/^°")
    try:
        same_number = bool(number) and math.isclose(float(number), mention.number, rel_tol=1e-6)
    except ValueError:
        same_number = False
    if mention.unit == wanted.unit:
        return 3 * close
    if mention.unit in shares and wanted.unit in shares and close:
        return 2
    if mention.unit == "" and (same_number or close):
        return 2
    loose = {"waypoints", "turns", "", "step"}
    if mention.unit in loose and wanted.unit in loose and (close or same_number):
        return 2
    return int(same_number)


def object_mention(mentions: Sequence[Referent], names: Sequence[str], used: set[int]) -> int:
    """The mention of the first of some objects, or of all of them; marks it as used."""
    best, score = UNKNOWN, 0.0
    for i, mention in enumerate(mentions):
        if mention.unclear or not mention.items or names[0] not in mention.items:
            continue
        if not set(mention.items) <= set(names):
            continue
        fit = 10 * len(mention.items) + (i not in used) - (5 if mention.words is None else 0)
        if fit > score:
            best, score = i, fit
    used.add(best)
    return best


NOUNS = """
anvil apple armchair backpack bag ball banana barrel basin basket bathtub battery bed bell bench bicycle blender
boat bolt book bottle bowl bracket brick broom bucket bulb bus bush cabinet cable cactus cake camera candle car carpet
cart cat chair clamp clock coat column compass computer cone couch crane crate cup curtain desk dog door drawer drill
drum easel elevator engine faucet fence fern flask flower fork fountain freezer fridge fryer funnel glove goat guitar
hammer hat helmet horse hose jar jug kettle keyboard knife ladder lamp laptop lathe lemon lever locker magnet mat
microscope microwave mirror mixer monitor motor motorcycle mug nail needle oven paintbrush pallet pan parrot pedestal
pencil phone piano pillar pillow pipe pipette plant plate pot pump puppy radiator rake refrigerator robot rope router
rug saw scale scalpel scanner screwdriver shelf shovel sink sofa spoon statue stove suitcase sword syringe table tank
teapot telescope tent tire toaster toilet tractor trampoline tray tree tripod trolley tuba tube turbine umbrella vacuum
valve vase violin wagon wall wardrobe washer wheel wheelbarrow window wok wrench yacht zebra""".split()
ADJECTIVES = (
    "red blue green yellow white black big small left right wooden metal glass old new spare second tall".split()
)
JOINTS = (
    ". ",
    ", ",
    "; ",
    " and ",
    ", and ",
    " and then ",
    ", then ",
    " , also ",
    " and also ",
    " plus ",
    ". then ",
    " but ",
    ". after that ",
    ", next ",
    ", and afterwards ",
    ", finally ",
    " while ",
    ". oh and ",
    " - and ",
)
BEGINS = (
    "please", "hey", "ok", "ok so", "right ,", "well ,", "um ,", "could you", "can you", "would you", "i want you to",
    "now", "so", "alright ,", "hey robot ,", "listen ,", "actually ,", "i'd like you to", "kindly", "you know what ,",
    "sorry ,", "good morning ,", "let's see ,", "as discussed ,", "for safety ,", "next ,", "first of all ,", "hm ,",
    "this time ,", "the floor is wet , so", "it's fragile , so", "since it is hot ,", "if you can ,", "honestly ,",
)  # fmt: skip
ENDS = (
    "please", "thanks", "thank you", "ok ?", "would you ?", "if possible", "if you can", "will you", ", it's fragile",
    ", the floor is wet", "because it is hot", "so that nobody gets hurt", ", there's a lot going on", "for safety",
    ", otherwise it spills", ", no exceptions", ", i mean it", ", mind you", ", as we discussed", "for the demo", "lol",
    ", that's all", ", you know", "!", "...", ", cheers", "since people are watching", ", it looks odd now", "today",
)  # fmt: skip
TAKING_BACK = (
    "no", ", no ,", ", i mean", ", sorry ,", ", no wait ,", ". no .", ", make that", ", or rather", ", scratch that ,",
    ", correction ,", ", actually", ", er ,", "- no -", ", wait ,", "... no ,", ", i meant", ", not that ,",
    "or better",
)  # fmt: skip
SWAPS = """
slight large faster slower closer away smooth left right up down raise wait stop circle spiral zigzag wave hop
hover mirror rotate tilt reverse resize near between over under constant ramp_up ramp_down goal start first last middle
except waypoints at_most at_least toward clockwise anticlockwise height curvature straight double increase decrease
denser sparser extend pass speed distance after before noise gradual""".split()
"""Concepts whose phrases may stand for each other."""

TEMPLATES = {
    "faster": (
        "{}",
        "{} near the cup | pace faster @near=cup",
        "make it {} | pace faster",
        "{} at the end | pace faster @last",
    ),
    "slower": (
        "{}",
        "{} near the cup | pace slower @near=cup",
        "make it {} | pace slower",
        "{} in the beginning | pace slower @first",
    ),
    "smooth": ("{} | smooth", "make the path {} | smooth"),
    "left": ("move {} | move left", "shift it {} by 10 cm | move left=10cm", "a bit {} | move left deg=slight"),
    "right": ("move {} | move right", "shift it {} by 10 cm | move right=10cm", "a bit {} | move right deg=slight"),
    "front": ("move {} | move front", "shift the path 10 cm {} | move front=10cm"),
    "back": ("move {} | move back", "shift the path 10 cm {} | move back=10cm"),
    "up": ("move {} | move up", "shift the path 10 cm {} | move up=10cm", "the end 5 cm {} | end goal up=5cm"),
    "down": ("move {} | move down", "shift the path 10 cm {} | move down=10cm"),
    "raise": ("{} it | move up", "{} the path by 10 cm | move up=10cm", "{} the goal | end goal up"),
    "lower": ("{} it | move down", "{} the path by 10 cm | move down=10cm"),
    "closer": ("{} to the cup | closer cup", "{} to the cup by 5 cm | closer cup by=5cm"),
    "away": ("{} from the cup | farther cup", "{} from the cup by 5 cm | farther cup by=5cm"),
    "wait": (
        "{} at the cup | wait at=cup",
        "{} at the cup for 3 s | wait at=cup for=3s",
        "{} at the end | wait at=goal",
    ),
    "stop": ("{} at the cup | stop at=cup",),
    "circle": ("{} the cup | circle cup", "{} the cup twice | circle cup turns=2"),
    "spiral": ("{} at the end | spiral at=goal", "do a {} at the cup | spiral at=cup"),
    "zigzag": ("{} in the middle | zigzag @middle", "make it {} | zigzag"),
    "wave": ("make it {} | wave", "{} at the end | wave @last"),
    "hop": ("{} the cup | hop cup",),
    "hover": ("{} the cup | hover cup", "{} the cup for 2 s | hover cup for=2s"),
    "reverse": ("{} the path | reverse", "run it {} | reverse"),
    "constant": ("{} speed | pace constant", "keep the speed {} | pace constant"),
    "ramp_up": ("{} | pace rampup", "{} towards the end | pace rampup @last"),
    "ramp_down": ("{} | pace rampdown", "{} towards the end | pace rampdown @last"),
    "through": ("go {} the cup | via cup",),
    "over": ("go {} the cup | via over=cup", "pass {} the cup by 10 cm | via over=cup by=10cm"),
    "under": ("go {} the cup | via under=cup",),
    "between": ("go {} the cup and the box | via between=cup+box",),
    "at_least": ("{} 20 cm from the cup | clearance cup at_least=20cm", "speed {} 0.2 m/s | pace at_least=0.2m/s"),
    "at_most": ("speed {} 0.2 m/s | pace at_most=0.2m/s", "height {} 50 cm | height at_most=50cm"),
    "no_closer": ("{} 20 cm to the cup | clearance cup at_least=20cm",),
    "denser": ("{} the waypoints | waypoints more", "{} | waypoints more"),
    "sparser": ("{} the waypoints | waypoints fewer",),
    "goal": ("leave the {} alone | keep goal", "move the {} up | end goal up"),
    "start": ("leave the {} alone | keep start", "move the {} left by 5 cm | end start left=5cm"),
    "first": ("faster in the {} part | pace faster @first", "move the {} part up | move up @first"),
    "last": ("faster in the {} part | pace faster @last", "move the {} part up | move up @last"),
    "middle": ("faster in the {} | pace faster @middle", "move the {} up | move up @middle"),
    "except": ("faster {} near the cup | pace faster @!near=cup", "move up {} at the end | move up @!last"),
    "straight": ("go {} between the cup and the box | straighten @between=cup+box", "{} | straighten"),
    "slight": (
        "{} higher | move up deg=slight",
        "{} faster | pace faster deg=slight",
        "{} further from the cup | farther cup deg=slight",
    ),
    "large": (
        "{} higher | move up deg=large",
        "{} faster | pace faster deg=large",
        "{} further from the cup | farther cup deg=large",
    ),
    "clockwise": ("circle the cup {} | circle cup cw", "rotate by 90 degrees {} | rotate 90deg cw"),
    "anticlockwise": ("circle the cup {} | circle cup ccw", "rotate by 90 degrees {} | rotate 90deg ccw"),
    "mirror": ("{} it left to right | mirror left",),
    "rotate": ("{} it by 90 degrees | rotate 90deg",),
    "tilt": ("{} the path by 10 degrees to the left | tilt 10deg left",),
    "extend": ("{} by 20 cm beyond the goal | extend by=20cm",),
    "undo": ("{} => {} | undo",),
}  # fmt: skip
"""For the concepts of the word files: patterns for each of their phrases."""


def words() -> list[str]:
    """All phrases that sentences are varied with."""
    return [p for c in concepts().values() for p in c] + [*NOUNS, *ADJECTIVES, *BEGINS, *ENDS, *JOINTS, *TAKING_BACK]


def templates(known: frozenset[str]) -> list[Sample]:
    """The word files' phrases in simple sentences."""
    found: list[Sample] = []
    objects = ("cup", "box")
    for concept, patterns in TEMPLATES.items():
        for phrase in concepts().get(concept, ()):
            for pattern in patterns:
                if "=>" in pattern:
                    continue
                said, bar, reading = pattern.partition(" | ")
                reading = reading if bar else {"faster": "pace faster", "slower": "pace slower"}[concept]
                frames = parse(reading, objects)
                example = check.Example("words", 0, objects, said.format(phrase), None, reading, frames)
                sample = sample_of(example, atoms_of(frames), known)
                if not any(UNKNOWN in pointer.values() for pointer in sample.pointers):
                    found.append(sample)
    return found


def vary(pool: Sequence[Sample], rng: random.Random, known: frozenset[str] = frozenset()) -> Iterator[Sample]:
    """Endless varied samples: every sentence equally often, some joined with another one."""
    simple = templates(known)
    first = [s for s in pool if s.first and _asks_for_all(s)]
    single = [s for s in pool if _edits_one(s)]
    named = [s for s in single if _names_it(s)]
    while True:
        for sample in rng.sample(pool, len(pool)):
            draw = rng.random()
            if draw < 0.07 and simple:
                sample = rng.choice(simple)
            if draw > 0.8 and sample.first and _asks_for_all(sample):
                sample = joined(sample, rng.choice(first if rng.random() < 0.8 else simple), rng)
                if draw > 0.94:
                    sample = joined(sample, rng.choice(first), rng)
            elif 0.07 < draw < 0.12:
                sample = elsewhere(sample, rng)
            elif 0.12 < draw < 0.16:
                sample = taken_back(sample, rng)
            elif 0.16 < draw < 0.26 and single:
                sample = both(rng.choice(single), rng.choice(named), rng) or sample
            yield changed(sample, rng)


def taken_back(sample: Sample, rng: random.Random) -> Sample:
    """A sentence with another amount or thing before one that it means, and words that take that back (Levelt 1983)."""
    pieces, mentions = [*sample.sketch.pieces], sample.sketch.mentions
    meant = {i for pointers in sample.pointers for i in pointers.values() if i >= 0}
    marks = {*LETTERS, *UNITS.values()}
    slips = [k for k, piece in enumerate(pieces) if piece.mention in meant and piece.text in marks]
    if not slips or len(pieces) > 60:
        return sample
    at = rng.choice(slips)
    mark, old = pieces[at].text, mentions[pieces[at].mention]
    if old.is_object:
        unused = [letter for letter in LETTERS if all(piece.text != letter for piece in pieces)]
        mark, old = (unused or LETTERS)[-1 if not unused else 0], Referent(None, ("something else",))
    elif rng.random() < 0.3:
        mark = UNITS[""]
    wrong = [Fragment(mark, None, len(mentions)), *(Fragment(w, None) for w in rng.choice(TAKING_BACK).split())]
    if at and pieces[at - 1].text in ("the", "a", "my") and rng.random() < 0.7:
        wrong.append(pieces[at - 1])
    pieces[at:at] = wrong
    return replace(sample, sketch=in_order(replace(sample.sketch, pieces=tuple(pieces), mentions=(*mentions, old))))


def in_order(seen: Sketch) -> Sketch:
    """A sentence with the letters of its things in the order in which they are mentioned."""
    order = [p.text for p in (*seen.pieces, *(seen.before or ())) if p.text in LETTERS]
    named = dict(zip(dict.fromkeys(order), LETTERS, strict=False))
    pieces, before = (
        tuple(replace(p, text=named.get(p.text, p.text)) for p in of) for of in (seen.pieces, seen.before or ())
    )
    return replace(seen, pieces=pieces, before=before if seen.before is not None else None)


def _asks_for_all(sample: Sample) -> bool:
    """Whether all that a sentence asks for can be done."""
    return all(atom.label("action") not in ("ask", "improper") for atom in sample.atoms)


ABOUT_ONE = frozenset(("scale", "set", "replace", "restrict", "except", "flip", "drop"))
"""Edits of one change among several."""


def _names_before(sample: Sample) -> list[str]:
    """The names of the frames before a turn."""
    texts = [";", *(piece.text for piece in sample.sketch.before or ())]
    return [text for end, text in pairwise(texts) if end == ";"]


def _edits_one(sample: Sample) -> bool:
    """Whether a turn is about the one change before it, of a kind that edits can name."""
    actions = {atom.label("action") for atom in sample.atoms}
    names = _names_before(sample) if actions and actions <= ABOUT_ONE else []
    return len(names) == 1 and names[0] in slots.TRAINED and len(sample.sketch.pieces) < 30


def _names_it(sample: Sample) -> bool:
    """Whether a turn has a word for the change that it is about, or names its thing."""
    (name,) = _names_before(sample)
    before = {piece.text for piece in sample.sketch.before or ()} - {
        "by",
        "to",
        "at",
        "in",
        "near",
        "of",
        "least",
        "most",
    }
    words = {piece.text for piece in sample.sketch.pieces}
    classes = (ALIKE.get(concept, concept) for concept in concepts_of(sample.sketch.pieces))
    told = {kind for name_of_class in classes for kind in remarks.NOUNS.get(name_of_class, ())}
    return name in told or any(word in before for word in words if word in LETTERS or word.isalpha())


def both(one: Sample, other: Sample, rng: random.Random) -> Sample | None:
    """Two turns, each about another change, as one turn about two changes; None if both are of the same kind."""
    names = [*_names_before(one), *_names_before(other)]
    if names[0] == names[1] or len(one.atoms) + len(other.atoms) > QUERIES:
        return None
    if rng.random() < 0.5:
        one, other, names = other, one, names[::-1]
    told = joined(_about(one, names[0]), _about(other, names[1]), rng)
    shift = len(one.sketch.mentions)
    renamed = _letters(other.sketch, told.sketch.pieces[-len(other.sketch.pieces) :])
    taken = {piece.text for piece in (*told.sketch.pieces, *(one.sketch.before or ())) if piece.text in LETTERS}
    later = []
    for piece in other.sketch.before or ():
        text = piece.text
        if text in LETTERS and text not in renamed:
            renamed[text] = next((letter for letter in LETTERS if letter not in taken), LETTERS[-1])
            taken.add(renamed[text])
        later.append(
            replace(piece, text=renamed.get(text, text), mention=piece.mention + shift if piece.mention >= 0 else -1)
        )
    parts = [tuple(one.sketch.before or ()), tuple(later)]
    rng.shuffle(parts)
    return replace(told, sketch=in_order(replace(told.sketch, before=(*parts[0], Fragment(";", None), *parts[1]))))


def _about(sample: Sample, name: str) -> Sample:
    """A turn whose edits name the change that they are about."""
    return replace(sample, atoms=tuple(replace(atom, labels=atom.labels | {"on": name}) for atom in sample.atoms))


def _letters(sketch: Sketch, pieces: Sequence[Fragment]) -> dict[str, str]:
    """The letters of a sentence, with those that stand for them in other pieces of the same words."""
    return {a.text: b.text for a, b in zip(sketch.pieces, pieces, strict=True) if a.text in LETTERS}


def joined(one: Sample, other: Sample, rng: random.Random) -> Sample:
    """Two sentences as one."""
    if len(one.atoms) + len(other.atoms) > QUERIES or len(one.sketch.pieces) + len(other.sketch.pieces) > 60:
        return one
    pieces = list(one.sketch.pieces)
    while pieces and pieces[-1].text in ".!,;?":
        pieces.pop()
    pieces += [Fragment(word, None) for word in rng.choice(JOINTS).split()]
    known = (*one.sketch.pieces, *(one.sketch.before or ()))
    letters = {p.text: one.sketch.mentions[p.mention].items for p in known if p.text in LETTERS}
    shift = len(one.sketch.mentions)
    renamed: dict[str, str] = {}
    same_object = rng.random() < 0.25 and letters
    for piece in other.sketch.pieces:
        text = piece.text
        if text in LETTERS:
            if text not in renamed:
                free = [letter for letter in LETTERS if letter not in letters and letter not in renamed.values()]
                taken = [letter for letter in letters if letter not in renamed.values()]
                renamed[text] = rng.choice(taken) if same_object and taken else free[0] if free else LETTERS[-1]
            text = renamed[text]
        pieces.append(Fragment(text, None, piece.mention + shift if piece.mention >= 0 else -1))
    moved = tuple({k: v + shift if v >= 0 else v for k, v in p.items()} for p in other.pointers)
    seen = Sketch(tuple(pieces), None, one.sketch.mentions + other.sketch.mentions)
    return replace(one, sketch=seen, atoms=one.atoms + other.atoms, pointers=one.pointers + moved)


def elsewhere(sample: Sample, rng: random.Random) -> Sample:
    """The sentence about an object that is not there, or about one that could be several."""
    pointed = {i for p in sample.pointers for k, i in p.items() if k in slots.OBJECTS and i >= 0}
    letters = {p.text for p in sample.sketch.pieces if p.mention in pointed and p.text in LETTERS}
    if len(letters) != 1 or not sample.first:
        return sample
    letter = letters.pop()
    unclear = rng.random() < 0.3
    noun = rng.choice(NOUNS)
    if rng.random() < 0.4:
        noun = f"{rng.choice(ADJECTIVES)} {noun}"
    elif rng.random() < 0.2:
        noun = f"{noun} {rng.choice(NOUNS)}"
    pieces = tuple(
        p if p.text != letter else Fragment(UNCLEAR, None, p.mention) if unclear else Fragment(noun, None)
        for p in sample.sketch.pieces
    )
    atom = Atom({"action": "ask", "choice": "which"} if unclear else {"action": "improper", "choice": "object"})
    return replace(sample, sketch=replace(sample.sketch, pieces=pieces), atoms=(atom,), pointers=({},))


MIRRORED = {
    "left": "right", "right": "left", "lefthand": "righthand", "righthand": "lefthand", "leftward": "rightward",
    "rightward": "leftward", "leftwards": "rightwards", "rightwards": "leftwards", "y": "y",
}  # fmt: skip


def changed(sample: Sample, rng: random.Random) -> Sample:
    """A sentence with other words, slips, punctuation and asides."""
    pieces = list(sample.sketch.pieces)
    atoms = sample.atoms
    before = sample.sketch.before
    if rng.random() < 0.5 and any(p.text in ("left", "right") for p in pieces):
        atoms = tuple(replace(a, labels=_mirrored(a.labels)) for a in atoms)
        pieces = [replace(p, text=MIRRORED.get(p.text, p.text)) for p in pieces]
        before = before and tuple(replace(p, text=MIRRORED.get(p.text, p.text)) for p in before)
    if sample.first and rng.random() < 0.4:
        pieces, atoms = turned(pieces, atoms, rng)
    if rng.random() < 0.25:
        pieces = _reworded(pieces, rng)
    if rng.random() < 0.3:
        pieces = [p for p in pieces if p.text not in ",.;!?" or rng.random() < 0.3]
    elif rng.random() < 0.15:
        pieces = [p for p in pieces if p.text not in (".", "!")]
    if rng.random() < 0.15:
        pieces = _slipped(pieces, rng)
    if sample.first and rng.random() < 0.15:
        pieces = [*(Fragment(w, None) for w in rng.choice(BEGINS).split()), *pieces]
    if sample.first and rng.random() < 0.15:
        end = [Fragment(w, None) for w in rng.choice(ENDS).split()]
        pieces = [*pieces[:-1], *end, pieces[-1]] if pieces and pieces[-1].text in ".!" else [*pieces, *end]
    if rng.random() < 0.25:
        pieces = [Fragment("[MASK]", None) if p.mention < 0 and rng.random() < 0.06 else p for p in pieces]
    return replace(sample, sketch=replace(sample.sketch, pieces=tuple(pieces), before=before), atoms=atoms)


COMPASS = ("left", "right", "front", "back", "up", "down")
OPPOSED: tuple[tuple[str, str, str, str, str], ...] = (
    *((a, b, "direction", a, b) for a in COMPASS for b in COMPASS if a != b),
    ("raise", "lower", "direction", "up", "down"),
    ("lower", "raise", "direction", "down", "up"),
    *(
        row
        for a, b, head, one, other in (
            ("faster", "slower", "choice", "faster", "slower"),
            ("closer", "away", "action", "closer", "farther"),
            ("at_least", "at_most", "role", "at_least", "at_most"),
            ("at_least", "at_most", "choice", "floor", "cap"),
            ("clockwise", "anticlockwise", "sense", "cw", "ccw"),
            ("first", "last", "part", "first", "last"),
            ("over", "under", "relation", "over", "under"),
            ("before", "after", "part", "before", "after"),
            ("start", "goal", "choice", "start", "goal"),
            ("start", "goal", "spot", "start", "goal"),
            ("ramp_up", "ramp_down", "choice", "rampup", "rampdown"),
            ("denser", "sparser", "choice", "more", "fewer"),
            ("slight", "large", "degree", "slight", "large"),
        )
        for row in ((a, b, head, one, other), (b, a, head, other, one))
    ),
)
"""Concepts that turn a request into another one: concept, other concept, head, its class, its other class."""


def turned(
    pieces: list[Fragment], atoms: tuple[Atom, ...], rng: random.Random
) -> tuple[list[Fragment], tuple[Atom, ...]]:
    """A sentence with one word for another of the same sort, and what it asks for then."""
    told = concepts_of(pieces)
    runs = [i for i, concept in enumerate(told) if concept and (i == 0 or told[i - 1] != concept)]
    once = {told[i]: i for i in runs if [told[k] for k in runs].count(told[i]) == 1}
    fitting = []
    for row in OPPOSED:
        a, b, head, one, other = row
        labels = [atom.label(head) for atom in atoms]
        if a in once and b not in told and labels.count(one) == 1 and other not in labels:
            fitting.append(row)
        lain = [t for t in atoms if t.label(head) == other and t.label("action") == "side"]  # "with it on your left"
        if a in once and b not in told and len(lain) == 1 and labels.count(other) == 1 and one not in labels:
            fitting.append((a, b, head, other, one))
    if not fitting:
        return pieces, atoms
    a, b, head, one, other = rng.choice(fitting)
    begin = once[a]
    end = next((i for i in range(begin, len(told)) if told[i] != a), len(told))
    phrase = rng.choice([p for p in concepts()[b][:14]])
    new = [*pieces[:begin], *(Fragment(word, None) for word in phrase.split()), *pieces[end:]]
    return new, tuple(replace(t, labels=t.labels | {head: other}) if t.label(head) == one else t for t in atoms)


def _mirrored(labels: dict[str, str]) -> dict[str, str]:
    swap = {"left": "right", "right": "left"}
    return {h: swap.get(v, v) if h in ("direction", "toward") else v for h, v in labels.items()}


def _reworded(pieces: list[Fragment], rng: random.Random) -> list[Fragment]:
    """With other phrases of the same concepts."""
    found: list[Fragment] = []
    i = 0
    words = [p.text if p.mention < 0 else "<>" for p in pieces]
    while i < len(pieces):
        concept, used = concept_at(words, i) if words[i] != "<>" else ("", 0)
        if concept in SWAPS and rng.random() < 0.4:
            found += [Fragment(word, None) for word in rng.choice(concepts()[concept]).split()]
            i += used
        else:
            found.append(pieces[i])
            i += 1
    return found


def _slipped(pieces: list[Fragment], rng: random.Random) -> list[Fragment]:
    """With one or two slips of the fingers."""
    open_ = [i for i, p in enumerate(pieces) if p.mention < 0 and p.text.isalpha() and len(p.text) > 3]
    for i in rng.sample(open_, min(len(open_), rng.choice((1, 1, 2)))):
        word = pieces[i].text
        at = rng.randrange(1, len(word) - 1)
        slip = rng.randrange(4)
        word = (
            word[:at] + word[at + 1] + word[at] + word[at + 2 :] if slip == 0
            else word[:at] + word[at + 1 :] if slip == 1
            else word[:at] + word[at] + word[at:] if slip == 2
            else word[:at] + rng.choice("aeiou") + word[at + 1 :]
        )  # fmt: skip
        pieces[i] = replace(pieces[i], text=word)
    return pieces
