"""A skill adapted by instruction: its mean moves, its variance and its generalisation stay."""

import json
import runpy
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from shown import demonstrations, reaching

from ovita.cli.main import cli
from ovita.errors import FormatError, OvitaError
from ovita.io import Task, load_task, save_task
from ovita.limits import ConstraintOptions
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene, SceneObject
from ovita.plots.geometry import tube
from ovita.sources.adapted_skills import adapt_skill
from ovita.sources.learning import learn
from ovita.sources.skills import KINDS, Skill

ROOT = Path(__file__).parents[2]
CUP = Scene((SceneObject("cup", np.array([0.3, 0.0, 0.05]), np.array([0.08, 0.08, 0.1])),))


def skill_of(kind: str, turning: bool = False) -> Skill:
    return learn([Task(one, CUP) for one in demonstrations(6, turning=turning)], kind)


@pytest.mark.parametrize("kind", KINDS)
def test_the_mean_is_adapted_and_the_variance_is_kept(kind):
    skill = skill_of(kind, turning=True)
    edited = adapt_skill(skill, "go a bit higher over the cup", writer="builtin")
    assert edited.result.status == "done" and not edited.notes
    before, after = skill.generate(), edited.skill.generate()
    assert np.allclose(after.trajectory.positions, edited.result.adapted.positions, atol=1e-9)
    lifted = after.trajectory.positions[:, 2] - before.trajectory.positions[:, 2]
    assert lifted.max() > 0.03 and abs(lifted[0]) < 1e-9
    assert before.covariance is None or np.array_equal(before.covariance, after.covariance)
    assert np.allclose(np.abs(np.sum(before.trajectory.orientations * after.trajectory.orientations, axis=1)), 1.0)
    assert edited.skill.edits == ("go a bit higher over the cup",)


@pytest.mark.parametrize("kind", ["kmp", "dmp", "tpgmm"])
def test_an_adapted_skill_still_generalises(kind):
    edited = adapt_skill(skill_of(kind), "go up by 0.1 near the cup", writer="builtin").skill
    made = edited.generate(start=[0.05, 0.0, 0.2], goal=[0.7, 0.1, 0.25])
    path = made.trajectory.positions
    assert np.allclose(path[[0, -1]], [[0.05, 0.0, 0.2], [0.7, 0.1, 0.25]], atol=5e-3)
    unedited = skill_of(kind).generate(start=[0.05, 0.0, 0.2], goal=[0.7, 0.1, 0.25]).trajectory.positions
    assert 0.09 < (path - unedited)[:, 2].max() < 0.11


def test_speeds_are_adapted_and_pauses_are_said_to_be_lost():
    skill = skill_of("kmp")
    slow = adapt_skill(skill, "half the speed near the cup", writer="builtin").skill
    assert np.allclose(slow.generate().trajectory.positions, skill.generate().trajectory.positions)
    ratio = slow.generate().trajectory.speeds / skill.generate().trajectory.speeds
    assert ratio.min() == pytest.approx(0.5) and ratio.max() == pytest.approx(1.0)
    waited = adapt_skill(skill, "wait for 10 timesteps near the cup", writer="builtin")
    assert waited.notes == ("a skill keeps no pauses; they are left out",)


def test_feedback_is_on_the_current_skill_or_on_what_was_shown():
    skill = skill_of("kmp")
    once = adapt_skill(skill, "go up by 0.1", writer="builtin").skill
    twice = adapt_skill(once, "go left by 0.1", writer="builtin").skill
    anew = adapt_skill(once, "go left by 0.1", on="original", writer="builtin").skill
    shown, both, one = (s.generate().trajectory.positions for s in (skill, twice, anew))
    assert np.allclose(both - shown, [-0.1, 0, 0.1]) and twice.edits == ("go up by 0.1", "go left by 0.1")
    assert np.allclose(one - shown, [-0.1, 0, 0]) and anew.edits == ("go left by 0.1",)


def test_a_path_that_is_drawn_anew_is_followed_as_far_as_phases_hold_it():
    edited = adapt_skill(skill_of("kmp"), "make a small circle around the cup", writer="builtin")
    assert edited.result.usable
    wanted, got = edited.result.adapted, edited.skill.generate().trajectory
    assert abs(got.length - wanted.length) < 0.1 * wanted.length or edited.notes


def test_what_is_not_understood_leaves_the_skill(tmp_path):
    skill = skill_of("kmp")
    edited = adapt_skill(skill, "frobnicate the splines", writer="builtin")
    assert edited.skill is skill and not edited.result.usable


def test_the_command_line(tmp_path):
    skill_of("kmp").save(tmp_path / "skill.json")
    words = ["adapt", tmp_path / "skill.json", "go up by 0.1", "--writer", "builtin", "--out", tmp_path / "second.json"]
    done = CliRunner().invoke(cli, [*map(str, words), "--trajectory", str(tmp_path / "mean.json")])
    assert done.exit_code == 0, done.output
    second = Skill.load(tmp_path / "second.json")
    assert second.edits == ("go up by 0.1",)
    mean = load_task(tmp_path / "mean.json")
    assert len(mean.extra["covariance"]) == 101
    assert np.allclose(mean.trajectory.positions, second.generate().trajectory.positions)


def test_a_reading_that_is_not_certain_waits_for_a_yes():
    skill = skill_of("kmp")
    doubtful = "move right by 5 cm if it is warm"
    asked = adapt_skill(skill, doubtful, writer="builtin")
    assert asked.result.status == "needs_confirmation" and asked.skill is skill
    done = adapt_skill(skill, doubtful, writer="builtin", accepting=True)
    lifted = done.skill.generate().trajectory.positions - skill.generate().trajectory.positions
    assert np.allclose(lifted, [0.05, 0, 0])


def test_a_skill_that_the_limits_could_not_hold_says_so():
    inside = Scene((SceneObject("cup", np.array([0.0, 0.0, 0.2]), np.array([0.2, 0.2, 0.2])),))
    skill = learn([Task(one, inside) for one in demonstrations(4)])
    edited = adapt_skill(
        skill,
        "go up by 0.02",
        writer="builtin",
        robot=Robot.preset("drone"),
        constraints=ConstraintOptions(fix_start=True),
    )
    assert edited.result.status in ("infeasible", "limited")
    assert edited.skill.notes[-1] == edited.result.verdict


def test_only_skills_have_an_original_and_only_generate_makes_paths_of_them(tmp_path):
    skill_of("kmp").save(tmp_path / "skill.json")
    save_task(tmp_path / "task.json", reaching(1))
    for words, said in (
        (["adapt", "task.json", "go up by 0.1", "--on", "original"], "--on is for skills"),
        (["convert", "skill.json", "x.csv"], "this is a skill, not a trajectory; make one of it: ovita generate"),
    ):
        placed = [str(tmp_path / word) if "." in word and " " not in word else word for word in words]
        with pytest.raises(OvitaError, match=said):
            CliRunner().invoke(cli, placed, catch_exceptions=False)


def test_a_tube_is_two_deviations_across_the_path():
    path = np.stack([np.linspace(0, 1, 5), np.zeros(5), np.zeros(5)], axis=1)
    rings = tube(path, np.tile([9.0, 0, 0, 0.01, 0, 0.04], (5, 1)))
    assert np.allclose(rings[..., 0], path[:, None, 0])
    assert np.abs(rings[..., 1]).max() == pytest.approx(0.2, rel=0.02)
    assert np.abs(rings[..., 2]).max() == pytest.approx(0.4, rel=0.02)


@pytest.mark.parametrize("picture", ["task.svg", "task.html", "skill.svg"])
def test_generated_paths_are_drawn_with_their_tube(picture, tmp_path):
    pytest.importorskip("matplotlib")
    pytest.importorskip("plotly")
    skill = learn([reaching(seed) for seed in range(3)])
    skill.save(tmp_path / "skill.json")
    save_task(tmp_path / "task.json", skill.generate().task())
    file = tmp_path / f"{picture.split('.')[0]}.json"
    done = CliRunner().invoke(cli, ["plot", str(file), "--out", str(tmp_path / picture)], catch_exceptions=False)
    assert done.exit_code == 0
    text = (tmp_path / picture).read_text(encoding="utf-8")
    assert "f3b0ad" in text


def test_a_covariance_that_does_not_fit_is_refused(tmp_path):
    pytest.importorskip("matplotlib")
    save_task(tmp_path / "task.json", learn(demonstrations(3)).generate().task())
    document = json.loads((tmp_path / "task.json").read_text())
    document["covariance"].pop()
    (tmp_path / "task.json").write_text(json.dumps(document))
    with pytest.raises(FormatError, match="covariance is no list of 101 rows"):
        words = ["plot", str(tmp_path / "task.json"), "--out", str(tmp_path / "x.png")]
        CliRunner().invoke(cli, words, catch_exceptions=False)


def test_the_example_runs(capsys):
    runpy.run_path(str(ROOT / "examples" / "skill_from_demonstrations.py"), run_name="__main__")
    said = capsys.readouterr().out
    assert "The variance is as it was: True" in said and "lies outside what was shown" in said


def test_the_benchmark_runs_small(monkeypatch, capsys):
    monkeypatch.setattr("sys.argv", ["demonstrations.py", "--small"])
    runpy.run_path(str(ROOT / "benchmarks" / "demonstrations.py"), run_name="not_main")["main"]()
    rows = [line.split("|") for line in capsys.readouterr().out.splitlines() if line.startswith("| ovita")]
    mean = {row[1].strip(): float(row[2]) for row in rows}
    assert max(mean[f"ovita {kind}"] for kind in KINDS) < 3.0
    assert mean["ovita kmp, frames"] < 20.0
