"""The left side: say it, see how it went, go back."""

from __future__ import annotations

import threading
from typing import Any

from ovita.request import FeedbackOn
from ovita.studio import html, turns
from ovita.studio.sessions import Desk, News, SessionController
from ovita.studio.writing import writer_name

_ON = {"current: what there is now": "current", "original: everything on the blue line": "original"}
_TICK_S = 0.5
_SPEAK = '<button class="link" data-voice hidden title="The browser writes down what you say">speak</button>'


class Conversation:
    """Instruction box, suggestions, progress, outcome and history of one tab."""

    def __init__(self, desk: Desk) -> None:
        self.desk, gui = desk, desk.client.gui
        self._suggested: tuple[str, ...] = ()
        self._tries: list[Any] = []
        self._clock: threading.Thread | None = None
        self._closed = False
        self._helped = False
        self.ask = gui.add_html("")
        with gui.add_form(None) as self.form:
            self.text = gui.add_text("", "")
            self.send = gui.add_button("Send", icon="send")
        self.on = gui.add_dropdown("feedback on", tuple(_ON), hint="Which trajectory your next words are about")
        self.meaning = gui.add_html("")
        self.stage = gui.add_html("", visible=False)
        self.bar = gui.add_progress_bar(100.0, animated=True, visible=False)
        self.cancel = gui.add_button("Cancel", color=html.QUIET, icon="x", visible=False)
        self.outcome = gui.add_html("")
        self.accept = gui.add_button("Accept", color=(255, 179, 0), icon="check", visible=False)
        self.dismiss = gui.add_button("Not this", color=html.QUIET, icon="x", visible=False)
        self.tries = gui.add_folder(None)
        self.back = gui.add_button_group("history", ("Undo", "Redo"), visible=False)
        self.past = gui.add_html("")
        self.form.on_submit(lambda _: self.send_words(self.text.value, answering=True))
        self.send.on_click(lambda _: self.form.submit())
        self.on.on_update(lambda _: self._explain())
        self.cancel.on_click(lambda _: self.desk.controller.cancel())
        self.accept.on_click(lambda _: self.desk.controller.act(lambda s: s.accept()))
        self.dismiss.on_click(lambda _: self.desk.controller.act(lambda s: s.dismiss()))
        self.back.on_click(lambda _: self.step(self.back.value))
        self._explain()

    def refresh(self, news: News) -> None:
        """Show the session."""
        controller, session = self.desk.controller, self.desk.controller.session
        busy = controller.busy is not None
        for node in (self.stage, self.bar, self.cancel):
            node.visible = busy
        self.send.disabled = busy
        self._show_stage()
        if busy and news == "busy" and (self._clock is None or not self._clock.is_alive()):
            self._clock = threading.Thread(target=self._tick, name="ovita-clock", daemon=True)
            self._clock.start()
        self.accept.visible = self.dismiss.visible = not busy and session.pending is not None
        self.ask.content = html.block(f"<h4>{self._title()} {_SPEAK}</h4>")
        self._helped = self._helped and news not in ("turn", "busy", "said")
        helped = turns.helping(session, self._suggested, writer_name(session.writer)) if self._helped else ""
        self.outcome.content = helped + turns.outcome(controller)
        if news in ("turn", "said", "knobs"):
            self._suggest(controller)
        if news in ("turn", "knobs"):
            self.past.content = turns.history(session)
            self.back.visible = bool(session.history.steps)

    def _title(self) -> str:
        """What the field for words asks for."""
        controller = self.desk.controller
        if controller.said is not None and controller.said.question:
            return "Your answer"
        if self.accept.visible:
            return "Is that meant? Accept, or say what is different"
        return "From where to where?" if controller.session.bare else "What should change?"

    def close(self) -> None:
        """Stop the clock."""
        self._closed = True

    def send_words(self, text: str, *, answering: bool) -> None:
        """Send an utterance, or the answer to a pending question."""
        controller = self.desk.controller
        if turns.is_help(text):
            self.text.value, self._helped = "", True
            self.refresh("error")
            return
        with self.desk.complaining():
            if answering and controller.said is not None and controller.said.question:
                controller.answer(text)
            else:
                controller.say(text, self._about())
            self.text.value = ""

    def _about(self) -> FeedbackOn:
        return "original" if _ON.get(self.on.value) == "original" else "current"

    def _explain(self) -> None:
        self.meaning.content = html.block(f'<p class="soft">{html.MEANING[self._about()]}</p>')

    def step(self, which: str) -> None:
        """Undo or redo a turn."""
        controller = self.desk.controller
        did: list[bool] = []
        if controller.act(lambda s: did.append(s.undo() if which == "Undo" else s.redo())) and not did[0]:
            self.desk.complain(f"There is nothing to {which.lower()}.")

    def go(self, turn: int) -> None:
        """Go on from a turn, or from the beginning (`ROOT`); the turns after it stay in the history."""
        if -1 <= turn < len(self.desk.controller.session.history.steps):
            self.desk.controller.act(lambda session: session.branch(turn))

    def _suggest(self, controller: SessionController) -> None:
        session = controller.session
        said = {step.said.lower() for step in session.steps}
        wanted = tuple(s for s in html.suggestions(session.current, session.scene) if s.lower() not in said)
        if wanted == self._suggested:
            return
        self._suggested = wanted
        for node in self._tries:
            node.remove()
        self._tries = []
        with self.tries:
            if wanted:
                self._tries.append(self.desk.client.gui.add_html(html.block("<h4>Try</h4>")))
            for text in wanted:
                button = self.desk.client.gui.add_button(text, color=(228, 236, 243), hint="Click to say this")
                button.on_click(lambda _, text=text: self.send_words(text, answering=False))
                self._tries.append(button)

    def _tick(self) -> None:
        done = threading.Event()
        while not self._closed and self.desk.controller.busy is not None:
            self._show_stage()
            done.wait(_TICK_S)

    def _show_stage(self) -> None:
        busy = self.desk.controller.busy
        if busy is not None:
            said = html.e(html.clipped(busy.said))
            self.stage.content = html.block(
                f'<div class="card">&ldquo;{said}&rdquo;<br><span class="soft">{html.e(busy.stage)}'
                f" &middot; {busy.elapsed:.0f} s</span></div>"
            )
