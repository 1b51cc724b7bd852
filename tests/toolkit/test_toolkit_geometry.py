import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from toolkit_paths import distances, modest, paths, paths_and_masks, points

from ovita.paths.scene import Frame, SceneObject
from ovita.paths.trajectory import Trajectory, arc_length
from ovita.toolkit import (
    Recorder,
    average,
    curve,
    mirror,
    reverse,
    rotate,
    scale,
    shortcut,
    straighten,
    tilt,
)

BALL = SceneObject("ball", [0.5, 0.02, 0.0], [0.1, 0.1, 0.1])

MASKED = {
    "rotate": lambda t, m: rotate(t, 40, about=BALL, where=m),
    "mirror": lambda t, m: mirror(t, "left", about="start", where=m),
    "scale": lambda t, m: scale(t, 1.3, where=m),
}
SHAPING = {
    "tilt": lambda t: tilt(t, 20),
    "curve": lambda t: curve(t, 2),
    "straighten": lambda t: straighten(t),
}
angles = st.floats(-720, 720).map(lambda v: round(v, 1))
axes = st.sampled_from(["up", "down", "left", "front"])
pivots = st.one_of(st.none(), st.sampled_from(["start", "goal", 0.5, -1]), points)


@modest
@given(paths_and_masks(extra=2), st.sampled_from(sorted({**MASKED, **SHAPING})))
def test_only_the_selected_positions_change(drawn, name):
    rows, mask = drawn
    before = rows.copy()
    rows.flags.writeable = False
    out = MASKED[name](rows, mask) if name in MASKED else SHAPING[name](rows)
    assert np.array_equal(rows, before) and not np.shares_memory(out, rows)
    assert np.isfinite(out).all()
    assert np.array_equal(out[:, 3:], rows[:, 3:])
    if name in MASKED:
        assert np.array_equal(out[~mask], rows[~mask])
    steps = (np.diff(rows[:, :3], axis=0) == 0).all(axis=1)
    if name in SHAPING:
        assert (np.diff(out[:, :3], axis=0)[steps] == 0).all()


@modest
@given(paths(), angles, axes, pivots)
def test_a_rotation_is_rigid_and_can_be_undone(rows, degrees, axis, about):
    out = rotate(rows, degrees, about=about, axis=axis)
    assert np.allclose(pairwise(out), pairwise(rows))
    assert np.allclose(np.linalg.det(spanned(out)), np.linalg.det(spanned(rows)))
    back = rotate(out, -degrees, about=about, axis=axis)
    assert np.allclose(back, rows)
    upward = Frame().direction(axis)
    if about is None:
        assert np.allclose(out[:, :3].mean(axis=0), rows[:, :3].mean(axis=0))
        assert np.allclose((out - rows)[:, :3] @ upward, 0)
    elif isinstance(about, np.ndarray):
        assert np.allclose(distances(out, about), distances(rows, about))
    elif about == "start":
        assert np.allclose(out[0], rows[0])


def pairwise(rows):
    return np.linalg.norm(rows[:, None, :3] - rows[None, :, :3], axis=2)


def spanned(rows):
    """Three edges of a path from its start, whose determinant changes its sign in a mirror only."""
    return np.resize(rows[1:, :3] - rows[0, :3], (3, 3)) if len(rows) > 3 else np.zeros((3, 3))


@pytest.mark.parametrize(
    ("axis", "of", "to"),
    [
        ("up", "front", "left"),
        ("down", "front", "right"),
        ("front", "left", "up"),
        ("back", "right", "up"),
        ("right", "front", "up"),
        ("left", "front", "down"),
    ],
)
@pytest.mark.parametrize("name", ["rfu", "flu", "ned"])
def test_a_quarter_turn_is_counter_clockwise_seen_from_the_tip(name, axis, of, to):
    frame = Frame(name)
    rows = np.zeros((2, 4))
    rows[1, :3] = frame.direction(of)
    assert np.allclose(rotate(rows, 90, about="start", axis=axis, frame=frame)[1, :3], frame.direction(to))
    if axis not in ("up", "down"):
        assert np.allclose(tilt(rows, 90, about="start", axis=axis, frame=frame)[1, :3], frame.direction(to))
    assert np.array_equal(rotate(rows, 720, axis=axis, frame=frame), rows)


@modest
@given(paths_and_masks(), st.sampled_from(["x", "y", "z", "left", "back", "up"]), pivots)
def test_a_mirror_image_of_a_mirror_image_is_the_original(drawn, axis, about):
    rows, mask = drawn
    assume(not isinstance(about, (str, int, float)) or about == "start")
    if isinstance(about, str):
        mask[0] = True
    out = mirror(rows, axis, about=about, where=mask, ease=0)
    assert np.allclose(mirror(out, axis, about=about, where=mask, ease=0), rows)
    flipped = {"x": 1, "y": 0, "z": 2, "left": 0, "back": 1, "up": 2}[axis]
    assert np.array_equal(np.delete(out, flipped, axis=1), np.delete(rows, flipped, axis=1))
    assert np.allclose(pairwise(out[mask]), pairwise(rows[mask]))
    if isinstance(about, np.ndarray):
        assert np.allclose(out[mask, flipped] - about[flipped], about[flipped] - rows[mask, flipped])


def test_words_mirror_by_the_frame(line):
    line[:, 1] = line[:, 0] ** 2
    assert np.array_equal(mirror(line, "left", about=[0, 0, 0])[:, 0], -line[:, 0])
    assert np.array_equal(mirror(line, "left", about=[0, 0, 0], frame=Frame("flu"))[:, 1], -line[:, 1])
    assert np.array_equal(mirror(line, "left"), mirror(line, "right"))
    assert np.array_equal(mirror(line, "x", about=BALL)[:, 1], 0.04 - line[:, 1])


@modest
@given(paths(), st.floats(0.1, 5), st.floats(0.1, 5), pivots)
def test_scaling_multiplies_lengths_and_composes(rows, a, b, about):
    out = scale(rows, a, about=about)
    assert np.allclose(pairwise(out), a * pairwise(rows))
    assert np.allclose(scale(out, b, about=about), scale(rows, a * b, about=about))
    assert np.array_equal(scale(rows, 1, about=about), rows)
    if isinstance(about, np.ndarray):
        assert np.allclose(distances(out, about), a * distances(rows, about))


@modest
@given(paths(smallest=3), st.floats(-3, 3))
def test_a_curve_multiplies_the_distance_from_the_chord(rows, factor):
    out = curve(rows, factor)
    assert np.array_equal(out[[0, -1]], rows[[0, -1]])
    chord = rows[-1, :3] - rows[0, :3]
    length = np.linalg.norm(chord)
    if length > 1e-3:
        across, new = (np.cross(r[:, :3] - rows[0, :3], chord) / length for r in (rows, out))
        assert np.allclose(new, factor * across, atol=1e-9)
        assert np.allclose((out - rows)[:, :3] @ chord, 0, atol=1e-9)
    assert np.array_equal(curve(rows, 1), rows)


def test_a_loop_is_curved_about_its_start():
    angle = np.linspace(0, 2 * np.pi, 25)
    rows = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle, np.ones(25)])
    rows[-1] = rows[0]
    assert np.allclose(curve(rows, 2)[12, :3], [-3, 0, 0])


@modest
@given(paths(smallest=3), st.integers(0, 40), st.integers(0, 40))
def test_straightening_makes_an_even_line_and_keeps_the_rest(rows, a, b):
    a, b = sorted((a % len(rows), b % len(rows)))
    assume(a != b)
    out = straighten(rows, b, a)
    assert np.array_equal(np.delete(out, range(a + 1, b), axis=0), np.delete(rows, range(a + 1, b), axis=0))
    assert arc_length(out[a : b + 1, :3])[-1] == pytest.approx(np.linalg.norm(rows[b, :3] - rows[a, :3]))
    steps = np.linalg.norm(np.diff(out[a : b + 1, :3], axis=0), axis=1)
    dwell = (np.diff(rows[a : b + 1, :3], axis=0) == 0).all(axis=1)
    assert (steps[dwell] == 0).all()
    if not dwell.all():
        assert np.ptp(steps[~dwell]) < 1e-9


def test_straightening_between_objects(line, cup):
    line[:, 1] = np.sin(3 * line[:, 0])
    out = straighten(line, cup, "goal")
    i = int(np.argmin(cup.distance(line[:, :3])))
    assert np.array_equal(out[: i + 1], line[: i + 1]) and not np.array_equal(out, line)


@modest
@given(paths(extra=2), st.integers(0, 39), points)
def test_a_shortcut_ends_straight_at_its_target(rows, a, point):
    i = a % len(rows)
    assume((rows[i, :3] != point).any())
    out = shortcut(rows, i, point)
    assert np.array_equal(out[: i + 1], rows[: i + 1])
    assert np.array_equal(out[-1, :3], point)
    assert len(out) > i + 1
    tail = out[i:, :3]
    assert arc_length(tail)[-1] == pytest.approx(np.linalg.norm(point - rows[i, :3]))
    assert (out[i:, 4:] == rows[i, 4:]).all()
    assert out[-1, 3] == rows[-1, 3]
    Trajectory.from_array(out[:, :4])


def test_a_shortcut_from_an_object_to_another(line, cup, scene):
    recorder = Recorder()
    out = shortcut(line, cup, scene["box"], recorder=recorder)
    assert np.array_equal(out[:11], line[:11]) and np.array_equal(out[-1, :3], scene["box"].position)
    assert recorder.contacts == ["box"]
    assert np.linalg.norm(np.diff(out[:, :3], axis=0), axis=1).max() <= 0.05 + 1e-9
    aside = shortcut(line, "start", cup, up=0.2, recorder=recorder)
    assert np.allclose(aside[-1, :3], [0.5, 0.3, 0.2]) and np.array_equal(aside[0], line[0])
    assert recorder.contacts == ["box"]
    assert np.array_equal(shortcut(line, 5, "goal")[-1], line[-1])
    line[-1, 3] = 0.0
    assert np.array_equal(shortcut(line, 5, 5)[:5], line[:5]) and shortcut(line, 5, 5)[5, 3] == 0


@modest
@given(paths(extra=2, smallest=3), st.integers(1, 39))
def test_an_average_keeps_the_centroid_of_full_groups(rows, k):
    assume(k < len(rows))
    out = average(rows, k)
    assert len(out) == -(-len(rows) // k)
    full = len(rows) // k
    assert np.allclose(out[:full], rows[: full * k].reshape(full, k, -1).mean(axis=1))
    if full < len(out):
        assert np.allclose(out[-1], rows[full * k :].mean(axis=0))
    assert np.array_equal(average(rows, 1), rows)


@modest
@given(paths_and_masks(extra=2))
def test_reversing_twice_changes_nothing(drawn):
    rows, mask = drawn
    before = rows.copy()
    out = reverse(rows, where=mask)
    assert np.array_equal(rows, before)
    assert np.array_equal(out[~mask], rows[~mask])
    assert np.array_equal(reverse(out, where=mask), rows)
    assert np.array_equal(reverse(rows), rows[::-1])


def test_each_run_is_reversed_for_itself(line):
    mask = np.isin(np.arange(21), [2, 3, 4, 8, 9])
    order = np.rint(reverse(line, where=mask)[:, 0] * 20).astype(int).tolist()
    assert order[:11] == [0, 1, 4, 3, 2, 5, 6, 7, 9, 8, 10]
