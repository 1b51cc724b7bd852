"""The layers of a transformer in numpy (Vaswani et al. 2017), with their weights by name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

Floats: TypeAlias = npt.NDArray[np.float32]


class Layers:
    """Linear layers, normalisation and attention.

    Args:
        weights: Arrays by name, as torch has them: a linear layer's (out, in); int8 arrays have their scales per row
            under "NAME.scale". What is no array of numbers is passed over.
        epsilon: Of the normalisation.
    """

    def __init__(self, weights: Mapping[str, npt.NDArray[Any]], epsilon: float = 1e-12) -> None:
        self.w: dict[str, Floats] = {}
        self._epsilon = np.float32(epsilon)
        for name in weights:
            value = weights[name]
            if value.dtype == np.int8:
                self.w[name] = value.astype(np.float32) * weights[f"{name}.scale"][:, None]
            elif value.dtype.kind == "f":
                self.w[name] = value.astype(np.float32)
        for name in [n for n in self.w if n.endswith(".weight") and self.w[n].ndim == 2 and "embed" not in n]:
            self.w[name] = np.ascontiguousarray(self.w[name].T)

    def linear(self, name: str, x: Floats) -> Floats:
        """A linear layer's output (..., out) for x (..., in)."""
        return np.asarray(x @ self.w[f"{name}.weight"] + self.w[f"{name}.bias"], dtype=np.float32)

    def norm(self, name: str, x: Floats) -> Floats:
        """The x (..., width) normalised along the last axis, scaled and shifted."""
        centred = x - x.mean(axis=-1, keepdims=True)
        scale = np.sqrt((centred**2).mean(axis=-1, keepdims=True) + self._epsilon)
        return np.asarray(centred / scale * self.w[f"{name}.weight"] + self.w[f"{name}.bias"], dtype=np.float32)

    def attend(
        self, name: str, x: Floats, to: Floats, heads: int, there: npt.NDArray[np.bool_] | None = None
    ) -> Floats:
        """What each of x (..., N, width) attends to of `to` (..., M, width), of which those `there` (..., M) count."""
        q, k, v = (
            self.linear(f"{name}.{part}", of).reshape(*of.shape[:-1], heads, -1).swapaxes(-2, -3)
            for part, of in (("q", x), ("k", to), ("v", to))
        )
        scores = q @ k.swapaxes(-1, -2) / np.sqrt(np.float32(q.shape[-1]))
        if there is not None:
            scores = np.where(there[..., None, None, :], scores, np.float32(-1e9))
        return self.linear(f"{name}.o", (softmax(scores) @ v).swapaxes(-2, -3).reshape(x.shape))


def softmax(x: Floats) -> Floats:
    """Shares that sum to one along the last axis."""
    e = np.exp(x - x.max(axis=-1, keepdims=True))
    return np.asarray(e / e.sum(axis=-1, keepdims=True), dtype=np.float32)


def gelu(x: Floats) -> Floats:
    """The tanh form of the Gaussian error linear unit."""
    return np.asarray(0.5 * x * (1 + np.tanh(0.7978845608 * (x + 0.044715 * x * x * x))), dtype=np.float32)
