"""Interpret an utterance as feedback on earlier turns or as a new instruction for the chain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from ovita.dialogue.feedback import Resolution, answer, clarified, resolve, together
from ovita.dialogue.history import ROOT, Kind, in_force
from ovita.dialogue.reframing import OFFLINE, DialogueState, Interpretation, respond
from ovita.dialogue.standing import KEEP_IT
from ovita.errors import PolicyError
from ovita.request import FeedbackOn, Turn
from ovita.result import Adaptation
from ovita.text import sentence


def interpret(said: str, on: FeedbackOn, state: DialogueState) -> Interpretation:
    """Resolve an utterance as feedback on the turns before it, or adapt by it as an instruction.

    Turns that keep their frames are edited as frames, the others in their words.

    Raises:
        InputError: If the instruction is empty or too long.
    """
    turns = in_force(state.steps)
    if turns and all(step.adaptation.frames for step, _ in turns):
        return respond(said, on, state)
    return _in_words(said, on, _Wording(**vars(state)))


def _in_words(said: str, on: FeedbackOn, state: _Wording) -> Interpretation:
    past = state.turns
    losses = state.losses() if said.strip(" ,.!").lower() in KEEP_IT else []
    if losses:
        return state._restored(said, losses)
    meant = clarified(state.asked, said, state.now.scene) if state.asked else ""
    if meant:
        return state._by_words(meant, on, past)
    found = state._resolved(said, past)
    if found is None:
        return state._declined(said) or state._by_words(said, on, past)
    if found.kind in ("undo", "redo", "restart"):
        return state._gone(said, found)
    if found.kind in ("accept", "ask"):
        return state._unchanged(said, found, found.kind == "ask")
    try:
        return state._changed(found, state.steps[-1].adaptation)
    except PolicyError as error:
        failed = state._said(said, state.current, found.taken)
        return Interpretation(replace(failed, status="failed", error=str(error), explanation=str(error)))


@dataclass(frozen=True)
class _Wording(DialogueState):
    """A dialogue whose turns are edited in their words."""

    def _resolved(self, said: str, past: Sequence[Turn]) -> Resolution | None:
        """Resolve an utterance as feedback; with a language model only if certain."""
        if not self.history.steps:
            return None
        found = answer(self.asked, said, past, self.now.scene, self.current) if self.asked else None
        found = found or resolve(said, past, self.now.scene, self.current)
        name = self.writer if isinstance(self.writer, str) else self.writer.name
        return found if found is not None and (found.certain or name in OFFLINE) else None

    def _by_words(self, said: str, on: FeedbackOn, past: Sequence[Turn]) -> Interpretation:
        """An instruction for the chain; on the original it includes all earlier utterances."""
        wording = together(past, said, self.now.scene, self.now.original) if on == "original" else None
        if wording is None:
            result = self._adapt(said, self.current)  # which is what all turns before made of the original
            on = "current"
        else:
            result = self._tuned(self._adapt(wording.instruction, self.now.original), wording.values)
        return Interpretation(result, on=on, asked=said if result.status == "needs_clarification" else "")

    def _changed(self, found: Resolution, last: Adaptation) -> Interpretation:
        """Other knobs, other words, or the last policy once more."""
        if found.kind == "tune":
            return Interpretation(_taken(self._rerun(last, found.values), found), "knobs")
        if found.kind == "again":
            return Interpretation(_taken(self._rerun(replace(last, original=self.current), {}), found))
        start = {"start": last.original, "current": self.current, "original": self.now.original}[found.begins]
        result = self._tuned(self._adapt(found.instruction, start), found.values)
        kind: Kind = "reworded" if found.begins == "start" else "said"
        return Interpretation(_taken(result, found), kind, "original" if found.begins == "original" else "current")

    def _tuned(self, result: Adaptation, values: Mapping[str, float | int]) -> Adaptation:
        """A result with earlier tuned values for the parameters it still has."""
        if result.proposal is not None:
            return replace(result, proposal=self._tuned(result.proposal, values))
        known = {p.name: p.value for p in result.parameters}
        kept = {name: value for name, value in values.items() if name in known and known[name] != value}
        return self._rerun(result, kept) if kept and result.usable else result

    def _gone(self, said: str, found: Resolution) -> Interpretation:
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


def _taken(result: Adaptation, found: Resolution) -> Adaptation:
    """A result with its interpretation noted."""
    return replace(result, taken=found.taken, explanation=f"{sentence(found.taken)}\n{result.explanation}")
