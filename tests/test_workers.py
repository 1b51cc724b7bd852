"""Work that is shared out to workers."""

import os
import signal
from functools import partial

import pytest

from ovita.errors import OvitaError, RequestError
from ovita.workers import shared


def squared(number):
    return number * number


def once_killed(number, folder):
    """Ends its process the first time that it is asked for 3."""
    mark = folder / "killed"
    if number == 3 and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def always_killed(number):
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.mark.parametrize(("jobs", "engine"), [(1, "processes"), (2, "processes"), (3, "threads")])
def test_every_item_is_done_once(jobs, engine):
    assert sorted(shared(squared, range(9), jobs=jobs, engine=engine)) == [n * n for n in range(9)]


def test_items_are_drawn_as_workers_come_free():
    drawn = []
    results = shared(squared, (drawn.append(n) or n for n in range(100)), jobs=2, engine="threads")
    next(results)
    results.close()
    assert len(drawn) <= 6


def test_what_a_killed_worker_had_is_done_by_another(tmp_path):
    assert sorted(shared(partial(once_killed, folder=tmp_path), range(6), jobs=2)) == list(range(6))


def test_workers_that_are_killed_again_and_again_are_given_up():
    with pytest.raises(OvitaError, match="fewer --jobs"):
        list(shared(always_killed, range(4), jobs=2))


def test_an_unknown_engine_is_refused():
    with pytest.raises(RequestError, match="no engine 'spark'"):
        list(shared(squared, range(3), jobs=2, engine="spark"))


def test_what_goes_wrong_in_a_worker_is_raised():
    with pytest.raises(TypeError):
        list(shared(squared, [None, "a"], jobs=2))


def test_ray_does_the_same():
    pytest.importorskip("ray", reason="Ray is not installed: pip install 'ovita[ray]'")
    assert sorted(shared(abs, range(-4, 1), jobs=2, engine="ray")) == [0, 1, 2, 3, 4]
