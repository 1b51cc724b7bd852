"""What people answered: a file of events for each, of which only the first answer to a page counts."""

from __future__ import annotations

import datetime
import os
import random
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import chain
from typing import Any, ClassVar

from ovita.io.documents import validated
from ovita.io.files import Journal
from ovita.study.assignment import Participant, StudyPage
from ovita.study.folder import StudyFolder, now, open_study
from ovita.study.questions import PREFERENCE
from ovita.study.ratings import NONE, Rating


@dataclass(frozen=True)
class StudyEvent:
    """A line of a person's file.

    Args:
        event: "consent", "shown", "answer", "saying" and "said" (a turn of a conversation before and after the system
            answered), or "withdrawn".
        when: In UTC (ISO 8601).
        seconds: From when the page was first shown.
        turn: Which turn of the conversation, from 1.
        on: What it is about: "original" or "current".
        steps: Turns in force afterwards.
        of: Whose adapting is judged: a person's id and one of their pages, as "p07/s002".
    """

    __pydantic_config__: ClassVar = {"extra": "forbid"}

    event: str
    when: str
    page: str = ""
    values: Mapping[str, int | str] | None = None
    seconds: float = 0.0
    consent_sha256: str = ""
    turn: int = 0
    said: str = ""
    on: str = ""
    status: str = ""
    told: tuple[str, ...] = ()
    steps: int = 0
    of: str = ""

    def document(self) -> dict[str, Any]:
        """What is written: only what differs from nothing."""
        return {key: value for key, value in vars(self).items() if value not in ("", None, 0, 0.0, ())}


WITHDRAWN = "withdrawn"


@dataclass(frozen=True)
class StudyProgress:
    """How far a person is."""

    person: Participant
    events: tuple[StudyEvent, ...]

    @property
    def consented(self) -> bool:
        """Whether the person agreed to take part."""
        return any(event.event == "consent" for event in self.events)

    @property
    def withdrawn(self) -> bool:
        """Whether the person withdrew."""
        return any(event.event == WITHDRAWN for event in self.events)

    @property
    def answered(self) -> dict[str, StudyEvent]:
        """The first answer to each page."""
        found: dict[str, StudyEvent] = {}
        for event in self.events:
            if event.event == "answer":
                found.setdefault(event.page, event)
        return found

    @property
    def current(self) -> StudyPage | None:
        """The first page without an answer, or None at the end."""
        answered = self.answered
        return next((page for page in self.person.pages if page.id not in answered), None)

    def first_shown(self, page: str) -> str:
        """When a page was shown first, or ""."""
        return next((e.when for e in self.events if e.event == "shown" and e.page == page), "")

    def judged(self, page: str) -> str:
        """Whose adapting was last drawn for a page, or ""."""
        return next((e.of for e in reversed(self.events) if e.page == page and e.of), "")

    def turns(self, page: str, event: str = "said") -> tuple[StudyEvent, ...]:
        """The turns of the conversation on a page."""
        return tuple(e for e in self.events if e.event == event and e.page == page)


def progress_of(study: StudyFolder, person: Participant) -> StudyProgress:
    """Read how far a person is.

    Raises:
        FormatError: If the file is damaged.
    """
    file = study.answers_of(person.id)
    if not file.exists():
        return StudyProgress(person, ())
    events = Journal(file).read()
    lines = enumerate(events, 1)
    return StudyProgress(person, tuple(validated(StudyEvent, e, str(file), f"line {i}") for i, e in lines))


def note(study: StudyFolder, person: Participant, event: StudyEvent) -> None:
    """Write an event; it is on disk when this returns."""
    Journal(study.answers_of(person.id)).add(event.document())


def withdraw(study: StudyFolder, person: Participant) -> None:
    """Delete all that a person said and answered; that the link was given back stays."""
    for file in study.session_of(person.id, "").parent.glob(f"{person.id}-*"):
        file.unlink(missing_ok=True)
    Journal(study.answers_of(person.id)).rewrite([StudyEvent(WITHDRAWN, now()).document()])


def seconds_between(start: str, end: str) -> float:
    """The time between two moments in ISO 8601 [s]; 0 where one is missing."""
    try:
        return max((datetime.datetime.fromisoformat(end) - datetime.datetime.fromisoformat(start)).total_seconds(), 0.0)
    except ValueError:
        return 0.0


def ratings(folder: str | os.PathLike[str]) -> tuple[Rating, ...]:
    """Every answer of a study by participant and position; those who withdrew left none.

    Raises:
        FormatError: If the folder is no study, or a file is damaged.
    """
    study = open_study(folder)
    return tuple(rating for person in study.participants.values() for rating in _of(study, progress_of(study, person)))


def _of(study: StudyFolder, progress: StudyProgress) -> Iterator[Rating]:
    person, answered = progress.person, progress.answered
    if progress.withdrawn or not progress.consented:
        return
    for page in [page for page in person.pages if page.id in answered]:
        event, adapter, item = answered[page.id], "", page.item
        if page.kind == "judge" and event.values:
            other, theirs = work_of(study, event.of)
            adapter, item = other.id, theirs.item
        for question, given in (event.values or {}).items():
            yield Rating(
                person.id, person.group, page.phase, item, _condition(study, page), page.explanation, question,
                _value(question, given, page), page.position, event.seconds, event.when, study.design.pilot, adapter,
            )  # fmt: skip


def _condition(study: StudyFolder, page: StudyPage) -> str:
    if page.kind in ("adapt", "judge"):
        return f"{study.design.adapt.writer} with feedback"
    return "|".join(page.conditions)


def work_of(study: StudyFolder, of: str) -> tuple[Participant, StudyPage]:
    """Who adapted what is judged, and on which page; `of` is "p07/s002"."""
    name, _, page_id = of.partition("/")
    person = study.participants[name]
    return person, next(page for page in person.pages if page.id == page_id)


def _value(question: str, given: int | str, page: StudyPage) -> float | str:
    if question == PREFERENCE:
        return {"left": page.conditions[0], "right": page.conditions[-1]}.get(str(given), NONE)
    if question == "attention":
        return float(given == page.expected)
    return given if isinstance(given, str) else float(given)


def draw(study: StudyFolder, person: Participant) -> str:
    """Draw the result of another person for this one to judge: "p07/s002", or "" while there is none.

    Those that fewest people were shown come first, among them items that this person has not seen rated. Nobody judges
    an item that they adapted themselves, and nobody judges a result twice.
    """
    everybody = {other.id: progress_of(study, other) for other in study.participants.values()}
    events = chain.from_iterable(progress.events for progress in everybody.values())
    seen = Counter(event.of for event in events if event.event == "shown")
    had = {event.of for event in everybody.pop(person.id).events}
    adapted = chain.from_iterable(map(_adapted, everybody.values()))
    left = sorted((of, item) for of, item in adapted if of not in had and item not in person.adapted)
    if not left:
        return ""
    random.Random(f"ovita cross-rating {study.design.seed} {person.id} {len(had)}").shuffle(left)
    return min(left, key=lambda lot: (seen[lot[0]], lot[1] in person.rated))[0]


def _adapted(progress: StudyProgress) -> Iterator[tuple[str, str]]:
    """What a person adapted and did not withdraw: "p07/s002", and the item."""
    answered = progress.answered
    for page in () if progress.withdrawn else progress.person.pages:
        if page.kind == "adapt" and page.id in answered:
            yield f"{progress.person.id}/{page.id}", page.item


def whose(study: StudyFolder, of: str) -> tuple[StudyProgress, StudyPage]:
    """The person whose result it is, as far as they are, and the page on which they adapted."""
    person, page = work_of(study, of)
    return progress_of(study, person), page
