"""Offscreen rendering: the OpenGL that works here, and the looks of robots from the MuJoCo Menagerie."""

from __future__ import annotations

import ctypes
import os
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from ovita.errors import OvitaError
from ovita.paths.trajectory import Array
from ovita.sim.models import mujoco
from ovita.sim.world import PREFIX, SimWorld

REMEDY = (
    "no offscreen OpenGL works here, so no video can be made; install one of the Debian packages libegl1 (EGL) and "
    "libosmesa6 (OSMesa), or simulate without --video"
)


class NoRenderer(OvitaError):
    """This machine cannot render without a screen."""

    def __init__(self, detail: str = "") -> None:
        super().__init__(REMEDY + (f" ({detail})" if detail else ""))


def backend() -> str:
    """Which OpenGL is used: what MUJOCO_GL says, else the first of EGL and OSMesa that works, else "disable"."""
    said = os.environ.get("MUJOCO_GL", "").lower().strip()
    if said in ("disable", "disabled", "off", "false", "0"):
        return "disable"
    if said in ("egl", "osmesa", "glfw"):
        return said
    if sys.platform != "linux":
        return "native"
    return "egl" if egl_works() else "osmesa" if osmesa_works() else "disable"


def egl_works() -> bool:
    """Whether EGL is installed and one of its devices can be used."""
    try:
        egl = ctypes.CDLL("libEGL.so.1")
    except OSError:
        return False
    egl.eglGetProcAddress.restype = ctypes.c_void_p
    query, display = (egl.eglGetProcAddress(name) for name in (b"eglQueryDevicesEXT", b"eglGetPlatformDisplayEXT"))
    if not query or not display:
        return False
    devices, count = (ctypes.c_void_p * 16)(), ctypes.c_int(0)
    list_devices = ctypes.CFUNCTYPE(ctypes.c_uint, ctypes.c_int, ctypes.c_void_p, ctypes.c_void_p)(query)
    if not list_devices(16, ctypes.byref(devices), ctypes.byref(count)):
        return False
    open_display = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_uint, ctypes.c_void_p, ctypes.c_void_p)(display)
    egl.eglInitialize.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p]
    device_platform = 0x313F
    for device in devices[: count.value]:
        opened = open_display(device_platform, device, None)
        if opened and egl.eglInitialize(opened, None, None):
            return True
    return False


def osmesa_works() -> bool:
    """Whether OSMesa is installed."""
    for name in ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so"):
        try:
            ctypes.CDLL(name)
        except OSError:
            continue
        return True
    return False


class Renderer:
    """Draws a MuJoCo model without a screen.

    Unlike MuJoCo's own renderer it does not matter whether MuJoCo was imported before the OpenGL was chosen.

    Args:
        model: MuJoCo's model, whose offscreen buffer is at least as large as the picture.
        width, height: [pixels].

    Raises:
        NoRenderer: If no offscreen OpenGL works.
    """

    def __init__(self, model: Any, width: int, height: int) -> None:
        self._model = model
        self._gl = _context(width, height)
        self._gl.make_current()
        try:
            font = mujoco.mjtFontScale.mjFONTSCALE_100 if width > 500 else mujoco.mjtFontScale.mjFONTSCALE_50
            self._context = mujoco.MjrContext(model, font)
        except mujoco.FatalError as error:
            raise NoRenderer(str(error)) from None
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        self.scene = mujoco.MjvScene(model, maxgeom=4000)
        self.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0
        self._option = mujoco.MjvOption()
        self._size = width, height

    def update(self, data: Any, camera: Any) -> None:
        """Take the bodies of the model as they are in `data`; more geoms may then be added to `scene`."""
        catch = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(self._model, data, self._option, mujoco.MjvPerturb(), camera, catch, self.scene)

    def render(self, size: tuple[int, int] | None = None) -> np.ndarray[Any, np.dtype[np.uint8]]:
        """Draw `scene`: (H, W, 3), of the renderer's size or a smaller one (width, height)."""
        width, height = size or self._size
        area, picture = mujoco.MjrRect(0, 0, width, height), np.empty((height, width, 3), dtype=np.uint8)
        self._gl.make_current()
        mujoco.mjr_render(area, self.scene, self._context)
        mujoco.mjr_readPixels(picture, None, area, self._context)
        return picture[::-1].copy()

    def close(self) -> None:
        """Free the OpenGL context."""
        self._gl.make_current()
        self._context.free()
        self._gl.free()


def _context(width: int, height: int) -> Any:
    chosen = backend()
    if chosen == "disable":
        raise NoRenderer
    home = "mujoco.gl_context" if chosen == "native" else f"mujoco.{chosen}"
    try:
        return import_module(home).GLContext(width, height)
    except (RuntimeError, ImportError, AttributeError, OSError) as error:
        raise NoRenderer(f"{chosen}: {str(error).splitlines()[0]}") from None


FILES = {"iiwa": ("kuka_iiwa_14", "iiwa14.xml"), "crazyflie": ("bitcraze_crazyflie_2", "cf2.xml")}
"""Folder and file of the Menagerie, whose joints mean the same as those of the shipped model."""

LOOK = "look/"


def find(robot: str) -> Path | None:
    """The Menagerie's model of a robot: below MENAGERIE_ROOT, or in the cache of the package mujoco-menagerie."""
    if robot not in FILES:
        return None
    folder, file = FILES[robot]
    cache = os.environ.get("MENAGERIE_CACHE_DIR") or os.path.join(
        os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache", "mujoco_menagerie"
    )
    places = sorted((Path(cache) / "models").glob(f"{folder}-*"))
    if root := os.environ.get("MENAGERIE_ROOT"):
        places.insert(0, Path(root) / folder)
    return next((place / file for place in places if (place / file).is_file()), None)


def visual_model(stage: SimWorld) -> Any:
    """A model to draw instead of the stage's: with the Menagerie's robot in the place of the shipped shapes.

    The stage's own model where the Menagerie is not at hand, or its robot does not fit.
    """
    file = find(stage.robot)
    if file is None:
        return stage.model
    try:
        look = mujoco.MjSpec.from_file(str(file))
        world = stage.spec.copy()
        frame = world.worldbody.add_frame(pos=stage.stand[:3], quat=stage.stand[3:])
        for key in ("timestep", "integrator", "cone", "impratio", "density", "viscosity"):
            setattr(look.option, key, getattr(world.option, key))
        for group in (look.keys, look.actuators):
            for item in list(group):
                look.delete(item)
        for geom in look.geoms:
            geom.contype = geom.conaffinity = 0
            if geom.group == 3 or geom.classname.name == "collision":
                look.delete(geom)
        world.attach(look, frame=frame, prefix=LOOK)
        for geom in world.geoms:
            if geom.parent.name.startswith(PREFIX):
                geom.rgba[3] = 0.0
        model = world.compile()
    except (ValueError, AttributeError):
        return stage.model
    return model if model.nq == 2 * stage.model.nq else stage.model


def visual_state(model: Any, stage: SimWorld, state: Array) -> Array:
    """Joint positions of the visual model: those of the simulated robot, copied to both robots."""
    return state if model.nq == stage.model.nq else np.concatenate([state, state])
