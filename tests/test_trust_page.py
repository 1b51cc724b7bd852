"""The tests that docs/trust.md names are there."""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
NAMED = re.findall(r"`(tests/[\w/]+\.py)::(test_\w+)`", (ROOT / "docs/trust.md").read_text(encoding="utf-8"))


def names_of_tests(file):
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    return {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


def test_the_tests_that_stand_for_the_defects_exist():
    assert len(NAMED) > 50
    found = {file: names_of_tests(file) for file in {file for file, _ in NAMED}}
    assert not [f"{file}::{name}" for file, name in NAMED if name not in found[file]]
