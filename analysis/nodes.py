"""Where the records of a merged study were measured (harness/records.md, Merged studies), and what follows for comparing them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Iterable

import pandas as pd

from . import text
from .load import Record, Study

if TYPE_CHECKING:
    from .comparison import Analysis
    from .tables import Table


def node(record: Record) -> str | None:
    """The node that a record comes from; None in a study that one machine ran."""
    return record.origin.get("node") if record.origin else None


def node_types(records: Iterable[Record]) -> list[str]:
    """Types of nodes, as words, in order of their first record."""
    return list(dict.fromkeys(str(record.origin["node_type"]) for record in records if record.origin and record.origin.get("node_type")))


def nodes(records: Iterable[Record]) -> list[str]:
    return sorted({str(found) for record in records if (found := node(record))})


def machine(records: list[Record]) -> str | None:
    """For captions: 'AMD EPYC 7542, 64 cores in 2 packages (node n3)'; a mixture is called one. None without origins."""
    types, names = node_types(records), nodes(records)
    if not types:
        return None
    if len(types) > 1:
        return f"mixed: {text.listing(types, 4)} ({text.listing(names, 6)}); only points of one picture share a node"
    return f"{types[0]} ({'node' if len(names) == 1 else 'nodes'} {text.listing(names, 6)})"


def mixed_groups(analysis: "Analysis") -> list[str]:
    """Titles of groups whose points, which the report compares, are of several nodes."""
    return [group.title for group in analysis.groups if len(nodes([*group.records, *group.peers])) > 1]


def remark(study: Study) -> str:
    """What a sentence over several pictures must add, or nothing."""
    types = node_types(study.every_record)
    return f" [Measured on {len(types)} types of nodes, each picture on one.]" if len(types) > 1 else ""


def tables(analysis: "Analysis") -> list["Table"]:
    """One row a node, of merged studies only."""
    from .tables import Table

    rows: dict[tuple[str, str], list[Record]] = {}
    for record in analysis.study.every_record:
        if found := node(record):
            rows.setdefault((found, str(record.origin.get("node_type"))), []).append(record)
    if not rows:
        return []
    frame = pd.DataFrame([{"node": found, "type": kind, "points": len(records),
                           "jobs": ", ".join(dict.fromkeys(str(record.origin.get("job")) for record in records)),
                           "families": len({record.origin.get("family") for record in records}),
                           "pictures": ", ".join(dict.fromkeys(f"{r.config.scene} {'x'.join(map(str, r.config.size))}" for r in records))}
                          for (found, kind), records in sorted(rows.items(), key=lambda row: row[0])])
    return [Table("nodes", "Nodes", "Where the points were measured. All points of a family are of one node; times of different families"
                  " compare machines as well.", frame, frame)]
