"""Looking in one tab: pictures in, boxes over them, and what is accepted becomes one turn of the session.

What is uploaded is data: it is decoded and checked, and nothing in it is run.
"""

from __future__ import annotations

import base64
import io
import os
import tempfile
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ovita.errors import FormatError, RequestError
from ovita.limits.problem import is_support
from ovita.paths.scene import Scene, SceneObject
from ovita.studio import html
from ovita.studio.files import by_name
from ovita.studio.sessions import Desk
from ovita.text import listed

if TYPE_CHECKING:
    from ovita.perceive.pointed import Rectangle
    from ovita.perceive.recordings import Recorded
    from ovita.perceive.update import SceneUpdate
    from ovita.perceive.view import View

ENDINGS = (".png", ".jpg", ".jpeg", ".npy", ".json")
"""Endings of the files that are taken."""


@dataclass(frozen=True)
class _SeenRow:
    """A thing that was seen, whether a person takes it, and under which name."""

    item: SceneObject
    taken: Any
    name: Any


class LookPanel:
    """What a camera saw, for one tab.

    `offered` are folders of pictures and recordings that need no upload: shown name to path.
    """

    def __init__(self, desk: Desk, offered: Mapping[str, str]) -> None:
        self.desk, self._offered = desk, offered
        self._gui = gui = desk.client.gui
        self._files: dict[str, tuple[str, bytes]] = {}
        self._rows: list[_SeenRow] = []
        self._gone: list[tuple[SceneObject, Any]] = []
        self._change: SceneUpdate | None = None
        self._before = Scene()
        about = (
            "Upload a picture (.png, .jpg), its depth (16-bit .png in millimetres, or .npy in metres) and camera.json,"
            " one after the other."
        )
        gui.add_html(html.section("Look", about))
        self.upload = gui.add_upload_button("Upload for looking", icon="upload", mime_type=",".join(ENDINGS))
        self.upload.on_upload(lambda _: self._uploaded())
        self.have = gui.add_html("")
        self.which = gui.add_dropdown("pictures", tuple(offered)) if offered else None
        self.names = gui.add_text("look for", "", hint="Names, such as: red cup, box=blue; nothing for all things")
        self.go = gui.add_button("Look", icon="eye")
        self._picture: Any = None
        self._drawn = 0
        self._views: tuple[View, ...] = ()
        self.dragged: Any = None
        self._seen = gui.add_folder(None)
        self._list = gui.add_folder(None)
        self.notes = gui.add_html("")
        self.take = gui.add_button("Take into the scene", icon="check", visible=False)
        self.go.on_click(lambda _: self._look())
        self.take.on_click(lambda _: self._take())

    def _uploaded(self) -> None:
        file = self.upload.value
        with self.desk.complaining():
            self._files[role_of(file.name, file.content)] = (file.name, file.content)
            have = [f"{role}: {Path(name).name[:40]}" for role, (name, _) in self._files.items()]
            self.have.content = html.soft(listed(have))

    def _look(self) -> None:
        with self.desk.complaining(), html.busy(self.go, "Look"):
            self._show()

    def _show(self) -> None:
        from ovita.perceive import perceive
        from ovita.perceive.assemble import perceive_clouds
        from ovita.perceive.update import update

        session, there = self.desk.controller.session, self._there()
        names = [name.strip() for name in str(self.names.value).split(",") if name.strip()]
        look: Any = (perceive, there.views) if there.views else (perceive_clouds, there.clouds)
        seen = look[0](look[1], names=names, frame=session.scene.frame)
        self._before = session.scene
        self._change = update(session.scene, seen.scene, there.views)
        self._views = there.views
        said = [*self._change.sentences(), *seen.notes, *seen.refused, *seen.missing]
        self.notes.content = html.block(html.listed([html.e(one) for one in said]))
        found = [*(match.now for match in self._change.matches), *self._change.new]
        self._show_picture(found)
        self._show_rows(found, self._change.gone)
        self.take.visible = True

    def _there(self) -> Recorded:
        """What is to be looked at: what was uploaded, else what was chosen."""
        from ovita.perceive.pictures import gathered

        if not self._files and self.which is not None:
            return gathered([self._offered[str(self.which.value)]])
        missing = [role for role in ("depth", "camera") if role not in self._files]
        if missing:
            raise RequestError(f"there is no {listed(missing)} yet; upload a picture, its depth and camera.json")
        with tempfile.TemporaryDirectory(prefix="ovita-look-") as folder:
            paths = {r: Path(folder, f"{r}{Path(name).suffix.lower()}") for r, (name, _) in self._files.items()}
            for role, path in paths.items():
                path.write_bytes(self._files[role][1])
            pictures = [str(paths[role]) for role in ("picture", "depth") if role in paths]
            try:
                return gathered(pictures, camera=str(paths["camera"]))
            except FormatError as error:
                role = Path(error.file).stem
                shown = self._files[role][0] if role in self._files else error.file
                raise FormatError(shown, error.problem, key=error.key, index=error.index) from None

    def _show_picture(self, items: Sequence[SceneObject]) -> None:
        """The first picture with its boxes, and the field that takes one that was dragged."""
        if not self._views:
            for part in (self._picture, self.dragged):
                if part is not None:
                    part.remove()
            self._picture = self.dragged = None
            return
        self._drawn += 1
        drawn = picture_html(self._views[0], items, self._drawn)
        if self._picture is not None:
            self._picture.content = drawn
            return
        with self._seen:
            self._picture = self._gui.add_html(drawn)
            hint = "Drag a box in the picture, or write: box NUMBER: x0 y0 x1 y1 (pixels)"
            self.dragged = self._gui.add_text("moved", FIELD, hint=hint)
        self.dragged.on_update(lambda _: self._drag())

    def _drag(self) -> None:
        """Measure anew what is in a box that was dragged."""
        from ovita.perceive.pointed import look_in

        text = str(self.dragged.value)
        if text.strip() == FIELD.strip() or self._change is None:
            return
        self.dragged.value = FIELD
        with self.desk.complaining():
            number, box = moved_box(text, len(self._rows))
            found = look_in(self._views, box, self._change.scene.frame)
            row = self._rows[number]
            if found is None:
                self.desk.complain(f"nothing stands out in that box; {row.item.name} stays as it was")
            else:
                item = replace(found, name=row.item.name, extra={**row.item.extra, **found.extra})
                self._change = _exchanged(self._change, row.item, item)
                row.taken.hint = _size(item)
                self._rows[number] = replace(row, item=item)
                place = ", ".join(f"{value:.3f}" for value in item.position)
                self.desk.tell(f"{item.name} is now {_size(item)}, at ({place}) m.")
            self._show_picture([row.item for row in self._rows])

    def _show_rows(self, found: Sequence[SceneObject], gone: Sequence[SceneObject]) -> None:
        for row in self._rows:
            row.taken.remove()
            row.name.remove()
        for _, box in self._gone:
            box.remove()
        self._rows = []
        with self._list:
            for item in found:
                taken = self._gui.add_checkbox(f"take {item.name}", True, hint=_size(item))
                self._rows.append(_SeenRow(item, taken, self._gui.add_text(f"name of {item.name}", item.name)))
            self._gone = [(item, self._gui.add_checkbox(f"{item.name} is gone", True)) for item in gone]

    def _take(self) -> None:
        change = self._change
        if change is None:
            return
        names = {row.item.name: str(row.name.value).strip() for row in self._rows if row.taken.value}
        removed = [item.name for item, box in self._gone if box.value]
        before = self.desk.controller.session.scene
        if before != self._before:
            self.desk.complain("The scene has changed since the look; look again.")
            return
        with self.desk.complaining():
            scene = accepted(before, change, names, removed)
            said = f"looked: {listed(names.values()) or 'nothing new'}"
            if self.desk.controller.act(lambda session: session.change(said, scene=scene)):
                self.take.visible = False
                self.desk.tell(f"{listed(names.values()) or 'Nothing'} taken into the scene; Undo takes it back.")


def _size(item: SceneObject) -> str:
    return " x ".join(f"{100 * edge:.1f}" for edge in item.size) + " cm"


def _exchanged(change: SceneUpdate, old: SceneObject, new: SceneObject) -> SceneUpdate:
    """What a look found, with one object measured anew."""

    def swap(item: SceneObject) -> SceneObject:
        return new if item is old else item

    return replace(
        change,
        scene=replace(change.scene, objects=tuple(map(swap, change.scene.objects))),
        matches=tuple(replace(match, now=swap(match.now)) for match in change.matches),
        new=tuple(map(swap, change.new)),
    )


def accepted(before: Scene, change: SceneUpdate, names: Mapping[str, str], removed: Collection[str]) -> Scene:
    """The scene after a look, with what a person accepted.

    Args:
        before: The scene before the look.
        change: What the look found.
        names: Of the things taken, as the look calls them, to the names to give them; of what is not taken, the
            scene keeps what it had.
        removed: Names of the things that are gone, as far as the person agrees.

    Raises:
        SceneError: If two objects would bear one name, or one none.
    """
    from ovita.perceive.segment import with_objects

    found = {match.before.name: match.now for match in change.matches}
    kept = [found[o.name] if o.name in found and o.name in names else o for o in before if o.name not in removed]
    new = [item for item in change.new if item.name in names]
    named = (replace(item, name=names.get(item.name, item.name)) for item in (*kept, *new))
    return with_objects(change.scene, tuple(named))


def role_of(name: str, content: bytes) -> str:
    """What an uploaded file is by its content: "picture", "depth" or "camera".

    Raises:
        FormatError: If it is none of these.
    """
    ending = Path(name).suffix.lower()
    if ending not in ENDINGS:
        raise FormatError(Path(name).name[:60], f"is nothing to look at; take {', '.join(ENDINGS)}")
    # Byte 24 of a PNG is its bit depth, byte 25 its kind of colours; 16 bits of grey are distances.
    grey = content[:4] == b"\x89PNG" and content[24:26] == b"\x10\x00"
    return {".json": "camera", ".npy": "depth"}.get(ending, "depth" if grey else "picture")


def lookable(paths: Sequence[str]) -> dict[str, str]:
    """What can be looked at of the files and folders that a studio was started with: shown name to path."""
    from ovita.perceive.pictures import is_view

    places: list[str] = []
    for path in paths:
        folder = os.path.isdir(path) and not is_view(path)
        places += filter(is_view, sorted(str(one) for one in Path(path).iterdir()) if folder else [path])
    return by_name(places)


FIELD = "box "
"""What the text of the panel's field for boxes begins with, by which the script in head.html finds it."""


def picture_html(view: View, items: Sequence[SceneObject], time: int = 0) -> str:
    """The picture with a box over each object, numbered from 1: small ones over large ones, so that each can be held.

    What things stand on has no box: it is seen in the whole picture.

    `time` is how often it was drawn: a browser that is told the same again changes nothing, and a box would stay where
    it was left.
    """
    from ovita.perceive.pointed import INKS, rectangle_of

    high, wide = view.shape
    boxes: list[tuple[float, str]] = []
    for number, item in enumerate(items, 1):
        there = None if is_support(item) else rectangle_of(view, item)
        if there is None:
            continue
        x0, y0, x1, y1 = there
        ink = "#{:02x}{:02x}{:02x}".format(*INKS[(number - 1) % len(INKS)])
        drawn = (
            f'<rect data-box="{number}" x="{x0:.1f}" y="{y0:.1f}" width="{x1 - x0:.1f}" height="{y1 - y0:.1f}"'
            f' stroke="{ink}"><title>{escape(item.name)}</title></rect>'
            f'<text x="{x0 + 0.01 * wide:.1f}" y="{max(y0 - 0.012 * wide, 0.04 * wide):.1f}" fill="{ink}"'
            f' font-size="{0.04 * wide:.1f}">{number} {escape(item.name[:40])}</text>'
        )
        boxes.append(((x1 - x0) * (y1 - y0), drawn))
    over = "".join(drawn for _, drawn in sorted(boxes, key=lambda box: -box[0]))
    return (
        f'<div class="ov"><svg class="boxes" data-time="{time}" viewBox="0 0 {wide} {high}">'
        f'<image width="{wide}" height="{high}" href="{_data(view)}"/>{over}</svg>'
        '<p class="soft">Drag a box to move it, its edges to resize it: what is there is measured anew.</p></div>'
    )


def _data(view: View) -> str:
    from PIL import Image

    from ovita.perceive.pointed import backdrop

    stream = io.BytesIO()
    Image.fromarray(backdrop(view)).save(stream, "JPEG", quality=80)
    return "data:image/jpeg;base64," + base64.b64encode(stream.getvalue()).decode()


def moved_box(text: str, count: int) -> tuple[int, Rectangle]:
    """Which box was dragged, from 0, and where it is now.

    Raises:
        RequestError: If the text says neither.
    """
    word, *values = text.replace(":", " ").split() or [""]
    try:
        number, x0, y0, x1, y1 = map(float, values)
    except ValueError:
        number, x0, y0, x1, y1 = (float("nan"),) * 5
    if word != FIELD.strip() or number not in range(1, count + 1) or not np.isfinite((x0, y0, x1, y1)).all():
        raise RequestError(f"{text[:60]!r} moves no box; write 'box 1: x0 y0 x1 y1' in pixels, with 1 to {count}")
    if x1 - x0 < 1 or y1 - y0 < 1:
        raise RequestError(f"{text[:60]!r} holds no pixel; the second corner must be right of and below the first")
    return int(number) - 1, (x0, y0, x1, y1)
