"""docs/agents.md says what is so: the tools, the tests that it names, and the talk of the example."""

import runpy
from pathlib import Path

from ovita.serve.operations import OPERATIONS

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/agents.md").read_text(encoding="utf-8")


def test_every_tool_is_in_the_table_with_its_path():
    for operation in OPERATIONS.values():
        row = next(line for line in PAGE.splitlines() if line.startswith(f"| `{operation.name}` |"))
        path = operation.path.replace("/v1/tasks/{task}/", ".../").replace("{task}", "TASK")
        assert row.endswith(f"| `{operation.method} {path}` |")


def test_every_test_that_the_security_list_names_is_there():
    tests = "".join(path.read_text(encoding="utf-8") for path in Path(__file__).parent.glob("test_*.py"))
    named = {word for word in PAGE.split("`") if word.startswith("test_")}
    assert len(named) > 15 and all(f"def {name}(" in tests for name in named)


def test_the_talk_on_the_page_is_what_the_example_prints():
    talk = runpy.run_path(str(ROOT / "examples/agent_transcript.py"))["transcript"]()
    assert f"```\n{talk}```" in PAGE
    assert "refused: this client cannot ask a person" in talk and "released: False" in talk
