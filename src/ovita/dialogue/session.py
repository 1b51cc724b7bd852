"""Phase five: feedback. A session keeps every turn, so that nothing a person says is lost and all can be undone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from threading import Event
from typing import Any

from ovita.chain import UNCHANGED, another, enforced, rerun
from ovita.dialogue.history import (
    OWN,
    ROOT,
    History,
    Kind,
    Situation,
    Step,
    read_session,
    replayed,
    write_session,
)
from ovita.dialogue.interpretation import Interpretation
from ovita.dialogue.postconditions import NOT_THAT, answered, lost
from ovita.dialogue.reframing import DialogueState, respond
from ovita.dialogue.splitting import split_in_turns
from ovita.errors import RequestError
from ovita.io.files import Journal
from ovita.limits import ConstraintOptions
from ovita.paths.part import WHOLE, PathPart
from ovita.paths.robot import UNLIMITED, Robot
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory
from ovita.policy.reading import parse
from ovita.policy.sandbox import Isolation, known_isolation
from ovita.request import FeedbackOn, robot_of, scene_of, trajectory_of
from ovita.result import Adaptation, accept
from ovita.writers.base import PolicyWriter, Progress, WriterInfo


@dataclass
class Session:
    """A conversation about one trajectory.

    Args:
        original: The trajectory that it began with, or an array as `adapt` takes it.
        scene: Its surroundings, or the objects.
        robot: The limits, or a robot's name or file.
        writer: A policy writer or its name.
        constraints: How limits are enforced.
        isolation: How policies must be isolated.
    """

    original: Trajectory
    scene: Scene = field(default_factory=Scene)
    robot: Robot = UNLIMITED
    writer: PolicyWriter | str = "auto"
    constraints: ConstraintOptions = field(default_factory=ConstraintOptions)
    isolation: Isolation = "auto"
    _history: History = field(init=False)
    _journal: Journal | None = field(default=None, init=False)
    _asked: str = field(default="", init=False)
    _pending: tuple[str, Interpretation] | None = field(default=None, init=False)
    _refused: tuple[Adaptation, ...] = field(default=(), init=False)
    _open: str = field(default="", init=False)
    _behind: bool = field(default=False, init=False)

    def __post_init__(self) -> None:
        known_isolation(self.isolation)
        self.original = trajectory_of(self.original)[0]
        self.scene, self.robot = scene_of(self.scene), robot_of(self.robot)
        self._history = History(self.situation)

    @classmethod
    def of(
        cls, adaptation: Adaptation, *, writer: PolicyWriter | str = "auto", isolation: Isolation = "auto"
    ) -> Session:
        """A session that goes on from a saved adaptation; its policy is not run until a knob is turned."""
        session = cls(adaptation.original, adaptation.scene, adaptation.robot, writer, isolation=isolation)
        session._begin(adaptation, adaptation.instruction or "opened a result", "opened")
        return session

    def _begin(self, adaptation: Adaptation, said: str, kind: Kind) -> None:
        if adaptation.usable:
            self._add(Step(said, "current", adaptation, kind))
        elif adaptation.proposal is not None:
            self._propose(adaptation.instruction, Interpretation(adaptation))

    def _propose(self, said: str, found: Interpretation | None) -> None:
        """Have a result wait for a yes, or nothing."""
        self._pending = None if found is None else (said, found)
        self._history.proposed = None if found is None else _step(said, found)
        self._note(self._history.now())

    @property
    def situation(self) -> Situation:
        """What the session is about now."""
        return Situation(self.original, self.scene, self.robot, self.constraints)

    @property
    def steps(self) -> tuple[Step, ...]:
        """The turns that are in force, oldest first."""
        return tuple(self._history.in_force)

    @property
    def history(self) -> History:
        """Every turn ever made, with those that were undone or branched away from; not to be changed."""
        return self._history

    @property
    def asked(self) -> str:
        """The sentence that led to a question, which the next sentence answers, or ""."""
        return self._asked

    @property
    def pending(self) -> Adaptation | None:
        """The result whose proposal the next sentence may agree to, or None."""
        return None if self._pending is None else self._pending[1].result

    @property
    def current(self) -> Trajectory:
        """The trajectory as it stands."""
        last = self.adaptation
        return self.original if last is None else last.adapted

    @property
    def adaptation(self) -> Adaptation | None:
        """The last turn's adaptation, or None before the first."""
        return None if self._history.head == ROOT else self._history.steps[self._history.head].adaptation

    def say(
        self,
        instruction: str,
        *,
        on: FeedbackOn = "current",
        selection: PathPart = WHOLE,
        progress: Progress | None = None,
        cancel: Event | None = None,
    ) -> Adaptation:
        """Adapt the current or the original trajectory, or resolve feedback on the turns before ("a bit more").

        On "current" the instruction is applied to what there is now. On "original", as in the paper, it is added to
        what was said so far, and all of it is applied to the original again, with the knobs as they were turned.
        Feedback is resolved without any writer wherever that is certain: it turns knobs of the last turn, runs it
        again, puts its instruction right, or takes it back. A turn that is not understood, or that fails, changes
        nothing and is not kept. Nor is one that needs confirmation until the next sentence agrees ("yes") or says what
        is different ("no, 10 cm"). A correction and a further wish in one sentence are two turns, taken back together;
        if the first is not done, the other is left, which a warning says. `selection` is the part of the path that is
        marked by hand, which "here" means; `progress` and `cancel` are those of `adapt`.

        Raises:
            InputError: If the instruction is empty or too long.
        """
        if not isinstance(instruction, str):
            raise RequestError("an instruction is a text such as 'go left by 0.1'")
        if not instruction.strip():
            raise RequestError("the instruction is empty; say what should change, such as 'slow down near the cup'")
        return self._say(instruction, on, selection, progress, cancel)

    def _say(
        self,
        instruction: str,
        on: FeedbackOn,
        selection: PathPart,
        progress: Progress | None,
        cancel: Event | None,
        same_utterance: bool = False,
    ) -> Adaptation:
        waited = self._pending is not None
        if self._pending is not None:
            settled, instruction = self._settled(instruction)
            if settled is not None:
                return settled
        state = DialogueState(
            self._history,
            self.situation,
            self.writer,
            self._asked,
            selection,
            {"isolation": self.isolation, "progress": progress, "cancel": cancel},
        )
        first, rest = split_in_turns(instruction, state)
        if first:
            before = self._history.head
            one = self._say(first, on, selection, progress, cancel)
            if one.status not in ("done", "limited"):
                later = f"Nothing is done yet about {rest!r}."  # it would be said of what it is not about
                return replace(one, warnings=(*one.warnings, later))
            added = self._history.head not in (before, *self._history.path(before))
            result = self._say(rest, on, selection, progress, cancel, added)
            return replace(result, taken="; ".join(filter(None, (one.taken, result.taken))))
        found = replace(respond(instruction, on, state), same_utterance=same_utterance)
        self._asked = found.asked
        if found.goto is not None and waited and found.goto == self._history.back():
            return self.dismiss(instruction)  # what was open was the last step
        if found.goto is not None:
            self._go(found.goto)
            return found.result
        if found.result.proposal is not None:
            self._propose(instruction, found)
            self._refused = (found.result,) if selection else ()  # another reading would not know what is marked
        if found.kind is None or not found.result.usable:
            return found.result
        return self._turn(instruction, found)

    def _settled(self, said: str) -> tuple[Adaptation | None, str]:
        """What a sentence makes of the result that waits for it; else None, and what is left of it to be read."""
        agrees, rest = answered(said)
        if agrees is not None and not rest:
            return (self.accept() if agrees else self.dismiss(said)), ""
        if agrees:
            self.accept()
            return None, rest
        return self._edited(said, rest), rest

    @property
    def bare(self) -> bool:
        """Whether there is no trajectory yet: nothing was said, and the path stands still."""
        return not self._history.steps and self._pending is None and self.original.length == 0.0

    def begin(self, adaptation: Adaptation) -> None:
        """Begin with an adaptation whose original was made from words, where there was no trajectory.

        Raises:
            RequestError: If there is a trajectory already.
        """
        if not self.bare:
            raise RequestError("there is a trajectory already; say what should change")
        self.original, self.scene = adaptation.original, adaptation.scene
        self._history.first, self._asked, self._behind = self.situation, "", True
        self._begin(adaptation, adaptation.instruction, "said")
        self._refused = (adaptation,)  # the words told the way, too, so that they have no other reading

    def ask_about(self, said: str) -> None:
        """Remember a sentence that led to a question, which the next sentence answers."""
        self._asked = said

    def accept(self) -> Adaptation:
        """Do what the last turn proposed.

        Raises:
            RequestError: If nothing is proposed.
        """
        if self._pending is None:
            raise RequestError("nothing waits for a yes; say what should change")
        said, found = self._pending
        return self._turn(said, replace(found, result=accept(found.result)))

    def dismiss(self, said: str = "no") -> Adaptation:
        """Forget what the last turn proposed; nothing changes. After a mere no, another reading waits then, once."""
        pending, self._asked = self._pending, ""
        self._propose(said, None)
        other = self._otherwise(pending) if said.lower().strip(" .,!") in NOT_THAT else None
        if other is not None:
            return other
        note = "Nothing changed."
        return replace(
            self._blank(said), original=self.current, adapted=self.current, code="", explanation=note,
            writer=WriterInfo("feedback", reason="it was the answer to a proposal"),
        )  # fmt: skip

    def _otherwise(self, pending: tuple[str, Interpretation] | None) -> Adaptation | None:
        """Another reading of an instruction whose first one was refused, which waits for a yes in its place."""
        if pending is None or self._refused:
            return None
        said, found = pending
        if found.kind != "said" or found.on != "current" or found.result.instruction != said:
            return None
        self._refused = (found.result,)
        other = another(self._refused, isolation=self.isolation)
        if other is not None:
            self._propose(said, replace(found, result=other))
        return other

    def _edited(self, instruction: str, change: str) -> Adaptation | None:
        """The proposal done with a change, or None if the sentence is no change of it; no language model is asked."""
        assert self._pending is not None
        said, found = self._pending
        draft = self.draft()
        draft.writer = "builtin"
        draft.accept()
        count = len(draft.history.steps)
        draft.say(change)
        if len(draft.history.steps) == count or draft.steps[-1].kind not in ("knobs", "reworded"):
            return None
        return self._turn(f"{said} ({instruction})", replace(found, result=draft.steps[-1].adaptation))

    def tune(self, parameters: Mapping[str, Any], *, merge: bool = False) -> Adaptation:
        """Set parameters of the last turn's policy by name and run it again, without calling a writer.

        Args:
            parameters: New values by name.
            merge: Whether turning the same knobs again goes on with the same turn, as while a slider is dragged. Such
                a turn goes to the journal with the next one, or when `settle` is called.

        Raises:
            RequestError: If there is no turn yet.
            PolicyError: If a parameter does not exist or the policy fails with it; the turn stays as it was.
        """
        if not self.steps:
            raise RequestError("there is no policy yet; say what should change first")
        last = self.steps[-1]
        base = self._base_of_knobs(set(parameters)) if merge else last
        before = {p.name: p.value for p in base.adaptation.parameters}
        turned = {name: value for name, value in parameters.items() if name not in before or before[name] != value}
        result = rerun(base.adaptation, turned, constraints=self.constraints, isolation=self.isolation)
        if base is last:
            return self._turn(last.said, Interpretation(result, "knobs", last.feedback_on), wait=merge)
        result = self._against_earlier(result, "knobs", last.feedback_on)
        self._history.steps[self._history.head] = replace(last, adaptation=result)
        self._open = self._open or "again"
        return result

    def _base_of_knobs(self, names: set[str]) -> Step:
        """The turn whose parameters are tuned: the last, or the one before if the last only tuned these."""
        last = self.steps[-1]
        if last.kind != "knobs" or len(self.steps) < 2:
            return last
        base = self.steps[-2]
        before = {p.name: p.value for p in base.adaptation.parameters}
        turned = {p.name for p in last.adaptation.parameters if before.get(p.name) != p.value}
        return base if turned <= names else last

    def recode(self, code: str) -> Adaptation:
        """Run edited code in place of the last turn's policy.

        Raises:
            PolicyError: If the code is refused or fails, with the line; nothing changes then.
        """
        last = self.steps[-1] if self.steps else None
        before = self._blank("edited the code") if last is None else last.adaptation
        policy = parse(code)
        noted = {(p.name, p.comment) for p in policy.parameters}
        if before.code:
            noted &= {(p.name, p.comment) for p in parse(before.code).parameters}
        known = [p for p in before.parameters if any(name == p.name for name, _ in noted)]
        edited = replace(
            before,
            code=policy.source,
            parameters=policy.described_by(known).parameters,
            plan=("Run the code as edited by hand.",),
            assumptions=(),
        )
        result = rerun(edited, {}, constraints=self.constraints, isolation=self.isolation)
        return self._turn("edited the code", Interpretation(result, "code", last.feedback_on if last else "current"))

    def draw(self, said: str, code: str, plan: str) -> Adaptation:
        """Edit the current trajectory by hand: run a policy of what the hand did, as a turn of its own.

        Raises:
            PolicyError: If the policy is refused or fails; nothing changes then.
        """
        policy = parse(code)
        start = replace(
            self._blank(said), original=self.current, code=policy.source, parameters=policy.parameters, plan=(plan,)
        )
        result = rerun(start, {}, constraints=self.constraints, isolation=self.isolation)
        return self._turn(said, Interpretation(result, "drawn"))

    def change(
        self,
        said: str,
        *,
        original: Trajectory | None = None,
        scene: Scene | None = None,
        robot: Robot | None = None,
        constraints: ConstraintOptions | None = None,
    ) -> Adaptation:
        """Change the session's trajectory, scene, robot or options and rerun every active policy, without a writer.

        Raises:
            PolicyError: If a policy fails in the new situation; nothing changes then.
        """
        now = self.situation
        then = Situation(
            original or now.original, scene or now.scene, robot or now.robot, constraints or now.constraints
        )
        turns = [result for result in self._history.results if result.code != UNCHANGED]
        afresh = self._again(turns, then)
        if afresh:
            losses = lost(turns[:-1], self.current, afresh[-1], scene=now.scene, afresh=afresh[:-1])
            losses = losses or lost(afresh[:-1], afresh[-1].original, afresh[-1], by_hand=self._drawn)
            result = replace(afresh[-1], lost=tuple(loss.report for loss in losses))
        else:
            result = enforced(said, then.original, then.scene, then.robot, constraints=then.constraints)
        moved = original is not None or scene is not None
        kind: Kind = "hand" if moved or then.constraints.pinned != now.constraints.pinned else "limits"
        self._take(then)
        self._add(Step(said, "current", result, kind))
        return result

    def undo(self) -> bool:
        """Take the last turn back; say whether there was one."""
        return self._go(self._history.back())

    def redo(self) -> bool:
        """Bring the turn that was last taken back again; say whether there was one."""
        return self._go(self._history.forth())

    def branch(self, turn: int) -> None:
        """Go on from any turn that was ever made, or from `ROOT`; the turns after it stay in the history.

        Raises:
            RequestError: If there is no such turn.
        """
        if not ROOT <= turn < len(self._history.steps):
            raise RequestError(f"there is no turn {turn + 1}; there are {len(self._history.steps)}")
        self._go(turn)

    def draft(self) -> Session:
        """A copy whose turns do not count until `adopt`, so that a slow turn can be cancelled."""
        draft = copy(self)
        draft._history, draft._journal, draft._open, draft._behind = self._history.copy(), None, "", False
        return draft

    def adopt(self, draft: Session) -> None:
        """Take over the new turns of a draft of this session.

        Raises:
            RequestError: If the session has gone on since the draft was made.
        """
        mine, theirs = self._history, draft._history
        known = len(mine.steps)
        if theirs.parents[:known] != mine.parents or theirs.steps[:known] != mine.steps:
            raise RequestError("the session has gone on since; say it again")
        self.settle()
        for i in range(known, len(theirs.steps)):
            mine.go(theirs.parents[i])
            mine.add(theirs.steps[i])
            self._note(mine.event(i))
        if mine.head != theirs.head:
            self._go(theirs.head)
        self._asked = draft._asked
        if self._pending is not draft._pending:
            self._propose(*(draft._pending or ("", None)))

    def keep(self, path: str) -> None:
        """Write this session to a new journal from now on, so that a killed process loses at most the turn it was in.

        Raises:
            FormatError: If it cannot be written.
        """
        self._journal, self._behind = Journal(path), True
        self._note({})

    @property
    def kept(self) -> bool:
        """Whether this session is written to a journal."""
        return self._journal is not None

    def settle(self) -> None:
        """Write what `tune(..., merge=True)` left open to the journal."""
        if self._open:
            event = self._history.event(self._history.head)
            if self._open == "again":
                event = {**event, "event": "again", "at": self._history.head}
            self._open = ""
            self._note(event)

    def save(self, path: str) -> None:
        """Write the whole session with every turn to one file, atomically; keys and writers are not in it.

        Raises:
            FormatError: If it cannot be written there.
        """
        self.settle()
        write_session(path, self._history)

    @classmethod
    def load(cls, path: str, *, writer: PolicyWriter | str = "auto", isolation: Isolation = "auto") -> Session:
        """Read a session that `save` wrote, without running any of its policies.

        Raises:
            FormatError: If the file is no session; names the file and the key.
        """
        return cls._of(read_session(path), writer, isolation)

    @classmethod
    def resume(cls, path: str, *, writer: PolicyWriter | str = "auto", isolation: Isolation = "auto") -> Session:
        """Go on with a session from its journal, and keep it there; a turn that was cut off is gone.

        Raises:
            FormatError: If the journal cannot be read.
        """
        journal = Journal(path)
        events = journal.read()
        session = cls._of(replayed(events, path), writer, isolation)
        least = session._history.events()
        if len(events) > 2 * len(least):
            journal.rewrite(least)
        session._journal = journal
        return session

    @classmethod
    def _of(cls, history: History, writer: PolicyWriter | str, isolation: Isolation) -> Session:
        first = history.first
        session = cls(first.original, first.scene, first.robot, writer, first.constraints, isolation)
        session._history = history
        waiting = history.proposed
        session._settle_on(history.head)
        if waiting is not None:
            history.proposed = waiting
            session._pending = (
                waiting.said,
                Interpretation(
                    waiting.adaptation, waiting.kind, waiting.feedback_on, same_utterance=waiting.same_utterance
                ),
            )
        return session

    def _again(self, turns: Sequence[Adaptation], then: Situation) -> list[Adaptation]:
        """Run policies one after the other in another situation."""
        results: list[Adaptation] = []
        for turn in turns:
            start = results[-1].adapted if results else then.original
            asked = replace(turn, original=start, scene=then.scene, robot=then.robot)
            results.append(rerun(asked, {}, constraints=then.constraints, isolation=self.isolation))
        return results

    def _against_earlier(self, result: Adaptation, kind: Kind, on: FeedbackOn) -> Adaptation:
        """A result that names the postconditions of earlier turns which it loses."""
        if on == "original" and kind in ("said", "opened"):
            return result  # it holds everything that was said before
        turns = self._history.results
        if kind in OWN:
            losses = lost(turns, self.current, result, by_hand=kind == "drawn")
        else:  # the last turn again, otherwise
            losses = lost(turns[:-1], result.original, result, by_hand=self._drawn)
        return replace(result, lost=tuple(loss.report for loss in losses)) if losses else result

    @property
    def _drawn(self) -> bool:
        """Whether the last turn in force is an edit by hand, perhaps with its knobs turned since."""
        return next((step.kind for step in reversed(self.steps) if step.kind in OWN), "said") == "drawn"

    def _blank(self, said: str) -> Adaptation:
        start = self.original
        return Adaptation(said, "done", start, start, scene=self.scene, robot=self.robot, code=UNCHANGED)

    def _turn(self, said: str, found: Interpretation, *, wait: bool = False) -> Adaptation:
        """Add a result, which then names what it loses of earlier turns."""
        result = self._against_earlier(found.result, found.kind or "said", found.on)
        self._add(_step(said, replace(found, result=result)), wait=wait)
        return result

    def _add(self, step: Step, *, wait: bool = False) -> None:
        self.settle()
        self._pending = None
        before = self._history.situation(self._history.head)
        now = self.situation
        self._history.add(replace(step, situation=None if _same(before, now) else now))
        if wait:
            self._open = "turn"
        else:
            self._note(self._history.event(self._history.head))

    def _go(self, turn: int | None) -> bool:
        if turn is None:
            return False
        self.settle()
        self._pending = None
        self._settle_on(turn)
        self._note({"event": "head", "at": turn})
        return True

    def _settle_on(self, turn: int) -> None:
        self._history.go(turn)
        self._take(self._history.situation(turn))

    def _take(self, then: Situation) -> None:
        self.original, self.scene = then.original, then.scene
        self.robot, self.constraints = then.robot, then.constraints

    def _note(self, event: Mapping[str, Any]) -> None:
        if self._journal is None:
            return
        behind, self._behind = self._behind, True
        if behind:
            self._journal.rewrite(self._history.events())
        else:
            self._journal.add(event)
        self._behind = False


def _step(said: str, found: Interpretation) -> Step:
    """The turn that an utterance comes to."""
    return Step(said, found.on, found.result, found.kind or "said", same_utterance=found.same_utterance)


def _same(a: Situation, b: Situation) -> bool:
    return a.original is b.original and a.scene is b.scene and a.robot == b.robot and a.constraints == b.constraints
