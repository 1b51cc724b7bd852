"""`ovita policy catalogue`, and the page that is made of it."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from ovita.cli.policy_ import group
from ovita.toolkit import CATALOGUE, describe
from ovita.toolkit.catalogue import reference, signature

PAGE = Path(__file__).parents[2] / "docs" / "toolkit.md"


def invoke(*arguments):
    return CliRunner().invoke(group, ["catalogue", *arguments])


def test_without_names_it_is_the_list_of_the_prompt():
    assert invoke().output == describe() + "\n"


def test_a_name_gives_the_whole_description_and_a_use():
    text = invoke("circle", "near").output
    assert text.index("near(traj, obj, within, of='centre')") < text.index(signature("circle"))
    assert "radius: [m], > 0; None for" in text
    assert 'For "Circle once around the vase": traj = circle(' in text


def test_as_json():
    entries = json.loads(invoke("--json").output)
    assert [entry["name"] for entry in entries] == list(CATALOGUE)
    (entry,) = json.loads(invoke("--json", "move").output)
    assert list(entry["parameters"]) == ["traj", "OFFSET", "where", "ease", "keep"]
    assert entry["group"] == "Shift the path and its ends"


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_parameter_is_explained(name):
    (entry,) = reference([name])
    words = entry.signature.partition("(")[2].rstrip(")")
    shown = [part.partition("=")[0] for part in words.split(", ") if part not in ("*", "")]
    assert list(entry.parameters) == shown
    assert entry.summary and all(entry.parameters.values())


def test_the_page_is_up_to_date():
    assert PAGE.read_text(encoding="utf-8") == invoke("--markdown").output, (
        "docs/toolkit.md is not what the docstrings say; run: ovita policy catalogue --markdown > docs/toolkit.md"
    )


@pytest.mark.parametrize(
    ("arguments", "said"), [(["fly"], "the toolkit has no fly; it has near"), (["--markdown", "near"], "whole page")]
)
def test_mistakes_are_one_sentence(arguments, said):
    result = invoke(*arguments)
    assert result.exit_code == 2 and said in result.output
