"""How grave each breach of a rule of measuring is: the one place that says so, for the warnings of the report (checks.py) and for
`analysis lint` (lint_rules.py, lint_figures.py)."""

from __future__ import annotations

GRAVE, NOTE = "grave", "note"  # unfit to be published; to be said beside the results

FEW_LAUNCHES = FEW_SAMPLES = GRAVE
NO_STOP = GRAVE
STOPPED_BY_LIMIT = NOTE
DIRTY = NOT_RECORDED = OTHER_CONTEXT = GRAVE
BUSY_MACHINE = NOTE
NO_BASE = NOTE
BASE_CAVEAT = GRAVE
NOT_PINNED = IDLE_THREAD = SHARED_CORE = NOT_WATCHED = NOTE
BINDING_BROKEN = GRAVE
NOT_STEADY = NOTE
FEWER_THREADS = OTHER_RUNTIME = GRAVE
NOT_TESTED = NOTE
BELOW_FLOOR = NOTE
ASSUMED_TEST = NOTE
COUNTS_DISAGREE = GRAVE
NOT_CONFORMING = GRAVE
OTHER_STATISTICS = GRAVE
