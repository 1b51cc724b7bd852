"""The built-in writer on sentences of our own: does the trajectory that comes out do what the sentence asks?"""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from ovita.limits import constrain
from ovita.measure import predicates as checks
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.policy.sandbox import run
from ovita.request import Request
from ovita.writers.base import ground
from ovita.writers.generate import BuiltinWriter

SCENE = Scene(
    (
        SceneObject("cup", [0.3, 0.42, 0.36]),
        SceneObject("yellow plate", [0.62, -0.3, 0.12], [0.16, 0.16, 0.02]),
        SceneObject("fan", [1.12, 0.05, 0.3], [0.1, 0.1, 0.4]),
        SceneObject("toolbox", [0.8, 0.2, 0.1], [0.3, 0.25, 0.2]),
        SceneObject("red box", [0.1, -0.2, 0.3], [0.1, 0.1, 0.1]),
        SceneObject("blue box", [0.95, -0.5, 0.3], [0.1, 0.1, 0.1]),
    ),
    environment="A workbench. The cup is green and made of glass. The toolbox is made of metal.",
)
T = np.linspace(0, 1, 40)
ROWS = np.column_stack(
    [
        1.2 * T,
        0.2 * np.sin(2 * np.pi * T) + 0.015 * np.sin(22 * np.pi * T),
        0.28 + 0.14 * np.sin(1.2 * np.pi * T),
        0.4 + 0.08 * np.sin(5 * T),
    ]
)
TRAJECTORY = Trajectory.from_array(np.round(ROWS, 4))
NAMES = {**vars(checks), **checks.BUILDERS}


HONEST = ("question", "honest")
"""Groups whose sentences ask for what no path can do, or leave a choice: no policy may come of them."""


def groups() -> dict[str, list[str]]:
    """The sentences by what their result must fulfil: a check, or a kind of answer without a policy."""
    found: dict[str, list[str]] = {}
    wanted = ""
    for line in (Path(__file__).parent / "paraphrases.txt").read_text(encoding="utf-8").splitlines():
        if line.startswith("="):
            wanted = line[1:].strip()
        elif line and not line.startswith("#"):
            found.setdefault(wanted, []).append(line)
    return found


GROUPS = groups()


def check(wanted: str) -> checks.Check:
    return eval(wanted, {}, NAMES)


@cache
def verdict(sentence: str, wanted: str) -> tuple[str, str]:
    """What came of a sentence: "right", "declined" or "wrong" (wrong without saying so), and why."""
    answer = BuiltinWriter().write(ground(Request(sentence, TRAJECTORY, SCENE)))
    if answer.confirm:  # shown, and nothing is done before a yes
        return ("right" if wanted == "honest" else "declined"), "shown"
    if wanted in HONEST:
        right = answer.kind != "policy" and (wanted == "honest" or answer.kind == wanted)
        return ("right" if right else "wrong" if answer.kind == "policy" else "declined"), answer.kind
    if answer.kind != "policy":
        return "declined", f"{answer.kind}: {' '.join(answer.unplaced) or answer.question}"
    rollout = run(answer.policy, TRAJECTORY, SCENE)
    solved = constrain(rollout.trajectory, SCENE, Robot.preset("none"), original=TRAJECTORY, contacts=rollout.contacts)
    result = check(wanted).judge(TRAJECTORY, solved.trajectory, SCENE)
    return ("right" if result.passed else "wrong"), f"{' '.join(answer.plan)} -> {result.sentence}"


@pytest.mark.parametrize("wanted", [w for w in GROUPS if w not in HONEST])
def test_doing_nothing_fails(wanted):
    assert not check(wanted).judge(TRAJECTORY, TRAJECTORY, SCENE).passed


def test_hardly_a_sentence_is_silently_misread():
    """None of these sentences was in the corpus; 10 of 601 are misread."""
    wrong = [s for wanted, sentences in GROUPS.items() for s in sentences if verdict(s, wanted)[0] == "wrong"]
    assert len(wrong) <= 10, wrong


def test_nearly_all_sentences_are_understood():
    verdicts = [verdict(sentence, wanted)[0] for wanted, sentences in GROUPS.items() for sentence in sentences]
    assert len(verdicts) > 550
    assert verdicts.count("right") >= 0.91 * len(verdicts)
