"""The instruments: what each question asks, word for word, and which answers it takes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from ovita.errors import RequestError


@dataclass(frozen=True)
class Question:
    """A question with a scale from `low` to `high` in steps of `by`.

    Args:
        anchors: What the points mean: one word each, or those at the two ends.
    """

    name: str
    text: str
    low: int
    high: int
    anchors: tuple[str, ...]
    by: int = 1

    @property
    def points(self) -> tuple[tuple[int, str], ...]:
        """The points of the scale, each with its words or ""."""
        values = range(self.low, self.high + 1, self.by)
        if len(self.anchors) == len(values):
            return tuple(zip(values, self.anchors, strict=True))
        ends = {self.low: self.anchors[0], self.high: self.anchors[-1]}
        return tuple((value, ends.get(value, "")) for value in values)

    @property
    def slider(self) -> bool:
        """Whether it is shown as a slider."""
        return len(self.points) > 11

    def read(self, given: str) -> int:
        """An answer as a number.

        Raises:
            RequestError: If it is none of the points.
        """
        if not given.isascii() or not given.isdigit() or len(given) > 4:
            raise RequestError(f"{self.name}: is not answered" if not given else f"{self.name}: is no number")
        value = int(given)
        if value not in range(self.low, self.high + 1, self.by):
            raise RequestError(f"{self.name}: is {value}, expected {self.low} to {self.high}")
        return value


CORRECT = ("completely wrong", "mostly wrong", "partly right", "mostly right", "completely right")
CORRECTNESS = Question("correctness", "How well does the changed path do what was said?", 1, 5, CORRECT)
"""The paper's scale; 4 and 5 count as success."""

INTERPRETABILITY = Question(
    "interpretability",
    "From what you see on this page, how well can you tell what was changed, and why?",
    1,
    5,
    ("not at all", "hardly", "partly", "mostly", "completely"),
)

ATTENTION = Question("attention", "How well does the changed path do what was said?", 1, 5, CORRECT)

_LOAD = ("very low", "very high")
TLX = tuple(
    Question(f"tlx_{name}", text, 0, 100, ends, 5)
    for name, text, ends in (
        ("mental", "Mental demand: how mentally demanding was the task?", _LOAD),
        ("physical", "Physical demand: how physically demanding was the task?", _LOAD),
        ("temporal", "Temporal demand: how hurried or rushed was the pace of the task?", _LOAD),
        ("performance", "Performance: how successful were you in what you were asked to do?", ("perfect", "failure")),
        ("effort", "Effort: how hard did you have to work for your level of performance?", _LOAD),
        ("frustration", "Frustration: how insecure, discouraged, irritated, stressed and annoyed were you?", _LOAD),
    )
)
"""Raw NASA-TLX (Hart and Staveland 1988, without weights): six scales of 21 points, 0 to 100."""

_AGREE = ("strongly disagree", "strongly agree")
UMUX = tuple(
    Question(f"umux_{i}", text, 1, 7, _AGREE)
    for i, text in enumerate(("This system's capabilities meet my requirements.", "This system is easy to use."), 1)
)
"""UMUX-Lite (Lewis, Utesch and Maher 2013): two items of seven points."""

SUS = tuple(
    Question(f"sus_{i}", text, 1, 5, _AGREE)
    for i, text in enumerate(
        (
            "I think that I would like to use this system frequently.",
            "I found the system unnecessarily complex.",
            "I thought the system was easy to use.",
            "I think that I would need the support of a technical person to be able to use this system.",
            "I found the various functions in this system were well integrated.",
            "I thought there was too much inconsistency in this system.",
            "I would imagine that most people would learn to use this system very quickly.",
            "I found the system very cumbersome to use.",
            "I felt very confident using the system.",
            "I needed to learn a lot of things before I could get going with this system.",
        ),
        1,
    )
)
"""System Usability Scale (Brooke 1996): ten items of five points, the even ones worded negatively."""

PREFERENCE = "preference"
SIDES = ("left", "none", "right")
"""What may be preferred on a page with two results."""

COMMENT = "comment"
LONGEST_COMMENT = 4000
"""Most characters of a remark that are kept."""

ASKED: Mapping[str, tuple[Question, ...]] = {
    "adapt": (CORRECTNESS, INTERPRETABILITY),
    "rate": (CORRECTNESS, INTERPRETABILITY),
    "judge": (CORRECTNESS, INTERPRETABILITY),
    "attention": (ATTENTION,),
    "preference": (),
    "tlx": TLX,
    "umux": UMUX,
    "sus": SUS,
    "closing": (),
}
"""The questions of each kind of page."""

KINDS = ("introduction", *ASKED)
"""The kinds of pages."""


def read_answers(kind: str, form: Mapping[str, str], comments: bool) -> tuple[dict[str, int | str], tuple[str, ...]]:
    """Read a page's answers from a form: the values, and the names of the questions that have none.

    What the form holds beyond the page's questions is ignored.
    """
    values: dict[str, int | str] = {}
    missing = []
    for question in ASKED.get(kind, ()):
        try:
            values[question.name] = question.read(form.get(question.name, ""))
        except RequestError:
            missing.append(question.name)
    if kind == PREFERENCE:
        chosen = form.get(PREFERENCE, "")
        if chosen in SIDES:
            values[PREFERENCE] = chosen
        else:
            missing.append(PREFERENCE)
    remark = form.get(COMMENT, "").strip()[:LONGEST_COMMENT]
    if remark and (comments or kind == "closing"):
        values[COMMENT] = remark
    return values, tuple(missing)
