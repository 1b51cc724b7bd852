"""Where the joints of a robot are now: a JointState from a file, a bag or a live topic."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from typing import Any

from ovita.errors import FormatError, LinkError, MissingExtra
from ovita.io import bags
from ovita.io.documents import NONE, Choices, number_problem
from ovita.io.files import file_name, is_address, is_bag, read_text, suffix
from ovita.io.links import Address
from ovita.io.recorded import JOINT_STATE

STATE_TOPIC = "/joint_states"


def joint_state(place: str, choices: Choices = NONE) -> dict[str, float]:
    """The last position of every joint [rad or m] in a file, a bag, or on a live topic such as ros2:/joint_states.

    A file is JSON or YAML: names with their positions, or `name` and `position` as `ros2 topic echo --once` prints
    them.

    Raises:
        FormatError: If the file holds no joint state.
        LinkError: If none comes.
        MissingExtra: If a package is missing.
    """
    if is_address(place):
        return _live(Address.parse(place))
    if is_bag(place):
        return _recorded(place, choices)
    document = _document(place)
    if not isinstance(document, Mapping):
        raise FormatError(file_name(place), "holds no joint state; write a table of joint names and positions [rad]")
    if "name" in document or "position" in document:
        return _paired(document.get("name"), document.get("position"), file_name(place))
    return _paired(list(document), list(document.values()), file_name(place))


def _paired(names: Any, values: Any, where: str) -> dict[str, float]:
    """Names with their positions."""
    names, values = _items(names), _items(values)
    if not names or len(names) != len(values):
        raise FormatError(where, f"holds {len(names)} joint names and {len(values)} positions; give one for each")
    if len(set(names)) != len(names):
        raise FormatError(where, "names a joint twice")
    for name, value in zip(names, values, strict=True):
        problem = number_problem(value)
        if problem:
            raise FormatError(where, problem, key=str(name))
    return {str(name): float(value) for name, value in zip(names, values, strict=True)}


def _items(values: Any) -> Sequence[Any]:
    if hasattr(values, "tolist"):
        values = values.tolist()
    return list(values) if isinstance(values, list | tuple) else []


def _document(place: str) -> Any:
    text = read_text(place)
    if suffix(place) not in (".yaml", ".yml"):
        try:
            return json.loads(text)
        except ValueError as error:
            raise FormatError(file_name(place), f"this is not JSON ({error}); YAML ends in .yaml") from None
    try:
        from ruamel.yaml import YAML
        from ruamel.yaml.error import YAMLError
    except ImportError:
        raise MissingExtra("ruamel.yaml", "ros") from None
    try:
        return next(iter(YAML(typ="safe").load_all(text)), None)
    except YAMLError as error:
        raise FormatError(file_name(place), f"this is not YAML ({' '.join(str(error).split())[:120]})") from None


def _recorded(place: str | os.PathLike[str], choices: Choices) -> dict[str, float]:
    """The last state of every joint in a bag; several publishers may each know some of them."""
    file, found = file_name(place), dict[str, float]()
    with bags.opened(place) as bag:
        wanted = [c for c in bag.connections if c.msgtype == JOINT_STATE and choices.topic in (None, c.topic)]
        for connection, _, data in bag.messages(connections=wanted) if wanted else ():
            message = bag.deserialize(data, connection.msgtype)
            found |= _paired(message.name, message.position, f"{file} {connection.topic}")
    if not found:
        on = f" on {choices.topic}" if choices.topic else ""
        raise FormatError(file, f"holds no {JOINT_STATE}{on}; record one: ros2 bag record {STATE_TOPIC}")
    return found


def _live(address: Address) -> dict[str, float]:
    if address.bus != "ros2":
        raise LinkError(f"{address}: joint states come from ROS 2 topics, such as ros2:{STATE_TOPIC}")
    from ovita.io import ros2

    came = ros2.capture(address, lambda there: [address.target], bool)
    fitting = [one.message for one in came if one.type == JOINT_STATE]
    if not fitting:
        where = f"on {address.target} in domain {address.domain} within {address.timeout:g} s"
        raise LinkError(f"{address}: no {JOINT_STATE} came {where}; so nobody knows where the arm is")
    return _paired(fitting[-1].name, fitting[-1].position, str(address))
