"""Documents: what JSON and TOML files hold, checked by pydantic and refused in one sentence.

`validated` reads a parsed document as any type that pydantic knows, dataclasses included, by the strict rules of JSON:
a number is no text and no boolean. What is wrong comes out as a `FormatError` with the file, the key and the index.
"""

from __future__ import annotations

import json
import os
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from difflib import get_close_matches
from functools import cache, cached_property
from itertools import chain
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, overload

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    Field,
    PlainValidator,
    TypeAdapter,
    ValidationError,
    model_validator,
)
from pydantic_core import ErrorDetails, PydanticCustomError, to_json

from ovita.errors import FormatError, OvitaError, RobotError, SceneError, TrajectoryError
from ovita.io.files import errors_of, examine, file_name, read_text, suffix
from ovita.io.geodesy import Home
from ovita.paths.geometry import Mask
from ovita.paths.robot import Box, Robot, Shell
from ovita.paths.scene import RFU, Frame, Scene, SceneObject
from ovita.paths.trajectory import Array, Trajectory
from ovita.text import called_as

T = TypeVar("T")

LARGEST = 1e9
"""Largest magnitude that a number of a trajectory or scene may have [m, m/s, s]."""

SCENE_KEYS = ("objects", "environment", "Env_descp", "constraints", "frame")
"""Keys of a scene document that describe the scene."""

PUBLIC_ENVIRONMENT = "Env_descp"
"""What the public OVITA files call the environment; a scene read under this name is written under it again."""

_ENVIRONMENT_KEY = "environment_key"
_OBJECT_KEYS = ("name", "x", "y", "z", "position", "dimensions", "orientation")
_XYZ = ("x", "y", "z")


@overload
def validated(kind: type[T], value: object, file: str, key: str = "") -> T: ...
@overload
def validated(kind: object, value: object, file: str, key: str = "") -> Any: ...
def validated(kind: object, value: object, file: str, key: str = "") -> Any:
    """Read a parsed value as a type, by the strict rules of JSON.

    The kind is any type that pydantic can validate, such as a model, a dataclass or `tuple[str, ...]`; the value holds
    lists, dicts and scalars, and stands in the file under the key, "" being the top.
    """
    try:
        return _adapter(kind).validate_json(json.dumps(value, default=str), strict=True)
    except ValidationError as error:
        raise _located(error.errors()[0], value, file, key) from None
    except OvitaError as error:
        problem = getattr(error, "problem", str(error))
        raise FormatError(file, problem, key=key or getattr(error, "key", None)) from None
    except (ValueError, RecursionError):
        raise FormatError(file, "holds what JSON cannot", key=key or None) from None


def plain(value: Any) -> Any:
    """A copy of a value in lists, dicts and scalars that JSON knows: tuples, arrays and dataclasses are taken apart."""
    if isinstance(value, str | bool | Table | None):
        return value
    if isinstance(value, int | float):
        return float(value) if isinstance(value, float) else int(value)
    if isinstance(value, Mapping):
        return {_text(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [row[:] for row in value] if is_table(value) else list(map(plain, value))
    if is_dataclass(value) and not isinstance(value, type):
        return {item.name: plain(getattr(value, item.name)) for item in fields(value)}
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    raise TypeError(f"a {type(value).__name__} cannot be written to JSON")


def _text(key: object) -> str:
    if not isinstance(key, str):
        raise TypeError(f"the key {show(key)} is not text")
    return str(key)


@dataclass(frozen=True, eq=False)
class Table:
    """Rows of finite numbers (N, D), such as a trajectory's, on their way into a file: written once, and fast."""

    rows: NDArray[np.float64]

    @cached_property
    def text(self) -> str:
        """As JSON, to the letter what Python's own encoder writes."""
        parts = (_rows_text(self.rows[i : i + _AT_ONCE]) for i in range(0, len(self.rows), _AT_ONCE))
        return f"[{', '.join(parts)}]"


_AT_ONCE = 4096
"""Rows that are lists at a time; a million of them would keep the garbage collector busy."""


def _rows_text(rows: NDArray[np.float64]) -> str:
    text = to_json(rows.tolist())[2:-2].decode().replace(",", ", ")
    sizes = np.abs(rows)
    odd = ((sizes < 1e-4) & (sizes > 0.0)) | (sizes >= 1e16)  # their exponents are written in two ways
    if odd.any():
        lines = text.split("], [")
        for i in np.flatnonzero(odd.any(axis=1)).tolist():
            lines[i] = json.dumps(rows[i].tolist())[1:-1]
        text = "], [".join(lines)
    return f"[{text}]"


def is_table(value: Sequence[Any]) -> bool:
    """Whether a list is of lists of floats and of nothing else, as waypoints are: they are written at once."""
    return set(map(type, value)) == {list} and set(map(type, chain.from_iterable(value))) == {float}


def show(value: object) -> str:
    """A short representation of any value for a message."""
    if isinstance(value, bool | None):
        return json.dumps(value)
    if isinstance(value, list | tuple):
        return "an empty list" if not value else f"a list of {len(value)}"
    if isinstance(value, Mapping):
        return "an object"
    if isinstance(value, int) and abs(value) >= 10**20:
        return "a huge integer"
    text = repr(value)
    return text if len(text) <= 40 else text[:30] + "..." + text[-7:]


def brief(name: str) -> str:
    """A name of any length and content as one short printable line."""
    cut = name if len(name) <= 30 else name[:27] + "..."
    return cut if cut.isprintable() else repr(cut)[1:-1]


def listing(names: Iterable[object]) -> str:
    """Names joined by commas, eight at most; "none" if there are none."""
    shown = [brief(str(name)) for name in names]
    more = f" and {len(shown) - 8} more" if len(shown) > 8 else ""
    return (", ".join(shown[:8]) + more) or "none"


def nearest(name: str, known: Sequence[str]) -> str | None:
    """The known name that is spelled most like `name`, or None if none is close."""
    found = get_close_matches(name.lower()[:60], [k.lower() for k in known], 1, 0.6)
    return next((k for k in known if k.lower() == found[0]), None) if found else None


def unknown_key(key: str, known: Sequence[str]) -> str:
    """What to say about a key that no document of this kind has."""
    guess = nearest(key, known)
    return "is an unknown key; " + (f"did you mean {guess!r}?" if guess else f"known keys are {listing(known)}")


def number_problem(value: object) -> str:
    """Why a value is no number of a trajectory or scene, or "" if it is one."""
    try:
        _adapter(Number).validate_python(value)
    except ValidationError as error:
        return _sentence(error.errors()[0])
    return ""


def cell_number(cell: str, odd: float | None = None) -> float | None:
    """The number in a cell of a table; None for other text, and `odd` for 1_000, which Python alone takes for one."""
    try:
        return odd if "_" in cell else float(cell)
    except ValueError:
        return None


def timestep_of(value: Any, file: str, text: str | None = None) -> float:
    """The duration of a dwell waypoint [s] that a file gives, checked; `text` is how it stands there."""
    if number_problem(value) or value <= 0:
        problem = f"is {show(value if text is None else text)}, expected a time > 0 in seconds"
        raise FormatError(file, problem, key="timestep")
    return float(value)


def _filled(name: str) -> str:
    if not name.strip():
        raise ValueError("is blank; give every object a name")
    return name


def _components(*layouts: Sequence[str]) -> BeforeValidator:
    """Accepts an object with the names of one layout for the list of its values."""

    def read(value: object) -> object:
        if not isinstance(value, Mapping):
            return value
        for layout in layouts:
            if set(value) == set(layout):
                return [value[name] for name in layout]
        wanted = " or ".join("{" + ", ".join(layout) + "}" for layout in layouts)
        raise ValueError(f"has the keys {listing(value)}, expected {wanted}")

    return BeforeValidator(read)


Number = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-LARGEST, le=LARGEST)]
"""A finite number of at most `LARGEST`; text and booleans are none."""

Point = Annotated[list[Number], Field(min_length=3, max_length=3), _components(_XYZ)]
"""[x, y, z] or {x, y, z} [m]."""

_Edge = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0.0, le=LARGEST)]
_Size = Annotated[list[_Edge], Field(min_length=3, max_length=3), _components(_XYZ, ("width", "depth", "height"))]
_Turn = Annotated[
    list[Number], Field(min_length=4, max_length=4), _components(("w", "x", "y", "z"), ("qw", "qx", "qy", "qz"))
]


class _ObjectDocument(BaseModel):
    name: Annotated[str, Field(max_length=200), AfterValidator(_filled)]
    x: Number | None = None
    y: Number | None = None
    z: Number | None = None
    position: Point | None = None
    dimensions: _Size | None = None
    orientation: _Turn | None = None

    @model_validator(mode="after")
    def _placed(self) -> _ObjectDocument:
        given = [value for value in (self.x, self.y, self.z) if value is not None]
        if self.position is not None and not given:
            return self
        if len(given) < 3:
            missing = ", ".join(key for key in _XYZ if getattr(self, key) is None)
            raise ValueError(f"({show(self.name)}) has no {missing}; give x, y and z in metres")
        if self.position not in (None, given):
            raise ValueError(f"({show(self.name)}) has a position that differs from its x, y, z; keep one of the two")
        self.position = given
        return self

    def object(self, given: Mapping[str, Any]) -> SceneObject:
        size = None if self.dimensions is None else np.array(self.dimensions)
        turn = np.array([1.0, 0.0, 0.0, 0.0] if self.orientation is None else self.orientation)
        extra = {key: value for key, value in given.items() if key not in _OBJECT_KEYS}
        return SceneObject(self.name, np.array(self.position), size, turn, extra)


class _SceneDocument(BaseModel):
    objects: list[_ObjectDocument] | None = None
    environment: str | None = None
    Env_descp: str | None = None
    frame: str | None = None


def scene_from_dict(document: Mapping[str, Any]) -> Scene:
    """Build a scene from {objects, environment | Env_descp, constraints, frame}, each of which may be missing.

    An object is {name, x, y, z, dimensions?, orientation?} in metres, with orientation as a quaternion wxyz;
    `position` [x, y, z] is accepted for x, y, z, and dimensions may be {x, y, z} or {width, depth, height}.
    Constraints that are text become `constraints_text`, a structure stays in `extra["constraints"]`; other keys are
    kept in `extra`.

    Raises:
        SceneError: On a missing or malformed value; names the key and the index.
    """
    if not isinstance(document, Mapping):
        raise SceneError(f"the scene is {show(document)}, expected a table with objects")
    read = _scene_document(document)
    said, structure = _constraints(document.get("constraints") or "")
    others = {key: value for key, value in document.items() if key not in SCENE_KEYS} | structure
    if PUBLIC_ENVIRONMENT in document and not read.environment:
        others[_ENVIRONMENT_KEY] = PUBLIC_ENVIRONMENT
    objects = tuple(_objects(read.objects or (), document))
    frame = RFU if read.frame is None else _frame(read.frame)
    return Scene(objects, frame, read.environment or read.Env_descp or "", said, others)


def _scene_document(document: Mapping[str, Any]) -> _SceneDocument:
    known = {key: document[key] for key in SCENE_KEYS if key in document and key != "constraints"}
    try:
        read = validated(_SceneDocument, known, "")
    except FormatError as error:
        raise SceneError(error.problem, key=error.key, index=error.index) from None
    if read.environment and read.Env_descp and read.environment != read.Env_descp:
        raise SceneError("differs from environment; keep one of the two", key=PUBLIC_ENVIRONMENT)
    return read


def _constraints(given: object) -> tuple[str, dict[str, Any]]:
    """Constraints that are text, and those that are a structure, which stays as it is."""
    if isinstance(given, str):
        return given, {}
    if not isinstance(given, Mapping | list | tuple):
        raise SceneError(f"is {show(given)}, expected text", key="constraints")
    return "", {"constraints": given}


def _objects(found: Iterable[_ObjectDocument], document: Mapping[str, Any]) -> Iterator[SceneObject]:
    for i, item in enumerate(found):
        try:
            yield item.object(document["objects"][i])
        except SceneError as error:
            raise SceneError(error.problem, key="objects", index=i) from None


def scene_dict(scene: Scene) -> dict[str, Any]:
    """The scene as {objects, constraints, ...}: plain lists and dicts that `scene_from_dict` turns back exactly.

    `environment` and `frame` are written only when they say something. If a scene holds both a constraint text and
    a structure in `extra["constraints"]`, the structure is written.
    """
    document: dict[str, Any] = {"objects": [_object_dict(item) for item in scene]}
    if scene.extra.get(_ENVIRONMENT_KEY) == PUBLIC_ENVIRONMENT:
        document[PUBLIC_ENVIRONMENT] = scene.environment or None
    elif scene.environment:
        document["environment"] = scene.environment
    document["constraints"] = plain(scene.extra.get("constraints", scene.constraints_text))
    if scene.frame != RFU:
        document["frame"] = scene.frame.name
    others = {k: plain(v) for k, v in scene.extra.items() if k not in (*SCENE_KEYS, _ENVIRONMENT_KEY)}
    return document | others


@called_as('load_robot("arm")')
def load_robot(name_or_path: str | os.PathLike[str]) -> Robot:
    """A shipped robot by its name, or a robot from a .toml or .json file (see `docs/formats.md`).

    Raises:
        RobotError: If it is neither a preset nor looks like a file.
        FormatError: If the file cannot be read or a value in it is malformed.
    """
    if not isinstance(name_or_path, str | os.PathLike):
        raise RobotError(f"a robot is a name or a file, not {show(name_or_path)}")
    from ovita.io.json_ import parse_object

    parse = {".toml": parse_toml, ".json": parse_object}.get(suffix(name_or_path))
    if parse is None and isinstance(name_or_path, str) and not {os.sep, "/"} & set(name_or_path):
        return Robot.preset(name_or_path)
    examine(name_or_path)
    file = file_name(name_or_path)
    if parse is None:
        raise FormatError(file, "a robot is a .toml or a .json file; rename it or name a preset")
    return robot_from_dict(parse(read_text(name_or_path), file), file)


def robot_from_dict(document: Mapping[str, Any], file: str) -> Robot:
    """Build a robot from the parsed content of a robot file: the fields of `Robot`, its workspace a table."""
    given = {"name": Path(file).stem, "max_speed": None, **document}
    check_keys(given, [item.name for item in fields(Robot)], file)
    workspace = given.pop("workspace", None)
    robot = validated(Robot, given, file)
    if not robot.name.strip():
        raise FormatError(file, "is blank, expected text", key="name")
    with errors_of(file):
        return robot if workspace is None else replace(robot, workspace=_workspace(workspace, file))


def parse_toml(content: str, file: str) -> dict[str, Any]:
    """Parse the text of a TOML file."""
    try:
        return tomllib.loads(content)
    except RecursionError:
        raise FormatError(file, "nested too deeply for a robot file") from None
    except tomllib.TOMLDecodeError as error:
        what = str(error)
        raise FormatError(file, f"this is not TOML: {what[:1].lower()}{what[1:]}") from None
    except ValueError:
        raise FormatError(file, "this is not TOML: a number or date in it is out of range") from None


def read_by(read: Any) -> PlainValidator:
    """A validator that makes an error of ovita one of pydantic, with its key and index."""

    def run(value: Any) -> Any:
        try:
            return read(value)
        except (SceneError, TrajectoryError) as error:
            place = [part for part in (error.key, error.index) if part is not None]
            raise PydanticCustomError("ovita", "{problem}", {"problem": error.problem, "place": place}) from None

    return PlainValidator(run)


SceneField = Annotated[Scene, read_by(scene_from_dict)]
"""A scene in the layout of `scene_dict`, for pydantic models."""


@cache
def _adapter(kind: Any) -> TypeAdapter[Any]:
    return TypeAdapter(kind)


def _located(error: ErrorDetails, value: object, file: str, key: str) -> FormatError:
    """The error located in the document: keys before the first index, the index, the keys inside."""
    place = [*filter(None, [key]), *_place(error, value)]
    at = next((i for i, part in enumerate(place) if isinstance(part, int)), len(place))
    keys, index = ".".join(brief(str(part)) for part in place[:at]), next(iter(place[at:]), None)
    rest = "".join(f"[{part}]" if isinstance(part, int) else f".{brief(part)}" for part in place[at + 1 :])
    problem = f"{rest.removeprefix('.')} {_sentence(error)}".strip()
    if not keys and index is None:
        return FormatError(file, f"the document {problem}")
    return FormatError(file, problem, key=keys or "item", index=index)  # type: ignore[arg-type]


def _place(error: ErrorDetails, value: Any) -> Iterator[int | str]:
    """The keys and indices of an error that the document has; any other part names a type in a union."""
    loc = [part for part in error["loc"] if part != "[key]"]
    for i, part in enumerate(loc):
        if _holds(value, part):
            value = value[part]
            yield part
        elif i == len(loc) - 1 and error["type"] == "extra_forbidden":
            yield part
    yield from (error.get("ctx") or {}).get("place", [])


def _holds(value: object, part: int | str) -> bool:
    if isinstance(value, list | tuple):
        return isinstance(part, int) and part < len(value)
    return isinstance(value, Mapping) and part in value


def _sentence(error: ErrorDetails) -> str:
    """What is wrong, in words that follow the name of the value."""
    kind, value, ctx = error["type"], error.get("input"), error.get("ctx") or {}
    if kind in ("value_error", "ovita"):
        return str(ctx.get("error") or ctx.get("problem"))
    if kind == "missing":
        keys = f" (its keys are {listing(value)})" if isinstance(value, Mapping) else ""
        return f"has no {error['loc'][-1]}{keys}"
    if kind == "string_too_long":
        return f"has {len(str(value))} characters; shorten it to {ctx['max_length']}"
    if "actual_length" in ctx:
        return f"holds {ctx['actual_length']} values, expected {ctx.get('min_length') or ctx.get('max_length')}"
    if isinstance(value, int | float) and LARGEST < abs(value) != float("inf"):
        return f"is {show(value)}, beyond the largest magnitude {LARGEST:g}"
    an_object = kind.split("_")[0] in ("dict", "model", "dataclass", "mapping")
    expected = _EXPECTED.get(kind, "expected an object" if an_object else "").format_map(ctx)
    return f"is {show(value)}, {expected}" if expected else error["msg"][:1].lower() + error["msg"][1:]


_EXPECTED = {
    "float_type": "not a number",
    "float_parsing": "not a number",
    "finite_number": "not a finite number",
    "string_type": "expected text",
    "bool_type": "expected true or false",
    "int_type": "expected a whole number",
    "int_from_float": "expected a whole number",
    "list_type": "expected a list",
    "tuple_type": "expected a list",
    "greater_than_equal": "expected a number >= {ge}",
    "greater_than": "expected a number > {gt}",
    "literal_error": "expected {expected}",
}
"""What pydantic wanted in place of a value, by the kind of its error; for others it takes its own words."""


def _frame(name: str) -> Frame:
    try:
        return Frame(name.lower() if len(name) < 30 else brief(name))
    except SceneError as error:
        raise SceneError(f"is an {error.problem}", key="frame") from None


def _object_dict(item: SceneObject) -> dict[str, Any]:
    x, y, z = item.position.tolist()
    document: dict[str, Any] = {"name": item.name, "x": x, "y": y, "z": z}
    if item.dimensions is not None:
        document["dimensions"] = item.dimensions.tolist()
    if item.orientation.tolist() != [1.0, 0.0, 0.0, 0.0]:
        document["orientation"] = item.orientation.tolist()
    return document | {key: plain(value) for key, value in item.extra.items() if key not in _OBJECT_KEYS}


def _workspace(document: object, file: str) -> Box | Shell:
    if not isinstance(document, Mapping):
        problem = f"is {show(document)}, expected a table with lower and upper, or center, r_min and r_max"
        raise FormatError(file, problem, key="workspace")
    kind = document.get("kind", "shell" if {"center", "r_min", "r_max"} & set(document) else "box")
    if kind not in ("box", "shell"):
        raise FormatError(file, f"is {show(kind)}, expected 'box' or 'shell'", key="workspace.kind")
    shape: type[Box | Shell] = Box if kind == "box" else Shell
    check_keys(document, [item.name for item in fields(shape)], file, "workspace.")
    kinds = {name: Point if name in ("lower", "upper", "center") else Number for name in document if name != "kind"}
    numbers = {name: validated(kinds[name], document[name], file, f"workspace.{name}") for name in kinds}
    return validated(shape, numbers, file, "workspace")


def check_keys(document: Mapping[str, Any], known: Sequence[str], file: str, prefix: str = "") -> None:
    """Refuse a document with a key that none of its kind has."""
    for key in document:
        if key not in known:
            raise FormatError(file, unknown_key(key, known), key=f"{prefix}{brief(key)}")


VERDICT = "verdict"
"""What a file calls the verdict on its trajectory, in one line."""


@dataclass(frozen=True, repr=False)
class Task:
    """A trajectory, its scene and an instruction, read from a file.

    Args:
        trajectory: The waypoints.
        scene: What surrounds them; empty if the file does not say.
        instruction: The request, or "".
        extra: Other top-level keys of the file, kept as they were.
        path: The file as it was named.
        robot: Name of a robot preset or path of a robot file, or None.
        notes: What had to be assumed or ignored, each a sentence for a person.
        verdict: What the file says of its own trajectory, such as "infeasible: ...", or "".
        fixed_frame: Whether the format itself fixes the axes (a ROS bag, a mission), so that another frame means
            turning the waypoints rather than reading them otherwise.
    """

    trajectory: Trajectory
    scene: Scene = field(default_factory=Scene)
    instruction: str = ""
    extra: Mapping[str, Any] = field(default_factory=dict)
    path: str = ""
    robot: str | None = None
    notes: tuple[str, ...] = ()
    fixed_frame: bool = False
    verdict: str = ""

    def __repr__(self) -> str:
        said = f"{self.instruction!r} about " if self.instruction else ""
        return f"<Task: {said}{self.trajectory!r} in {self.scene!r}>"


Kind = Literal["path", "poses", "multidof"]
"""ROS messages that hold a path: nav_msgs/Path, geometry_msgs/PoseArray, trajectory_msgs/MultiDOFJointTrajectory."""


@dataclass(frozen=True)
class Choices:
    """Options that a file's name does not determine.

    Args:
        topic: The topic of a bag, or None for the only one that fits.
        message: Which message on that topic, or episode of a LeRobot data set, counted from 0, negative from the end;
            None for the last.
        kind: The message to write to a bag, or None for that of the file it came from, else a path.
        frame_id: The ROS frame to write, or None for that of the file it came from, else "map".
        home: Where the local metres of a mission have their origin, or None for the file's own.
        heading: Where the front of a mission or of setpoints points, clockwise from north [degrees]; None for north.
        takeoff: Whether a mission that has no takeoff begins with one.
        frames: Of recorded transforms, which frame moves in which, as "map:base_link"; None for the only one that does.
        raw: Whether every sample of a recording is kept as it is, neither smoothed nor thinned.
        span: The first and last second that are read of a recording, or of any path with times; None for all.
    """

    topic: str | None = None
    message: int | None = None
    kind: Kind | None = None
    frame_id: str | None = None
    home: Home | None = None
    heading: float | None = None
    takeoff: bool = False
    frames: str | None = None
    raw: bool = False
    span: tuple[float, float] | None = None

    def during(self, times: Array) -> Mask:
        """Which of some times (N,) [s], counted from the first, are to be read.

        Raises:
            TrajectoryError: If fewer than two are.
        """
        if self.span is None:
            return np.ones(len(times), dtype=bool)
        first, last = self.span
        inside = np.asarray((times >= first) & (times <= last))
        if inside.sum() < 2:
            asked = f"after {first:g} s" if np.isinf(last) else f"from {first:g} to {last:g} s"
            raise TrajectoryError(f"lasts {times[-1]:.1f} s and has {inside.sum()} samples {asked}", key="time")
        return inside


NONE = Choices()
"""No choice made."""
