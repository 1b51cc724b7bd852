"""A trajectory from place to place, by three planners; run as a script or cell by cell."""

# %% A table with three things, and an arm's limits
import ovita
from ovita import Robot, Scene, SceneObject

table = Scene(
    (
        SceneObject("box", [0.30, -0.30, 0.05], [0.12, 0.10, 0.10]),
        SceneObject("plate", [0.30, 0.30, 0.01], [0.22, 0.22, 0.02]),
        SceneObject("bottle", [0.30, 0.00, 0.13], [0.07, 0.07, 0.26]),
    )
)
arm = Robot.preset("arm")

# %% The constraint module moves the straight way around the bottle
found = ovita.plan(table, start="10 cm left of the box", goal="plate", robot=arm)
print(*found.sentences())
assert found.ok and all(check.held for check in found.checks)

# %% The same with a via point, and by OMPL where it is installed
over = ovita.plan(table, start="box", goal="plate", via=["above the bottle"], robot=arm)
print(*over.sentences())
try:
    sampled = ovita.plan(table, start="10 cm left of the box", goal="plate", robot=arm, planner="rrt_connect", seed=1)
    print(f"rrt_connect: {sampled.cost:.3f} m, limits: {found.cost:.3f} m")
except ovita.OvitaError as missing:
    print(missing)

# %% What cannot be is explained
inside = ovita.plan(table, start="0.3,-0.3,0.05", goal="plate", robot=arm)
print(*inside.problems)
assert not inside.ok

# %% A plan is a trajectory like any other
result = ovita.adapt(ovita.Request("slower near the bottle", over.trajectory, table, arm), writer="builtin")
print(result.message, *result.plan)
