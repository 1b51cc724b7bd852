"""How well the speeds, lengths and standstills of a noisy recording are found again, on synthetic truth."""

import numpy as np

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


def drive(kind, noise, seed):
    """Stamps, noisy positions, and true times and speeds."""
    rng = np.random.default_rng(seed)
    fine = np.linspace(0, SECONDS, round(SECONDS * 1000) + 1)
    speeds = speeds_of(kind, fine)
    along = np.concatenate([[0], np.cumsum((speeds[1:] + speeds[:-1]) / 2 * 0.001)])
    heading = 1.2 * np.sin(1.3 * along)
    steps = np.diff(along)[:, None] * np.column_stack([np.cos(heading), np.sin(heading), 0.2 * np.cos(along)])[1:]
    places = np.vstack([np.zeros(3), np.cumsum(steps, axis=0)])
    speeds = np.linalg.norm(np.gradient(places, 0.001, axis=0), axis=1)
    due = np.arange(0, SECONDS + 1e-9, 1 / HZ)
    seen = np.column_stack([np.interp(due, fine, column) for column in places.T])
    return due + rng.normal(size=len(due)) * JITTER, seen + rng.normal(size=seen.shape) * noise, fine, speeds


def main():
    print(
        "| motion | noise [mm] | median speed error | 95th percentile | waypoints of 1001 | duration [s] | stands [s] |"
    )
    print("|---|---|---|---|---|---|---|")
    for kind in ("constant", "rest to rest", "varying", "with a stop of 3 s", "with a sudden stop of 3 s"):
        for noise in NOISES:
            errors, found = [], None
            for seed in range(5):
                stamps, seen, fine, true = drive(kind, noise, seed)
                found = smoothed(stamps, seen)
                at = np.linspace(0.1, SECONDS - 0.1, 1000)
                wanted = np.interp(at, fine, true)
                moving = wanted > 0.05
                off = np.abs(found.trajectory.at(at).speeds - wanted)[moving] / wanted[moving]
                errors.append((np.median(off), np.percentile(off, 95)))
            middle, high = np.median(errors, axis=0)
            path, stands = found.trajectory, ", ".join(f"{time:.2f}" for time in found.still) or "-"
            row = f"{middle:.2%} | {high:.1%} | {len(path)} | {path.duration:.2f} | {stands}"
            print(f"| {kind} | {noise * 1e3:g} | {row} |")


if __name__ == "__main__":
    main()
