"""Policies that try to reach another process or machine."""
# ruff: noqa: E501  (each policy stays on its line)

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
}
