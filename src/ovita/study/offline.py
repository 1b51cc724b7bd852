"""A study without a server: one HTML file for each person, which keeps its answers and hands them over as a file."""

from __future__ import annotations

import hmac
import json
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ovita.errors import FormatError, RequestError
from ovita.io import atomic_write
from ovita.io.documents import validated
from ovita.io.files import Journal, make_folder
from ovita.study import pages
from ovita.study.answers import WITHDRAWN, StudyEvent, note, progress_of, withdraw
from ovita.study.assignment import Participant
from ovita.study.folder import StudyFolder
from ovita.study.questions import read_answers


@dataclass(frozen=True)
class Collected:
    """What came of a file with answers.

    Args:
        new: Answers that were not there yet.
        known: Answers to pages that were answered before; the first ones stay.
        withdrawn: Whether the file says that the person withdrew, so that all was deleted.
    """

    participant: str
    new: int = 0
    known: int = 0
    withdrawn: bool = False


def write_files(study: StudyFolder, out: str) -> tuple[Path, ...]:
    """Write each person's study as one file that loads nothing.

    Raises:
        RequestError: If the study has an adaptation phase, which needs a server.
        FormatError: If the files cannot be written.
    """
    if study.design.adapt.items:
        raise RequestError(
            "the adaptation phase needs a server, which computes what people say; serve the study without --static, or"
            " make one with items = 0 under [adapt]"
        )
    folder = make_folder(out)
    found = {folder / f"{person.id}.html": person for person in study.participants.values()}
    for file, person in found.items():
        atomic_write(file, _file(study, person))
    return tuple(found)


def collect(study: StudyFolder, file: str) -> Collected:
    """Take in a file that a person's page handed over; a file that is taken in twice changes nothing.

    Raises:
        FormatError: If it is no such file, belongs to another study or link, or holds answers that no page could give.
        RequestError: If the person withdrew.
    """
    lines = Journal(file).read()
    person = _owner(study, lines[:1], file)
    events = [_event(study, person, line, file, i) for i, line in enumerate(lines[1:], 2)]
    progress = progress_of(study, person)
    if progress.withdrawn:
        raise RequestError(f"{file}: {person.id} withdrew, so nothing is taken in; delete this file")
    said = {event.event for event in events}
    if WITHDRAWN in said:
        withdraw(study, person)
        return Collected(person.id, withdrawn=True)
    if "consent" not in said:
        raise FormatError(file, "holds no consent, so nothing is taken in; delete this file")
    have = {(event.event, event.page) for event in progress.events}
    counted: Counter[bool] = Counter()
    for event in events:
        key = event.event, event.page
        counted[key in have] += event.event == "answer"
        if key not in have:
            have.add(key)
            note(study, person, event)
    return Collected(person.id, counted[False], counted[True])


def _owner(study: StudyFolder, first: list[dict[str, Any]], file: str) -> Participant:
    head = first[0] if first else {}
    if head.get("study") != study.founded.id:
        raise FormatError(file, "holds no answers of this study; a person's page hands such a file over at its end")
    name, token = str(head.get("participant")), str(head.get("token"))
    if not hmac.compare_digest(study.tokens.get(name, "").encode(), token.encode()) or name not in study.participants:
        raise FormatError(file, "bears a secret that belongs to none of this study's people")
    return study.participants[name]


def _event(study: StudyFolder, person: Participant, line: dict[str, Any], file: str, number: int) -> StudyEvent:
    event: StudyEvent = validated(StudyEvent, line, file, f"line {number}")
    known = {page.id: page for page in person.pages}
    page = known.get(event.page)
    match event.event:
        case "consent" if event.consent_sha256 == study.founded.consent_sha256:
            return event
        case "withdrawn" | "shown" if page is not None or event.event == WITHDRAWN:
            return event
        case "answer" if page is not None and event.seconds >= 0.0:
            form = {name: str(value) for name, value in (event.values or {}).items()}
            values, missing = read_answers(page.kind, form, study.design.comments)
            if not missing:
                return StudyEvent("answer", event.when, page=page.id, values=values, seconds=event.seconds)
    raise FormatError(file, f"line {number} holds what no page of this person could give; nothing was taken in")


def _file(study: StudyFolder, person: Participant) -> str:
    parts = {"consent": pages.consent(study), "done": pages.handing_over(), "gone": pages.forgotten(person.id)}
    for page in person.pages:
        parts[page.id] = pages.page_of(study, person, page) + pages.footer(study)
    parts["done"] += pages.footer(study)
    about = {
        "study": study.founded.id,
        "participant": person.id,
        "token": study.tokens[person.id],
        "consent": study.founded.consent_sha256,
        "pages": [page.id for page in person.pages],
    }
    data = "\n".join(f'<template id="page-{name}">{part}</template>' for name, part in parts.items())
    text = json.dumps(about).replace("<", "\\u003c")
    data += f'\n<script type="application/json" id="about">{text}</script>\n'
    return pages.offline_document(study.design.title, data, pilot=study.design.pilot)
