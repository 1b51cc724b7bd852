"""The report of a study: ratings and codebook, the analysis in Markdown, figures, and an R script."""

from __future__ import annotations

import math
import os
from collections import defaultdict
from collections.abc import Iterable, Sequence
from importlib.resources import files
from pathlib import Path

from ovita.bench.report import Table, cell, csv_text, pipes
from ovita.errors import MissingExtra, RequestError
from ovita.io import atomic_write
from ovita.io.files import make_folder
from ovita.study.analysis import LEFT_OUT, Analysis, Screened, people_by_group
from ovita.study.ratings import COLUMNS, LIKERT, written_row
from ovita.study.statistics import Estimate

PILOT = "PILOT: a trial of the study, not data"
"""Stands over every table and across every figure of a trial."""

PILOT_MARK = " (pilot)"
"""Follows a system's name wherever ratings of a trial leave the report."""

RATINGS, CODEBOOK, ANALYSIS, SCRIPT = "ratings.csv", "codebook.md", "analysis.md", "clmm.R"
FOR_BENCH = "interpretability.csv"


def write_study_report(
    folder: str | os.PathLike[str], title: str, found: Analysis, *, figures: bool = True
) -> list[Path]:
    """Write the report's files, and return them.

    The same ratings give the same files: ratings.csv (all, with why one is left out), codebook.md, analysis.md,
    summary.csv, clmm.R, interpretability.csv (what `ovita bench report --ratings` reads), figures.svg and figures.png.

    Raises:
        RequestError: If there is not one rating that counts.
        FormatError: If a file cannot be written.
    """
    if not found.screened.kept:
        raise RequestError("there is nothing to report: not one answer counts" + _why_none(found.screened))
    content: dict[str, str | bytes] = {}
    notes = [PILOT + "; nothing in here may be reported as a result"] if found.pilot else []
    if figures:
        try:
            from ovita.study.figures import image, study_panel

            panel = study_panel(found, PILOT if found.pilot else "")
            content = {f"figures.{kind}": image(panel, kind) for kind in ("svg", "png")}
        except MissingExtra as missing:
            notes.append(f"No figures: {missing}")
    content[RATINGS] = _long(found.screened)
    content[CODEBOOK] = codebook(found)
    content[ANALYSIS] = analysis_page(title, found, notes, figures=figures and "figures.svg" in content)
    content["summary.csv"] = _summary_csv(found)
    content[SCRIPT] = (files("ovita.study") / SCRIPT).read_text(encoding="utf-8")
    content[FOR_BENCH] = _for_bench(found)
    out = make_folder(folder)
    for name, data in content.items():
        atomic_write(out / name, data)
    return [out / name for name in content]


def analysis_page(title: str, found: Analysis, notes: Sequence[str] = (), *, figures: bool = True) -> str:
    """The analysis as Markdown; in a trial, every table says so."""
    parts = [f"# {cell(title)}{PILOT_MARK if found.pilot else ''}", *(f"> {cell(note)}" for note in notes)]
    for heading, rows, explained in _sections(found):
        if len(rows) > 1:
            parts += [f"## {heading}", *([f"**{PILOT}**"] if found.pilot else []), pipes(rows)]
            parts += [explained] if explained else []
    if figures:
        parts += ["## Figures", *([f"**{PILOT}**"] if found.pilot else []), "![Figures](figures.svg)"]
    parts += ["## Method", _METHOD]
    return "\n\n".join(parts) + "\n"


def codebook(found: Analysis) -> str:
    """What each column and each question of the ratings means, with how often each was answered."""
    rows = [["column", "meaning"], *([name, _MEANING[name]] for name in COLUMNS)]
    rows.append(["left_out", "why the rating does not count: " + "; ".join(f"{k}: {v}" for k, v in LEFT_OUT.items())])
    asked: dict[str, list[float | str]] = defaultdict(list)
    for r in found.screened.ratings:
        asked[r.question].append(r.value)
    questions = [["question", "answers", "smallest", "largest", "meaning"]]
    questions += [_described(question, values) for question, values in sorted(asked.items())]
    mark = [f"> {PILOT}"] if found.pilot else []
    return "\n\n".join(["# Codebook of ratings.csv", *mark, pipes(rows), "## Questions", pipes(questions)]) + "\n"


def _described(question: str, values: Sequence[float | str]) -> list[str]:
    numbers = [value for value in values if not isinstance(value, str)]
    ends = [f"{min(numbers):g}", f"{max(numbers):g}"] if numbers else ["-", "-"]
    meaning = next((text for prefix, text in _QUESTIONS.items() if question.startswith(prefix)), "")
    return [question, str(len(values)), *ends, meaning]


def _sections(found: Analysis) -> Iterable[tuple[str, Table, str]]:
    yield "People and answers", _people(found), ""
    rule = (
        f"Rule: whoever passed {found.screened.attention:.0%} of the attention checks or less is left out with all"
        " answers. Answers are left out in the order of the table and counted once."
    )
    out = found.screened
    counts = [[str(out.reasons.count(r)), str(out.people(r)), why] for r, why in LEFT_OUT.items()]
    yield "Left out", [["answers", "people", "because they were"], *counts], rule
    for question in LIKERT:
        yield f"{question.capitalize()} by condition", _by_condition(found, question, "rate"), _UNITS
    for question in LIKERT:
        yield f"{question.capitalize()} while adapting", _by_condition(found, question, "adapt"), ""
    heads = ["question", "test", "people", "conditions", "chi-squared", "df", "p", "Kendall's W"]
    tests = [
        [q, "Friedman", str(t.n), str(t.k), f"{t.chi2:.3f}", str(t.k - 1), _p(t.p), f"{t.w:.2f}"]
        for q, t in found.omnibus
    ]
    yield "All conditions at once", [heads, *tests], ""
    for factor, heading, explained in _FACTORS:
        yield heading, _contrasts(found, factor), explained
    yield from _asked(found)


def _asked(found: Analysis) -> Iterable[tuple[str, Table, str]]:
    """Preferences, questionnaires, agreement, and what others say of what was adapted."""
    pairs = found.preferred.counts if found.preferred else {}
    rows = [[a, b, *map(str, given), str(sum(given))] for (a, b), given in pairs.items()]
    yield "Preferences", [["a", "b", "a preferred", "no difference", "b preferred", "n"], *rows], ""
    yield "Strength by preference", _strengths(found), _BRADLEY_TERRY
    rows = [
        [s.instrument, s.condition or "the whole", *_estimate(s.mean, "{:.1f}"), str(s.mean.n)] for s in found.scores
    ]
    yield "Questionnaires", [["instrument", "condition", "mean", "95 % interval", "people"], *rows], ""
    heads = ["question", "condition", "Krippendorff's alpha", "95 % interval", "items rated twice or more"]
    rows = [[q, condition, *_estimate(alpha), str(alpha.n)] for q, condition, alpha in found.agreements]
    yield "Agreement", [heads, *rows], _ALPHA
    heads = ["who adapted", "own correctness", "others' correctness", "95 % interval", "judges"]
    rows = [[x.participant, _number(x.own), *_estimate(x.others), str(x.others.n)] for x in found.adapters]
    yield "Adaptations as others judge them", [heads, *rows], ""


def _people(found: Analysis) -> Table:
    kept = found.screened.kept
    rows = [["", ""], ["people", str(len({r.participant for r in kept}))]]
    rows += [[f"of the group {group!r}", str(n)] for group, n in sorted(people_by_group(kept).items()) if group]
    rows += [["items", str(len({r.item for r in kept if r.item}))], ["answers", str(len(kept))]]
    rows += [[f"{q} ratings", str(sum(r.question == q for r in kept))] for q in LIKERT]
    seconds = sorted(r.seconds for r in kept if r.question == LIKERT[0])
    return [*rows, ["median time on a page", f"{seconds[len(seconds) // 2]:.0f} s"]] if seconds else rows


def _by_condition(found: Analysis, question: str, phase: str) -> Table:
    rows = [
        ["condition", "group", "mean", "95 % interval", "4 or 5", "95 % interval", "people", "ratings",
         "4 or 5 of ratings", "Wilson's 95 %", "1", "2", "3", "4", "5"]
    ]  # fmt: skip
    for s in found.summaries:
        if (s.question, s.phase) == (question, phase):
            people = *_estimate(s.mean), *_estimate(s.success, "{:.1%}"), str(s.mean.n)
            ratings = str(s.ratings.n), f"{s.ratings.rate:.1%}", f"{s.ratings.low:.1%} to {s.ratings.high:.1%}"
            rows.append([s.condition, s.group, *people, *ratings, *map(str, s.counts)])
    return rows


def _contrasts(found: Analysis, factor: str) -> Table:
    rows = [["question", "a", "b", "test", "n", "b minus a", "95 % interval", "p", "p (Holm)", "effect"]]
    for c in found.contrasts:
        if c.factor == factor:
            mean, span = _estimate(c.difference, "{:+.2f}")
            rows.append([c.question, c.a, c.b, c.test, str(c.n), mean, span, _p(c.p), _p(c.holm), f"{c.effect:+.2f}"])
    return rows


def _strengths(found: Analysis) -> Table:
    rows = [["condition", "worth", "95 % interval"]]
    if found.preferred:
        named = zip(found.preferred.strengths.names, found.preferred.worth, strict=True)
        rows += [[name, *_estimate(worth)] for name, worth in sorted(named, key=lambda x: -x[1].value)]
        rows.append(["(no difference)", f"{found.preferred.strengths.tie:.2f}", "weight of a tie"])
    return rows


def _estimate(x: Estimate, form: str = "{:.2f}") -> list[str]:
    return [_number(x.value, form), f"{form.format(x.low)} to {form.format(x.high)}" if x.bounded else "-"]


def _number(value: float, form: str = "{:.2f}") -> str:
    return "-" if math.isnan(value) else form.format(value)


def _p(p: float) -> str:
    return "< 0.001" if p < 0.001 else f"{p:.3f}"


def _long(screened: Screened) -> str:
    """All ratings, with a last column that says why one is left out."""
    rows = zip(map(written_row, screened.ratings), screened.reasons, strict=True)
    return csv_text([[*COLUMNS, "left_out"], *([*row, reason] for row, reason in rows)])


def _for_bench(found: Analysis) -> str:
    """Interpretability by sample and writer, for `ovita bench report`; in a trial, the writer's name says so."""
    mark = PILOT_MARK if found.pilot else ""
    rated = [r for r in found.screened.kept if r.question == "interpretability" and r.phase == "rate"]
    rows = [[r.item, r.condition + mark, f"{float(r.value):g}"] for r in rated]
    return csv_text([["sample", "writer", "rating"], *rows])


def _summary_csv(found: Analysis) -> str:
    spread = ["mean", "mean_low", "mean_high", "success", "success_low", "success_high"]
    rows: Table = [["question", "phase", "condition", "group", *spread, "people", "ratings", "pilot"]]
    for s in found.summaries:
        figures = [f"{x:.6g}" for part in (s.mean, s.success) for x in (part.value, part.low, part.high)]
        counts = map(str, (s.mean.n, s.ratings.n, int(found.pilot)))
        rows.append([s.question, s.phase, s.condition, s.group, *figures, *counts])
    return csv_text(rows)


def _why_none(screened: Screened) -> str:
    counts = {why: screened.reasons.count(reason) for reason, why in LEFT_OUT.items()}
    found = [f"{count} were {why}" for why, count in counts.items() if count]
    return f" ({'; '.join(found)})" if found else ""


_QUESTIONS = {
    "correctness": "does the change do what was said, 1 completely wrong to 5 completely correct; 4 and 5 are success",
    "interpretability": "is it clear what was changed and why, 1 to 5",
    "preference": "the condition preferred of two, or none",
    "attention": "a check with a known answer: 1 passed, 0 failed",
    "comment": "free text",
    "tlx_": "NASA-TLX, 0 to 100, unweighted; performance: 0 perfect, 100 failure",
    "umux_": "UMUX-Lite, 1 to 7",
    "sus_": "System Usability Scale, 1 to 5, the even ones worded negatively",
}

_MEANING = {
    "participant": "a person, by a number or random letters",
    "group": "the person's stratum",
    "phase": "adapt: the person adapted it; rate: the person judges it",
    "item": "the instruction with its scene",
    "condition": "the system; a|b for a preference; empty for questions on the whole",
    "explanation": "1 if the explanation was shown",
    "question": "see below",
    "value": "the answer",
    "position": "which page of this person it was",
    "seconds": "time to the answer [s]",
    "when": "date and time, ISO 8601",
    "pilot": "1 if it belongs to a trial",
    "adapter": "who adapted what is judged, if another participant did",
}

_UNITS = (
    "Mean and share are means over people, with bootstrap intervals from resampling people. The share of all ratings"
    " with Wilson's interval is there for comparison with the paper: ratings of one person are not independent, so that"
    " interval is too narrow."
)

_ALPHA = "1: all agree; 0: as chance would have it. Intervals are from resampling items."

_BRADLEY_TERRY = (
    "A Bradley-Terry model with Davidson's ties: between two conditions the odds of being preferred are the ratio of"
    " their worths. Half a win and half a loss against an average condition are added to each; intervals are from"
    " resampling people."
)

_FACTORS = (
    ("condition", "Conditions in pairs", "Positive: b is higher. One value a person: the mean over what they rated."),
    ("explanation", "With and without the explanation", ""),
    (
        "phase",
        "While adapting and when rating others",
        "adapt: what people say of what they adapted themselves. Only conditions that occur in both phases.",
    ),
    ("group", "Groups", ""),
)

_METHOD = (
    "The unit is the person: all tests compare people's means. Pairs: Wilcoxon's signed-rank test, exact where it can"
    " be, with the matched-pairs rank-biserial correlation (-1 to 1); groups of different people: the Mann-Whitney test"
    " with the rank-biserial correlation. More than two conditions: Friedman's test with Kendall's W, on people who"
    " rated all. p (Holm) is corrected for all rows of the same question in the same table. Means: bias-corrected"
    " bootstrap, 2,000 resamples of people. `clmm.R` fits cumulative-link mixed models with people and items as random"
    " effects to the same ratings."
)
