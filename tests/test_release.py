"""What a release is made of: the sdist has all that its tests read, and old files are read today."""

import importlib.util
import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest

import ovita as ov
from ovita.errors import FormatError

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
OLD = ROOT / "tests" / "io"


def release():
    spec = importlib.util.spec_from_file_location("release", ROOT / ".ci" / "release.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_sdist_has_everything_that_is_tracked():
    if shutil.which("git") is None or not (ROOT / ".git").exists():
        pytest.skip("this is no checkout")
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    tracked = {line.split("/")[0] for line in listed.splitlines()} - {".gitignore", ".gitattributes", "pyproject.toml"}
    included = {entry.strip("/") for entry in PROJECT["tool"]["hatch"]["build"]["targets"]["sdist"]["include"]}
    assert tracked <= included, tracked - included


def test_versions_agree():
    version = PROJECT["project"]["version"]
    assert ov.__version__ == version
    assert re.search(r"^version: (.*)$", (ROOT / "CITATION.cff").read_text(encoding="utf-8"), re.M)[1] == version


def test_a_readme_for_an_index_has_no_link_that_leads_nowhere():
    text = "![A path](docs/a.png) and [docs](docs/b.md), [paper](https://x.org/p), [below](#use)"
    page = release().for_an_index
    assert page(text, "") == " and docs, [paper](https://x.org/p), [below](#use)"
    assert page(text, "https://r.org/raw/") == (
        "![A path](https://r.org/raw/docs/a.png) and [docs](https://r.org/raw/docs/b.md), [paper](https://x.org/p),"
        " [below](#use)"
    )
    whole = page((ROOT / "README.md").read_text(encoding="utf-8"), "")
    assert not re.search(r"\]\((?!https?:|#)", whole) and "![" not in whole


def test_a_session_of_an_older_version_is_read_and_goes_on():
    session = ov.Session.load(str(OLD / "session_0_1_0.json"), writer="builtin")
    assert [step.said for step in session.steps] == ["go left by 0.1", "slow down near the cup"]
    assert [step.adaptation.status for step in session.steps] == ["done", "done"]
    before = session.current.positions[0].copy()
    assert session.say("go up by 0.1").status == "done"
    assert session.current.positions[0] - before == pytest.approx([0.0, 0.0, 0.1])


@pytest.mark.parametrize(
    ("text", "read"),
    [
        ('{"schema": "ovita.adaptation/2"}', ov.Adaptation.load),
        ('{"schema": "ovita.session/2", "events": []}', ov.Session.load),
        ('{"schema": "ovita.skill/2"}', lambda path: ov.Skill.load(path)),
    ],
)
def test_a_newer_schema_is_refused_by_name(tmp_path, text, read):
    path = tmp_path / "new.json"
    path.write_text(text)
    with pytest.raises(FormatError, match=r"ovita\.\w+/1"):
        read(str(path))
