"""Evidence: what the pixels of one thing say about its surface and its outline, ready for a fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ovita.paths.trajectory import Array
from ovita.perceive.segment import SEED, Segments
from ovita.perceive.view import Mask, View

Indices = NDArray[np.intp]

POINTS = 260
"""Most points of the surface that a fit looks at."""

EDGES = 140
"""Most rays along the outline that a fit looks at."""

WIDEST = 5
"""Largest square whose pixels are averaged [pixels a side]."""

SLOPE = 3.0
"""Change of depth from pixel to pixel, in widths of a pixel, that a surface seen at a slant may have."""

GAP = 6
"""Widest strip without depth between a thing and its background, whose middle is taken for the outline [pixels]."""


@dataclass(frozen=True, eq=False)
class Evidence:
    """Points on the surface of one thing, and lines of sight that just touch it.

    Args:
        points: (N, 3) [m].
        point_noise: Standard deviation of each along its line of sight (N,) [m].
        eyes: Where the touching lines begin (E, 3) [m].
        rays: Their directions, unit vectors (E, 3).
        ray_noise: How far each may be off the outline (E,) [m].
        pixels: How many depth pixels there are in all.
        views: How many views they come from.
        cut: Whether the border of a picture cuts the thing.
        hidden: Share of the outline that something nearer hides, 0..1.
    """

    points: Array
    point_noise: Array
    eyes: Array
    rays: Array
    ray_noise: Array
    pixels: int
    views: int = 1
    cut: bool = False
    hidden: float = 0.0

    def turned(self, axes: Array, origin: Array) -> Evidence:
        """The same in other axes: rows of `axes` (3, 3) are unit vectors, `origin` (3,) becomes zero."""
        return Evidence(
            (self.points - origin) @ axes.T,
            self.point_noise,
            (self.eyes - origin) @ axes.T,
            self.rays @ axes.T,
            self.ray_noise,
            *(self.pixels, self.views, self.cut, self.hidden),
        )

    def thinned(self, count: int) -> Evidence:
        """At most so many points and so many lines, evenly spread over what there is."""
        some = np.linspace(0, len(self.points) - 1, min(count, len(self.points))).astype(int)
        few = np.linspace(0, len(self.rays) - 1, min(count, len(self.rays))).astype(int)
        return replace(
            self,
            points=self.points[some],
            point_noise=self.point_noise[some],
            eyes=self.eyes[few],
            rays=self.rays[few],
            ray_noise=self.ray_noise[few],
        )


def joined(parts: Sequence[Evidence], views: int) -> Evidence:
    """All evidence of one thing, thinned to what a fit looks at."""
    if len(parts) == 1:
        return parts[0]
    points, rays = sum(len(p.points) for p in parts), sum(len(p.rays) for p in parts)
    some, few = _some(points, int(1.5 * POINTS)), _some(rays, int(1.5 * EDGES))
    stacked = {
        key: np.concatenate([getattr(p, key) for p in parts])[chosen]
        for key, chosen in (("points", some), ("point_noise", some), ("eyes", few), ("rays", few), ("ray_noise", few))
    }
    hidden = min(p.hidden for p in parts) if views > 1 else max(p.hidden for p in parts)
    return Evidence(
        **stacked, pixels=sum(p.pixels for p in parts), views=views, cut=all(p.cut for p in parts), hidden=hidden
    )


def evidence_of(view: View, mask: Mask, parts: Segments) -> Evidence:
    """What one view says about the thing at the pixels of a mask (H, W)."""
    solid = mask & view.seen & np.isfinite(parts.depth)
    points, point_noise = _surface(view, solid, parts.noise)
    directions, noise, hidden, cut = _outline(view, solid, parts)
    few = _some(len(directions), EDGES)
    return Evidence(
        points,
        point_noise,
        np.broadcast_to(view.center, (len(few), 3)),
        directions[few],
        noise[few],
        int(solid.sum()),
        cut=cut,
        hidden=hidden,
    )


def _surface(view: View, mask: Mask, noise: Array) -> tuple[Array, Array]:
    """Points of a surface (N, 3) and their noise (N,) [m]: where there are many pixels, means over small squares."""
    rows, columns = (np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0))
    if not len(rows):
        return np.zeros((0, 3)), np.zeros(0)
    inner = _inner(mask) if mask.sum() > 4 * POINTS else mask
    side = int(np.clip(np.sqrt(inner.sum() / (3 * POINTS)), 1, WIDEST))
    box = (slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1))
    kept, cloud, sigma = (_squares(values[box], side) for values in (inner, view.points, noise))
    full = kept.all(axis=1)
    points, spread = cloud[full].mean(axis=1), sigma[full].mean(axis=1) / side
    chosen = _some(len(points), POINTS)
    return points[chosen], spread[chosen]


def _squares(values: Any, side: int) -> Any:
    """A picture (H, W, ...) cut into squares of pixels, (squares, side * side, ...); a rest at the edge is dropped."""
    high, wide = values.shape[0] // side, values.shape[1] // side
    cut = values[: high * side, : wide * side].reshape(high, side, wide, side, *values.shape[2:])
    return cut.swapaxes(1, 2).reshape(high * wide, side * side, *values.shape[2:])


def _some(count: int, most: int) -> Indices:
    """At most so many of `count` indices, drawn at random but always alike."""
    return np.random.default_rng(SEED).choice(count, min(most, count), replace=False)


def _inner(mask: Mask) -> Mask:
    """The mask without its outermost pixels."""
    kept = mask.copy()
    kept[1:] &= mask[:-1]
    kept[:-1] &= mask[1:]
    kept[:, 1:] &= mask[:, :-1]
    kept[:, :-1] &= mask[:, 1:]
    return kept


def _outline(view: View, mask: Mask, parts: Segments) -> tuple[Array, Array, float, bool]:
    """Lines of sight between a thing and what lies behind it, their uncertainty, the share hidden, and whether cut."""
    rows, columns = np.nonzero(mask)
    high, wide = view.shape
    cut = bool(rows.min(initial=high) == 0 or columns.min(initial=wide) == 0)
    cut |= bool(rows.max(initial=0) == high - 1 or columns.max(initial=0) == wide - 1)
    places, widths, depths = [np.zeros((0, 2))], [np.zeros(0)], [np.zeros(0)]
    outer = occluded = 0
    for dy, dx in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        y, x = rows, columns
        edge = ~_at(mask, y + dy, x + dx, True)
        y, x = y[edge], x[edge]
        z, jump = parts.depth[y, x], np.maximum(0.012, 4.0 * parts.noise[y, x])
        slope = SLOPE * z / view.focal
        outer += len(y)
        open_ = np.ones(len(y), dtype=bool)
        for k in range(1, GAP + 1):
            beyond = _at(parts.depth, y + k * dy, x + k * dx, np.nan)
            known = open_ & np.isfinite(beyond)
            clear = known & (beyond > z + jump + k * slope)
            occluded += int((known & (beyond < z - jump - k * slope)).sum())
            places.append(np.column_stack([x[clear] + 0.5 * k * dx, y[clear] + 0.5 * k * dy]))
            widths.append(np.full(int(clear.sum()), float(k)))
            depths.append(z[clear])
            open_ &= ~known & ~_at(mask, y + k * dy, x + k * dx, False)
    place, width, depth = np.concatenate(places), np.concatenate(widths), np.concatenate(depths)
    pixels = np.column_stack([place, np.ones(len(place))])
    rays = pixels @ np.linalg.inv(view.intrinsics).T @ view.pose[:3, :3].T
    rays = rays / np.linalg.norm(rays, axis=1)[:, None]
    noise = np.hypot(0.3, 0.3 * width) * depth / view.focal
    return rays, noise, occluded / max(outer, 1), cut


def _at(values: Any, rows: Indices, columns: Indices, outside: float | bool) -> Any:
    """Values at pixels, `outside` beyond the picture."""
    high, wide = values.shape
    inside = (rows >= 0) & (rows < high) & (columns >= 0) & (columns < wide)
    found = values[np.clip(rows, 0, high - 1), np.clip(columns, 0, wide - 1)]
    return np.where(inside, found, outside)
