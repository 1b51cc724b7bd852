"""Dialogue on frames: feedback on earlier turns as edits of their frames, and new instructions.

Every turn of the built-in writer keeps its frames. Feedback edits those of the last turn, which is then realised again
from the trajectory that it began with: "a bit more" after "go left by 0.2" makes 0.25 of the 0.2. If an earlier turn is
meant, or the feedback is on the original, the frames of all turns in force are realised from the original. Turns of
other writers have parameters only; what cannot be said by turning these is left to the writer.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, TypeAlias

from ovita.chain import adapt, rerun, to_confirm
from ovita.dialogue.history import ROOT, History, Kind, Situation, Step, in_force
from ovita.dialogue.parameters import called, frames_of, scaled, shown, values_after, which
from ovita.dialogue.standing import KEEP_IT, Loss, lost
from ovita.errors import PolicyError, RequestError
from ovita.instruct.chunks import Chunk, chunks
from ovita.instruct.editing import apply, realised_values
from ovita.instruct.edits import Again, Also, Command, Edit, Rescale, Set
from ovita.instruct.feedback import named_frames, named_objects, only_where, read_feedback
from ovita.instruct.frames import Quantity, Reading, SemanticFrame, name_of, with_selection
from ovita.instruct.lexicon import amount_at
from ovita.instruct.referee import feedback
from ovita.measure import compare
from ovita.paths.part import PathPart
from ovita.paths.scene import Scene, canonical
from ovita.paths.trajectory import Array, Trajectory
from ovita.request import MAX_INSTRUCTION, FeedbackOn, Request, Turn
from ovita.result import Adaptation
from ovita.text import number, sentence
from ovita.writers.base import PolicyWriter, WriterInfo
from ovita.writers.generate import FramesWriter

CODE_TURNS = 2
"""How many of the last turns a writer is shown the code of."""

OFFLINE = ("auto", "builtin")
"""Writers that read every instruction themselves first, so that feedback may also ask for further frames."""

PLACING = ("at", "radius", "share", "of", "other", None)
"""Roles of parameters that say where or how smoothly, not how much."""

Reader: TypeAlias = Callable[[str, Scene, Array | None, Sequence[SemanticFrame]], Reading]
"""Reads an instruction about a scene and a path (N, 3) [m] into frames, after those of the turns before."""

FURTHER = frozenset("also n plus too besides".split())
"""Words at the beginning with which something more is asked for."""

FAR = 3.0
"""How many times as much, or as little, a bare number among unknown words may ask for without being shown first."""

TAKEN = {
    "accept": "it is right as it is; nothing is changed",
    "redo": "bring back what was taken back last",
    "restart": "start over from the original",
    "explain": "a question of what was done",
}


def respond(said: str, on: FeedbackOn, state: DialogueState) -> Interpretation:
    """Edit the frames of the turns before by an utterance about them, or adapt by it as an instruction.

    Raises:
        InputError: If the instruction is empty or too long.
    """
    losses = state.losses() if said.strip(" ,.!").lower() in KEEP_IT else []
    if losses:
        return state._restored(said, losses)
    heard = state._answered(said) or state._heard(said)
    if heard is None:
        return state._instructed(said, on)
    try:
        return state._shown_first(heard, state._followed(heard, on))
    except PolicyError as error:
        meaning = heard.reading.question or "feedback on the last turn"
        failed = state._said(said, state.current, _took(said, meaning))
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
class Heard:
    """Feedback as it was read.

    Args:
        said: The words.
        reading: The edits, or a question.
        frames: The frames that the edits are about.
        first: Number of the turn in force that these begin with.
        values: What was realised for them.
        parameters: New values of parameters, where the words name one of them.
    """

    said: str
    reading: Reading
    frames: tuple[SemanticFrame, ...] = ()
    first: int = 0
    values: Mapping[str, Quantity] | None = None
    parameters: Mapping[str, float] | None = None

    @property
    def edits(self) -> tuple[Edit, ...]:
        """What is to be changed."""
        return self.reading.edits


@dataclass(frozen=True)
class DialogueState:
    """What an utterance is interpreted against.

    Args:
        history: The steps so far.
        first: The situation before the first step.
        now: The situation as it is.
        writer: A policy writer or its name.
        reader: Reads instructions into frames.
        asked: The utterance that led to a question right before, or "".
        selection: The part of the path that a person marked by hand, which "here" means.
        stages: Of `adapt`: isolation, progress and cancel.
    """

    history: History
    first: Situation
    now: Situation
    writer: PolicyWriter | str
    reader: Reader
    asked: str
    selection: PathPart
    stages: Mapping[str, Any]

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

    @property
    def _results(self) -> list[Adaptation]:
        return [step.adaptation for step, _ in in_force(self.steps)]

    @property
    def _offline(self) -> bool:
        return (self.writer if isinstance(self.writer, str) else self.writer.name) in OFFLINE

    def losses(self) -> list[Loss]:
        """The postconditions of earlier turns that the last step lost."""
        if not self.steps or not self.steps[-1].adaptation.lost:
            return []
        before = self.steps[-2].adaptation.adapted if len(self.steps) > 1 else self.now.original
        turns = self._results
        parent = self.history.situation(self.history.parents[self.history.head], self.first)
        return lost(turns[:-1], before, turns[-1], scene=parent.scene)

    # Reading.

    def _read(self, said: str, earlier: Sequence[SemanticFrame] = (), scene: Scene | None = None) -> Reading:
        """An instruction as the built-in reader reads it; "there" is where the frames before are, "here" is marked."""
        reading = self.reader(said, scene or self.now.scene, self.current.positions, earlier)
        return replace(reading, frames=with_selection(reading.frames, self.selection))

    def _heard(self, said: str) -> Heard | None:
        """Feedback on the last turn; on all turns where they are named or that reads more of the words; or None."""
        results = self._results
        if not self.history.steps or not results:
            return self._about(said, (), 0) if self.history.steps else None
        last = self._about(said, results[-1:], len(results) - 1)
        framed = len(results) > 1 and all(result.frames for result in results)
        named = self._named_earlier(said, results) if framed else 0
        if not framed or (last is not None and not last.reading.unread and not named):
            return last
        earlier = self._about(said, results, 0)
        if earlier is None or last is None:
            return earlier or last
        more = len(last.reading.unread) - len(earlier.reading.unread) or len(earlier.edits) - len(last.edits)
        return earlier if more > 0 or (more == 0 and named == 1) else last

    def _named_earlier(self, said: str, results: Sequence[Adaptation]) -> int:
        """1 if an utterance names changes of earlier turns only ("more to the left"), 2 if of the last too, else 0."""
        everything = _frames(results)[0]
        named = named_frames(said, self.now.scene, everything)
        old = [i for i in named if i < len(everything) - len(results[-1].frames)]
        return 0 if not old else 1 if old == named else 2

    def _about(self, said: str, results: Sequence[Adaptation], first: int) -> Heard | None:
        """Feedback on some of the turns in force; with a language model only if it needs no further frames."""
        frames, values = _frames(results)
        reading = read_feedback(said, self.now.scene, frames, self.current.positions, self._read)
        last, fresh = (results[-1] if results else None), self._read(said)
        if last is not None and (fresh.unread or fresh.question or not fresh.frames):
            if self._offline and not only_where(said, self.now.scene):
                reading = feedback(said, self.now.scene, frames, self.current.positions, reading)
            turned = called(said, last, self.now.scene)
            placing = any(p.name in turned and p.role in PLACING for p in last.parameters)
            if turned and (placing or reading is None or reading.unread or reading.question):
                return Heard(said, Reading(), frames, first, values, turned)
        if reading is None:
            return None
        heard = Heard(said, reading, frames, first, values)
        doable = last is None or last.frames or self._by_parameters(heard, last)
        return heard if doable else None

    def _by_parameters(self, heard: Heard, last: Adaptation) -> bool:
        """Whether feedback on a policy of another writer can be done without asking it."""
        if heard.reading.question or all(isinstance(edit, Command | Again) for edit in heard.edits):
            return True
        after = apply(heard.edits, heard.frames, self.now.scene, heard.values)
        return values_after(last.parameters, self.now.scene, heard.edits, after) is not None

    def _answered(self, said: str) -> Heard | None:
        """The answer to a question that feedback led to: which of the frames was meant."""
        results = self._results if self.asked else []
        if not results:
            return None
        frames, values = _frames(results[-1:])
        meant = named_frames(said, self.now.scene, frames)
        if not meant or len(meant) == len(frames):
            return None
        chosen = tuple(frames[i] for i in meant)
        reading = read_feedback(self.asked, self.now.scene, chosen, self.current.positions)
        if reading is None or reading.question or not reading.edits:
            return None
        edits = tuple(replace(edit, on=edit.on or name_of(chosen[-1])) for edit in reading.edits)
        return Heard(f"{self.asked} / {said}", replace(reading, edits=edits), frames, len(results) - 1, values)

    def _clarified(self, said: str) -> tuple[SemanticFrame, ...]:
        """The frames of the instruction that led to a question, where the answer names the one object that is meant."""
        meant = named_objects(said, self.now.scene) if self.asked and self._offline else ()
        if len(meant) != 1:
            return ()
        head = canonical(meant[0].name).split()[-1]
        rest = tuple(o for o in self.now.scene if o.name == meant[0].name or canonical(o.name).split()[-1] != head)
        reading = self._read(self.asked, scene=replace(self.now.scene, objects=rest))
        certain = not (reading.unread or reading.question or reading.improper)
        return reading.frames if certain and any(meant[0].name in frame.named for frame in reading.frames) else ()

    # Doing.

    def _instructed(self, said: str, on: FeedbackOn) -> Interpretation:
        """An instruction for the chain; on the original it is added to the frames of all turns."""
        declined = self._declined(said)
        if declined is not None:
            return declined
        frames = self._clarified(said)
        words = f"{self.asked.rstrip('.')}: {said}" if frames else said
        before, results = self.current, self._results
        if on == "original":
            self._refuse_drawn()
            found = self._with_earlier(words, frames, results)
            if found is not None:
                return Interpretation(found, on=on)
            if results and not all(result.frames for result in results) and not frames:
                words = _joined([*(result.instruction for result in results), said])
                before = self.now.original
        result = self._adapt(words, before, frames)
        on = "original" if before is self.now.original and on == "original" else "current"
        return Interpretation(result, on=on, asked=said if result.status == "needs_clarification" else "")

    def _refuse_drawn(self) -> None:
        """Refuse what would have to repeat an edit by hand on the original."""
        for step, _ in in_force(self.steps):
            if step.kind == "drawn":
                raise RequestError(
                    f"{step.said!r} was done by hand on the path as it was then, and cannot be said again"
                    " on the original; choose feedback on current, or undo it"
                )

    def _declined(self, said: str) -> Interpretation | None:
        """What says nothing but where is about the turn before: as an instruction it would lose the "only"."""
        words = only_where(said, self.now.scene) if self._offline and self.steps else ()
        return Interpretation(self._adapt(said, self.current, unplaced=words)) if words else None

    def _with_earlier(
        self, said: str, frames: tuple[SemanticFrame, ...], results: Sequence[Adaptation]
    ) -> Adaptation | None:
        """An instruction with all turns before it, on the original; None if they cannot be done in one."""
        reading = Reading(frames=frames) if frames else self._read(said)
        if reading.unread or reading.question or not reading.frames or not all(result.frames for result in results):
            return None
        everything = (*(frame for result in results for frame in result.frames), *reading.frames)
        words = _joined([*(result.instruction for result in results), said])
        result = self._adapt(words, self.now.original, everything)
        return result if result.usable or result.proposal is not None else None

    def _followed(self, heard: Heard, on: FeedbackOn) -> Interpretation:
        """What feedback does: a step back or forth, an answer, or the last turn's frames realised again."""
        commands = [edit for edit in heard.edits if isinstance(edit, Command)]
        rest = tuple(edit for edit in heard.edits if not isinstance(edit, Command))
        if heard.reading.question:
            return self._asking(heard)
        if commands and not rest:
            return self._commanded(heard, commands[0])
        last = self._results[-1]
        if heard.parameters is not None:
            return self._noted(heard, last, self._rerun(last, heard.parameters), "knobs")
        if isinstance(rest[0], Again) and len(rest) == 1:
            return self._noted(heard, None, self._rerun(replace(last, original=self.current), {}), "said")
        if rest[0].on.startswith("turn ") and len(self._results) >= int(rest[0].on[5:]):
            return self._without(heard, int(rest[0].on[5:]) - 1)
        after = with_selection(apply(rest, heard.frames, self.now.scene, heard.values), self.selection)
        if not last.frames:
            values = values_after(last.parameters, self.now.scene, rest, after)
            return self._noted(heard, last, self._rerun(last, values or {}), "knobs")
        return self._edited(heard, rest, after, on)

    def _shown_first(self, heard: Heard, found: Interpretation) -> Interpretation:
        """What feedback comes to, as a proposal where words are left over or a number is odd."""
        result = found.result
        if found.kind is None or found.goto is not None or not result.usable:
            return found
        unread, doubt = self._left_over(heard), self._odd_number(heard, result)
        if not (unread or doubt):
            return found
        asking = to_confirm(result, unread, (doubt,) if doubt else ())
        return replace(found, result=replace(asking, adapted=self.current))

    def _left_over(self, heard: Heard) -> tuple[str, ...]:
        """The unread words of feedback, where they hold an amount or are several."""
        words = heard.reading.unread
        return words if len(words) > 1 or any(amount_at(w.split(), 0) is not None for w in words) else ()

    def _odd_number(self, heard: Heard, result: Adaptation) -> str:
        """Why a number that sets an amount may mean something else, as a sentence: "the cup is 4 cm tall"."""
        edit = heard.edits[0] if len(heard.edits) == 1 else None
        if not isinstance(edit, Set):
            return ""
        said, _ = chunks(heard.said, self.now.scene, self.current.positions)
        asked = edit.quantity.value
        after_never = [b.q.value for a, b in pairwise(said) if a.kind == "never" and b.q is not None]
        about = {name for frame in (*heard.frames, *result.frames) for name in frame.named}
        things = [chunk for chunk in said if chunk.kind == "OBJ"]
        grounds = (
            (bool(said) and said[0].text.lower() in FURTHER, "It may be a further change."),
            (asked in after_never, f"{number(asked)} is what it should not be."),
            (not all(about & {*c.names} for c in things), "It may be about the object, not about the change."),
            (heard.said.rstrip().endswith("?"), "It is a question."),
        )
        return next((why for speaks, why in grounds if speaks), self._far(said, result))

    def _far(self, said: Sequence[Chunk], result: Adaptation) -> str:
        """That a bare number among unknown words is far from what it was, or ""."""
        if any(chunk.q is not None and chunk.q.unit for chunk in said) or all(c.kind != "unknown" for c in said):
            return ""
        values = {p.name: p.value for p in self._results[-1].parameters}
        pairs = [(values.get(p.name), p.value) for p in result.parameters]
        amounts = [(old, new) for old, new in pairs if isinstance(old, int | float) and isinstance(new, int | float)]
        far = [new for old, new in amounts if old and new and not 1 / FAR <= abs(new / old) <= FAR]
        return f"{number(far[0])} is far from what it was." if far else ""

    def _without(self, heard: Heard, turn: int) -> Interpretation:
        """All turns but one, on the original."""
        kept = [result for i, result in enumerate(self._results) if i != turn]
        if not kept:
            return self._moved(heard, len(self.steps))
        frames = tuple(frame for result in kept for frame in result.frames)
        result = self._adapt(_joined([result.instruction for result in kept]), self.now.original, frames)
        return self._noted(heard, None, result, "said", "original")

    def _edited(
        self, heard: Heard, edits: tuple[Edit, ...], after: tuple[SemanticFrame, ...], on: FeedbackOn
    ) -> Interpretation:
        """Frames after feedback, realised: in the last turn's place, as a further turn, or all from the original."""
        results, last = self._results, self._results[-1]
        whole = heard.first < len(results) - 1
        if not after:
            turns = in_force(self.steps)[heard.first :]
            return self._moved(heard, sum(count for _, count in turns))
        if on == "original" or whole:
            earlier = tuple(frame for result in results[: heard.first] for frame in result.frames)
            words = _joined([*(result.instruction for result in results), heard.said])
            result = self._adapt(words, self.now.original, (*earlier, *after))
            return self._noted(heard, last, result, "said", "original")
        if all(isinstance(edit, Also) for edit in edits):
            added = after[len(heard.frames) :]
            return self._noted(heard, None, self._adapt(heard.said, self.current, added), "said")
        only = edits[0] if len(edits) == 1 else None
        tuned = scaled(only, heard.frames, last.parameters) if isinstance(only, Rescale) else {}
        if tuned:
            return self._noted(heard, last, self._rerun(last, tuned), "knobs")
        valued = all(isinstance(edit, Rescale | Set) for edit in edits)
        words = last.instruction if valued else _joined([last.instruction, heard.said], "; ")
        return self._noted(heard, last, self._adapt(words, last.original, after), "knobs" if valued else "reworded")

    def _noted(
        self, heard: Heard, before: Adaptation | None, result: Adaptation, kind: Kind, on: FeedbackOn = "current"
    ) -> Interpretation:
        if result.usable:
            result = _noting(result, _took(heard.said, _meaning(before, result)))
        return Interpretation(result, kind, on)

    def _adapt(
        self,
        instruction: str,
        start: Trajectory,
        frames: Sequence[SemanticFrame] = (),
        unplaced: tuple[str, ...] = (),
    ) -> Adaptation:
        return adapt(
            Request(instruction, start, self.now.scene, self.now.robot, tuple(self.turns), selection=self.selection),
            writer=FramesWriter(tuple(frames), unplaced) if frames or unplaced else self.writer,
            constraints=self.now.constraints,
            **self.stages,
        )

    def _rerun(self, adaptation: Adaptation, values: Mapping[str, float | int]) -> Adaptation:
        asked = replace(adaptation, scene=self.now.scene, robot=self.now.robot)
        return rerun(asked, values, constraints=self.now.constraints, isolation=self.stages["isolation"])

    def _restored(self, said: str, losses: Sequence[Loss]) -> Interpretation:
        """Make postconditions hold again that the last step lost: the turns that promised them are run once more."""
        result: Adaptation | None = None
        for loss in losses:
            result = self._rerun(loss.restoring(result.adapted if result else self.current), {})
        assert result is not None
        words = "; ".join(dict.fromkeys(loss.turn.instruction for loss in losses))
        return Interpretation(_noting(result, f"took {said!r} as: {words}, once more"))

    def _commanded(self, heard: Heard, edit: Command) -> Interpretation:
        taken = _took(heard.said, TAKEN.get(edit.command, ""))
        if edit.command == "undo":
            return self._moved(heard, edit.steps)
        if edit.command == "restart":
            return Interpretation(self._said(heard.said, self.first.original, taken), goto=ROOT)
        if edit.command == "redo":
            turn = self.history.forth()
            if turn is None:
                return Interpretation(self._said(heard.said, self.current, "there is nothing to bring back"), kind=None)
            return Interpretation(self._said(heard.said, self.history.steps[turn].adaptation.adapted, taken), goto=turn)
        result = self._said(heard.said, self.current, taken)
        if edit.command == "explain" and self.steps:
            result = replace(result, explanation=self.steps[-1].adaptation.explanation)
        return Interpretation(result, kind=None)

    def _moved(self, heard: Heard, steps: int) -> Interpretation:
        path = self.history.path()
        turn = path[-steps - 1] if steps < len(path) else ROOT
        after = self.first.original if turn == ROOT else self.history.steps[turn].adaptation.adapted
        many = "the last turn" if steps == 1 else f"the last {steps} steps"
        taken = _took(heard.said, f"take {many} back")
        return Interpretation(self._said(heard.said, after, taken), goto=turn)

    def _asking(self, heard: Heard) -> Interpretation:
        question = heard.reading.question
        if heard.reading.asked and self._results:
            question = which(heard.reading.asked, heard.frames, self._results[-1].parameters)
        result = self._said(heard.said, self.current, f"took {heard.said!r} as: a question of which change")
        asking = replace(result, status="needs_clarification", question=question, explanation=question)
        return Interpretation(asking, asked=heard.said)

    def _said(self, said: str, after: Trajectory, taken: str) -> Adaptation:
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


def _frames(results: Sequence[Adaptation]) -> tuple[tuple[SemanticFrame, ...], dict[str, Quantity]]:
    """The frames of turns, and what was realised for them; of other writers' turns by their parameters."""
    frames: list[SemanticFrame] = []
    values: dict[str, Quantity] = {}
    for result in results:
        known = result.frames or frames_of(result.parameters, result.scene)
        for slot, q in realised_values(result.parameters).items():
            number, _, name = slot.partition(".")
            values[f"{len(frames) + int(number)}.{name}"] = q
        frames += known
    return tuple(frames), values


def _joined(texts: Sequence[str], between: str = ". ") -> str:
    """What was said in several turns, for the record; the first of it where it gets too long."""
    text = between.join(text.strip().rstrip(".!?;, ") for text in texts)
    return text if len(text) <= MAX_INSTRUCTION else text[: MAX_INSTRUCTION - 3] + "..."


def _took(said: str, meaning: str) -> str:
    return f"took {' '.join(said.split())!r} as: {meaning}"


def _noting(result: Adaptation, taken: str) -> Adaptation:
    return replace(result, taken=taken, explanation=f"{sentence(taken)}\n{result.explanation}")


def _meaning(before: Adaptation | None, result: Adaptation) -> str:
    """What changed in the parameters; the plan where other things did."""
    old = {p.name: p for p in before.parameters} if before else {}
    changed = [p for p in result.parameters if p.name in old and old[p.name].value != p.value]
    if before is not None and changed and set(old) == {p.name for p in result.parameters}:
        turned = [(f"{shown(old[p.name])} -> {shown(p, named=False)}", p.meaning) for p in changed]
        return ", ".join(f"{text} ({meaning})" if meaning else text for text, meaning in turned)
    return " ".join(result.plan).rstrip(".") or "nothing to do"
