"""What clients can have done, whatever they speak: every tool of MCP and every path of REST ends in a method here."""

from __future__ import annotations

import json
import tempfile
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

from ovita import gate
from ovita.dialogue.session import Session
from ovita.errors import FormatError, OvitaError, RequestError
from ovita.io import (
    Task,
    is_skill,
    json_,
    load_bare,
    load_scene,
    load_task,
    rendered,
    save_trajectory,
    scene_dict,
    with_scene,
)
from ovita.measure import compare, sentences
from ovita.paths.scene import Scene
from ovita.policy.sandbox import Isolation
from ovita.result import Adaptation
from ovita.serve import messages as m
from ovita.serve.access import (
    AccessRules,
    AuditLog,
    Caller,
    NotAllowed,
    RateLimiter,
    TooManyRequests,
    Unanswered,
    one_line,
)
from ovita.serve.tasks import NoSuchTask, OpenTask, OpenTasks
from ovita.text import clean_text
from ovita.writers.base import PolicyWriter

MAX_OBJECTS = 200
"""Most objects that a report lists."""

LONGEST_TEXT = 1_200
"""Most characters of a file's text that a report holds."""

RESOURCES = {
    "path.csv": "text/csv",
    "before.csv": "text/csv",
    "result.json": "application/json",
    "scene.json": "application/json",
    "picture.png": "image/png",
}
"""What can be read of a turn, and its media type."""


ADDRESS = "ovita://tasks/{task}/turns/{turn}/{name}"
"""How a resource is addressed."""


def address_of(task: str, turn: int, name: str) -> str:
    """The address of a resource."""
    return ADDRESS.format(task=task, turn=turn, name=name)


@dataclass
class Application:
    """Tools over open tasks.

    Args:
        sent: The log of sendings; None takes the user's own.
    """

    rules: AccessRules
    folder: Path
    audit: AuditLog
    writer: PolicyWriter | str = "auto"
    isolation: Isolation = "auto"
    sent: str | None = None
    tasks: OpenTasks = field(init=False)
    rate: RateLimiter = field(init=False)
    _saving: threading.Lock = field(default_factory=threading.Lock, init=False)

    def __post_init__(self) -> None:
        self.tasks = OpenTasks(self.folder, self.rules.tasks, self.rules.idle, self.writer, self.isolation)
        self.rate = RateLimiter(self.rules.rate)

    @contextmanager
    def logged(self, caller: Caller, tool: str, about: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
        """Count a call against its owner's rate and write what became of it to the audit log.

        Of the call's arguments only the task's name and the place are logged.

        Raises:
            TooManyRequests: If the owner asks too often.
        """
        event: dict[str, Any] = {
            "request": caller.request,
            "owner": caller.owner,
            "client": caller.client,
            "transport": caller.transport,
            "tool": tool,
            **{key: str(about[key]) for key in ("task", "turn", "path", "to") if about.get(key) is not None},
        }
        try:
            self.rate.take(caller.owner)
            yield event
        except OvitaError as error:
            refused = isinstance(error, NotAllowed | TooManyRequests | NoSuchTask)
            if not isinstance(error, TooManyRequests) or error.first:  # nobody fills the log by asking too often
                self.audit.add({**event, "outcome": "refused" if refused else "failed", "why": str(error)})
            raise
        except Unanswered:
            self.audit.add({**event, "outcome": "asked"})
            raise
        except Exception as error:
            self.audit.add({**event, "outcome": "crashed", "why": type(error).__name__})
            raise
        self.audit.add({"outcome": "done", **event})

    def open_task(self, caller: Caller, given: m.OpenArguments) -> m.TaskReport:
        """Open a trajectory with its scene."""
        task, shown = self._read(given.path, given.document)
        if given.scene is not None:
            task = with_scene(task, *self._scene_of(given.scene, None))
        if len(task.trajectory) > self.rules.waypoints:
            count = len(task.trajectory)
            raise NotAllowed(f"{shown} has {count} waypoints; up to {self.rules.waypoints} are taken here")
        robot = self.rules.robot(given.robot or task.robot)
        session = Session(task.trajectory, task.scene, robot, self.writer, isolation=self.isolation)
        opened = self.tasks.add(caller.owner, session)
        said = {"instruction": task.instruction} if task.instruction else {}
        return self._task_report(opened, notes=task.notes, texts=said)

    def describe(self, caller: Caller, given: m.TaskArguments) -> m.TaskReport:
        """Say what a task is about and what was done so far."""
        with self._using(caller.owner, given.task) as task:
            return self._task_report(task)

    def adapt(self, caller: Caller, given: m.AdaptArguments) -> m.AdaptationReport:
        """Adapt to an instruction or to feedback."""
        with self._using(caller.owner, given.task) as task:
            session = task.session
            if session.bare:
                from ovita.sources.words import begun

                result = begun(session, given.instruction)
            else:
                result = session.say(given.instruction, on=given.on)
            return self._adaptation_report(task, result)

    def accept(self, caller: Caller, given: m.AcceptArguments) -> m.AdaptationReport:
        """Do what a shown reading proposes."""
        with self._using(caller.owner, given.task) as task:
            waiting = task.session.pending
            if waiting is None:
                raise RequestError("nothing waits for a yes; call adapt")
            if _proposal_id(waiting) != given.proposal:
                raise RequestError("another reading waits for a yes than this one; call adapt again to see it")
            return self._adaptation_report(task, task.session.accept())

    def set_knob(self, caller: Caller, given: m.KnobArguments) -> m.AdaptationReport:
        """Turn a knob of the last turn."""
        with self._using(caller.owner, given.task) as task:
            value = given.value
            before = {p.name: p.value for p in task.result(None).parameters}.get(given.name)
            if isinstance(before, int) and not isinstance(before, bool) and isinstance(value, float):
                value = int(value) if value.is_integer() else value
            return self._adaptation_report(task, task.session.tune({given.name: value}))

    def undo(self, caller: Caller, given: m.TaskArguments) -> m.TaskReport:
        """Take the last turn back."""
        with self._using(caller.owner, given.task) as task:
            if not task.session.undo():
                raise RequestError("there is nothing to undo")
            return self._task_report(task)

    def explain(self, caller: Caller, given: m.TurnArguments) -> m.ExplanationReport:
        """Explain a turn, with everything measured again."""
        with self._using(caller.owner, given.task) as task, _saved(task.result(given.turn)) as file:
            return m.ExplanationReport(task=task.id, turn=task.at(given.turn), explanation=gate.explained(file))

    def compare(self, caller: Caller, given: m.CompareArguments) -> m.ComparisonReport:
        """Say what differs between two turns."""
        with self._using(caller.owner, given.task) as task:
            a, b = task.at(given.a), task.at(given.b)
            changes = sentences(compare(task.path(a), task.path(b), task.session.scene))
            return m.ComparisonReport(task=task.id, a=a, b=b, changes=tuple(map(str, changes)))

    def check(self, caller: Caller, given: m.TurnArguments) -> m.CheckReport:
        """Measure every limit anew, as the gate does before anything is sent."""
        with self._using(caller.owner, given.task) as task, _saved(task.result(given.turn)) as file:
            found = gate.review(file)
            said = {key: getattr(found, key) for key in ("released", "refusals", "cautions", "checks")}
            return m.CheckReport(task=task.id, turn=task.at(given.turn), **said)

    def simulate(self, caller: Caller, given: m.SimulateArguments) -> m.SimulationReport:
        """Let a robot follow the path of a turn in simulation."""
        from ovita import sim

        with self._using(caller.owner, given.task) as task:
            turn, path, session = task.at(given.turn), task.path(given.turn), task.session
        name = given.robot or session.robot.name
        if name not in (*sim.SHIPPED, *sim.STAND_INS):
            raise RequestError(f"name the robot that follows it: {', '.join(sim.STAND_INS)}")
        if path.duration > self.rules.seconds:
            raise NotAllowed(f"the path lasts {path.duration:.0f} s; up to {self.rules.seconds:g} s are simulated here")
        contacts = task.result(turn).contacts if turn else ()
        sim.require()
        done = sim.simulate(path, session.scene, name, limits=session.robot, contacts=contacts)
        return m.SimulationReport(task=task.id, turn=turn, said=done.report.sentences(), report=done.report)

    def perceive(self, caller: Caller, given: m.PerceiveArguments) -> m.SceneReport:
        """Find the things in pictures with depth."""
        places = tuple(self.rules.picture(name) for name in given.pictures)
        from ovita.perceive import perceive
        from ovita.perceive.pictures import gathered

        there = gathered(places)
        if not there.views:
            raise RequestError("these are no pictures with depth; name folders with depth, colour and camera.json")
        seen = perceive(there.views, names=tuple(given.names), frame=given.frame)
        document = {**scene_dict(seen.scene), "frame": seen.scene.frame.name}
        notes = (*there.notes, *seen.notes, *seen.refused, *seen.missing)
        return m.SceneReport(objects=_objects(seen.scene), document=document, notes=notes)

    def plan(self, caller: Caller, given: m.PlanArguments) -> m.TaskReport:
        """Plan a trajectory from place to place, and open it as a task."""
        from ovita.sources.planner import plan

        scene, _ = self._scene_of(given.scene, given.document)
        robot = self.rules.robot(given.robot)
        found = plan(
            scene,
            start=given.start,
            goal=given.goal,
            via=tuple(given.via),
            robot=robot,
            planner=given.planner,
            speed=given.speed,
        )
        if found.trajectory is None or not found.ok:
            raise RequestError(" ".join(found.sentences()))
        session = Session(found.trajectory, scene, robot, self.writer, isolation=self.isolation)
        return self._task_report(self.tasks.add(caller.owner, session), notes=found.sentences())

    def draw(self, caller: Caller, given: m.TurnArguments) -> m.PictureReport:
        """Draw the path of a turn, before and after."""
        with self._using(caller.owner, given.task) as task:
            turn = task.at(given.turn)
            report = m.PictureReport(task=task.id, turn=turn, resource=address_of(task.id, turn, "picture.png"))
            report._png = _picture(task, turn)
            return report

    def save(self, caller: Caller, given: m.SaveArguments) -> m.SavedReport:
        """Write a result (.json) or its trajectory to a new file."""
        notes: tuple[str, ...] = ()
        with self._using(caller.owner, given.task) as task, self._saving:
            file = self.rules.output(given.path)
            turn = task.at(given.turn)
            if file.lower().endswith(".json"):
                with _named(given.path, file):
                    task.result(turn).save(file)
            else:
                said, verdict = ("", "") if turn == 0 else (task.result(turn).instruction, task.result(turn).verdict)
                with _named(given.path, file):
                    notes = save_trajectory(file, task.path(turn), task.session.scene, said, verdict=verdict)
        return m.SavedReport(path=given.path, notes=notes)

    def send(self, caller: Caller, given: m.SendArguments) -> m.SendingReport:
        """Send a result to a robot: through the gate, and only after a person said yes."""
        place, log = self.rules.place(given.to), self.sent or str(gate.default_log())
        about = {"client": caller.client, "owner": caller.owner, "request": caller.request, "task": given.task}
        with self._using(caller.owner, given.task) as task, _saved(task.result(given.turn)) as file:
            turn, found = task.at(given.turn), gate.review(file, place=place)
            whole = compare(task.path(0), found.result.adapted, found.result.scene)
        report = m.SendingReport(task=task.id, turn=turn, to=place, outcome="refused")
        if not found.released:
            gate.refuse(found, place, log, about)
            return report.model_copy(update={"why": found.refusals})
        digest = sha256(f"{found.sha256}\0{place}".encode()).hexdigest()
        answer = caller.answer(_question(found, place, sentences(whole)), digest)
        if answer != "accept":
            why = f"the person did not agree ({answer})"
            gate.refuse(found, place, log, about, [why])
            return report.model_copy(update={"outcome": "declined", "why": (why,)})
        receipt = gate.release(found, place, log, about)
        return report.model_copy(update={"outcome": "sent", "sha256": receipt.sha256, "why": receipt.notes})

    def close_task(self, caller: Caller, given: m.TaskArguments) -> m.ClosedReport:
        """Close a task for good."""
        self.tasks.close(caller.owner, given.task)
        return m.ClosedReport(task=given.task)

    def resource(self, caller: Caller, task: str, turn: int, name: str) -> str | bytes:
        """The content of a resource: a trajectory, a whole result, the scene or a picture.

        Raises:
            NoSuchTask: If there is none.
        """
        if name not in RESOURCES:
            raise NoSuchTask(f"there is no {clean_text(name, 40)}; there are {', '.join(RESOURCES)}")
        with self._using(caller.owner, task) as opened:
            match name:
                case "picture.png":
                    return _picture(opened, opened.at(turn))
                case "result.json":
                    return json.dumps(opened.result(turn).to_document(), ensure_ascii=False)
                case "scene.json":
                    scene = opened.session.scene
                    return json.dumps({**scene_dict(scene), "frame": scene.frame.name}, ensure_ascii=False)
                case "before.csv":
                    path = opened.result(turn).original
                case _:
                    path = opened.path(turn)
        return str(rendered(name, path)[0])

    @contextmanager
    def _using(self, owner: str, name: str) -> Iterator[OpenTask]:
        """A task, held, whose robot the rules still allow."""
        with self.tasks.using(owner, name) as task:
            if task.session.robot not in self.rules.robots.values():
                raise NotAllowed("the robot of this task is not allowed here any more; open it again with open_task")
            yield task

    def _read(self, path: str | None, document: Mapping[str, Any] | None) -> tuple[Task, str]:
        """The task of a file or a document, and what to call it; where only a scene is, a path that stands still."""
        if (path is None) == (document is None):
            raise RequestError("give either path or document")
        if path is not None:
            with _named(path, self.rules.file(path)) as file:
                if is_skill(file):
                    raise RequestError(f"{path} is a skill; generate a trajectory of it first: ovita generate")
                return load_bare(file) or load_task(file), path
        text = json.dumps(document)
        return json_.parse_bare(text, "document") or json_.parse(text, "document"), "document"

    def _scene_of(self, path: str | None, document: Mapping[str, Any] | None) -> tuple[Scene, bool]:
        if (path is None) == (document is None):
            raise RequestError("give either scene, a file, or document")
        if path is None:
            return json_.parse_scene(json.dumps(document), "document")
        with _named(path, self.rules.file(path)) as file:
            return load_scene(file)

    def _task_report(
        self, task: OpenTask, *, notes: Sequence[str] = (), texts: Mapping[str, str] | None = None
    ) -> m.TaskReport:
        session, path = task.session, task.session.current
        scene, robot = session.scene, session.robot
        active = {id(step) for step in session.steps}
        written = {"environment": scene.environment, "constraints": scene.constraints_text, **(texts or {})}
        bare = ("there is no trajectory yet: say from where to where with adapt",) if session.bare else ()
        return m.TaskReport(
            task=task.id,
            turn=task.turn,
            waypoints=len(path),
            length=path.length,
            duration=path.duration,
            highest_speed=float(path.speeds.max()),
            lowest_corner=tuple(path.positions.min(axis=0).tolist()),
            highest_corner=tuple(path.positions.max(axis=0).tolist()),
            frame=f"{scene.frame.name}: {scene.frame.describe()}",
            robot=robot.name,
            limits=tuple(gate.limits_in_words(robot)),
            objects=_objects(scene),
            from_the_file={key: clean_text(text, LONGEST_TEXT) for key, text in written.items() if text},
            notes=(*notes, *bare),
            turns=tuple(
                m.TurnEntry(turn=i, said=step.said, status=step.adaptation.status, active=id(step) in active)
                for i, step in enumerate(session.history.steps, start=1)
            ),
            resources={name: address_of(task.id, task.turn, name) for name in ("path.csv", "scene.json")},
        )

    def _adaptation_report(self, task: OpenTask, result: Adaptation) -> m.AdaptationReport:
        held = ("path.csv", "before.csv", "result.json", "picture.png") if result.usable and task.turn else ()
        waiting = result.proposal
        proposal = None if waiting is None else m.ProposalReport(
            id=_proposal_id(result),
            plan=waiting.plan,
            changes=_changes(waiting),
            warnings=waiting.cautions,
        )  # fmt: skip
        return m.AdaptationReport(
            task=task.id,
            turn=task.turn,
            status=result.status,
            message=result.message,
            plan=result.plan,
            changes=_changes(result),
            limits=tuple(result.constraints.sentences()) if result.constraints is not None else (),
            assumptions=result.assumed,
            warnings=result.cautions,
            knobs=result.parameters,
            question=result.question,
            proposal=proposal,
            resources={name: address_of(task.id, task.turn, name) for name in held},
        )


@contextmanager
def _named(shown: str, file: str) -> Iterator[str]:
    """A file whose real path no error tells."""
    try:
        yield file
    except FormatError as error:
        raise FormatError(shown, error.problem, key=error.key, index=error.index) from None
    except OvitaError as error:
        raise RequestError(str(error).replace(file, shown)) from None


@contextmanager
def _saved(result: Adaptation) -> Iterator[str]:
    """A result as a sealed file, which is what the gate judges."""
    with tempfile.TemporaryDirectory(prefix="ovita-serve-") as folder:
        file = str(Path(folder) / "result.json")
        result.save(file)
        yield file


def _picture(task: OpenTask, turn: int) -> bytes:
    path, session = task.path(turn), task.session
    shown = task.result(turn) if turn else Adaptation("", "done", path, path, scene=session.scene, robot=session.robot)
    with tempfile.TemporaryDirectory(prefix="ovita-serve-") as folder:
        file = Path(folder) / "picture.png"
        shown.plot(str(file))
        return file.read_bytes()


def _objects(scene: Scene) -> tuple[m.ObjectEntry, ...]:
    return tuple(
        m.ObjectEntry(
            name=clean_text(item.name, LONGEST_TEXT),
            position=tuple(item.position.tolist()),
            dimensions=None if item.dimensions is None else tuple(item.dimensions.tolist()),
        )
        for item in scene.objects[:MAX_OBJECTS]
    )


def _changes(result: Adaptation) -> tuple[str, ...]:
    return tuple(str(text) for text in sentences(result.changes)) if result.changes else ()


def _proposal_id(result: Adaptation) -> str:
    """What a reading that waits for a yes is called: a digest of all that would be done."""
    shown = replace(
        result, timings_ms={}, proposal=replace(result.proposal, timings_ms={}) if result.proposal else None
    )
    return sha256(json.dumps(shown.to_document(), sort_keys=True, default=str).encode()).hexdigest()[:16]


def _question(found: gate.Review, place: str, whole: Sequence[object]) -> str:
    """What a person reads before they agree to a sending, all of it measured."""
    parts = [f"Send this path to {place}?", f'Last asked for: "{one_line(found.result.instruction, 400)}"']
    sections = {"Changes since the path was opened": [str(text) for text in whole], **found.sections()}
    sections["Changes by the last turn alone"] = sections.pop("Changes, measured again")
    for title, lines in sections.items():
        if lines:
            parts.append("\n".join([f"{title}:", *(f"- {one_line(line, 400)}" for line in lines)]))
    return "\n\n".join(parts)
