"""Who writes the programs: a writer and its model chosen from what there is, tried out, and used."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.resources import as_file, files
from importlib.util import find_spec

from ovita.chain import adapt
from ovita.errors import RequestError
from ovita.io import load_task
from ovita.policy import sandbox
from ovita.request import Request
from ovita.result import Adaptation
from ovita.studio import html, turns
from ovita.studio.sessions import Desk
from ovita.writers.base import PolicyWriter, configured_model, writer_named

TRIAL = "Go left by 0.15 and move at half the speed near the cup"
"""What a writer is tried with, on the shipped table-top scene."""

TRIAL_S = 90.0
"""How long a trial may take [s]."""


@dataclass(frozen=True)
class WriterChoice:
    """A kind of writer: its name or, with `asks`, the provider whose model is named; what else a person gives.

    Args:
        asks: Whether a model has to be named; then `example` is one.
        example: What a model's name looks like.
        server: Whether an address has to be given.
    """

    name: str
    asks: bool = False
    example: str = ""
    server: bool = False
    key: bool = False

    def writer(self, model: str) -> str:
        """The writer's name with a model.

        Raises:
            RequestError: If the model is missing.
        """
        if self.asks and not model:
            raise RequestError(f"name the model, such as {self.example!r}")
        return model if self.server else f"{self.name}:{model}" if self.asks else self.name


def choices(*, local: bool) -> Mapping[str, WriterChoice]:
    """Every kind of writer that can be had, by its label; only where `local` those of this machine."""
    from ovita.writers.models import catalogue

    named, present = configured_model()
    auto = named or present or "no model is set up"
    found = {"built-in: no model": WriterChoice("builtin"), f"auto: built-in first, then {auto}": WriterChoice("auto")}
    if local and find_spec("xllamacpp") is not None:
        found |= {f"on this machine: {name}": WriterChoice(f"llamacpp:{name}") for name in catalogue.present()}
    found |= {
        "OpenAI": WriterChoice("openai", True, "gpt-5-mini", key=True),
        "Anthropic": WriterChoice("anthropic", True, "claude-sonnet-4-5", key=True),
        "Google": WriterChoice("google", True, "gemini-2.5-flash", key=True),
    }
    if local:
        found["Ollama"] = WriterChoice("ollama", True, "qwen3:8b")
        found["another server (OpenAI's protocol)"] = WriterChoice("", True, "qwen3-8b", server=True, key=True)
    return found


class WritersPanel:
    """The choice of the writer; `chosen` is called when another was chosen.

    Only where `local`, that is, only this machine can reach the studio, may a person name servers, which would be sent
    the owner's key, or take models of this machine.
    """

    def __init__(self, desk: Desk, chosen: Callable[[], None], *, local: bool) -> None:
        self.desk, self._chosen, gui = desk, chosen, desk.client.gui
        self._choices = choices(local=local)
        about = (
            "The built-in writer needs no model. What you say, the scene and a summary of the path are sent to a model"
            " of a provider; one on this machine sends nothing."
        )
        gui.add_html(html.section("Writer", about))
        session = desk.controller.session
        now = writer_name(session.writer)
        self.kind = gui.add_dropdown("writer", tuple(self._choices), initial_value=self._label(now))
        self.model = gui.add_text("model", now.partition(":")[2])
        self.hint = gui.add_html("")
        self.address = gui.add_text("server", "", hint="Address of a server, such as http://localhost:8000/v1")
        self.secret = gui.add_html('<div class="secret"></div>')
        self.key = gui.add_text(
            "API key", "", hint="Kept in memory until the studio ends; never shown again, never saved"
        )
        self.use = gui.add_button("Use this writer", icon="check")
        self.test = gui.add_button("Try it", color=html.QUIET, icon="player-play", hint=TRIAL)
        self.told = gui.add_html("")
        self.kind.on_update(lambda _: self._show())
        self.use.on_click(lambda _: self._use())
        self.test.on_click(lambda _: self._try())
        missing = sandbox.missing()
        level = "strict" if not missing else f"degraded, because this machine lacks {', '.join(missing)}"
        gui.add_html(html.block(
            f"<h4>Isolation</h4><p class='soft'>Programs run in a sandbox: <b>{html.e(session.isolation)}</b>"
            f" is asked for; this machine offers <b>{html.e(level)}</b>.</p>"
        ))  # fmt: skip
        self._show()

    def _label(self, name: str) -> str:
        provider = name.partition(":")[0]
        fits = (label for label, choice in self._choices.items() if choice.name in (name, provider))
        return next(fits, next(iter(self._choices)))

    def _choice(self) -> WriterChoice:
        return self._choices[str(self.kind.value)]

    def _show(self) -> None:
        choice = self._choice()
        self.model.visible = self.hint.visible = choice.asks
        self.hint.content = html.soft(f"such as {choice.example}")
        self.address.visible = choice.server
        self.key.visible = self.secret.visible = choice.key

    def _made(self) -> PolicyWriter:
        key, self.key.value = self.key.value.strip(), ""
        choice = self._choice()
        address = self.address.value.strip() if choice.server else ""
        if choice.server and not address:
            raise RequestError("give the server's address, such as http://localhost:8000/v1")
        return keyed_writer(choice.writer(self.model.value.strip()), key, address)

    def _use(self) -> None:
        with self.desk.complaining():
            writer, controller = self._made(), self.desk.controller
            with controller.lock:
                controller.session.writer = writer
            self._chosen()

    def _try(self) -> None:
        with self.desk.complaining(), html.busy(self.test, "It writes\u2026"):
            self.told.content = trial(self._made())


def trial(writer: PolicyWriter) -> str:
    """What a writer makes of `TRIAL` on the shipped scene, and how long it took; nothing of the session changes.

    Raises:
        OvitaError: If it cannot be asked.
    """
    with as_file(files("ovita") / "data" / "tabletop.json") as path:
        task = load_task(str(path))
    result: Adaptation = adapt(Request(TRIAL, task.trajectory, task.scene), writer=writer, time_limit=TRIAL_S)
    took = f"{sum(result.timings_ms.values()) / 1000.0:.1f} s"
    return html.block(
        f'<div class="card">{turns.chip(turns.rung(result))} in {took}: &ldquo;{html.e(TRIAL)}&rdquo;'
        f"<p>{html.e(result.message)}</p></div>"
    )


def keyed_writer(name: str, key: str, address: str) -> PolicyWriter:
    """The writer of that name, as on the command line, with a key and a server's address of its own; "" for none."""
    if not key:
        return writer_named(name, base_url=address or None)
    from ovita.writers.models.chat import LLMWriter

    return LLMWriter(name, base_url=address or None, api_key=key)


def writer_name(writer: PolicyWriter | str) -> str:
    """How a writer is named."""
    return writer if isinstance(writer, str) else writer.name
