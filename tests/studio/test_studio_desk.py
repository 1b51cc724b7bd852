"""Sessions: one turn at a time, latest wish wins, and nothing is lost when the process dies."""

import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

from ovita.dialogue.session import Session
from ovita.errors import RequestError
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.studio.sessions import SessionController, Sessions
from ovita.writers.base import Reply, WriterInfo

PATH = Trajectory(np.column_stack([np.linspace(0, 1, 20), np.zeros((20, 2))]), np.full(20, 0.4))
SCENE = Scene((SceneObject("cup", [0.5, 0.3, 0.4]),))
CODE = "def adapt(traj, scene, *, up=0.1):\n    return move(traj, up=up)\n"


class SlowWriter:
    """Answers when it is let go."""

    name = "slow"

    def __init__(self):
        self.asked, self.go = threading.Event(), threading.Event()

    def write(self, prompt):
        self.asked.set()
        self.go.wait(20)
        return Reply("policy", plan=("Move up.",), code=CODE, writer=WriterInfo("test"))


def until(condition, seconds=10.0):
    ends = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < ends
        time.sleep(0.01)


def test_a_slow_writer_blocks_only_its_own_desk():
    writer = SlowWriter()
    slow, quick = (
        SessionController(Session(PATH, SCENE, writer=writer)),
        SessionController(Session(PATH, SCENE, writer="builtin")),
    )
    slow.say("up", "current")
    assert writer.asked.wait(10) and slow.busy is not None and slow.busy.elapsed >= 0
    with pytest.raises(RequestError, match="still"):
        slow.say("more", "current")
    assert not slow.act(lambda s: s.undo()) and "wait" in slow.error
    quick.say("go left by 0.1", "current").join(10)
    assert len(quick.session.steps) == 1
    writer.go.set()
    until(lambda: slow.busy is None)
    assert slow.session.current.positions[0, 2] == pytest.approx(0.1)


def test_a_cancelled_turn_never_arrives():
    writer = SlowWriter()
    controller = SessionController(Session(PATH, SCENE, writer=writer))
    worker = controller.say("up", "current")
    assert writer.asked.wait(10)
    controller.cancel()
    assert controller.busy is None and "Cancelled" in controller.said.message
    controller.session.writer = "builtin"
    controller.say("go left by 0.1", "current").join(10)
    writer.go.set()
    worker.join(10)
    assert [s.said for s in controller.session.steps] == ["go left by 0.1"]


def test_of_many_values_of_a_knob_the_last_one_stays():
    controller = SessionController(Session(PATH, SCENE, writer="builtin"))
    controller.say("go left by 0.1", "current").join(10)
    news = []
    controller.watch(news.append)
    for value in np.linspace(0.1, 0.5, 300):
        controller.turn("left", float(value))
    until(lambda: controller.session.current.positions[0, 0] == pytest.approx(-0.5))
    assert len(controller.session.steps) == 2 and news.count("line") < 300
    until(lambda: "knobs" in news)  # the texts, once it rests
    assert news.count("knobs") < 20
    controller.turn("sideways", 1.0)
    until(lambda: "sideways" in controller.error)


def test_a_question_is_answered_together_with_what_was_said():
    class Asking:
        name = "asking"
        heard = ""

        def write(self, prompt):
            self.heard = prompt.request.instruction
            if "red" in self.heard:
                return Reply("policy", plan=("Up.",), code=CODE, writer=WriterInfo("test"))
            return Reply("question", question="Which cup?", writer=WriterInfo("test"))

    writer = Asking()
    controller = SessionController(Session(PATH, SCENE, writer=writer))
    with pytest.raises(RequestError):
        controller.answer("the red one")
    controller.say("go over the cup", "current").join(10)
    assert controller.said.question == "Which cup?" and controller.session.adaptation is None
    controller.answer("the red one").join(10)
    assert (
        writer.heard == "go over the cup. the red one"
        and controller.said is None
        and len(controller.session.steps) == 1
    )


def test_desks_are_put_away_and_come_back(tmp_path):
    controllers = Sessions(tmp_path, lambda: (Session(PATH, SCENE, writer="builtin"), "scene"), writer="builtin")
    name, controller = controllers.new()
    controller.say("go left by 0.1", "current").join(10)
    controller.session.writer = writer = SlowWriter()
    controllers.leave(name)
    assert len(controllers) == 0
    again = controllers.find(name)
    assert (
        again.session.writer is writer
        and again is not controller
        and again.session.current == controller.session.current
    )
    assert controllers.find(name) is again
    for other in ("../" + name, "0" * 32, "", name[:-1], name.upper() + "x"):
        assert controllers.find(other) is None
    assert [oct(p.stat().st_mode & 0o777) for p in tmp_path.iterdir()] == ["0o600"]


def test_journals_that_nobody_opened_for_long_are_deleted(tmp_path):
    def controllers():
        return Sessions(tmp_path, lambda: (Session(PATH, SCENE, writer="builtin"), "scene"), writer="builtin")

    names = [controllers().new()[0] for _ in range(3)]
    (tmp_path / "notes.jsonl").write_text("mine")
    for path in (*(tmp_path / f"{name}.jsonl" for name in names[:2]), tmp_path / "notes.jsonl"):
        os.utime(path, (time.time() - 29 * 86_400.0,) * 2)
    assert controllers().find(names[0]) is not None
    for name in names[1:]:
        os.utime(tmp_path / f"{name}.jsonl", (time.time() - 31 * 86_400.0,) * 2)
    later = controllers()
    assert [later.find(name) is not None for name in names] == [True, False, False]
    assert time.time() - (tmp_path / f"{names[0]}.jsonl").stat().st_mtime < 3_600.0
    assert (tmp_path / "notes.jsonl").exists()


def test_a_journal_that_cannot_be_written_costs_no_turn(tmp_path):
    controllers = Sessions(tmp_path / "s", lambda: (Session(PATH, SCENE, writer="builtin"), "scene"), writer="builtin")
    _, controller = controllers.new()
    for file in (tmp_path / "s").iterdir():
        file.unlink()
    (tmp_path / "s").rmdir()
    news = []
    controller.watch(news.append)
    controller.say("go left by 0.1", "current").join(10)
    assert len(controller.session.steps) == 1 and "cannot be written" in controller.error and "error" in news
    assert not controller.act(lambda s: s.undo()) and controller.session.steps == ()
    (tmp_path / "s").mkdir()
    assert controller.act(lambda s: s.redo())
    controller.say("go up by 0.1", "current").join(10)
    (journal,) = (tmp_path / "s").iterdir()
    assert oct(journal.stat().st_mode & 0o777) == "0o600"
    assert Session.resume(str(journal)).current == controller.session.current


KILLED = """
import sys, threading, time
import numpy as np
sys.path.insert(0, sys.argv[2])
from test_studio_desk import PATH, SCENE, SlowWriter
from ovita.dialogue.session import Session
from ovita.studio.sessions import SessionController
if __name__ == "__main__":
    session = Session(PATH, SCENE, writer="builtin")
    session.keep(sys.argv[1])
    controller = SessionController(session)
    controller.say("go left by 0.1", "current").join()
    if sys.argv[3] == "writing":
        session.writer = writer = SlowWriter()
        controller.say("go up", "current")
        writer.asked.wait()
        print("now", flush=True)
        time.sleep(60)
    print("now", flush=True)
    while True:
        controller.say("go up by 0.01", "current").join()
"""


@pytest.mark.parametrize("moment", ["writing", 0.05, 0.11, 0.2])
def test_kill_9_during_a_turn_leaves_the_session_whole(tmp_path, moment):
    journal, here = tmp_path / "journal.jsonl", os.path.dirname(__file__)
    script = tmp_path / "killed.py"
    script.write_text(KILLED)
    process = subprocess.Popen(
        [sys.executable, str(script), str(journal), here, str(moment)], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "now\n"
    time.sleep(0.05 if moment == "writing" else moment)
    process.send_signal(signal.SIGKILL)
    process.wait()
    process.stdout.close()
    session = Session.resume(str(journal), writer="builtin")
    said = [step.said for step in session.steps]
    assert said[0] == "go left by 0.1" and set(said[1:]) <= {"go up by 0.01"}
    assert session.current.positions[0] == pytest.approx([-0.1, 0, 0.01 * (len(said) - 1)])
    session.say("go down by 0.5")
    assert Session.resume(str(journal)).current == session.current
