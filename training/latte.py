"""Train the LaTTe-style baseline: `python training/latte.py` writes src/ovita/baselines/latte.npz.

Needs torch (the `train` extra) and the sentence encoder (the `baselines` extra), which stays as it is.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from latte_data import Samples, augmented, corpus, grammar, spoken
from torch import nn
from torch.nn import functional as fn

from ovita.baselines.encoder import minilm
from ovita.baselines.latte import HEADS, OBJECTS, PATCH, TEXT, WAYPOINTS, WEIGHTS, Inputs, Seen, inputs

ROOT = Path(__file__).parent.parent
WIDTH, FEED, SAID, OUT = 64, 128, 1024, 128
ENCODERS, DECODERS = 1, 2
BATCH = 64
RATE = 1e-3
BEND = 0.05
"""Where the loss turns from squares to lengths, in half extents and mean speeds."""


class Heads(nn.Module):
    """Attention with several heads."""

    def __init__(self) -> None:
        super().__init__()
        self.q, self.k, self.v, self.o = (nn.Linear(WIDTH, WIDTH) for _ in range(4))

    def forward(self, x: torch.Tensor, to: torch.Tensor, there: torch.Tensor | None) -> torch.Tensor:
        """What each of x (B, N, WIDTH) attends to, of those that are there (B, M)."""
        q, k, v = (
            part(of).view(len(x), -1, HEADS, WIDTH // HEADS).transpose(1, 2)
            for part, of in ((self.q, x), (self.k, to), (self.v, to))
        )
        mask = None if there is None else there[:, None, None, :]
        mixed = fn.scaled_dot_product_attention(q, k, v, attn_mask=mask)
        return self.o(mixed.transpose(1, 2).reshape(x.shape))


class Layer(nn.Module):
    """A layer: attention to itself, in the decoder to what was encoded too, and a feed-forward network."""

    def __init__(self, decodes: bool) -> None:
        super().__init__()
        self.self = Heads()
        if decodes:
            self.cross = Heads()
        for i in range(2 + decodes):
            setattr(self, f"norm{i}", nn.LayerNorm(WIDTH))
        self.up, self.down = nn.Linear(WIDTH, FEED), nn.Linear(FEED, WIDTH)
        self.norms = 2 + decodes

    def forward(
        self, x: torch.Tensor, mask: torch.Tensor | None, memory: torch.Tensor | None, there: torch.Tensor | None
    ) -> torch.Tensor:
        """The tokens after the layer."""
        x = self.norm0(x + self.self(x, x, mask))
        if memory is not None:
            x = self.norm1(x + self.cross(x, memory, there))
        last = getattr(self, f"norm{self.norms - 1}")
        return last(x + self.down(fn.relu(self.up(x))))


class Model(nn.Module):
    """The network of `ovita.baselines.latte` in torch, with the same names."""

    def __init__(self) -> None:
        super().__init__()
        patches = WAYPOINTS // PATCH
        self.said = nn.ModuleList([nn.Linear(TEXT + OBJECTS * 4 + 3, SAID), nn.Linear(SAID, 5 * WIDTH)])
        self.waypoint, self.object = nn.Linear(8 * PATCH, WIDTH), nn.Linear(5, WIDTH)
        self.place = nn.Parameter(torch.randn(patches, WIDTH) * 0.2)
        self.encoder = nn.ModuleList([Layer(False) for _ in range(ENCODERS)])
        self.decoder = nn.ModuleList([Layer(True) for _ in range(DECODERS)])
        self.out = nn.ModuleList([nn.Linear(WIDTH, OUT), nn.Linear(OUT, 4 * PATCH)])
        nn.init.zeros_(self.out[1].bias)
        nn.init.normal_(self.out[1].weight, std=0.01)

    def forward(self, waypoints: torch.Tensor, objects: torch.Tensor, said: torch.Tensor) -> torch.Tensor:
        """The change of the waypoints (B, 40, 4)."""
        hidden = fn.dropout(fn.relu(self.said[0](said)), 0.1, self.training)
        tokens = self.said[1](hidden).view(len(said), 5, WIDTH)
        ways = self.waypoint(waypoints)
        x = torch.cat([self.object(objects), ways + self.place], dim=1)
        there = torch.ones(x.shape[:2], dtype=torch.bool)
        there[:, :OBJECTS] = objects[..., -1] > 0.5
        for layer in self.encoder:
            x = layer(x, there, None, None)
        memory = torch.cat([x, tokens[:, :4]], dim=1)
        there = torch.cat([there, torch.ones(len(there), 4, dtype=torch.bool)], dim=1)
        y = ways + self.place + tokens[:, 4:]
        for layer in self.decoder:
            y = layer(y, None, memory, there)
        return self.out[1](fn.relu(self.out[0](y))).view(len(y), WAYPOINTS, 4)


@dataclass(frozen=True)
class Ready:
    """Samples with the vectors of their texts (T, TEXT)."""

    samples: Samples
    vectors: Any

    def batch(self, rows: Any) -> tuple[torch.Tensor, ...]:
        """The inputs of some samples, and what should come out."""
        s = self.samples.of(rows)
        text = self.vectors[s.text]
        likeness = np.einsum("bd,bkd->bk", text, self.vectors[s.names])
        given = inputs(Seen(s.path, s.objects, s.present, s.scale), text, likeness)
        return (*tensors(given), torch.from_numpy(s.change))


def tensors(given: Inputs) -> tuple[torch.Tensor, ...]:
    """Inputs in torch."""
    return tuple(torch.from_numpy(a) for a in (given.waypoints, given.objects, given.said))


def ready(samples: Samples, cache: Path | None = None) -> Ready:
    """Samples with the texts that they use embedded, each once; a cache keeps vectors between runs."""
    known: dict[str, Any] = {}
    if cache is not None and cache.is_file():
        with np.load(cache) as saved:
            known = dict(zip(saved["texts"].tolist(), saved["vectors"], strict=True))
    texts = samples.texts.tolist()
    used = {texts[i] for i in np.unique(np.concatenate([samples.text, samples.names.ravel()]))}
    new = sorted({text for text in used if text not in known}, key=lambda text: (len(text), text))
    for i in range(0, len(new), 64):
        part = new[i : i + 64]
        known |= dict(zip(part, minilm()([text or "." for text in part]).astype(np.float32), strict=True))
    if cache is not None and new:
        np.savez(cache, texts=np.array(list(known)), vectors=np.stack(list(known.values())))
    return Ready(
        samples, np.stack([known[text] if text in used else np.zeros(TEXT, dtype=np.float32) for text in texts])
    )


def train(data: Ready, presentations: int, seed: int, report: Ready | None = None) -> Model:
    """A model that has been shown so many samples, each set in a new order as often as it takes."""
    torch.manual_seed(seed)
    rng = np.random.default_rng(seed)
    model = Model()
    steps = max(presentations // BATCH, 1)
    warm = max(steps // 20, 1)
    optimiser = torch.optim.AdamW(model.parameters(), lr=RATE, weight_decay=0.01, betas=(0.9, 0.98), fused=True)
    schedule = torch.optim.lr_scheduler.LambdaLR(
        optimiser, lambda i: min((i + 1) / warm, 0.5 * (1 + np.cos(np.pi * min(i / steps, 1.0))) + 0.01)
    )
    begun, recent, order = time.process_time(), 0.0, np.zeros(0, dtype=int)
    for step in range(steps):
        while len(order) < BATCH:
            order = np.concatenate([order, rng.permutation(len(data.samples))])
        rows, order = order[:BATCH], order[BATCH:]
        *given, change = data.batch(rows)
        loss = fn.smooth_l1_loss(model(*given), change, beta=BEND)
        optimiser.zero_grad(set_to_none=True)
        loss.backward()
        nn.utils.clip_grad_norm_(model.parameters(), 1.0)
        optimiser.step()
        schedule.step()
        recent = loss.item() if step == 0 else 0.98 * recent + 0.02 * loss.item()
        if step % max(steps // 10, 1) == 0 or step == steps - 1:
            measured = "" if report is None else f", left {left(model, report):.3f} of the change"
            print(f"step {step}/{steps} loss {recent:.4f}{measured}, {time.process_time() - begun:.0f} s", flush=True)
            model.train()
    return model.eval()


def left(model: Model, data: Ready) -> float:
    """The mean error as a share of the mean change: 1 for a model that changes nothing."""
    model.eval()
    errors = changes = 0.0
    for i in range(0, len(data.samples), 256):
        *given, change = data.batch(slice(i, i + 256))
        with torch.no_grad():
            errors += float((model(*given) - change).abs().sum())
        changes += float(change.abs().sum())
    return errors / changes


def weights(model: Model) -> dict[str, Any]:
    """The weights by name in 16 bits."""
    return {name: value.detach().numpy().astype(np.float16) for name, value in model.state_dict().items()}


def write_check(model: Model, data: Ready, to: Path) -> None:
    """Inputs of a few samples and what torch makes of them with the 16-bit weights, which numpy must reproduce."""
    model.load_state_dict({name: torch.from_numpy(value.astype(np.float32)) for name, value in weights(model).items()})
    *given, _ = data.batch(np.arange(4))
    with torch.no_grad():
        change = model.eval()(*given).numpy()
    arrays = dict(zip(("waypoints", "objects", "said"), (g.numpy() for g in given), strict=True))
    np.savez_compressed(to, **arrays, change=change)


def samples_of(name: str, n: int, seed: int, families: Collection[str]) -> Samples:
    """The training set of that name: "grammar", "voices", a file saved before, or a folder by `ovita augment`."""
    if name == "grammar":
        return grammar(n, seed)
    if name == "voices":
        return spoken(n, seed, corpus(held_out=False))
    if Path(name).is_dir():
        return augmented(Path(name), n, families)
    return Samples.load(Path(name)).of(slice(0, n))


def main() -> None:
    """Train and write the weights."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--data", default="voices", help="grammar, voices, a file by --save, or a folder by `ovita augment`"
    )
    parser.add_argument("--families", nargs="*", default=(), help="of a folder by `ovita augment`; all unless named")
    parser.add_argument("--samples", type=int, default=100_000)
    parser.add_argument("--presentations", type=int, default=400_000, help="samples shown in all, repeats counted")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--save", type=Path, help="where to keep the training set; nothing is trained then")
    parser.add_argument("--embeddings", type=Path, help="where to keep the vectors of texts")
    parser.add_argument("--validate", type=Path, help="a set of which the error is printed on the way")
    parser.add_argument("--to", type=Path, default=ROOT / "src" / "ovita" / "baselines" / WEIGHTS)
    parser.add_argument("--check", type=Path, help="write outputs that the tests compare with")
    options = parser.parse_args()
    torch.set_num_threads(1)
    samples = samples_of(options.data, options.samples, options.seed, options.families)
    digest = samples.digest()
    print(f"{len(samples)} samples, {len(samples.texts)} texts, data {digest}, seed {options.seed}", flush=True)
    if options.save is not None:
        samples.save(options.save)
        return
    report = ready(Samples.load(options.validate), options.embeddings) if options.validate else None
    data = ready(samples, options.embeddings)
    begun = time.process_time()
    model = train(data, options.presentations, options.seed, report)
    seconds = time.process_time() - begun
    told = f"data {digest}, {len(samples)} samples, {options.presentations} shown, seed {options.seed}"
    np.savez_compressed(options.to, **weights(model), told=np.array(told))
    if options.check is not None:
        write_check(model, data, options.check)
    size = sum(p.numel() for p in model.parameters()) / 1e6
    print(f"{told}, {seconds:.0f} s of training, {size:.2f} M parameters, {options.to.stat().st_size / 1e6:.1f} MB")


if __name__ == "__main__":
    main()
