"""Parts of the page that need no page: playing, charts, knobs, shapes, words."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ovita.dialogue.session import Session
from ovita.errors import FormatError
from ovita.paths.robot import Box, Robot
from ovita.paths.scene import Frame, Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.plots.geometry import corners
from ovita.studio import editor, files, html, panels, scene_view, turns
from ovita.studio.scene_view import SceneView, ViewBounds

CUP = SceneObject("cup", [0.5, 0.3, 0.1], [0.1, 0.1, 0.2])


def straight(speeds):
    n = len(speeds)
    return Trajectory(np.column_stack([np.linspace(0, 1, n), np.zeros((n, 2))]), np.array(speeds, dtype=float))


def test_playing_keeps_to_the_time_law():
    path = straight([0.0, 1.0, 1.0, 0.0])
    for i, moment in enumerate(path.times):
        assert path.at(float(moment)).positions[0] == pytest.approx(path.positions[i])
    first = float(path.times[1])
    assert path.at(first / 2).positions[0][0] == pytest.approx(path.positions[1, 0] / 4)
    assert path.at(1e9).positions[0] == pytest.approx(path.positions[-1])


def test_playing_stands_still_where_the_robot_does():
    path = Trajectory(np.array([[0.0, 0, 0], [1.0, 0, 0], [1.0, 0, 0], [2.0, 0, 0]]), np.array([1.0, 0, 0, 1.0]))
    dwell = (float(path.times[1]) + float(path.times[2])) / 2
    assert path.at(dwell).positions[0] == pytest.approx([1.0, 0, 0])


@pytest.mark.parametrize("value", [0.2, 1.0, 0.0, -0.35, 42.0, 1e-4])
def test_a_slider_reaches_round_numbers_around_its_value(value):
    low, high, step = panels.reach(value, "m")
    assert low <= value <= high and high >= 2 * abs(value) and 0 < step <= (high - low) / 50


def test_what_broke_a_limit_is_marked():
    robot = Robot(workspace=Box((-1, -1, -1), (0.75, 1, 1)), max_speed=2.0)
    path = straight([1, 1, 1, 3, 1])
    assert scene_view.broken(path, Scene(), robot, set()).tolist() == [False, False, False, True, True]
    inside = Scene((SceneObject("post", [0.25, 0, 0]),))
    assert scene_view.broken(path, inside, Robot(max_speed=None), set()).tolist() == [False, True, False, False, False]
    assert not scene_view.broken(path, inside, Robot(max_speed=None), {"post"}).any()


@pytest.mark.parametrize("frame", ["rfu", "flu", "ned"])
@pytest.mark.parametrize("aspect", [0.4, 1.0, 2.0])
def test_the_first_camera_sees_everything(frame, aspect):
    path, scene = straight([1, 1]), Scene((CUP,), Frame(frame))
    stage = ViewBounds.of([path], scene)
    position, target = stage.camera(scene.frame, aspect, 0.75)
    view = (target - position) / np.linalg.norm(target - position)
    up = scene.frame.direction("up")
    right = np.cross(view, up) / np.linalg.norm(np.cross(view, up))
    points = np.concatenate([path.positions, corners(CUP), stage.corner(scene.frame)[None]]) - position
    depth = points @ view
    assert (depth > 0).all() and (position - target) @ up > 0
    assert (np.abs(points @ right) / depth <= np.tan(0.375) * aspect + 1e-9).all()
    assert (np.abs(points @ np.cross(right, view)) / depth <= np.tan(0.375) + 1e-9).all()


def test_hand_edits_make_new_scenes_and_paths():
    scene = editor.with_object_at(Scene((CUP,)), "cup", np.array([0.0, 0, 0]))
    assert scene["cup"].position.tolist() == [0, 0, 0] and CUP.position[0] == 0.5
    path = editor.with_end(straight([1] * 9), np.array([1.0, 0.5, 0]), goal=True)
    assert path.positions[-1].tolist() == [1.0, 0.5, 0] and path.positions[0].tolist() == [0, 0, 0]


def test_suggestions_fit_the_scene_and_are_understood():
    for scene in (Scene((CUP,)), Scene()):
        session = Session(straight([0.4] * 20), scene, writer="builtin")
        said = html.suggestions(session.current, scene)
        assert 2 <= len(said) <= 3
        for text in said:
            assert session.draft().say(text).usable, text


def test_an_adaptation_is_opened_without_being_run(tmp_path, monkeypatch):
    session = Session(straight([0.4] * 20), Scene((CUP,)), writer="builtin")
    session.say("go left by 0.2")
    name, content = files.exported("adaptation", session)
    monkeypatch.setattr("ovita.policy.sandbox._run", lambda *a, **k: pytest.fail("a program was run"))
    opened = files.open_upload(name, content, session)
    assert opened.session.current == session.current and "None of it was run" in opened.notes[0]
    name, content = files.exported("session", session)
    assert files.open_upload(name, content, session).session.current == session.current


def test_another_files_limits_do_not_go_along_and_a_bare_trajectory_keeps_them():
    arm = Session(straight([0.4] * 20), Scene((CUP,)), Robot.preset("arm"), writer="builtin")
    scene = json.dumps({"trajectory": straight([0.4] * 20).to_array().tolist()}).encode()
    opened = files.open_upload("other.json", scene, arm, limits=Robot.preset("none"))
    assert opened.session.robot == Robot.preset("none") and "do not go along" in opened.notes[-1]
    bare = files.open_upload("path.csv", b"x,y,z,speed\n0,0,0,1\n1,0,0,1\n", arm, limits=Robot.preset("none"))
    assert bare.session.robot == arm.robot and "limits stay" in bare.notes[-1]


def test_a_verdict_that_is_not_done_stands_in_the_name_of_the_export():
    robot = replace(Robot.preset("none"), workspace=Box((-0.1, -1.0, -1.0), (3.0, 1.0, 0.3)))
    session = Session(straight([0.4] * 20), Scene(()), robot, writer="builtin")
    assert files.exported("csv", session)[0] == "trajectory.csv"
    session.say("go up by 3 m")
    assert session.adaptation.status != "done"
    name = files.exported("csv", session)[0]
    assert name == f"trajectory-{session.adaptation.status.replace('_', '-')}.csv"


def test_a_file_that_is_too_long_is_refused(tmp_path):
    template = Session(straight([1, 1]))
    rows = [[i * 1e-4, 0, 0, 1] for i in range(files.MAX_WAYPOINTS + 1)]
    with pytest.raises(FormatError, match=r"^long\.json: .*up to 20000"):
        files.open_upload("long.json", json.dumps({"trajectory": rows}).encode(), template)
    with pytest.raises(FormatError, match="8 MB"):
        files.open_upload("big.json", b" " * (files.MAX_UPLOAD + 1), template)


def test_a_file_with_a_long_name_is_opened_by_its_ending(template):
    opened = files.open_upload("x" * 200 + ".json", b'{"trajectory": [[0, 0, 0, 1], [1, 0, 0, 1]]}', template)
    assert len(opened.title) <= 80 and opened.title.endswith(".json")


def test_long_words_are_cut_and_a_branch_says_where_it_began():
    session = Session(straight([0.4] * 20), Scene((CUP,)), writer="builtin")
    session.say("go left by 0.1")
    session.branch(-1)
    session.say("go up by 0.1")
    assert "from the beginning" in turns.history(session) and len(html.clipped("x" * 3000)) == 300


def test_colours_of_speeds_reach_over_both_lines():
    session = Session(straight([0.4] * 20), Scene((CUP,)), writer="builtin")
    session.say("move half as fast")
    assert SceneView.pace(session) == (pytest.approx(0.2), pytest.approx(0.4))


def test_the_camera_follows_what_grows_until_a_person_moves_it():
    camera = SimpleNamespace(image_width=800, image_height=800, position=np.zeros(3))
    space = SceneView(SimpleNamespace(camera=camera, scene=None))
    session = Session(straight([0.4] * 20), Scene((CUP,)), writer="builtin")
    space.look(session)
    first = camera.position
    camera.position = np.array([3.0, 3.0, 3.0])  # on its way since before the first look
    space.look_again(session)
    camera.position = first
    space.look_again(session)
    session.say("go left by 0.5")
    space.look_again(session)
    second = camera.position
    assert not np.allclose(second, first)
    space.look_again(session)
    camera.position = moved = second + 1.0
    session.say("go left by 0.9")
    space.look_again(session)
    assert camera.position is moved


def test_a_turn_that_loses_an_earlier_wish_is_never_green():
    session = Session(straight([0.4] * 20), Scene((SceneObject("cup", [0.5, 0.3, 0.4]),)), writer="builtin")
    session.say("stay at least 0.6 away from the cup")
    result = session.say("go forward by 0.2")
    assert result.status == "done" and result.lost
    shown = turns.outcome(SimpleNamespace(busy=None, said=None, session=session))
    for text in (shown, turns.history(session)):
        assert ">an earlier wish is lost" in text
    assert "one turn ago" in shown and "one turn ago" in html.explanation(result)


def test_a_scene_without_a_trajectory_is_framed_by_its_objects():
    still = Trajectory(np.zeros((2, 3)), np.zeros(2))
    scene = Scene((SceneObject("a", [3.0, 2.0, 0.5], [1, 1, 1]), SceneObject("b", [5.0, 2.0, 0.5], [1, 1, 1])))
    stage = ViewBounds.of([still, still], scene)
    assert np.allclose(stage.lower, [2.5, 1.5, 0.0]) and np.allclose(stage.upper, [5.5, 2.5, 1.0])
    assert ViewBounds.of([still], Scene()).size == pytest.approx(0.2)
