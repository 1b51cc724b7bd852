"""Masks from models of the SAM family, by tiny models with their inputs and outputs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from depth_pictures import Thing, picture

from ovita.errors import FormatError, SceneError
from ovita.perceive import Found, View, perceive

pytest.importorskip("onnxruntime", reason="needs ONNX Runtime (extra perceive-onnx)")
pytest.importorskip("onnx", reason="needs the package onnx, which writes the tests' tiny models")

from sam_models import efficientsam, sam, sam2

from ovita.perceive.segmenter import BoxSegmenter, fits, sampled

CUP = Thing("box", (0.0, 0.15, 0.06), (0.08, 0.08, 0.12), colour="red")
BOOK = Thing("box", (0.05, -0.15, 0.03), (0.16, 0.1, 0.06), 0.4, "blue")


class Boxes:
    """A detector that knows boxes and is off by a few pixels, as such detectors are."""

    name = "boxes"

    def __init__(self, *boxes: tuple[str, tuple[float, float, float, float]]) -> None:
        self.boxes = boxes

    def find(self, view, names, text):
        return tuple(Found(label, None, box) for label, box in self.boxes)


def truth(view: View, colour: str) -> np.ndarray:
    red, _, blue = view.rgb.astype(int).transpose(2, 0, 1)
    return red - blue > 40 if colour == "red" else blue - red > 40


def around(mask: np.ndarray, wider: float = 3.0) -> tuple[float, float, float, float]:
    rows, columns = np.nonzero(mask)
    return columns.min() - wider, rows.min() - wider, columns.max() + 1 + wider, rows.max() + 1 + wider


MODELS = {
    "sam": sam,
    "sam without low masks": lambda folder: sam(folder, low=False),
    "sam with preprocessing": lambda folder: sam(folder, preprocess=True),
    "sam2": sam2,
    "efficientsam": efficientsam,
    "efficientsam in one file": lambda folder: efficientsam(folder, whole=True),
}


@pytest.mark.parametrize("size", [(160, 120), (90, 128)], ids=["landscape", "portrait"])
@pytest.mark.parametrize("model", MODELS)
def test_masks_of_each_family(tmp_path: Path, model: str, size: tuple[int, int]) -> None:
    view = picture([CUP, BOOK], size=size)
    cup, book = truth(view, "red"), truth(view, "blue")
    detector = BoxSegmenter(Boxes(("cup", around(cup)), ("book", around(book))), *MODELS[model](tmp_path))
    found = detector.find(view, (), "")
    assert [one.label for one in found] == ["cup", "book"]
    for one, mask in zip(found, (cup, book), strict=True):
        assert one.mask is not None and one.score == pytest.approx(0.9)
        assert (one.mask & mask).sum() / (one.mask | mask).sum() > 0.75


def test_a_scene_of_masks(tmp_path: Path) -> None:
    view = picture([CUP, BOOK])
    seen = perceive([view], detector=BoxSegmenter(Boxes(("cup", around(truth(view, "red")))), *sam2(tmp_path)))
    assert seen.scene.names == ("cup", "table")
    assert np.linalg.norm(seen.scene["cup"].position - CUP.position) < 0.03


def test_a_mask_that_does_not_fit_is_not_taken_and_said(tmp_path: Path) -> None:
    view = picture([CUP, BOOK])
    looked = BoxSegmenter(Boxes(("grey patch", (5.0, 80.0, 30.0, 110.0))), *sam(tmp_path)).look(view, (), "")
    assert looked.found[0].mask is None and looked.found[0].box is not None
    assert "mask of the grey patch did not fit" in looked.notes[0]


def test_what_fits() -> None:
    mask = np.zeros((20, 20), dtype=bool)
    assert not fits(mask, (0, 0, 20, 20))
    mask[5:10, 5:10] = True
    assert fits(mask, (5, 5, 10, 10)) and not fits(mask, (12, 12, 19, 19))


def test_sampling_is_exact_on_a_slope_and_leaves_the_padding_out() -> None:
    slope = np.add.outer(np.arange(8.0), 2.0 * np.arange(8.0))
    assert np.allclose(sampled(slope, (8, 8), (8.0, 8.0)), slope)
    half = sampled(slope, (8, 16), (4.0, 8.0))
    assert half.shape == (8, 16) and half.max() <= 4.0 + 14.0


def test_files_that_are_no_such_models(tmp_path: Path) -> None:
    encoder, decoder = sam(tmp_path)
    (tmp_path / "text.onnx").write_text("hello")
    for files, says in (
        ((str(tmp_path / "none.onnx"), decoder), "no such file; ovita ships and fetches no weights"),
        ((str(tmp_path / "text.onnx"), decoder), "no ONNX model"),
        ((decoder, encoder), "its inputs are input_image"),
        ((decoder,), "half of a model"),
    ):
        with pytest.raises(FormatError, match=says) as error:
            BoxSegmenter(Boxes(), *files)
        assert "\n" not in str(error.value)


def test_a_model_that_fails_on_the_picture(tmp_path: Path) -> None:
    view, (encoder, _), (_, other) = picture([CUP]), sam(tmp_path), sam2(tmp_path)
    detector = BoxSegmenter(Boxes(("cup", around(truth(view, "red")))), encoder, other)
    with pytest.raises(FormatError, match="the model fails on this picture") as error:
        detector.find(view, (), "")
    assert "\n" not in str(error.value)


def test_depth_alone_is_refused(tmp_path: Path) -> None:
    view = picture([CUP])
    with pytest.raises(SceneError, match="needs a picture"):
        BoxSegmenter(Boxes(), *sam(tmp_path)).find(View(view.depth, view.intrinsics, view.pose), (), "")
