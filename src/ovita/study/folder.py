"""What a study leaves on disk: the design, what is shown, who sees what, links, and what people answered."""

from __future__ import annotations

import csv
import datetime
import hmac
import io
import json
import os
import secrets
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from ovita.bench.report import csv_text
from ovita.errors import FormatError, RequestError
from ovita.io import atomic_write
from ovita.io.documents import listing, plain, validated
from ovita.io.files import make_folder, read_text
from ovita.io.json_ import parse_object
from ovita.study.assignment import Participant, assign
from ovita.study.design import (
    UNFINISHED,
    FoundedStudy,
    StudyDesign,
    consent_text,
    digest,
    read_design,
    read_founded,
    written,
)
from ovita.study.material import StudyItem, gather

STUDY, CONSENT, ITEMS, LAYOUT, LINKS = "study.toml", "consent.txt", "items", "layout.json", "links.csv"
PARTICIPANTS, SESSIONS = "participants", "sessions"

TOKEN_BYTES = 18
"""Random bytes of a link: 144 bits, 24 letters."""


def now() -> str:
    """The moment in UTC (ISO 8601), to the second."""
    return datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


@dataclass(frozen=True)
class StudyFolder:
    """A study on disk.

    Args:
        tokens: The secret part of each person's link, by id.
    """

    path: Path
    founded: FoundedStudy
    consent: str
    participants: Mapping[str, Participant]
    tokens: Mapping[str, str]

    @property
    def design(self) -> StudyDesign:
        """What is asked."""
        return self.founded.design

    def whose(self, token: str) -> Participant | None:
        """The person of a link, found in a time that does not depend on how much of it is right."""
        brought = token.encode("utf-8", "replace")
        fits = [name for name, secret in self.tokens.items() if hmac.compare_digest(brought, secret.encode())]
        return self.participants[fits[-1]] if fits else None

    @cached_property
    def items(self) -> Mapping[str, StudyItem]:
        """What is shown, by sample."""
        files = sorted((self.path / ITEMS).glob("*.json"))
        items = (validated(StudyItem, parse_object(read_text(file), str(file)), str(file)) for file in files)
        return {item.sample: item for item in items}

    def answers_of(self, participant: str) -> Path:
        """The file with a person's answers."""
        return self.path / PARTICIPANTS / f"{participant}.jsonl"

    def session_of(self, participant: str, page: str) -> Path:
        """The journal of a person's conversation on a page of the adaptation phase."""
        return self.path / SESSIONS / f"{participant}-{page}.jsonl"


def found_study(file: str, runs: Sequence[str], out: str, changes: Mapping[str, object] | None = None) -> StudyFolder:
    """Make a study's folder from a STUDY.toml and bench runs.

    The folder `out` must not exist yet or be empty; `changes` are values in place of the design's own.

    Raises:
        FormatError: If a file cannot be read or written.
        RequestError: If the design cannot be met, or the folder is in use.
    """
    design = replace(read_design(file), **dict(changes or {}))  # type: ignore[arg-type]
    text = _finished_consent(Path(file).parent / design.consent, design)
    items = gather(runs, design.conditions, design.items)
    names = tuple(items[0].results)
    people = assign(design, [item.sample for item in items], names)
    folder = Path(out)
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise RequestError(f"{out}: is there already; a study is never overwritten, choose another --out")
    founded = FoundedStudy(design, secrets.token_hex(8), now(), names, digest(text), tuple(Path(r).name for r in runs))
    tokens = {person.id: secrets.token_urlsafe(TOKEN_BYTES) for person in people}
    building = folder.with_name(f".{folder.name}.{secrets.token_hex(4)}")
    try:
        _write(StudyFolder(building, founded, text, {person.id: person for person in people}, tokens), items)
        if folder.exists():
            folder.rmdir()
        os.replace(building, folder)
    except OSError as error:
        raise FormatError(out, f"cannot be made: {error.strerror}") from None
    finally:
        shutil.rmtree(building, ignore_errors=True)
    return open_study(out)


def _finished_consent(file: Path, design: StudyDesign) -> str:
    text = consent_text(file)
    if UNFINISHED in text and not design.pilot:
        raise FormatError(str(file), "is still the example's text; write your own, or set pilot = true for a trial")
    return text


def open_study(path: str | os.PathLike[str]) -> StudyFolder:
    """Open a study's folder.

    Raises:
        FormatError: If it is none, or the consent text or the layout was changed since it was made.
    """
    folder = Path(path)
    if not (folder / STUDY).is_file():
        raise FormatError(str(path), "is no study's folder; `ovita study new` makes one")
    founded = read_founded(folder / STUDY)
    text = consent_text(folder / CONSENT)
    if digest(text) != founded.consent_sha256:
        problem = "differs from the text the study was made with; another text is another study"
        raise FormatError(str(folder / CONSENT), problem)
    layout = folder / LAYOUT
    listed = parse_object(read_text(layout), str(layout)).get("participants")
    people: tuple[Participant, ...] = validated(tuple[Participant, ...], listed, str(layout))
    return StudyFolder(folder, founded, text, {person.id: person for person in people}, _tokens(folder / LINKS))


def address_of(token: str) -> str:
    """The path of a person's pages."""
    return f"/s/{token}"


def _write(study: StudyFolder, items: Sequence[StudyItem]) -> None:
    folder, people = study.path, tuple(study.participants.values())
    make_folder(folder, mode=0o700)
    for name in (ITEMS, PARTICIPANTS, SESSIONS):
        make_folder(folder / name, mode=0o700)
    atomic_write(folder / STUDY, written(study.founded))
    atomic_write(folder / CONSENT, study.consent + "\n")
    for i, item in enumerate(items, 1):
        atomic_write(folder / ITEMS / f"i{i:04d}.json", json.dumps(plain(item), ensure_ascii=False) + "\n")
    layout = json.dumps({"participants": plain(people)}, ensure_ascii=False, indent=1)
    atomic_write(folder / LAYOUT, layout + "\n")
    links = [[person.id, person.group, address_of(study.tokens[person.id])] for person in people]
    atomic_write(folder / LINKS, csv_text([["participant", "group", "path"], *links]))
    os.chmod(folder / LINKS, 0o600)


def _tokens(file: Path) -> dict[str, str]:
    rows = list(csv.DictReader(io.StringIO(read_text(file))))
    try:
        found = {row["participant"]: row["path"].removeprefix(address_of("")) for row in rows}
    except KeyError:
        raise FormatError(str(file), "the columns are participant, group and path") from None
    short = [name for name, token in found.items() if len(token) < TOKEN_BYTES]
    if short:
        raise FormatError(str(file), f"the link of {listing(short)} is too short to be secret")
    return found
