"""Every name that a policy may call, bound to a scene's frame for a run and described for a prompt."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any

from ovita.scene import DIRECTIONS, Frame
from ovita.toolkit import (
    approach,
    edit,
    ends,
    expect,
    loops,
    overhead,
    regions,
    ripples,
    routes,
    select,
    shift,
    speed,
    speedlaws,
    transforms,
)
from ovita.toolkit.recorder import Recorder

HIDDEN = ("frame", "recorder")
"""Parameters that the runtime fills in and a policy never sees."""

CATALOGUE: Mapping[str, Callable[..., Any]] = MappingProxyType(
    {
        function.__name__: function
        for function in (
            select.near,
            select.first,
            select.last,
            select.between,
            select.where_rising,
            select.every,
            shift.move,
            ends.move_start,
            ends.move_goal,
            approach.closer,
            approach.farther,
            approach.keep_distance,
            ends.go_through,
            overhead.hop,
            overhead.hover,
            ends.extend,
            ends.continue_to,
            routes.shortcut,
            routes.straighten,
            transforms.curve,
            transforms.rotate,
            transforms.tilt,
            transforms.mirror,
            transforms.scale,
            loops.spiral,
            loops.circle,
            loops.figure_eight,
            ripples.zigzag,
            ripples.wave,
            ripples.noise,
            regions.bound,
            regions.stay_on,
            regions.quadrant,
            regions.at_height,
            speed.scale_speed,
            speed.shift_speed,
            speed.set_speed,
            speed.ramp_speed,
            speedlaws.exponential_speed,
            speedlaws.accelerate,
            speedlaws.trapezoid_speed,
            speedlaws.slow_turns,
            speed.stop_at,
            speed.dwell,
            edit.smooth,
            edit.resample,
            routes.average,
            routes.reverse,
            shift.midpoint,
            expect.expect_closer,
            expect.expect_farther,
            expect.expect_distance,
            expect.expect_moved,
            expect.expect_same_path,
            expect.expect_start,
            expect.expect_goal,
            expect.expect_visits,
            expect.expect_slower,
            expect.expect_faster,
            expect.expect_speed,
            expect.expect_stop,
        )
    }
)
"""The functions by name, in the order in which a prompt shows them."""


def namespace(frame: Frame, recorder: Recorder) -> dict[str, Callable[..., Any]]:
    """The catalogue for one run of a policy: each function knows the frame and the recorder.

    Args:
        frame: Which way is left.
        recorder: Collects contacts and expectations.

    A call that does not fit a function's signature raises a ValueError that shows the signature.
    """
    return {name: _bound(function, frame, recorder) for name, function in CATALOGUE.items()}


def describe(names: Iterable[str] | None = None) -> str:
    """The catalogue as text for a prompt: for each function its signature and first sentence.

    Args:
        names: Only these functions, in catalogue order; None for all.

    Raises:
        ValueError: If a name is not in the catalogue.
    """
    wanted = list(CATALOGUE) if names is None else list(names)
    unknown = [name for name in wanted if name not in CATALOGUE]
    if unknown:
        raise ValueError(f"the toolkit has no {', '.join(unknown)}; it has {', '.join(CATALOGUE)}")
    lines = [
        f"{signature(name)}: {(CATALOGUE[name].__doc__ or '').strip().splitlines()[0].rstrip('.')}"
        for name in CATALOGUE
        if name in wanted
    ]
    notes = {
        "OFFSET": f"any of {', '.join(DIRECTIONS)} in metres, such as left=0.2, up=0.1",
        "PLACE": 'object, point, index (int), fraction of the path (float), "start" or "goal"',
    }
    for word, meaning in reversed(notes.items()):
        if any(word in line for line in lines):
            lines.insert(0, f"{word}: {meaning}")
    return "\n".join(lines)


def signature(name: str, *, spelled: bool = False) -> str:
    """A call as a policy writes it, such as "near(traj, obj, within)"; the direction words are one OFFSET.

    Args:
        name: Of a function in the catalogue.
        spelled: Write the direction words out.
    """
    parts: list[str] = []
    starred = False
    for parameter in _public(CATALOGUE[name]).parameters.values():
        if parameter.kind is parameter.KEYWORD_ONLY and not starred:
            parts.append("*")
            starred = True
        if parameter.name in DIRECTIONS and not spelled:
            if "OFFSET" not in parts:
                parts.append("OFFSET")
        elif parameter.default is parameter.empty:
            parts.append(parameter.name)
        else:
            parts.append(f"{parameter.name}={_plain(parameter.default)}")
    return f"{name}({', '.join(parts)})"


def _public(function: Callable[..., Any]) -> inspect.Signature:
    whole = inspect.signature(function)
    return whole.replace(parameters=[p for p in whole.parameters.values() if p.name not in HIDDEN])


def _plain(default: Any) -> str:
    return f"{default:g}" if isinstance(default, float) else repr(default)


def _bound(function: Callable[..., Any], frame: Frame, recorder: Recorder) -> Callable[..., Any]:
    available = inspect.signature(function).parameters
    context = {name: value for name, value in (("frame", frame), ("recorder", recorder)) if name in available}
    public = _public(function)

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        try:
            public.bind(*args, **kwargs)
        except TypeError as error:
            shown = signature(function.__name__, spelled=True)
            raise ValueError(f"{function.__name__}: {error}; call it as {shown}") from None
        return function(*args, **kwargs, **context)

    # Otherwise inspect.signature() would follow __wrapped__ and show the hidden parameters.
    vars(call).pop("__wrapped__")
    vars(call)["__signature__"] = public
    return call
