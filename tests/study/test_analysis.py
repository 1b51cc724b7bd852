"""What counts, what is compared, and what a report of a study holds; all ratings in here are invented."""

import csv
import math
from dataclasses import replace

import pytest
from trial import QUALITY, invented

from command_line import ovita
from ovita.bench.records import read_ratings
from ovita.bench.tables import signed_rank
from ovita.study.analysis import analyse, compare, means, screen
from ovita.study.answers import StudyEvent, note
from ovita.study.questions import ASKED
from ovita.study.ratings import Rating, answers_csv, read_answers
from ovita.study.report import PILOT, write_study_report

ONE = Rating("p1", "", "rate", "s1", "A", True, "correctness", 4.0, 1, 5.0, "", False)


@pytest.fixture(scope="module")
def whole():
    """Twelve invented people, one of whom does not attend."""
    return analyse(invented(12, 3, careless=("p03",)))


@pytest.fixture(scope="module")
def report(whole, tmp_path_factory):
    """The report of these, as a folder."""
    folder = tmp_path_factory.mktemp("study") / "report"
    write_study_report(folder, "A study", whole)
    return folder


@pytest.mark.parametrize(
    ("ratings", "reasons"),
    [
        ([ONE, replace(ONE, pilot=True)], ["", "pilot"]),
        ([replace(ONE, pilot=True)], [""]),
        ([ONE, replace(ONE, question="attention", value=0.0)], ["attention"] * 2),
        ([ONE, *(replace(ONE, question="attention", value=v, position=int(v)) for v in (0.0, 1.0))], ["attention"] * 3),
        ([replace(ONE, question="attention", value=float(i > 0), position=i) for i in range(3)], [""] * 3),
        ([replace(ONE, adapter="p1"), replace(ONE, adapter="p2")], ["own", ""]),
        ([replace(ONE, phase="adapt", adapter="p1")], [""]),
        ([ONE, replace(ONE, value=2.0, position=9), replace(ONE, explanation=False)], ["repeated", "", ""]),
        ([ONE, replace(ONE, participant="p2", question="attention", value=0.0)], ["", "attention"]),
    ],
)  # fmt: skip
def test_what_does_not_count_is_left_out_for_a_reason(ratings, reasons):
    assert list(screen(ratings).reasons) == reasons


def test_people_are_the_unit():
    given = (("p1", "A", (1, 1, 1, 5)), ("p1", "B", (2,)), ("p2", "A", (3,)), ("p2", "B", (5,)))
    ratings = [replace(ONE, participant=who, condition=condition, item=f"s{i}", value=v)
               for who, condition, values in given for i, v in enumerate(values)]  # fmt: skip
    table = means(ratings, lambda r: r.condition)
    assert table == {"A": {"p1": 2.0, "p2": 3.0}, "B": {"p1": 2.0, "p2": 5.0}}
    (contrast,) = compare("correctness", "condition", table)
    expected = signed_rank([2.0, 3.0], [2.0, 5.0])
    assert (contrast.n, contrast.test, contrast.p, contrast.effect) == (2, "Wilcoxon", expected.p, expected.effect)
    assert contrast.difference.value == 1.0
    (mine,) = [s for s in analyse(ratings).summaries if s.condition == "A"]
    assert (mine.mean.value, mine.mean.n, mine.ratings.n) == (2.5, 2, 5)
    assert mine.success.value == pytest.approx(0.125) and mine.ratings.rate == pytest.approx(0.2)


def test_groups_of_different_people_are_compared_as_such():
    table = {"a": {f"p{i}": 1.0 + i / 10 for i in range(6)}, "b": {f"q{i}": 3.0 + i / 10 for i in range(6)}}
    (contrast,) = compare("correctness", "group", table)
    assert contrast.test == "Mann-Whitney" and contrast.n == 12 and contrast.effect == 1.0 and contrast.p < 0.01
    assert contrast.difference.low < 2.0 < contrast.difference.high
    assert compare("correctness", "group", {"a": {"p": 1.0}, "b": {"q": 2.0}}) == []


def test_an_invented_effect_is_found_and_corrected(whole):
    pairs = [c for c in whole.contrasts if c.factor == "condition" and c.question == "correctness"]
    assert len(pairs) == 3 and all(c.n == 11 and c.p <= c.holm < 0.05 and c.effect > 0.6 for c in pairs)
    assert all(test.k == 3 and test.w > 0.8 for _, test in whole.omnibus)
    (shown,) = [c for c in whole.contrasts if (c.factor, c.question) == ("explanation", "interpretability")]
    assert (shown.a, shown.b) == ("with", "without") and shown.effect < -0.5
    names = whole.preferred.strengths.names
    assert max(zip(whole.preferred.worth, names, strict=True), key=lambda x: x[0].value)[1] == "builtin"
    assert {s.instrument for s in whole.scores} >= {"UMUX-Lite", "raw TLX", "TLX effort"}


def test_phases_are_compared_on_the_same_conditions_only(whole):
    (phases,) = [c for c in whole.contrasts if c.factor == "phase"]
    rated = next(s for s in whole.summaries if (s.condition, s.phase, s.group) == ("builtin", "rate", "all"))
    adapted = next(s for s in whole.summaries if (s.phase, s.group) == ("adapt", "all"))
    assert phases.difference.value == pytest.approx(rated.mean.value - adapted.mean.value)


def test_people_are_judged_by_others():
    ratings = [replace(ONE, phase="adapt", participant="p2", value=5.0)]
    ratings += [
        replace(ONE, participant=who, adapter="p2", value=v) for who, v in (("p1", 2.0), ("p3", 4.0), ("p2", 5.0))
    ]
    (adapter,) = analyse(ratings).adapters
    assert (adapter.participant, adapter.own, adapter.others.value, adapter.others.n) == ("p2", 5.0, 3.0, 2)


def test_a_trial_says_so_everywhere(report):
    page = (report / "analysis.md").read_text()
    tables = page.count("|---|")
    assert tables and page.count(f"**{PILOT}**") >= len([p for p in page.split("\n## ") if "|---|" in p])
    assert all(PILOT in part for part in page.split("\n## ")[1:] if "|---|" in part or "![" in part)
    assert PILOT in (report / "codebook.md").read_text() and "(pilot)" in page.splitlines()[0]
    assert set(read_ratings(report / "interpretability.csv")) == {f"{name} (pilot)" for name in QUALITY}
    with open(report / "summary.csv", newline="") as stream:
        assert {row["pilot"] for row in csv.DictReader(stream)} == {"1"}


def test_every_part_of_the_figure_bears_the_watermark(whole):
    from ovita.study.figures import study_panel

    marked = study_panel(whole, PILOT)
    assert all("PILOT" in {t.get_text() for t in axes.texts} for axes in marked.axes)
    plain = study_panel(analyse(invented(4, 2, pilot=False)))
    assert not any("PILOT" in t.get_text() for axes in plain.axes for t in axes.texts)


def test_real_ratings_bear_no_mark(tmp_path):
    write_study_report(tmp_path, "A study", analyse(invented(4, 2, pilot=False)), figures=False)
    assert "pilot" not in (tmp_path / "analysis.md").read_text().lower().split("## method")[0].replace("trial", "")
    assert set(read_ratings(tmp_path / "interpretability.csv")) == set(QUALITY)


def test_the_long_file_holds_all_and_says_what_is_left_out(report, whole):
    assert read_answers(report / "ratings.csv") == whole.screened.ratings
    with open(report / "ratings.csv", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert {row["left_out"] for row in rows if row["participant"] == "p03"} == {"attention"}
    assert sum(row["left_out"] == "" for row in rows) == len(whole.screened.kept)
    columns = set(rows[0])
    said = (report / "codebook.md").read_text()
    assert all(f"| {name} |" in said for name in columns | {r["question"] for r in rows})


def test_the_same_ratings_give_the_same_files(report, tmp_path):
    again = write_study_report(tmp_path, "A study", analyse(invented(12, 3, careless=("p03",))), figures=False)
    for file in again:
        if file.name != "analysis.md":
            assert file.read_bytes() == (report / file.name).read_bytes(), file.name
    text = (report / "analysis.md").read_text()
    assert text.split("## Figures")[0] == (tmp_path / "analysis.md").read_text().split("## Method")[0]


def test_the_command_reports_a_file_or_says_why_not(tmp_path):
    file = tmp_path / "ratings.csv"
    file.write_text(answers_csv(invented(4, 2)))
    done = ovita("study", "report", file, "--no-figures")
    assert done.returncode == 0 and "of 4 people count" in done.stdout and PILOT in done.stdout
    assert (tmp_path / "report" / "clmm.R").is_file() and (tmp_path / "report" / "analysis.md").is_file()
    file.write_text(answers_csv([replace(ONE, question="attention", value=0.0)]))
    none = ovita("study", "report", file, "--no-figures")
    assert none.returncode == 2 and "not one answer counts (1 were given by someone who failed" in none.stderr
    assert "there is no such file" in ovita("study", "report", tmp_path / "nothing.csv").stderr


def test_what_people_answered_on_the_pages_is_analysed(make_study):
    study = make_study(participants=6)
    for person in study.participants.values():
        note(study, person, StudyEvent("consent", "2026-01-01T10:00:00Z"))
        for i, page in enumerate(person.pages):
            asked = {q.name: q.low + (i + len(page.conditions[0])) % (q.high - q.low + 1) if page.conditions else q.high
                     for q in ASKED.get(page.kind, ())}  # fmt: skip
            values = {"attention": page.expected} if page.kind == "attention" else asked
            values |= {"preference": "left"} if page.kind == "preference" else {}
            note(study, person, StudyEvent("answer", "2026-01-01T10:00:00Z", page.id, values, 9.0))
    done = ovita("study", "report", study.path, "--no-figures")
    assert done.returncode == 0 and "of 6 people count, 0 are left out" in done.stdout and PILOT in done.stdout
    page = (study.path / "report" / "analysis.md").read_text()
    assert page.startswith(f"# {study.design.title} (pilot)")
    assert (
        all(f"| {name} |" in page for name in study.founded.names) and "| UMUX-Lite |" in page and "| raw TLX |" in page
    )
    assert "Strength by preference" in page and "With and without the explanation" in page


def test_planning(tmp_path):
    said = ovita("study", "plan", "--effect", "0.8", "--dropout", "0.1", "--people", "12").stdout
    needed = int(said.split("power of 80%: ")[1].split()[0])
    assert abs(needed - 15) <= 1 and f"lost: {math.ceil(needed / 0.9)}" in said and "(yours)" in said
    assert (
        ovita("study", "plan", "--difference", "0.4", "--deviation", "0.5").stdout
        == ovita("study", "plan", "--effect", "0.8").stdout
    )
    assert "belong together" in ovita("study", "plan", "--difference", "0.4").stderr
    assert "more than 2000 people" in ovita("study", "plan", "--effect", "0.01").stderr
