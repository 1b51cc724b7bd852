"""The turns of a session: utterance or edit, situation, result, and how the turns branch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any, Literal, cast, get_args

from ovita.errors import FormatError
from ovita.io import atomic_write, scene_dict, trajectory_rows
from ovita.io.documents import SceneField, validated
from ovita.io.files import read_text
from ovita.io.json_ import check_values, dumps, parse_object
from ovita.io.waypoints import TrajectoryRows
from ovita.limits import ConstraintOptions
from ovita.paths.robot import Robot
from ovita.paths.trajectory import Trajectory
from ovita.request import FeedbackOn
from ovita.result import Adaptation

SCHEMA = "ovita.session/1"
"""Value of `schema` in a session file and in the first event of a journal."""

Kind = Literal["said", "knobs", "reworded", "code", "hand", "drawn", "limits", "opened"]
"""How a turn came about: words, knobs, the last turn in other words, edited code, a hand edit of what the turns
began with, a hand edit of what they came to, changed limits, or a result that was opened."""

OWN: frozenset[Kind] = frozenset({"said", "drawn", "opened"})
"""Kinds that are turns of their own; the others correct the turn before."""

ROOT = -1
"""The place before the first turn."""


@dataclass(frozen=True)
class Situation:
    """What a session is about.

    Args:
        original: The trajectory that it began with, or that hand edits made of it.
        scene: Its surroundings.
        robot: The limits.
        constraints: How limits are enforced.
    """

    original: TrajectoryRows
    scene: SceneField
    robot: Robot
    constraints: ConstraintOptions

    def to_document(self) -> dict[str, Any]:
        """The situation as JSON values; custom constraints, which are programs, are left out."""
        return {
            "original": trajectory_rows(self.original),
            "timestep": self.original.timestep,
            "scene": scene_dict(self.scene),
            "robot": asdict(self.robot),
            "constraints": asdict(replace(self.constraints, custom=())),
        }

    @classmethod
    def from_document(cls, document: Mapping[str, Any], file: str) -> Situation:
        """Build a situation from what `to_document` made.

        Raises:
            FormatError: If a key is missing or malformed.
        """
        key = "situation"
        known = validated(cls, dict(document), file, key)
        timestep = validated(float, document.get("timestep"), file, f"{key}.timestep")
        return replace(known, original=replace(known.original, timestep=timestep))


@dataclass(frozen=True)
class Step:
    """One turn of a session.

    Args:
        said: What the person said, or what was done in words such as "moved the cup".
        feedback_on: Which trajectory it was about.
        adaptation: The result. Its instruction is `said`, or for feedback on the original everything said
            since the original, since that is what was applied.
        kind: How it came about.
        situation: What the session was about then, or None where it did not change.
        same_utterance: Whether it was said in one utterance with the turn before, so that both are taken back together.
    """

    said: str
    feedback_on: FeedbackOn
    adaptation: Adaptation
    kind: Kind = "said"
    situation: Situation | None = None
    same_utterance: bool = False

    def to_document(self) -> dict[str, Any]:
        """The turn as JSON values."""
        return {
            "kind": self.kind,
            "said": self.said,
            "on": self.feedback_on,
            "situation": None if self.situation is None else self.situation.to_document(),
            "adaptation": self.adaptation.to_document(),
            **({"same_utterance": True} if self.same_utterance else {}),
        }

    @classmethod
    def from_document(cls, document: Mapping[str, Any], file: str) -> Step:
        """Build a turn from what `to_document` made.

        Raises:
            FormatError: If a key is missing or malformed.
        """
        said, on, kind = document.get("said"), document.get("on"), document.get("kind")
        known: bool = on in get_args(FeedbackOn) and kind in get_args(Kind)
        if not isinstance(said, str) or not known:
            raise FormatError(file, "this is not a turn of a session", key="turn")
        situation, adaptation = document.get("situation"), document.get("adaptation")
        if not isinstance(adaptation, Mapping) or not isinstance(situation, Mapping | None):
            raise FormatError(file, "this turn holds no adaptation", key="turn")
        return cls(
            said,
            cast(FeedbackOn, on),
            Adaptation.from_document(adaptation, file=file),
            cast(Kind, kind),
            None if situation is None else Situation.from_document(situation, file),
            document.get("same_utterance") is True,
        )


@dataclass
class History:
    """Turns as a tree: undo goes to the parent, redo to the child that was last left, and nothing is ever lost.

    Args:
        first: The situation before the first turn.
        steps: Every turn, in the order in which they were made.
        parents: The turn before each, or `ROOT`.
        head: The turn that is in force, or `ROOT`.
        proposed: What waits for a yes to be a turn, or None.
    """

    first: Situation
    steps: list[Step] = field(default_factory=list)
    parents: list[int] = field(default_factory=list)
    head: int = ROOT
    proposed: Step | None = None
    _last: dict[int, int] = field(default_factory=dict)

    def copy(self) -> History:
        """A history that changes on its own."""
        return History(self.first, [*self.steps], [*self.parents], self.head, self.proposed, {**self._last})

    def path(self, at: int | None = None) -> list[int]:
        """The turns from the first to `at`, by default to the one in force."""
        here = self.head if at is None else at
        turns: list[int] = []
        while here != ROOT:
            turns.append(here)
            here = self.parents[here]
        return turns[::-1]

    @property
    def in_force(self) -> list[Step]:
        """The turns that are in force, oldest first."""
        return [self.steps[i] for i in self.path()]

    def turns(self) -> list[tuple[Step, int]]:
        """The turns that make the current trajectory of the original, oldest first.

        Returns:
            For every turn its last correction, and how many steps it took with all of them.
        """
        turns: list[tuple[Step, int]] = []
        for step in self.in_force:
            if step.kind in OWN:
                alone = step.feedback_on == "original"
                turns = [(step, sum(count for _, count in turns) + 1)] if alone else [*turns, (step, 1)]
            elif turns:
                turns[-1] = step, turns[-1][1] + 1
            elif step.kind not in ("hand", "limits") and step.adaptation.instruction:
                turns = [(step, 1)]
        return turns

    @property
    def results(self) -> list[Adaptation]:
        """The results of these turns."""
        return [step.adaptation for step, _ in self.turns()]

    def after(self, turn: int) -> Trajectory:
        """The trajectory after a turn."""
        return self.first.original if turn == ROOT else self.steps[turn].adaptation.adapted

    def add(self, step: Step) -> None:
        """Put a turn after the one in force."""
        self.steps.append(step)
        self.parents.append(self.head)
        self.go(len(self.steps) - 1)

    def go(self, turn: int) -> None:
        """Make a turn, or `ROOT`, the one in force; what was proposed is forgotten."""
        self.head, self.proposed = turn, None
        if turn != ROOT:
            self._last[self.parents[turn]] = turn

    def back(self) -> int | None:
        """What undo would go to, or None; what was said as one utterance goes together."""
        return None if self.head == ROOT else self._before(self.head)

    def steps_of(self, count: int) -> int:
        """How many steps so many utterances are, counted back from the one in force."""
        here, path = self.head, self.path()
        for _ in range(count):
            here = here if here == ROOT else self._before(here)
        return len(path) - (path.index(here) + 1 if here != ROOT else 0)

    def _before(self, at: int) -> int:
        """The turn before the utterance that a turn belongs to, or `ROOT`."""
        while self.steps[at].same_utterance and self.parents[at] != ROOT:
            at = self.parents[at]
        return self.parents[at]

    def forth(self) -> int | None:
        """What redo would go to, or None; what was said as one utterance comes back together."""
        there = self._last.get(self.head)
        while there is not None and (then := self._last.get(there)) is not None and self.steps[then].same_utterance:
            there = then
        return there

    def situation(self, turn: int) -> Situation:
        """The situation at a turn."""
        changes = (self.steps[i].situation for i in reversed(self.path(turn)))
        return next((changed for changed in changes if changed is not None), self.first)

    def event(self, turn: int) -> dict[str, Any]:
        """A turn as an event for a journal."""
        return {"event": "turn", "at": self.parents[turn], **self.steps[turn].to_document()}

    def events(self) -> list[dict[str, Any]]:
        """The fewest events that lead to this history."""
        start = {"event": "open", "schema": SCHEMA, "situation": self.first.to_document()}
        return [start, *map(self.event, range(len(self.steps))), self.now()]

    def now(self) -> dict[str, Any]:
        """Which turn is in force, and what is proposed, as an event for a journal."""
        if self.proposed is None:
            return {"event": "head", "at": self.head}
        return {"event": "proposed", "at": self.head, **self.proposed.to_document()}


def replayed(events: list[dict[str, Any]], file: str) -> History:
    """The history that events lead to; nothing is run.

    Raises:
        FormatError: If the events are not those of a session; names the event.
    """
    if not events or events[0].get("schema") != SCHEMA or not isinstance(events[0].get("situation"), Mapping):
        raise FormatError(file, f"this is no session of ovita; expected the schema {SCHEMA!r}")
    history = History(Situation.from_document(events[0]["situation"], file))
    for number, event in enumerate(events[1:], start=1):
        at, what = event.get("at"), event.get("event")
        least = {"turn": ROOT, "head": ROOT, "proposed": ROOT, "again": ROOT + 1}.get(str(what))
        if least is None or type(at) is not int or not least <= at < len(history.steps):
            raise FormatError(file, "this is not an event of a session", key="events", index=number)
        history.go(at)
        if what == "turn":
            history.add(Step.from_document(event, file))
        elif what == "proposed":
            history.proposed = Step.from_document(event, file)
        elif what == "again":
            history.steps[at] = Step.from_document(event, file)
    return history


def write_session(path: str, history: History) -> None:
    """Write a whole session to one file, atomically.

    Raises:
        FormatError: If it cannot be written there.
    """
    atomic_write(path, dumps({"schema": SCHEMA, "events": history.events()}, path))


def read_session(path: str) -> History:
    """Read what `write_session` wrote; nothing is run.

    Raises:
        FormatError: If the file is no session; names the key.
    """
    document = parse_object(read_text(path), path)
    check_values(document, path)
    events = document.get("events")
    if document.get("schema") != SCHEMA or not isinstance(events, list) or not all(isinstance(e, dict) for e in events):
        raise FormatError(path, f"this is no session of ovita; expected the schema {SCHEMA!r}", key="schema")
    return replayed(events, path)
