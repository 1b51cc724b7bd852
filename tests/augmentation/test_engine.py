"""Datasets: verified, the same bytes whoever works, and exactly once whatever is killed."""

import json
import os
import signal
import subprocess
import sys
from dataclasses import replace

import pytest

from command_line import ovita
from ovita.augment.engine import Job, Machine, Rates, measure, run
from ovita.augment.engine import lines as lines_of_plan
from ovita.augment.ground import RandomScenes, Tasks
from ovita.augment.shards import ShardRecord, read_samples
from ovita.augment.sources import open_pool
from ovita.augment.verified import Manner, split_of
from ovita.augment.wording import families_from
from ovita.bench.generate import generate
from ovita.errors import FormatError, RequestError
from ovita.instruct.frames import from_json
from ovita.io import save_task
from ovita.limits import constrain
from ovita.paths.trajectory import Trajectory

FEW = Manner(3, families_from(("shift", "speed", "ends", "several")), paraphrases=2)
SCENES = RandomScenes(("tabletop", "drone"), waypoints=24)
JOB = Job(24, FEW, SCENES, shard=8, block=6)


def lines(folder):
    """The samples as they lie on disk."""
    return [json.dumps(sample.to_dict()) for sample in read_samples(folder)]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("made") / "data"
    return run(JOB, folder)


def test_every_sample_passes_its_own_check_and_keeps_the_limits(made):
    samples = list(read_samples(made.folder))
    assert [s.index for s in samples] == list(range(24)) and made.kept == 24
    for sample in samples:
        task = sample.task
        assert sample.holds() and not replace(sample, adapted=task.trajectory).holds()
        assert from_json(sample.frames)
        robot = SCENES.ground(3, sample.index // 6).robot
        solution = constrain(sample.adapted, task.scene, robot, original=task.trajectory)
        assert solution.verdict.status in ("satisfied", "preexisting")
        assert len({sample.instruction.casefold(), *map(str.casefold, sample.paraphrases)}) == 3


def test_a_sample_depends_on_the_seed_and_its_number_alone(made, tmp_path):
    whole = lines(made.folder)
    assert lines(run(replace(JOB, shard=5), tmp_path / "five").folder) == whole
    assert lines(run(replace(JOB, n=10, shard=7), tmp_path / "ten").folder) == whole[:10]
    other = run(replace(JOB, n=6, manner=replace(FEW, seed=4)), tmp_path / "other")
    assert not set(lines(other.folder)) & set(whole)


def test_a_scene_is_in_one_split_and_says_nothing_twice(made):
    samples = list(read_samples(made.folder))
    splits = {}
    for sample in samples:
        assert splits.setdefault(sample.source, sample.split) == sample.split
    said = [(s.source, json.dumps(s.frames)) for s in samples]
    assert len(set(said)) == len(said)
    shares = [split_of(f"scene {i}", (0.8, 0.1, 0.1)) for i in range(2000)]
    assert [shares.count(s) / 2000 for s in ("train", "val", "test")] == pytest.approx([0.8, 0.1, 0.1], abs=0.03)


def test_the_manifest_counts_what_is_there(made):
    manifest = json.loads((made.folder / "manifest.json").read_text())
    assert manifest["kept"] == sum(shard["kept"] for shard in manifest["shards"]) == 24
    assert sum(manifest["counts"]["family"].values()) == 24
    assert [(s["first"], s["end"]) for s in manifest["shards"]] == [(0, 8), (8, 16), (16, 24)]


def test_near_duplicates_over_all_blocks_of_a_source_are_removed(tmp_path):
    (sample,) = generate(1, seed=5, robots=("tabletop",), families=("latte",))
    pool = Tasks((("one", sample.task, "x"),))
    job = Job(60, replace(FEW, families=("law",), paraphrases=0), pool, shard=20, block=10)
    both = [run(replace(job, shard=shard), tmp_path / str(shard)) for shard in (20, 60)]
    assert lines(both[0].folder) == lines(both[1].folder)
    manifest = both[0].manifest
    assert 0 < both[0].kept < 60 and both[0].kept + manifest["rejected"].get("exhausted", 0) < 60
    frames = [json.dumps(s.frames) for s in read_samples(both[0].folder)]
    assert len(set(frames)) == len(frames)


def test_a_run_goes_on_where_it_was_and_refuses_what_is_another(made, tmp_path):
    folder = tmp_path / "data"
    again = run(JOB, folder)
    before = {path: path.stat().st_mtime_ns for path in folder.rglob("*.gz")}
    (folder / "shards" / "000001.json").unlink()
    again = run(JOB, folder)
    assert again.made == 1 and again.manifest == made.manifest
    changed = {path.name for path in folder.rglob("*.gz") if path.stat().st_mtime_ns != before[path]}
    assert changed == {"000001.jsonl.gz"}
    with pytest.raises(RequestError, match="holds another dataset"):
        run(replace(JOB, n=25), folder)
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "mine.txt").write_text("precious")
    with pytest.raises(RequestError, match="not empty"):
        run(JOB, tmp_path / "other")


CHILD = """
import os, signal, sys
sys.path[:0] = [{here!r}, os.path.dirname({here!r})]
import test_engine as t
from ovita.augment import engine
real, count = engine.write_shard, 0
def write_shard(job, root, shard, without=frozenset()):
    global count
    count += 1
    if count == 2 and not os.path.exists({mark!r}):
        open({mark!r}, "w").close()
        engine.ShardRecord.save = lambda self, folder: os.kill(os.getpid(), signal.SIGKILL)
    return real(job, root, shard, without)
engine.write_shard = write_shard
if __name__ == "__main__":
    engine.run(t.JOB, {folder!r}, jobs={jobs})
"""


@pytest.mark.parametrize("jobs", [1, 2], ids=["driver", "worker"])
def test_exactly_once_after_kill_9(jobs, made, tmp_path):
    """With one job the driver itself is killed between the files of a shard and its record, with two a worker is."""
    folder, mark, script = tmp_path / "data", tmp_path / "killed", tmp_path / "child.py"
    here = os.path.dirname(__file__)
    script.write_text(CHILD.format(here=here, mark=str(mark), folder=str(folder), jobs=jobs))
    first = subprocess.run([sys.executable, str(script)], timeout=120, capture_output=True, text=True)
    assert mark.exists()
    if jobs == 1:
        assert first.returncode == -signal.SIGKILL
        assert ShardRecord.load(folder, 0) is not None and ShardRecord.load(folder, 1) is None
        run(JOB, folder)
    else:
        assert first.returncode == 0, first.stderr
    assert lines(folder) == lines(made.folder)
    assert (folder / "manifest.json").read_bytes() == (made.folder / "manifest.json").read_bytes()
    assert not list(folder.rglob("*.tmp"))


@pytest.mark.filterwarnings("ignore")
def test_ray_makes_the_same_bytes(made, tmp_path):
    pytest.importorskip("ray", reason="Ray is not installed: pip install 'ovita[ray]'")
    run(JOB, tmp_path / "data", jobs=2, engine="ray")
    files = [path.relative_to(made.folder) for path in made.folder.rglob("*.gz")]
    assert files
    for file in [*files, "manifest.json"]:
        assert (tmp_path / "data" / file).read_bytes() == (made.folder / file).read_bytes()


def test_sources_of_every_kind(tmp_path):
    samples = list(generate(2, seed=1, robots=("drone",)))
    for i, sample in enumerate(samples):
        save_task(tmp_path / f"scene{i}.json", sample.task)
    (tmp_path / "notes.json").write_text("[]")
    pool, notes = open_pool([tmp_path, "random:arm", samples[0].task.trajectory], robot="drone")
    assert len(notes) == 1 and "notes.json" in notes[0]
    names = {pool.ground(0, block).name.split("/")[0] for block in range(8)}
    assert names >= {"random:arm", "task:00002"} and any(name.startswith("file:") for name in names)
    for wrong, said in ((["random:boat"], "random scenes for"), (["nowhere"], "no such file")):
        with pytest.raises(RequestError, match=said):
            open_pool(wrong)
    with pytest.raises(FormatError):
        open_pool([tmp_path / "notes.json"])


def test_the_command_line(tmp_path):
    out = tmp_path / "data"
    shown = ovita(
        "augment", "random:tabletop", "--n", "6", "--families", "shift", "--waypoints", "20", "--out", str(out)
    )
    assert shown.returncode == 0 and "6 verified samples" in shown.stdout and "family: shift 6" in shown.stdout
    assert len(list(read_samples(out))) == 6
    wrong = ovita("augment", "random", "--families", "dance", "--out", str(tmp_path / "x"))
    assert wrong.returncode == 2 and "there is no family 'dance'" in wrong.stderr


def test_a_plan_follows_from_what_was_measured(tmp_path):
    rates = Rates(seconds=0.004, bytes=2000.0, share=0.99)
    taken = Machine.parse("big = 64, 2.5").takes(1e8, rates)
    assert taken == pytest.approx((1e8 * 0.004 / 64 / 3600, 1e8 * 0.004 / 64 / 3600 * 2.5))
    text = "\n".join(lines_of_plan(1e8, rates, [], 1000))
    assert "111 core-hours, 200 GB, 100000 shards" in text and "examples" in text
    measured = measure(JOB, trial=6)
    assert measured.seconds > 0 and 100 < measured.bytes < 20_000 and 0 < measured.share <= 1
    wrong = ovita("augment", "random", "--plan", "1e8", "--machine", "big")
    assert wrong.returncode == 2 and "NAME=CORES,PRICE" in wrong.stderr


def test_what_breaks_its_limits_or_stands_still_is_left_out(tmp_path):
    """The limits would change it where no sentence does, and a label would be wrong."""
    still = Trajectory([[0.0, 0.0, 0.3]] * 3, [0.2] * 3)
    far = Trajectory([[0.0, 0.0, 0.5], [0.5, 0.0, 0.5], [2.0, 0.0, 0.5]], [0.1] * 3)
    fine = Trajectory([[0.0, 0.0, 0.5], [0.1, 0.1, 0.5], [0.2, 0.0, 0.5]], [0.1] * 3)
    pool, notes = open_pool([still, far, fine], robot="arm")
    assert [one["name"] for one in pool.describe()] == ["task:00002"]
    assert "stands still" in notes[0] and "breaks limits of the robot arm (workspace)" in notes[1]
    with pytest.raises(RequestError, match="stands still"):
        open_pool([still])


def test_what_a_killed_writer_left_is_removed(tmp_path):
    run(JOB, tmp_path / "data")
    left = tmp_path / "data" / "shards" / ".ovita-0123456789abcdef.tmp"
    left.parent.mkdir(exist_ok=True)
    left.write_bytes(b"half")
    run(JOB, tmp_path / "data")
    assert not left.exists()
