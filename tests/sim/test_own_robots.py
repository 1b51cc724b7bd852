"""Robots of one's own: URDFs whose links overlap, named tips, model files and folders as they are."""

import numpy as np
import pytest

from ovita import sim
from ovita.errors import RequestError, RobotError
from ovita.paths.scene import Frame, Scene
from ovita.paths.trajectory import Trajectory

pytest.importorskip("mujoco", reason="the extra sim is not installed")
pytest.importorskip("mink")

from ovita.sim.joints import joint_motion

SCENE = Scene(frame=Frame("flu"))
PATH = Trajectory([[0.5, -0.1, 0.1], [0.5, 0.1, 0.1]], [0.1, 0.1])


def link(name, length=0.0, collision=""):
    place = f'<origin xyz="{length / 2} 0 0"/>'
    body = f"<collision>{place}<geometry>{collision}</geometry></collision>" if collision else ""
    turn = 'ixx="0.001" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"'
    return f'<link name="{name}"><inertial>{place}<mass value="1"/><inertia {turn}/></inertial>{body}</link>'


def joint(name, parent, child, xyz, kind="revolute", limit='lower="-3" upper="3" effort="50" velocity="2"'):
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><origin xyz="{xyz}"/>'
        f'<axis xyz="0 0 1"/><limit {limit}/></joint>'
    )


def arm(overlap=True, third=False):
    """A planar arm whose base overlaps the first link, and on request whose third link reaches back to the first."""
    box = '<box size="0.4 0.05 0.05"/>'
    far = '<box size="0.7 0.7 0.05"/>' if third else box
    base = '<cylinder radius="0.08" length="0.24"/>' if overlap else ""
    return (
        '<robot name="own">'
        + link("base", 0.0, base)
        + link("upper", 0.4, box)
        + link("lower", 0.2, "")
        + link("hand", 0.2, far)
        + link("tool0")
        + joint("shoulder", "base", "upper", "0 0 0.1")
        + joint("elbow", "upper", "lower", "0.4 0 0")
        + joint("wrist", "lower", "hand", "0.2 0 0")
        + joint("fixed", "hand", "tool0", "0.2 0 0", "fixed")
        + "</robot>"
    )


@pytest.fixture
def urdf(tmp_path):
    def write(text, name="own.urdf"):
        (tmp_path / name).write_text(text)
        return tmp_path / name

    return write


def test_neighbouring_links_that_overlap_are_no_contact(urdf):
    model = sim.load_model(urdf(arm()))
    report = sim.simulate(PATH, SCENE, model, base=sim.Base()).report
    assert report.status == "followed" and not report.contacts and report.tracking.max < 0.001
    assert joint_motion(PATH, SCENE, model, base=sim.Base())[0].names == ("shoulder", "elbow", "wrist")


def test_links_that_touch_are_named_and_may_be_allowed(urdf):
    file = urdf(arm(third=True))
    found = sim.simulate(PATH, SCENE, sim.load_model(file), base=sim.Base()).report
    assert [c.told for c in found.contacts] == ["itself (hand and upper)"] and found.status in sim.FAILED
    with pytest.raises(RequestError, match=r"would touch itself \(hand and upper\).*--ignore-contact"):
        joint_motion(PATH, SCENE, sim.load_model(file), base=sim.Base())
    allowed = sim.load_model(file, ignore_contacts=["hand, upper"])
    assert sim.simulate(PATH, SCENE, allowed, base=sim.Base()).report.status == "followed"
    toml = file.with_suffix(".toml")
    toml.write_text(
        'model = "own.urdf"\ncontroller = "arm"\ntip = "tool0"\nvelocity = [2, 2, 2]\nacceleration = [5, 5, 5]\n'
        'postures = [[0.5, 1, 0.5]]\nignore_contacts = [["hand", "upper"]]\njoint_names = "left_*"\n'
    )
    motion, _ = joint_motion(PATH, SCENE, str(toml), base=sim.Base())
    assert motion.names == ("left_shoulder", "left_elbow", "left_wrist")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"ignore_contacts": ["hand"]}, "does not name two links; write LINK,LINK"),
        ({"ignore_contacts": ["hand,wing"]}, "has no link 'wing'; its links are base, hand, lower"),
        ({"tip": "wing"}, "has no site 'wing' for the tip, and no body of that name; it has base"),
        ({"tip": "base"}, "no chain of hinges leads from its base to the tip"),
    ],
)
def test_wrong_names_of_links_are_one_sentence(urdf, options, said):
    with pytest.raises(RobotError) as error:
        sim.simulate(PATH, SCENE, sim.load_model(urdf(arm()), **options), base=sim.Base())
    assert said in str(error.value)


def test_the_tip_is_the_tool_frame_or_what_is_named(urdf):
    file = urdf(arm())
    assert sim.load_model(file).tip == "tool0"
    reach = {tip: _reach(sim.load_model(file, tip=tip)) for tip in ("tool0", "hand", "lower")}
    assert reach == pytest.approx({"tool0": 0.8, "hand": 0.6, "lower": 0.4})


def _reach(model):
    from ovita.sim.world import build

    return build(model, Scene(), sim.Base(), 0.0).shoulder()[2]


def test_what_a_model_does_not_state_is_assumed_and_told(urdf):
    text = arm().replace(' velocity="2"', "", 1)
    model = sim.load_model(urdf(text))
    assert model.limits.velocity == (1.0, 2.0, 2.0) and model.limits.acceleration == (4.0, 8.0, 8.0)
    told = sim.simulate(PATH, SCENE, model, base=sim.Base()).report.sentences()
    assert any("states no speed of 1 joints; 1 rad/s is assumed" in text for text in told)
    assert any("The tip is 'tool0'; accelerations are assumed" in text for text in told)


def test_meshes_of_packages_are_found_in_the_folders_above(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    folder = tmp_path / "own_description"
    (folder / "urdf").mkdir(parents=True)
    (folder / "meshes").mkdir()
    trimesh.creation.box((0.3, 0.04, 0.04)).export(folder / "meshes" / "upper.stl")
    mesh = '<mesh filename="package://own_description/meshes/upper.stl"/>'
    (folder / "urdf" / "own.urdf").write_text(arm().replace('<box size="0.4 0.05 0.05"/>', mesh, 1))
    assert sim.simulate(PATH, SCENE, folder / "urdf" / "own.urdf", base=sim.Base()).report.status == "followed"
    (folder / "meshes" / "upper.stl").unlink()
    with pytest.raises(RobotError, match=r"upper\.stl"):
        sim.simulate(PATH, SCENE, folder / "urdf" / "own.urdf", base=sim.Base())


MENAGERIE_ARM = """<mujoco model="own"><compiler angle="radian"/>
<default><default class="servo"><general gaintype="fixed" biastype="affine" gainprm="2000" biasprm="0 -2000 -400"
 forcerange="-60 60" ctrlrange="-3 3"/></default></default>
<worldbody><light pos="0 0 2"/><body name="link0"><geom type="cylinder" size=".08 .12"/>
<body name="link1" pos="0 0 .1"><joint name="j1" axis="0 0 1" range="-3 3"/>
<geom type="box" size=".2 .03 .03" pos=".2 0 0" mass="1"/>
<body name="link2" pos=".4 0 0"><joint name="j2" axis="0 0 1" range="-3 3"/>
<geom type="box" size=".2 .03 .03" pos=".2 0 0" mass="1"/><site name="attachment_site" pos=".4 0 0"/>
<body name="left" pos=".4 .03 0"><joint name="f1" type="slide" axis="0 1 0" range="0 .04"/>
<geom size=".01" mass=".01"/></body>
<body name="right" pos=".4 -.03 0"><joint name="f2" type="slide" axis="0 -1 0" range="0 .04"/>
<geom size=".01" mass=".01"/>
</body></body></body></body></worldbody>
<tendon><fixed name="split"><joint joint="f1" coef=".5"/><joint joint="f2" coef=".5"/></fixed></tendon>
<equality><joint joint1="f1" joint2="f2"/></equality>
<actuator><general class="servo" joint="j1"/><general class="servo" joint="j2"/>
<general class="servo" tendon="split"/></actuator>
<sensor><jointpos joint="f1"/></sensor>
<keyframe><key name="home" qpos="0.5 1 0 0" ctrl="0.5 1 0"/></keyframe></mujoco>"""


def test_a_folder_as_in_the_menagerie_is_an_arm(tmp_path):
    """With servos in place of motors, a gripper, a keyframe, and a scene beside it."""
    folder = tmp_path / "maker_own"
    folder.mkdir()
    (folder / "own.xml").write_text(MENAGERIE_ARM)
    (folder / "own_mjx.xml").write_text("<mujoco/>")
    (folder / "scene.xml").write_text("<mujoco/>")
    model = sim.load_model(folder)
    assert model.tip == "attachment_site" and model.limits.postures[0] == (0.5, 1.0)
    report = sim.simulate(PATH, SCENE, model, base=sim.Base()).report
    assert report.status == "followed", report.sentences()
    (folder / "own.xml").rename(folder / "other.xml")
    with pytest.raises(RobotError, match=r"holds several robots \(other.xml and own_mjx.xml\); name one"):
        sim.load_model(folder)


QUADROTOR = """<mujoco model="quad"><compiler autolimits="true"/><option density="1.2" viscosity="1.8e-5"/>
<worldbody><body name="quad" pos="0 0 .1"><freejoint/>
<geom type="box" size=".1 .1 .03" mass="1.3"/>
<site name="t1" pos="-.14 -.18 .05"/><site name="t2" pos="-.14 .18 .05"/>
<site name="t3" pos=".14 .18 .05"/><site name="t4" pos=".14 -.18 .05"/></body></worldbody>
<actuator><motor site="t1" gear="0 0 1 0 0 -.02" ctrlrange="0 13"/>
<motor site="t2" gear="0 0 1 0 0 .02" ctrlrange="0 13"/>
<motor site="t3" gear="0 0 1 0 0 -.02" ctrlrange="0 13"/>
<motor site="t4" gear="0 0 1 0 0 .02" ctrlrange="0 13"/>
</actuator>
</mujoco>"""


def test_a_quadrotor_with_motors_at_sites_is_a_drone(tmp_path):
    (tmp_path / "quad.xml").write_text(QUADROTOR)
    path = Trajectory(np.linspace([0, 0, 1], [2, 1, 1.5], 20), np.full(20, 0.5))
    report = sim.simulate(path, SCENE, tmp_path / "quad.xml").report
    assert report.status == "followed", report.sentences()
    (tmp_path / "quad.xml").write_text(QUADROTOR.replace("0 13", "0 3"))
    with pytest.raises(RobotError, match=r"its rotors lift at most 12 N, and it weighs 1\.3 kg"):
        sim.load_model(tmp_path / "quad.xml")
    (tmp_path / "car.xml").write_text(QUADROTOR.partition("<actuator>")[0] + "</mujoco>")
    with pytest.raises(RobotError, match=r"not on rotors; describe a rover in a \.toml"):
        sim.load_model(tmp_path / "car.xml")
