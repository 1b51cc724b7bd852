"""Masks from exported models of the SAM family, by ONNX Runtime; a detector gives the boxes.

Three families are told apart by the names of their inputs, which are those that `samexporter` and the models' own
exporters write: SAM and MobileSAM, SAM 2, and EfficientSAM (in two files or one). ovita ships and fetches no weights.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ovita.errors import FormatError, SceneError, needs
from ovita.io.documents import listing
from ovita.io.files import file_name
from ovita.paths.trajectory import Array
from ovita.perceive.detect import Detector, Found, Sighting, sighting
from ovita.perceive.view import Mask, Picture, View
from ovita.text import the

Family = Literal["sam", "sam2", "efficientsam"]

CORNERS = (2.0, 3.0)
"""Labels of a prompt's points that are a box's first and last corner."""

TARGET = 1024
"""Longer edge of the picture in models that do not say their size [pixels]."""

LOW = 256
"""Edge of the mask prompt in models that do not say it [pixels]."""

MEAN, DEVIATION = (123.675, 116.28, 103.53), (58.395, 57.12, 57.375)
"""Of the pixels that SAM was trained on."""

INSIDE = 0.5
"""Share of a mask that must lie in the box that asked for it."""

MARGIN = 0.1
"""By how much of its edges a box is widened for that."""

Tensor = NDArray[Any]

_PROMPTS = {"point_coords", "point_labels", "mask_input", "has_mask_input"}
_SAM = {"image_embeddings", "orig_im_size"} | _PROMPTS
_SAM2 = {"image_embed", "high_res_feats_0", "high_res_feats_1"} | _PROMPTS
_EFFICIENT = {"batched_point_coords", "batched_point_labels"}


@dataclass(frozen=True, eq=False)
class _Encoded:
    """A picture as an encoder left it: its outputs by name, and its size when it went in (rows, columns)."""

    outputs: dict[str, Tensor]
    picture: Tensor
    shape: tuple[int, int]
    resized: tuple[int, int]


class BoxSegmenter:
    """A detector whose findings get masks from a segmentation model.

    Args:
        boxes: Finds and names things; each finding's box, or the box around its mask, is the prompt.
        encoder: ONNX file of the image encoder, or of the whole model.
        decoder: ONNX file of the mask decoder, or None.

    Raises:
        FormatError: If a file is missing, no ONNX model, or of no known family.
        MissingExtra: If ONNX Runtime is not installed.
    """

    def __init__(self, boxes: Detector, encoder: str, decoder: str | None = None) -> None:
        self._boxes = boxes
        self._files = encoder, decoder or encoder
        self._encoder = _session(encoder)
        self._decoder = self._encoder if decoder is None else _session(decoder)
        self._family = _family(self._decoder, self._files[1])
        self._whole = decoder is None
        if self._whole and self._family != "efficientsam":
            raise FormatError(
                file_name(encoder), "holds half of a model; give encoder and decoder: onnx:ENCODER,DECODER"
            )
        self.name = f"{boxes.name}+onnx:{Path(encoder).name}"

    def find(self, view: View, names: Sequence[str], text: str) -> tuple[Found, ...]:
        """The findings of the other detector, with masks."""
        return self.look(view, names, text).found

    def look(self, view: View, names: Sequence[str], text: str) -> Sighting:
        """What the other detector says, with masks; a mask that does not fit its box is not taken, which is noted.

        Raises:
            SceneError: If the view has no colours.
            FormatError: If a model fails on the picture.
        """
        if view.rgb is None:
            raise SceneError(f"{self.name} needs a picture, and {view.name} has depth only; use --detector clusters")
        seen = sighting(self._boxes, view, names, text)
        if not seen.found:
            return seen
        encoded = self._encode(view.rgb)
        found, notes = [], list(seen.notes)
        for one in seen.found:
            box = _box(one)
            mask, score = self._mask(encoded, box)
            if fits(mask, box):
                found.append(replace(one, mask=mask, box=box, score=one.score * score))
            else:
                found.append(one)
                notes.append(f"the model's mask of {the(one.label or 'thing')} did not fit its box and was not taken")
        return Sighting(tuple(found), seen.environment, tuple(notes))

    def _encode(self, rgb: Picture) -> _Encoded:
        shape = rgb.shape[0], rgb.shape[1]
        if self._family == "efficientsam":
            picture = (rgb.transpose(2, 0, 1)[None] / 255.0).astype(np.float32)
            outputs = {} if self._whole else self._run(self._encoder, {_inputs(self._encoder)[0]: picture}, 0)
            return _Encoded(outputs, picture, shape, shape)
        given = self._encoder.get_inputs()[0]
        size = _edges(given.shape)
        if self._family == "sam2":
            picture = _normal(_scaled(rgb, size)).transpose(2, 0, 1)[None]
            return _Encoded(self._run(self._encoder, {given.name: picture}, 0), picture, shape, size)
        scale = size[0] / max(shape)
        resized = int(shape[0] * scale + 0.5), int(shape[1] * scale + 0.5)
        small = _scaled(rgb, resized)
        if len(given.shape) == 3:  # exported with its preprocessing
            picture = small.astype(np.float32)
        else:
            padding = (0, size[0] - resized[0]), (0, size[1] - resized[1]), (0, 0)
            picture = np.pad(_normal(small), padding).transpose(2, 0, 1)[None]
        return _Encoded(self._run(self._encoder, {given.name: picture}, 0), picture, shape, resized)

    def _mask(self, encoded: _Encoded, box: Sequence[float]) -> tuple[Mask, float]:
        """The mask (H, W) for a box, the best of those that the model offers, and how good the model thinks it is."""
        outputs = self._run(self._decoder, self._prompt(encoded, box), 1)
        names = _outputs(self._decoder)
        low = self._family == "sam" and "low_res_masks" in names
        logits = outputs["low_res_masks" if low else names[0]]
        quality = np.atleast_1d(outputs[names[1]].ravel()) if len(names) > 1 else np.ones(1)
        offered = logits.reshape(-1, *logits.shape[-2:])
        best = int(quality.argmax()) if len(quality) == len(offered) else 0
        rows, columns = offered.shape[-2:]
        edge = max(encoded.resized) if low else 0  # SAM's low masks are of the padded square
        share = (encoded.resized[0] / edge, encoded.resized[1] / edge) if edge else (1.0, 1.0)
        plane = sampled(offered[best], encoded.shape, (rows * share[0], columns * share[1]))
        return plane > 0.0, float(np.clip(quality[best % len(quality)], 0.0, 1.0))

    def _prompt(self, encoded: _Encoded, box: Sequence[float]) -> dict[str, Tensor]:
        corners = np.asarray(box, dtype=np.float32).reshape(2, 2)
        labels = np.asarray(CORNERS, dtype=np.float32)
        if self._family == "efficientsam":
            given: dict[str, Tensor] = {
                "batched_images": encoded.picture,
                "batched_point_coords": corners[None, None],
                "batched_point_labels": labels[None, None],
                "orig_im_size": np.asarray(encoded.shape, dtype=np.int64),
            }
        else:
            rows, columns = (new / old for new, old in zip(encoded.resized, encoded.shape, strict=True))
            points = corners * np.asarray([columns, rows], dtype=np.float32)
            if self._family == "sam":  # whose exports want a padding point behind a box
                points = np.vstack([points, np.zeros((1, 2), dtype=np.float32)])
                labels = np.append(labels, np.float32(-1.0))
            edges = _edges(next(i.shape for i in self._decoder.get_inputs() if i.name == "mask_input"), LOW)
            given = {
                "point_coords": points[None].astype(np.float32),
                "point_labels": labels[None].astype(np.float32),
                "mask_input": np.zeros((1, 1, *edges), dtype=np.float32),
                "has_mask_input": np.zeros(1, dtype=np.float32),
                "orig_im_size": np.asarray(encoded.shape, dtype=np.float32),
            }
        given |= encoded.outputs
        return {name: given[name] for name in _inputs(self._decoder) if name in given}

    def _run(self, session: Any, given: dict[str, Tensor], which: int) -> dict[str, Tensor]:
        names = _outputs(session)
        try:
            values = session.run(names, given)
        except Exception as error:  # ONNX Runtime's own exceptions have no common base but this
            reason = " ".join(str(error).split())[:160]
            raise FormatError(file_name(self._files[which]), f"the model fails on this picture ({reason})") from None
        return {name: np.asarray(value) for name, value in zip(names, values, strict=True)}


def fits(mask: Mask, box: Sequence[float]) -> bool:
    """Whether a mask (H, W) holds anything, and most of it lies in a box x0, y0, x1, y1 [pixels]."""
    if not mask.any():
        return False
    x0, y0, x1, y1 = box
    dx, dy = MARGIN * (x1 - x0), MARGIN * (y1 - y0)
    rows, columns = np.nonzero(mask)
    held = (columns >= x0 - dx) & (columns <= x1 + dx) & (rows >= y0 - dy) & (rows <= y1 + dy)
    return float(held.mean()) >= INSIDE


def sampled(plane: Tensor, shape: tuple[int, int], spans: tuple[float, float]) -> Array:
    """A plane of numbers (h, w) at the pixels of a picture (H, W), bilinearly, with pixels at the middle of cells.

    Args:
        plane: (h, w).
        shape: Rows and columns wanted.
        spans: How many of the plane's rows and columns the picture takes, from the top left.
    """
    ats = []
    for count, span, most in zip(shape, spans, plane.shape, strict=True):
        at = np.clip((np.arange(count) + 0.5) * span / count - 0.5, 0.0, most - 1.0)
        low = np.minimum(at.astype(int), max(most - 2, 0))
        ats.append((low, np.minimum(low + 1, most - 1), at - low))
    (r0, r1, dr), (c0, c1, dc) = ats
    plane = plane.astype(np.float64)
    above = plane[r0][:, c0] * (1.0 - dc) + plane[r0][:, c1] * dc
    below = plane[r1][:, c0] * (1.0 - dc) + plane[r1][:, c1] * dc
    return np.asarray(above * (1.0 - dr)[:, None] + below * dr[:, None])


def _box(found: Found) -> tuple[float, float, float, float]:
    if found.box is not None:
        return found.box
    assert found.mask is not None
    rows, columns = (np.flatnonzero(found.mask.any(axis=axis)) for axis in (1, 0))
    return float(columns[0]), float(rows[0]), float(columns[-1] + 1), float(rows[-1] + 1)


def _session(file: str) -> Any:
    if not os.path.isfile(file):
        raise FormatError(file_name(file), "there is no such file; ovita ships and fetches no weights")
    with needs("onnxruntime", "perceive-onnx"):
        import onnxruntime
    options = onnxruntime.SessionOptions()
    options.log_severity_level = 4
    try:
        return onnxruntime.InferenceSession(file, options, providers=["CPUExecutionProvider"])
    except Exception as error:  # as above
        reason = " ".join(str(error).split())[:160]
        raise FormatError(file_name(file), f"is no ONNX model that can be used here ({reason})") from None


def _family(decoder: Any, file: str) -> Family:
    names = set(_inputs(decoder))
    if names >= _EFFICIENT:
        return "efficientsam"
    if names >= _SAM2:
        return "sam2"
    if names >= _SAM:
        return "sam"
    known = "SAM, MobileSAM, SAM 2 and EfficientSAM with box prompts"
    raise FormatError(file_name(file), f"is no decoder of {known}; its inputs are {listing(sorted(names))}")


def _inputs(session: Any) -> list[str]:
    return [one.name for one in session.get_inputs()]


def _outputs(session: Any) -> list[str]:
    return [one.name for one in session.get_outputs()]


def _edges(shape: Sequence[Any], otherwise: int = TARGET) -> tuple[int, int]:
    """The last two edges that a model says, or those that it takes where it leaves them open."""
    rows, columns = shape[-2:] if len(shape) == 4 else (None, None)
    return (rows if isinstance(rows, int) else otherwise, columns if isinstance(columns, int) else otherwise)


def _scaled(rgb: Picture, shape: tuple[int, int]) -> Picture:
    with needs("pillow", "perceive"):
        from PIL import Image
    image = Image.fromarray(np.ascontiguousarray(rgb)).resize(shape[::-1], Image.Resampling.BILINEAR)
    return np.asarray(image, dtype=np.uint8)


def _normal(rgb: Picture) -> Tensor:
    mean, deviation = np.array(MEAN, dtype=np.float32), np.array(DEVIATION, dtype=np.float32)
    return np.asarray((rgb.astype(np.float32) - mean) / deviation)
