"""The pages that people see, as HTML; a page knows letters, never the names of conditions."""

from __future__ import annotations

import gzip
import json
from collections.abc import Mapping, Sequence
from functools import cache, lru_cache
from importlib.resources import files
from typing import Any

from ovita.bench.page import template_of
from ovita.errors import needs
from ovita.io import scene_from_dict
from ovita.io.waypoints import trajectory_from_rows
from ovita.paths.trajectory import Trajectory
from ovita.study.adapting import AdaptedByPerson
from ovita.study.answers import StudyEvent
from ovita.study.assignment import Participant, StudyPage
from ovita.study.folder import StudyFolder
from ovita.study.material import StudyItem
from ovita.study.questions import ASKED

HEADINGS: Mapping[str, tuple[str, str]] = {
    "tlx": ("How demanding was it?", "Please set each slider for the task that you have just finished."),
    "umux": ("The system as a whole", "How far do you agree? Think of all that you have seen."),
    "sus": ("The system as a whole", "How far do you agree? Think of all that you have seen."),
}
"""Heading and introduction of each questionnaire."""

NOTHING: Mapping[str, str] = {}


def _macros() -> Any:
    return template_of("ovita.study", "pages.html.j2").module


@cache
def asset(name: str) -> str:
    """A file that belongs to the pages."""
    return (files("ovita.study") / name).read_text(encoding="utf-8")


@cache
def plotly() -> str:
    """The drawing library, as one script.

    Raises:
        MissingExtra: If plotly is not installed.
    """
    with needs("plotly", "plot"):
        from plotly.offline import get_plotlyjs
    return str(get_plotlyjs())


@cache
def scripts() -> Mapping[str, tuple[bytes, bytes]]:
    """The scripts that a server hands out, by address: as they are, and compressed."""
    found = {"/assets/plotly.js": plotly().encode(), "/assets/view.js": asset("view.js").encode()}
    return {address: (body, gzip.compress(body, 6, mtime=0)) for address, body in found.items()}


def document(title: str, body: str, *, pilot: bool, drawn: bool) -> str:
    """A whole page for a server.

    With `drawn`, the page has pictures or sliders and so needs the scripts.
    """
    from markupsafe import Markup

    addresses = ("/assets/plotly.js", "/assets/view.js") if drawn else ()
    tags = Markup("\n").join(Markup('<script src="{}"></script>').format(a) for a in addresses)
    return str(_macros().shell(title, Markup(body), pilot, Markup(asset("page.css")), tags))


def offline_document(title: str, data: str, *, pilot: bool) -> str:
    """A whole study as one page that loads nothing; `data` is HTML, which offline.js shows part by part."""
    from markupsafe import Markup

    code = Markup("\n").join(
        Markup("<script>") + Markup(text.replace("</script", "<\\/script")) + Markup("</script>")
        for text in (plotly(), asset("view.js"), asset("offline.js"))
    )
    style = Markup(asset("page.css"))
    empty = Markup("<noscript>This study needs a browser that runs JavaScript.</noscript>")
    return str(_macros().shell(title, empty, pilot, style, code, offline=True, data=Markup(data)))


def consent(study: StudyFolder, missing: bool = False) -> str:
    """The text that people agree to, before anything is stored."""
    return str(_macros().consent(study.design.title, study.consent.split("\n\n"), missing))


TROUBLE = (
    "Something went wrong here",
    "Your answers so far are saved. Please try again in a moment, or tell the person who sent you the link.",
)
FAREWELL = "Thank you", "All your answers are saved. You may close this page now."
GONE = "You have withdrawn", "Everything that you answered and said was deleted. You may close this page."
"""What `message` says where this side failed, after the last page, and to those who withdrew."""


def message(heading: str, text: str) -> str:
    """A page with something to read."""
    return str(_macros().message(heading, text))


def handing_over() -> str:
    """The last page of a study in a file."""
    return str(_macros().handing_over())


def forgotten(participant: str) -> str:
    """The page of those who withdrew, in a file."""
    text = (
        "Everything that this browser kept was deleted. Please hand over no file with answers; if you did so already,"
        f" tell the people who run the study to withdraw {participant}."
    )
    return message("You have withdrawn", text)


def footer(study: StudyFolder) -> str:
    """Whom to ask, and the way out."""
    return str(_macros().foot(study.design.contact))


def page_of(
    study: StudyFolder,
    person: Participant,
    page: StudyPage,
    given: Mapping[str, str] = NOTHING,
    missing: Sequence[str] = (),
    *,
    talk: tuple[Trajectory, Sequence[StudyEvent]] | None = None,
    outcome: AdaptedByPerson | None = None,
) -> str:
    """A page of a person's study.

    `given` is what the form held when it was sent with answers `missing`, which are named. A page of the adaptation
    phase shows a `talk`: the path as it stands and what was said so far; a page that judges, another's `outcome`.
    """
    macros, design, questions = _macros(), study.design, ASKED.get(page.kind, ())
    head = macros.head(page, len(person.pages))
    match page.kind:
        case "introduction":
            rating, judging = (sum(p.kind == kind for p in person.pages) for kind in ("rate", "judge"))
            letters = sorted(person.letters.values())
            body = macros.introduction(page, design.title, len(person.adapted), rating, judging,
                                       design.preference, letters)  # fmt: skip
        case "rate":
            item, (name,) = study.items[page.item], page.conditions
            body = macros.rate(page, item.instruction, *_side(item, name, person).values(), questions, given, missing,
                               design.comments)  # fmt: skip
        case "preference":
            item = study.items[page.item]
            sides = [_side(item, name, person) for name in page.conditions]
            body = macros.preference(page, item.instruction, sides, given, missing, design.comments)
        case "judge" if outcome is not None:
            item = outcome.item
            body = macros.rate(page, item.instruction, "of another person", drawing(outcome.path, item), outcome.told,
                               outcome.changed, questions, given, missing, design.comments)  # fmt: skip
        case "adapt" if talk is not None:
            item, (path, turns) = study.items[page.item], talk
            left = max(design.adapt.turns - len(turns), 0)
            body = macros.adapt(page, item.instruction, drawing(path, item), turns, len(turns) + 1, left, questions,
                                given, missing, design.comments)  # fmt: skip
        case "attention":
            word = dict(questions[0].points)[page.expected]
            body = macros.attention(page, questions[0], word, given, missing)
        case "closing":
            body = macros.closing(page, given)
        case _:
            body = macros.questionnaire(page, *HEADINGS[page.kind], questions, given, missing)
    return str(head + body)


def drawing(adapted: Trajectory, item: StudyItem) -> dict[str, Any]:
    """What the template's `view` takes: the picture as JSON that HTML may hold, and what is left out of it.

    All pictures of an item show the same part of the scene the same way, so that none stands out.
    """
    from markupsafe import Markup

    from ovita.plots.browser import playable

    beside = [trajectory_from_rows(result.adapted, key="adapted") for result in item.results.values()]
    made = playable(trajectory_from_rows(item.original), adapted, scene_from_dict(item.scene), beside=beside)
    text = json.dumps(made, separators=(",", ":")).replace("<", "\\u003c")
    return {"json": Markup(text), "left_out": ", ".join(made["left_out"])}


def _side(item: StudyItem, name: str, person: Participant) -> dict[str, Any]:
    result, letter = item.results[name], person.letters[name]
    return {"letter": letter, "figure": _drawn(item, name), "lines": result.told, "changed": result.changed}


@lru_cache(maxsize=4000)
def _drawn(item: StudyItem, name: str) -> dict[str, Any]:
    return drawing(trajectory_from_rows(item.results[name].adapted, key="adapted"), item)
