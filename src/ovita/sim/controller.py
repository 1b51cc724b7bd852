"""What every controller does: plan a trajectory under its robot's limits, then act on the simulated robot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ovita.paths.trajectory import Array
from ovita.sim.report import Touched, Unreachable
from ovita.sim.timing import Plan


@dataclass(frozen=True)
class Intent:
    """What a controller means to do.

    Args:
        plan: At every step of the simulation.
        unreachable: Waypoints that cannot be reached.
        limits: That the plan reaches.
        notes: What else a person should know.
    """

    plan: Plan
    unreachable: tuple[Unreachable, ...] = ()
    limits: tuple[Touched, ...] = ()
    notes: tuple[str, ...] = ()


class Controller(Protocol):
    """Drives one kind of robot; a fresh one is made for every simulation."""

    @property
    def intent(self) -> Intent:
        """The plan, made when the controller is made."""

    def pose(self, data: Any, step: int) -> None:
        """Put the simulated robot (MuJoCo's data) where the plan has it at one step, at rest."""

    def act(self, data: Any, step: int) -> bool:
        """Write the actuators' values for one step; positions, velocities and forces of `data` are up to date.

        Returns:
            Whether the actuators can give what the controller wants.
        """


def stretches(name: str, at_limit: np.ndarray[Any, Any], where: Array) -> tuple[Touched, ...]:
    """A limit as `Touched`, or nothing if it is reached nowhere.

    Args:
        name: Of the limit.
        at_limit: (K,) whether it is reached, at each step.
        where: (K,) place on the trajectory.
    """
    if not at_limit.any():
        return ()
    places = where[at_limit]
    return (Touched(name, round(float(places.min())), round(float(places.max())), float(at_limit.mean())),)
