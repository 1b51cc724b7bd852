"""What one instruction with the built-in writer does not need, it does not do."""

import ast
import subprocess
import sys

import numpy as np
import pytest

from ovita.chain import adapt, rerun
from ovita.dialogue.session import Session
from ovita.errors import RequestError
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.policy import Parameter, Policy, sandbox
from ovita.request import Request
from ovita.writers import generate
from ovita.writers.base import Prompt, Reply

PATH = Trajectory(np.linspace([0.0, 0, 0], [1.0, 0.5, 0.2], 50), np.full(50, 0.2))
SCENE = Scene((SceneObject("cup", np.array([0.5, 0.6, 0.1]), np.full(3, 0.1)),))


def test_no_prompt_no_process_one_parse_and_one_verdict_an_array(monkeypatch):
    parsed, judged = [], []
    parse, judge = ast.parse, generate.judge
    monkeypatch.setattr(ast, "parse", lambda source, *a, **k: parsed.append(source) or parse(source, *a, **k))
    monkeypatch.setattr(generate, "judge", lambda *a: judged.append(a[0]) or judge(*a))
    monkeypatch.setattr(Prompt, "sections", property(lambda self: pytest.fail("a prompt was made")))
    monkeypatch.setattr(sandbox, "_in_a_process", lambda *a: pytest.fail("a process was asked"))
    result = adapt(Request("go left by 0.2", PATH, SCENE), writer="builtin")
    assert (result.status, result.isolation, result.attempts) == ("done", "in process", 1)
    assert parsed == [result.code]
    assert len(judged) == len(result.postconditions) == 1


def test_what_is_slow_to_import_is_not_imported():
    program = (
        "import sys\nimport numpy as np\nimport ovita\nfrom ovita.paths.trajectory import Trajectory\n"
        "path = Trajectory(np.linspace([0.0, 0, 0], [1.0, 0.5, 0.2], 50), np.full(50, 0.2))\n"
        "assert ovita.adapt(ovita.Request('go left by 0.2', path), writer='builtin').status == 'done'\n"
        "print([name for name in ('scipy', 'piqp', 'pydantic_ai', 'ovita.policy.processes', 'ovita.policy.reading', "
        "'ovita.policy.check', 'ovita.writers.examples', 'ovita.writers.models.engine') if name in sys.modules])\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


class Known:
    """A writer that hands a policy along with what it knows of its parameters."""

    name = "known"

    def write(self, prompt):
        source = "def adapt(traj, scene, *, shift=0.2):\n    return move(traj, left=shift)\n"
        knob = Parameter("shift", 0.2, "m", "shift to the left", "by", "cup", "left")
        return Reply("policy", code=source, policy=Policy(source, parameters=(knob,)))


def test_what_is_known_of_a_parameter_stays_with_it():
    first = adapt(Request("go left", PATH, SCENE), writer=Known())
    again = rerun(first, {"shift": 0.1})
    assert [p.role for p in (*first.parameters, *again.parameters)] == ["by", "by"]
    assert again.parameters == (Parameter("shift", 0.1, "m", "shift to the left", "by", "cup", "left"),)
    assert again.adapted.positions[0, 0] == pytest.approx(-0.1)


@pytest.mark.parametrize("isolation", ["Strict", None, ""])
def test_an_unknown_isolation_is_refused_before_anything_is_done(isolation):
    with pytest.raises(RequestError, match="is unknown; use 'auto', 'strict' or 'degraded'"):
        adapt(Request("frobnicate", PATH, SCENE), writer=Known(), isolation=isolation)
    with pytest.raises(RequestError, match="is unknown; use 'auto', 'strict' or 'degraded'"):
        Session(PATH, SCENE, isolation=isolation)
