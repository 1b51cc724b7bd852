"""The studio as its browsers see it, over its own protocol."""

import json
import time

import numpy as np
import pytest

from ovita.studio.files import MAX_UPLOAD, MAX_WAYPOINTS
from ovita.writers.base import Reply

SAY = "Go left by 0.2 and slow down near the cup"


def adapted(tab):
    return tab.points("/lines/adapted")


def offset(tab):
    """How far the red line's start is to the left of the blue line's."""
    return float(tab.points("/lines/original")[0, 0, 0] - adapted(tab)[0, 0, 0])


def test_say_tune_undo(start, visit):
    tab = visit(start())
    assert "Change how the robot moves by saying so" in tab.text() and adapted(tab) is None
    tab.say(SAY)
    tab.wait(lambda: adapted(tab) is not None)
    assert offset(tab) == pytest.approx(0.2)
    tab.wait(lambda: tab.find("left [m]"))
    for value in np.linspace(0.2, 0.4, 21):
        tab.set("left [m]", float(value))
    tab.wait(lambda: abs(offset(tab) - 0.4) < 1e-6)
    tab.wait(lambda: "0.40 m left" in tab.text())
    tab.set("history", "Undo")
    tab.wait(lambda: abs(offset(tab) - 0.2) < 1e-6)
    tab.set("history", "Undo")
    tab.wait(lambda: adapted(tab) is None)
    tab.set("history", "Redo")
    tab.wait(lambda: adapted(tab) is not None)
    assert "left 0.2 \u2192 0.4" in tab.text()
    tab.set("page", "1 go 0")
    tab.wait(lambda: adapted(tab) is None)
    tab.set("page", "2 go 7")
    tab.set("page", "3 nonsense")
    tab.set("page", "4 go 1")
    tab.wait(lambda: adapted(tab) is not None)


def test_feedback_on_the_original_and_on_the_current(start, visit):
    tab = visit(start())
    tab.say("go left by 0.1")
    tab.wait(lambda: adapted(tab) is not None)
    tab.say("go left by 0.1")
    tab.wait(lambda: abs(offset(tab) - 0.2) < 1e-6)
    tab.set("feedback on", "original: everything on the blue line")
    tab.wait(lambda: "all of it is applied to the blue line" in tab.text())
    tab.say("go up by 0.1")
    tab.wait(lambda: "on the original" in tab.text() and abs(offset(tab) - 0.2) < 1e-6)
    assert adapted(tab)[0, 0, 2] - tab.points("/lines/original")[0, 0, 2] == pytest.approx(0.1)


def test_what_is_not_understood_is_told_and_changes_nothing(start, visit):
    tab = visit(start())
    tab.say("moonwalk")
    tab.wait(lambda: "not understood" in tab.text())
    assert adapted(tab) is None
    tab.say("   ")
    tab.wait(lambda: any("say what should change" in note for note in tab.notices))


class Unsure:
    """Is certain of nothing."""

    name = "builtin"

    def write(self, prompt):
        code = "def adapt(traj, scene, *, left=0.2):\n    expect_moved(left=left)\n    return move(traj, left=left)\n"
        return Reply("policy", ("Shift the path 0.2 m to the left.",), code, unplaced=("feed",), confirm=True)


def test_a_proposal_is_amber_until_it_is_accepted(start, visit):
    studio = start()
    tab = visit(studio)
    (view,) = tab.wait(lambda: studio.views)
    view.controller.session.writer = Unsure()

    def proposed():
        return tab.points("/lines/proposal") is not None

    tab.say("left 20 cm, feed 0.7")
    tab.wait(lambda: proposed() and "Not used: &#x27;feed&#x27;" in tab.text())
    assert adapted(tab) is None and "is that meant?" in tab.text() and "card waiting" in tab.text()
    tab.click("Not this")
    tab.wait(lambda: not proposed())
    assert adapted(tab) is None
    tab.say("left 20 cm, feed 0.7")
    tab.wait(proposed)
    tab.click("Accept")
    tab.wait(lambda: adapted(tab) is not None and not proposed())
    assert offset(tab) == pytest.approx(0.2)
    tab.say("right 20 cm, feed 0.7")
    tab.wait(proposed)
    tab.say("yes")
    tab.wait(lambda: abs(offset(tab) - 0.4) < 1e-6)


def test_names_and_words_are_never_markup(start, visit, tmp_path):
    scene = {
        "trajectory": [[0, 0, 0, 0.1], [1, 0, 0, 0.1]],
        "objects": [{"name": "<img src=x onerror=alert(1)>", "x": 0.5, "y": 0.5, "z": 0}],
    }
    file = tmp_path / "scene.json"
    file.write_text(json.dumps(scene))
    tab = visit(start(file))
    tab.say("<script>alert(1)</script>")
    tab.wait(lambda: "&lt;script&gt;" in tab.text() and "&lt;img" in tab.text())
    assert "<script" not in tab.text() and "<img" not in tab.text()


def test_code_runs_again_and_errors_name_their_line(start, visit):
    tab = visit(start())
    tab.say("go left by 0.1")
    tab.wait(lambda: adapted(tab) is not None)
    box = next(u for u, p in tab.parts.items() if p["props"].get("multiline"))
    source = tab.wait(lambda: tab.parts[box]["value"])

    def run(code):
        tab.send("GuiUpdateMessage", uuid=box, updates={"value": code})
        tab.parts[box]["value"] = code
        time.sleep(0.05)
        tab.click("Run in the sandbox")

    run(source.replace("left=0.1", "left=0.3"))
    tab.wait(lambda: abs(offset(tab) - 0.3) < 1e-6)
    run("def adapt(traj, scene):\n    import os\n    return traj\n")
    tab.wait(lambda: "<mark>    import os</mark>" in tab.text())
    assert any("line 2" in note for note in tab.notices) and offset(tab) == pytest.approx(0.3)


def test_limits_are_applied_and_judged(start, visit):
    tab = visit(start())
    tab.say("go up by 0.1")
    tab.wait(lambda: adapted(tab) is not None)
    tab.set("limit speed", True)
    tab.set("top speed [m/s]", 0.05)
    tab.click("Apply the limits below")
    tab.wait(lambda: "changed the limits" in tab.text())
    tab.wait(lambda: "The speed limit" in tab.text())
    assert "repaired" in tab.text()
    tab.set("robot", "drone")
    tab.wait(lambda: tab.value("top speed [m/s]") != 0.05)
    assert "limits: drone" not in tab.text()
    tab.click("Apply the limits below")
    tab.wait(lambda: "limits: drone" in tab.text())


def test_a_moved_object_is_a_turn(start, visit):
    studio = start()
    tab = visit(studio)
    tab.say("slow down near the cup")
    tab.wait(lambda: adapted(tab) is not None)
    assert studio.views[0].hand.move("cup", np.array([0.3, 0.5, 0.1]))
    tab.wait(lambda: "moved cup" in tab.text())
    assert studio.views[0].hand.move("the goal", np.array([0.6, 0.6, 0.3]))
    tab.wait(lambda: "moved the goal" in tab.text() and np.allclose(adapted(tab)[-1, 1], [0.6, 0.6, 0.3], atol=1e-6))
    tab.set("waypoint", 3)
    tab.click("Pin this waypoint")
    tab.wait(lambda: "pinned waypoint 3" in tab.text())


def test_reload_and_restart_resume(start, visit):
    studio, browser = start(), {}
    tab = visit(studio, browser)
    tab.say(SAY)
    tab.wait(lambda: adapted(tab) is not None)
    tab.close()
    again = visit(studio, browser)
    again.wait(lambda: adapted(again) is not None)
    assert offset(again) == pytest.approx(0.2) and SAY in again.text()
    studio.stop()
    restarted = start()
    third = visit(restarted, browser)
    third.wait(lambda: adapted(third) is not None)
    assert offset(third) == pytest.approx(0.2)
    third.click("Begin again")
    third.wait(lambda: adapted(third) is None)
    third.wait(lambda: third.parts[third.find("Go back to it")]["props"]["visible"])
    third.close()
    fourth = visit(restarted, browser)
    fourth.click("Go back to it")
    fourth.wait(lambda: adapted(fourth) is not None)


def test_a_tab_that_is_closed_while_it_plays_is_no_news(start, visit, capfd):
    studio = start()
    tab = visit(studio)
    tab.point("play")
    tab.wait(lambda: "/playhead/0" in tab.poses)
    tab.close()
    ends = time.monotonic() + 5.0
    while studio.views and time.monotonic() < ends:
        time.sleep(0.02)
    assert not studio.views and "closed connection" not in capfd.readouterr().err


def test_an_empty_program_is_not_run(start, visit):
    tab = visit(start())
    tab.click("Run in the sandbox")
    tab.wait(lambda: any("no code to run" in note for note in tab.notices))


def test_a_damaged_journal_is_told_and_a_new_session_begins(start, visit, tmp_path):
    studio, browser = start(), {}
    visit(studio, browser).close()
    studio.stop()
    for journal in (tmp_path / "sessions").iterdir():
        journal.write_bytes(b"{oops}\n")
    tab = visit(start(), browser)
    tab.wait(lambda: any("cannot be read" in note for note in tab.notices))


def test_two_browsers_do_not_see_each_other_and_two_tabs_of_one_do(start, visit):
    studio, browser = start(), {}
    mine, yours, my_second = visit(studio, browser), visit(studio), visit(studio, browser)
    mine.say("go left by 0.1")
    my_second.wait(lambda: adapted(my_second) is not None)
    mine.wait(lambda: adapted(mine) is not None)
    yours.say("go up by 0.1")
    yours.wait(lambda: adapted(yours) is not None)
    assert offset(yours) == pytest.approx(0.0) and "go left by 0.1" not in yours.text()
    assert "go up by 0.1" not in mine.text()
    assert len(studio.controllers) == 2


def test_uploads_are_read_and_bad_ones_are_refused_in_a_sentence(start, visit):
    tab = visit(start())
    rows = [[0.1 * i, 0.0, 0.0, 0.2] for i in range(5)]
    tab.upload("mine.json", json.dumps({"trajectory": rows}).encode())
    tab.wait(lambda: "mine.json" in tab.text() and "5 waypoints" in tab.text())
    tab.upload("points.csv", b"x,y,z,speed\n0,0,0,0.1\n1,1,1,0.1\n")
    tab.wait(lambda: "points.csv" in tab.text())
    for name, content, told in (
        ("bad.json", b"{oops", "this is not JSON"),
        ("bad.csv", b"x,y\n1,2\n", "bad.csv"),
        ("evil.py", b"import os", "opens .json and .csv"),
        ("long.csv", b"x,y,z,speed\n" + b"0,0,0,1\n1,0,0,1\n" * (MAX_WAYPOINTS // 2 + 1), "up to 20000"),
        ("robot.json", json.dumps({"trajectory": rows, "robot": "/etc/robot.toml"}).encode(), "no robot of ovita"),
    ):
        tab.upload(name, content)
        tab.wait(lambda told=told: any(told in note for note in tab.notices))
        assert not any("/tmp" in note for note in tab.notices)
    assert "points.csv" in tab.text()


def test_an_upload_that_is_too_large_is_not_taken(start, visit):
    studio = start()
    tab = visit(studio)
    tab.upload("huge.json", b"{}", declared=MAX_UPLOAD + 1)
    tab.wait(lambda: any("takes files of up to" in note for note in tab.notices))
    tab.upload("lying.json", b"{" + b" " * 1000, declared=10)
    tab.upload("fine.json", json.dumps({"trajectory": [[0, 0, 0, 1], [1, 0, 0, 1]]}).encode())
    tab.wait(lambda: "fine.json" in tab.text())
    assert not studio.views[0].client.gui._current_file_upload_states


def test_downloads_open_again(start, visit):
    tab = visit(start())
    tab.click("Result (JSON)")
    tab.wait(lambda: any("no result yet" in note for note in tab.notices))
    tab.say(SAY)
    tab.wait(lambda: adapted(tab) is not None)
    names = {
        "Result (JSON)": "tabletop-adaptation.json",
        "Trajectory (JSON)": "tabletop-trajectory.json",
        "Trajectory (CSV)": "tabletop-trajectory.csv",
        "Whole session": "tabletop-session.json",
        "Interactive page (HTML)": "tabletop-page.html",
    }
    for button, name in names.items():
        tab.click(button)
        tab.wait(lambda name=name: name in tab.downloads)
    time.sleep(0.2)
    assert b"<html" in tab.downloads["tabletop-page.html"][:200]
    for name in ("tabletop-adaptation.json", "tabletop-session.json"):
        tab.notices.clear()
        tab.upload(name, tab.downloads[name])
        tab.wait(lambda name=name: f">{name}<" in tab.text() and adapted(tab) is not None)
        assert offset(tab) == pytest.approx(0.2)
        tab.wait(lambda: any("None of it was run" in note for note in tab.notices))
    tab.wait(lambda: tab.find("left [m]"))
    tab.set("left [m]", 0.3)
    tab.wait(lambda: abs(offset(tab) - 0.3) < 1e-6)


def test_files_of_a_folder_can_be_opened(start, visit, tmp_path):
    folder = tmp_path / "scenes"
    folder.mkdir()
    for name, goal in (("a.json", 1.0), ("b.json", 2.0)):
        (folder / name).write_text(json.dumps({"trajectory": [[0, 0, 0, 1], [goal, 0, 0, 1]]}))
    (folder / "notes.txt").write_text("no scene")
    tab = visit(start(folder))
    tab.wait(lambda: "a.json" in tab.text())
    tab.set("at hand", "b.json")
    tab.click("Open")
    tab.wait(lambda: "b.json" in tab.text() and tab.points("/lines/original")[-1, 1, 0] == 2.0)


def test_a_key_is_neither_shown_nor_kept(start, visit, tmp_path):
    pytest.importorskip("pydantic_ai", reason="the extra `llm` takes the key")
    studio = start()
    tab = visit(studio)
    key = "sk-not-a-real-key-0123456789"
    tab.set("API key", key)
    time.sleep(0.1)
    tab.set("writer", "OpenAI")
    tab.set("model", "some-model")
    time.sleep(0.1)
    tab.click("Use this writer")
    tab.wait(lambda: "writer: openai:some-model" in tab.text())
    assert tab.value("API key") == "" and key not in tab.text() and key not in str(tab.notices)
    tab.click("Whole session")
    tab.wait(lambda: "tabletop-session.json" in tab.downloads)
    assert key.encode() not in tab.downloads["tabletop-session.json"]
    assert all(key.encode() not in file.read_bytes() for file in (tmp_path / "sessions").iterdir())
    tab.set("model", "")
    time.sleep(0.1)
    tab.click("Use this writer")
    tab.wait(lambda: any("name the model, such as" in note for note in tab.notices))
    tab.set("writer", "built-in: no model")
    time.sleep(0.1)
    tab.click("Try it")
    tab.wait(lambda: "move at half the speed near the cup&rdquo;" in tab.text())
    assert "writer: openai:some-model" in tab.text()


def test_the_playhead_moves_in_true_time(start, visit):
    studio = start()
    tab = visit(studio)
    tab.point("pace", pace=4)
    tab.point("play")
    tab.wait(lambda: "/playhead/0" in tab.nodes and tab.heard["clock"]["playing"])
    tab.wait(lambda: not tab.heard["clock"]["playing"])
    assert tab.heard["clock"]["at"] == studio.views[0].player.moment == studio.views[0].player.duration


def test_a_simulated_robot_follows_the_playhead(start, visit):
    pytest.importorskip("mujoco", reason="a simulated robot needs the extra sim")
    tab = visit(start())
    tab.set("robot", "ground")
    tab.wait(lambda: "/robot/0" in tab.poses, 30)
    before = tab.poses["/robot/0"]
    tab.point("moment", at=3.0)
    tab.wait(lambda: tab.poses["/robot/0"] != before)
    tab.set("robot", "none")
    tab.wait(lambda: "/robot/0" not in tab.nodes)


def test_dragging_shows_what_comes_and_dropping_makes_it_a_turn(start, visit):
    studio = start()
    tab = visit(studio)
    tab.say("slow down near the cup")
    tab.wait(lambda: adapted(tab) is not None)
    move = next(u for u, p in tab.parts.items() if "the goal" in (p["props"].get("options") or ()))
    tab.send("GuiUpdateMessage", uuid=move, updates={"value": "the goal"})
    tab.wait(lambda: "/gizmo" in tab.nodes)
    goal = adapted(tab)[-1, 1].astype(float)

    common = {"name": "/gizmo", "owner": tab.nodes["/gizmo"]["owner"]}

    def drag(up):
        place = (goal + np.array([0, 0, up])).tolist()
        tab.send("TransformControlsUpdateMessage", wxyz=(1.0, 0.0, 0.0, 0.0), position=place, **common)

    tab.send("TransformControlsDragStartMessage", **common)
    drag(0.1)
    tab.wait(lambda: abs(adapted(tab)[-1, 1, 2] - goal[2] - 0.1) < 1e-6)
    assert len(studio.views[0].controller.session.steps) == 1
    drag(0.2)
    tab.send("TransformControlsDragEndMessage", **common)
    tab.wait(lambda: "moved the goal 0.20 m up" in tab.text())
    tab.wait(lambda: abs(adapted(tab)[-1, 1, 2] - goal[2] - 0.2) < 1e-6)
    assert len(studio.views[0].controller.session.steps) == 2
