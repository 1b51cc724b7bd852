"""Circles, heights, sides and reasons of a way that is told in words alone."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from ovita import Robot, from_words
from ovita.cli.main import cli
from ovita.paths.robot import UNLIMITED
from ovita.sources.route import read_route

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
import generation


def made_of(said, robot="drone"):
    """What the built-in writer makes of a sentence in a yard."""
    return from_words(said, YARD, Robot.preset(robot) if robot else UNLIMITED, writer="builtin")


YARD = generation.scene_of(
    "tower 0 0 1.0 0.4 0.4 2.0; shed -2.2 1.6 0.6 0.9 0.8 1.2; bench 2.3 -1.6 0.25 0.9 0.4 0.5;"
    "gate 2.4 2 0.5 0.2 0.9 1.0; pad -2.2 -2.2 0.05 0.6 0.6 0.1"
)


@pytest.mark.parametrize("said", ["circle the tower twice at a radius of 1.2 m", "orbit the tower two times at 1.2 m"])
def test_a_circle_of_a_radius_is_full_turns_at_that_radius(said):
    made = made_of(f"From the shed to the bench, {said}")
    around = made.adaptation.adapted.resample(4000, by="arc_length").positions[:, :2]
    on_ring = around[np.abs(np.linalg.norm(around, axis=1) - 1.2) < 0.02]
    turned = np.unwrap(np.arctan2(on_ring[:, 1], on_ring[:, 0]))
    assert made.status == "done" and np.ptp(turned) >= 4 * np.pi - 0.05
    assert np.linalg.norm(around, axis=1).min() > 1.18


def test_a_loop_in_the_middle_is_a_circle_beside_the_way():
    made = made_of("From the pad to the bench, a loop of 50 cm radius half way")
    turned = np.diff(made.adaptation.adapted.positions[:, :2], axis=0)
    angles = np.unwrap(np.arctan2(turned[:, 1], turned[:, 0]))
    assert made.status == "done" and np.ptp(angles) == pytest.approx(2 * np.pi, abs=0.3)


@pytest.mark.parametrize(
    ("said", "height"),
    [
        ("about two metres up", 2.0),
        ("cruise at 1.8 m", 1.8),
        ("climb to 1.5 m and land", 1.5),
    ],
)
def test_a_height_that_is_told_is_that_between_the_ends(said, height):
    made = made_of(f"From the pad to the gate, {said}")
    path = made.adaptation.adapted.positions
    assert made.status == "done" and path[:, 2].max() == pytest.approx(height, abs=0.09)
    assert path[0, 2] < 0.4 and path[-1, 2] < 1.2


def test_a_height_may_be_that_of_the_goal():
    made = made_of("From the pad rise to 2 m, go across to the gate and come down to 1.5 m")
    path = made.adaptation.adapted.positions
    assert made.status == "done" and path[:, 2].max() == pytest.approx(2.0, abs=0.09)
    assert path[-1, 2] == pytest.approx(1.5, abs=0.01)


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize("told", ["with the tower on my {}", "keep the tower to your {}", "tower on our {}"])
def test_a_side_of_the_robot_is_so_along_its_course(told, side):
    made = made_of(f"From the shed to the bench, {told.format(side)}, keep half a metre")
    path = made.adaptation.adapted.resample(500, by="arc_length").positions
    k = int(np.linalg.norm(path[:, :2], axis=1).argmin())
    ahead, there = path[k + 1] - path[k - 1], -path[k]
    turn = float(ahead[0] * there[1] - ahead[1] * there[0])
    assert made.status == "done" and (turn > 0) == (side == "left")
    assert YARD["tower"].clearance(path).min() >= 0.5 - 1e-3


@pytest.mark.parametrize("said", ["avoid the tower by 30 cm", "clear the tower by 30 cm", "keep 30 cm from the tower"])
def test_avoiding_by_so_much_is_a_distance(said):
    made = made_of(f"From the shed to the bench, {said}")
    path = made.adaptation.adapted.resample(500, by="arc_length").positions
    assert made.status == "done" and YARD["tower"].clearance(path).min() == pytest.approx(0.3, abs=0.03)


def test_keeping_well_clear_leaves_the_ends():
    made = made_of("From the shed to the bench, keep well clear of the tower")
    path = made.adaptation.adapted
    assert made.status == "done" and np.allclose(path.positions[[0, -1]], made.plan.request.corners[[0, -1]])
    assert YARD["tower"].clearance(path.resample(500).positions).min() > 0.4


@pytest.mark.parametrize("said", ["then carry on faster", "then speed up", "and continue faster"])
def test_then_faster_counts_behind_what_was_told_before(said):
    route = read_route(f"From the shed to the bench, wait 2 s at the gate, {said}", YARD)
    parts = [f.part.kind for wish in route.wishes for f in wish.frames if getattr(f, "change", "") == "faster"]
    assert parts == ["after"]


@pytest.mark.parametrize("reason", ["it tips over easily", "dad is up on the tower", "so she doesn't see it"])
def test_a_statement_asks_for_nothing(reason):
    route = read_route(f"From the shed to the bench, slowly, {reason}", YARD)
    assert [type(f).__name__ for wish in route.wishes for f in wish.frames] == ["Pace"]
    assert any("a reason" in note for note in route.notes) and route.goal.label == "the bench"


@pytest.mark.parametrize(
    "said",
    [
        "People are standing by the tower. From the shed to the bench",
        "Can you go from the shed to the bench? There's someone at the tower",
    ],
)
def test_a_statement_of_its_own_is_no_place_on_the_way(said):
    route = read_route(said, YARD)
    assert (route.start.label, route.goal.label, route.via) == ("the shed", "the bench", ())
    assert not (route.wishes or route.doubts)


def test_as_fast_as_can_be_needs_a_robot():
    said = "From the shed to the bench as fast as you can"
    asked = made_of(said, robot=None).adaptation
    assert asked.status == "needs_confirmation" and any("highest speed" in doubt for doubt in asked.warnings)
    assert made_of(said).adaptation.status == "done"


def test_plan_takes_the_robot_that_the_scene_names(tmp_path):
    file, out = tmp_path / "scene.json", tmp_path / "made.json"
    objects = [{"name": "box", "x": 0.3, "y": 0, "z": 0.05, "dimensions": [0.1, 0.1, 0.1]}]
    file.write_text(json.dumps({"objects": objects, "robot": "arm"}))
    words = ["plan", str(file), "--from", "box", "--to", "0.3,0.3,0.3"]
    assert CliRunner().invoke(cli, [*words, "-o", str(out)]).exit_code == 0
    assert json.loads(out.read_text())["robot"] == "arm"
    assert "workspace" in CliRunner().invoke(cli, ["plan", str(file), "--from", "box", "--to", "9,0,0"]).output


@pytest.mark.parametrize(
    ("said", "kind", "part"),
    [
        ("Dawdle by the tower, though", "slower", "near"),
        ("By the tower go slowly", "slower", "near"),
        ("Half speed for the first 3 seconds", "slower", "first"),
        ("Start slowly", "slower", "first"),
        ("Arrive gently", "slower", "last"),
        ("There is no rush", "slower", "whole"),
        ("The top speed is 0.2 m/s", "cap", "whole"),
        ("Not too fast", "slower", "whole"),
    ],
)
def test_a_clause_beside_the_way_is_read_as_an_instruction(said, kind, part):
    for text in (f"From the shed to the bench. {said}.", f"{said}. From the shed to the bench."):
        route = read_route(text, YARD)
        paces = [frame for wish in route.wishes for frame in wish.frames]
        assert [(f.change, f.part.kind) for f in paces] == [(kind, part)] and not route.via and not route.doubts


@pytest.mark.parametrize(
    ("text", "via"),
    [
        ("Take the right side of the tower. Please head over to the bench from the shed", ["right of the tower"]),
        ("Starting at the shed, visit the tower on your way to the bench", ["the tower"]),
        ("Start at the shed, finish at the bench. Behind the tower, so the audience sees it", ["behind the tower"]),
    ],
)
def test_a_phrase_may_hold_several_places_of_the_way(text, via):
    route = read_route(text, YARD)
    assert (route.start.label, route.goal.label) == ("the shed", "the bench")
    assert [place.label for place in route.via] == via and not route.doubts


def test_nothing_closer_than_so_far_counts_for_all_that_the_way_does_not_come_to():
    route = read_route("From the shed to the bench, nothing closer than 30 cm", YARD)
    (frame,) = (frame for wish in route.wishes for frame in wish.frames)
    assert {*frame.objects} == {*YARD.names} - {"shed", "bench"} and frame.distance.value == 0.3


@pytest.mark.parametrize(("said", "end"), [("before it sets off", "start"), ("once you get there", "goal")])
def test_a_wait_may_be_at_an_end_by_its_words(said, end):
    route = read_route(f"From the shed past the tower to the bench, wait 3 s {said}", YARD)
    assert [frame.place for wish in route.wishes for frame in wish.frames] == [end]


def test_a_wait_is_where_the_way_passes_a_thing_as_it_was_told():
    made = from_words(
        "From the shed over the tower to the bench, wait 2 s at the tower",
        YARD,
        Robot.preset("drone"),
        writer="builtin",
    )
    path, tower = made.adaptation.adapted, YARD["tower"]
    still = path.positions[1:][np.diff(path.arc_length) < 1e-9]
    assert made.status == "done" and len(still)
    assert (np.abs(still - tower.position)[:, :2] < tower.size[:2] / 2 + 0.05).all()
