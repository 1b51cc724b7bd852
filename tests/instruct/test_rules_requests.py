"""The rules reader on ordinary requests: each comes to its frames, with nothing left over and nothing against it."""

import numpy as np
import pytest
from unusual_requests import UNUSUAL

from ovita.instruct.chunks import chunks
from ovita.instruct.contradictions import contradictions
from ovita.instruct.meaning import same
from ovita.instruct.notation import parse, show
from ovita.instruct.numerals import written_out
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
    # said again, shortened, denied, and left as it is
    ("lower, six centimetres lower wherever you are by the fan", "move down=6cm @near=fan"),
    ("move 1/4 to 1/2 m left", "move left=37.5cm"),
    ("accelerate by approx. a quarter between the cup and the fan", "pace faster by=25% @between=cup+fan"),
    ("stop getting so close to the cup", "farther cup"),
    ("the first half is left intact, the second half goes 10 cm up", "keep @first=50%; move up=10cm @last=50%"),
    ("start segment as planned, the rest 15% quicker", "keep start; pace faster by=15% @!first"),
    ("pass above the cup with 15 cm of clearance", "via over=cup by=15cm"),
    (
        "visit the cup, wait there 2 s, then on to the fan and finish there",
        "via cup; wait at=cup for=2s; end goal to=fan",
    ),
    (
        "go left by 0.2 for the first half and right by 0.2 for the second half",
        "move left=0.2m @first=50%; move right=0.2m @last=50%",
    ),
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
    # what a part that is named first, or anew, belongs to
    ("at the end, move down 10 cm and slow down", "move down=10cm @last; pace slower @last"),
    ("from the halfway mark, go faster and 10 cm left", "pace faster @last=50%; move left=10cm @last=50%"),
    ("near the fan: slower, 5 cm up and 2 cm left", "pace slower @near=fan; move up=5cm left=2cm @near=fan"),
    ("in the first half go faster and move the whole path up", "pace faster @first=50%; move up"),
    ("10 cm left, and after waypoint 30 raise it by 20 cm", "move left=10cm; move up=20cm @after=30wp"),
    ("it goes 10 cm right, then the last part 20 cm forward", "move right=10cm; move front=20cm @last"),
    ("the middle up, the whole path a touch left", "move up @middle; move left deg=slight"),
    ("a bit left, and the goal five centimetres up", "move left deg=slight; end goal up=5cm"),
    ("slow down at the fan and stop there", "pace slower @near=fan; stop at=fan"),
    # how much, and which way
    ("apart from the last part, everything moves 3 cm back", "move back=3cm @!last"),
    ("two times farther from the fan", "farther fan by=2x"),
    ("15 cm is as close as you get to the fan", "clearance fan at_least=15cm"),
    ("stay inside 10 cm of the fan", "clearance fan at_most=10cm"),
    ("18 inches clear of the fan", "clearance fan at_least=18in"),
    ("move it 3 in up", "move up=3in"),
    ("take 0.05 m/s off near the fan", "pace slower by=0.05m/s @near=fan"),
    ("3 inches onto the height", "move up=3in"),
    ("let the speed sink evenly to 0.1 m/s", "pace rampdown to=0.1m/s"),
    ("would you mind going underneath the fan?", "via under=fan"),
    ("kick off from the fan", "end start to=fan"),
    ("move it up and 10 cm to the left", "move up left=10cm"),
    ("everything a tad forward, and half an inch down", "move front down=0.5in deg=slight"),
    ("go left 5 cm up 3 cm", "move left=5cm up=3cm"),
    ("never higher than 30 cm, never quicker than 5 m/s", "height at_most=30cm; pace at_most=5m/s"),
    ("above 3 m go slower", "pace slower @beyond=up,3m"),
    ("right after the fan, rise 5 cm", "move up=5cm @after=fan"),
    ("pull up 10 cm short of the fan", "stop at=fan by=10cm"),
    ("the whole path but the last bit, quicker", "pace faster @!last"),
    ("rotate it ninety degrees counter clock wise", "rotate 90deg ccw"),
    ("fifteen to twenty centimetres up", "move up=17.5cm"),
    ("take a third off your speed", "pace slower by=33%"),
    ("make it smaller, 80%", "resize by=0.8x"),
    ("trim the first 5 waypoints, then remove jitter", "trim first=5wp; smooth"),
    ("slow down 20% and stay 25 cm clear of the fan", "pace slower by=20%; clearance fan at_least=25cm"),
    ("20 waypoints, and keep the speed the same", "waypoints to=20; keep speed"),
    ("thread it between the cup and the fan, slowly there", "via between=cup+fan; pace slower @between=cup+fan"),
    ("translate it by 0.4 m in the negative y direction", "move -y=0.4m"),
    ("all the way back to where we started", "return"),
    ("height at most 12 cm, the floor is wet", "height at_most=12cm"),
    ("raise it without changing the speed", "move up; keep speed"),
    ("accelerate by -0.3 m/s2 near the fan", "pace accelerate by=-0.3m/s2 @near=fan"),
    ("raise it by -5 cm", "move up=-5cm"),
    ("bigger, ten percent", "resize larger by=10%"),
    ("higher in the middle and also a bit to the left overall", "move up @middle; move left deg=slight"),
    ("slow down to a third near the fan", "pace slower to=33% @near=fan"),
    ("wp 8..14 up 4 cm", "move up=4cm @range=8-14"),
    # what a second writer's words showed
    ("past the cup on the left, then speed up", "side cup left; pace faster @after=cup"),
    (
        "constant speed everywhere but near the fan; there I want it slower",
        "pace constant @!near=fan; pace slower @near=fan",
    ),
    (
        "20 percent quicker where the path is rising, and 20 percent slower where it descends",
        "pace faster by=20% @rising; pace slower by=20% @falling",
    ),
    (
        "not more than two feet per second, except near the goal, there not more than half a foot per second",
        "pace at_most=2ft/s; pace at_most=0.5ft/s @last",
    ),
    ("y axis +30 mm", "move y=3cm"),
    ("smooth it, then back to where you set off", "smooth; return"),
    ("be far from the cup and be near the fan", "farther cup; closer fan"),
    ("there is too much shaking", "smooth"),
    # how long the way takes
    ("make it take 20 seconds", "pace to=20s"),
    ("finish in 10 s", "pace to=10s"),
    ("the whole thing should last half a minute", "pace to=30s"),
    ("it should take at most 15 seconds", "pace at_most=15s"),
    ("do the first half in 4 s", "pace to=4s @first=50%"),
    ("be done in 12 seconds and stay away from the cup", "pace to=12s; farther cup"),
    ("slow down in the last 5 seconds", "pace slower @last=5s"),
    ("wait at the cup for 5 s and take it slow", "wait at=cup for=5s; pace slower"),
    # points, steps along the axes, and what is not meant
    ("set the goal to (1, 2, 0.5)", "end goal to=(1:2:0.5)"),
    ("end at x=0.3, y=-0.2, z=.1", "end goal to=(0.3:-0.2:0.1)"),
    ("go through [0.3, 0.2, 0.1] and slow down near it", "via (0.3:0.2:0.1); pace slower @near=(0.3:0.2:0.1)"),
    ("circle around (0.5, 0.5, 0.3) twice", "circle (0.5:0.5:0.3) turns=2"),
    ("shift it by (0.10, -0.05, 0.02)", "move x=0.1m -y=0.05m z=0.02m"),
    ("offset the trajectory by [0.1, 0, 0]", "move x=0.1m"),
    ("pass left of the cup, not right of it", "side cup left"),
    ("pass the fan on the left instead of the right", "side fan left"),
    ("raise it rather than lower it", "move up"),
    ("increase the distance to the cup to 20 cm", "clearance cup at_least=20cm"),
    ("decrease the gap to the fan to 5 cm", "clearance fan at_most=5cm"),
    ("leave the cup to port", "side cup right"),
    ("leave the cup on your left", "side cup right"),
    # ways that are not to be taken
    ("do not fly over the cup", "avoid over=cup"),
    ("never over the fan", "avoid over=fan"),
    ("don't pass under the fan", "avoid under=fan"),
    ("avoid going over the cup, and slow down near the fan", "avoid over=cup; pace slower @near=fan"),
    ("it must not pass between the cup and the fan", "avoid between=cup+fan"),
]


def doubts(sentence, reading):
    return contradictions(chunks(written_out(sentence), SCENE, PATH.positions)[0], reading.frames)


@pytest.mark.parametrize(("sentence", "notation"), REQUESTS, ids=[r[0] for r in REQUESTS])
def test_a_request_is_read_whole(sentence, notation):
    reading = read(written_out(sentence), SCENE, PATH.positions)
    assert same(reading.frames, parse(notation, SCENE.names)), show(reading.frames)
    assert not (reading.unread or reading.question or reading.improper or doubts(sentence, reading))


OPEN = [
    *UNUSUAL,
    "lift the cup by 5 cm",
    "keep 5 cm more distance from the cup than from the fan",
    "avoid the fan unless it is off",
    "give the cup 40 cm more room and the same for the fan",
    "to the right by 8 cm and up by the same",
    "axis +30 mm",
]


@pytest.mark.parametrize("sentence", OPEN)
def test_what_has_no_place_is_left_over_or_doubted(sentence):
    reading = read(sentence, SCENE, PATH.positions)
    whole = reading.frames and not (reading.unread or reading.question or reading.improper)
    assert not whole or doubts(sentence, reading)
