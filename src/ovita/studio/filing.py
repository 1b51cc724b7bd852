"""The files of one tab: open, save, export."""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Sequence
from typing import Any

from ovita.errors import OvitaError
from ovita.studio import files, words
from ovita.studio.desk import Desk

_KINDS = {
    "adaptation": ("Result (JSON)", "What was adapted, with its program, its verdict and its explanation"),
    "json": ("Trajectory (JSON)", "The red line with its scene, to adapt again"),
    "csv": ("Trajectory (CSV)", "The red line's waypoints"),
    "html": ("Interactive page (HTML)", "A page to turn and zoom, for people without ovita"),
    "session": ("Whole session", "Every turn, to go on elsewhere; no keys are in it"),
}


class Filing:
    """Opening and saving in one tab.

    Args:
        client: viser's handle of the tab.
        gui: Its GUI; the controls are added to the container that is open.
        desk: Gives the desk.
        opened: Called with a session that was opened.
        again: Called to begin again with the file that the studio was started with.
        offered: Files that can be opened without an upload: shown name to path.
        earlier: Gives the sessions that this browser had before: shown name to name.
        returned: Called with the name of one of them.
        complain: Shows a sentence to the person.
    """

    def __init__(
        self,
        client: Any,
        gui: Any,
        desk: Callable[[], Desk],
        *,
        opened: Callable[[files.Opened], None],
        again: Callable[[], None],
        offered: dict[str, str],
        earlier: Callable[[], dict[str, str]],
        returned: Callable[[str], None],
        complain: Callable[[str], None],
    ) -> None:
        self._client, self._desk, self._opened, self._complain = client, desk, opened, complain
        self._offered, self._earlier = offered, earlier
        size = files.MAX_UPLOAD // 2**20
        gui.add_html(words.block(f"<h4>Open</h4><p class='soft'>A scene, a result or a session (.json), or waypoints"
                                 f" (.csv), up to {size} MB and {files.MAX_WAYPOINTS} waypoints.</p>"))  # fmt: skip
        self.upload = gui.add_upload_button("Upload a file", icon="upload", mime_type=".json,.csv")
        self.upload.on_upload(lambda _: self._uploaded())
        if offered:
            self.which = gui.add_dropdown("from folder", tuple(offered))
            gui.add_button("Open", icon="folder-open").on_click(
                lambda _: self._open(self._offered.get(self.which.value, ""))
            )
        gui.add_button("Begin again", color="gray", icon="refresh").on_click(lambda _: again())
        self.before = gui.add_dropdown("earlier", ("",), hint="Sessions that this browser had before")
        self.back = gui.add_button("Go back to it", color="gray", icon="history")
        self.back.on_click(lambda _: returned(earlier().get(self.before.value, "")))
        self.refresh()
        gui.add_html(words.block("<h4>Save</h4>"))
        for kind, (label, hint) in _KINDS.items():
            button = gui.add_button(label, color=(228, 236, 243), icon="download", hint=hint)
            button.on_click(lambda _, kind=kind: self._export(kind))
        picture = gui.add_button("Picture (PNG)", color=(228, 236, 243), icon="photo", hint="The scene as you see it")
        picture.on_click(lambda _: self._picture())

    def refresh(self) -> None:
        """Show the sessions that this browser had before."""
        names = tuple(self._earlier())
        self.before.visible = self.back.visible = bool(names)
        if names and names != self.before.options:
            self.before.options, self.before.value = names, names[0]

    def _uploaded(self) -> None:
        file = self.upload.value
        try:
            self._opened(files.open_upload(file.name, file.content, self._desk().session))
        except OvitaError as error:
            self._complain(str(error))

    def _open(self, path: str) -> None:
        if not path:
            return
        try:
            self._opened(files.open_file(path, self._desk().session))
        except OvitaError as error:
            self._complain(str(error))

    def _export(self, kind: str) -> None:
        try:
            name, content = files.exported(kind, self._desk().session)
        except OvitaError as error:
            self._complain(str(error))
            return
        self._client.send_file_download(name, content, save_immediately=True)

    def _picture(self) -> None:
        import imageio.v3 as images

        try:
            height, width = self._client.camera.image_height, self._client.camera.image_width
            seen = self._client.get_render(height, width, transport_format="png", timeout=20.0)
        except (RuntimeError, TimeoutError, AssertionError):
            self._complain("The browser gave no picture; try again with the tab in front.")
            return
        alpha = seen[..., 3:4] / 255.0
        flat = (seen[..., :3] * alpha + 255.0 * (1.0 - alpha)).astype("uint8")
        stream = io.BytesIO()
        images.imwrite(stream, flat, extension=".png")
        self._client.send_file_download("ovita.png", stream.getvalue(), save_immediately=True)


def offered_files(paths: Sequence[str]) -> dict[str, str]:
    """The files that a studio offers, from the files and folders it was started with: shown name to path.

    Raises:
        FormatError: If a folder cannot be read.
    """
    found: dict[str, str] = {}
    for path in paths:
        inside = [os.path.join(path, name) for name in files.in_folder(path)] if os.path.isdir(path) else [path]
        for file in inside:
            name = os.path.basename(file)
            found[name if name not in found else file] = file
    return found
