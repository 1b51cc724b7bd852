"""Numbers of an instruction that a policy does not use: small models like to keep those of the example they saw."""

from __future__ import annotations

import math
import re

_NUMBER = re.compile(r"(?<![\w.])(\d+(?:\.\d+)?|\.\d+)")
_SCALES = (1.0, 0.01, 0.001, 0.3048, 0.0254, 1 / 3.6, math.pi / 180)
"""What a number may be multiplied by: cm and %, mm, feet, inches, km/h, degrees."""


def unused(instruction: str, code: str) -> tuple[str, ...]:
    """Return the numbers of an instruction that do not occur in a policy in any unit, as they are written.

    0 and 1 are left out, since they are so often no amounts; so are numbers in words.
    """
    used = {float(number) for number in _NUMBER.findall(code)}
    said = dict.fromkeys(_NUMBER.findall(instruction))
    return tuple(number for number in said if float(number) > 1e-9 and float(number) != 1.0 and not _in(number, used))


def _in(number: str, used: set[float]) -> bool:
    """Whether a number is used: converted, as its inverse, as more or less by that share, or as the index beside it."""
    n = float(number)
    meant = [n * scale for scale in _SCALES]
    meant += [1 / n, 1 + n / 100, 1 - n / 100, 1 + n, 1 - n, n - 1]
    return any(math.isclose(abs(value), other, rel_tol=0.01, abs_tol=1e-6) for value in meant for other in used)
