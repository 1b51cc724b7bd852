"""A trajectory from a sentence alone; run as a script or cell by cell."""

# %% A table with three things, and no trajectory
from ovita import Robot, Scene, SceneObject, from_words, rerun

table = Scene(
    (
        SceneObject("box", [0.30, -0.30, 0.05], [0.12, 0.10, 0.10]),
        SceneObject("plate", [0.30, 0.30, 0.01], [0.22, 0.22, 0.02]),
        SceneObject("bottle", [0.30, 0.00, 0.13], [0.07, 0.07, 0.26]),
    )
)
arm = Robot.preset("arm")

# %% The way is planned, the rest of the sentence adapts it
sentence = "From the box to the plate over the bottle, slowly, then a spiral"
made = from_words(sentence, table, arm, writer="builtin")
print(made.route.start.label, "->", made.route.goal.label, "| the rest:", made.route.rest)
print(made.status, *made.adaptation.plan, sep="\n  ")
assert made.adaptation.usable

# %% What is not said is asked for
print(from_words("go to the plate", table, arm, writer="builtin").question)

# %% The result is an ordinary adaptation: turn a knob
wider = rerun(made.adaptation, {"turns": 2})
print(f"{len(made.adaptation.adapted)} waypoints, then {len(wider.adapted)}")
