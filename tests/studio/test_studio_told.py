"""What the page tells of a change, and what a selection is after one."""

import re
from importlib.resources import files
from importlib.util import find_spec
from types import SimpleNamespace

import numpy as np
import pytest

import ovita as ov
from ovita.dialogue.session import Session
from ovita.io import load_task
from ovita.measure import compare, moved_ends
from ovita.paths.part import PathPart
from ovita.paths.robot import Robot
from ovita.paths.trajectory import Trajectory
from ovita.studio import turns
from ovita.studio.editor import deleted, inserted, pulled, sketched, with_object_at
from ovita.studio.sessions import SessionController
from ovita.writers.base import Reply

TABLETOP = str(files("ovita") / "data" / "tabletop.json")
HIGHER = "pass 30 cm higher after the bottle and slower"


def tabletop(robot="none"):
    task = load_task(TABLETOP)
    return Session(task.trajectory, task.scene, Robot.preset(robot), "builtin")


@pytest.fixture
def higher():
    talk = tabletop()
    assert talk.say(HIGHER).status == "done"
    return talk


def card(talk):
    page = turns.outcome(SimpleNamespace(busy=None, said=None, session=talk))
    return re.sub(r"\s+", " ", re.sub("<[^>]+>", " ", page)).replace("&#x27;", "'")


class Unsure:
    """Is certain of nothing."""

    name = "unsure"

    def write(self, prompt):
        code = "def adapt(traj, scene):\n    return move(traj, up=0.3, where=between(traj, 0.5, 1.0))\n"
        return Reply("policy", ("Shift the end 0.3 m up.",), code, confirm=True)


def test_a_card_and_a_preview_say_where_the_ends_go(higher):
    talk = tabletop()
    talk.writer = Unsure()
    asked = talk.say("rather above")
    assert asked.status == "needs_confirmation" and "The goal would move 0.30 m up." in asked.message
    assert "The goal would move 0.30 m up." in card(talk)
    assert "the goal moved 0.30 m up" in card(higher)


@pytest.mark.parametrize(
    ("start", "goal", "said"),
    [
        ((0, 0, 0), (0, 0, 0), []),
        ((0, 0, 0), (0, 0, 0.3), ["the goal moved 0.30 m up"]),
        ((-0.2, 0, 0), (-0.2, 0, 0), ["the start and the goal moved 0.20 m left"]),
        ((-0.2, 0, 0), (0, 0.1, 0), ["the start moved 0.20 m left", "the goal moved 0.10 m forward"]),
    ],
)
def test_where_the_ends_went_is_said_in_one_way(start, goal, said):
    before = Trajectory(np.linspace([0, 0, 0], [1, 0, 0], 5), np.full(5, 0.1))
    places = before.positions + np.linspace(start, goal, 5)
    assert moved_ends(compare(before, before.with_(positions=places), ov.Scene())) == said


def test_what_the_limits_did_is_one_truth():
    talk = tabletop()
    bottle, path = talk.scene["bottle"], talk.current.positions
    near = int(bottle.clearance(path).argmin())
    pulled(near, 0.7 * (bottle.position - path[near]), talk.scene.frame, len(path)).do(talk)
    result = talk.adaptation
    moved = result.constraints.max_shift
    assert moved > 0.001, "it is pulled into the bottle's margin"
    said = f"moved the path by up to {moved:.3f} m"
    assert result.by_limits == (said,) and any(said in line for line in result.constraints.sentences())
    assert f"the limits: {said}" in card(talk) and "nothing" not in card(talk)
    if result.status == "limited":
        assert said in result.message and said in turns.history(talk)


def test_history_says_how_much_the_limits_changed():
    path = Trajectory(np.linspace([0.3, 0, 0.3], [1.0, 0.2, 0.3], 9), np.full(9, 0.2))
    talk = Session(path, robot=Robot.preset("arm"), writer="builtin")
    talk.say("go up by 3 m")
    assert talk.adaptation.status != "done"
    if talk.adaptation.status == "limited":
        assert "the limits took back" in turns.history(talk)


def test_a_card_names_the_number_that_a_knob_was_turned_to(higher):
    assert "slower came out:" in card(higher)
    higher.tune({"up": 0.31})
    higher.tune({"up": 0.325})
    assert "slower, then turned up 0.3 \u2192 0.325 came out:" in card(higher)


def test_speeds_are_told_where_they_changed():
    talk = tabletop()
    (slower,) = (p for p in talk.say("slow down near the bottle").postconditions if p.kind == "slower")
    first, last = map(int, re.search(r"average speed of waypoints (\d+) to (\d+) went", slower.outcome).groups())
    changed = np.flatnonzero(talk.current.speeds != talk.original.speeds)
    assert (first, last) == (changed[0] + 1, changed[-1] + 1)


def flat(talk, first, last):
    line = talk.current.positions[first : last + 1].copy()
    line[:, 2] = 0.1
    return sketched(line, first, last)


@pytest.mark.parametrize(
    ("edit", "lost"),
    [
        (lambda talk: flat(talk, 36, 59), True),
        (lambda talk: deleted(33, 58), True),
        (lambda talk: inserted(3), False),
        (lambda talk: pulled(5, np.array([0.0, 0.0, 0.05]), talk.scene.frame, 60), False),
        (lambda talk: pulled(50, np.array([0.0, 0.0, 0.05]), talk.scene.frame, 60), False),
    ],
)
def test_a_hand_that_wipes_out_an_earlier_wish_is_not_green(higher, edit, lost):
    edit(higher).do(higher)
    verdict = turns.rung(higher.adaptation)
    assert (verdict is turns.LOST) == lost
    assert ("No longer as asked one turn ago by 'pass 30 cm" in card(higher)) == lost


def test_a_part_of_which_one_waypoint_is_left_is_gone():
    talk = tabletop()
    talk.say("this part slower", selection=PathPart("range", amount=22, until=32))
    inserted(10).do(talk)
    deleted(22, 32).do(talk)
    (loss,) = talk.adaptation.lost
    assert loss.outcome == "1 of 11 waypoints of that part are left" and turns.rung(talk.adaptation) is turns.LOST


def test_a_wish_stays_lost_until_the_hand_gives_it_back(higher):
    flat(higher, 36, 59).do(higher)
    higher.tune({"stiffness": 0.3})
    assert turns.rung(higher.adaptation) is turns.LOST
    moved = with_object_at(higher.scene, "bottle", higher.scene["bottle"].position + np.array([0.0, 0.01, 0.0]))
    higher.change("moved bottle", scene=moved)
    assert higher.adaptation.lost


def test_a_sketch_moves_no_end():
    talk = tabletop()
    last = len(talk.current) - 1
    for first, end in ((30, last), (0, 25)):
        line = talk.current.positions[first : end + 1] + np.array([0.0, 0.0, 0.1])
        sketched(line, first, end).do(talk)
        assert np.array_equal(talk.current.positions[[0, -1]], talk.original.positions[[0, -1]])
        assert np.ptp(talk.current.positions[:, 2] - talk.original.positions[:, 2]) > 0.05


@pytest.mark.parametrize(
    ("edit", "then"),
    [
        (deleted(26, 36), None),
        (deleted(10, 14), (21, 31)),
        (deleted(30, 33), (26, 32)),
        (deleted(20, 28), (20, 27)),
        (inserted(3), (27, 37)),
        (inserted(30), (26, 37)),
        (inserted(40), (26, 36)),
    ],
)
def test_a_selection_stays_on_its_waypoints(edit, then):
    talk = tabletop()
    desk = SessionController(talk)
    desk.selected = 26, 36
    desk.act(edit.do)
    assert desk.selected == then
    desk.act(lambda session: session.undo())
    assert desk.selected == {None: None, (26, 32): (26, 36), (20, 27): (29, 36)}.get(then, (26, 36))


def test_a_satisfied_verdict_says_whose_body_and_how_far_it_stays():
    from ovita.studio import html

    assert "the path, without a body, stays 0.01 m from objects" in html.limits_of(Robot.preset("none"))
    drone = Robot.preset("drone")
    assert f"its body, {drone.radius:g} m around the path, stays {drone.obstacle_margin:g} m" in html.limits_of(drone)


def test_the_robot_that_is_shown_and_the_one_whose_limits_hold_know_of_each_other(start, visit):
    studio = start()
    tab = visit(studio)
    (view,) = tab.wait(lambda: studio.views)
    view.puppet.follow = lambda *_: None  # no simulator is needed to see what the page says
    tab.say("go up by 0.1")
    tab.wait(lambda: view.controller.session.steps)
    tab.wait(lambda: view.robots._about[0] is view.controller.session.current)
    assert "The limits in force are those of &#x27;none&#x27;" in tab.text()
    tab.click("Show what the gate says")
    tab.wait(lambda: "press &#x27;Use its limits&#x27;" in tab.text())
    assert not re.search(" --[a-z]", tab.text()) and "data-show" in tab.text()
    tab.set("robot", "drone")
    tab.wait(lambda: "It is only shown" in tab.text() and tab.value("limits of") == "drone")
    assert "drone: filled in below, not applied yet" in tab.text()
    tab.click("Use its limits")
    tab.wait(lambda: view.controller.session.robot.name == "drone" and "Its limits are in force" in tab.text())
    tab.click("Show what the gate says")
    tab.wait(lambda: "<h4>Checked</h4>" in tab.text())
    assert not re.search(" --[a-z]", tab.text())
    tab.set("limits of", "arm")
    tab.click("Apply the limits below")
    tab.wait(lambda: view.controller.session.robot.name == "arm" and tab.value("robot") == "arm")
    tab.wait(lambda: "Its limits are in force" in tab.text())


def test_what_cannot_be_sent_is_said_where_it_was_asked(start, visit):
    studio = start()
    tab = visit(studio)
    (view,) = tab.wait(lambda: studio.views)
    view.puppet.follow = lambda *_: None
    tab.set("robot", "drone")
    tab.click("Use its limits")
    tab.say("go up by 0.1")
    tab.wait(lambda: len(view.controller.session.steps) == 2)
    tab.wait(lambda: view.robots._about[0] is view.controller.session.current)
    tab.click("Show what the gate says")
    tab.wait(lambda: tab.parts[tab.find("Send it")]["props"]["visible"])
    tab.click("Send it")
    tab.wait(lambda: 'class="bad" data-show>Say where to send it' in tab.text())
    parts = sorted((part["props"] for part in tab.parts.values() if "order" in part["props"]), key=lambda p: p["order"])
    said = [str(part.get("label", part.get("content", ""))) for part in parts]
    where = next(i for i, text in enumerate(said) if "data-show" in text)
    assert where < said.index("Show what the gate says") < said.index("Send it")


def test_a_simulation_reports_contact_and_limits_also_where_there_are_none():
    pytest.importorskip("mujoco", reason="a simulation needs the extra sim")
    from ovita.studio import robots

    path = Trajectory(np.linspace([0, 0, 0.5], [0.6, 0, 0.5], 6), np.full(6, 0.2))
    text = robots.reported(Session(path, writer="builtin"), "crazyflie")
    assert "It touches nothing." in text and "No limit of the robot itself was reached." in text


def test_knobs_count_waypoints_as_cards_do(start, visit):
    studio = start()
    tab = visit(studio)
    (view,) = tab.wait(lambda: studio.views)
    tab.point("select", range=[26, 36])
    tab.wait(lambda: view.controller.selected)
    tab.say("this part slower")
    tab.wait(lambda: view.controller.session.steps and tab.find("first waypoint"))
    assert (tab.value("first waypoint"), tab.value("last waypoint")) == (27, 37)
    assert "from waypoint 27 to 37" in tab.text()
    tab.set("last waypoint", 40)
    tab.wait(lambda: view.controller.session.adaptation.parameters[1].value == 39)
    tab.wait(lambda: "last waypoint 37 \u2192 40" in tab.text())


def test_the_ruler_names_its_ends(start, visit):
    studio = start()
    tab = visit(studio)
    tab.wait(lambda: studio.views)
    tab.say("go up by 0.1")
    tab.wait(lambda: studio.views[0].controller.session.steps)
    tab.set("from", "cup")
    tab.set("to", "the original goal")
    tab.wait(lambda: "/ruler/2" in tab.nodes and tab.nodes["/ruler/1"]["props"]["text"] == "the original goal")
    (_, name), (last, other), (_, size) = (
        (tab.poses.get(f"/ruler/{i}"), tab.nodes[f"/ruler/{i}"]["props"]["text"]) for i in range(3)
    )
    assert (name, other) == ("cup", "the original goal") and size.endswith("cm")
    assert np.allclose(last, studio.views[0].controller.session.original.positions[-1])
    tab.set("to", "nothing")
    tab.wait(lambda: not any(node.startswith("/ruler/") for node in tab.nodes))


@pytest.mark.parametrize(("name", "robot"), [("arm-bench", "arm"), ("drone-room", "drone"), ("rover-yard", "ground")])
def test_a_scene_for_every_kind_of_robot_is_shipped(start, visit, name, robot):
    task = load_task(str(files("ovita") / "data" / f"{name}.json"))
    result = ov.adapt(task, writer="builtin")
    assert task.robot == robot and result.status == "done" and result.constraints.status == "satisfied"
    if robot == "drone":
        tab = visit(start())
        assert f"shipped: {name}" in tab.parts[tab.find("at hand")]["props"]["options"]
        tab.set("at hand", f"shipped: {name}")
        tab.click("Open")
        tab.wait(lambda: f"{name}.json" in tab.text() and "drone: box" in tab.text())
        if find_spec("mujoco") is not None:
            tab.wait(lambda: tab.value("robot") == "drone" and "Its limits are in force" in tab.text())


def test_an_end_that_moves_bears_a_name_in_the_scene(start, visit):
    studio = start()
    tab = visit(studio)
    (view,) = tab.wait(lambda: studio.views)
    view.controller.session.writer = Unsure()
    tab.say("rather above")
    tab.wait(lambda: view.controller.session.pending is not None and tab.visible.get("/ends/proposed goal/name"))
    goal = view.controller.session.pending.proposal.adapted.positions[-1]
    tab.wait(lambda: np.allclose(tab.poses["/ends/proposed goal"], goal))
    assert not tab.visible["/ends/proposed start/name"]
    tab.click("Accept")
    tab.wait(lambda: tab.visible.get("/ends/new goal/name") and not tab.visible["/ends/proposed goal"])


@pytest.mark.parametrize("said", [
    "pass 30 cm higher behind the bottle", "Behind the bottle go 30 cm higher", "30 cm up behind the bottle",
])  # fmt: skip
def test_higher_behind_a_thing_is_up_on_the_way_after_it(said):
    talk = tabletop()
    assert talk.say(said).status == "done"
    by = talk.current.positions - talk.original.positions
    assert by[-1, 2] == pytest.approx(0.3) and not by[:, :2].any() and not by[:30].any()
