"""Plug-ins: what other packages add to ovita, by the entry points that they declare.

    ovita.writers      a function of a model's name, which gives a `PolicyWriter`
    ovita.operations   a module or function; importing it runs `@operation` (see `ovita.toolkit.catalogue`)
    ovita.robots       a `Robot`, or a function that gives one
    ovita.formats      by a file's ending without its dot: `parse(content, file) -> Task`, `dumps(trajectory, scene)`
    ovita.planners     a function that gives a `Planner`
    ovita.detectors    a function of a model's name and a frame, which gives a `Detector`

Entry points are looked for when a name is asked for that ovita does not know itself, and a plug-in is imported when it
is the one that is meant. One that fails is an `OvitaError` of one sentence which names it. See docs/plugins.md.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache, wraps
from typing import TYPE_CHECKING, Any

from ovita.errors import OvitaError, RequestError
from ovita.text import clean_text

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

KINDS = ("writers", "operations", "robots", "formats", "planners", "detectors")
"""What a plug-in can add."""

MAX_SAID = 300
"""Longest part of a plug-in's own words that is passed on [characters]."""


class PluginWarning(UserWarning):
    """A plug-in that nobody asked for by name cannot be used; everything else goes on without it."""


@cache
def entries(kind: str) -> Mapping[str, EntryPoint]:
    """The entry points of a kind by name in lower case, none of them imported; of two of one name the first.

    A process looks once; `entries.cache_clear()` lets it look again.
    """
    from importlib.metadata import entry_points

    found: dict[str, EntryPoint] = {}
    for entry in entry_points(group=f"ovita.{kind}"):
        found.setdefault(entry.name.lower(), entry)
    return found


def origin(entry: EntryPoint) -> str:
    """The package that declares an entry point, with its version."""
    return f"{entry.dist.name} {entry.dist.version}" if entry.dist is not None else entry.value


def folders(kind: str) -> tuple[str, ...]:
    """The folders that the packages with entry points of a kind are imported from."""
    return tuple(str(entry.dist.locate_file("")) for entry in entries(kind).values() if entry.dist is not None)


def load(kind: str, name: str, error: type[OvitaError] = RequestError) -> Any | None:
    """What a plug-in has under a name, imported; None if no plug-in has the name.

    Raises:
        OvitaError: Of the type `error`, if it cannot be imported.
    """
    entry = entries(kind).get(name.lower())
    if entry is None:
        return None
    with blamed(kind, name, error):
        return entry.load()


def make(kind: str, name: str, wanted: str, *arguments: Any, error: type[OvitaError] = RequestError) -> Any | None:
    """What a plug-in's function under a name gives; None if no plug-in has the name."""
    function = load(kind, name, error)
    if function is None:
        return None
    with blamed(kind, name, error):
        thing = function(*arguments)
    if not callable(getattr(thing, wanted, None)):
        raise RequestError(f"{culprit(kind, name)} gave a {type(thing).__name__}, which has no {wanted}()")
    return Guarded(thing, kind, name, error)


class Guarded:
    """A plug-in's object; what its methods fail with is said in one sentence that names the plug-in."""

    def __init__(self, thing: Any, kind: str, name: str, error: type[OvitaError] = RequestError) -> None:
        self._thing, self._called = thing, (kind, name, error)

    def __getattr__(self, attribute: str) -> Any:
        with blamed(*self._called, passed=(AttributeError,)):
            value = getattr(self._thing, attribute)
        return self._guarded(value) if callable(value) else value

    def _guarded(self, method: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(method)
        def call(*arguments: Any, **options: Any) -> Any:
            with blamed(*self._called):
                return method(*arguments, **options)

        return call


@contextmanager
def blamed(
    kind: str, name: str, error: type[OvitaError] = RequestError, *, passed: tuple[type[Exception], ...] = ()
) -> Iterator[None]:
    """Turn what the code of a plug-in raises into one sentence; ovita's own errors are that already."""
    try:
        yield
    except (Exception, SystemExit) as problem:
        if isinstance(problem, (OvitaError, *passed)):
            raise
        said = clean_text(f"{type(problem).__name__}: {problem}".removesuffix(": "), MAX_SAID)
        raise error(f"{culprit(kind, name)} fails with {said}; mend or uninstall it") from None


def culprit(kind: str, name: str) -> str:
    """A plug-in as the subject of a sentence."""
    entry = entries(kind).get(name.lower())
    return f"the plug-in {origin(entry) if entry else 'package'} ({kind.removesuffix('s')} {name!r})"
