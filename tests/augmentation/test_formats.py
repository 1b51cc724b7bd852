"""Formats of augmented data: what is written is read back, by ovita and, where it is installed, by lerobot itself."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from shifted import samples

from ovita.augment.formats import ADAPTED, FORMATS, ORIGINAL, read, sinks_named
from ovita.augment.lerobot import LeRobotEpisodes, frames_of
from ovita.bench.dataset import load_dataset
from ovita.errors import FormatError, RequestError
from ovita.io import Choices, load_task
from ovita.io.lerobot import episode, episodes
from ovita.paths.scene import transformed

pyarrow = pytest.importorskip("pyarrow", reason="pyarrow (extra lerobot) is not installed")
pytest.importorskip("rosbags", reason="rosbags (extra ros) is not installed")
from pyarrow import parquet  # noqa: E402

LEROBOT = "OVITA_LEROBOT_PYTHON"
"""Environment variable: the Python of an environment with lerobot."""


def write(sink, folder, made, size=20):
    """Shards of `size` samples, written from the last to the first, as workers might, and finished."""
    shards = range(0, len(made), size)
    done = [
        file for first in reversed(shards) for file in sink.write(folder, first // size, made[first : first + size])
    ]
    return [*done, *sink.finish(folder, {})]


@pytest.fixture(scope="module")
def made():
    return list(samples(40))


@pytest.fixture(scope="module")
def made_again():
    return list(samples(40))


@pytest.fixture(scope="module")
def lerobot(made, tmp_path_factory):
    folder = tmp_path_factory.mktemp("data")
    write(LeRobotEpisodes(), folder, made)
    return folder / "lerobot"


@pytest.mark.parametrize("name", FORMATS)
def test_samples_come_back_as_they_were(name, made, tmp_path):
    files = write(FORMATS[name], tmp_path, made)
    back = list(read(tmp_path))
    assert [one.to_dict() for one in back] == [one.to_dict() for one in sorted(back, key=lambda s: s.index)]
    assert [one.to_dict() for one in back] == [one.to_dict() for one in made]
    assert all(one.holds() for one in back[::10])
    for file in files:
        content = (tmp_path / file.path).read_bytes()
        assert hashlib.sha256(content).hexdigest() == file.sha256 and len(content) == file.bytes
    listed = {file.path for file in files}
    assert listed == {path.relative_to(tmp_path).as_posix() for path in tmp_path.rglob("*") if path.is_file()}


@pytest.mark.parametrize("name", FORMATS)
def test_the_same_bytes_each_time(name, made, made_again, tmp_path):
    once, again = tmp_path / "once", tmp_path / "again"
    assert write(FORMATS[name], once, made) == write(FORMATS[name], again, made_again)
    assert write(FORMATS[name], again, made) == write(FORMATS[name], once, made), "it can be written over"


@pytest.mark.parametrize("name", [name for name in FORMATS if name != "jsonl"])
def test_no_split_holds_a_sample_of_another(name, made, tmp_path):
    write(FORMATS[name], tmp_path, made)
    (root,) = {path.name for path in tmp_path.iterdir()} - {"lerobot"}
    for split in ("train", "val", "test"):
        alone = tmp_path / f"only-{split}"
        shutil.copytree(tmp_path / root / split, alone / root / split)
        assert [one.index for one in read(alone)] == [one.index for one in made if one.split == split]


def test_formats_are_named():
    with pytest.raises(RequestError, match=r"no format 'tfrecord'; the formats are jsonl, parquet, lerobot, "):
        sinks_named(["jsonl", "tfrecord"])
    with pytest.raises(RequestError, match="choose one of them"):
        sinks_named(["lerobot", "lerobot-language"])
    assert [sink.name for sink in sinks_named(["mcap", "jsonl", "mcap"])] == ["mcap", "jsonl", "card"]


def test_a_folder_without_samples_is_said(tmp_path):
    with pytest.raises(FormatError, match="holds no augmented data"):
        read(tmp_path)
    for name, sink in FORMATS.items():
        folder = tmp_path / name
        for file in sink.write(folder, 0, list(samples(1))):
            (folder / file.path).write_bytes(b'{"a": 1}' if name == "scenes" else b"\x1f\x8b nothing")
        with pytest.raises(FormatError):
            list(read(folder))


def test_turned_samples_come_back(tmp_path):
    made = list(samples(3, turned=True))
    write(LeRobotEpisodes(), tmp_path, made)
    assert [one.to_dict() for one in read(tmp_path)] == [one.to_dict() for one in made]
    for task, sample in zip(episodes(tmp_path / "lerobot" / "train"), made, strict=True):
        turns = task.trajectory.orientations
        assert np.allclose(turns[0], sample.adapted.orientations[0]) and np.allclose(
            turns[-1], sample.adapted.orientations[-1], atol=1e-6
        )


def test_episodes_are_the_motion_at_a_fixed_rate(made, lerobot):
    mine = [sample for sample in made if sample.split == "train"]
    info = json.loads((lerobot / "train" / "meta" / "info.json").read_text())
    table = parquet.read_table(lerobot / "train" / "data" / "chunk-000" / "file-000.parquet", partitioning=None)
    assert info["codebase_version"] == "v3.0" and info["total_episodes"] == len(mine) == 32
    assert info["total_frames"] == table.num_rows and info["splits"] == {"train": "0:32"}
    assert table.schema.field("observation.state").type == pyarrow.list_(pyarrow.float32(), 4)
    assert table["index"].to_pylist() == list(range(table.num_rows))
    about = parquet.read_table(lerobot / "train" / "meta" / "episodes", partitioning=None).to_pylist()
    for row, sample in zip(about, mine, strict=True):
        rows = table.slice(row["dataset_from_index"], row["length"]).to_pydict()
        moments = np.array(rows["frame_index"]) / info["fps"]
        assert np.allclose(rows["timestamp"], moments) and row["tasks"] == [sample.instruction]
        state = np.array(rows["observation.state"])
        assert np.allclose(state, frames_of(sample.adapted, moments, turned=False), atol=1e-6)
        assert np.allclose(state[[0, -1], :3], sample.adapted.positions[[0, -1]], atol=1e-6), "start and goal"
        assert np.allclose(rows["action"][:-1], state[1:]) and np.allclose(rows["action"][-1], state[-1])
        reference = np.array(rows["observation.environment_state"])
        assert np.allclose(reference[-1, :3], sample.task.trajectory.positions[-1], atol=1e-6)
        assert row["stats/observation.state/min"] == pytest.approx(state.min(axis=0), abs=1e-6)


def test_statistics_are_those_of_all_frames(lerobot):
    table = parquet.read_table(lerobot / "train" / "data" / "chunk-000" / "file-000.parquet", partitioning=None)
    stats = json.loads((lerobot / "train" / "meta" / "stats.json").read_text())
    for name, said in stats.items():
        rows = np.array(table[name].to_pylist(), dtype=float).reshape(table.num_rows, -1)
        reach = np.ptp(rows, axis=0) + 1e-9
        assert said["count"] == [len(rows)]
        for key, value in (("mean", rows.mean(axis=0)), ("std", rows.std(axis=0)), ("min", rows.min(axis=0))):
            assert (np.abs(value - said[key]) < 1e-5 * reach + 1e-6).all(), (name, key)
        for key, share in (("q01", 0.01), ("q50", 0.5), ("q99", 0.99)):
            assert (np.abs(np.quantile(rows, share, axis=0) - said[key]) < 2e-3 * reach).all(), (name, key)


def test_tasks_have_the_index_that_lerobot_expects(lerobot, made):
    table = parquet.read_table(lerobot / "train" / "meta" / "tasks.parquet")
    about = json.loads(table.schema.metadata[b"pandas"])
    assert about["index_columns"] == ["task"] and {c["field_name"] for c in about["columns"]} == {"task", "task_index"}
    assert table["task_index"].to_pylist() == list(range(table.num_rows))
    assert set(table["task"].to_pylist()) == {sample.instruction for sample in made if sample.split == "train"}


def test_files_are_cut_at_their_limit(made, tmp_path, monkeypatch):
    for name, value in (("BATCH", 100), ("FILE_MB", 0.05), ("CHUNK", 2)):
        monkeypatch.setattr(f"ovita.augment.lerobot.{name}", value)
    write(LeRobotEpisodes(), tmp_path, made)
    root = tmp_path / "lerobot" / "train"
    files = sorted(path.relative_to(root).as_posix() for path in (root / "data").rglob("*.parquet"))
    assert files[:3] == [f"data/chunk-00{i // 2}/file-00{i % 2}.parquet" for i in range(3)]
    about = parquet.read_table(root / "meta" / "episodes", partitioning=None).to_pylist()
    for row in about:
        place = root / f"data/chunk-{row['data/chunk_index']:03d}/file-{row['data/file_index']:03d}.parquet"
        numbers = parquet.read_table(place, columns=["episode_index"], partitioning=None)["episode_index"].to_pylist()
        assert numbers.count(row["episode_index"]) == row["length"]
    assert [task.instruction for task in episodes(root)] == [s.instruction for s in made if s.split == "train"]


def test_an_episode_is_opened_with_its_scene(lerobot, made):
    third = [sample for sample in made if sample.split == "train"][3]
    task = load_task(lerobot / "train", Choices(message=3))
    assert task.instruction == third.instruction and task.robot == "drone"
    assert [item.name for item in task.scene] == [item.name for item in third.task.scene]
    assert task.trajectory.duration == pytest.approx(third.adapted.duration, abs=0.15)
    assert task.trajectory == episodes(lerobot / "train")[3].trajectory == episode(lerobot / "train", 3 - 32).trajectory
    assert "it holds 32 episodes; read the last (--message picks another)" in load_task(lerobot / "train").notes
    with pytest.raises(FormatError, match="there is no episode 32; it holds 32 episodes, counted from 0"):
        load_task(lerobot / "train", Choices(message=32))


def test_scene_files_are_tasks_with_checks(made, tmp_path):
    write(FORMATS["scenes"], tmp_path, made[:3])
    for sample, judged in zip(made, load_dataset(tmp_path / "scenes").samples, strict=False):
        assert judged.task.trajectory == sample.task.trajectory and judged.kind == sample.family
        assert judged.check.judge(sample.task.trajectory, sample.adapted, judged.task.scene).passed


def test_a_file_with_any_check_is_read_by_the_benchmark_alone(tmp_path):
    """Found by a stranger: `ovita bench run` knew only part of the checks that samples bear."""
    code = "from ovita.measure.predicates import Check; Check('rests_at', {'place': 'cup'})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_bags_hold_a_message_for_each_sample(made, tmp_path):
    write(FORMATS["mcap"], tmp_path, made)
    file, mine = tmp_path / "mcap" / "train" / "000000.mcap", [s for s in made[:20] if s.split == "train"]
    for number in (0, 15):
        for topic, path in ((ORIGINAL, mine[number].task.trajectory), (ADAPTED, mine[number].adapted)):
            task = load_task(file, Choices(topic=topic, message=number))
            back = transformed(task.trajectory, task.scene.frame, mine[number].task.scene.frame)
            assert np.allclose(back.positions, path.positions) and np.allclose(back.speeds, path.speeds)


def test_a_data_set_is_replaced_only_once_it_is_whole(made, tmp_path, monkeypatch):
    sink = LeRobotEpisodes()
    before = write(sink, tmp_path, made[:8])
    monkeypatch.setattr("ovita.augment.lerobot._tasks_table", lambda tasks: 1 / 0)
    sink.write(tmp_path, 1, made[10:18])
    with pytest.raises(ZeroDivisionError):
        sink.finish(tmp_path, {})
    assert all(hashlib.sha256((tmp_path / f.path).read_bytes()).hexdigest() == f.sha256 for f in before)
    monkeypatch.undo()
    sink.finish(tmp_path, {})
    assert len(episodes(tmp_path / "lerobot" / "train")) == 16
    assert [path.name for path in (tmp_path / "lerobot").iterdir()] == ["train"], "nothing half-made is left"


@pytest.mark.parametrize("language", [False, True])
def test_lerobot_itself_reads_the_episodes(language, made, tmp_path):
    python = os.environ.get(LEROBOT)
    if not python:
        pytest.skip(f"{LEROBOT} names no Python with lerobot; see docs/augment-formats.md")
    found = subprocess.run([python, "-c", "import lerobot.datasets.language"], capture_output=True)
    if language and found.returncode:
        pytest.skip("this lerobot is older than 0.6 and knows no columns for language")
    write(LeRobotEpisodes(language=language), tmp_path, made)
    script = Path(__file__).with_name("lerobot_itself.py")
    offline = os.environ | {"HF_HUB_OFFLINE": "1", "HF_HOME": str(tmp_path / "hf")}
    done = subprocess.run(
        [python, script, tmp_path / "lerobot" / "val"], capture_output=True, text=True, env=offline, timeout=300
    )
    assert done.returncode == 0, done.stderr[-2000:]
    seen = json.loads(done.stdout.splitlines()[-1])
    mine = [sample for sample in made if sample.split == "val"]
    assert seen["episodes"] == len(mine) and seen["fps"] == 10
    assert seen["first_task"] == mine[0].instruction and seen["last_task"] == mine[-1].instruction
    assert np.allclose(seen["first_state"][:3], mine[0].adapted.positions[0], atol=1e-6)
    assert np.allclose(seen["last_state"][:3], mine[-1].adapted.positions[-1], atol=1e-6)
    assert np.allclose(seen["last_reference"][:3], mine[-1].task.trajectory.positions[-1], atol=1e-6)
    assert seen["batch"]["action"] == [16, 4] and seen["chunk_of_actions"] == [3, 4]
    assert seen["frames_of_last_episode"] == seen["lengths"][-1] and sum(seen["lengths"]) == seen["frames"]
    if language:
        wordings = [mine[0].instruction, *mine[0].paraphrases]
        assert [text for style, text in seen["language"] if style == "task_aug"] == wordings
        assert {task for task, _ in seen["tasks_in_turn"]} == set(wordings)
