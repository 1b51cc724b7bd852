"""Supports: the table or floor that things stand on, as an object of the scene, and the scene in one sentence."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import ConvexHull

from ovita.limits.problem import SUPPORT, is_support, top_of
from ovita.paths.scene import Scene, SceneObject, quaternion
from ovita.paths.trajectory import Array
from ovita.perceive.segment import Footing, Plane, sides_of
from ovita.text import listed

THICKNESS = {"table": 0.03, "floor": 0.1}
"""What is assumed of a support by its name, since nobody sees it [m]."""

HIGH = 0.3
"""A support that is higher than this above zero is a table [m]."""

WIDE = 1.8
"""Of the others, one that was seen to be longer than this is a floor [m]."""

LEVEL = np.cos(np.radians(0.6))
"""Cosine of the angle up to which a support is taken to be level."""


def support_object(plane: Plane, up: Array, footings: Sequence[Footing]) -> SceneObject | None:
    """The support as a box: the rectangle around what was seen of it, its own z axis up, its thickness assumed.

    `plane` is its upper side, `up` a unit vector (3,) in the world, `footings` what each view saw of it.

    Returns:
        An object of the kind "support", named "table" or "floor"; None where no view saw it.
    """
    if not footings:
        return None
    rim = np.concatenate([one.rim for one in footings])
    middle, size, turn = _rectangle(rim, plane.normal)
    if plane.normal @ up > LEVEL:
        turn = _axes(turn[:, 0], up)
        middle = middle + (plane.offset - middle @ plane.normal) / (plane.normal @ up) * up
    else:
        middle = middle + (plane.offset - middle @ plane.normal) * plane.normal
    name = name_of(float(middle @ up), float(size.max()))
    thick = THICKNESS[name]
    extra: dict[str, object] = {"kind": SUPPORT, "shape": "box", "seen_by": len(footings)}
    extra |= {"points": sum(one.pixels for one in footings), "assumed": "thickness"}
    if any(one.cut for one in footings):
        extra["cut"] = True
    center = np.round(middle - 0.5 * thick * turn[:, 2], 4) + 0.0
    return SceneObject(name, center, np.round([*size, thick], 4), quaternion(turn), extra)


def name_of(height: float, length: float) -> str:
    """Whether a support at a height [m] that was seen to be so long [m] is a "table" or a "floor"."""
    return "floor" if height < HIGH and length > WIDE else "table"


def _rectangle(points: Array, normal: Array) -> tuple[Array, Array, Array]:
    """The smallest rectangle around points (N, 3) along a plane: middle (3,), size (2,), axes (3, 3) as columns."""
    sides = sides_of(normal)
    flat = points @ sides.T
    corners = flat[ConvexHull(flat).vertices]
    edges = np.roll(corners, -1, axis=0) - corners
    edges = edges / np.maximum(np.linalg.norm(edges, axis=1), 1e-12)[:, None]
    frames = np.stack([edges, edges[:, ::-1] * (-1.0, 1.0)], axis=1)  # (E, 2, 2), rows are axes
    spread = np.einsum("eij,nj->eni", frames, corners)
    low, high = spread.min(axis=1), spread.max(axis=1)
    best = int(np.prod(high - low, axis=1).argmin())
    axis, size = frames[best], (high - low)[best]
    middle = 0.5 * (high + low)[best] @ axis
    along, across = axis @ sides
    turn = _upright(along, normal)
    swapped = abs(turn[:, 0] @ across) > abs(turn[:, 0] @ along)
    return middle @ sides, size[::-1] if swapped else size, turn


def _upright(along: Array, up: Array) -> Array:
    """As `_axes`, x the one of the four level directions at right angles nearest to +x."""
    turn = _axes(along, up)
    first, other = turn[:, 0], turn[:, 1]
    return _axes(max((first, -first, other, -other), key=lambda one: float(one[0])), up)


def _axes(along: Array, up: Array) -> Array:
    """Axes (3, 3) as columns: z is `up`, x the level direction nearest to `along` (3,)."""
    first = along - (along @ up) * up
    first = first / np.linalg.norm(first)
    return np.column_stack([first, np.cross(up, first), up])


def description(scene: Scene) -> str:
    """One sentence on what a scene holds, from its objects alone; "" for none."""
    things = [item.name for item in scene if not is_support(item)]
    supports = [item for item in scene if is_support(item)]
    if not things:
        return ""
    there = f"Seen by a camera: {listed(things)}"
    if not supports:
        return f"{there}."
    height = float(top_of(supports[0]) @ scene.frame.direction("up"))
    return f"{there}, on the {supports[0].name}, whose upper side is at height {height:.3f} m."


def with_objects(scene: Scene, objects: Sequence[SceneObject]) -> Scene:
    """The scene with other objects; a description that ovita made of the ones before is made anew."""
    new = replace(scene, objects=tuple(objects))
    return replace(new, environment=description(new)) if scene.environment == description(scene) else new
