"""The rules reader: sentences to frames, by the table."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ovita.instruct.frames import Reading
from ovita.instruct.meaning import same
from ovita.instruct.notation import parse, show
from ovita.instruct.rules import read
from ovita.instruct.understanding import understand
from ovita.paths.scene import Scene, SceneObject

NAMES = ("cup", "box", "lamp")
SCENE = Scene(tuple(SceneObject(name, np.array([i, 1.0, 0.5])) for i, name in enumerate(NAMES)))


@pytest.mark.parametrize(
    ("sentence", "notation"),
    [
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
        ("slow down near the cup and near the lamp", "pace slower @near=cup+lamp"),
        ("keep 20 cm away from both the cup and the lamp", "clearance cup+lamp at_least=20cm"),
        # what turns a sense round
        ("the lamp is much too near", "farther lamp"),
        ("you drive too slowly", "pace faster"),
        ("without bumping into the box", "clearance box at_least=0m"),
        # distances
        ("reduce the gap between the gripper and the lamp", "closer lamp"),
        ("leave more space around the box", "farther box"),
        ("the distance to the lamp never below 20 cm", "clearance lamp at_least=20cm"),
        ("double the separation to the cup", "farther cup by=2x"),
        # manners and verbs of motion
        ("inch towards the lamp", "closer lamp"),
        ("withdraw by 5 cm", "move back=5cm"),
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
        ("slower after shifting everything up by 3 cm", "pace slower; move up=3cm"),
        # heights, ends and times
        ("keep below a height of 0.4", "height at_most=0.4m"),
        ("restrict the altitude to 60 cm", "height at_most=60cm"),
        ("when finished, go 10 cm up", "extend up=10cm"),
        ("add 15 cm to the end", "extend by=15cm"),
        ("take half the time", "pace set to=2x"),
        ("a third as fast", "pace set to=33%"),
        ("two loops around the lamp", "circle lamp turns=2"),
        # each clause has its own place
        ("2 cm up at the start and 3 cm down at the end", "move up=2cm @first; move down=3cm @last"),
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
    ],
)
def test_a_sentence_becomes_its_frames(sentence, notation):
    verdict = understand(sentence, SCENE, quick=True)
    assert same(verdict.reading.frames, parse(notation, NAMES)), show(verdict.reading.frames)
    assert verdict.outcome in ("do", "needs_confirmation")


@pytest.mark.parametrize(
    ("sentence", "notation"),
    [
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
        ("move the start up and left", "end start up left"),
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
        ("a small spiral after reaching the goal", "spiral at=goal deg=slight"),
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
    ],
)  # fmt: skip
def test_plain_requests_with_numbers_and_several_clauses_are_read(sentence, notation):
    verdict = understand(sentence, SCENE, quick=True)
    assert same(verdict.reading.frames, parse(notation, NAMES)), show(verdict.reading.frames)
    assert verdict.outcome in ("do", "needs_confirmation")


@settings(max_examples=150, deadline=None)
@given(
    st.lists(
        st.sampled_from(["x", "-", "+", "/", "..", "ray", "5", ".5", "cup", " ", "%", "=", ">", "go", "×", "'"]),
        max_size=9,
    )
)
def test_no_string_of_marks_breaks_the_rules(pieces):
    text = "".join(pieces)
    assert isinstance(read(text, SCENE), Reading), text


def test_a_number_too_large_for_metres_is_centimetres():
    path = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    assert show(read("lift 80 near the cup", SCENE, path).frames) == "move up=0.8m @near=cup"
    assert show(read("lift 0.08 near the cup", SCENE, path).frames) == "move up=0.08m @near=cup"


@pytest.mark.parametrize(
    "sentence",
    [
        "keep away from the piano",
        "polish the cup",
        "shift by 5 cm",
        "who won the game",
        "left unless the cup is in the way",
        "go back to the original path",
        "make the path half as long",
        "from 0.1 to 0.5 m/s",
        "pick up the cup",
        "turn left",
        "stay as far from the cup as from the lamp",
    ],
)
def test_what_cannot_be_done_is_not_read_as_done(sentence):
    reading = read(sentence, SCENE)
    assert reading.unread or reading.question or reading.improper or not reading.frames


@pytest.mark.parametrize(
    "sentence",
    [
        "go faster and slower",
        "at least 30 cm from the cup and at most 10 cm from the cup",
        "speed at least 2 m/s, at most 1 m/s",
    ],
)
def test_what_excludes_itself_is_improper(sentence):
    assert read(sentence, SCENE).improper


def test_a_described_object_that_the_scene_does_not_have_is_asked_for():
    assert read("go to the second box", SCENE).question == "Which second box is meant?"


def test_how_something_is_told_to_be_is_no_order():
    assert "lamp" in read("you're crowding the lamp, go 5 cm higher", SCENE).unread
