"""The two baselines that read no instruction."""

import numpy as np
import pytest

from ovita.baselines import NAMES, Baseline, adapted_by, baseline_named
from ovita.baselines.catalogue import FACTOR, SHIFT, Copy, Random
from ovita.errors import RequestError
from ovita.paths.trajectory import Trajectory
from ovita.request import Request

PATH = Trajectory(np.column_stack([np.linspace(0, 2, 401), np.zeros(401), np.zeros(401)]), np.full(401, 0.4))


def test_copying_changes_nothing_and_says_nothing():
    result = adapted_by(Copy(), Request("go up", PATH))
    assert result.adapted == PATH == result.proposed
    assert (result.status, result.plan, result.code, result.writer.model) == ("done", (), "", "baseline:copy")


@pytest.mark.parametrize("instruction", ["go up", "slower", "keep away from the cup"])
def test_random_changes_have_the_usual_size_and_spare_the_ends(instruction):
    new = Random().deform(Request(instruction, PATH)).trajectory
    shift = new.positions - PATH.positions
    size = np.linalg.norm(shift, axis=1)
    assert size.max() == pytest.approx(SHIFT * 2.0, rel=1e-3)  # the path's extent is 2 m
    assert np.linalg.matrix_rank(shift, tol=1e-9) == 1  # one direction
    ratio = new.speeds / PATH.speeds
    assert max(ratio.max(), 1 / ratio.min()) == pytest.approx(FACTOR, rel=1e-3)
    assert (ratio >= 1).all() or (ratio <= 1).all()
    for end in (0, -1):
        assert np.array_equal(new.to_array()[end], PATH.to_array()[end])


def test_random_changes_repeat_for_the_same_sample_and_seed_only():
    def drawn(seed, said, path=PATH):
        return Random(seed).deform(Request(said, path)).trajectory

    assert drawn(0, "go up") == drawn(0, "go up")
    others = [drawn(1, "go up"), drawn(0, "go down"), drawn(0, "go up", PATH.with_(speeds=PATH.speeds * 1.5))]
    directions = [(t.positions - PATH.positions)[200] for t in (drawn(0, "go up"), *others)]
    assert len({tuple(np.round(d, 6)) for d in directions}) == 4


def test_baselines_go_by_their_names():
    for name in ("baseline:copy", "baseline:random"):
        assert isinstance(baseline_named(name), Baseline) and baseline_named(name).name == name
    ours = ("baseline:copy", "baseline:random", "baseline:extract", "baseline:extract-ovita", "baseline:latte-style")
    assert ours == NAMES
    with pytest.raises(RequestError, match=r"no baseline 'baseline:latte'; there are baseline:copy, .*exec:COMMAND"):
        baseline_named("baseline:latte")
