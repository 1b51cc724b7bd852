"""Every name that a policy may call, bound to a scene's frame for a run and described for a prompt."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any

from ovita.paths.scene import DIRECTIONS, Frame
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

GROUPS: Mapping[str, tuple[Callable[..., Any], ...]] = MappingProxyType(
    {
        "Choose waypoints": (
            select.near,
            select.first,
            select.last,
            select.between,
            select.where_rising,
            select.every,
        ),
        "Shift the path and its ends": (
            shift.move,
            ends.move_start,
            ends.move_goal,
            shift.midpoint,
        ),
        "Objects: come closer, stay away, pass": (
            approach.closer,
            approach.farther,
            approach.keep_distance,
            ends.go_through,
            overhead.hop,
            overhead.hover,
        ),
        "Go on, or go straight": (
            ends.extend,
            ends.continue_to,
            routes.shortcut,
            routes.straighten,
        ),
        "Reshape the whole": (
            transforms.curve,
            transforms.rotate,
            transforms.tilt,
            transforms.mirror,
            transforms.scale,
        ),
        "Draw figures": (
            loops.spiral,
            loops.circle,
            loops.figure_eight,
            ripples.zigzag,
            ripples.wave,
            ripples.noise,
        ),
        "Keep to a region": (
            regions.bound,
            regions.stay_on,
            regions.quadrant,
            regions.at_height,
        ),
        "Speed": (
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
        ),
        "Waypoints": (
            edit.smooth,
            edit.resample,
            routes.average,
            routes.reverse,
        ),
        "State what is meant": (
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
        ),
    }
)
"""The functions by what they are for, in the order in which a prompt and the page show them."""

CATALOGUE: Mapping[str, Callable[..., Any]] = MappingProxyType(
    {function.__name__: function for functions in GROUPS.values() for function in functions}
)
"""The functions by name."""

CORE = (
    "near",
    "first",
    "last",
    "move",
    "closer",
    "farther",
    "keep_distance",
    "scale_speed",
    "expect_closer",
    "expect_farther",
    "expect_distance",
    "expect_moved",
    "expect_slower",
    "expect_faster",
)
"""The functions that every prompt shows; others are shown where the instruction seems to need them."""

RARE = frozenset({"angle", "blend", "brake", "ease", "hold", "ramp", "reach", "seed", "smooth", "width"})
"""Parameters with defaults that a prompt leaves out to stay short; the page has them all."""

NOTES = {
    "OFFSET": f"{', '.join(f'{word}=' for word in DIRECTIONS)} in metres, such as left=0.2, up=0.1",
    "PLACE": 'object, point, index (int), share of the path (float), "start" or "goal"',
}
"""What the words in capitals stand for."""


def namespace(frame: Frame, recorder: Recorder) -> dict[str, Callable[..., Any]]:
    """The catalogue for one run of a policy: each function knows the frame and the recorder.

    Args:
        frame: Which way is left.
        recorder: Collects contacts and expectations.

    A call that does not fit a function's signature raises a ValueError that shows the signature.
    """
    return {name: _bound(function, frame, recorder) for name, function in CATALOGUE.items()}


def describe(names: Iterable[str] | None = None, *, known_notes: Iterable[str] = ()) -> str:
    """The catalogue as text for a prompt: for each function its signature and first sentence, in catalogue order.

    Optional parameters are marked with "?". The expectations, whose names say it all, share a line.

    Args:
        names: Only these functions; None for all.
        known_notes: The words in capitals, OFFSET and PLACE, that were explained before; others are explained first.

    Raises:
        ValueError: If a name is not in the catalogue.
    """
    wanted = in_order(names)
    lines = [f"{signature(name, brief=True)}: {summary(name)}" for name in wanted if not name.startswith("expect_")]
    expectations = [signature(name, brief=True) for name in wanted if name.startswith("expect_")]
    lines += [", ".join(expectations)] if expectations else []
    for word, meaning in reversed(NOTES.items()):
        if word not in known_notes and any(word in line for line in lines):
            lines.insert(0, f"{word}: {meaning}")
    return "\n".join(lines)


def in_order(names: Iterable[str] | None = None) -> list[str]:
    """The names in catalogue order; None for all.

    Raises:
        ValueError: If one is not in the catalogue.
    """
    wanted = list(CATALOGUE) if names is None else list(names)
    unknown = [name for name in wanted if name not in CATALOGUE]
    if unknown:
        raise ValueError(f"the toolkit has no {', '.join(unknown)}; it has {', '.join(CATALOGUE)}")
    return [name for name in CATALOGUE if name in wanted]


def summary(name: str) -> str:
    """The first sentence of a function's description, without its full stop."""
    return (CATALOGUE[name].__doc__ or "").strip().splitlines()[0].rstrip(".")


def signature(name: str, *, spelled: bool = False, brief: bool = False) -> str:
    """A call as a policy writes it, such as "move(traj, *, OFFSET, where=None, ...)".

    Args:
        name: Of a function in the catalogue.
        spelled: Write the direction words out, instead of one OFFSET for all.
        brief: For a prompt: optional parameters are marked with "?" and rare ones left out.
    """
    parts: list[str] = []
    for parameter in public_signature(name).parameters.values():
        optional = parameter.default is not parameter.empty
        if brief and optional and parameter.name in RARE:
            continue
        if not brief and parameter.kind is parameter.KEYWORD_ONLY and "*" not in parts:
            parts.append("*")
        if parameter.name in DIRECTIONS and not spelled:
            if "OFFSET" not in parts:
                parts.append("OFFSET")
        elif not optional:
            parts.append(parameter.name)
        else:
            parts.append(f"{parameter.name}?" if brief else f"{parameter.name}={_plain(parameter.default)}")
    return f"{name}({', '.join(parts)})"


def public_signature(name: str) -> inspect.Signature:
    """A function's signature without what the runtime fills in."""
    return _public(CATALOGUE[name])


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
