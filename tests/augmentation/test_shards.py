"""Samples as documents, and shards that are done or not."""

import hashlib
import json
from dataclasses import replace

import numpy as np
import pytest

from ovita.augment.shards import AugmentedSample, JsonLines, ShardRecord, Sink, is_there, read_samples, record_file
from ovita.errors import FormatError
from ovita.io import Task
from ovita.measure.predicates import moved
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory


@pytest.fixture
def sample() -> AugmentedSample:
    path = Trajectory([[0.0, 0.0, 0.1], [0.5, 0.0, 0.1], [1.0, 0.0, 0.1]], [0.1, 0.2, 0.1])
    said = "Shift it 20 cm up"
    task = Task(path, Scene((SceneObject("red cup", (0.5, 0.4, 0.1)),)), said, robot="drone")
    frame = {"frame": "Shift", "offset": [["up", {"value": 0.2, "unit": "m"}]]}
    return AugmentedSample(
        *(3, 7, "random:drone/00000", task, said, ("Up by 0.2 m",), (frame,)),
        *(
            path.with_(positions=path.positions + np.array([0.0, 0.0, 0.2])),
            "def adapt(traj, scene):\n    return traj\n",
            (),
        ),
        *("done", moved(up=0.2).to_dict(), {"magnitude": 0.2}, "shift", "train", "0.1"),
    )


def test_a_sample_survives_its_document_and_judges_itself(sample):
    again = AugmentedSample.from_dict(json.loads(json.dumps(sample.to_dict())))
    assert again.to_dict() == sample.to_dict()
    assert again.holds()
    assert not replace(again, adapted=again.task.trajectory).holds()


def test_a_shard_is_done_once_its_record_is_there_and_its_files_are_whole(tmp_path, sample):
    sink = JsonLines()
    assert isinstance(sink, Sink)
    files = tuple(sink.write(tmp_path, 0, [sample]))
    assert ShardRecord.load(tmp_path, 0) is None
    record = ShardRecord(0, 3, 4, 1, files, {"check": 2}, {"family": {"shift": 1}}, ((3, "ab"),))
    record.save(tmp_path)
    assert ShardRecord.load(tmp_path, 0) == record
    (file,) = files
    assert hashlib.sha256((tmp_path / file.path).read_bytes()).hexdigest() == file.sha256
    assert [s.to_dict() for s in read_samples(tmp_path)] == [sample.to_dict()]
    damaged = bytearray((tmp_path / file.path).read_bytes())
    damaged[-9] ^= 1
    (tmp_path / file.path).write_bytes(damaged)
    assert is_there(tmp_path, file) and not is_there(tmp_path, file, whole=True)
    (tmp_path / file.path).write_bytes(damaged[:20])
    assert ShardRecord.load(tmp_path, 0) is None
    with pytest.raises(FormatError, match="no shard of samples"):
        list(read_samples(tmp_path))


def test_a_record_that_is_none_is_refused(tmp_path):
    (tmp_path / "shards").mkdir()
    record_file(tmp_path, 0).write_text("{}")
    with pytest.raises(FormatError, match="no record of a shard"):
        ShardRecord.load(tmp_path, 0)
