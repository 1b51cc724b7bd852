"""Parts of the path and objects that words mean, beside what the network's places can say."""

import pytest

from ovita.instruct.meaning import same
from ovita.instruct.notation import parse, show
from ovita.instruct.sketch import sketch
from ovita.instruct.understanding import understand
from ovita.paths.scene import Scene, SceneObject

SCENE = Scene(
    tuple(
        SceneObject(name, [k * 0.4 - 0.6, 0.3, 0.1], [0.1, 0.1, 0.2])
        for k, name in enumerate(("hoop", "tuba", "goat_1", "goat_2"))
    )
)


@pytest.mark.parametrize(
    ("sentence", "frames"),
    [
        ("closer to everything except the hoop", "closer tuba+goat_1+goat_2"),
        ("All but the hoop: 5 cm more distance.", "farther tuba+goat_1+goat_2 by=5cm"),
        ("More distance to all except the tuba.", "farther hoop+goat_1+goat_2"),
        ("beyond 1 m to the right: slow", "pace slower @beyond=right,1m"),
        ("More than 20 cm to the left: speed limit 0.1.", "pace at_most=0.1m/s @beyond=left,0.2m"),
        ("Second quarter: 1.5x faster.", "pace faster by=1.5x @range=25-50%"),
        ("From the middle onward, 2 metres up.", "move up=2m @after=50%"),
        ("Straight until the middle.", "straighten @before=50%"),
        ("From three quarters on, straight.", "straighten @after=75%"),
        ("Represent the route by 80 waypoints.", "waypoints to=80"),
        ("Thin out the samples by a factor of two.", "waypoints by=0.5x"),
        ("Never in front of the tuba.", "side tuba back"),
        ("Gap to tuba times 0.5.", "closer tuba by=0.5x"),
        ("go 5 cm closer to the tuba", "closer tuba by=5cm"),
        ("hug the tuba closer, about a foot off", "clearance tuba at=1ft"),
        (
            "slower over the hoop and the tuba, and wider around them",
            "pace slower @near=hoop+tuba; farther hoop+tuba",
        ),
        ("First half takes ten minutes, second half takes six.", "pace to=10min @first=50%; pace to=6min @last=50%"),
    ],
)
def test_what_words_say_of_the_part_and_the_objects(sentence, frames):
    read = understand(sentence, SCENE).reading.frames
    assert same(read, parse(frames, SCENE.names)), show(read)


def test_a_top_speed_and_a_bottom_speed_are_a_cap_and_a_floor():
    read = understand("Top speed 4 km/h, bottom speed 1 km/h.", SCENE).reading.frames
    assert same(read, parse("pace at_most=4km/h; pace at_least=1km/h")), show(read)


@pytest.mark.parametrize(
    "sentence", ["Pass goat_1 on the left.", "pass goat 1 on the left", "Pass GOAT_1 on the left."]
)
def test_a_name_is_known_as_it_is_written(sentence):
    assert [m.items for m in sketch(sentence, SCENE).mentions] == [("goat_1",)]
    verdict = understand(sentence, SCENE)
    assert verdict.outcome == "do" and verdict.reading.frames[0].objects == ("goat_1",)
