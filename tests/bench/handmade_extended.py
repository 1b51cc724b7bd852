"""Hand-made adaptations of the extended subset, right and wrong ones."""

import numpy as np
from handmade import (
    DRONE,
    EXTENDED,
    Edit,
    at,
    avoid,
    constant,
    drag,
    end,
    flipped,
    go_to,
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
    same,
    sample,
    shift,
    shifted,
    size,
    stop,
    then,
    through,
    turned,
    zigzag,
)

from ovita import toolkit as tk

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
    everywhere=pace(1.5),
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
    lambda rows, scene: tk.smooth(rows, 10.0),
    opposite=zigzag(0.04, 5),
    shift_instead=shift("up"),
    straight_away=lambda rows, scene: np.column_stack(
        [np.linspace(rows[0, :3], rows[-1, :3] + 0.3, len(rows)), rows[:, 3]]
    ),
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
    then(shift("up", metres=0.1), shift("left", metres=0.25), shift("back", metres=0.25)),
    then(
        shift("up", metres=0.1),
        lambda rows, scene: shifted(
            rows, (-0.2, -0.2, 0), np.exp(-(((reach(rows, at(scene, "hautbois")) - 0.32) / 0.3) ** 2))
        ),
    ),
    opposite=then(pull("hautbois", 0.2), shift("down", metres=0.1)),
    only_up=shift("up", metres=0.1),
    only_away=pull("hautbois", 0.15, -1),
    wrong_number=then(shift("up", metres=0.3), shift("left", metres=0.2), shift("back", metres=0.3)),
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
    only_second=through(over("ribbed toad", 0.08)),
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
