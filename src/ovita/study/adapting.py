"""The adaptation phase: a conversation of one person about one item, kept on disk turn by turn."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Sequence
from dataclasses import dataclass, replace

from ovita.dialogue.session import Session
from ovita.errors import OvitaError, RobotError
from ovita.io import load_robot, scene_from_dict
from ovita.io.waypoints import trajectory_from_rows
from ovita.paths.robot import UNLIMITED
from ovita.paths.trajectory import Trajectory
from ovita.request import FeedbackOn
from ovita.result import Adaptation
from ovita.study.answers import StudyEvent, StudyProgress, note
from ovita.study.assignment import Participant, StudyPage
from ovita.study.folder import StudyFolder, now
from ovita.study.material import StudyItem, shown

LONGEST = 500
"""Most characters of a sentence."""

FAILED = "That did not work. Please say it in other words."
"""What a person reads where the system failed; why it did is not for their eyes."""


@dataclass(frozen=True)
class AdaptedByPerson:
    """What others judge of a person's adapting; the words that led there stay with that person.

    Args:
        path: As the person left it.
        changed: Whether it differs from the item's.
        told: What the system says of it, a line each.
    """

    item: StudyItem
    path: Trajectory
    changed: bool
    told: tuple[str, ...]


class Conversations:
    """The conversations of a study that are open in this process; each is used under its person's lock.

    After a kill they are taken up from their journals. A turn is noted before the system is asked and after it
    answered, so one that was cut off is neither lost nor done twice.
    """

    def __init__(self, study: StudyFolder, secret: Sequence[str] = ()) -> None:
        self.study = study
        self._secret = (*secret, study.design.adapt.writer)
        self._open: dict[tuple[str, str], Session] = {}
        self._lock = threading.Lock()

    def current(self, progress: StudyProgress, page: StudyPage) -> Trajectory:
        """The path of a page as it stands."""
        return self._session(progress, page).current

    def outcome(self, progress: StudyProgress, page: StudyPage) -> AdaptedByPerson:
        """What a person's conversation came to, as others see it."""
        session = self._session(progress, page)
        last = session.adaptation if session.steps else None
        lines = (last.explanation.splitlines() or last.plan) if last is not None else ()
        said = [turn.said for turn in progress.turns(page.id)]
        told = shown([line for line in lines if not any(words in line for words in said)], self._secret)
        return AdaptedByPerson(self.study.items[page.item], session.current, last is not None, told)

    def settled(self, progress: StudyProgress, page: StudyPage) -> bool:
        """Note the answer of a turn that was done, but cut off before its answer was noted; say whether it was so."""
        asked, said = progress.turns(page.id, "saying"), progress.turns(page.id)
        if len(asked) <= len(said):
            return False
        session = self._session(progress, page)
        done = len(session.steps) > (said[-1].steps if said else 0)
        self._answered(progress.person, page, asked[-1], session, repeat=not done)
        return True

    def say(self, progress: StudyProgress, page: StudyPage, said: str, on: FeedbackOn) -> None:
        """Let the system do what a person says, and note both."""
        session = self._session(progress, page)
        turn = len(progress.turns(page.id)) + 1
        saying = StudyEvent("saying", now(), page=page.id, turn=turn, said=said.strip()[:LONGEST], on=on)
        note(self.study, progress.person, saying)
        self._answered(progress.person, page, saying, session, repeat=True)

    def forget(self, person: Participant) -> None:
        """Close the conversations of a person who withdrew."""
        with self._lock:
            for key in [key for key in self._open if key[0] == person.id]:
                del self._open[key]

    def _answered(
        self, person: Participant, page: StudyPage, saying: StudyEvent, session: Session, *, repeat: bool
    ) -> None:
        """Note what the system answered; `repeat` asks it, else its last answer stands."""
        said = replace(saying, event="said", status="failed", told=(FAILED,))
        with contextlib.suppress(OvitaError):
            result = session.adaptation
            if repeat:
                result = session.say(said.said, on="original" if said.on == "original" else "current")
            if result is not None:
                said = replace(said, status=result.status, told=self._told(result, page))
        note(self.study, person, replace(said, when=now(), steps=len(session.steps)))

    def _told(self, result: Adaptation, page: StudyPage) -> tuple[str, ...]:
        """What a person reads: questions and proposals always, the rest where explanations are shown."""
        lines = _unanswered(result) or ["Done; look at the red path.", result.taken, *result.cautions]
        if page.explanation and result.usable:
            lines += [result.message, *(result.explanation.splitlines() or result.plan)]
        return shown(lines, self._secret)

    def _session(self, progress: StudyProgress, page: StudyPage) -> Session:
        key = progress.person.id, page.id
        with self._lock:
            found = self._open.get(key)
        if found is None:
            found = self._begun(progress, page)
            with self._lock:
                self._open[key] = found
        return found

    def _begun(self, progress: StudyProgress, page: StudyPage) -> Session:
        file = self.study.session_of(progress.person.id, page.id)
        writer = self.study.design.adapt.writer
        if not file.exists():
            session = _new(self.study.items[page.item], writer)
            session.keep(str(file))
            return session
        session = Session.resume(str(file), writer=writer)
        said = progress.turns(page.id)
        if said and said[-1].status in ("needs_confirmation", "needs_clarification"):
            session.say(said[-1].said, on="original" if said[-1].on == "original" else "current")
        return session


def _new(item: StudyItem, writer: str) -> Session:
    try:
        robot = load_robot(item.robot)
    except RobotError:
        robot = UNLIMITED
    return Session(trajectory_from_rows(item.original), scene_from_dict(item.scene), robot, writer)


def _unanswered(result: Adaptation) -> list[str]:
    """What a person reads where nothing was done; hints for those who run the system are left out."""
    if result.usable:
        return []
    if result.question:
        return [result.question]
    if result.proposal is not None:
        return [result.message]
    if result.status == "not_understood" and result.unplaced:
        words = ", ".join(f"'{word}'" for word in result.unplaced)
        return [f"I did not understand {words}. Please say it in other words."]
    return [FAILED]
