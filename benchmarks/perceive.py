"""How well perception finds things: random MuJoCo scenes with ground truth, one view and two, beside PCA.

    python benchmarks/perceive.py --scenes 200 --seed 2026

Half of the scenes are table-tops, half rooms. Depth gets noise of 2.5 mm z^2, holes and flying pixels at edges, blind
spots and millimetre steps. What is cut off by the picture, or hidden by more than half, is neither asked for nor
counted as invented. PCA, as in the paper, gets the renderer's own masks; ours finds its own. Renders are kept in
--cache; Ctrl-C prints what is measured so far.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial.transform import Rotation

from ovita.paths.scene import SceneObject, matrix
from ovita.perceive import View, perceive
from ovita.sim.render import backend

WIDE, HIGH, FOCAL = 640, 480, 580.0
TABLE = 0.74
COLOURS = {
    "red": (0.75, 0.1, 0.1),
    "green": (0.1, 0.55, 0.2),
    "blue": (0.1, 0.25, 0.75),
    "yellow": (0.9, 0.8, 0.1),
    "orange": (0.9, 0.45, 0.05),
    "purple": (0.45, 0.15, 0.6),
    "white": (0.93, 0.93, 0.93),
    "black": (0.06, 0.06, 0.06),
}


@dataclass(frozen=True)
class Truth:
    """A thing as it is: its kind, place [m], attitude, full size [m] and colour."""

    kind: str
    center: np.ndarray
    rotation: np.ndarray
    size: np.ndarray
    colour: str
    tilted: bool = False


@dataclass(frozen=True)
class Shot:
    """One rendered view: clean depth [m], colours, index of the thing at each pixel (-1 for none), camera to world."""

    rgb: np.ndarray
    depth: np.ndarray
    mask: np.ndarray
    pose: np.ndarray


@dataclass
class Tally:
    """What was measured over scenes."""

    asked: int = 0
    found: int = 0
    told: int = 0
    invented: int = 0
    center: list[float] = field(default_factory=list)
    size: list[float] = field(default_factory=list)
    yaw: list[float] = field(default_factory=list)
    tilt: list[float] = field(default_factory=list)
    kinds: list[bool] = field(default_factory=list)
    colours: list[bool] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    by_kind: dict[str, list[float]] = field(default_factory=dict)


def things(rng: np.random.Generator, room: bool) -> list[Truth]:
    """Three to seven things that stand apart on a table, or in a room."""
    placed: list[Truth] = []
    ground, reach = (0.0, (1.1, 0.9)) if room else (TABLE, (0.38, 0.28))
    wanted, gap = int(rng.integers(3, 8)), 0.12 if room else 0.03
    for _ in range(200):
        if len(placed) == wanted:
            break
        one = thing(rng, room, ground)
        spot = rng.uniform(-1, 1, 2) * reach
        one = Truth(one.kind, one.center + np.array([*spot, 0.0]), one.rotation, one.size, one.colour, one.tilted)
        if all(np.linalg.norm(spot - o.center[:2]) > footprint(one) + footprint(o) + gap for o in placed):
            placed.append(one)
    return placed


def footprint(one: Truth) -> float:
    """Radius of a thing seen from above [m]."""
    return float(np.linalg.norm(np.abs(one.rotation[:2]) @ one.size / 2))


def thing(rng: np.random.Generator, room: bool, ground: float) -> Truth:
    """A thing of random kind at the origin of the ground."""
    scale = 5.0 if room else 1.0
    kind = rng.choice(["box", "box", "flat", "cylinder", "cylinder", "lying", "sphere", "tilted"])
    turn = Rotation.from_euler("z", rng.uniform(0, 2 * np.pi))
    if kind == "sphere":
        size = np.full(3, rng.uniform(0.06, 0.14))
    elif kind in ("cylinder", "lying"):
        across = rng.uniform(0.05, 0.1)
        size = np.array([across, across, rng.uniform(0.08, 0.24)])
        turn = turn * Rotation.from_euler("y", np.pi / 2) if kind == "lying" else turn
    elif kind == "flat":
        size = np.array([rng.uniform(0.12, 0.22), rng.uniform(0.1, 0.18), rng.uniform(0.022, 0.04)])
    else:
        size = rng.uniform([0.05, 0.05, 0.05], [0.16, 0.14, 0.2])
    if kind == "tilted":
        turn = turn * Rotation.from_euler("yx", [rng.uniform(15, 40), rng.uniform(-10, 10)], degrees=True)
    size = size * scale
    shape = {"lying": "cylinder", "cylinder": "cylinder", "sphere": "sphere"}.get(str(kind), "box")
    rotation = turn.as_matrix()
    low = np.abs(rotation[2]) @ size / 2 if shape == "box" else size[0] / 2 if kind != "cylinder" else size[2] / 2
    colour = str(rng.choice(list(COLOURS)))
    return Truth(shape, np.array([0.0, 0.0, ground + low]), rotation, size, colour, kind == "tilted")


def camera(eye: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Camera to world, x right, y down, z towards the target."""
    z = (target - eye) / np.linalg.norm(target - eye)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = np.column_stack([x, np.cross(z, x), z]), eye
    return pose


def cameras(rng: np.random.Generator, room: bool) -> list[np.ndarray]:
    """Two views, from 50 to 120 degrees apart."""
    azimuth, turn = rng.uniform(0, 2 * np.pi), np.radians(rng.uniform(50, 120)) * rng.choice([-1, 1])
    away, rise = (
        (rng.uniform(2.6, 3.4), rng.uniform(1.4, 2.3)) if room else (rng.uniform(0.65, 0.9), rng.uniform(0.45, 0.8))
    )
    ground = 0.0 if room else TABLE
    target = np.array([*rng.uniform(-0.05, 0.05, 2), ground + (0.2 if room else 0.03)])
    angles = (azimuth, azimuth + turn)
    return [camera(np.array([away * np.cos(a), away * np.sin(a), ground + rise]), target) for a in angles]


def world(rng: np.random.Generator, truths: Sequence[Truth], room: bool):
    """The scene as a MuJoCo model: floor, walls or a table, things, lights."""
    import mujoco

    kinds = mujoco.mjtGeom
    spec = mujoco.MjSpec()
    spec.visual.global_.offwidth, spec.visual.global_.offheight = WIDE, HIGH
    spec.visual.map.znear, spec.visual.map.zfar = 0.01, 30.0
    spec.stat.extent = 3.0
    spec.visual.headlight.ambient, spec.visual.headlight.diffuse = (
        [rng.uniform(0.2, 0.45)] * 3,
        [rng.uniform(0.1, 0.4)] * 3,
    )
    glow = rng.uniform(0.35, 0.65) * np.array([1.0, rng.uniform(0.92, 1.0), rng.uniform(0.85, 1.0)])
    down = np.array([*rng.uniform(-0.6, 0.6, 2), -1.0])
    spec.worldbody.add_light(pos=[0, 0, 4], dir=down, type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, diffuse=glow)
    grey = rng.uniform(0.35, 0.75)
    spec.worldbody.add_geom(type=kinds.mjGEOM_PLANE, size=[8, 8, 1], rgba=[grey, grey * 0.95, grey * 0.88, 1])
    wall = rng.uniform(3.6, 4.5) if room else rng.uniform(1.4, 2.5)
    for sign, axis in ((1, 0), (-1, 0), (1, 1), (-1, 1)):
        half = np.array([0.05, 6.0, 1.5]) if axis == 0 else np.array([6.0, 0.05, 1.5])
        place = np.array([0.0, 0.0, 1.5])
        place[axis] = sign * wall * (1.0 if room else 1.5)
        spec.worldbody.add_geom(type=kinds.mjGEOM_BOX, size=half, pos=place, rgba=[0.8, 0.79, 0.75, 1])
    if not room:
        size = [rng.uniform(0.6, 0.8), rng.uniform(0.5, 0.6), 0.015]
        spec.worldbody.add_geom(type=kinds.mjGEOM_BOX, size=size, pos=[0, 0, TABLE - 0.015], rgba=[0.62, 0.47, 0.33, 1])
        for x, y in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            leg = [x * (size[0] - 0.05), y * (size[1] - 0.05), TABLE / 2 - 0.02]
            spec.worldbody.add_geom(type=kinds.mjGEOM_BOX, size=[0.025, 0.025, TABLE / 2 - 0.02], pos=leg)
    shapes = {"box": kinds.mjGEOM_BOX, "cylinder": kinds.mjGEOM_CYLINDER, "sphere": kinds.mjGEOM_SPHERE}
    for i, one in enumerate(truths):
        half = one.size / 2 if one.kind == "box" else [one.size[0] / 2, one.size[2] / 2, 0]
        quat = np.roll(Rotation.from_matrix(one.rotation).as_quat(), 1)
        shade = np.clip(np.array(COLOURS[one.colour]) + rng.uniform(-0.04, 0.04, 3), 0, 1)
        spec.worldbody.add_geom(
            name=f"thing/{i}", type=shapes[one.kind], size=half, pos=one.center, quat=quat, rgba=[*shade, 1]
        )
    return spec.compile()


def shoot(model, pose: np.ndarray, renderer) -> Shot:
    """Render colours, depth and masks from a pose."""
    import mujoco

    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    eye = mujoco.MjvCamera()
    eye.type = mujoco.mjtCamera.mjCAMERA_FREE
    forward = pose[:3, 2]
    eye.lookat, eye.distance = pose[:3, 3] + forward, 1.0
    eye.azimuth = np.degrees(np.arctan2(forward[1], forward[0]))
    eye.elevation = np.degrees(np.arcsin(forward[2]))
    model.vis.global_.fovy = np.degrees(2 * np.arctan(HIGH / 2 / FOCAL))
    names = {model.geom(i).id: int(model.geom(i).name.split("/")[1]) for i in range(model.ngeom) if model.geom(i).name}
    pictures = []
    for mode in (
        renderer.disable_depth_rendering,
        renderer.enable_depth_rendering,
        renderer.enable_segmentation_rendering,
    ):
        renderer.disable_depth_rendering()
        renderer.disable_segmentation_rendering()
        mode()
        renderer.update_scene(data, eye)
        pictures.append(renderer.render().copy())
    rgb, depth, seg = pictures
    mask = np.full(depth.shape, -1, dtype=np.int16)
    for geom, index in names.items():
        mask[(seg[..., 0] == geom) & (seg[..., 1] == int(mujoco.mjtObj.mjOBJ_GEOM))] = index
    return Shot(rgb, depth.astype(np.float32), mask, pose)


def rendered(seed: int, cache: Path) -> tuple[list[Truth], list[Shot]]:
    """The things and two shots of one scene, from the cache where they are."""
    rng = np.random.default_rng([seed, 15])
    room = bool(seed % 2)
    truths, poses = things(rng, room), cameras(rng, room)
    file = cache / f"{seed}.npz"
    if not file.exists():
        if sys.platform == "linux":
            os.environ.setdefault("MUJOCO_GL", backend())  # no screen is needed; to be set before mujoco is imported
        import mujoco

        model = world(rng, truths, room)
        renderer = mujoco.Renderer(model, HIGH, WIDE)
        shots = [shoot(model, pose, renderer) for pose in poses]
        renderer.close()
        stacks = {key: np.stack([getattr(shot, key) for shot in shots]) for key in ("rgb", "depth", "mask", "pose")}
        cache.mkdir(parents=True, exist_ok=True)
        np.savez_compressed(file, **stacks)
    kept = np.load(file)
    return truths, [Shot(*(kept[key][i] for key in ("rgb", "depth", "mask", "pose"))) for i in range(2)]


def spoiled(depth: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Depth as a camera gives it: noise, holes and flying pixels at edges, blind spots, steps of a millimetre."""
    z = depth.astype(float)
    z[z > 8.0] = np.nan
    around = [np.roll(z, shift, axis) for shift in (1, -1) for axis in (0, 1)]
    steps = np.abs(np.stack(around) - z)
    edge = np.where(np.isnan(steps), 0.0, steps).max(axis=0) > 0.02 * z
    noisy = z + 0.0025 * z**2 * rng.standard_normal(z.shape)
    chance = rng.random(z.shape)
    other = np.choose(rng.integers(0, 4, z.shape), around)
    share = rng.random(z.shape)
    noisy = np.where(edge & (chance < 0.2), share * z + (1 - share) * other, noisy)
    noisy[edge & (chance > 0.5)] = np.nan
    for _ in range(12):
        y, x, r = rng.integers(0, HIGH), rng.integers(0, WIDE), rng.integers(1, 6)
        noisy[max(y - r, 0) : y + r, max(x - r, 0) : x + r] = np.nan
    return np.asarray(np.round(noisy, 3))


def intrinsics() -> np.ndarray:
    return np.array([[FOCAL, 0.0, (WIDE - 1) / 2], [0.0, FOCAL, (HIGH - 1) / 2], [0.0, 0.0, 1.0]])


def view_of(shot: Shot, rng: np.random.Generator, off: float = 0.0) -> View:
    """What perception gets; `off` is the pose's error in millimetres and in tenths of a degree (one sigma)."""
    pose = shot.pose.copy()
    if off:
        pose[:3, 3] += 0.001 * off * rng.standard_normal(3)
        pose[:3, :3] = Rotation.from_rotvec(np.radians(0.1 * off) * rng.standard_normal(3)).as_matrix() @ pose[:3, :3]
    return View(spoiled(shot.depth, rng), intrinsics(), pose, shot.rgb)


def whole_pixels(one: Truth, pose: np.ndarray, stride: int = 4) -> float:
    """Pixels that a thing would have with nothing before it, inside or outside of the picture."""
    rows, columns = np.mgrid[-HIGH // 2 : 3 * HIGH // 2 : stride, -WIDE // 2 : 3 * WIDE // 2 : stride]
    rays = np.stack([(columns - (WIDE - 1) / 2) / FOCAL, (rows - (HIGH - 1) / 2) / FOCAL, np.ones(rows.shape)], -1)
    rays = rays.reshape(-1, 3) @ pose[:3, :3].T
    return float(hits(one, pose[:3, 3], rays).sum() * stride**2)


def hits(one: Truth, eye: np.ndarray, rays: np.ndarray) -> np.ndarray:
    """Whether rays from the eye meet a thing."""
    a, d = (eye - one.center) @ one.rotation, rays @ one.rotation
    half = one.size / 2
    with np.errstate(divide="ignore", invalid="ignore"):
        near, far = np.sort([(-half - a) / d, (half - a) / d], axis=0)
    if one.kind == "box":
        return np.asarray(near.max(axis=1) <= far.min(axis=1))
    n = 3 if one.kind == "sphere" else 2
    aa, ab = (d[:, :n] ** 2).sum(axis=1), d[:, :n] @ a[:n]
    under = ab**2 - aa * (a[:n] @ a[:n] - half[0] ** 2)
    root = np.sqrt(np.maximum(under, 0.0)) / aa
    into, out = -ab / aa - root, -ab / aa + root
    if n == 2:
        into, out = np.maximum(into, near[:, 2]), np.minimum(out, far[:, 2])
    return np.asarray((under > 0) & (into <= out))


def asked_for(truths: Sequence[Truth], shots: Sequence[Shot]) -> list[bool]:
    """Which things a view shows well: at least 150 pixels, half of the thing, not cut by the border."""
    good = []
    for i, one in enumerate(truths):
        ok = False
        for shot in shots:
            mine = shot.mask == i
            border = mine[[0, -1]].any() or mine[:, [0, -1]].any()
            ok |= bool(not border and mine.sum() >= 150 and mine.sum() >= 0.5 * whole_pixels(one, shot.pose))
        good.append(ok)
    return good


def by_pca(truths: Sequence[Truth], shots: Sequence[Shot], views: Sequence[View]) -> list[SceneObject | None]:
    """Centres, axes and extents by principal components of the masked points, as in the paper."""
    boxes: list[SceneObject | None] = []
    for i in range(len(truths)):
        pairs = zip(views, shots, strict=True)
        cloud = np.concatenate([view.points[(shot.mask == i) & view.seen] for view, shot in pairs])
        if len(cloud) < 60:
            boxes.append(None)
            continue
        turn = np.linalg.svd(cloud - cloud.mean(axis=0), full_matrices=False)[2].T
        turn[:, 2] *= np.sign(np.linalg.det(turn))
        local = cloud @ turn
        low, high = np.percentile(local, [1, 99], axis=0)
        quat = np.roll(Rotation.from_matrix(turn).as_quat(), 1)
        boxes.append(SceneObject(f"thing {i}", turn @ ((low + high) / 2), high - low, quat))
    return boxes


def errors(one: Truth, seen: SceneObject) -> tuple[float, float, float, float]:
    """Of centre [m], size [m, mean of three edges], yaw [deg] and attitude [deg], axes matched as well as they go."""
    center = float(np.linalg.norm(seen.position - one.center))
    turn, size = matrix(seen.orientation), seen.size
    if one.kind == "sphere":
        return center, float(np.abs(np.sort(size) - np.sort(one.size)).mean()), np.nan, np.nan
    order = linear_sum_assignment(-np.abs(one.rotation.T @ turn))[1]
    if one.kind == "cylinder":
        along = int(np.abs(one.rotation[:, 2] @ turn).argmax())
        rest = [i for i in range(3) if i != along]
        off = np.abs([size[rest[0]] - one.size[0], size[rest[1]] - one.size[1], size[along] - one.size[2]])
        angle = np.degrees(np.arccos(min(1.0, abs(one.rotation[:, 2] @ turn[:, along]))))
        return center, float(off.mean()), np.nan, float(angle)
    off = float(np.abs(size[order] - one.size).mean())
    cosines = np.abs(np.einsum("ij,ij->j", one.rotation, turn[:, order]))
    worst = float(np.degrees(np.arccos(np.clip(cosines.min(), -1, 1))))
    mine, theirs = (np.degrees(np.arctan2(r[1], r[0])) for r in (one.rotation[:, 0], turn[:, order[0]]))
    yaw = abs((theirs - mine + 90) % 180 - 90)
    return center, off, np.nan if one.tilted else yaw, worst if one.tilted else np.nan


def paired(truths: Sequence[Truth], seen: Sequence[SceneObject]) -> list[tuple[int, int]]:
    """Things and findings that belong together: centres closer than half the thing's diagonal."""
    if not truths or not seen:
        return []
    gap = np.linalg.norm(
        np.array([s.position for s in seen])[None] - np.array([t.center for t in truths])[:, None], axis=2
    )
    limit = np.array([np.linalg.norm(t.size) / 2 for t in truths])[:, None]
    cost = np.where(gap < limit, gap / limit, 10.0)
    return [(int(i), int(j)) for i, j in zip(*linear_sum_assignment(cost), strict=True) if cost[i, j] < 10.0]


def count(tally: Tally, truths: Sequence[Truth], asked: Sequence[bool], seen: Sequence[SceneObject]) -> None:
    """Enter one scene."""
    pairs = paired(truths, seen)
    tally.asked += sum(asked)
    tally.found += sum(asked[i] for i, _ in pairs)
    tally.told += len(seen)
    tally.invented += len(seen) - len(pairs)
    for i, j in pairs:
        if not asked[i]:
            continue
        center, size, yaw, tilt = errors(truths[i], seen[j])
        tally.center.append(center)
        tally.size.append(size)
        tally.yaw += [yaw] if np.isfinite(yaw) else []
        tally.tilt += [tilt] if np.isfinite(tilt) else []
        tally.kinds.append(seen[j].extra.get("shape") == truths[i].kind)
        tally.colours.append(seen[j].extra.get("colour") == truths[i].colour)
        kind = "tilted box" if truths[i].tilted else truths[i].kind
        tally.by_kind.setdefault(kind, []).append(center)


def row(name: str, tally: Tally) -> str:
    """One row of the table."""
    cells = [
        *(name, _spread(tally.center, 1000), _spread(tally.size, 1000), _spread(tally.yaw), _spread(tally.tilt)),
        *(_share(tally.found, tally.asked), _share(tally.invented, tally.told)),
        *(_share(sum(tally.kinds), len(tally.kinds)), _share(sum(tally.colours), len(tally.colours))),
        f"{np.median(tally.seconds):.2f}" if tally.seconds else "-",
    ]
    return "| " + " | ".join(cells) + " |"


def _spread(values: Sequence[float], scale: float = 1.0) -> str:
    if not values:
        return "-"
    middle, most = scale * np.percentile(values, [50, 90])
    return f"{middle:.1f} ({most:.1f})"


def _share(part: int, whole: int) -> str:
    return f"{100 * part / max(whole, 1):.1f} ({part}/{whole})"


HEAD = """| method | centre mm | size mm | yaw deg | axis deg | found % | invented % | shape % | colour % | CPU s/view |
|---|---|---|---|---|---|---|---|---|---|
(median and, in brackets, the 90th percentile; shares with their counts)"""


def scene(seed: int, given: argparse.Namespace, tallies: Mapping[str, Tally], per_place: Mapping[str, Tally]) -> None:
    """Measure one scene, with one view and with two."""
    truths, shots = rendered(seed, given.cache)
    rng = np.random.default_rng(seed)
    views = [view_of(shot, rng, given.pose_error) for shot in shots]
    for n in (1, 2):
        label = f"{n} view{'s' * (n > 1)}"
        asked = asked_for(truths, shots[:n])
        began = time.process_time()
        seen = perceive([View(v.depth, v.intrinsics, v.pose, v.rgb) for v in views[:n]]).things
        spent = (time.process_time() - began) / n
        place = per_place[f"ovita, {label}, {'rooms' if seed % 2 else 'table-tops'}"]
        for tally in (tallies[f"ovita, {label}"], place):
            tally.seconds.append(spent)
            count(tally, truths, asked, seen)
        boxes = by_pca(truths, shots[:n], views[:n])
        count(tallies[f"PCA, {label}"], truths, asked, [b for b in boxes if b is not None])


def main(argv: Sequence[str] | None = None) -> dict[str, Tally]:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--cache", type=Path, default=Path("/tmp/ovita-perceive"))
    parser.add_argument("--first", type=int, default=0, help="number of the first scene")
    parser.add_argument("--pose-error", type=float, default=0.0, help="of the cameras [mm, and tenths of a degree]")
    parser.add_argument("--kinds", action="store_true", help="also the centre error by kind of thing")
    given = parser.parse_args(argv)
    tallies = {f"{who}, {n} view{'s' * (n > 1)}": Tally() for who in ("ovita", "PCA") for n in (1, 2)}
    per_place = {f"ovita, {n} view{'s' * (n > 1)}, {p}": Tally() for n in (1, 2) for p in ("table-tops", "rooms")}
    done = 0
    try:
        for i in range(given.first, given.first + given.scenes):
            scene(given.seed * 100_000 + i, given, tallies, per_place)
            done += 1
    except KeyboardInterrupt:
        print("stopped")
    print(f"{done} scenes of seed {given.seed}")
    print(HEAD)
    for name, tally in {**tallies, **per_place}.items():
        print(row(name, tally))
    if given.kinds:
        for name, tally in tallies.items():
            print(name, {k: f"{1000 * np.median(v):.1f} mm of {len(v)}" for k, v in tally.by_kind.items()})
    return tallies


if __name__ == "__main__":
    main()
