"""One turn of a session: what is said is feedback on the turns before it, or an instruction for the chain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from threading import Event

from ovita.chain import adapt, rerun
from ovita.dialogue.feedback import Past, Resolution, answer, clarified, resolve, together
from ovita.dialogue.history import ROOT, History, Kind, Situation, Step
from ovita.errors import PolicyError
from ovita.measure import compare
from ovita.paths.trajectory import Trajectory
from ovita.request import FeedbackOn, Request, Turn
from ovita.result import Adaptation
from ovita.writers.base import PolicyWriter, WriterInfo
from ovita.writers.generate import Isolation
from ovita.writers.progress import Progress

CODE_TURNS = 2
"""How many of the last turns a writer is shown the code of."""

OFFLINE = ("auto", "builtin")
"""Writers that read every instruction themselves first, so that feedback may also become other words for them."""


@dataclass(frozen=True)
class Heard:
    """What became of a sentence.

    Args:
        result: The adaptation.
        kind: How the turn came about, or None where there is none.
        on: Which trajectory it is about.
        turn: The turn to go to instead of adding one, or None.
        asked: The sentence that led to a question, or "".
    """

    result: Adaptation
    kind: Kind | None = "said"
    on: FeedbackOn = "current"
    turn: int | None = None
    asked: str = ""


@dataclass(frozen=True)
class Listener:
    """Everything that a sentence is heard with.

    Args:
        history: The turns so far.
        first: The situation before the first turn.
        now: The situation as it is.
        writer: A policy writer or its name.
        isolation: How policies must be isolated.
        asked: The sentence that led to a question right before, or "".
        progress: Told what goes on.
        cancel: Ends the writing once it is set.
    """

    history: History
    first: Situation
    now: Situation
    writer: PolicyWriter | str
    isolation: Isolation = "auto"
    asked: str = ""
    progress: Progress | None = None
    cancel: Event | None = None

    @property
    def steps(self) -> list[Step]:
        """The steps in force, oldest first."""
        return [self.history.steps[i] for i in self.history.path()]

    @property
    def current(self) -> Trajectory:
        """The trajectory as it stands."""
        steps = self.steps
        return steps[-1].adaptation.adapted if steps else self.now.original

    def hear(self, said: str, on: FeedbackOn) -> Heard:
        """Resolve a sentence as feedback, or adapt by it as an instruction.

        Raises:
            InputError: If the instruction is empty or too long.
        """
        turns = in_force(self.steps)
        past = [turn.past for turn in turns]
        meant = clarified(self.asked, said, self.now.scene) if self.asked else ""
        if meant:
            return self._instructed(meant, on, past)
        found = self._resolved(said, past)
        if found is None:
            return self._instructed(said, on, past)
        if found.kind in ("undo", "redo", "restart"):
            return self._moved(said, found)
        if found.kind in ("accept", "ask"):
            return self._unchanged(said, found, found.kind == "ask")
        try:
            return self._changed(found, turns[-1].adaptation, past)
        except PolicyError as error:
            failed = self._said(said, self.current, found.taken)
            return Heard(replace(failed, status="failed", error=str(error), explanation=str(error)))

    def _resolved(self, said: str, past: Sequence[Past]) -> Resolution | None:
        """What a sentence comes to as feedback; with a language model only what is certain."""
        if not self.history.steps:
            return None
        found = answer(self.asked, said, past, self.now.scene, self.current) if self.asked else None
        found = found or resolve(said, past, self.now.scene, self.current)
        name = self.writer if isinstance(self.writer, str) else self.writer.name
        return found if found is not None and (found.certain or name in OFFLINE) else None

    def _instructed(self, said: str, on: FeedbackOn, past: Sequence[Past]) -> Heard:
        """An instruction for the chain; on the original, together with everything said before."""
        wording = together(past, said, self.now.scene, self.now.original) if on == "original" else None
        if wording is None:
            result = self._adapt(said, self.current, past)  # which is what all turns before made of the original
            on = "current"
        else:
            result = self._tuned(self._adapt(wording.instruction, self.now.original, past), wording.values)
        return Heard(result, on=on, asked=said if result.status == "needs_clarification" else "")

    def _changed(self, found: Resolution, last: Adaptation, past: Sequence[Past]) -> Heard:
        """Other knobs, other words, or the last policy once more."""
        if found.kind == "tune":
            return Heard(_noted(self._rerun(last, found.values), found), "knobs")
        if found.kind == "again":
            return Heard(_noted(self._rerun(replace(last, original=self.current), {}), found))
        start = {"start": last.original, "current": self.current, "original": self.now.original}[found.begins]
        result = self._tuned(self._adapt(found.instruction, start, past), found.values)
        kind: Kind = "reworded" if found.begins == "start" else "said"
        return Heard(_noted(result, found), kind, "original" if found.begins == "original" else "current")

    def _adapt(self, instruction: str, start: Trajectory, past: Sequence[Past]) -> Adaptation:
        turns = tuple(
            Turn(a.instruction, "current", a.plan, a.code if i >= len(past) - CODE_TURNS else "")
            for i, a in enumerate(turn.adaptation for turn in in_force(self.steps))
        )
        return adapt(
            Request(instruction, start, self.now.scene, self.now.robot, turns),
            writer=self.writer,
            constraints=self.now.constraints,
            isolation=self.isolation,
            progress=self.progress,
            cancel=self.cancel,
        )

    def _tuned(self, result: Adaptation, values: Mapping[str, float | int]) -> Adaptation:
        """A result with knobs turned as they were turned before, where its policy still has them."""
        known = {p.name: p.value for p in result.parameters}
        kept = {name: value for name, value in values.items() if name in known and known[name] != value}
        return self._rerun(result, kept) if kept and result.usable else result

    def _rerun(self, adaptation: Adaptation, values: Mapping[str, float | int]) -> Adaptation:
        asked = replace(adaptation, scene=self.now.scene, robot=self.now.robot)
        return rerun(asked, values, constraints=self.now.constraints, isolation=self.isolation)

    def _moved(self, said: str, found: Resolution) -> Heard:
        """A turn taken back or brought back."""
        turn: int | None = ROOT
        if found.kind == "redo":
            turn = self.history.forth()
        elif found.kind == "undo":
            path = self.history.path()
            turn = path[-found.steps - 1] if found.steps < len(path) else ROOT
        if turn is None:
            return Heard(self._said(said, self.current, "there is nothing to bring back"), kind=None)
        after = self.first.original if turn == ROOT else self.history.steps[turn].adaptation.adapted
        return Heard(self._said(said, after, found.taken), turn=turn)

    def _unchanged(self, said: str, found: Resolution, ask: bool) -> Heard:
        result = self._said(said, self.current, found.taken)
        if not ask:
            return Heard(result, kind=None)
        asking = replace(result, status="needs_clarification", question=found.question, explanation=found.question)
        return Heard(asking, asked=said)

    def _said(self, said: str, after: Trajectory, taken: str) -> Adaptation:
        """An answer without a policy."""
        sentence = taken[:1].upper() + taken[1:] + "."
        return Adaptation(
            said,
            "done",
            self.current,
            after,
            scene=self.now.scene,
            robot=self.now.robot,
            assumptions=(taken,) if taken else (),
            explanation=sentence,
            changes=compare(self.current, after, self.now.scene),
            writer=WriterInfo("feedback", reason="it was feedback"),
        )


@dataclass(frozen=True)
class _Turn:
    """A turn as it stands, and how many steps it took."""

    adaptation: Adaptation
    steps: int = 1

    @property
    def past(self) -> Past:
        """The turn as feedback sees it."""
        a = self.adaptation
        return Past(a.instruction, a.original, a.parameters, self.steps)


def in_force(steps: Sequence[Step]) -> list[_Turn]:
    """The turns that make the current trajectory of the original, each with the corrections made to it."""
    turns: list[_Turn] = []
    for step in steps:
        if step.kind in ("said", "opened"):
            before = sum(turn.steps for turn in turns)
            alone = step.feedback_on == "original"
            turns = [_Turn(step.adaptation, before + 1)] if alone else [*turns, _Turn(step.adaptation)]
        elif turns:
            turns[-1] = _Turn(step.adaptation, turns[-1].steps + 1)
        elif step.adaptation.instruction:
            turns = [_Turn(step.adaptation)]
    return turns


def _noted(result: Adaptation, found: Resolution) -> Adaptation:
    """A result that says what the words were taken to mean."""
    sentence = found.taken[:1].upper() + found.taken[1:] + "."
    return replace(
        result,
        assumptions=(found.taken, *(text for text in result.assumptions if not text.startswith("took "))),
        explanation=f"{sentence}\n{result.explanation}",
    )
