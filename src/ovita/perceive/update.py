"""Looking again: which object of a scene is which of those seen now, and what that changes for a path."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from ovita.limits import ConstraintCheck
from ovita.limits.problem import is_support, top_of
from ovita.limits.verify import verify
from ovita.paths.geometry import dots
from ovita.paths.scene import Frame, Scene, SceneObject, canonical
from ovita.paths.trajectory import Array
from ovita.perceive.looks import distinct
from ovita.perceive.segment import description, with_objects
from ovita.perceive.view import View, landing
from ovita.result import Adaptation, Postcondition
from ovita.text import length, listed, the
from ovita.toolkit import judge
from ovita.toolkit.catalogue import Expectation

STILL = 0.015
"""An object whose centre was found nearer to where it was has not moved: cameras err by that much [m]."""

ALIKE = 0.35
"""Sizes that differ by more, relative and over the edges on average, are those of different things."""

REACH = 3.0
"""An object is not looked for farther from where it was [m]."""

UNLIKE = 1.0
"""Cost from which two objects are not the same."""

BEHIND, BEHIND_FAR = 0.008, 0.004
"""A camera sees through the place of a surface if it measures farther than it by this much [m], and this for each
square metre of its squared distance."""

ODD = 0.2
"""The same for what is no box, cylinder or ball, in longest edges: its box is around the side that was seen."""

THROUGH = 0.6
"""Share of an object's visible surface that must be seen through for the object to be gone."""

SEEN, LABEL, SHAPE, COLOUR = "seen_by", "seen_as", "shape", "colour"
"""Keys of a perceived object's extra data."""


@dataclass(frozen=True)
class FoundAgain:
    """An object of the scene before, and the one seen now that it is."""

    before: SceneObject
    now: SceneObject

    @property
    def shift(self) -> Array:
        """How far its centre moved, (3,) [m]."""
        return self.now.position - self.before.position

    @property
    def moved(self) -> bool:
        """Whether it moved by more than cameras err; of a table or floor, each view shows another part."""
        odd = "irregular" in (self.before.extra.get(SHAPE), self.now.extra.get(SHAPE))
        still = max(STILL, ODD * float(self.now.size.max())) if odd else STILL
        return not is_support(self.now) and float(np.linalg.norm(self.shift)) > still


@dataclass(frozen=True, eq=False)
class SceneUpdate:
    """A scene after another look.

    Args:
        scene: The objects as they are now, under the names that they had; what was not in sight stays.
        gone: What is not where it was, though the cameras see the place.
        unseen: What the cameras cannot see now, or was not perceived in the first place; it stays as it was.
    """

    scene: Scene
    matches: tuple[FoundAgain, ...] = ()
    new: tuple[SceneObject, ...] = ()
    gone: tuple[SceneObject, ...] = ()
    unseen: tuple[SceneObject, ...] = ()

    @property
    def changed(self) -> bool:
        """Whether anything moved, came or went."""
        return bool(self.new or self.gone or any(match.moved for match in self.matches))

    def sentences(self) -> list[str]:
        """What changed, each a sentence."""
        frame = self.scene.frame
        said = [f"{_name(m.now)} moved {_words(m.shift, frame)}." for m in self.matches if m.moved]
        still = [the(m.now.name) for m in self.matches if not (m.moved or is_support(m.now))]
        said += [f"{_capital(listed(still))} did not move."] if still else []
        said += [f"{_name(item)} is new." for item in self.new]
        said += [f"{_name(item)} is gone." for item in self.gone]
        said += [f"{_name(item)} is out of sight, and was left as it was." for item in self.unseen]
        return said


def update(before: Scene, seen: Scene, views: Sequence[View] = ()) -> SceneUpdate:
    """Match the objects of a scene with those seen now.

    Things are told apart by name, or by what they were seen as, by size, colour and shape, and by how far they would
    have moved; the assignment of least cost over all of them counts. Names that a person gave stay.

    What is seen is turned into the frame of the scene before. An object that was there is gone only where one of the
    views sees its place.
    """
    seen = seen.in_frame(before.frame)
    pairs = _assigned(before.objects, seen.objects)
    matches = tuple(FoundAgain(old, _taken_over(old, new)) for old, new in pairs)
    missing = _without(before, [old for old, _ in pairs])
    gone = tuple(item for item in missing if SEEN in item.extra and sees_through(views, item))
    unseen = _without(missing, gone)
    kept = [*(m.now for m in matches), *unseen]
    came = _without(seen, [new for _, new in pairs])
    names = distinct([item.name for item in came], [item.name for item in kept])
    new = tuple(replace(item, name=name) for item, name in zip(came, names, strict=True))
    order = {canonical(item.name): i for i, item in enumerate(before)}
    kept.sort(key=lambda item: order[canonical(item.name)])
    said = "" if seen.environment == description(seen) else seen.environment
    scene = with_objects(before, (*kept, *new))
    scene = replace(scene, environment=said or scene.environment or description(scene))
    return SceneUpdate(scene, matches, new, gone, unseen)


def _without(items: Iterable[SceneObject], taken: Sequence[SceneObject]) -> tuple[SceneObject, ...]:
    """The objects that are none of those taken; two that are equal are two."""
    gone = {id(item) for item in taken}
    return tuple(item for item in items if id(item) not in gone)


def _assigned(old: Sequence[SceneObject], new: Sequence[SceneObject]) -> list[tuple[SceneObject, SceneObject]]:
    """Which is which, where they are alike."""
    if not old or not new:
        return []
    costs = np.array([[_unlikeness(a, b) for b in new] for a in old])
    rows, columns = linear_sum_assignment(np.minimum(costs, UNLIKE))  # not to be matched costs as much
    return [(old[i], new[j]) for i, j in zip(rows, columns, strict=True) if costs[i, j] < UNLIKE]


def _unlikeness(old: SceneObject, new: SceneObject) -> float:
    """How little two objects are alike: `UNLIKE` and more for different things."""
    if is_support(old) or is_support(new):
        return 0.0 if _same_level(old, new) else 10.0 * UNLIKE
    away, unlike = float(np.linalg.norm(new.position - old.position)), _sizes_differ(old, new)
    named = canonical(new.name) in {canonical(old.name), canonical(str(old.extra.get(LABEL, "")))}
    there = old.cuboid.signed(new.position[None])[0][0] < STILL
    stranger = SEEN not in old.extra and not (named or there)  # written by hand, so nobody knows how it looks
    if stranger or away > REACH or (old.dimensions is not None and unlike > ALIKE and not (named and there)):
        return 10.0 * UNLIKE
    looks = 0.25 * (not named) + 0.45 * _differ(old, new, COLOUR) + 0.15 * _differ(old, new, SHAPE)
    return float(looks + 0.5 * unlike / ALIKE * (old.dimensions is not None) + 0.3 * min(away, 1.0) - 0.3 * there)


def _sizes_differ(old: SceneObject, new: SceneObject) -> float:
    """Mean logarithm of the ratio of their edges, longest to longest."""
    return float(np.abs(np.diff(np.log(np.sort(np.maximum([old.size, new.size], 1e-3))), axis=0)).mean())


def _differ(old: SceneObject, new: SceneObject, key: str) -> bool:
    """Whether both say a thing about themselves, and not the same."""
    return key in old.extra and key in new.extra and old.extra[key] != new.extra[key]


def _same_level(old: SceneObject, new: SceneObject) -> bool:
    """Whether two things are supports at one height, and one of them reaches over the other."""
    if not (is_support(old) and is_support(new)):
        return False
    up, gap = old.rotation[:, 2], top_of(new) - top_of(old)
    level = gap - (gap @ up) * up
    return bool(abs(gap @ up) < 2.0 * STILL and np.linalg.norm(level) < 0.5 * (max(old.size) + max(new.size)))


def _taken_over(old: SceneObject, new: SceneObject) -> SceneObject:
    """Of two looks at one thing, the one that rests on more: seen whole, by more views; if they are equal, the later.

    What moved is where it was seen last. It keeps its name, and what the scene said of it beyond what is seen.
    """
    later = SEEN not in old.extra or FoundAgain(old, new).moved or _foundation(old) <= _foundation(new)
    kept = new if later else old
    label = {} if canonical(new.name) == canonical(old.name) else {LABEL: new.name}
    return replace(kept, name=old.name, extra={**old.extra, **kept.extra, **label})


def _foundation(item: SceneObject) -> tuple[float, ...]:
    """What a perceived object rests on, to be compared: of a support its extent, of a thing if it was seen whole."""
    if is_support(item):
        return (float(np.prod(item.size[:2])),)
    whole = not (item.extra.get("cut") or item.extra.get("partly_hidden"))
    return (float(whole), float(item.extra[SEEN]))


def sees_through(views: Sequence[View], item: SceneObject) -> bool:
    """Whether some view measures what lies behind most of the surface that an object would show it."""
    return any(_share_behind(view, item) > THROUGH for view in views)


def _share_behind(view: View, item: SceneObject) -> float:
    """Share of the surface that an object would show a view and that the view sees through, 0..1."""
    local = _FACES * item.size / 2.0
    points = local @ item.rotation.T + item.position
    points = points[dots(_NORMALS @ item.rotation.T, view.center - points) > 0]
    known, rows, columns = landing(view.project(points), view.shape)
    away = (points - view.center) @ view.pose[:3, 2]
    with np.errstate(invalid="ignore"):
        through = known & (view.depth[rows, columns] > away + BEHIND + BEHIND_FAR * away**2)
    return float(through.mean()) if len(through) else 0.0


def _faces() -> tuple[Array, Array]:
    """Points (150, 3) on the faces of the cube from -1 to 1, and the normals there."""
    grid = np.stack(np.meshgrid(*[np.linspace(-0.8, 0.8, 5)] * 2), axis=-1).reshape(-1, 2)
    faces = [(axis, side) for axis in range(3) for side in (-1.0, 1.0)]
    points = [np.insert(grid, axis, side, axis=1) for axis, side in faces]
    return np.concatenate(points), np.repeat([side * np.eye(3)[axis] for axis, side in faces], len(grid), axis=0)


_FACES, _NORMALS = _faces()


def _name(item: SceneObject) -> str:
    return _capital(the(item.name))


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _words(shift: Array, frame: Frame) -> str:
    parts = [f"{length(amount)} {word}" for word, amount in frame.words(shift).items() if amount >= 0.005]
    return listed(parts) or length(float(np.linalg.norm(shift)))


# What it changes for a path


@dataclass(frozen=True, eq=False)
class PathImpact:
    """What a changed scene means for an adapted path that stays as it is.

    Args:
        broken: Limits that held in the scene before and do not hold now.
        lost: Promises that were kept and are not now.
        clearances: Least distance to each object's surface before and now [m]; None where it is not in that scene.
    """

    broken: tuple[ConstraintCheck, ...]
    lost: tuple[Postcondition, ...]
    clearances: Mapping[str, tuple[float | None, float | None]]

    @property
    def holds(self) -> bool:
        """Whether the path is as good as before."""
        return not (self.broken or self.lost)

    def sentences(self) -> list[str]:
        """What changed for the path, each a sentence."""
        said = [_broken(check) for check in self.broken]
        said += [f"No longer as meant: {promise.text}; now {promise.outcome}." for promise in self.lost]
        for name, (old, new) in self.clearances.items():
            if new is not None and (old is None or abs(new - old) > 1e-3):
                was = "" if old is None else f", it was {length(old)}"
                said.append(f"Clearance to {the(name)} is {length(new)}{was}.")
        broken = "The path no longer holds; adapt it again with the new scene."
        return ["The path still holds." if self.holds else broken, *said]


def impact(result: Adaptation, scene: Scene) -> PathImpact:
    """Judge an adapted path in another scene by the limits and promises of its adaptation; nothing is solved again."""
    scene = scene.in_frame(result.scene.frame)
    broke, broken = _broken_limits(result, result.scene), _broken_limits(result, scene)
    kept = [_again(result, promise, scene) for promise in result.postconditions if promise.held and promise.kind]
    lost = tuple(promise for promise in kept if not promise.held)
    return PathImpact(
        tuple(check for key, check in broken.items() if key not in broke), lost, _clearances(result, scene)
    )


def _broken(check: ConstraintCheck) -> str:
    subject = f" ({check.subject})" if check.subject else ""
    amount = length(check.violation_after) if check.unit == "m" else f"{check.violation_after:.3g} {check.unit}"
    return f"The limit {check.name}{subject}, {check.limit}, is broken by {amount}."


def _broken_limits(result: Adaptation, scene: Scene) -> dict[tuple[str, str], ConstraintCheck]:
    """The limits that an adapted path breaks in a scene, by name and subject."""
    contacts = [name for name in result.contacts if name in scene]
    compared: dict[str, Any] = {"proposed": result.adapted, "original": result.original, "contacts": contacts}
    checks = verify(result.adapted, scene, result.robot, **compared, options=result.options)
    return {(check.name, check.subject): check for check in checks if not check.held}


def _again(result: Adaptation, promise: Postcondition, scene: Scene) -> Postcondition:
    expectation = Expectation(promise.kind, promise.arguments, promise.text)
    outcome = judge(expectation, result.original.to_array(), result.adapted.to_array(), scene)
    return replace(promise, held=outcome.held, outcome=outcome.sentence)


def _clearances(result: Adaptation, scene: Scene) -> dict[str, tuple[float | None, float | None]]:
    path = result.adapted.positions
    least = [{item.name: item.cuboid.closest(path)[0] for item in place} for place in (result.scene, scene)]
    names = dict.fromkeys([*least[0], *least[1]])
    return {name: (least[0].get(name), least[1].get(name)) for name in names}
