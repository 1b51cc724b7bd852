"""Two plain wishes, put together, are read as the two: neither takes words from the other."""

import random

from ovita.instruct.frames import Pace
from ovita.instruct.meaning import same
from ovita.instruct.notation import parse, show
from ovita.instruct.understanding import understand
from ovita.paths.scene import Scene, SceneObject

SCENE = Scene(tuple(SceneObject(name, [0.3 * i, 0.2, 0.0]) for i, name in enumerate(("cup", "fan", "box"))))

WISHES = {
    "move the path 10 cm to the left": "move left=10cm",
    "go up by 5 cm": "move up=5cm",
    "lower the path a bit": "move down deg=slight",
    "shift the path right": "move right",
    "raise the goal by 3 cm": "end goal up=3cm",
    "move the start 4 cm back": "end start back=4cm",
    "slow down": "pace slower",
    "slow down near the cup": "pace slower @near=cup",
    "go 20 % faster at the end": "pace faster by=20% @last",
    "don't exceed 0.3 m/s": "pace at_most=0.3m/s",
    "keep a constant speed": "pace constant",
    "stay 20 cm away from the box": "clearance box at_least=20cm",
    "get closer to the cup": "closer cup",
    "keep further from the fan": "farther fan",
    "pass the box on the left": "side box left",
    "pass over the cup by 10 cm": "via over=cup by=10cm",
    "go between the cup and the fan": "via between=cup+fan",
    "wait 2 s at the box": "wait at=box for=2s",
    "stop at the box": "stop at=box",
    "end at the fan": "end goal to=fan",
    "circle the cup twice": "circle cup turns=2",
    "make it smoother": "smooth",
    "keep the goal where it is": "keep goal",
    "leave the first half as it is": "keep @first=50%",
    "go higher in the second half": "move up @last=50%",
    "raise waypoints 5 to 10 by 2 cm": "move up=2cm @range=5-10",
    "stay below 50 cm": "height at_most=50cm",
    "go straight between the cup and the box": "straighten @between=cup+box",
    "reverse the path": "reverse",
    "mirror the path left to right": "mirror left",
    "make the path 20 % larger": "resize larger by=20%",
    "rotate the path by 90 degrees clockwise": "rotate 90deg cw",
    "cut the last 5 waypoints": "trim last=5wp",
    "zigzag in the middle": "zigzag @middle",
    "return to the start": "return",
    "bend less": "curve less",
    "halve the number of waypoints": "waypoints by=50%",
}
MEANT = {said: parse(notation, SCENE.names)[0] for said, notation in WISHES.items()}
JOINTS = (" and ", ", ", ". ")


def test_two_plain_wishes_are_read_as_two():
    rng, right, wrong = random.Random(3), 0, []
    pairs = [(one, other) for one in WISHES for other in WISHES if one != other]
    for i, (one, other) in enumerate(rng.sample(pairs, 150)):
        pair = MEANT[one], MEANT[other]
        if all(isinstance(frame, Pace) for frame in pair):  # "slowly, but faster at the end" is said of the rest
            continue
        verdict = understand(one + JOINTS[i % 3] + other, SCENE)
        if same(verdict.reading.frames, pair):
            right += 1
        elif verdict.outcome == "do":
            wrong.append(f"{one}{JOINTS[i % 3]}{other}: {show(verdict.reading.frames)}")
    assert right >= 135 and len(wrong) <= 8, (right, wrong)
