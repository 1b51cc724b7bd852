"""The rules reader on ordinary requests: each comes to its frames, with nothing left over and nothing against it."""

import numpy as np
import pytest

from ovita.instruct.chunks import chunks
from ovita.instruct.frames import same
from ovita.instruct.notation import parse, show
from ovita.instruct.referee import contradictions
from ovita.instruct.rules import read
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory

SCENE = Scene(
    (
        SceneObject("cup", [0.1, 0.2, 0.3]),
        SceneObject("Yellow Plate", [0.5, 0.2, 0.0], [0.2, 0.2, 0.02]),
        SceneObject("fan", [0.9, -0.1, 0.0]),
        SceneObject("red wine", [0.3, 0.9, 0.0]),
    )
)
PATH = Trajectory(np.column_stack([np.linspace(0, 1, 40), np.linspace(0, 0.3, 40), np.full(40, 0.2)]), np.full(40, 0.4))

REQUESTS = [
    ("go left", "move left"),
    ("Please shift the path slightly to the right", "move right deg=slight"),
    ("fly much higher", "move up deg=large"),
    ("go lower", "move down"),
    ("move 30 cm forwards", "move front=30cm"),
    ("translate everything backward by two metres", "move back=2m"),
    ("go up by .25 and 0.5 m to the left", "move up=0.25m left=0.5m"),
    ("increase the altitude by 150 mm", "move up=150mm"),
    ("raise the arm by 0.1", "move up=0.1m"),
    ("shift the start 0.1 to the left", "end start left=0.1m"),
    ("the goal position should be a bit lower", "end goal down deg=slight"),
    ("after reaching the goal go up by 0.3", "extend up=0.3m"),
    ("go closer to the cup", "closer cup"),
    ("get much nearer to the yellow plate", "closer Yellow_Plate deg=large"),
    ("hold a smaller distance from the fan", "closer fan"),
    ("head towards the plate", "closer Yellow_Plate"),
    ("go 0.1 m closer to the cup", "closer cup by=0.1m"),
    ("stay a little further off from the fan", "farther fan deg=slight"),
    ("increase the distance to the cup", "farther cup"),
    ("avoid the red wine", "farther red_wine"),
    ("keep at least 0.3 away from the cup", "clearance cup at_least=0.3m"),
    ("maintain a minimum distance of 20 cm from the cup and the fan", "clearance cup+fan at_least=20cm"),
    ("pass through the cup", "via cup"),
    ("go over the plate", "via over=Yellow_Plate"),
    ("pass between the cup and the fan", "via between=cup+fan"),
    ("start at the fan", "end start to=fan"),
    ("continue to the fan", "extend to=fan"),
    ("wait at the cup for 12 timesteps", "wait at=cup for=12steps"),
    ("pause near the cup for 3 seconds", "wait at=cup for=3s"),
    ("stop near the fan", "stop at=fan"),
    ("slow down", "pace slower"),
    ("go faster near the fan", "pace faster @near=fan"),
    ("reduce the speed by 20 % within 0.3 m of the cup", "pace slower by=20% @near=cup,0.3m"),
    ("double the speed when passing the cup", "pace faster by=2x @near=cup"),
    ("halve the velocity in the first half", "pace set to=0.5x @first=50%"),
    ("go three times faster", "pace faster by=3x"),
    ("increase the speed by 0.1 m/s", "pace faster by=0.1m/s"),
    ("lower the speed at the end", "pace slower @last"),
    ("drive at a constant speed of 0.3", "pace constant to=0.3m/s"),
    ("keep a constant speed after the cup", "pace constant @after=cup"),
    ("set the speed to 0.2 for the last 10 waypoints", "pace set to=0.2m/s @last=10wp"),
    ("slow down when going up", "pace slower @rising"),
    ("accelerate gradually", "pace rampup"),
    ("decelerate to a stop", "pace rampdown"),
    ("go slower between the cup and the fan while passing", "pace slower @between=cup+fan"),
    ("slow down in the middle of the path", "pace slower @middle"),
    ("slow down in the first 0.5 m", "pace slower @first=0.5m"),
    ("slow down in the last 2 seconds", "pace slower @last=2s"),
    ("go faster between waypoint 10 and 30", "pace faster @range=10-30"),
    ("go slower from the cup onwards", "pace slower @after=cup"),
    ("slow down until the midpoint", "pace slower @first=50%"),
    ("don't exceed 0.3 m/s", "pace at_most=0.3m/s"),
    ("go no slower than 0.1 m/s", "pace at_least=0.1m/s"),
    ("take twice as long", "pace set to=0.5x"),
    ("go 0.1 m/s slower", "pace slower by=0.1m/s"),
    ("don't change the speed along the way", "pace constant"),
    ("draw a spiral with a radius of 0.1 near the cup", "spiral at=cup radius=0.1m"),
    ("orbit the fan twice with a radius of 0.3", "circle fan radius=0.3m turns=2"),
    ("circle once around the cup", "circle cup turns=1"),
    ("fly a figure eight at the goal", "eight at=goal"),
    ("follow the path in a zig-zag with an amplitude of 0.05", "zigzag size=0.05m"),
    ("move in a sinusoidal pattern in the last half", "wave @last=50%"),
    ("hop over the cup", "hop cup"),
    ("hover 0.2 above the plate for 2 seconds", "hover Yellow_Plate by=0.2m for=2s"),
    ("rotate the path clockwise by 45 degrees", "rotate 45deg cw"),
    ("scale the path by 1.5", "resize by=1.5x"),
    ("make the path much more curved", "curve more"),
    ("go straight from the cup to the fan", "straighten @between=cup+fan"),
    ("replace each group of 4 waypoints by its mean", "waypoints merge=4"),
    ("never go higher than 0.3", "height at_most=0.3m"),
    ("always stay left of the fan", "side fan left"),
    ("stay in the second quadrant", "quadrant 2"),
    ("keep a height of 0.2 above the floor", "height to=0.2m"),
    ("slow down to 30 % near the cup", "pace slower to=30% @near=cup"),
    ("reduce the speed by 30 %", "pace slower by=30%"),
    ("raise the speed to 150 %", "pace faster to=150%"),
    ("increase the speed by half", "pace faster by=50%"),
    ("move at 50 % speed", "pace slower by=50%"),
    ("enlarge the path by 20 %", "resize larger by=20%"),
    ("scale the path down by 10 %", "resize smaller by=10%"),
    ("slow down before the turns", "pace turns"),
    ("go left by 0.2 and slow down near the cup", "move left=0.2m; pace slower @near=cup"),
    ("go up, then closer to the fan but slower near the plate", "move up; closer fan; pace slower @near=Yellow_Plate"),
    ("Go left by 0.1. Wait at the fan for 5 steps.", "move left=0.1m; wait at=fan for=5steps"),
    ("go faster near the cup and slower near the fan", "pace faster @near=cup; pace slower @near=fan"),
    ("when passing the cup, slow down", "pace slower @near=cup"),
    ("double the number of waypoints and smooth the path", "waypoints by=2x; smooth"),
    (
        "go left by 0.2 for the first half and right by 0.2 for the second half",
        "move left=0.2m @first=50%; move right=0.2m @last=50%",
    ),
    ("speed up while going left", "pace faster @heading=left"),
    ("finish 5 cm above the plate", "end goal up=5cm to=Yellow_Plate"),
    ("set the pace to 0.1 m/s between the cup and the fan", "pace set to=0.1m/s @between=cup+fan"),
    ("keep 0.2 m distance from the cup while moving at 0.5 m/s", "clearance cup at_least=0.2m; pace set to=0.5m/s"),
    ("first go left, second go up, finally slow down", "move left up; pace slower"),
    ("slow down near the cup after moving everything left by 0.2", "pace slower @near=cup; move left=0.2m"),
    ("keep the goal fixed and go left", "keep goal; move left"),
    ("go left without changing the speed", "move left; keep speed"),
    ("follow the same path but faster", "pace faster"),
    ("wait at the cup for 5 steps and then carry on", "wait at=cup for=5steps"),
    # a distance to things that move, and laws
    ("the nearer to the fan, the quicker", "pace faster @near=fan"),
    ("pass with the fan on your left", "side fan right"),
    ("between the fan and the goal, up by 2 cm", "move up=2cm @after=fan"),
    ("come within 12 cm of the fan", "clearance fan at_most=12cm"),
    ("lower the last 5 waypoints by 1 cm and slow them down", "move down=1cm @last=5wp; pace slower @last=5wp"),
    ("0.3 m/s until the fan and 0.2 m/s afterwards", "pace set to=0.3m/s @before=fan; pace set to=0.2m/s @after=fan"),
    ("halve how far you stay from the fan", "closer fan by=0.5x"),
    ("head straight for the goal", "straighten"),
    ("multiply the speed by 1.5", "pace set to=1.5x"),
    ("keep the velocity under 0.3 m/s", "pace at_most=0.3m/s"),
]


def doubts(sentence, reading):
    return contradictions(chunks(sentence, SCENE, PATH.positions)[0], reading.frames)


@pytest.mark.parametrize(("sentence", "notation"), REQUESTS, ids=[r[0] for r in REQUESTS])
def test_a_request_is_read_whole(sentence, notation):
    reading = read(sentence, SCENE, PATH.positions)
    assert same(reading.frames, parse(notation, SCENE.names)), show(reading.frames)
    assert not (reading.unread or reading.question or reading.improper or doubts(sentence, reading))


OPEN = [
    "do a barrel roll",
    "go closer to the vase",
    "move left unless it rains",
    "paint the cup blue",
    "xyzzy",
    "slow down within 0.3 m",
    "push the cup to the left",
    "lift the cup by 5 cm",
    "rotate the cup by 30 degrees",
    "close the fan",
    "point the gripper down",
    "turn the gripper by 20 degrees",
    "go back to the original path",
    "stay as far from the fan as from the cup",
    "make the path half as long",
    "avoid the left side",
    "don't go left",
    "make a figure eight around the cup and the fan",
    "approach the cup from the left",
    "go left and end there",
    "stop slowing down",
    "go around the fan",
    "don't slow down",
    "go left by 0.1 and keep at least a distance of 0.3",
    "keep 5 cm more distance from the cup than from the fan",
    "avoid the fan unless it is off",
]


@pytest.mark.parametrize("sentence", OPEN)
def test_what_has_no_place_is_left_over_or_doubted(sentence):
    reading = read(sentence, SCENE, PATH.positions)
    whole = reading.frames and not (reading.unread or reading.question or reading.improper)
    assert not whole or doubts(sentence, reading)
