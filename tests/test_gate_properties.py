"""What holds of the gate for any result: `convert` warns exactly where it refuses, and numbers are numbers."""

import json
import random
from dataclasses import replace

import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from ovita.chain import adapt
from ovita.cli.transfer_ import convert, send
from ovita.errors import OvitaError
from ovita.gate import review
from ovita.io.json_ import seal
from ovita.limits import ConstraintOptions
from ovita.paths.robot import Box, Robot
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.request import Request

CELL = Robot("cell", Box((-2, -2, -1), (2, 2, 1)), max_speed=0.6, max_acceleration=5.0)
SCENE = Scene((SceneObject("cup", [0.5, 0.6, 0], [0.1, 0.1, 0.1]),))
PATH = Trajectory([[0.1 * i, 0, 0] for i in range(6)], [0.3] * 6)
FIELD = Robot("field", Box((-200, -200, 0), (200, 200, 60)), max_speed=8.0)
LEGS = Trajectory([[0, 20.0 * i, 20] for i in range(5)], [4.0, 4.0, 0.5, 4.0, 4.0])


def made(words, path=PATH, robot=CELL, **options):
    return adapt(Request(words, path, SCENE, robot), writer="builtin", **options).to_document()


@pytest.fixture(scope="module")
def results():
    return [
        made("go left by 0.2"),
        made("slow down near the cup and go up by 0.1"),
        made("go forward by 0.6", constraints=ConstraintOptions(enabled=False)),
        made("go up by 5", LEGS, FIELD),
        made("fly at a tenth of the speed in the second half", LEGS, replace(FIELD, max_speed=0.3)),
        made("flurb the snark"),
        made("go left by 0.2", robot=Robot.preset("none")),
    ]


def rows(document, change):
    return {**document, "adapted": [change(i, list(row)) for i, row in enumerate(document["adapted"])]}


CHANGES = {
    "nothing": lambda d: d,
    "another place": lambda d: rows(d, lambda i, row: [0.5, 0.6, 0.0, row[3]] if i == 2 else row),
    "too fast": lambda d: rows(d, lambda i, row: [*row[:3], 9.0]),
    "a standstill": lambda d: rows(d, lambda i, row: [*row[:3], 0.0]),
    "far away": lambda d: rows(d, lambda i, row: [row[0], row[1], 1e5, row[3]]),
    "beyond measure": lambda d: rows(d, lambda i, row: [row[0], row[1], 1e7, row[3]]),
    "a limit": lambda d: {**d, "robot": {**d["robot"], "max_speed": 0.1}},
    "the verdict": lambda d: {**d, "status": "infeasible"},
    "no verdict": lambda d: {**d, "constraints": None},
    "a promise": lambda d: {**d, "postconditions": [{**p, "arguments": {"x": []}} for p in d["postconditions"]]},
    "a knob": lambda d: {**d, "parameters": [{**p, "value": "0.2"} for p in d["parameters"]]},
}


@given(st.data())
@settings(derandomize=True, deadline=None, max_examples=30)
def test_convert_warns_exactly_where_the_gate_refuses(results, tmp_path_factory, data):
    folder = tmp_path_factory.mktemp("gate")
    document = data.draw(st.sampled_from(results))
    for name in data.draw(st.lists(st.sampled_from(list(CHANGES)), max_size=2)):
        document = CHANGES[name](document)
    if data.draw(st.integers(0, 3)):
        document = {**document, "sha256": seal(document)}
    file = folder / "r.json"
    file.write_text(json.dumps(document))
    ending = data.draw(st.sampled_from(["csv", "plan", "waypoints", "json"]))
    home = ["--home", "47.4,8.5,400"]
    told = CliRunner().invoke(convert, [str(file), str(folder / f"a.{ending}"), *home])
    sending = [str(file), "--to", str(folder / f"b.{ending}"), "--yes", "--log", str(folder / "log"), *home]
    sent = CliRunner().invoke(send, sending)
    if isinstance(told.exception, OvitaError):
        assert isinstance(sent.exception, OvitaError)
        return
    assert told.exit_code == 0, told.exception
    warned = [
        line.partition("would refuse it: ")[2] for line in told.output.splitlines() if "would refuse it: " in line
    ]
    if isinstance(sent.exception, OvitaError):
        assert warned == [f"{sent.exception}."]
        return
    refused = sent.output.partition("Refused, it does not go to")[2].splitlines()[1:]
    assert warned == ([" ".join(line.strip() for line in refused if line.strip())] if refused else [])
    assert sent.exit_code == (4 if warned else 0) and (folder / f"b.{ending}").exists() != bool(warned)


def leaves(value, path=()):
    if isinstance(value, dict | list):
        for key, item in value.items() if isinstance(value, dict) else enumerate(value):
            yield from leaves(item, (*path, key))
    else:
        yield path, value


def test_no_result_is_released_in_which_a_number_became_a_text(results, tmp_path):
    """500 results, sealed anew: half of them with a number in quotes, half with anything in any place."""
    chance, file, released = random.Random(19), tmp_path / "r.json", 0
    for turn in range(500):
        document = json.loads(json.dumps(chance.choice(results[:2])))
        numbers = {}
        for path, value in leaves(document):
            if turn % 2 or (isinstance(value, int | float) and not isinstance(value, bool)):
                numbers.setdefault(tuple(key for key in path if isinstance(key, str)), []).append(path)
        *way, last = chance.choice(numbers[chance.choice(sorted(numbers))])
        holder = document
        for key in way:
            holder = holder[key]
        was = holder[last]
        holder[last] = chance.choice([None, True, "", "x", [], {}, -1, 1e308, 10**400]) if turn % 2 else str(was)
        document["sha256"] = seal(document)
        file.write_text(json.dumps(document))
        try:
            found = review(str(file))
        except OvitaError as error:
            assert len(str(error).splitlines()) == 1
            continue
        assert turn % 2 or not found.released, (way, last, was)
        released += found.released
    assert released, "some places do not matter"


def test_an_object_may_be_called_by_a_number(tmp_path):
    scene = Scene((SceneObject("2", [0.5, 0.6, 0], [0.1, 0.1, 0.1]),))
    result = adapt(Request("go 0.1 closer to the 2", PATH, scene, CELL), writer="builtin")
    assert result.usable and "'2'" in str(result.to_document()["postconditions"][0]["arguments"])
    result.save(str(tmp_path / "r.json"))
    assert review(str(tmp_path / "r.json")).released
