"""Parameters as knobs: a slider, a number, a switch or a text for each, with unit and meaning."""

from __future__ import annotations

import ast
from collections.abc import Callable
from typing import Any

import numpy as np

from ovita.policy import Parameter
from ovita.studio import words
from ovita.studio.desk import Desk


def reach(value: float, unit: str) -> tuple[float, float, float]:
    """Lowest and highest value of a slider for a parameter, and its step: round numbers around the value."""
    size = abs(value) if value else 0.25 if unit in ("m", "m/s", "") else 1.0
    power = 10.0 ** np.floor(np.log10(2.5 * size))
    high = float(next(s * power for s in (1, 2, 3, 5, 10) if s * power >= 2.5 * size * (1 - 1e-9)))
    low = -high if value < 0 or (value == 0 and unit == "m") else 0.0
    return low, high, float(f"{(high - low) / 200.0:.1g}")


class Knobs:
    """The knobs of one tab.

    Args:
        gui: viser's GUI of the tab; the knobs are added to the container that is open.
        desk: Gives the desk.
    """

    def __init__(self, gui: Any, desk: Callable[[], Desk]) -> None:
        self.gui, self._desk = gui, desk
        self.note = gui.add_html("")
        self.box = gui.add_folder(None)
        self.handles: dict[str, Any] = {}
        self._others: list[Any] = []
        self._made: tuple[tuple[str, type, str], ...] | None = None

    def refresh(self, *, turned: bool) -> None:
        """Show the knobs of the policy in force.

        Args:
            turned: Whether knobs were turned, so that those under the hand are left alone.
        """
        result = self._desk().session.adaptation
        knobs = result.parameters if result is not None else ()
        made = tuple((p.name, type(p.value), p.meaning) for p in knobs)
        if turned and made == self._made:
            return
        if made and made == self._made and self._fits(knobs):
            for knob in knobs:
                handle = self.handles[knob.name]
                value = _shown(knob.value)
                if handle.value != value:
                    handle.value = value
            return
        self._made = made
        for handle in (*self.handles.values(), *self._others):
            handle.remove()
        self.handles, self._others = {}, []
        if knobs:
            text = "Turn a knob: the program and the limits run again at once, no model is asked."
        elif result is not None:
            text = "This program has no parameters."
        else:
            text = "The numbers in what you say become knobs here."
        self.note.content = words.block(f'<p class="soft">{text}</p>')
        with self.box:
            for knob in knobs:
                self._make(knob)

    def _fits(self, knobs: tuple[Parameter, ...]) -> bool:
        """Whether every value lies within its slider."""
        for knob in knobs:
            high, low = getattr(self.handles[knob.name], "max", None), getattr(self.handles[knob.name], "min", None)
            if high is not None and low is not None and isinstance(knob.value, int | float):
                if not low <= knob.value <= high:
                    return False
        return True

    def _make(self, knob: Parameter) -> None:
        unit = f" [{knob.unit}]" if knob.unit else ""
        title = knob.meaning or knob.name.replace("_", " ")
        label = knob.name.replace("_", " ") + unit
        hint = f"{title}{unit}"
        if knob.meaning:
            self._others.append(self.gui.add_html(words.block(f'<div class="soft">{words.e(knob.meaning)}</div>')))
        value = knob.value
        if isinstance(value, bool):
            handle = self.gui.add_checkbox(label, value, hint=hint)
        elif isinstance(value, int) and not knob.unit:
            handle = self.gui.add_number(label, value, step=1, hint=hint)
        elif isinstance(value, int | float):
            low, high, step = reach(float(value), knob.unit)
            handle = self.gui.add_slider(label, low, high, step, float(value), hint=hint)
        else:
            handle = self.gui.add_text(label, _shown(value), hint=hint)

        async def turned(event: Any, name: str = knob.name, like: Any = value) -> None:
            if event.client is not None:
                self._desk().turn(name, _read(handle_of(name).value, like))

        def handle_of(name: str) -> Any:
            return self.handles[name]

        handle.on_update(turned)
        self.handles[knob.name] = handle


def _shown(value: Any) -> Any:
    return value if isinstance(value, bool | int | float | str) else repr(value)


def _read(value: Any, like: Any) -> Any:
    """A value as its parameter wants it: groups and None are typed as Python writes them."""
    if not isinstance(value, str) or isinstance(like, str):
        return value
    try:
        return ast.literal_eval(value.strip())
    except (ValueError, SyntaxError):
        return value
