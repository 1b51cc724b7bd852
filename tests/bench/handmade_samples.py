"""The hand-made adaptations of each public sample, by id."""

import numpy as np
from handmade import (
    OPPOSITE,
    RIGHT,
    WRONG,
    Edit,
    append,
    at,
    avoid,
    constant,
    drag,
    end,
    fading,
    flipped,
    go_to,
    helix,
    line,
    mid,
    over,
    pace,
    pull,
    ramp,
    reach,
    resampled,
    same,
    shift,
    shifted,
    size,
    stop,
    then,
    through,
    turned,
    wait,
    with_other,
    zigzag,
)

from ovita import toolkit as tk

LATTE, EXTENDED = "latte_subset/latte_", "extended_subset/extended_"
DRONE = "robot_subset/Drone/drone_trajectory_"
GROUND, ARM = "robot_subset/Ground_robot/trajectory_", "robot_subset/Manipulator/trajectory_"


def sample(id: str, *right: Edit, **wrong: Edit) -> None:
    RIGHT[id] = list(right)
    WRONG[id] = [(name.replace("_", " "), edit) for name, edit in wrong.items()]


def nearer(id: str, name: str, share: float = 0.08) -> None:
    sample(
        id,
        pull(name, share),
        drag(name, share),
        opposite=pull(name, share, -1.0),
        wrong_object=with_other(name, lambda one: pull(one, share)),
        speed_instead=pace(0.5, name),
    )


def away(id: str, name: str, share: float = 0.08) -> None:
    sample(
        id,
        pull(name, share, -1.0),
        opposite=pull(name, share),
        wrong_object=with_other(name, lambda one: pull(one, share, -1.0)),
        speed_instead=pace(0.5, name),
    )


def speed_near(id: str, name: str, factor: float, moving: Edit = same) -> None:
    sample(
        id,
        then(pace(factor, name), moving),
        then(fading(factor, name), moving),
        opposite=then(pace(1 / factor, name), moving),
        wrong_object=with_other(name, lambda one: then(pace(factor, one), moving)),
        everywhere=then(pace(factor), moving),
        elsewhere=then(pace(factor, name, outer=True), moving),
        path_instead=pull(name, 0.08),
    )


def toward(id: str, word: str, share: float = 0.08) -> None:
    across = {"left": "front", "right": "back", "front": "up", "back": "down", "up": "left", "down": "right"}[word]
    sample(
        id,
        shift(word, share),
        line(0.3 * np.array(_axis(word))),
        end(0.3 * np.array(_axis(word)), share=0.8),
        opposite=shift(OPPOSITE[word], share),
        across=shift(across, share),
        speed_instead=pace(0.5),
    )


def _axis(word: str) -> tuple[int, int, int]:
    from handmade import AXES

    return AXES[word]


for number, name, share in (
    (0, "labyrinth", 0.06), (19, "bagel", 0.05), (27, "crossword", 0.1), (35, "panda", 0.04), (38, "Siamese cat", 0.1),
    (41, "stoplight", 0.05), (45, "trifle", 0.2), (50, "marmoset", 0.15), (63, "terrace", 0.04),
    (65, "Gordon setter", 0.06), (68, "shako", 0.1),
):  # fmt: skip
    nearer(f"{LATTE}{number}", name, share)
for number, name, share in (
    (9, "cardoon", 0.1), (14, "pretzel", 0.2), (22, "mower", 0.05), (48, "Tringa totanus", 0.1),
    (59, "fiddler crab", 0.1), (74, "curly-coated retriever", 0.15),
):  # fmt: skip
    away(f"{LATTE}{number}", name, share)
for number, name, factor in (
    (1, "orang", 0.7), (6, "shopping basket", 2.0), (10, "damselfly", 0.3), (16, "Irish water spaniel", 1.6),
    (25, "space shuttle", 0.7), (33, "icecream", 0.4), (43, "half track", 1.6), (52, "ladybird beetle", 1.4),
    (56, "prairie wolf", 1.6), (62, "African chameleon", 1.6), (70, "confectionery", 1.4),
):  # fmt: skip
    speed_near(f"{LATTE}{number}", name, factor)
for number, word in (
    (3, "down"), (15, "up"), (23, "left"), (30, "down"), (32, "left"), (36, "down"), (51, "front"), (57, "left"),
    (67, "up"),
):  # fmt: skip
    toward(f"{LATTE}{number}", word)

for id in (f"{EXTENDED}2", f"{DRONE}1"):
    sample(
        id,
        then(shift("up", 0.06), lambda rows, scene: end((0, 0, -0.12 * size(rows)))(rows, scene)),
        lambda rows, scene: end((0, 0, -0.12 * size(rows)), share=0.05)(shift("up", 0.06)(rows, scene), scene),
        opposite=then(shift("down", 0.06), lambda rows, scene: end((0, 0, 0.12 * size(rows)))(rows, scene)),
        only_path=shift("up", 0.06),
        only_goal=lambda rows, scene: end((0, 0, -0.06 * size(rows)))(rows, scene),
        only_goal_up=lambda rows, scene: end((0, 0, 0.06 * size(rows)))(rows, scene),
    )
sample(
    f"{EXTENDED}4",
    then(pace(1.5, "ear", 0.3), pull("tin opener", 0.1)),
    then(pull("tin opener", 0.1), pace(1.5, "ear", 0.3)),
    opposite=then(pace(0.6, "ear", 0.3), pull("tin opener", 0.1, -1)),
    only_speed=pace(1.5, "ear", 0.3),
    only_path=pull("tin opener", 0.1),
    wrong_object=then(pace(1.5, "tin opener", 0.35), pull("ear", 0.1)),
    everywhere=then(pace(1.5), pull("tin opener", 0.1)),
)
sample(
    f"{EXTENDED}6",
    then(shift("down", metres=0.1), pull("panda", 0.1)),
    then(pull("panda", 0.1), shift("down", metres=0.1)),
    opposite=then(shift("up", metres=0.1), pull("panda", 0.1, -1)),
    only_down=shift("down", metres=0.1),
    only_closer=pull("panda", 0.1),
    twice=then(shift("down", metres=0.2), pull("panda", 0.1)),
    wrong_object=then(shift("down", metres=0.1), pull("car wheel", 0.1)),
)
sample(
    f"{EXTENDED}8",
    stop("stinkhorn", cut=True),
    stop("stinkhorn", cut=False),
    lambda rows, scene: tk.stop_at(rows, scene["stinkhorn"]),
    lambda rows, scene: tk.stop_at(rows, scene["stinkhorn"], resume=True),
    opposite=pace(2.0, "stinkhorn"),
    wrong_object=stop("rifle", cut=False),
    only_slower=pace(0.5, "stinkhorn"),
)
sample(
    f"{EXTENDED}11",
    line((-0.2, 0, 0)),
    opposite=line((0.2, 0, 0)),
    too_little=line((-0.1, 0, 0)),
    whole_path=shift("left", metres=0.2),
    goal_only=end((-0.2, 0, 0)),
)
sample(
    f"{EXTENDED}13",
    then(pace(0.5, "rugby ball"), pull("redbone", 0.1, -1)),
    opposite=then(pace(2, "rugby ball"), pull("redbone", 0.1)),
    only_speed=pace(0.5, "rugby ball"),
    only_path=pull("redbone", 0.1, -1),
    wrong_object=then(pace(0.5, "rugby ball"), pull("rugby ball", 0.1, -1)),
)
sample(
    f"{EXTENDED}15",
    then(pace(1.5, "ananas", 0.3), pace(0.6, "maraca", 0.3)),
    opposite=then(pace(0.6, "ananas", 0.3), pace(1.5, "maraca", 0.3)),
    only_first=pace(1.5, "ananas", 0.3),
    only_second=pace(0.6, "maraca", 0.3),
    larger_threshold=then(pace(1.5, "ananas", 0.7), pace(0.6, "maraca", 0.5)),
)
sample(
    f"{EXTENDED}17",
    then(pull("cassette", 0.1, -1), constant(1.0)),
    then(drag("cassette", 0.1, -1), constant(1.0)),
    opposite=then(pull("cassette", 0.1), constant(0.0)),
    only_speed=constant(1.0),
    only_path=pull("cassette", 0.1, -1),
    wrong_number=then(pull("cassette", 0.1, -1), constant(0.5)),
    wrong_object=then(pull("king crab", 0.1, -1), constant(1.0)),
)
sample(
    f"{EXTENDED}19",
    helix(2, 0.08),
    helix(2, 0.1, grows=True),
    helix(3, 0.05, rise=-0.1),
    straight_on=line((0, 0.1, 0.1)),
    circle=helix(1, 0.08, rise=0.0),
    half_turn=helix(0.5, 0.1),
    zigzag_instead=zigzag(0.05, 6),
)
sample(
    f"{EXTENDED}20",
    then(pull("ptarmigan", 0.1, -1), pace(0.5)),
    opposite=then(pull("ptarmigan", 0.1), pace(2)),
    only_speed=pace(0.5),
    only_path=pull("ptarmigan", 0.1, -1),
    wrong_number=then(pull("ptarmigan", 0.1, -1), pace(0.75)),
    wrong_object=then(pull("dunlin", 0.1, -1), pace(0.5)),
)
sample(
    f"{EXTENDED}21",
    pace(2.0, "potpie", 0.3),
    opposite=pace(0.5, "potpie", 0.3),
    wrong_number=pace(1.4, "potpie", 0.3),
    everywhere=pace(2.0),
    wrong_object=pace(2.0, "Sydney silky", 0.3),
)
sample(f"{EXTENDED}23", resampled(80), resampled(60), opposite=resampled(20), path_instead=shift("up"))
sample(
    f"{EXTENDED}24",
    then(shift("left", 0.05), go_to("digital clock")),
    lambda rows, scene: tk.continue_to(shift("left", 0.06)(rows, scene), scene["digital clock"]),
    opposite=then(shift("right", 0.05), go_to("digital clock")),
    only_shift=shift("left", 0.05),
    only_clock=go_to("digital clock"),
    wrong_object=then(shift("left", 0.05), go_to("gyromitra")),
    jump=then(shift("left", 0.05), go_to("digital clock", 1)),
)
sample(
    f"{EXTENDED}26",
    then(pace(0.5, "rocker"), shift("up", 0.06)),
    opposite=then(pace(2, "rocker"), shift("down", 0.06)),
    only_speed=pace(0.5, "rocker"),
    only_path=shift("up", 0.06),
    everywhere=then(pace(0.5), shift("up", 0.06)),
    far_too_high=then(pace(0.5, "rocker"), shift("up", 0.6)),
)
sample(
    f"{EXTENDED}28",
    then(shift("down", 0.08), helix(3, 0.05)),
    then(shift("down", 0.08), helix(3, 0.08, grows=True)),
    opposite=then(shift("up", 0.08), helix(3, 0.05)),
    only_shift=shift("down", 0.08),
    only_spiral=helix(3, 0.05),
    wrong_number=then(shift("down", 0.08), helix(1, 0.05)),
)
sample(
    f"{EXTENDED}29",
    avoid(0.2, "lampshade", "sock"),
    avoid(0.25, "lampshade", "sock"),
    opposite=then(pull("lampshade", 0.1), pull("sock", 0.1)),
    too_little=avoid(0.12, "lampshade", "sock"),
    only_first=avoid(0.2, "lampshade"),
    only_second=avoid(0.2, "sock"),
)
_MIDPOINT = mid("Mergus serrator", "Japanese spaniel")
sample(
    f"{EXTENDED}30",
    end(0, to=_MIDPOINT, share=0.5),
    go_to(_MIDPOINT),
    jump=end(0, to=_MIDPOINT, share=0.01),
    wrong_object=end(0, to="Japanese spaniel", share=0.5),
    start_instead=end(0, row=0, to=_MIDPOINT, share=0.5),
)
sample(
    f"{EXTENDED}31",
    lambda rows, scene: tk.smooth(rows, 5.0),
    lambda rows, scene: tk.smooth(rows, 1.0),
    opposite=zigzag(0.04, 5),
    shift_instead=shift("up"),
    straight_away=lambda rows, scene: np.column_stack([np.linspace(rows[0, :3], rows[-1, :3] + 0.3, len(rows)), rows[:, 3]]),
)
sample(
    f"{EXTENDED}37",
    end(0, row=0, to="butternut squash"),
    lambda rows, scene: np.concatenate([[[*at(scene, "butternut squash"), rows[0, 3]]], rows]),
    end(0, row=0, to="butternut squash", share=0.01),
    goal_instead=end(0, to="butternut squash"),
    wrong_object=end(0, row=0, to="mud turtle"),
    whole_path=lambda rows, scene: shifted(rows, at(scene, "butternut squash") - rows[0, :3]),
)
sample(
    f"{EXTENDED}39",
    then(stop("lab coat", cut=True), end((0, 0, 0.06), row=0)),
    then(stop("lab coat", cut=False), end((0, 0, 0.06), row=0)),
    opposite=then(pace(2, "lab coat"), end((0, 0, -0.06), row=0)),
    only_start=end((0, 0, 0.06), row=0),
    only_stop=stop("lab coat", cut=True),
    wrong_object=then(stop("Bonasa umbellus", cut=False), end((0, 0, 0.06), row=0)),
)
sample(
    f"{EXTENDED}42",
    then(shift("up", 0.06), end((0.2, 0, 0), row=0)),
    opposite=then(shift("down", 0.06), end((-0.2, 0, 0), row=0)),
    only_up=shift("up", 0.06),
    only_start=end((0.2, 0, 0), row=0),
    wrong_number=then(shift("up", 0.06), end((0.1, 0, 0), row=0)),
    goal_instead=then(shift("up", 0.06), end((0.2, 0, 0))),
)
sample(
    f"{EXTENDED}44",
    end((0, 0, -0.1), row=0),
    opposite=end((0, 0, 0.1), row=0),
    goal_instead=end((0, 0, -0.1)),
    whole_path=shift("down"),
)
sample(
    f"{EXTENDED}45",
    zigzag(0.04, 6),
    zigzag(0.04, 4, "left"),
    then(resampled(120), zigzag(0.04, 12)),
    one_bend=zigzag(0.1, 80),
    shift_instead=shift("up"),
    smooth_instead=lambda rows, scene: tk.smooth(rows, 5.0),
)
sample(
    f"{EXTENDED}48",
    then(shift("front", 0.1), ramp(None, 0.0)),
    then(line((0, 0.2, 0)), ramp(None, 0.0, 0.3)),
    opposite=then(shift("back", 0.1), ramp(0.1, 1.0)),
    only_shift=shift("front", 0.1),
    only_speed=ramp(None, 0.0),
    not_to_zero=then(shift("front", 0.1), ramp(None, 0.5)),
)
sample(f"{EXTENDED}50", resampled(20), resampled(30), opposite=resampled(80), far_too_few=resampled(2))
sample(
    f"{EXTENDED}52",
    then(pull("hautbois", 0.25, -1), shift("up", metres=0.1)),
    then(shift("up", metres=0.1), pull("hautbois", 0.25, -1)),
    opposite=then(pull("hautbois", 0.2), shift("down", metres=0.1)),
    only_up=shift("up", metres=0.1),
    only_away=pull("hautbois", 0.15, -1),
    wrong_number=then(pull("hautbois", 0.3, -1), shift("up", metres=0.25)),
)
sample(
    f"{EXTENDED}53",
    same,
    go_to(mid("Yorkshire terrier", "milk can")),
    opposite=line((0.2, -0.2, 0.2)),
    wrong_object=go_to(mid("hautbois", "milk can")),
)
sample(
    f"{EXTENDED}57",
    zigzag(0.06, 10),
    zigzag(0.06, 20, "left"),
    shift_instead=shift("up"),
    one_bend=zigzag(0.1, 80),
)
sample(
    f"{EXTENDED}58",
    flipped((1, 2), 13, about_start=True),
    flipped((1,), 10, about_start=True),
    flipped((1, 2), 13, about_start=False),
    flipped((1,), 20, about_start=False),
    everything=flipped((1, 2), 40, about_start=False),
    other_axis=flipped((0,), 13, about_start=False),
    shift_instead=shift("up"),
)
nearer(f"{EXTENDED}60", "ringlet butterfly", 0.06)
sample(
    f"{EXTENDED}64",
    through(over("Gordon setter", 0.08), over("ribbed toad", 0.08)),
    opposite=through(over("Gordon setter", -0.1), over("ribbed toad", -0.1)),
    only_first=through(over("Gordon setter", 0.08)),
    wrong_direction=shift("down"),
)


def _rising(gain, along) -> Edit:
    def edit(rows, scene):
        x = along(rows)
        share = (x - x.min()) / np.ptp(x)
        return shifted(rows, (0, 0, 0.2 * size(rows)), gain(share))

    return edit


def _exponential(share):
    return np.expm1(3 * share) / np.expm1(3)


sample(
    f"{EXTENDED}66",
    _rising(_exponential, lambda rows: -rows[:, 0]),
    then(_rising(_exponential, lambda rows: np.arange(len(rows))), shift("left")),
    opposite=_rising(lambda share: -_exponential(share), lambda rows: -rows[:, 0]),
    to_the_right=_rising(_exponential, lambda rows: rows[:, 0]),
    linear=_rising(lambda share: share, lambda rows: -rows[:, 0]),
    constant=shift("up"),
)


def _averages(size_: int, repeat: bool, whole: bool = False) -> Edit:
    def edit(rows, scene):
        count = len(rows) - len(rows) % size_ if whole else len(rows)
        means = np.array([rows[i : i + size_].mean(axis=0) for i in range(0, count, size_)])
        return means[np.arange(len(rows)) // size_] if repeat else means

    return edit


sample(
    f"{EXTENDED}69",
    _averages(6, False),
    _averages(6, False, whole=True),
    _averages(6, True),
    wrong_number=_averages(5, False),
    resampled_instead=resampled(7),
    every_sixth=lambda rows, scene: rows[::6],
)


def _corners(factor: float) -> Edit:
    """Slow at the sharpest quarter of the bends and just before them, by a plain numpy measure."""

    def edit(rows, scene):
        step = np.diff(rows[:, :3], axis=0)
        unit = step / np.maximum(np.linalg.norm(step, axis=1), 1e-9)[:, None]
        bend = np.concatenate([[0.0], np.arccos(np.clip((unit[1:] * unit[:-1]).sum(axis=1), -1, 1)), [0.0]])
        sharp = bend >= np.quantile(bend, 0.75)
        weight = np.maximum.reduce([sharp, 0.7 * np.roll(sharp, -1), 0.4 * np.roll(sharp, -2)])
        new = rows.copy()
        new[:, 3] *= 1.0 + (factor - 1.0) * weight
        return new

    return edit


sample(f"{EXTENDED}71", _corners(0.4), opposite=_corners(2.0), everywhere=pace(0.5), path_instead=shift("up"))


def _inner(edit: Edit) -> Edit:
    """With the ends kept: what the edit does fades in and out."""

    def kept(rows, scene):
        new = edit(rows, scene)
        weight = np.clip(np.minimum(np.arange(len(rows)), np.arange(len(rows))[::-1]) / 5.0, 0, 1)[:, None]
        return rows * (1 - weight) + new * weight

    return kept


_CLUSTER = [-0.115, 0.105, 0.078]
sample(
    f"{EXTENDED}72",
    _inner(pull(_CLUSTER, 0.1)),
    _inner(drag(_CLUSTER, 0.1)),
    _inner(pull("French horn", 0.1)),
    opposite=_inner(pull(_CLUSTER, 0.1, -1)),
    ends_too=drag(_CLUSTER, 0.15),
    lonely_object=_inner(pull("go-kart", 0.15)),
)
sample(
    f"{EXTENDED}73",
    lambda rows, scene: np.column_stack([np.maximum(rows[:, :2], 0.0), rows[:, 2:]]),
    lambda rows, scene: shifted(rows, -np.minimum(rows[:, :3].min(axis=0), 0)),
    opposite=lambda rows, scene: np.column_stack([np.minimum(rows[:, :2], 0.0), rows[:, 2:]]),
    only_x=lambda rows, scene: np.column_stack([np.maximum(rows[:, :1], 0.0), rows[:, 1:]]),
    too_little=shift("right", 0.1),
)
sample(
    f"{EXTENDED}74",
    turned(-90, 2),
    turned(90, 0),
    turned(-90, 1),
    opposite=turned(90, 2),
    wrong_number=turned(-45, 2),
    shift_instead=shift("up"),
)

sample(
    f"{DRONE}2",
    pull("Person", 0.08),
    then(pull("Person", 0.08), line((0, -0.3, 0))),
    opposite=pull("Person", 0.08, -1),
    only_continuing=line((0, -0.3, 0)),
    wrong_object=pull("Cycle", 0.15),
)
sample(f"{DRONE}8", ramp(None, 0.0, 0.4), pace(0.5, (0.67, -0.19, 1.25), 0.9), opposite=ramp(None, 1.0, 0.4), start_instead=pace(0.5, (-1.42, -1.02, 0.0), 0.9))  # fmt: skip
sample(f"{DRONE}9", resampled(80), resampled(79), opposite=resampled(20), too_many=resampled(160), once_more=resampled(60))


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
        near = near[(near >= 0)]
        angle = np.linspace(0, 4 * np.pi, len(near))
        grow = radius * np.sin(np.linspace(0, np.pi, len(near)))
        fine[near, 0] += grow * np.cos(angle)
        fine[near, 1] += 0.0
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
_FLOOR = {"height": 2}
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
        new[: i + 1 if before else None, 3] = np.where(np.arange(len(new[: i + 1 if before else None])) >= i, value, new[: i + 1 if before else None, 3])
        if before:
            new[: i + 1, 3] = value
        return new

    return edit


sample(
    f"{GROUND}23",
    _constant_from("bed", 0.3),
    _constant_from("bed", 0.1),
    everywhere=constant(0.3),
    before_instead=_constant_from("bed", 0.3, before=True),
    wrong_object=_constant_from("piano", 0.3),
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
    only_second=through(over("remote_controller", 0.2)),
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
