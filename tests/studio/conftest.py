"""A studio for tests: on a free port, with the built-in writer, in a folder of its own."""

from __future__ import annotations

import pytest

pytest.importorskip("viser", reason="the studio needs viser: pip install 'ovita[studio]'")

import numpy as np
from studio_tab import Tab

from ovita.dialogue.session import Session
from ovita.paths.trajectory import Trajectory
from ovita.studio import Studio, StudioSettings


@pytest.fixture
def template():
    return Session(Trajectory(np.array([[0.0, 0, 0], [1.0, 0, 0]]), np.array([0.1, 0.1])), writer="builtin")


@pytest.fixture
def start(template, tmp_path):
    """Starts studios; all of them, and their tabs, end with the test."""
    made = []

    def make(*paths, **settings):
        studio = Studio(
            StudioSettings(template, tuple(map(str, paths)), port=0, folder=tmp_path / "sessions", **settings)
        )
        made.append(studio)
        return studio

    yield make
    for studio in made:
        studio.stop()


@pytest.fixture
def visit():
    """Opens tabs; all of them are closed with the test."""
    tabs = []

    def come(studio, storage=None, **options):
        tab = Tab(studio.url, storage, **options)
        tabs.append(tab)
        tab.ready()
        tab.wait(lambda: studio.views)
        return tab

    yield come
    for tab in tabs:
        tab.close()
