"""Carry out each line of the corpus and check what comes of it: `python training/corpus/realised.py [VOICE ...]`.

For each line with frames a scene is made whose path and objects suit the amounts that the line states; its frames are
turned into a policy, the policy is run, and `bench.expected` judges the outcome. As a negative control, the outcome of
a flipped frame (the other way, another object, another shape) is judged by the check of the right one.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from check import Example, examples

from ovita.bench.expected import expected
from ovita.errors import OvitaError
from ovita.instruct import frames as F
from ovita.instruct.editing import apply, realised_values
from ovita.instruct.frames import name_of
from ovita.instruct.meaning import canonical
from ovita.instruct.notation import show
from ovita.instruct.realise import realise
from ovita.limits.problem import kind_of
from ovita.paths.part import PathPart
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.policy.policy import TooMuch, run_proven
from ovita.policy.source import parse_tree
from ovita.toolkit.speed import stop_at

VOICES = Path(__file__).parent / "voices"
LEVEL = ("left", "right", "front", "back")
"""Directions that are not up or down."""
SIZES = {"person": (0.5, 0.4, 1.75), "animal": (0.6, 0.3, 0.5)}
"""Edges of people and animals [m], where the scene has room for them."""


@dataclass(frozen=True)
class Trial:
    """What became of a line: "done", "asked" or "failed", and why."""

    outcome: str
    why: str = ""
    code: str = ""


def setting(frames: Sequence[F.SemanticFrame], objects: Sequence[str]) -> tuple[Trajectory, Scene]:
    """A path and a scene that suit what frames state: lengths are a sixth of it, speeds in the middle of its own."""
    quantities = [(f, slot, q) for f in frames for slot, q in f.quantities.items()]
    parts = [part for frame in frames for part in _parts(frame.part)]
    lengths = [abs(q.value) for f, _, q in quantities if q.unit == "m" and not isinstance(f, F.Height)]
    lengths += [p.amount or 0.0 for p in parts if p.kind == "near" and p.amount] + [
        p.amount or 0.0 for p in parts if p.kind in ("first", "last") and p.unit == "m"
    ]
    short = [f.by.value for f in frames if isinstance(f, F.StopAt | F.Wait) and f.by is not None and f.by.unit == "m"]
    lengths += [(len(objects) + 1) / 5.0 * metres for metres in short]  # the first object has that much path before it
    size = max(6.0 * max(lengths, default=0.0), 0.0) or 2.0
    levels = [q.value for f, _, q in quantities if isinstance(f, F.Height) and q.unit == "m"]
    levels += [abs(p.amount or 0.0) for p in parts if p.kind == "beyond" and p.direction in ("up", "down")]
    if levels and not lengths:
        far = [abs(level) for level in levels]  # below an object they are negative
        size = max(min(8.0 * min(far), 2.0), 2.0 * max(far)) or 2.0
    counts = [p.until or p.amount or 0 for p in parts if p.kind in ("first", "last", "range") and p.unit == "waypoints"]
    counts += [q.value for _, _, q in quantities if q.unit == "waypoints"]
    counts += [p.value for f in frames for p in vars(f).values() if isinstance(p, F.Quantity) and p.unit == "waypoints"]
    n = int(np.clip(1.5 * max(counts, default=0), 80, 1000))
    t = np.linspace(0.0, 1.0, n)
    height = float(np.mean(levels)) if levels else 0.5 * size
    path = np.column_stack(
        [size * (t - 0.5), 0.22 * size * np.sin(4.4 * t - 0.6), height + 0.1 * size * np.sin(6.5 * t + 0.4)]
    )
    sides = {f.direction in ("left", "right") for f in frames if isinstance(f, F.Side) and f.direction in LEVEL}
    if len(sides) == 2:  # so that all of them are beside it
        path[:, :2] = path[:, :2] @ np.array([[1.0, 1.0], [-1.0, 1.0]]) / 2.0**0.5
    elif True in sides:
        path = path[:, [1, 0, 2]] * np.array([-1.0, 1.0, 1.0])
    if any(isinstance(f, F.Bound) and f.offset[0][0] in ("up", "down") for f in frames):
        path[:, 2] += 0.2 * size * np.sin(6.5 * t + 0.4)
    if any(isinstance(frame, F.Smooth) for frame in frames):
        path += 0.006 * size * np.random.default_rng(1).normal(size=path.shape) * np.sin(np.pi * t)[:, None]
    scene = Scene(tuple(_placed(frames, parts, objects, path, size)))
    rows = Trajectory(path, _speeds(frames, parts, size, t)).to_array()
    for frame in frames:
        if isinstance(frame, F.NoStop) and not any(isinstance(other, F.Pace) for other in frames):
            place = frame.part.places[0] if frame.part.kind == "near" else ""
            rows = stop_at(rows, scene[place] if place in scene.names else 0.5, resume=True)
    return Trajectory.from_array(rows), scene


def _parts(part: PathPart) -> list[PathPart]:
    return [inner for p in part.parts for inner in _parts(p)] if part.parts else [part]


def _speeds(frames: Sequence[F.SemanticFrame], parts: Sequence[PathPart], size: float, t: Any) -> Any:
    paces = [f for f in frames if isinstance(f, F.Pace) and f.amount is not None]
    base = 1.3 * size / 20.0
    seconds = max([p.amount or 0.0 for p in parts if p.unit == "s"], default=0.0)
    if seconds:
        base = size / (4.0 * seconds)
    for frame in paces:
        q = frame.amount
        assert q is not None
        if q.unit == "m/s" and q.value > 0:
            far = {"rampup": 0.4, "rampdown": 3.0}.get(frame.change, {"by": 3.0, "to": 1.7}.get(q.role, 1.0))
            base = far * q.value
        elif q.unit == "m/s2":
            base = (2.5 * abs(q.value) * size) ** 0.5
    return base * (1.0 + 0.35 * np.sin(9.0 * t + 1.0))


def _placed(
    frames: Sequence[F.SemanticFrame], parts: Sequence[PathPart], objects: Sequence[str], path: Any, size: float
) -> Iterator[SceneObject]:
    """The objects, beside the path in their order, as far from it as makes a difference."""
    near = {p.places[0]: p.amount for p in parts if p.kind == "near" and p.amount is not None}
    gap_of = dict.fromkeys(objects, 0.1 * size)
    same_side = any(isinstance(f, F.Visit) and f.relation == "between" for f in frames)
    for frame in frames:
        for name in getattr(frame, "objects", ()):
            match frame:
                case F.Approach(sense="closer") | F.Clearance(distance=F.Quantity(role="at_most")):
                    gap_of[name] = 0.24 * size
                case F.Clearance() if gap_of[name] != 0.24 * size:
                    gap_of[name] = 0.08 * size
                case F.Side():
                    gap_of[name] = 0.06 * size
                case F.Visit(relation="between") | F.Avoid(relation="between"):
                    gap_of[name] = 0.15 * size
                case F.Avoid():
                    gap_of[name] = 0.0
    mentioned = [name for frame in frames for name in frame.named if name in objects]
    for i, name in enumerate(dict.fromkeys([*mentioned, *objects])):
        k = round((i + 1) / (len(objects) + 1) * (len(path) - 1))
        heading = path[min(k + 1, len(path) - 1)] - path[k - 1]
        level = float(np.linalg.norm(heading[:2]))
        aside = np.array([-heading[1], heading[0], 0.0]) / level if level else np.array([0.0, 1.0, 0.0])
        gap = min(0.5 * near[name], 0.1 * size) if name in near else gap_of[name]
        way = 1.0 if same_side or i % 2 else -1.0
        for frame in frames:
            if isinstance(frame, F.Side) and name in frame.objects:
                side = Scene().frame.direction(frame.direction) if frame.direction in F.OPPOSITES else aside
                way = 1.0 if aside @ side > 0 else -1.0
        kind = kind_of(name)
        edges = np.array(SIZES.get(kind.name if kind else "", (0.5, 0.5, 0.5)))
        edges = edges * min(1.0, 0.06 * size / edges.max())
        if any(isinstance(frame, F.Arrive) and frame.place == name for frame in frames):
            yield SceneObject(name, path[-1] - np.array([0.0, 0.0, 0.05 * size]), edges)
            continue
        yield SceneObject(name, path[k] + way * gap * aside - np.array([0.0, 0.0, 0.01 * size]), edges)


def carried_out(frames: Sequence[F.SemanticFrame], trajectory: Trajectory, scene: Scene) -> tuple[Trial, Any]:
    """Realise frames and run the policy; the rows that it makes."""
    try:
        d = realise(frames, trajectory, scene)
        if d.question:
            return Trial("asked", d.question), None
        code = d.source(" ".join(d.plan))
        rows, _ = run_proven(parse_tree(code), trajectory.to_array(), scene)
        return Trial("done", code=code), Trajectory.from_array(rows)
    except (OvitaError, TooMuch, ValueError, IndexError, KeyError) as error:
        return Trial("failed", f"{type(error).__name__}: {error}"), None


def tried(frames: Sequence[F.SemanticFrame], objects: Sequence[str]) -> Trial:
    """Whether frames, carried out, do what they say."""
    trajectory, scene = setting(frames, objects)
    trial, adapted = carried_out(frames, trajectory, scene)
    if adapted is None:
        return trial
    result = expected(frames, trajectory, scene).judge(trajectory, adapted, scene)
    return trial if result.passed else replace(trial, outcome="failed", why=result.sentence)


def alike(read: Sequence[F.SemanticFrame], meant: Sequence[F.SemanticFrame], objects: Sequence[str]) -> bool:
    """Whether two readings come to the same: what comes of each passes the check of the other."""
    trajectory, scene = setting(meant, objects)
    for frames, other in ((read, meant), (meant, read)):
        try:
            _, adapted = carried_out(frames, trajectory, scene)
            if adapted is None or not expected(other, trajectory, scene).judge(trajectory, adapted, scene).passed:
                return False
        except (OvitaError, ValueError, IndexError, KeyError):
            return False
    return True


def flipped(frames: Sequence[F.SemanticFrame], objects: Sequence[str]) -> tuple[F.SemanticFrame, ...] | None:
    """The frames with one of them turned into another; None if none can be."""
    for i, frame in enumerate(frames):
        other = _other(frame, objects)
        if other is not None:
            return (*frames[:i], other, *frames[i + 1 :])
    return None


_PACES: dict[str, Any] = {
    "faster": "slower", "slower": "faster", "rampup": "rampdown", "rampdown": "rampup", "constant": "rampup",
}  # fmt: skip


def _other(frame: F.SemanticFrame, objects: Sequence[str]) -> F.SemanticFrame | None:  # noqa: C901
    """A frame that asks for something else than this one."""
    named = getattr(frame, "objects", ())
    rest = [name for name in objects if name not in frame.named]
    match frame:
        case F.Shift(offset=offset) | F.Extend(offset=offset) | F.Bound(offset=offset) if offset:
            return replace(frame, offset=tuple((F.OPPOSITES[word], q) for word, q in offset))
        case F.MoveEnd(relation="", offset=offset):
            return replace(frame, offset=tuple((F.OPPOSITES[word], q) for word, q in offset))
        case F.MoveEnd(relation="toward" | "away" as way):
            return replace(frame, relation="away" if way == "toward" else "toward")
        case F.Approach(sense=sense):
            return replace(frame, sense="farther" if sense == "closer" else "closer")
        case F.Side(direction=direction) if direction in F.OPPOSITES:
            return replace(frame, direction=F.OPPOSITES[direction])
        case F.Avoid(relation="between" | "over" | "under" as way, objects=objects):
            return F.Visit(relation=way, objects=objects)
        case F.Pace(change=change) if change in _PACES:
            q = frame.amount
            inverse = q if q is None or q.role == "by" else replace(q, value=2 * q.value)
            if change == "constant" or (q is not None and q.role != "by"):
                return F.Pace(change="accelerate", amount=F.Quantity(0.01, "m/s2"), part=frame.part)
            return replace(frame, change=_PACES[change], amount=inverse)
        case F.Pace(amount=F.Quantity() as q) if q.role in ("to", "at_least", "at_most"):
            far = 0.6 if q.role == "at_least" else 1.6
            return replace(frame, change="set", amount=replace(q, role="to", value=q.value * far))
        case F.Pace(change="accelerate", amount=F.Quantity() as q):
            return replace(frame, amount=replace(q, value=-q.value))
        case F.Pace():
            return replace(frame, change="faster")
        case F.Resize() | F.Curve() | F.Resample() | F.Trim() | F.Rotate() | F.Mirror() | F.Tilt() | F.Quadrant():
            return _inverse(frame)
        case F.Height(level=level):
            far = 0.6 if level.role == "at_least" else 1.5
            return replace(frame, level=replace(level, role="to", value=level.value * far))
        case F.Visit(relation="over" | "under" as way):
            return replace(frame, relation="under" if way == "over" else "over", by=None)
        case F.Visit() | F.Hop() | F.Hover() | F.Clearance() if len(rest) >= len(named):
            return replace(frame, objects=tuple(rest[: len(named)]))
        case F.StopAt(place=str()) | F.Wait(place=str()) | F.MoveEnd(place=str()) if rest:
            return replace(frame, place=rest[0])
        case F.Figure(shape=shape):
            return replace(frame, shape="spiral" if shape in ("circle", "eight") else "circle", place=objects[0])
        case F.Smooth():
            return F.Figure(shape="zigzag", part=frame.part)
        case F.Arrive():
            return F.Extend(offset=(("down", frame.by),))
        case F.NoStop() if rest:
            return F.Wait(place=rest[0])
        case F.OneHeight():
            return F.Tilt(angle=F.Quantity(40.0, "deg"), direction="front")
        case F.Straighten():
            return F.Curve(change="more", part=frame.part)
        case F.Reverse():
            return F.Mirror(axis="left")
        case F.Return():
            return F.Extend()
        case F.Extend():
            return F.Return()
    return None


def _inverse(frame: F.SemanticFrame) -> F.SemanticFrame:
    match frame:
        case F.Resize():
            plain = canonical(frame)
            by = getattr(plain, "by", None)
            if by is None:
                return replace(frame, change="smaller" if frame.change == "larger" else "larger")
            return replace(frame, change="", by=F.Quantity(1 / by.value, "x"))
        case F.Curve(change=change):
            return replace(frame, change="less" if change == "more" else "more")
        case F.Resample(amount=None, change=change):
            return replace(frame, change="fewer" if change == "more" else "more")
        case F.Resample():
            return F.Resample(change="by", amount=F.Quantity(0.3, "x"))
        case F.Trim(cut=cut):
            return replace(frame, cut={"first": "last", "last": "first", "before": "after", "after": "before"}[cut])
        case F.Rotate(sense=sense):
            return replace(frame, sense="ccw" if sense == "cw" else "cw") if sense else F.Mirror(axis="left")
        case F.Mirror(axis=axis):
            return replace(frame, axis="up" if axis in ("left", "front", "x", "y") else "left")
        case F.Tilt(direction=direction):
            return replace(frame, direction=F.OPPOSITES[direction])
        case F.Quadrant(number=number):
            return replace(frame, number=(number + 1) % 4 + 1)
    return frame


def after_feedback(line: Example, trajectory: Trajectory, scene: Scene) -> tuple[F.SemanticFrame, ...]:
    """The frames of the turn before with a line's edits, for which open slots have the values that were realised."""
    assert line.before is not None
    values = realised_values(list(realise(line.before, trajectory, scene).parameters.values()))
    return apply(line.edits, line.before, scene, values)


def feedback(voices: Sequence[str] = ()) -> Iterator[Example]:
    """The lines of the training voices that change what was done."""
    for path in sorted(VOICES.glob("*.txt")):
        if not voices or path.stem in voices:
            yield from (line for line in examples(path) if line.edits and line.before and not line.problem)


def sentences(voices: Sequence[str] = ()) -> Iterator[Example]:
    """The lines of the training voices that ask for something to be done."""
    for path in sorted(VOICES.glob("*.txt")):
        if not voices or path.stem in voices:
            yield from (line for line in examples(path) if line.frames and not line.problem)


def main() -> int:
    """Print per frame how many lines were done, asked about or failed, and how many flipped ones were told apart."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("voices", nargs="*")
    parser.add_argument("--show", action="store_true", help="print the policy of each failure")
    parser.add_argument("--every", type=int, default=1, help="only every so many-th line")
    arguments = parser.parse_args()
    counts: Counter[tuple[str, str]] = Counter()
    missed: Counter[str] = Counter()
    turned: Counter[str] = Counter()
    flips = 0
    for line in list(sentences(arguments.voices))[:: arguments.every]:
        name = name_of(line.frames[0]) if len(line.frames) == 1 else "several"
        trial = tried(line.frames, line.objects)
        counts[name, trial.outcome] += 1
        if trial.outcome != "done":
            print(f"{trial.outcome} {line.voice}:{line.number} {show(line.frames)} | {trial.why}")
            if arguments.show:
                print(trial.code)
        other = flipped(line.frames, line.objects)
        if other is None or trial.outcome != "done":
            continue
        trajectory, scene = setting(line.frames, line.objects)
        _, adapted = carried_out(other, trajectory, scene)
        if adapted is not None:
            flips += 1
            if expected(line.frames, trajectory, scene).judge(trajectory, adapted, scene).passed:
                missed[name] += 1
                print(f"missed {line.voice}:{line.number} {show(line.frames)} | {show(other)}")
    print(f"{'frame':12}{'done':>7}{'asked':>7}{'failed':>7}{'flip missed':>13}")
    for name in sorted({name for name, _ in counts}):
        print(
            f"{name:12}" + "".join(f"{counts[name, o]:7}" for o in ("done", "asked", "failed")) + f"{missed[name]:13}"
        )
    total = {o: sum(n for (_, out), n in counts.items() if out == o) for o in ("done", "asked", "failed")}
    for line in list(feedback(arguments.voices))[:: arguments.every]:
        after = after_feedback(line, *setting(line.before or (), line.objects))
        trial = tried(after, line.objects) if after else Trial("dropped")
        turned[trial.outcome] += 1
        if trial.outcome in ("failed", "asked"):
            print(
                f"{trial.outcome} {line.voice}:{line.number} {show(line.before or ())} => {line.reading} | {trial.why}"
            )
    print(f"feedback: {dict(turned)}")
    lines = sum(total.values())
    shares = ", ".join(f"{count / lines:.1%} {outcome}" for outcome, count in total.items())
    apart = 1 - sum(missed.values()) / max(flips, 1)
    print(f"{lines} lines: {shares}; of {flips} flipped frames {apart:.1%} were told apart")
    return 0


if __name__ == "__main__":
    sys.exit(main())
