"""Robot models: the shipped ones have the published figures, others can be added, mistakes are one sentence."""

import numpy as np
import pytest

from ovita import sim
from ovita.errors import RobotError
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory
from ovita.sim.world import build

mujoco = pytest.importorskip("mujoco", reason="the extra sim is not installed")


def stage(name):
    return build(sim.load_model(name), Scene(), sim.Base(), 0.0)


def test_the_iiwa_has_the_published_figures():
    arm = stage("iiwa")
    _, shoulder, reach = arm.shoulder()
    assert shoulder == pytest.approx(0.36) and reach == pytest.approx(0.42 + 0.40 + 0.126)
    assert np.degrees(arm.model.jnt_range[:, 1]) == pytest.approx([170, 120, 170, 120, 170, 120, 175])
    assert arm.model.actuator_ctrlrange[:, 1] == pytest.approx([320, 320, 176, 176, 110, 40, 40])
    limits = sim.load_model("iiwa").limits
    assert np.degrees(limits.velocity) == pytest.approx([85, 85, 100, 75, 130, 135, 135], abs=0.01)


def test_the_iiwa_bends_as_its_published_chain_does():
    arm = stage("iiwa")
    data = mujoco.MjData(arm.model)
    data.qpos[:] = np.radians([0, 90, 0, 0, 0, 0, 0])
    mujoco.mj_kinematics(arm.model, data)
    assert data.site_xpos[arm.tip] == pytest.approx([0.946, 0, 0.36], abs=1e-9)
    data.qpos[:] = np.radians([90, 0, 0, -90, 0, 0, 0])
    mujoco.mj_kinematics(arm.model, data)
    assert data.site_xpos[arm.tip] == pytest.approx([0, 0.526, 0.78], abs=1e-9)


def test_the_crazyflie_weighs_27_grams_and_lifts_twice_that():
    drone = stage("crazyflie").model
    assert drone.body_mass.sum() == pytest.approx(0.027)
    assert drone.actuator_ctrlrange[:, 1].sum() / (0.027 * 9.81) == pytest.approx(2.27, abs=0.01)
    assert np.linalg.norm(drone.site_pos[-4:, :2], axis=1) == pytest.approx(0.046, abs=1e-4)


def test_the_jackal_skids_by_the_factor_that_its_maker_publishes():
    rover, limits = stage("jackal").model, sim.load_model("jackal").limits
    data = mujoco.MjData(rover)
    mujoco.mj_step(rover, data, 100)
    wheel = 0.5 * limits.track * limits.slip * 1.0 / limits.wheel_radius
    data.ctrl[:] = [-wheel, wheel, -wheel, wheel]
    mujoco.mj_step(rover, data, 1000)
    begun = data.qpos[3:7].copy()
    mujoco.mj_step(rover, data, 500)
    turned = 2 * np.arccos(abs(begun @ data.qpos[3:7]))
    assert turned == pytest.approx(1.0, rel=0.25)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("", "has no controller"),
        ('controller = "boat"', "controller is 'boat', expected 'arm'"),
        ('controller = "arm"\ntip = "tip"\nwings = 2', "wings is no key of a robot with controller 'arm'"),
        (
            'controller = "arm"\ntip = "tip"\nvelocity = [-1]\nacceleration = [1]\npostures = [[0]]',
            "velocity[0] is -1, expected a number > 0",
        ),
        (
            'controller = "arm"\ntip = "tip"\nvelocity = [1]\nacceleration = [1]\npostures = [[0]]',
            "model 'none.xml' does not exist beside it",
        ),
        ("controller = ", "this is not TOML"),
    ],
)
def test_a_malformed_robot_file_is_one_sentence(tmp_path, change, said):
    file = tmp_path / "own.toml"
    file.write_text(f'model = "none.xml"\n{change}\n', encoding="utf-8")
    with pytest.raises(RobotError) as error:
        sim.load_model(file)
    assert said in str(error.value) and str(file) in str(error.value)


@pytest.mark.parametrize(
    ("kind", "model", "said"),
    [
        ("jackal", "jackal.xml", "has no actuator 'wing'"),
        ("jackal", "iiwa.xml", "a rover needs a free joint at its first body"),
        ("crazyflie", "iiwa.xml", "a drone needs a free joint at its first body"),
    ],
)
def test_a_model_that_does_not_fit_its_controller_is_one_sentence(tmp_path, kind, model, said):
    shipped = sim.load_model(kind).model.parent
    text = (shipped / f"{kind}.toml").read_text(encoding="utf-8").replace('"front_left", ', '"wing", ')
    (tmp_path / "own.toml").write_text(text.replace(f'"{kind}.xml"', f'"{shipped / model}"'), encoding="utf-8")
    path = Trajectory(np.array([[0, 0, 0], [1, 0, 0.0]]), np.ones(2))
    with pytest.raises(RobotError, match=said):
        sim.simulate(path, robot=tmp_path / "own.toml")


def test_an_unknown_robot_names_those_that_there_are():
    with pytest.raises(RobotError, match="unknown robot 'r2d2'; robots that can be simulated are arm, ground, drone"):
        sim.load_model("r2d2")


@pytest.mark.parametrize(
    ("xml", "said"),
    [
        ("<mujoco><worldbody/>", "cannot be read"),
        ('<mujoco><worldbody><body name="b"><joint/><geom size="1"/></body></worldbody></mujoco>', "give the torque"),
    ],
)
def test_a_malformed_model_is_one_sentence(tmp_path, xml, said):
    (tmp_path / "own.xml").write_text(xml, encoding="utf-8")
    text = 'model = "own.xml"\ncontroller = "arm"\ntip = "b"\nvelocity = [1]\nacceleration = [1]\npostures = [[0]]\n'
    (tmp_path / "own.toml").write_text(text, encoding="utf-8")
    with pytest.raises(RobotError, match=said):
        stage(tmp_path / "own.toml")
