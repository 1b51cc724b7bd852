"""Detectors, by name: what tells things in a picture apart and names them, and the mask that a finding stands for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

import numpy as np

import ovita.plugins as plugins
from ovita.errors import RequestError, SceneError
from ovita.paths.scene import Frame
from ovita.perceive.segment import Labels, Segments, segment
from ovita.perceive.view import Mask, View

FEWEST = 60
"""Pixels that a thing needs at least."""


@dataclass(frozen=True, eq=False)
class Found:
    """One thing that a detector found in a picture.

    Args:
        label: Its name; "" leaves naming to its colour and shape.
        mask: Its pixels (H, W), or None where only the box is known.
        box: x0, y0, x1, y1 [pixels], x to the right and y down; or None where the mask says it.
        score: How sure the detector is, 0..1.
        attributes: What else it said, such as {"colour": "red", "shape": "cylinder"}.

    Raises:
        SceneError: If there is neither mask nor box, or the box is empty.
    """

    label: str
    mask: Mask | None = None
    box: tuple[float, float, float, float] | None = None
    score: float = 1.0
    attributes: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.mask is None and self.box is None:
            raise SceneError(f"a detector found {self.label!r} without saying where", key="box")
        if self.box is not None:
            x0, y0, x1, y1 = self.box
            if not (np.isfinite(self.box).all() and x1 > x0 and y1 > y0):
                raise SceneError(f"a detector's box of {self.label!r} is empty: {self.box}", key="box")


class Detector(Protocol):
    """Finds things in a view. What it reads off the picture is data, never an order."""

    name: str

    def find(self, view: View, names: Sequence[str], text: str) -> tuple[Found, ...]:
        """The things in a view, of `names` where there are any; a `SceneError` where colours are needed and missing."""
        ...


@dataclass(frozen=True)
class Sighting:
    """What a detector has to say of a view beyond what it found.

    Args:
        environment: A description of the scene, or "": data, to be quoted wherever it goes on to.
        notes: What a person should know, each a sentence.
    """

    found: tuple[Found, ...]
    environment: str = ""
    notes: tuple[str, ...] = ()


@runtime_checkable
class DescribingDetector(Protocol):
    """A detector that also describes the scene."""

    def look(self, view: View, names: Sequence[str], text: str) -> Sighting:
        """What is in a view; as `Detector.find`, with a description and notes."""
        ...


def sighting(detector: Detector, view: View, names: Sequence[str], text: str) -> Sighting:
    """What a detector says of a view, whether or not it describes."""
    if isinstance(detector, DescribingDetector):
        return detector.look(view, names, text)
    return Sighting(detector.find(view, names, text))


def mask_of(found: Found, labels: Labels) -> Mask:
    """The pixels of a finding: its mask where it has one, else the cluster that its box holds best.

    `labels` are the cluster of each pixel (H, W), from 1; 0 for none.

    Returns:
        (H, W), all False where no cluster lies in the box. A box that several clusters share takes the one that it
        overlaps most as boxes do (intersection over union, counted in pixels), since boxes are off by a few percent.
    """
    if found.mask is not None:
        return np.asarray(found.mask & (labels > 0)) if (found.mask & (labels > 0)).any() else found.mask
    assert found.box is not None
    inside, total, held = counted_in(found.box, labels)
    share = held / np.maximum(total + inside.sum() - held, 1)
    share[(total == 0) | (held < 0.5 * total)] = 0.0
    share[0] = 0.0
    best = int(share.argmax())
    return np.asarray(labels == best) if share[best] > 0 else np.zeros(labels.shape, dtype=bool)


def counted_in(box: Sequence[float], labels: Labels) -> tuple[Mask, Labels, Labels]:
    """Which pixels (H, W) lie in a box, and how many pixels each cluster, from 0, has in all and in the box."""
    high, wide = labels.shape
    x0, y0, x1, y1 = np.clip(np.round(box), 0, (wide, high, wide, high)).astype(int)
    inside = np.zeros(labels.shape, dtype=bool)
    inside[y0:y1, x0:x1] = True
    total, held = (np.bincount(labels[where].ravel(), minlength=int(labels.max()) + 1) for where in (..., inside))
    return inside, total, held


def clusters(parts: Segments) -> tuple[Found, ...]:
    """Each cluster of depth as a nameless finding."""
    sizes = np.bincount(parts.labels.ravel(), minlength=parts.count + 1)
    return tuple(Found("", parts.labels == i) for i in range(1, parts.count + 1) if sizes[i] >= FEWEST)


KINDS = "clusters, vlm:PROVIDER:MODEL, onnx:ENCODER,DECODER, or both: vlm:PROVIDER:MODEL+onnx:ENCODER,DECODER"


class ClusterDetector:
    """Each cluster of depth above the support, nameless: for masks that a model then refines."""

    name = "clusters"

    def __init__(self, frame: Frame) -> None:
        self._up = frame.direction("up")

    def find(self, view: View, names: Sequence[str], text: str) -> tuple[Found, ...]:
        """The clusters of a view."""
        return clusters(segment(view, self._up))


def detector_named(
    name: str, *, frame: Frame | str = "flu", base_url: str | None = None, boxes: str | None = None
) -> Detector | None:
    """Return the detector of that name, or None for "clusters", which `perceive` does by itself.

    Args:
        name: "clusters"; "vlm:PROVIDER:MODEL"; "onnx:ENCODER,DECODER" or "onnx:FILE" for masks of clusters; and of a
            model's boxes with both, joined by "+".
        frame: Of the world: which way is up.
        base_url: Address of an OpenAI-compatible server; the model is then one of its own, vlm:MODEL.
        boxes: How the model writes boxes, where its name does not tell: see `ovita.perceive.vlm.CONVENTIONS`.

    Raises:
        RequestError: If the name is none of these, or an option does not go with it.
        FormatError: If a model's file cannot be used.
        MissingExtra: If a package is not installed.
    """
    finder, _, masks = name.partition("+")
    if not masks and finder.startswith("onnx:"):
        finder, masks = "clusters", finder
    kind, _, model = finder.partition(":")
    if kind != "vlm" and (base_url or boxes):
        raise RequestError("--base-url and --boxes go with a vlm: detector")
    up = Frame(frame) if isinstance(frame, str) else frame
    found: Detector = ClusterDetector(up)
    if kind == "vlm" and model.strip():
        from ovita.perceive.vlm import VlmDetector

        found = VlmDetector(model.strip(), base_url=base_url, boxes=boxes)
    elif finder != "clusters":
        found = _of_a_plugin(name, kind, model.strip(), up)
    if masks:
        return _masked(found, masks, name)
    return None if finder == "clusters" else found


def _of_a_plugin(name: str, kind: str, model: str, frame: Frame) -> Detector:
    found: Detector | None = plugins.make("detectors", kind, "find", model, frame)
    if found is None:
        others = "".join(f", {known}" for known in plugins.entries("detectors"))
        raise RequestError(f"unknown detector {name!r}; use {KINDS}{others}")
    return found


def _masked(found: Detector, masks: str, name: str) -> Detector:
    """A detector with masks of a segmentation model for what it finds."""
    kind, _, files = masks.partition(":")
    encoder, _, decoder = files.partition(",")
    if kind != "onnx" or not encoder:
        raise RequestError(f"unknown detector {name!r}; use {KINDS}")
    from ovita.perceive.segmenter import BoxSegmenter

    return BoxSegmenter(found, encoder.strip(), decoder.strip() or None)
