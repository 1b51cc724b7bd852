"""Drones: durations of missions, missions over a lossy link, and flights that are killed at random moments.

    python benchmarks/drones.py [--paths 50] [--missions 100] [--kills 200] [--loss 0.2] [--no-walks]

Durations are told by paths against what their missions command. Missions are uploaded over UDP on this machine to a
vehicle that loses and repeats messages both ways. Flights are flown by setpoints on a simulated multicopter, whose
station is killed at a random moment; its state is looked at 1.5 s (PX4) or 3.5 s (ArduPilot) later, beyond the
timeout of its failsafe. At last `ovita send` flies as a process of its own, while ten things go wrong.
"""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
from pathlib import Path

import numpy as np

from ovita.chain import adapt
from ovita.errors import LinkError
from ovita.io import Choices, mavlink
from ovita.io.geodesy import Home
from ovita.io.links import deliver
from ovita.io.mission_checks import Flight, flight_of
from ovita.io.mission_files import dumps_plan, parse_plan
from ovita.io.missions import mission_from, numbered
from ovita.io.setpoints import Course, Pilot
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene
from ovita.request import Request

TESTS = Path(__file__).parents[1] / "tests"
sys.path += [str(TESTS / "links"), str(TESTS / "io")]
from flown import Copter  # noqa: E402
from responder import Responder  # noqa: E402
from test_mission_checks import generated  # noqa: E402
from test_setpoints import PATH  # noqa: E402
from walked import CASES, made, walk  # noqa: E402

HOME = Home(47.3977419, 8.5455938, 488.2)


WORDS = (
    "slow down in the last third",
    "go up by 5",
    "fly at half the speed",
    "wait 5 seconds at the middle",
    "speed up in the second half",
    "go left by 10",
)


class Killed(BaseException):
    """The station is gone."""


def durations(count: int) -> None:
    """How far told and commanded durations are apart, written and read."""
    written, read = [], []
    for seed in range(count):
        path = generated(seed)
        mission, _ = mission_from(path, Scene(), HOME)
        commanded = Flight.of(mission, path.duration).duration
        written.append(abs(commanded / path.duration - 1.0))
        read.append(abs(parse_plan(dumps_plan(mission, "f"), "f").trajectory.duration / commanded - 1.0))
    for name, errors in (("written", written), ("read", read)):
        print(f"{name:8} median {np.median(errors):.2%}, worst {max(errors):.2%} of {count} paths")


def adapted(count: int) -> None:
    """How many missions, read, adapted and made anew, last as long as their paths."""
    agree = made_ = 0
    for seed in range(count):
        mission, _ = mission_from(generated(seed), Scene(), HOME)
        task = parse_plan(dumps_plan(mission, "f"), "f")
        for words in WORDS:
            result = adapt(Request(words, task.trajectory, task.scene), writer="builtin")
            agree += flight_of(result.adapted, result.scene, Choices())[0].agrees
            made_ += 1
    print(f"adapted  {agree} of {made_} missions last as long as their paths, to 5 %")


def lossy(count: int, loss: float) -> None:
    """Missions that arrive whole over a link that loses and repeats."""
    mavlink.RESEND = 0.05
    mavlink.RETRIES = 40
    whole = items = messages = 0
    for seed in range(count):
        chance = random.Random(seed)

        def passes(name: str, n: int, chance: random.Random = chance) -> int:
            return chance.choices([0, 1, 2], [loss, 0.9 - loss, 0.1])[0]

        path = generated(seed)
        mission, _ = mission_from(path, Scene(), HOME)
        sent = numbered(mission, with_home=False)
        with Responder(incoming=passes, outgoing=passes) as vehicle:
            place = f"mavlink:udpout:127.0.0.1:{vehicle.port}?timeout=6"
            deliver(place, path, Scene(), choices=Choices(home=HOME))
        same = [(i.command, i.seq) for i in vehicle.items] == [(item.command, k) for k, item in enumerate(sent)]
        whole, items = whole + same, items + len(sent)
        messages += sum(vehicle.seen.values()) + sum(vehicle.sent.values())
    link = f"{messages} messages, {loss:.0%} lost and 10% repeated both ways"
    print(f"{whole} of {count} missions whole: {items} items, each once and in order ({link})")


def killed(count: int, loss: float) -> None:
    """In which state vehicles are after their station was killed."""
    states: dict[str, int] = {}
    for seed in range(count):
        chance = random.Random(seed)
        px4 = bool(seed % 2)
        copter = Copter(px4=px4, loss=loss, jitter=0.05, seed=seed)
        pilot = Pilot(copter, Course.of(PATH, Scene(), Robot("any"), 20.0))

        def kill(_: object) -> None:
            raise Killed

        copter.at.append((chance.uniform(0.2, 7.5), kill))
        try:
            pilot.fly()
            how = "arrived"
        except Killed:
            how = "killed"
        except LinkError:
            how = "ended with an error"
        copter.run(1.5 if px4 else 3.5)
        moves = "moving" if np.linalg.norm(copter.velocity) > 0.0 else "still"
        key = f"{'PX4' if px4 else 'ArduPilot'}, {how}: {copter.state}, {moves}"
        states[key] = states.get(key, 0) + 1
    for key, number in sorted(states.items()):
        print(f"{number:4} {key}")


def walks() -> None:
    """`ovita send` as a process: its exit code, the vehicle's state at the end, and what is said."""
    with tempfile.TemporaryDirectory() as folder:
        file = made(folder)
        for px4 in (True, False):
            print("PX4" if px4 else "ArduPilot")
            for number, case in enumerate(CASES):
                seen = walk(case, file, px4=px4, seed=number)
                said = seen.sentence.partition("setpoints: ")[2] if seen.code > 0 else ""
                print(f"  {case:32} exit code {seen.code:3}  {seen.state:12} {said}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--paths", type=int, default=50)
    parser.add_argument("--missions", type=int, default=100)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--loss", type=float, default=0.2)
    parser.add_argument("--no-walks", action="store_true")
    options = parser.parse_args()
    durations(options.paths)
    adapted(options.paths // 4)
    killed(options.kills, options.loss)
    lossy(options.missions, options.loss)
    if not options.no_walks:
        walks()


if __name__ == "__main__":
    main()
