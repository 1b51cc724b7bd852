"""Looking again: what moved, came and went, and what that means for an adapted path."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from depth_pictures import Thing, picture

from ovita.chain import adapt
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.perceive import perceive
from ovita.perceive.update import impact, sees_through, update
from ovita.request import Request


def thing(name, position, size=(0.08, 0.08, 0.12), **extra):
    return SceneObject(name, np.asarray(position, dtype=float), np.asarray(size, dtype=float), extra=extra)


CUP = thing("cup", (0.4, 0.1, 0.06), seen_by=1, colour="red", shape="cylinder")
BOOK = thing("book", (0.6, -0.2, 0.02), (0.2, 0.15, 0.04), seen_by=1, colour="blue", shape="box")
BOX = Thing("box", (0.0, 0.15, 0.06), (0.08, 0.08, 0.12), colour="red")
OTHER = Thing("box", (0.05, -0.15, 0.03), (0.16, 0.1, 0.06), 0.4, "blue")
BEFORE = Scene((CUP, BOOK), environment="a desk")


def seen(*objects, environment=""):
    return Scene(objects, environment=environment)


def as_seen(item, name=None, by=(0.0, 0.0, 0.0), grown=1.0):
    name = name or f"{item.extra['colour']} {item.extra['shape']}"
    return replace(item, name=name, position=item.position + by, dimensions=item.dimensions * grown)


def test_what_is_where_it_was_keeps_its_name_and_measured_size():
    now = update(BEFORE, seen(as_seen(CUP, by=(0.004, 0, 0), grown=1.02), as_seen(BOOK), environment="the desk"))
    assert now.scene.names == ("cup", "book") and not now.changed
    assert now.scene["cup"].extra["seen_as"] == "red cylinder"
    assert np.allclose(now.scene["cup"].dimensions, CUP.dimensions * 1.02)
    assert now.scene.environment == "the desk"
    assert now.sentences() == ["The cup and the book did not move."]


def test_what_moved_is_said_with_numbers_and_directions():
    now = update(BEFORE, seen(as_seen(BOOK), as_seen(CUP, by=(-0.3, 0.1, 0.0))))
    assert now.changed and "The cup moved 30.0 cm left and 10.0 cm front." in now.sentences()
    assert np.allclose(now.scene["cup"].position, CUP.position + np.array([-0.3, 0.1, 0.0]))


def test_what_is_new_and_does_not_take_a_name_that_is_in_use():
    other = thing("cup", (0.9, 0.5, 0.06), (0.3, 0.3, 0.3), seen_by=1, colour="green", shape="box")
    now = update(BEFORE, seen(as_seen(CUP), as_seen(BOOK), other))
    assert now.scene.names == ("cup", "book", "cup 2") and [item.name for item in now.new] == ["cup 2"]


def test_two_that_changed_places_are_told_apart_by_how_they_look():
    now = update(
        BEFORE, seen(as_seen(CUP, by=BOOK.position - CUP.position), as_seen(BOOK, by=CUP.position - BOOK.position))
    )
    assert np.allclose(now.scene["cup"].position, BOOK.position, atol=0.05)
    assert now.scene["book"].extra["colour"] == "blue"


def test_two_alike_are_matched_by_the_least_way():
    left, right = replace(CUP, name="left cup", position=CUP.position), replace(CUP, name="right cup")
    right = replace(right, position=CUP.position + np.array([0.3, 0.0, 0.0]))
    now = update(Scene((left, right)), seen(as_seen(right, "a", (0.05, 0, 0)), as_seen(left, "b", (0.05, 0, 0))))
    assert now.scene["left cup"].position[0] == pytest.approx(0.45)
    assert now.scene["right cup"].position[0] == pytest.approx(0.75)


def test_what_has_no_partner_does_not_take_that_of_another():
    ball = thing("green ball", (0.2, 0.4, 0.04), (0.08, 0.08, 0.08), seen_by=1, colour="green", shape="sphere")
    now = update(BEFORE, seen(as_seen(CUP, "red cylinder", (0.2, 0.1, 0.0)), ball))
    assert [match.now.name for match in now.matches] == ["cup"] and [item.name for item in now.new] == ["green ball"]


def test_what_was_written_by_hand_is_only_taken_for_what_is_there_or_bears_its_name():
    zone = thing("zone", (0.4, 0.1, 0.06))
    assert update(Scene((zone,)), seen(as_seen(CUP, "red box", (0.3, 0.0, 0.0)))).scene.names == ("zone", "red box")
    assert update(Scene((zone,)), seen(as_seen(CUP, "red box"))).scene.names == ("zone",)
    assert update(Scene((zone,)), seen(as_seen(CUP, "the zone", (0.3, 0.0, 0.0)))).scene.names == ("zone",)


def test_a_flat_thing_that_is_gone():
    sheet = thing("sheet", (0.0, 0.0, 0.01), (0.2, 0.15, 0.02), seen_by=1)
    there = picture([Thing("box", (0.0, 0.0, 0.01), (0.2, 0.15, 0.02))])
    assert sees_through([picture([])], sheet) and not sees_through([there], sheet)


def test_a_renamed_thing_keeps_its_name_over_several_looks():
    first = update(
        Scene((replace(CUP, name="my mug", extra={**CUP.extra, "seen_as": "red cylinder"}),)), seen(as_seen(CUP))
    )
    second = update(first.scene, seen(as_seen(CUP, by=(0.5, 0.5, 0.0))))
    assert second.scene.names == ("my mug",) and second.matches[0].moved


def on_the_table(kind="box", position=(0.0, 0.15, 0.06), colour="red"):
    return Thing(kind, position, (0.08, 0.08, 0.12), colour=colour)


def test_gone_is_only_what_a_camera_sees_the_place_of():
    there = thing("cup", (0.0, 0.15, 0.06), seen_by=1)
    behind = thing("hidden", (0.35, -0.15, 0.03), (0.05, 0.05, 0.05), seen_by=1)
    outside = thing("far", (0.0, 5.0, 0.05), seen_by=1)
    by_hand = thing("zone", (0.05, 0.0, 0.1))
    view = picture([Thing("box", (0.0, -0.15, 0.15), (0.1, 0.3, 0.3))])
    assert sees_through([view], there) and not sees_through([view], behind) and not sees_through([view], outside)
    now = update(Scene((there, behind, outside, by_hand)), Scene(), [view])
    assert [item.name for item in now.gone] == ["cup"] and now.scene.names == ("hidden", "far", "zone")
    assert (
        "The cup is gone." in now.sentences() and "The zone is out of sight, and was left as it was." in now.sentences()
    )


def test_another_frame_is_turned():
    now = update(BEFORE, seen(as_seen(CUP), as_seen(BOOK)).in_frame(BEFORE.frame).in_frame(type(BEFORE.frame)("flu")))
    assert not now.changed and now.scene.frame == BEFORE.frame


def test_nothing_before_and_nothing_now():
    assert update(Scene(), Scene()).sentences() == []
    assert update(Scene(), seen(CUP)).scene.names == ("cup",)


LINE = Trajectory(np.column_stack([np.linspace(0.0, 1.0, 30), np.full(30, 0.5), np.full(30, 0.06)]), np.full(30, 0.2))


@pytest.fixture(scope="module")
def result():
    robot = replace(Robot.preset("none"), obstacle_margin=0.05)
    return adapt(Request("keep at least 0.2 away from the cup", LINE, BEFORE, robot), writer="builtin")


def test_a_path_that_still_holds(result):
    assert result.status == "done"
    found = impact(result, BEFORE)
    assert found.holds and found.sentences() == ["The path still holds."]


def test_a_path_that_no_longer_holds(result):
    moved = replace(BEFORE, objects=(replace(CUP, position=np.array([0.5, 0.5, 0.06])), BOOK))
    found = impact(result, moved)
    assert not found.holds and [check.subject for check in found.broken] == ["cup"] and found.lost
    said = found.sentences()
    assert said[0].startswith("The path no longer holds") and any("No longer as meant" in one for one in said)
    assert found.clearances["cup"][0] > 0.2 > 0.0 > found.clearances["cup"][1]
    assert any(one.startswith("Clearance to the cup is") for one in said)


def test_a_new_thing_in_the_way_and_one_that_is_gone(result):
    wall = thing("wall", (0.5, 0.5, 0.1), (0.1, 0.1, 0.2))
    found = impact(result, Scene((CUP, wall)))
    assert [check.subject for check in found.broken] == ["wall"]
    assert found.clearances["wall"][0] is None and found.clearances["book"][1] is None


def test_a_poorer_look_does_not_replace_a_better_founded_one_of_what_did_not_move():
    two = replace(CUP, extra={**CUP.extra, "seen_by": 2, "points": 900})
    poor = as_seen(CUP, by=(0.006, 0, 0), grown=0.8)
    now = update(seen(two), seen(poor)).scene["cup"]
    assert np.allclose(now.dimensions, CUP.dimensions) and now.extra["seen_by"] == 2
    moved = update(seen(two), seen(as_seen(CUP, by=(0.1, 0, 0), grown=0.9))).scene["cup"]
    assert moved.position[0] == pytest.approx(0.5) and moved.extra["seen_by"] == 1
    hidden = replace(poor, extra={**poor.extra, "seen_by": 3, "partly_hidden": True})
    assert update(seen(two), seen(hidden)).scene["cup"].extra["seen_by"] == 2
    assert np.allclose(update(seen(poor), seen(as_seen(two))).scene.objects[0].dimensions, CUP.dimensions)


def test_the_description_keeps_the_names_that_a_person_gave():
    first = perceive([picture([BOX])], names=["mug=red", "desk=table"]).scene
    assert first.environment.startswith("Seen by a camera: mug, on the desk")
    view = picture([BOX, OTHER])
    again = update(first, perceive([view]).scene, [view])
    assert set(again.scene.names) == {"mug", "desk", "blue box"}
    assert again.scene.environment.startswith("Seen by a camera: mug and blue box, on the desk")
    own = replace(first, environment="The bench of Anna.")
    assert update(own, perceive([view]).scene, [view]).scene.environment == "The bench of Anna."


def test_a_support_keeps_its_name_and_the_larger_extent_and_does_not_move():
    first = perceive([picture([BOX])], names=["desk=table"]).scene
    near = picture([BOX], eye=(-0.4, 0.0, 0.35))
    again = update(first, perceive([near]).scene, [near])
    assert again.scene.names == ("red box", "desk") and not again.changed
    assert again.scene["desk"].size == pytest.approx(first["desk"].size)


@pytest.mark.parametrize("shape, moved", [("irregular", False), ("box", True)])
def test_another_side_of_something_odd_is_no_move(shape, moved):
    size = np.array([0.06, 0.06, 0.22])
    before, now = (
        SceneObject("bottle", np.array([x, 0.0, 0.11]), size, extra={"shape": shape, "seen_by": 1}) for x in (0.0, 0.02)
    )
    (match,) = update(Scene((before,)), Scene((now,))).matches
    assert match.moved is moved
