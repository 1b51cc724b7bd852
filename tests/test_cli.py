"""The command line, run as a user runs it: results, messages, exit codes, never a traceback."""

import json
import os
import sys
from pathlib import Path

import click
import numpy as np
import pytest
from click.testing import CliRunner

from command_line import ovita, process
from ovita.cli.main import cli
from ovita.io import load_task
from ovita.result import Adaptation

TABLETOP = Path(__file__).parents[1] / "src" / "ovita" / "data" / "tabletop.json"


def scene(**changes):
    document = {
        "trajectory": [[0, 0, 0, 0.1], [0.5, 0, 0, 0.5], [1, 0, 0, 0.1]],
        "objects": [{"name": "cup", "x": 0.5, "y": 0.3, "z": 0}],
        "instruction": "go left by 0.1",
    }
    document.update(changes)
    return {k: v for k, v in document.items() if v is not None}


@pytest.fixture
def written(tmp_path):
    def write(content, name="scene.json"):
        path = tmp_path / name
        if isinstance(content, bytes):
            path.write_bytes(content)
        else:
            path.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
        return path

    return write


def test_adapt_moves_by_exactly_the_amount_and_slows_only_near_the_cup(tmp_path):
    out = tmp_path / "r.json"
    done = ovita("adapt", TABLETOP, "Go left by 0.2 and slow down near the cup", "--out", out)
    assert done.returncode == 0, done.stderr
    result = Adaptation.load(str(out))
    assert result.status == "done" and not result.warnings
    shift = result.adapted.positions - result.original.positions
    assert np.abs(shift - [-0.2, 0, 0]).max() < 1e-12
    slower = result.adapted.speeds < result.original.speeds
    distance = result.scene["cup"].distance(result.original.positions)  # a shift changes no part that is spoken of
    radius = {p.name: p.value for p in result.parameters}["cup_radius"]
    assert np.array_equal(slower, (distance <= radius) & (result.original.speeds > 0))
    assert 0 < slower.sum() < len(slower) / 2
    assert np.array_equal(result.adapted.speeds[~slower], result.original.speeds[~slower])
    assert "0.2 m" in done.stdout and "left" in done.stdout and "cup" in done.stdout
    assert "0.2" in result.explanation and "cup" in result.explanation


def test_adapt_takes_the_instruction_of_the_file_and_prints_json(written):
    done = ovita("adapt", written(scene()), "--json")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    assert document["schema"] == "ovita.adaptation/1" and document["instruction"] == "go left by 0.1"
    assert np.array(document["adapted"])[:, 0] == pytest.approx([-0.1, 0.4, 0.9])
    assert Adaptation.from_document(document).to_document() == document


def test_not_understood_exits_3_names_the_words_and_writes_a_loadable_result(written, tmp_path):
    out = tmp_path / "r.json"
    done = ovita("adapt", written(scene()), "moonwalk", "--out", out)
    assert done.returncode == 3
    assert "'moonwalk'" in done.stdout and "'cup'" in done.stdout
    result = Adaptation.load(str(out))
    assert result.status == "not_understood" and result.adapted == result.original


def test_a_question_exits_3_and_is_shown(written):
    cups = [{"name": "red cup", "x": 0, "y": 1, "z": 0}, {"name": "blue cup", "x": 1, "y": 1, "z": 0}]
    done = ovita("adapt", written(scene(objects=cups)), "go closer to the cup")
    assert done.returncode == 3 and "Which is meant, the red cup or the blue cup?" in done.stdout


def test_infeasible_exits_4_with_the_best_effort(written, tmp_path):
    out = tmp_path / "r.json"
    far = scene(trajectory=[[5, 0, 0, 0.1], [2, 0, 0, 0.5], [1, 0, 0, 0.1]])
    done = ovita("adapt", written(far), "go up by 0.1", "--robot", "drone", "--fix-start", "--out", out)
    assert done.returncode == 4, done.stdout + done.stderr
    assert Adaptation.load(str(out)).status == "infeasible" and "start" in done.stdout


def test_partly_done_exits_5_and_not_as_meant_exits_6(written):
    limited = ovita("adapt", written(scene()), "go left by 0.1", "--max-speed", "0.3")
    assert limited.returncode == 5 and "changed by the limits" in limited.stdout, limited.stdout
    vain = ovita("adapt", written(scene()), "go up by 0.2", "--no-obstacles", "--robot", written(FLAT, "flat.toml"))
    assert vain.returncode == 6 and "100%" in vain.stdout, vain.stdout


FLAT = 'name = "flat"\nmargin = 0.0\n[workspace]\nkind = "box"\nlower = [-3, -3, -1]\nupper = [3, 3, 0]\n'


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--out", "x.csv"], "x.csv: a result is JSON"),
        (["--out", "a.json", "--trajectory", "a.json"], "a.json is named twice"),
        (["--out", "scene.json"], "scene.json is named twice"),
    ],
)
def test_no_output_takes_the_place_of_another_file(written, tmp_path, options, said):
    path = written(scene())
    before = path.read_bytes()
    done = ovita("adapt", path, *options, cwd=tmp_path)
    assert done.returncode == 2 and said in done.stderr.replace(": is named", " is named"), done.stderr
    assert path.read_bytes() == before and [p.name for p in tmp_path.iterdir()] == ["scene.json"]


def test_a_mistyped_command_is_guessed():
    done = ovita("adpat", "x.json")
    assert done.returncode == 2 and "did you mean 'adapt'?" in done.stderr
    for group, typed, meant in (("bench", "rnu", "run"), ("policy", "chek", "check"), ("models", "lst", "list")):
        with pytest.raises(click.UsageError, match=f"no command '{typed}'; did you mean '{meant}'"):
            cli([group, typed], standalone_mode=False)


def test_a_configured_model_that_cannot_be_used_leaves_the_builtin_reader(written, monkeypatch):
    monkeypatch.setenv("OVITA_MODEL", "nonsense")
    done = CliRunner().invoke(cli, ["adapt", str(written(scene())), "go left by 0.1"])
    assert done.exit_code == 0 and "OVITA_MODEL names 'nonsense', which cannot be used" in done.output


def test_demo_without_the_drawing_libraries_says_what_brings_them(tmp_path, monkeypatch):
    from ovita.cli import adapt_

    monkeypatch.setattr(adapt_, "find_spec", lambda name: None)
    done = CliRunner().invoke(cli, ["demo", "--out", str(tmp_path / "d")])
    assert done.exit_code == 0 and "pip install 'ovita[plot]'" in done.output
    assert sorted(path.name for path in (tmp_path / "d").iterdir()) == ["1.json", "2.json", "3.json", "scene.json"]


def test_a_terminal_without_the_letters_of_a_name_gets_escapes(written, monkeypatch):
    monkeypatch.setenv("PYTHONIOENCODING", "latin-1")
    cups = [{"name": "чашка ☕", "x": 0.5, "y": 0.3, "z": 0}]
    done = process("adapt", written(scene(objects=cups)), "moonwalk")
    assert done.returncode == 3 and "Traceback" not in done.stderr and "\\u2615" in done.stdout


def test_chat_says_what_is_lost_keeps_a_journal_and_goes_on_from_it(written, tmp_path):
    lines = "stay at least 0.4 away from the cup\ngo forward by 0.2\nkeep it\n/knobs\n/objects\n/quit\n"
    path, journal = written(scene()), tmp_path / "talk.jsonl"
    done = ovita("chat", path, "--writer", "builtin", "--journal", journal, stdin=lines)
    assert done.returncode == 0 and "one turn ago" in done.stdout and "took 'keep it' as" in done.stdout, done.stdout
    assert "distance = 0.4 m" in done.stdout and "cup at [0.5, 0.3, 0] m" in done.stdout
    again = ovita("chat", path, "--writer", "builtin", "--journal", journal, stdin="/history\n/quit\n")
    assert "3 turns so far" in again.stdout and "3. on current: keep it" in again.stdout, again.stdout


def test_result_can_be_adapted_again_explained_plotted_and_converted(written, tmp_path):
    first = tmp_path / "first.json"
    assert ovita("adapt", written(scene()), "--out", first).returncode == 0
    again = ovita("adapt", first, "go up by 0.1", "--trajectory", tmp_path / "t.csv")
    assert again.returncode == 0, again.stderr
    assert load_task(tmp_path / "t.csv").trajectory.positions[0] == pytest.approx([-0.1, 0, 0.1])
    explained = ovita("explain", first)
    assert explained.returncode == 0 and "0.1 m" in explained.stdout
    for name, head in (("p.png", b"\x89PNG"), ("p.svg", b"<?xml"), ("p.pdf", b"%PDF"), ("p.html", b"<")):
        plotted = ovita("plot", first, "--out", tmp_path / name)
        assert plotted.returncode == 0, plotted.stderr
        assert (tmp_path / name).read_bytes().startswith(head)


def test_csv_with_a_scene_file_and_another_frame(written):
    path = written("speed,x,y,z\n0,0,0,0\n0.5,0.5,0,0\n0,1,0,0\n", "path.csv")
    done = ovita("adapt", path, "go left by 0.2", "--scene", written(scene()), "--frame", "flu", "--json")
    assert done.returncode == 0, done.stderr
    assert np.array(json.loads(done.stdout)["adapted"])[:, 1] == pytest.approx(0.2)


def test_chat_feedback_undo_knob_and_save(written, tmp_path):
    lines = [
        "go left by 0.1",
        "go up by 0.1",
        "/undo",
        "/redo",
        "/undo",
        "/original go right by 0.3",
        "/set right=0.4",
        "/history",
        "/set sideways=1",
        "moonwalk",
        "/nonsense",
        "/why",
        f"/save {tmp_path / 'end.json'}",
        f"/save {tmp_path / 'end.csv'}",
        "/quit",
    ]
    done = ovita("chat", written(scene()), stdin="\n".join(lines) + "\n")
    assert done.returncode == 0, done.stderr
    assert (
        "Took back: go up by 0.1 (/redo brings it back)." in done.stdout
        and "unknown command '/nonsense'" in done.stdout
    )
    assert "'moonwalk'" in done.stdout and "sideways" in done.stdout
    assert load_task(tmp_path / "end.csv").trajectory.positions[0] == pytest.approx([0.3, 0, 0])
    assert Adaptation.load(str(tmp_path / "end.json")).adapted.positions[0] == pytest.approx([0.3, 0, 0])


def test_chat_with_everything_taken_back_has_nothing_to_undo_or_save(written, tmp_path):
    lines = ["go left by 0.1", "/undo", "/undo", f"/save {tmp_path / 'end.json'}", "/quit"]
    done = ovita("chat", written(scene()), stdin="\n".join(lines) + "\n")
    assert "There is nothing to undo." in done.stdout and "as it was at first" in done.stdout + done.stderr
    assert "defect" not in done.stdout + done.stderr and not (tmp_path / "end.json").exists()


def test_demo_adapts_three_times_and_saves_pictures(tmp_path):
    done = ovita("demo", "--out", tmp_path / "demo")
    assert done.returncode == 0, done.stderr
    for i in (1, 2, 3):
        assert Adaptation.load(str(tmp_path / "demo" / f"{i}.json")).status == "done"
        assert (tmp_path / "demo" / f"{i}.png").read_bytes().startswith(b"\x89PNG")
        assert (tmp_path / "demo" / f"{i}.html").stat().st_size > 100_000


ROW = [[0, 0, 0, 0.1], [1, 0, 0, 0.1]]
BAD_FILES = [
    ("not-json", "{oops", "scene.json", ["not JSON", "line 1"]),
    ("not-an-object", "[1, 2]", "scene.json", ["object"]),
    ("no-trajectory", {"objects": []}, "scene.json", ["trajectory"]),
    ("wrong-shape", scene(trajectory=[1, 2, 3]), "scene.json", ["trajectory[0]"]),
    ("too-wide", scene(trajectory=[[1, 2, 3, 4, 5], [1, 2, 3, 4, 5]]), "scene.json", ["trajectory"]),
    ("nan", '{"trajectory": [[0, 0, 0, 0], [0, NaN, 0, 0]]}', "scene.json", ["trajectory[1]", "nan"]),
    ("ragged", scene(trajectory=[[0, 0, 0, 0], [1, 2]]), "scene.json", ["trajectory[1]"]),
    ("text-in-row", scene(trajectory=[[0, 0, 0, 0], [1, 2, "x", 0]]), "scene.json", ["trajectory[1]"]),
    ("empty-file", "", "scene.json", ["empty"]),
    ("empty-trajectory", scene(trajectory=[]), "scene.json", ["trajectory"]),
    ("one-waypoint", scene(trajectory=[[0, 0, 0, 0]]), "scene.json", ["at least 2"]),
    ("negative-speed", scene(trajectory=[[0, 0, 0, 0], [1, 0, 0, -2]]), "scene.json", ["trajectory[1]", "negative"]),
    (
        "duplicate-names",
        scene(objects=[{"name": "cup", "x": 0, "y": 0, "z": 0}, {"name": "CUP", "x": 1, "y": 0, "z": 0}]),
        "scene.json",
        ["objects[1]", "'CUP'"],
    ),
    ("object-without-x", scene(objects=[{"name": "cup", "y": 0, "z": 0}]), "scene.json", ["objects[0]", "x"]),
    ("unknown-frame", scene(frame="enu"), "scene.json", ["frame", "'enu'", "rfu"]),
    ("binary", b"\xff\xfe\x00\x01", "scene.json", ["UTF-8"]),
    ("unknown-ending", "hello", "scene.xyz", [".xyz", ".json"]),
    ("csv-no-z", "x,y\n1,2\n", "path.csv", ["z"]),
    ("csv-ragged", "x,y,z,speed\n0,0,0,1\n1,2\n", "path.csv", ["1"]),
    ("csv-nan", "x,y,z,speed\n0,0,0,1\n1,nan,0,1\n", "path.csv", ["y"]),
    ("csv-word", "x,y,z,speed\n0,0,0,1\n1,abc,0,1\n", "path.csv", ["abc"]),
    ("csv-empty", "x,y,z,speed\n", "path.csv", ["waypoint"]),
    ("csv-time-back", "x,y,z,t\n0,0,0,0\n1,0,0,2\n2,0,0,1\n", "path.csv", ["t"]),
]


@pytest.mark.parametrize(("content", "name", "said"), [b[1:] for b in BAD_FILES], ids=[b[0] for b in BAD_FILES])
def test_bad_files_get_one_sentence_and_exit_2(written, content, name, said):
    refused(ovita("adapt", written(content, name), "go left"), name, *said)


def test_a_process_of_its_own_ends_in_the_same_way(written):
    refused(process("adapt", written("{oops"), "go left"), "not JSON")
    refused(process("fly"), "no command 'fly'")
    done = process("adapt", written(scene()))
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines()[1:] == ovita("adapt", written(scene())).stdout.splitlines()[1:]  # but for the ms


def refused(done, *said):
    assert done.returncode == 2, done.stdout + done.stderr
    assert done.stdout == ""
    assert done.stderr.startswith("error: ") and done.stderr.count("\n") == 1, done.stderr
    for word in said:
        assert word in done.stderr, done.stderr


def test_missing_file_directory_huge_file_and_unreadable_file(tmp_path):
    refused(ovita("adapt", tmp_path / "nowhere.json", "go left"), "nowhere.json")
    folder = tmp_path / "folder.json"
    folder.mkdir()
    refused(ovita("adapt", folder, "go left"), "folder.json", "director")
    huge = tmp_path / "huge.json"
    with huge.open("wb") as file:
        file.truncate(2 << 30)
    refused(ovita("adapt", huge, "go left"), "huge.json", "MB")
    secret = tmp_path / "secret.json"
    secret.write_text(json.dumps(scene()))
    secret.chmod(0)
    if not os.access(secret, os.R_OK):
        refused(ovita("adapt", secret, "go left"), "secret.json")


BAD_USE = [
    ("empty-instruction", ["  "], ["instruction is empty"]),
    ("long-instruction", ["go left " * 500], ["2000"]),
    ("unknown-robot", ["go left", "--robot", "submarine"], ["submarine", "drone, arm, ground, none"]),
    ("unknown-writer", ["go left", "--writer", "oracle"], ["unknown writer 'oracle'", "builtin"]),
    ("out-in-no-folder", ["go left", "--out", "/nowhere/r.json"], ["/nowhere"]),
    ("plot-ending", ["go left", "--plot", "p.bmp"], ["p.bmp", ".png"]),
    ("max-speed", ["go left", "--max-speed", "-1"], ["max_speed"]),
    ("no-limits-in-scene", ["go left", "--robot", "scene"], ["states no limits"]),
    ("frame", ["go left", "--frame", "enu"], ["enu"]),
    ("pin", ["go left", "--pin", "99"], ["99"]),
]


@pytest.mark.parametrize(("arguments", "said"), [b[1:] for b in BAD_USE], ids=[b[0] for b in BAD_USE])
def test_bad_use_gets_one_sentence_and_exit_2(written, arguments, said):
    refused(ovita("adapt", written(scene()), *arguments), *said)


def test_a_scene_without_instruction_says_how_to_give_one(written):
    refused(ovita("adapt", written(scene(instruction=None))), "holds no instruction")


def test_unknown_options_and_commands_exit_2(written):
    for arguments in (["adapt"], ["adapt", written(scene()), "go left", "--frobnicate"], ["fly"]):
        done = ovita(*arguments)
        refused(done)


def test_outputs_are_checked_before_anything_is_written(written, tmp_path):
    out = tmp_path / "r.json"
    for wrong in (["--plot", "/nowhere/x.png"], ["--trajectory", "x.foo"], ["--plot", "x.bmp"]):
        refused(ovita("adapt", written(scene()), "go left", "--out", out, *wrong))
        assert not out.exists()


def test_damaged_results_are_refused_with_the_key(written, tmp_path):
    good = tmp_path / "good.json"
    assert ovita("adapt", written(scene()), "--out", good).returncode == 0
    document = json.loads(good.read_text())
    for key, value in (
        ("adapted", [[0, 0, 0, 0], [1, 2]]),
        ("adapted", [["a", 0, 0, 0], [1, 2, 3, 4]]),
        ("writer", {"attempts": 1}),
        ("writer", {**document["writer"], "attempts": "many"}),
        ("changes", {"displacement": 3}),
        ("status", "fine"),
        ("robot", {"name": "x", "margin": -1}),
    ):
        refused(ovita("explain", written({**document, key: value}, "bad.json")), "bad.json")


def test_a_missing_key_exits_3_before_anything_is_sent(written):
    pytest.importorskip("pydantic_ai", reason="the extra `llm` asks for the key")
    done = ovita("adapt", written(scene()), "go left", "--llm", "openai:gpt-5")
    assert done.returncode == 3
    assert "OPENAI_API_KEY" in done.stdout + done.stderr and "Traceback" not in done.stderr


def test_explain_and_plot_refuse_what_is_no_result(written):
    refused(ovita("explain", written(scene())), "scene.json")
    broken = written({"schema": "ovita.adaptation/1", "adapted": []}, "r.json")
    refused(ovita("explain", broken), "r.json")


def test_nothing_is_half_written(written, tmp_path):
    before = sorted(os.listdir(tmp_path))
    ovita("adapt", written(scene()), "go left", "--out", tmp_path)
    assert sorted(set(os.listdir(tmp_path)) - {"scene.json"}) == before


def test_a_robot_that_is_not_known_is_noted_where_no_limits_are_asked_for(tmp_path):
    for name, said in (("kuka", "unknown robot 'kuka'"), (5, "robot is 5")):
        (tmp_path / "s.json").write_text(json.dumps(scene(robot=name)))
        done = ovita("adapt", "s.json", "go left by 0.1", cwd=tmp_path)
        assert done.returncode == 0 and said in done.stderr, done.stderr
    assert ovita("adapt", "s.json", "go left", "--robot", "kuka", cwd=tmp_path).returncode == 2


def test_pins_count_from_1(tmp_path):
    (tmp_path / "s.json").write_text(json.dumps(scene()))
    assert "--pin 1" in ovita("adapt", "s.json", "go left by 0.1", "--pin", "0", cwd=tmp_path).stderr
    assert ovita("adapt", "s.json", "go left by 0.1", "--pin", 3, "--out", "r.json", cwd=tmp_path).returncode == 0
    assert Adaptation.load(str(tmp_path / "r.json")).options.pinned == (2,)
    over = ovita("adapt", "s.json", "go left by 0.1", "--pin", 4, cwd=tmp_path)
    assert over.returncode == 2 and "waypoint 4" in over.stderr and "there are 3" in over.stderr


def test_reports_break_between_words_on_a_terminal_and_not_at_all_in_a_file(monkeypatch):
    from ovita.cli.common import wrapped

    text = "The path goes 0.2 m to the left, /a/very/long/name-of-a-file/that-is-longer-than-the-line.json and so on."
    assert wrapped(text, "  ") == f"  {text}"
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "44")
    lines = wrapped(text, "  ").split("\n")
    assert " ".join(line.strip() for line in lines) == text
    assert all(len(line) <= 44 or len(line.split()) == 1 for line in lines) and len(lines) > 2
