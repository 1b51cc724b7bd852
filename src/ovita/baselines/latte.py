"""A transformer after LaTTe (Bucker et al., ICRA 2023), of our own making and with our own weights, in numpy.

Tokens of the waypoints and the objects, the sentence's embedding and its similarity with each object's name go in; the
change of 40 waypoints comes out. `training/latte.py` trains it. It is not the authors' model: docs/benchmark.md lists
what differs.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np
import numpy.typing as npt

from ovita.baselines.base import Deformed
from ovita.baselines.encoder import Embed, Remembered, minilm
from ovita.errors import OvitaError
from ovita.instruct.transformer import Floats, Layers
from ovita.paths.scene import RFU, Scene, rotation
from ovita.paths.trajectory import Array, Trajectory, interpolate
from ovita.request import Request

WAYPOINTS, PATCH = 40, 4
"""Waypoints that the network sees, and how many of them make a token."""

OBJECTS = 6
"""Most objects that it sees: those whose names are most like the sentence."""

TEXT = 384
"""Length of a sentence's embedding."""

HEADS = 4

LOCALITY = 0.5
"""LaTTe's factor for how far an object's influence reaches, as in OVITA's comparison."""

SHARPNESS = 20.0
"""How much of the relevance goes to the object most like the sentence: the softmax's inverse temperature."""

QUIET = (0.04, 0.04)
"""Predicted changes below these are none: of positions, in half extents of the path; of speeds, in mean speeds."""

WEIGHTS = "latte.npz"


@dataclass(frozen=True)
class Seen:
    """A path and its objects as the network sees them, for one or more samples.

    Args:
        path: Positions in half extents about the middle of the path's box, +x right, +y front, +z up, and speeds in
            mean speeds (B, 40, 4).
        objects: Their centres, likewise (B, 6, 3).
        present: Which of them there are (B, 6).
        scale: Locality, and the logarithms of the half extent [m] and the mean speed [m/s] (B, 3).
    """

    path: Floats
    objects: Floats
    present: npt.NDArray[np.bool_]
    scale: Floats


@dataclass(frozen=True)
class Inputs:
    """What the network's first layers take.

    Args:
        waypoints: Four waypoints a row, each with the way to the object in question (B, 10, 32).
        objects: Centre, relevance and presence (B, 6, 5).
        said: Embedding, similarities, centres and scale (B, TEXT + 27).
    """

    waypoints: Floats
    objects: Floats
    said: Floats


@dataclass(frozen=True)
class PathBox:
    """The box in which the network sees a path: `half` extents [m], `pace` [m/s], and the turn to right, front, up."""

    middle: Array
    half: float
    pace: float
    turn: Array

    @classmethod
    def of(cls, path: Trajectory, scene: Scene) -> PathBox:
        """The box of a path in its scene."""
        turn = rotation(scene.frame, RFU)
        points = path.positions @ turn.T
        low, high = points.min(axis=0), points.max(axis=0)
        return cls((low + high) / 2, max(float((high - low).max()) / 2, 1e-6), float(path.speeds.mean()) or 1.0, turn)

    def rows(self, path: Trajectory) -> Floats:
        """The 40 waypoints of a path, spread evenly by index (40, 4)."""
        rows = _by_index(np.column_stack([self.places(path.positions), path.speeds / self.pace]), WAYPOINTS)
        return np.asarray(rows, dtype=np.float32)

    def places(self, points: Array) -> Floats:
        """Points (K, 3) [m] in the box."""
        return np.asarray((points @ self.turn.T - self.middle) / self.half, dtype=np.float32)

    def changed(self, path: Trajectory, change: Array) -> Trajectory:
        """A path with a change (40, 4) spread over its waypoints; no speed falls below zero."""
        over = _by_index(change, len(path))
        positions = path.positions + self.half * over[:, :3] @ self.turn
        return path.with_(positions=positions, speeds=np.maximum(path.speeds + self.pace * over[:, 3], 0.0))


def seen(path: Trajectory, scene: Scene, locality: float = LOCALITY) -> Seen:
    """A request's path and at most six objects as the network sees them, a batch of one."""
    box = PathBox.of(path, scene)
    places = np.zeros((1, OBJECTS, 3), dtype=np.float32)
    for i, item in enumerate(scene):
        places[0, i] = box.places(item.position[None])[0]
    scale = np.array([[locality, np.log10(box.half), np.log10(box.pace)]], dtype=np.float32)
    return Seen(box.rows(path)[None], places, np.arange(OBJECTS)[None] < len(scene), scale)


def inputs(what: Seen, text: Array, likeness: Array) -> Inputs:
    """The network's inputs for embeddings (B, TEXT) of sentences and their similarity to the objects' names (B, 6)."""
    similar = np.where(what.present, likeness, 0.0).astype(np.float32)
    share = np.exp(SHARPNESS * (similar - 1.0)) * what.present
    share = share / np.maximum(share.sum(axis=1, keepdims=True), 1e-9)
    target = np.einsum("bk,bkd->bd", share, what.objects)[:, None]
    way = np.clip(target - what.path[..., :3], -4.0, 4.0)
    rows = np.concatenate([what.path, way, np.linalg.norm(way, axis=-1, keepdims=True)], axis=-1)
    centres = np.clip(what.objects, -4.0, 4.0) * what.present[..., None]
    items = np.concatenate([centres, share[..., None], what.present[..., None]], axis=-1)
    said = np.concatenate([text * 10.0, similar, centres.reshape(len(rows), -1), what.scale], axis=1)
    return Inputs(
        rows.reshape(len(rows), WAYPOINTS // PATCH, -1).astype(np.float32),
        items.astype(np.float32),
        said.astype(np.float32),
    )


class LatteNetwork(Layers):
    """The network with its weights; `training/latte.py` has the same in torch, with the same names.

    An encoder layer over objects and waypoints, then decoder layers over the waypoints that attend to one another and
    to what was encoded, beside four tokens of the sentence; normalised after each step, as in LaTTe.
    """

    def __init__(self, weights: Mapping[str, npt.NDArray[Any]]) -> None:
        super().__init__(weights, epsilon=1e-5)
        self.encoders, self.decoders = (
            len({name.split(".")[1] for name in self.w if name.startswith(f"{part}.")})
            for part in ("encoder", "decoder")
        )

    def change(self, given: Inputs) -> Floats:
        """The change of the 40 waypoints in the box (B, 40, 4)."""
        batch = len(given.said)
        hidden = np.maximum(self.linear("said.0", given.said), 0.0)
        tokens = self.linear("said.1", hidden).reshape(batch, 5, -1)
        ways, items = self.linear("waypoint", given.waypoints), self.linear("object", given.objects)
        x = np.concatenate([items, ways + self.w["place"]], axis=1)
        there = np.ones((batch, x.shape[1]), dtype=bool)
        there[:, :OBJECTS] = given.objects[..., -1] > 0.5
        for i in range(self.encoders):
            x = self.norm(f"encoder.{i}.norm0", x + self.attend(f"encoder.{i}.self", x, x, HEADS, there))
            x = self.norm(f"encoder.{i}.norm1", x + self._feed(f"encoder.{i}", x))
        memory = np.concatenate([x, tokens[:, :4]], axis=1)
        there = np.concatenate([there, np.ones((batch, 4), dtype=bool)], axis=1)
        y = ways + self.w["place"] + tokens[:, 4:]
        for i in range(self.decoders):
            y = self.norm(f"decoder.{i}.norm0", y + self.attend(f"decoder.{i}.self", y, y, HEADS))
            y = self.norm(f"decoder.{i}.norm1", y + self.attend(f"decoder.{i}.cross", y, memory, HEADS, there))
            y = self.norm(f"decoder.{i}.norm2", y + self._feed(f"decoder.{i}", y))
        out = self.linear("out.1", np.maximum(self.linear("out.0", y), 0.0))
        return out.reshape(batch, WAYPOINTS, 4)

    def _feed(self, name: str, x: Floats) -> Floats:
        return self.linear(f"{name}.down", np.maximum(self.linear(f"{name}.up", x), 0.0))


@cache
def latte_network() -> LatteNetwork:
    """The network that the package brings, loaded at the first call.

    Raises:
        OvitaError: If the weights are missing.
    """
    path = files("ovita.baselines").joinpath(WEIGHTS)
    if not path.is_file():
        raise OvitaError(f"the weights of baseline:latte-style ({WEIGHTS}) are missing; `make train-latte` writes them")
    with path.open("rb") as file, np.load(file) as weights:
        return LatteNetwork({name: weights[name] for name in weights.files})


@dataclass
class LatteStyle:
    """A LaTTe-style transformer of our own, not the authors' weights.

    Args:
        embed: The sentence encoder; None takes all-MiniLM-L6-v2.
        network: None takes the one that the package brings.

    Raises:
        MissingExtra: If the encoder's packages are not installed.
        OvitaError: If there are no weights.
    """

    embed: Embed | None = None
    network: LatteNetwork | None = None
    name = "baseline:latte-style"
    keeps_limits = False

    def __post_init__(self) -> None:
        self._vectors = Remembered(self.embed or minilm())
        self.network = self.network or latte_network()

    def deform(self, request: Request) -> Deformed:
        """The trajectory with the network's change; nothing is matched, so no similarity is said."""
        assert self.network is not None
        path = request.trajectory
        text = self._vectors([request.instruction])
        likeness = np.array([self._vectors([item.name.lower()])[0] @ text[0] for item in request.scene])
        most = sorted(np.argsort(-likeness, kind="stable")[:OBJECTS])
        scene = Scene(tuple(request.scene.objects[i] for i in most), request.scene.frame)
        similar = np.zeros((1, OBJECTS))
        similar[0, : len(most)] = likeness[most]
        change = quieted(self.network.change(inputs(seen(path, scene), text, similar))[0])
        return Deformed(PathBox.of(path, scene).changed(path, change))


def quieted(change: Array) -> Array:
    """A change (40, 4) without its positions, or speeds, where the largest of them is not worth mentioning."""
    large = np.linalg.norm(change[:, :3], axis=1).max(), np.abs(change[:, 3]).max()
    kept = np.array([large[0] >= QUIET[0]] * 3 + [large[1] >= QUIET[1]])
    return np.asarray(change * kept, dtype=float)


def _by_index(rows: Array, n: int) -> Array:
    return interpolate(rows, np.linspace(0.0, len(rows) - 1.0, n))
