"""Ordinary requests, one by one: each comes to its frames, at once or after a yes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ovita.instruct.meaning import same
from ovita.instruct.notation import parse, show
from ovita.instruct.understanding import understand
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
THINGS = Scene(tuple(SceneObject(name, np.array([i, 1.0, 0.5])) for i, name in enumerate(("cup", "box", "lamp"))))
PATH = Trajectory(np.column_stack([np.linspace(0, 1, 40), np.linspace(0, 0.3, 40), np.full(40, 0.2)]), np.full(40, 0.4))

REQUESTS = [
    # said again, shortened, denied, and left as it is
    ("lower, six centimetres lower wherever you are by the fan", "move down=6cm @near=fan"),
    ("accelerate by approx. a quarter between the cup and the fan", "pace faster by=25% @between=cup+fan"),
    ("stop getting so close to the cup", "farther cup"),
    ("the first half is left intact, the second half goes 10 cm up", "keep @first=50%; move up=10cm @last=50%"),
    ("start segment as planned, the rest 15% quicker", "keep @first; pace faster by=15% @!first"),
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
    ("pass with the fan on your left", "side fan right"),
    ("come within 12 cm of the fan", "clearance fan at_most=12cm"),
    ("lower the last 5 waypoints by 1 cm and slow them down", "move down=1cm @last=5wp; pace slower @last=5wp"),
    ("0.3 m/s until the fan and 0.2 m/s afterwards", "pace set to=0.3m/s @before=fan; pace set to=0.2m/s @after=fan"),
    ("halve how far you stay from the fan", "closer fan by=50%"),
    ("head straight for the goal", "straighten"),
    ("multiply the speed by 1.5", "pace set to=1.5x"),
    ("keep the velocity under 0.3 m/s", "pace at_most=0.3m/s"),
    # what a part that is named first, or anew, belongs to
    ("from the halfway mark, go faster and 10 cm left", "pace faster @last=50%; move left=10cm @last=50%"),
    ("in the first half go faster and move the whole path up", "pace faster @first=50%; move up"),
    ("10 cm left, and after waypoint 30 raise it by 20 cm", "move left=10cm; move up=20cm @after=30wp"),
    ("it goes 10 cm right, then the last part 20 cm forward", "move right=10cm; move front=20cm @last"),
    ("a bit left, and the goal five centimetres up", "move left deg=slight; end goal up=5cm"),
    # how much, and which way
    ("apart from the last part, everything moves 3 cm back", "move back=3cm @!last"),
    ("two times farther from the fan", "farther fan by=2x"),
    ("15 cm is as close as you get to the fan", "clearance fan at_least=15cm"),
    ("stay inside 10 cm of the fan", "clearance fan at_most=10cm"),
    ("18 inches clear of the fan", "clearance fan at_least=18in"),
    ("move it 3 in up", "move up=3in"),
    ("take 0.05 m/s off near the fan", "pace slower by=0.05m/s @near=fan"),
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
    # points, steps along the axes, and what is not meant
    ("set the goal to (1, 2, 0.5)", "end goal to=(1:2:0.5)"),
    ("end at x=0.3, y=-0.2, z=.1", "end goal to=(0.3:-0.2:0.1)"),
    ("go through [0.3, 0.2, 0.1] and slow down near it", "via (0.3:0.2:0.1); pace slower @near=(0.3:0.2:0.1)"),
    ("circle around (0.5, 0.5, 0.3) twice", "circle (0.5:0.5:0.3) turns=2"),
    ("offset the trajectory by [0.1, 0, 0]", "move x=0.1m"),
    ("pass left of the cup, not right of it", "side cup left"),
    ("pass the fan on the left instead of the right", "side fan left"),
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


@pytest.mark.parametrize(("sentence", "notation"), REQUESTS, ids=[r[0] for r in REQUESTS])
def test_a_request_is_read_as_it_is_meant(sentence, notation):
    verdict = understand(sentence, SCENE, PATH)
    assert same(verdict.reading.frames, parse(notation, SCENE.names)), show(verdict.reading.frames)
    assert verdict.outcome in ("do", "needs_confirmation")


PLAIN = [
    ("left 20 cm", "move left=20cm"),
    ("move it 5 cm up and 10 left", "move up=5cm left=10cm"),
    ("spd -20%", "pace slower by=20%"),
    ("clr >= 80 mm cup", "clearance cup at_least=80mm"),
    ("wp 5-15: L 2 cm", "move left=2cm @range=5-15"),
    ("z += 0.05", "move up=0.05m"),
    ("not so close to the lamp, please", "farther lamp"),
    ("come no nearer than 30 cm to the lamp", "clearance lamp at_least=30cm"),
    ("the goal further from the cup, 10 cm", "end goal away=cup by=10cm"),
    ("never higher than 80 cm", "height at_most=80cm"),
    ("wait 3 s at the box, then go faster", "wait at=box for=3s; pace faster @after=box"),
    ("everywhere except near the cup, 20 % faster", "pace faster by=20% @!near=cup"),
    ("twice around the box, clockwise", "circle box turns=2 cw"),
    ("keep the start, move the rest up 2 cm", "keep start; move up=2cm"),
    ("slow down in the turns", "pace turns"),
    ("slower near the cup because it is hot", "pace slower @near=cup"),
    ("slow down near the cup and near the lamp", "pace slower @near=cup; pace slower @near=lamp"),
    ("keep 20 cm away from both the cup and the lamp", "clearance cup+lamp at_least=20cm"),
    # what turns a sense round
    ("the lamp is much too near", "farther lamp deg=large"),
    ("you drive too slowly", "pace faster"),
    ("without bumping into the box", "clearance box at_least=0m"),
    # distances
    ("leave more space around the box", "farther box"),
    ("the distance to the lamp never below 20 cm", "clearance lamp at_least=20cm"),
    ("double the separation to the cup", "farther cup by=2x"),
    # manners and verbs of motion
    ("inch towards the lamp", "closer lamp"),
    ("advance 10 cm", "move front=10cm"),
    ("drop by 4 cm", "move down=4cm"),
    ("drop the first 3 waypoints", "trim first=3wp"),
    ("climb by 12 cm", "move up=12cm"),
    ("right half a metre", "move right=0.5m"),
    ("backwards by 3 cm", "move back=3cm"),
    # where
    ("slower whenever the lamp is near", "pace slower @near=lamp"),
    ("quicker once you have passed the box", "pace faster @after=box"),
    ("prior to reaching the lamp, 3 cm higher", "move up=3cm @before=lamp"),
    ("from halfway on, 2 cm to the right", "move right=2cm @last=50%"),
    ("until the midpoint, slower", "pace slower @first=50%"),
    # what is said of two things
    ("go right 5 cm while speeding up", "move right=5cm; pace faster"),
    ("raise it by 0.1, then to the left by 0.2", "move up=0.1m left=0.2m"),
    # heights, ends and times
    ("keep below a height of 0.4", "height at_most=0.4m"),
    ("restrict the altitude to 60 cm", "height at_most=60cm"),
    ("when finished, go 10 cm up", "extend up=10cm"),
    ("add 15 cm to the end", "extend by=15cm"),
    ("take half the time", "pace set to=2x"),
    ("a third as fast", "pace set to=33%"),
    ("two loops around the lamp", "circle lamp turns=2"),
    # each clause has its own place
    (
        "left 0.1 for the first third, right 0.1 for the last third",
        "move left=0.1m @first=33%; move right=0.1m @last=33%",
    ),
    ("quicker until the lamp, then slower", "pace faster @before=lamp; pace slower @after=lamp"),
    ("1 m/s for the first 5 waypoints", "pace set to=1m/s @first=5wp"),
    ("raise it by 3 cm over the lamp", "move up=3cm @near=lamp"),
    # to, not by
    ("raise the path to 0.4", "height to=0.4m"),
    ("finish 5 cm above the lamp", "end goal to=lamp up=5cm"),
    ("never drive more than 0.2 m/s", "pace at_most=0.2m/s"),
    ("never drop below 0.2 m/s", "pace at_least=0.2m/s"),
    ("never go right of the lamp", "side lamp left"),
    ("decelerate to a stop", "pace rampdown"),
    ("go left without altering the speed", "move left; keep speed"),
]

NUMBERS = [
    # a number without a unit counts what stands beside it
    ("pass faster within 0.4 of the lamp", "pace faster @near=lamp,40cm"),
    ("move it 0.3 to the left and 0.1 down", "move left=30cm down=10cm"),
    ("stay at least 0.2 clear of the box and the cup", "clearance box+cup at_least=20cm"),
    ("keep a speed of 0.4 while within 0.5 of the cup", "pace set to=0.4m/s @near=cup,50cm"),
    ("multiply the speed by 0.5", "pace set to=50%"),
    ("scale your velocity by 1.5", "pace set to=1.5x"),
    ("go faster near the cup and slower near the box. The threshold is 0.2",
     "pace faster @near=cup,20cm; pace slower @near=box,20cm"),
    ("points 3 to 8 higher", "move up @range=3-8"),
    # where
    ("slower in the vicinity of the lamp", "pace slower @near=lamp"),
    ("drive slower around the location of the box", "pace slower @near=box"),
    ("hurry past the lamp", "pace faster @near=lamp"),
    ("everything past the lamp 5 cm lower", "move down=5cm @after=lamp"),
    ("lift the middle of the route", "move up @middle"),
    ("0.1 up for the first half and 0.1 down for the second half",
     "move up=10cm @first=50%; move down=10cm @last=50%"),
    ("a steady pace after reaching the box", "pace constant @after=box"),
    # distances
    ("cut the gap to the lamp a little", "closer lamp deg=slight"),
    ("with a smaller distance from the cup", "closer cup"),
    ("steer a bit clear of the lamp", "farther lamp deg=slight"),
    ("remain within 30 cm of the box", "clearance box at_most=30cm"),
    # several things in one sentence
    ("go a bit higher and move the start left by 0.1", "move up deg=slight; end start left=10cm"),
    ("shift left keeping the speed", "move left; keep speed"),
    ("walk closer to the cup and keep at least 0.2 from the box", "closer cup; clearance box at_least=20cm"),
    ("keep it level between the cup and the box", "level @between=cup+box"),
    ("constant altitude after the cup please", "level @after=cup"),
    ("keep a constant height of 0.3 m", "height to=0.3m"),
    # ends
    ("the new goal is the midpoint of the cup and the lamp", "end goal to=cup+lamp"),
    ("after reaching the goal go on straight to the box", "extend to=box"),
    ("move the goal backwards by 0.2", "end goal back=20cm"),
    ("run the route backwards", "reverse"),
    ("a small spiral after reaching the goal", "spiral at=goal"),
    ("stop near the lamp for 8 timesteps", "wait at=lamp for=8steps"),
    ("stay on the right", "move right"),
    ("0.5 times as fast", "pace set to=50%"),
    # a clause of its own beside another one
    ("keep away from the cup but stay close to the box", "farther cup; closer box"),
    ("lift everything while the goal stays put", "move up; keep goal"),
    ("smoother and with fewer points", "smooth; waypoints fewer"),
    ("pass on the left side of the lamp and a bit more away from it", "side lamp left; farther lamp deg=slight"),
    ("go to the top and drive slower in the proximity of the box", "move up; pace slower @near=box"),
    ("sink 4 cm. Only between the cup and the lamp.", "move down=4cm @between=cup+lamp"),
    # what is said of the path as it is
    # speeds as targets and as changes
    ("crawl near the box, 0.1 m/s", "pace set to=0.1m/s @near=box"),
    ("take 20 percent off the speed", "pace slower by=20%"),
    ("-0.1 m/s in the last 20 cm", "pace slower by=0.1m/s @last=20cm"),
    ("0.25 times as fast", "pace set to=25%"),
    ("+15 waypoints", "waypoints by=+15wp"),
    ("downsample to 40 points", "waypoints to=40"),
    ("at no point lower than 60 mm above the ground", "height at_least=60mm"),
    ("at the lamp, and only within 10 cm of it, slower", "pace slower @near=lamp,10cm"),
    ("hop over the box, 8 cm clear", "hop box by=8cm"),
    ("end nearer to the lamp, then wait 2 s", "end goal toward=lamp; wait at=goal for=2s"),
]  # fmt: skip


@pytest.mark.parametrize(("sentence", "notation"), [*PLAIN, *NUMBERS])
def test_plain_words_become_their_frames(sentence, notation):
    verdict = understand(sentence, THINGS)
    assert same(verdict.reading.frames, parse(notation, THINGS.names)), show(verdict.reading.frames)
    assert verdict.outcome in ("do", "needs_confirmation")


@settings(max_examples=100, deadline=None)
@given(
    st.lists(
        st.sampled_from(["x", "-", "+", "/", "..", "ray", "5", ".5", "cup", " ", "%", "=", ">", "go", "×", "'"]),
        max_size=9,
    )
)
def test_no_string_of_marks_breaks_the_reader(pieces):
    text = "".join(pieces)
    assert understand(text, THINGS).outcome in ("do", "needs_confirmation", "ask", "decline"), text


@pytest.mark.parametrize(
    "sentence",
    [
        "keep away from the piano",
        "polish the cup",
        "shift by 5 cm",
        "who won the game",
        "left unless the cup is in the way",
        "from 0.1 to 0.5 m/s",
        "pick up the cup",
        "turn left",
        "stay as far from the cup as from the lamp",
        "go faster and slower",
        "at least 30 cm from the cup and at most 10 cm from the cup",
        "speed at least 2 m/s, at most 1 m/s",
        "go to the second box",
        "lift the cup by 5 cm",
        "keep 5 cm more distance from the cup than from the lamp",
        "avoid the lamp unless it is off",
        "axis +30 mm",
    ],
)
def test_what_cannot_be_done_is_not_done(sentence):
    assert understand(sentence, THINGS).outcome != "do"
