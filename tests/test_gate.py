"""The gate: nothing that is infeasible, unverified, edited or in collision goes to a robot."""

import json
import os
import re
import stat

import pytest
from click.testing import CliRunner

from ovita.chain import adapt
from ovita.cli.transfer_ import gate as group
from ovita.errors import FormatError
from ovita.gate import default_log, explained, record, review, simulated
from ovita.io.json_ import seal
from ovita.io.signatures import make_keys
from ovita.limits import ConstraintOptions
from ovita.measure import sentences
from ovita.paths.robot import Box, Robot
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.request import Request
from ovita.result import Adaptation

ROBOT = Robot("cell", Box((-2, -2, -1), (2, 2, 1)), max_speed=0.6)
SCENE = Scene((SceneObject("cup", [0.5, 0.6, 0], [0.1, 0.1, 0.1]),))
PATH = Trajectory([[0.1 * i, 0, 0] for i in range(11)], [0.3] * 11)


def result(instruction="go left by 0.2", robot=ROBOT, **options):
    return adapt(Request(instruction, PATH, SCENE, robot), writer="builtin", **options)


@pytest.fixture(scope="module")
def good():
    return result().to_document()


@pytest.fixture
def reviewed(tmp_path):
    def run(document, **options):
        path = tmp_path / "r.json"
        path.write_text(json.dumps(document))
        return review(str(path), **options)

    return run


def sealed(document, **changes):
    changed = {**document, **changes}
    return {**changed, "sha256": seal(changed)}


def test_an_explanation_is_measured_again_and_a_forged_one_is_called_unchecked(tmp_path):
    made, path = result("go left by 0.2"), tmp_path / "r.json"
    made.save(str(path))
    assert explained(str(path)) == made.explanation
    document = json.loads(path.read_text())
    document["explanation"] = "It is certified."
    document["postconditions"][0] |= {"held": True, "outcome": "the path moved 9 m up"}
    document["changes"] = None
    document["adapted"][5][:3] = [0.5, 0.6, 0.0]
    path.write_text(json.dumps(document))
    told = explained(str(path))
    assert "edited after it was saved" in told and "9 m up" not in told and "on average" in told
    assert "Measured again" in told
    assert told.index("nothing checked") < told.index("It is certified.")


def test_a_good_result_is_released(good, reviewed, tmp_path):
    found = reviewed(good)
    assert found.released and len(found.checks) == 3 and all(check.held for check in found.checks)
    assert len(found.sha256) == 64 and found.robot == ROBOT
    Adaptation.from_document(good).save(str(tmp_path / "again.json"))
    assert review(str(tmp_path / "again.json")).released


def moved(document, row, value):
    rows = [list(r) for r in document["adapted"]]
    rows[row] = value
    return rows


def test_edits_are_caught(good, reviewed):
    for changes in (
        {"adapted": moved(good, 4, [0.4, 0.0, 0.001, 0.3])},
        {"robot": {**good["robot"], "max_speed": 0.5}},
        {"scene": {**good["scene"], "objects": []}},
        {"contacts": ["cup"]},
        {"timestep": 0.2},
        {"status": "infeasible"},
        {"constraints": {**good["constraints"], "status": "repaired"}},
    ):
        assert any("its seal does not fit" in text for text in reviewed({**good, **changes}).refusals), changes
    assert reviewed({**good, "explanation": "reworded"}).released
    unsealed = {key: value for key, value in good.items() if key != "sha256"}
    assert any("bears no seal" in text for text in reviewed(unsealed).refusals)


def test_even_a_resealed_file_is_measured(good, reviewed):
    through = reviewed(sealed(good, adapted=moved(good, 5, [0.5, 0.6, 0.0, 0.3])))
    assert any("it passes too close to 'cup' by" in text for text in through.refusals)
    fast = reviewed(sealed(good, adapted=moved(good, 5, [0.5, 0.2, 0.0, 0.9])))
    assert any("the speed limit is broken by 0.3 m/s at waypoint 6" in text for text in fast.refusals)
    outside = reviewed(sealed(good, adapted=moved(good, 5, [0.5, 0.2, 3.0, 0.3])))
    assert any("the workspace limit is broken by 2.01 m" in text for text in outside.refusals)
    still = sealed(good, adapted=[[x, y, z, 0.0] for x, y, z, _ in good["adapted"]])
    assert any("goes on at speed 0" in text for text in reviewed(still).refusals)


def test_what_the_record_says_counts(good, reviewed):
    off = result("go forward by 0.6", constraints=ConstraintOptions(enabled=False)).to_document()
    refusals = reviewed(off).refusals
    assert any("only measured, not enforced" in text for text in refusals)
    assert any("too close to 'cup'" in text for text in refusals)
    assert any("never verified" in text for text in reviewed(sealed(good, constraints=None)).refusals)
    declined = result("flurb the snark").to_document()
    assert any("There is no result to send" in text for text in reviewed(declined).refusals)
    tight = Robot("tight", Box((-2, -0.1, -1), (2, 0.1, 1)), max_speed=0.6)
    stuck = adapt(
        Request("go left by 0.5", PATH, SCENE, tight),
        writer="builtin",
        constraints=ConstraintOptions(fix_goal=True, fix_start=True),
    )
    if stuck.status == "infeasible":
        assert any("only the best effort" in text for text in reviewed(stuck.to_document()).refusals)


def test_a_robot_without_limits_verifies_nothing(reviewed):
    loose = result(robot=Robot.preset("none")).to_document()
    assert any("'none' has no limits to verify against" in text for text in reviewed(loose).refusals)
    found = reviewed(loose, robot=ROBOT)
    assert found.released and any("instead of the result's 'none'" in text for text in found.cautions)
    slow = Robot("slow", max_speed=0.1)
    assert any("speed limit is broken" in text for text in reviewed(loose, robot=slow).refusals)


def test_limits_on_acceleration_are_measured_again(reviewed):
    gentle = result("slow down near the cup", constraints=ConstraintOptions(max_acceleration=0.5)).to_document()
    found = reviewed(gentle)
    assert found.released and any(check.name == "acceleration" for check in found.checks)
    jerky = sealed(gentle, adapted=moved(gentle, 5, [*gentle["adapted"][5][:3], 0.0]))
    jerky["adapted"][4][3] = jerky["adapted"][6][3] = 0.6
    assert any("acceleration limit is broken" in text for text in reviewed(sealed(jerky)).refusals)


def test_contacts_are_told(reviewed):
    found = reviewed(result("go through the cup").to_document())
    assert any("'cup' is meant to be touched" in text for text in found.cautions)


def test_other_files_are_no_results(tmp_path, good):
    with pytest.raises(FormatError, match="only a result can be sent"):
        review(str(tmp_path / "a.csv"))
    (tmp_path / "t.json").write_text(json.dumps({"trajectory": [[0, 0, 0, 1], [1, 0, 0, 1]]}))
    with pytest.raises(FormatError, match="this is a task, not a saved adaptation"):
        review(str(tmp_path / "t.json"))


def test_the_log_only_grows(tmp_path, monkeypatch):
    log = tmp_path / "new" / "sent.jsonl"
    record(log, {"event": "sending", "to": "ü\n"})
    before = log.read_bytes()
    record(log, {"event": "sent"})
    assert log.read_bytes().startswith(before)
    lines = [json.loads(line) for line in log.read_text().splitlines()]
    assert [line["event"] for line in lines] == ["sending", "sent"] and lines[0]["to"] == "ü\n"
    assert lines[0]["time"].endswith("+00:00") and stat.S_IMODE(os.stat(log).st_mode) == 0o600
    (tmp_path / "file").write_text("")
    with pytest.raises(FormatError, match=r"the log cannot be written .*so nothing is sent"):
        record(tmp_path / "file" / "sent.jsonl", {})
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    assert default_log() == tmp_path / "ovita" / "sent.jsonl"
    monkeypatch.delenv("XDG_STATE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert default_log() == tmp_path / ".local" / "state" / "ovita" / "sent.jsonl"


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (lambda lines: lines, ""),
        (lambda lines: [lines[0], lines[1].replace(b"two", b"TWO"), *lines[2:]], "line 3 does not follow"),
        (lambda lines: [lines[0], *lines[2:]], "line 2 does not follow"),
        (lambda lines: lines[1:], "line 1 does not follow"),
        (lambda lines: [*lines[:2], lines[1], *lines[2:]], "line 3 does not follow"),
        (lambda lines: [lines[1], lines[0], *lines[2:]], "line 1 does not follow"),
        (lambda lines: lines[:-1], "1 of 4 lines are missing at the end"),
        (lambda lines: [*lines[:3], lines[3].replace(b"four", b"4our")], "the last line is another"),
        (lambda lines: [*lines[:2], b"{", *lines[3:]], "line 3 does not follow"),
    ],
)
def test_a_line_of_the_log_that_was_changed_removed_or_inserted_is_found(tmp_path, change, fault):
    log = tmp_path / "sent.jsonl"
    for word in ("one", "two", "three", "four"):
        record(log, {"event": word})
    log.write_bytes(b"".join(line + b"\n" for line in change(log.read_bytes().splitlines())))
    said = CliRunner().invoke(group, ["log", "--log", str(log), "--verify"])
    assert said.exit_code == (4 if fault else 0) and (fault or "4 lines, whole") in said.output


def test_a_log_of_an_earlier_version_is_gone_on_with(tmp_path):
    log = tmp_path / "sent.jsonl"
    log.write_text('{"event":"old"}\n{"event":"older"}\n')
    record(log, {"event": "new"})
    said = CliRunner().invoke(group, ["log", "--log", str(log), "--verify"])
    assert said.exit_code == 0 and "2 lines at the beginning are from an earlier version" in said.output
    log.write_text(log.read_text().replace("older", "elder"))
    assert CliRunner().invoke(group, ["log", "--log", str(log), "--verify"]).exit_code == 4
    shown = CliRunner().invoke(group, ["log", "--log", str(log), "--last", "1", "--json"]).output
    assert json.loads(shown)["event"] == "new" and "previous" not in shown
    (tmp_path / "sent.jsonl.head").unlink()
    assert "is missing, so nobody knows" in CliRunner().invoke(group, ["log", "--log", str(log), "--verify"]).output


def test_the_log_is_shown_in_lines_for_people(tmp_path):
    log, about = tmp_path / "sent.jsonl", {"result": "/a/r.json", "to": "/a/x.csv", "robot": "drone"}
    size = {"waypoints": 60, "duration_s": 5.474}
    record(log, {"event": "sent", **about, **size, "bytes": 1855, "sha256": "ec15a62ca15bfda"})
    record(log, {"event": "refused", **about, "why": ["It is old.", "It is slow."]})
    record(log, {"event": "failed", "task": "t1", "to": "ros2:/path", "why": "nobody\nanswers"})
    record(log, {"event": 3, "bytes": None})
    lines = CliRunner().invoke(group, ["log", "--log", str(log)]).output.splitlines()
    assert [line[21:] for line in lines] == [
        "sent     r.json -> /a/x.csv (robot drone, 60 waypoints, 5.474 s, 1855 bytes, SHA-256 ec15a62ca15b...)",
        "refused  r.json -> /a/x.csv (robot drone): It is old. It is slow.",
        "failed   t1 -> ros2:/path: nobody answers",
        "3        ? -> ? (None bytes, SHA-256 None...)",
    ]
    assert re.match(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d  sent", lines[0])
    assert CliRunner().invoke(group, ["log", "--log", str(log), "--json", "--verify"]).exit_code != 0


def test_the_changes_shown_are_measured_not_read(good, reviewed):
    forged = json.loads(json.dumps(good))
    for item in forged["changes"]["objects"]:
        item["distance"]["after"] = 5.0
    assert reviewed(sealed(forged)).changes == reviewed(good).changes
    for lie in (1e308, "far", None, [1], {"a": 1}, True):
        forged["changes"]["objects"][0]["distance"]["after"] = lie
        try:
            assert sentences(reviewed(sealed(forged)).changes)
        except FormatError as error:
            assert "changes" in str(error)


@pytest.mark.parametrize("value", ["0.4", True, None, [0.4]])
def test_coordinates_are_numbers(good, reviewed, value):
    with pytest.raises(FormatError, match="adapted"):
        reviewed(sealed(good, adapted=moved(good, 4, [value, 0.2, 0.0, 0.3])))


def put(document, path, value):
    changed = json.loads(json.dumps(document))
    place = changed
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    return sealed(changed)


@pytest.mark.parametrize("value", ["0.4", True])
@pytest.mark.parametrize(
    "path",
    [
        ("original", 3, 1),
        ("timestep",),
        ("robot", "max_speed"),
        ("robot", "workspace", "lower", 0),
        ("robot", "margin"),
        ("scene", "objects", 0, "x"),
        ("scene", "objects", 0, "dimensions", 1),
    ],
)
def test_every_number_that_is_measured_is_a_number(good, reviewed, path, value):
    with pytest.raises(FormatError):
        reviewed(put(good, path, value))


def test_it_says_of_each_check_whether_it_could_be_made(good, reviewed):
    said = {check.what: check for check in reviewed(good).looked}
    assert said["the seal"].held and said["the workspace"].held and said["the speed"].held and said["the objects"].held
    for what in (
        "the signature",
        "the acceleration across the path",
        "the body",
        "where the robot is now",
        "the dynamics",
    ):
        assert said[what].held is None, what
    assert str(said["the speed"]) == "the speed: holds (at most 0.6 m/s)"
    assert "the body: not checked (the robot counted as a point)" in reviewed(good).sections()["Checked"]
    near = {check.what: check.held for check in reviewed(sealed(good, adapted=moved(good, 5, [0.5, 0.6, 0, 9]))).looked}
    assert near["the objects"] is False and near["the speed"] is False
    touched = reviewed(result("go through the cup").to_document())
    assert any(check.what == "contact with 'cup'" and check.held is None for check in touched.looked)


def test_a_start_elsewhere_is_told(good, reviewed):
    assert not any("It starts" in text for text in reviewed(good).cautions) or good["adapted"][0] != good["original"][0]
    elsewhere = reviewed(sealed(good, adapted=moved(good, 0, [0.0, 0.3, 0.0, 0.3])))
    assert any("It starts 0.3 m from where the original starts" in text for text in elsewhere.cautions)
    assert next(check for check in elsewhere.looked if check.what == "the start").held is None


@pytest.fixture
def keys(tmp_path):
    pytest.importorskip("cryptography")
    for name in ("mine", "other"):
        assert CliRunner().invoke(group, ["key", str(tmp_path / name)]).exit_code == 0
    return tmp_path


def test_signed_results_are_verified_where_a_key_is_trusted(keys, good, monkeypatch):
    file, public = str(keys / "r.json"), str(keys / "mine.pub")
    Adaptation.from_document(good).save(file)
    assert any("only signed results are trusted" in text for text in review(file, trusted=[public]).refusals)
    assert stat.S_IMODE(os.stat(keys / "mine.key").st_mode) == 0o600
    said = CliRunner().invoke(group, ["sign", file, "--key", str(keys / "mine.key")])
    assert said.exit_code == 0, said.output
    found = review(file, trusted=[str(keys / "other.pub"), public])
    assert found.released and next(check for check in found.looked if check.what == "the signature").held
    assert review(file).released
    others = review(file, trusted=[str(keys / "other.pub")])
    assert others.refusals == ("None of the trusted keys signed it as it is now.",)
    document = json.loads((keys / "r.json").read_text())
    edited = sealed(document, adapted=moved(document, 4, [0.4, 0.2, 0.001, 0.3]))
    (keys / "e.json").write_text(json.dumps(edited))
    monkeypatch.setenv("OVITA_TRUSTED_KEYS", public)
    assert any("None of the trusted keys" in text for text in review(str(keys / "e.json")).refusals)
    (keys / "s.json").write_text(json.dumps({**document, "signature": {"ed25519": "%"}}))
    assert any("cannot be read" in text for text in review(str(keys / "s.json")).refusals)


def test_a_key_that_cannot_be_read_trusts_nothing(keys, good, reviewed, monkeypatch):
    for file in (keys / "none.pub", keys / "mine.key", keys / "text"):
        (keys / "text").write_text("no key")
        with pytest.raises(FormatError):
            reviewed(good, trusted=[str(file)])
    monkeypatch.setenv("OVITA_TRUSTED_KEYS", str(keys / "none.pub"))
    with pytest.raises(FormatError, match="no such file"):
        reviewed(good)
    with pytest.raises(FormatError, match="is there already"):
        make_keys(str(keys / "mine"))


def test_only_what_the_gate_lets_through_is_signed(keys, good):
    (keys / "r.json").write_text(json.dumps(sealed(good, adapted=moved(good, 5, [0.5, 0.6, 0.0, 0.3]))))
    said = CliRunner().invoke(group, ["sign", str(keys / "r.json"), "--key", str(keys / "mine.key")])
    assert said.exit_code == 4 and "too close to 'cup'" in said.output
    assert "signature" not in (keys / "r.json").read_text()


def test_a_motion_that_fails_in_simulation_is_refused(good, reviewed):
    found = simulated(reviewed(good), ["Contact with cup: waypoint 3."], failed=True)
    assert not found.released and "Simulated, the robot does not follow it: Contact with cup" in found.refusals[-1]
    fine = simulated(reviewed(good), ["Tracking error 1 mm rms."], failed=False)
    assert fine.released and fine.looked[-1].held


def test_absurd_coordinates_are_refused(good, reviewed):
    with pytest.raises(FormatError, match="beyond 1e\\+06"):
        reviewed(sealed(good, adapted=moved(good, 4, [1e200, 0.2, 0.0, 0.3])))


def test_it_says_what_it_did_not_check(good, reviewed):
    said = " ".join(reviewed(good).cautions)
    assert "Not checked, since robot 'cell' states no limit on it: the acceleration along the path" in said
    assert "counted as a point" in said
    full = Robot("full", ROBOT.workspace, max_speed=0.6, radius=0.05, max_acceleration=5, max_lateral_acceleration=5)
    assert "Not checked" not in " ".join(reviewed(good, robot=full).cautions)


def test_a_body_is_measured_again(good, reviewed):
    wide = Robot("wide", ROBOT.workspace, max_speed=0.6, radius=0.6)
    assert any("too close to 'cup'" in text for text in reviewed(good, robot=wide).refusals)
    hard = Robot("hard", ROBOT.workspace, max_speed=0.6, max_acceleration=0.1)
    jerk = sealed(good, adapted=moved(good, 5, [*good["adapted"][5][:3], 0.5]))
    assert any("acceleration limit is broken" in text for text in reviewed(jerk, robot=hard).refusals)
