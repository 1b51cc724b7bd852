"""`ovita perceive`: from pictures with depth, recordings and point clouds to a scene file."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import click
from click import option

from ovita.cli.common import EXIT_NOTHING, FRAMES, check_writable, names_in, say, section, show_notes, shown, waiting
from ovita.errors import FormatError, RequestError
from ovita.io import atomic_write, load_scene, scene_dict
from ovita.io.json_ import dumps
from ovita.paths.scene import Scene, SceneObject
from ovita.perceive import Perceived, perceive, regions
from ovita.perceive.assemble import perceive_clouds
from ovita.perceive.detect import detector_named
from ovita.perceive.pictures import gathered
from ovita.perceive.recordings import Recorded, RecordingChoices, load_mount
from ovita.perceive.update import SceneUpdate, impact, update
from ovita.result import Adaptation


@click.command()
@click.argument("places", metavar="PICTURE...", nargs=-1, required=True)
@option("--out", "-o", metavar="FILE", help="Write the scene (JSON), for ovita adapt --scene.")
@option("--camera", metavar="FILE", help="Intrinsics and pose of loose pictures. [camera.json in each folder]")
@option("--names", metavar="A,B", help="What you call the things: 'red cup, ball', or 'cup=red, bin=blue box'.")
@option("--text", default="", help="What you say about the scene; it becomes its environment.")
@shown("--frame", type=FRAMES, default="flu", help="Of the camera's world.")
@shown("--plane", default="auto", metavar="auto|none|Z", help="What things rest on; Z is its height [m].")
@shown(
    "--detector",
    default="clusters",
    metavar="NAME",
    help="What finds and names things: clusters, vlm:PROVIDER:MODEL, onnx:ENCODER,DECODER, or vlm:...+onnx:....",
)
@option("--base-url", metavar="URL", help="An OpenAI-compatible server; --detector vlm:MODEL names its model.")
@option("--boxes", metavar="HOW", help="How a model writes boxes: gemini, qwen2.5, qwen3, glm, fractions. [by name]")
@option(
    "--without",
    multiple=True,
    metavar="WHAT",
    help="Leave out: a thing by its name (the arm in the picture), pixels x0,y0,x1,y1 of the first picture, or a box"
    " x0,y0,z0,x1,y1,z1 in the world [m]; again for more.",
)
@option("--crop", metavar="X0,Y0,X1,Y1", help="Look at these pixels of the first picture only.")
@option("--rgb", metavar="TOPIC", help="Topic of a bag's or a live camera's picture. [the only one]")
@option("--depth", metavar="TOPIC", help="Topic of a bag's depth. [the only one]")
@option("--cloud", metavar="TOPIC", help="Topic of a bag's point cloud, instead of depth.")
@option(
    "--at",
    type=float,
    multiple=True,
    metavar="SECONDS",
    help="When to look into a bag; again for more views. [its end]",
)
@option("--camera-frame", metavar="NAME", help="The camera's optical frame. [that of the messages]")
@option("--world-frame", metavar="NAME", help="The frame of the scene. [the root of the bag's transforms]")
@option("--pose", metavar="FILE", help="Where the camera is mounted (JSON): pose 4x4, and the frame that it is in.")
@option("--update", "old", metavar="SCENE", help="Match with this scene: what moved, came and went; names stay.")
@option("--result", metavar="FILE", help="With --update: what that changes for this adapted path.")
@option("--picture", metavar="FILE", help="Draw what was found over the first view (.png).")
@option("--json", "as_json", is_flag=True, help="Print the scene as JSON instead of a report.")
def command(places: tuple[str, ...], out: str | None, picture: str | None, as_json: bool, **given: Any) -> None:
    """Find the things in PICTUREs with depth, and where they are: centre, size and orientation.

    A PICTURE is a folder with depth.png (16-bit, millimetres) or depth.npy (metres), rgb.png or rgb.jpg and
    camera.json, one folder a view; an .npz file of all in one; or a depth and a colour file with --camera. Several
    views are merged. camera.json holds intrinsics (3x3, or fx, fy, cx, cy) and pose (4x4, camera to world).

    A PICTURE may also be a ROS bag, a live camera by the topic of its depth (ros2:/camera/depth/image_rect_raw), or a
    point cloud (.ply, .pcd, .npy with rows x, y, z).

    Then: ovita adapt PATH.csv "Keep 10 cm away from the red cup" --scene SCENE.json

    Exit code 3 where nothing was found, or nothing for one of the names.
    """
    _check(out, picture)
    if given["result"] and not given["old"]:
        raise RequestError("--result goes with --update SCENE, the scene that the path was adapted in")
    before = None if given["old"] is None else _earlier(given["old"])
    adapted = None if given["result"] is None else Adaptation.load(given["result"])
    there, seen = _looked(places, given, quiet=as_json)
    change = None if before is None else update(before, seen.scene, there.views)
    seen = seen if change is None else replace(seen, scene=change.scene)
    if out is not None:
        atomic_write(out, dumps(document(seen.scene), out))
    if picture:
        _draw(picture, there, seen)
    if as_json:
        click.echo(dumps(document(seen.scene), "the scene").rstrip())
    else:
        _report(seen, change, adapted)
    show_notes((*there.notes, *seen.notes, *(f"not taken: {each}" for each in (*seen.refused, *seen.missing))))
    say(*(f"wrote {path}" for path in (out, picture) if path and not as_json))
    raise SystemExit(0 if seen.things and not seen.missing else EXIT_NOTHING)


def _report(seen: Perceived, change: SceneUpdate | None, adapted: Adaptation | None) -> None:
    """Print what was found, what changed since the last look, and what that means for a path."""
    say(seen.environment or "Nothing was found.")
    section("Objects", [_line(item) for item in seen.scene])
    section("Since the last look", change.sentences() if change is not None else ())
    section("The path", impact(adapted, seen.scene).sentences() if adapted is not None else ())


def _earlier(file: str) -> Scene:
    """The scene of an earlier look."""
    scene, _ = load_scene(file)
    if not scene.objects:
        raise FormatError(file, "holds no objects to compare with; name the scene of an earlier look")
    return scene


def _looked(places: tuple[str, ...], given: dict[str, Any], *, quiet: bool) -> tuple[Recorded, Perceived]:
    """What there was to look at, without what is to be left out, and what was found in it."""
    leave = _Leave.of(given["without"], given["crop"])
    finder = detector_named(given["detector"], **{name: given[name] for name in ("frame", "base_url", "boxes")})
    options: dict[str, Any] = {"names": names_in(given["names"]), "plane": _level(given["plane"])}
    options |= {name: given[name] for name in ("text", "frame")}
    with waiting("looking", quiet=quiet):
        there = leave.out_of(gathered(places, camera=given["camera"], choices=_choices(given)))
        if there.views:
            seen = perceive(there.views, detector=finder, **options)
        elif finder is None:
            seen = perceive_clouds(there.clouds, **options)
        else:
            raise RequestError(f"a point cloud has no picture for --detector {given['detector']}; use clusters")
    return there, regions.without(seen, leave.names)


@dataclass(frozen=True)
class _Leave:
    """What is left out: things by name, regions, and all outside of one region."""

    names: tuple[str, ...]
    gone: tuple[regions.CutRegion, ...]
    crop: regions.CutRegion | None

    @classmethod
    def of(cls, without: tuple[str, ...], crop: str | None) -> _Leave:
        """From the options."""
        read = [(text, regions.region_from(text, "--without")) for text in without]
        names = tuple(part for text, region in read if region is None for part in names_in(text))
        inside = None if crop is None else regions.region_from(crop, "--crop", flat=True)
        if crop is not None and inside is None:
            raise RequestError(f"--crop {crop}: give four numbers, x0,y0,x1,y1 in pixels")
        return cls(names, tuple(region for _, region in read if region is not None), inside)

    def out_of(self, there: Recorded) -> Recorded:
        """What there is to look at, without the regions."""
        if not self.gone and self.crop is None:
            return there
        if there.clouds and self.crop is not None:
            raise RequestError("a point cloud has no pixels to --crop; use --without with a box in metres")
        views = regions.cropped(there.views, self.crop, self.gone)
        return replace(there, views=views, clouds=regions.thinned(there.clouds, self.gone) if there.clouds else ())


def _check(out: str | None, picture: str | None) -> None:
    """Refuse files that cannot be written before anything is."""
    for path, ending in ((out, ".json"), (picture, ".png")):
        if path and not path.lower().endswith(ending):
            raise FormatError(path, f"name a {ending} file")
        if path:
            check_writable(path)


def _choices(given: dict[str, Any]) -> RecordingChoices:
    mount = None if given["pose"] is None else load_mount(given["pose"])
    topics = {key: given[key] for key in ("rgb", "depth", "cloud", "at", "camera_frame", "world_frame")}
    return RecordingChoices(**topics, mount=mount)


def _draw(picture: str, there: Recorded, seen: Perceived) -> None:
    if not there.views:
        raise FormatError(picture, "a point cloud is no picture to draw over; leave --picture out")
    from ovita.perceive.pointed import overlay

    atomic_write(picture, overlay(there.views[0], seen.scene))


def _level(plane: str) -> str | float:
    """What things rest on: "auto", "none", or a height [m]."""
    if plane in ("auto", "none"):
        return plane
    try:
        return float(plane)
    except ValueError:
        raise RequestError(f"--plane {plane}: say auto, none, or a height in metres") from None


def document(scene: Scene) -> dict[str, object]:
    """A scene as a document that always states its frame."""
    return {**scene_dict(scene), "frame": scene.frame.name}


def _line(item: SceneObject) -> str:
    place = ", ".join(f"{value:.3f}" for value in item.position)
    size = " x ".join(f"{value:.3f}" for value in item.size)
    known = item.extra
    if "seen_by" not in known:
        return f"{item.name}: at ({place}) m, {size} m; not seen by a camera"
    views = "1 view" if known["seen_by"] == 1 else f"{known['seen_by']} views"
    spread = f", spread {known['spread_mm']} mm" if "spread_mm" in known else ""
    flags = "".join(f", {word.replace('_', ' ')}" for word in ("tilted", "cut", "partly_hidden") if known.get(word))
    assumed = "; its thickness is assumed" if known.get("assumed") == "thickness" else ""
    return f"{item.name}: at ({place}) m, {size} m; {known['points']} pixels in {views}{spread}{flags}{assumed}"
