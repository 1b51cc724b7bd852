"""Train the network that finds the way in a sentence (`sources/tagging.py`), on top of the learned reader's encoder.

`python training/ways.py` trains on every voice of training/corpus/ways and writes src/ovita/sources/ways.npz;
`--judge` trains on three quarters of the voices, four times, and prints how much of the others it reads right.
In the corpus, {S ...} is where a way starts, {V ...} what it passes, {G ...} where it ends, {R ...} another wish and
{W ...} a wait. To be run again whenever the encoder was trained anew.
"""

from __future__ import annotations

import argparse
import hashlib
import random
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

sys.path.insert(0, str(Path(__file__).parent / "corpus"))

from check import examples

from ovita.instruct import frames as F
from ovita.instruct.sketch import Sketch
from ovita.paths.scene import Scene, SceneObject
from ovita.sources import tagging
from ovita.sources.places import Text

CORPUS = Path(__file__).parent / "corpus" / "ways"
VOICES = CORPUS.parent / "voices"
OUT = Path(__file__).parents[1] / "src" / "ovita" / "sources" / tagging.WEIGHTS
ROLE = dict(zip("SVGRW", tagging.ROLES, strict=True))
HIDDEN, DROPPED, EPOCHS, BATCH, RATE, DECAY, SEED = 96, 0.3, 12, 8, 1e-3, 0.01, 4
LAST_RATE = 0.02
"""The share of the rate that is left at the end."""

WEIGHT_OF_MOVES = 0.3
REPEATED = 8
"""How often a sentence of the corpus counts, beside those that are put together."""


@dataclass(frozen=True)
class Line:
    """A sentence of the corpus with its phrases."""

    voice: str
    text: str
    phrases: tuple[tagging.TaggedPhrase, ...]
    scene: Scene


def lines(folder: Path = CORPUS) -> list[Line]:
    """Every sentence of every voice."""
    found = []
    for path in sorted(folder.glob("*.txt")):
        scene = Scene(())
        for row in path.read_text(encoding="utf-8").splitlines():
            if row.startswith("# objects:"):
                names = [name.strip() for name in row.removeprefix("# objects:").split(";")]
                scene = Scene(tuple(SceneObject(n, [k, 0.3 * k, 0.5], [0.2] * 3) for k, n in enumerate(names)))
            elif row and not row.startswith("#"):
                found.append(Line(path.stem, *marked(row), scene))
    return found


def marked(row: str) -> tuple[str, tuple[tagging.TaggedPhrase, ...]]:
    """A sentence without its brackets, and what stood in them."""
    text, phrases, opened = "", [], 0
    role: tagging.Role = "wish"
    k = 0
    while k < len(row):
        if row[k] == "{":
            role, opened, k = ROLE[row[k + 1]], len(text), k + 3
        elif row[k] == "}":
            phrases.append(tagging.TaggedPhrase(role, (opened, len(text))))
            k += 1
        else:
            text, k = text + row[k], k + 1
    return text, tuple(phrases)


def seen(line: Line) -> Sketch:
    """The sentence as the tagger sees it."""
    points = [piece.span for piece in Text(line.text, line.scene).pieces if piece.point is not None]
    return tagging.seen_with_points(line.text, line.scene, points)


def labels(line: Line, sketch: Sketch) -> list[int]:
    """The label of each word."""
    found, before = [], None
    for piece in sketch.pieces:
        begin, end = piece.words or (0, 0)
        phrase = next((p for p in line.phrases if p.span[0] <= (begin + end) / 2 < p.span[1]), None)
        place = "inside" if phrase is before else "begin"
        found.append(tagging.LABELS.index(f"{place}-{phrase.role}") if phrase and phrase.role else 0)
        before = phrase
    return found


def trained(rows: list[tuple[np.ndarray, list[int]]], seed: int = SEED) -> dict[str, np.ndarray]:
    """The tagger's weights."""
    torch.manual_seed(seed)
    torch.set_num_threads(1)
    every = np.concatenate([x for x, _ in rows])
    mean, scale = every.mean(axis=0), every.std(axis=0) + 1e-3
    drop = torch.nn.Dropout(DROPPED)
    one, two = torch.nn.Linear(every.shape[1], HIDDEN), torch.nn.Linear(HIDDEN, len(tagging.LABELS))
    net = torch.nn.Sequential(drop, one, torch.nn.ReLU(), torch.nn.Dropout(DROPPED), two)
    steps = torch.optim.AdamW(net.parameters(), lr=RATE, weight_decay=DECAY)
    xs = [torch.tensor(((x - mean) / scale).astype(np.float32)) for x, _ in rows]
    ys = [torch.tensor(y) for _, y in rows]
    slower = torch.optim.lr_scheduler.LinearLR(steps, 1.0, LAST_RATE, EPOCHS * -(-len(rows) // BATCH))
    for _ in range(EPOCHS):
        for batch in torch.randperm(len(rows)).split(BATCH):
            x, y = torch.cat([xs[i] for i in batch]), torch.cat([ys[i] for i in batch])
            steps.zero_grad()
            (torch.nn.functional.cross_entropy(net(x), y, reduction="sum") / 100).backward()
            steps.step()
            slower.step()
    moves = np.full((len(tagging.LABELS) + 1, len(tagging.LABELS)), 0.05)
    for _, y in rows:
        np.add.at(moves, ([len(tagging.LABELS), *y[:-1]], y), 1.0)
    logs = WEIGHT_OF_MOVES * np.maximum(np.log(moves / moves.sum(axis=1, keepdims=True)), -6.0)
    layers = {"in": one.weight.T, "in.bias": one.bias, "out": two.weight.T, "out.bias": two.bias}
    arrays = {name: value.detach().numpy() for name, value in layers.items()}
    return {name: v.astype(np.float16) for name, v in (arrays | {"mean": mean, "scale": scale, "moves": logs}).items()}


def ways(sketch: Sketch, phrases: tuple[tagging.TaggedPhrase, ...]) -> list[tuple[str, tuple[int, ...]]]:
    """The places of a way: the role of each phrase and the objects in it."""
    named = [
        (p.words or (0, 0), p.mention) for p in sketch.pieces if p.mention >= 0 and sketch.mentions[p.mention].items
    ]
    found = [(p.role, tuple(m for (at, _), m in named if p.span[0] <= at < p.span[1])) for p in phrases]
    return [(role, objects) for role, objects in found if role in ("start", "via", "goal") and objects]


ASIDES = (CORPUS / "asides").read_text(encoding="utf-8").splitlines()
"""What people add that asks for nothing: why they want it, what they will do meanwhile, what something is like."""

SPOKEN_ASIDE = 0.3
"""How many of the sentences that are put together hold one of these."""

PHRASES = tomllib.loads((CORPUS / "phrases.toml").read_text(encoding="utf-8"))
NAMES = "box cup plate crate lamp chair table bench tower flag door tent tray bowl rack wall tree sofa".split()
SAID_AS: dict[type, tagging.Role] = {
    F.Visit: "via", F.Side: "via", F.Wait: "wait", F.Pace: "wish", F.Clearance: "wish", F.Height: "wish",
    F.Figure: "wish",
}  # fmt: skip
"""What a frame of the first requests of the voices is in a sentence that has no trajectory yet."""

LONGEST = 16
"""Words of a request that becomes a part of a sentence."""


def spoken() -> dict[tagging.Role, list[tuple[str, tuple[str, ...]]]]:
    """What the training voices say of one thing, by what it would be beside a way, with the objects of the scene."""
    found: dict[tagging.Role, list[tuple[str, tuple[str, ...]]]] = {role: [] for role in tagging.ROLES}
    for path in sorted(VOICES.glob("*.txt")):
        for line in examples(path):
            role = SAID_AS.get(type(line.frames[0])) if len(line.frames) == 1 and line.before is None else None
            if (
                role
                and len(line.sentence.split()) <= 16
                and not (role == "wait" and line.frames[0].part.kind != "whole")
            ):
                found[role].append((line.sentence.rstrip(" .!?"), line.objects))
    return found


def composed(count: int, seed: int = SEED) -> list[Line]:
    """Sentences put together at random: ends, places on the way, waits, and wishes in the words of the voices."""
    draw = random.Random(seed)
    voices = spoken()
    return [_composed(draw, voices) for _ in range(count)]


def _composed(draw: random.Random, voices: dict[tagging.Role, list[tuple[str, tuple[str, ...]]]]) -> Line:
    parts: list[tuple[tagging.Role | None, str]] = []
    objects = tuple(draw.sample(NAMES, 5))
    role: tagging.Role = draw.choice(["via", "wait", "wish", "wish", "wish"])
    if draw.random() < 0.5 and voices[role]:
        said, objects = draw.choice(voices[role])
        parts.append((role, said))
    short = draw.random() < 0.1
    more: list[tagging.Role] = draw.choices(["via", "wait", "wish", "wish"], k=draw.choice([0, 0, 1, 1, 2]))
    parts += [(r, _said(draw, {"wish": "wishes"}.get(r, r), objects)) for r in more]
    ends = [("start", _said(draw, "start", objects)), ("goal", _said(draw, "goal", objects))]
    if draw.random() < 0.12:
        ends.append(("goal", draw.choice(["and back", "and back again", "and return", _said(draw, "goal", objects)])))
    if draw.random() < 0.06:
        ends = ends[1:]
    if short:
        ends = [("start", _filled(draw, "{p}", objects)), ("goal", _said(draw, "goal", objects))]
        parts = ends + parts
    elif draw.random() < 0.6:
        at = draw.randint(0, len(parts))
        parts[at:at] = ends
    else:
        parts += ends
        draw.shuffle(parts)
    for _ in range(draw.choice([0, 0, 1, 1, 2])):
        parts.insert(draw.randint(0, len(parts)), (None, _said(draw, "nothing", objects)))
    if draw.random() < SPOKEN_ASIDE:
        at = len(parts) if draw.random() < 0.6 else draw.randint(0, len(parts))
        parts.insert(at, (None, _filled(draw, draw.choice(ASIDES), objects)))
    text, phrases = "", list[tagging.TaggedPhrase]()
    for told, said in parts:
        text += draw.choice(PHRASES["joins"]) if text else ""
        said = said[0].lower() + said[1:] if text and draw.random() < 0.8 else said
        if told:
            phrases.append(tagging.TaggedPhrase(told, (len(text), len(text) + len(said))))
        text += said
    scene = Scene(tuple(SceneObject(n, [k, 0.3 * k, 0.5], [0.2] * 3) for k, n in enumerate(dict.fromkeys(objects))))
    return Line("", text, tuple(phrases), scene)


def _said(draw: random.Random, kind: str, objects: tuple[str, ...]) -> str:
    return _filled(draw, draw.choice(PHRASES[kind]), objects)


def _filled(draw: random.Random, phrase: str, objects: tuple[str, ...]) -> str:
    one, other = draw.sample(objects, 2) if len(objects) > 1 else (objects[0], objects[0])
    the = draw.choice(["the ", "the ", "the ", ""])
    phrase = phrase.replace("{p}", draw.choice(PHRASES["place"]))
    fill = {"o": the + one, "q": the + other, "m": draw.choice(PHRASES["metres"]), "s": draw.choice(PHRASES["seconds"])}
    return phrase.format(**fill)


def main() -> None:
    """Train and write, or judge."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--judge", action="store_true")
    parser.add_argument("--composed", type=int, default=1500, help="sentences that are put together besides")
    options = parser.parse_args()
    corpus = lines()
    made_up = composed(options.composed)
    more = [(tagging.features(s), labels(line, s)) for line in made_up for s in (seen(line),)]
    sketches = [seen(line) for line in corpus]
    rows = [(tagging.features(s), labels(line, s)) for line, s in zip(corpus, sketches, strict=True)]
    if not options.judge:
        np.savez(OUT, **trained(REPEATED * rows + more))
        told = hashlib.sha256("\n".join(f"{line.text}{line.phrases}" for line in corpus).encode()).hexdigest()[:16]
        print(f"{len(corpus)} sentences of {len({line.voice for line in corpus})} voices, sha256 {told}, seed {SEED}")
        return
    voices = sorted({line.voice for line in corpus})
    right = words = hits = 0
    for k in range(4):
        kept = set(voices[k::4])
        made = trained(
            [row for line, row in zip(corpus, rows, strict=True) if line.voice not in kept] * REPEATED + more
        )
        net = tagging.Tagger(made)
        for line, sketch, (_, told) in zip(corpus, sketches, rows, strict=True):
            if line.voice in kept:
                found = net.read(sketch)
                right += ways(sketch, found) == ways(sketch, line.phrases)
                same = labels(Line(line.voice, line.text, found, line.scene), sketch)
                hits, words = hits + sum(a == b for a, b in zip(same, told, strict=True)), words + len(told)
    print(f"unseen voices: {right / len(corpus):.1%} of {len(corpus)} ways, {hits / words:.1%} of {words} words")


if __name__ == "__main__":
    main()
