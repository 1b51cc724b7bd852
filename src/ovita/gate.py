"""The gate that everything passes on its way to a robot: it believes no file, and keeps a log.

A result is released only if it says that it succeeded, was verified against the limits of a robot, has not been edited
since, and keeps every limit when its own trajectory, scene and robot are measured again. What is shown to a person
is measured here too: the file's own report of changes and promises counts for nothing.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from ovita.errors import FormatError, RequestError, TrajectoryError
from ovita.io import Choices, is_address, is_mission, load_document
from ovita.io.documents import NONE, cell_number
from ovita.io.files import file_name, state_folder
from ovita.io.json_ import seal
from ovita.io.ledger import Ledger
from ovita.io.links import Receipt, deliver, deliver_joints
from ovita.io.messages import JointMotion
from ovita.io.mission_checks import flight_of
from ovita.io.signatures import TRUSTED, SignatureCheck, checked, trusted_keys
from ovita.limits import ConstraintCheck, ConstraintOptions, verify
from ovita.limits.problem import at
from ovita.measure import Changes, compare, sentences
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory
from ovita.result import Adaptation, Postcondition, explain
from ovita.text import listed, quoted, sentence
from ovita.toolkit import Expectation, judge
from ovita.toolkit.judging import Outcome

START = 0.01
"""How far from the original's start a result may start without a word [m]."""

FARTHEST = 1e6
"""Coordinates beyond this are no path of a robot [m]."""


@dataclass(frozen=True)
class GateCheck:
    """One thing that the gate looks at.

    Args:
        what: Such as "the speed".
        held: Whether it is as it must be; None where it could not be checked.
        why: The limit in words, or why it could not be checked.
        option: Of the command line that has it checked, or "".
    """

    what: str
    held: bool | None
    why: str
    option: str = ""

    def __str__(self) -> str:
        verdict = {True: "holds", False: "BROKEN", None: "not checked"}[self.held]
        return f"{self.what}: {verdict} ({self.why})"

    @property
    def advised(self) -> str:
        """As a line for a terminal, with the option that has it looked at."""
        return f"{str(self)[:-1]}: {self.option})" if self.option else str(self)


@dataclass(frozen=True)
class Review:
    """What the gate found.

    Args:
        result: As the file holds it.
        robot: Whose limits were measured.
        checks: Every limit, measured anew on the adapted trajectory.
        changes: The difference between the original and the adapted trajectory, measured anew.
        refusals: Why it may not be sent, each a sentence; none if it may.
        cautions: What a person should know before sending it, each a sentence.
        sha256: Of the result's content.
        looked: Everything that the gate looks at, and whether it could.
    """

    result: Adaptation
    robot: Robot
    checks: tuple[ConstraintCheck, ...]
    changes: Changes
    refusals: tuple[str, ...]
    cautions: tuple[str, ...]
    sha256: str
    looked: tuple[GateCheck, ...] = ()

    @property
    def released(self) -> bool:
        """Whether it may be sent."""
        return not self.refusals

    def sections(self, *, terminal: bool = True) -> dict[str, list[str]]:
        """What a person is shown before it is sent, all of it measured here: lines under their titles."""
        path = self.result.adapted
        size = (
            f"{len(path)} waypoints, {path.length:.3f} m in {path.duration:.2f} s, at most {path.speeds.max():.3g} m/s"
        )
        held = sum(check.held for check in self.checks)
        return {
            "Path": [size],
            "Limits": limits_in_words(self.robot),
            "Verdict": [f"Measured again just now: {held} of {len(self.checks)} limits hold."],
            "Checked": [check.advised if terminal else str(check) for check in self.looked],
            "Changes, measured again": [str(text) for text in sentences(self.changes)],
            "Mind": [*self.cautions],
        }


def review(
    path: str,
    *,
    robot: Robot | None = None,
    trusted: Sequence[str] | None = None,
    place: str = "",
    choices: Choices = NONE,
) -> Review:
    """Judge a saved result of `ovita adapt`.

    Args:
        path: The file.
        robot: Whose limits to measure, or None for those of the result.
        trusted: Files of public keys, one of which must have signed it; None for those of OVITA_TRUSTED_KEYS. None
            there, and no signature is asked for.
        place: Where it is to go, if that is known: of a mission, what it commands is judged, too.
        choices: Of home and heading.

    Raises:
        FormatError: If the file holds no readable result.
    """
    if not path.lower().endswith(".json"):
        raise FormatError(
            path, "only a result can be sent, so that it can be verified: ovita adapt ... --out RESULT.json"
        )
    document = load_document(path)
    result = Adaptation.from_document(document, file=path)
    limits = robot or result.robot
    for name, path_ in (("original", result.original), ("adapted", result.adapted)):
        if np.abs(path_.to_array()).max() > FARTHEST:
            raise FormatError(path, f"holds a number beyond {FARTHEST:g}, which is no path of a robot", key=name)
    checks = _checks(result, limits)
    keys = trusted_keys() if trusted is None else tuple(trusted)
    signature = checked(document, keys) if keys else None
    by_signature = [signature.problem] if signature and signature.problem else []
    refusals = [*_by_record(result), *_by_seal(document), *by_signature, *_by_measure(result.adapted, limits, checks)]
    flown, against_flight, notes = _of_mission(place, result.adapted, result.scene, limits, choices)
    refusals += [*_by_sense(document, result), *against_flight]
    cautions = [text for text in (*_cautions(result, limits), *notes) if text not in refusals]
    changes = compare(result.original, result.adapted, result.scene)
    looked = (*_of_file(document, signature), *_of_limits(limits, result, checks), *_of_world(result, limits, checks))
    found = tuple(dict.fromkeys(refusals)), tuple(cautions), _digest(document)
    return Review(result, limits, checks, changes, *found, (*looked, *flown))


def _cautions(result: Adaptation, limits: Robot) -> list[str]:
    """What a person should know before it is sent."""
    said = [f"'{name}' is meant to be touched and was not measured as an obstacle." for name in result.contacts]
    said += result.warnings
    if result.robot != limits:
        said.append(f"Measured against the limits of {limits.name!r} instead of the result's {result.robot.name!r}.")
    said += _unchecked(limits, result)
    away = _start_gap(result)
    if away > START:
        said.append(f"It starts {away:.3g} m from where the original starts; bring the robot there first.")
    return said


def _of_mission(
    place: str, trajectory: Trajectory, scene: Scene, robot: Robot | None, choices: Choices
) -> tuple[list[GateCheck], list[str], tuple[str, ...]]:
    """Of the mission that goes to a place what was looked at, what speaks against it, and what a person should know.

    Nothing for other places.
    """
    if not place or not is_mission(place, scene):
        return [], [], ()
    try:
        flight, notes = flight_of(trajectory, scene, choices)
    except TrajectoryError as error:
        return [GateCheck("the mission", None, error.problem)], [], ()
    against = flight.against(robot)
    return [GateCheck("the mission", not against, f"it flies {flight}")], against, notes


def _start_gap(result: Adaptation) -> float:
    return float(np.linalg.norm(result.adapted.positions[0] - result.original.positions[0]))


def _of_file(document: Mapping[str, Any], signature: SignatureCheck | None) -> list[GateCheck]:
    broken = _by_seal(document)
    found = [GateCheck("the seal", not broken, f"the content is {'not ' if broken else ''}as it was saved")]
    if signature is None:
        return [*found, GateCheck("the signature", None, "no key is trusted", f"--trust FILE, or {TRUSTED}")]
    why = signature.problem.rstrip(".") or f"key {signature.signer}"
    return [*found, GateCheck("the signature", not signature.problem, why)]


def _of_limits(robot: Robot, result: Adaptation, checks: Sequence[ConstraintCheck]) -> list[GateCheck]:
    """What was looked at of the robot's limits on its motion."""
    names = {"the workspace": "workspace", "the speed": "speed", "the least speed": "least speed"}
    names |= {
        "the acceleration along the path": "acceleration",
        "the acceleration across the path": "lateral acceleration",
    }
    found = []
    for what, name in names.items():
        made = [check for check in checks if check.name == name]
        if made:
            found.append(GateCheck(what, all(check.held for check in made), made[0].limit))
        elif name != "least speed":
            found.append(GateCheck(what, None, f"robot {robot.name!r} states no limit on it"))
    if result.adapted.orientations is not None:
        found.append(GateCheck("the orientations", None, "no limit on turning can be stated"))
    return found


def _of_world(result: Adaptation, robot: Robot, checks: Sequence[ConstraintCheck]) -> list[GateCheck]:
    """What was looked at of objects, the robot's body, its start and its motion."""
    bodies = [check for check in checks if check.name == "obstacle"]
    count = f"{len(bodies)} of {len(result.scene)} objects measured"
    found = [GateCheck("the objects", all(check.held for check in bodies) if bodies else None, count)]
    found += [GateCheck(f"contact with {name!r}", None, "it is meant to be touched") for name in result.contacts]
    size = f"{robot.radius:g} m around the path" if robot.radius else "the robot counted as a point"
    found.append(GateCheck("the body", all(check.held for check in bodies) if robot.radius else None, size))
    away = _start_gap(result)
    held = away <= START
    found.append(GateCheck("the start", held or None, f"{away:.3g} m from the original's"))
    found.append(GateCheck("where the robot is now", None, "nobody asked it; setpoints do, before they start"))
    return [*found, GateCheck("the dynamics", None, "not simulated", "--simulate")]


def simulated(found: Review, said: Sequence[str], *, failed: bool, slowed: bool = False) -> Review:
    """The review after the motion was simulated, which refuses it where that failed."""
    why = " ".join(said)
    refused = (f"Simulated, the robot does not follow it: {why}",) if failed else ()
    late = (f"Simulated, the robot follows it later than asked: {why}",) if slowed else ()
    looked = [check for check in found.looked if check.what != "the dynamics"]
    looked.append(GateCheck("the dynamics", not failed, f"simulated; {said[0]}"))
    cautions = (*found.cautions, *late)
    return replace(found, refusals=(*found.refusals, *refused), cautions=cautions, looked=tuple(looked))


def explained(path: str) -> str:
    """The explanation of a saved result, from what is measured on its paths again.

    Plan, assumptions and parameters are the writer's own words. What the file holds as its explanation follows only
    where it says something else, such as in a model's words, and is called unchecked.

    Raises:
        FormatError: If the file holds no readable result.
    """
    document = load_document(path)
    result = Adaptation.from_document(document, file=path)
    if not result.usable:
        return result.explanation or result.message
    measured = replace(
        result,
        changes=compare(result.original, result.adapted, result.scene),
        postconditions=tuple(_judged_again(result, promise) for promise in result.postconditions),
    )
    text = explain(measured)
    parts = [*_by_seal(document), text]
    if result.constraints is not None and result.constraints.ok:
        parts += _broken(_checks(result, result.robot))
    own = result.explanation.removeprefix(f"{sentence(result.taken)}\n") if result.taken else result.explanation
    if result.taken:
        parts.insert(0, sentence(result.taken))
    if own and own != explain(result):
        parts += ["", "The file also holds this explanation, which nothing checked:", own]
    return "\n".join(parts)


def _by_sense(document: Mapping[str, Any], result: Adaptation) -> list[str]:
    """What in the file makes no sense: numbers that became words, promises that cannot be measured."""
    quoted_ = _in_quotes(document, result.scene.names)
    dark = [promise.text for promise in result.postconditions if promise.kind and _outcome(result, promise) is None]
    said = [f"{where} is the text {text!r}, not a number." for where, text in quoted_]
    return [*said, *(f"Its promise {text!r} cannot be measured again." for text in dark)]


def _in_quotes(document: Mapping[str, Any], names: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Numbers in quotes among what may be a number or a word: knobs, what the frames hold, promises' arguments."""
    waiting = [(key, document.get(key)) for key in ("parameters", "frames", "postconditions")]
    while waiting:
        where, value = waiting.pop()
        if isinstance(value, str):
            if cell_number(value) is not None and value not in names:
                yield where, value
        elif isinstance(value, Mapping):
            waiting += [(f"{where}.{key}", item) for key, item in value.items()]
        elif isinstance(value, list):
            waiting += [(f"{where}[{i}]", item) for i, item in enumerate(value)]


def _outcome(result: Adaptation, promise: Postcondition) -> Outcome | None:
    """How a promise is kept, measured anew; None where its arguments make no sense."""
    expectation = Expectation(promise.kind, promise.arguments, promise.text)
    try:
        return judge(expectation, result.original.to_array(), result.adapted.to_array(), result.scene)
    except (ValueError, KeyError, TypeError, IndexError, AttributeError):
        return None


def _judged_again(result: Adaptation, promise: Postcondition) -> Postcondition:
    after = _outcome(result, promise)
    if after is None:
        return replace(promise, held=False, outcome=f"'{promise.text}' cannot be measured again")
    return replace(promise, held=after.held, outcome=after.sentence, change=after.change, unit=after.unit)


def record(log: str | os.PathLike[str], event: Mapping[str, Any]) -> None:
    """Add an event to the log, one JSON object a line with the time (UTC) first; it is on disk when this returns.

    Each line carries the SHA-256 of the one before it, see `ovita.io.ledger`.

    Raises:
        FormatError: If the log cannot be written; nothing may be sent then.
    """
    time = datetime.now(UTC).isoformat(timespec="milliseconds")
    try:
        Path(log).parent.mkdir(parents=True, exist_ok=True)
        Ledger(log).add({"time": time, **event})
    except (OSError, FormatError) as error:
        reason = str(getattr(error, "strerror", None) or error).lower()
        raise FormatError(file_name(log), f"the log cannot be written ({reason}), so nothing is sent") from None


def refuse(found: Review, place: str, log: str, about: Mapping[str, Any], why: Sequence[str] = ()) -> None:
    """Log that a result does not go to a place, and why: what the gate says where no other sentences are given."""
    record(log, {"event": "refused", **_event(found, place, about), "why": list(why or found.refusals)})


def release(
    found: Review,
    place: str,
    log: str,
    about: Mapping[str, Any],
    *,
    choices: Choices = NONE,
    motion: JointMotion | None = None,
    told: Callable[[str], None] | None = None,
) -> Receipt:
    """Send a result that the gate let through, and log that before and after.

    The `motion` of an arm's joints is sent in place of the path; `told` hears how far a controller is that follows it.

    Raises:
        RequestError: If the gate refused it.
        LinkError: If the other side does not answer.
    """
    if not found.released:
        raise RequestError(f"it does not go to {place}: {' '.join(found.refusals)}")
    path = found.result.adapted
    _, against_flight, _ = _of_mission(place, path, found.result.scene, found.robot, choices)
    if against_flight:
        refuse(found, place, log, about, against_flight)
        raise RequestError(f"it does not go to {place}: {' '.join(against_flight)}")
    event = _event(found, place, about) | {"waypoints": len(path), "duration_s": round(path.duration, 3)}
    record(log, {"event": "sending", **event})
    try:
        if motion is not None:
            receipt = deliver_joints(place, motion, choices, told)
        else:
            result = found.result
            said, verdict = result.instruction, result.verdict
            robot, scene = found.robot, result.scene
            receipt = deliver(place, path, scene, instruction=said, choices=choices, verdict=verdict, robot=robot)
    except BaseException as error:
        record(log, {"event": "failed", **event, "why": str(error) or type(error).__name__})
        raise
    record(log, {"event": "sent", **event, "sha256": receipt.sha256, "bytes": receipt.size})
    return receipt


def _event(found: Review, place: str, about: Mapping[str, Any]) -> dict[str, Any]:
    to = place if is_address(place) else os.path.abspath(place)
    return {**about, "result_sha256": found.sha256, "to": to, "robot": found.robot.name}


def default_log() -> Path:
    """Where sendings are logged: `sent.jsonl` in the user's state folder (XDG_STATE_HOME)."""
    return state_folder() / "sent.jsonl"


def against(
    trajectory: Trajectory, scene: Scene, robot: Robot | None, place: str = "", choices: Choices = NONE
) -> list[str]:
    """What measuring says against a trajectory that no result vouches for, each a sentence.

    Without a robot it looks only for what no robot can follow.
    """
    _, against_flight, _ = _of_mission(place, trajectory, scene, robot, choices)
    if robot is None:
        return [*_standstill(trajectory), *against_flight]
    checks = verify(trajectory, scene, robot, proposed=trajectory, original=trajectory)
    return [*_by_measure(trajectory, robot, checks), *against_flight]


def limits_in_words(robot: Robot) -> list[str]:
    """A robot's limits, each as a line for a person."""
    said = [f"robot {robot.name}"]
    if robot.workspace is not None:
        said.append(f"workspace: {robot.workspace.describe()}, {robot.margin:g} m from its border")
    said.append(f"body: {robot.radius:g} m radius" if robot.radius else "body: a point")
    said.append(f"objects: {robot.obstacle_margin:g} m from each, {robot.person_margin:g} m from people")
    said.append("speed: " + ("no limit" if robot.max_speed is None else f"at most {robot.max_speed:g} m/s"))
    for name, limit in (("along", robot.max_acceleration), ("across", robot.max_lateral_acceleration)):
        said.append(f"acceleration {name} the path: " + ("no limit" if limit is None else f"at most {limit:g} m/s^2"))
    return said


def _checks(result: Adaptation, robot: Robot) -> tuple[ConstraintCheck, ...]:
    return verify(
        result.adapted,
        result.scene,
        robot,
        proposed=result.adapted,
        original=result.original,
        contacts=[name for name in result.contacts if name in result.scene],
        options=ConstraintOptions(
            max_acceleration=result.options.max_acceleration,
            max_lateral_acceleration=result.options.max_lateral_acceleration,
        ),
    )


def _by_record(result: Adaptation) -> list[str]:
    """What the result itself says against it."""
    if not result.usable:
        hint = " Accept its proposal first: ovita adapt RESULT --accept." if result.proposal is not None else ""
        return [f"There is no result to send: its status is {result.status!r}.{hint}"]
    if result.status == "not_as_meant":
        return [f"{result.message} Correct it before it is sent."]
    verdict = result.constraints
    if verdict is None:
        return ["It was never verified against any limit."]
    said = []
    if result.status == "infeasible" or verdict.status == "infeasible":
        said.append("The limits cannot all hold: it is only the best effort.")
    if verdict.status == "off":
        said.append("Its limits were only measured, not enforced.")
    elif not verdict.ok and result.status != "infeasible":
        said.append("By its own report it breaks a limit.")
    return said


def _by_seal(document: Mapping[str, Any]) -> list[str]:
    """Whether the content is that which was saved."""
    kept = document.get("sha256")
    if kept is None:
        return ["It bears no seal, so nobody knows whether it was edited; run ovita adapt again with --out."]
    if kept != seal(document):
        return ["It was edited after it was saved, or an earlier version wrote it: its seal does not fit; adapt again."]
    return []


def _by_measure(adapted: Trajectory, robot: Robot, checks: Sequence[ConstraintCheck]) -> list[str]:
    """What measuring the trajectory again says against it."""
    said = []
    if robot.workspace is None and robot.max_speed is None:
        said.append(f"The robot {robot.name!r} has no limits to verify against; name the real one: --robot NAME|FILE.")
    return said + _broken(checks) + _standstill(adapted)


def _broken(checks: Sequence[ConstraintCheck]) -> list[str]:
    said = []
    for check in checks:
        if not check.held:
            where = at(check.place, check.where_after)
            what = f"it passes too close to {check.subject!r}" if check.subject else f"the {check.name} limit is broken"
            said.append(f"Measured again, {what} by {check.violation_after:.3g} {check.unit}{where} ({check.limit}).")
    return said


def _standstill(trajectory: Trajectory) -> list[str]:
    if trajectory.stall is None:
        return []
    return [f"From waypoint {trajectory.stall + 1} it goes on at speed 0, which no robot can follow."]


def _unchecked(robot: Robot, result: Adaptation) -> list[str]:
    """What was not checked, since nobody stated a limit on it."""
    limits = {
        "the workspace": robot.workspace,
        "the speed": robot.max_speed,
        "the acceleration along the path": robot.max_acceleration or result.options.max_acceleration,
        "the acceleration across the path": robot.max_lateral_acceleration or result.options.max_lateral_acceleration,
        "the size of the robot, which counted as a point": robot.radius or None,
    }
    missing = [what for what, limit in limits.items() if limit is None]
    unsized = [item.name for item in result.scene if item.dimensions is None]
    said = [f"Not checked, since robot {robot.name!r} states no limit on it: {listed(missing)}."] if missing else []
    if unsized:
        said.append(f"The scene gives no size for {quoted(unsized)}; {robot.object_size:g} m was assumed at least.")
    return said


def _digest(document: Mapping[str, Any]) -> str:
    return sha256(json.dumps(document, sort_keys=True).encode()).hexdigest()
