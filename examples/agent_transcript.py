"""An agent adapts a path, checks it, and is refused to send it: `python examples/agent_transcript.py` prints the talk.

The agent is a script, the client is the official SDK's, the server that of `ovita serve mcp`, in this process. The
client cannot show forms to a person, so nothing is sent. `docs/agents.md` holds the printed talk.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import anyio
from mcp import Client

from ovita.serve.access import AccessRules, AuditLog
from ovita.serve.application import Application
from ovita.serve.protocol import ToolServer

TASK = {
    "trajectory": [[0.1 * i, 0.0, 0.5, 0.4] for i in range(11)],
    "objects": [
        {"name": "cup", "x": 0.7, "y": 0.5, "z": 0.5, "dimensions": [0.1, 0.1, 0.1]},
        {"name": "lamp", "x": 0.3, "y": -0.1, "z": 0.5, "dimensions": [0.1, 0.1, 0.3]},
    ],
    "robot": "drone",
}
TALK: tuple[tuple[str, Mapping[str, Any]], ...] = (
    ("open_task", {"document": TASK}),
    ("adapt", {"instruction": "slow down near the cup"}),
    ("set_knob", {"name": "slowdown", "value": 0.4}),
    ("check", {}),
    ("adapt", {"instruction": "keep at least 0.3 from the lamp"}),
    ("check", {}),
    ("send", {"to": "ros2:/plan"}),
)
SHOWN = ("status", "message", "released", "refusals", "changes", "limits", "knobs", "objects", "turn")
"""What is printed of a result; the client got all of it."""


def brief(structured: Mapping[str, Any]) -> list[str]:
    """The lines of a result that matter in this talk."""
    lines = []
    for key in SHOWN:
        value = structured.get(key)
        if key == "limits" and "status" not in structured:
            continue
        if key == "knobs":
            value = [f"{knob['name']} = {knob['value']:g} {knob['unit']}".strip() for knob in value or ()]
        if key == "objects":
            value = [item["name"] for item in value or ()]
        if value not in (None, [], ""):
            lines += [f"{key}: {part}" for part in (value[:2] if isinstance(value, list) else [value])]
    return lines


async def talk(client: Client) -> list[str]:
    """Have the agent call the tools, and write down what it says and hears."""
    lines, task = [], ""
    for tool, arguments in TALK:
        given = dict(arguments) if tool == "open_task" else {"task": task, **arguments}
        answer = await client.call_tool(tool, given)
        shown = ", ".join(f"{key}={value!r}" for key, value in arguments.items() if key != "document")
        lines.append(f"agent: {tool}({shown or ('document={...}' if tool == 'open_task' else '')})")
        if answer.is_error:
            lines.append(f"    refused: {answer.content[0].text}")
            continue
        task = answer.structured_content["task"]
        lines += [f"    {line}" for line in brief(answer.structured_content)]
    return lines


def transcript() -> str:
    """The whole talk."""
    with tempfile.TemporaryDirectory() as folder:
        rules = AccessRules(places=("ros2:/plan",))
        application = Application(rules, Path(folder, "tasks"), AuditLog(Path(folder, "audit.jsonl")), "builtin")

        async def meet() -> list[str]:
            async with Client(ToolServer(application).server) as client:
                return await talk(client)

        return "\n".join(anyio.run(meet)) + "\n"


if __name__ == "__main__":
    print(transcript(), end="")
