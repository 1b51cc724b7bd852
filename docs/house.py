"""Draw the house: every package of ovita as it stands in the code, lowest layer at the bottom, with its imports.

`python docs/house.py` writes docs/images/house.svg. An arrow that follows from others is left out.
"""

from __future__ import annotations

import ast
import html
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
SRC = ROOT / "src" / "ovita"
sys.path.insert(0, str(ROOT / "tests"))

from test_layers import LAYERS, imported  # noqa: E402

WIDTH, HEIGHT, GAP_X, GAP_Y, MARGIN = 232, 54, 22, 40, 24


def modules(name: str) -> list[Path]:
    """The files of a top-level module or package."""
    folder = SRC / name
    return sorted(folder.rglob("*.py")) if folder.is_dir() else [folder.with_suffix(".py")]


def summary(name: str) -> str:
    """The first words of a package's docstring, up to a colon or full stop."""
    folder = SRC / name
    text = ast.get_docstring(
        ast.parse((folder / "__init__.py" if folder.is_dir() else folder.with_suffix(".py")).read_text())
    )
    return (text or "").split("\n")[0].split(":")[0].split(".")[0].split(",")[0]


def edges(names: list[str]) -> dict[str, set[str]]:
    """For every package the packages that it imports, without what follows from others."""
    direct = {
        name: set().union(*(imported(ast.parse(p.read_text())) for p in modules(name))) & set(names) - {name}
        for name in names
    }
    below: dict[str, set[str]] = {}
    for name in names:  # lowest first
        below[name] = direct[name].union(*(below[other] for other in direct[name] if other in below))
    return {name: {a for a in found if not any(a in below[b] for b in found - {a})} for name, found in direct.items()}


def draw() -> str:
    """The picture as SVG."""
    layers = [layer for layer in LAYERS if layer != ("__main__",)]
    names = [name for layer in layers for name in layer]
    wide = max(len(layer) for layer in layers) * (WIDTH + GAP_X) - GAP_X
    tall = len(layers) * (HEIGHT + GAP_Y) - GAP_Y
    place: dict[str, tuple[float, float]] = {}
    for level, layer in enumerate(layers):
        row = len(layer) * (WIDTH + GAP_X) - GAP_X
        for k, name in enumerate(layer):
            place[name] = (
                MARGIN + (wide - row) / 2 + k * (WIDTH + GAP_X),
                MARGIN + (len(layers) - 1 - level) * (HEIGHT + GAP_Y),
            )
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {wide + 2 * MARGIN} {tall + 2 * MARGIN}"'
        ' font-family="sans-serif" font-size="12">',
        '<rect width="100%" height="100%" fill="#ffffff"/>',
        '<defs><marker id="a" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
        '<path d="M0 0L8 4L0 8z" fill="#8a97a8"/></marker></defs>',
    ]
    for name, found in edges(names).items():
        x, y = place[name]
        for other in sorted(found):
            u, v = place[other]
            a, b = (x + WIDTH / 2, y + HEIGHT), (u + WIDTH / 2, v - 2)
            bend = (b[1] - a[1]) / 2
            out.append(
                f'<path d="M{a[0]:.0f} {a[1]:.0f}C{a[0]:.0f} {a[1] + bend:.0f} {b[0]:.0f} {b[1] - bend:.0f}'
                f' {b[0]:.0f} {b[1]:.0f}" fill="none" stroke="#8a97a8" marker-end="url(#a)"/>'
            )
    for name, (x, y) in place.items():
        files = modules(name)
        lines = sum(len(p.read_text().splitlines()) for p in files)
        size = f"{len(files)} files, {lines:,} lines" if len(files) > 1 else f"{lines} lines"
        text = summary(name)
        text = text if len(text) <= 36 else text[:35].rsplit(" ", 1)[0] + " …"
        out += [
            f'<rect x="{x:.0f}" y="{y:.0f}" width="{WIDTH}" height="{HEIGHT}" rx="7" fill="#eef3fa" stroke="#3b6ea8"/>',
            f'<text x="{x + 10:.0f}" y="{y + 21:.0f}" font-size="15" font-weight="bold">{name}</text>',
            f'<text x="{x + WIDTH - 10:.0f}" y="{y + 21:.0f}" text-anchor="end" fill="#5a6675">{size}</text>',
            f'<text x="{x + 10:.0f}" y="{y + 41:.0f}" fill="#333">{html.escape(text)}</text>',
        ]
    return "\n".join([*out, "</svg>", ""])


if __name__ == "__main__":
    (ROOT / "docs" / "images" / "house.svg").write_text(draw(), encoding="utf-8")
