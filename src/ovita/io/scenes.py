"""Scenes as plain dicts, in the layout of the public OVITA files."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ovita.errors import SceneError
from ovita.io.values import brief, listing, number, plain, show, text, vector
from ovita.paths.frame import RFU, Frame
from ovita.paths.scene import Scene, SceneObject

SCENE_KEYS = ("objects", "environment", "Env_descp", "constraints", "frame")
"""Keys of a scene file that describe the scene."""

PUBLIC_ENVIRONMENT = "Env_descp"
"""What the public OVITA files call the environment; a scene read under this name is written under it again."""

_ENVIRONMENT_KEY = "environment_key"
_OBJECT_KEYS = ("name", "x", "y", "z", "position", "dimensions", "orientation")
_LONGEST_NAME = 200
_XYZ = ("x", "y", "z")


def scene_from_dict(document: Mapping[str, Any]) -> Scene:
    """Build a scene from {objects, environment | Env_descp, constraints, frame}, each of which may be missing.

    An object is {name, x, y, z, dimensions?, orientation?} in metres, with orientation as a quaternion wxyz;
    `position` [x, y, z] is accepted for x, y, z, and dimensions may be {x, y, z} or {width, depth, height}.
    Constraints that are text become `constraints_text`, a structure stays in `extra["constraints"]`; other keys are
    kept in `extra`.

    Raises:
        SceneError: On a missing or malformed value; names the key and the index.
    """
    extra = {key: value for key, value in document.items() if key not in SCENE_KEYS}
    environment = _environment(document, extra)
    constraints = document.get("constraints")
    if isinstance(constraints, (Mapping, list, tuple)):
        extra["constraints"] = constraints
        constraints = None
    items = document.get("objects")
    if not isinstance(items, (list, tuple, type(None))):
        raise SceneError(f"is {show(items)}, expected a list of objects with name, x, y, z", key="objects")
    return Scene(
        objects=tuple(_object(item, i) for i, item in enumerate(items or ())),
        frame=_frame(document.get("frame")),
        environment=environment,
        constraints_text=_text(constraints, "constraints"),
        extra=extra,
    )


def scene_dict(scene: Scene) -> dict[str, Any]:
    """The scene as {objects, constraints, ...}: plain lists and dicts that `scene_from_dict` turns back exactly.

    `environment` and `frame` are written only when they say something. If a scene holds both a constraint text and
    a structure in `extra["constraints"]`, the structure is written.
    """
    document: dict[str, Any] = {"objects": [_object_dict(item) for item in scene]}
    key = scene.extra.get(_ENVIRONMENT_KEY)
    if key == PUBLIC_ENVIRONMENT:
        document[PUBLIC_ENVIRONMENT] = scene.environment or None
    elif scene.environment:
        document["environment"] = scene.environment
    document["constraints"] = plain(scene.extra.get("constraints", scene.constraints_text))
    if scene.frame != RFU:
        document["frame"] = scene.frame.name
    others = {k: plain(v) for k, v in scene.extra.items() if k not in (*SCENE_KEYS, _ENVIRONMENT_KEY)}
    return document | others


def _environment(document: Mapping[str, Any], extra: dict[str, Any]) -> str:
    values = {key: _text(document[key], key) for key in ("environment", PUBLIC_ENVIRONMENT) if key in document}
    said = {value for value in values.values() if value}
    if len(said) > 1:
        raise SceneError("differs from environment; keep one of the two", key=PUBLIC_ENVIRONMENT)
    if PUBLIC_ENVIRONMENT in values and not values.get("environment"):
        extra[_ENVIRONMENT_KEY] = PUBLIC_ENVIRONMENT
    return said.pop() if said else ""


def _text(value: object, key: str) -> str:
    try:
        return text(value, "it")
    except ValueError:
        raise SceneError(f"is {show(value)}, expected text", key=key) from None


def _frame(value: object) -> Frame:
    if value is None:
        return RFU
    name = _text(value, "frame")
    try:
        return Frame(name.lower() if len(name) < 30 else brief(name))
    except SceneError as error:
        raise SceneError(f"is an {error.problem}", key="frame") from None


def _object(item: object, index: int) -> SceneObject:
    try:
        if not isinstance(item, Mapping):
            raise ValueError(f"is {show(item)}, expected an object with name, x, y, z")
        name = item.get("name")
        if not isinstance(name, str) or not name.strip():
            has = f"its keys are {listing(map(str, item))}" if "name" not in item else f"its name is {show(name)}"
            raise ValueError(f"has no name ({has}); give every object a name")
        if len(name) > _LONGEST_NAME:
            raise ValueError(f"has a name of {len(name)} characters; shorten it to {_LONGEST_NAME}")
        size, turn = item.get("dimensions"), item.get("orientation")
        return SceneObject(
            name=name,
            position=np.array(_position(item)),
            dimensions=None if size is None else np.array(_size(size)),
            orientation=np.array([1.0, 0.0, 0.0, 0.0] if turn is None else _quaternion(turn)),
            extra={key: value for key, value in item.items() if key not in _OBJECT_KEYS},
        )
    except ValueError as error:
        raise SceneError(str(error), key="objects", index=index) from None
    except SceneError as error:
        raise SceneError(error.problem, key="objects", index=index) from None


def _position(item: Mapping[str, Any]) -> list[float]:
    present = [key for key in _XYZ if key in item]
    place = vector(item["position"], "position", _XYZ) if "position" in item else None
    if place is not None and not present:
        return place
    if len(present) < 3:
        missing = ", ".join(key for key in _XYZ if key not in item)
        raise ValueError(f"({show(item['name'])}) has no {missing}; give x, y and z in metres")
    xyz = [number(item[key], key) for key in _XYZ]
    if place is not None and place != xyz:
        raise ValueError(f"({show(item['name'])}) has a position that differs from its x, y, z; keep one of the two")
    return xyz


def _size(value: object) -> list[float]:
    size = vector(value, "dimensions", _XYZ, ("width", "depth", "height"))
    if min(size) < 0:
        raise ValueError(f"dimensions {size} are negative; give full edge lengths >= 0 m")
    return size


def _quaternion(value: object) -> list[float]:
    return vector(value, "orientation", ("w", "x", "y", "z"), ("qw", "qx", "qy", "qz"))


def _object_dict(item: SceneObject) -> dict[str, Any]:
    x, y, z = item.position.tolist()
    document: dict[str, Any] = {"name": item.name, "x": x, "y": y, "z": z}
    if item.dimensions is not None:
        document["dimensions"] = item.dimensions.tolist()
    if item.orientation.tolist() != [1.0, 0.0, 0.0, 0.0]:
        document["orientation"] = item.orientation.tolist()
    return document | {key: plain(value) for key, value in item.extra.items() if key not in _OBJECT_KEYS}
