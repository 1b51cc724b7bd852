import inspect
import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import ovita.toolkit
from ovita.paths.scene import DIRECTIONS, RFU, Frame
from ovita.toolkit import CATALOGUE, Recorder, approach, catalogue, describe, expect_side, judge, namespace
from ovita.toolkit.arguments import Offset, OffsetLimits
from ovita.toolkit.catalogue import HIDDEN, as_text, core_names, operation, reference, signature


@pytest.mark.parametrize("name", CATALOGUE)
def test_every_function_is_exported_and_documents_each_parameter(name):
    function = CATALOGUE[name]
    assert getattr(ovita.toolkit, name) is function
    assert inspect.getdoc(function).splitlines()[0].endswith(".")
    (entry,) = reference([name])
    expected = {p.replace("offset", "OFFSET") for p in inspect.signature(function).parameters} - set(HIDDEN)
    assert set(entry.parameters) == expected and all(entry.parameters.values())
    assert all(
        word in expected for word in re.findall(r"^    (\w+): ", inspect.getdoc(function), re.M) if word != "offset"
    )


@pytest.mark.parametrize("name", [n for n in CATALOGUE if "where" in inspect.signature(CATALOGUE[n]).parameters])
def test_an_edit_of_a_part_says_what_happens_at_its_edges(name):
    if not name.startswith("expect_"):
        assert re.search(r"\b(jumps?|blends?|beside it follow)\b", as_text(*reference([name]))), name


def test_the_description_is_short_and_complete():
    text = describe()
    for name in CATALOGUE:
        assert re.search(rf"(?:^|, ){name}\(", text, re.MULTILINE), name
    assert "frame" not in text and "recorder" not in text
    assert len(text) < 85 * len(CATALOGUE)
    assert len(describe(core_names())) < 1500 and set(core_names()) < set(CATALOGUE)


def test_the_description_of_some_names():
    assert describe(["near"]).startswith("near(traj, obj, within, of?): Mask: ")
    promises = describe(["expect_stop", "expect_closer"]).splitlines()[-1]
    assert promises == "expect_closer(obj, by?, where?), expect_stop(near?, OFFSET, before?)"
    offset, move = describe(["move"]).splitlines()
    assert offset.startswith("OFFSET: left=, right=") and move.startswith("move(traj, OFFSET, where?, keep?): ")
    assert describe(["move"], known_notes=("OFFSET",)) == move
    with pytest.raises(ValueError, match="fly"):
        describe(["fly"])


def test_the_direction_words_of_the_types_are_those_of_the_frames():
    assert tuple(Offset.__annotations__) == tuple(OffsetLimits.__annotations__) == DIRECTIONS


def test_an_operation_is_entered_once_in_a_known_group():
    with pytest.raises(ValueError, match="unknown group 'Dance'; groups are Choose waypoints"):
        operation("Dance")
    with pytest.raises(ValueError, match="already has an operation 'move'"):
        operation("Speed")(CATALOGUE["move"])


def test_the_recipe_of_contributing_makes_an_operation_that_keeps_its_promise(line, cup, scene):
    recipe = (Path(__file__).parents[2] / "CONTRIBUTING.md").read_text(encoding="utf-8")
    code = re.search(r"```python\n(.*?)```", recipe, re.DOTALL)[1]
    try:
        exec(code, names := dict(vars(approach)))
        (entry,) = reference(["arc_over"])
        out = names["arc_over"](line, cup, 0.1)
    finally:
        catalogue._withdraw({"arc_over"})
    assert all(entry.parameters.values()) and "level part" in entry.summary
    assert np.array_equal(out[[0, -1]], line[[0, -1]])
    outcome = judge(expect_side("above", 0.1, of=cup, within=0.02), line, out, scene)
    assert outcome.held, outcome.sentence


def test_a_call_that_does_not_fit_shows_the_whole_signature():
    assert signature("circle") == "circle(traj, obj, *, radius=None, turns=1, clockwise=None)"
    assert signature("midpoint", brief=True) == "midpoint(a, b)"


def test_the_namespace_binds_frame_and_recorder_and_looks_like_the_catalogue(line, cup):
    recorder = Recorder()
    bound = namespace(Frame("flu"), recorder)
    assert list(bound) == list(CATALOGUE)
    for name, function in bound.items():
        assert function.__name__ == name
        assert function.__doc__ == CATALOGUE[name].__doc__
        assert not {"frame", "recorder"} & set(inspect.signature(function).parameters)
    assert np.allclose(bound["move"](line, left=1.0)[:, 1], 1.0)
    with pytest.raises(ValueError, match="frame"):
        bound["move"](line, left=1.0, frame=RFU)
    bound["expect_moved"](left=1.0)
    assert recorder.expectations[0].arguments == {"offset": {"left": 1.0}}


def test_contacts_are_objects_reached_without_an_offset(line, cup, scene):
    recorder = Recorder()
    bound = namespace(RFU, recorder)
    bound["move_goal"](line, cup, up=0.1)
    bound["go_through"](line, [0.5, 0.1, 0.0])
    bound["move_goal"](line, up=0.1)
    assert recorder.contacts == []
    bound["go_through"](line, cup)
    bound["continue_to"](line, cup)
    bound["move_start"](line, scene["box"])
    assert recorder.contacts == ["cup", "box"]


def test_expectations_are_plain_json(line, cup):
    recorder = Recorder()
    bound = namespace(RFU, recorder)
    mask = bound["near"](line, cup, 0.32)
    bound["expect_slower"](where=mask)
    bound["expect_visits"](np.array([1.0, 2.0, 3.0]), within=0.1)
    bound["expect_closer"](cup, 0.1, where=mask)
    slower, visits, nearer = recorder.expectations
    assert slower.arguments == {"where": {"count": 21, "ranges": [[8, 12]]}}
    assert slower.text == "the robot moves slower (waypoints 9 to 13)"
    assert visits.arguments == {"point": [1.0, 2.0, 3.0], "within": 0.1}
    assert nearer.arguments["object"] == "cup"
    for item in recorder.expectations:
        assert json.loads(json.dumps(item.arguments)) == item.arguments


def test_only_numpy_is_imported():
    code = "import sys, ovita.toolkit; print({'scipy', 'pydantic', 'matplotlib'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
