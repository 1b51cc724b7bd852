"""Short cuts change nothing: limits that surely hold do hold, and a kept proof runs as the sandbox would."""

from collections import Counter

import numpy as np
import pytest

from ovita.augment.ground import RandomScenes
from ovita.augment.verified import Manner, make
from ovita.augment.wording import families_from, grammar
from ovita.instruct.builder import PolicyBuilder
from ovita.limits import constrain
from ovita.policy.policy import TooMuch
from ovita.policy.reading import parse
from ovita.policy.sandbox import run

POOL = RandomScenes(waypoints=30)


@pytest.mark.parametrize("block", range(4))
def test_where_the_limits_surely_hold_constrain_leaves_all_as_it_is(block):
    """The original is pushed about at random, near to objects and borders and beyond them."""
    ground = POOL.ground(5, block)
    rng, task, said = np.random.default_rng(block), ground.task, Counter()
    for _ in range(12):
        bend = np.outer(np.sin(np.linspace(0, np.pi, 30)), rng.normal(size=3) * rng.uniform(0, 0.2) * ground.extent)
        bend[:, 2] *= not ground.flat
        proposed = task.trajectory.with_(
            positions=task.trajectory.positions + bend, speeds=task.trajectory.speeds * rng.uniform(0.5, 2.0)
        )
        status = constrain(proposed, task.scene, ground.robot, original=task.trajectory).verdict.status
        surely = ground.legality.holds(proposed)
        assert not surely or status == "satisfied"
        said[surely] += 1
    assert said[True]


def test_a_sample_is_what_its_policy_makes_in_the_usual_way():
    manner, no = Manner(2, families_from(())), Counter()
    for block in range(2):
        ground = POOL.ground(2, block)
        for index in range(16 * block, 16 * block + 8):
            made = make(index, ground, manner, grammar(), set(), no)
            if made is None or made.sample.verdict != "done":
                continue
            sample = made.sample
            policy = parse(sample.code)
            assert policy.toolkit_only
            again = run(policy, sample.task.trajectory, sample.task.scene)
            assert again.trajectory == sample.adapted and again.isolation == "in process"


@pytest.mark.parametrize(
    "code", ["import os", "traj = open(traj)", "traj = _hidden", "traj = scene.__class__", "abs = 1"]
)
def test_what_is_not_proven_is_not_run_here(code):
    ground = POOL.ground(5, 0)
    policy = PolicyBuilder(ground.task.trajectory, ground.task.scene)
    rows, _ = policy.run()
    assert (rows == ground.rows).all()
    policy.add(code)
    with pytest.raises(TooMuch):
        policy.run()
