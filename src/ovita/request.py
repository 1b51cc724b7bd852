"""What a person asks: one instruction about one trajectory in its scene, and how Python's values become one."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sized
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from ovita.errors import RequestError, TrajectoryError
from ovita.io import Task, is_address, load_robot, load_task
from ovita.io.waypoints import COLUMNS, from_columns
from ovita.paths.geometry import on_the_ground
from ovita.paths.part import WHOLE, PathPart
from ovita.paths.robot import UNLIMITED, Robot
from ovita.paths.scene import Frame, Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.policy import Parameter
from ovita.policy.wire import MAX_ROWS
from ovita.text import sentence

MAX_INSTRUCTION = 2000
"""Longest instruction that is accepted [characters]."""

FeedbackOn = Literal["original", "current"]


@dataclass(frozen=True)
class Turn:
    """An earlier turn of the same session that is still in force, with all corrections made to it since.

    Args:
        instruction: What it does, in words that stand on their own.
        start: The trajectory that it began with.
        parameters: The parameters of its policy with their present values.
        steps: How many steps of the session it took.
        feedback_on: Which trajectory it was about.
        plan: What was done.
        code: Its policy, or "" where a writer need not see it.
        contacts: Names of objects that it means to touch.
    """

    instruction: str
    start: Trajectory
    parameters: tuple[Parameter, ...] = ()
    steps: int = 1
    feedback_on: FeedbackOn = "current"
    plan: tuple[str, ...] = ()
    code: str = ""
    contacts: tuple[str, ...] = ()


@dataclass(frozen=True)
class Request:
    """One instruction about one trajectory.

    Args:
        instruction: The person's instruction.
        trajectory: The trajectory that the instruction is about.
        scene: Its surroundings.
        robot: The limits that will be enforced.
        history: Earlier turns, oldest first.
        origin: How the trajectory came about, such as "planned from above the box to above the plate", or "".
        assumed: What had to be assumed of the trajectory, each a sentence.
        selection: The part of the path that is marked by hand, which "here" and "this part" mean.

    An array stands for a trajectory, objects for a scene, and a name or a file for a robot.

    Raises:
        RequestError: If the instruction is empty or longer than 2000 characters, or something is of another kind.
        TrajectoryError: If an array is no trajectory.
        RobotError: If there is no such robot.
    """

    instruction: str
    trajectory: Trajectory
    scene: Scene = field(default_factory=Scene)
    robot: Robot = UNLIMITED
    history: tuple[Turn, ...] = ()
    origin: str = ""
    assumed: tuple[str, ...] = ()
    selection: PathPart = WHOLE

    if TYPE_CHECKING:  # what may be given is wider than what is held

        def __init__(
            self,
            instruction: str,
            trajectory: Trajectory | ArrayLike,
            scene: Scene | Iterable[SceneObject] | None = None,
            robot: Robot | str | None = None,
            history: tuple[Turn, ...] = (),
            origin: str = "",
            assumed: tuple[str, ...] = (),
            selection: PathPart = WHOLE,
        ) -> None: ...

    def __post_init__(self) -> None:
        if not isinstance(self.instruction, str):
            raise RequestError(f"an instruction is a text such as 'go left by 0.1', not {_kind(self.instruction)}")
        trajectory, assumed = trajectory_of(self.trajectory)
        object.__setattr__(self, "trajectory", trajectory)
        if not isinstance(self.assumed, list | tuple):
            raise RequestError(f"what was assumed is a list of sentences, not {_kind(self.assumed)}")
        object.__setattr__(self, "assumed", (*self.assumed, *assumed))
        object.__setattr__(self, "robot", robot_of(self.robot))
        scene = scene_of(self.scene)
        level = _level(self.trajectory, self.robot, scene.frame)
        if level != scene.frame.level:
            scene = replace(scene, frame=replace(scene.frame, level=level))
        object.__setattr__(self, "scene", scene)
        if not self.instruction.strip():
            raise RequestError("the instruction is empty; say what should change, such as 'slow down near the cup'")
        if len(self.instruction) > MAX_INSTRUCTION:
            raise RequestError(
                f"the instruction has {len(self.instruction)} characters; at most {MAX_INSTRUCTION} are read"
            )


Adaptable: TypeAlias = Task | Trajectory | ArrayLike | os.PathLike[str]
"""What an instruction can be about: a task, a trajectory, an array (N, 3), (N, 4) or (N, 8), or the name of a file."""


def requested(
    about: Request | Adaptable,
    instruction: str | None = None,
    *,
    scene: Scene | Iterable[SceneObject] | None = None,
    robot: Robot | str | None = None,
    times: ArrayLike | None = None,
    selection: PathPart = WHOLE,
) -> Request:
    """The request that a caller means; what is None is that of the task, the file or the request.

    `times` (N,) [s], when the waypoints of an array are reached, stand in place of speeds.

    Raises:
        InputError: If any of these cannot be used; says which, and what to give.
    """
    if isinstance(about, Request):
        if any(given is not None for given in (instruction, scene, robot, times)) or selection:
            raise RequestError("a Request holds instruction, scene, robot and speeds itself; change it with replace()")
        return about
    if times is not None and isinstance(about, str | os.PathLike | Task | Trajectory):
        raise RequestError("times go with an array of positions (N, 3); a task, a trajectory and a file have their own")
    if isinstance(about, str | os.PathLike):
        if is_address(os.fspath(about)):
            raise RequestError(f"{about} is an address; read it first: ovita.load({about!r})")
        about = load_task(about)
    if not isinstance(about, Task):
        trajectory, assumed = trajectory_of(about, times)
        return Request(_instruction(instruction, ""), trajectory, scene, robot, assumed=assumed, selection=selection)
    surroundings = about.scene if scene is None else scene_of(scene)
    chosen, notes = about.robot if robot is None else robot, stated_limits(surroundings)
    instruction = _instruction(instruction, about.instruction)
    return Request(instruction, about.trajectory, surroundings, chosen, assumed=notes, selection=selection)


def stated_limits(scene: Scene) -> tuple[str, ...]:
    """What is to be told of limits in a scene's text, which the robot has not."""
    from ovita.limits.stated import parse_text

    found = parse_text(scene.constraints_text) if scene.constraints_text else None
    stated = () if found is None else (*found.understood, *found.ignored)
    how = "give robot=parse_text(scene.constraints_text).apply(robot), from ovita.limits"
    return (f"limits in the scene's text are not enforced ({'; '.join(stated)}): {how}",) if stated else ()


def trajectory_of(
    waypoints: Trajectory | ArrayLike, times: ArrayLike | None = None
) -> tuple[Trajectory, tuple[str, ...]]:
    """A trajectory from one or from an array, and what was assumed for it.

    Args:
        waypoints: Positions (N, 3) [m]; with speeds (N, 4) [m/s]; with quaternions wxyz (N, 8).
        times: When the waypoints are reached (N,) [s], in place of speeds.

    Raises:
        RequestError: If it is nothing of that kind.
        TrajectoryError: If its shape or a value is wrong; names the waypoint.
    """
    if isinstance(waypoints, Trajectory):
        return _of_a_length(waypoints), ()
    rows = _numbers(waypoints, "a trajectory is an array (N, 3) of x, y, z, or (N, 4) with speeds")
    if rows.ndim != 2 or rows.shape[1] not in (3, 4, 8):
        raise TrajectoryError(
            f"waypoints have shape {rows.shape}, expected (N, 3): x, y, z, or (N, 4) with speeds", key="waypoints"
        )
    _of_a_length(rows)
    if len(rows) < 2:
        raise TrajectoryError(f"a trajectory needs at least 2 waypoints, this one has {len(rows)}", key="waypoints")
    columns = dict(zip(COLUMNS, rows.T, strict=False))
    if times is None:
        built, notes = from_columns(columns, key="waypoints")
        return built, tuple(map(sentence, notes))
    if rows.shape[1] != 3:
        raise TrajectoryError("waypoints have speeds and times; give times only with positions (N, 3)", key="times")
    moments = _numbers(times, "times are (N,) seconds")
    if moments.shape != (len(rows),):
        raise TrajectoryError(f"times have shape {moments.shape}, expected one for each of {len(rows)} waypoints")
    return from_columns({**columns, "t": moments}, key="waypoints", timestep=None)[0], ()


def _level(trajectory: Trajectory, robot: Robot, frame: Frame) -> float | None:
    """The height [m] that a robot keeps, if it is a planar one, or none is known and its path lies on the ground."""
    up = frame.direction("up")
    heights = trajectory.positions @ up
    rolls = robot == UNLIMITED and on_the_ground(trajectory.positions, up)
    return float(np.median(heights)) if robot.planar or rolls else None


def scene_of(scene: Scene | Iterable[SceneObject] | None) -> Scene:
    """A scene from one, from its objects, or the empty one.

    Raises:
        RequestError: If it is nothing of that kind.
    """
    if scene is None or isinstance(scene, Scene):
        return Scene() if scene is None else scene
    if isinstance(scene, str | os.PathLike) or not isinstance(scene, Iterable):
        raise RequestError(f"a scene is a Scene or a list of SceneObjects, not {_kind(scene)}")
    return Scene(scene)


def robot_of(robot: Robot | str | None) -> Robot:
    """A robot from one, from its name or file, or the one without limits.

    Raises:
        RequestError: If it is nothing of that kind.
        RobotError: If no robot has that name.
    """
    if isinstance(robot, Robot):
        return robot
    if not isinstance(robot, str | os.PathLike | None):
        raise RequestError(f"a robot is a Robot or a name such as 'drone', not {_kind(robot)}")
    return load_robot(robot) if robot else UNLIMITED


def _instruction(instruction: str | None, otherwise: str) -> str:
    if instruction is None and not otherwise.strip():
        raise RequestError("there is no instruction; say what should change, such as adapt(task, 'go left by 0.1')")
    return otherwise if instruction is None else instruction


_Rows = TypeVar("_Rows", bound=Sized)


def _of_a_length(waypoints: _Rows) -> _Rows:
    """Refuse, before anything is done, more waypoints than a policy may return."""
    if len(waypoints) > MAX_ROWS:
        raise TrajectoryError(
            f"the trajectory has {len(waypoints)} waypoints and at most {MAX_ROWS} can be adapted; take fewer first:"
            f" trajectory.resample({MAX_ROWS}, by='index')",
            key="waypoints",
        )
    return waypoints


def _numbers(values: object, wanted: str) -> np.ndarray[Any, np.dtype[np.float64]]:
    if values is None or isinstance(values, str | bytes | dict | int | float):
        raise RequestError(f"{wanted}, not {_kind(values)}")
    try:
        rows = np.asarray(values)
        if rows.dtype.kind not in "iuf":
            raise TypeError
        return rows.astype(np.float64)
    except (TypeError, ValueError):
        raise RequestError(f"{wanted}; {_kind(values)} of another shape or kind was given") from None


def _kind(value: object) -> str:
    name = type(value).__name__
    return "None" if value is None else f"{'an' if name[:1].lower() in 'aeiou' else 'a'} {name}"
