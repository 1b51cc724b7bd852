"""`ovita plan`, `ovita learn` and `ovita generate`: trajectories from places, and from skills that were shown."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NoReturn

import click
from click import option

from ovita.chain import enforced
from ovita.cli import common
from ovita.errors import FormatError, RequestError
from ovita.io import Task, load_bare, load_robot, load_scene, load_task, save_task
from ovita.io.documents import plain as as_json_value
from ovita.limits import ConstraintOptions
from ovita.paths.robot import UNLIMITED, Robot
from ovita.paths.scene import Scene
from ovita.request import FeedbackOn
from ovita.result import Adaptation
from ovita.sources.demonstrations import read_demonstrations
from ovita.sources.learning import learn as learn_skill
from ovita.sources.planner import PLANNERS, TIME_LIMIT, WAYPOINTS, Plan
from ovita.sources.planner import plan as plan_path
from ovita.sources.skills import COVARIANCE, KINDS, GeneratedPath, Skill, SkillKind
from ovita.sources.words import from_words
from ovita.text import counted, length
from ovita.writers.base import PolicyWriter

if TYPE_CHECKING:
    from ovita.cli.adapt_ import Outputs


@click.command()
@click.argument("scene", metavar="SCENE")
@option("--from", "start", required=True, metavar="PLACE", help="Where to start; see below.")
@option("--to", "goal", required=True, metavar="PLACE", help="Where to end.")
@option("--via", multiple=True, metavar="PLACE", help="What to pass; may be given several times, in order.")
@common.shown("--planner", default="limits", metavar="NAME", help=f"{', '.join(PLANNERS)}, or of a plug-in.")
@option("--robot", metavar="NAME|FILE", help="Limits, as for ovita adapt. [the robot that SCENE names, else none]")
@option("--out", "-o", metavar="FILE", help="Write the trajectory in its scene, in any format of ovita convert.")
@common.shown("--waypoints", type=int, default=WAYPOINTS, metavar="N")
@option("--speed", type=float, metavar="M/S", help="On the way. [half of the robot's highest]")
@common.shown("--seed", type=int, default=0, help="Of planners that sample.")
@common.shown("--time-limit", type=float, default=TIME_LIMIT, metavar="SECONDS")
@common.FRAME
@option("--json", "as_json", is_flag=True, help="Print the outcome as JSON.")
def plan(scene: str, robot: str | None, out: str | None, frame: str | None, as_json: bool, **options: Any) -> None:
    """Plan a trajectory in SCENE, a JSON file with objects, from place to place within a robot's limits.

    A PLACE is an object ("box"), a place at one ("above the box", "0.1 m left of the cup", "between the posts"), or
    x,y,z in metres. At an object that is an obstacle, the path keeps the robot's distance. From words alone, a
    trajectory is made by ovita adapt SCENE "from the box to the plate, slowly".

    Planners: limits (moves the straight way around obstacles; quick), rrt_connect and rrt_star (sampling, extra
    planning), mpc (what a rover or drone would really drive), joint (all joints of an arm, extras planning and sim).
    """
    surroundings = common.in_frame(load_scene(scene)[0], frame)
    limits, named, notes = (load_robot(robot), robot, ()) if robot else _own_robot(scene)
    with common.waiting(f"{options['planner']} plans", quiet=as_json) as tell:
        found = plan_path(surroundings, robot=limits, progress=tell, **options)
    lost: tuple[str, ...] = ()
    if out and found.ok:
        task = replace(found.task(None if named == "none" else named), path=scene)
        lost = save_task(out, task)
    _tell_plan(found, out, as_json)
    common.show_notes((*notes, *lost))
    raise SystemExit(0 if found.ok else common.EXIT_REFUSED)


def _own_robot(scene: str) -> tuple[Robot, str | None, tuple[str, ...]]:
    """The robot that a scene's file names, that name, and a note where it is not known; none where it names none."""
    try:
        task = load_bare(scene) or load_task(scene)
    except FormatError:  # no trajectory and no objects
        return UNLIMITED, None, ()
    limits, notes = common.own_robot(task)
    return limits, None if notes else task.robot, notes


def generated(
    bare: Task, instruction: str | None, planner: str, options: dict[str, Any], stages: dict[str, Any], *, as_json: bool
) -> tuple[Adaptation, Task, PolicyWriter]:
    """Plan and adapt from words alone, for `ovita adapt` on a file without a trajectory.

    A question, or a way that cannot be, is told and ends the command.
    """
    text = bare.instruction if instruction is None else instruction
    if not text.strip():
        hint = f"ovita adapt {bare.path} 'from A to B'"
        raise RequestError(f"{bare.path} has no trajectory: say from where to where, {hint}")
    robot = common.robot_from(bare, options["robot"], options["max_speed"])
    with common.waiting(f"{planner} plans", quiet=as_json) as tell:
        made = from_words(text, bare.scene, robot, planner=planner, progress=tell, **stages)
    if made.adaptation is None or made.plan is None:
        if as_json:
            click.echo(json.dumps({"status": made.status, "instruction": text, "message": made.message}))
        else:
            common.say(made.message)
        raise SystemExit(common.EXIT_OF[made.status])
    return made.adaptation, replace(bare, trajectory=made.adaptation.original), stages["writer"]


def _tell_plan(found: Plan, out: str | None, as_json: bool) -> None:
    if as_json:
        click.echo(json.dumps(_document(found), ensure_ascii=False))
        return
    common.say(*found.sentences())
    if found.ok and out:
        click.echo(f"wrote {common.plain(out)}")
        click.echo(f'Now change it: ovita adapt {common.plain(out)} "a little higher"')


def _document(found: Plan) -> Any:
    path, motion = found.trajectory, found.motion
    asked = {"from": found.request.start.label, "via": [anchor.label for anchor in found.request.via]}
    told = {name: getattr(found, name) for name in ("problems", "notes", "seconds")}
    ways = {name: getattr(path, name, None) for name in ("length", "duration")}
    moves = {"joints": getattr(motion, "positions", None), "times": getattr(motion, "times", None)}
    rows = None if path is None else path.to_array()
    document = {"ok": found.ok, "planner": found.planner, **asked, "to": found.request.goal.label, **told, **ways}
    return as_json_value({**document, "trajectory": rows, **moves, "checks": found.checks})


@click.command()
@click.argument("demos", metavar="DEMOS...", nargs=-1, required=True)
@option("--out", "-o", required=True, metavar="FILE", help="Where to write the skill (JSON).")
@common.shown("--kind", type=click.Choice(KINDS), default="kmp", help="What is learned; see below.")
@option(
    "--frames",
    default="",
    metavar="NAMES",
    help="Objects, or start and goal, that the movement is relative to: cup,plate (kmp, tpgmm).",
)
@common.pick("--align", "dtw arc_length time", "How moments of the demonstrations are matched.")
@common.shown("--components", type=click.IntRange(1, 100), default=8, help="Gaussians of a tpgmm.")
@common.source
def learn(
    demos: tuple[str, ...], out: str, kind: SkillKind, frames: str, align: Any, components: int, **options: Any
) -> None:
    """Learn a skill from DEMOS: files of any format that ovita reads, one demonstration each, or LeRobot folders.

    \b
    kmp    passes through any via-point and bends where demonstrations varied; the default
    promp  stays within what the demonstrations span
    dmp    one movement between any two ends, without a variance; one demonstration is enough
    tpgmm  weighs what several task frames say, so that it follows objects that moved
    """  # noqa: D301
    choices = common.choices_from(options)
    tasks = read_demonstrations(demos, scene_file=options["scene_file"], frame=options["frame"], choices=choices)
    skill = learn_skill(tasks, kind, frames=common.names_in(frames), align=align, components=components)
    skill.save(out)
    around = f", relative to {', '.join(skill.frames)}" if skill.frames else ""
    common.say(f"Learned a {kind} from {counted(skill.shown, 'demonstration')}{around}: {spread(skill)}")
    common.show_notes(skill.notes)
    if options["frame"] is None:
        frame = tasks[0].scene.frame
        common.show_notes(
            [f"taken to be in the frame {frame.name} ({frame.describe()}); another is named with --frame"]
        )
    click.echo(f"wrote {out}")


def spread(skill: Skill) -> str:
    """How large a movement is and how much it varies, in words."""
    covariance = skill.generate().covariance
    across = f"{length(skill.size)} across"
    if covariance is None:
        return f"{across}, without a variance"
    deviations = (covariance[:, range(3), range(3)].sum(axis=1)) ** 0.5
    return f"{across}, varying by {length(deviations.min())} to {length(deviations.max())}"


@click.command()
@click.argument("file", metavar="SKILL.json")
@option("--start", metavar="PLACE", help="Where to start: 'above the cup', or x,y,z[,qw,qx,qy,qz]. [as shown]")
@option("--goal", metavar="PLACE", help="Where to end. [as shown]")
@option(
    "--via",
    multiple=True,
    metavar="PHASE: PLACE",
    help="Pass through a place at a phase between 0 and 1: '0.5: cup'; without a phase, where it is least unusual.",
)
@option("--scene", "scene_file", metavar="FILE", help="Where the objects are now. [where they were shown]")
@option("--frame", type=common.FRAMES, help="Which way is left in PLACE. [the one that the skill was learned in]")
@option("--waypoints", type=click.IntRange(2, 10000), metavar="N", help="Number of waypoints. [101]")
@common.shown("--robot", default="none", metavar="NAME|FILE", help="Limits, as for ovita adapt.")
@option("--max-speed", type=float, metavar="M/S", help="Speed limit, instead of the robot's.")
@option("--repair", is_flag=True, help="Move and slow the path to keep the limits, not only measure them.")
@option("--no-obstacles", is_flag=True, help="Objects are no obstacles.")
@option("--out", "-o", metavar="FILE", help="Write the trajectory, in any format that ovita convert writes.")
@option("--json", "as_json", is_flag=True, help="Print mean and covariance as JSON.")
def generate(file: str, robot: str, repair: bool, out: str | None, as_json: bool, **options: Any) -> None:
    """Generate a trajectory of SKILL.json between other ends, through via-points, around objects that moved.

    A task in JSON holds the covariance as well. The path is measured against the limits as an adapted one is: exit code
    5 where one of them is broken, or where --repair had to change the path, 4 where they cannot all be kept. If a place
    is not reached, which can happen to a promp or by --repair, that is said and the exit code is 6.
    """
    limits = common.slowed(load_robot(robot), options["max_speed"])
    skill = Skill.load(file)
    scene = _scene_of(skill, options["scene_file"], options["frame"])
    places = options["start"], options["goal"], list(map(_via, options["via"]))
    asked = skill.generate(*places, scene=scene, waypoints=options["waypoints"], robot=limits)
    made, judged = checked(asked, limits, repair=repair, obstacles=not options["no_obstacles"])
    lost = save_task(out, made.task()) if out else ()
    if as_json:
        covariance = None if made.covariance is None else made.covariance.tolist()
        document = {"trajectory": made.trajectory.to_array().tolist(), "covariance": covariance}
        document |= {"notes": made.notes, "missed": made.missed, "status": judged.status, "limits": made.broken}
        click.echo(json.dumps(document))
    else:
        _tell(made, (*skill.notes, *made.notes, *lost), repaired=repair)
        if out:
            click.echo(f"wrote {out}")
    raise SystemExit(common.EXIT_OF["not_as_meant" if made.missed else judged.status])


def _tell(made: GeneratedPath, notes: Sequence[str], *, repaired: bool) -> None:
    path = made.trajectory
    click.echo(f"{counted(len(path), 'waypoint')}, {length(path.length)} in {path.duration:.1f} s")
    common.show_notes(notes)
    common.say(
        *(f"not as meant: {text}" for text in made.missed), *(f"limits: {text}" for text in made.broken), err=True
    )
    if made.broken and not repaired:
        click.echo("Nothing was changed for the limits; --repair keeps them.", err=True)


def checked(made: GeneratedPath, robot: Robot, *, repair: bool, obstacles: bool) -> tuple[GeneratedPath, Adaptation]:
    """A generated path with what was measured of the limits, moved to keep them where that is asked for."""
    options = ConstraintOptions(repair_original=True, obstacles=obstacles, enabled=repair)
    result = enforced("Generate", made.trajectory, made.scene, robot, constraints=options)
    verdict = result.constraints
    kept = verdict is None or verdict.status == "satisfied" or result.status == "done"
    moved = made if result.adapted == made.trajectory else made.moved_to(result.adapted)
    return replace(moved, broken=() if verdict is None or kept else tuple(verdict.sentences())), result


def _scene_of(skill: Skill, scene_file: str | None, frame: str | None) -> Scene:
    """Where the objects are now, in the frame that places are told in.

    Raises:
        RequestError: If the file states another frame than the skill was learned in, and none is asked for.
    """
    scene, stated = (skill.scene, "") if scene_file is None else load_scene(scene_file)
    if frame is not None:
        return common.in_frame(scene, frame)
    if stated and scene.frame != skill.scene.frame:
        frames = f"is in the frame {scene.frame.name}, the skill in {skill.scene.frame.name}"
        raise RequestError(f"{scene_file} {frames}; give them the same, or say by --frame which one counts")
    return replace(scene, frame=skill.scene.frame)


def _via(text: str) -> tuple[float | None, str]:
    phase, colon, place = text.partition(":")
    if not colon:
        return None, text.strip()
    try:
        return float(phase), place.strip()
    except ValueError:
        raise RequestError(f"--via {text!r}: {phase.strip()!r} is no phase; say it as '0.5: cup'") from None


def adapt_file(file: str, instruction: str, on: FeedbackOn, outputs: Outputs, options: dict[str, Any]) -> NoReturn:
    """Adapt a skill's mean to an instruction and write the skill, its trajectory and its picture where asked."""
    from ovita.cli.adapt_ import draw, report
    from ovita.sources.adapted_skills import adapt_skill

    skill, robot = Skill.load(file), common.slowed(load_robot(options["robot"] or "none"), options["max_speed"])
    how: dict[str, Any] = {"writer": common.writer_from(options), "constraints": common.constraints_from(options)}
    edited = adapt_skill(skill, instruction, on=on, robot=robot, accepting=outputs.accepting, **how)
    result, made, lost = edited.result, edited.skill.generate().task(instruction), tuple[str, ...]()
    if not result.usable:
        report(result, outputs, (), (), edited.notes)
    if outputs.result:
        edited.skill.save(outputs.result)
    if outputs.trajectory:
        lost = save_task(outputs.trajectory, made)
    if outputs.picture:
        draw(result, outputs.picture, tube=made.extra.get(COVARIANCE))
    report(result, outputs, outputs.files, lost, edited.notes)
