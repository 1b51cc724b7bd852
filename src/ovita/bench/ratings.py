"""People's ratings of how understandable adaptations are, where there are any."""

from __future__ import annotations

import csv
import os
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path

from ovita.errors import FormatError

RATINGS = "ratings.csv"
"""A file of this name in a run's folder is read: columns sample, writer, rating (1 to 5)."""


def read_ratings(path: str | os.PathLike[str]) -> Mapping[str, tuple[float, ...]]:
    """Read ratings by writer; a folder without the file has none.

    Args:
        path: The file, or a run's folder.

    Raises:
        FormatError: If the file lacks a column, or a rating is not between 1 and 5.
    """
    file = Path(path)
    if file.is_dir():
        file = file / RATINGS
        if not file.exists():
            return {}
    found: dict[str, list[float]] = defaultdict(list)
    try:
        with open(file, encoding="utf-8", newline="") as stream:
            for number, row in enumerate(csv.DictReader(stream), start=2):
                found[_cell(row, "writer", file, number)].append(_rating(row, file, number))
    except (OSError, UnicodeDecodeError) as error:
        raise FormatError(str(file), f"cannot be read: {error}") from None
    return {writer: tuple(values) for writer, values in sorted(found.items())}


def _cell(row: Mapping[str, str | None], key: str, file: Path, number: int) -> str:
    value = row.get(key)
    if not value:
        raise FormatError(str(file), f"line {number} has no value; the columns are sample, writer and rating", key=key)
    return value


def _rating(row: Mapping[str, str | None], file: Path, number: int) -> float:
    text = _cell(row, "rating", file, number)
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 1.0 <= value <= 5.0:
        raise FormatError(str(file), f"line {number} is {text!r}, expected a number from 1 to 5", key="rating")
    return value
