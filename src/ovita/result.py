"""The result of one adaptation: a trajectory together with everything that is needed to trust it."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cache
from typing import TYPE_CHECKING, Any, Literal, get_type_hints

from ovita.errors import FormatError, MissingExtra, RequestError, TrajectoryError
from ovita.instruct.frames import SemanticFrame, from_json, to_json
from ovita.io import atomic_write, load_document, save_document, scene_dict
from ovita.io.documents import SceneField, plain, validated
from ovita.io.json_ import ADAPTATION_SCHEMA as SCHEMA
from ovita.io.json_ import seal
from ovita.io.waypoints import trajectory_table
from ovita.limits import ConstraintOptions, Verdict
from ovita.measure import Changes, compare, moved_ends, sentences
from ovita.paths.robot import UNLIMITED, Robot
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory
from ovita.policy import Parameter
from ovita.text import counted, listed, quoted, sentence, shortened
from ovita.writers.base import WriterInfo

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ovita.plots.geometry import View

Status = Literal[
    "done",
    "limited",
    "not_as_meant",
    "infeasible",
    "needs_confirmation",
    "needs_clarification",
    "answered",
    "not_understood",
    "failed",
]
"""How an adaptation ended, best first; only the first four hold a trajectory that differs from the original."""

PICTURES = (".png", ".svg", ".pdf", ".html")
"""Endings of the files that pictures are written to."""

_TRAJECTORIES = ("original", "adapted", "proposed")
"""Fields that documents hold as rows of numbers."""

TAKEN_BACK = 0.95
"""Share of a change that the limits may take back before the result no longer counts as what was meant."""


@dataclass(frozen=True)
class Postcondition:
    """A postcondition of the policy, and whether it was kept.

    Args:
        text: As a sentence.
        held_before: Whether the policy's own output kept it.
        held: Whether the result kept it, after the constraints had their say.
        outcome: What was measured on the result, as a sentence.
        change_before: How far the policy's own output went from the original in the sense of the postcondition,
            or None where no amount can be measured.
        change: How far the result went.
        unit: Of both.
        kind: Of the postcondition, such as "distance", so that it can be measured again; "" where it is not known.
        arguments: Of the postcondition, as JSON values.
    """

    text: str
    held_before: bool
    held: bool
    outcome: str
    change_before: float | None = None
    change: float | None = None
    unit: str = "m"
    kind: str = ""
    arguments: Mapping[str, Any] = field(default_factory=dict)

    @property
    def states(self) -> bool:
        """Whether it describes the result by itself, such as a distance, rather than a change or what stays."""
        ends = self.kind in ("start", "goal") and bool(self.arguments)
        return ends or self.kind in ("distance", "side", "visits", "speed", "stop")

    @property
    def lost(self) -> bool:
        """Whether the policy's output met the postcondition and the limits undid it completely.

        What describes the result by itself may still hold after that; a change that was taken back does not.
        """
        broken = not self.held or not self.states
        return self.held_before and broken and self.undone is not None and self.undone >= TAKEN_BACK

    @property
    def undone(self) -> float | None:
        """Share of the change that the limits took back (0 none, 1 all), or None if there was no change to measure."""
        if self.change_before is None or self.change is None or self.change_before <= 1e-6:
            return None
        return min(max(1.0 - self.change / self.change_before, 0.0), 1.0)

    def sentences(self) -> list[str]:
        """What the limits took back, in plain words; nothing if they left it as it was."""
        if self.undone is None or self.undone <= 0.005:
            return []
        return [
            f"The limits undid {self.undone:.0%} of the change that was meant by '{self.text}': "
            f"{self.change_before:.3f} {self.unit} without them, {self.change:.3f} {self.unit} with them."
        ]


@dataclass(frozen=True)
class LostPostcondition:
    """A postcondition of an earlier turn of the conversation that no longer holds.

    Args:
        text: As a sentence.
        outcome: What was measured on the new result, as a sentence.
        instruction: The instruction of that turn.
        turns_ago: How many turns lie between, 1 for the last one.
    """

    text: str
    outcome: str
    instruction: str
    turns_ago: int

    def sentence(self) -> str:
        """What was lost, and in which turn it was requested."""
        ago = "one turn ago" if self.turns_ago == 1 else f"{self.turns_ago} turns ago"
        return f"No longer as asked {ago} by '{self.instruction}': now {self.outcome}."


@dataclass(frozen=True, repr=False)
class Adaptation:
    """One adaptation, from the instruction to the verdict.

    Args:
        instruction: The person's instruction.
        status: "done"; "limited" (done, but the limits changed it or are not all kept: see `warnings`);
            "not_as_meant" (a postcondition does not hold, nothing changed, or the path comes to a standstill);
            "infeasible" (the limits cannot all hold, `adapted` is the best effort); "needs_confirmation" (see
            `proposal`); "needs_clarification" (see `question`); "answered" (a question about the path, see
            `explanation`); "not_understood" (see `unplaced`); "failed" (see `error`).
        original: The trajectory that the instruction was about.
        adapted: The result; equal to `original` where there is none.
        proposed: What the policy returned, before the constraints, or None.
        scene: The surroundings.
        robot: The limits that were enforced.
        options: How they were enforced; custom constraints, which are programs, are not saved.
        frames: What the instruction and the feedback on it ask for, with the amounts as they were turned by hand; empty
            where another writer than the built-in one wrote the policy.
        plan: The high-level plan.
        code: The adaptation policy.
        parameters: Of the policy, with their values.
        assumptions: What was assumed because the instruction leaves it open.
        taken: What feedback was taken to mean, or "".
        lost: Postconditions of earlier turns of the conversation that no longer hold.
        explanation: Plain words for people.
        changes: The measured difference between `original` and `adapted`, or None.
        constraints: The verdict on the limits, or None.
        postconditions: Of the policy, and whether they were kept.
        contacts: Objects that the change is meant to touch.
        writer: Who wrote the policy.
        attempts: How many policies were written until one worked.
        question: The question back, or "".
        unplaced: Words that could not be placed, or that the proposal does not use.
        proposal: For "needs_confirmation" the whole result of the reading that a person has to agree to (`accept`).
        error: Why it failed, or "".
        isolation: How the policy was isolated while it ran, or "".
        warnings: What a person should look at.
        timings_ms: Milliseconds by stage.
    """

    instruction: str
    status: Status
    original: Trajectory
    adapted: Trajectory
    proposed: Trajectory | None = None
    scene: Scene = field(default_factory=Scene)
    robot: Robot = UNLIMITED
    options: ConstraintOptions = field(default_factory=ConstraintOptions)
    frames: tuple[SemanticFrame, ...] = ()
    plan: tuple[str, ...] = ()
    code: str = ""
    parameters: tuple[Parameter, ...] = ()
    assumptions: tuple[str, ...] = ()
    taken: str = ""
    lost: tuple[LostPostcondition, ...] = ()
    explanation: str = ""
    changes: Changes | None = None
    constraints: Verdict | None = None
    postconditions: tuple[Postcondition, ...] = ()
    contacts: tuple[str, ...] = ()
    writer: WriterInfo = field(default_factory=lambda: WriterInfo("none"))
    attempts: int = 0
    question: str = ""
    unplaced: tuple[str, ...] = ()
    proposal: Adaptation | None = None
    error: str = ""
    isolation: str = ""
    warnings: tuple[str, ...] = ()
    timings_ms: Mapping[str, float] = field(default_factory=dict)

    @property
    def verdict(self) -> str:
        """The line that exported files carry: "" for a result that is done, else its status and message."""
        return "" if self.status == "done" else " ".join(f"{self.status}: {self.message}".split())

    @property
    def mark(self) -> str:
        """What the default name of an exported file ends in: "" for a result that is done, such as "-infeasible"."""
        return "" if self.status == "done" else f"-{self.status.replace('_', '-')}"

    @property
    def usable(self) -> bool:
        """Whether there is a new trajectory, even one that breaks limits."""
        return self.status in ("done", "limited", "not_as_meant", "infeasible")

    @property
    def assumed(self) -> tuple[str, ...]:
        """Interpretation of the feedback, and assumptions."""
        return (self.taken, *self.assumptions) if self.taken else self.assumptions

    @property
    def cautions(self) -> tuple[str, ...]:
        """What a person should check: warnings, and postconditions of earlier turns that no longer hold."""
        return (*self.warnings, *(loss.sentence() for loss in self.lost))

    @property
    def message(self) -> str:
        """How it went, in a sentence or two."""
        if self.writer.kind == "feedback" and self.usable:
            return self.explanation
        match self.status:
            case "done":
                return self._done()
            case "limited":
                return self._limited()
            case "not_as_meant":
                return f"Not as meant: {' '.join(self._broken or self.warnings)}"
            case "infeasible":
                conflicts = self.constraints.conflicts if self.constraints else ()
                return f"The limits cannot all hold, so this is the best effort: {' '.join(conflicts)}"
            case "needs_clarification":
                return self.question
            case "answered":
                return self.explanation
        return self.error if self.proposal is None else self._understood(self.proposal)

    @property
    def _broken(self) -> list[str]:
        return [p.outcome for p in self.postconditions if p.lost or not p.held]

    def _done(self) -> str:
        if self.lost:
            lost = " ".join(loss.sentence() for loss in self.lost)
            return f'Done, but: {lost} Say "keep it" to have it as asked.'
        return "Done." if not self.warnings else f"Done, with {counted(len(self.warnings), 'warning')}."

    def _limited(self) -> str:
        if self.constraints is None or self.constraints.status == "off":
            return "Done, but the limits were only measured, and not all of them are kept."
        said = self.by_limits
        lost = f": they {listed(said)}." if said else "."
        if self.constraints.status == "preexisting":
            also = f" It was changed by the limits{lost}" if said else ""
            return f"Done, but the path breaks a limit that the original path broke already.{also}"
        return f"Done, but changed by the limits{lost}"

    @property
    def by_limits(self) -> tuple[str, ...]:
        """What the limits did to what was proposed, as phrases; none where they left it as it was."""
        taken = [f"{p.undone:.0%} of '{p.text}'" for p in self.postconditions if p.undone and p.undone > 0.005]
        did = self.constraints.did if self.constraints is not None else ()
        return (*[f"took back {', '.join(taken)}"] * bool(taken), *did)

    def _understood(self, proposal: Adaptation) -> str:
        """The reading in plain words, what it leaves out, why it is not certain, and how it would come out."""
        steps = [step.strip().rstrip(".") for step in proposal.plan]
        said = [f"I understood: {'; '.join(step[:1].lower() + step[1:] for step in steps)}."]
        ends = moved_ends(proposal.changes, "would move") if proposal.changes else []
        said += [sentence(text) for text in ends]
        said += [f"Not used: {quoted(self.unplaced)}."] if self.unplaced else []
        said += [] if self.unplaced or self.warnings else ["I am not sure that I read it right."]
        kept = proposal.status == "limited" and not proposal.by_limits
        return " ".join([*said, *self.warnings, *_COMES_OUT.get("" if kept else proposal.status, ())])

    def __repr__(self) -> str:
        return f"<Adaptation {shortened(self.instruction)}: {self.status}; {self.adapted!r}>"

    def to_numpy(self) -> Array:
        """The adapted trajectory as rows x, y, z [m], speed [m/s], (N, 4); with a quaternion wxyz where it has one."""
        return self.adapted.to_numpy()

    def plot(
        self,
        path: str | None = None,
        *,
        robot: Robot | None = None,
        view: View = "auto",
        tube: Array | None = None,
    ) -> Figure | None:
        """Draw the path before and after; of a proposal, as it would become.

        Args:
            path: Writes the picture to this .png, .svg, .pdf or .html file; None only returns the figure.
            robot: Whose workspace to draw; None takes the result's.
            view: "3d", "top" (from above), or "auto".
            tube: Covariance of the adapted positions, rows xx, xy, xz, yy, yz, zz (N, 6) [m2]; None for none.

        Returns:
            The matplotlib figure; None where an .html file is written.

        Raises:
            FormatError: If the file's name has another ending, or it cannot be written.
            MissingExtra: If matplotlib, or for .html plotly, is not installed.
        """
        from ovita import plots

        ending = os.path.splitext(path or "")[1].lower()
        if path is not None and ending not in PICTURES:
            raise FormatError(path, f"pictures are written as {', '.join(PICTURES)}")
        waits = self.proposal is not None
        shown = self.proposal or self
        title = f"Proposal, not done yet: {self.instruction}" if waits else self.instruction
        paths = (shown.original, shown.adapted, shown.scene)
        proposed = None if shown.proposed == shown.adapted else shown.proposed
        how: dict[str, Any] = {"robot": robot or shown.robot, "proposed": proposed, "title": title}
        how |= {"view": view, "tube": tube}
        if path is not None and ending == ".html":
            notes = (self.message if waits else self.explanation).split("\n")
            atomic_write(path, plots.interactive(*paths, notes=notes, **how))
            return None
        checks = shown.constraints.checks if shown.constraints else None
        drawing = plots.figure(*paths, violations=checks, **how)
        if path is not None:
            plots.save(path, drawing)
        return drawing

    def _repr_html_(self) -> str:
        """Picture, plan and verdict for a notebook; without matplotlib, the words alone."""
        from ovita import plots

        shown = self.proposal or self
        picture, missing = None, ""
        try:
            picture = self.plot()
        except MissingExtra as error:
            missing = f"No picture: {error}."
        known = facts(shown)
        sections = {"Plan": known["plan"], "Changes": known["changes"], "Limits": known["limits"]}
        sections |= {"Assumed": [*shown.assumed], "Knobs": known["parameters"]}
        sections |= {"Warnings": [*shown.cautions, *([missing] if missing else [])]}
        return plots.card(self.instruction, f"{self.status.replace('_', ' ')}: {self.message}", sections, picture)

    def to_document(self) -> dict[str, Any]:
        """The adaptation as JSON values; `from_document` reads it back to an equal adaptation."""
        document = self._document()
        own = {key: None if document[key] is None else document[key].rows.tolist() for key in _TRAJECTORIES}
        return {**document, **own, "proposal": None if self.proposal is None else self.proposal.to_document()}

    def _document(self) -> dict[str, Any]:
        """As `to_document`, with trajectories as tables, one for those that are the same."""
        paths = {id(path): path for path in (self.original, self.adapted, self.proposed)}
        tables = {key: None if path is None else trajectory_table(path) for key, path in paths.items()}
        saved = replace(self, options=replace(self.options, custom=()))
        document: dict[str, Any] = {
            "schema": SCHEMA,
            **{key: plain(getattr(saved, key)) for key in _kinds() if key not in ("scene", "frames")},
            "message": self.message,
            **{key: tables[id(getattr(self, key))] for key in _TRAJECTORIES},
            "timestep": self.original.timestep,
            "scene": scene_dict(self.scene),
            "proposal": None if self.proposal is None else self.proposal._document(),
            "frames": to_json(self.frames),
        }
        document["writer"]["attempts"] = document.pop("attempts")
        return {**document, "sha256": seal(document)}

    @classmethod
    def from_document(cls, document: Mapping[str, Any], *, file: str = "document") -> Adaptation:
        """Build an adaptation from `to_document`'s output, also from one that earlier versions of ovita wrote.

        Raises:
            FormatError: If a key is missing or has another shape; names the file and the key.
        """

        def read(key: str, kind: Any) -> Any:
            if key not in given:
                raise FormatError(file, "is missing; is this a result of 'ovita adapt'?", key=key)
            return validated(kind, given[key], file, key)

        def path(key: str) -> Trajectory | None:
            rows = read(key, list[list[float]] | None if key == "proposed" else list[list[float]])
            try:
                return None if rows is None else Trajectory.from_array(rows, timestep=timestep)
            except TrajectoryError as error:
                raise FormatError(file, str(error), key=key) from None

        given = dict(document)
        writer = dict(read("writer", dict[str, Any]))
        given |= {"attempts": writer.pop("attempts", 0), "writer": writer}
        timestep = read("timestep", float)
        report = given.get("changes")
        of_0_1_0 = isinstance(report, Mapping) and "matching" in report and "shape" not in report
        added = {"options", "taken", "lost", "frames"} - set(given) | ({"changes"} if of_0_1_0 else set())
        if earlier := given.get("status") == "ok":
            given["status"] = "done"
        kinds = {**_kinds(), "frames": list[dict[str, Any]]}
        values = {key: read(key, kind) for key, kind in kinds.items() if key not in added}
        try:
            values["frames"] = from_json(values.get("frames", ()))
        except ValueError as error:
            raise FormatError(file, str(error), key="frames") from None
        values |= {key: path(key) for key in _TRAJECTORIES}
        if earlier:
            values["status"] = judged_status(values["constraints"], values["postconditions"])
        if of_0_1_0:
            values["changes"] = compare(values["original"], values["adapted"], values["scene"])
        return cls(**values, proposal=cls._proposal_of(values["status"], given.get("proposal"), file))

    @classmethod
    def _proposal_of(cls, status: Status, held: object, file: str) -> Adaptation | None:
        waits = status == "needs_confirmation"
        if waits != (held is not None):
            wanted = "is missing" if waits else f"has no place under the status {status!r}"
            raise FormatError(file, wanted, key="proposal")
        if not waits:
            return None
        document = validated(dict[str, Any], held, file, "proposal")
        try:
            proposal = cls.from_document(document, file=file)
        except FormatError as error:
            raise FormatError(file, error.problem, key=f"proposal.{error.key}", index=error.index) from None
        if not proposal.usable:
            raise FormatError(file, "holds no result of its own", key="proposal")
        return proposal

    def save(self, path: str) -> None:
        """Write the adaptation as JSON, atomically.

        Raises:
            FormatError: If the file cannot be written.
        """
        save_document(path, self._document())

    @classmethod
    def load(cls, path: str) -> Adaptation:
        """Read an adaptation that `save` wrote.

        Raises:
            FormatError: If the file is no adaptation; names the file and the key.
        """
        return cls.from_document(load_document(path), file=str(path))


_COMES_OUT: Mapping[str, tuple[str, ...]] = {
    "limited": ("The limits would change it.",),
    "not_as_meant": ("It would not come out as meant.",),
    "infeasible": ("The limits could not all hold.",),
}
"""What is said of a proposal that would not simply be done."""


def accept(result: Adaptation) -> Adaptation:
    """The result that was proposed, now that a person agrees to it.

    Raises:
        RequestError: If nothing was proposed.
    """
    if not isinstance(result, Adaptation):
        raise RequestError("accept takes an adaptation that waits for a yes")
    if result.proposal is None:
        raise RequestError(f"there is no proposal to accept; the status is {result.status!r}")
    return result.proposal


NEGLIGIBLE = 1e-3
"""What the limits may take back without a change that anybody would call one [m, m/s, m/s^2]."""

UNSEEN, UNMISSED = 0.01, 0.1
"""Up to here nobody sees what the limits changed: metres and m/s, and the share of a promise that they took back."""


def judged_status(verdict: Verdict | None, postconditions: Sequence[Postcondition], *, vain: bool = False) -> Status:
    """The status of a result, from best to worst: done, limited, not as meant, infeasible.

    It is `vain` where nothing changed, or where it comes to a standstill.
    """
    if verdict is not None and verdict.status == "infeasible":
        return "infeasible"
    if vain or any(p.lost or not (p.held or p.held_before) for p in postconditions):
        return "not_as_meant"
    return "done" if verdict is None or _kept(verdict, postconditions) else "limited"


def _kept(verdict: Verdict, postconditions: Sequence[Postcondition]) -> bool:
    """Whether the limits left the result as it was meant, or nearly so."""
    if verdict.status == "repaired":
        little = all(check.violation_before <= NEGLIGIBLE for check in verdict.checks)
        return little or _unseen(verdict, postconditions)
    return verdict.status == "satisfied" or (verdict.status == "off" and verdict.ok)


def _unseen(verdict: Verdict, postconditions: Sequence[Postcondition]) -> bool:
    """Whether every promise is kept, nearly in full, and the path was moved and slowed by less than anybody sees."""
    seen = [check for check in verdict.checks if check.unit not in ("m", "m/s") or check.violation_before > UNSEEN]
    least = all(check.violation_before <= NEGLIGIBLE for check in seen) and verdict.max_shift <= UNSEEN
    return least and all(p.held and (p.undone or 0.0) <= UNMISSED for p in postconditions)


_HEADINGS = {
    "plan": "What was done",
    "changes": "What changed",
    "promises that do not hold": "What did not come out as meant",
    "limits": "Limits",
    "assumptions": "What was assumed",
    "parameters": "What you can turn",
}


def facts(result: Adaptation) -> dict[str, list[str]]:
    """Everything that an explanation may say, by topic, each as sentences or short lines."""
    told = (result.constraints, *result.postconditions)
    return {
        "instruction": [" ".join(result.instruction.split())],
        "plan": [*result.plan],
        "changes": [str(text) for text in sentences(result.changes)] if result.changes else [],
        "promises that do not hold": [p.outcome for p in result.postconditions if not p.held],
        "limits": [text for part in told if part is not None for text in part.sentences()],
        "assumptions": [*result.assumptions],
        "parameters": [parameter.line for parameter in result.parameters],
    }


def explain(result: Adaptation) -> str:
    """Explain a result in plain words from a template; every number is measured or a parameter."""
    known = facts(result)
    parts = [f'You asked: "{known["instruction"][0]}".']
    for topic, heading in _HEADINGS.items():
        if known[topic]:
            parts.append("\n".join([f"{heading}:", *(f"- {line}" for line in known[topic])]))
    return "\n".join(parts)


@cache
def _kinds() -> dict[str, Any]:
    """The fields of a document other than its trajectories and proposal, with their types."""
    kinds = get_type_hints(Adaptation)
    own = (*_TRAJECTORIES, "proposal")
    kept = {item.name: kinds[item.name] for item in fields(Adaptation) if item.name not in own}
    return {**kept, "scene": SceneField}
