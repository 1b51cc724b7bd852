"""The allowlist check: early, readable errors about what a policy may not contain.

On Linux this is a courtesy to the writer of a policy, and the kernel is the wall (`ovita.policy.sandbox`). Elsewhere
it is part of the wall, together with the reduced modules and builtins that `ovita.policy.environment` hands out.
"""

from __future__ import annotations

import ast
import builtins
import difflib
import re

from ovita.errors import PolicyRejected
from ovita.policy.source import all_bindings, own_bindings, parse_tree
from ovita.toolkit import CATALOGUE, extended

MODULES: frozenset[str] = frozenset(
    """
    __future__ abc bisect cmath collections collections.abc contextlib copy dataclasses decimal enum fractions functools
    heapq itertools json math numbers operator random re statistics string typing warnings
    numpy numpy.exceptions numpy.fft numpy.lib numpy.lib.stride_tricks numpy.linalg numpy.ma
    numpy.polynomial numpy.polynomial.polynomial numpy.random numpy.typing
    scipy scipy.fft scipy.integrate scipy.interpolate scipy.linalg scipy.ndimage scipy.optimize scipy.signal
    scipy.signal.windows scipy.spatial scipy.spatial.distance scipy.spatial.transform scipy.special scipy.stats
    """.split()
)
"""Every module that a policy may import."""

SCIPY_PARTS: tuple[str, ...] = tuple(sorted(m for m in MODULES if m.startswith("scipy.")))
"""The parts of scipy, in the order that the worker's request mask counts them."""

ONLY: dict[str, frozenset[str]] = {
    "copy": frozenset({"copy", "deepcopy"}),
    "json": frozenset({"loads", "dumps", "JSONDecodeError"}),
    "contextlib": frozenset({"suppress", "nullcontext", "contextmanager"}),
    "abc": frozenset({"ABC", "ABCMeta", "abstractmethod"}),
    "string": frozenset({"ascii_letters", "ascii_lowercase", "ascii_uppercase", "digits", "punctuation"}),
    "warnings": frozenset({"warn", "filterwarnings", "simplefilter"}),
    "numpy.lib": frozenset(),
    "numpy.lib.stride_tricks": frozenset({"sliding_window_view", "broadcast_to", "broadcast_arrays"}),
    "__future__": frozenset({"annotations"}),
    "enum": frozenset({"Enum", "IntEnum", "StrEnum", "Flag", "IntFlag", "auto", "unique"}),
}
"""Modules of which only these names are given."""

DENIED_ATTRIBUTES: frozenset[str] = frozenset(
    """
    load save savez savez_compressed savetxt loadtxt genfromtxt fromfile tofile fromregex memmap open_memmap
    DataSource ctypeslib f2py ctypes cffi capsule dump as_strided from_dlpack get_include info show_config
    show_runtime bmat setbufsize getbufsize seterrcall geterrcall testing distutils npyio LowLevelCallable
    gi_frame gi_code gi_yieldfrom cr_frame cr_code cr_await cr_origin ag_frame ag_code ag_await f_globals f_locals
    f_builtins f_back f_code f_trace tb_frame tb_next tb_lasti tb_lineno co_code co_consts co_names func_globals
    func_code im_func im_self mro attrgetter methodcaller get_type_hints ForwardRef singledispatch
    singledispatchmethod make_dataclass update_wrapper SystemRandom Formatter format_map
    os sys builtins subprocess importlib socket inspect threading multiprocessing pickle posix ctypes_lib
    modules system popen _convert _convert_ _create_ _add_alias_ _add_value_alias_ _add_member_
    """.split()
)
"""Attributes that lead out of a policy, whatever they are read from."""

ALLOWED_DUNDERS: frozenset[str] = frozenset(
    """
    __init__ __post_init__ __call__ __len__ __getitem__ __setitem__ __delitem__ __iter__ __next__ __contains__
    __reversed__ __repr__ __str__ __bool__ __float__ __int__ __index__ __abs__ __neg__ __pos__ __invert__ __hash__
    __eq__ __ne__ __lt__ __le__ __gt__ __ge__ __add__ __radd__ __iadd__ __sub__ __rsub__ __isub__ __mul__ __rmul__
    __imul__ __truediv__ __rtruediv__ __itruediv__ __floordiv__ __rfloordiv__ __mod__ __rmod__ __pow__ __rpow__
    __matmul__ __rmatmul__ __and__ __or__ __xor__ __round__ __enter__ __exit__ __slots__ __name__
    __doc__ __version__ __qualname__ __class__
    """.split()
)
"""Double-underscore names that a class may define and code may read."""

NAMEDTUPLE = frozenset({"_replace", "_asdict", "_fields", "_make"})

BUILTINS: frozenset[str] = frozenset(
    """
    abs all any ascii bin bool bytearray bytes callable chr classmethod complex dict divmod enumerate filter float
    format frozenset getattr hasattr hash hex id int isinstance issubclass iter len list map max min next object oct
    ord pow print property range repr reversed round set setattr slice sorted staticmethod str sum super tuple type zip
    True False None Ellipsis NotImplemented __build_class__ __debug__ __name__
    """.split()
) | {name for name, value in vars(builtins).items() if isinstance(value, type) and issubclass(value, BaseException)}
"""Builtins that a policy may use."""

_FILES = "a policy may not open files; the trajectory is already in `traj`"
_NETWORK = "a policy may not use the network; everything it needs is in `traj` and `scene`"
_PROCESSES = "a policy may not start processes or threads or send signals"
_INTERPRETER = "a policy may not look into the interpreter"
_CODE = "a policy may not run text as code; write the code itself"

REASONS: dict[str, str] = {
    **dict.fromkeys(
        "os io pathlib shutil glob tempfile fileinput mmap zipfile tarfile sqlite3 dbm shelve csv h5py posix nt "
        "codecs linecache zipimport fcntl open load save savez savez_compressed savetxt loadtxt genfromtxt fromfile "
        "tofile fromregex memmap open_memmap DataSource dump npyio".split(),
        _FILES,
    ),
    **dict.fromkeys(
        "socket ssl urllib http requests httpx ftplib smtplib telnetlib xmlrpc asyncio selectors select "
        "socketserver aiohttp webbrowser".split(),
        _NETWORK,
    ),
    **dict.fromkeys(
        "subprocess multiprocessing threading _thread concurrent signal pty sched joblib dask system popen".split(),
        _PROCESSES,
    ),
    **dict.fromkeys(
        "sys inspect gc builtins importlib types traceback ast dis symtable code codeop atexit site runpy pkgutil "
        "imp platform resource ctypes _ctypes cffi weakref tracemalloc faulthandler globals locals vars dir "
        "__builtins__ __import__ __loader__ __spec__ modules".split(),
        _INTERPRETER,
    ),
    **dict.fromkeys("eval exec compile pickle marshal cloudpickle dill numexpr numba".split(), _CODE),
    **dict.fromkeys("input breakpoint pdb getpass".split(), "a policy may not ask anybody; give it parameters instead"),
    **dict.fromkeys(
        "time datetime timeit uuid secrets".split(), "a policy depends on its input alone, not on the time"
    ),
    **dict.fromkeys("exit quit".split(), "a policy may not end the program; return the trajectory"),
    **dict.fromkeys(
        "as_strided ctypes ctypeslib f2py capsule from_dlpack memoryview LowLevelCallable".split(),
        "a policy may not reach into memory; use plain numpy indexing",
    ),
}
"""Why something is refused, by the name that was met."""

_DUNDER = re.compile(r"__\w*__\Z")
_FORMAT_FIELD = re.compile(r"\{[^{}]*?(?:\.\s*_|\[\s*_|__)")


def is_dunder(name: str) -> bool:
    """Whether a name belongs to Python itself, such as `__globals__`; `__private` does not."""
    return _DUNDER.match(name) is not None


def refusal(attribute: str) -> str | None:
    """Why an attribute of that name may not be touched, or None if it may."""
    if attribute in DENIED_ATTRIBUTES:
        return REASONS.get(attribute, f"a policy may not use {attribute}")
    if is_dunder(attribute) and attribute not in ALLOWED_DUNDERS:
        return f"a policy may not touch {attribute}"
    return None


def opens_objects(template: str) -> bool:
    """Whether a `str.format` template reads underscored attributes or items of its arguments."""
    return _FORMAT_FIELD.search(template) is not None


def scipy_parts(source: str) -> int:
    """Bit mask over `SCIPY_PARTS` of the parts that a source mentions; bit 31 says that it mentions scipy at all."""
    if "scipy" not in source:
        return 0
    mask = 1 << 31
    for i, part in enumerate(SCIPY_PARTS):
        if all(re.search(rf"\b{word}\b", source) for word in part.split(".")):
            mask |= 1 << i
    return mask


SCRIPT_CALLS = ("get_trajectory", "detect_objects")
"""What the script form of the paper calls."""

PROVIDED = frozenset({*CATALOGUE, *SCRIPT_CALLS, "np", "math"})
"""Names at hand in every policy, besides the operations of plug-ins."""

_TYPE = "a policy may call type(value) with one value, and nothing else with type"
_LONGEST_HINT = 40
_INSTEAD = "numpy (as np), math and parts of scipy are at hand"


def check(source: str | ast.Module) -> None:
    """Check that a policy contains only what it may.

    Raises:
        PolicyRejected: With the line and what to do instead.
    """
    tree = parse_tree(source) if isinstance(source, str) else source
    try:
        _Check(tree).visit(tree)
    except RecursionError:
        raise PolicyRejected("an expression is nested too deeply; split it into several statements") from None


class _Check(ast.NodeVisitor):
    """Visits every node; each visitor looks at one kind."""

    def __init__(self, tree: ast.Module) -> None:
        self.bound = all_bindings(tree)
        self.private = _own_attributes(tree) | NAMEDTUPLE
        self.star = any(isinstance(n, ast.ImportFrom) and any(a.name == "*" for a in n.names) for n in ast.walk(tree))

    def generic_visit(self, node: ast.AST) -> None:
        for name in own_bindings(node):
            self.binding(name, node)
        super().generic_visit(node)

    def binding(self, name: str, node: ast.AST) -> None:
        if is_dunder(name) and name not in ALLOWED_DUNDERS and name != "__all__":
            raise _reject(node, REASONS.get(name, f"a policy may not define {name}"))

    def visit_Import(self, node: ast.Import) -> None:
        for alias in node.names:
            self.module(alias.name, node)
        self.generic_visit(node)

    def visit_ImportFrom(self, node: ast.ImportFrom) -> None:
        if node.level:
            raise _reject(node, f"a policy has no package around it, so it cannot import relatively; {_INSTEAD}")
        module = node.module or ""
        self.module(module, node)
        for name in (alias.name for alias in node.names):
            if f"{module}.{name}" in MODULES or name == "*":
                continue
            if module == "scipy":
                raise _reject(node, f"scipy.{name} is not available in a policy; {_INSTEAD}")
            reason = refusal(name)
            if reason or name not in ONLY.get(module, (name,)) or name.startswith("_"):
                raise _reject(node, reason or REASONS.get(name) or f"a policy may not import {name} from {module}")
        self.generic_visit(node)

    def module(self, name: str, node: ast.AST) -> None:
        if name in MODULES:
            return
        root = name.split(".")[0]
        why = REASONS.get(name) or REASONS.get(root) or REASONS.get(name.split(".")[-1])
        why = why or f"{name} is not available in a policy"
        raise _reject(node, f"{why} (import {name}); {_INSTEAD}" if root in REASONS else f"{why}; {_INSTEAD}")

    def visit_Name(self, node: ast.Name) -> None:
        name = node.id
        if not isinstance(node.ctx, ast.Load) or name in self.bound or name in PROVIDED:
            self.binding(name, node)
        elif name == "type":
            raise _reject(node, _TYPE)
        elif name not in BUILTINS:
            self.foreign(name, node)

    def foreign(self, name: str, node: ast.Name) -> None:
        """Refuse a name that is neither bound nor provided, unless a star import may have brought it."""
        inbuilt, why = hasattr(builtins, name) or is_dunder(name), REASONS.get(name, "")
        if not inbuilt and name in extended():
            return
        if inbuilt and not why:
            raise _reject(node, f"a policy may not use {name}")
        if self.star and not inbuilt:
            return
        if why:
            raise _reject(node, why if inbuilt and "open files" in why else f"{why} ({name})")
        known = [n for n in sorted(PROVIDED | BUILTINS | extended() | self.bound) if len(n) <= _LONGEST_HINT][:2000]
        near = difflib.get_close_matches(name[:_LONGEST_HINT], known, 1, 0.75)
        hint = f"; did you mean {near[0]}?" if near else ""
        raise _reject(node, f"{name} is not defined{hint}")

    def visit_Attribute(self, node: ast.Attribute) -> None:
        name = node.attr
        reason = refusal(name)
        if reason:
            raise _reject(node, reason)
        if name == "format" and name not in self.private:
            if not (isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)):
                raise _reject(node, "a policy may call .format only on a literal text; use an f-string")
            if opens_objects(node.value.value):
                raise _reject(node, "a policy may not reach attributes through .format; use an f-string")
        if name.startswith("_") and not is_dunder(name) and name not in self.private:
            raise _reject(node, f"a policy may not touch the private {name}")
        if not isinstance(node.ctx, ast.Load) and is_dunder(name):
            raise _reject(node, f"a policy may not set {name}")
        self.visit(node.value)

    def visit_Call(self, node: ast.Call) -> None:
        match node.func, node.args:
            case ast.Name(id="type"), args if "type" not in self.bound:
                if len(args) != 1 or node.keywords or isinstance(args[0], ast.Starred):
                    raise _reject(node, _TYPE)
                self.visit(args[0])
                return
            case ast.Name(id="getattr" | "setattr" | "hasattr"), [_, ast.Constant(value=str() as name), *_]:
                if reason := refusal(name):
                    raise _reject(node, reason)
        self.generic_visit(node)

    def visit_keyword(self, node: ast.keyword) -> None:
        if node.arg == "refcheck":
            raise _reject(node, "a policy may not reach into memory; use np.resize or np.concatenate")
        if node.arg is not None and is_dunder(node.arg):
            raise _reject(node, f"a policy may not pass {node.arg}")
        self.generic_visit(node)

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        for keyword in node.keywords:
            plain = isinstance(keyword.value, ast.Name | ast.Attribute)
            if keyword.arg == "metaclass" and not (plain and ast.unparse(keyword.value).endswith("ABCMeta")):
                raise _reject(node, "a policy may not use metaclasses; write a plain class")
        self.generic_visit(node)

    def visit_MatchClass(self, node: ast.MatchClass) -> None:
        for name in node.kwd_attrs:
            reason = refusal(name)
            if reason or name == "format" or (name.startswith("_") and name not in self.private):
                raise _reject(node, reason or f"a policy may not match the attribute {name}")
        self.generic_visit(node)

    def visit_arg(self, node: ast.arg) -> None:
        self.binding(node.arg, node)  # and not its annotation, which is never evaluated

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        self.visit(node.target)
        if node.value is not None:
            self.visit(node.value)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        self.binding(node.name, node)
        for part in (*node.decorator_list, node.args, *node.body):
            self.visit(part)

    def visit_AsyncFunctionDef(self, node: ast.AsyncFunctionDef | ast.Await) -> None:
        raise _reject(node, "a policy may not be asynchronous; write plain functions")

    visit_Await = visit_AsyncFunctionDef


def _own_attributes(tree: ast.Module) -> set[str]:
    """Attributes that the policy's own classes define: methods, class variables, and what they set on self."""
    names: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef):
            for inner in ast.walk(node):
                names.update(own_bindings(inner) if isinstance(inner, ast.FunctionDef | ast.Name) else ())
                if isinstance(inner, ast.Attribute) and not isinstance(inner.ctx, ast.Load):
                    names.add(inner.attr)
    return {name for name in names if not is_dunder(name)}


def _reject(node: ast.AST, problem: str) -> PolicyRejected:
    return PolicyRejected(problem, line=getattr(node, "lineno", None))
