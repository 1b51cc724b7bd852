"""A run is complete, resumable after any interruption, replayable without a writer, and says what it left out."""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import bench_writers
import pytest

from ovita.bench import systems, tables
from ovita.bench.dataset import load_dataset, natural
from ovita.bench.evaluate import BY_SUBSET, DEFAULT, Protocol, conditions_from, robot_for
from ovita.bench.generate import generate, write_dataset
from ovita.bench.records import RecordLog, read_records
from ovita.bench.report import outcome_table
from ovita.bench.runner import RunPlan, run
from ovita.errors import FormatError, RequestError
from ovita.toolkit import CATALOGUE

PLAN = RunPlan(jobs=1)


def toys(dataset, **options):
    return load_dataset(dataset, **options)


def asked(name):
    return replace(PLAN, writers=(f"python:bench_writers:{name}",), retries=0)


def passes(records):
    return {(r.writer, r.condition, r.sample): r.last.passed for r in records}


def test_a_run_judges_every_sample_and_says_why(dataset, tmp_path):
    seen = []
    done = run(toys(dataset), tmp_path / "out", PLAN, progress=seen.append)
    by_id = {r.sample: r for r in done.records}
    assert {k: r.last.passed for k, r in by_id.items()} == {
        "a/s_0": True, "a/s_1": True, "a/s_2": True, "b/s_3": True, "b/s_4": False, "b/s_5": True,
    }  # fmt: skip
    lost = by_id["b/s_4"].last
    assert (
        lost.status in ("not_understood", "needs_clarification")
        and not lost.executable
        and "Please" in lost.sentence
        and lost.score == 0.0
    )
    good = by_id["a/s_2"].last
    assert good.limits == "satisfied" and good.score == 1.0 and good.proposed_passed and good.code and good.ms > 0
    assert len(good.replies) == 1 and not by_id["a/s_2"].idle
    assert [(s.done, s.total) for s in seen] == [(i, 6) for i in range(1, 7)]
    assert seen[-1].left_s == 0.0 and seen[-1].passed == 5


def test_first_answers_are_right_right_after_one_yes_asked_declined_flagged_or_silently_wrong(dataset, tmp_path):
    certain = {r.sample: r for r in run(toys(dataset), tmp_path / "a", PLAN).records}
    unsure = {r.sample: r for r in run(toys(dataset), tmp_path / "b", asked("Unsure")).records}
    lefty = {r.sample: r for r in run(toys(dataset), tmp_path / "c", asked("Lefty")).records}
    assert certain["a/s_0"].outcome == "right" and certain["b/s_4"].outcome in ("asked", "declined")
    right = [name for name, r in lefty.items() if r.outcome == "right"]
    assert 0 < len(right) < 6
    assert {r.outcome for r in lefty.values()} == {"right", "silently wrong"}
    assert {name: r.outcome for name, r in unsure.items()} == {
        name: "right after one yes" if name in right else "asked" for name in unsure
    }
    assert all(r.first.status == "needs_confirmation" and r.first.code for r in unsure.values())
    flagged = replace(lefty["b/s_4"], rounds=(replace(lefty["b/s_4"].first, flagged=True, passed=False),))
    assert flagged.outcome == "flagged"
    (tally,) = tables.tallies(list(unsure.values()))
    assert tally.outcomes["right after one yes"] == len(right) and sum(tally.outcomes.values()) == 6
    assert "right after one yes" in outcome_table(list(unsure.values()))[0]


def test_what_is_recorded_is_not_asked_again(dataset, tmp_path):
    plan, out = asked("Lefty"), tmp_path / "out"
    first = run(toys(dataset, limit=3), out, plan)
    assert len(bench_writers.Lefty.prompts) == 3
    again = run(toys(dataset), out, plan)
    assert len(bench_writers.Lefty.prompts) == 6 and len(again.records) == 6
    assert set(passes(first.records).items()) <= set(passes(again.records).items())
    run(toys(dataset), out, plan)
    assert len(bench_writers.Lefty.prompts) == 6


def test_a_torn_last_line_costs_one_sample(dataset, tmp_path):
    plan, out = asked("Lefty"), tmp_path / "out"
    whole = run(toys(dataset), out, plan)
    log = out / "records.jsonl"
    log.write_bytes(log.read_bytes()[:-100])
    assert len(read_records(out)) == 5
    mended = run(toys(dataset), out, plan)
    assert len(bench_writers.Lefty.prompts) == 7
    assert passes(mended.records) == passes(whole.records)
    assert log.read_bytes().endswith(b"\n")


def test_a_changed_sample_is_run_again(dataset, tmp_path):
    plan, out = asked("Lefty"), tmp_path / "out"
    run(toys(dataset), out, plan)
    file = dataset / "a" / "s_2.json"
    file.write_text(json.dumps({**json.loads(file.read_text()), "instruction": "go right by 0.1 please"}))
    done = run(toys(dataset), out, plan)
    assert len(bench_writers.Lefty.prompts) == 7
    assert {r.instruction for r in done.records if r.sample == "a/s_2"} == {"go right by 0.1 please"}


def test_a_line_that_is_no_record_is_named(dataset, tmp_path):
    out = tmp_path / "out"
    run(toys(dataset, limit=1), out, PLAN)
    with open(out / "records.jsonl", "a") as stream:
        stream.write("{}\n")
    with pytest.raises(FormatError, match="line 2 is no record"):
        read_records(out)
    with pytest.raises(FormatError, match=r"holds no records\.jsonl"):
        read_records(tmp_path)


def test_two_runs_cannot_write_to_one_folder(dataset, tmp_path):
    pytest.importorskip("fcntl")
    with RecordLog(tmp_path / "out"), pytest.raises(RequestError, match="another run writes there"):
        run(toys(dataset), tmp_path / "out", PLAN)


def test_a_folder_keeps_to_one_protocol(dataset, tmp_path):
    run(toys(dataset, limit=1), tmp_path / "out", PLAN)
    with pytest.raises(RequestError, match="feedback = 0, not 2"):
        run(toys(dataset), tmp_path / "out", replace(PLAN, protocol=Protocol(feedback=2)))


@pytest.mark.parametrize("on", ["original", "current"])
def test_feedback_is_the_failed_checks_sentence(dataset, tmp_path, on):
    plan = replace(asked("Learner"), protocol=Protocol(feedback=2, feedback_on=on))
    done = run(toys(dataset, limit=1), tmp_path / "out", plan)
    (record,) = done.records
    assert [r.passed for r in record.rounds] == [False, True]
    assert record.rounds[1].said == record.rounds[0].sentence
    second = bench_writers.Learner.prompts[1].request
    assert [turn.instruction for turn in second.history] == ["go left by 0.2"]
    assert second.instruction.startswith("Please move" if on == "current" else "go left by 0.2. Please move")


def test_feedback_that_is_not_understood_leaves_the_answer_that_was_there(dataset, tmp_path):
    file = dataset / "a" / "s_0.json"
    wide = {"kind": "all_of", "children": [{"kind": "moved", "arguments": {"left": 0.2}}, {"kind": "fewer_waypoints"}]}
    file.write_text(json.dumps({**json.loads(file.read_text()), "check": wide}))
    plan = replace(PLAN, protocol=Protocol(feedback=1, feedback_on="original"))
    (record,) = run(toys(dataset, limit=1), tmp_path / "out", plan).records
    kept = [r for r in record.rounds if r.executable][-1]
    assert record.first.executable and record.last == kept and record.first.score == 0.5


def test_repairs_count_as_attempts_and_can_be_switched_off(dataset, tmp_path):
    plan = replace(asked("Crasher"), conditions=conditions_from("repair"))
    done = run(toys(dataset, limit=1), tmp_path / "out", plan)
    usual, without = done.records
    assert (usual.condition, usual.first.attempts, usual.first.executable) == ("default", 2, True)
    assert (without.condition, without.first.attempts, without.first.executable) == ("no repair", 1, False)
    assert usual.first.input_tokens == 200 and usual.tokens == 220 and without.first.error


def test_ablations_change_the_prompt(dataset, tmp_path):
    plan = replace(
        asked("Lefty"), conditions=conditions_from("examples,toolkit,grounding,constraints,temperature=0,0.7")
    )
    done = run(toys(dataset, limit=1), tmp_path / "out", plan)
    prompts = dict(zip([c.name for c in plan.conditions], bench_writers.Lefty.prompts, strict=True))
    usual = prompts["default"]
    assert "# Example 1" in usual.situation and "# Example" not in usual.fixed
    assert "# Example 2" in prompts["paper examples"].fixed and "# Example" not in prompts["paper examples"].situation
    assert not any("# Example" in part for part in (prompts["no examples"].fixed, prompts["no examples"].situation))
    assert "spiral(" in prompts["no examples"].fixed
    script = prompts["no toolkit"].fixed
    assert "modified_trajectory" in script and not any(f"{name}(" in script for name in CATALOGUE)
    assert "waypoints" in usual.situation and "waypoints" not in prompts["no grounding"].situation
    assert '"cup"' in prompts["no grounding"].situation
    assert prompts["temperature 0"] == usual
    assert {r.condition: r.last.limits for r in done.records}["no constraints"] == "off"


def test_unsupported_ablations_are_named():
    with pytest.raises(RequestError, match=r"'sandbox' cannot be switched off.*examples, toolkit"):
        conditions_from("sandbox")
    with pytest.raises(RequestError, match="out of range"):
        conditions_from("temperature=hot")
    with pytest.raises(RequestError, match="'seed' cannot"):
        conditions_from("seed=1")
    assert conditions_from("") == (DEFAULT,)
    assert [c.name for c in conditions_from("temperature=0,0.2,examples")] == [
        "default", "temperature 0", "temperature 0.2", "no examples", "paper examples",
    ]  # fmt: skip


def test_ablations_of_a_prompt_are_left_out_for_a_writer_that_reads_none(dataset, tmp_path):
    done = run(toys(dataset, limit=1), tmp_path / "out", replace(PLAN, conditions=conditions_from("examples,repair")))
    assert [r.condition for r in done.records] == ["default", "no repair"]
    assert done.notes == tuple(
        f"{name}: makes no difference to builtin, which reads no prompt; left out."
        for name in ("no examples", "paper examples")
    )


def test_failures_in_transport_are_sent_again(dataset, tmp_path, monkeypatch):
    monkeypatch.setattr(systems.time, "sleep", lambda seconds: None)
    done = run(toys(dataset, limit=2), tmp_path / "out", replace(asked("Flaky"), retries=1))
    assert [r.last.executable for r in done.records] == [True, True]
    assert len(bench_writers.Flaky.prompts) == 4


def test_a_writer_that_cannot_be_reached_is_given_up_and_tried_again_later(dataset, tmp_path):
    done = run(toys(dataset), tmp_path / "out", asked("Down"))
    assert len(done.records) == 6 or len(done.records) == 5
    assert all(r.unreached and not r.last.passed for r in done.records)
    assert "could not be reached 5 times in a row" in done.notes[0] and "SOME_KEY" in done.notes[0]
    before = len(bench_writers.Down.prompts)
    run(toys(dataset), tmp_path / "out", asked("Down"))
    assert len(bench_writers.Down.prompts) > before


def test_an_unusable_answer_is_the_writers_own_failure(dataset, tmp_path):
    done = run(toys(dataset), tmp_path / "out", asked("Confused"))
    assert len(done.records) == 6 and not any(r.unreached for r in done.records) and not done.notes
    assert {r.last.status for r in done.records} == {"failed"}
    run(toys(dataset), tmp_path / "out", asked("Confused"))
    assert len(bench_writers.Confused.prompts) == 6


def test_a_budget_ends_the_run_early_and_says_so(dataset, tmp_path):
    done = run(toys(dataset), tmp_path / "out", replace(asked("Lefty"), budget_tokens=150))
    assert 2 <= len(done.records) < 6 and "budget of 150 tokens is used up" in done.notes[0]
    name = "python:bench_writers:Lefty"
    rich = run(toys(dataset), tmp_path / "rich", replace(asked("Lefty"), prices={name: (1e4, 1e4)}, budget_cost=2.0))
    assert 2 <= len(rich.records) < 6 and "budget of 2 is used up" in rich.notes[0]


def test_a_limiter_spaces_requests(monkeypatch):
    slept = []
    monkeypatch.setattr(systems.time, "sleep", slept.append)
    limiter = systems.Limiter(60)
    for _ in range(3):
        limiter.wait()
    assert slept[0] == 0 and slept[1] == pytest.approx(1, abs=0.1) and slept[2] == pytest.approx(2, abs=0.1)


@pytest.mark.parametrize("name", ["Learner", "Crasher", "Confused"])
def test_a_replay_asks_nobody_and_ends_the_same(dataset, tmp_path, name):
    plan = replace(asked(name), protocol=Protocol(feedback=1), conditions=conditions_from("repair"))
    done = run(toys(dataset, limit=3), tmp_path / "out", plan)
    count = len(getattr(bench_writers, name).prompts)
    again = run(toys(dataset, limit=3), tmp_path / "again", plan, replay=tmp_path / "out")
    assert again.records == done.records and len(getattr(bench_writers, name).prompts) == count


def test_a_replay_is_scored_by_todays_check(dataset, tmp_path):
    run(toys(dataset), tmp_path / "out", asked("Lefty"))
    file = dataset / "a" / "s_0.json"
    strict = {"kind": "moved", "arguments": {"left": 0.5}}
    file.write_text(json.dumps({**json.loads(file.read_text()), "check": strict}))
    again = run(toys(dataset), tmp_path / "again", PLAN, replay=tmp_path / "out")
    assert {r.sample: r.last.passed for r in again.records}["a/s_0"] is False
    with pytest.raises(RequestError, match="none of this dataset's samples"):
        write_dataset(tmp_path / "other", generate(2))
        run(load_dataset(tmp_path / "other"), tmp_path / "third", PLAN, replay=tmp_path / "out")


def test_wrong_writers_are_named(dataset, tmp_path):
    for name, problem in (
        ("nosuch", "unknown writer"),
        ("python:nosuchmodule:X", "makes no writer"),
        ("python:bench_writers:NOT_A_WRITER", "needs a name and a method"),
    ):
        with pytest.raises(RequestError, match=problem):
            run(toys(dataset), tmp_path / "out", replace(PLAN, writers=(name,)))


def test_samples_that_cannot_be_judged_are_refused(dataset, tmp_path):
    file = dataset / "a" / "s_1.json"
    good = json.loads(file.read_text())
    for check, problem in (
        ({"kind": "closer", "arguments": {"place": "walrus"}}, "walrus"),
        ({"kind": "levitates"}, "unknown check"),
    ):
        file.write_text(json.dumps({**good, "check": check}))
        with pytest.raises(FormatError, match=problem):
            load_dataset(dataset)
    file.write_text(json.dumps({**good, "instruction": " "}))
    with pytest.raises(FormatError, match="needs an instruction"):
        load_dataset(dataset)
    with pytest.raises(RequestError, match="no such folder"):
        load_dataset(tmp_path / "nowhere")
    (tmp_path / "plain").mkdir()
    (tmp_path / "plain" / "x.json").write_text("{}")
    with pytest.raises(RequestError, match="none of its 1"):
        load_dataset(tmp_path / "plain")


def test_a_limit_is_spread_and_order_is_natural(dataset):
    assert [s.id for s in load_dataset(dataset, limit=2).samples] == ["a/s_0", "b/s_3"]
    assert sorted(["s_10", "s_9"], key=natural) == ["s_9", "s_10"]
    assert load_dataset(dataset).digest == load_dataset(dataset).digest != load_dataset(dataset, limit=2).digest


def test_robots_by_subset(dataset):
    sample = toys(dataset).samples[0]
    assert robot_for(sample, None).name == "none"
    assert robot_for(replace(sample, subset="robot_subset/Ground_robot"), BY_SUBSET).name == "ground"
    assert robot_for(replace(sample, subset="arm"), BY_SUBSET).name == "arm"
    assert robot_for(replace(sample, subset="latte"), BY_SUBSET).name == "none"


def descendants(pid):
    """Process ids of all living descendants, from /proc."""
    parents = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                parents[int(entry.name)] = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
            except (OSError, IndexError):
                continue
    found, new = set(), {pid}
    while new:
        new = {child for child, parent in parents.items() if parent in new} - found
        found |= new
    return found


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc to see what a killed run leaves behind")
def test_a_run_killed_half_way_goes_on_and_ends_with_the_same_table(tmp_path):
    data, out = tmp_path / "data", tmp_path / "out"
    write_dataset(data, generate(12, seed=5))
    code = "from ovita.cli.bench_ import group; group()"
    command = [sys.executable, "-c", code, "run", str(data), "--out", str(out), "--jobs", "2", "--no-figures"]
    with open(tmp_path / "log", "w") as log:
        process = subprocess.Popen(command, stdout=log, stderr=log)
        deadline = time.monotonic() + 300
        while time.monotonic() < deadline and process.poll() is None:
            if (out / "records.jsonl").exists() and (out / "records.jsonl").read_bytes().count(b"\n") >= 2:
                break
            time.sleep(0.01)
        children = descendants(process.pid)
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
    before = len(read_records(out))
    assert 2 <= before < 12, (tmp_path / "log").read_text()
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and any(Path(f"/proc/{pid}").exists() for pid in children):
        time.sleep(0.05)
    assert not [pid for pid in children if Path(f"/proc/{pid}").exists()], "a killed run left processes behind"
    seen = []
    run(load_dataset(data), out, PLAN, progress=seen.append)
    assert len(seen) == 12 - before and seen[-1].done == seen[-1].total == 12
    whole = run(load_dataset(data), tmp_path / "whole", PLAN)
    assert passes(read_records(out)) == passes(whole.records)
