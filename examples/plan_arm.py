"""All joints of an arm around a bottle, checked in physics (extras planning and sim); run as a script or by cells."""

# %% A table with three things
from ovita import Scene, SceneObject, plan
from ovita.sources.joints import touched

table = Scene(
    (
        SceneObject("box", [0.30, -0.30, 0.05], [0.12, 0.10, 0.10]),
        SceneObject("plate", [0.30, 0.30, 0.01], [0.22, 0.22, 0.02]),
        SceneObject("bottle", [0.30, 0.00, 0.13], [0.07, 0.07, 0.26]),
    )
)

# %% RRT-Connect over the seven joints; the whole arm keeps clear, not only its tip
found = plan(table, start="box", goal="plate", robot="arm", planner="joint", seed=1, time_limit=120)
print(*found.sentences())
assert found.ok and found.motion is not None
print(found.motion.names, f"{found.motion.times[-1]:.2f} s, {len(found.motion.positions)} postures")

# %% A simulated arm follows the motion; what does it touch?
contacts, worst = touched(found)
print(contacts or "nothing is touched", f"worst error of a joint: {worst:.4f} rad")
assert not contacts
