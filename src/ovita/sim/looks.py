"""The looks of robots from the MuJoCo Menagerie, where it is at hand; only drawn, never simulated."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from ovita.paths.trajectory import Array
from ovita.sim.stage import PREFIX, Stage

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


def dressed(stage: Stage) -> Any:
    """A model to draw instead of the stage's: with the Menagerie's robot in the place of the shipped shapes.

    The stage's own model where the Menagerie is not at hand, or its robot does not fit.
    """
    import mujoco

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


def worn(model: Any, stage: Stage, state: Array) -> Array:
    """Positions of a dressed model: those of the stage's model, given to both robots."""
    return state if model.nq == stage.model.nq else np.concatenate([state, state])
