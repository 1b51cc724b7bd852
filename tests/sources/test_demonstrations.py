"""Demonstrations: aligned in time, counted, compared, and refused where they do not belong together."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shown import demonstration, demonstrations, swing

from ovita.errors import FormatError, RequestError
from ovita.io import Task, load_task, save_trajectory
from ovita.paths.scene import Frame, Scene
from ovita.paths.trajectory import Trajectory
from ovita.sources.demonstrations import aligned, read_demonstrations, warp
from ovita.sources.learning import learn


def task(trajectory: Trajectory, name: str, frame: str = "rfu") -> Task:
    return Task(trajectory, Scene(frame=Frame(frame)), path=name)


@pytest.mark.parametrize("by", ["dtw", "arc_length", "time"])
def test_alignment_keeps_ends_and_phases(by):
    shown = demonstrations(4, turning=True)
    found = aligned(shown, [one.positions for one in shown], by)
    assert found.positions.shape == (4, 101, 3) and found.orientations.shape == (4, 101, 4)
    for i, one in enumerate(shown):
        assert np.allclose(found.positions[i, [0, -1]], one.positions[[0, -1]], atol=1e-9)


def test_warping_undoes_a_detour_and_arc_length_undoes_the_pace():
    """One demonstration makes a longer way in the middle: by arc length all that follows comes too early."""
    s = np.linspace(0, 1, 120)
    straight = np.stack([s, 0 * s, 0 * s], axis=1)
    detour = np.stack([s, 0.25 * np.exp(-(((s - 0.35) / 0.05) ** 2)), 0 * s], axis=1)
    shown = [Trajectory(straight, np.full(120, 0.2)), Trajectory(detour, np.full(120, 0.2))]
    gaps = {}
    for by in ("dtw", "arc_length"):
        found = aligned(shown, [one.positions for one in shown], by).positions
        gaps[by] = np.abs(found[0, :, 0] - found[1, :, 0]).mean()
    assert gaps["dtw"] < 0.5 * gaps["arc_length"]
    slow = [Trajectory(swing(np.linspace(0, 1, 90) ** power), np.full(90, 0.2)) for power in (0.7, 1.0, 1.6)]
    found = aligned(slow, [one.positions for one in slow], "arc_length").positions
    assert np.abs(found - found[:1]).max() < 5e-3


@given(st.lists(st.floats(-1, 1), min_size=6, max_size=40), st.integers(0, 5))
def test_warping_is_monotone_and_keeps_the_ends(values, seed):
    rows = np.array(values)[:, None]
    other = rows + np.random.default_rng(seed).normal(0, 0.2, rows.shape)
    found = warp(rows, other)
    assert found[0] == pytest.approx(0.0, abs=1e-9) and found[-1] == pytest.approx(len(rows) - 1)
    assert (np.diff(found) >= -1e-9).all()


@pytest.mark.parametrize("kind", ["kmp", "promp", "tpgmm"])
def test_one_demonstration_has_no_variance(kind):
    with pytest.raises(RequestError, match=f"one demonstration shows no variance, which a {kind} is made of.*dmp"):
        learn([demonstration()], kind)
    assert learn([demonstration()], "dmp").generate().covariance is None


def test_two_demonstrations_fall_back_to_the_same_variance_in_all_directions():
    skill = learn(demonstrations(2))
    assert "two demonstrations are too few for a covariance" in skill.notes[0]
    covariance = skill.generate().covariance
    assert np.allclose(covariance, covariance[:, :1, :1] * np.eye(3), atol=1e-12)
    assert not learn(demonstrations(3)).notes


def test_no_demonstration_is_refused():
    with pytest.raises(RequestError, match="there is no demonstration"):
        learn([])


def test_disagreement_is_refused_by_name():
    shown = demonstrations(3)
    good = [task(one, f"{name}.csv") for one, name in zip(shown, "abc", strict=True)]
    backwards = shown[1].with_(positions=shown[1].positions[::-1])
    with pytest.raises(FormatError, match=r"b.csv: runs the other way than [ac].csv"):
        learn([good[0], task(backwards, "b.csv"), good[2]])
    with pytest.raises(FormatError, match=r"b.csv: is \d+ times as large as the others \(.*\); is it in metres"):
        learn([good[0], task(shown[1].with_(positions=1000 * shown[1].positions), "b.csv")])
    with pytest.raises(FormatError, match=r"c.csv: is in the frame flu, but a.csv in rfu"):
        learn([good[0], good[1], task(shown[2], "c.csv", "flu")])
    with pytest.raises(FormatError, match=r"c.csv: never leaves its place"):
        learn([*good[:2], task(Trajectory(np.zeros((5, 3)), np.zeros(5)), "c.csv")])
    flipped = [np.array([[np.cos(a), np.sin(a), 0, 0]] * 80) for a in (0.0, 0.0, 0.0, 0.0, 1.5)]
    with pytest.raises(RequestError, match="degrees from their mean"):
        learn([Trajectory(swing(np.linspace(0, 1, 80)), np.full(80, 0.2), turn) for turn in flipped])


def test_doubts_are_said():
    shown = [task(one, f"{i}.csv") for i, one in enumerate(demonstrations(6))]
    far = replace(
        shown[5], trajectory=shown[5].trajectory.with_(positions=shown[5].trajectory.positions + np.array([0, 1, 0]))
    )
    assert any("5.csv lies 1.0" in text for text in learn([*shown[:5], far]).notes)
    turned = task(demonstration(seed=9, turning=True), "t.csv")
    skill = learn([*shown, turned])
    assert any("only t.csv of 7 demonstrations has orientations" in text for text in skill.notes)
    assert skill.generate().trajectory.orientations is None
    waiting = np.insert(shown[0].trajectory.to_array(), 20, shown[0].trajectory.to_array()[20], axis=0)
    waiting[21, 3] = 0.0
    assert any(
        "the pauses of w.csv" in text for text in learn([*shown, task(Trajectory.from_array(waiting), "w.csv")]).notes
    )


@pytest.mark.parametrize("ending", ["csv", "json", "tum"])
def test_demonstrations_enter_through_every_format(ending, tmp_path):
    files = []
    for i, one in enumerate(demonstrations(3, turning=True)):
        files.append(str(tmp_path / f"{i}.{ending}"))
        save_trajectory(files[-1], one)
    tasks = read_demonstrations(files)
    assert [t.path for t in tasks] == files
    one = learn(tasks).generate().trajectory
    same = learn(files).generate().trajectory
    assert one == same and np.allclose(one.positions[[0, -1]], swing(np.array([0.0, 1.0])), atol=0.02)
    assert load_task(files[0]).trajectory.orientations is not None
