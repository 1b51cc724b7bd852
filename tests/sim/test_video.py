"""Videos: the robot and its path are to be seen, and a machine without OpenGL says so."""

import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from ovita import sim
from ovita.errors import FormatError, MissingExtra
from ovita.paths.scene import Frame, Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.sim import render
from ovita.sim.video import frames

pytest.importorskip("mujoco", reason="the extra sim is not installed")

NO_GL = not (render.egl_works() or render.osmesa_works())
needs_gl = pytest.mark.skipif(NO_GL, reason="neither EGL nor OSMesa works here (libegl1, libosmesa6)")
PATH = Trajectory(np.linspace([0.5, -0.3, 0.3], [0.5, 0.3, 0.5], 6), np.full(6, 0.6))
WORLD = sim.WorldTransform(Frame())


@pytest.fixture(scope="module")
def pane():
    scene = Scene((SceneObject("cup", np.array([0.4, 0.4, 0.1]), np.array([0.1, 0.1, 0.2])),))
    return sim.Pane("original", PATH, sim.simulate(PATH, scene, "iiwa", base=sim.Base()))


@needs_gl
def test_a_picture_shows_the_orange_arm_the_blue_trail_and_the_captions(pane):
    pictures = list(frames([pane, pane], WORLD, title="go higher", robot="KUKA", fps=3, scale=0.5))
    first, last = pictures[0].astype(int), pictures[-1].astype(int)
    assert first.shape == (2 * round(0.25 * 480) * 1 + 22 + 26, 640, 3)
    red, green, blue = last[22:-26].transpose(2, 0, 1)
    assert ((red > 150) & (green < 140) & (blue < 90)).sum() > 800
    trail = (blue > 150) & (red < 90)
    assert trail.sum() > 40
    assert (first[:22] < 90).any() and (first[-26:] < 90).any()
    left, right = last[22:-26, :320], last[22:-26, 320:]
    assert np.abs(left[:, 2:-2] - right[:, 2:-2]).mean() < 1.0
    assert np.abs(first - last)[22:-26].mean() > 1.0


@needs_gl
def test_the_adapted_path_is_red_as_in_every_other_picture(pane):
    both = [pane, replace(pane, label="adapted")]
    last = list(frames(both, WORLD, fps=2, scale=0.5))[-1][22:-26].astype(int)
    blue, red = last[:, 2:318], last[:, 322:638]
    other = np.abs(blue - red).max(axis=2) > 60
    assert other.sum() > 40
    assert (blue[other][:, 2] > blue[other][:, 0]).all() and (red[other][:, 0] > red[other][:, 2]).all()


@needs_gl
@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
def test_a_video_is_written_whole_or_not_at_all(pane, tmp_path, suffix):
    out, shares = tmp_path / f"v{suffix}", []
    sim.save_video(str(out), [pane], WORLD, fps=2, scale=0.3, progress=shares.append)
    assert out.stat().st_size > 1000 and os.listdir(tmp_path) == [out.name]
    assert shares[-1] == 1.0 and shares == sorted(shares)
    if suffix == ".mp4":
        import imageio_ffmpeg

        information = next(imageio_ffmpeg.read_frames(str(out)))
        assert information["codec"] == "h264" and information["size"] == (192, 174)


def test_an_unknown_suffix_is_refused():
    with pytest.raises(FormatError, match=r"v\.avi: videos are written as \.mp4, \.gif"):
        sim.check_video("v.avi")


def test_a_missing_video_package_is_named_with_its_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(MissingExtra, match=r"this needs imageio_ffmpeg: pip install 'ovita\[sim\]'"):
        sim.check_video("v.mp4")


def test_where_no_video_can_be_written_is_said_before_the_simulation(tmp_path, monkeypatch):
    (tmp_path / "v.mp4").mkdir()
    with pytest.raises(FormatError, match="this is a folder; name a file in it"):
        sim.check_video(str(tmp_path / "v.mp4"))
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    with pytest.raises(FormatError, match="no permission to write here"):
        sim.check_video(str(tmp_path / "w.mp4"))


def test_a_folder_that_is_missing_is_one_sentence(pane, tmp_path):
    with pytest.raises(FormatError, match="cannot be written: its folder does not exist"):
        sim.save_video(str(tmp_path / "none" / "v.mp4"), [pane], WORLD)


def test_without_opengl_the_packages_to_install_are_named(pane, monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", "disable")
    with pytest.raises(render.NoRenderer, match=r"install one of the Debian packages libegl1 .* libosmesa6"):
        next(frames([pane], WORLD))


@pytest.mark.parametrize(
    ("said", "egl", "osmesa", "chosen"),
    [
        ("", True, True, "egl"),
        ("", False, True, "osmesa"),
        ("", False, False, "disable"),
        ("osmesa", True, True, "osmesa"),
        ("off", True, True, "disable"),
    ],
)
def test_egl_is_taken_before_osmesa_unless_mujoco_gl_says_otherwise(monkeypatch, said, egl, osmesa, chosen):
    monkeypatch.setenv("MUJOCO_GL", said)
    monkeypatch.setattr(render, "egl_works", lambda: egl)
    monkeypatch.setattr(render, "osmesa_works", lambda: osmesa)
    monkeypatch.setattr(sys, "platform", "linux")
    assert render.backend() == chosen


@pytest.mark.skipif(not render.osmesa_works(), reason="OSMesa is not installed (libosmesa6)")
def test_osmesa_renders_too():
    code = (
        "import numpy as np; from ovita import sim; from ovita.sim.video import frames;"
        "from ovita.paths.trajectory import Trajectory; from ovita.paths.scene import Frame;"
        "t = Trajectory(np.array([[0, 0, 1], [0.3, 0, 1.0]]), np.ones(2));"
        "p = sim.Pane('a', t, sim.simulate(t, robot='crazyflie'));"
        "print(next(frames([p], sim.WorldTransform(Frame()), scale=0.2)).std() > 5)"
    )
    env = {**os.environ, "MUJOCO_GL": "osmesa"}
    env.pop("PYOPENGL_PLATFORM", None)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=env, timeout=120)
    assert done.stdout.strip() == "True", done.stderr[-2000:]


@needs_gl
def test_the_menagerie_gives_the_looks_where_it_is_at_hand(pane, tmp_path, monkeypatch):
    from ovita.sim import render

    monkeypatch.setenv("MENAGERIE_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.delenv("MENAGERIE_ROOT", raising=False)
    stage = pane.simulation.stage
    assert render.visual_model(stage) is stage.model
    folder = tmp_path / "kuka_iiwa_14"
    folder.mkdir()
    green = sim.load_model("iiwa").model.read_text(encoding="utf-8")
    green = green.replace('rgba="0.93 0.45 0.1 1"', 'rgba="0.1 0.9 0.1 1"').replace("0.62 0.64 0.67", "0.1 0.9 0.1")
    (folder / "iiwa14.xml").write_text(green, encoding="utf-8")
    monkeypatch.setenv("MENAGERIE_ROOT", str(tmp_path))
    picture = next(frames([pane], WORLD, scale=0.4)).astype(int)
    red, greens, blue = picture.transpose(2, 0, 1)
    assert ((greens > 120) & (red < 90) & (blue < 90)).sum() > 300
    assert not ((red > 150) & (greens < 140) & (blue < 60)).any()
    (folder / "iiwa14.xml").write_text("<mujoco/>", encoding="utf-8")
    assert render.visual_model(stage) is stage.model


@needs_gl
def test_a_small_robot_is_also_shown_from_near_and_a_small_workspace_by_its_edges():
    from ovita.paths.robot import Box, Robot

    path = Trajectory(np.linspace([-1.0, 0, 1], [1.0, 0, 1], 5), np.full(5, 1.0))
    limits = Robot("drone", Box((-1.2, -0.4, 0.5), (1.2, 0.4, 1.5)))
    run = sim.simulate(path, robot="crazyflie", limits=limits)
    with_box = next(frames([sim.Pane("a", path, run)], WORLD, scale=0.6)).astype(int)
    bare = sim.simulate(path, robot="crazyflie")
    without = next(frames([sim.Pane("a", path, bare)], WORLD, scale=0.6)).astype(int)
    assert (np.abs(with_box - without).max(axis=2) > 40).sum() > 200
    corner = without[32:110, -112:-8]
    assert (np.ptp(corner.reshape(-1, 3), axis=0) > 100).all()


def test_the_inset_goes_where_it_hides_no_path():
    import mujoco

    from ovita.sim.video import corner

    camera = mujoco.MjvCamera()
    camera.lookat[:], camera.distance, camera.azimuth, camera.elevation = (1.0, 2.0, 0.5), 4.0, 90.0, 0.0
    spread = np.array([[1.0 + x, 2.0, 0.5 + z] for x, z in [(1.5, 1.2), (-1.5, 1.2), (-1.5, -1.2)]])
    assert corner(camera, spread[2:], (640, 480)) == (1, 1)
    assert corner(camera, spread[:1], (640, 480)) == (-1, 1)
    assert corner(camera, spread, (640, 480)) == (1, -1)
