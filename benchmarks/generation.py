"""Sentences without a trajectory, judged by executable checks.

`python benchmarks/generation.py` makes a trajectory of every sentence of training/corpus/generation/ with the built-in
writer, offline, and prints what came out; `--wrong` prints the wrong ones only. A sentence is right if the result is
done (or limited) without a question, keeps every limit by the independent verifier, and passes all its checks.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ovita import Robot, Scene, SceneObject, verify
from ovita.limits import ConstraintOptions
from ovita.measure import predicates as P
from ovita.sources.places import obstacles
from ovita.sources.words import Generation, from_words

CORPUS = Path(__file__).parents[1] / "training" / "corpus" / "generation"
AT = 0.12
"""How far from the robot's distance an end at an object may be [m]."""


@dataclass(frozen=True)
class Sentence:
    """A sentence, its scene and robot, and what must be true."""

    file: str
    voice: str
    text: str
    scene: Scene
    robot: Robot
    checks: tuple[tuple[str, ...], ...]


def corpus(folder: Path = CORPUS) -> Iterator[Sentence]:
    """Every sentence of the folder's files."""
    for path in sorted(folder.glob("*.txt")):
        head: dict[str, str] = {}
        for line in path.read_text(encoding="utf-8").splitlines():
            key, colon, value = line.removeprefix("# ").partition(": ")
            if line.startswith("# ") and colon and key in ("voice", "robot", "scene"):
                head[key] = value
            elif line and not line.startswith("#"):
                text, _, told = line.rpartition(" | ")
                checks = tuple(tuple(check.split()) for check in told.split(";"))
                yield Sentence(
                    path.stem, head["voice"], text, scene_of(head["scene"]), Robot.preset(head["robot"]), checks
                )


def scene_of(text: str) -> Scene:
    """A scene from "name x y z a b c; ..."."""
    objects = []
    for part in text.split(";"):
        *name, x, y, z, a, b, c = part.split()
        objects.append(SceneObject(" ".join(name), [float(v) for v in (x, y, z)], [float(v) for v in (a, b, c)]))
    return Scene(tuple(objects))


class Judge:
    """Measures one generated trajectory."""

    def __init__(self, sentence: Sentence, made: Generation) -> None:
        self.sentence, self.made = sentence, made
        self.scene, self.robot = sentence.scene, sentence.robot

    def wrong(self) -> list[str]:
        """What does not hold; empty if all does."""
        checks, made = self.sentence.checks, self.made
        if checks == (("ask",),):
            return [] if made.adaptation is None and made.question else [f"asks nothing: {made.status}"]
        result = made.adaptation
        if result is None or result.status not in ("done", "limited"):
            return [f"{made.status}: {made.message}"]
        self.path, self.plan = result.adapted, result.original
        self.dense = self.path.resample(2000, by="arc_length").positions
        measured = verify(
            self.path,
            self.scene,
            self.robot,
            proposed=self.path,
            original=self.plan,
            contacts=result.contacts,
            options=ConstraintOptions(repair_original=True),
        )
        said = [f"limit {check.name} {check.subject}" for check in measured if not check.held]
        return said + [" ".join(check) for check in checks if not self.holds(*check)]

    def holds(self, kind: str, *values: str) -> bool:
        """Whether one check holds."""
        check: Callable[..., bool] = getattr(self, f"_{kind}")
        return check(*values)

    def item(self, name: str) -> SceneObject:
        return self.scene[name.replace("_", " ")]

    def at(self, point: np.ndarray, name: str) -> bool:
        item = self.item(name)
        keep = max(body.radius for body in obstacles(self.scene, self.robot) if body.name == item.name)
        return float(item.clearance(point[None])[0]) <= keep + AT

    def placed(self, point: np.ndarray, words: tuple[str, ...]) -> bool:
        if len(words) == 1:
            return self.at(point, words[0])
        side, name = words
        item, away = self.item(name), point - self.item(name).position
        if side == "above":
            return bool((np.abs(away[:2]) <= item.size[:2] / 2 + 0.03).all() and away[2] > item.size[2] / 2)
        along = float(away @ self.scene.frame.direction(side))
        return along > 0.9 * float(np.linalg.norm(away[:2])) and along < 1.0

    def _from(self, *words: str) -> bool:
        return self.placed(self.path.positions[0], words)

    def _to(self, *words: str) -> bool:
        return self.placed(self.plan.positions[-1], words) and self._arrives()

    def _arrives(self) -> bool:
        """The adapted path comes to where the plan ends; a figure or a wait may follow."""
        return float(np.linalg.norm(self.dense - self.plan.positions[-1], axis=1).min()) < 0.05

    def _from_point(self, *xyz: str) -> bool:
        return float(np.linalg.norm(self.path.positions[0] - [float(v) for v in xyz])) < 0.02

    def _to_point(self, *xyz: str) -> bool:
        return float(np.linalg.norm(self.path.positions[-1] - [float(v) for v in xyz])) < 0.02

    def _height(self, point: np.ndarray, name: str, height: str) -> bool:
        top = float(self.item(name).position[2] + self.item(name).size[2] / 2)
        return abs(float(point[2]) - top - float(height)) < 0.03

    def _start_height(self, name: str, height: str) -> bool:
        return self._height(self.path.positions[0], name, height)

    def _end_height(self, name: str, height: str) -> bool:
        return self._height(self.path.positions[-1], name, height)

    def _over(self, name: str) -> bool:
        away, half = self.dense - self.item(name).position, self.item(name).size / 2
        return bool(((np.abs(away[:, :2]) <= half[:2] + 0.02).all(axis=1) & (away[:, 2] > half[2])).any())

    def _via(self, name: str) -> bool:
        return any(self.at(point, name) for point in self.dense)

    def _between(self, one: str, two: str) -> bool:
        names = (self.item(one).name, self.item(two).name)
        return P.passes_between(*names).judge(self.plan, self.path, self.on_the_floor()).passed

    def on_the_floor(self) -> Scene:
        """The scene, with the objects' middles at the height of a robot that stays on the ground."""
        if not self.robot.planar:
            return self.scene
        flat = [replace(item, position=[*item.position[:2], self.path.positions[0, 2]]) for item in self.scene]
        return replace(self.scene, objects=tuple(flat))

    def _side(self, direction: str, name: str) -> bool:
        away = (self.dense - self.item(name).position)[:, :2]
        nearest = away[np.linalg.norm(away, axis=1).argmin()]
        along = float(nearest @ self.scene.frame.direction(direction)[:2])
        return along > 0.7 * float(np.linalg.norm(nearest))

    def _clear(self, name: str, distance: str) -> bool:
        return float(self.item(name).clearance(self.dense).min()) >= float(distance) - 2e-3

    def _height_at_most(self, height: str) -> bool:
        return float(self.dense[:, 2].max()) <= float(height) + 1e-6

    def compared(self, check: P.Check) -> bool:
        return check.judge(self.plan, self.path, self.scene).passed

    def _slower(self) -> bool:
        return self.compared(P.slower())

    def _pace(self, factor: str) -> bool:
        return self.compared(P.slower(factor=float(factor)))

    def _slower_near(self, name: str) -> bool:
        return self.compared(P.slower(where=P.near(self.item(name).name), only=True))

    def _slower_last(self, share: str) -> bool:
        return self.compared(P.slower(where=P.last(float(share), unit="share")))

    def _constant(self, speed: str) -> bool:
        return self.compared(P.constant_speed(float(speed))) or self._mostly(float(speed))

    def _mostly(self, speed: float) -> bool:
        """The speed on all but the ramps at the ends, which the limits on acceleration ask for."""
        middle = self.path.speeds[len(self.path) // 5 : -len(self.path) // 5]
        return bool(np.abs(middle - speed).max() < 0.01)

    def _at_most(self, speed: str) -> bool:
        return float(self.path.speeds.max()) <= float(speed) + 1e-6

    def _wait(self, name: str, seconds: str) -> bool:
        there = np.array([self.at(p, name) or self._above(p, name) for p in self.path.positions[1:]])
        still = np.diff(self.path.arc_length) < 1e-9
        return float(self.path.durations[there & still].sum()) >= 0.9 * float(seconds)

    def _above(self, point: np.ndarray, name: str) -> bool:
        return self.placed(point, ("above", name))

    def _zigzag(self) -> bool:
        return self.compared(P.zigzags())

    def _wavy(self) -> bool:
        return self.compared(P.zigzags(2))

    def _spiral(self) -> bool:
        return any(self.compared(check) for check in (P.spiral(), P.spiral(near="goal")))

    def _circle(self, name: str) -> bool:
        away = (self.dense - self.item(name).position)[:, :2]
        return float(np.ptp(np.unwrap(np.arctan2(away[:, 1], away[:, 0])))) > 1.9 * np.pi


def evaluate(sentences: Iterator[Sentence]) -> list[tuple[Sentence, list[str]]]:
    """Every sentence with what is wrong about its trajectory."""
    found = []
    for sentence in sentences:
        made = from_words(sentence.text, sentence.scene, sentence.robot, writer="builtin")
        found.append((sentence, Judge(sentence, made).wrong()))
    return found


def main() -> None:
    """Print a line for each sentence, and the share that is right."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--wrong", action="store_true", help="print the wrong ones only")
    parser.add_argument("--folder", type=Path, default=CORPUS)
    options = parser.parse_args()
    found = evaluate(corpus(options.folder))
    for sentence, wrong in found:
        if wrong or not options.wrong:
            print(f"{'WRONG' if wrong else 'right'}  {sentence.text}" + "".join(f"\n         {line}" for line in wrong))
    for file in dict.fromkeys(sentence.file for sentence, _ in found):
        wrongs = [wrong for sentence, wrong in found if sentence.file == file]
        right = sum(not wrong for wrong in wrongs)
        print(f"{file}: {right} of {len(wrongs)} right ({right / len(wrongs):.1%})")


if __name__ == "__main__":
    main()
