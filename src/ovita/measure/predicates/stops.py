"""Checks of stops and waits."""

from __future__ import annotations

from typing import Any

import numpy as np

from ovita.measure.predicates.check import Verdict, predicate, say
from ovita.measure.predicates.pair import Pair
from ovita.paths.geometry import SAME_PLACE
from ovita.paths.trajectory import Array

AROUND = 0.15
"""A stop "near" an object is at most this share of the extent farther from it than the original comes."""

AT_REST = 0.03
"""The robot stands below this share of the original's median speed."""


@predicate
def stops(pair: Pair, near: Any = None) -> Verdict:
    """The robot stops where it did not before: near a place, or at the end.

    A path that ends there will do, as will a stop after which the robot goes on.
    """
    still = pair.adapted[:, 3] <= _rest(pair)
    if near is None:
        fact = f"the speed at the end is {pair.adapted[-1, 3]:.3f} m/s"
        return say(bool(still[-1]), "stop at the end", fact)
    centre, name = pair.place(near)
    distance, limit = _around(pair, centre)
    cut = bool(np.linalg.norm(pair.adapted[-1, :3] - pair.original[-1, :3]) > 2 * pair.noticeable)
    if cut:
        still[-1] = True
    else:
        # Where the original stands already, standing is no answer.
        old = pair.original[pair.original[:, 3] <= _rest(pair), :3]
        for place in old:
            still &= np.linalg.norm(pair.adapted[:, :3] - place, axis=1) > 2 * pair.noticeable
    nearest = float(distance[still].min()) if still.any() else np.inf
    fact = f"it stops {nearest:.3f} m from {name} (at most {limit:.3f} m)" if still.any() else "it does not stop"
    return say(nearest <= limit, f"stop near {name}", fact)


@predicate
def dwells(pair: Pair, steps: int, *, near: Any = None) -> Verdict:
    """The robot waits for so many timesteps: repeated waypoints, or waypoints at rest, in one place; one may differ.

    Args:
        pair: What is compared.
        steps: Timesteps.
        near: The place where it waits; None for anywhere.
    """
    waiting = _waits(pair.adapted, pair)
    name = ""
    if near is not None:
        centre, name = pair.place(near)
        distance, limit = _around(pair, centre)
        waiting = [(a, b) for a, b in waiting if distance[a] <= limit]
    longest = max((b - a for a, b in waiting), default=0)
    before = max((b - a for a, b in _waits(pair.original, pair)), default=0)
    there = f" near {name}" if name else ""
    held = abs(longest - steps) <= max(1, round(0.1 * steps)) and longest > before
    return say(held, f"wait for {steps} timesteps{there}", f"the longest wait{there} has {longest} timesteps")


def _rest(pair: Pair) -> float:
    return max(AT_REST * float(np.median(pair.original[:, 3])), 1e-6)


def _around(pair: Pair, centre: Array) -> tuple[Array, float]:
    distance = np.linalg.norm(pair.adapted[:, :3] - centre, axis=1)
    old = float(np.linalg.norm(pair.original[:, :3] - centre, axis=1).min())
    return distance, old + AROUND * pair.extent


def _waits(rows: Array, pair: Pair) -> list[tuple[int, int]]:
    """First and last index of each run of waypoints at one place; at rest, a small shift of them does not count."""
    still, runs, a = rows[:, 3] <= _rest(pair), [], 0
    for i in range(1, len(rows) + 1):
        if i < len(rows):
            step = float(np.linalg.norm(rows[i, :3] - rows[i - 1, :3]))
            away = float(np.linalg.norm(rows[i, :3] - rows[a, :3]))
            if step <= SAME_PLACE or (still[i] and still[i - 1] and away <= pair.noticeable):
                continue
        if i - 1 > a:
            runs.append((a, i - 1))
        a = i
    return runs
