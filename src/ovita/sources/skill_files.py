"""Skills as JSON files."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from ovita.errors import FormatError
from ovita.io import atomic_write, scene_dict, scene_from_dict
from ovita.io.documents import Number, plain, show, timestep_of, validated
from ovita.io.files import errors_of, examine, file_name, read_text, suffix
from ovita.io.json_ import SKILL_SCHEMA, check_values, dumps, parse_object
from ovita.paths.trajectory import TIMESTEP, Array
from ovita.sources.dmp import BASES as DMP_BASES
from ovita.sources.dmp import Dmp
from ovita.sources.probabilistic import BASES as PROMP_BASES
from ovita.sources.probabilistic import Promp
from ovita.sources.skills import Model, Moments, Skill, SkillKind
from ovita.sources.tpgmm import Mixture

_MODELS: Mapping[str, tuple[type[Model], Mapping[str, str]]] = {
    "kmp": (Moments, {"means": "JTd", "covariances": "JTdd", "way": "Tp", "about": "Tpp"}),
    "promp": (Promp, {"weights": "DPd"}),
    "dmp": (Dmp, {"weights": "Fd", "start": "d", "goal": "d", "speed": "d"}),
    "tpgmm": (Mixture, {"priors": "C", "means": "JCe", "covariances": "JCee"}),
}
"""The arrays of each kind of model, with a letter for each axis: frames J, phases T, components of a pose d."""


def save_skill(path: str | os.PathLike[str], skill: Skill) -> None:
    """Write a skill atomically as JSON.

    Raises:
        FormatError: If it cannot be written there.
    """
    file = file_name(path)
    if suffix(path) != ".json":
        raise FormatError(file, "a skill is JSON; name a .json file")
    atomic_write(path, dumps(document_of(skill), file))


def document_of(skill: Skill) -> dict[str, Any]:
    """The document of a skill, in lists, dicts and scalars."""
    held = {name: getattr(skill, name) for name in _HELD}
    return dict(plain({"schema": SKILL_SCHEMA, **held, "scene": scene_dict(skill.scene)}))


_HELD = (
    *("kind", "shown", "frames", "size", "timestep", "notes", "edits"),
    *("start", "goal", "bases", "speeds", "offset", "pace", "model"),
)


def load_skill(path: str | os.PathLike[str]) -> Skill:
    """Read a skill that `save_skill` wrote.

    Raises:
        FormatError: If the file cannot be read, has another schema, or something in it is malformed.
    """
    examine(path)
    file = file_name(path)
    document = parse_object(read_text(path), file)
    schema = document.get("schema")
    if schema != SKILL_SCHEMA:
        problem = f"this is no skill: the schema is {show(schema)}, not {SKILL_SCHEMA!r}; `ovita learn` makes skills"
        raise FormatError(file, problem)
    check_values(document, file)
    return _skill({"frames": [], "scene": {}, "edits": [], "notes": [], "timestep": TIMESTEP, **document}, file)


def _skill(document: Mapping[str, Any], file: str) -> Skill:
    def read(kind: object, key: str) -> Any:
        return validated(kind, document.get(key), file, key)

    kind, frames = read(SkillKind, "kind"), read(tuple[str, ...], "frames")
    turned = document.get("bases") is not None
    sizes = {"J": max(len(frames), 1), "q": 4, "p": 3, "d": 6 if turned else 3}
    sizes |= {"e": sizes["d"] + 1, "P": PROMP_BASES, "F": DMP_BASES}
    axes = {"bases": "Jq", "speeds": "T", "offset": "Td", "pace": "T", "start": "p", "goal": "p"}
    needed = ("speeds", "start", "goal")
    given = {name: letters for name, letters in axes.items() if name in needed or document.get(name) is not None}
    arrays: dict[str, Any] = {"bases": None}
    arrays |= {name: _array(document, name, letters, file, sizes) for name, letters in given.items()}
    for name in {"speeds", "pace"} & set(arrays):
        if len(arrays[name]) < 2 or (arrays[name] < 0).any():
            raise FormatError(file, "holds fewer than 2 speeds or a negative one", key=name)
    with errors_of(file):
        scene = scene_from_dict(read(dict[str, Any], "scene"))
    model = _model(kind, read(dict[str, Any], "model"), file, sizes)
    told = {name: read(tuple[str, ...], name) for name in ("edits", "notes")}
    size, shown, timestep = read(Number, "size"), read(int, "shown"), timestep_of(document["timestep"], file)
    return Skill(kind, model, frames, size=size, shown=shown, scene=scene, timestep=timestep, **arrays, **told)


def _model(kind: SkillKind, document: Mapping[str, Any], file: str, sizes: dict[str, int]) -> Model:
    made, axes = _MODELS[kind]
    arrays = {name: _array(document, name, letters, file, sizes, "model.") for name, letters in axes.items()}
    for name in {"covariances", "about"} & set(arrays):
        values = arrays[name]
        if not np.allclose(values, values.swapaxes(-1, -2)) or np.linalg.eigvalsh(values).min() <= 0.0:
            raise FormatError(file, "holds a matrix that is no covariance", key=f"model.{name}")
    return made(**arrays)


def _array(
    document: Mapping[str, Any], name: str, axes: str, file: str, sizes: dict[str, int], prefix: str = ""
) -> Array:
    """An array of a document; the size of an axis that was not seen before is noted under its letter."""
    kind: Any = Number
    for _ in axes:
        kind = list[kind]
    values = validated(kind, document.get(name), file, prefix + name)
    try:
        array = np.array(values, dtype=float)
    except ValueError:
        raise FormatError(file, "has rows of different lengths", key=prefix + name) from None
    if array.ndim == len(axes):
        for letter, size in zip(axes, array.shape, strict=True):
            sizes.setdefault(letter, size)
    wanted = tuple(sizes.get(letter, 0) for letter in axes)
    if array.shape != wanted or 0 in wanted:
        raise FormatError(file, f"has the shape {array.shape}, expected {wanted}", key=prefix + name)
    return array
