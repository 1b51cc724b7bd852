"""Parts of a path: the same as mask, as words and as JSON."""

import json

import numpy as np
import pytest

from ovita.errors import UnknownObject
from ovita.paths import part
from ovita.paths.geometry import runs
from ovita.paths.part import PathPart
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory

SCENE = Scene((SceneObject("cup", [3.0, 0.5, 0.0]), SceneObject("the box", [7.0, 0.0, 0.0])))
LINE = Trajectory(np.column_stack([np.arange(11.0), np.zeros(11), np.zeros(11)]), np.full(11, 0.5))


def of_mask(mask):
    return PathPart("indices", ranges=tuple(runs(mask)), count=len(mask))


def only(*indices):
    return [i in indices for i in range(11)]


PARTS = [
    (PathPart(), "", only(*range(11))),
    (part.near("cup", 1.2), "near the cup (within 1.2 m)", only(2, 3, 4)),
    (part.near([4.5, 0.1, 0], 0.2), "near [4.5, 0.1, 0] (within 0.2 m)", only(4)),
    (part.near({"between": ["cup", "the box"]}), "near the midpoint of the cup and the box", only(4, 5, 6)),
    (part.first(3), "in the first 3 waypoints", only(0, 1, 2)),
    (part.first(fraction=0.2), "in the first 20%", only(0, 1)),
    (part.first(2.5, unit="m"), "in the first 2.5 m", only(0, 1, 2)),
    (part.last(4, unit="s"), "in the last 4 s", only(8, 9, 10)),
    (part.last(2), "in the last 2 waypoints", only(9, 10)),
    (part.middle(0.3), "in the middle", only(4, 5, 6)),
    (part.after("box"), "after the box", only(7, 8, 9, 10)),
    (part.before([2, 0, 0]), "before [2, 0, 0]", only(0, 1, 2)),
    (part.between("box", "cup"), "between the box and the cup", only(3, 4, 5, 6, 7)),
    (PathPart("range", amount=2, until=4), "from waypoint 3 to 5", only(2, 3, 4)),
    (PathPart("range", amount=9), "from waypoint 10 on", only(9, 10)),
    (PathPart("range", amount=1.5, until=3.5, unit="m"), "from 1.5 to 3.5 m", only(2, 3)),
    (PathPart("every", amount=4), "at one waypoint in 4", only(0, 4, 8)),
    (PathPart("heading", direction="right"), "where it heads right", only(*range(11))),
    (PathPart("beyond", direction="right", amount=7.5), "further right than 7.5 m", only(8, 9, 10)),
    (PathPart("indices", ranges=((0, 1), (5, 5)), count=11), "at waypoints 1 to 2 and waypoint 6", only(0, 1, 5)),
    (part.outside(part.first(9)), "except in the first 9 waypoints", only(9, 10)),
    (part.outside(part.near("cup", 4)), "except near the cup (within 4 m)", only(8, 9, 10)),
    (part.both(part.first(5), part.last(8)), "in the first 5 waypoints and in the last 8 waypoints", only(3, 4)),
    (
        PathPart("either", parts=(part.first(2), part.last(fraction=0.1))),
        "in the first 2 waypoints or in the last 10%",
        only(0, 1, 10),
    ),
]


@pytest.mark.parametrize(("chosen", "words", "mask"), PARTS, ids=lambda p: p.kind if isinstance(p, PathPart) else "")
def test_a_part_is_a_mask_words_and_json(chosen, words, mask):
    assert chosen.words() == words
    found = chosen.mask(LINE, SCENE)
    assert found.tolist() == mask
    assert PathPart.from_json(json.loads(json.dumps(chosen.to_json()))) == chosen
    assert (of_mask(found).mask(LINE, SCENE) == found).all()


def test_indices_stretch_with_the_number_of_waypoints():
    assert of_mask(np.arange(11) < 5).mask(LINE.resample(21, by="index"), SCENE).sum() in (9, 10)


def test_turns_are_where_the_path_bends_most():
    corner = Trajectory([[x, 0, 0] for x in range(20)] + [[19, y, 0] for y in range(1, 20)], np.ones(39))
    assert np.abs(np.flatnonzero(part.turns(0.08).mask(corner, SCENE)) - 19).max() <= 3


@pytest.mark.parametrize("document", [{"nonsense": 1}, {"first": "many"}, {"range": 3}, {"outside": {"x": 1}}])
def test_what_is_no_part_is_refused(document):
    with pytest.raises(ValueError):
        PathPart.from_json(document).mask(LINE, SCENE)


def test_an_unknown_object_is_named():
    with pytest.raises(UnknownObject, match="dragon"):
        part.near("dragon", 1).mask(LINE, SCENE)


def test_every_part_of_a_waypoint_is_refused():
    with pytest.raises(ValueError, match=r"every 0\.5 waypoints is no part"):
        PathPart("every", amount=0.5).mask(LINE, SCENE)


def test_a_radius_of_the_surface_is_measured_from_the_box_itself():
    scene = Scene((SceneObject("crate", [5.0, 0.0, 0.0], [3.0, 1.0, 1.0]), SceneObject("pin", [5.0, 0.0, 0.0])))
    surface = PathPart("near", ("crate",), 0.6, of="surface")
    assert surface.mask(LINE, scene).tolist() == only(3, 4, 5, 6, 7)
    assert PathPart("near", ("crate",), 0.6, of="centre").mask(LINE, scene).tolist() == only(5)
    assert PathPart("near", ("pin",), 0.6, of="surface").mask(LINE, scene).tolist() == only(5)
    assert PathPart.from_json(json.loads(json.dumps(surface.to_json()))) == surface
    with pytest.raises(ValueError, match="'centre' or 'surface'"):
        PathPart.from_json({"near": "crate", "within": 1.0, "of": "edge"})
