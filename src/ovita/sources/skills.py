"""Skills: what several demonstrations have in common, to be generated anew between other places.

`learning.learn` makes a skill of demonstrations, `Skill.generate` a trajectory of a skill, with its covariance where
the kind has one.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike

from ovita.errors import RequestError
from ovita.io import Task
from ovita.paths.geometry import path_distances
from ovita.paths.robot import UNLIMITED, Robot
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import TIMESTEP, Array, Trajectory, interpolate
from ovita.sources import taskframes
from ovita.sources.dmp import Dmp
from ovita.sources.places import locate, read_place
from ovita.sources.probabilistic import Promp, Via, conditioned, led
from ovita.sources.tpgmm import Mixture
from ovita.text import counted, length, point

SkillKind = Literal["kmp", "promp", "dmp", "tpgmm"]
"""Kernelized, probabilistic and dynamic movement primitives, and task-parameterised Gaussian mixtures."""

KINDS: tuple[SkillKind, ...] = get_args(SkillKind)

FRAMED = ("kmp", "tpgmm")
"""Kinds that see a movement from task frames."""

FINEST = 0.003
"""Deviations up to this share of a movement's extent, and three times so many radians, count as agreement."""

OUTSIDE = 3.7
"""Farther than so many standard deviations, a place lies outside what was shown: 0.3 % of a Gaussian in space."""

REACHED = 0.005
"""A place is missed if the path passes it by more than this share of the movement's extent."""

SLOWEST = 0.01
"""Between its ends a generated path is never slower than this share of its highest speed, so that it goes on."""

Place: TypeAlias = "str | SceneObject | ArrayLike"
"""A place in words ("the cup", "0.1 m left of the cup"), an object (its centre), or x, y, z[, qw, qx, qy, qz] [m]."""

Vias: TypeAlias = "Mapping[float, Place] | Sequence[tuple[float | None, Place]]"
"""Places by phase, from 0 to 1; None stands for the phase at which the place is least unusual."""


@dataclass(frozen=True, eq=False)
class Moments:
    """Mean and covariance of demonstrations at each phase, as seen from J task frames.

    Args:
        means: (J, T, d).
        covariances: (J, T, d, d).
        way: How far the movement is from the straight way between its ends (T, 3) [m].
        about: How much that varies (T, 3, 3).
    """

    means: Array
    covariances: Array
    way: Array
    about: Array


Model: TypeAlias = Moments | Promp | Dmp | Mixture


@dataclass(frozen=True, eq=False)
class GeneratedPath:
    """A trajectory that a skill generated.

    Args:
        trajectory: The mean.
        covariance: Of the poses (N, d, d), d = 3 or 6; None where the kind of skill has none.
        scene: The objects that it was generated for.
        notes: What a person should know, each a sentence.
        missed: Places that the path was asked for and does not reach, each a sentence.
        broken: Limits of a robot that it breaks, or that it was moved to keep, each a sentence.
        asked: The places (K, 3) [m] that it was asked to reach.
        within: How near counts as reached [m].
    """

    trajectory: Trajectory
    covariance: Array | None
    scene: Scene = field(default_factory=Scene)
    notes: tuple[str, ...] = ()
    missed: tuple[str, ...] = ()
    broken: tuple[str, ...] = ()
    asked: Array = field(default_factory=lambda: np.zeros((0, 3)))
    within: float = 0.0

    def moved_to(self, trajectory: Trajectory) -> GeneratedPath:
        """The path where the limits moved it, and which of the places it no longer reaches."""
        gaps = path_distances(trajectory.positions, self.asked) if len(self.asked) else np.zeros(0)
        away = [f"{point(place)} is missed by {length(gap)}, as the limits moved the path"
                for place, gap in zip(self.asked, gaps, strict=True) if gap > self.within]  # fmt: skip
        return replace(self, trajectory=trajectory, missed=(*self.missed, *away))

    def task(self, instruction: str = "") -> Task:
        """As a task that every format holds; in JSON with the covariance of the positions."""
        extra = {} if self.covariance is None else {COVARIANCE: packed(self.covariance).tolist()}
        verdict = f"not_as_meant: {' '.join(self.missed)}" if self.missed else ""
        if self.broken and not verdict:
            verdict = f"limited: {' '.join(self.broken)}"
        return Task(self.trajectory, self.scene, instruction, extra, notes=self.notes, verdict=verdict)


COVARIANCE = "covariance"
"""Key of a task's extra values that holds rows xx, xy, xz, yy, yz, zz [m2], one a waypoint."""

_UPPER = np.triu_indices(3)


def packed(covariance: Array) -> Array:
    """The positions' part of covariances (N, d, d) as rows (N, 6) xx, xy, xz, yy, yz, zz."""
    return np.asarray(covariance[:, _UPPER[0], _UPPER[1]])


@dataclass(frozen=True, eq=False)
class Skill:
    """A movement learned from demonstrations.

    Args:
        kind: The kind of primitive.
        model: What was learned.
        frames: Names of the task frames; none for the world.
        bases: Mean orientations (J, 4) wxyz, one a frame, that rotation vectors are about; None without orientations.
        speeds: Mean speeds (T,) [m/s] at even phases.
        start: Mean first position in the world (3,) [m].
        goal: Mean last position in the world (3,) [m].
        size: Extent of the movement [m].
        shown: Number of demonstrations.
        scene: The objects of the first demonstration.
        offset: By how much instructions moved the mean (T, d), positions in the world's axes, or None.
        pace: Speeds after instructions (T,) [m/s], or None for those shown.
        edits: These instructions.
        notes: What a person should know, each a sentence.
        timestep: Of generated trajectories [s].
    """

    kind: SkillKind
    model: Model
    frames: tuple[str, ...]
    bases: Array | None
    speeds: Array
    start: Array
    goal: Array
    size: float
    shown: int
    scene: Scene = field(default_factory=Scene)
    offset: Array | None = None
    pace: Array | None = None
    edits: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    timestep: float = TIMESTEP

    def generate(
        self,
        start: Place | None = None,
        goal: Place | None = None,
        via: Vias = (),
        *,
        scene: Scene | None = None,
        waypoints: int | None = None,
        robot: Robot | None = None,
    ) -> GeneratedPath:
        """Generate the movement between other places, through via-points, around objects that moved.

        Speeds are those that were shown at each phase.

        Args:
            start: First pose; by default as shown.
            goal: Last pose; by default as shown.
            via: Places to pass through.
            scene: The objects where they are now; by default as shown.
            waypoints: Number of waypoints; by default as many as the skill has phases.
            robot: Whose distance a place at an object keeps; by default that of no robot. Limits are not enforced here.

        Raises:
            RequestError: If a place or a phase cannot be used, or the kind has no via-points.
            UnknownObject: If the scene lacks the object of a task frame.
        """
        scene = self.scene if scene is None else scene
        asked = _asked(start, goal, via, scene, robot or UNLIMITED)
        if self.kind == "dmp" and any(one.what == "via" for one in asked):
            raise RequestError("a dmp has a start and a goal, but no via-points; learn a kmp for these")
        if waypoints is not None and waypoints < 2:
            raise RequestError(f"a path of {counted(waypoints, 'waypoint')} leads nowhere; ask for 2 or more")
        shown = self._shown(np.linspace(0.0, 1.0, waypoints or len(self.speeds)), scene, asked)
        placed = [one if one.phase is not None else replace(one, phase=_likeliest(one, shown)) for one in asked]
        shown = self._shown(_with(shown.phases, placed), scene, asked)
        reached = self._through(shown, [_via(one, shown) for one in placed])
        covariance = None if self.kind == "dmp" else reached.covariance
        said = self._unusual(placed, shown), self._missed(placed, reached)
        places = np.array([one.position for one in placed]).reshape(-1, 3)
        near: dict[str, Any] = {"asked": places, "within": max(REACHED * self.size, 0.005)}
        return GeneratedPath(self._trajectory(reached), covariance, scene, *said, **near)

    def _shown(self, phases: Array, scene: Scene, asked: Sequence[_AskedPlace]) -> taskframes.PathDistribution:
        """What was shown at some phases, around a scene's objects, before any place is asked for."""
        base = None if self.bases is None else self.bases[0]
        if isinstance(self.model, Dmp):
            mean = self.model.generated(phases)
            shown = taskframes.PathDistribution(phases, mean, np.zeros((*mean.shape, mean.shape[1])), base)
        elif isinstance(self.model, Promp):
            shown = self.model.generated(phases, (), base)
        else:
            ends = {one.phase: one.position for one in asked}
            frames = taskframes.frames_of(self.frames, scene, ends.get(0.0, self.start), ends.get(1.0, self.goal))
            seen = [self._seen(self.model, i, phases) for i in range(len(frames))]
            shown = taskframes.fused(seen, frames)
            if isinstance(self.model, Moments) and self.frames:
                way = taskframes.PathDistribution(self._even, self.model.way, self.model.about).at(phases)
                shown = taskframes.multiplied([shown, taskframes.along_the_way(shown, way.mean, way.covariance)])
        return replace(shown, mean=shown.mean + self._moved(phases))

    @property
    def _even(self) -> Array:
        """The phases (T,) that the skill was learned at."""
        return np.linspace(0.0, 1.0, len(self.speeds))

    def _seen(self, model: Moments | Mixture, i: int, phases: Array) -> taskframes.PathDistribution:
        """What was shown as seen from task frame i."""
        base = None if self.bases is None else self.bases[i]
        if isinstance(model, Mixture):
            return model.regressed(phases, i, base)
        return taskframes.PathDistribution(self._even, model.means[i], model.covariances[i], base).at(phases)

    def _moved(self, phases: Array) -> Array:
        """By how much instructions moved the mean at some phases (M, d)."""
        if self.offset is None:
            return np.zeros((len(phases), 1))
        return interpolate(self.offset, phases * (len(self.offset) - 1))

    def _through(self, shown: taskframes.PathDistribution, vias: Sequence[Via]) -> taskframes.PathDistribution:
        """The distribution once it was made to pass through via-points, the start and the goal among them."""
        if not vias:
            return shown
        if isinstance(self.model, Dmp):
            start, goal = (_value(vias, phase, self._moved(np.array([phase]))[0]) for phase in (0.0, 1.0))
            mean = self.model.generated(shown.phases, start, goal) + self._moved(shown.phases)
            return replace(shown, mean=mean)
        if isinstance(self.model, Promp):
            moved = self._moved(np.array([via.phase for via in vias]))
            asked = [replace(via, value=via.value - away) for via, away in zip(vias, moved, strict=True)]
            found = self.model.generated(shown.phases, asked, shown.base)
            return replace(found, mean=found.mean + self._moved(shown.phases))
        start, goal = _value(vias, 0.0), _value(vias, 1.0)
        start, goal = shown.mean[0] if start is None else start, shown.mean[-1] if goal is None else goal
        return conditioned(led(shown, start, goal), vias)

    def _trajectory(self, reached: taskframes.PathDistribution) -> Trajectory:
        paced = self.speeds if self.pace is None else self.pace
        speeds = interpolate(paced[:, None], reached.phases * (len(paced) - 1))[:, 0]
        speeds[1:-1] = np.maximum(speeds[1:-1], SLOWEST * float(paced.max()))
        turns = None if reached.base is None else taskframes.exponential(reached.base, reached.mean[:, 3:])
        return Trajectory(reached.mean[:, :3], speeds, turns, self.timestep)

    def _unusual(self, placed: Sequence[_AskedPlace], shown: taskframes.PathDistribution) -> tuple[str, ...]:
        """Which places lie outside what was shown, each a sentence."""
        said = []
        for one in placed:
            if self.kind == "dmp" or one.what in self.frames:
                continue  # it has no variance; or its task frames say where it starts and ends
            away, deviations = (rows[_slot(shown.phases, one)] for rows in _away(one.position, shown))
            if deviations > OUTSIDE:
                far = f"{length(away)} from the mean there, {deviations:.0f} standard deviations"
                said.append(f"{one.named} lies outside what was shown: {far}")
        return tuple(said)

    def _missed(self, placed: Sequence[_AskedPlace], reached: taskframes.PathDistribution) -> tuple[str, ...]:
        """Which places the path does not reach, each a sentence."""
        gaps = [float(np.linalg.norm(reached.mean[_slot(reached.phases, one), :3] - one.position)) for one in placed]
        why = "; a promp stays within what its demonstrations span, a kmp does not" if self.kind == "promp" else ""
        missed = [(one, gap) for one, gap in zip(placed, gaps, strict=True) if gap > REACHED * self.size]
        return tuple(f"{one.named} is missed by {length(gap)}{why}" for one, gap in missed)

    def base(self) -> Array | None:
        """The orientation (4,) that rotations of the mean are about around the objects as shown, or None."""
        return self._shown(self._even, self.scene, ()).base

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the skill as JSON.

        Raises:
            FormatError: If the file cannot be written.
        """
        from ovita.sources.skill_files import save_skill

        save_skill(path, self)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Skill:
        """Read a skill that `save` wrote.

        Raises:
            FormatError: If the file cannot be read, or something in it is malformed.
        """
        from ovita.sources.skill_files import load_skill

        return load_skill(path)


@dataclass(frozen=True, eq=False)
class _AskedPlace:
    """A place to pass through, and what to call it.

    Args:
        what: "start", "goal" or "via".
        phase: None where it is to be chosen.
        position: (3,) [m].
        orientation: Unit quaternion (4,) wxyz, or None where it is free.
    """

    what: str
    phase: float | None
    position: Array
    orientation: Array | None
    text: str

    @property
    def named(self) -> str:
        return f"the {self.what}" if self.what != "via" else f"the via-point at {self.phase:.3g} ({self.text})"


def _asked(start: Place | None, goal: Place | None, via: Vias, scene: Scene, robot: Robot) -> list[_AskedPlace]:
    """All places to pass through, the ends first."""
    pairs: list[tuple[str, float | None, Place]] = []
    pairs += [] if start is None else [(taskframes.START, 0.0, start)]
    pairs += [] if goal is None else [(taskframes.GOAL, 1.0, goal)]
    pairs += [("via", phase, place) for phase, place in (via.items() if isinstance(via, Mapping) else via)]
    seen: set[float] = set()
    for _, phase, _ in pairs:
        if phase is not None and not 0.0 <= phase <= 1.0:
            raise RequestError(f"the phase {phase:g} of a via-point is not between 0 (the start) and 1 (the goal)")
        if phase in seen:
            raise RequestError(f"two places are asked for at the phase {phase:g}; give each a phase of its own")
        seen |= set() if phase is None else {phase}
    return [_AskedPlace(what, phase, *placed(place, scene, robot), _text(place)) for what, phase, place in pairs]


def placed(place: Place, scene: Scene, robot: Robot) -> tuple[Array, Array | None]:
    """The position (3,) [m] of a place, and its orientation (4,) where it gives one.

    Words are read as `ovita plan` reads them, so "the cup" is the free place above it; a `SceneObject` is its centre.

    Raises:
        RequestError: If it is no place, or the scene has no such object.
    """
    if isinstance(place, SceneObject):
        return place.position, None
    if isinstance(place, str) and any(letter.isalpha() for letter in place):
        return locate(read_place(place, scene), scene, robot).position, None
    values = _numbers(place)
    return values[:3], _unit(values[3:]) if len(values) == 7 else None


def _numbers(place: Place) -> Array:
    try:
        values = np.array(place.split(",") if isinstance(place, str) else place, dtype=float)
    except (TypeError, ValueError):
        values = np.zeros(0)
    if values.ndim != 1 or len(values) not in (3, 7) or not np.isfinite(values).all():
        raise RequestError(f"{_text(place)!r} is no place; give an object, such as 'above the cup', or x,y,z in metres")
    return values


def _unit(quaternion: Array) -> Array:
    norm = float(np.linalg.norm(quaternion))
    if norm < 1e-9:
        raise RequestError("a place's quaternion (wxyz) has length zero")
    return quaternion / norm


def _text(place: Place) -> str:
    if isinstance(place, SceneObject):
        return place.name
    return place if isinstance(place, str) else ", ".join(f"{float(x):g}" for x in np.ravel(np.asarray(place)))


def _via(asked: _AskedPlace, shown: taskframes.PathDistribution) -> Via:
    """A place as a via-point."""
    i = _slot(shown.phases, asked)
    value, known = shown.mean[i].copy(), np.zeros(shown.mean.shape[1], dtype=bool)
    value[:3], known[:3] = asked.position, True
    if asked.orientation is not None:
        if shown.base is None:
            raise RequestError(f"{asked.named} asks for an orientation, but the demonstrations had none")
        value[3:], known[3:] = taskframes.logarithm(shown.base, asked.orientation[None])[0], True
    return Via(float(shown.phases[i]), value, known)


def _value(vias: Sequence[Via], phase: float, moved: ArrayLike = 0.0) -> Array | None:
    """The pose that is asked for at a phase, less what instructions moved it by."""
    return next((via.value - np.asarray(moved) for via in vias if via.phase == phase), None)


def _slot(phases: Array, asked: _AskedPlace) -> int:
    return int(np.argmin(np.abs(phases - (0.0 if asked.phase is None else asked.phase))))


def _with(phases: Array, placed: Sequence[_AskedPlace]) -> Array:
    """Phases of which the nearest ones are replaced by those of places."""
    slots = [_slot(phases, one) for one in placed]
    if len(set(slots)) < len(slots):
        problem = "two places are asked for at nearly the same phase"
        raise RequestError(f"{problem}; move them apart or ask for more waypoints")
    exact = phases.copy()
    exact[slots] = [one.phase for one in placed]
    if (np.diff(exact) <= 0).any() or exact[0] != 0.0 or exact[-1] != 1.0:
        raise RequestError("a via-point lies too near to an end; move it or ask for more waypoints")
    return exact


def _away(position: Array, shown: taskframes.PathDistribution) -> tuple[Array, Array]:
    """How far a position is from the mean at each phase (T,): in metres, and in standard deviations."""
    off = position - shown.mean[:, :3]
    covariance = shown.covariance[:, :3, :3] + (1e-6 * np.eye(3))
    squared = np.einsum("ti,ti->t", off, np.linalg.solve(covariance, off[:, :, None])[:, :, 0])
    return np.linalg.norm(off, axis=1), np.sqrt(squared)


def _likeliest(asked: _AskedPlace, shown: taskframes.PathDistribution) -> float:
    """The phase at which a place is least unusual; the ends are left to the start and the goal."""
    return float(shown.phases[1:-1][int(np.argmin(_away(asked.position, shown)[1][1:-1]))])
