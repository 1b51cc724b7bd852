"""The studio: see a trajectory, say what should change, turn the knobs. One page in the browser, served by viser.

    Studio    the server; every browser that comes gets a Tab on a SessionController
    SessionController      one session with its lock, its worker threads and its journal; two tabs of a browser share it
    Tab      what one tab shows: panels on the left and right, the scene in the middle

Only `Session` does work; everything here shows it and passes on what a person does.
"""

from __future__ import annotations

from ovita.studio.app import Studio, StudioSettings

__all__ = ["Studio", "StudioSettings"]
