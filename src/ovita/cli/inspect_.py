"""`ovita augment inspect`: what is in a dataset, single samples, a sheet of pictures, and everything checked anew."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ovita.cli.common import plain, section, show, waiting

if TYPE_CHECKING:
    from ovita.augment.sample import AugmentedSample

EXIT_UNSOUND = 4

_ROW = 12


@click.command()
@click.argument("folder", metavar="FOLDER", type=click.Path(path_type=Path))
@click.option(
    "--samples", "count", type=click.IntRange(0, 1000), metavar="N", help="How many to show. [3; 12 on a sheet]"
)
@click.option("--sample", "index", type=click.IntRange(0), metavar="I", help="Show sample I whole.")
@click.option(
    "--out", "-o", metavar="FILE", help="Write sample I as a result, for ovita plot, explain, simulate ... (JSON)."
)
@click.option("--plot", "picture", metavar="FILE", help="Draw the samples on a sheet, or sample I (.png, .svg, .pdf).")
@click.option("--verify", "verifying", is_flag=True, help="Look at every file's SHA-256 and judge every sample anew.")
@click.option("--json", "as_json", is_flag=True, help="Print the manifest, or sample I, as JSON.")
def inspect(
    folder: Path,
    count: int | None,
    index: int | None,
    out: str | None,
    picture: str | None,
    verifying: bool,
    as_json: bool,
) -> None:
    """Show what is in the dataset of FOLDER; exit code 4 if --verify finds something wrong."""
    from ovita.augment.inspection import open_manifest, sample_at, samples_from_all_over

    if out is not None and index is None:
        raise click.UsageError("--out writes one sample; say which: --sample 12")
    manifest = open_manifest(folder)
    if verifying:
        _verify(folder, manifest)
    elif index is not None:
        _one(sample_at(folder, manifest, index), out, picture, as_json)
    elif as_json:
        click.echo(json.dumps(manifest, indent=1, ensure_ascii=False))
    else:
        shown = samples_from_all_over(folder, manifest, count if count is not None else 12 if picture else 3)
        if picture is not None:
            _sheet(picture, shown)
        _overview(folder, manifest, shown[: count if count is not None else 3])


def _overview(folder: Path, manifest: Mapping[str, Any], shown: Sequence[AugmentedSample]) -> None:
    """Print counts, spreads, reasons of rejection and a few samples."""
    kept, tried = manifest["kept"], manifest["n"]
    files = [file for part in (*manifest["shards"], manifest) for file in part["files"]]
    size = sum(file["bytes"] for file in files)
    click.echo(
        plain(f"{folder}: {kept:,} samples of {tried:,} numbers, seed {manifest['seed']}, ovita {manifest['version']}")
    )
    formats = ", ".join(manifest["formats"])
    click.echo(
        plain(f"{len(files)} files, {size / 1e6:.1f} MB in {formats}; {size / max(kept, 1):,.0f} bytes a sample")
    )
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
    return [
        f"{name:{wide}}  {count:8,}  {count / total:4.0%}  {'#' * round(30 * count / total)}" for name, count in ranked
    ]


def _rejected(rejected: Mapping[str, int]) -> list[str]:
    from ovita.augment.verified import REASONS

    ranked = sorted(rejected.items(), key=lambda pair: (-pair[1], pair[0]))
    return [f"{count:8,}  {name}: {REASONS.get(name, '')}" for name, count in ranked]


def _lines(sample: AugmentedSample) -> list[str]:
    others = "; ".join(sample.paraphrases[:3])
    return [
        f"[{sample.index}] {sample.instruction!r} ({sample.family}, {sample.split}, {sample.verdict}; {sample.source})",
        f"    also: {others}" if others else "    no paraphrases",
        f"    check: {sample.measured.get('sentence', '')}",
    ]


def _one(sample: AugmentedSample, out: str | None, picture: str | None, as_json: bool) -> None:
    """Show one sample whole, made anew as a result."""
    from ovita.augment.inspection import result_of

    result, same = result_of(sample)
    if out is not None:
        result.save(out)
    if picture is not None:
        result.plot(picture)
    if as_json:
        click.echo(json.dumps(sample.to_dict(), indent=1, ensure_ascii=False))
        return
    for line in _lines(sample):
        click.echo(plain(line))
    section("Paraphrases", sample.paraphrases)
    section("Meaning", [json.dumps(frame, ensure_ascii=False) for frame in sample.frames])
    holds = "passes" if sample.holds() else "does not pass"
    section("Check", [json.dumps(sample.check, ensure_ascii=False), f"judged anew it {holds}"])
    agrees = "gives the recorded motion" if same else "gives another motion than the recorded one"
    section("Made anew", [f"the policy for this meaning, run once more with the limits, {agrees}"])
    click.echo()
    show(result, code=True)
    for file in (out, picture):
        if file is not None:
            click.echo(plain(f"\nwrote {file}"))


def _sheet(picture: str, shown: Sequence[AugmentedSample]) -> None:
    from ovita.augment.sheet import sheet
    from ovita.plots import save

    save(picture, sheet(shown))
    click.echo(plain(f"wrote {picture}: {len(shown)} samples"))


def _verify(folder: Path, manifest: Mapping[str, Any]) -> None:
    from ovita.augment.inspection import verify

    with waiting("checking") as progress:
        found = verify(folder, manifest, progress)
    for sentence in found.sentences():
        click.echo(plain(sentence))
    if not found.sound:
        raise SystemExit(EXIT_UNSOUND)
