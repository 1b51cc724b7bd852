"""What was answered survives: a server that is killed, files that are taken in. The answers are test data."""

import http.client
import json
import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import contextmanager, suppress

import pytest
from visitor import Visitor, heading

from command_line import ovita
from ovita.errors import OvitaError
from ovita.study.answers import StudyEvent, note, progress_of, ratings
from ovita.study.folder import address_of, now
from ovita.study.offline import collect, write_files
from ovita.study.server import StudyServer, serving

GONE = (OSError, http.client.HTTPException)


UNDRAWN = """import sys
from ovita.cli.main import main
from ovita.study import pages
pages.drawing = lambda *_: {"json": "{}", "left_out": ""}
sys.exit(main())"""


@contextmanager
def process(study, port=0, drawn=False):
    """A real server in a process of its own, by default without pictures; it gives the process and the address."""
    command = [
        sys.executable,
        *(["-m", "ovita"] if drawn else ["-c", UNDRAWN]),
        "study",
        "serve",
        str(study.path),
        "--port",
        str(port),
    ]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        try:
            line = server.stdout.readline()
            yield server, line.split()[-1]
        finally:
            server.kill()


def test_a_killed_server_loses_and_doubles_nothing(make_study):
    study = make_study(adapt={"items": 1}, participants=3, questionnaires=["umux"])
    heard = []

    def go(visitor, name):
        page = visitor.get()
        with suppress(*GONE):
            while "<h1>Thank you</h1>" not in page:
                sent = visitor.answers(page)["page"] if 'name="page"' in page else ""
                page = visitor.step(page)
                heard.append((name, sent))

    with process(study) as (server, base):
        people = {name: Visitor(base, address_of(token)) for name, token in study.tokens.items()}
        crowd = [threading.Thread(target=go, args=(visitor, name)) for name, visitor in people.items()]
        for one in crowd:
            one.start()
        while len(heard) < 16:
            assert any(one.is_alive() for one in crowd)
            time.sleep(0.01)
        os.kill(server.pid, signal.SIGKILL)
        for one in crowd:
            one.join(60)
    before = {name: progress_of(study, person).answered for name, person in study.participants.items()}
    confirmed = {(name, page) for name, page in heard if page not in ("", "s002")}
    assert all(page in before[name] for name, page in confirmed), "what the server confirmed is on disk"
    assert 0 < sum(map(len, before.values())) < sum(len(p.pages) for p in study.participants.values())
    with serving(StudyServer(study)) as server:
        for token in study.tokens.values():
            Visitor(server.url, address_of(token)).finish()
    for name, person in study.participants.items():
        progress = progress_of(study, person)
        events = [event.page for event in progress.events if event.event == "answer"]
        assert events == [page.id for page in person.pages], "each page once, in order"
        assert all(progress.answered[page] == event for page, event in before[name].items())
        assert [turn.turn for turn in progress.turns("s002")] == [1]


@pytest.mark.parametrize("done", [False, True], ids=["before the system answered", "before its answer was noted"])
def test_a_sentence_that_was_cut_off_is_done_once(make_study, done):
    from ovita.study.desk import StudyDesk

    study = make_study(adapt={"items": 1})
    person, token = study.participants["p1"], study.tokens["p1"]
    desk = StudyDesk(study)
    desk.take(token, {"do": "consent", "agree": "yes"})
    desk.take(token, {"do": "answer", "page": "s001"})
    desk.show(token)
    note(study, person, StudyEvent("saying", now(), page="s002", turn=1, said="go up by 0.1", on="current"))
    if done:
        progress = progress_of(study, person)
        desk._conversations._session(progress, person.pages[1]).say("go up by 0.1")
    again = StudyDesk(study)
    again.show(token)
    progress = progress_of(study, person)
    assert [turn.status for turn in progress.turns("s002")] == ["done"]
    session = again._conversations._session(progress, person.pages[1])
    rise = session.current.positions[:, 2] - session.original.positions[:, 2]
    assert rise == pytest.approx(0.1), "once, not twice"


def test_a_proposal_outlives_the_server(make_study):
    from ovita.study.desk import StudyDesk

    study = make_study(adapt={"items": 1})
    token = study.tokens["p1"]
    desk = StudyDesk(study)
    desk.take(token, {"do": "consent", "agree": "yes"})
    desk.take(token, {"do": "answer", "page": "s001"})
    say = {"do": "say", "page": "s002", "on": "current"}
    desk.take(token, {**say, "turn": "1", "said": "go up by 0.1 and frobnicate"})
    person = study.participants["p1"]
    assert progress_of(study, person).turns("s002")[-1].status == "needs_confirmation"
    later = StudyDesk(study)
    later.take(token, {**say, "turn": "2", "said": "yes"})
    assert progress_of(study, person).turns("s002")[-1].status == "done"


def handed_over(study, name, folder, **changes):
    """A file as a person's page hands it over, with made-up answers."""
    person = study.participants[name]
    values = {"correctness": 4, "interpretability": 2, "preference": "right", "attention": 3, "umux_1": 7, "umux_2": 1}
    asked = {
        "rate": ("correctness", "interpretability"), "preference": ("preference",), "attention": ("attention",),
        "umux": ("umux_1", "umux_2"),
    }  # fmt: skip
    head = {"study": study.founded.id, "participant": name, "token": study.tokens[name]}
    lines = [head | changes, {"event": "consent", "when": now(), "consent_sha256": study.founded.consent_sha256}]
    for page in person.pages:
        given = {question: values[question] for question in asked.get(page.kind, ())}
        lines.append({"event": "shown", "when": now(), "page": page.id})
        lines.append({"event": "answer", "when": now(), "page": page.id, "values": given, "seconds": 2.0})
    file = folder / f"answers-{name}.jsonl"
    file.write_text("".join(json.dumps(line) + "\n" for line in lines))
    return file, lines


def test_files_are_taken_in_once(make_study, tmp_path):
    study = make_study(questionnaires=["umux"])
    file, _ = handed_over(study, "p2", tmp_path)
    done = ovita("study", "collect", study.path, file, file)
    assert done.returncode == 0 and "p2: 12 new" in done.stdout and "p2: 0 new" in done.stdout
    found = ratings(study.path)
    assert len([r for r in found if r.question == "correctness"]) == 6 and {r.participant for r in found} == {"p2"}
    ovita("study", "withdraw", study.path, "p2", "--yes")
    assert ratings(study.path) == ()
    assert "withdrew" in ovita("study", "collect", study.path, file).stderr


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda lines: lines[0].update(study="other"), "no answers of this study"),
        (lambda lines: lines[0].update(token="x" * 24), "secret"),
        (lambda lines: lines[0].update(participant="p9"), "secret"),
        (lambda lines: lines[0].update(participant="p1"), "secret"),
        (lambda lines: lines[1].update(consent_sha256="0"), "line 2"),
        (lambda lines: lines.pop(1), "no consent"),
        (lambda lines: lines[5]["values"].update(correctness=6), "line 6"),
        (lambda lines: lines[5].update(page="s999"), "line 6"),
        (lambda lines: lines[5].update(seconds=-1.0), "line 6"),
        (lambda lines: lines[5].update(event="said"), "line 6"),
        (lambda lines: lines[5].update(surprise=1), "line 6"),
    ],
)
def test_files_that_no_page_wrote_are_refused(make_study, tmp_path, change, said):
    study = make_study(questionnaires=["umux"])
    file, lines = handed_over(study, "p2", tmp_path)
    change(lines)
    file.write_text("".join(json.dumps(line) + "\n" for line in lines))
    with pytest.raises(OvitaError, match=said):
        collect(study, str(file))
    assert ratings(study.path) == ()


def test_files_hold_one_person_and_no_names(make_study, tmp_path):
    study = make_study(explanation="on")
    files = write_files(study, str(tmp_path / "files"))
    assert [file.name for file in files] == [f"{name}.html" for name in study.participants]
    text = files[0].read_text(encoding="utf-8")
    pages = text[text.index("<template") :].partition("<script>")[0]
    assert "PILOT" in text and study.tokens["p1"] in text and study.tokens["p2"] not in text
    assert not any(name.split(":")[-1] in pages for name in study.founded.names)
    assert all(f'id="page-{page.id}"' in pages for page in study.participants["p1"].pages)
    with pytest.raises(OvitaError, match="needs a server"):
        from dataclasses import replace

        from ovita.study.design import AdaptationPhase

        design = replace(study.design, adapt=AdaptationPhase(1))
        write_files(replace(study, founded=replace(study.founded, design=design)), str(tmp_path / "more"))


def test_the_heading_of_a_page_is_found():
    assert heading("<h1>A &amp; B</h1>") == "A & B"
