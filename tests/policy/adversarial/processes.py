"""Policies that try to start, signal, trace or starve processes, or to talk to the kernel directly."""
# ruff: noqa: E501  (each policy stays on its line)

_C = "import ctypes\nlibc = ctypes.CDLL(None, use_errno=True)\n"


def _syscall(*arguments: object) -> str:
    return _C + f"if libc.syscall({', '.join(map(str, arguments))}) >= 0:\n    raise ValueError(NAME)"


BODIES: dict[str, str] = {
    "os_system": "import os\nos.system(f'touch {TRACE}')",
    "os_popen": "import os\nos.popen(f'touch {TRACE}').read()",
    "os_execv": "import os\nos.execv('/bin/sh', ['sh', '-c', f'touch {TRACE}'])",
    "os_posix_spawn": "import os\nos.posix_spawn('/bin/sh', ['sh', '-c', f'touch {TRACE}'], {})",
    "os_fork": "import os\nif os.fork() == 0:\n    open(TRACE, 'w').write('x')",
    "os_fork_linger": "import os, time\nif os.fork() == 0:\n    time.sleep(600)",
    "os_forkpty": "import os\nos.forkpty()\nraise ValueError(NAME)",
    "subprocess_run": "import subprocess\nsubprocess.run(['touch', TRACE])",
    "subprocess_shell": "import subprocess\nsubprocess.Popen(f'touch {TRACE}', shell=True).wait()",
    "posix_subprocess": "import _posixsubprocess\nraise ValueError(NAME, _posixsubprocess.fork_exec.__name__, __import__('os').fork())",
    "multiprocessing": "import multiprocessing\np = multiprocessing.Process(target=open, args=(TRACE, 'w'))\np.start()\np.join()",
    "fork_bomb": "import os\nwhile True:\n    try:\n        os.fork()\n    except OSError:\n        pass",
    "thread": "import threading\nt = threading.Thread(target=open, args=(TRACE, 'w'))\nt.start()\nt.join()",
    "thread_bomb": "import threading, time\nfor _ in range(1000):\n    threading.Thread(target=time.sleep, args=(600,)).start()\nraise ValueError(NAME)",
    "thread_low": "import _thread\n_thread.start_new_thread(print, ('x',))\nraise ValueError(NAME)",
    "executor": "from concurrent.futures import ThreadPoolExecutor\nThreadPoolExecutor(4).submit(open, TRACE, 'w').result()",
    "kill_parent": "import os, signal\nos.kill(PARENT, signal.SIGUSR1)",
    "kill_worker": "import os\nos.kill(os.getppid(), 9)",
    "kill_worker_guess": "import os\nfor pid in WORKERS:\n    os.kill(pid, 9)",
    "kill_victim": "import os\nos.kill(VICTIM, 9)",
    "kill_all": "import os\nos.kill(-1, 9)",
    "kill_group": "import os\nos.killpg(0, 9)",
    "kill_own_group": "import os\nos.kill(0, 15)",
    "kill_self": "import os\nos.kill(os.getpid(), 9)",
    "tgkill": _C + "libc.syscall(234, VICTIM, VICTIM, 9)",
    "pidfd_signal": "import os, signal\nsignal.pidfd_send_signal(os.pidfd_open(VICTIM), signal.SIGKILL)",
    "sigqueue": _C + "libc.sigqueue(VICTIM, 9, None)",
    "signal_thread": "import signal, threading\nsignal.pthread_kill(threading.get_ident(), 9)",
    "signal_handler": "import signal\nsignal.signal(signal.SIGTERM, signal.SIG_IGN)\nraise ValueError(NAME)",
    "alarm": "import signal\nsignal.setitimer(signal.ITIMER_REAL, 5)\nraise ValueError(NAME)",
    "ptrace_parent": _C + "if libc.ptrace(16, PARENT, 0, 0) == 0:\n    raise ValueError(NAME)",
    "ptrace_me": _C + "if libc.ptrace(0, 0, 0, 0) == 0:\n    raise ValueError(NAME)",
    "process_vm_read": _C
    + "buf = ctypes.create_string_buffer(8)\nv = (ctypes.c_size_t * 2)(ctypes.addressof(buf), 8)\n"
    "if libc.process_vm_readv(PARENT, v, 1, v, 1, 0) >= 0 or ctypes.get_errno() != 1:\n    raise ValueError(NAME)",
    "set_user_root": "import os\nos.setuid(0)\nif os.getuid() == 0:\n    open(TRACE, 'w').write('x')",
    "set_groups": "import os\nos.setgroups([0])\nraise ValueError(NAME)",
    "raise_limits": "import resource\nresource.setrlimit(resource.RLIMIT_NOFILE, (100, 100))\nraise ValueError(NAME)",
    "parent_limits": "import resource\nresource.prlimit(PARENT, resource.RLIMIT_CPU, (1, 1))\nraise ValueError(NAME)",
    "priority_of_parent": "import os\nos.setpriority(os.PRIO_PROCESS, PARENT, 19)\nraise ValueError(NAME)",
    "affinity_of_parent": "import os\nos.sched_setaffinity(PARENT, {0})\nraise ValueError(NAME)",
    "scheduler": "import os\nos.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))\nraise ValueError(NAME)",
    "daemon": "import os\nos.setsid()\nraise ValueError(NAME)",
    "unshare_user": _syscall(272, "0x10000000"),
    "mount": _C + "if libc.mount(b'none', FOLDER.encode(), b'tmpfs', 0, None) == 0:\n    raise ValueError(NAME)",
    "chroot": "import os\nos.chroot(FOLDER)\nraise ValueError(NAME)",
    "io_uring": _syscall(425, 8, "ctypes.create_string_buffer(256)"),
    "bpf": _syscall(321, 0, "ctypes.create_string_buffer(128)", 128),
    "userfaultfd": _syscall(323, 1),
    "perf_event": _syscall(298, "ctypes.create_string_buffer(128)", 0, -1, -1, 0),
    "keyctl": _syscall(250, 0, -3, 1),
    "add_key": _syscall(248, "b'user'", "b'x'", "b'y'", 1, -3),
    "clone_raw": _syscall(56, 17, 0, 0, 0, 0),
    "clone3_raw": _syscall(435, "ctypes.create_string_buffer(88)", 88),
    "vfork_raw": _C + "if libc.fork() >= 0:\n    raise ValueError(NAME)",
    "open_raw": _C + "if libc.syscall(2, TRACE.encode(), 0o102, 0o666) >= 0:\n    raise ValueError(NAME)",
    "openat2_raw": _C + "how = (ctypes.c_ulonglong * 3)(0o102, 0o666, 0)\n"
    "if libc.syscall(437, -100, TRACE.encode(), how, 24) >= 0:\n    raise ValueError(NAME)",
    "execveat_raw": _C + "libc.syscall(322, -100, b'/bin/true', None, None, 0)",
    "int80_open": _C + "import mmap\nm = mmap.mmap(-1, 4096, prot=7)\nraise ValueError(NAME)",
    "x32_call": _C + "libc.syscall(0x40000000 + 39)\nraise ValueError(NAME)",
    "executable_memory": "import mmap\nm = mmap.mmap(-1, 4096, prot=mmap.PROT_READ | mmap.PROT_WRITE | mmap.PROT_EXEC)\nraise ValueError(NAME)",
    "mprotect_executable": _C
    + "import mmap\nm = mmap.mmap(-1, 4096)\na = ctypes.addressof(ctypes.c_char.from_buffer(m))\n"
    "if libc.mprotect(ctypes.c_void_p(a), 4096, 5) == 0:\n    raise ValueError(NAME)",
    "seccomp_again": _C
    + "if libc.prctl(22, 2, None) == 0 or libc.prctl(38, 0, 0, 0, 0) == 0:\n    raise ValueError(NAME)",
    "thread_raw": _C
    + "if libc.pthread_create(ctypes.create_string_buffer(8), None, libc.abs, None) == 0:\n    raise ValueError(NAME)",
    "every_system_call": _C
    + "skip = {60, 231, 15, 9, 10, 11, 12, 25, 35, 230, 202, 28, 219, 131, 1, 14, 335, 336}\nallowed = []\nfor n in range(0, 470):\n"
    "    if n not in skip:\n        ctypes.set_errno(0)\n        if libc.syscall(n, 0, 0, 0, 0, 0, 0) >= 0 or ctypes.get_errno() != 1:\n            allowed.append(n)\n"
    "if set(allowed) - {24, 39, 96, 201, 228, 229, 309, 318}:\n    raise ValueError(NAME, allowed)",
    "write_elsewhere": _C + "if sum(libc.write(fd, b'', 0) == 0 for fd in range(64)) > 1:\n    raise ValueError(NAME)",
    "undo_death_signal": _C + "if libc.prctl(1, 0, 0, 0, 0) == 0:\n    raise ValueError(NAME)",
    "ioctl_terminal": "import fcntl\nfor fd in range(3):\n    try:\n        fcntl.ioctl(fd, 0x5412, b'x')\n        raise ValueError(NAME)\n    except OSError:\n        pass",
    "time_of_machine": "import time\ntime.clock_settime(time.CLOCK_REALTIME, 0)\nraise ValueError(NAME)",
    "hostname": "import socket\nsocket.sethostname('evil')\nraise ValueError(NAME)",
    "core_dump": "import resource\nresource.setrlimit(resource.RLIMIT_CORE, (-1, -1))\nimport ctypes\nctypes.string_at(1)",
}
