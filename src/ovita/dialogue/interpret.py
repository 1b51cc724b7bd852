"""Interpret an utterance as feedback on earlier turns or as a new instruction for the chain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from threading import Event

from ovita.chain import adapt, rerun
from ovita.dialogue.feedback import Resolution, answer, clarified, resolve, together
from ovita.dialogue.history import ROOT, History, Kind, Situation, Step, in_force
from ovita.dialogue.standing import KEEP_IT, Loss, lost
from ovita.errors import PolicyError
from ovita.measure import compare
from ovita.paths.trajectory import Trajectory
from ovita.request import FeedbackOn, Request, Turn
from ovita.result import Adaptation
from ovita.text import sentence
from ovita.writers.base import PolicyWriter, Progress, WriterInfo
from ovita.writers.generate import Isolation

CODE_TURNS = 2
"""How many of the last turns a writer is shown the code of."""

OFFLINE = ("auto", "builtin")
"""Writers that read every instruction themselves first, so that feedback may also become other words for them."""


def interpret(said: str, on: FeedbackOn, state: DialogueState) -> Interpretation:
    """Resolve an utterance as feedback on the turns before it, or adapt by it as an instruction.

    Raises:
        InputError: If the instruction is empty or too long.
    """
    past = state.turns
    losses = state.losses() if said.strip(" ,.!").lower() in KEEP_IT else []
    if losses:
        return state._restored(said, losses)
    meant = clarified(state.asked, said, state.now.scene) if state.asked else ""
    if meant:
        return state._instructed(meant, on, past)
    found = state._resolved(said, past)
    if found is None:
        return state._instructed(said, on, past)
    if found.kind in ("undo", "redo", "restart"):
        return state._moved(said, found)
    if found.kind in ("accept", "ask"):
        return state._unchanged(said, found, found.kind == "ask")
    try:
        return state._changed(found, state.steps[-1].adaptation, past)
    except PolicyError as error:
        failed = state._said(said, state.current, found.taken)
        return Interpretation(replace(failed, status="failed", error=str(error), explanation=str(error)))


@dataclass(frozen=True)
class Interpretation:
    """What an utterance does to a session.

    Args:
        result: The adaptation, or an answer without a policy.
        kind: How the step came about, or None if it adds none.
        on: Which trajectory it is about.
        goto: The step to go to instead of adding one, or None.
        asked: The utterance that led to a question, or "".
    """

    result: Adaptation
    kind: Kind | None = "said"
    on: FeedbackOn = "current"
    goto: int | None = None
    asked: str = ""


@dataclass(frozen=True)
class DialogueState:
    """What an utterance is interpreted against.

    Args:
        history: The steps so far.
        first: The situation before the first step.
        now: The situation as it is.
        writer: A policy writer or its name.
        isolation: How policies must be isolated.
        asked: The utterance that led to a question right before, or "".
        progress: Called with a short line at every stage.
        cancel: Ends the writing once it is set.
    """

    history: History
    first: Situation
    now: Situation
    writer: PolicyWriter | str
    isolation: Isolation = "strict"
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

    @property
    def turns(self) -> list[Turn]:
        """The turns in force, oldest first."""
        turns = in_force(self.steps)
        shown = len(turns) - CODE_TURNS
        return [
            Turn(
                a.instruction,
                a.original,
                a.parameters,
                count,
                plan=a.plan,
                code=a.code if i >= shown else "",
                contacts=a.contacts,
            )
            for i, (a, count) in enumerate((step.adaptation, count) for step, count in turns)
        ]

    def losses(self) -> list[Loss]:
        """The postconditions of earlier turns that the last step lost."""
        if not self.steps or not self.steps[-1].adaptation.lost:
            return []
        before = self.steps[-2].adaptation.adapted if len(self.steps) > 1 else self.now.original
        turns = [step.adaptation for step, _ in in_force(self.steps)]
        parent = self.history.situation(self.history.parents[self.history.head], self.first)
        return lost(turns[:-1], before, turns[-1], scene=parent.scene)

    def _resolved(self, said: str, past: Sequence[Turn]) -> Resolution | None:
        """Resolve an utterance as feedback; with a language model only if certain."""
        if not self.history.steps:
            return None
        found = answer(self.asked, said, past, self.now.scene, self.current) if self.asked else None
        found = found or resolve(said, past, self.now.scene, self.current)
        name = self.writer if isinstance(self.writer, str) else self.writer.name
        return found if found is not None and (found.certain or name in OFFLINE) else None

    def _instructed(self, said: str, on: FeedbackOn, past: Sequence[Turn]) -> Interpretation:
        """An instruction for the chain; on the original it includes all earlier utterances."""
        wording = together(past, said, self.now.scene, self.now.original) if on == "original" else None
        if wording is None:
            result = self._adapt(said, self.current, past)  # which is what all turns before made of the original
            on = "current"
        else:
            result = self._tuned(self._adapt(wording.instruction, self.now.original, past), wording.values)
        return Interpretation(result, on=on, asked=said if result.status == "needs_clarification" else "")

    def _restored(self, said: str, losses: Sequence[Loss]) -> Interpretation:
        """Make postconditions hold again that the last step lost: the turns that promised them are run once more."""
        result: Adaptation | None = None
        for loss in losses:
            result = self._rerun(loss.restoring(result.adapted if result else self.current), {})
        assert result is not None
        words = "; ".join(dict.fromkeys(loss.turn.instruction for loss in losses))
        return Interpretation(_noted(result, Resolution("again", f"took {said!r} as: {words}, once more")))

    def _changed(self, found: Resolution, last: Adaptation, past: Sequence[Turn]) -> Interpretation:
        """Other knobs, other words, or the last policy once more."""
        if found.kind == "tune":
            return Interpretation(_noted(self._rerun(last, found.values), found), "knobs")
        if found.kind == "again":
            return Interpretation(_noted(self._rerun(replace(last, original=self.current), {}), found))
        start = {"start": last.original, "current": self.current, "original": self.now.original}[found.begins]
        result = self._tuned(self._adapt(found.instruction, start, past), found.values)
        kind: Kind = "reworded" if found.begins == "start" else "said"
        return Interpretation(_noted(result, found), kind, "original" if found.begins == "original" else "current")

    def _adapt(self, instruction: str, start: Trajectory, past: Sequence[Turn]) -> Adaptation:
        return adapt(
            Request(instruction, start, self.now.scene, self.now.robot, tuple(past)),
            writer=self.writer,
            constraints=self.now.constraints,
            isolation=self.isolation,
            progress=self.progress,
            cancel=self.cancel,
        )

    def _tuned(self, result: Adaptation, values: Mapping[str, float | int]) -> Adaptation:
        """A result with earlier tuned values for the parameters it still has."""
        if result.proposal is not None:
            return replace(result, proposal=self._tuned(result.proposal, values))
        known = {p.name: p.value for p in result.parameters}
        kept = {name: value for name, value in values.items() if name in known and known[name] != value}
        return self._rerun(result, kept) if kept and result.usable else result

    def _rerun(self, adaptation: Adaptation, values: Mapping[str, float | int]) -> Adaptation:
        asked = replace(adaptation, scene=self.now.scene, robot=self.now.robot)
        return rerun(asked, values, constraints=self.now.constraints, isolation=self.isolation)

    def _moved(self, said: str, found: Resolution) -> Interpretation:
        """A turn taken back or brought back."""
        turn: int | None = ROOT
        if found.kind == "redo":
            turn = self.history.forth()
        elif found.kind == "undo":
            path = self.history.path()
            turn = path[-found.steps - 1] if found.steps < len(path) else ROOT
        if turn is None:
            return Interpretation(self._said(said, self.current, "there is nothing to bring back"), kind=None)
        after = self.first.original if turn == ROOT else self.history.steps[turn].adaptation.adapted
        return Interpretation(self._said(said, after, found.taken), goto=turn)

    def _unchanged(self, said: str, found: Resolution, ask: bool) -> Interpretation:
        result = self._said(said, self.current, found.taken)
        if not ask:
            return Interpretation(result, kind=None)
        asking = replace(result, status="needs_clarification", question=found.question, explanation=found.question)
        return Interpretation(asking, asked=said)

    def _said(self, said: str, after: Trajectory, taken: str) -> Adaptation:
        """An answer without a policy."""
        return Adaptation(
            said,
            "done",
            self.current,
            after,
            scene=self.now.scene,
            robot=self.now.robot,
            taken=taken,
            explanation=sentence(taken),
            changes=compare(self.current, after, self.now.scene),
            writer=WriterInfo("feedback", reason="it was feedback"),
        )


def _noted(result: Adaptation, found: Resolution) -> Adaptation:
    """A result with its interpretation noted."""
    return replace(result, taken=found.taken, explanation=f"{sentence(found.taken)}\n{result.explanation}")
