"""Evidence: what the pixels of one thing say about its surface and its outline, ready for a fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
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

    @cached_property
    def point_weights(self) -> Array:
        """One over the standard deviation of each point (N,) [1/m]."""
        return np.asarray(1.0 / np.hypot(self.point_noise, 5e-4))

    @cached_property
    def ray_weights(self) -> Array:
        """One over how far each line may be off (E,) [1/m]."""
        return np.asarray(1.0 / self.ray_noise)

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
    patch = _Patch.around(view, mask, parts)
    points, point_noise = _surface(patch)
    rays, ray_noise, hidden = _outline(patch)
    few = _some(len(rays), EDGES)
    return Evidence(
        points,
        point_noise,
        np.broadcast_to(view.center, (len(few), 3)),
        rays[few],
        ray_noise[few],
        int(patch.mask.sum()),
        cut=patch.cut,
        hidden=hidden,
    )


@dataclass(frozen=True, eq=False)
class _Patch:
    """A part of a picture: one thing, and `GAP` pixels around it.

    Args:
        mask: The thing's pixels, (h, w) like all that follow; none at the patch's own border.
        depth: Smoothed depth [m], nan beyond the picture.
        noise: Of the depth [m].
        inside: Which pixels lie where the picture has depth at all.
        corner: Row and column of its first pixel in the picture.
    """

    view: View
    mask: Mask
    depth: Array
    noise: Array
    inside: Mask
    corner: tuple[int, int]

    @classmethod
    def around(cls, view: View, mask: Mask, parts: Segments) -> _Patch:
        """Around the pixels of a mask (H, W) that have depth."""
        rows, columns = (np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0))
        spans = [(int(at[0]) - GAP, int(at[-1]) + 1 + GAP) if len(at) else (0, 0) for at in (rows, columns)]
        place = tuple(slice(max(low, 0), high) for low, high in spans)
        depth = parts.depth[place]
        lack = [(max(-low, 0), max(high - size, 0)) for (low, high), size in zip(spans, view.shape, strict=True)]
        solid = np.pad(mask[place] & view.seen[place] & np.isfinite(depth), lack)
        beyond = np.pad(depth, lack, constant_values=np.nan)
        noise, inside = np.pad(parts.noise[place], lack), np.pad(view.frame[place], lack)
        return cls(view, solid, beyond, noise, inside, (spans[0][0], spans[1][0]))

    @property
    def cut(self) -> bool:
        """Whether the border of the picture, or of the part of it that has depth, cuts the thing."""
        return bool((_grown(self.mask) & ~self.inside).any())


def _surface(patch: _Patch) -> tuple[Array, Array]:
    """Points of a surface (N, 3) and their noise (N,) [m]: where there are many pixels, means over small squares."""
    mask = patch.mask
    inner = ~_grown(~mask) if mask.sum() > 4 * POINTS else mask
    side = int(np.clip(np.sqrt(inner.sum() / (3 * POINTS)), 1, WIDEST))
    full = np.flatnonzero(_squares(inner, side).all(axis=1))
    chosen = full[_some(len(full), POINTS)]
    rows, columns = (_squares(at + np.zeros(mask.shape, dtype=int), side)[chosen] for at in np.indices(mask.shape))
    rows, columns = rows + patch.corner[0], columns + patch.corner[1]
    cloud = patch.view.located(rows, columns, patch.view.depth[rows, columns])
    return cloud.mean(axis=1), _squares(patch.noise, side)[chosen].mean(axis=1) / side


def _squares(values: Any, side: int) -> Any:
    """A picture (H, W, ...) cut into squares of pixels, (squares, side * side, ...); a rest at the edge is dropped."""
    high, wide = values.shape[0] // side, values.shape[1] // side
    cut = values[: high * side, : wide * side].reshape(high, side, wide, side, *values.shape[2:])
    return cut.swapaxes(1, 2).reshape(high * wide, side * side, *values.shape[2:])


def _some(count: int, most: int) -> Indices:
    """At most so many of `count` indices, drawn at random but always alike."""
    return np.random.default_rng(SEED).choice(count, min(most, count), replace=False)


def _grown(mask: Mask) -> Mask:
    more = mask.copy()
    more[1:] |= mask[:-1]
    more[:-1] |= mask[1:]
    more[:, 1:] |= mask[:, :-1]
    more[:, :-1] |= mask[:, 1:]
    return more


def _outline(patch: _Patch) -> tuple[Array, Array, float]:
    """Lines of sight between a thing and what lies behind it, their uncertainty, and the share of it that is hidden."""
    rows, columns = np.nonzero(patch.mask & _grown(~patch.mask))
    places, widths, depths = [np.zeros((0, 2))], [np.zeros(0)], [np.zeros(0)]
    outer = occluded = 0
    for dy, dx in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        edge = patch.inside[rows + dy, columns + dx] & ~patch.mask[rows + dy, columns + dx]
        y, x = rows[edge], columns[edge]
        z, jump = patch.depth[y, x], np.maximum(0.012, 4.0 * patch.noise[y, x])
        slope = SLOPE * z / patch.view.focal
        outer += len(y)
        open_ = np.ones(len(y), dtype=bool)
        for k in range(1, GAP + 1):
            beyond = patch.depth[y + k * dy, x + k * dx]
            clear = open_ & (beyond > z + jump + k * slope)
            occluded += int((open_ & (beyond < z - jump - k * slope)).sum())
            places.append(np.column_stack([x[clear] + 0.5 * k * dx, y[clear] + 0.5 * k * dy]))
            widths.append(np.full(int(clear.sum()), float(k)))
            depths.append(z[clear])
            open_ &= np.isnan(beyond) & ~patch.mask[y + k * dy, x + k * dx]
    place, width, depth = np.concatenate(places), np.concatenate(widths), np.concatenate(depths)
    rays = patch.view.located(place[:, 1] + patch.corner[0], place[:, 0] + patch.corner[1], np.ones(len(place)))
    rays = rays - patch.view.center
    rays = rays / np.linalg.norm(rays, axis=1)[:, None]
    noise = np.hypot(0.3, 0.3 * width) * depth / patch.view.focal
    return rays, noise, occluded / max(outer, 1)
