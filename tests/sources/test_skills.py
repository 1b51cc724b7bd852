"""Skills: reproduce, generalise, pass through via-points, say what they cannot do, and survive a file."""

import json

import numpy as np
import pytest
from shown import demonstrations, reaching, swing

from ovita.errors import FormatError, RequestError, UnknownObject
from ovita.io import Task
from ovita.paths.geometry import path_distances
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.sources.learning import learn
from ovita.sources.probabilistic import LENGTH
from ovita.sources.skills import KINDS, Skill
from ovita.sources.taskframes import rotation

VARIED = [kind for kind in KINDS if kind != "dmp"]
MIDDLE = swing(np.array([0.5]))[0]


@pytest.fixture(scope="module", params=KINDS)
def skill(request: pytest.FixtureRequest) -> Skill:
    return learn(demonstrations(turning=True), request.param)


def test_reproduces_the_mean_of_what_was_shown(skill):
    made = skill.generate().trajectory
    shown = np.mean([one.resample(101).positions for one in demonstrations(turning=True)], axis=0)
    assert path_distances(shown, made.positions).mean() < 0.006
    assert made.speeds.min() > 0.0 and made.stall is None
    turned = rotation(made.orientations[[0, -1]]).as_rotvec()
    assert np.allclose(turned[1] - turned[0], [0, 0, 0.8], atol=0.12)


@pytest.mark.parametrize("kind", ["kmp", "dmp", "tpgmm"])
def test_other_ends_are_reached_and_the_shape_is_kept(kind):
    made = learn(demonstrations(), kind).generate(start=[-0.1, 0.1, 0.25], goal=[0.8, 0.0, 0.1])
    path = made.trajectory.positions
    assert np.allclose(path[[0, -1]], [[-0.1, 0.1, 0.25], [0.8, 0.0, 0.1]], atol=0.004)
    assert not made.missed
    assert path[:, 2].max() > 0.23 and np.ptp(path[:, 1]) > 0.2


@pytest.mark.parametrize("kind", ["kmp", "tpgmm"])
@pytest.mark.parametrize("phase", [0.25, 1 / 3, 0.5])
def test_a_via_point_is_met_exactly_and_bends_the_path_nowhere_else(kind, phase):
    skill = learn(demonstrations(turning=True), kind)
    plain = skill.generate().trajectory.positions
    place = skill.generate(waypoints=1001).trajectory.positions[round(1000 * phase)] + [0.02, 0.08, 0.05]
    made = skill.generate(via={phase: place})
    gaps = np.linalg.norm(made.trajectory.positions - plain, axis=1)
    assert np.linalg.norm(made.trajectory.positions - place, axis=1).min() < 1e-6
    far = np.abs(np.linspace(0, 1, 101) - phase) > 3 * LENGTH
    assert gaps[far].max() < 0.015 < 0.08 < gaps.max() < 0.12
    deviations = np.sqrt(np.trace(made.covariance[:, :3, :3], axis1=1, axis2=2))
    assert deviations[round(100 * phase)] < 1e-3 < deviations[far].min()


def test_a_via_point_with_an_orientation_turns_the_tool():
    skill = learn(demonstrations(turning=True), "kmp")
    wanted = np.array([np.cos(0.5), 0.0, 0.0, np.sin(0.5)])
    made = skill.generate(via={0.5: [*MIDDLE, *wanted]}).trajectory
    assert abs(made.orientations[50] @ wanted) > 1 - 1e-9
    with pytest.raises(RequestError, match=r"the via-point at 0.5 .* the demonstrations had none"):
        learn(demonstrations()).generate(via={0.5: [*MIDDLE, *wanted]})


def test_covariance_is_that_of_the_demonstrations_where_nothing_is_asked():
    few = demonstrations(24, spread=0.03)
    made = learn(few, "kmp", align="arc_length").generate()
    rows = np.stack([one.resample(101).positions for one in few])
    shown = rows.var(axis=0, ddof=1).sum(axis=1)
    tube = np.trace(made.covariance, axis1=1, axis2=2)
    assert np.allclose(tube[10:-10], shown[10:-10], rtol=0.1)


def test_promp_conditions_on_what_was_seen_together():
    """Where demonstrations shift as a whole, a via-point moves the whole path, not a bump of it."""
    path = swing(np.linspace(0, 1, 80))
    paths = [Trajectory(np.add(path, [0, y, 0]), np.full(80, 0.2)) for y in np.linspace(-0.1, 0.1, 5)]
    made = learn(paths, "promp").generate(via={0.5: np.add(MIDDLE, [0, 0.06, 0])})
    shift = made.trajectory.positions[:, 1] - learn(paths, "promp").generate().trajectory.positions[:, 1]
    assert np.allclose(shift, 0.06, atol=2e-3) and not made.missed


def test_promp_says_what_it_cannot_reach():
    made = learn(demonstrations(spread=0.001), "promp").generate(via={0.5: np.add(MIDDLE, [0, 0, 0.1])})
    assert "the via-point at 0.5" in made.missed[0] and "a kmp does not" in made.missed[0]
    assert made.task().verdict.startswith("not_as_meant: the via-point")
    exact = learn(demonstrations(spread=0.001), "kmp").generate(via={0.5: np.add(MIDDLE, [0, 0, 0.1])})
    assert not exact.missed


def test_a_place_outside_what_was_shown_is_named():
    skill = learn(demonstrations(), "kmp")
    inside = skill.generate(via={0.5: skill.generate().trajectory.positions[50] + [0, 0.01, 0]})
    assert not inside.notes
    outside = skill.generate(goal=[0.9, 0, 0.2], via={0.5: np.add(MIDDLE, [0, 0, 0.3])})
    assert any(text.startswith("the goal lies outside what was shown") for text in outside.notes)
    assert any(text.startswith("the via-point at 0.5") and "deviations" in text for text in outside.notes)


def test_places_are_told_in_words_or_by_objects():
    tasks = [reaching(seed) for seed in range(4)]
    skill, plate = learn(tasks), tasks[0].scene["plate"]
    centre = skill.generate(goal=plate).trajectory.positions[-1]
    above = skill.generate(goal="0.2 m above the plate").trajectory.positions[-1]
    assert np.allclose(centre, plate.position)
    assert np.allclose(above, np.add(plate.position, [0, 0, 0.2 + plate.size[2] / 2]))


def test_a_via_point_without_a_phase_goes_where_it_is_least_unusual():
    skill = learn(demonstrations(), "kmp")
    place = skill.generate().trajectory.positions[30] + [0, 0.01, 0.0]
    made = skill.generate(via=[(None, place)])
    assert 25 <= np.argmin(np.linalg.norm(made.trajectory.positions - place, axis=1)) <= 35


@pytest.mark.parametrize(("kind", "within"), [("kmp", 0.02), ("tpgmm", 0.08)])
def test_task_frames_follow_objects_that_moved_and_turned(kind, within):
    shown = [reaching(seed) for seed in range(8)]
    skill = learn(shown, kind, frames=("cup", "plate"))
    gaps, ends, unmoved = [], [], []
    for seed in (77, 78, 79):
        there = reaching(seed)
        wanted = there.trajectory.resample(101).positions
        made = skill.generate(scene=there.scene)
        path = made.trajectory.resample(101).positions
        gaps.append(np.linalg.norm(path - wanted, axis=1).mean())
        ends.append(np.linalg.norm((path - wanted)[[0, -1]], axis=1).max())
        unmoved.append(np.linalg.norm(skill.generate().trajectory.resample(101).positions - wanted, axis=1).mean())
    assert np.mean(gaps) < within < np.mean(unmoved)
    assert max(ends) < 0.035
    assert skill.frames == ("cup", "plate") and made.scene is there.scene


@pytest.mark.parametrize("kind", ["kmp", "tpgmm"])
def test_the_tool_turns_with_the_object_of_its_task_frame(kind):
    def at(yaw: float, seed: int = 0) -> Task:
        """Towards a cup from its front, the tool turned as the cup is."""
        c, s = np.cos(yaw), np.sin(yaw)
        rng = np.random.default_rng(seed)
        out = np.linspace(0.5, 0.0, 60)[:, None] * [c, s, 0] + rng.normal(0, 0.005, 3) * [0, 0, 1]
        turn = np.array([np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)])
        cup = SceneObject("cup", np.array([0.1 * seed, 0.2, 0.0]), orientation=turn)
        return Task(Trajectory(cup.position + out, np.full(60, 0.2), np.tile(turn, (60, 1))), Scene((cup,)))

    skill = learn([at(0.4 * seed - 1.0, seed) for seed in range(6)], kind, frames=("cup",))
    there = at(1.6, 3)
    made = skill.generate(scene=there.scene).trajectory
    assert np.abs(made.positions - there.trajectory.resample(101).positions).max() < 0.01
    assert np.abs((made.orientations * there.trajectory.orientations[0]).sum(axis=1)).min() > 1 - 1e-4


@pytest.mark.parametrize("kind", KINDS)
def test_a_skill_survives_its_file(kind, tmp_path):
    skill = learn([reaching(seed) for seed in range(4)], kind, frames=("cup",) if kind in ("kmp", "tpgmm") else ())
    skill.save(tmp_path / "skill.json")
    again = Skill.load(tmp_path / "skill.json")
    goal = "plate" if kind != "promp" else None
    ours, theirs = skill.generate(goal=goal), again.generate(goal=goal)
    assert ours.trajectory == theirs.trajectory and again.notes == skill.notes and again.frames == skill.frames
    assert ours.covariance is None or np.array_equal(ours.covariance, theirs.covariance)


DAMAGE = {
    "schema": (lambda d: d.update(schema="ovita.skill/9"), "the schema is 'ovita.skill/9'"),
    "kind": (lambda d: d.update(kind="gmm"), "kind"),
    "nan": (lambda d: d["speeds"].__setitem__(3, float("nan")), "not a finite number"),
    "negative": (lambda d: d["speeds"].__setitem__(3, -0.1), "negative"),
    "ragged": (lambda d: d["model"]["means"][0].__setitem__(3, [0.0]), "rows of different lengths"),
    "short": (lambda d: d["model"]["means"][0].pop(), r"model.means has the shape"),
    "singular": (lambda d: d["model"]["covariances"][0].__setitem__(0, [[0.0] * 3] * 3), "no covariance"),
    "text": (lambda d: d["model"].update(means="x"), "model.means"),
    "missing": (lambda d: d.pop("model"), "model"),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_file_is_refused_in_one_sentence(damage, tmp_path):
    path = tmp_path / "skill.json"
    learn(demonstrations(3)).save(path)
    document = json.loads(path.read_text())
    change, said = DAMAGE[damage]
    change(document)
    path.write_text(json.dumps(document))
    with pytest.raises(FormatError, match=said) as refusal:
        Skill.load(path)
    assert "\n" not in str(refusal.value)


WRONG = {
    "phase": (dict(via={1.5: MIDDLE}), "the phase 1.5"),
    "twice": (dict(start=[0, 0, 0], via={0.0: MIDDLE}), "two places"),
    "near": (dict(via={0.5: MIDDLE, 0.501: MIDDLE}), "nearly the same phase"),
    "end": (dict(via={0.001: MIDDLE}), "too near to an end"),
    "place": (dict(goal=[1, 2]), "no place"),
    "text": (dict(goal="1,2,x"), "no place"),
    "few": (dict(waypoints=1), "2 or more"),
}


@pytest.mark.parametrize("wrong", WRONG)
def test_what_cannot_be_generated_is_said(wrong):
    options, said = WRONG[wrong]
    with pytest.raises(RequestError, match=said):
        learn(demonstrations(3)).generate(**options)


def test_more_that_cannot_be_done_is_said():
    with pytest.raises(RequestError, match="'violin' is no place"):
        learn([reaching(1), reaching(2)]).generate(goal="violin")
    with pytest.raises(UnknownObject, match="'violin'"):
        learn([reaching(1), reaching(2)], frames=("violin",))
    with pytest.raises(RequestError, match="no via-points"):
        learn(demonstrations(2), "dmp").generate(via={0.5: MIDDLE})
    with pytest.raises(RequestError, match="a dmp has no task frames"):
        learn(demonstrations(2), "dmp", frames=("cup",))
    with pytest.raises(RequestError, match="no kind of skill 'gp'"):
        learn(demonstrations(2), "gp")
    with pytest.raises(FormatError, match="a skill is JSON"):
        learn(demonstrations(2)).save("skill.toml")
