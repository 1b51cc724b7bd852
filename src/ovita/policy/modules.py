"""The modules and builtins that a checked policy is given: the real functions, without the doors between them."""

from __future__ import annotations

import builtins
import functools
import importlib
import sys
import types
from collections.abc import Callable, Mapping
from typing import Any

from ovita.policy.allowed import BUILTINS, MODULES, ONLY, is_dunder, refusal


class Modules:
    """Reduced copies of the allowed modules, made once and handed to every checked policy.

    A copy holds the public names of the module and other copies; no module can be reached through it.
    """

    def __init__(self) -> None:
        self._copies: dict[str, types.ModuleType] = {}

    def load(self, name: str) -> types.ModuleType:
        """Return the reduced copy of an allowed module, importing and copying it at first use.

        Raises:
            ImportError: If a policy may not import it.
        """
        if name not in MODULES:
            raise ImportError(f"{name} is not available in a policy")
        if name in self._copies:
            return self._copies[name]
        parent, _, child = name.rpartition(".")
        if parent:
            self.load(parent)
        copy = types.ModuleType(name)
        self._copies[name] = copy
        copy.__dict__.update(_public(importlib.import_module(name), name))
        if name == "functools":
            copy.__dict__["wraps"] = _wraps
        if name == "collections":
            copy.__dict__["abc"] = self.load("collections.abc")
        if parent:
            setattr(self._copies[parent], child, copy)
        return copy

    def import_(
        self,
        name: str,
        globals_: Mapping[str, Any] | None = None,
        locals_: Mapping[str, Any] | None = None,
        fromlist: Any = (),
        level: int = 0,
    ) -> types.ModuleType | None:
        """Stand in for `__import__`."""
        if type(fromlist) is list and name in sys.modules:
            return None  # C code of numpy imports through here at run time, and ignores what it gets
        if level:
            raise ImportError("a policy has no package around it")
        module = self.load(name)
        if not fromlist:
            return self._copies[name.split(".")[0]]
        for part in fromlist:
            if f"{name}.{part}" in MODULES:
                self.load(f"{name}.{part}")
        return module


def reduced_builtins(import_: Callable[..., Any], print_: Callable[..., None]) -> dict[str, Any]:
    """The builtins of a checked policy: the harmless ones, and guarded versions of those that are not."""
    reduced = {name: getattr(builtins, name) for name in BUILTINS if hasattr(builtins, name)}
    return {
        **reduced,
        "__import__": import_,
        "print": print_,
        "getattr": _getattr,
        "hasattr": _hasattr,
        "setattr": _setattr,
        "type": _type,
    }


def _public(module: types.ModuleType, name: str) -> dict[str, Any]:
    listed = getattr(module, "__all__", None) or [n for n in vars(module) if not n.startswith("_")]
    wanted = ONLY.get(name, [n for n in listed if refusal(n) is None])
    found = {n: getattr(module, n) for n in wanted if _gives(name, n) and hasattr(module, n)}
    values = {n: value for n, value in found.items() if not isinstance(value, types.ModuleType)}
    if hasattr(module, "__version__"):
        values["__version__"] = module.__version__
    values["__all__"] = [n for n in values if not n.startswith("_")]
    return values


def _gives(module: str, name: str) -> bool:
    """Whether to look a name up at all: looking up a submodule would import it."""
    return f"{module}.{name}" not in sys.modules and (module != "scipy" or name.startswith("__"))


def _checked(name: object) -> str:
    if type(name) is not str:
        raise TypeError("an attribute name must be a text")
    reason = refusal(name)
    if reason:
        raise AttributeError(reason)
    return name


def _getattr(value: Any, name: str, *default: Any) -> Any:
    if isinstance(value, str) and name == "format":
        raise AttributeError("a policy may call .format only on a literal text; use an f-string")
    return getattr(value, _checked(name), *default)


def _hasattr(value: Any, name: str) -> bool:
    return hasattr(value, _checked(name))


def _setattr(target: Any, name: str, value: Any) -> None:
    if is_dunder(_checked(name)):
        raise AttributeError(f"a policy may not set {name}")
    setattr(target, name, value)


def _type(value: Any) -> Any:
    return type(value)


def _wraps(wrapped: Callable[..., Any]) -> Callable[..., Any]:
    return functools.wraps(wrapped)
