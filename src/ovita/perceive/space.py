"""Things in a point cloud: the support, the clusters above it in space, and the shape that explains each best."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ovita.io.clouds import PointCloud
from ovita.paths.trajectory import Array
from ovita.perceive.evidence import POINTS, Evidence
from ovita.perceive.segment import SEED, Footing, Plane, connected, support_of

CELL = 0.012
"""Points in touching cells of this edge belong together, so that things need a gap of one to two cells [m]."""

NOISE = 0.002
"""Standard deviation that points are taken to have [m]: a cloud does not say how it was measured."""

LOWEST = 0.008
"""Least height over the support of what counts as standing on it [m]."""

LARGEST = 1.5
"""What is longer than this over the support is a wall or another piece of furniture, and no thing on it [m]."""

COLOURS = 400
"""Most pixels whose colours are looked at."""

MOST = 400_000
"""Of more points a random part of so many is looked at."""


@dataclass(frozen=True, eq=False)
class SpaceCluster:
    """One thing in a cloud: a part of its points as evidence, and colours (N, 3), none without colours."""

    evidence: Evidence
    colours: Array


@dataclass(frozen=True, eq=False)
class SpaceSegments:
    """A cloud taken apart into the support and the clusters above it; `large` were left out for their size."""

    clusters: tuple[SpaceCluster, ...]
    support: Plane | None
    footing: Footing | None = None
    large: int = 0


def taken_apart(
    clouds: Sequence[PointCloud], up: Array, fewest: int, plane: Plane | None = None, *, find_plane: bool = True
) -> SpaceSegments:
    """Take clouds of one scene apart.

    `up` is a unit vector (3,), `fewest` are the points that a cluster has at least; a support is looked for as in
    `segment`.
    """
    points = np.concatenate([cloud.points for cloud in clouds])
    known = [cloud.colours for cloud in clouds if cloud.colours is not None]
    colours = np.concatenate(known) if len(known) == len(clouds) else np.zeros((len(points), 0), dtype=np.uint8)
    if len(points) > MOST:
        some = np.random.default_rng(SEED).choice(len(points), MOST, replace=False)
        points, colours = points[some], colours[some]
    if plane is None and find_plane:
        plane = support_of(points, np.full(len(points), NOISE), up)
    heights = np.full(len(points), np.inf) if plane is None else plane.heights(points)
    on = points[np.abs(heights) < LOWEST]
    footing = None if plane is None else Footing.of(on, plane, len(on))
    clusters, large = _clusters(points, colours, np.flatnonzero(heights > LOWEST), fewest)
    return SpaceSegments(clusters, plane, footing, large)


def _clusters(
    points: Array, colours: NDArray[np.uint8], place: NDArray[np.intp], fewest: int
) -> tuple[tuple[SpaceCluster, ...], int]:
    """The clusters of the points at some places, largest first, and how many were left out for their size."""
    owner = joined_cells(points[place])
    sizes = np.bincount(owner)
    order = [number for number in np.argsort(-sizes, kind="stable") if sizes[number] >= fewest]
    found = [place[owner == number] for number in order]
    small = [mine for mine in found if np.ptp(points[mine], axis=0).max() <= LARGEST]
    hues = [np.asarray(colours[mine][:: max(1, len(mine) // COLOURS)], dtype=float) for mine in small]
    parts = zip(small, hues, strict=True)
    return tuple(SpaceCluster(_evidence(points[mine]), hue.reshape(-1, 3)) for mine, hue in parts), len(found) - len(
        small
    )


def _evidence(points: Array) -> Evidence:
    """Points (N, 3) [m] on a surface as evidence; a cloud has no lines of sight that touch the outline."""
    some = np.random.default_rng(SEED).choice(len(points), min(2 * POINTS, len(points)), replace=False)
    none = np.zeros((0, 3))
    return Evidence(points[some], np.full(len(some), NOISE), none, none, np.zeros(0), len(points))


def joined_cells(points: Array) -> NDArray[np.intp]:
    """Number of the cluster of each point (N, 3), (N,): points whose cells touch, corners included, are together."""
    if not len(points):
        return np.zeros(0, dtype=np.intp)
    places = np.floor((points - points.min(axis=0)) / CELL).astype(np.int64)
    cells, owner = np.unique(places, axis=0, return_inverse=True)
    span = cells.max(axis=0) + 3
    keys = ((cells[:, 0] + 1) * span[1] + cells[:, 1] + 1) * span[2] + cells[:, 2] + 1
    ends = [np.zeros((2, 0), dtype=np.intp)]
    for dx, dy, dz in _AHEAD:
        wanted = keys + (dx * span[1] + dy) * span[2] + dz
        at = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
        there = np.flatnonzero(keys[at] == wanted)
        ends.append(np.stack([there, at[there]]))
    return connected(len(cells), *np.concatenate(ends, axis=1))[owner.ravel()]


_AHEAD = [(dx, dy, dz) for dx in (0, 1) for dy in (-1, 0, 1) for dz in (-1, 0, 1) if (dx, dy, dz) > (0, 0, 0)]
