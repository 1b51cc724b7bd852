"""What disturbs a simulated robot: noise of its sensors, delay, lag of its actuators, a payload, wind; seeded.

The robot's controller knows of none of it: it works with its own model of the robot, on what its sensors say.
"""

from __future__ import annotations

import copy
from collections import deque
from dataclasses import dataclass
from typing import Any

import numpy as np

from ovita.errors import RequestError
from ovita.paths.scene import matrix, quaternion
from ovita.paths.trajectory import Array
from ovita.sim.models import mujoco
from ovita.sim.world import SimWorld

AIR_DENSITY, AIR_VISCOSITY = 1.204, 1.8e-5
"""Of air at 20 degrees C [kg/m^3, Pa s], where a model states none."""

GUST_TIME = 1.0
"""Time in which a gust fades [s]; gusts are an Ornstein-Uhlenbeck process in each direction."""


@dataclass(frozen=True)
class Disturbances:
    """What disturbs a robot in a simulation; all of it is off by default.

    Args:
        noise: Standard deviation of what its sensors say of positions: of the body [m], of an arm's joints [rad].
        rate_noise: The same of speeds [m/s; rad/s for joints].
        delay: From the sensors to the actuators [s].
        lag: Time constant of the actuators [s]: rotors that spin up, motors whose torque builds up.
        payload: Mass at the tip that the controller does not know of [kg].
        wind: Velocity of the air (3,) in the scene's coordinates [m/s]; it acts on the bodies' boxes (MuJoCo's fluid).
        gust: Standard deviation of the wind's changes in each direction [m/s].
        seed: Of noise and gusts.

    Raises:
        RequestError: On a number that is negative or not finite.
    """

    noise: float = 0.0
    rate_noise: float = 0.0
    delay: float = 0.0
    lag: float = 0.0
    payload: float = 0.0
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0)
    gust: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        for key in ("noise", "rate_noise", "delay", "lag", "payload", "gust"):
            value = getattr(self, key)
            if not 0.0 <= value < np.inf:
                raise RequestError(f"{key.replace('_', ' ')} {value:g} is not a number >= 0")
        if len(self.wind) != 3 or not np.isfinite(self.wind).all():
            raise RequestError(f"the wind {self.wind} is not three numbers x,y,z [m/s]")
        if self.delay > 1.0 or self.lag > 1.0:
            raise RequestError("a delay or lag of more than 1 s is not simulated; give seconds, such as 0.02")

    @property
    def calm(self) -> bool:
        """Whether nothing disturbs."""
        return self == Disturbances(seed=self.seed)

    @property
    def told(self) -> str:
        """What disturbs, in words."""
        x, y, z = self.wind
        said = (
            (self.noise, f"noise {self.noise:g} m or rad"),
            (self.rate_noise, f"noise of speeds {self.rate_noise:g} m/s or rad/s"),
            (self.delay, f"delay {self.delay:g} s"),
            (self.lag, f"lag {self.lag:g} s"),
            (self.payload, f"payload {self.payload:g} kg"),
            (any(self.wind), f"wind {x:g},{y:g},{z:g} m/s"),
            (self.gust, f"gusts {self.gust:g} m/s"),
        )
        return f"Disturbed by {', '.join(text for value, text in said if value)} (seed {self.seed})."


CALM = Disturbances()


class Plant:
    """The robot as it really is, beside the one that its controller believes in.

    Args:
        signs: (3,) from the scene's coordinates to the simulator's.
        free: Whether the robot moves about, so that its place is what is measured.
    """

    def __init__(self, stage: SimWorld, wanted: Disturbances, signs: Array, free: bool) -> None:
        self.stage, self.wanted, self.free = stage, wanted, free
        self.model = self._laden(copy.copy(stage.model))
        self.data, self.seen = mujoco.MjData(self.model), mujoco.MjData(stage.model)
        self._rng = np.random.default_rng(wanted.seed)
        step = float(self.model.opt.timestep)
        self._late: deque[Array] = deque(maxlen=round(wanted.delay / step) + 1)
        self._share = 1.0 if wanted.lag == 0.0 else 1.0 - float(np.exp(-step / wanted.lag))
        self._gust, self._fade = np.zeros(3), float(np.exp(-step / GUST_TIME))
        self._wind = np.array(wanted.wind) * signs
        if self._wind.any() or wanted.gust:
            self.model.opt.density = self.model.opt.density or AIR_DENSITY
            self.model.opt.viscosity = self.model.opt.viscosity or AIR_VISCOSITY
        self._drive: Array | None = None

    def _laden(self, model: Any) -> Any:
        if not self.wanted.payload:
            return model
        body, load = int(model.site_bodyid[self.stage.tip]), self.wanted.payload
        place, mass = model.site_pos[self.stage.tip], float(model.body_mass[body])
        rotation = matrix(model.body_iquat[body])
        inertia = rotation @ np.diag(model.body_inertia[body]) @ rotation.T
        centre = (mass * model.body_ipos[body] + load * place) / (mass + load)
        for m, at in ((mass, model.body_ipos[body].copy()), (load, place)):
            d = at - centre
            inertia = inertia + m * (d @ d * np.eye(3) - np.outer(d, d))
        values, axes = np.linalg.eigh(inertia)
        axes *= np.sign(np.linalg.det(axes))
        model.body_mass[body], model.body_ipos[body] = mass + load, centre
        model.body_inertia[body], model.body_iquat[body] = values, quaternion(axes)
        mujoco.mj_setConst(model, mujoco.MjData(model))
        return model

    def sense(self) -> Any:
        """MuJoCo's data as the controller sees it: its own model at the measured state."""
        self.seen.qpos[:], self.seen.qvel[:] = self.data.qpos, self.data.qvel
        measured = 3 if self.free else self.stage.model.nv
        if self.wanted.noise:
            self.seen.qpos[:measured] += self._rng.normal(0.0, self.wanted.noise, measured)
        if self.wanted.rate_noise:
            self.seen.qvel[:measured] += self._rng.normal(0.0, self.wanted.rate_noise, measured)
        mujoco.mj_step1(self.stage.model, self.seen)
        return self.seen

    def drive(self) -> None:
        """Pass what the controller wants on to the actuators, late and lagging, and let the wind blow."""
        self._late.append(self.seen.ctrl.copy())
        asked = self._late[0]
        self._drive = asked if self._drive is None else self._drive + self._share * (asked - self._drive)
        self.data.ctrl[:] = self._drive
        if self.wanted.gust:
            push = self.wanted.gust * np.sqrt(1.0 - self._fade**2)
            self._gust = self._fade * self._gust + push * self._rng.normal(size=3)
        self.model.opt.wind[:] = self._wind + self._gust
