"""What a link shows, and what happens to what its page sends; every answer is on disk before it counts."""

from __future__ import annotations

import threading
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass

from ovita.request import FeedbackOn
from ovita.study import pages
from ovita.study.adapting import Conversations
from ovita.study.answers import StudyEvent, StudyProgress, draw, note, progress_of, seconds_between, whose, withdraw
from ovita.study.assignment import Participant, StudyPage
from ovita.study.folder import StudyFolder, now
from ovita.study.questions import COMMENT, read_answers


@dataclass(frozen=True)
class DeskAnswer:
    """What goes back to a browser: a page, or, where `page` is "", the advice to fetch the current one."""

    page: str = ""
    status: int = 200


class StudyDesk:
    """A study that people take part in; one request of a person at a time, those of many at once."""

    def __init__(self, study: StudyFolder) -> None:
        self.study = study
        self._conversations = Conversations(study, study.founded.names)
        self._locks: defaultdict[str, threading.Lock] = defaultdict(threading.Lock)
        self._guard = threading.Lock()

    def show(self, token: str) -> DeskAnswer:
        """The page that a link leads to now."""
        person = self.study.whose(token)
        if person is None:
            return self.unknown()
        with self._lock_of(person):
            return DeskAnswer(self._current(person))

    def take(self, token: str, form: Mapping[str, str]) -> DeskAnswer:
        """Take what a page sends. A page that was answered before keeps its first answer."""
        person = self.study.whose(token)
        if person is None:
            return self.unknown()
        with self._lock_of(person):
            progress = progress_of(self.study, person)
            if progress.withdrawn:
                return DeskAnswer()
            match form.get("do", ""):
                case "withdraw":
                    self._conversations.forget(person)
                    withdraw(self.study, person)
                case "consent" if not progress.consented:
                    return self._consent(person, form)
                case "answer" if progress.consented:
                    return self._answer(progress, form)
                case "say" if progress.consented:
                    self._say(progress, form)
            return DeskAnswer()

    def unknown(self) -> DeskAnswer:
        """What those see who have no link."""
        text = "Please open the link that you were given, whole and as it is."
        return DeskAnswer(self._document(pages.message("This is no link of a study", text), drawn=False), 404)

    def _lock_of(self, person: Participant) -> threading.Lock:
        with self._guard:
            return self._locks[person.id]

    def _current(self, person: Participant) -> str:
        progress = progress_of(self.study, person)
        if progress.withdrawn:
            return self._document(pages.message(*pages.GONE), drawn=False)
        if not progress.consented:
            return self._document(pages.consent(self.study), drawn=False)
        page = progress.current
        while page is not None and page.kind == "judge" and not self._has_lot(progress, page):
            note(self.study, person, StudyEvent("answer", now(), page=page.id, values={}))
            progress = progress_of(self.study, person)
            page = progress.current
        if page is None:
            return self._document(pages.message(*pages.FAREWELL) + pages.footer(self.study), drawn=False)
        if not progress.first_shown(page.id):
            note(self.study, person, StudyEvent("shown", now(), page=page.id))
        if page.kind == "judge" or (page.kind == "adapt" and self._conversations.settled(progress, page)):
            progress = progress_of(self.study, person)
        return self._drawn(progress, page, {}, ())

    def _drawn(
        self, progress: StudyProgress, page: StudyPage, given: Mapping[str, str], missing: tuple[str, ...]
    ) -> str:
        talk, outcome = None, None
        if page.kind == "adapt":
            talk = self._conversations.current(progress, page), progress.turns(page.id)
        elif page.kind == "judge":
            outcome = self._conversations.outcome(*whose(self.study, progress.judged(page.id)))
        body = pages.page_of(self.study, progress.person, page, given, missing, talk=talk, outcome=outcome)
        return self._document(body + pages.footer(self.study), drawn=page.kind not in ("introduction", "closing"))

    def _has_lot(self, progress: StudyProgress, page: StudyPage) -> bool:
        """Whether there is a result of another person for a page; it is drawn, and noted, where none was."""
        of = progress.judged(page.id)
        if of and not whose(self.study, of)[0].withdrawn:
            return True
        with self._guard:
            of = draw(self.study, progress.person)
            if of:
                note(self.study, progress.person, StudyEvent("shown", now(), page=page.id, of=of))
        return bool(of)

    def _document(self, body: str, *, drawn: bool) -> str:
        return pages.document(self.study.design.title, body, pilot=self.study.design.pilot, drawn=drawn)

    def _consent(self, person: Participant, form: Mapping[str, str]) -> DeskAnswer:
        if form.get("agree") != "yes":
            return DeskAnswer(self._document(pages.consent(self.study, missing=True), drawn=False))
        note(self.study, person, StudyEvent("consent", now(), consent_sha256=self.study.founded.consent_sha256))
        return DeskAnswer()

    def _answer(self, progress: StudyProgress, form: Mapping[str, str]) -> DeskAnswer:
        page = progress.current
        of = progress.judged(page.id) if page else ""
        if page is None or form.get("page") != page.id or (page.kind == "judge" and not of):
            return DeskAnswer()
        values, missing = read_answers(page.kind, form, self.study.design.comments)
        if missing:
            given = {name: str(value) for name, value in values.items()} | {COMMENT: form.get(COMMENT, "")}
            return DeskAnswer(self._drawn(progress, page, given, missing))
        when = now()
        seconds = seconds_between(progress.first_shown(page.id), when)
        answer = StudyEvent("answer", when, page=page.id, values=values, seconds=seconds, of=of)
        note(self.study, progress.person, answer)
        return DeskAnswer()

    def _say(self, progress: StudyProgress, form: Mapping[str, str]) -> None:
        page = progress.current
        if page is None or page.kind != "adapt" or form.get("page") != page.id or not form.get("said", "").strip():
            return
        self._conversations.settled(progress, page)
        progress = progress_of(self.study, progress.person)
        turn = len(progress.turns(page.id)) + 1
        if form.get("turn") == str(turn) and turn <= self.study.design.adapt.turns:
            on: FeedbackOn = "original" if form.get("on") == "original" else "current"
            self._conversations.say(progress, page, form["said"], on)
