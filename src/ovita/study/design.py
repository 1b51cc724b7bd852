"""What a study asks, and of how many people: the file STUDY.toml, and the study.toml that a study's folder keeps."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import Any, ClassVar, Literal

from ovita.errors import FormatError, RequestError
from ovita.io.documents import check_keys, parse_toml, validated
from ovita.io.files import read_text
from ovita.study.ratings import NONE

Questionnaire = Literal["tlx", "umux", "sus"]
"""Raw NASA-TLX, UMUX-Lite, and the System Usability Scale."""

Explaining = Literal["both", "on", "off"]
"""Whether explanations are shown: to half of the items of each person ("both", a factor), to all, or to none."""

UNFINISHED = "PLEASE REPLACE THIS TEXT"
"""What the shipped example of a consent text begins with; only a pilot may be made with it."""

SHORTEST_CONSENT = 80
"""Fewest characters of a consent text; less cannot say what a person consents to."""


@dataclass(frozen=True)
class AdaptationPhase:
    """The phase in which people adapt and refine by feedback, before they rate what others did.

    Args:
        items: How many each person adapts; none where 0.
        writer: Who writes the policies, as `ovita adapt --writer` takes it.
        turns: Most sentences that a person may say about an item.
        judged: How many results of other people's adapting each person rates in the end; as many as `items` where None.

    Raises:
        RequestError: If numbers are out of range.
    """

    __pydantic_config__: ClassVar = {"extra": "forbid"}

    items: int = 0
    writer: str = "builtin"
    turns: int = 8
    judged: int | None = None

    def __post_init__(self) -> None:
        if not 0 <= self.items <= 50 or not 1 <= self.turns <= 100 or not 0 <= self.judging <= 50:
            raise RequestError("adapt: expected items and judged from 0 to 50, and turns from 1 to 100")
        if self.judging and not self.items:
            raise RequestError("adapt: judged needs items; nobody adapts anything that others could judge")

    @property
    def judging(self) -> int:
        """How many results of other people each person rates."""
        return self.items if self.judged is None else self.judged


@dataclass(frozen=True)
class StudyDesign:
    """What a study asks, and of how many people.

    Args:
        consent: The file with the text that people agree to, beside the design's file.
        participants: How many links are made; the sum of `groups` where there are any.
        groups: People by group, such as {"expert": 15, "other": 15}; each sees the items equally often.
        per_person: Ratings that each person gives, a multiple of the number of conditions.
        items: How many of the runs' samples are shown, spread evenly; all where None.
        seed: Decides every order and letter.
        pilot: Whether it is a trial whose data are not for analysis.
        explanation: Whether what a system says of its result is shown.
        preference: Whether two conditions are shown side by side after each item.
        questionnaires: Asked once, at the end; the workload after the adaptation phase where there is one.
        attention: Pages that check that a person reads.
        comments: Whether each page has room for a remark.
        contact: Whom people turn to, shown on every page.
        conditions: Names for the records that are compared: name -> "WRITER" or "WRITER/CONDITION"; all where empty.

    Raises:
        RequestError: If numbers are out of range.
    """

    __pydantic_config__: ClassVar = {"extra": "forbid"}

    title: str
    consent: str
    participants: int = 30
    groups: Mapping[str, int] = field(default_factory=dict)
    per_person: int = 24
    items: int | None = None
    seed: int = 0
    pilot: bool = False
    explanation: Explaining = "both"
    preference: bool = True
    questionnaires: tuple[Questionnaire, ...] = ("tlx", "umux")
    attention: int = 2
    comments: bool = True
    contact: str = ""
    adapt: AdaptationPhase = field(default_factory=AdaptationPhase)
    conditions: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.title.strip():
            raise RequestError("title: is empty; say what the study is about, as people will read it")
        bounds = {"participants": (1, 1000), "per_person": (1, 500), "attention": (0, 20), "items": (1, 100_000)}
        for name, (least, most) in bounds.items():
            value = getattr(self, name)
            if value is not None and not least <= value <= most:
                raise RequestError(f"{name}: is {value}, expected {least} to {most}")
        if any(number < 1 for number in self.groups.values()):
            raise RequestError("groups: each group needs at least one person")
        odd = [name for name in self.conditions if "|" in name or name.strip() in ("", NONE)]
        if odd:
            raise RequestError(f"conditions: {odd[0]!r} is no name for a condition; take one without '|'")

    @property
    def people(self) -> tuple[str, ...]:
        """The group of each person, "" for none; they come in turn, so that an early end leaves each of them served."""
        if not self.groups:
            return ("",) * self.participants
        places = [(i / number, name) for name, number in self.groups.items() for i in range(number)]
        return tuple(name for _, name in sorted(places, key=lambda place: place[0]))


@dataclass(frozen=True)
class FoundedStudy:
    """A design as it was made a study: what `study new` adds to it.

    Args:
        id: Random; answers from elsewhere must bear it.
        created: When, in UTC (ISO 8601).
        names: The conditions, in the order of their names.
        runs: The runs' folders, by their names only.
    """

    design: StudyDesign
    id: str
    created: str
    names: tuple[str, ...]
    consent_sha256: str
    runs: tuple[str, ...] = ()


def read_design(path: str | os.PathLike[str]) -> StudyDesign:
    """Read a STUDY.toml.

    Raises:
        FormatError: If it cannot be read, or a value is missing or wrong; names the key.
    """
    file = str(path)
    document = parse_toml(read_text(path), file)
    check_keys(document, [item.name for item in fields(StudyDesign)], file)
    return validated(StudyDesign, document, file)


def read_founded(path: str | os.PathLike[str]) -> FoundedStudy:
    """Read the study.toml of a study's folder.

    Raises:
        FormatError: If it cannot be read.
    """
    return validated(FoundedStudy, parse_toml(read_text(path), str(path)), str(path))


def consent_text(path: str | os.PathLike[str]) -> str:
    """Read the text that people agree to.

    Raises:
        FormatError: If there is none, or it is too short to say what a person agrees to.
    """
    if not Path(path).is_file():
        raise FormatError(
            str(path),
            "there is no consent text; write down what happens, how long it takes, what is stored and for how long,"
            " and that people may stop at any time (docs/study.md says what belongs in it)",
        )
    text = read_text(path).strip()
    if len(text) < SHORTEST_CONSENT:
        raise FormatError(str(path), f"has {len(text)} characters; a consent text says what happens and what is stored")
    return text


def digest(text: str) -> str:
    """SHA-256 of a text, in hexadecimal digits."""
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


def written(founded: FoundedStudy) -> str:
    """The text of a study.toml."""
    note = (
        "# Written by `ovita study new`. People see what follows from it; leave it as it is once the study has begun."
    )
    return "\n".join([note, *_lines(_document(founded), ()), ""])


def _document(value: Any) -> dict[str, Any]:
    return {item.name: getattr(value, item.name) for item in fields(value)}


def _lines(document: Mapping[str, Any], place: tuple[str, ...]) -> list[str]:
    """A table as lines: its own values first, then the tables in it."""
    tables = {key: _document(v) if is_dataclass(v) else v for key, v in document.items() if _is_table(v)}
    lines = [f"{_key(key)} = {_scalar(v)}" for key, v in document.items() if key not in tables and v is not None]
    for key, table in tables.items():
        inner = (*place, key)
        lines += ["", f"[{'.'.join(map(_key, inner))}]", *_lines(table, inner)]
    return lines


def _is_table(value: Any) -> bool:
    return isinstance(value, Mapping) or is_dataclass(value)


def _key(name: str) -> str:
    return name if name.isascii() and name.isidentifier() else _text(name)


def _scalar(value: Any) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(map(_scalar, value))}]"
    return _text(value) if isinstance(value, str) else json.dumps(value)


def _text(value: str) -> str:
    """A text as TOML: JSON's strings are TOML's, but for one control character."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
