"""A study from bench runs to answers; people are simulated, and what they answer is test data."""

import json
import re
import threading
from dataclasses import replace

import pytest
from made_study import write_design
from visitor import Visitor, heading

from command_line import ovita
from ovita.errors import OvitaError
from ovita.study import pages
from ovita.study.answers import progress_of, ratings
from ovita.study.folder import address_of, open_study
from ovita.study.material import hidden
from ovita.study.server import StudyServer, serving


@pytest.fixture
def served(make_study):
    """Makes a study, serves it, and gives a visitor for each link."""
    open_servers = []

    def serve(study=None, **changes):
        study = study or make_study(**changes)
        context = serving(StudyServer(study))
        server = context.__enter__()
        open_servers.append(context)
        return study, [Visitor(server.url, address_of(token)) for token in study.tokens.values()]

    yield serve
    for context in open_servers:
        context.__exit__(None, None, None)


def test_people_go_through_a_whole_study(served):
    study, people = served(adapt={"items": 1}, questionnaires=["tlx", "umux", "sus"])
    seen = people[0].finish()
    names = {heading(page).split()[0] for page in seen}
    assert {"Test", "Change", "How", "Result", "A", "Which", "The", "Last", "Thank"} <= names
    found = ratings(study.path)
    assert {r.participant for r in found} == {"p1"} and all(r.pilot for r in found)
    asked = {r.question for r in found}
    assert {"correctness", "interpretability", "preference", "tlx_effort", "umux_2", "sus_10", "attention"} <= asked
    rated = [r for r in found if r.question == "correctness" and r.phase == "rate"]
    assert len(rated) == 6 and {r.condition for r in rated} == set(study.founded.names)
    preferred = [r for r in found if r.question == "preference"]
    assert all(r.value == r.condition.split("|")[0] for r in preferred)
    assert [r.value for r in found if r.question == "attention"] == [1.0]
    adapted = [r for r in found if r.phase == "adapt" and r.question == "correctness"]
    assert [r.condition for r in adapted] == ["builtin with feedback"] and adapted[0].item not in {
        r.item for r in rated
    }


def test_people_judge_what_others_adapted(served):
    study, people = served(adapt={"items": 1}, participants=4, explanation="on")
    seen = [page for visitor in people for page in visitor.finish() if "Result of another person" in page]
    judged = [r for r in ratings(study.path) if r.adapter and r.question == "correctness"]
    assert len(judged) == len(seen) >= 2, "the first had nobody to judge"
    for rating in judged:
        assert rating.adapter != rating.participant and rating.condition == "builtin with feedback"
        assert {rating.item} == study.participants[rating.adapter].adapted
        assert rating.item not in study.participants[rating.participant].adapted
    assert len({r.adapter for r in judged}) >= 2, "those that fewest judged come first"
    for page in seen:
        assert "go up by 0.1" not in page and "What the system says" in page and not re.search("builtin", page)
    first = progress_of(study, study.participants["p1"])
    skipped = next(page for page in first.person.pages if page.kind == "judge")
    assert first.answered[skipped.id].values == {}


def test_what_a_person_took_back_is_judged_by_nobody(served):
    study, people = served(adapt={"items": 1, "judged": 2}, participants=3)
    people[0].finish()
    for visitor in people[1:]:
        page = visitor.get()
        while "Result of another person" not in page and "<h1>Thank you</h1>" not in page:
            page = visitor.step(page)
        if "Result of another person" in page:
            form = visitor.answers(page)
            people[0].post(do="withdraw")
            assert "Result of another person" not in visitor.get(), "it is gone, and there is no other"
            visitor.post(**form)
            assert not [r for r in ratings(study.path) if r.adapter]
            return
    raise AssertionError("nobody judged anything")


def test_no_page_tells_a_condition(run_folder, served, make_study, real_pictures):
    run = run_folder(explanation="Secret-Model did it; alpha:secret-model was asked.\n- It went up.")
    study = make_study(run, explanation="on")
    _, people = served(study)
    for page in people[0].finish():
        assert not re.search(r"secret.model|alpha|baseline|random|builtin|123\.4", page, re.IGNORECASE)
        assert "PILOT" in page
    assert "http://" not in page and "https://" not in page


def test_markup_in_scenes_and_sentences_stays_text(run_folder, make_study, served, real_pictures):
    evil = '</script><script>alert(1)</script><img src=x onerror="alert(2)">'
    study = make_study(run_folder(instruction=evil, explanation=evil), explanation="on", title=evil, contact=evil)
    _, people = served(study)
    for page in people[0].finish():
        assert "alert(1)</script>" not in page and "<img" not in page


def test_answers_count_once(served):
    study, people = served()
    visitor = people[0]
    page = visitor.step(visitor.step(visitor.get()))
    form = visitor.answers(page)
    after = visitor.post(**form)
    assert visitor.post(**{**form, "correctness": "5"}) == after == visitor.get(), "a page sent twice goes on"
    first = [r.value for r in ratings(study.path) if r.question == "correctness"]
    assert first == [3.0]
    late = {**form, "page": "s009", "correctness": "1"}
    assert visitor.post(**late) == after, "a page that was not reached is not answered"
    assert len(progress_of(study, study.participants["p1"]).answered) == 2


def test_a_question_left_out_is_asked_again(served):
    _, (visitor, *_) = served()
    page = visitor.step(visitor.step(visitor.get()))
    form = visitor.answers(page)
    again = visitor.post(**{**form, "correctness": "9", "comment": "<b>hm</b>"})
    assert "Please answer the marked question." in again and "&lt;b&gt;hm&lt;/b&gt;" in again
    assert len(re.findall(r'class="missing"', again)) == 1


def test_a_sentence_sent_twice_is_done_once(served):
    study, (visitor, *_) = served(adapt={"items": 1, "turns": 2})
    page = visitor.step(visitor.step(visitor.get()))
    said = {"do": "say", "page": "s002", "turn": "1", "said": "go up by 0.1", "on": "current"}
    assert 'name="said"' in page
    visitor.post(**said)
    visitor.post(**said)
    progress = progress_of(study, study.participants["p1"])
    assert [turn.said for turn in progress.turns("s002")] == ["go up by 0.1"]
    visitor.post(**{**said, "turn": "2", "on": "original"})
    assert 'name="said"' not in visitor.post(**{**said, "turn": "3"}), "all sentences are used up"


def test_hints_for_those_who_run_it_reach_nobody(served):
    study, (visitor, *_) = served(adapt={"items": 1})
    visitor.step(visitor.step(visitor.get()))
    page = visitor.post(do="say", page="s002", turn="1", said="asdf qwer", on="current")
    assert "I did not understand" in page and "asdf" in page
    assert not re.search(
        "ovita|writer|model", " ".join(progress_of(study, study.participants["p1"]).turns("s002")[0].told)
    )


def test_all_pictures_of_an_item_look_alike(make_study, real_pictures):
    study = make_study()
    person, item = study.participants["p1"], study.items["tests/item_0"]
    lifted = tuple((x, y, z + x, v) for x, y, z, v in item.original)
    odd = replace(item.results["baseline:copy"], adapted=lifted)
    item = replace(item, results={**item.results, "baseline:copy": odd})
    scenes = []
    for name in study.founded.names:
        scene = json.loads(str(pages._side(item, name, person)["figure"]["json"]))["figure"]["layout"]["scene"]
        scenes.append((scene["camera"], scene["aspectratio"], [scene[f"{axis}axis"]["range"] for axis in "xyz"]))
    assert scenes[0] == scenes[1] == scenes[2], "a picture from above beside two in space would tell which one is odd"


def test_links_are_secret(served):
    study, people = served()
    token = study.tokens["p1"]
    assert len(token) >= 24 and len(set(study.tokens.values())) == 6
    for wrong in (
        "/",
        "/s/",
        "/s/p1",
        f"/s/{token[:-1]}",
        f"/s/{token}x",
        "/participants/p1.jsonl",
        "/s/%00",
        "/s/é".encode().decode("latin1"),
    ):
        try:
            assert people[0].status(wrong) == 404
        except UnicodeEncodeError:
            continue
    assert study.path.joinpath("links.csv").stat().st_mode & 0o077 == 0
    assert study.whose(token).id == "p1" and study.whose("") is None and study.whose("ä") is None


def test_withdrawal_deletes_and_lasts(served):
    study, people = served(adapt={"items": 1})
    people[0].finish()
    stale = people[0].answers('name="page" value="s003"')
    assert "You have withdrawn" in people[0].post(do="withdraw")
    people[1].finish()
    assert "You have withdrawn" in people[0].post(**stale), "a tab that was left open brings nothing back"
    assert "You have withdrawn" in people[0].post(do="consent", agree="yes") and "withdrawn" in people[0].get()
    left = study.answers_of("p1").read_text()
    assert [json.loads(line)["event"] for line in left.splitlines()] == ["withdrawn"]
    assert {r.participant for r in ratings(study.path)} == {"p2"}
    assert not list((study.path / "sessions").glob("p1-*")) and list((study.path / "sessions").glob("p2-*"))


def test_nothing_is_stored_before_consent(served):
    study, (visitor, *_) = served()
    visitor.get()
    visitor.post(do="answer", page="s001")
    assert "tick the box" in visitor.post(do="consent")
    assert not study.answers_of("p1").exists()
    visitor.post(do="consent", agree="yes")
    event = json.loads(study.answers_of("p1").read_text().splitlines()[0])
    assert event["consent_sha256"] == study.founded.consent_sha256


def test_thirty_people_at_once(served):
    study, people = served(participants=30, per_person=3, attention=0, questionnaires=[], preference=False)
    crowd = [threading.Thread(target=visitor.finish) for visitor in people]
    for one in crowd:
        one.start()
    for one in crowd:
        one.join(120)
    found = [r for r in ratings(study.path) if r.question == "correctness"]
    assert len(found) == 90 and len({r.participant for r in found}) == 30


def test_the_examples_consent_is_for_pilots_only(tmp_path, run_folder):
    design = write_design(tmp_path / "design", pilot=False)
    text = (tmp_path / "design" / "consent.txt").read_text()
    (tmp_path / "design" / "consent.txt").write_text(f"PLEASE REPLACE THIS TEXT\n\n{text}")
    words = ["study", "new", design, "--runs", run_folder(), "--out"]
    failed = ovita(*words, tmp_path / "s")
    assert failed.returncode == 2 and "still the example's text" in failed.stderr and not (tmp_path / "s").exists()
    assert ovita(*words, tmp_path / "s", "--pilot").returncode == 0


def test_one_server_a_study(served):
    study, _ = served()
    with pytest.raises(OvitaError, match="being served already"):
        StudyServer(study)


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("alpha did it, ALPHA:x too", "the system did it, the system too"),
        ("alphabet stays", "alphabet stays"),
        ("the ﬁnal İ ALPHA", "the ﬁnal İ the system"),
    ],
)
def test_names_are_hidden_as_whole_words(text, shown):
    assert hidden(text, ("alpha:x", "alpha")) == shown


def test_the_command_says_what_is_wrong(tmp_path, run_folder):
    run = run_folder()
    design = write_design(tmp_path / "design")
    done = ovita("study", "new", design, "--runs", run, run, "--out", tmp_path / "s", "--per-person", 3)
    assert done.returncode == 0 and "each result is rated 1 times" in done.stdout
    assert open_study(tmp_path / "s").design.per_person == 3
    for words, said in (
        (["study", "new", design, "--runs", run, "--out", tmp_path / "s"], "never overwritten"),
        (["study", "new", design, "--runs", run, "--out", tmp_path / "t", "--per-person", 5], "no multiple"),
        (["study", "new", design, "--runs", tmp_path, "--out", tmp_path / "t"], "holds no records"),
        (["study", "serve", tmp_path], "is no study's folder"),
    ):
        failed = ovita(*words)
        assert failed.returncode == 2 and said in failed.stderr
    odd = write_design(tmp_path / "odd", atention=1)
    assert "attention" in ovita("study", "new", odd, "--runs", run, "--out", tmp_path / "t").stderr
    (tmp_path / "design" / "consent.txt").unlink()
    failed = ovita("study", "new", design, "--runs", run, "--out", tmp_path / "t")
    assert failed.returncode == 2 and "no consent text" in failed.stderr
    (tmp_path / "s" / "consent.txt").write_text("Something else that people never saw or agreed to. " * 3)
    assert "differs from the text" in ovita("study", "serve", tmp_path / "s").stderr
