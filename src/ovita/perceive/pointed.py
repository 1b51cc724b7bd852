"""Objects in a picture: drawn over it, and what lies in a rectangle that a person drew, fitted anew."""

from __future__ import annotations

import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from ovita.errors import needs
from ovita.paths.scene import Frame, SceneObject
from ovita.paths.trajectory import Array
from ovita.perceive.assemble import perceive
from ovita.perceive.detect import Found, counted_in
from ovita.perceive.segment import Labels, segment
from ovita.perceive.view import Mask, Picture, View

Rectangle = tuple[float, float, float, float]
"""x0, y0, x1, y1 [pixels], x to the right and y down."""

WHOLE = 0.8
"""Share of a cluster's pixels in a rectangle from which all of it is meant."""

ROOM = 4.0
"""Pixels by which an object's rectangle in another view is widened."""


def rectangle_of(view: View, item: SceneObject) -> Rectangle | None:
    """The rectangle around an object's cuboid in a picture, cut at its border; None where the picture shows nothing."""
    ends = outlines(view, item).reshape(-1, 2)
    if not np.isfinite(ends).all():
        return None
    high, wide = view.shape
    x0, y0 = np.clip(ends.min(axis=0), 0, (wide, high))
    x1, y1 = np.clip(ends.max(axis=0), 0, (wide, high))
    return (float(x0), float(y0), float(x1), float(y1)) if x1 - x0 > 1 and y1 - y0 > 1 else None


def pixels_in(box: Rectangle, labels: Labels) -> Mask:
    """The pixels that a person means by a rectangle (H, W).

    All clusters that lie in it but for a rest; where none does, what it cuts out of the one that it shows most of, so
    that things that touch can be parted.
    """
    inside, total, held = counted_in(box, labels)
    total[0] = held[0] = 0
    whole = held > WHOLE * np.maximum(total, 1)
    if whole.any():
        return np.asarray(whole[labels])
    return np.asarray(inside & (labels == held.argmax()) & (labels > 0))


@dataclass(eq=False)
class _Pointer:
    """A detector of the one thing in a rectangle, by the name of the view."""

    boxes: Sequence[tuple[View, Rectangle]]
    frame: Frame
    name: str = "pointed"

    def find(self, view: View, names: Sequence[str], text: str) -> tuple[Found, ...]:
        """What is in the view's rectangle, if it has one."""
        labels = segment(view, self.frame.direction("up")).labels
        return tuple(Found("", pixels_in(box, labels)) for of, box in self.boxes if of is view)


def look_in(views: Sequence[View], box: Rectangle, frame: Frame) -> SceneObject | None:
    """The thing in a rectangle of the first view, with what the other views see of it; None where there is none."""
    found = perceive(views[:1], detector=_Pointer([(views[0], box)], frame), frame=frame).things
    if not found or len(views) == 1:
        return found[0] if found else None
    boxes = [(views[0], box)]
    for view in views[1:]:
        there = rectangle_of(view, found[0])
        if there is not None:
            x0, y0, x1, y1 = there
            boxes.append((view, (x0 - ROOM, y0 - ROOM, x1 + ROOM, y1 + ROOM)))
    together = perceive(views, detector=_Pointer(boxes, frame), frame=frame).things
    return max(together, key=lambda item: item.extra["seen_by"], default=found[0])


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
    with needs("pillow", "perceive"):
        from PIL import Image, ImageDraw
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
