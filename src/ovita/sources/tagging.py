"""Which words of a sentence tell where a way starts, what it passes, where it ends, and what else is wished for.

A small network labels every word, on top of the encoder of the learned reader (`instruct.encoder`): the beginning and
the inside of a phrase of each role (Ramshaw and Marcus 1995), the likeliest row of labels by Viterbi's algorithm.
`training/ways.py` trains it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.resources import files
from itertools import pairwise
from typing import Any, Literal, get_args

import numpy as np
import numpy.typing as npt

from ovita.instruct.encoder import WordPiece, encode, network
from ovita.instruct.sketch import LETTERS, Fragment, Referent, Sketch, sketch
from ovita.instruct.transformer import Floats
from ovita.paths.scene import Scene

Role = Literal["start", "via", "goal", "wish", "wait"]
"""What a phrase tells: an end or a place of the way, a wish besides it, or a wait at a place of it."""

ROLES: tuple[Role, ...] = get_args(Role)
LABELS = ("", *(f"{place}-{role}" for role in ROLES for place in ("begin", "inside")))
WEIGHTS = "ways.npz"
NEVER = -1e9


@dataclass(frozen=True)
class TaggedPhrase:
    """Words of a sentence that belong together.

    Args:
        role: What they tell, or None for nothing.
        span: Where they stand in the sentence, in characters.
        shares: How likely each role is by its words together (0..1).
    """

    role: Role | None
    span: tuple[int, int]
    shares: Mapping[Role, float] = field(default_factory=dict, compare=False)


class Tagger:
    """The network that labels words.

    Args:
        weights: Two layers ("in", "out") with biases, "mean" and "scale" of the features, and "moves": the
            log-likelihood of each label behind each other one, the last row for the first word.
    """

    def __init__(self, weights: Mapping[str, npt.NDArray[Any]]) -> None:
        self.w: dict[str, Floats] = {name: weights[name].astype(np.float32) for name in weights}
        self.w["moves"] = self.w["moves"] + forbidden()

    def read(self, seen: Sketch) -> tuple[TaggedPhrase, ...]:
        """The phrases of a sentence, in order; what stands between them has no role."""
        if not seen.pieces:
            return ()
        shares = self.shares(features(seen))
        labels = likeliest(np.log(shares + 1e-12), self.w["moves"])
        of_role = {role: shares[:, [i for i, label in enumerate(LABELS) if label.endswith(role)]].sum(axis=1)
                   for role in ROLES}  # fmt: skip
        found: list[TaggedPhrase] = []
        for (role, first), last in _runs(labels):
            begin, end = (seen.pieces[first].words or (0, 0))[0], (seen.pieces[last].words or (0, 0))[1]
            means = {name: float(share[first : last + 1].mean()) for name, share in of_role.items()}
            found.append(TaggedPhrase(role, (begin, end), means))
        return tuple(found)

    def shares(self, x: Floats) -> Floats:
        """The share of each label for each word (T, labels)."""
        x = (x - self.w["mean"]) / self.w["scale"]
        hidden = np.maximum(x @ self.w["in"] + self.w["in.bias"], 0.0)
        z = hidden @ self.w["out"] + self.w["out.bias"]
        e = np.exp(z - z.max(axis=1, keepdims=True))
        return np.asarray(e / e.sum(axis=1, keepdims=True), dtype=np.float32)


def _runs(labels: Sequence[int]) -> list[tuple[tuple[Role | None, int], int]]:
    """The phrases of a row of labels: role and first word, and last word."""
    found: list[tuple[tuple[Role | None, int], int]] = []
    for k, label in enumerate(labels):
        place, _, role = LABELS[label].partition("-")
        if place == "begin" or (not role and not (found and found[-1][0][0] is None)):
            found.append(((_ROLE_OF.get(role), k), k))
        else:
            found[-1] = (found[-1][0], k)
    return found


_ROLE_OF: Mapping[str, Role] = {role: role for role in ROLES}


def forbidden() -> Floats:
    """What keeps the inside of a phrase from standing behind anything but that phrase (labels + 1, labels)."""
    moves = np.zeros((len(LABELS) + 1, len(LABELS)), dtype=np.float32)
    for behind, label in enumerate(LABELS):
        if label.startswith("inside"):
            moves[:, behind] = NEVER
            moves[[behind - 1, behind], behind] = 0.0
    return moves


def likeliest(logs: Floats, moves: Floats) -> list[int]:
    """The likeliest row of labels (Viterbi 1967).

    Args:
        logs: Log-likelihoods of the labels of each word (T, labels).
        moves: Of each label behind each other one (labels + 1, labels), the last row for the first word.
    """
    best, back = logs[0] + moves[-1], []
    for row in logs[1:]:
        scores = best[:, None] + moves[:-1]
        back.append(scores.argmax(axis=0))
        best = scores.max(axis=0) + row
    found = [int(best.argmax())]
    for came in reversed(back):
        found.append(int(came[found[-1]]))
    return found[::-1]


def features(seen: Sketch) -> Floats:
    """What the encoder makes of each word and its neighbours (T, 3 * width)."""
    net = network()
    hidden = net.hidden(encode(seen, net.splitter))
    x = hidden[first_pieces(seen, net.splitter, len(hidden) - 1)]
    none = np.zeros((1, x.shape[1]), dtype=np.float32)
    return np.concatenate([x, np.vstack([none, x[:-1]]), np.vstack([x[1:], none])], axis=1)


def first_pieces(seen: Sketch, splitter: WordPiece, last: int) -> list[int]:
    """Where the first piece of each word stands in the encoder's output; at most `last`, for words cut off."""
    counts = [len(splitter.split(piece.text)) for piece in seen.pieces]
    return [min(1 + int(at), last) for at in np.cumsum([0, *counts[:-1]])]


def seen_with_points(text: str, scene: Scene, points: Sequence[tuple[int, int]] = ()) -> Sketch:
    """A sentence as the network sees it, with one mark for each triple of coordinates.

    Args:
        text: The sentence.
        scene: Whose objects it may name.
        points: Where coordinates stand in it.
    """
    seen = sketch(text, scene, None, None, network().known)
    if not points:
        return seen
    pieces, mentions = list[Fragment](), list(seen.mentions)
    inside = [next((p for p in points if p[0] <= (f.words or (0, 0))[0] < p[1]), None) for f in seen.pieces]
    for (before, within), piece in zip(pairwise([None, *inside]), seen.pieces, strict=True):
        if within is None:
            pieces.append(piece)
        elif within != before:
            mentions.append(Referent(within, ("point",)))
            pieces.append(Fragment(LETTERS[-1], within, len(mentions) - 1))
    return replace(seen, pieces=tuple(pieces), mentions=tuple(mentions))


@cache
def tagger() -> Tagger:
    """The network that the package brings, loaded at the first call."""
    with files("ovita.sources").joinpath(WEIGHTS).open("rb") as file, np.load(file) as weights:
        return Tagger({name: weights[name] for name in weights.files})
