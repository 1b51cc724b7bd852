"""The rules reader on ordinary requests: each comes to its frames, with nothing left over and nothing against it."""

import numpy as np
import pytest
from unusual_requests import UNUSUAL

from ovita.instruct.chunks import chunks
from ovita.instruct.contradictions import contradictions
from ovita.instruct.frames import same
from ovita.instruct.notation import parse, show
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
]


def doubts(sentence, reading):
    return contradictions(chunks(sentence, SCENE, PATH.positions)[0], reading.frames)


@pytest.mark.parametrize(("sentence", "notation"), REQUESTS, ids=[r[0] for r in REQUESTS])
def test_a_request_is_read_whole(sentence, notation):
    reading = read(sentence, SCENE, PATH.positions)
    assert same(reading.frames, parse(notation, SCENE.names)), show(reading.frames)
    assert not (reading.unread or reading.question or reading.improper or doubts(sentence, reading))


OPEN = [
    *UNUSUAL,
    "lift the cup by 5 cm",
    "keep 5 cm more distance from the cup than from the fan",
    "avoid the fan unless it is off",
]


@pytest.mark.parametrize("sentence", OPEN)
def test_what_has_no_place_is_left_over_or_doubted(sentence):
    reading = read(sentence, SCENE, PATH.positions)
    whole = reading.frames and not (reading.unread or reading.question or reading.improper)
    assert not whole or doubts(sentence, reading)
