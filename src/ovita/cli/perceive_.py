"""`ovita perceive`: from pictures with depth to a scene file."""

from __future__ import annotations

import os

import click

from ovita.cli.common import plain, section, show_notes, waiting
from ovita.errors import FormatError, RequestError
from ovita.io import atomic_write, scene_dict
from ovita.io.json_ import dumps
from ovita.paths.scene import Scene, SceneObject
from ovita.perceive import Perceived, perceive
from ovita.perceive.pictures import views_from

EXIT_NOTHING = 3


@click.command()
@click.argument("places", metavar="PICTURE...", nargs=-1, required=True)
@click.option("--out", "-o", metavar="FILE", help="Write the scene (JSON), for ovita adapt --scene.")
@click.option("--camera", metavar="FILE", help="Intrinsics and pose of loose pictures. [camera.json in each folder]")
@click.option("--names", metavar="A,B", help="What you call the things: 'red cup, ball', or 'cup=red, bin=blue box'.")
@click.option("--text", default="", help="What you say about the scene; it becomes its environment.")
@click.option(
    "--frame", type=click.Choice(["rfu", "flu", "ned"]), default="flu", show_default=True, help="Of the camera's world."
)
@click.option(
    "--plane",
    default="auto",
    show_default=True,
    metavar="auto|none|Z",
    help="What things rest on; Z is its height [m].",
)
@click.option("--picture", metavar="FILE", help="Draw what was found over the first view (.png).")
@click.option("--json", "as_json", is_flag=True, help="Print the scene as JSON instead of a report.")
def command(
    places: tuple[str, ...],
    out: str | None,
    camera: str | None,
    names: str | None,
    text: str,
    frame: str,
    plane: str,
    picture: str | None,
    as_json: bool,
) -> None:
    """Find the things in PICTUREs with depth, and where they are: centre, size and orientation.

    A PICTURE is a folder with depth.png (16-bit, millimetres) or depth.npy (metres), rgb.png or rgb.jpg and
    camera.json, one folder a view; an .npz file of all in one; or a depth and a colour file with --camera. Several
    views are merged. camera.json holds intrinsics (3x3, or fx, fy, cx, cy) and pose (4x4, camera to world).

    Then: ovita adapt PATH.csv "Keep 10 cm away from the red cup" --scene SCENE.json

    Exit code 3 where nothing was found.
    """
    _check(out, picture)
    level = plane if plane in ("auto", "none") else _height(plane)
    views = views_from(places, camera)
    with waiting("looking", quiet=as_json):
        seen = perceive(views, names=_listed(names), text=text, frame=frame, plane=level)
    written = _write(seen, out)
    if picture:
        from ovita.perceive.overlay import overlay

        atomic_write(picture, overlay(views[0], seen.scene))
        written.append(picture)
    if as_json:
        click.echo(dumps(document(seen.scene), "the scene").rstrip())
    else:
        _show(seen)
    show_notes((*seen.notes, *(f"not taken: {each}" for each in seen.refused)))
    if not as_json:
        for path in written:
            click.echo(plain(f"wrote {path}"))
    raise SystemExit(0 if len(seen.scene) else EXIT_NOTHING)


def _check(out: str | None, picture: str | None) -> None:
    """Refuse files that cannot be written before anything is."""
    for path, ending in ((out, ".json"), (picture, ".png")):
        if path and not path.lower().endswith(ending):
            raise FormatError(path, f"name a {ending} file")
        if path and not os.path.isdir(os.path.dirname(path) or "."):
            raise FormatError(path, "its folder does not exist; make it first")


def _height(plane: str) -> float:
    try:
        return float(plane)
    except ValueError:
        raise RequestError(f"--plane {plane}: say auto, none, or a height in metres") from None


def _listed(names: str | None) -> tuple[str, ...]:
    return tuple(part.strip() for part in (names or "").split(",") if part.strip())


def document(scene: Scene) -> dict[str, object]:
    """A scene as a document that always states its frame."""
    return {**scene_dict(scene), "frame": scene.frame.name}


def _write(seen: Perceived, out: str | None) -> list[str]:
    if out is None:
        return []
    atomic_write(out, dumps(document(seen.scene), out))
    return [out]


def _show(seen: Perceived) -> None:
    """Print what was found."""
    click.echo(plain(seen.environment or "Nothing was found."))
    section("Objects", [_line(item) for item in seen.scene])


def _line(item: SceneObject) -> str:
    place = ", ".join(f"{value:.3f}" for value in item.position)
    size = " x ".join(f"{value:.3f}" for value in item.size)
    known = item.extra
    views = "1 view" if known["seen_by"] == 1 else f"{known['seen_by']} views"
    spread = f", spread {known['spread_mm']} mm" if "spread_mm" in known else ""
    flags = "".join(f", {word.replace('_', ' ')}" for word in ("tilted", "cut", "partly_hidden") if known.get(word))
    return f"{item.name}: at ({place}) m, {size} m; {known['points']} pixels in {views}{spread}{flags}"
