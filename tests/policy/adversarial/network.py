"""Policies that try to reach another process or machine."""
# ruff: noqa: E501  (each policy stays on its line)

_RAW = (
    "import ctypes, struct\nlibc = ctypes.CDLL(None, use_errno=True)\n"
    "def connect(family, kind, address):\n    fd = libc.socket(family, kind, 0)\n"
    "    if fd >= 0 and libc.connect(fd, address, len(address)) == 0:\n        libc.write(fd, b'x', 1)\n"
)
_AF = "import socket\ns = socket.socket(socket.AF_UNIX)\n"

BODIES: dict[str, str] = {
    "tcp_connect": "import socket\nsocket.create_connection(('127.0.0.1', PORT), 1).sendall(b'x')",
    "tcp_listen": "import socket\ns = socket.socket()\ns.bind(('127.0.0.1', 0))\ns.listen()\nraise ValueError(NAME)",
    "udp_send": "import socket\nsocket.socket(socket.AF_INET, socket.SOCK_DGRAM).sendto(b'x', ('127.0.0.1', UDP))",
    "raw_socket": "import _socket\n_socket.socket(2, 1, 0)\nraise ValueError(NAME)",
    "unix_path": _AF + "s.connect(UNIX)\ns.sendall(b'x')",
    "unix_abstract": _AF + "s.connect('\\0' + ABSTRACT)\ns.sendall(b'x')",
    "unix_abstract_bind": _AF + "s.bind('\\0ovita-evil')\nraise ValueError(NAME)",
    "socketpair": "import socket\nsocket.socketpair()\nraise ValueError(NAME)",
    "netlink": "import socket\nsocket.socket(socket.AF_NETLINK, socket.SOCK_RAW, 0)\nraise ValueError(NAME)",
    "vsock": "import socket\nsocket.socket(40, 1, 0)\nraise ValueError(NAME)",
    "urllib_open": "import urllib.request\nurllib.request.urlopen(f'http://127.0.0.1:{PORT}/', timeout=1)",
    "urllib_file": "import urllib.request\nraise ValueError(urllib.request.urlopen('file://' + SECRET).read())",
    "http_client": "import http.client\nhttp.client.HTTPConnection('127.0.0.1', PORT, timeout=1).request('GET', '/')",
    "asyncio_connect": "import asyncio\nasyncio.run(asyncio.open_connection('127.0.0.1', PORT))",
    "socket_fromfd": "import socket\nfor fd in range(64):\n    try:\n        socket.socket(fileno=fd).send(b'x')\n    except OSError:\n        pass",
    "name_lookup": "import socket\nsocket.getaddrinfo('localhost', PORT)[0]\nsocket.create_connection(('localhost', PORT), 1)",
    "xmlrpc": "import xmlrpc.client\nxmlrpc.client.ServerProxy(f'http://127.0.0.1:{PORT}').x()",
    "smtplib": "import smtplib\nsmtplib.SMTP('127.0.0.1', PORT, timeout=1)",
    "message_queue": "import ctypes\nif ctypes.CDLL(None).msgget(4711, 0o1666) >= 0:\n    raise ValueError(NAME)",
    "shared_memory": "from multiprocessing import shared_memory\nshared_memory.SharedMemory('ovita_evil', create=True, size=64)\nraise ValueError(NAME)",
    "named_pipe_descriptor": "import os\nos.pipe()\nraise ValueError(NAME)",
    "memfd": "import os\nos.memfd_create('x')\nraise ValueError(NAME)",
    "eventfd": "import os\nos.eventfd(0)\nraise ValueError(NAME)",
    "dup_result_pipe": "import os\nfor fd in range(64):\n    try:\n        os.dup(fd)\n    except OSError:\n        continue\n    raise ValueError(NAME)",
    "pty": "import os\nos.openpty()\nraise ValueError(NAME)",
    "raw_tcp": _RAW
    + "connect(2, 1, struct.pack('<H', 2) + struct.pack('>H', PORT) + bytes([127, 0, 0, 1]) + bytes(8))",
    "raw_udp": _RAW + "connect(2, 2, struct.pack('<H', 2) + struct.pack('>H', UDP) + bytes([127, 0, 0, 1]) + bytes(8))",
    "raw_unix": _RAW + "connect(1, 1, struct.pack('<H', 1) + UNIX.encode() + b'\\0')",
    "raw_abstract": _RAW + "connect(1, 1, struct.pack('<H', 1) + b'\\0' + ABSTRACT.encode())",
    "raw_socket_any": _RAW
    + "if any(libc.socket(f, k, 0) >= 0 for f in range(1, 46) for k in (1, 2, 3, 5)):\n    raise ValueError(NAME)",
    "raw_socketpair": _RAW + "if libc.socketpair(1, 1, 0, (ctypes.c_int * 2)()) == 0:\n    raise ValueError(NAME)",
    "raw_pipe": _RAW + "if libc.pipe((ctypes.c_int * 2)()) == 0:\n    raise ValueError(NAME)",
    "raw_shared_memory": _RAW
    + "if libc.shmget(4711, 4096, 0o1666) >= 0 or libc.shm_open(b'/ovita_evil', 0o102, 0o666) >= 0:\n    raise ValueError(NAME)",
    "raw_connect_existing": _RAW
    + "a = struct.pack('<H', 1) + b'\\0' + ABSTRACT.encode()\nfor fd in range(64):\n    libc.connect(fd, a, len(a))",
    "raw_sendmsg": _RAW
    + "for fd in range(64):\n    if libc.send(fd, b'x', 1, 0) >= 0:\n        raise ValueError(NAME)",
}
