"""Numbers as words: the same rounding in figures, tables and sentences."""

from __future__ import annotations

import math
import textwrap
from typing import Any

MISSING = "–"


def _decimals(value: float, low: float | None, high: float | None) -> int:
    """Decimals that show three significant digits, or four when the interval is narrower than that."""
    if value == 0 or not math.isfinite(value):
        return 0
    magnitude = math.floor(math.log10(abs(value)))
    digits = 3
    if low is not None and high is not None and high - low < 2 * 10.0 ** (magnitude - 2):
        digits = 4
    return max(0, digits - 1 - magnitude)


def number(value: float | None, low: float | None = None, high: float | None = None) -> str:
    if value is None or not math.isfinite(value):
        return MISSING
    return f"{value:.{_decimals(value, low, high)}f}"


def interval(value: float, low: float | None, high: float | None) -> str:
    """'[12.1, 12.6]' with the decimals of the value that it belongs to."""
    if low is None or high is None:
        return "[no interval]"
    places = _decimals(value, low, high)
    return f"[{low:.{places}f}, {high:.{places}f}]"


def estimate(value: float, low: float | None, high: float | None, unit: str = "") -> str:
    """'12.3 ms [12.1, 12.6]'."""
    return f"{number(value, low, high)}{unit} {interval(value, low, high)}"


def percent(share: float) -> str:
    return f"{100 * share:.1f} %" if share < 0.095 else f"{100 * share:.0f} %"


def count(amount: int, noun: str, plural: str | None = None) -> str:
    return f"{amount} {noun if amount == 1 else plural or noun + 's'}"


def listing(words: list[str], limit: int = 4, conjunction: str = "and") -> str:
    """'a, b and c'; beyond the limit 'a, b, c and 5 more'."""
    if len(words) > limit:
        return ", ".join(words[:limit]) + f" and {len(words) - limit} more"
    if len(words) < 2:
        return "".join(words)
    return ", ".join(words[:-1]) + f" {conjunction} {words[-1]}"


def shorten(text: str, width: int) -> str:
    return textwrap.shorten(str(text), width=width, placeholder=" …") if len(str(text)) > width else str(text)


def span(values: list[int]) -> str:
    """'n = 12' or 'n = 8 to 20'."""
    if not values:
        return "no samples"
    low, high = min(values), max(values)
    return f"n = {low}" if low == high else f"n = {low} to {high}"


def machine(described: dict[str, Any]) -> str:
    """'AMD EPYC 7763, 8 CPUs allowed', of the `machine` of a record's context."""
    cpu = described.get("cpu")
    words = [str(cpu) if cpu and not str(cpu).startswith("unavailable") else "unknown CPU"]
    allowed = described.get("cpus_allowed")
    if isinstance(allowed, list):
        words.append(count(len(allowed), "CPU") + " allowed")
    return ", ".join(words)
