"""ExTraCT (Yow et al., arXiv 2401.03701): the most similar textual description of a feature, and its deformation.

A feature is a distance to an object or a Cartesian direction, less or more of it; each has a few descriptions. The
feature whose best description has the highest cosine similarity with the instruction is applied, whatever that
similarity is: xi = xi_0 + w F with a force F on each waypoint.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ovita.baselines.base import Deformed
from ovita.baselines.encoder import Embed, Remembered, minilm
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Array, Trajectory
from ovita.request import Request
from ovita.text import the

RADIUS = 0.3
"""Waypoints nearer to the object's centre than this are moved by a distance feature [m]; both variants' value."""

TOWARDS: Mapping[int, Sequence[str]] = {
    1: ("Move closer to {}", "Stay close to {}", "Decrease distance to {}", "Keep a smaller distance from {}"),
    -1: (
        "Move further away from {}",
        "Stay away from {}",
        "Increase distance to {}",
        "Keep a bigger distance from {}",
        "Avoid {}",
    ),
}
"""Descriptions of the two features of an object: towards it (1) and away from it (-1)."""

ALONG: Mapping[str, Sequence[str]] = {
    "down": ("Move lower", "Move down", "Stay down", "Go to the bottom", "Down", "Low"),
    "up": ("Move higher", "Move up", "Stay up", "Stay on the upper part", "Up", "Top", "Go to the top"),
    "left": ("Stay on the left", "Go to the left", "Move left", "Move more towards the left", "Left"),
    "right": ("Stay on the right", "Go to the right", "Move right", "Move more towards the right", "Right"),
    "back": ("Stay at the back", "Go to the back", "Move back", "Stay back", "Move backward", "Go behind"),
    "front": ("Stay at the front", "Go to the front", "Move front", "Stay front", "Move forward"),
}
"""Descriptions of the six Cartesian features, by the direction in the scene's frame."""


@dataclass(frozen=True)
class Feature:
    """Something about a trajectory that can be changed.

    Args:
        texts: Its descriptions.
        target: The object that a distance feature is about, or None for a Cartesian one.
        sign: Of a distance feature: 1 towards the object, -1 away from it.
        direction: Of a Cartesian feature: "up", "left" and so on; else "".
    """

    texts: tuple[str, ...]
    target: SceneObject | None = None
    sign: int = 0
    direction: str = ""

    @property
    def named(self) -> str:
        """The feature in words."""
        if self.target is None:
            return f"move {self.direction}"
        return f"move {'closer to' if self.sign > 0 else 'away from'} {the(self.target.name)}"


@dataclass(frozen=True)
class Settings:
    """What differs between the variants.

    Args:
        name: On the command line.
        keeps_limits: Whether an optimiser enforces the limits after the deformation.
        reach: Largest length of w F [m].
        arrives: Whether a pull ends at the object's centre at the latest.
        ramp: Whether a Cartesian force grows from 0 at the start to its full size at the goal.
        spared: Waypoints at most so far from the object's centre are left where they are [m].
        waypoints: The path is resampled to so many first, by index; None leaves it.
    """

    name: str
    keeps_limits: bool
    reach: float
    arrives: bool = False
    ramp: bool = False
    spared: float = 0.0
    waypoints: int | None = None


PUBLISHED = Settings("baseline:extract", keeps_limits=True, reach=RADIUS, arrives=True)
"""The paper's: r = 0.3, w = 1, then limits. It gives the force's direction and not its length: ours is r - d, so that a
push ends at the radius, where nothing jumps, at most d towards the object, and r for a Cartesian feature, the same at
every waypoint."""

OVITA = Settings("baseline:extract-ovita", keeps_limits=False, reach=0.1, ramp=True, spared=0.01, waypoints=100)
"""As the authors of OVITA ran it (github.com/anurag1000101/ExTraCT): w = 0.1, a force (r - d) / r, no optimiser."""


def features(scene: Scene) -> tuple[Feature, ...]:
    """The features of a scene: two for each object, and six directions."""
    near = [
        Feature(tuple(text.format(item.name.lower()) for text in texts), item, sign)
        for sign, texts in TOWARDS.items()
        for item in scene
    ]
    return (*near, *(Feature(tuple(texts), direction=word) for word, texts in ALONG.items()))


def best(instruction: str, found: Sequence[Feature], embed: Embed) -> tuple[Feature, float]:
    """The feature with the description most similar to an instruction, the first on a tie, and that cosine."""
    said = embed([instruction])[0]
    owners = [feature for feature in found for _ in feature.texts]
    likeness = embed([text for feature in found for text in feature.texts]) @ said
    first = int(np.argmax(likeness))
    return owners[first], float(likeness[first])


def deformed(path: Trajectory, feature: Feature, scene: Scene, settings: Settings) -> Trajectory:
    """The path with a feature's force applied to its positions; speeds stay."""
    if settings.waypoints is not None:
        path = path.resample(settings.waypoints, by="index")
    if feature.target is None:
        share = np.linspace(0.0, 1.0, len(path)) if settings.ramp else np.ones(len(path))
        shift = settings.reach * share[:, None] * scene.frame.direction(feature.direction)
    else:
        shift = _pulled(path.positions, feature.target.position, feature.sign, settings)
    return path.with_(positions=path.positions + shift)


def _pulled(points: Array, centre: Array, sign: int, settings: Settings) -> Array:
    """Shifts (N, 3) [m] of points towards a centre (sign 1) or away from it (-1): w F."""
    to = centre - points
    distance = np.linalg.norm(to, axis=1)
    moved = (distance < RADIUS) & (distance > max(settings.spared, 1e-6))
    length = np.where(moved, settings.reach * (RADIUS - distance) / RADIUS, 0.0)
    if settings.arrives and sign > 0:
        length = np.minimum(length, distance)
    return np.asarray(sign * (length / np.where(moved, distance, 1.0))[:, None] * to)


@dataclass
class Extract:
    """ExTraCT with the settings of a variant.

    Args:
        embed: The encoder; None takes all-MiniLM-L6-v2.

    Raises:
        MissingExtra: If the encoder's packages are not installed.
    """

    settings: Settings = PUBLISHED
    embed: Embed | None = None

    def __post_init__(self) -> None:
        self._vectors = Remembered(self.embed or minilm())

    @property
    def name(self) -> str:
        """Of the variant."""
        return self.settings.name

    @property
    def keeps_limits(self) -> bool:
        """Whether the variant has an optimiser."""
        return self.settings.keeps_limits

    def deform(self, request: Request) -> Deformed:
        """The trajectory with the most similar feature's deformation."""
        feature, similarity = best(request.instruction, features(request.scene), self._vectors)
        path = deformed(request.trajectory, feature, request.scene, self.settings)
        return Deformed(path, feature.named, similarity)
