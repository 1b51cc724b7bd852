"""A result that is done has used every number of its sentence: two wishes in one sentence, each with an amount."""

from itertools import product

import numpy as np
import pytest

from ovita import Request, Scene, Trajectory, adapt

N = 40
PATH = Trajectory(np.column_stack([np.linspace(0, 2, N), np.zeros(N), np.full(N, 1.0)]), np.full(N, 0.4))
WAYS = {"up": (0, 0, 1), "down": (0, 0, -1), "left": (-1, 0, 0), "right": (1, 0, 0)}
MOVES = (
    "go {way} by {metres}",
    "move it {way} {metres}",
    "shift the path {metres} {way}",
    "lift it {way} {metres}",
    "push everything {metres} to the {way}",
    "nudge it {way} {metres}",
    "raise it by {metres}",
    "lower it {metres}",
    "take it {metres} {way}",
)
PACES = (
    ("slow down by {percent}", -1),
    ("drop the speed by {percent}", -1),
    ("cut the speed by {percent}", -1),
    ("go {percent} faster", 1),
    ("increase the speed by {percent}", 1),
    ("speed up by {percent}", 1),
    ("be {percent} slower", -1),
)
JOINTS = ("{0} and {1}", "{0}, then {1}", "{1} and {0}", "{0}; {1}", "{1}, and also {0}", "{0} while you {1}")
METRES = ((0.1, "10 cm"), (0.07, "0.07 m"), (0.25, "25cm"), (0.033, "33 mm"), (0.12, "0.12"))
PERCENT = ((0.2, "20 percent"), (0.35, "35 %"), (0.1, "10%"))


def sentences(count, seed=0):
    """Seeded sentences with the shift (3,) [m] and the factor on the speed that they ask for."""
    rng = np.random.default_rng(seed)
    every = list(product(MOVES, PACES, JOINTS, METRES, PERCENT))
    for k in rng.permutation(len(every))[:count]:
        move, (pace, sign), joint, (metres, said), (share, percent) = every[k]
        fitting = ["up"] if move.startswith(("lift", "raise")) else ["down"] if move.startswith("lower") else list(WAYS)
        fitting = [w for w in fitting if "to the" not in move or w in ("left", "right")]
        way = str(rng.choice(fitting))
        text = joint.format(move.format(way=way, metres=said), pace.format(percent=percent))
        yield text, metres * np.array(WAYS[way]), 1 + sign * share


def fault(text, shift, factor):
    """What a result called done leaves of the amounts, as a sentence; "" if it keeps them or asks."""
    result = adapt(Request(text, PATH, Scene()), writer="builtin")
    if result.status != "done":
        return "", result.status
    moved = (result.adapted.positions - PATH.positions).mean(axis=0)
    paced = result.adapted.speeds.mean() / 0.4
    right = np.allclose(moved, shift, atol=1e-6) and abs(paced - factor) < 1e-6
    return "" if right else f"{text!r} is done with {np.round(moved, 4)} m and {paced:.3f} times the speed", "done"


@pytest.mark.parametrize("block", range(3))
def test_a_result_that_is_done_has_used_both_numbers(block):
    found = [fault(*drawn) for drawn in sentences(20, seed=block)]
    assert not [text for text, _ in found if text]
    assert sum(status == "done" for _, status in found) >= 5


if __name__ == "__main__":
    import sys

    found = [fault(*drawn) for drawn in sentences(int(sys.argv[1]), seed=9)]
    print(*(text for text, _ in found if text), sep="\n")
    statuses = [status for _, status in found]
    print({status: statuses.count(status) for status in set(statuses)}, len([t for t, _ in found if t]), "faults")
