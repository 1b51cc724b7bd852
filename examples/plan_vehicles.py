"""What a rover and a drone under model predictive control would really drive; run as a script or cell by cell."""

# %% A wall between a crate and a door
import ovita
from ovita import Scene, SceneObject

yard = Scene(
    (
        SceneObject("wall", [0.0, 0.0, 0.0], [0.2, 2.0, 1.0]),
        SceneObject("crate", [-1.5, 0.0, 0.0], [0.2, 0.2, 0.2]),
        SceneObject("door", [1.5, 0.0, 0.0], [0.2, 0.2, 0.2]),
    )
)

# %% The rover is a unicycle: it cannot turn corners, so its rollout rounds them
rover = ovita.plan(yard, start="crate", goal="door", robot="ground", planner="mpc", time_limit=120)
print(*rover.sentences())
assert rover.ok and all(check.held for check in rover.checks)

# %% The drone is a double integrator
drone = ovita.plan(yard, start="crate", goal="door", robot="drone", planner="mpc", time_limit=120)
print(*drone.sentences())
assert drone.ok and all(check.held for check in drone.checks)
