"""What two runs were recorded under, and where that differs: a comparison of times means nothing beside another difference."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Iterator, Sequence

# Results of a run, not conditions of it. Load and noise move from minute to minute; the report warns of them.
MEASURED = ("id", "started", "finished", "points", "images", "limits.rates", "machine.load_average", "noise")
ABSENT = "not recorded"


@dataclass(frozen=True)
class Difference:
    """A key of context.json, dotted, with its value in either run; of records, the first point in which they differ."""

    key: str
    a: Any
    b: Any
    point: str = ""

    @property
    def words(self) -> str:
        where = f" (first in {self.point})" if self.point else ""
        return f"{_short(self.a)} in A, {_short(self.b)} in B{where}"


def differences(a: dict[str, Any], b: dict[str, Any], shared_only: bool = False) -> list[Difference]:
    """Every recorded condition that is not equal, in the order of the keys; with shared_only those that both runs record (a
    file of Google Benchmark says less than a context, which is no difference of the runs)."""
    left, right = dict(leaves(a)), dict(leaves(b))
    keys = sorted(left.keys() & right.keys() if shared_only else left.keys() | right.keys())
    found = (Difference(key, left.get(key, ABSENT), right.get(key, ABSENT)) for key in keys if not under(key, MEASURED))
    return [difference for difference in found if difference.a != difference.b]


def under(key: str, names: Sequence[str]) -> bool:
    """Whether a dotted key is one of the names or lies in one of them: program.commit lies in program."""
    return any(key == name or key.startswith(f"{name}.") for name in names)


def leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted keys and values of what lies in nested objects."""
    if isinstance(value, dict):
        for key, item in value.items():
            yield from leaves(item, f"{path}.{key}" if path else str(key))
    else:
        yield path, value


def _short(value: Any) -> str:
    words = str(value).replace("\n", " ")
    return words if len(words) <= 48 else f"{words[:45]}..."
