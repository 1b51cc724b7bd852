"""Detectors by name: clusters, vlm:PROVIDER:MODEL, onnx:ENCODER,DECODER, and a detector with masks of a model."""

from __future__ import annotations

from collections.abc import Sequence

import ovita.plugins as plugins
from ovita.errors import RequestError
from ovita.paths.frame import Frame
from ovita.perceive.assemble import clusters
from ovita.perceive.detect import Detector, Found
from ovita.perceive.segment import segment
from ovita.perceive.view import View

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
    if finder == "clusters":
        return _masked(ClusterDetector(up), masks, name) if masks else None
    if kind == "vlm" and model.strip():
        from ovita.perceive.vlm import VlmDetector

        found: Detector = VlmDetector(model.strip(), base_url=base_url, boxes=boxes)
    else:
        found = _of_a_plugin(name, kind, model.strip(), up)
    return _masked(found, masks, name) if masks else found


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
