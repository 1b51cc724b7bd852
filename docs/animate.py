"""Draw the first picture of the README: a sentence is typed, and the path moves as it says.

`python docs/animate.py` writes docs/images/adapt.gif (extra `plot`).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image

import ovita as ov
from ovita.plots import figure

ROOT = Path(__file__).parents[1]
SAID = ("Go left by 0.2", "Slow down near the cup", "Pass over the bottle")
WIDTH, TYPED, MOVED, REST = 760, 5, 8, 12


def frames(task: ov.Task) -> list[tuple[ov.Trajectory, str, int]]:
    """A path between before and after, what is written above it, and for how long [ms]."""
    talk = ov.Session(task.trajectory, task.scene, writer="builtin")
    shown: list[tuple[ov.Trajectory, str, int]] = []
    for said in SAID:
        before, result = talk.current, talk.say(said)
        after = result.adapted
        if result.status != "done" or len(before) != len(after):
            raise SystemExit(f"{said!r} is no good for the picture: {result.message}")
        for i in range(1, TYPED + 1):
            shown.append((before, f"> {said[: round(i * len(said) / TYPED)]}", 110))
        for share in np.linspace(0.0, 1.0, MOVED):
            eased = share * share * (3 - 2 * share)
            rows = (1 - eased) * before.to_array() + eased * after.to_array()
            shown.append((ov.Trajectory.from_array(rows), f"> {said}", 90))
        shown.append((after, f"> {said}     {result.message.split('.')[0]}.", 100 * REST))
    return shown


def drawn(task: ov.Task, now: ov.Trajectory, title: str) -> Image.Image:
    """One frame."""
    picture = figure(task.trajectory, now, task.scene, title=title)
    picture.set_dpi(WIDTH / picture.get_figwidth())
    picture.canvas.draw()
    return Image.fromarray(np.asarray(picture.canvas.buffer_rgba())[..., :3])


def without_blanks(pictures: list[Image.Image], kept: int = 14) -> list[Image.Image]:
    """The pictures without the broad bands that are blank in all of them."""
    shade = np.array([np.asarray(picture).min(axis=2).min(axis=1) for picture in pictures]).min(axis=0)
    blank = shade > 240
    run = np.array([np.argmax(~np.append(blank[i::-1], False)) for i in range(len(blank))])
    return [Image.fromarray(np.asarray(picture)[run < kept]) for picture in pictures]


def main() -> None:
    """Do it."""
    task = ov.load(ROOT / "src" / "ovita" / "data" / "tabletop.json")
    shown = frames(task)
    pictures = without_blanks([drawn(task, now, title) for now, title, _ in shown])
    palette = pictures[-1].quantize(48)
    pictures = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    path = ROOT / "docs" / "images" / "adapt.gif"
    times = [time for *_, time in shown]
    pictures[0].save(path, save_all=True, append_images=pictures[1:], duration=times, loop=0, optimize=True)
    print(f"{path}: {len(pictures)} frames, {path.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
