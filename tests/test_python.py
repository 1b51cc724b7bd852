"""ovita from Python: what people give is taken where it makes sense, and refused in one sentence where not."""

import dataclasses

import numpy as np
import pytest

import ovita as ov
from ovita.errors import OvitaError, RequestError, TrajectoryError

S = np.linspace(0.0, 1.0, 20)
XYZ = np.column_stack([S, 0 * S, 0.3 + 0 * S])
ROWS = np.column_stack([XYZ, 0.2 + 0 * S])
CUP = ov.SceneObject("cup", [0.5, 0.2, 0.3], [0.1, 0.1, 0.1])
TURNED = np.column_stack([ROWS, np.tile([1.0, 0.0, 0.0, 0.0], (20, 1))])
PATH = ov.Trajectory.from_array(ROWS)


def up(about, **options):
    return ov.adapt(about, "go up by 0.1", writer="builtin", **options)


@pytest.mark.parametrize(
    "about",
    [ROWS, ROWS.tolist(), tuple(map(tuple, ROWS)), ROWS.astype(np.float32), PATH, TURNED],
)
def test_arrays_lists_and_trajectories_are_adapted(about):
    result = up(about)
    assert result.status == "done" and not result.assumptions
    assert result.to_numpy()[:, 2] == pytest.approx(np.full(20, 0.4))
    assert result.to_numpy()[:, 3] == pytest.approx(np.full(20, 0.2))


def test_bare_positions_get_a_speed_and_the_result_says_so():
    result = up(XYZ)
    assert np.array_equal(result.adapted.speeds, np.full(20, 0.1))
    assert any("0.1 m/s" in text for text in result.assumptions) and "0.1 m/s" in result.explanation
    assert ov.rerun(result, {"up": 0.2}).assumptions == result.assumptions


def test_times_become_speeds():
    result = up(XYZ, times=10 * S)
    assert result.original.times == pytest.approx(10 * S, abs=1e-6) and not result.assumptions


def test_a_task_or_a_file_brings_its_own_scene_robot_and_instruction(tmp_path):
    task = ov.Task(PATH, ov.Scene([CUP]), "go up by 0.1", robot="drone")
    path = tmp_path / "task.json"
    ov.save_task(path, task)
    for about in (task, path, str(path), ov.load(path)):
        result = ov.adapt(about, writer="builtin")
        assert result.robot.name == "drone" and result.scene.names == ("cup",) and result.usable
    other = ov.adapt(path, "go left by 0.1", robot="none", scene=[], writer="builtin")
    assert other.robot.name == "none" and not len(other.scene) and other.instruction == "go left by 0.1"


def test_load_takes_a_scene_from_beside(tmp_path):
    ov.save_task(tmp_path / "scene.json", ov.Task(PATH, ov.Scene([CUP])))
    ov.save_trajectory(tmp_path / "path.csv", PATH)
    for scene in (tmp_path / "scene.json", ov.Scene([CUP])):
        task = ov.load(tmp_path / "path.csv", scene)
        assert task.scene.names == ("cup",) and task.trajectory == PATH


def test_a_trajectory_is_an_array_and_has_parts():
    turned = ov.Trajectory(XYZ.tolist(), ROWS[:, 3].tolist(), TURNED[:, 4:].tolist())
    assert np.array_equal(np.asarray(PATH), ROWS) and np.asarray(PATH, dtype=np.float32).dtype == np.float32
    assert np.asarray(turned).shape == (20, 8) and ov.Trajectory.from_array(turned) == turned
    assert np.array_equal(turned[-1], np.asarray(turned)[-1]) and np.array_equal(np.array(list(PATH)), ROWS)
    assert turned[2:6] == ov.Trajectory.from_array(np.asarray(turned)[2:6])
    assert ov.Trajectory.from_array(XYZ, speed=0.2) == PATH
    np.asarray(PATH)[0] = 9.0
    assert PATH[0][0] == 0.0
    with pytest.raises(IndexError):
        PATH[20]
    with pytest.raises(TrajectoryError, match="at least 2 waypoints"):
        PATH[3:4]


def test_reprs_are_short():
    scene = ov.Scene([CUP])
    things = [PATH, scene, CUP, ov.Task(PATH, scene, "go up"), up(PATH, scene=scene)]
    assert max(len(repr(thing)) for thing in things) < 250
    assert repr(PATH) == "<Trajectory: 20 waypoints, 1 m, 5 s, from [0, 0, 0.3] to [1, 0, 0.3]>"
    assert repr(CUP) == "SceneObject('cup', [0.5, 0.2, 0.3], [0.1, 0.1, 0.1])"
    assert "done" in repr(things[-1])


def test_a_notebook_shows_picture_plan_and_verdict_escaped_and_alone(monkeypatch):
    pytest.importorskip("matplotlib", reason="pictures need the extra plot")
    result = up(PATH, scene=[ov.SceneObject("<script>alert(1)</script>", [0.5, 0.3, 0.3])])
    result = dataclasses.replace(result, instruction="<img src=x onerror=alert(1)>", warnings=("<b>", *result.warnings))
    page = result._repr_html_()
    assert 'src="data:image/png;base64,' in page and "done" in page and result.plan[0] in page
    assert "<script" not in page and "<img src=x" not in page and "&lt;b&gt;" in page
    assert "http" not in page.split("base64,")[0] + page.split('"></div>')[-1]
    assert result.plot() is not None


def test_a_notebook_without_matplotlib_shows_the_words(monkeypatch):
    import ovita.plots
    from ovita.errors import MissingExtra

    def absent(*args, **options):
        raise MissingExtra("matplotlib", "plot")

    monkeypatch.setattr(ovita.plots, "figure", absent, raising=False)
    page = up(PATH)._repr_html_()
    assert "<img" not in page and "ovita[plot]" in page and "Plan" in page


def test_a_proposal_is_drawn_as_it_would_become(tmp_path):
    pytest.importorskip("matplotlib", reason="pictures need the extra plot")
    done = up(PATH)
    waiting = dataclasses.replace(done, status="needs_confirmation", adapted=PATH, proposal=done)
    assert "Raise" in waiting._repr_html_() or done.plan[0] in waiting._repr_html_()
    waiting.plot(str(tmp_path / "p.png"))
    assert (tmp_path / "p.png").stat().st_size > 1000
    with pytest.raises(OvitaError, match="pictures are written as"):
        done.plot(str(tmp_path / "p.gif"))


def test_batch_keeps_order_and_names_the_task_at_fault(tmp_path):
    said = ["go up by 0.1", "go left by 0.1", "go down by 0.1"]
    for workers in (1, 3):
        results = ov.batch([PATH, ROWS, XYZ], said, writer="builtin", workers=workers)
        assert [result.instruction for result in results] == said
    assert len(ov.batch(np.stack([ROWS, ROWS]), "go up by 0.1", writer="builtin")) == 2
    with pytest.raises(RequestError, match=r"task 1: .*no such file"):
        ov.batch([PATH, tmp_path / "absent.json"], "go up by 0.1")
    with pytest.raises(RequestError, match="3 tasks but 2 instructions"):
        ov.batch([PATH] * 3, said[:2])


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: ov.adapt(5, "go up"), "a trajectory is an array (N, 3)"),
        (lambda: ov.adapt(None, "go up"), "not None"),
        (lambda: ov.adapt({}, "go up"), "a trajectory is an array"),
        (lambda: ov.adapt([["a", "b", "c"]] * 3, "go up"), "a trajectory is an array"),
        (lambda: ov.adapt([[1, 2], [3]], "go up"), "a trajectory is an array"),
        (lambda: ov.adapt(np.zeros((5, 5)), "go up"), "shape (5, 5)"),
        (lambda: ov.adapt(XYZ[:1], "go up"), "at least 2 waypoints"),
        (lambda: ov.adapt(XYZ * np.nan, "go up"), "finite"),
        (lambda: ov.adapt(XYZ, "go up", times=S[::-1]), "increase strictly"),
        (lambda: ov.adapt(XYZ, "go up", times=S[:3]), "times have shape (3,)"),
        (lambda: ov.adapt(ROWS, "go up", times=S), "speeds and times"),
        (lambda: ov.adapt(PATH, "go up", times=S), "times go with an array"),
        (lambda: ov.adapt(PATH), "there is no instruction"),
        (lambda: ov.adapt(PATH, 5), "an instruction is a text"),
        (lambda: ov.adapt(PATH, "go up", scene="cup"), "a scene is a Scene or a list"),
        (lambda: ov.adapt(PATH, "go up", scene=[5]), "the objects of a scene are SceneObjects"),
        (lambda: ov.adapt(PATH, "go up", robot=5), "a robot is a Robot or a name"),
        (lambda: ov.adapt(PATH, "go up", robot="kuka"), "unknown robot 'kuka'"),
        (lambda: ov.adapt(ov.Request("go up", PATH), "go down"), "a Request holds"),
        (lambda: ov.adapt(PATH, "go up", writer=5), "a writer is a name"),
        (lambda: ov.adapt(PATH, "go up", isolation=None), "isolation None is unknown"),
        (lambda: ov.adapt("ros2:/path", "go up"), "is an address"),
        (lambda: ov.Request(None, PATH), "an instruction is a text"),
        (lambda: ov.Request("go up", None), "a trajectory is an array"),
        (lambda: ov.Session(5), "a trajectory is an array"),
        (lambda: ov.Session(PATH, robot=5), "a robot is a Robot"),
        (lambda: ov.Session(PATH).say(5), "an instruction is a text"),
        (lambda: ov.rerun(5, {}), "rerun takes an adaptation"),
        (lambda: ov.accept(5), "accept takes an adaptation"),
        (lambda: ov.load(5), "load takes the name of a file"),
        (lambda: ov.batch(5, "go up"), "batch takes a list"),
        (lambda: ov.batch("a.json", "go up"), "batch takes a list"),
        (lambda: ov.batch([PATH], "go up", workers=0), "workers must be"),
        (lambda: ov.save_trajectory("x.csv", ROWS), "save_trajectory takes a Trajectory"),
        (lambda: ov.Trajectory.from_array(XYZ), "speed=0.1"),
        (lambda: PATH[[1, 2]], "by an index or a slice"),
    ],
)
def test_misuse_is_one_sentence(call, says):
    with pytest.raises(OvitaError) as refused:
        call()
    assert says in str(refused.value) and "\n" not in str(refused.value)


def test_every_public_name_says_what_it_is():
    for name in ov.__all__:
        said = getattr(ov, name).__doc__
        assert said and not said.startswith(f"{name}("), f"{name} has no docstring of its own"


def test_more_waypoints_than_a_policy_may_return_are_refused_before_anything_is_done():
    """A million waypoints were read, understood and run, and only then refused."""

    class Never:
        name = "never"

        def write(self, prompt):
            raise AssertionError("nobody is asked")

    rows = np.zeros((1_000_001, 4))
    for about in (rows, ov.Trajectory.from_array(rows)):
        with pytest.raises(TrajectoryError, match="1000001 waypoints and at most 1000000"):
            ov.adapt(about, "go up by 0.1", writer=Never())
    with pytest.raises(TrajectoryError, match="1000001 waypoints"):
        ov.Session(rows)
    assert ov.adapt(rows[::100], "go up by 0.1", writer="builtin").status == "done"


@pytest.mark.parametrize(
    ("misuse", "says"),
    [
        (lambda: ov.load_task(5), "load_task takes the name of a file, not 5"),
        (lambda: ov.save_task("x.json", 5), "and a Task, not 5"),
        (lambda: ov.save_trajectory(5, PATH), "save_trajectory takes the name of a file, not 5"),
        (lambda: ov.load_robot(5), "a robot is a name or a file, not 5"),
        (
            lambda: ov.plan(ov.Scene(), (0, 0, 0), (1, 0, 0)),
            r"too many positional .*; call it like this: plan\(",
        ),
        (lambda: ov.plan(ov.Scene()), "missing a required.* argument: 'start'; call it like this"),
        (lambda: ov.plan("x.json", start=(0, 0, 0), goal=(1, 0, 0)), "plan takes a Scene, not 'x.json'"),
        (lambda: ov.plan(ov.Scene(), start=(0, 0, 0), goal=(1, 0, 0), robot=5), "a name or a file, not 5"),
        (lambda: ov.plan(ov.Scene(), start=(0, 0, 0), goal=(1, 0, 0), planner=5), "5 is no planner"),
        (lambda: ov.plan(ov.Scene(), start=(0, 0, 0), goal=(1, 0, 0), waypoints="x"), "waypoints 'x' is no number"),
        (lambda: ov.plan(ov.Scene(), start=(0, 0, 0), goal=(1, 0, 0), speed="x"), "speed 'x' is no number"),
    ],
)
def test_what_does_not_fit_a_function_is_one_sentence(misuse, says):
    with pytest.raises(OvitaError, match=says):
        misuse()


def test_limits_in_a_scenes_text_that_nobody_enforces_are_named():
    """`ov.adapt` of a scene that says "z >= 0.1" went below it without a word."""
    said = ov.Scene(constraints_text="z >= 0.1, v_max = 0.5")
    told = [line for line in up(ov.Task(PATH, said)).assumptions if "not enforced" in line]
    assert len(told) == 1 and "0.1" in told[0] and "0.5" in told[0]


def test_the_first_line_says_how_far_limits_moved_the_path():
    result = ov.adapt([[0.3, 0, 0.3], [0.6, 0.1, 0.3], [1.0, 0.2, 0.3]], "go left by 0.1", robot="arm")
    assert result.status == "limited" and "moved the path by up to 0.263 m" in result.message


SCENE = ov.Scene([CUP])
WAYS_IN = {
    "Frame": {},
    "Request": {"instruction": "go up by 0.1", "trajectory": PATH},
    "Robot": {"name": "mine"},
    "Scene": {},
    "SceneObject": {"name": "cup", "position": [0, 0, 0]},
    "Session": {"original": PATH},
    "Trajectory": {"positions": XYZ, "speeds": S},
    "ConstraintOptions": {},
    "accept": {"result": None},
    "adapt": {"request": PATH, "instruction": "go up by 0.1", "writer": "builtin"},
    "batch": {"tasks": [PATH], "instructions": "go up by 0.1", "writer": "builtin"},
    "compare": {"original": PATH, "adapted": PATH, "scene": SCENE},
    "constrain": {"proposed": PATH, "scene": SCENE, "robot": ov.Robot("mine"), "original": PATH},
    "from_words": {"instruction": "from the cup to 0, 0, 1", "scene": SCENE, "robot": ov.Robot("mine")},
    "ground": {"request": ov.Request("go up by 0.1", PATH)},
    "learn": {"demos": ["a.csv", "b.csv"]},
    "load": {"place": "a.csv"},
    "load_robot": {"name_or_path": "arm"},
    "load_task": {"path": "a.csv"},
    "plan": {"scene": SCENE, "start": (0, 0, 0.5), "goal": (1, 0, 0.5)},
    "rerun": {"adaptation": None, "parameters": {}},
    "save_task": {"path": "b.json", "task": ov.Task(PATH, SCENE)},
    "save_trajectory": {"path": "b.csv", "trajectory": PATH},
    "verify": {"result": PATH, "scene": SCENE, "robot": ov.Robot("mine"), "proposed": PATH, "original": PATH},
    "writer_named": {"name": "builtin"},
}
"""A call of every function and class that people call themselves."""
MADE = {"Adaptation", "Changes", "Generation", "Plan", "Policy", "Prompt", "Reply", "Skill", "Task", "Verdict"}
"""What ovita makes, or takes as it is and looks at where it is used."""


@pytest.mark.parametrize("name", WAYS_IN)
def test_a_wrong_type_is_one_sentence_or_harmless(name, tmp_path, monkeypatch):
    """`ov.learn(5)`, `ov.compare(None, ...)` and some 200 more ended in an AttributeError or TypeError."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.csv").write_text("x,y,z,speed\n0,0,0,1\n1,0,0,1\n2,1,0,1\n")
    result = up(PATH) if any(value is None for value in WAYS_IN[name].values()) else None
    good = {key: result if value is None else value for key, value in WAYS_IN[name].items()}
    call = getattr(ov, name)
    for parameter in good:
        for wrong in (5, None, object(), [1], {"a": 1}, b"x"):
            try:
                call(**{**good, parameter: wrong})
            except OvitaError as error:
                assert "\n" not in str(error)


def test_every_public_callable_was_tried():
    assert {*WAYS_IN} | MADE | {"OvitaError", "PolicyWriter"} == {*ov.__all__}


@pytest.mark.parametrize(
    ("misuse", "says"),
    [
        (lambda: ov.learn(5), r"learn: .*not 5|not 5"),
        (lambda: ov.compare(PATH, 5, SCENE), "compare: adapted is to be Trajectory, not 5; call it like this"),
        (lambda: ov.writer_named(5), "writer_named: name is to be str, not 5"),
        (lambda: up(PATH, repairs="two"), "adapt: repairs is to be int, not 'two'"),
        (lambda: up(PATH, constraints=5), "adapt: constraints is to be .*, not 5"),
        (lambda: ov.adapt(), "missing a required argument|no instruction|there is"),
        (lambda: ov.Trajectory(XYZ, S, timestep="x"), "timestep 'x' is not a positive time"),
        (lambda: ov.Frame([]), "unknown frame"),
    ],
)
def test_a_wrong_type_is_named(misuse, says):
    with pytest.raises(OvitaError, match=says):
        misuse()
