"""Hand-made adaptations of the robot subset, right and wrong ones."""

import numpy as np
from handmade import (
    ARM,
    DRONE,
    GROUND,
    Edit,
    append,
    at,
    avoid,
    constant,
    drag,
    end,
    helix,
    line,
    mid,
    nearer,
    over,
    pace,
    pull,
    ramp,
    reach,
    resampled,
    sample,
    shift,
    shifted,
    speed_near,
    stop,
    then,
    through,
    toward,
    wait,
    zigzag,
)

from ovita import toolkit as tk

sample(
    f"{DRONE}2",
    pull("Person", 0.08),
    then(pull("Person", 0.08), line((0, -0.3, 0))),
    opposite=pull("Person", 0.08, -1),
    only_continuing=line((0, -0.3, 0)),
    wrong_object=pull("Cycle", 0.15),
)
sample(
    f"{DRONE}8",
    ramp(None, 0.0, 0.4),
    pace(0.5, (0.67, -0.19, 1.25), 0.9),
    opposite=ramp(None, 1.0, 0.4),
    start_instead=pace(0.5, (-1.42, -1.02, 0.0), 0.9),
)
sample(
    f"{DRONE}9", resampled(80), resampled(79), opposite=resampled(20), too_many=resampled(160), once_more=resampled(60)
)


def _onward(rows, scene):
    step = rows[-1, :3] - rows[-3, :3]
    return line(0.4 * step / np.linalg.norm(step))(rows, scene)


sample(
    f"{DRONE}11",
    _onward,
    line((0, 0.4, 0)),
    wrong_number=line((0, 0.8, 0)),
    too_little=line((0, 0.1, 0)),
    shift_instead=shift("front", metres=0.4),
)
nearer(f"{DRONE}12", "wall lamp", 0.06)


def _small_spiral(name: str, radius: float, turns: float = 2) -> Edit:
    def edit(rows, scene):
        i = int(reach(rows, at(scene, name)).argmin())
        t = np.linspace(0, 1, int(16 * turns) + 1)[1:-1]
        r, angle = radius * np.minimum(t, 1 - t) * 2, 2 * np.pi * turns * t
        offset = np.column_stack([r * np.cos(angle), r * np.sin(angle), 0 * t])
        loop = np.column_stack([rows[i, :3] + offset, np.full(len(t), rows[i, 3])])
        return np.concatenate([rows[: i + 1], loop, rows[i + 1 :]])

    return edit


def _wound_around(name: str, radius: float) -> Edit:
    """The waypoints near the object circle around the old path."""

    def edit(rows, scene):
        i = int(reach(rows, at(scene, name)).argmin())
        fine = tk.resample(rows, 200)
        centre = rows[i, :3]
        near = np.flatnonzero(reach(fine, centre) < 0.2)
        angle = np.linspace(0, 4 * np.pi, len(near))
        grow = radius * np.sin(np.linspace(0, np.pi, len(near)))
        fine[near, 0] += grow * np.cos(angle)
        fine[near, 2] += grow * np.sin(angle)
        return fine

    return edit


sample(
    f"{DRONE}14",
    _small_spiral("wall lamp", 0.1),
    _small_spiral("wall lamp", 0.08, 3),
    _wound_around("wall lamp", 0.1),
    wrong_object=_small_spiral("prayer mat", 0.1),
    too_large=_small_spiral("wall lamp", 0.3),
    after_the_goal=then(shift("back", 0.4), helix(2, 0.05)),
    closer_instead=pull("wall lamp", 0.1),
)
sample(
    f"{DRONE}16",
    lambda rows, scene: np.column_stack([rows[:, :2], np.full(len(rows), 0.1), rows[:, 3]]),
    wrong_number=lambda rows, scene: np.column_stack([rows[:, :2], np.full(len(rows), 0.3), rows[:, 3]]),
    shift_instead=shift("up", metres=0.1),
    at_least=lambda rows, scene: np.column_stack([rows[:, :2], np.maximum(rows[:, 2], 0.1), rows[:, 3]]),
)
nearer(f"{DRONE}17", "Cycle", 0.06)
sample(
    f"{DRONE}18",
    then(shift("up", 0.06), constant(0.1)),
    opposite=then(shift("down", 0.06), constant(0.1)),
    only_up=shift("up", 0.06),
    only_speed=constant(0.1),
    wrong_number=then(shift("up", 0.06), constant(0.2)),
)
sample(
    f"{DRONE}19",
    pace(0.5, "Box", 0.2),
    opposite=pace(2.0, "Box", 0.2),
    wrong_object=pace(0.5, "keyboard", 0.2),
    everywhere=pace(0.5),
)
sample(
    f"{DRONE}21",
    then(pull("Fan", 0.08), avoid(0.25, "Dustbin")),
    opposite=then(pull("Fan", 0.08, -1), pull("Dustbin", 0.03)),
    only_dustbin=avoid(0.25, "Dustbin"),
    too_near=then(pull("Fan", 0.08), pull("Dustbin", 0.03)),
    wrong_object=then(pull("Person", 0.08), avoid(0.25, "Dustbin")),
)


def _spline(count: int) -> Edit:
    def edit(rows, scene):
        from scipy.interpolate import CubicSpline

        k = np.arange(len(rows))
        new = CubicSpline(k, rows)(np.linspace(0, len(rows) - 1, count))
        new[:, 3] = np.maximum(new[:, 3], 0)
        return new

    return edit


sample(
    f"{DRONE}24",
    lambda rows, scene: tk.smooth(rows, 3.0),
    _spline(200),
    opposite=zigzag(0.02, 5),
    shift_instead=shift("up"),
    resampled_instead=resampled(20),
)

sample(
    f"{GROUND}0",
    shift("back", metres=3.0),
    opposite=shift("front", metres=3.0),
    wrong_number=shift("back", metres=1.5),
    across=shift("left", metres=3.0),
)
sample(
    f"{GROUND}1",
    lambda rows, scene: shifted(rows, (0.4, 0.2, 0)),
    opposite=lambda rows, scene: shifted(rows, (-0.4, -0.2, 0)),
    swapped=lambda rows, scene: shifted(rows, (0.2, 0.4, 0)),
    only_right=lambda rows, scene: shifted(rows, (0.4, 0, 0)),
    only_front=lambda rows, scene: shifted(rows, (0, 0.2, 0)),
)
sample(
    f"{GROUND}4",
    constant(0.34, "bottle", 2.0),
    everywhere=constant(0.34),
    wrong_number=constant(0.5, "bottle", 2.0),
    wrong_object=constant(0.34, "fan", 2.0),
    smaller_radius=constant(0.34, "bottle", 1.0),
)
sample(
    f"{GROUND}5",
    then(drag("piano", 0.1), ramp(0.1, 0.8)),
    then(drag("piano", 0.1), ramp(0.0, 0.6)),
    opposite=then(drag("piano", 0.1, -1), ramp(0.8, 0.1)),
    only_path=drag("piano", 0.1),
    only_speed=ramp(0.1, 0.8),
    wrong_object=then(drag("cupboard", 0.15), ramp(0.1, 0.8)),
)


def _doubled(name: str, times: float) -> Edit:
    def edit(rows, scene):
        point, new = at(scene, name), rows.copy()
        new[:, :3] = point + times * (rows[:, :3] - point)
        return new

    return edit


sample(
    f"{GROUND}6",
    _doubled("table", 2.0),
    opposite=_doubled("table", 0.5),
    wrong_number=_doubled("table", 1.5),
    wrong_object=_doubled("bed", 2.0),
    pushed_instead=pull("table", 0.1, -1),
)
sample(
    f"{GROUND}12",
    then(pull("bottle", 0.08, -1), wait("fan", 10)),
    opposite=then(pull("bottle", 0.05), pace(2)),
    only_path=pull("bottle", 0.08, -1),
    only_wait=wait("fan", 10),
    wrong_number=then(pull("bottle", 0.08, -1), wait("fan", 3)),
    wrong_place=then(pull("bottle", 0.08, -1), wait("start", 10)),
)


def _straightened(a: str, b: str) -> Edit:
    def edit(rows, scene):
        i, j = sorted(int(reach(rows, at(scene, name)).argmin()) for name in (a, b))
        new = rows.copy()
        new[i : j + 1, :3] = np.linspace(rows[i, :3], rows[j, :3], j - i + 1)
        return new

    return edit


sample(
    f"{GROUND}13",
    _straightened("fan", "chair"),
    wrong_object=_straightened("fan", "cupboard"),
    everything=lambda rows, scene: np.column_stack([np.linspace(rows[0, :3], rows[-1, :3], len(rows)), rows[:, 3]]),
)
sample(
    f"{GROUND}15",
    then(pull("fan", 0.04), pace(1.4, "sofa")),
    opposite=then(pull("fan", 0.04, -1), pace(0.6, "sofa")),
    only_path=pull("fan", 0.04),
    only_speed=pace(1.4, "sofa"),
    swapped=then(pull("sofa", 0.04), pace(1.4, "fan")),
)
sample(
    f"{GROUND}17",
    lambda rows, scene: shifted(rows, (-1, 1, 0)),
    opposite=lambda rows, scene: shifted(rows, (1, -1, 0)),
    only_left=lambda rows, scene: shifted(rows, (-1, 0, 0)),
    only_front=lambda rows, scene: shifted(rows, (0, 1, 0)),
)


def _revolution(name: str, turns: float = 1.0, sense: float = 1.0) -> Edit:
    """A circle around the object, begun where the path is nearest to it."""

    def edit(rows, scene):
        centre = at(scene, name)
        i = int(reach(rows, centre).argmin())
        spoke = rows[i, :2] - centre[:2]
        angle = np.arctan2(spoke[1], spoke[0]) + sense * np.linspace(0, 2 * np.pi * turns, int(40 * turns) + 2)[1:-1]
        ring = centre[:2] + np.linalg.norm(spoke) * np.column_stack([np.cos(angle), np.sin(angle)])
        loop = np.column_stack([ring, np.full((len(ring), 1), rows[i, 2]), np.full((len(ring), 1), rows[i, 3])])
        return np.concatenate([rows[: i + 1], loop, rows[i + 1 :]])

    return edit


sample(
    f"{GROUND}20",
    _revolution("piano"),
    _revolution("piano", sense=-1.0),
    wrong_number=_revolution("piano", 3.0),
    wrong_object=_revolution("table"),
    after_the_goal=append(lambda rows, scene: rows[-1, :3] + np.linspace(0, 1, 10)[1:, None] * np.array([3.2, 1.1, 0])),
    closer_instead=pull("piano", 0.1),
)


def _first_pulled(count: int, name: str, share: float) -> Edit:
    def edit(rows, scene):
        new, point = rows.copy(), at(scene, name)
        new[:count, :3] += share * (point - rows[:count, :3])
        return new

    return edit


sample(
    f"{GROUND}22",
    _first_pulled(6, "chair", 0.2),
    opposite=_first_pulled(6, "chair", -0.2),
    everything=_first_pulled(40, "chair", 0.2),
    wrong_object=_first_pulled(6, "bed", 0.3),
    last_six=lambda rows, scene: _first_pulled(6, "chair", 0.3)(rows[::-1], scene)[::-1],
)


def _constant_from(name: str, value: float, before: bool = False) -> Edit:
    def edit(rows, scene):
        new, i = rows.copy(), int(reach(rows, at(scene, name)).argmin())
        new[slice(0, i + 1) if before else slice(i, None), 3] = value
        return new

    return edit


sample(
    f"{GROUND}23",
    _constant_from("bed", 0.3),
    _constant_from("bed", 0.1),
    everywhere=constant(0.3),
    before_instead=_constant_from("bed", 0.3, before=True),
    wrong_object=_constant_from("cupboard", 0.3),
    slower_instead=pace(0.5),
)

toward(f"{ARM}0", "up")
toward(f"{ARM}2", "left")
toward(f"{ARM}6", "up")


def _middle(factor: float, low: float = 0.3, high: float = 0.7, outer: bool = False) -> Edit:
    def edit(rows, scene):
        share = np.linspace(0, 1, len(rows))
        new, mask = rows.copy(), (share >= low) & (share <= high)
        new[mask != outer, 3] *= factor
        return new

    return edit


sample(
    f"{ARM}5",
    _middle(0.5),
    _middle(0.3, 0.4, 0.6),
    opposite=_middle(2.0),
    everywhere=pace(0.5),
    ends_instead=_middle(0.5, outer=True),
)
sample(
    f"{ARM}8",
    lambda rows, scene: tk.extend(rows, 0.2),
    line((0.1, 0, 0.1)),
    shift_instead=shift("front"),
    cut_short=lambda rows, scene: rows[:60],
)
sample(
    f"{ARM}10",
    end((0.1, 0, 0)),
    end((0.1, 0, 0), share=0.02),
    opposite=end((-0.1, 0, 0)),
    wrong_number=end((0.2, 0, 0)),
    start_instead=end((0.1, 0, 0), row=0),
    whole_path=shift("right", metres=0.1),
)
speed_near(f"{ARM}11", "banana", 1.5)
nearer(f"{ARM}13", "orange", 0.06)
sample(
    f"{ARM}16",
    through(mid("banana", "glue")),
    wrong_object=through(mid("banana", "green bowl")),
    only_banana=through(lambda scene: at(scene, "banana")),
    shift_instead=shift("up"),
)
sample(
    f"{ARM}18",
    stop("scissors", cut=True),
    stop("scissors", cut=False),
    opposite=pace(2, "scissors"),
    only_slower=pace(0.5, "scissors"),
    at_the_start=stop([-0.53, 0.05, 1.85], cut=False),
)
sample(
    f"{ARM}20",
    wait("mug", 7),
    wrong_number=wait("mug", 2),
    wrong_place=wait("start", 7),
    only_slower=pace(0.5, "mug"),
)
sample(
    f"{ARM}21",
    end((0, 0, -0.2), row=0),
    opposite=end((0, 0, 0.2), row=0),
    wrong_number=end((0, 0, -0.1), row=0),
    goal_instead=end((0, 0, -0.2)),
    whole_path=shift("down", metres=0.2),
)
sample(
    f"{ARM}24",
    through(over("red marker", 0.15), over("remote_controller", 0.2)),
    wrong_object=through(over("lemon", 0.2), over("spoon", 0.2)),
    only_first=through(over("red marker", 0.15)),
    shift_instead=shift("front"),
)


def _halves(first, second) -> Edit:
    def edit(rows, scene):
        late = np.arange(len(rows)) >= len(rows) // 2
        return shifted(shifted(rows, first, ~late), second, late)

    return edit


sample(
    f"{ARM}25",
    _halves((-0.2, 0, 0), (0.2, 0, 0)),
    opposite=_halves((0.2, 0, 0), (-0.2, 0, 0)),
    only_first=_halves((-0.2, 0, 0), (0, 0, 0)),
    only_second=_halves((0, 0, 0), (0.2, 0, 0)),
    wrong_number=_halves((-0.1, 0, 0), (0.1, 0, 0)),
)
nearer(f"{ARM}27", "apple", 0.1)
