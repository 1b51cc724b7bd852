"""What a policy may import, call and touch: the tables behind the check and behind the modules that it is given."""

from __future__ import annotations

import builtins
import re

MODULES: frozenset[str] = frozenset(
    """
    __future__ abc bisect cmath collections collections.abc contextlib copy dataclasses decimal fractions functools
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
    modules system popen
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
