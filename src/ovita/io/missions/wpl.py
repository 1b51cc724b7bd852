"""QGC WPL 110 text (.waypoints, .txt, .wpl): one mission item a line, its twelve columns separated by tabs.

    index  current  frame  command  param1 .. param4  x (latitude)  y (longitude)  z (altitude)  autocontinue

Item 0 is home where it is a NAV_WAYPOINT above sea level, as ArduPilot's ground stations write it.
"""

from __future__ import annotations

import math

from ovita.errors import FormatError
from ovita.io.documents import LARGEST, show
from ovita.io.files import errors_of
from ovita.io.geodesy import Home
from ovita.io.missions.mission import CHANGE_SPEED, DEFAULT_SPEED, GLOBAL, WAYPOINT, Item, Mission, numbered
from ovita.io.missions.stations import task_of
from ovita.io.task import Task

MAGIC = "QGC WPL"
_VERSIONS = ("110", "120")
_COLUMNS = 12


def parse(content: str, file: str, home: Home | None = None) -> Task:
    """Read a task from QGC WPL text; `home` replaces the file's own.

    Raises:
        FormatError: If something in it is malformed; names the line.
    """
    lines = [(line.split(), i) for i, line in enumerate(content.splitlines(), start=1) if line.strip()]
    version = lines[0][0][2:]
    if " ".join(lines[0][0][:2]) != MAGIC or version[:1] not in [[v] for v in _VERSIONS]:
        raise FormatError(file, "the first line is not 'QGC WPL 110'; this is not a waypoint file that ovita reads")
    items = []
    for i, (cells, line) in enumerate(lines[1:]):
        items.append(_item(cells, i, line, file))
    listed = items[0] if items and items[0].command == WAYPOINT and items[0].frame == GLOBAL else None
    if listed is not None:
        items = items[1:]
        place = [value for value in listed.params[4:] if value is not None]
        with errors_of(file):
            home = home or (Home(*place) if place[:2] != [0.0, 0.0] else None)
    if home is None:
        problem = "there is no home position (item 0); say where it is: --home latitude,longitude,altitude"
        raise FormatError(file, problem)
    said: tuple[str, ...] = ()
    if not any(item.command == CHANGE_SPEED for item in items):
        said = (f"no speed is commanded; assumed {DEFAULT_SPEED:g} m/s",)
    with errors_of(file):
        return task_of(Mission(home, tuple(items), listed, DEFAULT_SPEED, {"format": "wpl"}), file, said)


def dumps(mission: Mission) -> str:
    """Write a mission as QGC WPL 110 text, home first unless it came from a file without."""
    bare = mission.rest.get("format") == "wpl" and mission.home_item is None
    lines = [f"{MAGIC} {_VERSIONS[0]}"]
    for seq, item in enumerate(numbered(mission, with_home=not bare)):
        params = [_cell(value) for value in item.params]
        columns = [str(seq), str(int(seq == 0)), str(item.frame), str(item.command), *params]
        lines.append("\t".join([*columns, str(int(item.autocontinue))]))
    return "\n".join(lines) + "\n"


def looks_like(content: str) -> bool:
    """Whether a text begins as such a file does."""
    return content.lstrip().startswith(MAGIC)


def _item(cells: list[str], i: int, line: int, file: str) -> Item:
    if len(cells) != _COLUMNS:
        raise FormatError(file, f"line {line} holds {len(cells)} values, expected {_COLUMNS}")
    try:
        values = [math.nan if "_" in cell else float(cell) for cell in cells]
    except ValueError:
        bad = next(cell for cell in cells if not _is_number(cell))
        raise FormatError(file, f"line {line}: {show(bad)} is not a number") from None
    whole = [values[k] for k in (0, 1, 2, 3, 11)]
    if any(not math.isfinite(v) or v != int(v) for v in whole):
        raise FormatError(file, f"line {line}: index, current, frame, command and autocontinue are whole numbers")
    params = tuple(None if math.isnan(v) else v for v in values[4:11])
    if any(v is not None and abs(v) > LARGEST for v in params):
        raise FormatError(file, f"line {line} holds a number beyond the largest magnitude {LARGEST:g}")
    return Item(int(values[3]), int(values[2]), params, values[11] != 0, (int(values[0]),))


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _cell(value: float | None) -> str:
    """A parameter so that it reads back exactly; what is not set is 0, as ground stations write it."""
    if value is None:
        return "0"
    return str(int(value)) if value == int(value) and abs(value) < 1e15 else repr(value)
