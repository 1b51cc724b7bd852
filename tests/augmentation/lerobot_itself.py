"""Loads a data set with lerobot itself and prints what it sees as JSON: PYTHON_WITH_LEROBOT lerobot_itself.py FOLDER.

Runs in an environment of its own, so it imports nothing of ovita.
"""

import json
import sys
from importlib.metadata import version
from pathlib import Path

import torch

try:  # since 0.5
    from lerobot.datasets import LeRobotDataset
except ImportError:
    from lerobot.datasets.lerobot_dataset import LeRobotDataset


def seen(folder: Path) -> dict:
    data = LeRobotDataset("local/check", root=folder)
    ahead = LeRobotDataset("local/check", root=folder, delta_timestamps={"action": [0.0, 1 / data.fps, 2 / data.fps]})
    one = LeRobotDataset("local/check", root=folder, episodes=[data.num_episodes - 1])
    batch = next(iter(torch.utils.data.DataLoader(data, batch_size=16, shuffle=False, collate_fn=collate(data))))
    first, last = data[0], data[len(data) - 1]
    tensors = {key: list(value.shape) for key, value in batch.items() if isinstance(value, torch.Tensor)}
    return {
        "lerobot": version("lerobot"),
        "torch": torch.__version__,
        "episodes": data.num_episodes,
        "frames": data.num_frames,
        "fps": data.fps,
        "tasks": len(data.meta.tasks),
        "first_task": first["task"],
        "last_task": last["task"],
        "first_state": first["observation.state"].tolist(),
        "last_state": last["observation.state"].tolist(),
        "last_reference": last["observation.environment_state"].tolist(),
        "last_index": [int(last[key]) for key in ("episode_index", "frame_index", "index", "task_index")],
        "last_timestamp": float(last["timestamp"]),
        "lengths": [int(n) for n in data.meta.episodes["length"]],
        "batch": tensors,
        "batch_tasks": list(batch["task"]),
        "chunk_of_actions": list(ahead[0]["action"].shape),
        "frames_of_last_episode": len(one),
        "mean_state": data.meta.stats["observation.state"]["mean"].tolist(),
        "median_state": data.meta.stats["observation.state"]["q50"].tolist(),
        "language": [[line["style"], line["content"]] for line in first.get("language_persistent", ())],
        "tasks_in_turn": tasks_in_turn(first),
    }


def collate(data: LeRobotDataset):
    """What lerobot's own training loop takes: None, but for data with language."""
    if "language_persistent" not in data.features:
        return None
    from lerobot.utils.collate import lerobot_collate_fn

    return lerobot_collate_fn


def tasks_in_turn(frame: dict) -> list:
    """The wordings that lerobot's recipes ask for, by number of the sample."""
    if "language_persistent" not in frame:
        return []
    from lerobot.configs.recipe import MessageTurn, TrainingRecipe
    from lerobot.datasets.language_render import render_sample

    asked = MessageTurn(role="user", content="${task}", stream="high_level")
    answer = MessageTurn(role="assistant", content="${motion}", stream="high_level", target=True)
    recipe = TrainingRecipe(messages=[asked, answer], bindings={"motion": "active_at(t, style=motion)"})
    rows = frame["language_persistent"]
    said = [render_sample(recipe=recipe, persistent=rows, events=[], t=0.0, sample_idx=i, task=None) for i in range(20)]
    return [[message["content"] for message in one["messages"]] for one in said]


if __name__ == "__main__":
    print(json.dumps(seen(Path(sys.argv[1]))))
