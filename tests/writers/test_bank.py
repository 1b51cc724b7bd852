"""The example bank: every example runs, does what it says, and is found by other words."""

import pytest
from bank_scenes import SCENES

from ovita.measure import predicates as checks
from ovita.policy.reading import parse
from ovita.policy.sandbox import run
from ovita.toolkit import judge
from ovita.writers.examples import examples

POLICIES = [example for example in examples() if example.code]


@pytest.mark.parametrize("example", POLICIES, ids=lambda e: f"{e.family}: {e.say}")
def test_an_example_does_what_it_says(example):
    trajectory, scene = SCENES[example.scene]
    policy = parse(example.code)
    rollout = run(policy, trajectory, scene)
    assert [
        o.sentence
        for e in rollout.expectations
        if not (o := judge(e, trajectory.to_array(), rollout.trajectory.to_array(), scene)).held
    ] == []
    names = {**vars(checks), **checks.BUILDERS}
    verdict = eval(example.check, {"__builtins__": {}}, names).judge(trajectory, rollout.trajectory, scene)
    assert verdict.passed, verdict.sentence
    assert set(rollout.contacts) == set(example.contacts)
    assert all(p.meaning or p.unit for p in policy.parameters)
