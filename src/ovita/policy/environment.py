"""What a policy finds around it inside the sandbox: modules, builtins, toolkit and scene; and reading its result."""

from __future__ import annotations

import builtins
import enum
import functools
import gc
import importlib
import math
import random
import sys
import threading
import time
import types
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ovita.errors import PolicyError, PolicyOutputInvalid
from ovita.paths.scene import Frame, Scene, SceneObject
from ovita.paths.trajectory import Array
from ovita.policy import wire
from ovita.policy.check import BUILTINS, MODULES, ONLY, SCIPY_PARTS, check, is_dunder, refusal
from ovita.policy.source import RESULT, EntryPoint, entry_of, parse_tree, stated, to_rows
from ovita.toolkit import Recorder, extended, namespace


class Waypoint(dict[str, float]):
    """A waypoint of the script form: x, y, z and velocity; `speed` may be read too."""

    def __missing__(self, key: str) -> float:
        if key == "speed":
            return self["velocity"]
        raise KeyError(key)


def scene_to_json(scene: Scene) -> dict[str, Any]:
    """A scene as plain JSON values; what else the scene file says of an object goes along if it is plain too."""
    return {
        "frame": scene.frame.name,
        "level": scene.frame.level,
        "environment": scene.environment,
        "objects": [
            {
                "name": item.name,
                "position": item.position.tolist(),
                "dimensions": None if item.dimensions is None else item.dimensions.tolist(),
                "orientation": item.orientation.tolist(),
            }
            for item in scene
        ],
    }


def scene_from_json(value: dict[str, Any]) -> Scene:
    """The inverse of `scene_to_json`."""
    objects = (
        SceneObject(o["name"], np.array(o["position"]), _array(o["dimensions"]), np.array(o["orientation"]))
        for o in value["objects"]
    )
    return Scene(tuple(objects), Frame(value["frame"], value["level"]), value["environment"])


def _array(value: list[float] | None) -> Array | None:
    return None if value is None else np.array(value, dtype=float)


def trajectory_getter(original: Array) -> Callable[[], list[Waypoint]]:
    """The script form's `get_trajectory` for rows x, y, z, speed (N, 4)."""

    def get_trajectory() -> list[Waypoint]:
        """All waypoints of the trajectory, as dicts x, y, z [m], velocity [m/s]."""
        return [Waypoint(x=x, y=y, z=z, velocity=v) for x, y, z, v in original.tolist()]

    return get_trajectory


def object_detector(scene: Scene) -> Callable[..., list[dict[str, Any]]]:
    """The script form's `detect_objects` for a scene."""

    def detect_objects(name: str | None = None) -> list[dict[str, Any]]:
        """The objects of the scene, or those that a name can mean, as dicts name, x, y, z, dimensions [m]."""
        found = list(scene)
        if name is not None:
            one = scene.find(str(name))
            found = [one] if one else [item for item in scene if str(name).lower() in item.name.lower()]
        return [
            {
                "name": item.name.lower(),
                **dict(zip("xyz", item.position.tolist(), strict=True)),
                "dimensions": item.size.tolist(),
            }
            for item in found
        ]

    return detect_objects


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
        copy.__dict__.update(_public(importlib.import_module(name), name) | _GUARDED.get(name, {}))
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
        "type": lambda value: type(value),
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


class _ClosedEnum(enum.EnumType):
    """Makes enumerations by a class statement only; a call with names could give a class any attribute."""

    def __call__(cls, value: Any) -> Any:  # type: ignore[override]
        """The member of a value."""
        return super().__call__(value)


_GUARDED: dict[str, dict[str, Any]] = {
    "functools": {"wraps": lambda wrapped: functools.wraps(wrapped)},
    "enum": {
        open_.__name__: types.new_class(open_.__name__, (open_,), {"metaclass": _ClosedEnum})
        for open_ in (enum.Enum, enum.IntEnum, enum.StrEnum, enum.Flag, enum.IntFlag)
    },
}
"""What stands in for names of modules that would give a policy more than it may have."""


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


FILENAME = "<policy>"
SEED = 20240229

_REHEARSAL = wire.pack_payload(
    {
        "source": "def adapt(traj, scene, *, d=0.1):\n    traj = np.asarray(traj)[:, :4] + d\n    return f'{traj}'\n",
        "scene": {
            "frame": "rfu",
            "level": None,
            "environment": "",
            "objects": [{"name": "cup", "position": [0, 0, 0], "dimensions": None, "orientation": [1, 0, 0, 0]}],
        },
    },
    np.zeros((2, 4)),
)

Execute = Callable[[str, dict[str, Any]], None]


class Prints:
    """Stands in for stdout and keeps the first few characters."""

    encoding = "utf-8"

    def __init__(self) -> None:
        self.parts: list[str] = []
        self.room = wire.MAX_PRINTS

    def write(self, text: str) -> int:
        """Keep what there is room for."""
        if self.room > 0:
            part = str(text[: self.room])
            self.parts.append(part)
            self.room -= len(part)
        return len(text)

    def flush(self) -> None:
        """Do nothing."""

    def isatty(self) -> bool:
        """Say no."""
        return False

    def print(self, *values: object, sep: str | None = " ", end: str | None = "\n", **_: object) -> None:
        """Stand in for the builtin `print`."""
        if self.room > 0:
            self.write((" " if sep is None else sep).join(map(str, values)) + ("\n" if end is None else end))


@dataclass
class PolicyRun:
    """A policy prepared to run, and its outcome afterwards."""

    source: str = ""
    entry: EntryPoint = field(default_factory=lambda: EntryPoint("function"))
    given: Array = field(default_factory=lambda: np.zeros((0, 4)))
    scene: Scene = field(default_factory=Scene)
    recorder: Recorder = field(default_factory=Recorder)
    namespace: dict[str, Any] = field(default_factory=dict)
    rows: Array | None = None
    failure: dict[str, Any] | None = None

    def __post_init__(self) -> None:
        self.original = self.given[:, :4].copy()

    @classmethod
    def failed(cls, kind: str, message: str, line: int | None = None) -> PolicyRun:
        """A run that failed before it began."""
        return cls(failure=_failure(kind, message, line))

    def run(self, execute: Execute) -> None:
        """Run the policy and read its result, or note why there is none."""
        try:
            execute(self.source, self.namespace)
            if self.entry.form == "function":
                arguments = (self.given, self.scene)[: self.entry.arguments]
                result, what = self.namespace[self.entry.name](*arguments), f"the result of {self.entry.name}"
            else:
                result, what = self.namespace.get(RESULT), RESULT
            self.rows = to_rows(result, self.original, what)
        except BaseException as error:
            self.failure = _explained(error)

    def payload(self, prints: Prints) -> bytes:
        """Everything as bytes."""
        header = self.failure or {"status": "ok", **stated(self.recorder)}
        header["prints"] = "".join(prints.parts)
        try:
            return wire.pack_payload(header, None if self.failure else self.rows)
        except (TypeError, ValueError, RecursionError):
            return wire.pack_payload(_failure("output", wire.NOT_PLAIN))


class Environment:
    """What every policy finds in place: made once in a worker, copied by each fork."""

    def __init__(self, modules: Modules) -> None:
        self.modules = modules
        self.prints = Prints()
        for name in sorted(MODULES):
            if not name.startswith("scipy"):
                modules.load(name)
        self.builtins = reduced_builtins(modules.import_, self.prints.print)
        make_deterministic()

    def warm_up(self) -> None:
        """Import everything in advance, since nothing can be imported after lockdown."""
        warm_up()
        extended()
        namespace(Frame(), Recorder())
        _freeze()

    def load_scipy(self, mask: int) -> None:
        """Load parts of scipy, as `allowed.scipy_parts` counts them."""
        if mask:
            self.modules.load("scipy")
            for i, part in enumerate(SCIPY_PARTS):
                if mask & (1 << i):
                    self.modules.load(part)
            warm_up_scipy()
            _freeze()

    def rehearsal(self) -> Iterator[Callable[[], object]]:
        """Steps of going through the motions, so that a forked process has its pages before the clock runs."""
        yield lambda: self.prepare(_REHEARSAL, checked=True)
        yield lambda: PolicyRun.failed("", "").payload(self.prints)
        yield _common_calls

    def prepare(self, body: bytes | bytearray, *, checked: bool) -> PolicyRun:
        """Make a policy ready to run from the body of a request."""
        header, table = wire.unpack_payload(memoryview(body))
        try:
            tree = parse_tree(header["source"])
            job = PolicyRun(header["source"], entry_of(tree), table, scene_from_json(header["scene"]))
            if checked:
                check(tree)
        except PolicyError as error:
            return PolicyRun.failed("rejected", error.problem, error.line)
        name = "__main__" if job.entry.form == "script" else "policy"
        module = sys.modules[name] = types.ModuleType(name)
        job.namespace = module.__dict__
        for hidden in ("__loader__", "__spec__", "__package__"):
            del job.namespace[hidden]
        job.namespace.update(
            namespace(job.scene.frame, job.recorder),
            np=self.modules.load("numpy") if checked else np,
            math=self.modules.load("math") if checked else math,
            get_trajectory=trajectory_getter(job.original),
            detect_objects=object_detector(job.scene),
            __builtins__=self.builtins if checked else builtins,
        )
        seed_all()
        return job


def _failure(kind: str, message: str, line: int | None = None) -> dict[str, Any]:
    return {"status": kind, "message": message[: wire.MAX_MESSAGE], "line": line}


def _explained(error: BaseException) -> dict[str, Any]:
    """A failure as a JSON object; asking the error for its text runs code of the policy, so that may fail too."""
    if isinstance(error, PolicyOutputInvalid):
        return _failure("output", error.problem, error.line)
    if isinstance(error, MemoryError):
        return _failure("memory", "it used too much memory", _line(error))
    name = type(error).__name__
    if isinstance(error, SystemExit | KeyboardInterrupt | GeneratorExit):
        return _failure("crashed", f"it ended with {name}; a policy returns its trajectory instead", _line(error))
    try:
        text = str(error)
    except BaseException:
        text = ""
    return _failure("crashed", f"{name}: {text}" if text else name, _line(error))


def _line(error: BaseException) -> int | None:
    """The last line of the policy that the error passed through."""
    if isinstance(error, SyntaxError) and error.filename == FILENAME:
        return error.lineno
    line, frame = None, error.__traceback__
    while frame is not None:
        if frame.tb_frame.f_code.co_filename == FILENAME:
            line = frame.tb_lineno
        frame = frame.tb_next
    return line


def make_deterministic() -> None:
    """Give generators that are made without a seed a fixed one, so that a policy is a function of its input."""
    original = random.Random.seed

    def fixed(self: random.Random, a: Any = None, version: int = 2) -> None:
        original(self, SEED if a is None else a, version)

    random.Random.seed = fixed  # type: ignore[method-assign]


def seed_all() -> None:
    """Start every source of chance from the same point."""
    np.random.bit_generator.randbits = random.Random(SEED).getrandbits  # type: ignore[attr-defined]
    random.seed(SEED)
    np.random.seed(SEED)


def _common_calls() -> Array:
    """What most policies call."""
    rows = np.linspace(0.0, 1.0, 12).reshape(4, 3)
    rows.mean(), rows.sum(axis=0), rows.any(), np.linalg.norm(rows - rows[0], axis=1), np.where(rows > 0.5, rows, 0.0)
    return rows


def warm_up() -> None:
    """Touch what numpy and Python import late, since nothing can be imported once the door is locked."""
    rows = _common_calls()
    np.median(rows), str(rows), f"{rows!r}"
    rows.std(), np.unique(rows), np.einsum("ij,ij->i", rows, rows), np.polyfit([0, 1, 2], [0, 1, 4], 1)
    np.interp(0.5, [0, 1], [0, 1]), np.gradient(rows, axis=0), np.random.default_rng(0).normal(), np.fft.fft([1, 2])
    np.ma.masked_array([1], [False]), np.isclose(rows, rows).all(), np.percentile(rows, 50), rows.var(axis=0)
    "ä".encode("latin-1"), "a".encode("ascii"), b"a".decode("unicode_escape")


def warm_up_scipy() -> None:
    """Touch what scipy imports late, for the parts that are loaded."""
    x = np.linspace(0.0, 1.0, 12)
    loaded: Callable[[str], Any] = sys.modules.get
    if interpolate := loaded("scipy.interpolate"):
        interpolate.CubicSpline(x, x)(x), interpolate.interp1d(x, x)(x), interpolate.UnivariateSpline(x, x)(x)
        interpolate.splev(x, interpolate.splprep([x, x**2], s=0)[0]), interpolate.make_interp_spline(x, x)(x)
    if ndimage := loaded("scipy.ndimage"):
        ndimage.gaussian_filter1d(x, 1.0), ndimage.uniform_filter1d(x, 3)
    if signal := loaded("scipy.signal"):
        signal.savgol_filter(x, 5, 2)
    if optimize := loaded("scipy.optimize"):
        optimize.minimize(lambda p: float((p**2).sum()), [1.0])
        optimize.differential_evolution(lambda p: float((p**2).sum()), [(0, 1)], maxiter=1, popsize=2, seed=1)
    if linalg := loaded("scipy.linalg"):
        linalg.logm(np.eye(2))
    if spatial := loaded("scipy.spatial"):
        spatial.cKDTree(x[:, None]).query(x[:, None])


def _freeze() -> None:
    """Keep the collector from touching what forked processes share."""
    gc.collect()
    gc.freeze()


def watch_memory(limit: int) -> None:
    """End the process when it has taken more memory than allowed, where the kernel does not enforce it."""
    if sys.platform != "darwin":
        return
    import os
    import resource

    start = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

    def watch() -> None:
        while resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - start < limit:
            time.sleep(0.05)
        os._exit(71)

    threading.Thread(target=watch, daemon=True).start()
