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


@pytest.mark.parametrize(
    "reason",
    [
        "it tips over easily",
        "dad is up on the tower",
        "so she doesn't see it",
        "while I note the number",
        "or we lose sight of it",
        "like when they water the lawn",
    ],
)
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
        ("Half speed for the first 3 seconds", "set", "first"),
        ("Start slowly", "slower", "first"),
        ("Arrive gently", "slower", "last"),
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


@pytest.mark.parametrize(
    ("said", "height"),
    [("at about one metre forty", 1.4)],
)
def test_a_height_between_the_ends_is_told_in_many_ways(said, height):
    made = made_of(f"From the pad to the bench, {said}")
    path = made.adaptation.adapted.positions
    assert made.status == "done" and path[30, 2] == pytest.approx(height, abs=0.05)
    assert path[0, 2] < 0.4 and path[-1, 2] < 0.9


def test_a_height_halfway_is_that_of_the_middle_only():
    path = made_of("From the pad to the bench, rise to 2.2 m half way").adaptation.adapted
    assert path.positions[:, 2].max() == pytest.approx(2.2, abs=0.05)
    assert path.positions[15, 2] < 1.6 and path.positions[45, 2] < 1.6


@pytest.mark.parametrize(("said", "beyond"), [("40 cm higher than usual", 0.4), ("stay up high", 0.1)])
def test_going_higher_leaves_the_ends_where_they_were_said(said, beyond):
    plain, higher = made_of("From the shed to the gate"), made_of(f"From the shed to the gate, {said}")
    before, path = plain.adaptation.adapted.positions, higher.adaptation.adapted.positions
    assert higher.status == "done" and np.allclose(path[[0, -1]], before[[0, -1]])
    assert path[:, 2].max() >= before[:, 2].max() + beyond - 0.02


@pytest.mark.parametrize("said", ["then one circle", "go round in a circle at the end", "then do a small loop there"])
def test_a_circle_at_the_end_is_where_the_way_ends(said):
    made = made_of(f"From the pad to the bench, {said}")
    path = made.adaptation.adapted.positions[:, :2]
    ends = made.plan.request.goal.position[:2]
    first = int(np.argmax(np.linalg.norm(path - ends, axis=1) < 0.05))
    turned = np.unwrap(np.arctan2(*np.diff(path[first:], axis=0).T[::-1]))
    assert made.status == "done" and np.ptp(turned) > 1.8 * np.pi and np.linalg.norm(path[-1] - ends) < 0.05


def test_a_figure_that_no_one_hears_as_a_wish_is_made_all_the_same():
    made = made_of("Go from the shed to the gate and then fly a figure eight!")
    assert [frame.shape for wish in made.route.wishes for frame in wish.frames] == ["eight"]


def test_a_circle_keeps_the_distance_that_is_told_behind_it():
    made = made_of("Circle the tower once from the shed to the bench. Half a metre away from it")
    path = made.adaptation.adapted.resample(800, by="arc_length").positions
    assert made.status == "done" and YARD["tower"].clearance(path).min() >= 0.5 - 3e-3


@pytest.mark.parametrize("said", ["lap the tower twice", "a circle around the tower"])
def test_a_round_trip_with_a_circle_has_a_way(said):
    made = made_of(f"From the shed, {said}, and back to the shed")
    turned = np.unwrap(np.arctan2(*made.adaptation.adapted.resample(800).positions[:, 1::-1].T))
    assert made.status == "done" and np.ptp(turned) > 1.9 * np.pi


def test_a_spiral_that_is_to_rise_rises():
    made = made_of("From the shed to the bench, then let the drone rise in a spiral")
    end = made.adaptation.adapted.positions[-1]
    assert made.status in ("done", "limited") and end[2] > made.plan.request.goal.position[2] + 0.2


def test_a_place_that_is_led_on_to_is_no_mere_spot_of_a_wait():
    route = read_route("Shed to tower and on to the gate, wait 3 seconds there, and hurry", YARD)
    assert ([place.label for place in route.via], route.goal.label) == (["the tower"], "the gate")


def test_denying_asks_for_something_and_gives_no_reason():
    route = read_route("From the shed to the gate, and don't dawdle", YARD)
    assert [frame.change for wish in route.wishes for frame in wish.frames] == ["faster"]


def test_slow_there_is_near_what_was_named_last():
    route = read_route("Pad to gate, left of the tower, slow there", YARD)
    assert [frame.part.places for wish in route.wishes for frame in wish.frames] == [("tower",)]


def test_a_wait_at_the_via_point_is_where_the_way_passes():
    route = read_route("Shed to bench via 0.5 m above the tower; dwell 2 s at the via point", YARD)
    assert [frame.place for wish in route.wishes for frame in wish.frames] == ["tower"]


def test_a_radius_counts_from_the_surface_where_the_middle_is_out_of_reach():
    made = made_of("From the bench to the shed, half speed within 45 cm of the shed")
    ratio = made.adaptation.adapted.speeds[1:-1] / made.plan.trajectory.speeds[1:-1]
    assert made.status == "done" and ratio[56] == pytest.approx(0.5, abs=0.1) and ratio[20] == pytest.approx(1.0)


@pytest.mark.parametrize("said", ["no sudden moves", "by the shortest way", "in a straight line"])
def test_what_a_plan_does_anyway_is_noted(said):
    made = made_of(f"From the shed to the bench, {said}")
    assert made.status == "done" and any("anyway" in note for note in made.route.notes)


def test_names_with_underscores_are_names():
    scene = generation.scene_of("bin_A -2 -2 0.5 0.3 0.3 1; bin_B 2 2 0.5 0.3 0.3 1")
    route = read_route("src=bin_A, dst=bin_B", scene)
    assert (route.start.label, route.goal.label) == ("the bin_A", "the bin_B")


@pytest.mark.parametrize("said", ["carefully, like 30 cm from the tower", "keep a good 30 cm from the tower, I think"])
def test_asides_around_an_amount_ask_for_nothing(said):
    made = made_of(f"From the shed to the bench, {said}")
    path = made.adaptation.adapted.resample(500, by="arc_length").positions
    assert made.status in ("done", "limited") and YARD["tower"].clearance(path).min() >= 0.3 - 1e-3


@pytest.mark.parametrize(
    ("said", "change", "part"),
    [
        ("Start slowly at the shed and go to the bench", "slower", "first"),
        ("From the shed past the tower, then speed up to the bench", "faster", "after"),
    ],
)
def test_how_a_place_is_come_to_is_a_speed_there(said, change, part):
    (frame,) = (frame for wish in read_route(said, YARD).wishes for frame in wish.frames)
    assert frame.change == change and frame.part.kind in (part, "whole", "last")


def test_a_way_does_not_lead_back_to_a_speed():
    assert read_route("Shed to gate, slow near the tower, then back to normal speed", YARD).goal.label == "the gate"
    assert read_route("From the shed to the gate and back at full speed", YARD).goal.label == "the shed"


def test_what_a_clause_across_a_comma_passes_is_passed():
    route = read_route("From the pad to the gate, between the tower and the bench, quite slowly there", YARD)
    assert [place.label for place in route.via] == ["between the tower and the bench"]


def test_a_distance_without_a_thing_is_kept_from_all_but_the_ends():
    (frame,) = (f for w in read_route("From the shed to the bench, clearance 20 cm", YARD).wishes for f in w.frames)
    assert frame.objects == ("tower", "gate", "pad") and frame.distance.value == 0.2


def test_a_quick_look_is_no_speed():
    route = read_route("Shed to gate, swing by the tower for a quick look, slowly", YARD)
    assert [frame.change for wish in route.wishes for frame in wish.frames] == ["slower"]


def test_a_distance_behind_a_denied_nearness_counts():
    made = made_of("From the shed to the bench, but not near the tower, minimum 0.9 m")
    path = made.adaptation.proposal or made.adaptation
    assert YARD["tower"].clearance(path.adapted.resample(500).positions).min() >= 0.9 - 3e-3


@pytest.mark.parametrize(
    "why",
    [
        "so that it can read the tag",
        "so Kevin could count them",
        "I want to see if it leaks",
        "because I'm filming it",
    ],
)
def test_what_it_is_for_and_what_it_is_like_ask_for_nothing(why):
    route = read_route(f"From the shed to the bench, stop at the tower for 2 seconds, {why}, then continue", YARD)
    assert any(why in note and "a reason" in note for note in route.notes), route.notes
    assert [(wish.outcome, wish.text) for wish in route.wishes] == [("do", "wait 2 s at the tower")]
    assert (route.start.label, route.goal.label, route.doubts) == ("the shed", "the bench", ())


def test_a_comparison_may_ask_for_a_pace():
    assert [wish.outcome for wish in read_route("From the shed to the bench, like, slowly", YARD).wishes] == ["do"]


def test_a_thing_by_a_word_of_its_name_that_says_something_elsewhere():
    scene = generation.scene_of(
        "letter scale 0 0 0.2 0.4 0.4 0.4; marble box 2 0 0.2 0.4 0.4 0.4; shed -2 0 0.2 0.4 0.4 0.4"
    )
    route = read_route("From the shed to the marbles, stop at the scale for five seconds", scene)
    assert (route.goal.label, [wish.text for wish in route.wishes]) == (
        "the marble box",
        ["wait 5 s at the letter scale"],
    )


def test_a_thing_that_was_named_in_full_is_meant_again():
    scene = generation.scene_of(
        "north pier -1 0 0.2 0.4 0.4 0.4; south pier 1 1 0.2 0.4 0.4 0.4;"
        "hut -2 2 0.2 0.4 0.4 0.4; inn 2 -2 0.2 0.4 0.4 0.4"
    )
    route = read_route("From the hut past the north pier to the inn, and go easy near the pier", scene)
    assert [frame.part.places for wish in route.wishes for frame in wish.frames] == [("north pier",)]
    assert "Which object" in read_route("From the hut to the pier", scene).question


def test_an_amount_may_end_a_phrase():
    assert read_route("From the shed, wait there a", YARD).start.label == "the shed"


def test_a_share_of_the_speed_is_not_the_highest_speed():
    route = read_route("from the shed to the bench, quater of the speed, its full of wet soil", YARD)
    assert not route.fastest and [frame.amount.value for wish in route.wishes for frame in wish.frames] == [0.25]


def test_a_side_of_what_was_named_is_passed():
    route = read_route("From the shed to the bench, do not go above the tower, pass it on the back side only", YARD)
    assert [place.label for place in route.via] == ["behind the tower"] and not route.doubts


@pytest.mark.parametrize(
    "said",
    [
        "left of the tower, the floor is still wet on the right",
        "over the tower, not around it",
        "which I must film for my aunt",
    ],
)
def test_remarks_and_what_is_done_anyway_need_no_yes(said):
    route = read_route(f"From the shed to the bench, {said}", YARD)
    assert (route.start.label, route.goal.label, route.doubts) == ("the shed", "the bench", ())
    assert [place.relation for place in route.via] == ["left"] * ("left" in said) + ["over"] * ("over" in said)


@pytest.mark.parametrize(
    ("said", "shape"),
    [("Now make it wavy, from the shed to the bench", "wave"), ("Now the lawn: zigzag from shed to bench", "zigzag")],
)
def test_a_figure_is_heard_among_words_that_ask_for_nothing(said, shape):
    (wish,) = read_route(said, YARD).wishes
    assert [frame.shape for frame in wish.frames] == [shape]


def test_a_side_that_is_taken_back_is_not_passed():
    route = read_route("From the shed to the bench, pass the tower on the right, no no, sorry, on its left", YARD)
    assert [place.label for place in route.via] == ["left of the tower"] and not route.doubts


def test_a_bare_number_before_a_place_is_in_metres():
    route = read_route("start 0.05 above the shed, end 0.3 above the bench", YARD)
    assert (route.start.distance, route.goal.distance) == (0.05, 0.3)


def test_easy_and_half_the_speed_is_half_the_speed():
    route = read_route("From the shed to the bench, easy, half the speed", YARD)
    assert [frame.factor for wish in route.wishes for frame in wish.frames] == [0.5]


def test_one_word_of_a_name_is_the_thing_behind_a_preposition():
    hall = generation.scene_of(
        "reception desk -2 0 0.5 0.6 0.6 1; palm 0 0 0.5 0.5 0.5 1; grey sofa 2 0 0.4 0.8 0.8 0.8"
    )
    route = read_route("Palm to reception, not too quick", hall)
    assert (route.start.label, route.goal.label) == ("the palm", "the reception desk")


def test_its_is_no_verb_behind_a_preposition_nor_can_in_a_name():
    yard = generation.scene_of("watering can 0 0 0.3 0.3 0.3 0.6; shed -2 1 0.5 0.9 0.8 1; bench 2 -1 0.2 0.9 0.4 0.4")
    route = read_route("From the shed to the bench, passing the watering can at its front", yard)
    assert [place.label for place in route.via] == ["in front of the watering can"]


def test_a_place_beside_another_goal_is_where_a_wish_counts():
    route = read_route("From the shed to the bench, and next to the tower still slower because of the cat", YARD)
    (frame,) = (frame for wish in route.wishes for frame in wish.frames)
    assert route.goal.label == "the bench" and frame.part.places == ("tower",)
