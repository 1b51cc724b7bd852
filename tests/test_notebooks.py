"""The notebooks of examples/ run from top to bottom in this process, without a kernel, and carry no output."""

import ast
import json
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[1] / "examples"


def run(name):
    """Run a notebook's cells in order; its names, and what each cell shows last."""
    notebook = json.loads((EXAMPLES / f"{name}.ipynb").read_text(encoding="utf-8"))
    cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert notebook["nbformat"] == 4 and not any(cell["outputs"] or cell["execution_count"] for cell in cells)
    names, shown = {"__name__": "__main__"}, []
    for i, cell in enumerate(cells):
        tree = ast.parse("".join(cell["source"]))
        last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
        exec(compile(tree, f"{name}, cell {i}", "exec"), names)
        if last is not None:
            shown.append(eval(compile(ast.Expression(last.value), f"{name}, cell {i}", "eval"), names))
    return names, shown


@pytest.fixture(autouse=True)
def alone(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.delenv("OVITA_MODEL", raising=False)


def test_first_adaptation():
    names, shown = run("first_adaptation")
    assert names["result"].status == "done" and "Plan" in shown[0]._repr_html_()
    assert shown[1] == ("done", (60, 4)) and 0.1 < shown[2] < 0.2
    assert shown[3][0] == "needs_confirmation" and "dance" in shown[3][1]


def test_own_robot():
    _, shown = run("own_robot")
    assert shown[0] == ("done", pytest.approx(0.4))
    assert shown[1].status in ("limited", "not_as_meant") and shown[1].adapted.positions[:, 2].max() <= 0.5
    assert shown[2][1] <= 0.25 + 1e-9


def test_batch_and_dataset():
    _, shown = run("batch_and_dataset")
    assert shown[0] == ["done"] * 9 and shown[1] == (9, "go left by 0.1")


def test_compare_writers():
    _, shown = run("compare_writers")
    assert [held for (name, _), held in shown[-1].items() if name == "builtin"] == [True, True, True]
    assert [held for (name, _), held in shown[-1].items() if name == "theirs"] == [True, False, False]


def test_every_notebook_is_tested():
    tested = {name.removeprefix("test_") for name in globals() if name.startswith("test_")}
    assert {path.stem for path in EXAMPLES.glob("*.ipynb")} <= tested
