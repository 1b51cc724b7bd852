"""`ovita augment`: verified pairs of language and motion at any scale, and a look into them."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click import option

from ovita.cli.common import ENGINE, EXIT_REFUSED, counting, names_in, say, section, show, show_notes, shown, waiting
from ovita.cli.main import GuessingGroup

if TYPE_CHECKING:
    from ovita.augment.engine import AugmentedDataset, Job, Progressed
    from ovita.augment.shards import AugmentedSample


class _MakingGroup(GuessingGroup):
    """A group whose command `make` is meant where no command is named."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Put `make` in front of sources and options."""
        if args and args[0] not in (*self.commands, "--help", "-h"):
            args = ["make", *args]
        return super().parse_args(ctx, args)


@click.group(cls=_MakingGroup)
def group() -> None:
    """Make pairs of language and motion, each verified by its own check.

    `ovita augment random --n 1000 --out data` makes 1000 of random scenes, as without
    SOURCES; these may also be files with
    trajectories, folders, LeRobot data sets, skills, and scenes without a trajectory. `make` is understood where no
    command is named.
    """


@group.command()
@click.argument("sources", nargs=-1, metavar="[SOURCES]...")
@shown("--n", type=click.IntRange(1), default=1000, help="Samples.")
@option("--out", "-o", metavar="FOLDER", help="Where the dataset goes. [ovita-augmented]")
@option("--families", default="", metavar="LIST", help="Kinds of requests, such as shift,distance,speed. [all]")
@shown("--paraphrases", type=click.IntRange(0, 50), default=4, help="Further sentences each.")
@shown("--seed", type=click.IntRange(0), default=0)
@shown(
    "--format",
    "formats",
    default="jsonl",
    metavar="LIST",
    help="jsonl, parquet, lerobot, lerobot-language, scenes, mcap, or several: jsonl,lerobot.",
)
@option(
    "--licence",
    "licences",
    multiple=True,
    metavar="[SOURCE=]TEXT",
    help="Licence of the sources, or of one, for the dataset's card; may be repeated.",
)
@option("--robot", metavar="NAME|FILE", help="Whose limits hold. [what each file names, else none]")
@option("--waypoints", type=click.IntRange(8, 2000), metavar="N", help="Of random scenes. [as the scale has it]")
@shown(
    "--repairs",
    type=click.FloatRange(0, 1),
    default=0.05,
    help="Share of the draws that break a limit with their path which the solver repairs; the others are drawn anew.",
)
@option(
    "--voices", metavar="FOLDER", help="What people wrote, whose wordings are used, too; as training/corpus/voices."
)
@option("--plan", type=click.FloatRange(1), metavar="N", help="Make nothing: say what N samples would take.")
@option("--machine", "machines", multiple=True, metavar="NAME=CORES,PRICE", help="For --plan; may be given again.")
@shown("--jobs", type=click.IntRange(1, 1024), default=1, help="Workers.")
@ENGINE
@shown("--shard", type=click.IntRange(1, 1_000_000), default=1000, help="Samples a shard.")
def make(sources: tuple[str, ...], out: str | None, families: str, formats: str, **options: Any) -> None:
    """Make a dataset of SOURCES. Run it again to go on after an interruption."""
    from ovita.augment.card import licences_from
    from ovita.augment.engine import Job, run
    from ovita.augment.formats import sinks_named
    from ovita.augment.sources import open_pool
    from ovita.augment.verified import Manner
    from ovita.augment.wording import families_from, with_voices

    chosen = families_from(names_in(families))
    manner = Manner(options["seed"], chosen, options["paraphrases"], options["repairs"])
    pool, notes = open_pool(sources, robot=options["robot"], waypoints=options["waypoints"])
    licences = licences_from(options["licences"], [source["name"] for source in pool.describe()])
    sinks = sinks_named(names_in(formats), licences)
    show_notes(notes)
    wordings = None if options["voices"] is None else with_voices(options["voices"])
    job = Job(options["n"], manner, pool, sinks, options["shard"], wordings=wordings)
    if options["plan"] is not None:
        _plan(job, options["plan"], options["machines"])
        return
    _show(run(job, out or "ovita-augmented", jobs=options["jobs"], engine=options["engine"], progress=_progress()))


def _plan(job: Job, n: float, machines: tuple[str, ...]) -> None:
    from ovita.augment.engine import Machine, lines, measure

    say(*lines(n, measure(job), [Machine.parse(text) for text in machines], job.shard))


def _progress() -> Callable[[Progressed], None]:
    tell, live = counting(), sys.stderr.isatty()
    return lambda at: tell(f"{at.done} of {at.shards} shards, {at.kept} samples", live and at.done == at.shards)


def _show(done: AugmentedDataset) -> None:
    from ovita.augment.inspection import files_of

    manifest = done.manifest
    click.echo(f"{done.kept} verified samples are in {done.folder} ({done.seconds:.1f} s for {done.made} shards)")
    size = sum(file["bytes"] for file in files_of(manifest))
    click.echo(f"{size / 1e3:.0f} kB; every sample passed its own check after the limits")
    missing = int(manifest["n"]) - done.kept
    if missing:
        click.echo(f"{missing} of {manifest['n']} are missing: no draw for them passed, or they said what another says")
    section("Draws that were rejected", _rejected(manifest["rejected"]))
    click.echo("\nHow they spread")
    for name in ("family", "split", "robot", "verdict", "region", "direction"):
        counts = manifest["counts"].get(name, {})
        click.echo(f"  {name}: " + ", ".join(f"{key} {count}" for key, count in counts.items()))


_ROW = 12


@group.command()
@click.argument("folder", metavar="FOLDER", type=click.Path(path_type=Path))
@option("--samples", "count", type=click.IntRange(0, 1000), metavar="N", help="How many to show. [3; 12 on a sheet]")
@option("--sample", "index", type=click.IntRange(0), metavar="I", help="Show sample I whole.")
@option("--out", "-o", metavar="FILE", help="Write sample I as a result, for ovita plot, explain, simulate ... (JSON).")
@option("--plot", "picture", metavar="FILE", help="Draw the samples on a sheet, or sample I (.png, .svg, .pdf).")
@option("--verify", "verifying", is_flag=True, help="Look at every file's SHA-256 and judge every sample anew.")
@option("--json", "as_json", is_flag=True, help="Print the manifest, or sample I, as JSON.")
def inspect(folder: Path, index: int | None, out: str | None, picture: str | None, as_json: bool, **more: Any) -> None:
    """Show what is in the dataset of FOLDER; exit code 4 if --verify finds something wrong."""
    from ovita.augment.inspection import open_manifest, sample_at, samples_from_all_over

    if out is not None and index is None:
        raise click.UsageError("--out writes one sample; say which: --sample 12")
    manifest, told = open_manifest(folder), 3 if more["count"] is None else more["count"]
    if more["verifying"]:
        _verify(folder, manifest)
    elif index is not None:
        _one(sample_at(folder, manifest, index), out, picture, as_json)
    elif as_json:
        click.echo(json.dumps(manifest, indent=1, ensure_ascii=False))
    elif picture is None:
        _overview(folder, manifest, samples_from_all_over(folder, manifest, told))
    else:
        drawn = samples_from_all_over(folder, manifest, 12 if more["count"] is None else told)
        _sheet(picture, drawn)
        _overview(folder, manifest, drawn[:told])


def _overview(folder: Path, manifest: Mapping[str, Any], shown: Sequence[AugmentedSample]) -> None:
    """Print counts, spreads, reasons of rejection and a few samples."""
    from ovita.augment.inspection import files_of

    kept, tried = manifest["kept"], manifest["n"]
    files = files_of(manifest)
    size = sum(file["bytes"] for file in files)
    say(f"{folder}: {kept:,} samples of {tried:,} numbers, seed {manifest['seed']}, ovita {manifest['version']}")
    formats = ", ".join(manifest["formats"])
    say(f"{len(files)} files, {size / 1e6:.1f} MB in {formats}; {size / max(kept, 1):,.0f} bytes a sample")
    section("Sources", [f"{source['name']}: {source['what']}" for source in manifest["sources"]])
    for name, counts in manifest["counts"].items():
        section(name.capitalize(), _bars(counts))
    section("Draws that were rejected", _rejected(manifest["rejected"]))
    section("Some samples", [line for sample in shown for line in _lines(sample)])


def _bars(counts: Mapping[str, int]) -> list[str]:
    """Counts as lines with bars, the greatest first; the least are put together."""
    ranked = sorted(counts.items(), key=lambda pair: (-pair[1], pair[0]))
    rest = sum(count for _, count in ranked[_ROW:])
    ranked = [*ranked[:_ROW], *([(f"{len(ranked) - _ROW} others", rest)] if rest else [])]
    total, wide = sum(counts.values()), max(len(name) for name, _ in ranked)
    return [f"{name:{wide}}  {n:8,}  {n / total:4.0%}  {'#' * round(30 * n / total)}" for name, n in ranked]


def _rejected(rejected: Mapping[str, int]) -> list[str]:
    from ovita.augment.verified import REASONS

    ranked = sorted(rejected.items(), key=lambda pair: (-pair[1], pair[0]))
    return [f"{count:8,}  {name}: {REASONS.get(name, '')}" for name, count in ranked]


def _lines(sample: AugmentedSample) -> list[str]:
    others = "; ".join(sample.paraphrases[:3])
    about = f"{sample.family}, {sample.split}, {sample.verdict}; {sample.source}"
    also = f"    also: {others}" if others else "    no paraphrases"
    check = f"    check: {sample.measured.get('sentence', '')}"
    return [f"[{sample.index}] {sample.instruction!r} ({about})", also, check]


def _one(sample: AugmentedSample, out: str | None, picture: str | None, as_json: bool) -> None:
    from ovita.augment.inspection import result_of

    result, same = result_of(sample)
    if out is not None:
        result.save(out)
    if picture is not None:
        result.plot(picture)
    if as_json:
        click.echo(json.dumps(sample.to_dict(), indent=1, ensure_ascii=False))
        return
    say(*_lines(sample))
    section("Paraphrases", sample.paraphrases)
    section("Meaning", [json.dumps(frame, ensure_ascii=False) for frame in sample.frames])
    holds = "passes" if sample.holds() else "does not pass"
    section("Check", [json.dumps(sample.check, ensure_ascii=False), f"judged anew it {holds}"])
    agrees = "gives the recorded motion" if same else "gives another motion than the recorded one"
    section("Made anew", [f"the policy for this meaning, run once more with the limits, {agrees}"])
    click.echo()
    show(result, code=True)
    say(*(f"\nwrote {file}" for file in (out, picture) if file is not None))


def _sheet(picture: str, shown: Sequence[AugmentedSample]) -> None:
    from ovita.augment.sheet import sheet
    from ovita.plots import save

    save(picture, sheet(shown))
    say(f"wrote {picture}: {len(shown)} samples")


def _verify(folder: Path, manifest: Mapping[str, Any]) -> None:
    from ovita.augment.inspection import verify

    with waiting("checking") as progress:
        found = verify(folder, manifest, progress)
    say(*found.sentences())
    if not found.sound:
        raise SystemExit(EXIT_REFUSED)
