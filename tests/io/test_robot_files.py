import pytest

from ovita.errors import FormatError, RobotError
from ovita.io import load_robot
from ovita.paths.robot import Box, Robot, Shell

TOML = """
name = "my arm"
margin = 0.02
obstacle_margin = 0.05
max_speed = 0.5
object_size = 0.1
[workspace]
kind = "shell"
center = [0, 0.0, 0.3]
r_min = 0.1
r_max = 0.8
"""


def write(folder, content, name="robot.toml"):
    path = folder / name
    path.write_text(content)
    return path


@pytest.mark.parametrize("name", ["drone", "arm", "ground", "none", "Drone"])
def test_presets(name):
    assert load_robot(name) == Robot.preset(name)


def test_a_toml_file(tmp_path):
    expected = Robot("my arm", Shell((0, 0, 0.3), 0.1, 0.8), 0.02, 0.05, 0.5, 0.1)
    assert load_robot(write(tmp_path, TOML)) == expected
    assert load_robot(str(write(tmp_path, TOML))) == expected


def test_a_json_file_with_little_in_it(tmp_path):
    content = '{"workspace": {"lower": [0, 0, 0], "upper": {"x": 1, "y": 1, "z": 1}}, "max_speed": null}'
    robot = load_robot(write(tmp_path, content, "cart.json"))
    assert robot == Robot("cart", Box((0, 0, 0), (1, 1, 1)), max_speed=None)


def test_the_body_and_its_dynamics(tmp_path):
    content = "radius = 0.2\nperson_margin = 0.5\nmax_acceleration = 2\nmin_speed = 0.05\nplanar = true"
    robot = load_robot(write(tmp_path, content))
    assert (robot.radius, robot.person_margin, robot.max_acceleration) == (0.2, 0.5, 2.0)
    assert (robot.max_lateral_acceleration, robot.min_speed, robot.planar) == (None, 0.05, True)
    with pytest.raises(FormatError, match="planar is 'yes', expected true or false"):
        load_robot(write(tmp_path, "planar = 'yes'"))


def test_without_a_speed_or_workspace_there_is_no_such_limit(tmp_path):
    robot = load_robot(write(tmp_path, "margin = 0.1"))
    assert (robot.max_speed, robot.workspace) == (None, None)


@pytest.mark.parametrize(
    ("content", "fragment"),
    [
        ("max_sped = 1", "max_sped is an unknown key; did you mean 'max_speed'?"),
        ("colour = 1", "colour is an unknown key; known keys are name, workspace"),
        ("[workspace]\nlowr = [0,0,0]", "workspace.lowr is an unknown key; did you mean 'lower'?"),
        ("[workspace]\nlower = [0,0,0]", "workspace has no upper (its keys are lower)"),
        ("[workspace]\ncenter = [0,0,0]", "workspace has no r_min (its keys are center)"),
        ("[workspace]\nkind = 'ball'", "workspace.kind is 'ball', expected 'box' or 'shell'"),
        ("[workspace]\nkind = 3", "workspace.kind is 3"),
        ("workspace = 3", "workspace is 3, expected a table"),
        ("[workspace]\nlower = [0,0]\nupper=[1,1,1]", "workspace.lower holds 2 values"),
        ("[workspace]\nlower = [2,0,0]\nupper=[1,1,1]", "exceeds upper"),
        ("[workspace]\nlower = [0,0,0]\nupper=[1,inf,1]", "workspace.upper[1] is inf, not a finite number"),
        ("[workspace]\ncenter = [0,0,0]\nr_min = 2\nr_max = 1", "must satisfy"),
        ("max_speed = -1", "max_speed -1.0 is not a speed"),
        ("max_speed = true", "max_speed is true, not a number"),
        ("max_speed = nan", "max_speed nan is not a speed"),
        ("max_speed = 2020-01-01", "max_speed is '2020-01-01', not a number"),
        ("margin = -1", "margin -1.0 is not a length"),
        ("margin = '1'", "margin is '1', not a number"),
        ("name = 3", "name is 3, expected text"),
        ("name = ", "this is not TOML: invalid value (at"),
        ("a = " + "[" * 100_000, "nested too deeply"),
        ("a = " + "9" * 5000, "out of range"),
    ],
)
def test_a_bad_file_gives_one_sentence(tmp_path, content, fragment):
    with pytest.raises(FormatError) as caught:
        load_robot(write(tmp_path, content))
    assert fragment in str(caught.value)
    assert "robot.toml: " in str(caught.value)
    assert "\n" not in str(caught.value)


def test_neither_a_preset_nor_a_file(tmp_path):
    with pytest.raises(RobotError, match="unknown robot 'dron'; presets are drone, arm"):
        load_robot("dron")
    with pytest.raises(FormatError, match="no such file"):
        load_robot("dron.toml")
    with pytest.raises(FormatError, match="top level is an empty list, expected an object"):
        load_robot(write(tmp_path, "[]", "r.json"))
    with pytest.raises(FormatError, match=r"a \.toml or a \.json"):
        load_robot(write(tmp_path, "x", "r.yaml"))
