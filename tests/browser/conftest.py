"""A real browser: Chromium with software WebGL, and a studio in this process."""

from __future__ import annotations

import faulthandler
import os
import shutil
import sys
from pathlib import Path

import pytest
from browser_page import at_rest, ready

CHROMIUM = os.environ.get("OVITA_CHROMIUM") or shutil.which("chromium") or shutil.which("chromium-browser")
FLAGS = (
    "--headless --no-sandbox --use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader "
    "--disable-background-networking --disable-component-update --disable-sync --no-first-run"
).split()


LIMIT_S = 150.0


def pytest_configure(config):
    config.addinivalue_line("markers", "browser: needs Chromium and playwright")
    config.addinivalue_line("markers", "limit_s(seconds): ends the run only after so long")


def pytest_collection_modifyitems(items):
    here = str(Path(__file__).parent) + os.sep
    for item in items:
        if str(item.path).startswith(here):
            item.add_marker(pytest.mark.browser)


@pytest.fixture(scope="session")
def chromium():
    sync_api = pytest.importorskip("playwright.sync_api", reason="browser tests need playwright")
    pytest.importorskip("viser", reason="the studio needs viser: pip install 'ovita[studio]'")
    if CHROMIUM is None:
        pytest.skip("browser tests need Chromium; OVITA_CHROMIUM may name it")
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield browser
        browser.close()


@pytest.fixture(autouse=True)
def no_hanging(request):
    """Ends the run, with a stack of every thread, where a test hangs in something that has no time limit."""
    longer = request.node.get_closest_marker("limit_s")
    faulthandler.dump_traceback_later(longer.args[0] if longer else LIMIT_S, exit=True, file=sys.__stderr__)
    yield
    faulthandler.cancel_dump_traceback_later()


@pytest.fixture(scope="session")
def start(tmp_path_factory):
    """Starts studios that keep their sessions in one folder."""
    import numpy as np

    from ovita.dialogue.session import Session
    from ovita.paths.trajectory import Trajectory
    from ovita.studio import Studio, StudioSettings

    made, folder = [], tmp_path_factory.mktemp("studio") / "sessions"

    def make(*paths, port=0, **settings):
        template = Session(Trajectory(np.array([[0.0, 0, 0], [1.0, 0, 0]]), np.array([0.1, 0.1])), writer="builtin")
        made.append(Studio(StudioSettings(template, tuple(map(str, paths)), port=port, folder=folder, **settings)))
        return made[-1]

    yield make
    for studio in made:
        studio.stop()


@pytest.fixture(scope="session")
def studio(start):
    """One for several tests, since each browser has its own session."""
    return start()


@pytest.fixture
def browser(chromium):
    """Opens browsers that know nothing of each other; what they ask of other machines is kept in `asked`."""
    contexts = []

    def come(studio, width=1120, height=640, bare=False):
        context = chromium.new_context(viewport={"width": width, "height": height})
        contexts.append(context)
        page = context.new_page()
        page.set_default_timeout(40_000)
        page.asked, page.broken = [], []
        page.on("request", lambda request: page.asked.append(request.url))
        page.on("pageerror", lambda error: page.broken.append(str(error)))
        before = set(studio.views)
        page.goto(studio.url)
        ready(page, bare)
        (page.view,) = set(studio.views) - before
        return at_rest(page)

    yield come
    for context in contexts:
        context.close()
