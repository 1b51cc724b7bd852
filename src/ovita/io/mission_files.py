"""Mission files: QGroundControl's plans, whose every unread key is kept, and QGC WPL text."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any

from pydantic import BaseModel, Field

from ovita.errors import FormatError
from ovita.io.documents import LARGEST, NONE, VERDICT, Choices, Number, Task, cell_number, show, validated
from ovita.io.files import errors_of
from ovita.io.geodesy import Home
from ovita.io.json_ import check_values, parse_object
from ovita.io.json_ import dumps as json_dumps
from ovita.io.mission_checks import remarks
from ovita.io.missions import DEFAULT_SPEED, GLOBAL, WAYPOINT, Item, Mission, home_of, mission_from, numbered, task_of
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory

_MULTIROTOR = 2
_WITH_ALTITUDE = "Altitude"
_EMPTY: Mapping[str, Any] = {
    "fileType": "Plan",
    "version": 1,
    "groundStation": "ovita",
    "geoFence": {"circles": [], "polygons": [], "version": 2},
    "rallyPoints": {"points": [], "version": 2},
    "mission": {
        "version": 2,
        "firmwareType": 12,
        "vehicleType": _MULTIROTOR,
        "cruiseSpeed": 15,
        "hoverSpeed": 5,
        "globalPlanAltitudeMode": 1,
    },
}


def parse_plan(content: str, file: str, home: Home | None = None, heading: float | None = None) -> Task:
    """Read a task from the text of a plan; `home` replaces the plan's own, and front points to the `heading`."""
    document = parse_object(content, file)
    check_values(document, file)
    if document.get("fileType") != "Plan":
        raise FormatError(file, f"is {show(document.get('fileType'))}, expected 'Plan'", key="fileType")
    mission, verdict = document.get("mission"), document.pop(VERDICT, "")
    if not isinstance(mission, Mapping) or not isinstance(mission.get("items"), list):
        raise FormatError(file, "there is no mission with a list of items; save the plan again")
    speed_key = "hoverSpeed" if mission.get("vehicleType", _MULTIROTOR) == _MULTIROTOR else "cruiseSpeed"
    speed = validated(Number, mission.get(speed_key, DEFAULT_SPEED), file, f"mission.{speed_key}")
    if speed <= 0:
        raise FormatError(file, f"is {speed:g}, expected a speed > 0 m/s", key=f"mission.{speed_key}")
    items = tuple(_plan_item(item, i, file) for i, item in enumerate(mission["items"]))
    with errors_of(file):
        place = replace(home or _home(mission, file), heading=heading)
        read = Mission(place, items, None, speed, {**document, "mission": {**mission, "items": []}})
        task = task_of(read, file, f"{speed_key} ")
    return replace(task, verdict=verdict if isinstance(verdict, str) else "")


def dumps(
    file: str, trajectory: Trajectory, scene: Scene, choices: Choices = NONE, verdict: str = "", *, plan: bool
) -> tuple[str, tuple[str, ...]]:
    """The content of a plan or a WPL file for a trajectory in the scene's frame, and notes on what is lost."""
    mission, lost = mission_from(trajectory, scene, choices.home, heading=choices.heading, takeoff=choices.takeoff)
    notes = remarks(mission, trajectory.duration, lost, scene)
    if plan:
        return dumps_plan(mission, file, verdict), notes
    unsaid = (f"QGC WPL text has no room for the verdict ({verdict.partition(':')[0]})",) if verdict else ()
    return dumps_wpl(mission), notes + unsaid


def dumps_plan(mission: Mission, file: str, verdict: str = "") -> str:
    """Write a mission as a QGroundControl plan, keeping unread keys."""
    rest = mission.rest if mission.rest.get("fileType") == "Plan" else _EMPTY
    used = [i for item in mission.items for i in item.ids]
    fresh = max(used, default=0) + 1
    items = []
    for item in mission.items:
        items.append(_item_dict(item, item.ids[0] if item.ids else fresh))
        fresh += not item.ids and item.command >= 0
    home = [mission.home.latitude, mission.home.longitude, mission.home.height]
    body = rest.get("mission")
    body = {**(body if isinstance(body, Mapping) else {}), "plannedHomePosition": home, "items": items}
    return json_dumps({**rest, "mission": body, **({VERDICT: verdict} if verdict else {})}, file)


def _home(mission: Mapping[str, Any], file: str) -> Home:
    place = mission.get("plannedHomePosition")
    if not isinstance(place, list) or len(place) != 3 or place[:2] == [0, 0]:
        problem = "there is no home position; set it in QGroundControl, or say --home latitude,longitude,altitude"
        raise FormatError(file, problem)
    return Home(*validated(list[Number], place, file, "mission.plannedHomePosition"))


class _SimpleItem(BaseModel):
    command: int
    frame: int
    params: Annotated[list[Number | None], Field(min_length=7, max_length=7)]
    autoContinue: bool = True
    doJumpId: int | None = None


def _plan_item(item: object, i: int, file: str) -> Item:
    if isinstance(item, Mapping) and item.get("type") == "ComplexItem":
        return Item(-1, 2, raw=item)
    read = validated(_SimpleItem, item, file, f"mission.items[{i}]")
    ids = (i + 1 if read.doJumpId is None else read.doJumpId,)
    return Item(read.command, read.frame, tuple(read.params), read.autoContinue, ids, dict(item))  # type: ignore[call-overload]


def _item_dict(item: Item, jump: int) -> dict[str, Any]:
    """The item as the plan has it, with the parameters of the mission."""
    raw, params = dict(item.raw or {}), list(item.params)
    if item.command < 0 or (raw.get("type") == "SimpleItem" and params == list(raw["params"])):
        return raw
    height = {_WITH_ALTITUDE: params[6], "AMSLAltAboveTerrain": None}
    if raw.get("type") == "SimpleItem":
        # Equal numbers stay as they were written, 0 rather than 0.0.
        kept = [a if a == b else b for a, b in zip(raw["params"], params, strict=True)]
        moved = _WITH_ALTITUDE in raw and raw["params"][6] != params[6]
        return {**raw, **(height if moved else {}), "params": kept}
    mode = {0: 2, 5: 2, 3: 1, 6: 1}.get(item.frame)
    fresh = {"type": "SimpleItem", "command": item.command, "frame": item.frame, "autoContinue": item.autocontinue}
    return {**fresh, "doJumpId": jump, **({**height, "AltitudeMode": mode} if mode else {}), "params": params}


MAGIC = "QGC WPL"
_VERSIONS = ("110", "120")
_COLUMNS = 12


def parse_wpl(content: str, file: str, home: Home | None = None, heading: float | None = None) -> Task:
    """Read a task from QGC WPL text; `home` replaces the file's own, and front points to the `heading`."""
    lines = [(line.split(), i) for i, line in enumerate(content.splitlines(), start=1) if line.strip()]
    version = lines[0][0][2:]
    if " ".join(lines[0][0][:2]) != MAGIC or version[:1] not in [[v] for v in _VERSIONS]:
        raise FormatError(file, "the first line is not 'QGC WPL 110'; this is not a waypoint file that ovita reads")
    items = [_wpl_item(cells, line, file) for cells, line in lines[1:]]
    has_home = bool(items) and items[0].command == WAYPOINT and items[0].frame == GLOBAL
    listed = items.pop(0) if has_home else None
    with errors_of(file):
        home = home or home_of(listed)
        if home is None:
            problem = "there is no home position (item 0); say where it is: --home latitude,longitude,altitude"
            raise FormatError(file, problem)
        about = replace(home, heading=heading)
        return task_of(Mission(about, tuple(items), listed, DEFAULT_SPEED, {"format": "wpl"}), file)


def dumps_wpl(mission: Mission) -> str:
    """Write a mission as QGC WPL 110 text, home first unless it came from a file without."""
    bare = mission.rest.get("format") == "wpl" and mission.home_item is None
    lines = [f"{MAGIC} {_VERSIONS[0]}"]
    for seq, item in enumerate(numbered(mission, with_home=not bare)):
        params = [_cell(value) for value in item.params]
        columns = [str(seq), str(int(seq == 0)), str(item.frame), str(item.command), *params]
        lines.append("\t".join([*columns, str(int(item.autocontinue))]))
    return "\n".join(lines) + "\n"


def looks_like_wpl(content: str) -> bool:
    """Whether a text starts with the file's header."""
    return content.lstrip().startswith(MAGIC)


def _wpl_item(cells: list[str], line: int, file: str) -> Item:
    if len(cells) != _COLUMNS:
        raise FormatError(file, f"line {line} holds {len(cells)} values, expected {_COLUMNS}")
    numbers = [cell_number(cell, math.nan) for cell in cells]
    values = [number for number in numbers if number is not None]
    if len(values) < _COLUMNS:
        raise FormatError(file, f"line {line}: {show(cells[numbers.index(None)])} is not a number")
    seq, current, frame, command, *params, autocontinue = values
    if not all(map(float.is_integer, (seq, current, frame, command, autocontinue))):
        raise FormatError(file, f"line {line}: index, current, frame, command and autocontinue are whole numbers")
    if any(abs(v) > LARGEST for v in params):
        raise FormatError(file, f"line {line} holds a number beyond the largest magnitude {LARGEST:g}")
    set_ = tuple(None if math.isnan(v) else v for v in params)
    return Item(int(command), int(frame), set_, autocontinue != 0, (int(seq),))


def _cell(value: float | None) -> str:
    """A parameter that reads back exactly; unset is 0, as ground stations write it."""
    if value is None:
        return "0"
    return str(int(value)) if value == int(value) and abs(value) < 1e15 else repr(value)
