"""What a person wants left out of a look: things by name, rectangles of a picture, boxes in the world."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ovita.errors import RequestError, SceneError
from ovita.io.clouds import PointCloud
from ovita.paths.trajectory import Array
from ovita.perceive.assemble import Perceived
from ovita.perceive.segment import with_objects
from ovita.perceive.view import Mask, View
from ovita.text import listed


@dataclass(frozen=True)
class CutRegion:
    """A rectangle of the first picture, or a box in the world.

    Args:
        low: First corner: column and row [pixels], or x, y, z [m].
        high: The opposite one.
    """

    low: tuple[float, ...]
    high: tuple[float, ...]

    @property
    def flat(self) -> bool:
        """Whether it is a rectangle of a picture."""
        return len(self.low) == 2

    def holds(self, points: Array) -> Mask:
        """Which points (..., D) lie in it."""
        return np.asarray(((points >= self.low) & (points <= self.high)).all(axis=-1))

    def in_view(self, view: View) -> Mask:
        """Which pixels of a view lie in it, (H, W)."""
        if self.flat:
            rows, columns = np.indices(view.shape)
            return self.holds(np.stack([columns, rows], axis=-1))
        return self.holds(view.points)


def region_from(text: str, option: str, *, flat: bool = False) -> CutRegion | None:
    """Read "x0,y0,x1,y1" [pixels] or "x0,y0,z0,x1,y1,z1" [m]; None where the text is no list of numbers.

    Errors name the `option`; with `flat`, only a rectangle of the picture will do.

    Raises:
        RequestError: If there are too few or too many numbers, or the corners enclose nothing.
    """
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        return None
    if len(values) not in ((4,) if flat else (4, 6)):
        more = "" if flat else ", or six numbers x0,y0,z0,x1,y1,z1 in metres"
        raise RequestError(f"{option} {text}: give four numbers, x0,y0,x1,y1 in pixels{more}")
    half = len(values) // 2
    low, high = values[:half], values[half:]
    if not all(a < b for a, b in zip(low, high, strict=True)):
        raise RequestError(f"{option} {text}: the second corner must be beyond the first in each direction")
    return CutRegion(low, high)


def cropped(views: Sequence[View], crop: CutRegion | None, gone: Sequence[CutRegion]) -> tuple[View, ...]:
    """The views without what lies in some regions or outside of one; rectangles are of the first picture.

    Raises:
        SceneError: If nothing is left of a view.
    """
    return tuple(
        _kept(view, crop if i == 0 else None, [one for one in gone if i == 0 or not one.flat])
        for i, view in enumerate(views)
    )


def _kept(view: View, crop: CutRegion | None, gone: Sequence[CutRegion]) -> View:
    left_out = np.zeros(view.shape, dtype=bool) if crop is None else ~crop.in_view(view)
    for one in gone:
        left_out |= one.in_view(view)
    if not (view.seen & ~left_out).any():
        raise SceneError(f"nothing of {view.name} is left by --crop and --without", key="views")
    return replace(view, depth=np.where(left_out, np.nan, view.depth)) if left_out.any() else view


def thinned(clouds: Sequence[PointCloud], gone: Sequence[CutRegion]) -> tuple[PointCloud, ...]:
    """Point clouds without what lies in some boxes.

    Raises:
        RequestError: If a region is a rectangle of a picture.
    """
    if any(one.flat for one in gone):
        raise RequestError("a point cloud has no pixels; give --without six numbers x0,y0,z0,x1,y1,z1 in metres")
    kept = []
    for cloud in clouds:
        stays = ~np.any([one.holds(cloud.points) for one in gone], axis=0) if gone else slice(None)
        colours = None if cloud.colours is None else cloud.colours[stays]
        kept.append(replace(cloud, points=cloud.points[stays], colours=colours))
    return tuple(kept)


def without(seen: Perceived, names: Sequence[str]) -> Perceived:
    """What was perceived without things of some names; a name that no thing bears is said."""
    items = {name: seen.scene.find(name) for name in names}
    dropped = {item.name for item in items.values() if item is not None}
    there = listed(seen.scene.names) or "nothing"
    missing = [f"{name}: nothing of this name to leave out; there is {there}" for name, one in items.items() if not one]
    left = [item for item in seen.scene if item.name not in dropped]
    return replace(seen, scene=with_objects(seen.scene, left), missing=(*seen.missing, *missing))
