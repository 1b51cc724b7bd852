"""Reports hold the numbers of the records, are the same for the same records, and never let data become markup."""

import csv
import json
import re
from xml.etree import ElementTree

import pytest
from click.testing import CliRunner

from ovita.bench import tables
from ovita.bench.dataset import load_dataset
from ovita.bench.page import sketch
from ovita.bench.records import read_manifest, read_ratings, read_records
from ovita.bench.report import write_report
from ovita.bench.runner import RunPlan, run
from ovita.cli.bench_ import group
from ovita.errors import FormatError, MissingExtra, RequestError

EVIL = "<script>alert('x')</script> | **$a$** ![i](j)"
LEARNER = "python:bench_writers:Learner"


def test_lines_count_what_passed(outcome):
    by = {(x.writer, x.condition): x for x in tables.tallies(outcome.records)}
    mine = by["builtin", "default"]
    assert (mine.success.successes, mine.success.n, mine.first.successes) == (5, 6, 5)
    assert mine.executable.rate == pytest.approx(5 / 6) and mine.limits == {"none": 1, "satisfied": 5}
    learner = by[LEARNER, "default"]
    assert learner.first.successes == 0 and learner.success.successes == 3
    assert learner.input_tokens == 1200 and learner.output_tokens == 120
    assert {
        (x.group, x.success.successes) for x in tables.tallies(outcome.records, "subset") if x.writer == "builtin"
    } == {
        ("a", 3),
        ("b", 2),
    }
    (priced,) = [
        x for x in tables.tallies(outcome.records, prices={LEARNER: (1.0, 10.0)}) if x.condition == "no examples"
    ]
    assert priced.cost == pytest.approx(1200e-6 + 1200e-6)
    assert tables.idle(outcome.records).successes == 0


def test_feedback_and_pairs_are_compared(outcome):
    assert [x.successes for x in tables.rounds(tables.by_column(outcome.records)[LEARNER, "default"])] == [0, 3]
    found = {(c.what, c.a, c.b): c.paired for c in tables.comparisons(outcome.records)}
    writers = found["success", "builtin", LEARNER]
    assert (writers.n, writers.changed, writers.better) == (6, 4, 1)
    assert found["success", LEARNER, f"{LEARNER}, with feedback"].better == 3
    assert ("success", LEARNER, f"{LEARNER}, no examples") in found
    assert ("time", "builtin", LEARNER) in found and ("time", LEARNER, f"{LEARNER}, no examples") not in found


def test_the_same_records_give_the_same_files(outcome, tmp_path):
    first = write_report(tmp_path / "x", outcome.records, outcome.manifest)
    second = write_report(tmp_path / "y", outcome.records, outcome.manifest)
    assert [p.name for p in first] == [p.name for p in second]
    assert {"report.md", "report.html", "records.csv", "summary.csv", "panel.png", "panel.svg"} == {
        p.name for p in first
    }
    for a, b in zip(first, second, strict=True):
        assert a.read_bytes() == b.read_bytes(), a.name


def test_the_report_has_the_tables_and_csv_can_be_read(outcome, tmp_path):
    write_report(tmp_path, outcome.records, outcome.manifest, notes=["Something was left out."], figures=False)
    text = (tmp_path / "report.md").read_text()
    assert "> Something was left out." in text and "| builtin | 83.3% | 43.6% to 97.0% | 6 |" in text
    assert "doing nothing | 0.0%" in text and "McNemar" in text and "panel.svg" not in text
    with open(tmp_path / "records.csv", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == len(outcome.records) and json.loads(rows[0]["check"])["kind"]
    with open(tmp_path / "summary.csv", newline="") as stream:
        assert {row["by"] for row in csv.DictReader(stream)} == {"all", "subset", "kind"}


def test_data_never_becomes_markup(dataset, tmp_path):
    file = dataset / "a" / "s_0.json"
    document = json.loads(file.read_text())
    document["objects"][0]["name"] = EVIL
    document |= {"instruction": EVIL, "kind": EVIL, "subset": EVIL}
    file.write_text(json.dumps(document))
    done = run(load_dataset(dataset, limit=2), tmp_path / "run", RunPlan(jobs=1))
    write_report(tmp_path / "run", done.records, done.manifest, notes=[EVIL], figures=False)
    page = (tmp_path / "run" / "report.html").read_text()
    assert "<script" not in page and "&lt;script&gt;" in page
    assert "default-src 'none'" in page and not re.search(r"(src|href)=[\"']https?:", page)
    table = next(line for line in (tmp_path / "run" / "report.md").read_text().splitlines() if "alert" in line)
    assert "<script" not in table


def test_every_sample_can_be_looked_into(outcome, tmp_path):
    write_report(tmp_path, outcome.records, outcome.manifest, figures=False)
    page = (tmp_path / "report.html").read_text()
    for record in outcome.records:
        assert record.sample in page
    assert page.count('aria-label="path before and after"') == sum(len(r.rounds) for r in outcome.records)
    assert "def adapt(traj, scene" in page and "moved(left=0.2)" in page and "feedback 1: Please" in page


def test_a_sketch_is_well_formed_for_any_path(outcome):
    record = outcome.records[0]
    still = ((0.0, 0.0, 0.0, 0.0),) * 3
    for adapted in (record.last.adapted, (), still):
        for frame in ("rfu", "ned", "nonsense"):
            root = ElementTree.fromstring(sketch(still, adapted, {**record.scene, "frame": frame}))
            assert root.tag.endswith("svg")
    assert "nan" not in sketch(still, still, {"objects": []})


def test_the_panel_says_how_to_run_what_is_missing(outcome, tmp_path):
    figures = pytest.importorskip("ovita.bench.figures")
    only = [r for r in outcome.records if r.writer == "builtin" and r.condition == "default"]
    texts = [t.get_text() for axes in figures.panel(only).axes for t in axes.texts]
    assert any("--ablate examples" in t for t in texts) and any("ratings.csv" in t for t in texts)
    full = figures.panel(outcome.records, {"builtin": [4.0, 5.0]})
    said = " ".join(t.get_text() for axes in full.axes for t in axes.texts)
    assert "not run" not in said and "no ratings" not in said
    assert [axes.get_title(loc="left")[0] for axes in full.axes[:7]] == list("ABCDEFG")


def test_ratings_are_read_and_checked(tmp_path):
    assert read_ratings(tmp_path) == {}
    file = tmp_path / "ratings.csv"
    file.write_text("sample,writer,rating\na,builtin,4\nb,builtin,5\na,toy,3\n")
    assert read_ratings(tmp_path) == {"builtin": (4.0, 5.0), "toy": (3.0,)}
    file.write_text("sample,writer,rating\na,builtin,7\n")
    with pytest.raises(FormatError, match="line 2 is '7', expected a number from 1 to 5"):
        read_ratings(file)
    file.write_text("sample,rating\na,4\n")
    with pytest.raises(FormatError, match="writer"):
        read_ratings(file)


def test_parquet_is_written_or_the_extra_is_named(outcome, tmp_path, monkeypatch):
    from ovita.bench import report

    def missing(name):
        raise ImportError(name)

    monkeypatch.setattr(report, "import_module", missing)
    with pytest.raises(MissingExtra, match=r"ovita\[bench\]"):
        write_report(tmp_path, outcome.records, outcome.manifest, figures=False, parquet=True)


def test_parquet_holds_the_rows(outcome, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    write_report(tmp_path, outcome.records, outcome.manifest, figures=False, parquet=True)
    assert parquet.read_table(tmp_path / "records.parquet").num_rows == len(outcome.records)


def test_nothing_to_report_is_said(tmp_path):
    with pytest.raises(RequestError, match="no records"):
        write_report(tmp_path, (), {})


def invoke(*arguments):
    return CliRunner().invoke(group, [str(a) for a in arguments], catch_exceptions=False)


def test_the_command_runs_replays_and_reports_again(dataset, tmp_path):
    out, again = tmp_path / "out", tmp_path / "again"
    common = ["--jobs", 1, "--no-figures"]
    done = invoke("run", dataset, "--out", out, "--writer", LEARNER, "--feedback", 1, *common)
    assert done.exit_code == 0 and "6/6 done" in done.output and "50.0%" in done.output
    replayed = invoke("run", dataset, "--replay", out, "--out", again, *common)
    assert replayed.exit_code == 0
    for name in ("report.md", "report.html", "records.csv", "summary.csv"):
        assert (out / name).read_bytes() == (again / name).read_bytes(), name
    (out / "ratings.csv").write_text(f"sample,writer,rating\na,{LEARNER},4\n")
    assert "report.md" in invoke("report", out, "--no-figures", "--price", f"{LEARNER}=1,10").output
    text = (out / "report.md").read_text()
    assert "## Interpretability" in text and "cost" in text
    assert read_manifest(out)["dataset"] == "toys" and len(read_records(out)) == 6


def test_a_generated_dataset_can_be_run(tmp_path):
    assert "wrote 4 samples" in invoke("generate", "--out", tmp_path / "d", "--n", 4, "--split", "heldout").output
    done = invoke("run", tmp_path / "d", "--out", tmp_path / "r", "--jobs", 1, "--no-figures")
    assert done.exit_code == 0 and "4/4 done" in done.output


def test_bad_options_are_refused_in_a_sentence(dataset, tmp_path):
    with pytest.raises(RequestError, match="cannot be read; write --price"):
        invoke("run", dataset, "--out", tmp_path / "o", "--price", "openai:gpt-5=cheap")
    with pytest.raises(RequestError, match="another --out"):
        invoke("run", dataset, "--out", tmp_path / "o", "--replay", tmp_path / "o")
    invoke("run", dataset, "--out", tmp_path / "o", "--jobs", 1, "--no-figures", "--limit", 1)
    with pytest.raises(RequestError, match="choose another --out"):
        invoke("run", dataset, "--out", tmp_path / "o", "--feedback", 3)


def test_records_survive_the_file(outcome):
    assert read_records(outcome.folder) == list(outcome.records)
