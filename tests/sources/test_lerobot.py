"""Episodes of LeRobot data sets, versions 2 and 3."""

import json

import numpy as np
import pytest
from shown import demonstrations

from ovita.errors import FormatError
from ovita.io.lerobot import episodes
from ovita.paths.trajectory import Array, Trajectory
from ovita.sources.demonstrations import read_demonstrations
from ovita.sources.learning import learn
from ovita.sources.taskframes import rotation

pyarrow = pytest.importorskip("pyarrow", reason="pyarrow (extra lerobot) is not installed")
from pyarrow import parquet  # noqa: E402


def write(folder, paths: list[Trajectory], names: object, *, version: int = 3, more: Array | None = None) -> None:
    """A data set as LeRobot writes it: all episodes in one file (version 3), or one file each (version 2)."""
    (folder / "meta").mkdir()
    (folder / "data" / "chunk-000").mkdir(parents=True)
    state = {"dtype": "float32", "shape": [3], "names": names}
    info = {"codebase_version": f"v{version}.0", "features": {"index": {"shape": [1], "names": None}}}
    info["features"] |= {
        "observation.images.front": {"names": ["height", "width", "channel"]},
        "observation.state": state,
    }
    (folder / "meta" / "info.json").write_text(json.dumps(info))
    tables = []
    for i, path in enumerate(paths):
        rows = path.positions if more is None else np.column_stack([path.positions, np.tile(more, (len(path), 1))])
        columns = {"observation.state": rows.tolist(), "timestamp": path.times.tolist()}
        tables.append(pyarrow.table(columns | {"episode_index": [i] * len(path)}))
    if version == 3:
        parquet.write_table(pyarrow.concat_tables(tables), folder / "data" / "chunk-000" / "file-000.parquet")
        return
    for i, table in enumerate(tables):
        parquet.write_table(table, folder / "data" / "chunk-000" / f"episode_{i:06d}.parquet")


@pytest.mark.parametrize("version", [2, 3])
@pytest.mark.parametrize("names", [["x", "y", "z"], {"motors": ["ee.x", "ee.y", "ee.z"]}, ["eef_x", "eef_y", "eef_z"]])
def test_episodes_are_tasks(version, names, tmp_path):
    shown = demonstrations(3)
    write(tmp_path, shown, names, version=version)
    tasks = episodes(tmp_path)
    assert [t.path for t in tasks] == [f"{tmp_path}: episode {i}" for i in range(3)]
    for task, path in zip(tasks, shown, strict=True):
        assert np.allclose(task.trajectory.positions, path.positions)
        assert task.trajectory.duration == pytest.approx(path.duration, rel=0.02)
    assert learn(read_demonstrations([tmp_path])).shown == 3


def test_angles_and_quaternions_are_orientations(tmp_path):
    angles, turns = tmp_path / "angles", tmp_path / "turns"
    angles.mkdir(), turns.mkdir()
    write(angles, demonstrations(1), ["x", "y", "z", "roll", "pitch", "yaw"], more=np.array([0.0, 0.0, 0.5]))
    write(turns, demonstrations(1), ["ee.x", "ee.y", "ee.z", "ee.qx", "ee.qy", "ee.qz", "ee.qw"], more=np.eye(4)[3])
    (one,), (two,) = episodes(angles), episodes(turns)
    assert np.allclose(rotation(one.trajectory.orientations).as_rotvec(), [0, 0, 0.5])
    assert np.allclose(two.trajectory.orientations, [1, 0, 0, 0])


def test_what_holds_no_positions_is_refused(tmp_path):
    joints, bare = tmp_path / "joints", tmp_path / "bare"
    joints.mkdir(), bare.mkdir()
    write(joints, demonstrations(1), ["shoulder_pan", "elbow", "wrist"])
    with pytest.raises(FormatError, match=r"no feature holds the positions x, y, z \(observation.state holds shoulder"):
        episodes(joints)
    write(bare, demonstrations(1), ["x", "y", "z"])
    (bare / "data" / "chunk-000" / "file-000.parquet").write_bytes(b"no parquet at all")
    with pytest.raises(FormatError, match="cannot be read as Parquet"):
        episodes(bare)
    (bare / "data" / "chunk-000" / "file-000.parquet").unlink()
    with pytest.raises(FormatError, match=r"there is no \.parquet file under data/"):
        episodes(bare)
