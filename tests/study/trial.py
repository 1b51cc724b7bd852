"""Invented ratings of people who do not exist, all marked as a trial: to test the analysis, and nothing else."""

from itertools import combinations

import numpy as np

from ovita.study.ratings import Rating

QUALITY = {"builtin": 4.3, "baseline:extract": 2.6, "baseline:copy": 1.6}
SCALES = ("mental", "physical", "temporal", "performance", "effort", "frustration")


def invented(people=12, items=6, *, seed=0, pilot=True, careless=(), quality=QUALITY):
    """Ratings of so many people on so many items of each system, with preferences and questionnaires."""
    rng = np.random.default_rng(seed)
    found = []
    for i in range(people):
        who, group, mood = f"p{i + 1:02d}", "expert" if i % 2 else "novice", rng.normal(0, 0.3)
        shared = {"participant": who, "group": group, "seconds": 8.0, "when": "2026-01-01T10:00:00Z", "pilot": pilot}

        def say(phase, item, condition, explanation, question, value, shared=shared, found=found):
            found.append(
                Rating(**shared, phase=phase, item=item, condition=condition, explanation=explanation,
                       question=question, value=value, position=len(found))
            )  # fmt: skip

        def likert(level, mood=mood):
            return float(np.clip(round(level + mood + rng.normal(0, 0.8)), 1, 5))

        for k in range(items):
            item, shown = f"s{k}", bool((i + k) % 2)
            for condition, level in quality.items():
                say("rate", item, condition, shown, "correctness", likert(level))
                say("rate", item, condition, shown, "interpretability", likert(level - 0.6 + 0.8 * shown))
            for a, b in combinations(quality, 2):
                chosen = "none" if rng.random() < 0.2 else max(a, b, key=lambda c: quality[c] + rng.normal(0, 1.2))
                say("rate", item, f"{a}|{b}", shown, "preference", chosen)
        say("adapt", "s0", "builtin", True, "correctness", likert(4.5))
        for scale in SCALES:
            say("adapt", "", "", False, f"tlx_{scale}", float(5 * rng.integers(2, 12)))
        say("rate", "", "", False, "umux_1", float(rng.integers(4, 8)))
        say("rate", "", "", False, "umux_2", float(rng.integers(4, 8)))
        for _ in range(2):
            say("rate", "s0", "builtin", False, "attention", 0.0 if who in careless else 1.0)
    return tuple(found)
