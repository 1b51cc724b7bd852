"""The report of changes: plain immutable data that goes to JSON and back.

Waypoints count from 0, both ends included, and are those of the adapted trajectory unless said otherwise.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, is_dataclass
from typing import Any, get_args, get_origin, get_type_hints

from ovita.errors import InputError
from ovita.paths.correspondence import Method

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Span:
    """One quantity before and after."""

    before: float
    after: float

    @property
    def change(self) -> float:
        """After minus before."""
        return self.after - self.before


@dataclass(frozen=True)
class Displacement:
    """Displacement of the corresponding waypoints.

    Args:
        max: Largest displacement [m], at waypoint `index` and share `fraction` (0..1) of the path length.
        mean: Mean length of the displacements [m].
        vector: Mean displacement (world frame) [m]; `words` splits it into direction words with metres > 0.
        max_words: Direction words of the largest displacement [m].
        spread: Largest deviation of a displacement from `vector` [m]; 0 for a pure translation.
        count: Number of displaced waypoints, the first and last of which are `first` and `last` (None without any).
    """

    max: float
    mean: float
    index: int
    fraction: float
    vector: Vector
    words: dict[str, float]
    max_words: dict[str, float]
    spread: float
    count: int
    first: int | None
    last: int | None


@dataclass(frozen=True)
class Insertion:
    """Inserted waypoints `first` to `last`, up to `off` [m] from the original path."""

    first: int
    last: int
    off: float


@dataclass(frozen=True)
class Kink:
    """A turn at `waypoint` by `degrees` that the original does not have there; it turned by `before` at most [deg]."""

    waypoint: int
    degrees: float
    before: float


@dataclass(frozen=True)
class Jump:
    """A step of `step` [m] from `waypoint` to the next, far above the original's longest step `before` [m]."""

    waypoint: int
    step: float
    before: float


@dataclass(frozen=True)
class ShapeChange:
    """How sharply the path turns and how evenly it is sampled.

    Args:
        sharpest: Sharpest turn at a waypoint [deg], at waypoint `sharpest_at` of either trajectory.
        reversals: Number of turns by more than 150 degrees.
        step: Longest step between neighbouring waypoints [m].
        kinks: Turns by 60 degrees or more that the adaptation brought to waypoints that were there before.
        jumps: Steps more than four times the original's longest, allowing for another number of waypoints.
    """

    sharpest: Span
    sharpest_at: Span
    reversals: Span
    step: Span
    kinks: tuple[Kink, ...] = ()
    jumps: tuple[Jump, ...] = ()


@dataclass(frozen=True)
class Endpoint:
    """Start or goal: positions before and after [m], the distance between them [m] and its direction words."""

    before: Vector
    after: Vector
    shift: float
    words: dict[str, float]


@dataclass(frozen=True)
class SpeedRange:
    """Neighbouring waypoints that all became slower, or all faster.

    Args:
        first: First waypoint.
        last: Last waypoint.
        speed: Mean speed of these waypoints [m/s].
        near: Names of the objects, two at most, that the path passes here.
    """

    first: int
    last: int
    speed: Span
    near: tuple[str, ...]


@dataclass(frozen=True)
class Stop:
    """A stop of the adapted trajectory: waypoints `first` to `last` at speed 0, waiting `seconds` [s], near what."""

    first: int
    last: int
    seconds: float
    near: tuple[str, ...]


@dataclass(frozen=True)
class SpeedChange:
    """Speeds over the waypoints, dwells left out.

    Args:
        mean: Mean speed [m/s].
        min: Lowest speed [m/s].
        max: Highest speed [m/s].
        ratio_min: Lowest ratio of speed after to before, over waypoints that moved before; None without any.
        ratio_max: Highest such ratio.
        count: Number of waypoints whose speed changed; `everywhere` if these are all that moved before.
        first: First waypoint whose speed changed, or None.
        last: Last one.
        ranges: The changed waypoints as runs of one direction; one run over all if there are very many.
        stops: Number of stops on the way, and at the ends if the robot waits there.
        stopped: The stops of the adapted trajectory.
        dwell_steps: Number of dwell waypoints (repeated at speed 0); each lasts one timestep.
        dwell: Time spent in dwells [s].
    """

    mean: Span
    min: Span
    max: Span
    ratio_min: float | None
    ratio_max: float | None
    count: int
    everywhere: bool
    first: int | None
    last: int | None
    ranges: tuple[SpeedRange, ...]
    stops: Span
    stopped: tuple[Stop, ...]
    dwell_steps: Span
    dwell: Span


@dataclass(frozen=True)
class ObjectChange:
    """How the path passes one object, measured along the segments too.

    Args:
        name: As in the scene.
        distance: Closest approach to the centre [m], at fractional waypoint `distance_at` of either trajectory.
        clearance: Closest approach to the cuboid's surface [m], negative inside, at `clearance_at`.
        neighbourhood: Distance from the centre that counts as near [m].
        speed_before: Mean speed of the original's waypoints in the neighbourhood [m/s]; None without any.
        speed_after: The same of the adapted trajectory.
    """

    name: str
    distance: Span
    distance_at: Span
    clearance: Span
    clearance_at: Span
    neighbourhood: float
    speed_before: float | None
    speed_after: float | None


@dataclass(frozen=True)
class Changes:
    """The measured difference of two trajectories in a scene.

    Args:
        matching: How waypoints were paired, as in `paths.correspondence`.
        removed: Runs (first, last) of original waypoints that were taken out.
        added: Runs of waypoints that were put in.
        path_unchanged: Whether positions are the same bit by bit.
        speeds_unchanged: Whether speeds are the same bit by bit.
        orientations_unchanged: Whether orientations are the same bit by bit.
        waypoints: Number of waypoints.
        length: Length of the path [m].
        duration: Time from start to goal [s].
        displacement: How far the path moved.
        shape: Its turns and steps.
        start: Change of the start.
        goal: Change of the goal.
        speed: How speeds changed.
        objects: How each object is passed, in the scene's order.
    """

    matching: Method
    removed: tuple[tuple[int, int], ...]
    added: tuple[Insertion, ...]
    path_unchanged: bool
    speeds_unchanged: bool
    orientations_unchanged: bool
    waypoints: Span
    length: Span
    duration: Span
    displacement: Displacement
    shape: ShapeChange
    start: Endpoint
    goal: Endpoint
    speed: SpeedChange
    objects: tuple[ObjectChange, ...]

    @property
    def nothing_changed(self) -> bool:
        """Whether the adapted trajectory is the original, bit by bit."""
        return self.path_unchanged and self.speeds_unchanged and self.orientations_unchanged

    def to_dict(self) -> dict[str, Any]:
        """Return plain dicts, lists and numbers, ready for JSON; `from_dict` gives an equal object back."""
        plain: dict[str, Any] = _plain(asdict(self))
        return plain

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Changes:
        """Rebuild from what `to_dict` returned, directly or through JSON.

        Raises:
            InputError: If keys are missing or unknown.
        """
        try:
            rebuilt: Changes = _rebuilt(cls, data)
            return rebuilt
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f"this is not a report of changes as ovita writes it: {error}") from None


def _rebuilt(kind: Any, value: Any) -> Any:
    """Rebuild a value of a type from JSON data: dataclasses, tuples of these, and plain values."""
    if isinstance(kind, type) and is_dataclass(kind):
        hints = get_type_hints(kind)
        return kind(**{key: _rebuilt(hints.get(key), item) for key, item in dict(value).items()})
    if get_origin(kind) is tuple:
        inner = get_args(kind)
        return tuple(_rebuilt(inner[0] if inner[-1] is Ellipsis else None, item) for item in value)
    return value


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    return [_plain(item) for item in value] if isinstance(value, (list, tuple)) else value
