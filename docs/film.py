"""The film of the README: the studio's real page, used for a minute; `make film` takes it anew.

Needs playwright and a Chromium (OVITA_CHROMIUM may name it). Every picture is one of the page; how long it is shown is
set here, since a machine without a graphics card draws the page slower than a person works.
"""

from __future__ import annotations

import io
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from ovita.dialogue.session import Session
from ovita.paths.robot import Robot
from ovita.paths.trajectory import Trajectory
from ovita.studio import Studio, StudioSettings

OUT = Path(__file__).parent / "images" / "studio.gif"
SCENE = Path(__file__).parent.parent / "src" / "ovita" / "data" / "tabletop.json"
SIZE, SHOWN = (1366, 768), (900, 506)
COLOURS, LARGEST = 96, 3_000_000
FLAGS = ("--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
SAY = "Go left by 0.2 and slow down near the cup"

CAPTION = """text => {
  let node = document.getElementById("film");
  if (!node) {
    node = document.createElement("div");
    node.id = "film";
    node.style = "position:fixed;left:50%;top:14px;transform:translateX(-50%);z-index:400;padding:8px 18px;"
      + "border-radius:20px;background:#27547dee;color:#fff;font:600 19px system-ui,sans-serif;pointer-events:none;"
      + "white-space:nowrap";
    document.body.append(node);
  }
  node.textContent = text;
}"""


class Film:
    """Pictures of a page, and how long each is shown [s]."""

    def __init__(self, page: Any) -> None:
        self.page = page
        self.pictures: list[tuple[Image.Image, float]] = []

    def take(self, seconds: float, caption: str | None = None) -> None:
        """Show the page as it is."""
        if caption is not None:
            self.page.evaluate(CAPTION, caption)
        picture = Image.open(io.BytesIO(self.page.screenshot())).convert("RGB").resize(SHOWN, Image.Resampling.LANCZOS)
        self.pictures.append((picture, seconds))

    def type(self, text: str) -> None:
        """Type into the field, some letters a picture, and press Enter."""
        box = self.page.locator("form input").first
        box.click()
        for first in range(0, len(text), 9):
            box.press_sequentially(text[first : first + 9])
            self.take(0.45)
        box.press("Enter")

    def save(self, path: Path) -> None:
        """Write the film, in one table of colours so that what stands still costs nothing."""
        sample = Image.fromarray(
            np.concatenate([np.asarray(p)[::2] for p, _ in self.pictures[:: max(len(self.pictures) // 10, 1)]])
        )
        table = sample.quantize(COLOURS, method=Image.Quantize.MEDIANCUT)
        frames = [picture.quantize(palette=table, dither=Image.Dither.NONE) for picture, _ in self.pictures]
        times = [round(1000 * seconds) for _, seconds in self.pictures]
        frames[0].save(path, save_all=True, append_images=frames[1:], duration=times, loop=0, optimize=True)


def until(condition: Callable[[], Any], seconds: float = 120.0) -> None:
    """Wait until something holds, and a moment more for the picture."""
    ends = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > ends:
            sys.exit("the page did not come so far")
        time.sleep(0.1)
    time.sleep(1.2)


def tab(page: Any, name: str) -> None:
    """Show a tab."""
    page.get_by_text(name, exact=True).locator("visible=true").first.click()
    time.sleep(0.6)


def play(film: Film, view: Any, caption: str) -> None:
    """Both trajectories in motion."""
    film.take(0.3, caption)
    for moment in np.linspace(0.2, view.player.duration, 18):
        view.player.heard("moment", {"at": float(moment)})
        view.player._tell()
        time.sleep(0.5)
        film.take(0.3)


def take(page: Any, view: Any) -> Film:
    """The minute."""
    film = Film(page)
    talk = view.controller

    def turns() -> int:
        return len(talk.session.steps)

    film.take(3.5, "A robot's path, and what stands around it")
    film.take(1.0, "Say what should change")
    film.type(SAY)
    until(lambda: turns() == 1)
    film.take(4.0, "The adapted path is red; what came out is measured")
    film.take(0.8, "Every number is a knob")
    slider = page.locator("[role=slider]:visible").first
    slider.focus()
    for _ in range(8):
        for _ in range(5):
            page.keyboard.press("ArrowRight")
        time.sleep(0.8)
        film.take(0.4)
    until(lambda: turns() == 2)
    film.take(2.0)
    play(film, view, "Play both in true time")
    tab(page, "Constraints")
    film.take(1.5, "The robot's limits, checked by code of their own")
    talk.act(lambda session: session.change("limits: arm", robot=Robot.preset("arm")))
    until(lambda: turns() == 3)
    film.type("move up by 3 m")
    until(lambda: talk.busy is None and (turns() == 4 or talk.session.pending is not None))
    if talk.session.pending is not None:
        film.take(3.0, "A reading that is not certain waits for your yes")
        page.get_by_role("button", name="Accept").click()
        until(lambda: turns() == 4)
    film.take(5.0, "Not green: what the limits took back is said")
    page.locator("button.turn", has_text="\u2192").first.click()
    until(lambda: turns() == 2)
    film.take(3.0, "Every turn is kept: click to go on from it")
    tab(page, "Robot")
    unset = page.locator("input[value='none']:visible")
    if unset.count():  # else it is the robot whose limits hold
        unset.first.click()
        page.get_by_role("option", name="drone").click()
    until(lambda: view.puppet._motion is not None)
    page.get_by_role("button", name="Let it follow, and report").click()
    page.wait_for_selector("text=Tracking error")
    play(film, view, "A simulated robot follows, and reports")
    film.take(3.0)
    page.locator("[data-do='look top']").click()
    time.sleep(3.0)
    film.take(2.5, "Look from above, or work in the dark")
    page.locator("[data-do='dark']").click()
    page.locator("[data-do='look fit']").click()
    time.sleep(4.0)
    film.take(3.5)
    film.take(3.5, "ovita studio: no key, no network")
    return film


def main() -> None:
    """Take the film and write it."""
    from playwright.sync_api import sync_playwright

    browser_at = os.environ.get("OVITA_CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
    template = Session(Trajectory(np.array([[0.0, 0, 0], [1.0, 0, 0]]), np.array([0.1, 0.1])), writer="builtin")
    with tempfile.TemporaryDirectory() as folder:
        studio = Studio(StudioSettings(template, (str(SCENE),), port=0, folder=Path(folder)))
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=browser_at, args=[*FLAGS])
            page = browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]})
            page.set_default_timeout(180_000)
            page.goto(studio.url)
            until(lambda: studio.views)
            page.wait_for_selector("text=Change how the robot moves by saying so.")
            notice = page.locator(".mantine-Notification-root", has_text="Software WebGL")
            if notice.count():
                notice.evaluate("node => { node.style.display = 'none' }")
            time.sleep(2.0)
            film = take(page, studio.views[0])
            browser.close()
        studio.stop()
    film.save(OUT)
    seconds, size = sum(t for _, t in film.pictures), OUT.stat().st_size
    print(f"{OUT}: {len(film.pictures)} pictures, {seconds:.0f} s, {size / 1e6:.2f} MB")
    if size > LARGEST:
        sys.exit(f"larger than {LARGEST / 1e6:g} MB")


if __name__ == "__main__":
    main()
