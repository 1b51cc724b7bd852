"""Points of the compass as directions of the scene's frame: y is north, as in REP 103; in NED x is north."""

from __future__ import annotations

import re

import numpy as np

from ovita.paths.scene import Scene

POINTS = {"north": (0.0, 1.0), "south": (0.0, -1.0), "east": (1.0, 0.0), "west": (-1.0, 0.0)}
"""Each point of the compass in x and y."""

_POINT = re.compile(rf"\b({'|'.join(POINTS)})(?:ern|erly|wards?|bound)?\b", re.IGNORECASE)


def on_axes(text: str, scene: Scene) -> tuple[str, str]:
    """An utterance with the scene's direction words for points of the compass, and what they were taken for, or "".

    Words in the names of objects ("north gate") stay, and so do all of them where there is such an object.
    """
    if any(_POINT.search(item.name) for item in scene.objects):
        return text, ""
    taken: dict[str, str] = {}
    north = "x" if scene.frame.name == "ned" else "y"

    def direction(found: re.Match[str]) -> str:
        point = found[1].lower()
        along = POINTS[point][:: -1 if north == "x" else 1]
        word = next(iter(scene.frame.words(np.array([*along, 0.0]))))
        taken[point] = word
        return word

    turned = _POINT.sub(direction, text)
    told = " and ".join(f"{point} is {word}" for point, word in taken.items())
    return turned, f"It is taken that {told}, as {north} points north." if told else ""
