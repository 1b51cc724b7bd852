"""The README's Python runs, and its commands exist."""

import re
import shlex
from pathlib import Path

import pytest

from command_line import ovita
from ovita.cli.main import COMMANDS

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_python_blocks_run(tmp_path, monkeypatch):
    blocks = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    assert blocks
    monkeypatch.chdir(tmp_path)
    for block in blocks:
        exec(compile(block.replace('"src/', f'"{ROOT}/src/'), "README.md", "exec"), {})
    assert (tmp_path / "result.json").exists()


def test_the_first_commands_work_as_printed_in_order(tmp_path):
    shell = "\n".join(re.findall(r"```sh\n(.*?)```", README, re.DOTALL))
    lines = [line.split("#")[0].strip() for line in shell.splitlines()]
    assert lines[0] == "make demo" and ". .venv/bin/activate" in lines
    target = re.search(r"^demo:.*\n\t(.*)$", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    assert target and target[1] == "$(BIN)/ovita demo"
    commands = ["ovita demo", *(line for line in lines if line.startswith("ovita "))]
    assert len(commands) >= 6
    printed = ""
    for command in commands:
        done = ovita(*shlex.split(command)[1:], cwd=tmp_path, stdin="/quit\n")
        assert done.returncode in (0, 5), f"{command}\n{done.stdout}{done.stderr}"
        printed += done.stdout
    report = re.search(r"```\n(Done\..*?)```", README, re.DOTALL)
    assert report
    for line in report[1].splitlines()[1:]:
        assert line.strip() in ("", "...") or line in printed, f"README prints {line!r}, ovita does not"


def test_every_command_is_described():
    for name in COMMANDS:
        assert f"`ovita {name}" in (ROOT / "docs" / "commands.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("page", [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), ROOT / "CONTRIBUTING.md"])
def test_links_lead_somewhere(page):
    for target in re.findall(r"\]\(([^)#:]+)\)", page.read_text(encoding="utf-8")):
        assert (page.parent / target).exists(), f"{page.name} links to {target}, which is not there"
