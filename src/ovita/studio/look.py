"""Looking in one tab: pictures in, boxes over them, and what is accepted becomes one turn of the session.

What is uploaded is data: it is decoded and checked, and nothing in it is run.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ovita.errors import FormatError, OvitaError, RequestError
from ovita.paths.scene import Scene, SceneObject
from ovita.studio import html
from ovita.studio.look_picture import FIELD, moved_box, picture_html
from ovita.studio.sessions import SessionController
from ovita.text import listed

if TYPE_CHECKING:
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

    Args:
        gui: viser's GUI of the tab; the controls are added to the container that is open.
        controller: Gives the controller.
        offered: Folders of pictures and recordings that need no upload: shown name to path.
        complain, tell: Show a sentence about something that did not work, or that is good to know.
    """

    def __init__(
        self,
        gui: Any,
        controller: Callable[[], SessionController],
        *,
        offered: Mapping[str, str],
        complain: Callable[[str], None],
        tell: Callable[[str], None],
    ) -> None:
        self._gui, self._controller, self._offered = gui, controller, offered
        self._complain, self._tell = complain, tell
        self._files: dict[str, tuple[str, bytes]] = {}
        self._rows: list[_SeenRow] = []
        self._gone: list[tuple[SceneObject, Any]] = []
        self._change: SceneUpdate | None = None
        self._before = Scene()
        gui.add_html(html.block(
            "<h4>Look</h4><p class='soft'>Upload a picture (.png, .jpg), its depth (16-bit .png in millimetres, or .npy"
            " in metres) and camera.json, one after the other.</p>"
        ))  # fmt: skip
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
        try:
            self._files[role_of(file.name, file.content)] = (file.name, file.content)
        except OvitaError as error:
            self._complain(str(error))
            return
        self.have.content = html.block(f"<p class='soft'>{html.e(self._told())}</p>")

    def _told(self) -> str:
        have = [f"{role}: {Path(name).name[:40]}" for role, (name, _) in self._files.items()]
        return listed(have)

    def _look(self) -> None:
        self.go.disabled = True
        try:
            self._show()
        except OvitaError as error:
            self._complain(str(error))
        finally:
            self.go.disabled = False

    def _show(self) -> None:
        from ovita.perceive import perceive
        from ovita.perceive.assemble import perceive_clouds
        from ovita.perceive.update import update

        session, there = self._controller().session, self._there()
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
        from ovita.perceive.sources import gathered

        if not self._files and self.which is not None:
            return gathered([self._offered[str(self.which.value)]])
        missing = [role for role in ("depth", "camera") if role not in self._files]
        if missing:
            raise RequestError(f"there is no {listed(missing)} yet; upload a picture, its depth and camera.json")
        with tempfile.TemporaryDirectory(prefix="ovita-look-") as folder:
            paths = {}
            for role, (name, content) in self._files.items():
                paths[role] = Path(folder, f"{role}{Path(name).suffix.lower()}")
                paths[role].write_bytes(content)
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
            self._clear_picture()
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

    def _clear_picture(self) -> None:
        for part in (self._picture, self.dragged):
            if part is not None:
                part.remove()
        self._picture = self.dragged = None

    def _drag(self) -> None:
        """Measure anew what is in a box that was dragged."""
        from ovita.perceive.pointed import look_in

        text = str(self.dragged.value)
        if text.strip() == FIELD.strip() or self._change is None:
            return
        self.dragged.value = FIELD
        try:
            number, box = moved_box(text, len(self._rows))
            found = look_in(self._views, box, self._change.scene.frame)
        except OvitaError as error:
            self._complain(str(error))
            return
        row = self._rows[number]
        if found is None:
            self._complain(f"nothing stands out in that box; {row.item.name} stays as it was")
        else:
            item = replace(found, name=row.item.name, extra={**row.item.extra, **found.extra})
            self._change = _exchanged(self._change, row.item, item)
            row.taken.hint = _size(item)
            self._rows[number] = replace(row, item=item)
            place = ", ".join(f"{value:.3f}" for value in item.position)
            self._tell(f"{item.name} is now {_size(item)}, at ({place}) m.")
        self._show_picture([row.item for row in self._rows])

    def _show_rows(self, found: Sequence[SceneObject], gone: Sequence[SceneObject]) -> None:
        for row in self._rows:
            row.taken.remove()
            row.name.remove()
        for _, box in self._gone:
            box.remove()
        with self._list:
            self._rows = [self._row(item) for item in found]
            self._gone = [(item, self._gui.add_checkbox(f"{item.name} is gone", True)) for item in gone]

    def _row(self, item: SceneObject) -> _SeenRow:
        taken = self._gui.add_checkbox(f"take {item.name}", True, hint=_size(item))
        return _SeenRow(item, taken, self._gui.add_text(f"name of {item.name}", item.name))

    def _take(self) -> None:
        change = self._change
        if change is None:
            return
        names = {row.item.name: str(row.name.value).strip() for row in self._rows if row.taken.value}
        removed = [item.name for item, box in self._gone if box.value]
        before = self._controller().session.scene
        if before != self._before:
            self._complain("The scene has changed since the look; look again.")
            return
        try:
            scene = accepted(before, change, names, removed)
        except OvitaError as error:
            self._complain(str(error))
            return
        said = f"looked: {listed(names.values()) or 'nothing new'}"
        if self._controller().act(lambda session: session.change(said, scene=scene)):
            self.take.visible = False
            self._tell(f"{listed(names.values()) or 'Nothing'} taken into the scene; Undo takes it back.")


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
    from ovita.perceive.support import with_objects

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
    if ending == ".json":
        return "camera"
    if ending == ".npy":
        return "depth"
    if ending not in ENDINGS:
        raise FormatError(Path(name).name[:60], f"is nothing to look at; take {', '.join(ENDINGS)}")
    # Byte 24 of a PNG is its bit depth, byte 25 its kind of colours; 16 bits of grey are distances.
    return "depth" if content[:4] == b"\x89PNG" and content[24:26] == b"\x10\x00" else "picture"


def lookable(paths: Sequence[str]) -> dict[str, str]:
    """What can be looked at of the files and folders that a studio was started with: shown name to path."""
    from ovita.perceive.sources import is_view

    found: dict[str, str] = {}
    for path in paths:
        inside = (
            sorted(str(one) for one in Path(path).iterdir()) if os.path.isdir(path) and not is_view(path) else [path]
        )
        for place in filter(is_view, inside):
            name = os.path.basename(os.path.normpath(place))
            found[name if name not in found else place] = place
    return found
