"""What the built-in writer's answers to the corpus amount to, judged by executable checks.

`python training/answers.py [voices|held_out|FOLDER]`: right, right after one yes, shown but not meant, asked or
declined, said to be not as meant, and silently wrong, voice by voice; it prints no sentence. A sentence that asks for
nothing is right if nothing is done.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "corpus"))

from check import Example, examples
from realised import setting

from ovita.bench.expected import expected
from ovita.errors import OvitaError
from ovita.instruct.frames import unaimed
from ovita.instruct.meaning import same
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory
from ovita.policy.policy import run_proven
from ovita.policy.source import parse_tree
from ovita.request import Request
from ovita.toolkit import judge
from ovita.writers.base import Reply, ground
from ovita.writers.generate import BuiltinWriter

KINDS = (
    "right",
    "after a yes",
    "shown, not meant",
    "asked or declined",
    "rightly refused",
    "not as meant",
    "silently wrong",
)


def judged(line: Example) -> str:
    """What the answer to one sentence amounts to: one of KINDS."""
    trajectory, scene = setting(line.frames, line.objects)
    reply = BuiltinWriter().write(ground(Request(line.sentence, trajectory, scene)))
    done = reply.kind == "policy"
    if line.outcome != "do":
        return "rightly refused" if not done else "shown, not meant" if reply.confirm else "silently wrong"
    if not done:
        return "asked or declined"
    if line.besides and not reply.confirm:
        return "silently wrong"
    if passes(line, reply, trajectory, scene):
        return "after a yes" if reply.confirm else "right"
    if reply.confirm:
        return "shown, not meant"
    return "silently wrong" if promised(reply, trajectory, scene) else "not as meant"


def promised(reply: Reply, trajectory: Trajectory, scene: Scene) -> bool:
    """Whether a policy keeps what it promises; where it does not, the result is told to be not as meant."""
    try:
        rows, recorder = run_proven(parse_tree(reply.code), trajectory.to_array(), scene)
        adapted = Trajectory.from_array(rows)
    except (OvitaError, ValueError, IndexError, KeyError):
        return False
    return all(judge(promise, trajectory, adapted, scene).held for promise in recorder.expectations)


def passes(line: Example, reply: Reply, trajectory: Trajectory, scene: Scene) -> bool:
    """Whether what a reply does is what the line's writer meant.

    The notation leaves open what of an object is meant, its top, its surface or the place beside it. Where a frame says
    so and is else the writer's, it is held to what the policy promises of it.
    """
    try:
        rows, _ = run_proven(parse_tree(reply.code), trajectory.to_array(), scene)
        adapted = Trajectory.from_array(rows)
        if expected(line.frames, trajectory, scene).judge(trajectory, adapted, scene).passed:
            return True
        rest = tuple(frame for frame in reply.frames if unaimed(frame) == frame)
        if not same(reply.frames, line.frames) or len(rest) == len(reply.frames):
            return False
        if not promised(reply, trajectory, scene):
            return False
        return not rest or bool(expected(rest, trajectory, scene).judge(trajectory, adapted, scene).passed)
    except (OvitaError, ValueError, IndexError, KeyError):
        return False


def main() -> None:
    """Print the table."""
    where = sys.argv[1] if len(sys.argv) > 1 else "held_out"
    folder = Path(__file__).parent / "corpus" / where if where in ("voices", "held_out") else Path(where)
    total: Counter[str] = Counter()
    for path in sorted(folder.glob("*.txt")):
        counts = Counter(judged(line) for line in examples(path) if line.before is None and not line.problem)
        total += counts
        print(row(path.stem, counts), flush=True)
    print(row("all", total))


def row(name: str, counts: Counter[str]) -> str:
    """A line of the table."""
    n = max(counts.total(), 1)
    return f"{name:16} {counts.total():5}  " + "  ".join(f"{k} {counts[k] / n:5.1%}" for k in KINDS)


if __name__ == "__main__":
    main()
