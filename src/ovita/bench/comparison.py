"""The paper's comparison: which systems can run here, and why others cannot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ovita.baselines.catalogue import NAMES, baseline_named
from ovita.errors import OvitaError
from ovita.writers.base import MODEL_VARIABLE, configured_model, writer_named

EVERYTHING = "all"
"""The name that stands for every system that can run here."""


@dataclass(frozen=True)
class SystemsHere:
    """Systems that can run here by name, and why others cannot."""

    names: tuple[str, ...]
    missing: Mapping[str, str]


def systems_here() -> SystemsHere:
    """The built-in writer, the configured or local model, and every baseline that ovita brings."""
    names, missing = ["builtin"], {}
    model = next((name for name in configured_model() if name), "")
    if not model:
        missing["a language model"] = f"{MODEL_VARIABLE} is not set, and no local model is present (ovita models)"
    for name in (*([model] if model else []), *NAMES):
        try:
            (baseline_named if name in NAMES else writer_named)(name)
        except OvitaError as error:
            missing[name] = str(error)
        else:
            names.append(name)
    return SystemsHere(tuple(dict.fromkeys(names)), missing)
