"""A forest of small decision trees, run by numpy: how likely something is, from named values.

`training/referee.py` grows it; the file holds one row a node of all trees.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

import numpy as np

from ovita.paths.trajectory import Array

FILE = "referee.npz"


@dataclass(frozen=True)
class Forest:
    """Trees that add up to the logarithm of odds.

    Args:
        names: Of the values that it asks for; one that is not given counts as 0.
        roots: The first node of each tree (T,).
        feature: Which value each node asks for (N,); -1 for a leaf.
        threshold: Up to which value it goes on at `left`, else at `right` (N,).
        left: A node (N,).
        right: A node (N,).
        value: What a leaf adds (N,).
        base: What is added to the trees.
    """

    names: tuple[str, ...]
    roots: Any
    feature: Any
    threshold: Any
    left: Any
    right: Any
    value: Any
    base: float

    def likelihood(self, values: Mapping[str, float]) -> float:
        """How likely (0..1) these values make it."""
        row = np.array([values.get(name, 0.0) for name in self.names])
        at = self.roots
        while (open_ := self.feature[at] >= 0).any():
            less = row[self.feature[at]] <= self.threshold[at]
            at = np.where(open_, np.where(less, self.left[at], self.right[at]), at)
        return float(1.0 / (1.0 + np.exp(-self.base - self.value[at].sum())))


@cache
def forest() -> Forest:
    """The forest that the package brings."""
    with files("ovita.instruct").joinpath(FILE).open("rb") as file, np.load(file) as saved:
        arrays: dict[str, Array] = {name: saved[name] for name in saved.files if name not in ("names", "base")}
        return Forest(tuple(str(saved["names"]).split("\n")), base=float(saved["base"]), **arrays)
