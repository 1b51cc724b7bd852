"""`verify` measures what is there, names where, and knows no solver."""

import ast
import json
from pathlib import Path

import numpy as np
import pytest

from ovita.limits import ConstraintOptions, constrain, problem, verify
from ovita.limits.problem import obstacles_of
from ovita.paths.robot import Box, Robot, Shell
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory

DATA = Path(__file__).parents[3] / "shared" / "data" / "ovita-dev"


def line(n=5, **more):
    return Trajectory(np.column_stack([np.linspace(0, 1, n), np.zeros((n, 2))]), np.full(n, 0.5), **more)


def check(name, t, scene=None, robot=None, **options):
    found = verify(
        t,
        scene or Scene(),
        robot or Robot("r", None),
        proposed=line(),
        original=line(),
        options=ConstraintOptions(**options),
    )
    return next(c for c in found if c.name == name)


@pytest.mark.parametrize("source", ["verify", "problem"])
def test_it_imports_no_solver(source):
    tree = ast.parse((Path(problem.__file__).parent / f"{source}.py").read_text(encoding="utf-8"))
    names = {n.module or "" for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)}
    names |= {a.name for n in ast.walk(tree) if isinstance(n, ast.Import) for a in n.names}
    assert {n.split(".")[2] for n in names if n.startswith("ovita.limits.")} <= {"problem"}
    assert not {n for n in names if n.split(".")[0] in ("piqp", "scipy", "optuna")}


def test_a_plate_between_waypoints_is_seen():
    plate = Scene((SceneObject("plate", [0.4, 0, 0], [0.002, 1, 1]),))
    found = check("obstacle", line(), plate)
    assert found.subject == "plate"
    assert found.violation_after == pytest.approx(0.011)
    assert (found.where_after, found.place) == (1, "segment")
    sphere = check("obstacle", line(), plate, obstacle_shape="sphere")
    assert sphere.violation_after == pytest.approx(np.linalg.norm([0.002, 1, 1]) / 2 + 0.01)


def test_box_shell_and_speed():
    box = check("workspace", line(), robot=Robot("r", Box((-1, -1, -1), (0.9, 1, 1))))
    assert box.violation_after == pytest.approx(0.11)
    assert box.where_after == 3
    shell = check("workspace", line(2), robot=Robot("r", Shell((0.5, 0.05, 0), 0.2, 2.0)))
    assert shell.violation_after == pytest.approx(0.16), "the segment dips below r_min, its ends do not"
    fast = check("speed", line().with_(speeds=[0, 0, 3, 0, 0]))
    assert (fast.violation_after, fast.where_after, fast.unit) == (2.0, 2, "m/s")


def test_acceleration_and_ends():
    quick = check("acceleration", line().with_(speeds=[0, 1, 1, 1, 1]), max_acceleration=0.5)
    assert quick.violation_after == pytest.approx(1 - np.sqrt(2 * 0.5 * 0.25))
    assert quick.where_after == 0
    gone = check("goal", line().with_(positions=line().positions * 1.1), fix_goal=True)
    assert gone.violation_after == pytest.approx(0.1)
    assert check("start", line(), fix_start=True).held


def test_before_after_and_original_are_told_apart():
    cup = Scene((SceneObject("cup", [0.5, 0, 0], [0.2, 0.2, 0.2]),))
    far = line().with_(positions=line().positions + np.array([0, 5, 0]))
    c = verify(far, cup, Robot("r", None), proposed=line(), original=far)[0]
    assert c.violation_before == pytest.approx(0.11)
    assert (c.violation_after, c.violation_original, c.where_after) == (0, 0, None)
    assert not c.held_before
    assert c.held


def task(path):
    data = json.loads(path.read_text(encoding="utf-8"))
    objects = tuple(
        SceneObject(o["name"], [o["x"], o["y"], o["z"]], o.get("dimensions") or None) for o in data["objects"]
    )
    rows = np.array(data["trajectory"], dtype=float)[:, :4]
    name = "arm" if "Manipulator" in str(path) else "ground" if "Ground" in str(path) else "drone"
    return Trajectory.from_array(rows), Scene(objects), Robot.preset(name)


@pytest.mark.skipif(not DATA.is_dir(), reason="the public files are not here")
def test_every_public_file():
    files = sorted(DATA.rglob("*.json"))
    assert len(files) > 100
    for i, path in enumerate(files):
        t, scene, robot = task(path)
        for fixed in (False, True) if i % 2 else (False,):
            options = ConstraintOptions(fix_start=fixed, fix_goal=fixed, repair_original=True)
            found = constrain(t, scene, robot, original=t, options=options)
            if fixed and found.verdict.status == "infeasible":
                ends = t.positions[[0, -1]]
                outside = (robot.workspace.inside(ends) < robot.margin).any()
                inside = any((body.signed(ends)[0] < 0).any() for body in obstacles_of(scene, robot))
                assert outside or inside, path.name
                assert found.verdict.conflicts
            else:
                assert found.verdict.status in ("satisfied", "repaired"), (path.name, found.verdict.sentences())
                assert max(c.violation_after for c in found.verdict.checks) <= problem.TOLERANCE


NOT_CHECKED = "No limits of a robot are known, so workspace, speed and acceleration were not checked."
CUPS = tuple(SceneObject(f"cup {k}", [k, 3.0, 0.0]) for k in range(4))


def test_a_verdict_on_an_arm_says_that_its_joints_were_not_checked():
    low = line().with_(positions=line().positions * 0.1 + np.array([0.0, 0.0, 0.4]))
    for path in (low, low.with_(speeds=np.full(len(low), 5.0))):
        said = constrain(path, Scene(), Robot.preset("arm"), original=low).verdict.sentences()
        assert any("not the arm's joints: ovita simulate" in each for each in said)
    drone = constrain(low, Scene(), Robot.preset("drone"), original=low).verdict.sentences()
    assert not any("joints" in each for each in drone)


@pytest.mark.parametrize(
    ("robot", "objects", "told"),
    [
        ("none", 0, [NOT_CHECKED]),
        ("none", 2, ["Every limit holds as proposed: the distance to 'cup 0' and 'cup 1'.", NOT_CHECKED]),
        (
            "drone",
            4,
            [
                "Every limit holds as proposed: workspace, speed, acceleration, lateral acceleration and the distance "
                "to 4 objects."
            ],
        ),
    ],
)
def test_a_verdict_names_the_limits_that_were_checked(robot, objects, told):
    scene = Scene(CUPS[:objects])
    done = constrain(line(), scene, Robot.preset(robot), original=line())
    assert done.verdict.sentences() == told
