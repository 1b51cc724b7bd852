"""Strategies for paths, points and masks."""

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st

modest = settings(max_examples=30, deadline=None)

seeds = st.integers(0, 2**32 - 1)


@st.composite
def paths(draw, smallest=2, extra=1):
    """A random walk (N, 4 + extra), sometimes with a dwell, a standstill or all at one point."""
    rng = np.random.default_rng(draw(seeds))
    n = draw(st.integers(smallest, 40))
    steps = rng.normal(0.05, 0.05, (n, 3))
    kind = draw(st.sampled_from(["free", "free", "dwell", "still"]))
    if kind == "dwell":
        steps[rng.integers(0, n)] = 0.0
    if kind == "still":
        steps[:] = 0.0
    rows = np.column_stack([np.cumsum(steps, axis=0), rng.uniform(0.0, 1.0, n), rng.normal(size=(n, extra))])
    rows[-1, 3] = draw(st.sampled_from([0.0, rows[-1, 3]]))
    return rows


@st.composite
def paths_and_masks(draw, **options):
    rows = draw(paths(**options))
    rng = np.random.default_rng(draw(seeds))
    return rows, rng.random(len(rows)) < draw(st.sampled_from([0.0, 0.3, 0.8, 1.0]))


points = st.tuples(*[st.floats(-1.0, 3.0, allow_nan=False).map(lambda v: round(v, 3))] * 3).map(np.array)
amounts = st.floats(0.0, 1.0).map(lambda v: round(v, 4))
shares = st.sampled_from([0.0, 0.1, 0.25, 0.5, 1.0])
words = st.sampled_from(["left", "right", "front", "back", "up", "down"])


def distances(rows, centre):
    return np.linalg.norm(rows[:, :3] - centre, axis=1)


def bending(rows):
    return float((np.diff(rows[:, :3], n=2, axis=0) ** 2).sum())
