"""Playing trajectories in true time: where the robot is at each moment, and the bar with play, scrub and pace."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from typing import Any

from ovita.paths.trajectory import Array
from ovita.plots.geometry import COLOURS
from ovita.studio.shapes import rgb
from ovita.studio.stage import Space

_PACES = {"0.25x": 0.25, "0.5x": 0.5, "1x": 1.0, "2x": 2.0, "4x": 4.0}
_TICK_S = 1 / 25


class Heads:
    """The balls that move along the lines.

    Args:
        space: The scene of the tab.
    """

    def __init__(self, space: Space) -> None:
        self._space = space
        self._nodes: list[Any] = []
        self._lock = threading.Lock()

    def place(self, places: Sequence[Array]) -> None:
        """Put the ball of each line somewhere, (3,) each [m]; none takes them away."""
        stage = self._space.stage
        radius = 0.022 * (stage.size if stage is not None else 1.0)
        with self._lock:
            while len(self._nodes) > len(places):
                self._nodes.pop().remove()
            for i in range(len(self._nodes), len(places)):
                colour = rgb(COLOURS[("before", "after")[i]])
                self._nodes.append(self._space.api.add_icosphere(f"/playhead/{i}", radius, colour, subdivisions=2))
            for node, place in zip(self._nodes, places, strict=True):
                node.position = place


class Player:
    """The bar below the scene.

    Args:
        gui: viser's GUI of the tab; the bar is added to the container that is open.
        show: Called with the moment [s] to show.
    """

    def __init__(self, gui: Any, show: Callable[[float], None]) -> None:
        self.gui, self._show = gui, show
        self.duration, self.moment = 1.0, 0.0
        self._playing = threading.Event()
        self._closed = False
        self.button = gui.add_button("Play", icon="player-play", hint="Play both in true time (key: space)")
        self.slider = gui.add_slider("time [s]", 0.0, 1.0, 0.01, 0.0)
        self.pace = gui.add_dropdown("pace", tuple(_PACES), initial_value="1x")
        self.button.on_click(lambda _: self.toggle())
        self.slider.on_update(self._scrubbed)

    def set_duration(self, seconds: float) -> None:
        """Set how long the longer of the two trajectories takes [s]."""
        self.duration = max(seconds, 0.01)
        self.slider.max = round(self.duration, 3)
        self.slider.step = round(max(self.duration / 1000.0, 0.001), 4)
        if self.moment > self.duration:
            self.moment = self.duration
            self.slider.value = self.slider.max
        self._show(self.moment)

    def toggle(self) -> None:
        """Play or pause; at the end it begins again."""
        if self._playing.is_set():
            self._stop()
            return
        if self.moment >= self.duration - 1e-6:
            self.moment = 0.0
        self._playing.set()
        self.button.label, self.button.icon = "Pause", "player-pause"
        threading.Thread(target=self._run, name="ovita-player", daemon=True).start()

    def close(self) -> None:
        """Stop for good."""
        self._closed = True
        self._playing.clear()

    def _stop(self) -> None:
        self._playing.clear()
        if not self._closed:
            self.button.label, self.button.icon = "Play", "player-play"

    def _run(self) -> None:
        last, shown = time.monotonic(), 0.0
        while self._playing.is_set() and not self._closed:
            now = time.monotonic()
            self.moment = min(self.moment + (now - last) * _PACES.get(self.pace.value, 1.0), self.duration)
            last = now
            self._show(self.moment)
            if now - shown > 0.12 or self.moment >= self.duration:
                shown = now
                self.slider.value = self.moment
            if self.moment >= self.duration:
                break
            time.sleep(_TICK_S)
        self._stop()

    async def _scrubbed(self, event: Any) -> None:
        if event.client is None or self._playing.is_set():
            return
        self.moment = float(self.slider.value)
        self._show(self.moment)
