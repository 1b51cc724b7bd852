import numpy as np
import pytest
from hypothesis import given
from toolkit_paths import distances, modest, paths, points, words

from ovita.paths.scene import Frame
from ovita.toolkit import between, every, first, last, move, near, where_rising


@modest
@given(paths(), points)
def test_near_selects_by_distance_to_the_centre(rows, point):
    selected = near(rows, point, within=0.5)
    assert selected.dtype == bool
    assert (selected == (distances(rows, point) <= 0.5)).all()


def test_near_takes_objects_and_measures_to_the_centre(line, cup):
    assert (near(line, cup, 0.31) == near(line, cup.position, 0.31)).all()
    assert near(line, cup, 0.29).sum() == 0
    assert near(line, cup, 0.31).sum() == 3


def test_first_and_last(line):
    assert first(line, 3).nonzero()[0].tolist() == [0, 1, 2]
    assert last(line, 2).nonzero()[0].tolist() == [19, 20]
    assert first(line, fraction=0.5).sum() == 10
    assert last(line, fraction=0.01).sum() == 1
    assert not first(line, fraction=0).any()


def test_between_takes_every_kind_of_place_in_any_order(line, cup):
    assert between(line, 3, 5).nonzero()[0].tolist() == [3, 4, 5]
    assert (between(line, 5, 3) == between(line, 3, 5)).all()
    assert between(line, 0.25, 0.5).nonzero()[0].tolist() == list(range(5, 11))
    assert between(line, cup, "goal").nonzero()[0].tolist() == list(range(10, 21))
    assert between(line, -2, [1.0, 0, 0]).nonzero()[0].tolist() == [19, 20]


def test_where_rising_follows_the_frame():
    z = np.array([0, 0, 1, 2, 2, 1, 0.0])
    rows = np.column_stack([np.arange(7.0), np.zeros(7), z, np.ones(7)])
    assert where_rising(rows).nonzero()[0].tolist() == [1, 2]
    assert where_rising(rows, "down").nonzero()[0].tolist() == [4, 5, 6]
    assert where_rising(rows, frame=Frame("ned")).nonzero()[0].tolist() == [4, 5, 6]
    assert where_rising(rows, "front", frame=Frame("flu")).all()


@modest
@given(paths(), words)
def test_a_path_never_rises_both_ways(rows, word):
    other = {"left": "right", "right": "left", "front": "back", "back": "front", "up": "down", "down": "up"}[word]
    assert not (where_rising(rows, word) & where_rising(rows, other)).any()


def test_every(line):
    assert every(line, 5).nonzero()[0].tolist() == [0, 5, 10, 15, 20]
    assert every(line, 10, start=3).nonzero()[0].tolist() == [3, 13]


def test_masks_combine(line, cup):
    mask = near(line, cup, 0.4) & ~first(line, 10)
    assert np.array_equal(move(line, up=1.0, where=mask)[~mask], line[~mask])


@pytest.mark.parametrize("fraction", [0.1, 0.33, 1.0])
def test_first_and_last_of_a_fraction_are_mirror_images(line, fraction):
    assert (first(line, fraction=fraction) == last(line, fraction=fraction)[::-1]).all()
