"""Who writes: the built-in writer or a model, with a key that is kept in memory only."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ovita.errors import OvitaError, RequestError
from ovita.policy import sandbox
from ovita.studio import words
from ovita.studio.desk import Desk
from ovita.writers.base import PROVIDERS, PolicyWriter, writer_named


class Writers:
    """The choice of the writer in one tab.

    Args:
        gui: viser's GUI of the tab; the controls are added to the container that is open.
        desk: Gives the desk.
        complain: Shows a sentence to the person.
        chosen: Called when another writer was chosen.
        local: Whether only this machine can reach the studio. Others may not name servers, which would be sent the
            owner's key, nor model files of this machine.
    """

    def __init__(
        self,
        gui: Any,
        desk: Callable[[], Desk],
        *,
        complain: Callable[[str], None],
        chosen: Callable[[], None],
        local: bool,
    ) -> None:
        self._desk, self._complain, self._chosen, self._local = desk, complain, chosen, local
        self.note = gui.add_html("")
        self.name = gui.add_text("writer", writer_name(desk().session.writer), hint="builtin, auto or PROVIDER:MODEL")
        self.address = gui.add_text("server", "", hint="Address of an OpenAI-compatible server", visible=local)
        gui.add_html('<div class="secret"></div>')
        self.key = gui.add_text(
            "API key", "", hint="Kept in memory until the studio ends; never shown again, never saved"
        )
        self.use = gui.add_button("Use this writer", icon="check")
        self.use.on_click(lambda _: self._use())
        missing = sandbox.missing()
        level = "strict" if not missing else f"degraded, because this machine lacks {', '.join(missing)}"
        providers = ", ".join(PROVIDERS)
        self.note.content = words.block(
            "<h4>Writer</h4><p class='soft'>The built-in writer needs no model. A model is named as PROVIDER:MODEL with"
            f" {words.e(providers)}. What you say, the scene and a summary of the path are sent to it.</p>"
        )
        gui.add_html(words.block(
            f"<h4>Isolation</h4><p class='soft'>Programs run in a sandbox: <b>{words.e(desk().session.isolation)}</b>"
            f" is asked for; this machine offers <b>{words.e(level)}</b>.</p>"
        ))  # fmt: skip

    def _use(self) -> None:
        key = self.key.value.strip()
        self.key.value = ""
        name, address = self.name.value.strip() or "builtin", self.address.value.strip()
        try:
            if not self._local and (address or "llamacpp" in name):
                raise RequestError("only on the studio's own machine can a server or a model file be named")
            writer = keyed_writer(name, key, address)
        except OvitaError as error:
            self._complain(str(error))
            return
        desk = self._desk()
        with desk.lock:
            desk.session.writer = writer
        self._chosen()


def keyed_writer(name: str, key: str, address: str) -> PolicyWriter:
    """The writer of that name, with a key that only it knows.

    Args:
        name: As on the command line.
        key: The key, or "" for the one in the environment.
        address: Of an OpenAI-compatible server, or "".

    Raises:
        OvitaError: If there is no such writer or it cannot be made.
    """
    if not key:
        return writer_named(name, base_url=address or None)
    from ovita.writers.models.chat import LLMWriter

    return LLMWriter(name, base_url=address or None, api_key=key)


def writer_name(writer: PolicyWriter | str) -> str:
    """How a writer is named."""
    return writer if isinstance(writer, str) else writer.name
