"""Reading a policy happens outside the sandbox, so nothing that a model writes may make it slow."""

import time

import pytest

from ovita.errors import PolicyRejected
from ovita.policy.reading import parse

K = 250  # sources of a quarter of the largest size: what is not linear shows as well, at a quarter of the cost
ADAPT = "def adapt(traj, scene):\n    return traj\n"

SLOW: dict[str, str] = {
    "spaces before a sign": "A" + " " * 200 * K + "=",
    "one long fence": "`" * 250 * K,
    "many fences": "```\n" * 60 * K,
    "fences of many lengths": "".join("`" * (3 + i % 90) + "\n" for i in range(5000)),
    "many blocks": f"```python\n{ADAPT}```\n" * 4000,
    "many broken blocks": "```python\nx = (\n```\n" * 10 * K,
    "prose": ("Word word word.\n") * 15 * K,
    "spaces in a docstring": f'def adapt(traj, scene, *, a=1):\n    """a{" " * 60 * K}x"""\n    return traj\n',
    "spaces in a comment": f"A = 1  # a {' ' * 60 * K} [x\nmodified_trajectory = A\n",
    "brackets in a comment": f"A = 1  # {'[' * 60 * K}\nmodified_trajectory = A\n",
    "a long template": ADAPT + f"x = '{{{'a.' * 30 * K}'.format(1)\n",
    "many names": "".join(f"a{i}=1\n" for i in range(8 * K)) + "modified_trajectory = a1\n",
    "many names on a line": ";".join(f"a{i}=1" for i in range(8 * K)) + "\nmodified_trajectory = a1\n",
    "many names with comments": "".join(f"a{i}=1#b\n" for i in range(6 * K)) + "modified_trajectory = a1\n",
    "a chain of names": "".join(f"b{i + 1}=b{i}\n" for i in reversed(range(5 * K)))
    + f"def adapt(t):\n    return b{5 * K}\n",
    "many imports": "import ab\n" * 6 * K + ADAPT,
    "many functions": "".join(f"def f{i}():\n x\n" for i in range(3 * K)) + "modified_trajectory = f1\n",
    "many prints": "print()\n" * 7 * K + "modified_trajectory = 1\n",
    "many dead lines": "def adapt(traj):\n return traj\n" + " x\n" * 15 * K,
    "many parameters": f"def adapt(traj, *, {', '.join(f'a{i}=1' for i in range(7 * K))}):\n return traj\n",
    "two long names": f"def adapt(traj):\n return {'ab' * 15 * K}\n{'ba' * 15 * K} = 1\n",
    "a long unknown name": f"def adapt(traj):\n return {'a' * 60 * K}\n",
    "a long import": f"import {'a' * 60 * K}\nx = {'a' * 60 * K}\nmodified_trajectory = x\n",
    "many attributes": "class A:\n"
    + "".join(f" def a{i}(s): s._b\n" for i in range(2500))
    + "modified_trajectory = 1\n",
    "one long text": "modified_trajectory = f'''" + "{a}\n" * 12 * K + "'''\n",
    "deep sums": "modified_trajectory = " + "+".join("a" for _ in range(30 * K)) + "\n",
    "deep attributes": "modified_trajectory = a" + ".b" * 150 + "\n",
    "deep blocks": "".join(" " * i + "if a:\n" for i in range(95)) + " " * 95 + "modified_trajectory = 1\n",
    "deep elif": "if a: pass\n" + "elif a: pass\n" * 4000 + "modified_trajectory = 1\n",
    "deep lambdas": "modified_trajectory = " + "lambda: " * 140 + "1\n",
    "many lines": "\n" * 60 * K + "modified_trajectory = 1\n",
    "many tabs": ADAPT + "\t" * 60 * K + "\n",
    "too long": "#" * 150_000,
}


@pytest.mark.parametrize("name", SLOW)
def test_reading_is_quick(name):
    started = time.process_time()
    try:
        policy = parse(SLOW[name])
        assert policy.toolkit_only in (True, False)
        assert policy.carries_columns in (True, False)
    except PolicyRejected as rejected:
        assert len(str(rejected)) < 2100
    assert time.process_time() - started < 5.0  # against a minute, where it is not linear
