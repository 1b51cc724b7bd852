"""Where the kernel has no locks: a process of its own, the allowlist, and the limits of the operating system."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest
from ordinary import FUNCTIONS, SCRIPTS

import ovita.policy
from ovita.errors import PolicyCrashed, PolicyRejected, PolicyTimeout, RequestError
from ovita.policy import Policy
from ovita.policy.reading import parse
from ovita.policy.sandbox import SandboxLimits, _run, run

needs_rlimits = pytest.mark.skipif(sys.platform != "linux", reason="rlimits on memory are Linux's")


@pytest.mark.parametrize(
    ("source", "locked"),
    [(FUNCTIONS["classes"], False), (FUNCTIONS["scipy_filters"], True), (SCRIPTS["functions_and_main"], False)],
)
def test_ordinary_policies_run(source, locked, line, table):
    degraded = _run(parse(source), line, table, isolation="degraded", locked=locked)
    assert degraded.isolation == "degraded"
    assert np.isfinite(degraded.trajectory.to_array()).all()
    if sys.platform == "linux":
        strict = run(parse(source), line, table)
        assert degraded.trajectory == strict.trajectory


def test_the_allowlist_is_not_optional(line, table):
    with pytest.raises(PolicyRejected, match="may not open files"):
        run(Policy("def adapt(traj, scene):\n    open('x')\n"), line, table, isolation="degraded")
    with pytest.raises(RequestError, match="only where the kernel holds"):
        _run(Policy("def adapt(traj, scene):\n    return traj\n"), line, table, isolation="degraded", checked=False)


@pytest.mark.parametrize("locked", [True, False])
def test_time_is_limited(locked, line, table):
    hang = Policy("def adapt(traj, scene):\n    while True:\n        pass\n")
    with pytest.raises(PolicyTimeout, match="ran longer"):
        _run(hang, line, table, limits=SandboxLimits(wall_s=0.2), isolation="degraded", locked=locked)


@needs_rlimits
@pytest.mark.parametrize("locked", [True, False])
def test_memory_is_limited(locked, line, table):
    bomb = Policy("def adapt(traj, scene):\n    return np.ones((1 << 30, 4))\n")
    with pytest.raises(PolicyTimeout, match="memory"):
        _run(bomb, line, table, limits=SandboxLimits(memory_mb=200), isolation="degraded", locked=locked)


def test_a_crash_is_told(line, table):
    with pytest.raises(PolicyCrashed, match="line 2: ZeroDivisionError"):
        run(Policy("def adapt(traj, scene):\n    1 / 0\n"), line, table, isolation="degraded")


@pytest.mark.parametrize(
    "body",
    [
        "getattr(move, '__glo' + 'bals__')",
        "getattr('{0.__class__}', 'for' + 'mat')(traj)",
        "setattr(scene, '__cl' + 'ass__', 1)",
        "import random\nrandom._os",
        "import numpy\ngetattr(numpy, 'lo' + 'ad')('x')",
        "if False:\n    type = 1\ntype('A', (), {})",
        "if False:\n    open = eval = 1\neval('1')",
        "import json\njson.codecs",
        "import functools\nfunctools.wraps(move, ('__globals__',), ())",
    ],
)
def test_what_the_check_cannot_see_is_not_there(body, line, table):
    source = "def adapt(traj, scene):\n" + "".join(f"    {x}\n" for x in body.split("\n")) + "    return traj\n"
    with pytest.raises((PolicyCrashed, PolicyRejected)):
        _run(Policy(source), line, table, isolation="degraded", locked=False)


def test_text_is_run_as_code_in_one_module_only():
    package = Path(ovita.policy.__file__).parent.parent
    files = [p for p in package.rglob("*.py") if re.search(r"(?<![\w.\"'])(exec|eval)\(", p.read_text())]
    assert [p.name for p in files] == ["_worker.py"]
