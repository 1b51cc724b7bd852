"""The picture of the Look panel: boxes over it that a person drags, and what is sent when one was dragged.

The browser's side is the script in head.html. It writes "box NUMBER: x0 y0 x1 y1" into a text field of the panel, which
a person may write there too.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from ovita.errors import RequestError
from ovita.limits.obstacles import is_support
from ovita.paths.scene import SceneObject

if TYPE_CHECKING:
    from ovita.perceive.pointed import Rectangle
    from ovita.perceive.view import View

FIELD = "box "
"""What the text of the field begins with, by which the script finds it."""


def picture_html(view: View, items: Sequence[SceneObject], time: int = 0) -> str:
    """The picture with a box over each object, numbered from 1: small ones over large ones, so that each can be held.

    What things stand on has no box: it is seen in the whole picture.

    Args:
        view: What was looked at.
        items: What was found.
        time: How often it was drawn. A browser told the same again changes nothing: a box would stay where it was left.
    """
    from ovita.perceive.overlay import INKS
    from ovita.perceive.pointed import rectangle_of

    high, wide = view.shape
    boxes: list[tuple[float, str]] = []
    for number, item in enumerate(items, 1):
        there = None if is_support(item) else rectangle_of(view, item)
        if there is None:
            continue
        x0, y0, x1, y1 = there
        ink = "#{:02x}{:02x}{:02x}".format(*INKS[(number - 1) % len(INKS)])
        drawn = (
            f'<rect data-box="{number}" x="{x0:.1f}" y="{y0:.1f}" width="{x1 - x0:.1f}" height="{y1 - y0:.1f}"'
            f' stroke="{ink}"><title>{escape(item.name)}</title></rect>'
            f'<text x="{x0 + 0.01 * wide:.1f}" y="{max(y0 - 0.012 * wide, 0.04 * wide):.1f}" fill="{ink}"'
            f' font-size="{0.04 * wide:.1f}">{number} {escape(item.name[:40])}</text>'
        )
        boxes.append(((x1 - x0) * (y1 - y0), drawn))
    over = "".join(drawn for _, drawn in sorted(boxes, key=lambda box: -box[0]))
    return (
        f'<div class="ov"><svg class="boxes" data-time="{time}" viewBox="0 0 {wide} {high}">'
        f'<image width="{wide}" height="{high}" href="{_data(view)}"/>{over}</svg>'
        '<p class="soft">Drag a box to move it, its edges to resize it: what is there is measured anew.</p></div>'
    )


def _data(view: View) -> str:
    """The bare picture as a JPEG in an address."""
    from PIL import Image

    from ovita.perceive.overlay import backdrop

    stream = io.BytesIO()
    Image.fromarray(backdrop(view)).save(stream, "JPEG", quality=80)
    return "data:image/jpeg;base64," + base64.b64encode(stream.getvalue()).decode()


def moved_box(text: str, count: int) -> tuple[int, Rectangle]:
    """Which box was dragged, from 0, and where it is now.

    Raises:
        RequestError: If the text says neither.
    """
    word, *values = text.replace(":", " ").split() or [""]
    try:
        number, x0, y0, x1, y1 = map(float, values)
    except ValueError:
        number, x0, y0, x1, y1 = (float("nan"),) * 5
    if word != FIELD.strip() or number not in range(1, count + 1) or not np.isfinite((x0, y0, x1, y1)).all():
        raise RequestError(f"{text[:60]!r} moves no box; write 'box 1: x0 y0 x1 y1' in pixels, with 1 to {count}")
    if x1 - x0 < 1 or y1 - y0 < 1:
        raise RequestError(f"{text[:60]!r} holds no pixel; the second corner must be right of and below the first")
    return int(number) - 1, (x0, y0, x1, y1)
