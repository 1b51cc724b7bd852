"""What a study's answers amount to: who is left out and why, means by person, tests, agreement, preferences."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np

from ovita.bench.tables import Interval, holm, signed_rank, wilson
from ovita.paths.trajectory import Array
from ovita.study import statistics
from ovita.study.ratings import LIKERT, NONE, Rating
from ovita.study.statistics import Estimate, Friedman, Strengths

SUCCESS = 4.0
"""Ratings from here on count as success, as in the paper."""

ATTENTION = 0.5
"""Who passed this share of the attention checks, or less, is left out."""

RESAMPLES = 300
"""Of people, for the intervals of preferences."""

OVERALL = "all"

LEFT_OUT = {
    "pilot": "given in a trial before the study",
    "attention": "given by someone who failed too many attention checks",
    "own": "about what the person adapted",
    "repeated": "given again later to the same question on the same thing; the last one counts",
}
"""Why a rating is left out, in the order in which it is decided."""

Means = Mapping[str, Mapping[str, float]]
"""By level of a factor and person: the mean of that person's ratings."""


@dataclass(frozen=True)
class Screened:
    """Ratings, and for each of them why it is left out, or "".

    Args:
        reasons: One each, a key of LEFT_OUT or "".
        attention: The share of attention checks that was not enough.
    """

    ratings: tuple[Rating, ...]
    reasons: tuple[str, ...]
    attention: float

    @property
    def kept(self) -> tuple[Rating, ...]:
        """The ratings that count."""
        return tuple(r for r, reason in zip(self.ratings, self.reasons, strict=True) if not reason)

    @property
    def pilot(self) -> bool:
        """Whether what is left is a trial and no data."""
        return any(r.pilot for r in self.kept)

    def people(self, reason: str) -> int:
        """How many people have ratings that are left out for that reason."""
        return len({r.participant for r, why in zip(self.ratings, self.reasons, strict=True) if why == reason})


@dataclass(frozen=True)
class Summary:
    """The answers to one question of 1 to 5 about one condition.

    Args:
        question, phase, condition, group: What of; group "all" for everybody.
        mean: Of people's means.
        success: Of people's shares of ratings of 4 and 5.
        ratings: The share of ratings of 4 and 5 as if each were another person's, with Wilson's interval.
        counts: How often 1, 2, 3, 4, 5 was given.
    """

    question: str
    phase: str
    condition: str
    group: str
    mean: Estimate
    success: Estimate
    ratings: Interval
    counts: tuple[int, ...]


@dataclass(frozen=True)
class Contrast:
    """Two levels of a factor compared by people's means.

    Args:
        factor: "condition", "explanation", "phase" or "group".
        test: "Wilcoxon" where people gave both, "Mann-Whitney" where each gave one.
        n: Pairs, or people in both groups.
        difference: Mean of b minus a.
        p, holm: As it is, and corrected for all contrasts of this question and factor.
        effect: Rank-biserial correlation, -1..1, > 0 if b is higher.
    """

    question: str
    factor: str
    a: str
    b: str
    test: str
    n: int
    difference: Estimate
    p: float
    effect: float
    holm: float = math.nan


@dataclass(frozen=True)
class Preferred:
    """Preferences between pairs.

    Args:
        worth: Of each condition, with its interval from resampling people.
        counts: By pair: how often the first, none and the second was preferred.
    """

    strengths: Strengths
    worth: tuple[Estimate, ...]
    counts: Mapping[tuple[str, str], tuple[int, int, int]]


@dataclass(frozen=True)
class Score:
    """A questionnaire's score about one condition, or about the whole where that is ""."""

    instrument: str
    condition: str
    mean: Estimate


@dataclass(frozen=True)
class Adapter:
    """What others say of what one person adapted, and what that person said.

    Args:
        own: Mean of the person's own ratings in the adaptation phase; NaN if there is none.
        others: Mean over the people who judged it.
    """

    participant: str
    own: float
    others: Estimate


@dataclass(frozen=True)
class Analysis:
    """All that a study's report says; `omnibus` is Friedman's test of all conditions, by question."""

    screened: Screened
    summaries: tuple[Summary, ...]
    omnibus: tuple[tuple[str, Friedman], ...]
    contrasts: tuple[Contrast, ...]
    agreements: tuple[tuple[str, str, Estimate], ...]
    preferred: Preferred | None
    scores: tuple[Score, ...]
    adapters: tuple[Adapter, ...]

    @property
    def pilot(self) -> bool:
        """Whether it rests on a trial and not on data."""
        return self.screened.pilot


def screen(ratings: Sequence[Rating], *, attention: float = ATTENTION) -> Screened:
    """Decide which ratings count.

    Left out are, in this order: ratings of a trial beside ratings of the study; all of a person who passed that share
    of the attention checks or less; a person's ratings of what they adapted themselves in the rating phase; all but
    the last answer to the same question about the same thing.

    `attention` is a share, 0..1; ratings are in the order in which they were given.
    """
    mixed = {r.pilot for r in ratings} == {True, False}
    counted = [r for r in ratings if not (mixed and r.pilot)]
    passed = means(_asked(counted, "attention"), lambda r: r.question).get("attention", {})
    careless = {who for who, share in passed.items() if share <= attention}
    last = {_subject(r): i for i, r in enumerate(ratings)}
    reasons = [_reason(r, careless, mixed, last[_subject(r)] != i) for i, r in enumerate(ratings)]
    return Screened(tuple(ratings), tuple(reasons), attention)


def analyse(ratings: Sequence[Rating], *, attention: float = ATTENTION) -> Analysis:
    """Screen ratings and analyse those that count, with people as the unit."""
    screened = screen(ratings, attention=attention)
    kept = screened.kept
    rated = [r for r in kept if r.phase == "rate" and not r.adapter]
    return Analysis(
        screened,
        tuple(_summaries(kept)),
        tuple(_omnibus(rated)),
        tuple(_contrasts(kept, rated)),
        tuple(_agreements([r for r in kept if r.phase == "rate"])),
        _preferences([r for r in kept if r.question == "preference"]),
        tuple(_scores(kept)),
        tuple(_adapters(kept)),
    )


def means(ratings: Iterable[Rating], level: Callable[[Rating], str]) -> dict[str, dict[str, float]]:
    """The mean of each person's ratings at each level of a factor."""
    return {
        k: _by_person((r.participant, float(r.value)) for r in mine) for k, mine in _sorted_by(ratings, level).items()
    }


def compare(question: str, factor: str, table: Means) -> list[Contrast]:
    """Compare every two levels of a factor: by Wilcoxon's test on the people who have both, else by Mann-Whitney's."""
    found = [_contrast(question, factor, a, b, table[a], table[b]) for a, b in combinations(table, 2)]
    tested = [contrast for contrast in found if contrast is not None]
    corrected = holm([contrast.p for contrast in tested])
    return [replace(contrast, holm=float(p)) for contrast, p in zip(tested, corrected, strict=True)]


def _contrast(
    question: str, factor: str, a: str, b: str, left: Mapping[str, float], right: Mapping[str, float]
) -> Contrast | None:
    both = sorted(left.keys() & right.keys())
    if len(both) >= 2:
        paired = signed_rank([left[who] for who in both], [right[who] for who in both])
        difference = statistics.mean_of_people([right[who] - left[who] for who in both])
        return Contrast(question, factor, a, b, paired.test, len(both), difference, paired.p, paired.effect)
    if min(len(left), len(right)) < 2:
        return None
    groups = list(left.values()), list(right.values())
    p, effect = statistics.rank_sum(*groups)
    difference = statistics.difference_of_groups(*groups)
    return Contrast(question, factor, a, b, "Mann-Whitney", len(left) + len(right), difference, p, effect)


def _reason(rating: Rating, careless: set[str], mixed: bool, repeated: bool) -> str:
    if mixed and rating.pilot:
        return "pilot"
    if rating.participant in careless:
        return "attention"
    if rating.phase == "rate" and rating.adapter == rating.participant:
        return "own"
    return "repeated" if repeated else ""


def _subject(r: Rating) -> tuple[object, ...]:
    position = r.position if r.question in ("attention", "comment") else 0
    return r.participant, r.phase, r.item, r.condition, r.explanation, r.question, r.pilot, r.adapter, position


def _asked(ratings: Iterable[Rating], question: str) -> list[Rating]:
    return [r for r in ratings if r.question == question]


def _condition(rating: Rating) -> str:
    return rating.condition


def _sorted_by(ratings: Iterable[Rating], level: Callable[[Rating], str]) -> dict[str, list[Rating]]:
    found: dict[str, list[Rating]] = defaultdict(list)
    for rating in ratings:
        found[level(rating)].append(rating)
    return dict(sorted(found.items()))


def _summaries(kept: Sequence[Rating]) -> Iterable[Summary]:
    groups = sorted({r.group for r in kept if r.group})
    for question, phase in product(LIKERT, ("rate", "adapt")):
        here = [r for r in _asked(kept, question) if r.phase == phase]
        for condition, mine in _sorted_by(here, _condition).items():
            yield _summary(question, phase, condition, OVERALL, mine)
            for group, part in _sorted_by(mine, lambda r: r.group).items() if len(groups) > 1 else ():
                if group:
                    yield _summary(question, phase, condition, group, part)


def _summary(question: str, phase: str, condition: str, group: str, mine: Sequence[Rating]) -> Summary:
    values = [(r.participant, float(r.value)) for r in mine]
    passed = [(who, float(value >= SUCCESS)) for who, value in values]
    ratings = wilson(round(sum(share for _, share in passed)), len(values))
    counts = Counter(round(value) for _, value in values)
    given = tuple(counts[point] for point in range(1, 6))
    return Summary(question, phase, condition, group, _of_people(values), _of_people(passed), ratings, given)


def _omnibus(rated: Sequence[Rating]) -> Iterable[tuple[str, Friedman]]:
    for question in LIKERT:
        table = means(_asked(rated, question), _condition)
        people = sorted(set.intersection(*(set(column) for column in table.values()))) if table else []
        if len(table) >= 3 and len(people) >= 2:
            yield question, statistics.friedman([[table[c][who] for c in table] for who in people])


def _contrasts(kept: Sequence[Rating], rated: Sequence[Rating]) -> Iterable[Contrast]:
    for question in LIKERT:
        mine = _asked(rated, question)
        yield from compare(question, "condition", means(mine, _condition))
        yield from compare(question, "explanation", means(mine, lambda r: "with" if r.explanation else "without"))
        yield from compare(question, "phase", means(_in_both_phases(_asked(kept, question)), lambda r: r.phase))
        yield from compare(question, "group", means([r for r in mine if r.group], lambda r: r.group))


def _in_both_phases(ratings: Sequence[Rating]) -> list[Rating]:
    """The ratings of conditions that were rated in both phases, so that conditions do not stand in for phases."""
    adapted, rated = ({r.condition for r in ratings if r.phase == phase} for phase in ("adapt", "rate"))
    return [r for r in ratings if r.condition in adapted & rated]


def _agreements(rated: Sequence[Rating]) -> Iterable[tuple[str, str, Estimate]]:
    for question in LIKERT:
        mine = _asked(rated, question)
        for condition in (OVERALL, *sorted({r.condition for r in mine})):
            units: dict[tuple[str, str, bool, str], list[float]] = defaultdict(list)
            for r in mine:
                if condition in (OVERALL, r.condition):
                    units[r.item, r.condition, r.explanation, r.adapter].append(float(r.value))
            if any(len(unit) > 1 for unit in units.values()):
                yield question, condition, statistics.agreement(list(units.values()))


def _preferences(given: Sequence[Rating]) -> Preferred | None:
    pairs = [(r.participant, *r.condition.split("|", 1), str(r.value)) for r in given if "|" in r.condition]
    if not pairs:
        return None
    names = sorted({name for pair in pairs for name in pair[1:3]})
    wins, ties = _tallied(pairs, names)
    total, even = wins.sum(0).astype(int).tolist(), ties.sum(0).astype(int).tolist()
    two = combinations(enumerate(names), 2)
    counts = {(a, b): (total[i][j], even[i][j], total[j][i]) for (i, a), (j, b) in two}
    asked = {pair: count for pair, count in counts.items() if any(count)}
    fitted = _fit(names, wins.sum(0), ties.sum(0))
    return Preferred(fitted, _spread(fitted, wins, ties), asked)


def _spread(fitted: Strengths, wins: Array, ties: Array) -> tuple[Estimate, ...]:
    """The worth of each with its interval from resampling people."""
    n = len(wins)
    weights = np.random.default_rng(0).multinomial(n, np.full(n, 1 / n), RESAMPLES)
    drawn = [_fit(fitted.names, np.tensordot(w, wins, 1), np.tensordot(w, ties, 1)).worth for w in weights]
    spread = zip(fitted.worth, *np.quantile(np.array(drawn), (0.025, 0.975), axis=0).tolist(), strict=True)
    return tuple(Estimate(value, low, high, n) for value, low, high in spread)


def _tallied(pairs: Sequence[tuple[str, ...]], names: Sequence[str]) -> tuple[Array, Array]:
    """How often each person preferred one to another, and neither of two (people, k, k)."""
    place = {name: i for i, name in enumerate(names)}
    people = {who: i for i, who in enumerate(sorted({who for who, *_ in pairs}))}
    wins = np.zeros((len(people), len(names), len(names)))
    ties = np.zeros_like(wins)
    for who, a, b, value in pairs:
        for first, second in ((a, b), (b, a)):
            ties[people[who], place[first], place[second]] += value == NONE
            wins[people[who], place[first], place[second]] += value == first
    return wins, ties


def _fit(names: Sequence[str], wins: Array, ties: Array) -> Strengths:
    # half a win and a loss against an average condition keep the worth finite where one is always preferred
    return statistics.bradley_terry(names, wins, ties, pseudo=0.5)


_INSTRUMENTS: tuple[tuple[str, str, int, Callable[[Mapping[str, float]], float]], ...] = (
    ("SUS", "sus_", 10, lambda given: statistics.sus([given[f"sus_{i}"] for i in range(1, 11)])),
    ("UMUX-Lite", "umux_", 2, lambda given: statistics.umux_lite([given["umux_1"], given["umux_2"]])),
    ("raw TLX", "tlx_", 6, statistics.raw_tlx),
)


def _scores(kept: Sequence[Rating]) -> Iterable[Score]:
    for instrument, prefix, number, score in _INSTRUMENTS:
        asked = [r for r in kept if r.question.startswith(prefix)]
        for condition, mine in _sorted_by(asked, _condition).items():
            whole = [(who, form) for who, form in _forms(mine) if len(form) == number]
            yield Score(instrument, condition, _of_people((who, score(form)) for who, form in whole))
            for scale in sorted(whole[0][1]) if whole and prefix == "tlx_" else ():
                mean = _of_people((who, form[scale]) for who, form in whole)
                yield Score(f"TLX {scale.removeprefix(prefix)}", condition, mean)


def _forms(given: Iterable[Rating]) -> Iterable[tuple[str, dict[str, float]]]:
    """What each person wrote into a questionnaire, once for each phase."""
    filled: dict[tuple[str, str], dict[str, float]] = defaultdict(dict)
    for r in given:
        filled[r.participant, r.phase][r.question] = float(r.value)
    return ((who, form) for (who, _), form in filled.items())


def _by_person(values: Iterable[tuple[str, float]]) -> dict[str, float]:
    """The mean of each person's values."""
    people: dict[str, list[float]] = defaultdict(list)
    for who, value in values:
        people[who].append(value)
    return {who: sum(mine) / len(mine) for who, mine in people.items()}


def _of_people(values: Iterable[tuple[str, float]]) -> Estimate:
    return statistics.mean_of_people(list(_by_person(values).values()))


def _adapters(kept: Sequence[Rating]) -> Iterable[Adapter]:
    asked = _asked(kept, "correctness")
    judged = means([r for r in asked if r.phase == "rate" and r.adapter], lambda r: r.adapter)
    own = means([r for r in asked if r.phase == "adapt"], lambda r: r.participant)
    for who, others in judged.items():
        mine = own.get(who, {}).get(who, math.nan)
        yield Adapter(who, mine, statistics.mean_of_people(list(others.values())))


def people_by_group(ratings: Iterable[Rating]) -> Mapping[str, int]:
    """How many people of each group there are."""
    return Counter({r.participant: r.group for r in ratings}.values())
