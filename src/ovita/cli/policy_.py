"""`ovita policy`: check policy files, run them in the sandbox, and list what they may call."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from typing import Any

import click
from click import option

from ovita.cli.common import EXIT_NOTHING, EXIT_OF, literal, pick, say, shown
from ovita.cli.main import GuessingGroup
from ovita.errors import IsolationUnavailable, PolicyError
from ovita.io import Task, atomic_write, load_task
from ovita.io.files import read_text
from ovita.policy.reading import parse
from ovita.policy.sandbox import Rollout, SandboxLimits, _run
from ovita.toolkit import judge


@click.group(cls=GuessingGroup)
def group() -> None:
    """Check policy files, run them in the sandbox, or list what they may call.

    A policy is Python source: a function adapt(traj, scene, *, ...) or a script that leaves modified_trajectory;
    a model's reply with the code between ``` fences will do as well.
    """


@group.command("check")
@click.argument("files", metavar="FILE.py...", nargs=-1, required=True)
def check_command(files: tuple[str, ...]) -> None:
    """Say whether FILE.py is a policy that may run, and list its parameters; exit code 3 if one is not."""
    sound = [_checked(file) for file in files]
    if not all(sound):
        raise SystemExit(EXIT_NOTHING)


def _checked(file: str) -> bool:
    try:
        policy = parse(read_text(file))
    except PolicyError as error:
        say(f"{file}: {error}")
        return False
    calls = ", toolkit calls only" if policy.toolkit_only else ""
    say(f"{file}: ok ({policy.form}{calls})" + (f": {policy.summary}" if policy.summary else ""))
    for p in policy.parameters:
        say(f"  {p.name} = {p.value!r} {p.unit}".rstrip() + (f"  {p.meaning}" if p.meaning else ""))
    return True


@group.command("catalogue")
@click.argument("names", metavar="[NAME...]", nargs=-1)
@option("--json", "as_json", is_flag=True, help="As a JSON list, for other programs.")
@option("--markdown", is_flag=True, help="As the page docs/toolkit.md; always with all functions.")
def catalogue_command(names: tuple[str, ...], as_json: bool, markdown: bool) -> None:
    """List the functions that a policy may call, or describe those named NAME."""
    from ovita.toolkit.catalogue import CATALOGUE, as_text, describe, extended, page, reference
    from ovita.writers.examples import use_of

    if markdown:
        if names or as_json:
            raise click.UsageError("--markdown is the whole page; leave out --json and names")
        click.echo(page({name: use for name in CATALOGUE if (use := use_of(name))}), nl=False)
        return
    extended()
    try:
        entries = reference(names or None)
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    if as_json:
        click.echo(json.dumps([entry.to_dict() for entry in entries], ensure_ascii=False, indent=1))
    elif names:
        for entry in entries:
            use = use_of(entry.name)
            click.echo(as_text(entry) + (f'\n  For "{use[0]}": {use[1]}\n' if use else "\n"))
    else:
        click.echo(describe())


@group.command("run")
@click.argument("files", metavar="FILE.py...", nargs=-1, required=True)
@option("--scene", "scene_file", metavar="S.json", required=True, help="File with the trajectory and objects.")
@option("--out", metavar="OUT.json", help="Where to write the result; a list of results for several files.")
@option("--param", "params", metavar="NAME=VALUE", multiple=True, help="Another value for a parameter.")
@pick(
    "--isolation",
    "auto strict degraded",
    help="auto: a policy of toolkit calls only runs in process; strict: none does; degraded: without kernel locks.",
)
@shown("--time-limit", type=float, default=5.0, metavar="S", help="For each policy.")
@shown("--memory-limit", type=int, default=1024, metavar="MIB", help="For each policy.")
@option("--kernel-alone", is_flag=True, hidden=True, help="For tests of the sandbox: leave the allowlist out.")
def run_command(files: tuple[str, ...], out: str | None, **options: Any) -> None:
    """Run FILE.py on the trajectory of a scene; exit code 3 if a policy fails, 6 if a promise of one does not hold.

    OUT holds `adapted` ([[x, y, z, speed], ...]), `isolation` and `timings_ms`, and where a policy failed `error`
    with its kind, line and message.
    """
    values = _values(options["params"])
    limits = SandboxLimits(options["time_limit"], options["memory_limit"])
    task = load_task(options["scene_file"])
    settings = {"limits": limits, "isolation": options["isolation"], "checked": not options["kernel_alone"]}
    results = [_run_one(file, read_text(file), task, values, settings) for file in files]
    if out is not None:
        document: Any = results[0] if len(results) == 1 else results
        atomic_write(out, json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n")
    say(*map(_report, results))
    raise SystemExit(_exit_code(results))


def _exit_code(results: list[dict[str, Any]]) -> int:
    if any("error" in result for result in results):
        return EXIT_NOTHING
    kept = all(promise["held"] for result in results for promise in result["expectations"])
    return EXIT_OF["done" if kept else "not_as_meant"]


def _run_one(
    file: str, text: str, task: Task, values: Mapping[str, Any], settings: Mapping[str, Any]
) -> dict[str, Any]:
    started, policy = time.perf_counter(), None
    timings: dict[str, float] = {}
    result: dict[str, Any] = {"file": file, "isolation": settings["isolation"], "timings_ms": timings}
    try:
        policy = parse(text, checked=settings["checked"])
        policy = policy.with_parameters(**values)
        timings["read"] = _since(started)
        rollout = _run(policy, task.trajectory, task.scene, **settings)
        result |= _success(rollout, task)
        result["parameters"] = [{"name": p.name, "value": p.value, "unit": p.unit} for p in policy.parameters]
    except PolicyError as error:
        line = policy.written_line(error.line) if policy is not None else error.line
        result["error"] = {"kind": error.kind, "line": line, "message": error.problem}
    except IsolationUnavailable as error:
        result["error"] = {"kind": "isolation", "line": None, "message": str(error)}
    timings["total"] = _since(started)
    timings["run"] = round(timings["total"] - timings.get("read", timings["total"]), 3)
    return result


def _success(rollout: Rollout, task: Task) -> dict[str, Any]:
    original, adapted = task.trajectory.to_array(), rollout.trajectory.to_array()
    judged = [(e, judge(e, original, adapted, task.scene)) for e in rollout.expectations]
    told = [{"kind": e.kind, "text": e.text, "held": o.held, "outcome": o.sentence} for e, o in judged]
    kept = {"isolation": rollout.isolation, "contacts": list(rollout.contacts)}
    return {"adapted": adapted.tolist(), **kept, "expectations": told, "prints": rollout.prints}


def _report(result: Mapping[str, Any]) -> str:
    error = result.get("error")
    if error is not None:
        where = "" if error["line"] is None else f"line {error['line']}: "
        return f"{result['file']}: {error['kind']}: {where}{error['message']}"
    spent = result["timings_ms"]["run"]
    lines = [f"{result['file']}: {len(result['adapted'])} waypoints in {spent:.0f} ms ({result['isolation']})"]
    for item in result["expectations"]:
        lines.append(f"  {'held' if item['held'] else 'NOT held'}: {item['text']} ({item['outcome']})")
    lines += [f"  | {line}" for line in result["prints"].splitlines()]
    return "\n".join(lines)


def _values(params: tuple[str, ...]) -> dict[str, Any]:
    """Read NAME=VALUE; a value that is not a Python literal is text."""
    values: dict[str, Any] = {}
    for param in params:
        name, sign, text = param.partition("=")
        if not sign or not name.strip().isidentifier():
            raise click.BadParameter(f"{param!r} is not NAME=VALUE", param_hint="--param")
        values[name.strip()] = literal(text)
    return values


def _since(started: float) -> float:
    return round((time.perf_counter() - started) * 1000.0, 3)
