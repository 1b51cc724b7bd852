"""For each kind of check one adaptation that must pass, and wrong ones that must fail."""

import numpy as np
from handmade import avoid, constant, end, helix, line, pace, pull, ramp, resampled, shift, shifted, stop, wait, zigzag
from scipy.interpolate import CubicSpline

from ovita import toolkit as tk
from ovita.measure import predicates as ck
from ovita.paths.scene import Scene, SceneObject

SCENE = Scene(
    (
        SceneObject("cup", np.array([0.5, 0.25, 0.1])),
        SceneObject("lamp", np.array([0.1, -0.3, 0.3])),
        SceneObject("box", np.array([0.9, -0.2, 0.0]), np.array([0.1, 0.1, 0.1])),
    )
)
CUP, LAMP = SCENE["cup"].position, SCENE["lamp"].position
UP = np.array([0.0, 0.0, 0.1])


def path(n=50):
    """An S-shaped path past the cup, one metre long, that speeds up and slows down."""
    t = np.linspace(0, 1, n)
    wave = 0.1 * np.sin(2 * np.pi * t) + 0.01 * np.sin(22 * np.pi * t)
    return np.column_stack([t, wave, 0.2 + 0.05 * t, 0.2 + 0.2 * np.sin(np.pi * t)])


ROWS = path()


def speeds(values):
    return lambda rows, scene: np.column_stack([rows[:, :3], values(np.linspace(0, 1, len(rows)))])


def trapezium(t):
    return np.clip(np.minimum(t, 1 - t) / 0.25, 0.1, 1.0)


def heights(f):
    return lambda rows, scene: shifted(rows, (0, 0, 1), f(np.linspace(0, 1, len(rows))))


def flattened(rows, scene):
    return np.column_stack([rows[:, :2], np.full(len(rows), 0.4), rows[:, 3]])


def through(point):
    return lambda rows, scene: tk.go_through(rows, np.asarray(point))


def scaled(factor):
    return lambda rows, scene: np.column_stack([CUP + factor * (rows[:, :3] - CUP), rows[:, 3]])


def about_up(degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return lambda rows, scene: np.column_stack([rows[:, :3] @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]), rows[:, 3]])


def mirrored_front(rows, scene):
    return np.column_stack([rows[:, 0], 0.3 - rows[:, 1], rows[:, 2:]])


def ring(turns):
    """Around the cup, from the waypoint nearest to it."""

    def edit(rows, scene):
        i = int(np.linalg.norm(rows[:, :3] - CUP, axis=1).argmin())
        spoke = rows[i, :2] - CUP[:2]
        angle = np.arctan2(*spoke[::-1]) + np.linspace(0, 2 * np.pi * turns, int(30 * turns))
        loop = CUP[:2] + np.linalg.norm(spoke) * np.column_stack([np.cos(angle), np.sin(angle)])
        return np.concatenate(
            [rows[: i + 1], np.column_stack([loop, np.tile(rows[i, 2:], (len(loop), 1))]), rows[i + 1 :]]
        )

    return edit


def local_helix(place, radius):
    """A widening and narrowing loop at the waypoint nearest to a place."""

    def edit(rows, scene):
        i = int(np.linalg.norm(rows[:, :3] - place, axis=1).argmin())
        t = np.linspace(0, 1, 40)
        r = radius * np.sin(np.pi * t)
        loop = rows[i, :3] + np.column_stack([0 * t, r * np.cos(4 * np.pi * t), r * np.sin(4 * np.pi * t)])
        return np.concatenate([rows[:i], np.column_stack([loop, np.full(40, rows[i, 3])]), rows[i:]])

    return edit


def straightened(rows, scene):
    new = rows.copy()
    new[:25, :3] = np.linspace(rows[0, :3], rows[24, :3], 25)
    return new


def reversed_rows(rows, scene):
    return np.column_stack([rows[::-1, :3], rows[:, 3]])


def averaged(size):
    return lambda rows, scene: np.array([rows[i : i + size].mean(axis=0) for i in range(0, len(rows), size)])


def splined(rows, scene):
    return CubicSpline(np.arange(len(rows)), rows)(np.linspace(0, len(rows) - 1, 300))


def jumping(rows, scene):
    return np.delete(rows, slice(10, 40), axis=0)


HALF = ck.first(fraction=0.5)
NEAR_CUP = ck.near("cup", 0.35)
TABLE = [
    (
        ck.moved(left=0.2),
        shift("left", metres=0.2),
        {
            "opposite": shift("right", metres=0.2),
            "number": shift("left", metres=0.3),
            "across": shift("up", metres=0.2),
            "askew": lambda r, s: shifted(r, (-0.2, 0.3, 0)),
        },
    ),
    (
        ck.moved("up", amount="little"),
        shift("up", metres=0.05),
        {"opposite": shift("down", metres=0.05), "too far": shift("up", metres=0.8)},
    ),
    (
        ck.moved(down=0.1, where=HALF),
        lambda r, s: tk.move(r, down=0.1, where=tk.first(r, fraction=0.5)),
        {"other half": lambda r, s: tk.move(r, down=0.1, where=tk.last(r, fraction=0.5))},
    ),
    (
        ck.closer("cup"),
        pull("cup", 0.08),
        {"opposite": pull("cup", 0.08, -1), "wrong object": pull("box", 0.08), "speed": pace(0.5)},
    ),
    (ck.closer("cup", by=0.1), pull("cup", 0, metres=0.1), {"number": pull("cup", 0, metres=0.04)}),
    (ck.closer("cup", amount="little"), pull("cup", 0.05), {"too much": pull("cup", 0, metres=0.2)}),
    (ck.farther("cup"), pull("cup", 0.08, -1), {"opposite": pull("cup", 0.08), "wrong object": pull("box", 0.08, -1)}),
    (ck.farther("cup", times=2.0), scaled(2.0), {"number": scaled(1.4), "opposite": scaled(0.5)}),
    (
        ck.min_distance("cup", 0.3),
        avoid(0.3, "cup"),
        {"number": avoid(0.22, "cup"), "wrong object": avoid(0.4, "lamp"), "opposite": pull("cup", 0.1)},
    ),
    (ck.min_distance("box", 0.3), avoid(0.4, "box"), {"opposite": pull("box", 0.1)}),
    (ck.max_distance("cup", 0.5), scaled(0.8), {"opposite": scaled(1.3)}),
    (ck.passes_through("cup"), through(CUP), {"opposite": pull("cup", 0.08, -1), "wrong object": through(LAMP)}),
    (
        ck.passes_between("lamp", "box"),
        through((0.5, -0.25, 0.15)),
        {"opposite": shift("front"), "wrong object": through(CUP)},
    ),
    (ck.passes_over("cup"), through(CUP + UP), {"under": through(CUP - UP), "wrong object": through(LAMP + UP)}),
    (ck.slower(), pace(0.6), {"opposite": pace(1.6)}),
    (ck.slower(factor=0.5), pace(0.5), {"number": pace(0.8)}),
    (
        ck.slower(where=NEAR_CUP, only=True),
        pace(0.5, "cup", 0.35),
        {"everywhere": pace(0.5), "opposite": pace(2.0, "cup", 0.35), "wrong object": pace(0.5, "box", 0.35)},
    ),
    (
        ck.slower(where=ck.near("cup"), only=True),
        pace(0.5, "cup"),
        {"everywhere": pace(0.5), "wrong object": pace(0.5, "box")},
    ),
    (
        ck.faster(where=NEAR_CUP, factor=1.5),
        pace(1.5, "cup", 0.35),
        {"number": pace(2.5, "cup", 0.35), "opposite": pace(0.6, "cup", 0.35)},
    ),
    (ck.faster(amount="much"), pace(1.6), {"too little": pace(1.1)}),
    (ck.constant_speed(0.3), constant(0.3), {"number": constant(0.4)}),
    (ck.monotone_speed("rising"), ramp(0.1, 0.5), {"opposite": ramp(0.5, 0.1), "constant": constant(0.3)}),
    (ck.monotone_speed("falling", to=0.0), speeds(lambda t: 0.5 * (1 - t**3)), {"not to it": ramp(0.5, 0.2)}),
    (ck.monotone_speed("falling", to=0.0, final=0.2), ramp(None, 0.0, 0.3), {"at once": speeds(lambda t: 0.3 + 0 * t)}),
    (
        ck.uniform_acceleration("rising"),
        ramp(0.1, 0.5),
        {"opposite": ramp(0.5, 0.1), "uneven": speeds(lambda t: 0.1 + 0.4 * t**6)},
    ),
    (
        ck.exponential_speed("rising"),
        speeds(lambda t: 0.05 * np.exp(3 * t)),
        {"straight": ramp(0.05, 1.0), "opposite": speeds(lambda t: np.exp(-3 * t))},
    ),
    (
        ck.trapezoidal_speed(),
        speeds(trapezium),
        {"opposite": speeds(lambda t: 1.1 - trapezium(t)), "triangle": speeds(lambda t: np.minimum(t, 1 - t))},
    ),
    (
        ck.stops(near="cup"),
        stop("cup", cut=False),
        {
            "only slower": pace(0.3, "cup"),
            "wrong place": stop([0.0, 0.0, 0.2], cut=False),
            "cut elsewhere": stop([0.95, 0.0, 0.2], cut=True),
        },
    ),
    (ck.stops(), ramp(None, 0.0, 0.2), {"opposite": pace(2.0)}),
    (
        ck.dwells(10, near="cup"),
        wait("cup", 10),
        {"number": wait("cup", 4), "wrong place": wait("start", 10), "only slower": pace(0.2, "cup")},
    ),
    (
        ck.start_moved("down"),
        end((0, 0, -0.1), row=0),
        {"opposite": end((0, 0, 0.1), row=0), "other end": end((0, 0, -0.1))},
    ),
    (
        ck.goal_moved(right=0.1),
        end((0.1, 0, 0)),
        {"opposite": end((-0.1, 0, 0)), "other end": end((0.1, 0, 0), row=0), "number": end((0.2, 0, 0))},
    ),
    (
        ck.starts_at("lamp"),
        end(0, row=0, to="lamp"),
        {"other end": end(0, to="lamp"), "wrong object": end(0, row=0, to="cup")},
    ),
    (
        ck.ends_at({"between": ["cup", "box"]}),
        end(0, to=(CUP + SCENE["box"].position) / 2),
        {"wrong object": end(0, to="cup")},
    ),
    (
        ck.growing("up", "right"),
        heights(lambda t: 0.2 * t),
        {"opposite": heights(lambda t: 0.2 * (1 - t)), "constant": shift("up")},
    ),
    (
        ck.growing("up", exponential=True),
        heights(lambda t: 0.2 * np.expm1(4 * t) / np.expm1(4)),
        {"straight": heights(lambda t: 0.2 * t)},
    ),
    (ck.never_beyond(back=0.0), shift("front", metres=0.2), {"opposite": shift("back", metres=0.2)}),
    (
        ck.level(0.4),
        flattened,
        {"shift": shift("up", metres=0.2), "aside": lambda r, s: shifted(flattened(r, s), (0.3, 0, 0))},
    ),
    (ck.extended(by=0.3), line((0.3, 0, 0)), {"number": line((0.6, 0, 0)), "shift": shift("right", metres=0.3)}),
    (ck.extended(up=0.2), line((0, 0, 0.2)), {"opposite": line((0, 0, -0.2))}),
    (
        ck.spiral(),
        helix(2, 0.06),
        {"straight": line((0.2, 0, 0)), "circle": helix(1, 0.06, rise=0.0), "half": helix(0.5, 0.06)},
    ),
    (ck.spiral(turns=3), helix(3, 0.06, grows=True), {"number": helix(1.5, 0.06, grows=True)}),
    (
        ck.spiral(near="cup", max_radius=0.1),
        local_helix(CUP, 0.1),
        {
            "too large": local_helix(CUP, 0.3),
            "wrong place": local_helix(np.array([1.0, 0, 0.25]), 0.1),
            "closer": pull("cup", 0.1),
        },
    ),
    (
        ck.circles("cup"),
        ring(1),
        {"number": ring(3), "closer": pull("cup", 0.1), "after the goal": line((-0.5, 0.5, 0))},
    ),
    (ck.zigzags(), zigzag(0.05, 6), {"one bend": zigzag(0.1, 100), "shift": shift("up")}),
    (
        ck.zigzags(amplitude=0.1),
        zigzag(0.1 / np.linalg.norm(np.ptp(ROWS[:, :3], axis=0)), 8),
        {"number": zigzag(0.03, 8)},
    ),
    (ck.smoother(), lambda r, s: tk.smooth(r, 10.0), {"opposite": zigzag(0.03, 5), "shift": shift("up")}),
    (ck.curvier(), zigzag(0.03, 5), {"opposite": lambda r, s: tk.smooth(r, 10.0), "shift": shift("up")}),
    (ck.finer(), splined, {"fewer": resampled(20)}),
    (ck.straight(HALF), straightened, {"curvier": zigzag(0.03, 5), "shift": shift("up")}),
    (
        ck.mirrored(["front"]),
        mirrored_front,
        {"shift": shift("front"), "other axis": lambda r, s: np.column_stack([1 - r[:, 0], r[:, 1:]])},
    ),
    (ck.rotated(90.0), about_up(90), {"opposite": about_up(-90), "number": about_up(45)}),
    (ck.reversed_part(), reversed_rows, {"mirrored": mirrored_front}),
    (ck.more_waypoints(factor=2.0), resampled(100), {"opposite": resampled(25), "number": resampled(150)}),
    (ck.fewer_waypoints(), resampled(30), {"opposite": resampled(70)}),
    (ck.group_averages(5), averaged(5), {"number": averaged(7), "resampled": resampled(10)}),
]
KEEPING = [
    (ck.same_path(), pace(0.5), {"shift": shift("up"), "cut": lambda r, s: r[:25]}),
    (ck.same_path(partly=True), lambda r, s: r[:25], {"shift": shift("up")}),
    (ck.shape_kept(), shift("up"), {"bent": pull("cup", 0.2)}),
    (ck.kept(ck.last(fraction=0.3)), lambda r, s: end((0.2, 0, 0), row=0)(r, s), {"whole": shift("up")}),
    (ck.speeds_kept(ck.outside(NEAR_CUP)), pace(0.5, "cup", 0.35), {"everywhere": pace(0.5)}),
    (ck.no_jumps(), resampled(40), {"jump": jumping}),
    (ck.gradual(), end((0.2, 0, 0), share=0.5), {"sudden": end((0.2, 0, 0), share=0.01)}),
    (ck.never_stops(), shift("up"), {"stopped": stop("cup", cut=False), "waiting": wait("cup", 10)}),
    (ck.finite(), shift("up"), {"far away": shift("up", metres=20.0)}),
]
COMBINED = [
    (
        ck.all_of(ck.moved("up"), ck.slower()),
        lambda r, s: pace(0.5)(shift("up")(r, s), s),
        {"first": shift("up"), "second": pace(0.5)},
    ),
    (ck.any_of(ck.moved("up"), ck.slower()), pace(0.5), {"opposite": pace(2.0)}),
]
