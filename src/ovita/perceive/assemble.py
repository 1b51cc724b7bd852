"""From views to a scene: take each view apart, fit a shape to each thing, and merge what several views saw."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ovita.errors import SceneError
from ovita.io.clouds import PointCloud
from ovita.limits.problem import is_support
from ovita.paths.scene import Frame, Scene, SceneObject, canonical, quaternion
from ovita.paths.trajectory import Array
from ovita.perceive.detect import FEWEST, Detector, Found, Sighting, clusters, mask_of, sighting
from ovita.perceive.doubts import doubts, strange_sizes
from ovita.perceive.evidence import Evidence, evidence_of, joined
from ovita.perceive.fit import fit
from ovita.perceive.looks import Look, assign, colour_of, distinct, names_of_support, support_word
from ovita.perceive.segment import Footing, Plane, Segments, description, segment, support_object
from ovita.perceive.solids import Solid
from ovita.perceive.space import SpaceSegments, taken_apart
from ovita.perceive.view import Mask, View

COLOURS = 400
"""Most pixels of a thing, in each view, whose colour is looked at."""

HIDDEN = 0.2
"""Share of its outline behind other things from which a thing counts as partly hidden."""

APART = 0.03
"""Supports of several views that differ by more are not the same [m]."""


@dataclass(frozen=True, eq=False)
class Perceived:
    """What was seen.

    Args:
        scene: The objects; `extra` of each says its shape and colour, on how many depth pixels (`points`) and views
            (`seen_by`) it rests, and how far the pixels are from its surface (`spread_mm`, the median). What they stand
            on is the last of them, of the kind "support".
        notes: What a person should know, each a sentence.
        refused: What was found but not taken, each a sentence with the reason.
        missing: The person's names that nothing was given, each a sentence with the reason.
    """

    scene: Scene
    support: Plane | None = None
    notes: tuple[str, ...] = ()
    refused: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()

    @property
    def things(self) -> tuple[SceneObject, ...]:
        """The objects without what they stand on."""
        return tuple(item for item in self.scene if not is_support(item))

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
    plane: str | float = "auto",
) -> Perceived:
    """Make a scene of what cameras saw.

    Args:
        views: At least one; their poses are in the world of the scene.
        names: What the person calls the things: "red cup", or "cup=red box" where the name and the look differ.
        text: What the person says about the scene.
        detector: Finds and names things; None takes each cluster of depth above the support for a thing.
        frame: Of the world: which way is up.
        plane: "auto" looks for a level support, a number is its height [m], and "none" fits shapes in space.

    Raises:
        SceneError: Without views, or with a plane or a name that cannot be.
    """
    if not views:
        raise SceneError("there is no view to look at", key="views")
    axes = Frame(frame) if isinstance(frame, str) else frame
    up = axes.direction("up")
    given = _height(plane, up)
    parts = [segment(view, up, given, find_plane=plane == "auto") for view in views]
    ground = _Ground.of(parts, up)
    things: list[_Thing] = []
    refused: list[str] = []
    notes, said = [*_notes(views, parts, ground, plane), *doubts(views, parts, up, level=plane == "auto")], ""
    for number, (view, part) in enumerate(zip(views, parts, strict=True)):
        seen = sighting(detector, view, names, text) if detector else Sighting(clusters(part))
        notes += list(seen.notes)
        said = said or seen.environment
        new, without = _things(seen.found, view, part, number, ground, rough=len(views) > 1)
        refused += without
        things = _merged(things, _whole(new, ground), ground)
    things = _settled([thing.refined(ground) for thing in things], ground)
    return _result(things, ground, axes, names, said or text, notes, tuple(refused))


def perceive_clouds(
    clouds: Sequence[PointCloud],
    *,
    names: Sequence[str] = (),
    text: str = "",
    frame: Frame | str = "flu",
    plane: str | float = "auto",
) -> Perceived:
    """Make a scene of point clouds, where there is no picture: things are clusters in space.

    At least one cloud, in the world of the scene; the rest is as for `perceive`, and colours count where every cloud
    has them.

    Raises:
        SceneError: Without clouds, or with a plane or a name that cannot be.
    """
    if not clouds:
        raise SceneError("there is no point cloud to look at", key="clouds")
    axes = Frame(frame) if isinstance(frame, str) else frame
    up = axes.direction("up")
    parts = taken_apart(clouds, up, FEWEST, _height(plane, up), find_plane=plane == "auto")
    ground = _Ground.of([parts], up)
    things = [_Thing.of(Found("", None, _WHOLE), one.evidence, one.colours, 0, ground) for one in parts.clusters]
    notes = [note for cloud in clouds for note in cloud.notes]
    if parts.large:
        notes.append(f"{_things_are(parts.large)} left out: as large as a wall or another piece of furniture")
    if ground.plane is None and plane == "auto":
        notes.append("no level support was found, so shapes were fitted in space")
    return _result(things, ground, axes, names, text, notes)


def _result(
    things: Sequence[_Thing],
    ground: _Ground,
    axes: Frame,
    names: Sequence[str],
    text: str,
    notes: list[str],
    refused: tuple[str, ...] = (),
) -> Perceived:
    base = ground.object(axes.direction("up"))
    called, rest = names_of_support(names, base.name if base else "")
    named, unplaced = _named(things, rest)
    *labels, called = distinct([*named, called])
    objects = [thing.object(label, ground) for thing, label in zip(things, labels, strict=True)]
    supports = [replace(base, name=called)] if base else []
    remarks = [note for thing, label in zip(things, labels, strict=True) for note in thing.remarks(label)]
    scene = Scene((*objects, *supports), axes, text)
    scene = scene if text else replace(scene, environment=description(scene))
    said = tuple(dict.fromkeys([*notes, *remarks, *strange_sizes(objects)]))
    return Perceived(scene, ground.plane, said, refused, unplaced)


_WHOLE = (0.0, 0.0, 1.0, 1.0)


def _height(plane: str | float, up: Array) -> Plane | None:
    if isinstance(plane, str):
        if plane not in ("auto", "none"):
            raise SceneError(f"is {plane!r}, expected auto, none or a height in metres", key="plane")
        return None
    if not np.isfinite(plane):
        raise SceneError(f"is {plane}, not a height in metres", key="plane")
    return Plane(up, float(plane))


def _notes(views: Sequence[View], parts: Sequence[Segments], ground: _Ground, plane: str | float) -> list[str]:
    """What a person should know about the pictures as a whole."""
    notes = []
    if plane == "auto" and ground.plane is None:
        notes.append("no level support was found, so shapes were fitted in space; sides that nobody saw are guesses")
    supports = [part.support.offset for part in parts if part.support is not None]
    if supports and np.ptp(supports) > APART:
        heights = ", ".join(f"{height:.3f}" for height in supports)
        notes.append(f"the views disagree on the height of the support ({heights} m); check the cameras' poses")
    for view, part in zip(views, parts, strict=True):
        notes += _view_notes(view, part, "" if len(views) == 1 else f" in {view.name}")
    return notes


def _view_notes(view: View, part: Segments, where: str) -> Iterator[str]:
    if part.beyond:
        yield f"{_things_are(part.beyond)} left out{where}: not on the support"
    if part.backdrops:
        yield f"{_things_are(part.backdrops)} left out{where}: taken for a wall"
    if view.seen.mean() < 0.5:
        share = f"{100 * view.seen.mean():.0f} %"
        yield f"only {share} of the pixels have depth{where}; glass, gloss and what is too near have none"


def _things_are(count: int) -> str:
    return "1 thing was" if count == 1 else f"{count} things were"


def _things(
    found: Sequence[Found], view: View, part: Segments, number: int, ground: _Ground, *, rough: bool
) -> tuple[list[_Thing], list[str]]:
    """What was found in one view as fitted things, and a sentence for each that has too few pixels."""
    things, refused = [], []
    for item in found:
        if item.mask is None and support_word(item.label) and part.footing is not None:
            continue  # the support is in the scene by itself, and its box holds everything on it
        mask = mask_of(item, part.labels)
        evidence = evidence_of(view, mask, part)
        if evidence.pixels < FEWEST:
            what = item.label or "a thing"
            refused.append(f"{what}: {evidence.pixels} pixels with depth in {view.name}; {FEWEST} are needed")
            continue
        things.append(_Thing.of(item, evidence, _sample(view, mask), number, ground, rough=rough))
    return things, refused


def _sample(view: View, mask: Mask) -> Array:
    """Colours of some pixels of a mask, (N, 3); none without a picture."""
    if view.rgb is None:
        return np.zeros((0, 3))
    pixels = view.rgb[mask]
    return np.asarray(pixels[:: max(1, len(pixels) // COLOURS)], dtype=float)


def _named(things: Sequence[_Thing], names: Sequence[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """A name for each thing, its detector's, else the person's that fits, else colour and shape; names not used up."""
    looks = [thing.look for thing in things]
    found = {canonical(thing.label) for thing in things if thing.label}
    if found:
        wanted = [text.partition("=")[0].strip() for text in names]
        missing = tuple(f"{name}: not found" for name in wanted if canonical(name) not in found)
        return distinct([thing.label or look.words for thing, look in zip(things, looks, strict=True)]), missing
    given, unplaced = assign(names, looks)
    return distinct([given.get(i) or look.words for i, look in enumerate(looks)]), unplaced


@dataclass(frozen=True, eq=False)
class _Ground:
    """Axes in which fits are made: z up, zero on the support where there is one."""

    axes: Array
    origin: Array
    plane: Plane | None
    footings: tuple[Footing, ...] = ()

    def object(self, up: Array) -> SceneObject | None:
        """What things stand on, as an object of the scene; None where it was not seen."""
        return None if self.plane is None else support_object(self.plane, up, self.footings)

    @classmethod
    def of(cls, parts: Sequence[Segments | SpaceSegments], up: Array) -> _Ground:
        """From the supports that the views show, their mean."""
        planes = [part.support for part in parts if part.support is not None]
        normal = np.mean([p.normal for p in planes], axis=0) if planes else up
        normal = normal / np.linalg.norm(normal)
        side = np.eye(3)[int(np.abs(normal).argmin())]
        first = np.cross(side, normal)
        first = first / np.linalg.norm(first)
        rows = np.array([first, np.cross(normal, first), normal])
        if not planes:
            return cls(rows, np.zeros(3), None)
        offset = float(np.mean([p.offset for p in planes]))
        footings = tuple(part.footing for part in parts if part.footing is not None)
        return cls(rows, offset * normal, Plane(normal, offset), footings)


@dataclass(frozen=True, eq=False)
class _Thing:
    """One thing, as far as it is known: in the axes of the ground."""

    label: str
    evidence: Evidence
    solid: Solid
    colours: Array
    views: tuple[int, ...]
    rough: bool = False

    @classmethod
    def of(
        cls, found: Found, evidence: Evidence, colours: Array, view: int, ground: _Ground, *, rough: bool = False
    ) -> _Thing:
        """Fitted to the pixels of a finding."""
        local = evidence.turned(ground.axes, ground.origin)
        solid = fit(local, supported=ground.plane is not None, rough=rough)
        return cls(found.label, local, solid, colours, (view,), rough)

    def refined(self, ground: _Ground) -> _Thing:
        """Fitted to all of its evidence."""
        if not self.rough:
            return self
        solid = fit(self.evidence, supported=ground.plane is not None, hints=(self.solid, self.solid))
        return replace(self, solid=solid, rough=False)

    def with_(self, other: _Thing, ground: _Ground) -> _Thing:
        """Both taken for one."""
        views = tuple(sorted({*self.views, *other.views}))
        evidence = joined([self.evidence, other.evidence], len(views))
        solid = fit(evidence, supported=ground.plane is not None, hints=(self.solid, other.solid))
        return _Thing(self.label or other.label, evidence, solid, np.vstack([self.colours, other.colours]), views)

    @property
    def look(self) -> Look:
        """Its colour and shape."""
        return Look(colour_of(self.colours), self.solid.kind if self.solid.regular else "irregular")

    def object(self, name: str, ground: _Ground) -> SceneObject:
        """As an object of a scene."""
        solid, look = self.solid.turned(ground.axes, ground.origin), self.look
        extra: dict[str, object] = {"shape": look.shape, **({"colour": look.colour} if look.colour else {})}
        extra |= {"seen_by": len(self.views), "points": self.evidence.pixels}
        extra |= {"spread_mm": round(1000.0 * solid.spread, 1)} if solid.regular else {}
        flags = (("tilted", solid.tilted), ("cut", self.evidence.cut), ("partly_hidden", self.evidence.hidden > HIDDEN))
        extra |= {key: True for key, holds in flags if holds}
        center, size = np.round(solid.center, 4) + 0.0, np.round(solid.size, 4)
        return SceneObject(name, center, size, quaternion(solid.rotation), extra)

    def remarks(self, name: str) -> list[str]:
        """What a person should know about how it was seen."""
        said = []
        if not self.solid.regular:
            said.append(f"{name} is no box, cylinder or ball; the box around what was seen of it stands for it")
        if self.evidence.cut:
            said.append(f"{name} is cut off by the edge of the picture; it may be larger")
        elif self.evidence.hidden > HIDDEN:
            said.append(f"{name} is partly hidden by something nearer; it may be larger")
        return said


def _whole(things: list[_Thing], ground: _Ground) -> list[_Thing]:
    """Things of one view, the parts that something nearer cuts a thing into taken together.

    Two parts are one thing if one shape explains both as well as two shapes do.
    """
    left = list(things)
    for thing in sorted(things, key=lambda one: one.evidence.pixels):
        for other in [one for one in left if one is not thing and _may_belong(thing, one)]:
            both = other.with_(thing, ground)
            if thing in left and both.solid.loss < 1.15 * max(thing.solid.loss, other.solid.loss) + 0.03:
                left = [one for one in left if one is not thing and one is not other] + [both]
    return left


def _may_belong(one: _Thing, other: _Thing) -> bool:
    """Whether two parts are hidden in part, alike in colour, and near each other for their size."""
    if min(one.evidence.hidden, other.evidence.hidden) < 0.08 or one.label != other.label:
        return False
    gap = np.linalg.norm(one.solid.center - other.solid.center)
    near = bool(gap < 0.75 * (np.linalg.norm(one.solid.size) + np.linalg.norm(other.solid.size)))
    return near and colour_of(one.colours) == colour_of(other.colours)


def _merged(known: list[_Thing], seen: list[_Thing], ground: _Ground) -> list[_Thing]:
    """Things of the views before with those of one more, the ones in the same place taken together."""
    left = list(known)
    for thing in seen:
        for one in [one for one in left if _same_place(one.solid, thing.solid)]:
            left.remove(one)
            thing = one.with_(thing, ground)
        left.append(thing)
    return left


def _settled(things: Sequence[_Thing], ground: _Ground) -> list[_Thing]:
    """Things with those taken together that only their better fits put in the same place: of different views."""
    left: list[_Thing] = []
    for thing in things:
        apart = [one for one in left if {*one.views} & {*thing.views}]
        left = apart + _merged([one for one in left if one not in apart], [thing], ground)
    return left


def _same_place(one: Solid, other: Solid) -> bool:
    """Whether one solid holds the centre of the other, and the other way round or nearly."""
    gap = other.center - one.center
    return any(bool((np.abs(each.rotation.T @ gap) < 0.5 * each.size + 0.005).all()) for each in (one, other))
