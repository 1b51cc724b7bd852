"""The learned reader's network in numpy: WordPiece, a six-layer transformer, queries that read atoms off it.

The encoder is MiniLM-L6 (Wang et al. 2020), fine-tuned by `training/train.py`; each learned query attends to the
words and says one atom: a class per head, and which mention each pointer points at.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib.resources import files
from typing import Any

import numpy as np
import numpy.typing as npt

from ovita.errors import OvitaError
from ovita.instruct.lexicon import concept_at
from ovita.instruct.sketch import Fragment, Sketch
from ovita.instruct.slots import AMOUNTS, HEADS, POINTERS
from ovita.instruct.transformer import Floats, Layers, gelu, softmax

QUERIES = 6
"""Most atoms of a sentence."""

ENCODER_HEADS, DECODER_HEADS = 12, 6
KEY = 64
"""Length of the keys that pointers compare."""

LONGEST = 96
"""Pieces of a sentence that are read; the rest is cut off."""

WEIGHTS = "weights.npz"


class WordPiece:
    """Splits words into the longest known pieces (Wu et al. 2016).

    Args:
        pieces: The vocabulary in the order of the embeddings; continuations begin with "##".
    """

    def __init__(self, pieces: Sequence[str]) -> None:
        self.ids = {piece: i for i, piece in enumerate(pieces)}
        self.pad, self.unknown = self.ids["[PAD]"], self.ids["[UNK]"]
        self.begin, self.end = self.ids["[CLS]"], self.ids["[SEP]"]

    def whole(self) -> frozenset[str]:
        """The words that are one piece: no misspellings."""
        return frozenset(piece for piece in self.ids if piece.isalpha() and len(piece) > 1)

    def split(self, word: str) -> list[int]:
        """The pieces of a word in lower case."""
        found: list[int] = []
        for part in word.lower().split():
            if part in self.ids:
                found.append(self.ids[part])
                continue
            for run in _runs(part):
                found += self._run(run)
        return found

    def _run(self, word: str) -> list[int]:
        found: list[int] = []
        at = 0
        while at < len(word):
            for end in range(len(word), at, -1):
                piece = self.ids.get(("##" if at else "") + word[at:end])
                if piece is not None:
                    break
            else:
                return [self.unknown]
            found.append(piece)
            at = end
        return found


def _runs(word: str) -> list[str]:
    """Letters and digits apart from other signs."""
    runs: list[str] = []
    for c in word:
        if runs and c.isalnum() and runs[-1][-1].isalnum():
            runs[-1] += c
        else:
            runs.append(c)
    return runs


@dataclass(frozen=True)
class Encoded:
    """A sketch as the network takes it.

    Args:
        ids: Pieces (T,).
        kinds: 0 for the sentence, 1 for the turn before (T,).
        amounts: Position and mention of each amount.
        objects: Position and mention of each object.
        concepts: The concept of the word files that each position belongs to, or "" (T,).
    """

    ids: tuple[int, ...]
    kinds: tuple[int, ...]
    amounts: tuple[tuple[int, int], ...]
    objects: tuple[tuple[int, int], ...]
    concepts: tuple[str, ...]


def encode(seen: Sketch, splitter: WordPiece) -> Encoded:
    """A sketch in word pieces."""
    ids, kinds, concepts = [splitter.begin], [0], [""]
    found: dict[bool, list[tuple[int, int]]] = {False: [], True: []}
    for kind, pieces in enumerate((seen.pieces, seen.before)):
        for piece, concept in zip(pieces or (), concepts_of(pieces or ()), strict=True):
            split = splitter.split(piece.text)
            if len(ids) + len(split) > LONGEST - 1:
                break
            if piece.mention >= 0 and split:
                found[seen.mentions[piece.mention].is_object].append((len(ids), piece.mention))
            ids += split
            kinds += [kind] * len(split)
            concepts += [concept] * len(split)
        if kind == 0 or seen.before is not None:
            ids.append(splitter.end)
            kinds.append(kind)
            concepts.append("")
    return Encoded(tuple(ids), tuple(kinds), tuple(found[False]), tuple(found[True]), tuple(concepts))


def concepts_of(pieces: Sequence[Fragment]) -> list[str]:
    """The concept of the phrase that each piece belongs to, or ""."""
    words = [piece.text if piece.mention < 0 else "<>" for piece in pieces]
    found: list[str] = []
    while len(found) < len(words):
        i = len(found)
        concept, length = concept_at(words, i) if words[i] != "<>" else ("", 0)
        found += [concept] * max(length, 1)
    return found


def layout() -> dict[str, tuple[int, int]]:
    """Where the classes of each head stand in the network's output."""
    places: dict[str, tuple[int, int]] = {}
    at = 0
    for head, classes in HEADS.items():
        places[head] = (at, at + len(classes))
        at += len(classes)
    return places


@dataclass(frozen=True)
class Output:
    """What the network says of a sentence.

    Args:
        heads: Probabilities of the classes of each head, (QUERIES, classes).
        pointers: Probabilities that each pointer means none, then each of its candidates, (QUERIES, 1 + candidates).
        candidates: The mentions that amounts and objects may point at.
    """

    heads: Mapping[str, Floats]
    pointers: Mapping[str, Floats]
    candidates: Mapping[str, tuple[int, ...]]


REMEMBERED = 64
"""Sentences of which it is remembered what the network says of them."""


class Network(Layers):
    """The network with its weights.

    Args:
        weights: Arrays by name; int8 arrays have their scales per row under "NAME.scale".
    """

    def __init__(self, weights: Mapping[str, npt.NDArray[Any]]) -> None:
        self.pieces = tuple(str(weights["vocabulary"]).split("\n"))
        self.splitter = WordPiece(self.pieces)
        self.concepts = {name: i for i, name in enumerate(str(weights["concepts"]).split("\n"))}
        self.known = frozenset(str(weights["known"]).split("\n"))
        self.extra = {name: weights[name] for name in weights if name.startswith("calibration")}
        super().__init__(weights)
        self.layers = sum(name.endswith("q.weight") and name.startswith("encoder.") for name in self.w)
        self.steps = len({name.split(".")[1] for name in self.w if name.startswith("decoder.")})
        # What writes, judges and shows a result has the same few sentences read again and again.
        self._hidden_of = lru_cache(REMEMBERED)(self._hidden)
        self._read_of = lru_cache(REMEMBERED)(self._read)

    def _feed(self, name: str, x: Floats) -> Floats:
        return self.linear(f"{name}.down", gelu(self.linear(f"{name}.up", x)))

    def hidden(self, encoded: Encoded) -> Floats:
        """The encoder's output (T, width), which is not to be written to."""
        return self._hidden_of(encoded)

    def _hidden(self, encoded: Encoded) -> Floats:
        ids, kinds = np.array(encoded.ids), np.array(encoded.kinds)
        x = self.w["embed.word"][ids] + self.w["embed.position"][: len(ids)] + self.w["embed.kind"][kinds]
        x = begun = self.norm("embed.norm", x)
        for i in range(self.layers):
            x = self.norm(f"encoder.{i}.norm1", x + self.attend(f"encoder.{i}", x, x, ENCODER_HEADS))
            x = self.norm(f"encoder.{i}.norm2", x + self._feed(f"encoder.{i}", x))
        told = self.w["concept"][[self.concepts.get(concept, 0) for concept in encoded.concepts]]
        found = x + told + self.linear("skip", begun)
        found.flags.writeable = False
        return found

    def read(self, encoded: Encoded) -> Output:
        """What the network says of a sentence; its arrays are not to be written to."""
        return self._read_of(encoded)

    def _read(self, encoded: Encoded) -> Output:
        words = self.hidden(encoded)
        x = self.w["queries"]
        for i in range(self.steps):
            x = self.norm(f"decoder.{i}.norm0", x + self.attend(f"decoder.{i}.self", x, x, DECODER_HEADS))
            x = self.norm(f"decoder.{i}.norm1", x + self.attend(f"decoder.{i}.cross", x, words, DECODER_HEADS))
            x = self.norm(f"decoder.{i}.norm2", x + self._feed(f"decoder.{i}", x))
        said = self.linear("heads", x)
        heads = {head: softmax(said[:, a:b]) for head, (a, b) in layout().items()}
        asked = self.linear("asks", x).reshape(len(x), len(POINTERS), KEY)
        keys = self.linear("keys", words)
        pointers: dict[str, Floats] = {}
        candidates: dict[str, tuple[int, ...]] = {}
        for p, pointer in enumerate(POINTERS):
            found = encoded.amounts if pointer in AMOUNTS else encoded.objects
            options = np.concatenate([self.w["nothing"][p : p + 1], keys[[at for at, _ in found]]])
            pointers[pointer] = softmax(asked[:, p] @ options.T / np.float32(math.sqrt(KEY)))
            candidates[pointer] = tuple(mention for _, mention in found)
        for said_of in (*heads.values(), *pointers.values()):
            said_of.flags.writeable = False
        return Output(heads, pointers, candidates)


@cache
def network() -> Network:
    """The network that the package brings, loaded at the first call.

    Raises:
        OvitaError: If the weights are missing.
    """
    path = files("ovita.instruct").joinpath(WEIGHTS)
    if not path.is_file():
        raise OvitaError(f"the learned reader's weights ({WEIGHTS}) are missing; `make train` writes them")
    with path.open("rb") as file, np.load(file) as weights:
        return Network({name: weights[name] for name in weights.files})
