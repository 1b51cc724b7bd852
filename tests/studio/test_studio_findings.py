"""What visitors found wrong in the studio, each with a test; `docs/studio.md` lists them."""

import json
import re
import socket
import urllib.request
from importlib.resources import files as package_files
from types import SimpleNamespace

import numpy as np
import pytest

from ovita import adapt
from ovita.dialogue.session import Session
from ovita.errors import RequestError
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.result import Status
from ovita.studio import files, guide, html, panels, playback, robots, scene_view, turns
from ovita.studio.ruler import measured
from ovita.studio.scene_view import VIEW_DIRECTIONS, ViewBounds
from ovita.studio.sessions import SessionController
from ovita.writers.base import Reply

CUP = Scene((SceneObject("cup", [0.5, 0.3, 0.4], dimensions=(0.1, 0.1, 0.1)),))
LOW = Scene((SceneObject("cup", [0.5, 0.3, 0.05], dimensions=(0.1, 0.1, 0.1)),))
STYLE = (package_files("ovita.studio") / "head.html").read_text(encoding="utf-8")


class Unsure:
    """Is certain of nothing."""

    name = "unsure"

    def write(self, prompt):
        code = "def adapt(traj, scene, *, left=0.2):\n    expect_moved(left=left)\n    return move(traj, left=left)\n"
        return Reply("policy", ("Shift the path 0.2 m to the left.",), code, unplaced=("feed",), confirm=True)


def straight(high=0.4, count=20):
    places = np.stack([np.linspace(0, 1, count), np.zeros(count), np.full(count, high)], axis=1)
    return Trajectory(places, np.full(count, 0.2))


def session(**options):
    return Session(straight(), CUP, writer="builtin", **options)


def shown(of):
    return turns.outcome(SimpleNamespace(busy=None, said=None, session=of))


def test_every_verdict_has_a_rung_and_only_done_is_green():
    assert set(turns.LADDER) == set(Status.__args__)
    assert [status for status, rung in turns.LADDER.items() if rung.colour == "good"] == ["done"]
    assert all(f".ov .chip.{rung.colour}" in STYLE for rung in (*turns.LADDER.values(), turns.LOST))


@pytest.mark.parametrize(
    ("said", "robot", "word", "taken"),
    [
        ("go left by 0.2", "none", "done", "nothing"),
        ("go up by 3 m", "arm", "changed by the limits", "of 'the path moves 3 m up'"),
    ],
)
def test_one_line_says_what_was_asked_what_came_out_and_what_was_taken_back(said, robot, word, taken):
    talk = session(robot=Robot.preset(robot))
    talk.say(said)
    text = shown(talk)
    line = re.search(r'<p class="account">(.*?)</p>', text)[1]
    asked, came, back = re.split(r"(?:<br>)?<b>.*?</b> ", line)[1:]
    assert asked == said and "the path moved" in came and taken in back.replace("&#x27;", "'")
    for place in (text, turns.badge(talk), turns.history(talk), turns.header(controller(talk), "builtin")):
        assert f">{word}</span>" in place


def controller(talk):
    return SessionController(talk, "scene.json")


def test_an_infeasible_result_is_not_green_and_its_file_says_so():
    talk = session(robot=Robot.preset("arm"))
    talk.say("go right by 5 m")
    assert talk.adaptation.status != "done" and "chip good" not in shown(talk) + turns.history(talk)
    name, content = files.exported("html", talk, "desk.json")
    assert name == f"desk-page{talk.adaptation.mark}.html" and talk.adaptation.status.encode() in content


def test_history_rows_go_back_and_name_what_a_knob_did():
    talk = session()
    talk.say("go left by 0.2")
    talk.tune({"left": 0.42}, merge=True)
    talk.settle()
    text = turns.history(talk)
    assert turns.label(talk, 1) == "left 0.2 \u2192 0.42" and text.index('"go 2"') < text.index('"go 1"') < text.index(
        '"go 0"'
    )
    assert text.count("aria-current") == 1
    talk.undo()
    assert "undone" in turns.history(talk)


def test_a_word_of_100000_letters_is_refused_at_the_door():
    with pytest.raises(RequestError, match="at most 2000"):
        controller(session()).say("a" * 100_000, "current")


@pytest.mark.parametrize("said", ["help", "Help!", "?", "what can I say?"])
def test_help_is_answered_and_is_no_instruction(start, visit, said):
    tab = visit(start())
    tab.say(said)
    tab.wait(lambda: "What can be said here" in tab.text())
    assert "&#x27;bottle&#x27;" in tab.text() and "not understood" not in tab.text()


def test_what_is_not_understood_leaves_a_proposal_on_the_page():
    talk = Session(straight(), CUP, writer=Unsure())
    assert talk.say("left 20 cm, feed 0.7").status == "needs_confirmation"
    said = SimpleNamespace(text="moonwalk", result=None, message="I could not place 'moonwalk'.")
    text = turns.outcome(SimpleNamespace(busy=None, said=said, session=talk))
    assert text.index("moonwalk") < text.index('class="card waiting"') < text.index("feed 0.7")


def test_a_value_that_is_typed_beyond_a_slider_widens_it():
    slider = SimpleNamespace(value=5.0, min=0.0, max=0.5)
    panels._widen(slider)
    assert slider.value == 5.0 and slider.max >= 5.0 and slider.min == 0.0
    panels._widen(SimpleNamespace(value=True))  # a box has no ends


def test_a_rover_stays_on_the_floor():
    pytest.importorskip("mujoco", reason="a simulated robot needs the extra sim")
    seen = []
    nodes = SimpleNamespace(remove=lambda: None)
    api = SimpleNamespace(
        add_frame=lambda name, **_: seen.append(SimpleNamespace(**vars(nodes))) or seen[-1],
        **dict.fromkeys(("add_box", "add_icosphere", "add_cylinder"), lambda *a, **k: nodes),
    )
    rover = playback.RobotView(api, pytest.fail)
    rover.choose("ground")
    rover._plan((straight(0.4), LOW, Robot.preset("none")))
    heights = rover._motion.positions[..., 2]
    assert playback.floor(straight(0.4), LOW) == 0.0
    assert heights.max() < 0.2
    talk = Session(straight(), LOW, writer="builtin")
    assert "stays on the floor" in robots._remark(talk, "ground") and "only shown" in robots._remark(talk, "drone")


def test_a_robot_reports_reach_tracking_and_contacts():
    pytest.importorskip("mujoco", reason="a simulation needs the extra sim")
    text = robots.reported(Session(straight(0.5, 6), CUP, writer="builtin"), "crazyflie")
    assert "Tracking error" in text and 'class="chip' in text


def test_sending_passes_the_gate_and_shows_its_checks(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    with pytest.raises(RequestError, match="say what should change first"):
        robots.reviewed(session())
    loose = session()
    loose.say("go left by 0.1")
    refused = robots.reviewed(loose)
    assert "refused" in robots.gate_said(refused) and "no limits to verify against" in robots.gate_said(refused)
    with pytest.raises(RequestError, match="no limits to verify"):
        robots.sent(refused, str(tmp_path / "no.csv"), "scene")
    talk = session(robot=Robot.preset("drone"))
    talk.say("go left by 0.1")
    found = robots.reviewed(talk)
    assert found.released and "may be sent" in robots.gate_said(found) and "limits hold" in robots.gate_said(found)
    with pytest.raises(RequestError, match="say where"):
        robots.sent(found, "", "scene")
    assert "sent" in robots.sent(found, str(tmp_path / "path.csv"), "scene")
    assert (tmp_path / "path.csv").exists() and not (tmp_path / "no.csv").exists()
    kinds = [
        json.loads(line)["event"]
        for line in (tmp_path / "state" / "ovita" / "sent.jsonl").read_text().split("\n")
        if line
    ]
    assert kinds == ["refused", "sending", "sent"]


def test_strangers_cannot_send(start, visit):
    studio = start(host="0.0.0.0", token="a-token-for-tests")
    tab = visit(studio, headers={"Cookie": f"{studio.gate.cookie}=a-token-for-tests"})
    hidden = [
        tab.parts[tab.find(name)]["props"]["visible"] for name in ("send to", "Show what the gate says", "Send it")
    ]
    assert hidden == [False] * 3


@pytest.mark.parametrize("view", VIEW_DIRECTIONS)
def test_every_view_sees_everything(view):
    path = straight()
    stage = ViewBounds.of([path], CUP)
    place, target = stage.camera(CUP.frame, 1.3, 0.75, view)
    back = (place - target) / np.linalg.norm(place - target)
    right = np.cross(stage.up, back) / np.linalg.norm(np.cross(stage.up, back))
    seen = path.positions - place
    near = -(seen @ back)
    assert (near > 0).all()
    assert (np.abs(seen @ right) / near < np.tan(0.375) * 1.3).all()
    assert (np.abs(seen @ np.cross(back, right)) / near < np.tan(0.375)).all()


def test_the_page_asks_for_views_and_dark_mode(start, visit):
    studio = start()
    tab = visit(studio)
    (view,) = tab.wait(lambda: studio.views)
    fit = np.array(view.client.camera.position)
    tab.set("page", "1 look top")
    tab.wait(lambda: np.linalg.norm(view.space._looked[0] - fit) > 0.1)
    tab.set("page", "2 dark 1")
    tab.wait(lambda: view.space.dark)
    tab.set("page", "3 look follow")
    tab.wait(lambda: view.space.following)


def test_every_key_is_listed_and_does_something():
    assert {key.wish for key in guide.HOTKEYS} == {"play", "undo", "redo", *(f"look {view}" for view in turns.VIEWS)}
    text = guide.page().decode()
    every = [key for keys in guide.KEYS.values() for key in keys]
    assert all(f"<kbd>{html.e(key.shown)}</kbd>" in text for key in every if key.shown)
    heard = json.loads(re.search(r"window.ovitaKeys = (.*);</script>", text)[1])
    assert [key["wish"] for key in heard] == [key.wish for key in every if key.wish]
    named = r"""(?:event|one)\.(?:key|code) *[!=]=|(?:shift|alt)Key"""  # no handler knows a key but from the table
    allowed = ("const held =", "&& key.held ===", "bare(event.target) &&")
    lines = [line for line in text.split("\n") if re.search(named, line)]
    own = [line for line in lines if len(line) < 400]  # viser's client is one long line
    assert own and all(any(part in line for part in allowed) for line in own)
    assert all(rung.meaning in text for rung in turns.LADDER.values())


def ratio(one, other):
    def light(colour):
        parts = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255.0
        return float(
            np.where(parts <= 0.03928, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4) @ (0.2126, 0.7152, 0.0722)
        )

    high, low = sorted((light(one), light(other)), reverse=True)
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize(
    ("begins", "paper"), [(":root {", "#ffffff"), ('[data-mantine-color-scheme="dark"] {', "#242424")]
)
def test_contrast_is_at_least_4_5(begins, paper):
    rules = STYLE[STYLE.index(begins) :]
    colour = {"paper": paper} | dict(re.findall(r"--([\w-]+): (#[0-9a-f]{6})", rules[: rules.index("}")]))
    pairs = [(kind, f"{kind}-on") for kind in ("good", "warn", "wrong", "bad", "ask")]
    pairs += [(ink, on) for ink in ("ink", "soft") for on in ("paper", "card", "now", "waiting")]
    pairs += [("ink", "chip"), ("brand", "paper"), ("brand", "card"), ("bad", "paper"), ("on", "brand")]
    pairs += [(ink, "dock-back") for ink in ("ink", "soft", "warn")]  # what the timeline draws itself
    assert {
        pair: ratio(*(colour[name] for name in pair)) for pair in pairs if ratio(*(colour[name] for name in pair)) < 4.5
    } == {}

    scene = scene_view.DARK if "dark" in begins else scene_view.COLOURS
    assert (colour["blue"], colour["red"]) == (scene["before"], scene["after"])  # one colour in texts, timeline, scene
    back = "#141414" if "dark" in begins else "#ffffff"
    assert min(ratio(scene[name], back) for name in ("before", "after", "goal")) >= 4.5


def test_no_text_is_smaller_than_12_pixels():
    """Viser's rem is 14.8 pixels, so what is less than 0.9 rem says what it is at least."""
    sizes = re.findall(r"font(?:-size)?:[^;}]*?(max\(12px, )?([\d.]+)(rem|px)", STYLE)
    small = [found for found in sizes if not found[0] and float(found[1]) * (14.8 if found[2] == "rem" else 1.0) < 12.0]
    assert len(sizes) > 8 and not small


def test_a_post_is_answered_without_a_traceback(start, capfd):
    studio = start()
    for request in (b"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 2\r\n\r\nhi", b"\x00\x01 nonsense\r\n\r\n"):
        with socket.create_connection(("127.0.0.1", studio.port), timeout=5) as line:
            line.sendall(request)
            line.recv(4096)
    studio.stop()
    assert "Traceback" not in "".join(capfd.readouterr())


def test_the_page_can_ask_whether_the_studio_is_there(start):
    with urllib.request.urlopen(start().url + "alive", timeout=5) as answer:
        assert answer.status == 200 and answer.read() == b""


def test_what_is_used_of_the_inside_of_viser_is_there(start, visit):
    """A new version of viser that lacks one of these fails here, and `pyproject.toml` keeps it out until then."""
    studio = start()
    tab = visit(studio)
    (view,) = tab.wait(lambda: studio.views)
    connection, gui = view.client._websock_connection, view.client.gui
    assert connection.get_message_buffer()._sanctioned_dead_writes >= 1
    for owner, name in ((connection, "unregister_handler"), (connection, "register_handler"),
                        (gui, "_current_file_upload_states"), (gui, "_handle_file_transfer_part"),
                        (studio.server, "request_share_url")):  # fmt: skip
        assert hasattr(owner, name), name
    own = guide.page().decode()
    assert own.count("<title>") == 1 and "ovita studio" in own[: own.index("</title>")]
    project = (package_files("ovita") / ".." / ".." / "pyproject.toml").read_text(encoding="utf-8")
    assert "viser>=1.1,<1.2" in project


@pytest.mark.parametrize(
    ("one", "other", "says"),
    [
        ("the start", "the goal", "1.00 m from the start to the goal: 1.00 m right."),
        (
            "the goal",
            "cup",
            "58.3 cm from the goal to cup: 50.0 cm left and 30.0 cm front. 51.5 cm to the surface of cup.",
        ),
        ("cup", "the line", "25.0 cm to the surface of cup."),
    ],
)
def test_what_is_measured_between_things(one, other, says):
    assert measured(session(), one, other).said.endswith(says)


def test_earlier_sessions_are_listed_whatever_file_the_studio_was_started_with(start, visit, tmp_path):
    storage = {}
    for name in ("a.json", "b.json"):
        (tmp_path / name).write_text(json.dumps({"trajectory": [[0, 0, 0, 1], [1, 0, 0, 1]]}))
    first = visit(start(tmp_path / "a.json"), storage)
    first.wait(lambda: "ovita-sessions" in storage)
    second = visit(start(tmp_path / "b.json"), storage)
    second.wait(lambda: any("a.json" in str(part["props"].get("options")) for part in second.parts.values()))
    second.click("Go back to it")
    second.wait(lambda: ">a.json<" in second.text())


def test_a_result_of_python_reads_as_in_the_page():
    result = adapt(straight(), "go up by 0.1", scene=CUP, writer="builtin")
    assert turns.rung(result) is turns.LADDER["done"] and "0.1" in turns.account(result)


def test_sentences_measure_from_what_is_named():
    talk = session()
    talk.say("go left by 0.1")
    before = talk.current
    talk.say("go left by 0.1")
    assert "0.20 m left" in html.changes(talk.original, talk) and "0.10 m left" in html.changes(before, talk)


def test_while_a_knob_moves_only_its_line_is_sent(start, visit):
    """The line that stays is not sent again, nor are texts, until the knob rests."""
    studio = start()
    tab = visit(studio)
    tab.say("go left by 0.1")
    tab.wait(lambda: tab.points("/lines/adapted") is not None and tab.find("left [m]"))
    (view,) = studio.views
    told, kept = [], view.space._lines["original"].points
    view.controller.watch(told.append)
    for value in (0.2, 0.3, 0.4):
        tab.set("left [m]", value)
    tab.wait(lambda: told and told[-1] == "knobs" and "0.40 m left" in tab.text())
    assert told.count("knobs") == 1 and view.space._lines["original"].points is kept
    view.space.draw_lines(view.controller.session)
    assert not view.space._another("original", view.controller.session.original, view.space.palette["before"], None)
