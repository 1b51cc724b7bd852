"""How well the speeds, lengths and standstills of a noisy recording are found again, on synthetic truth.

The last six kinds of motion were written after the method, which was not tuned on them; docs/robots.md has their first
figures too.
"""

from itertools import pairwise

import numpy as np
from scipy.interpolate import PchipInterpolator

from ovita.io.smoothing import smoothed

SECONDS, HZ, JITTER = 20.0, 50.0, 0.0005
NOISES = (0.0, 0.001, 0.003, 0.005, 0.02)


def speeds_of(kind, t):
    """True speeds [m/s] of a drive at about 0.5 m/s."""
    ends = np.minimum(t, SECONDS - t)
    match kind:
        case "constant":
            return np.full_like(t, 0.5)
        case "rest to rest":
            return 0.5 * np.clip(ends, 0, 1)
        case "varying":
            return 0.5 + 0.3 * np.sin(2 * np.pi * t / 5)
        case "with a stop of 3 s":
            return 0.5 * np.clip(np.minimum(np.abs(t - 10) - 1.5, ends) / 0.8, 0, 1)
    return np.where(np.abs(t - 10) < 1.5, 0, 0.5)


def legs(points, cruise, acceleration):
    """Straight legs from rest to rest at a trapezoid of speed, corner to corner; then it stands."""
    done = []
    for a, b in pairwise(points):
        length = np.linalg.norm(b - a)
        ramp = cruise / acceleration
        t = np.arange(0, length / cruise + ramp, 0.001)
        left = length / cruise + ramp - t
        s = np.where(t < ramp, acceleration * t**2 / 2, cruise * (t - ramp / 2))
        done.append(a + np.outer(np.where(left < ramp, length - acceleration * left**2 / 2, s) / length, b - a))
    return done


def placed(points, seconds, rest):
    """Minimum-jerk motions between points, with a rest at each."""
    u = np.arange(0, 1, 0.001 / seconds)
    ease = 10 * u**3 - 15 * u**4 + 6 * u**5
    pairs = pairwise(points)
    return [np.vstack([a + np.outer(ease, b - a), np.tile(b, (round(rest * 1000), 1))]) for a, b in pairs]


def places_of(kind, t):
    """True places (N, 3) [m] of the motions that the method was not tuned on."""
    zero = np.zeros_like(t)
    match kind:
        case "figure of eight, 1.2 m/s":
            return np.column_stack([2 * np.sin(0.2 * np.pi * t), np.sin(0.4 * np.pi * t), zero])
        case "helix that speeds up":
            s = 0.1 * t + 0.02 * t**2
            return np.column_stack([0.5 * np.cos(2 * s), 0.5 * np.sin(2 * s), 0.05 * s])
        case "creeping, 2.4 cm/s":
            return np.column_stack([0.02 * t, 0.05 * np.sin(0.4 * t), zero])
        case "teleoperated, in bursts":
            rng = np.random.default_rng(9)
            knots = rng.uniform(0, 0.6, 21) * (rng.random(21) > 0.3)
            speed, heading = (PchipInterpolator(range(21), v)(t) for v in (knots, rng.uniform(-1.5, 1.5, 21)))
            return np.cumsum(0.001 * np.column_stack([speed * np.cos(heading), speed * np.sin(heading), zero]), axis=0)
        case "pick and place":
            high, low, other, down = [0.4, 0, 0.3], [0.4, 0, 0.1], [0.2, 0.4, 0.3], [0.2, 0.4, 0.1]
            done = placed(np.array([high, low, high, other, down, other]), 2.2, 1.1)
        case "rows with square corners":
            done = legs(np.array([[0, 0, 0], [2, 0, 0], [2, 0.5, 0], [0, 0.5, 0], [0, 1, 0], [2.0, 1, 0]]), 0.4, 0.5)
    rows = np.vstack(done)[: len(t)]
    return np.vstack([rows, np.tile(rows[-1], (len(t) - len(rows), 1))])


TUNED = ("constant", "rest to rest", "varying", "with a stop of 3 s", "with a sudden stop of 3 s")
NEW = (
    "figure of eight, 1.2 m/s",
    "helix that speeds up",
    "rows with square corners",
    "teleoperated, in bursts",
    "pick and place",
    "creeping, 2.4 cm/s",
)


def drive(kind, noise, seed):
    """Stamps, noisy positions, and true times and speeds."""
    rng = np.random.default_rng(seed)
    fine = np.linspace(0, SECONDS, round(SECONDS * 1000) + 1)
    if kind in NEW:
        return recorded(fine, places_of(kind, fine), noise, rng)
    speeds = speeds_of(kind, fine)
    along = np.concatenate([[0], np.cumsum((speeds[1:] + speeds[:-1]) / 2 * 0.001)])
    heading = 1.2 * np.sin(1.3 * along)
    steps = np.diff(along)[:, None] * np.column_stack([np.cos(heading), np.sin(heading), 0.2 * np.cos(along)])[1:]
    places = np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])
    return recorded(fine, places, noise, rng)


def recorded(fine, places, noise, rng):
    """The stamps and noisy places of a motion, and its true times and speeds."""
    speeds = np.linalg.norm(np.gradient(places, 0.001, axis=0), axis=1)
    due = np.arange(0, SECONDS + 1e-9, 1 / HZ)
    seen = np.column_stack([np.interp(due, fine, column) for column in places.T])
    return due + rng.normal(size=len(due)) * JITTER, seen + rng.normal(size=seen.shape) * noise, fine, speeds


def main():
    print(
        "| motion | noise [mm] | median speed error | 95th percentile | waypoints of 1001 | duration [s] | stands [s] |"
    )
    print("|---|---|---|---|---|---|---|")
    for kind in (*TUNED, *NEW):
        for noise in NOISES:
            errors, found = [], None
            for seed in range(5):
                stamps, seen, fine, true = drive(kind, noise, seed)
                found = smoothed(stamps, seen)
                at = np.linspace(0.1, SECONDS - 0.1, 1000)
                wanted = np.interp(at, fine, true)
                moving = wanted > 0.1 * np.percentile(true, 95)
                off = np.abs(found.trajectory.at(at).speeds - wanted)[moving] / wanted[moving]
                errors.append((np.median(off), np.percentile(off, 95)))
            middle, high = np.median(errors, axis=0)
            path, stands = found.trajectory, ", ".join(f"{time:.2f}" for time in found.still) or "-"
            row = f"{middle:.2%} | {high:.1%} | {len(path)} | {path.duration:.2f} | {stands}"
            print(f"| {kind} | {noise * 1e3:g} | {row} |")


if __name__ == "__main__":
    main()
