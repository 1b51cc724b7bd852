"""Reading policies out of replies, cleaning them, and their knobs."""

import pytest

from ovita.errors import PolicyRejected
from ovita.policy import Parameter, Policy
from ovita.policy.reading import parse

FUNCTION = '''def adapt(traj, scene, *, distance=0.2, factor=0.5):
    """Shift left, then slow down."""
    return scale_speed(move(traj, left=distance), factor)
'''


def test_plain_code_is_kept_as_it_is():
    policy = parse(FUNCTION)
    assert policy.source == FUNCTION
    assert policy.form == "function"
    assert policy.summary == "Shift left, then slow down."
    assert policy.parameters == (Parameter("distance", 0.2), Parameter("factor", 0.5))


@pytest.mark.parametrize(
    "reply",
    [
        f"Here you are:\n\n```python\n{FUNCTION}```\nIt shifts the path.",
        f"```py\nresult = 3\n```\n\n```python\n{FUNCTION}```",
        f"```python\n{FUNCTION}```\nUsage:\n```python\nnew = adapt(traj, scene)\n```",
        f"~~~\n{FUNCTION}~~~",
        f"```python\n{FUNCTION}",
        f"\ufeff{FUNCTION}".replace("\n", "\r\n"),
        f"Sure! This is the policy you asked for:\n\n{FUNCTION}\nIt shifts the path and slows down.",
        "```python\n" + "".join(f"    {line}\n" for line in FUNCTION.splitlines()) + "```",
        "1. First:\n   ```python\n" + "".join(f"   {line}\n" for line in FUNCTION.splitlines()) + "   ```",
    ],
)
def test_code_is_found_in_a_reply(reply):
    assert parse(reply).source == FUNCTION


def test_the_last_policy_of_a_reply_counts():
    reply = f"```python\n{FUNCTION}```\nBetter:\n```python\n{FUNCTION.replace('0.2', '0.3')}```"
    assert parse(reply).parameters[0].value == 0.3


def test_a_policy_spread_over_blocks_is_joined():
    reply = "```python\ndef shift(t, d):\n    return move(t, left=d)\n```\nand\n```python\nmodified_trajectory = 1\n```"
    assert parse(reply).form == "script"
    reply = "```python\nimport math\nSTEP = math.pi / 4\n```\n```python\nX = STEP\n```"
    with pytest.raises(PolicyRejected, match="there is no policy here"):
        parse(reply)


def test_a_syntax_error_names_its_line():
    with pytest.raises(PolicyRejected, match="not valid Python") as caught:
        parse("def adapt(traj, scene):\n    x = (1,\n    return traj\n")
    assert caught.value.line == 2


@pytest.mark.parametrize("text", ["", "  \n", "I cannot do that.", "```python\nx = 1\n```"])
def test_no_policy_is_said_so(text):
    with pytest.raises(PolicyRejected, match=r"empty|no policy|not valid Python"):
        parse(text)


@pytest.mark.parametrize(
    "source",
    [
        "(" * 5000,
        "x = " + "-" * 60000 + "1",
        "a" + ".b" * 20000,
        "x = 1\0",
        "x" * 70_000,
        "x = '\ud800'",
        "x =" * 99999,
    ],
)
def test_hostile_source_is_refused_quickly(source):
    with pytest.raises(PolicyRejected):
        parse(source)


def test_other_function_names_and_plain_defaults_are_accepted():
    policy = parse("def slow_down(trajectory, objects, factor=0.5):\n    return trajectory\n")
    assert policy.form == "function"
    assert policy.parameters == (Parameter("factor", 0.5),)
    policy = parse("def helper(x):\n    return x\n\ndef change(traj, scene):\n    return helper(traj)\n")
    assert policy.form == "function"


def test_an_unclear_entry_is_refused():
    with pytest.raises(PolicyRejected, match=r"not clear which function is the policy \(one, two\)"):
        parse("def one(traj, scene):\n    return traj\n\ndef two(traj, scene):\n    return traj\n")
    with pytest.raises(PolicyRejected, match="must be callable as adapt"):
        parse("def adapt(traj, scene, distance):\n    return traj\n")


CLUTTERED = '''import numpy as np
import matplotlib.pyplot as plt
from toolkit import move, near

LIMIT = 0.3  # keep

# a dummy
def get_trajectory():
    return [{"x": 0}]

def adapt(traj, scene, *, distance=0.2):
    # shift first
    import math
    traj = move(traj, left=distance * math.cos(0))
    print("shifted", len(traj))

    if distance > LIMIT:
        print("far")
    text = """a  \t

      b"""
    return traj
    print("never")

def plot(traj):
    plt.plot(traj)

traj = np.zeros((3, 4))
result = adapt(traj, None)

# run it
if __name__ == "__main__":
    print(adapt(np.zeros((3, 4)), {}))
    # done
'''


def test_cleaning_leaves_what_the_policy_is():
    assert (
        parse(CLUTTERED).source
        == '''LIMIT = 0.3  # keep

def adapt(traj, scene, *, distance=0.2):
    # shift first
    traj = move(traj, left=distance * math.cos(0))

    if distance > LIMIT:
        pass
    text = """a  \t

      b"""
    return traj
'''
    )


def test_lines_are_known_by_their_number_in_the_file():
    policy = parse(CLUTTERED)
    lines, original = policy.source.split("\n"), CLUTTERED.split("\n")
    for number, text in enumerate(lines[:-1], start=1):
        if text.strip() not in ("pass", ""):
            assert original[policy.written_line(number) - 1].strip() == text.strip()
    assert policy.written_line(99) is None


def test_what_is_refused_is_named_by_its_line_in_the_file():
    with pytest.raises(PolicyRejected) as caught:
        parse("import numpy as np\n\ndef adapt(traj, scene):\n    open('x')\n    return traj\n")
    assert str(caught.value) == "line 4: a policy may not open files; the trajectory is already in `traj`"


@pytest.mark.parametrize(
    "source",
    [
        "np.random.seed(7)\ndef adapt(traj, scene):\n    return traj + np.random.rand()\n",
        "TABLE = {}\nTABLE['a'] = 1\nTABLE.update(b=2)\nfor i in range(3):\n    TABLE[i] = i\n"
        "def adapt(traj, scene):\n    return traj * len(TABLE)\n",
        "def adapt(traj, scene):\n    for w in traj: print(w)\n    x = 1; print(x)\n    return traj\n",
        "def adapt(traj, scene):\n    items = [1, 2]\n    print(items.pop())\n    return traj * items[-1]\n",
        "def adapt(traj, scene):\n    return list(g())\ndef g():\n    return\n    yield 1\n",
        "from scipy.ndimage import gaussian_filter1d\ndef adapt(traj, scene):\n    return gaussian_filter1d(traj, 1)\n",
        "import numpy\ndef adapt(traj, scene):\n    return numpy.copy(traj)\n",
        "class Shift:\n    def __call__(self, t):\n        return t\nf = Shift()\n"
        "def adapt(traj, scene):\n    return f(traj)\n",
    ],
)
def test_cleaning_keeps_what_matters(source):
    assert parse(source).source == source


def test_a_script_keeps_its_main_part_if_that_is_where_the_result_is():
    source = (
        "def main():\n    return get_trajectory()\n\nif __name__ == '__main__':\n    modified_trajectory = main()\n"
    )
    assert parse(source).source == source
    demo = "modified_trajectory = get_trajectory()\nif __name__ == '__main__':\n    print(modified_trajectory)\n"
    assert parse(demo).source == "modified_trajectory = get_trajectory()\n"


def test_dummies_are_dropped_from_a_script():
    source = (
        "def get_trajectory():\n    return [{'x': 0.0}]\n\n\ndef detect_objects():\n    return []\n\n\n"
        "detect = detect_objects()\nmodified_trajectory = get_trajectory()\n"
    )
    assert parse(source).source == "detect = detect_objects()\nmodified_trajectory = get_trajectory()\n"


def test_parameters_of_a_function_have_units_and_meanings():
    policy = parse(
        "def adapt(traj, scene, *,\n"
        "          distance=0.2,  # how far to shift [m]\n"
        "          factor=-0.5, turns=2,  # turns: how often\n"
        "          word='left', on=True, where=(1, 2.0),\n"
        "          computed=2 * 0.25, other=len('abc'),\n"
        "          speed=None,\n"
        "          ):\n"
        '    """Shift.\n\n    Args:\n        factor (float): what remains (m/s)\n        speed: top speed [m/s]\n'
        '        word -- which way\n    """\n'
        "    return traj\n"
    )
    assert policy.parameters == (
        Parameter("distance", 0.2, "m", "how far to shift"),
        Parameter("factor", -0.5, "m/s", "what remains"),
        Parameter("turns", 2, "", "how often"),
        Parameter("word", "left", "", "which way"),
        Parameter("on", True),
        Parameter("where", (1, 2.0)),
        Parameter("computed", 0.5),
        Parameter("speed", None, "m/s", "top speed"),
    )


def test_parameters_of_a_script_are_literals_assigned_once():
    policy = parse(
        "OFFSET = 0.1  # to the right [m]\nNAMES = ('cup', 'box')\nfactor: float = 0.5\n_private = 1\ni = 0\ni += 1\n"
        "items = []\ntwice = 1\ntwice = 2\ncount = 3\ndef f():\n    global count\n    count = 4\n"
        "for k in range(3):\n    pass\nmodified_trajectory = get_trajectory()\n"
    )
    assert [p.name for p in policy.parameters] == ["OFFSET", "NAMES", "factor"]
    assert policy.parameters[0] == Parameter("OFFSET", 0.1, "m", "to the right")


def test_new_values_are_written_into_the_source():
    policy = parse(FUNCTION.replace("factor=0.5", "factor=(0.5), ü='ä'"))
    changed = policy.with_parameters(factor=0.25, distance=1)
    assert "distance=1.0, factor=(0.25), ü='ä'" in changed.source
    assert changed.parameters[:2] == (Parameter("distance", 1.0), Parameter("factor", 0.25))
    assert changed.summary == policy.summary
    assert policy.with_parameters() is policy
    script = parse("A = 'x'  # ä [m]\nB = (1, 2)\nmodified_trajectory = get_trajectory()\n")
    assert script.with_parameters(A="it's", B=[3, 4.5]).source.startswith('A = "it\'s"  # ä [m]\nB = (3, 4.5)\n')


@pytest.mark.parametrize(
    ("values", "problem"),
    [
        ({"speed": 1}, "the policy has no parameter 'speed'; its parameters are: distance, times, on, word, pair"),
        ({"distance": "far"}, "parameter distance is a number, such as 0.2; 'far' is not"),
        ({"distance": float("nan")}, "parameter distance is a number"),
        ({"distance": True}, "parameter distance is a number"),
        ({"times": 1.5}, "parameter times is a whole number"),
        ({"on": 1}, "parameter on is True or False"),
        ({"word": 3}, "parameter word is a text"),
        ({"pair": (1,)}, "parameter pair is a group of 2 values"),
    ],
)
def test_values_that_do_not_fit_are_refused(values, problem):
    policy = parse(
        "def adapt(traj, scene, *, distance=0.2, times=2, on=True, word='a', pair=(1, 2)):\n    return traj\n"
    )
    with pytest.raises(PolicyRejected) as caught:
        policy.with_parameters(**values)
    assert str(caught.value).startswith(problem)


@pytest.mark.parametrize(
    ("source", "simple"),
    [
        (FUNCTION, True),
        (
            "def adapt(traj, scene):\n    if 'cup' in scene:\n        traj = move(traj, up=1)\n    return traj\n",
            True,
        ),
        ("def adapt(traj, scene):\n    return move(traj, up=2 * scene['cup'].size[2])\n", True),
        ("def adapt(traj, scene):\n    return np.array(traj)\n", False),
        ("def adapt(traj, scene):\n    for i in range(3):\n        traj = move(traj, up=1)\n    return traj\n", False),
        ("def adapt(traj, scene):\n    move = 1\n    return move(traj)\n", False),
        ("def adapt(traj, scene):\n    return move(*traj)\n", False),
        ("def adapt(traj, scene):\n    return traj.tofile('x')\n", False),
        ("def adapt(traj, scene):\n    traj[0] = 1\n    return traj\n", False),
        ("@near\ndef adapt(traj, scene):\n    return traj\n", False),
        ("def adapt(traj, scene, *, x=open('f')):\n    return traj\n", False),
        ("modified_trajectory = get_trajectory()\n", False),
    ],
)
def test_policies_of_toolkit_calls_only_are_recognised(source, simple):
    assert Policy(source).toolkit_only is simple
