"""Turns of phrase are put in plain words before anybody reads them."""

import pytest

from ovita import Scene, SceneObject
from ovita.instruct.idioms import plainer, without_cargo
from ovita.instruct.meaning import same
from ovita.instruct.notation import parse, show
from ovita.instruct.referee import understand

SCENE = Scene(
    (
        SceneObject("cup", [0.3, 0.3, 0.1], [0.1] * 3),
        SceneObject("shelf B", [0.9, 0.1, 0.1], [0.1] * 3),
        SceneObject("plate", [1.4, 0.1, 0.1], [0.1] * 3),
        SceneObject("paint pot", [1.9, 0.1, 0.1], [0.1] * 3),
    )
)


@pytest.mark.parametrize(
    ("said", "meant"),
    [
        ("drive down the middle between the cup and shelf B", "via between=cup+shelf_B"),
        ("no more stopping at the cup, just drive through", "nonstop @near=cup"),
        ("don't stop at the cup and carry straight on", "nonstop @near=cup"),
        ("30 cm to the right, but start and stop at the same places", "move right=30cm; keep ends"),
        ("normal speed till the cup, after that only slowly", "keep speed @before=cup; pace slower @after=cup"),
        ("wait 10 seconds at the cup instead of 3", "wait at=cup for=10s"),
        ("wait ten seconds at the cup instead of five.", "wait at=cup for=10s"),
        ("drive on the other side of the cup", "side cup other"),
        ("go 20 cm wider round the cup than now", "farther cup by=20cm"),
        ("stay 5 cm higher all the way", "move up=5cm"),
        ("slow down when you go over to the cup", "pace slower @before=cup"),
        ("10 percent slower but not the last bit over the cup", "pace slower by=10percent @!near=cup"),
        ("go faster to the cup", "pace faster @before=cup"),
        (
            "go to the plate faster but back to the cup as slowly as now",
            "pace faster @before=plate; keep speed @before=cup",
        ),
        ("put it down more gently", "pace slower @last"),
        ("no stop at the cup today, it is empty", "nonstop @near=cup"),
        ("wait 5 s at the cup, then faster until the plate", "wait at=cup for=5s; pace faster @between=cup+plate"),
        ("swing wide round the cup, 10 cm more", "farther cup by=10cm"),
        ("slower at the cup, wait a second before you set it down", "pace slower @near=cup; wait at=goal for=1s"),
        ("fly higher! But come down at the same place", "move up; keep goal"),
        ("is too much fast, I see nothing", "pace slower"),
        ("stop one metre further back from the plate", "trim last=1m"),
        ("stay a bit longer at the cup", "wait at=cup longer"),
        ("don't go behind the cup, I can't see you", "side cup front"),
        ("get through the first half quicker, we're running late", "pace faster @first=50%"),
        ("carry the paint 5 cm higher over the cup", "move up=5cm @near=cup"),
        ("paint a bit slower at the cup", "pace slower deg=slight @near=cup"),
        ("no stop at the cup, just go on to the plate", "nonstop @near=cup"),
        ("slow down to 1 m/s near the cup, then speed up again", "pace set to=1m/s @near=cup; pace faster @after=cup"),
        ("Quick, stay at least 40 cm clear of the plate!", "clearance plate at_least=40cm"),
        ("slow down within 20 cm of the cup until it stops at the goal", "pace slower @near=cup,20cm"),
        ("stop 15 cm above the plate", "end goal up=15cm to=plate"),
        ("stop 15 cm above the plate for 2 seconds", "hover plate by=15cm for=2s"),
        ("stop next to the plate so grandma can see it", "wait at=plate"),
        ("be careful at the cup", "pace slower @near=cup"),
        ("speed up, but be careful at the cup", "pace faster @!near=cup; pace slower @near=cup"),
        ("go half as fast where it climbs", "pace set to=0.5x @rising"),
        ("stay 2 cm lower over the plate so the paint doesn't run", "move down=2cm @near=plate"),
        ("stop for 3 seconds at the cup so I can wave, then go on", "wait at=cup for=3s"),
        ("start off gently, then go at the normal pace", "pace slower @first"),
        ("begin gently and pick up speed over the first quarter", "pace rampup @first=25%"),
        ("set it down 4 cm lower", "end goal down=4cm"),
        ("make the whole motion take 25% longer", "pace set to=0.8x"),
        ("take 20 % less time", "pace set to=1.25x"),
        ("the cup must not be bumped", "clearance cup at_least=0m"),
        ("1 cm more to the cup side", "closer cup by=1cm"),
        ("hold it a second over the plate", "hover plate for=1s"),
        ("pass 20 cm to the left of the cup", "side cup left by=20cm"),
        ("wave up and down three times near the cup", "wave waves=3 upright @near=cup"),
        ("take a wider berth around the cup", "farther cup"),
        ("last quarter slower, 0.2", "pace set to=0.2m/s @last=25%"),
        ("stop a bit short of the end, say 0.5 m", "trim last=0.5m"),
        ("slower. half.", "pace slower by=50%"),
        ("stop a little higher", "end goal up deg=slight"),
        ("wait 4 s right over the plate", "hover plate for=4s"),
        ("take the cup on its left side", "side cup left"),
        ("hang there two seconds right after you've picked it up before moving on", "wait at=start for=2s"),
        ("faster, we've got two hundred of these to do", "pace faster"),
        ("the arm dashes off at the end, make the last third gentle", "pace slower @last=33%"),
        ("the robot rushes past the cup", "pace slower @near=cup"),
        ("it creeps towards the end", "pace faster @last"),
        ("you're too far to the left", "move right"),
        ("don't go lower than z = -0.2", "height at_least=-0.2m"),
        ("stop to the left of the cup for 2 seconds", "side cup left; wait at=cup for=2s"),
        ("wait 50 cm in front of the cup", "wait at=cup by=50cm"),
        ("get a touch closer to the cup, but don't bump into it, okay?", "closer cup deg=slight"),
        ("pass more to the left of the cup", "move left @near=cup"),
        ("slow down as soon as you get near the cup", "pace slower @near=cup"),
        ("stop 30 centimetres before the old goal", "trim last=0.3m"),
        ("come down to 5 cm above the rim of the cup", "via over=cup by=5cm"),
        ("way too quick by the cup. Easy!", "pace slower @near=cup"),
        ("please don't zip across the cup like that", "pace slower @near=cup"),
        ("put it down 20% slower", "pace slower by=20% @last"),
        ("it jerks, go slower", "pace slower"),
        ("I want this done in half the time", "pace faster by=2x"),
        ("when you pass the cup, hover there for 5 seconds", "wait at=cup for=5s"),
        ("scale the speed by 1.2", "pace set to=1.2x"),
        ("go further left", "move left"),
        ("fly a bit higher past the cup", "move up deg=slight @near=cup"),
        ("climb no higher than 1.5 metres", "height at_most=1.5m"),
        ("last quarter slower by 0.2", "pace slower by=0.2 @last=25%"),
    ],
)
def test_what_a_turn_of_phrase_means(said, meant):
    verdict = understand(said, SCENE)
    assert same(verdict.reading.frames, parse(meant, SCENE.names)), show(verdict.reading.frames)
    assert verdict.outcome == "do"


@pytest.mark.parametrize(
    ("said", "plain"),
    [
        ("slower near the cup or the plate", "slower near the cup and the plate"),
        ("slower near the cup or the plate falls", "slower near the cup or the plate falls"),
        ("pass the cup, just drive through", "pass the cup, just drive through"),
    ],
)
def test_an_or_is_an_and_between_two_things_alone(said, plain):
    assert plainer(said, SCENE) == plain


@pytest.mark.parametrize(
    "said",
    [
        "we have to go left at the cup",
        "I have to turn left",
        "when you move to the left, slow down",
        "before lowering the speed, go up",
        "keep the part near the cup as it is",
        "lower the lamp",
        "lift the bottle",
        "stop 2 m back from the cup",
        "before it is set down",
        "turn right into the lane",
        "go right onto the ramp",
    ],
)
def test_what_is_no_turn_of_phrase_stays(said):
    assert plainer(without_cargo(said, SCENE), SCENE) == said


def test_objects_with_numbers_are_named_by_them():
    pylons = Scene(tuple(SceneObject(f"pylon {n}", [float(n), 0.0, 0.0], [0.1] * 3) for n in (1, 2, 3)))
    assert plainer("a circle around the second pylon", pylons) == "a circle around pylon 2"
    assert plainer("a circle around the second cup", pylons) == "a circle around the second cup"


@pytest.mark.parametrize(
    ("said", "meant"),
    [
        ("at most 2 m/s near the tree", "pace at_most=2m/s @near=tree"),
        ("go 2 metres higher at no more than 1 m/s", "move up=2m; pace at_most=1m/s"),
        ("keep 3 m away from both pylons", "clearance pylon_1+pylon_2 at_least=3m"),
        ("keep 3 m away from pylons 1 and 2", "clearance pylon_1+pylon_2 at_least=3m"),
        ("stay clear of the shelves by 1 m", "clearance shelf_A+shelf_B at_least=1m"),
    ],
)
def test_the_number_of_a_thing_is_no_name_of_it(said, meant):
    names = ("pylon 1", "pylon 2", "tree", "shelf A", "shelf B")
    scene = Scene(tuple(SceneObject(name, [float(n), 0.0, 0.0], [0.1] * 3) for n, name in enumerate(names)))
    verdict = understand(said, scene)
    assert same(verdict.reading.frames, parse(meant, scene.names)), show(verdict.reading.frames)
    assert verdict.outcome == "do"


def test_a_figure_that_is_not_read_is_shown_first():
    assert understand("make the circles at the cup half as big", SCENE).outcome == "needs_confirmation"


@pytest.mark.parametrize(
    "said", ["when anything is within 20 cm, slow down", "slow down whenever something is closer than 20 cm"]
)
def test_anything_that_is_near_is_any_object(said):
    verdict = understand(said, SCENE)
    assert same(verdict.reading.frames, parse("pace slower @near=cup+shelf_B+plate+paint_pot,20cm", SCENE.names))


@pytest.mark.parametrize(
    ("said", "meant"),
    [
        ("go slower near our table, it's table 2", "pace slower @near=table_2"),
        ("shift table 2's line 0.5 m to the right", "move right=0.5m @near=table_2"),
        ("keep 1 m away from both table 1 and the bar", "clearance table_1+bar at_least=1m"),
        ("do the whole thing in half the time", "pace faster by=2x"),
        ("stop briefly at the bar", "wait at=bar"),
        ("increase the hover time at table 2 to five seconds", "wait at=table_2 for=5s"),
        ("wait 2 s longer at the bar before it lifts", "wait at=bar for=2s longer"),
        ("the same thing but 10 cm higher", "move up=10cm"),
        ("10 cm higher from the middle of the path to the end", "move up=10cm @last=50%"),
    ],
)
def test_sentences_about_several_of_a_kind_and_stops(said, meant):
    scene = Scene(
        tuple(SceneObject(n, [float(k), 0.0, 0.0], [0.1] * 3) for k, n in enumerate(("table 1", "table 2", "bar")))
    )
    verdict = understand(said, scene)
    assert same(verdict.reading.frames, parse(meant, scene.names)), show(verdict.reading.frames)


def test_several_of_a_kind_are_asked_about_by_name():
    scene = Scene(tuple(SceneObject(f"table {n}", [float(n), 0.0, 0.0], [0.1] * 3) for n in (1, 2, 3)))
    assert "'table 3'" in understand("go slower near the table", scene).reading.question
