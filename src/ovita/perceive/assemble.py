"""From views to a scene: take each view apart, fit a shape to each thing, and merge what several views saw."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ovita.errors import SceneError
from ovita.paths.frame import Frame, quaternion
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Array
from ovita.perceive.detect import Detector, Found, Sighting, mask_of, sighting
from ovita.perceive.fit import Solid, upright_box
from ovita.perceive.segment import Plane, Segments, segment
from ovita.perceive.view import View

FEWEST = 60
"""Pixels that a thing needs at least."""


@dataclass(frozen=True, eq=False)
class Perceived:
    """What was seen.

    Args:
        scene: The objects; `extra` of each says its shape and colour, on how many depth pixels (`points`) and views
            (`seen_by`) it rests, and how far the pixels are from its surface (`spread_mm`, the median).
        support: The plane that things rest on, or None.
        notes: What a person should know, each a sentence.
        refused: What was found but not taken, each a sentence with the reason.
    """

    scene: Scene
    support: Plane | None = None
    notes: tuple[str, ...] = ()
    refused: tuple[str, ...] = ()

    @property
    def environment(self) -> str:
        """The description of the scene."""
        return self.scene.environment


def perceive(
    views: Sequence[View],
    *,
    names: Sequence[str] = (),
    text: str = "",
    detector: Detector | None = None,
    frame: Frame | str = "flu",
    plane: str = "auto",
) -> Perceived:
    """Make a scene of what cameras saw.

    Args:
        views: At least one; their poses are in the world of the scene.
        names: What the person calls the things, such as "red cup" or "cup=red".
        text: What the person says about the scene.
        detector: Finds and names things; None takes each cluster of depth above the support for a thing.
        frame: Of the world: which way is up.
        plane: "auto" looks for a level support; "none" fits boxes in space.

    Raises:
        SceneError: Without views, or with an unknown plane.
    """
    if not views:
        raise SceneError("there is no view to look at", key="views")
    if plane not in ("auto", "none"):
        raise SceneError(f"is {plane!r}, expected auto or none", key="plane")
    axes = Frame(frame) if isinstance(frame, str) else frame
    view = views[0]
    parts = segment(view, axes.direction("up"), find_plane=plane == "auto")
    seen = sighting(detector, view, names, text) if detector else Sighting(clusters(parts))
    objects, refused = [], []
    for i, item in enumerate(seen.found, start=1):
        mask = mask_of(item, parts.labels)
        if mask.sum() < FEWEST:
            refused.append(f"{item.label or 'a thing'}: {mask.sum()} pixels with depth, at least {FEWEST} are needed")
            continue
        cloud = view.points[mask & view.seen]
        solid = _solid(cloud, parts.support, axes.direction("up"))
        name = item.label or f"thing {i}"
        extra = {"seen_by": 1, "points": len(cloud), "shape": solid.kind}
        objects.append(SceneObject(name, solid.center, solid.size, quaternion(solid.rotation), extra))
    return Perceived(Scene(tuple(objects), axes, seen.environment or text), parts.support, seen.notes, tuple(refused))


def clusters(parts: Segments) -> tuple[Found, ...]:
    """Each cluster of depth as a nameless finding."""
    sizes = np.bincount(parts.labels.ravel(), minlength=parts.count + 1)
    return tuple(Found("", parts.labels == i) for i in range(1, parts.count + 1) if sizes[i] >= FEWEST)


def _solid(cloud: Array, support: Plane | None, up: Array) -> Solid:
    normal = up if support is None else support.normal
    side = np.eye(3)[int(np.abs(normal).argmin())]
    first = np.cross(side, normal)
    first = first / np.linalg.norm(first)
    axes = np.array([first, np.cross(normal, first), normal])
    floor = float((cloud @ normal).min()) if support is None else support.offset
    return upright_box(cloud, axes, floor)
