"""The card of a dataset: what it is made of, how, what was measured, whose licences hold, and what it is not."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import Any

from ovita.augment.shards import SPLITS, ShardFile, Sink, written
from ovita.augment.verified import REASONS
from ovita.errors import RequestError
from ovita.io.documents import listing
from ovita.text import counted

CARD = "README.md"

OURS = "ovita's own, Apache-2.0"
"""The licence of random scenes."""

NOT_STATED = "not stated"
"""The licence of a source of which nobody said one."""

_SPREADS = {
    "family": "Kind of request",
    "robot": "Robot",
    "verdict": "Verdict",
    "direction": "Direction",
    "region": "Part of the path",
    "magnitude": "First number of the request",
    "shift": "Largest displacement",
    "waypoints": "Waypoints",
    "words": "Words of the instruction",
}
"""Distributions of the manifest that the card shows, with their headings."""

_HUBS = {"train": "train", "val": "validation", "test": "test"}
_SIZES = (10**3, 10**4, 10**5, 10**6, 10**7, 10**8, 10**9)
_RANGES = ("n<1K", "1K<n<10K", "10K<n<100K", "100K<n<1M", "1M<n<10M", "10M<n<100M", "100M<n<1B", "n>1B")

_IS_NOT = """\
- No recording of a robot. Every motion was computed and none executed; no camera saw it, so there are no pictures.
- No proof that a robot can follow: the limits of the robot named in a sample hold for the path (workspace, speed,
  acceleration, distance to objects); its joints and its dynamics were not asked. Samples without a robot only keep
  clear of the objects. `ovita simulate` tries a motion in physics.
- No natural speech: the sentences come from a grammar. Judge a reader of language on sentences of people.
- No clean test of understanding by itself: the check measures what the frames ask for, and the sentence was rendered
  from the same frames. It says that the motion does what was meant, and not that every person would put it so.
- English only; objects are boxes with a name and a size.
"""


@dataclass(frozen=True)
class DatasetCard(Sink):
    """Writes the card as README.md, once all shards are there; the other sinks come before it.

    Args:
        licences: Names of sources with their licences, as the maker of the dataset gives them.
    """

    licences: tuple[tuple[str, str], ...] = ()
    name = "card"

    def finish(self, folder: Path, manifest: Mapping[str, Any]) -> Sequence[ShardFile]:
        """Write the card from the manifest."""
        return [written(folder, CARD, card(manifest, dict(self.licences)).encode("utf-8"))]


def licences_from(stated: Sequence[str], sources: Sequence[str]) -> tuple[tuple[str, str], ...]:
    """The licence of each source from texts such as "demos/=CC-BY-4.0"; one without a source holds for all others.

    Raises:
        RequestError: If a text names no licence, or a source that is not there.
    """
    found = {name: OURS if name.startswith("random:") else NOT_STATED for name in sources}
    pairs = [(text, *(part.strip() for part in text.rpartition("="))) for text in stated]
    for text, source, given, licence in sorted(pairs, key=lambda pair: bool(pair[2])):
        if not licence or (given and not source):
            raise RequestError(f"--licence {text!r}: say a licence, or SOURCE=LICENCE, such as demos/=CC-BY-4.0")
        mine = [name for name in sources if (_is_of(name, source) if given else found[name] != OURS)]
        if given and not mine:
            raise RequestError(f"--licence {text!r}: there is no source {source!r}; the sources are {listing(sources)}")
        found |= dict.fromkeys(mine, licence)
    return tuple(found.items())


def _is_of(name: str, source: str) -> bool:
    """Whether a source, "file:demos/a.json", is the one that a person names: "file:...", "x/demos/", "a.json"."""
    inside, wanted = PurePath(name.partition(":")[2] or name), PurePath(source)
    places = {name, inside.as_posix(), inside.name, inside.parent.name} - {""}
    return bool({source, wanted.as_posix(), wanted.name} & places)


def card(manifest: Mapping[str, Any], licences: Mapping[str, str]) -> str:
    """The card as Markdown with the header that data set hubs read."""
    kept, splits = manifest["kept"], manifest["counts"].get("split", {})
    named = [(source["name"], source["what"]) for source in manifest["sources"]]
    sources = [(name, what, licences.get(name, NOT_STATED)) for name, what in named]
    own = [f"{name} {splits[name]:,}" for name in SPLITS if name in splits]
    parts = [
        _header(manifest, {licence for _, _, licence in sources}),
        f"# {counted(kept, 'verified pair')} of language and motion",
        f"Made by `ovita augment` {manifest['version']}. A sample is a trajectory in a scene, an instruction about it"
        " with paraphrases, its meaning as frames, the trajectory after the adaptation, the policy that made it, and a"
        f" check. Splits: {', '.join(own)}; all samples of a scene are in the same.",
        "## Sources and licences",
        _table(("source", "what", "licence"), sources),
        "A licence is what the maker of the dataset said of the source; nothing was looked up. It goes with every"
        " sample of the source. The sentences, policies and checks are ovita's, Apache-2.0.",
        "## How it was made",
        _table(("", ""), _facts(manifest)),
        "The same command with the same version of ovita makes the same bytes; `manifest.json` has the SHA-256 of every"
        " file.",
        "## Checks",
        "Each sample was kept only if its own check, which measures the motion and knows neither the policy nor what it"
        " promises, passed after the limits were enforced, and fails for the motion as it was before.",
        _rejections(manifest["rejected"], kept),
        "## How the samples spread",
        *(_spread(title, manifest["counts"].get(name, {}), kept) for name, title in _SPREADS.items()),
        "## What it is not",
        _IS_NOT.rstrip(),
        "## Reading it",
        "```sh\novita augment inspect .                  # counts, and a few samples\n"
        "ovita augment inspect . --sample 12      # one sample; --out result.json opens it elsewhere\n"
        "ovita augment inspect . --verify         # every file and every check anew\n```\n\n"
        "In Python: `ovita.augment.formats.read(folder)` gives the samples, whichever the format.",
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _header(manifest: Mapping[str, Any], licences: set[str]) -> str:
    """The YAML header that data set hubs read."""
    kept, formats = manifest["kept"], manifest["formats"]
    size = _RANGES[bisect_right(_SIZES, kept)]
    free = licences <= {OURS}
    lines = [
        "---",
        "license: apache-2.0" if free else "license: other",
        *([] if free else ["license_name: see-sources"]),
        "language: [en]",
        "task_categories: [robotics]",
        f"tags: [ovita, trajectory, language, synthetic{', LeRobot' if 'lerobot' in ' '.join(formats) else ''}]",
        f"size_categories: [{size}]",
    ]
    if {"parquet", "lerobot", "lerobot-language"} & set(formats):
        lines += ["configs:", "- config_name: default", "  data_files:"]
        there = [split for split in SPLITS if manifest["counts"].get("split", {}).get(split)]
        lines += [f"  - split: {_HUBS[split]}\n    path: parquet/{split}/*.parquet" for split in there]
    return "\n".join([*lines, "---"])


def _facts(manifest: Mapping[str, Any]) -> list[tuple[str, str]]:
    return [
        ("seed", str(manifest["seed"])),
        ("numbers tried", f"{manifest['n']:,}; sample i depends on the seed, the sources and i alone"),
        ("kept", f"{manifest['kept']:,}"),
        ("paraphrases a sample", str(manifest["paraphrases"])),
        ("samples of one scene in a row", str(manifest["block"])),
        ("families", ", ".join(manifest["families"])),
        ("formats", ", ".join(name for name in manifest["formats"] if name != "card")),
        ("wordings (SHA-256)", f"`{manifest['wordings'][:16]}`"),
    ]


def _rejections(rejected: Mapping[str, int], kept: int) -> str:
    draws = {name: count for name, count in rejected.items() if name != "exhausted"}
    if not draws:
        return "No draw was rejected."
    ranked = sorted(draws.items(), key=lambda pair: (-pair[1], pair[0]))
    total, empty = sum(draws.values()), rejected.get("exhausted", 0)
    said = f"{total:,} of {kept + total:,} draws were rejected"
    said += f", and for {counted(empty, 'number')} no draw passed:" if empty else ":"
    return f"{said}\n\n{_table(('draws', 'why'), [(f'{count:,}', REASONS.get(name, name)) for name, count in ranked])}"


def _spread(title: str, counts: Mapping[str, int], kept: int) -> str:
    if not counts:
        return ""
    ranked = sorted(counts.items(), key=lambda pair: (-pair[1], pair[0]))
    said = ", ".join(f"{name} {count:,} ({_share(count, kept)})" for name, count in ranked)
    return f"**{title}.** {said}"


def _share(count: int, total: int) -> str:
    share = count / max(total, 1)
    return "< 1%" if 0 < share < 0.005 else f"{share:.0%}"


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in Markdown; a bar in a cell cannot end it."""
    safe = [[cell.replace("|", "\\|").replace("\n", " ") for cell in row] for row in rows]
    return "\n".join(f"| {' | '.join(row)} |" for row in (heads, ["---"] * len(heads), *safe))
