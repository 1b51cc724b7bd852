"""The timeline, over its own line: what it shows, and what a person does in it."""

import json

import numpy as np
import pytest
from websockets.sync.client import connect

import ovita as ov
from ovita.dialogue.session import Session
from ovita.errors import RequestError
from ovita.paths.part import PathPart
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory
from ovita.studio.editor import deleted, inserted, pulled, sketched
from ovita.studio.playback import Player
from ovita.studio.timeline import acting, curvature, signals, thinned


def session(studio):
    return studio.views[0].controller.session


def opened(start, visit):
    studio = start()
    tab = visit(studio)
    tab.point("moment", at=0.0)
    tab.wait(lambda: {"paths", "clock", "selected"} <= tab.heard.keys() and studio.views)
    return studio, tab


def test_the_page_hears_of_paths_and_of_the_clock_and_strangers_of_nothing(start, visit):
    studio, tab = opened(start, visit)
    (path,) = tab.heard["paths"]["paths"]
    assert path["count"] == len(session(studio).original)
    assert path["rows"] == 8 + len(tab.heard["paths"]["objects"])
    tab.say("slow down near the cup")
    tab.wait(lambda: len(tab.heard["paths"]["paths"]) == 2 and tab.heard["acting"]["spans"])
    for text in ("[]", "{", "null", '{"kind": "select", "range": [1]}', '{"kind": "sketch", "line": "x"}', "7"):
        tab._timeline.send(text)
    tab.point("moment", at=1e9)
    tab.wait(lambda: studio.views[0].player.moment == studio.views[0].player.duration)
    with (
        connect(f"{tab._address}timeline/{'0' * 32}", open_timeout=10) as stranger,
        pytest.raises(Exception, match="1008"),
    ):
        stranger.recv(timeout=10)


def test_words_about_a_part_mean_what_is_selected(start, visit):
    studio, tab = opened(start, visit)
    tab.point("select", range=[40, 20])
    tab.wait(lambda: tab.heard["selected"]["range"] == [20, 40])
    tab.say("move this part 5 cm up")
    tab.wait(lambda: len(session(studio).steps) == 1)
    up = session(studio).current.positions[:, 2] - session(studio).original.positions[:, 2]
    assert up[30] == pytest.approx(0.05) and not up[:20].any() and not up[41:].any()
    assert "from waypoint 21 to 41" in session(studio).adaptation.plan[0]
    tab.point("select", range=None)
    tab.wait(lambda: tab.heard["selected"]["range"] is None)


def test_waypoints_are_picked_inserted_deleted_and_sketched_as_turns(start, visit):
    studio, tab = opened(start, visit)
    tab.point("pick", index=11)
    tab.wait(lambda: "/gizmo" in tab.nodes and studio.views[0].hand.what.value == "waypoint 12")
    assert studio.views[0].hand.move("waypoint 12", session(studio).current.positions[11] + [0, 0, 0.1])
    assert session(studio).steps[-1].said == "moved waypoint 12 0.10 m up"
    tab.point("insert", after=3)
    tab.wait(lambda: len(session(studio).current) == 61)
    tab.point("delete", range=[10, 14])
    tab.wait(lambda: len(session(studio).current) == 56)
    line = session(studio).current.positions[20:40:4] + np.array([0, 0, 0.1])
    tab.point("sketch", line=line.tolist(), range=[20, 36])
    tab.wait(lambda: len(session(studio).steps) == 4 and tab.find("stiffness"))
    tab.wait(lambda: "sketched a new way" in tab.text() and "by hand" in tab.text())
    tab.point("delete", range=[0, 999])
    tab.wait(lambda: any("That" in note or "delete_waypoints" in note for note in tab.notices) or tab.notices)
    for count in (3, 2, 1, 0):
        studio.views[0].conversation.step("Undo")
        assert len(session(studio).steps) == count


def around(n=60):
    t = np.linspace(0.0, 1.0, n)
    return Trajectory(np.stack([t, 0.1 * np.sin(3 * t), 0.2 + 0 * t], axis=1), np.full(n, 0.2))


EDITS = {
    "pull": lambda s: pulled(30, np.array([0.0, 0.0, 0.1]), s.scene.frame, len(s.current)),
    "insert": lambda s: inserted(10),
    "delete": lambda s: deleted(5, 9),
    "sketch": lambda s: sketched(s.current.positions[10:31:4] + np.array([0, 0, 0.1]), 10, 30),
}


@pytest.mark.parametrize("edit", EDITS.values(), ids=EDITS)
def test_a_hand_edit_is_a_turn_that_outlives_its_process(edit, tmp_path):
    path = str(tmp_path / "journal.jsonl")
    talk = Session(around(), writer="builtin")
    talk.keep(path)
    talk.say("go left by 0.1")
    before = talk.current
    edit(talk).do(talk)
    assert talk.current != before and talk.adaptation.status == "done" and talk.steps[-1].kind == "drawn"
    again = Session.resume(path, writer="builtin")
    assert again.current == talk.current and again.steps[-1].said == talk.steps[-1].said
    again.change("moved nothing", scene=Scene())  # what is in force runs again
    assert np.allclose(again.current.positions, talk.current.positions)
    assert again.undo() and again.undo() and again.current == before


def test_only_what_was_meant_moves():
    talk = Session(around(), writer="builtin")
    EDITS["pull"](talk).do(talk)
    moved = np.linalg.norm(talk.current.positions - talk.original.positions, axis=1)
    assert moved[30] == pytest.approx(0.1) and moved[29] > 0 and not moved[:25].any() and not moved[36:].any()
    assert {p.name for p in talk.adaptation.parameters} == {"up", "width"}
    talk.tune({"width": 0.0})
    moved = np.linalg.norm(talk.current.positions - talk.original.positions, axis=1)
    assert np.flatnonzero(moved).tolist() == [30]


def test_a_stiffer_path_keeps_more_of_its_shape():
    talk = Session(around(), writer="builtin")
    bump = talk.current.positions[10:31].copy()
    bump[10] += [0, 0, 0.1]
    sketched(bump, 10, 30).do(talk)
    heights = []
    for stiffness in (0.0, 0.2, 0.6, 0.95):
        talk.tune({"stiffness": stiffness})
        moved = talk.current.positions - talk.original.positions
        assert not moved[:10].any() and not moved[31:].any()
        heights.append(moved[20, 2])
    assert heights[0] > 0.09 and heights == sorted(heights, reverse=True) and heights[3] < 0.5 * heights[0]


@pytest.mark.parametrize(
    ("edit", "told"),
    [
        (lambda: deleted(0, 59), "at least 2 stay"),
        (lambda: inserted(59), "after"),
        (lambda: sketched(np.zeros((1, 3)), 0, 9), "too short"),
        (lambda: sketched(np.zeros((4, 3)), 5, 6), "less than 3 waypoints"),
        (lambda: pulled(3, np.zeros(3), Scene().frame, 60), "less than 1 mm"),
    ],
)
def test_what_no_hand_can_do_is_one_sentence_and_changes_nothing(edit, told):
    talk = Session(around(), writer="builtin")
    with pytest.raises(ov.errors.OvitaError, match=told):
        edit().do(talk)
    assert not talk.steps and talk.current == talk.original


def test_feedback_on_the_original_says_that_it_cannot_repeat_a_hand_edit():
    talk = Session(around(), writer="builtin")
    EDITS["pull"](talk).do(talk)
    with pytest.raises(RequestError, match="feedback on current"):
        talk.say("go left by 0.1", on="original")
    assert talk.say("go left by 0.1").status == "done"


def test_a_selection_is_one_mechanism_in_python_and_in_a_session():
    part = PathPart("range", amount=20, until=40)
    alone = ov.adapt(around(), "this part slower", selection=part, writer="builtin")
    talk = Session(around(), writer="builtin")
    assert talk.say("this part slower", selection=part).adapted == alone.adapted
    slower = alone.adapted.speeds < alone.original.speeds
    assert slower[25:36].all() and not slower[:20].any() and not slower[41:].any()
    assert ov.adapt(around(), "this part slower", writer="builtin").status == "needs_clarification"


def test_signals_are_those_of_the_path():
    angles = np.linspace(0.0, np.pi, 50)
    circle = np.stack([0.5 * np.cos(angles), 0.5 * np.sin(angles), 0 * angles], axis=1)
    assert np.allclose(curvature(circle)[1:-1], 2.0)
    path = Trajectory(circle, np.linspace(0.1, 0.5, 50))
    rows = signals(path, Scene())
    assert np.allclose(rows[5], path.speeds) and np.allclose(rows[1], path.times)
    assert np.allclose(np.diff(path.speeds), rows[6][:-1] * path.durations)
    many = np.random.default_rng(0).normal(size=(4, 5000))
    kept = thinned(many)
    assert kept.shape[1] < 420 and np.allclose(kept.max(axis=1), many.max(axis=1))


def test_the_lines_that_act_are_known_for_each_moment():
    talk = Session(around(), writer="builtin")
    talk.say("go up by 0.1 in the second half")
    lines = talk.adaptation.code.split("\n")
    spans = acting(talk)
    assert spans and all("move(" in lines[line - 1] for line, _, _ in spans)
    assert min(a for _, a, _ in spans) == pytest.approx(talk.current.duration / 2, rel=0.1)


def test_playing_keeps_true_time_however_slowly_it_is_shown(monkeypatch):
    """The clock is read, not counted: a picture that takes long costs pictures and no time."""
    now, told, shown = [0.0], [], []
    monkeypatch.setattr("ovita.studio.playback.time.monotonic", lambda: now[0])
    monkeypatch.setattr("ovita.studio.playback.time.sleep", lambda s: now.__setitem__(0, now[0] + s))

    def show(at):
        shown.append((at, now[0]))
        now[0] += 0.3 if len(shown) > 1 else 0.0

    player = Player(lambda kind, message: told.append(json.loads(json.dumps(message))), show)
    player.set_duration(7.66)
    monkeypatch.setattr("ovita.studio.playback.threading.Thread", Immediate)
    player.toggle()
    assert shown[-1][0] == 7.66 and shown[-1][1] == pytest.approx(7.66, abs=0.35)
    assert all(at == pytest.approx(when, abs=1e-9) for at, when in shown[1:-1])
    assert told[-1] == {"at": 7.66, "playing": False, "pace": 1.0}


class Immediate:
    """A thread that runs at once."""

    def __init__(self, target, **_):
        self.start = target


def test_a_tab_waits_for_no_symbol_that_was_not_read_before(start, visit):
    """Each that is missing in `ICONS`, and all once they are more than viser keeps, cost every tab 50 ms of work."""
    from viser._icons import svg_from_icon

    from ovita.studio.app import ICONS, warm_icons

    studio = start()
    warm_icons()
    before = svg_from_icon.cache_info().misses
    visit(studio)
    assert svg_from_icon.cache_info().misses == before and len(set(ICONS)) <= 32
