"""Which OpenMP runtime ran a point, against the one that it asked for: they deal the same schedule differently, so that times of
one must not stand under the name of the other."""

from __future__ import annotations

from .load import Record, Study
from .schedule_model import RUNTIMES


def asked(study: Study, record: Record) -> str | None:
    """Of config.runtime, or, where that is the program's own, of libraries.openmp in the context; None: not known, as where
    families that were merged had several, or no OpenMP."""
    if record.config.backend != "openmp":
        return None
    if record.config.runtime in RUNTIMES:
        return record.config.runtime
    words = str(study.context["libraries"].get("openmp") or "").split()  # "libgomp 201511"
    return words[0] if words and words[0] in RUNTIMES else None


def other(study: Study, record: Record) -> str:
    """'libgomp ran its loops, libomp was asked for'; empty where it was the right one, or nothing says which."""
    wanted, ran = asked(study, record), record.runtime_observed
    if wanted is None or ran is None or wanted == ran:
        return ""
    own = "" if record.config.runtime in RUNTIMES else ", the program's own,"
    return f"{ran} ran its loops, {wanted}{own} was asked for"


def mixed(study: Study) -> dict[str, list[str]]:
    """Values of the axis runtime under which points ran in several runtimes, with these."""
    seen: dict[str, set[str]] = {}
    for record in study.timed:
        if record.config.backend == "openmp" and record.runtime_observed is not None:
            seen.setdefault(str(record.config.runtime or "default"), set()).add(record.runtime_observed)
    return {axis: sorted(found) for axis, found in seen.items() if len(found) > 1}
