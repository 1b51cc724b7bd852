"""Confining a process on Windows: a job object with a memory limit and room for one process. Untested on Windows."""

from __future__ import annotations

import ctypes
import sys
from typing import Any

from ovita.errors import IsolationUnavailable

_LIMIT_ACTIVE_PROCESS, _LIMIT_PROCESS_MEMORY, _LIMIT_DIE_ON_EXCEPTION, _KILL_ON_CLOSE = 0x8, 0x100, 0x400, 0x2000
_EXTENDED_LIMITS = 9
_SET_QUOTA_AND_TERMINATE = 0x0100 | 0x0001
_BASE_BYTES = 512 << 20  # what Python and numpy commit before a policy runs, generously


class _BasicLimits(ctypes.Structure):
    _fields_ = (
        ("per_process_time", ctypes.c_int64),
        ("per_job_time", ctypes.c_int64),
        ("flags", ctypes.c_uint32),
        ("minimum_working_set", ctypes.c_size_t),
        ("maximum_working_set", ctypes.c_size_t),
        ("active_processes", ctypes.c_uint32),
        ("affinity", ctypes.c_size_t),
        ("priority_class", ctypes.c_uint32),
        ("scheduling_class", ctypes.c_uint32),
    )


class _ExtendedLimits(ctypes.Structure):
    _fields_ = (
        ("basic", _BasicLimits),
        ("io_counters", ctypes.c_uint64 * 6),
        ("process_memory", ctypes.c_size_t),
        ("job_memory", ctypes.c_size_t),
        ("peak_process_memory", ctypes.c_size_t),
        ("peak_job_memory", ctypes.c_size_t),
    )


class Job:
    """A job object; closing it kills what runs in it."""

    def __init__(self, kernel: Any, handle: Any) -> None:
        self._kernel, self._handle = kernel, handle

    def close(self) -> None:
        """Close the job."""
        self._kernel.CloseHandle(self._handle)


def confine(pid: int, memory: int) -> Job:
    """Put a process into a job of its own.

    Args:
        pid: The process.
        memory: What it may take beyond Python and numpy [bytes].

    Raises:
        IsolationUnavailable: If Windows refuses, or this is not Windows.
    """
    if sys.platform != "win32":
        raise IsolationUnavailable("job objects exist on Windows only")
    kernel = ctypes.WinDLL("kernel32", use_last_error=True)
    for name in ("CreateJobObjectW", "OpenProcess"):
        getattr(kernel, name).restype = ctypes.c_void_p
    job = ctypes.c_void_p(kernel.CreateJobObjectW(None, None))
    process = ctypes.c_void_p(kernel.OpenProcess(_SET_QUOTA_AND_TERMINATE, False, pid))
    limits = _ExtendedLimits()
    limits.basic.flags = _LIMIT_ACTIVE_PROCESS | _LIMIT_PROCESS_MEMORY | _LIMIT_DIE_ON_EXCEPTION | _KILL_ON_CLOSE
    limits.basic.active_processes = 1
    limits.process_memory = memory + _BASE_BYTES
    done = (
        job.value
        and process.value
        and kernel.SetInformationJobObject(job, _EXTENDED_LIMITS, ctypes.byref(limits), ctypes.sizeof(limits))
        and kernel.AssignProcessToJobObject(job, process)
    )
    if process.value:
        kernel.CloseHandle(process)
    if not done:
        raise IsolationUnavailable(f"Windows refused a job object for the policy (error {ctypes.get_last_error()})")
    return Job(kernel, job)
