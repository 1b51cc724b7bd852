"""`ovita plan`: a trajectory from place to place."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import click
from click import option

from ovita.cli.common import (
    EXIT_OF,
    EXIT_REFUSED,
    FRAME,
    in_frame,
    own_robot,
    plain,
    robot_from,
    say,
    show_notes,
    shown,
    waiting,
)
from ovita.errors import FormatError, RequestError
from ovita.io import Task, load_bare, load_robot, load_scene, load_task, save_task
from ovita.io.documents import plain as as_json_value
from ovita.paths.robot import UNLIMITED, Robot
from ovita.result import Adaptation
from ovita.sources.planner import PLANNERS, TIME_LIMIT, WAYPOINTS, Plan, plan
from ovita.sources.words import from_words


@click.command()
@click.argument("scene", metavar="SCENE")
@option("--from", "start", required=True, metavar="PLACE", help="Where to start; see below.")
@option("--to", "goal", required=True, metavar="PLACE", help="Where to end.")
@option("--via", multiple=True, metavar="PLACE", help="What to pass; may be given several times, in order.")
@shown("--planner", default="limits", metavar="NAME", help=f"{', '.join(PLANNERS)}, or of a plug-in.")
@option("--robot", metavar="NAME|FILE", help="Limits, as for ovita adapt. [the robot that SCENE names, else none]")
@option("--out", "-o", metavar="FILE", help="Write the trajectory in its scene, in any format of ovita convert.")
@shown("--waypoints", type=int, default=WAYPOINTS, metavar="N")
@option("--speed", type=float, metavar="M/S", help="On the way. [half of the robot's highest]")
@shown("--seed", type=int, default=0, help="Of planners that sample.")
@shown("--time-limit", type=float, default=TIME_LIMIT, metavar="SECONDS")
@FRAME
@option("--json", "as_json", is_flag=True, help="Print the outcome as JSON.")
def command(scene: str, robot: str | None, out: str | None, frame: str | None, as_json: bool, **options: Any) -> None:
    """Plan a trajectory in SCENE, a JSON file with objects, from place to place within a robot's limits.

    A PLACE is an object ("box"), a place at one ("above the box", "0.1 m left of the cup", "between the posts"), or
    x,y,z in metres. At an object that is an obstacle, the path keeps the robot's distance. From words alone, a
    trajectory is made by ovita adapt SCENE "from the box to the plate, slowly".

    Planners: limits (moves the straight way around obstacles; quick), rrt_connect and rrt_star (sampling, extra
    planning), mpc (what a rover or drone would really drive), joint (all joints of an arm, extras planning and sim).
    """
    surroundings = in_frame(load_scene(scene)[0], frame)
    limits, named, notes = (load_robot(robot), robot, ()) if robot else _own_robot(scene)
    with waiting(f"{options['planner']} plans", quiet=as_json) as tell:
        found = plan(surroundings, robot=limits, progress=tell, **options)
    lost: tuple[str, ...] = ()
    if out and found.ok:
        task = replace(found.task(None if named == "none" else named), path=scene)
        lost = save_task(out, task)
    _tell(found, out, as_json)
    show_notes((*notes, *lost))
    raise SystemExit(0 if found.ok else EXIT_REFUSED)


def _own_robot(scene: str) -> tuple[Robot, str | None, tuple[str, ...]]:
    """The robot that a scene's file names, that name, and a note where it is not known; none where it names none."""
    try:
        task = load_bare(scene) or load_task(scene)
    except FormatError:  # no trajectory and no objects
        return UNLIMITED, None, ()
    limits, notes = own_robot(task)
    return limits, None if notes else task.robot, notes


def generated(
    bare: Task, instruction: str | None, planner: str, options: dict[str, Any], stages: dict[str, Any], *, as_json: bool
) -> tuple[Adaptation, Task]:
    """Plan and adapt from words alone, for `ovita adapt` on a file without a trajectory.

    A question, or a way that cannot be, is told and ends the command.
    """
    known = replace(bare, scene=in_frame(bare.scene, options["frame"]))
    text = known.instruction if instruction is None else instruction
    if not text.strip():
        hint = f"ovita adapt {bare.path} 'from A to B'"
        raise RequestError(f"{bare.path} has no trajectory: say from where to where, {hint}")
    robot = robot_from(known, options["robot"], options["max_speed"])
    with waiting(f"{planner} plans", quiet=as_json) as tell:
        made = from_words(text, known.scene, robot, planner=planner, progress=tell, **stages)
    if made.adaptation is None or made.plan is None:
        if as_json:
            click.echo(json.dumps({"status": made.status, "instruction": text, "message": made.message}))
        else:
            say(made.message)
        raise SystemExit(EXIT_OF[made.status])
    return made.adaptation, replace(known, trajectory=made.adaptation.original)


def _tell(found: Plan, out: str | None, as_json: bool) -> None:
    if as_json:
        click.echo(json.dumps(_document(found), ensure_ascii=False))
        return
    say(*found.sentences())
    if found.ok and out:
        click.echo(f"wrote {plain(out)}")
        click.echo(f'Now change it: ovita adapt {plain(out)} "a little higher"')


def _document(found: Plan) -> Any:
    path, motion = found.trajectory, found.motion
    asked = {"from": found.request.start.label, "via": [anchor.label for anchor in found.request.via]}
    told = {name: getattr(found, name) for name in ("problems", "notes", "seconds")}
    ways = {name: getattr(path, name, None) for name in ("length", "duration")}
    moves = {"joints": getattr(motion, "positions", None), "times": getattr(motion, "times", None)}
    rows = None if path is None else path.to_array()
    document = {"ok": found.ok, "planner": found.planner, **asked, "to": found.request.goal.label, **told, **ways}
    return as_json_value({**document, "trajectory": rows, **moves, "checks": found.checks})
