"""Entry point of the `ovita` command; each subcommand is imported only when it runs."""

from __future__ import annotations

import io
import os
import sys
import warnings
from collections.abc import Callable
from difflib import get_close_matches
from importlib import import_module
from typing import Any

import click

from ovita.errors import MissingExtra, OvitaError, WriterError
from ovita.plugins import PluginWarning

EXIT_INPUT, EXIT_WRITER, EXIT_INFEASIBLE = 2, 3, 4

COMMANDS: dict[str, tuple[str, str]] = {
    "adapt": ("ovita.cli.adapt_:command", "Adapt a trajectory to an instruction."),
    "augment": ("ovita.cli.augment_:group", "Make verified pairs of language and motion, at any scale."),
    "bench": ("ovita.cli.bench_:group", "Measure writers over a dataset with machine-checkable outcomes."),
    "chat": ("ovita.cli.sessions_:chat", "Adapt in a conversation: feedback, undo, save."),
    "convert": ("ovita.cli.transfer_:convert", "Convert a trajectory: ROS bags, drone missions, TUM, CSV, JSON."),
    "demo": ("ovita.cli.adapt_:demo", "Adapt a shipped scene three times and save the pictures."),
    "explain": ("ovita.cli.adapt_:explain", "Explain a result in plain words."),
    "gate": ("ovita.cli.transfer_:gate", "The log of what was sent, and keys that sign results."),
    "generate": (
        "ovita.cli.sources_:generate",
        "Generate a trajectory of a skill: other ends, via-points, moved objects.",
    ),
    "learn": ("ovita.cli.sources_:learn", "Learn a skill from demonstrations: KMP, ProMP, DMP or TP-GMM."),
    "models": ("ovita.cli.models_:group", "Local models: list them, fetch one, add a file, try one."),
    "perceive": ("ovita.cli.perceive_:command", "Find the things in pictures with depth; write a scene."),
    "plan": ("ovita.cli.sources_:plan", "Plan a trajectory from place to place."),
    "plot": ("ovita.cli.adapt_:plot", "Draw a result or a scene: PNG, SVG, PDF, or an interactive page."),
    "plugins": ("ovita.cli.models_:plugins", "List what other packages add: writers, robots, formats and more."),
    "policy": ("ovita.cli.policy_:group", "Check or run policy files in the sandbox."),
    "read": ("ovita.cli.read_:command", "Show how a sentence is understood, reader by reader."),
    "ros": ("ovita.cli.ros_:group", "Look at ROS 2's topics, with or without a ROS installation."),
    "send": ("ovita.cli.transfer_:send", "Verify a result once more and send it to a robot."),
    "serve": ("ovita.cli.serve_:group", "Serve agents and programs: MCP and REST, within rules that you set."),
    "simulate": ("ovita.cli.simulate_:command", "Let a robot follow a result or a trajectory in simulation; video."),
    "study": ("ovita.cli.study_:group", "Let people judge results, blinded and balanced; analyse what they say."),
    "studio": ("ovita.cli.sessions_:studio", "See it, say it, turn the knobs, in the browser."),
    "tour": ("ovita.cli.adapt_:tour", "Show in five steps what ovita does."),
}


class GuessingGroup(click.Group):
    """A group that guesses which command a mistyped name means."""

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the command, or refuse with the name that is most like the one given."""
        known = self.list_commands(ctx)
        if args and args[0] not in known and not args[0].startswith("-"):
            near = get_close_matches(args[0], known, n=1)
            hint = f"did you mean {near[0]!r}?" if near else f"the commands are {', '.join(known)}"
            raise click.UsageError(f"there is no command {args[0]!r}; {hint}")
        return super().resolve_command(ctx, args)


class _LazyGroup(GuessingGroup):
    """A group whose commands are imported on use, so that `--help` is instant."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        module, _, name = COMMANDS[cmd_name][0].partition(":")
        command: click.Command = getattr(import_module(module), name)
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl([(name, short) for name, (_, short) in COMMANDS.items()])


@click.command(cls=_LazyGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="ovita")
def cli() -> None:
    """Change how a robot moves by saying so.

    Start with `ovita tour`, or: ovita adapt SCENE.json "Go left by 0.2 and slow down near the cup"

    Exit codes: 0 done; 2 bad usage or input; 3 not done (not understood, a question, a proposal that waits for a yes,
    or the writer failed);
    4 infeasible (the limits cannot all hold; the best effort is written and flagged), or a result may not be sent to a
    robot; 5 done, but changed by the limits, or breaking one that the original path broke already; 6 not as meant.
    """


def main() -> None:
    """Run the command line; a user's mistake gives one sentence and an exit code, never a traceback."""
    for library in ("OPENBLAS", "MKL", "OMP"):
        # Our matrices are small: on a busy machine, threads that wait for each other take ten times the work.
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # a terminal may lack the letters of a name
    with warnings.catch_warnings():
        warnings.simplefilter("always", PluginWarning)
        warnings.showwarning = _shown(warnings.showwarning)
        _run()


def _shown(otherwise: Callable[..., None]) -> Callable[..., None]:
    """How warnings are shown: those that are meant for the user as a sentence, without a place in the code."""

    def show(message: Warning | str, category: type[Warning], *where: Any) -> None:
        if issubclass(category, PluginWarning):
            click.echo(f"warning: {message}", err=True)
        else:
            otherwise(message, category, *where)

    return show


def _run() -> None:
    try:
        cli(standalone_mode=False)
    except click.ClickException as error:
        click.echo(f"error: {error.format_message()}", err=True)
        sys.exit(error.exit_code)
    except (click.Abort, KeyboardInterrupt):
        click.echo("stopped", err=True)
        sys.exit(130)
    except OvitaError as error:
        click.echo(f"error: {error}", err=True)
        sys.exit(EXIT_WRITER if isinstance(error, WriterError) and not isinstance(error, MissingExtra) else EXIT_INPUT)
    except OSError as error:
        if isinstance(error, BrokenPipeError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            sys.exit(0)
        click.echo(f"error: the output cannot be written: {error.strerror}", err=True)
        sys.exit(EXIT_INPUT)
