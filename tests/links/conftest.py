"""Tests of links talk with other processes."""

import signal

import pytest

LONGEST = 240
"""Seconds that no test of a link takes, however busy the machine is."""


@pytest.fixture(autouse=True)
def no_test_hangs():
    """A test that waits for a line of another process fails after a while, and never hangs."""

    def late(*_):
        raise TimeoutError(f"another process said nothing for {LONGEST} s")

    before = signal.signal(signal.SIGALRM, late)
    signal.alarm(LONGEST)
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, before)
