"""Public movement primitives for `demonstrations.py`, run in an interpreter that has them.

    python reference_primitives.py ASKED.json ANSWERED.json

gmr 2.0.3 (Gaussian mixture regression), movement-primitives 0.9.1 (ProMP, DMP) and lc-ns-kmp 0.1.0 (KMP), each with as
many components or weights as ours. A package that is missing is left out.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

Paths = dict[str, Any]
EXACT = 1e-6


def gmr_mixture(phases: Any, rows: Any) -> tuple[Any, Any]:
    """Mean (T, 3) and covariance (T, 3, 3) by Gaussian mixture regression of the package gmr."""
    from gmr import GMM

    data = np.column_stack([np.tile(phases, len(rows)), rows.reshape(-1, 3)])
    mixture = GMM(n_components=8, random_state=0)
    mixture.from_samples(data)
    ones = [mixture.condition([0], [phase]).to_mvn() for phase in phases]
    return np.stack([one.mean for one in ones]), np.stack([one.covariance for one in ones])


def gmr(phases: Any, rows: Any, case: Paths) -> Paths:
    """Regression only: it knows neither via-points nor ends."""
    return {"mean": gmr_mixture(phases, rows)[0].tolist(), "via": None, "ends": None}


def kmp(phases: Any, rows: Any, case: Paths) -> Paths:
    """The package's KMP on the moments of the demonstrations, with via-points as precise references."""
    from lc_ns_kmp import LC_NS_KMP

    mean = rows.mean(axis=0)
    away = rows - mean
    covariance = np.einsum("nti,ntj->tij", away, away) / (len(rows) - 1) + 1e-6 * np.eye(3)

    def path(asked: dict[int, Any]) -> Any:
        mu, sigma = mean.copy(), covariance.copy()
        for i, value in asked.items():
            mu[i], sigma[i] = value, EXACT * np.eye(3)
        # its kernel is exp(-l (s - t)^2): this l is a standard deviation of 0.1, as ours
        primitive = LC_NS_KMP(3, len(phases), 1.0, 6.0, 50.0)
        column = np.ascontiguousarray(phases[:, None])
        return primitive.predict(column, column, mu, np.ascontiguousarray(sigma)).tolist()

    ends = {0: case["start"], len(phases) - 1: case["goal"]}
    return {"mean": path({}), "via": path({len(phases) // 2: case["via"]}), "ends": path(ends)}


def promp(phases: Any, rows: Any, case: Paths) -> Paths:
    """The package's ProMP; a via-point with the same variance as ours."""
    from movement_primitives.promp import ProMP

    primitive = ProMP(n_dims=3, n_weights_per_dim=25)
    primitive.imitate([phases] * len(rows), rows, n_iter=30)
    precise = 1e-6 * np.eye(3)
    via = primitive.condition_position(np.array(case["via"]), y_cov=precise, t=0.5)
    ends = primitive.condition_position(np.array(case["start"]), y_cov=precise, t=0.0)
    ends = ends.condition_position(np.array(case["goal"]), y_cov=precise, t=1.0)
    made = {"mean": primitive, "via": via, "ends": ends}
    return {name: one.mean_trajectory(phases).tolist() for name, one in made.items()}


def dmp(phases: Any, rows: Any, case: Paths) -> Paths:
    """The package's DMP of the mean demonstration."""
    from movement_primitives.dmp import DMP

    mean = rows.mean(axis=0)
    primitive = DMP(n_dims=3, execution_time=1.0, dt=float(phases[1]), n_weights_per_dim=40)
    primitive.imitate(phases, mean)

    def path(start: Any, goal: Any) -> Any:
        primitive.configure(start_y=np.array(start), goal_y=np.array(goal))
        return primitive.open_loop()[1].tolist()

    return {"mean": path(mean[0], mean[-1]), "via": None, "ends": path(case["start"], case["goal"])}


METHODS: dict[str, tuple[str, Callable[[Any, Any, Paths], Paths]]] = {
    "lc-ns-kmp KMP": ("lc_ns_kmp", kmp),
    "movement-primitives ProMP": ("movement_primitives", promp),
    "movement-primitives DMP": ("movement_primitives", dmp),
    "gmr GMR": ("gmr", gmr),
}


def main(asked: str, answered: str) -> None:
    answers = []
    for case in json.loads(Path(asked).read_text()):
        phases, rows = np.array(case["phases"]), np.array(case["rows"])
        answer: dict[str, Paths] = {}
        for name, (package, method) in METHODS.items():
            if find_spec(package):
                began = time.process_time()
                answer[name] = method(phases, rows, case)
                answer[name]["ms"] = 1e3 * (time.process_time() - began)
        answers.append(answer)
    Path(answered).write_text(json.dumps(answers))


if __name__ == "__main__":
    main(*sys.argv[1:])
