"""Baselines run, are recorded, replayed and compared like writers."""

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ovita.baselines import encoder
from ovita.bench.dataset import load_dataset
from ovita.bench.evaluate import conditions_from
from ovita.bench.records import read_records
from ovita.bench.report import report_tables
from ovita.bench.runner import RunPlan, run
from ovita.errors import RequestError

PROGRAM = Path(__file__).parents[1] / "baselines" / "stand_in.py"
EXEC = f"exec:{sys.executable} '{PROGRAM}' lift"
SYSTEMS = ("builtin", "baseline:copy", "baseline:extract", "baseline:extract-ovita", EXEC)


@pytest.fixture
def words(monkeypatch):
    """An encoder by the words that two texts share, so that no package is needed."""

    def embed(texts):
        rows = np.zeros((len(texts), 512))
        for row, text in zip(rows, texts, strict=True):
            for word in text.lower().split():
                row[sum(word.encode()) % 512] = 1.0
        return rows / np.linalg.norm(rows, axis=1, keepdims=True)

    monkeypatch.setattr("ovita.baselines.extract.minilm", lambda: embed)


@pytest.fixture
def compared(dataset, tmp_path, words):
    plan = RunPlan(writers=SYSTEMS, jobs=1)
    done = run(load_dataset(dataset), tmp_path / "out", plan)
    return done.records, tmp_path / "out", plan


def test_all_systems_are_judged_by_the_same_checks(compared, dataset, tmp_path):
    records, folder, plan = compared
    passed = {name: {r.sample for r in records if r.writer == name and r.first.passed} for name in SYSTEMS}
    assert len(records) == 6 * len(SYSTEMS) and all(r.first.executable for r in records if r.writer != "builtin")
    assert passed["builtin"] == {"a/s_0", "a/s_1", "a/s_2", "b/s_3", "b/s_5"}
    assert passed["baseline:copy"] == set()
    # Three go left or right by an amount that ExTraCT cannot know: it moves by 0.3 m, or by up to 0.1 m.
    assert passed["baseline:extract"] <= passed["builtin"] and passed[EXEC] == {"b/s_3"}  # it lifts by 0.1 m
    up = next(r.first for r in records if (r.writer, r.sample) == ("baseline:extract", "b/s_3"))
    assert (up.matched, up.model, up.attempts, up.code) == ("move up", "baseline:extract", 1, "")
    assert 0.0 < up.similarity < 1.0 and not up.flagged and up.limits in ("satisfied", "repaired", "preexisting")
    ovita = [r.first for r in records if r.writer == "baseline:extract-ovita"]
    assert {x.limits for x in ovita} == {"off"} and {len(x.adapted) for x in ovita} == {100}
    again = run(load_dataset(dataset), tmp_path / "again", plan, replay=folder)
    assert again.records == records == tuple(read_records(folder))


def test_the_report_corrects_comparisons_and_shows_similarities(compared):
    found = dict(report_tables(compared[0]))
    heading = found["Comparisons"][0]
    rows = [dict(zip(heading, row, strict=True)) for row in found["Comparisons"][1:]]
    success = [row for row in rows if row["measure"] == "success"]
    assert len(success) == 10 and all(float(r["p (Holm)"]) >= float(r["p"]) for r in rows)
    assert max(float(r["p (Holm)"]) / float(r["p"]) for r in success if float(r["p (Holm)"]) < 1) <= 10.1
    likeness = {(row[0], row[1]): int(row[2]) for row in found["Similarity with what was matched"][1:]}
    assert sum(n for (name, _), n in likeness.items() if name == "baseline:extract") == 6


def test_only_the_ablation_of_limits_concerns_a_baseline(dataset, tmp_path, words):
    plan = RunPlan(writers=("baseline:extract",), conditions=conditions_from("repair,examples,constraints"), jobs=1)
    done = run(load_dataset(dataset, limit=1), tmp_path / "out", plan)
    assert [(r.condition, r.last.limits) for r in done.records][1] == ("no constraints", "off")
    assert [r.condition for r in done.records] == ["default", "no constraints"]


def test_a_program_that_fails_is_a_failure_and_one_that_is_missing_is_asked_again(dataset, tmp_path):
    crash = RunPlan(writers=(EXEC.replace(" lift", " crash"), "exec:/no/such/program"), jobs=1)
    records = run(load_dataset(dataset, limit=2), tmp_path / "out", crash).records
    unreached = {writer: [r.unreached for r in records if r.writer == writer] for writer in crash.writers}
    assert unreached == {crash.writers[0]: [False, False], crash.writers[1]: [True, True]}
    assert all(not r.first.executable and r.outcome == "declined" for r in records)
    replay = run(load_dataset(dataset, limit=2), tmp_path / "again", crash, replay=tmp_path / "out")
    assert replay.records == records


def test_what_cannot_be_used_is_said_before_anything_runs(dataset, tmp_path, monkeypatch):
    plan = RunPlan(writers=("baseline:latte",), jobs=1)
    with pytest.raises(RequestError, match="there is no baseline 'baseline:latte'"):
        run(load_dataset(dataset), tmp_path / "out", plan)
    encoder.minilm.cache_clear()
    monkeypatch.setattr(encoder, "find_spec", lambda name: None)
    with pytest.raises(Exception, match=r"pip install 'ovita\[baselines\]'"):
        run(load_dataset(dataset), tmp_path / "out", replace(plan, writers=("baseline:extract",)))
    assert json.loads((tmp_path / "out" / "run.json").read_text())["samples"] == 6
