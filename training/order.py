"""Put the atoms of a sentence in the order in which its words say them, where the reading has them in another.

Which words say what is learned from all sentences and their readings (Brown et al., The Mathematics of Statistical
Machine Translation, 1993, Model 1); amounts and objects are where they are mentioned.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ovita.instruct.slots import HEADS, Atom

if TYPE_CHECKING:
    from augment import Sample

ROUNDS = 4
"""Of expectation and maximisation; more change little."""

NOTHING = "nothing"
"""What the words say that no atom needs."""

SINGLE = ("relation", "direction", "degree", "sense", "spot", "outside", "place", "toward", "step", "on")
"""Heads whose classes are said by words of their own."""


def claims(atom: Atom) -> list[str]:
    """What an atom says, each part of it by itself."""
    found = [f"{atom.label('action')} {atom.label('choice')}", f"{atom.label('action')} {atom.label('role')}"]
    found += [f"{head}={atom.label(head)}" for head in SINGLE if atom.label(head) != HEADS[head][0]]
    return found + ([f"part={atom.label('part')}"] if atom.label("part") != "whole" else [])


class Order:
    """Which words say what.

    Args:
        samples: Sentences with their atoms, in any order.
    """

    def __init__(self, samples: Sequence[Sample]) -> None:
        pairs = [(_words(s), [claim for atom in s.atoms for claim in claims(atom)] + [NOTHING]) for s in samples]
        self.told: dict[str, dict[str, float]] = {}
        for _ in range(ROUNDS):
            counts: dict[str, dict[str, float]] = defaultdict(lambda: defaultdict(float))
            for words, said in pairs:
                for word in words:
                    shares = [self.told[claim][word] if self.told else 1.0 for claim in said]
                    whole = sum(shares)
                    for claim, share in zip(said, shares, strict=True):
                        counts[claim][word] += share / whole
            self.told = {claim: _shares(of) for claim, of in counts.items()}

    def places(self, sample: Sample) -> list[float]:
        """Where in the sentence each atom is said, as a piece of it."""
        words = _words(sample)
        said = np.array([self._likely(claims(atom), words) for atom in sample.atoms])
        shares = said / np.maximum(said.sum(0) + self._likely([NOTHING], words), 1e-12)
        pointed = [{m for m in pointers.values() if m >= 0} for pointers in sample.pointers]
        for i, piece in enumerate(sample.sketch.pieces):
            if piece.mention >= 0:
                at = np.array([piece.mention in mentions for mentions in pointed], dtype=float)
                shares[:, i] = at / max(at.sum(), 1.0)
        weights = shares**2 + 1e-9
        return [float(x) for x in (weights * np.arange(len(words))).sum(1) / weights.sum(1)]

    def _likely(self, said: Sequence[str], words: Sequence[str]) -> list[float]:
        return [sum(self.told.get(claim, {}).get(word, 0.0) for claim in said) for word in words]

    def ordered(self, sample: Sample) -> Sample:
        """The sample with its atoms as they are said, a wish that no frame can say last."""
        if len(sample.atoms) < 2:
            return sample
        at = self.places(sample)
        order = sorted(range(len(at)), key=lambda i: (sample.atoms[i].label("action") == "improper", at[i]))
        return replace(
            sample, atoms=tuple(sample.atoms[i] for i in order), pointers=tuple(sample.pointers[i] for i in order)
        )


def _shares(counts: dict[str, float]) -> dict[str, float]:
    whole = sum(counts.values())
    return {word: n / whole for word, n in counts.items()}


def _words(sample: Sample) -> list[str]:
    return [piece.text.lower() for piece in sample.sketch.pieces]
