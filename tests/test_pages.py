"""The pages keep their word: snippets run or are at least real, links lead somewhere, figures were measured."""

import ast
import importlib
import importlib.util
import re
import shlex
import shutil
from pathlib import Path

import click
import pytest

import ovita as ov
from command_line import ovita
from ovita.cli.main import cli

ROOT = Path(__file__).parents[1]
PAGES = sorted((ROOT / "docs").glob("*.md"))
BLOCK = re.compile(r"^```(python|sh)\n(.*?)^```", re.DOTALL | re.MULTILINE)
FENCE = re.compile(r"^```.*?^```", re.DOTALL | re.MULTILINE)
TEXTS = {page.name: page.read_text(encoding="utf-8") for page in [ROOT / "README.md", *PAGES]}


def docs():
    spec = importlib.util.spec_from_file_location("docs_site", ROOT / ".ci" / "docs.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


SITE = docs()


@pytest.fixture
def at_home(tmp_path, monkeypatch):
    """A folder with the files that the pages take for granted."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("OVITA_MODEL", raising=False)
    shutil.copy(ROOT / "src" / "ovita" / "data" / "tabletop.json", "scene.json")
    return tmp_path


def blocks(name, language):
    return [text for found, text in BLOCK.findall(TEXTS[name]) if found == language]


def commands(text):
    """The commands of ovita in a block of shell lines."""
    for line in text.replace("\\\n", " ").splitlines():
        words = shlex.split(line, comments=True)
        if words[:1] == ["ovita"]:
            yield [word for word in words[1:] if word not in ("&", "&&")]


def test_the_tutorial_works_as_printed_in_order(at_home):
    names = {}
    for language, text in BLOCK.findall(TEXTS["tutorial.md"]):
        if language == "python":
            exec(compile(text, "tutorial.md", "exec"), names)
            continue
        for command in commands(text):
            done = ovita(*command, cwd=at_home)
            assert done.returncode in (0, 5), f"{command}\n{done.stdout}{done.stderr}"
    assert {path.name for path in at_home.iterdir()} >= {"desk.json", "result.png", "result.html", "second.csv"}
    assert len(names["talk"].steps) == 2 and names["result"].usable


@pytest.mark.parametrize("name", [name for name in TEXTS if blocks(name, "sh")])
def test_every_command_on_a_page_is_one(name):
    """What needs a key, a robot or a camera is not run, but its command and options are read."""
    for text in blocks(name, "sh"):
        for words in commands(text):
            command, parent = cli, click.Context(cli, info_name="ovita")
            while isinstance(command, click.Group) and words:
                found = command.get_command(parent, words[0])
                assert found is not None, f"{name}: there is no command {words[0]!r}"
                command, words = found, words[1:]
                parent = click.Context(command, info_name=command.name, parent=parent)
            known = {option for parameter in command.params for option in (*parameter.opts, *parameter.secondary_opts)}
            given = {word.split("=")[0] for word in words if re.match(r"--?[a-z]", word)}
            assert given <= known | {"--help"}, f"{name}: {command.name} has no {given - known}"


@pytest.mark.parametrize("name", [name for name in TEXTS if blocks(name, "python") and name != "toolkit.md"])
def test_every_name_that_python_on_a_page_imports_is_there(name):
    for text in blocks(name, "python"):
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "ovita":
                module = importlib.import_module(node.module)
                assert all(hasattr(module, alias.name) for alias in node.names), f"{name}: {ast.unparse(node)}"
            if (
                isinstance(node, ast.Attribute)
                and isinstance(node.value, ast.Name)
                and node.value.id in ("ov", "ovita")
            ):
                assert hasattr(ov, node.attr), f"{name}: ovita.{node.attr}"


def test_every_public_name_is_in_the_reference_once():
    named = re.findall(r"^::: ovita\.(\w+)$", TEXTS["reference.md"], re.MULTILINE)
    assert sorted(named) == ov.__all__


def test_the_figures_of_the_honest_page_stand_where_it_says():
    rows = [line for line in re.split(r"\n\n|\n(?=[|-])", TEXTS["cannot.md"]) if "**" in line]
    assert len(rows) > 10
    for row in rows:
        text = " ".join(TEXTS[page] for page in re.findall(r"\]\(([\w-]+\.md)\)", row))
        words = " ".join(text.split())
        for figure in re.findall(r"\*\*(.*?)\*\*", " ".join(row.split())):
            assert figure in words, f"{figure} stands on none of the pages of: {row}"


def test_every_page_is_on_the_site_and_its_links_lead_somewhere():
    import tomllib

    def listed(entry):
        for value in entry.values():
            yield from [value] if isinstance(value, str) else (page for inner in value for page in listed(inner))

    project = tomllib.loads((ROOT / "zensical.toml").read_text(encoding="utf-8"))["project"]
    shown = [page for entry in project["nav"] for page in listed(entry)]
    assert sorted(shown) == sorted({page.name for page in PAGES} | set(SITE.TOP.values()))
    for name, text in TEXTS.items():
        page = SITE.page(text, ROOT if name == "README.md" else ROOT / "docs")
        for target in re.findall(r"\]\((?!\w+:)([^)#\s]+)", FENCE.sub("", page)):
            assert target in shown or (ROOT / "docs" / target).exists(), f"{name} leads to {target}"


def test_what_a_reader_without_a_network_would_miss_is_found(tmp_path):
    (tmp_path / "a.html").write_text(
        '<script src="https://x.org/a.js"></script><a href="b.html#here">b</a><a href="b.html#there">b</a>'
        '<a href="c.html">c</a><img src="no.png"><a href="https://x.org">x</a><a href="#top">t</a><p id="top">'
    )
    (tmp_path / "b.html").write_text('<h2 id="here">Here</h2><link rel="stylesheet" href="//fonts.org/f.css">')
    assert sorted(SITE.faults(tmp_path)) == [
        "a.html leads to b.html#there, which b.html does not have",
        "a.html leads to c.html, which is not there",
        "a.html leads to no.png, which is not there",
        "a.html loads https://x.org/a.js",
        "b.html loads //fonts.org/f.css",
    ]
