"""The picture with what was found in it: the edges of each object's cuboid, and its name."""

from __future__ import annotations

import io
from collections.abc import Iterable
from itertools import product

import numpy as np

from ovita.errors import MissingExtra
from ovita.paths.scene import SceneObject
from ovita.paths.trajectory import Array
from ovita.perceive.view import Picture, View

CORNERS = np.array(list(product((-0.5, 0.5), repeat=3)))
EDGES = tuple((a, b) for a in range(8) for b in range(a) if bin(a ^ b).count("1") == 1)
INKS = ((228, 60, 60), (50, 120, 230), (40, 160, 80), (235, 150, 20), (150, 80, 200), (20, 170, 170))


def outlines(view: View, item: SceneObject) -> Array:
    """Ends of the edges of an object's cuboid in a picture (12, 2, 2) as column and row [pixels]; nan behind it."""
    corners = view.project(item.position + (CORNERS * item.size) @ item.rotation.T)
    return np.asarray(corners[np.array(EDGES)])


def overlay(view: View, objects: Iterable[SceneObject]) -> bytes:
    """A PNG of the picture, or of the depth where it has no colours, with the objects drawn over it.

    Raises:
        MissingExtra: Without pillow.
    """
    try:
        from PIL import Image, ImageDraw
    except ImportError:
        raise MissingExtra("pillow", "perceive") from None
    image = Image.fromarray(backdrop(view))
    pen = ImageDraw.Draw(image)
    for number, item in enumerate(objects):
        ink, lines = INKS[number % len(INKS)], outlines(view, item)
        if not np.isfinite(lines).all():
            continue
        for start, end in lines:
            pen.line([*map(float, start), *map(float, end)], fill=ink, width=2)
        column, row = lines.reshape(-1, 2).min(axis=0)
        place = (float(np.clip(column, 0, view.shape[1] - 30)), float(np.clip(row - 14, 0, view.shape[0] - 12)))
        pen.rectangle(pen.textbbox(place, item.name), fill=(255, 255, 255))
        pen.text(place, item.name, fill=ink)
    stream = io.BytesIO()
    image.save(stream, "PNG")
    return stream.getvalue()


def backdrop(view: View) -> Picture:
    """The colours, or the depth in grey, near things bright."""
    if view.rgb is not None:
        return np.array(view.rgb)
    near, far = np.nanpercentile(view.depth, [1, 99])
    share = np.clip((far - view.depth) / max(far - near, 1e-6), 0.0, 1.0)
    grey = np.where(view.seen, 50.0 + 190.0 * share, 0.0).astype(np.uint8)
    return np.repeat(grey[..., None], 3, axis=2)
