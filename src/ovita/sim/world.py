"""The simulator's world: a robot on its base, the floor, the objects of a scene, and motions to draw."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import cycle, pairwise
from typing import Any, Literal

import numpy as np

from ovita.errors import RobotError
from ovita.limits.problem import is_support
from ovita.paths.robot import Box, Robot, Shell
from ovita.paths.scene import Scene, SceneObject, matrix
from ovita.paths.trajectory import Array, nlerp
from ovita.sim.model_files import add_tip, make_arm, read_spec
from ovita.sim.models import ArmLimits, RobotModel, Tip, mujoco
from ovita.sim.placement import Base

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Color = tuple[float, float, float, float]


@dataclass(frozen=True)
class Shape:
    """A primitive shape that is fixed to a body.

    Args:
        body: Index of the body in `Motion.bodies`.
        kind: A box; a sphere; or a cylinder, or capsule, along its own z axis.
        size: Box: full edge lengths. Sphere: (radius, 0, 0). Cylinder: (radius, length, 0). Capsule: (radius, length of
            the cylindrical part, 0). All [m].
        position, wxyz: In the body's frame: (3,) [m], and a unit quaternion.
        rgba: Colour, 0..1 each.
    """

    body: int
    kind: Literal["box", "sphere", "cylinder", "capsule"]
    size: Vector
    position: Vector
    wxyz: Quaternion
    rgba: Color


@dataclass(frozen=True)
class Motion:
    """Poses of a robot's bodies over time, in the scene's own coordinates.

    Args:
        bodies: Their B names.
        times: (T,) of the simulated motion [s], ascending from 0, evenly spaced but for the last.
        positions: (T, B, 3) [m].
        wxyz: (T, B, 4) unit quaternions.
        waypoints: (T,) the place on the trajectory, counted in waypoints: 2.5 is midway between waypoints 2 and 3.
        asked: (T,) the time at which the trajectory itself is at that place [s]; ascending, and the same as `times`
            where the robot keeps up.
        tip: (T, 3) the point of the robot that follows the trajectory [m].
    """

    bodies: tuple[str, ...]
    times: Array
    positions: Array
    wxyz: Array
    waypoints: Array
    asked: Array
    tip: Array
    shapes: tuple[Shape, ...]

    @property
    def duration(self) -> float:
        """[s]."""
        return float(self.times[-1])

    def at(self, time: float, *, clock: Literal["robot", "trajectory"] = "robot") -> tuple[Array, Array]:
        """Positions (B, 3) [m] and quaternions (B, 4) wxyz at one time [s], interpolated; held at both ends.

        The clock "trajectory" counts the time of the trajectory's own law, as a playhead on the trajectory does.
        """
        frames = np.arange(len(self.times), dtype=float)
        source = np.interp([time], self.times if clock == "robot" else self.asked, frames)
        low = int(source[0])
        pair = slice(low, min(low + 2, len(frames)))
        share = source - low
        positions = self.positions[pair]
        place = positions[0] + share[0] * (positions[-1] - positions[0])
        turns = np.array([nlerp(self.wxyz[pair, b], share)[0] for b in range(len(self.bodies))])
        return place, turns


PREFIX = "robot/"
BOX_GROUP = 4
"""Group of a workspace's box; a picture shows its edges instead, since it is often larger than what is to be seen."""

_OPTIONS = ("timestep", "integrator", "cone", "impratio", "gravity", "density", "viscosity", "iterations", "tolerance")
_COLORS = (
    *((0.36, 0.6, 0.85), (0.45, 0.7, 0.42), (0.8, 0.5, 0.6)),
    *((0.62, 0.55, 0.8), (0.85, 0.68, 0.35), (0.4, 0.7, 0.7)),
)


@dataclass(frozen=True)
class SimWorld:
    """A compiled world.

    Args:
        tip: The site that follows the trajectory.
        objects: Name of the scene's object by geom.
        ground: Its height [m].
        rolls: Whether the robot is meant to touch the floor.
        stand: Position and quaternion (7,) of the robot's base; at the origin for robots that move about.
    """

    model: Any
    tip: int
    bodies: tuple[int, ...]
    names: tuple[str, ...]
    objects: dict[int, str]
    floor: int
    ground: float
    rolls: bool
    robot: str
    spec: Any
    stand: Array

    @property
    def joints(self) -> tuple[str, ...]:
        """The names of the robot's joints."""
        return tuple(self.model.joint(j).name.removeprefix(PREFIX) for j in range(self.model.njnt))

    def shoulder(self) -> tuple[int, float, float]:
        """Of an arm: its shoulder, the shoulder's height and the arm's length [m].

        The shoulder is the second joint, or the first of an arm whose first two axes are parallel.
        """
        data = mujoco.MjData(self.model)
        mujoco.mj_kinematics(self.model, data)
        mujoco.mj_comPos(self.model, data)
        joint = int(self.model.njnt > 1 and abs(data.xaxis[0] @ data.xaxis[1]) < 0.9)
        anchors = [*(data.xanchor[j] for j in range(joint, self.model.njnt)), data.site_xpos[self.tip]]
        reach = sum(float(np.linalg.norm(b - a)) for a, b in pairwise(anchors))
        return joint, float(data.xanchor[joint, 2]), reach

    def check_free(self, robot: RobotModel) -> None:
        """Check that the robot moves about freely.

        Raises:
            RobotError: If its first joint is not a free joint.
        """
        if self.model.njnt < 1 or self.model.jnt_type[0] != 0:
            raise RobotError(f"{robot.model}: a {robot.controller} needs a free joint at its first body")

    def actuator(self, robot: RobotModel, name: str) -> int:
        """The index of an actuator.

        Raises:
            RobotError: If there is none of that name.
        """
        try:
            return int(self.model.actuator(PREFIX + name).id)
        except KeyError:
            raise RobotError(f"{robot.model}: has no actuator {name!r}") from None

    def link(self, geom: int) -> str:
        """The name of the robot's body that a geom belongs to."""
        return str(self.model.body(int(self.model.geom_bodyid[geom])).name).removeprefix(PREFIX)

    def shapes(self) -> tuple[Shape, ...]:
        """The robot's visual shapes; meshes become bounding boxes."""
        owners = enumerate(self.model.geom_bodyid.tolist())
        seen = [(g, b) for g, b in owners if b in self.bodies and self.model.geom_rgba[g, 3] > 0]
        return tuple(_shape(self.model, geom, self.bodies.index(body)) for geom, body in seen)


def build(
    robot: RobotModel, scene: Scene, base: Base, ground: float, *, solid: bool = False, workspace: Robot | None = None
) -> SimWorld:
    """Put a robot and a scene into one world.

    Scene, workspace and the height of the floor [m] are in the simulator's coordinates; robots that move about ignore
    the base. Objects that are not solid are detected in contact but not felt.

    Raises:
        RobotError: If the model cannot be loaded, or has no such tip.
    """
    child = _load(robot)
    world = mujoco.MjSpec()
    world.modelname = robot.name
    for key in _OPTIONS:
        setattr(world.option, key, getattr(child.option, key))
    fixed, rolls = robot.controller == "arm", robot.controller == "rover"
    stood = base if fixed else Base()
    stand = np.array([*stood.position, np.cos(0.5 * stood.yaw), 0.0, 0.0, np.sin(0.5 * stood.yaw)])
    frame = world.worldbody.add_frame(pos=stand[:3], quat=stand[3:])
    world.attach(child, frame=frame, prefix=PREFIX)
    _furnish(world, base if fixed else None, ground)
    bulky = {f"object/{i}": item for i, item in enumerate(scene) if float(np.prod(item.size)) > 0}
    colors = {f"object/{i}": color for i, color in zip(range(len(scene)), cycle(_COLORS), strict=False)}
    for name, item in bulky.items():
        felt = not (rolls and is_support(item))  # a rover stands on the simulator's own floor, not on supports
        _add_object(world, name, item, colors[name], solid=solid, felt=felt)
    _show(world, None if workspace is None else workspace.workspace)
    model, tip = _compiled(world, robot)
    names = {i: model.body(i).name for i in range(model.nbody)}
    own = {i: name.removeprefix(PREFIX) for i, name in names.items() if name.startswith(PREFIX)}
    found = {model.geom(name).id: item.name for name, item in bulky.items()}
    whose = tuple(own), tuple(own.values()), found
    return SimWorld(model, tip, *whose, model.geom("floor").id, ground, rolls, robot.name, world, stand)


def _compiled(world: Any, robot: RobotModel) -> tuple[Any, int]:
    """MuJoCo's model of a world, and the site of the robot's tip."""
    try:
        model = world.compile()
    except ValueError as error:
        raise RobotError(f"{robot.model}: cannot be compiled: {str(error).splitlines()[0]}") from None
    name = "tip" if isinstance(robot.tip, Tip) else robot.tip
    tip = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, PREFIX + name)
    if tip < 0:
        raise RobotError(f"{robot.model}: has no site {name!r} for the tip")
    return model, tip


def _load(robot: RobotModel) -> Any:
    spec = read_spec(robot.model)
    if isinstance(robot.limits, ArmLimits):
        make_arm(spec, robot)
    elif isinstance(robot.tip, Tip):
        add_tip(spec, robot.model, robot.tip)
    return spec


def _furnish(world: Any, base: Base | None, ground: float) -> None:
    """Light, sky, the floor, and a pedestal where an arm stands above it."""
    kinds = mujoco.mjtGeom
    world.visual.global_.offwidth, world.visual.global_.offheight = 1920, 1080
    for light, level in (("ambient", 0.45), ("diffuse", 0.35), ("specular", 0.1)):
        setattr(world.visual.headlight, light, [level] * 3)
    above = {"pos": [0, 0, ground + 6], "dir": [0.2, 0.3, -1], "diffuse": [0.45] * 3}
    world.worldbody.add_light(type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, **above)
    checker, flat = mujoco.mjtBuiltin.mjBUILTIN_CHECKER, mujoco.mjtTexture.mjTEXTURE_2D
    grey = {"rgb1": [0.87, 0.88, 0.9], "rgb2": [0.8, 0.82, 0.85]}
    world.add_texture(name="tiles", type=flat, builtin=checker, width=256, height=256, **grey)
    tiles = world.add_material(name="tiles", texrepeat=[1, 1], texuniform=True, reflectance=0.0)
    tiles.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = "tiles"
    sky = world.add_texture(name="sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX, width=64, height=384)
    sky.builtin = mujoco.mjtBuiltin.mjBUILTIN_GRADIENT
    sky.rgb1, sky.rgb2 = [1.0, 1.0, 1.0], [0.93, 0.95, 0.98]
    floor = world.worldbody.add_geom(name="floor", type=kinds.mjGEOM_PLANE, size=[0, 0, 1], pos=[0, 0, ground])
    floor.material = "tiles"
    if base is not None and base.z - ground > 0.01:
        tall = 0.5 * (base.z - ground)
        look = {"rgba": [0.55, 0.57, 0.6, 1], "contype": 0, "conaffinity": 0}
        place, size = [base.x, base.y, ground + tall], [0.13, 0.13, tall]
        world.worldbody.add_geom(type=kinds.mjGEOM_BOX, size=size, pos=place, **look)


def _add_object(world: Any, name: str, item: SceneObject, color: Vector, *, solid: bool, felt: bool) -> None:
    body = world.worldbody.add_body(name=name, pos=item.position, quat=item.orientation)
    geom = body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_BOX, size=0.5 * item.size)
    geom.rgba, geom.margin, geom.gap = ([*color, 1.0], 0.0, 0.0) if solid else ([*color, 0.85], -10.0, 10.0)
    if not felt:
        geom.contype = geom.conaffinity = 0


def _show(world: Any, space: Box | Shell | None) -> None:
    """Show a workspace as a transparent body that touches nothing."""
    if space is None:
        return
    look: dict[str, Any] = {"name": "workspace", "rgba": [0.2, 0.5, 0.9, 0.05], "contype": 0, "conaffinity": 0}
    if isinstance(space, Box):
        low, high = np.array(space.lower), np.array(space.upper)
        look |= {"type": mujoco.mjtGeom.mjGEOM_BOX, "group": BOX_GROUP, "pos": 0.5 * (low + high)}
        look["size"] = np.maximum(0.5 * (high - low), 1e-3)
    else:
        look |= {"type": mujoco.mjtGeom.mjGEOM_SPHERE, "size": [space.r_max, 0, 0], "pos": space.center}
    world.worldbody.add_geom(**look)


def _shape(model: Any, geom: int, body: int) -> Shape:
    kind, size = mujoco.mjtGeom(model.geom_type[geom]), model.geom_size[geom]
    place, turn = model.geom_pos[geom], model.geom_quat[geom]
    name, scale = _SCALES.get(kind.name, ("box", (2.0, 2.0, 2.0)))
    if name == "box" and kind != mujoco.mjtGeom.mjGEOM_BOX:
        place, size = place + matrix(turn) @ model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
    looks: list[Any] = [tuple(map(float, row)) for row in (size * scale, place, turn, model.geom_rgba[geom])]
    return Shape(body, name, *looks)


_SCALES: dict[str, tuple[Any, Vector]] = {
    "mjGEOM_SPHERE": ("sphere", (1.0, 0.0, 0.0)),
    "mjGEOM_CYLINDER": ("cylinder", (1.0, 2.0, 0.0)),
    "mjGEOM_CAPSULE": ("capsule", (1.0, 2.0, 0.0)),
}
