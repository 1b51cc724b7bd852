"""A skill from demonstrations: learned, generated around objects that moved, and adapted by instruction.

python examples/skill_from_demonstrations.py
"""

import numpy as np

from ovita import Scene, SceneObject, Trajectory, learn
from ovita.io import Task
from ovita.sources.adapted_skills import adapt_skill


def demonstration(seed: int) -> Task:
    """Somebody puts the cup's content on the plate: another scene, another pace and another way each time."""
    rng = np.random.default_rng(seed)
    cup, plate = rng.uniform([-0.1, -0.1, 0], [0.1, 0.1, 0]), rng.uniform([0.5, 0.2, 0], [0.7, 0.5, 0])
    t = np.linspace(0.0, 1.0, 80)[:, None] ** rng.uniform(0.8, 1.2)
    start, goal, over = (
        np.add(cup, [0, 0, 0.1]),
        np.add(plate, [0, 0, 0.1]),
        np.array([0.0, 0.0, 0.25 + rng.normal(0.0, 0.02)]),
    )
    path = (
        (1 - t) ** 3 * start + 3 * (1 - t) ** 2 * t * (cup + over) + 3 * (1 - t) * t**2 * (plate + over) + t**3 * goal
    )
    scene = Scene((SceneObject("cup", cup), SceneObject("plate", plate)))
    return Task(Trajectory(path, np.full(80, 0.2)), scene)


def main() -> None:
    skill = learn([demonstration(seed) for seed in range(6)], "kmp", frames=("cup", "plate"))
    moved = demonstration(42).scene
    made = skill.generate(scene=moved)
    above = made.trajectory.positions[-1] - moved["plate"].position
    print(f"The plate moved; the path ends above it by {np.array2string(above, precision=3, suppress_small=True)} m.")

    higher = adapt_skill(skill, "a bit higher over the cup", writer="builtin")
    print(f"{higher.result.message} The variance is as it was:", end=" ")
    before, after = skill.generate(scene=moved), higher.skill.generate(scene=moved)
    assert before.covariance is not None
    print(np.array_equal(before.covariance, after.covariance))

    far = made.trajectory.positions[50] + [0.0, 0.0, 0.3]
    for note in skill.generate(scene=moved, via={0.5: far}).notes:
        print(f"Note: {note}.")


if __name__ == "__main__":
    main()
