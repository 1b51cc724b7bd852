"""The shape of the house: data flows one way, a file is a subject, and a concept has one name."""

import ast
import re
import runpy
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path

ROOT = Path(__file__).parents[1]
SRC = ROOT / "src" / "ovita"


@dataclass(frozen=True)
class Outline:
    """What is looked at in a module; the whole trees of all would keep the garbage collector busy for seconds."""

    imports: tuple[ast.Import | ast.ImportFrom, ...]
    classes: tuple[str, ...]


@cache
def modules() -> dict[str, Outline]:
    found = {}
    for path in sorted(SRC.rglob("*.py")):
        nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
        imports = tuple(node for node in nodes if isinstance(node, ast.Import | ast.ImportFrom))
        classes = tuple(node.name for node in nodes if isinstance(node, ast.ClassDef))
        found[path.relative_to(SRC).as_posix()] = Outline(imports, classes)
    return found


LAYERS = (
    ("errors", "units"),
    ("text",),
    ("plugins", "workers"),
    ("paths",),
    ("toolkit", "limits", "io"),
    ("measure", "policy"),
    ("plots",),
    ("request",),
    ("instruct",),
    ("writers",),
    ("result",),
    ("chain",),
    ("baselines", "dialogue"),
    ("gate", "perceive", "sim"),
    ("sources",),
    ("bench", "serve", "studio"),
    ("augment", "study"),
    ("cli",),
    ("__main__",),
)
LEVEL = {name: level for level, names in enumerate(LAYERS) for name in names}


def imported(module: Outline) -> set[str]:
    names: set[str] = set()
    for node in module.imports:
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("ovita."):
            names.add(node.module.split(".")[1])
        elif isinstance(node, ast.ImportFrom) and node.module == "ovita":
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.Import):
            names |= {a.name.split(".")[1] for a in node.names if a.name.startswith("ovita.")}
    return names & set(LEVEL)


def test_imports_go_down():
    wrong = []
    for path, module in modules().items():
        home = path.split("/")[0].removesuffix(".py")
        if home == "__init__":
            continue
        assert home in LEVEL, f"{home} has no layer; add it to LAYERS and to docs/architecture.md"
        wrong += [f"{path} imports {name}" for name in imported(module) - {home} if LEVEL[name] >= LEVEL[home]]
    assert not wrong, "a module imports only from layers below its own:\n" + "\n".join(wrong)


def test_a_file_is_a_subject():
    names = {path.rsplit("/")[-1] for path in modules()}
    assert not names & {"utils.py", "helpers.py", "misc.py"}
    long = {path: n for path in modules() if (n := len((SRC / path).read_text().splitlines())) > 650}
    assert not long, f"is this one subject? {long}"


MAY_MATCH_TEXT = {
    # What people wrote: instructions, feedback, limits in words, and names of objects.
    "augment/wording.py",
    "bench/generate.py",
    "dialogue/pointing.py",
    "instruct/landmarks.py",
    "dialogue/parameters.py",
    "instruct/notation.py",
    "instruct/numerals.py",
    "instruct/objects.py",
    "instruct/sketch.py",
    "limits/problem.py",
    "limits/stated.py",
    "paths/scene.py",
    "sources/places.py",
    "writers/prompt.py",
    "writers/generate.py",
    # What models wrote: replies, policies and the exceptions these raise, explanations.
    "errors.py",
    "text.py",
    "policy/check.py",
    "policy/reading.py",
    "writers/explain.py",
    "writers/models/exchange.py",
    # What files hold: data, shipped examples, docstrings of the catalogue.
    "bench/dataset.py",
    "io/json_.py",
    "io/tables.py",
    "toolkit/catalogue.py",
    "writers/examples.py",
    # What comes from outside and is checked or escaped: addresses, names, tokens, keys, control characters.
    "cli/common.py",
    "io/bags.py",
    "io/links.py",
    "study/material.py",
    "studio/security.py",
    "studio/sessions.py",
    "writers/models/catalogue.py",
    "writers/models/chat.py",
}


def test_no_part_reads_a_sentence_of_another():
    def matches(node: ast.Import | ast.ImportFrom) -> bool:
        return "re" in ([a.name for a in node.names] if isinstance(node, ast.Import) else [node.module])

    found = {path for path, module in modules().items() if any(map(matches, module.imports))}
    assert found == MAY_MATCH_TEXT, f"parts talk in data; which text is matched here? {found ^ MAY_MATCH_TEXT}"


def test_no_class_name_twice():
    homes: dict[str, list[str]] = {}
    for path, module in modules().items():
        for name in module.classes:
            homes.setdefault(name, []).append(path)
    twice = {name: where for name, where in homes.items() if len(where) > 1}
    assert not twice, f"one concept, one name: {twice}"


def test_one_instruction_enters_few_files_and_the_page_names_them(tmp_path, monkeypatch):
    monkeypatch.delenv("OVITA_MODEL", raising=False)
    scene = tmp_path / "scene.json"
    scene.write_text((files("ovita") / "data" / "tabletop.json").read_text(encoding="utf-8"), encoding="utf-8")
    entered = runpy.run_path(str(ROOT / "benchmarks" / "trip.py"))["files_entered"](scene)
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    told = re.search(r"(\d+) files are entered:\n(.*?)\nwarm", page, re.DOTALL)
    assert told is not None
    named = told[2].replace(">", " ").split()
    assert len(named) == int(told[1]) == 53, "a file more is a step more to follow: does the instruction need it?"
    assert named == entered
