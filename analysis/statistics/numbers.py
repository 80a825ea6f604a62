"""Numbers that were read from files."""

from __future__ import annotations

import math


def is_close(a: float, b: float) -> bool:
    """Whether a stored number is the computed one: six digits are written."""
    return math.isclose(a, b, rel_tol=1e-4, abs_tol=1e-6)


def is_number(value: object) -> bool:
    if not isinstance(value, (int, float)) or isinstance(value, bool):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # JSON has integers of any length
        return False
