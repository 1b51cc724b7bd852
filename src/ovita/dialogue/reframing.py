"""Dialogue on frames: feedback on earlier turns as edits of their frames, and new instructions.

Every turn of the built-in writer keeps its frames. Feedback edits those of the last turn, which is then realised again
from the trajectory that it began with: "a bit more" after "go left by 0.2" makes 0.25 of the 0.2. If an earlier turn is
meant, or the feedback is on the original, the frames of all turns in force are realised from the original. Turns of
other writers have parameters only; what cannot be said by turning these is left to the writer.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ovita.chain import adapt, rerun, to_confirm
from ovita.dialogue.doubts import doubted, gives_up_more
from ovita.dialogue.history import ROOT, History, Kind, Situation
from ovita.dialogue.interpretation import Feedback, Interpretation, frames_in, numbers_of
from ovita.dialogue.parameters import called, frames_of, names_zone, scaled, shown, values_after, which
from ovita.dialogue.pointing import spelt_out, with_thing
from ovita.dialogue.postconditions import KEEP_IT, Loss, lost
from ovita.errors import PolicyError, RequestError
from ovita.instruct.editing import apply, realised_values
from ovita.instruct.edits import Again, Also, Command, Drop, Edit, Except, Rescale, Set
from ovita.instruct.frames import (
    SPOTS,
    Keep,
    Quantity,
    Reading,
    SemanticFrame,
    Smooth,
    name_of,
    with_selection,
)
from ovita.instruct.lexicon import sorts_of
from ovita.instruct.remarks import named_frames, named_objects, vaguely_where
from ovita.instruct.understanding import feedback as refereed
from ovita.instruct.understanding import read, understand
from ovita.measure import compare
from ovita.paths.part import PathPart
from ovita.paths.scene import Scene, canonical
from ovita.paths.trajectory import Trajectory
from ovita.policy import Parameter
from ovita.request import MAX_INSTRUCTION, FeedbackOn, Request, Turn
from ovita.result import Adaptation
from ovita.text import sentence
from ovita.writers.base import PolicyWriter, WriterInfo
from ovita.writers.generate import FramesWriter

CODE_TURNS = 2
"""How many of the last turns a writer is shown the code of."""

OFFLINE = ("auto", "builtin")
"""Writers that read every instruction themselves first, so that feedback may also ask for further frames."""

PLACING = ("at", "radius", "share", "of", "other", None)
"""Roles of parameters that say where or how smoothly, not how much."""

BRIEF = 4
"""Words of an answer that says no more than what was asked."""

BETWEEN = frozenset("between halfway middle quite".split())
"""Words for less than all of the way back to what was before the last correction."""

WHAT_GOES = "What should be taken back? 'Undo' is the last turn; or name it, such as 'forget the shift'."
"""The question where words give up more than they name."""

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
    said = state.named(said)
    losses = state.losses() if said.strip(" ,.!").lower() in KEEP_IT else []
    if losses:
        return state._restored(said, losses)
    feedback = state._answered(said) or state.feedback(said)
    if feedback is None:
        return state._instructed(said, on)
    try:
        return state._shown_first(feedback, state._followed(feedback, on))
    except PolicyError as error:
        meaning = feedback.reading.question or "feedback on the last turn"
        failed = state._unchanged(said, _took(said, meaning))
        return Interpretation(replace(failed, status="failed", error=str(error), explanation=str(error)))


def _keeps_ends(edits: Sequence[Edit]) -> bool:
    """Whether edits only leave start or goal where they were before all turns."""
    return bool(edits) and all(
        isinstance(edit, Also) and isinstance(edit.frame, Keep) and edit.frame.what in SPOTS for edit in edits
    )


def _gives_up(edits: Sequence[Edit]) -> bool:
    """Whether edits take back the last turn, or all of it."""
    return bool(edits) and all(edit == Command(command="undo") or edit == Drop() for edit in edits)


def _numbers(edits: Sequence[Edit]) -> bool:
    """Whether edits take back a turn by its number: "forget the first one"."""
    return any(edit.on.startswith("turn ") for edit in edits)


@dataclass(frozen=True)
class DialogueState:
    """What an utterance is interpreted against.

    `asked` is the utterance that led to a question right before, or ""; `selection` is the part of the path that a
    person marked by hand, which "here" means; `stages` are isolation, progress and cancel of `adapt`.
    """

    history: History
    now: Situation
    writer: PolicyWriter | str
    asked: str
    selection: PathPart
    stages: Mapping[str, Any]

    @property
    def current(self) -> Trajectory:
        """The trajectory after the last step."""
        return self.history.after(self.history.head)

    @property
    def turns(self) -> list[Turn]:
        """The turns in force, oldest first."""
        turns = self.history.turns()
        codeless = len(turns) - CODE_TURNS
        shown = [(step.adaptation, count, i >= codeless) for i, (step, count) in enumerate(turns)]
        return [
            Turn(a.instruction, a.original, a.parameters, n, "current", a.plan, a.code if with_code else "", a.contacts)
            for a, n, with_code in shown
        ]

    @cached_property
    def results(self) -> list[Adaptation]:
        """What came of the turns in force, oldest first."""
        return self.history.results

    @property
    def offline(self) -> bool:
        """Whether the writer reads every instruction itself first."""
        return (self.writer if isinstance(self.writer, str) else self.writer.name) in OFFLINE

    def losses(self) -> list[Loss]:
        """The postconditions of earlier turns that the last step lost."""
        if self.history.head == ROOT or not self.history.steps[self.history.head].adaptation.lost:
            return []
        parent = self.history.parents[self.history.head]
        before, scene = self.history.after(parent), self.history.situation(parent).scene
        return lost(self.results[:-1], before, self.results[-1], scene=scene)

    def named(self, said: str) -> str:
        """What was said, with names for what "it", "there" and "both of them" point at."""
        before = self.history.steps[self.history.head].said if self.results else ""
        return spelt_out(said, before, [result.frames for result in self.results], self.now.scene)

    # Reading.

    def read(self, said: str) -> Reading:
        """An instruction as the built-in reader reads it; "here" is what is marked."""
        reading = read(said, self.now.scene, self.current)
        return replace(reading, frames=with_selection(reading.frames, self.selection))

    def feedback(self, said: str) -> Feedback | None:
        """Feedback on the last turn; on all turns where they are named or that reads more of the words; or None."""
        results = self.results
        if not results:
            return self._about(said, (), 0) if self.history.steps else None
        last = self._about(said, results[-1:], len(results) - 1)
        if len(results) == 1 or not all(result.frames for result in results):
            return last
        named = 1 if last is not None and _keeps_ends(last.edits) else self._named_earlier(said)
        if (
            last is not None
            and _gives_up(last.edits)
            and (back := self._about(said, results, 0))
            and _numbers(back.edits)
        ):
            return back
        if last is not None and not last.reading.unread and not named:
            return last
        earlier = self._about(said, results, 0)
        readings = (earlier, last) if named == 1 else (last, earlier)
        return max(filter(None, readings), key=lambda one: (-len(one.reading.unread), len(one.edits)), default=None)

    def _named_earlier(self, said: str) -> int:
        """1 if it names earlier changes only, 2 if the last too, else 0."""
        everything = frames_in(self.results)
        named = named_frames(said, self.now.scene, everything)
        old = [i for i in named if i < len(everything) - len(self.results[-1].frames)]
        return 0 if not old else 1 if old == named else 2

    def _about(self, said: str, results: Sequence[Adaptation], first: int) -> Feedback | None:
        """Feedback on some of the turns in force; with a language model only if it needs no further frames."""
        frames, values = _realised(results)
        if vaguely_where(said, self.now.scene):
            return None
        reading = refereed(said, self.now.scene, frames, self.current.positions)
        adds = reading is not None and any(isinstance(edit, Also) for edit in reading.edits)
        if adds and not (results and self.offline):
            return None
        if reading is not None and reading.question and self.history.in_force:
            reading = self._of_the_newest(said) or reading
        if results and (not is_certain(self.read(said)) or names_zone(said)):
            parameters = self._parameters_named(said, results[-1], reading)
            if parameters:
                return Feedback(said, Reading(), frames, first, values, parameters)
        commands = reading is not None and all(isinstance(edit, Command) for edit in reading.edits)
        if reading is None or _leaves_nothing(reading, frames) or not (results or commands):
            return None
        feedback = Feedback(said, reading, frames, first, values)
        doable = not results or results[-1].frames or self._by_parameters(feedback, results[-1])
        return feedback if doable else None

    def _of_the_newest(self, said: str) -> Reading | None:
        """Feedback that could be about several frames, on the one that the last step added; None if it added none."""
        *earlier, last = (step.adaptation.frames for step in self.history.in_force)
        known = [frame for frames in earlier for frame in frames]
        new = [frame for frame in last if known and frame not in known]
        reading = refereed(said, self.now.scene, new, self.current.positions) if len(new) == 1 else None
        if reading is None or reading.question or not reading.edits:
            return None
        return replace(reading, edits=tuple(replace(edit, on=edit.on or name_of(new[0])) for edit in reading.edits))

    def _parameters_named(self, said: str, last: Adaptation, reading: Reading | None) -> dict[str, float]:
        """New values of parameters that an utterance calls by name, where nothing else was read from all of it."""
        values = called(said, last, self.now.scene)
        placing = any(p.name in values and p.role in PLACING for p in last.parameters)
        if reading is None or reading.question or placing:
            return values
        return values if reading.unread and not any(isinstance(edit, Set) for edit in reading.edits) else {}

    def _by_parameters(self, feedback: Feedback, last: Adaptation) -> bool:
        """Whether feedback on a policy of another writer can be done without asking it."""
        if feedback.reading.question or all(isinstance(edit, Command | Again) for edit in feedback.edits):
            return True
        after = apply(feedback.edits, feedback.frames, self.now.scene, feedback.values)
        return values_after(last.parameters, self.now.scene, feedback.edits, after) is not None

    def _answered(self, said: str) -> Feedback | None:
        """The answer to a question that feedback led to: which of the frames was meant."""
        if not self.asked or not self.results:
            return None
        frames, values = _realised(self.results[-1:])
        named = [frames[i] for i in named_frames(said, self.now.scene, frames)]
        if not named or len(named) == len(frames):
            return None
        reading = refereed(self.asked, self.now.scene, named, self.current.positions)
        if reading is None or reading.question or not reading.edits:
            return None
        edits = tuple(replace(edit, on=edit.on or name_of(named[-1])) for edit in reading.edits)
        reading = replace(reading, edits=edits)
        return Feedback(f"{self.asked} / {said}", reading, frames, len(self.results) - 1, values)

    def _clarified(self, said: str) -> tuple[SemanticFrame, ...]:
        """The frames of the instruction that led to a question, where the answer names an object, or which way."""
        if not (self.asked and self.offline):
            return ()
        named = named_objects(said, self.now.scene)
        if len(named) == 1:
            return self._with_thing(named[0].name)
        return self._together(said) if not named and len(said.split()) <= BRIEF else ()

    def _together(self, said: str) -> tuple[SemanticFrame, ...]:
        """The frames of what led to a question, said together with its answer: "move it by 10 cm", "to the right"."""
        return self._meant(f"{self.asked.rstrip(' .!?')} {said}", self.now.scene)

    def _with_thing(self, name: str) -> tuple[SemanticFrame, ...]:
        """The frames of what led to a question with an object in place of what it left open, or of all of its kind."""
        called = _called(name)
        rest = tuple(item for item in self.now.scene if item.name == name or called.isdisjoint(_called(item.name)))
        alone = self._meant(self.asked, replace(self.now.scene, objects=rest))
        told = (self._meant(text, self.now.scene) for text in with_thing(self.asked, name))
        return next((frames for frames in (alone, *told) if any(name in frame.named for frame in frames)), ())

    def _meant(self, said: str, scene: Scene) -> tuple[SemanticFrame, ...]:
        """The frames of an instruction of which nothing is left over, and against which nothing speaks."""
        verdict = understand(said, scene, self.current)
        sound = verdict.outcome in ("do", "needs_confirmation") and not (verdict.unused or verdict.doubts)
        return with_selection(verdict.reading.frames, self.selection) if sound else ()

    # Doing.

    def _instructed(self, said: str, on: FeedbackOn) -> Interpretation:
        """An instruction for the chain; on the original it is added to the frames of all turns."""
        unplaced = vaguely_where(said, self.now.scene) if self.offline and self.history.head != ROOT else ()
        if unplaced:
            # What says nothing but where is about the turn before: as an instruction it would lose the "only".
            return Interpretation(self._adapt(said, self.current, unplaced=unplaced))
        frames = self._clarified(said)
        words, before = f"{self.asked.rstrip('.')}: {said}" if frames else said, self.current
        if on == "original":
            self._refuse_drawn()
            whole = self._with_earlier(words, frames)
            if whole is not None:
                return Interpretation(whole, on=on)
            if not frames and not all(result.frames for result in self.results):
                words, before = self._transcript(said), self.now.original
        result = self._adapt(words, before, frames)
        on = "original" if before is self.now.original and on == "original" else "current"
        return Interpretation(result, on=on, asked=said if result.status == "needs_clarification" else "")

    def _refuse_drawn(self) -> None:
        """Refuse what would have to repeat an edit by hand on the original."""
        for step, _ in self.history.turns():
            if step.kind == "drawn":
                raise RequestError(
                    f"{step.said!r} was done by hand on the path as it was then, and cannot be said again"
                    " on the original; choose feedback on current, or undo it"
                )

    def _with_earlier(self, said: str, frames: tuple[SemanticFrame, ...]) -> Adaptation | None:
        """An instruction with all turns before it, on the original; None if they cannot be done in one."""
        reading = Reading(frames=frames) if frames else self.read(said)
        if not is_certain(reading) or not all(result.frames for result in self.results):
            return None
        everything = (*frames_in(self.results), *reading.frames)
        result = self._adapt(self._transcript(said), self.now.original, everything)
        return result if result.usable or result.proposal is not None else None

    def _followed(self, feedback: Feedback, on: FeedbackOn) -> Interpretation:
        """What feedback does: a step back or forth, an answer, or the last turn's frames realised again."""
        if gives_up_more(feedback, self.results):
            feedback = replace(feedback, reading=Reading(question=WHAT_GOES))
        if feedback.reading.question:
            return self._asking(feedback)
        commands = [edit for edit in feedback.edits if isinstance(edit, Command)]
        edits = tuple(edit for edit in feedback.edits if not isinstance(edit, Command))
        if commands and not edits:
            return self._commanded(feedback, commands[0])
        last = self.results[-1]
        if feedback.parameters is not None:
            return self._noted(feedback, last, self._rerun(last, feedback.parameters), "knobs")
        if isinstance(edits[0], Again) and len(edits) == 1:
            return self._noted(feedback, None, self._repeated(last), "said")
        if edits[0].on.startswith("turn "):
            turn = int(edits[0].on[5:]) - 1
            if turn < len(self.results) > 1:
                return self._without(feedback, turn)
            edits = tuple(Drop(on=name_of(frame)) for frame in feedback.frames[turn : turn + 1])
        after = with_selection(apply(edits, feedback.frames, self.now.scene, feedback.values), self.selection)
        if not last.frames:
            values = values_after(last.parameters, self.now.scene, edits, after)
            return self._noted(feedback, last, self._rerun(last, values or {}), "knobs")
        return self._edited(feedback, edits, after, on)

    def _shown_first(self, feedback: Feedback, found: Interpretation) -> Interpretation:
        """What feedback comes to, as a proposal where words are left over or a number is odd."""
        if found.kind is None or found.goto is not None or not found.result.usable:
            return found
        unread, doubt = feedback.left_over, doubted(feedback, self.results[-1:], found.result)
        if not (unread or doubt):
            return found
        asking = to_confirm(found.result, unread, (doubt,) if doubt else ())
        return replace(found, result=replace(asking, adapted=self.current))

    def _without(self, feedback: Feedback, turn: int) -> Interpretation:
        """All turns but one, on the original."""
        kept = [result for i, result in enumerate(self.results) if i != turn]
        if not kept:
            return self._taken_back(feedback, len(self.history.path()))
        result = self._adapt(_joined([one.instruction for one in kept]), self.now.original, frames_in(kept))
        return self._noted(feedback, None, result, "said", "original")

    def _edited(
        self, feedback: Feedback, edits: tuple[Edit, ...], after: tuple[SemanticFrame, ...], on: FeedbackOn
    ) -> Interpretation:
        """Frames after feedback, realised: in the last turn's place, as a further turn, or all from the original."""
        last, earlier = self.results[-1], self.results[: feedback.first]
        if not after:
            return self._taken_back(feedback, sum(count for _, count in self.history.turns()[feedback.first :]))
        if on == "original" or len(earlier) < len(self.results) - 1:
            result = self._adapt(self._transcript(feedback.said), self.now.original, (*frames_in(earlier), *after))
            return self._noted(feedback, last, result, "said", "original")
        if all(isinstance(edit, Also) for edit in edits) and not _keeps_ends(edits):
            added = after[len(feedback.frames) :]
            return self._noted(feedback, None, self._adapt(feedback.said, self.current, added), "said")
        if len(edits) == 1 and isinstance(edits[0], Rescale):
            tuned = scaled(edits[0], feedback.frames, last.parameters)
            if tuned:
                result = self._rerun(last, tuned)
                between = self._halfway(feedback.said, numbers_of(result)) if _in_between(feedback.said) else {}
                return self._noted(feedback, last, self._rerun(result, between) if between else result, "knobs")
        if all(isinstance(edit, Rescale | Set) for edit in edits):
            result = self._adapt(last.instruction, last.original, after)
            stated = any(isinstance(edit, Set) or (isinstance(edit, Rescale) and edit.factor) for edit in edits)
            halfway = (
                {} if stated and not _in_between(feedback.said) else self._halfway(feedback.said, numbers_of(result))
            )
            return self._noted(feedback, last, self._rerun(result, halfway) if halfway else result, "knobs")
        words = _joined([last.instruction, feedback.said], "; ")
        return self._noted(feedback, last, self._adapt(words, last.original, after), "reworded")

    def _halfway(self, said: str, new: Mapping[str, float]) -> dict[str, float | int]:
        """What undoes more than the last correction, half of the way back; or all of it: "something in between"."""
        steps = self.history.in_force
        if len(steps) < 2 or steps[-1].kind != "knobs":
            return {}
        old, now = (numbers_of(step.adaptation) for step in steps[-2:])
        least = 0.0 if _in_between(said) else -1e-9
        back = [k for k in new.keys() & old.keys() & now.keys() if (new[k] - old[k]) * (now[k] - old[k]) <= least]
        middle = {k: (old[k] + now[k]) / 2.0 for k in back if now[k] != old[k]}
        return {k: round(v) if isinstance(new[k], int) else float(f"{v:.3g}") for k, v in middle.items()}

    def _noted(
        self, feedback: Feedback, before: Adaptation | None, result: Adaptation, kind: Kind, on: FeedbackOn = "current"
    ) -> Interpretation:
        if result.usable:
            same = np.array_equal(result.adapted.to_array(), self.current.to_array())
            meaning = _meaning(before, result) + ("; nothing changes by that" if same else "")
            result = _noting(result, _took(feedback.said, meaning))
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

    def _repeated(self, last: Adaptation) -> Adaptation:
        """A turn once more, on what there is now; a smoothing as strongly as it takes to make a difference there."""
        if any(isinstance(frame, Smooth) for frame in last.frames):
            return self._adapt(last.instruction, self.current, last.frames)
        return self._rerun(replace(last, original=self.current), {})

    def _restored(self, said: str, losses: Sequence[Loss]) -> Interpretation:
        """Make postconditions hold again that the last step lost: the turns that promised them are run once more."""
        current = self.current
        for loss in losses:
            result = self._rerun(loss.restoring(current), {})
            current = result.adapted
        words = "; ".join(dict.fromkeys(loss.turn.instruction for loss in losses))
        return Interpretation(_noting(result, f"took {said!r} as: {words}, once more"))

    def _commanded(self, feedback: Feedback, edit: Command) -> Interpretation:
        taken = _took(feedback.said, TAKEN.get(edit.command, ""))
        forth = self.history.forth()
        match edit.command:
            case "undo":
                return self._taken_back(feedback, self.history.steps_of(edit.steps))
            case "restart":
                return self._gone_to(feedback, ROOT, taken)
            case "redo" if forth is not None:
                return self._gone_to(feedback, forth, taken)
            case "redo":
                taken = "there is nothing to bring back"
        result = self._unchanged(feedback.said, taken)
        if edit.command == "explain" and self.history.head != ROOT:
            result = replace(result, explanation=self.history.steps[self.history.head].adaptation.explanation)
        return Interpretation(result, kind=None)

    def _taken_back(self, feedback: Feedback, steps: int) -> Interpretation:
        path = self.history.path()
        many = "the last turn" if steps == 1 else f"the last {steps} steps"
        turn = path[-steps - 1] if steps < len(path) else ROOT
        return self._gone_to(feedback, turn, _took(feedback.said, f"take {many} back"))

    def _gone_to(self, feedback: Feedback, turn: int, taken: str) -> Interpretation:
        after = self.history.after(turn)
        changes = compare(self.current, after, self.now.scene)
        return Interpretation(replace(self._unchanged(feedback.said, taken), adapted=after, changes=changes), goto=turn)

    def _asking(self, feedback: Feedback) -> Interpretation:
        question = feedback.reading.question
        if feedback.reading.asked and self.results:
            question = which(feedback.reading.asked, feedback.frames, self.results[-1].parameters)
        result = self._unchanged(feedback.said, f"took {feedback.said!r} as: a question of which change")
        asking = replace(result, status="needs_clarification", question=question, explanation=question)
        return Interpretation(asking, asked=feedback.said)

    def _unchanged(self, said: str, taken: str) -> Adaptation:
        """The answer to an utterance that changes nothing."""
        return Adaptation(
            said,
            "done",
            self.current,
            self.current,
            scene=self.now.scene,
            robot=self.now.robot,
            taken=taken,
            explanation=sentence(taken),
            changes=compare(self.current, self.current, self.now.scene),
            writer=WriterInfo("feedback", reason="it was feedback"),
        )

    def _transcript(self, said: str) -> str:
        """The instructions of all turns, and an utterance."""
        return _joined([*(result.instruction for result in self.results), said])


def _leaves_nothing(reading: Reading, frames: Sequence[SemanticFrame]) -> bool:
    """Whether all of the part that a frame is about would be left out: "the rest faster" is another wish."""
    out = [(edit.part.kind, edit.part.places) for edit in reading.edits if isinstance(edit, Except)]
    return any((frame.part.kind, frame.part.places) in out for frame in frames)


def is_certain(reading: Reading) -> bool:
    """Whether a reading has frames, and nothing in it is left open."""
    return bool(reading.frames) and not (reading.unread or reading.question)


def _called(name: str) -> frozenset[str]:
    """What a thing may be called that a name names: "cup" of "blue cup", "animal" of a buffalo."""
    words = canonical(name).split()
    return sorts_of(words) | {words[-1]}


def _realised(results: Sequence[Adaptation]) -> tuple[tuple[SemanticFrame, ...], dict[str, Quantity]]:
    """The frames of turns, and what was realised for them; of other writers' turns by their parameters."""
    frames: list[SemanticFrame] = []
    values: dict[str, Quantity] = {}
    for result in results:
        for slot, q in realised_values(result.parameters).items():
            number, _, name = slot.partition(".")
            values[f"{len(frames) + int(number)}.{name}"] = q
        frames += result.frames or frames_of(result.parameters, result.scene)
    return tuple(frames), values


def _joined(texts: Sequence[str], between: str = ". ") -> str:
    """What was said in several turns, for the record; the first of it where it gets too long."""
    text = between.join(text.strip().rstrip(".!?;, ") for text in texts)
    return text if len(text) <= MAX_INSTRUCTION else text[: MAX_INSTRUCTION - 3] + "..."


def _in_between(said: str) -> bool:
    """Whether less than all of the way back is wanted: "go back half way"."""
    return not BETWEEN.isdisjoint(said.lower().replace(".", " ").replace("half way", "halfway").split())


def _took(said: str, meaning: str) -> str:
    return f"took {' '.join(said.split())!r} as: {meaning}"


def _noting(result: Adaptation, taken: str) -> Adaptation:
    return replace(result, taken=taken, explanation=f"{sentence(taken)}\n{result.explanation}")


def _meaning(before: Adaptation | None, result: Adaptation) -> str:
    """What changed in the parameters; the plan where other things did."""
    old = {p.name: p for p in before.parameters} if before else {}
    changed = [p for p in result.parameters if p.name in old and old[p.name].value != p.value]
    if changed and set(old) == {p.name for p in result.parameters}:
        return ", ".join(_turned(old[p.name], p) for p in changed)
    return " ".join(result.plan).rstrip(".") or "nothing to do"


def _turned(old: Parameter, new: Parameter) -> str:
    text = f"{shown(old)} -> {shown(new, named=False)}"
    return f"{text} ({new.meaning})" if new.meaning else text
