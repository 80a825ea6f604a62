"""The keys and types of records.jsonl and context.json, as harness/records.md has them."""

from __future__ import annotations

from typing import Any

NUMBER, TEXT, LIST, WHOLE = (int, float), str, list, int
NULL = type(None)
CONFIG = {"scene": TEXT, "scene_hash": TEXT, "size": LIST, "kernel": TEXT, "numeric": TEXT, "fill": TEXT, "near": TEXT, "backend": TEXT,
          "schedule": (TEXT, NULL), "chunk": (WHOLE, NULL), "threads": WHOLE, "binding": TEXT, "wait_policy": TEXT, "runtime": TEXT,
          "tile": (WHOLE, NULL), "isa": TEXT, "output": TEXT, "cache": TEXT, "generality": TEXT, "techniques": (TEXT, NULL)}
RECORD = {"schema": WHOLE, "id": TEXT, "name": TEXT, "config": dict, "status": TEXT, "launches": LIST, "blocks": LIST, "frames_per_sample": WHOLE,
          "samples_ms": LIST, "stages_ms": dict, "loop_ms": (LIST, NULL), "median_ms": (*NUMBER, NULL), "interval_ms": (LIST, NULL), "p95_ms": (*NUMBER, NULL),
          "min_ms": (*NUMBER, NULL), "max_ms": (*NUMBER, NULL), "floor_ms": (*NUMBER, NULL), "stop": (TEXT, NULL), "verify": (dict, NULL), "work": (dict, NULL), "hardware": (dict, NULL),
          "threads_observed": (WHOLE, NULL), "runtime_observed": (TEXT, NULL), "per_thread": LIST, "raster_loop": (dict, NULL), "placement": (dict, NULL), "context": TEXT}
PLACEMENT = {"binding": (TEXT, NULL)} | dict.fromkeys(["migrations", "cpus", "cores", "packages", "numa_nodes", "samples_sharing_cpu", "samples_sharing_core"], WHOLE)
NOISE = {"windows": WHOLE, "seconds": NUMBER, "other_load_cpus": (dict, TEXT), "steal_share": (dict, TEXT), "load_average": (dict, TEXT),
         "frequency_mhz": (dict, TEXT), "throttled": (*NUMBER, TEXT), "warnings": LIST, "remarks": LIST}
VERIFY = {"conforms": bool, "checked_against": TEXT, "differing_pixels": WHOLE, "oracle": (dict, NULL), "end_to_end": dict, "embree": dict, "embree_robust": dict,
          "bound": dict}
ORACLE = {"renderer": TEXT, "within_bound": bool, "seconds": NUMBER} | dict.fromkeys(
    ["pixels", "wrong", "false_positives", "false_negatives", "exact_ties", "edge", "depth", "unexplained", "depth_out_of_bound", "unbounded", "predicted",
     "colours_changed", "colours_changed_8", "coverage_fallbacks", "depth_fallbacks"], WHOLE) | dict.fromkeys(
    ["ssim", "worst_distance_px", "max_depth_error_steps", "max_depth_error_world", "silhouette_hausdorff_px", "psnr_db"], (*NUMBER, NULL))
END_TO_END = {"renderer": TEXT, "max_depth_error_steps": (*NUMBER, NULL), "seconds": NUMBER} | dict.fromkeys(
    ["pixels", "identical", "wrong", "ambiguous", "edge_ties", "depth_ties", "unbounded", "errors", "multiprecision_pixels"], WHOLE)
EMBREE = {"version": TEXT, "first_error": (TEXT, NULL), "max_depth_difference": (*NUMBER, NULL), "build_ms": NUMBER, "trace_ms": NUMBER} | dict.fromkeys(
    ["identical", "edge_ties", "depth_ties", "errors"], WHOLE)
BOUND = {"bounded": bool, "text": TEXT, "source": TEXT}
WORK = {"triangles": WHOLE, "drawn": WHOLE, "pieces": WHOLE, "rejected": dict, "near_clipped": WHOLE, "guard_clipped": WHOLE,
        "fragments_tested": WHOLE, "fragments_covered": WHOLE, "covered_pixels": WHOLE, "bytes": WHOLE, "counted": (dict, NULL)}
COUNTED = {"sizes": (dict, NULL), "bytes": dict, "per_thread": (LIST, NULL)} | dict.fromkeys(
    ["samples_in_boxes", "fragments_tested", "edge_tests", "fragments_passed", "covered_pixels", "visible_triangles", "tiles", "tiles_touched",
     "bin_entries", "hidden_entries", "binned_fragments", "merges"], (WHOLE, NULL))
EVENTS = ["cycles", "instructions", "branches", "branch_misses", "l1d_read_misses", "llc_misses", "dtlb_read_misses", "task_clock",
          "context_switches", "page_faults"]
REJECTED = dict.fromkeys(["non_finite", "zero_area", "behind_near", "beyond_far", "off_screen", "back_facing"], WHOLE)
CONTEXT = {"schema": WHOLE, "id": TEXT, "started": TEXT, "finished": TEXT, "program": dict, "libraries": dict, "machine": dict,
           "environment": dict, "study": dict, "region": TEXT, "scenes": dict, "overrides": dict, "custom": dict, "points": dict, "images": dict, "limits": dict, "noise": dict}
MACHINE = {"hostname": TEXT, "cpu": TEXT, "cpus_online": WHOLE, "cpus_allowed": LIST, "cores": WHOLE, "packages": WHOLE, "numa_nodes": WHOLE,
           "smt": bool, "caches": LIST, "topology": LIST, "memory_bytes": WHOLE, "governor": TEXT, "load_average": TEXT, "kernel": TEXT, "virtualisation": TEXT}


def obey(value: dict[str, Any], schema: dict[str, Any], what: str, optional: tuple[str, ...] = ()) -> None:
    assert set(value) - set(optional) == set(schema), what
    for key, kind in schema.items():
        good = isinstance(value[key], kind) and (kind is not WHOLE or not isinstance(value[key], bool))
        assert good, f"{what}: {key} is {value[key]!r}"
