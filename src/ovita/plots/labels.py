"""Where to write names so that they cover neither each other nor the paths."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ovita.paths.trajectory import Array

_ANGLES = np.deg2rad([90, -90, 0, 180, 45, 135, -45, -135, 67, 113, -67, -113, 22, 158, -22, -158])
_GAPS = (4.0, 12.0, 24.0, 40.0, 60.0, 85.0)


@dataclass(frozen=True)
class Placed:
    """A label's middle (2,) and whether it lies so far from its object that a line should join them."""

    middle: Array
    joined: bool


def place(
    boxes: Sequence[tuple[Array, Array]],
    sizes: Sequence[tuple[float, float]],
    busy: Array,
    area: tuple[Array, Array],
    *,
    scale: float = 1.0,
) -> list[Placed]:
    """Choose a place for each label, one after the other, where it covers least.

    Args:
        boxes: Lower and upper corner (2,) of each object in the picture [pixels].
        sizes: Width and height of each label [pixels].
        busy: Points (K, 2) that labels should not cover, such as those of the paths [pixels].
        area: Lower and upper corner (2,) that labels should stay in [pixels].
        scale: Pixels per point, by which gaps grow.
    """
    placed: list[Placed] = []
    taken: list[tuple[Array, Array]] = []
    for own, (box, size) in enumerate(zip(boxes, sizes, strict=True)):
        half = np.asarray(size) / 2.0
        middles, costs = _candidates(box, half, scale)
        lower, upper = middles - half - 2.0 * scale, middles + half + 2.0 * scale
        hits = ((busy >= lower[:, None]) & (busy <= upper[:, None])).all(axis=2).sum(axis=1)
        costs = costs + 6.0 * np.minimum(hits, 20)
        for other in taken:
            costs = costs + 400.0 * _overlap(lower, upper, *other)
        for i, other in enumerate(boxes):
            costs = costs + (15.0 if i == own else 60.0) * _overlap(lower, upper, *other)
        outside = np.maximum(area[0] - lower, 0.0).sum(axis=1) + np.maximum(upper - area[1], 0.0).sum(axis=1)
        costs = costs + 20.0 * outside / scale
        best = int(np.argmin(costs))
        taken.append((lower[best], upper[best]))
        gap = np.maximum(np.maximum(box[0] - upper[best], lower[best] - box[1]), 0.0)
        placed.append(Placed(middles[best], bool(np.linalg.norm(gap) > 9.0 * scale)))
    return placed


def _candidates(box: tuple[Array, Array], half: Array, scale: float) -> tuple[Array, Array]:
    middle, reach = (box[0] + box[1]) / 2.0, (box[1] - box[0]) / 2.0 + half
    spots = [middle]
    costs = [30.0]
    for gap in _GAPS:
        for k, angle in enumerate(_ANGLES):
            direction = np.array([np.cos(angle), np.sin(angle)])
            stretch = direction / np.abs(direction).max() if k < 4 else np.sign(direction) * np.sqrt(np.abs(direction))
            spots.append(middle + stretch * reach + direction * gap * scale)
            costs.append(0.35 * gap + (0.0 if k < 2 else 1.5))
    return np.array(spots), np.array(costs)


def _overlap(lower: Array, upper: Array, other_lower: Array, other_upper: Array) -> Array:
    """Share of the smaller rectangle that two rectangles have in common, for rows of the first pair."""
    common = np.maximum(np.minimum(upper, other_upper) - np.maximum(lower, other_lower), 0.0).prod(axis=1)
    smaller = np.minimum((upper - lower).prod(axis=1), float((other_upper - other_lower).prod()))
    return np.asarray(common / np.maximum(smaller, 1.0))
