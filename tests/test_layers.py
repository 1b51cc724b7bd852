"""A module imports only from layers below its own, also inside functions."""

import ast
from pathlib import Path

import pytest

SRC = Path(__file__).parents[1] / "src" / "ovita"

LAYERS = [
    {"errors"},
    {"trajectory", "scene", "robot"},
    {"toolkit", "formats", "constraints"},
    {"policy", "changes", "links"},
    {"language"},
    {"chain", "adaptation"},
    {"history"},
    {"turns"},
    {"gate", "session", "plots", "baselines", "sim", "perception"},
    {"bench", "joints", "studio"},
    {"cli", "__main__"},
]
LEVEL = {name: level for level, names in enumerate(LAYERS) for name in names}
MODULES = sorted(p for p in SRC.rglob("*.py") if p != SRC / "__init__.py")


def package_of(path: Path) -> str:
    return path.relative_to(SRC).parts[0].removesuffix(".py")


def imported(path: Path) -> set[str]:
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("ovita."):
            names.add(node.module.split(".")[1])
        elif isinstance(node, ast.ImportFrom) and node.module == "ovita":
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.Import):
            names |= {a.name.split(".")[1] for a in node.names if a.name.startswith("ovita.")}
    return names & set(LEVEL)


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(SRC)))
def test_imports_go_down(path):
    home = package_of(path)
    assert home in LEVEL, f"{home} has no layer; add it to LAYERS and to the design"
    for name in imported(path) - {home}:
        same_layer = {home, name} <= {"trajectory", "scene", "robot"} or {home, name} == {"chain", "adaptation"}
        same_layer = same_layer or home == "__main__"
        assert LEVEL[name] < LEVEL[home] or same_layer, f"{path.name} ({home}) imports {name} from a layer above"


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(SRC)))
def test_no_module_is_a_god(path):
    assert path.name not in ("utils.py", "helpers.py", "misc.py")
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 400
