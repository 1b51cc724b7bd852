"""The LaTTe-style model with other weights, by the checks of `ovita bench`: its learning curve.

`python training/evaluate_latte.py DATASET WEIGHTS.npz ...` prints a row for each file of weights; a dataset is what
`ovita bench run` takes, each sample under its own limits, which are measured and not enforced.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path

import numpy as np

from ovita.baselines.latte import LatteNetwork, LatteStyle
from ovita.bench.dataset import load_dataset
from ovita.bench.evaluate import DEFAULT, Protocol, evaluate
from ovita.bench.systems import recording


def main(folder: str, *files: str) -> None:
    """Print the table."""
    dataset = load_dataset(folder)
    print(f"{len(dataset.samples)} samples of {Path(folder).name}, digest {dataset.digest}")
    for file in files:
        with np.load(file) as saved:
            model = LatteStyle(network=LatteNetwork({name: saved[name] for name in saved.files}))
            told = str(saved["told"])
        records = [evaluate(sample, recording(model, DEFAULT), DEFAULT, Protocol()) for sample in dataset.samples]
        passed, total = Counter[str](), Counter[str]()
        for record in records:
            for group in (record.subset, record.kind, "all"):
                passed[group] += record.rounds[-1].passed
                total[group] += 1
        clauses = sum(record.rounds[-1].score for record in records) / len(records)
        groups = ", ".join(f"{group} {passed[group]}/{total[group]}" for group in sorted(total))
        print(f"{Path(file).stem} ({told}): clauses {clauses:.1%}; {groups}", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
