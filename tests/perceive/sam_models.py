"""Tiny models with the inputs and outputs of exported SAM-family models, which do real arithmetic.

A pixel is in the mask where it lies in the box and its red and blue differ, as those of coloured things do.
"""

# ruff: noqa: E501

from __future__ import annotations

from pathlib import Path

import onnx
import onnx.parser

HEAD = '<ir_version: 8, opset_import: ["" : 18]>\n'

POOL = "AveragePool <kernel_shape = [2, 2], strides = [2, 2]>"

# What every decoder does with a picture p (1, 3, h, w), whose cells lie at x and y, and a box of two corners.
JUDGE = """
  x0 = Gather <axis = 2> (first, i0)
  y0 = Gather <axis = 2> (first, i1)
  x1 = Gather <axis = 2> (second, i0)
  y1 = Gather <axis = 2> (second, i1)
  left = Sub (x, x0)
  right = Sub (x1, x)
  above = Sub (y, y0)
  below = Sub (y1, y)
  box = Min (left, right, above, below)
  red = Gather <axis = 1> (p, i0)
  blue = Gather <axis = 1> (p, i2)
  hue = Sub (red, blue)
  strong = Abs (hue)
  coloured = Sub (strong, limit)
  inside = Min (box, coloured)
  corner0 = Gather <axis = 1> (labels, i0)
  corner1 = Gather <axis = 1> (labels, i1)
  opens = Equal (corner0, two)
  closes = Equal (corner1, three)
  isbox = And (opens, closes)
  mask = Where (isbox, inside, minus)
"""

CONSTANTS = (
    "int64[1] i0 = {0}, int64[1] i1 = {1}, int64[1] i2 = {2}, float[1] two = {2}, float[1] three = {3},"
    " float[1] minus = {-1}, float[1] limit = {LIMIT}, int64 axis2 = {2}, int64 axis3 = {3}, float[1] half = {0.5},"
    " float[1] step = {STEP}, float[1] zero = {0}"
)

PLACES = """
  none = Mul (red0, zero)
  ones = Exp (none)
  xs = CumSum (ones, axis3)
  ys = CumSum (ones, axis2)
  xc = Sub (xs, half)
  yc = Sub (ys, half)
  x = Mul (xc, step)
  y = Mul (yc, step)
"""


def constants(limit: float, step: float) -> str:
    return CONSTANTS.replace("LIMIT", str(limit)).replace("STEP", str(step))


def write(path: Path, text: str) -> str:
    model = onnx.parser.parse_model(HEAD + text)
    onnx.checker.check_model(model)
    onnx.save(model, str(path))
    return str(path)


def sam(folder: Path, *, low: bool = True, preprocess: bool = False) -> tuple[str, str]:
    """As samexporter writes SAM and MobileSAM: a padded square of 128 pixels, masks of 64."""
    if preprocess:
        encoder = """encoder (float[h, w, 3] input_image) => (float[1, 3, 64, 64] image_embeddings)
        <float[3] mean = {123.675, 116.28, 103.53}, float[3] deviation = {58.395, 57.12, 57.375},
         int64[1] n0 = {0}, int64[3] none = {0, 0, 0}, int64[3] size = {1024, 1024, 3}> {
          c = Sub (input_image, mean)
          d = Div (c, deviation)
          s = Shape (d)
          rest = Sub (size, s)
          pads = Concat <axis = 0> (none, rest)
          e = Pad (d, pads)
          f = Transpose <perm = [2, 0, 1]> (e)
          g = Unsqueeze (f, n0)
          image_embeddings = AveragePool <kernel_shape = [16, 16], strides = [16, 16]> (g)
        }"""
    else:
        encoder = f"""encoder (float[1, 3, 128, 128] input_image) => (float[1, 3, 64, 64] image_embeddings) {{
          image_embeddings = {POOL} (input_image)
        }}"""
    step = 16.0 if preprocess else 2.0
    outputs = "float[1, 1, h, w] masks, float[1, 1] iou_predictions"
    outputs += ", float[1, 1, 64, 64] low_res_masks" if low else ""
    last = "low_res_masks = Identity (mask)" if low else ""
    decoder = f"""decoder (float[1, 3, 64, 64] image_embeddings, float[1, n, 2] point_coords, float[1, n] point_labels,
      float[1, 1, 64, 64] mask_input, float[1] has_mask_input, float[2] orig_im_size) => ({outputs})
      <{constants(0.7, step)}, int64[2] spatial = {{2, 3}}, float[1, 1] quality = {{0.9}}, float[2] square = {{64, 64}}> {{
      p = Identity (image_embeddings)
      labels = Identity (point_labels)
      first = Gather <axis = 1> (point_coords, i0)
      second = Gather <axis = 1> (point_coords, i1)
      red0 = Gather <axis = 1> (p, i0)
      {PLACES}
      {JUDGE}
      used = Mul (mask_input, has_mask_input)
      masks0 = Add (mask, used)
      wanted = Cast <to = 7> (orig_im_size)
      least = ReduceMax <keepdims = 1> (wanted)
      both = Concat <axis = 0> (least, least)
      padded = Resize <mode = "linear", axes = [2, 3]> (masks0, , , both)
      starts = Sub (both, both)
      masks = Slice (padded, starts, wanted, spatial)
      iou_predictions = Identity (quality)
      {last}
    }}"""
    return write(folder / "encoder.onnx", encoder), write(folder / "decoder.onnx", decoder)


def sam2(folder: Path) -> tuple[str, str]:
    """As samexporter writes SAM 2: the picture stretched to a square, three masks of which the second is best."""
    encoder = f"""encoder (float[1, 3, 128, 128] image)
      => (float[1, 3, 64, 64] high_res_feats_0, float[1, 3, 64, 64] high_res_feats_1, float[1, 3, 64, 64] image_embed) {{
      image_embed = {POOL} (image)
      high_res_feats_0 = Identity (image_embed)
      high_res_feats_1 = Identity (image_embed)
    }}"""
    decoder = f"""decoder (float[1, 3, 64, 64] image_embed, float[1, 3, 64, 64] high_res_feats_0,
      float[1, 3, 64, 64] high_res_feats_1, float[b, n, 2] point_coords, float[b, n] point_labels,
      float[b, 1, 64, 64] mask_input, float[b] has_mask_input) => (float[1, 3, 64, 64] masks, float[1, 3] iou_predictions)
      <{constants(0.7, 2.0)}, float[1, 3] quality = {{0.5, 0.9, 0.1}}, float[1] third = {{0.3333333}}> {{
      sum = Sum (image_embed, high_res_feats_0, high_res_feats_1)
      p = Mul (sum, third)
      labels = Identity (point_labels)
      first = Gather <axis = 1> (point_coords, i0)
      second = Gather <axis = 1> (point_coords, i1)
      red0 = Gather <axis = 1> (p, i0)
      {PLACES}
      {JUDGE}
      far = Neg (ones)
      masks = Concat <axis = 1> (box, mask, far)
      iou_predictions = Identity (quality)
    }}"""
    return write(folder / "encoder2.onnx", encoder), write(folder / "decoder2.onnx", decoder)


def efficientsam(folder: Path, *, whole: bool = False) -> tuple[str, ...]:
    """As EfficientSAM's own exporter writes it, in two files or in one: any size, masks of the picture's own size."""
    body = f"""
      points = Squeeze (batched_point_coords, i1)
      labels = Squeeze (batched_point_labels, i1)
      first = Gather <axis = 1> (points, i0)
      second = Gather <axis = 1> (points, i1)
      red0 = Gather <axis = 1> (p, i0)
      {PLACES}
      {JUDGE}
      two_masks = Concat <axis = 1> (mask, box)
      output_masks = Unsqueeze (two_masks, i1)
      iou_predictions = Identity (quality)
    """
    prompts = "float[1, 1, n, 2] batched_point_coords, float[1, 1, n] batched_point_labels"
    outputs = "float[1, 1, 2, h, w] output_masks, float[1, 1, 2] iou_predictions"
    constant = f"<{constants(0.16, 1.0)}, float[1, 1, 2] quality = {{0.9, 0.4}}>"
    if whole:
        text = f"whole (float[1, 3, h, w] batched_images, {prompts}) => ({outputs}) {constant} {{ p = Identity (batched_images) {body} }}"
        return (write(folder / "whole.onnx", text),)
    encoder = """encoder (float[1, 3, h, w] batched_images) => (float[1, 3, h, w] image_embeddings) {
      image_embeddings = Identity (batched_images)
    }"""
    decoder = f"""decoder (float[1, 3, h, w] image_embeddings, {prompts}, int64[2] orig_im_size) => ({outputs}) {constant} {{
      p = Identity (image_embeddings)
      {body}
    }}"""
    return write(folder / "encoder3.onnx", encoder), write(folder / "decoder3.onnx", decoder)
