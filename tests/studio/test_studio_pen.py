"""A pen that is dragged through the studio's scene: strokes become demonstrations, these a skill."""

import json

import numpy as np
import pytest

from ovita.errors import RequestError
from ovita.io import load_task
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory
from ovita.sources.learning import learn
from ovita.sources.skills import Skill
from ovita.studio.recording import PenSample, level, stroke


def drag(tab, path):
    """What a browser sends while a person drags the pen along a path (N, 3)."""
    common = {"name": "/pen", "owner": tab.nodes["/pen"]["owner"], "instance_index": None}
    common |= {"start_screen_pos": (0.5, 0.5), "end_screen_pos": (0.5, 0.5), "button": "left", "modifier": None}
    for i, place in enumerate(path):
        phase = "start" if i == 0 else "end" if i == len(path) - 1 else "update"
        at = tuple(float(v) for v in place)
        tab.send("SceneNodeDragMessage", phase=phase, start_position=at, end_position=at, **common)


def test_strokes_are_kept_saved_and_learned_from(start, visit, tmp_path):
    studio = start()
    tab = visit(studio)
    tab.click("Take the pen")
    tab.wait(lambda: "/pen" in tab.nodes and tab.find("Put the pen away"))
    tab.set("the pen moves", "in the plane that faces you")
    home = studio.views[0].controller.session.original.positions[0]
    s = np.linspace(0.05, 1.0, 25)
    for by in (0.0, 0.02, -0.02):
        drag(tab, home + np.stack([s, (by + 0.2) * np.sin(np.pi * s), 0.1 * s], axis=1))
        tab.wait(lambda: tab.points("/lines/pen") is not None)
    tab.wait(lambda: "3 demonstrations" in tab.text())
    tab.click("Save the demonstrations")
    tab.wait(lambda: "demonstration-3.json" in tab.downloads)
    (tmp_path / "one.json").write_bytes(tab.downloads["demonstration-1.json"])
    path = load_task(tmp_path / "one.json").trajectory
    assert np.allclose(path.positions[[0, -1]], [home, home + np.array([1, 0, 0.1])], atol=1e-6)
    tab.click("Learn a skill and save it")
    tab.wait(lambda: "skill.json" in tab.downloads and any("3 demonstrations" in said for said in tab.notices))
    (tmp_path / "skill.json").write_bytes(tab.downloads["skill.json"])
    assert "/tube" in tab.nodes
    made = Skill.load(tmp_path / "skill.json").generate(goal=[0.9, 0.1, 0.1])
    assert np.allclose(made.trajectory.positions[-1], [0.9, 0.1, 0.1])
    tab.click("Put the pen away")
    tab.wait(lambda: "/pen" not in tab.nodes)


def test_a_skill_is_opened_as_what_it_generates_with_its_tube(start, visit, tmp_path):
    s = np.linspace(0.0, 1.0, 30)
    shown = [np.stack([s, by * np.sin(np.pi * s), 0 * s], axis=1) for by in (0.1, 0.2, 0.3)]
    learn([Trajectory(path, np.full(30, 0.2)) for path in shown]).save(tmp_path / "skill.json")
    tab = visit(start())
    tab.upload("skill.json", (tmp_path / "skill.json").read_bytes())
    tab.wait(lambda: "/tube" in tab.nodes and any("what the skill generates" in said for said in tab.notices))
    assert np.allclose(tab.points("/lines/original")[-1, 1], [1, 0, 0], atol=1e-5)
    document = json.loads((tmp_path / "skill.json").read_text())
    document["model"]["means"] = "x"
    tab.upload("broken.json", json.dumps(document).encode())
    tab.wait(lambda: any("model.means" in said for said in tab.notices))


def test_one_stroke_is_too_few_for_a_variance_and_that_is_said(start, visit):
    studio = start()
    tab = visit(studio)
    home = studio.views[0].controller.session.original.positions[0]
    tab.click("Take the pen")
    tab.wait(lambda: "/pen" in tab.nodes)
    drag(tab, home + np.linspace([0.0, 0.0, 0.0], [0.001, 0.0, 0.0], 5))
    tab.wait(lambda: any("the pen moved less than" in said for said in tab.notices))
    drag(tab, home + np.linspace([0.0, 0.0, 0.0], [0.5, 0.2, 0.0], 20))
    tab.wait(lambda: "1 demonstration" in tab.text())
    tab.click("Learn a skill and save it")
    tab.wait(lambda: any("one demonstration shows no variance" in said for said in tab.notices))
    tab.click("Discard the last")
    tab.wait(lambda: "1 demonstration" not in tab.text())


def test_the_pen_keeps_its_height_along_the_ray_of_the_eye():
    camera, home, up = np.array([0.0, -2.0, 2.0]), np.array([0.0, 0.0, 0.5]), np.array([0.0, 0.0, 1.0])
    there = np.array([0.4, 0.3, 0.5])
    seen = camera + 0.6 * (there - camera)
    assert np.allclose(level(seen, camera, home, up), there)
    sideways = level(np.array([1.0, 0.0, 2.0]), camera, home, up)
    assert sideways[2] == pytest.approx(0.5)


def test_a_stroke_has_the_speeds_of_the_hand():
    samples = [PenSample(0.1 * i, (0.05 * i, 0.0, 0.0)) for i in range(11)]
    task = stroke([*samples[:5], samples[4], *samples[5:]], Scene())
    assert len(task.trajectory) == 11 and task.trajectory.duration == pytest.approx(1.0, rel=1e-3)
    assert np.allclose(task.trajectory.speeds, 0.5, atol=1e-6)
    with pytest.raises(RequestError, match="the pen moved less than"):
        stroke(samples[:1], Scene())
