"""What the allowlist check refuses, in which words, and what it lets pass."""

import pytest

from ovita.errors import PolicyRejected
from ovita.policy.check import check


def adapt(body: str) -> str:
    return "def adapt(traj, scene):\n" + "".join(f"    {line}\n" for line in body.split("\n")) + "    return traj\n"


@pytest.mark.parametrize(
    ("body", "sentence"),
    [
        ("open('x')", "line 2: a policy may not open files; the trajectory is already in `traj`"),
        ("import os", "line 2: a policy may not open files; the trajectory is already in `traj` (import os); numpy"),
        ("from socket import socket", "line 2: a policy may not use the network"),
        ("import requests", "line 2: a policy may not use the network"),
        ("import subprocess", "line 2: a policy may not start processes or threads"),
        ("import sys", "line 2: a policy may not look into the interpreter"),
        ("import ctypes", "line 2: a policy may not reach into memory"),
        ("import pandas as pd", "line 2: pandas is not available in a policy; numpy (as np), math and parts of scipy"),
        ("from scipy import io", "line 2: scipy.io is not available in a policy"),
        ("import scipy.io", "line 2: a policy may not open files"),
        ("from . import x", "line 2: a policy has no package around it"),
        ("from numpy import load", "line 2: a policy may not open files"),
        ("import json\njson.dump({}, None)", "line 3: a policy may not open files"),
        ("x = 1\nnp.save('x', traj)", "line 3: a policy may not open files"),
        ("traj.tofile('x')", "line 2: a policy may not open files"),
        ("np.lib.stride_tricks.as_strided(traj)", "line 2: a policy may not reach into memory"),
        ("traj.ctypes", "line 2: a policy may not reach into memory"),
        ("eval('1')", "line 2: a policy may not run text as code; write the code itself (eval)"),
        ("exec('1')", "line 2: a policy may not run text as code"),
        ("globals()", "line 2: a policy may not look into the interpreter (globals)"),
        ("input()", "line 2: a policy may not ask anybody"),
        ("exit()", "line 2: a policy may not end the program; return the trajectory"),
        ("import time", "line 2: a policy depends on its input alone, not on the time"),
        ("().__class__.__bases__", "line 2: a policy may not touch __bases__"),
        ("getattr(np, '__loader__')", "line 2: a policy may not touch __loader__"),
        ("scene._secret", "line 2: a policy may not touch the private _secret"),
        ("match traj:\n    case object(size=c):\n        pass\n    case object(__globals__=g):\n        pass",
         "line 5: a policy may not touch __globals__"),
        ("'{0.__class__}'.format(traj)", "line 2: a policy may not reach attributes through .format"),
        ("x = 'a'\nx.format(1)", "line 3: a policy may call .format only on a literal text"),
        ("class A(metaclass=print):\n    pass", "line 2: a policy may not use metaclasses"),
        ("class A:\n    def __del__(self):\n        pass", "line 3: a policy may not define __del__"),
        ("type('A', (), {})", "line 2: a policy may call type(value) with one value"),
        ("x = type", "line 2: a policy may call type(value) with one value"),
        ("async def f():\n    pass", "line 2: a policy may not be asynchronous"),
        ("traj = mov(traj, left=1)", "line 2: mov is not defined; did you mean move?"),
        ("traj = shift_it(traj)", "line 2: shift_it is not defined"),
        ("memoryview(traj)", "line 2: a policy may not reach into memory"),
        ("breakpoint()", "line 2: a policy may not ask anybody"),
        ("x = __builtins__", "line 2: a policy may not look into the interpreter"),
        ("dict(__class__=1)", "line 2: a policy may not pass __class__"),
    ],
)  # fmt: skip
def test_refusals_name_the_line_and_the_remedy(body, sentence):
    with pytest.raises(PolicyRejected) as caught:
        check(adapt(body))
    assert str(caught.value).startswith(sentence)


@pytest.mark.parametrize(
    "body",
    [
        "import numpy.linalg as la\nfrom numpy.linalg import norm\nfrom numpy import pi, sin",
        "from math import *\nx = cos(pi) + floor(2.5)",
        "import scipy\nimport scipy.signal as ss\nfrom scipy import ndimage, optimize\nfrom scipy.stats import norm",
        "from collections.abc import Sequence\nfrom typing import List, Dict, Any\nx: List[Undefined] = []",
        "dir = traj[1] - traj[0]\ninput = 3\nvars = dir * input",
        "def f(open, type=None, *args, **kwargs):\n    return open",
        "class Node:\n    _n = 0\n    def __init__(self):\n        self._x = self._n",
        "for _ in range(3):\n    __ = 1",
        "x = 'a{}b'.format(1) + '{:.2f}'.format(2.0) + f'{traj.shape}'",
        "if (n := len(traj)) > 3:\n    traj[0:n:2, 0] += 1",
        "a, *b = [1, 2, 3]\ndel a\nx = {**{}, 'k': b}",
        "try:\n    pass\nexcept (ValueError, KeyError) as e:\n    raise RuntimeError(str(e)) from e",
        "with np.errstate(all='ignore'):\n    traj /= 1.0",
        "x = scene['cup'].__class__.__name__ + type(traj).__name__",
        "traj.sort(axis=0)\ntraj.flags.writeable\ntraj.T @ traj",
        "from contextlib import suppress\nimport re\nwith suppress(Exception):\n    re.sub('a', 'b', 'c')",
        "lambda *a, k=1, **kw: (a, k, kw)\n(yield_ for yield_ in [1])",
        "np.random.default_rng(0).normal()\nnp.polynomial.Polynomial([1])\nnp.fft.fft(traj[:, 0])\nnp.ma.array([1])",
    ],
)  # fmt: skip
def test_ordinary_python_passes(body):
    check(adapt(body))


def test_reserved_attribute_names_stay_reserved():
    with pytest.raises(PolicyRejected, match="open files"):
        check(adapt("class A:\n    def tofile(self, name):\n        pass\ntraj.tofile('x')"))
