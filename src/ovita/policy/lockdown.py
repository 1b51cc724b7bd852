"""Locking a process in on Linux: Landlock, seccomp, rlimits and capabilities, with ctypes alone.

Everything here runs in the sandbox's child, before the policy does. The order of the steps matters and is argued
where it is not obvious. Numbers are those of the kernel's headers; x86-64 and aarch64 are known.
"""

from __future__ import annotations

import ctypes
import os
import platform
import struct
import sys
from collections.abc import Callable
from dataclasses import dataclass

if sys.platform != "win32":
    import resource

NOBODY = 65534

_PR_SET_PDEATHSIG, _PR_SET_DUMPABLE, _PR_GET_SECCOMP, _PR_SET_SECCOMP, _PR_SET_NO_NEW_PRIVS = 1, 4, 21, 22, 38
_SECCOMP_MODE_FILTER = 2
_SECCOMP_GET_ACTION_AVAIL = 2
_KILL_PROCESS, _ERRNO, _ALLOW = 0x80000000, 0x00050000, 0x7FFF0000
_EPERM = 1
_SIGKILL = 9
_LANDLOCK_CREATE_RULESET, _LANDLOCK_RESTRICT_SELF = 444, 446
_LANDLOCK_VERSION = 1

# Load, jump and return instructions of the classic BPF machine; offsets into struct seccomp_data.
_LOAD, _JUMP_EQ, _JUMP_GE, _JUMP_SET, _AND, _RETURN = 0x20, 0x15, 0x35, 0x45, 0x54, 0x06
_NR, _ARCH, _ARGS = 0, 4, 16

_PROT_EXEC = 4
_MAP_ANONYMOUS, _MAP_LOCKED, _MAP_HUGETLB = 0x20, 0x2000, 0x40000
_FUTEX_COMMAND = 0x7F
_FUTEX_ALLOWED = (0, 1, 9, 10)  # wait, wake, and both with a bit set
_MADVISE_ALLOWED = (4, 8, 14, 15)  # dontneed, free, hugepage, nohugepage


@dataclass(frozen=True)
class _Machine:
    """What differs between processors: the audit number and the system calls."""

    audit: int
    seccomp: int
    capset: int
    write: int
    mmap: int
    mprotect: int
    futex: int
    madvise: int
    plain: tuple[int, ...]
    x32: bool = False


# plain: brk munmap mremap rt_sigprocmask rt_sigreturn sigaltstack sched_yield getpid nanosleep clock_nanosleep
# clock_gettime clock_getres gettimeofday getrandom restart_syscall getcpu exit exit_group (and time on x86-64)
_MACHINES = {
    "x86_64": _Machine(
        0xC000003E, 317, 126, 1, 9, 10, 202, 28,
        (12, 11, 25, 14, 15, 131, 24, 39, 35, 230, 228, 229, 96, 318, 219, 309, 60, 231, 201), x32=True,
    ),
    "aarch64": _Machine(
        0xC00000B7, 277, 91, 64, 222, 226, 98, 233,
        (214, 215, 216, 135, 139, 132, 124, 172, 101, 115, 113, 114, 169, 278, 128, 168, 93, 94),
    ),
}  # fmt: skip


class LockFailed(Exception):
    """A requested restriction could not be applied."""


def landlock_version() -> int:
    """The version of Landlock's interface, or 0 if the kernel has none."""
    if not sys.platform.startswith("linux"):
        return 0
    return max(0, _syscall(_LANDLOCK_CREATE_RULESET, 0, 0, _LANDLOCK_VERSION))


def has_seccomp() -> bool:
    """Whether the kernel filters system calls and this processor's numbers are known."""
    machine = _MACHINES.get(platform.machine())
    if machine is None or not sys.platform.startswith("linux") or struct.calcsize("P") != 8:
        return False
    action = ctypes.c_uint32(_KILL_PROCESS)
    return _syscall(machine.seccomp, _SECCOMP_GET_ACTION_AVAIL, 0, ctypes.addressof(action)) == 0


def missing_locks() -> tuple[str, ...]:
    """What strict isolation needs and this machine lacks."""
    if not sys.platform.startswith("linux"):
        return (f"Landlock and seccomp (this is {platform.system() or sys.platform})",)
    missing = []
    if landlock_version() < 1:
        missing.append("Landlock (Linux 5.13 or later, with landlock among the kernel's lsm)")
    if not has_seccomp():
        missing.append(f"seccomp filters (on x86-64 or aarch64; this is {platform.machine()})")
    return tuple(missing)


def drop_privileges() -> None:
    """Become nobody if root, lose every capability and every way to gain one, and die with the parent."""
    parent = os.getppid()
    if os.geteuid() == 0:
        try:
            os.setgroups([])
            os.setresgid(NOBODY, NOBODY, NOBODY)
            os.setresuid(NOBODY, NOBODY, NOBODY)
        except OSError:
            pass  # a user namespace without that user; the capabilities go all the same
    header = struct.pack("Ii", 0x20080522, 0)
    nothing = ctypes.create_string_buffer(24)
    machine = _MACHINES.get(platform.machine())
    if machine is not None:
        buffer = ctypes.create_string_buffer(header)
        _must("capset", _syscall(machine.capset, ctypes.addressof(buffer), ctypes.addressof(nothing)))
    _must("no_new_privs", _prctl(_PR_SET_NO_NEW_PRIVS, 1))
    _must("dumpable", _prctl(_PR_SET_DUMPABLE, 0))
    _must("pdeathsig", _prctl(_PR_SET_PDEATHSIG, _SIGKILL))  # again: setresuid cleared it
    if os.getppid() != parent:
        os._exit(0)


def die_with(parent: int) -> None:
    """End this process whenever its parent ends."""
    _must("pdeathsig", _prctl(_PR_SET_PDEATHSIG, _SIGKILL))
    if os.getppid() != parent:
        os._exit(0)


def attempt(step: Callable[[], None], best_effort: bool) -> None:
    """Take a step, and pass over its failure if it is an effort only."""
    try:
        step()
    except LockFailed:
        if not best_effort:
            raise


def landlock() -> None:
    """Give up every right that Landlock knows: files, TCP, abstract sockets, signals to others.

    Raises:
        LockFailed: If the kernel refuses.
    """
    version = landlock_version()
    if version < 1:
        raise LockFailed("landlock")
    files = (1 << {1: 13, 2: 14, 3: 15, 4: 15}.get(version, 16)) - 1
    network = 0b11 if version >= 4 else 0
    scopes = 0b11 if version >= 6 else 0
    attributes = ctypes.create_string_buffer(struct.pack("QQQ", files, network, scopes))
    size = 8 if version < 4 else 16 if version < 6 else 24
    ruleset = _must("landlock ruleset", _syscall(_LANDLOCK_CREATE_RULESET, ctypes.addressof(attributes), size, 0))
    _must("landlock", _syscall(_LANDLOCK_RESTRICT_SELF, ruleset, 0))
    os.close(ruleset)


def limit_resources(memory: int, cpu_s: int, *, base: int | None = None) -> None:
    """Set the limits of this process.

    Args:
        memory: How much more address space it may take [bytes].
        cpu_s: Processor time, all in all [s].
        base: Address space that it has now [bytes]; read from /proc if None.
    """
    if sys.platform == "win32":
        return
    base = address_space() if base is None else base
    wanted = {
        "RLIMIT_AS": base + memory,
        "RLIMIT_CPU": cpu_s,
        "RLIMIT_FSIZE": 0,
        "RLIMIT_NOFILE": 0,
        "RLIMIT_NPROC": 0,
        "RLIMIT_CORE": 0,
        "RLIMIT_MEMLOCK": 0,
        "RLIMIT_MSGQUEUE": 0,
    }
    for name, value in wanted.items():
        kind = getattr(resource, name, None)
        if kind is None:
            continue
        hard = resource.getrlimit(kind)[1]
        value = value if hard == resource.RLIM_INFINITY else min(value, hard)
        try:
            resource.setrlimit(kind, (value, value))
        except (ValueError, OSError):
            if sys.platform.startswith("linux"):
                raise LockFailed(name) from None


def address_space() -> int:
    """Address space of this process [bytes], or 0 where the system does not say."""
    try:
        with open("/proc/self/statm", "rb") as file:
            return int(file.read().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError):
        return 0


def seccomp(result: int) -> None:
    """Allow about 25 system calls from here on, all others fail with EPERM; writing only to one descriptor.

    Args:
        result: The descriptor that may be written to.

    Raises:
        LockFailed: If the kernel refuses.
    """
    program = _filter(_MACHINES[platform.machine()], result)
    instructions = ctypes.create_string_buffer(program)
    header = ctypes.create_string_buffer(struct.pack("HxxxxxxP", len(program) // 8, ctypes.addressof(instructions)))
    _must("seccomp", _prctl(_PR_SET_SECCOMP, _SECCOMP_MODE_FILTER, ctypes.addressof(header)))


def _filter(machine: _Machine, result: int) -> bytes:
    """The filter as classic BPF: each system call with conditions is a block that ends in a verdict."""
    deny = [(_RETURN, 0, 0, _ERRNO | _EPERM)]
    allow = [(_RETURN, 0, 0, _ALLOW)]
    kill = [(_RETURN, 0, 0, _KILL_PROCESS)]
    program = [(_LOAD, 0, 0, _ARCH), (_JUMP_EQ, 1, 0, machine.audit), *kill, (_LOAD, 0, 0, _NR)]
    if machine.x32:
        program += [(_JUMP_GE, 0, 1, 0x40000000), *kill]
    for number in machine.plain:
        program += [(_JUMP_EQ, 0, 1, number), *allow]

    def block(number: int, body: list[tuple[int, int, int, int]]) -> None:
        program.extend([(_JUMP_EQ, 0, len(body), number), *body])

    def one_of(argument: int, mask: int, values: tuple[int, ...]) -> list[tuple[int, int, int, int]]:
        body = [(_LOAD, 0, 0, _ARGS + 8 * argument), (_AND, 0, 0, mask)]
        for value in values:
            body += [(_JUMP_EQ, 0, 1, value), *allow]
        return body + deny

    not_executable = [(_LOAD, 0, 0, _ARGS + 8 * 2), (_JUMP_SET, 0, 1, _PROT_EXEC), *deny]
    block(machine.write, one_of(0, 0xFFFFFFFF, (result,)))
    block(machine.futex, one_of(1, _FUTEX_COMMAND, _FUTEX_ALLOWED))
    block(machine.madvise, one_of(2, 0xFFFFFFFF, _MADVISE_ALLOWED))
    block(machine.mprotect, [*not_executable, *allow])
    anonymous = [
        (_LOAD, 0, 0, _ARGS + 8 * 3),
        (_JUMP_SET, 0, 1, _MAP_LOCKED | _MAP_HUGETLB), *deny,
        (_JUMP_SET, 1, 0, _MAP_ANONYMOUS), *deny,
    ]  # fmt: skip
    block(machine.mmap, [*not_executable, *anonymous, *allow])
    program += deny
    return b"".join(struct.pack("HBBI", *instruction) for instruction in program)


def _syscall(number: int, *arguments: int) -> int:
    libc = _libc()
    padded = [*arguments, *[0] * (6 - len(arguments))]
    return int(libc.syscall(ctypes.c_long(number), *(ctypes.c_long(a) for a in padded)))


def _prctl(option: int, *arguments: int) -> int:
    padded = [*arguments, *[0] * (4 - len(arguments))]
    return int(_libc().prctl(ctypes.c_int(option), *(ctypes.c_ulong(a) for a in padded)))


_loaded: list[ctypes.CDLL] = []


def _libc() -> ctypes.CDLL:
    if not _loaded:
        library = ctypes.CDLL(None, use_errno=True)
        library.syscall.restype = ctypes.c_long
        _loaded.append(library)
    return _loaded[0]


def _must(step: str, result: int) -> int:
    if result < 0:
        raise LockFailed(f"{step}: {os.strerror(ctypes.get_errno())}")
    return result
