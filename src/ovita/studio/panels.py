"""The right side: what the program is, and what it did."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ovita.errors import OvitaError, PolicyError
from ovita.studio import charts, words
from ovita.studio.desk import Desk

_RUN = "Run in the sandbox"


class Plan:
    """Plan and explanation."""

    def __init__(self, gui: Any, desk: Callable[[], Desk]) -> None:
        self._desk = desk
        self.text = gui.add_html("")

    def refresh(self) -> None:
        """Show what the desk holds."""
        self.text.content = words.plan(self._desk().session.adaptation)


class Explanation:
    """The explanation in plain words."""

    def __init__(self, gui: Any, desk: Callable[[], Desk]) -> None:
        self._desk = desk
        self.text = gui.add_html("")

    def refresh(self) -> None:
        """Show what the desk holds."""
        self.text.content = words.explanation(self._desk().session.adaptation)


class Changes:
    """The measured difference, as charts and sentences."""

    def __init__(self, gui: Any, desk: Callable[[], Desk]) -> None:
        self._desk = desk
        self.charts = gui.add_html("")
        self.text = gui.add_html("")

    def refresh(self) -> None:
        """Show what the desk holds."""
        session = self._desk().session
        adapted = session.current if session.steps else None
        speed = charts.speed_chart(session.original, adapted)
        margin = session.robot.obstacle_margin
        distance = charts.clearance_chart(session.original, adapted, session.scene, margin)
        title = "<h4>Distance to the nearest object [m]</h4>" if distance else ""
        self.charts.content = words.block(f"<h4>Speed [m/s]</h4>{speed}{title}{distance}")
        self.text.content = words.changes(session)


class Code:
    """The program, to read, to edit and to run again in the sandbox."""

    def __init__(self, gui: Any, desk: Callable[[], Desk], complain: Callable[[str], None]) -> None:
        self._desk, self._complain = desk, complain
        self._shown = ""
        self.note = gui.add_html("")
        self.listing = gui.add_html("")
        with gui.add_folder("Edit", expand_by_default=False):
            self.text = gui.add_text("", "", multiline=True)
            self.run = gui.add_button(_RUN, icon="player-play")
            self.reset = gui.add_button("Discard edits", color="gray", icon="arrow-back-up")
        self.run.on_click(lambda _: self._run())
        self.reset.on_click(lambda _: self._fill())

    def refresh(self) -> None:
        """Show the program in force; edits that were not run stay as long as it is the same program."""
        result = self._desk().session.adaptation
        source = result.code if result is not None else ""
        if source == self._shown and source:
            return
        if result is None:
            text = "The program that changes the trajectory is shown here. It runs in a sandbox that can only compute."
        else:
            where = f"isolation: {result.isolation}" if result.isolation else "not run on this machine yet"
            text = f"This program made the red line. It runs in a sandbox that can only compute ({where})."
        self.note.content = words.block(f'<p class="soft">{words.e(text)}</p>')
        self._shown = source
        self.listing.content = words.code(source) if source else ""
        self._fill()

    def _fill(self) -> None:
        self.text.value = self._shown
        self.listing.content = words.code(self._shown) if self._shown else ""

    def _run(self) -> None:
        source = self.text.value
        if not source.strip():
            self._complain("There is no code to run; write a program, or discard the edits.")
            return
        failed: list[OvitaError] = []

        def work(session: Any) -> None:
            try:
                session.recode(source)
            except OvitaError as error:
                failed.append(error)
                raise

        self.run.disabled, self.run.label = True, "Running\u2026"
        try:
            if self._desk().act(work):
                return
        finally:
            self.run.disabled, self.run.label = False, _RUN
        error = failed[0] if failed else None
        line = error.line if isinstance(error, PolicyError) else None
        note = f'<p class="bad">{words.e(error)}</p>' if error else ""
        self.listing.content = words.block(note) + words.code(source, line)
