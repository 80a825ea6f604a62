"""Writes a study as harness/records.md describes it, with times from a seeded model instead of a machine."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable

import numpy as np

from ..statistics import intervals


KERNELS = {  # name: (share of the slowest, parallel share, tile)
    "all_pixels": (1.0, 0.99, None), "bounding_box": (0.06, 0.93, None), "triangle_locks": (0.16, 0.6, None),
    "triangle_atomics": (0.08, 0.9, None), "triangle_private": (0.09, 0.85, None), "row_parallel": (0.07, 0.95, None),
    "tile_parallel": (0.045, 0.97, 32), "scanline": (0.05, 0.9, None)}
SERIAL_ONLY = ("scanline",)
SCHEDULES = [("openmp", "static", None), ("openmp", "static", 16), ("openmp", "dynamic", 1), ("openmp", "dynamic", 16),
             ("openmp", "guided", None), ("openmp", "auto", None), ("tbb", "auto", None), ("tbb", "simple", 16),
             ("tbb", "static", None), ("tbb", "affinity", None)]
EFFECT = {"static": 1.25, "dynamic": 1.0, "guided": 1.06, "auto": 1.25, "simple": 1.03, "affinity": 1.04}
SCENES = {"teapot": (6320, 45.0, [640, 360]), "confetti_heavy": (120000, 240.0, [1920, 1080])}


@dataclass
class Plan:
    scenes: dict[str, tuple[int, float, list[int]]]
    kernels: list[str]
    schedules: list[tuple[str, str, int | None]]
    threads: list[int]
    launches: int = 1
    blocks: int = 10
    noise: float = 0.012
    same: bool = False  # an A/A study: every point has one distribution
    untimed: bool = True  # one failed and one skipped point
    seed: int = 7
    edit: Callable[[list[dict[str, Any]]], None] | None = None


def plan(**changes: Any) -> Plan:
    standard = dict(scenes=SCENES, kernels=list(KERNELS), schedules=SCHEDULES, threads=[1, 2, 4])
    return Plan(**(standard | changes))


def digest(value: Any) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()[:32]


def configs(p: Plan) -> list[dict[str, Any]]:
    result = []
    for scene, (_, _, size) in p.scenes.items():
        for kernel in p.kernels:
            runs = [("serial", None, None, 1)]
            if kernel not in SERIAL_ONLY:
                runs += [(*schedule, threads) for schedule in p.schedules for threads in p.threads]
            for backend, schedule, chunk, threads in runs:
                result.append({
                    "scene": scene, "scene_hash": digest(scene), "size": size, "kernel": kernel, "numeric": "f32",
                    "fill": "top-left", "near": "clip", "backend": backend, "schedule": schedule, "chunk": chunk,
                    "threads": threads, "binding": "close", "wait_policy": "active",
                    "runtime": {"serial": "none", "openmp": "libgomp", "tbb": "onetbb"}[backend],
                    "tile": KERNELS[kernel][2], "isa": "baseline", "output": "rgba8+f32", "cache": "warm"})
    return result


def mean_time(p: Plan, config: dict[str, Any]) -> float:
    if p.same:
        return 10.0
    share, parallel, _ = KERNELS[config["kernel"]]
    base = p.scenes[config["scene"]][1] * share
    if config["backend"] == "serial":
        return base
    factor = EFFECT[config["schedule"]] if config["threads"] > 1 and config["kernel"] != "triangle_atomics" else 1.0
    factor *= 1.08 if config["schedule"] == "dynamic" and config["chunk"] == 1 and config["kernel"] == "row_parallel" else 1
    return base * 1.03 * (1 - parallel + parallel / config["threads"]) * factor


def record(p: Plan, config: dict[str, Any], rng: np.random.Generator, drift: np.ndarray, context: str) -> dict[str, Any]:
    n = p.launches * p.blocks
    base = drift.ravel() * mean_time(p, config)
    samples = base * np.exp(rng.normal(0, p.noise, n)) + rng.exponential(0.002, n) * base
    shares = np.array([0.04, 0.12, 0.76, 0.08])
    stages = {name: (samples * share).round(6).tolist() for name, share in zip(statistics_stages(), shares)}
    if config["kernel"] == "tile_parallel":
        stages["geometry"] = None  # fused: one named stage
    bounds = intervals.order_interval(samples)
    triangles, _, (w, h) = p.scenes[config["scene"]]
    imbalance = EFFECT.get(config["schedule"], 1.0)
    busy = [float(np.median(samples) * 0.76 * (imbalance if i == 0 else 1)) for i in range(config["threads"])]
    return {
        "schema": 1, "id": digest(config), "name": name(config), "config": config, "status": "ok",
        "launches": np.repeat(np.arange(p.launches), p.blocks).tolist(),
        "blocks": np.tile(np.arange(p.blocks), p.launches).tolist(), "frames_per_sample": 1,
        "samples_ms": samples.tolist(), "stages_ms": stages,
        "loop_ms": (samples * 0.7).round(6).tolist(), "median_ms": float(np.median(samples)),
        "interval_ms": list(bounds) if bounds else None, "p95_ms": float(np.quantile(samples, 0.95)) if n >= 59 else None,
        "min_ms": float(samples.min()), "max_ms": float(samples.max()), "stop": "target",
        "verify": {"conforms": True, "checked_against": "scalar specification", "differing_pixels": 0,
                   "oracle": {"renderer": "exact", "identical": w * h - 14, "edge_ties": 11, "depth_ties": 3, "errors": 0,
                              "max_depth_error_steps": 2, "within_bound": True}, "embree": None},
        "work": {"triangles": triangles, "drawn": triangles - 300, "pieces": 12, "rejected": {
            "non_finite": 0, "zero_area": 100, "behind_near": 0, "beyond_far": 0, "off_screen": 200, "back_facing": 0},
            "near_clipped": 0, "guard_clipped": 0, "covered_pixels": w * h // 3, "bytes": 12 * w * h},
        "threads_observed": config["threads"], "runtime_observed": "libgomp" if config["backend"] == "openmp" else None,
        "per_thread": [{"busy_ms": b, "iterations": 100, "cpu": i, "cpus": {str(i): n}, "migrations": 0} for i, b in enumerate(busy)],
        "placement": {"binding": None if config["backend"] == "serial" else "kept", "migrations": 0, "cpus": config["threads"], "cores": config["threads"],
                      "packages": 1, "numa_nodes": 1, "samples_sharing_cpu": 0, "samples_sharing_core": 0},
        "raster_loop": loop_of(busy, base * 0.76), "context": context}


def loop_of(busy: list[float], raster: np.ndarray | float) -> dict[str, float]:
    """raster_loop of samples that all have these busy times."""
    longest, mean = max(busy), min(max(busy), sum(busy) / len(busy))
    return {"busy_mean_ms": mean, "busy_longest_ms": longest, "imbalance_ms": longest - mean,
            "outside_ms": max(0.0, float(np.median(raster)) - longest), "lock_wait_ms": 0.0, "contended_locks": 0.0, "failed_exchanges": 0.0}


def statistics_stages() -> tuple[str, ...]:
    return ("clear", "geometry", "raster", "resolve")


def name(config: dict[str, Any]) -> str:
    w, h = config["size"]
    schedule = f":{config['schedule']}" if config["schedule"] else ""
    chunk = f",{config['chunk']}" if config["chunk"] else ""
    return "/".join([config["scene"], f"{w}x{h}", config["kernel"], config["numeric"], config["fill"], config["near"],
                     f"{config['backend']}{schedule}{chunk}", str(config["threads"])])


def withhold(entry: dict[str, Any], status: str, reason: str) -> None:
    """Turns a timed record into one that has no times."""
    entry.update(status=status, reason=reason, samples_ms=[], launches=[], blocks=[], median_ms=None, interval_ms=None,
                 p95_ms=None, min_ms=None, max_ms=None, stop=None, per_thread=[], raster_loop=None, threads_observed=None,
                 stages_ms={stage: None for stage in statistics_stages()})


def context(p: Plan, records: list[dict[str, Any]]) -> dict[str, Any]:
    statuses = [entry["status"] for entry in records]
    return {
        "schema": 1, "id": "c0ffee", "started": "2024-05-01T10:00:00Z", "finished": "2024-05-01T10:03:10Z",
        "program": {"version": "0.1", "commit": "0123abc", "dirty": False, "compiler": "g++ 12.2.0", "flags": "-O3",
                    "build_type": "Release", "build_id": "b01d"},
        "libraries": {"google_benchmark": "1.7.1", "tbb": "2021.8", "openmp": "libgomp 201511"},
        "machine": {"hostname": "node_1", "cpu": "Example CPU 9000 @ 2.0 GHz", "cpus_online": 4, "cpus_allowed": [0, 1, 2, 3],
                    "cores": 4, "packages": 1, "numa_nodes": 1, "smt": False,
                    "caches": [{"level": 1, "size_bytes": 32768, "shared_by": 1}], "memory_bytes": 2**34,
                    "governor": "unavailable: no cpufreq in this VM", "load_average": [0.1, 0.2, 0.3], "kernel": "6.1.0",
                    "virtualisation": "kvm"},
        "environment": {"OMP_PROC_BIND": "close"},
        "noise": {"windows": 30, "seconds": 60.0, "other_load_cpus": {"median": 0.03, "worst": 0.2, "worst_blocks": [4, 4]},
                  "steal_share": {"median": 0.0, "worst": 0.001, "worst_blocks": [2, 2]}, "load_average": {"median": 2.1, "worst": 2.4, "worst_blocks": [9, 9]},
                  "frequency_mhz": "unavailable: no cpufreq in this VM", "throttled": 0, "warnings": [], "remarks": []},
        "study": {"name": "synthetic", "question": "Which strategy & schedule is fastest?", "file": "studies/synthetic.toml",
                  "text": "[study]\nname = \"synthetic\" # <b>not html</b>\n", "hash": "ab12", "seed": 1, "shard": "1/1",
                  "sampling": {"target": 0.02, "min_samples": 6, "max_samples": 30, "point_seconds": 2, "launches": p.launches,
                               "time_limit_s": 240}},
        "region": "world triangles in memory to rgba8 + f32 depth in memory, clears included", "custom": {},
        "images": {}, "points": {"planned": len(records), "run": statuses.count("ok"), "skipped": statuses.count("skipped"),
                                 "failed": statuses.count("failed")}}


def images(directory: Path, p: Plan) -> dict[str, str]:
    import matplotlib.image

    (directory / "images").mkdir(exist_ok=True)
    named = {}
    for scene, (_, _, (w, h)) in p.scenes.items():
        y, x = np.mgrid[0:h:4, 0:w:4]
        disc = ((x - w / 2) ** 2 + (y - h / 2) ** 2 < (h / 3) ** 2)[..., None]
        picture = np.where(disc, np.stack([x / w, y / h, 0.5 + 0 * x], -1), 0.95)
        matplotlib.image.imsave(directory / "images" / f"{scene}.png", picture)
        named[scene] = f"images/{scene}.png"
    return named


def write(directory: Path, p: Plan | None = None, pictures: bool = True) -> Path:
    p = p or plan()
    rng = np.random.default_rng(p.seed)
    # What a block meets, all points of it meet: drift over the run and an offset of each launch.
    drift = np.exp(rng.normal(0, 0.01, (p.launches, 1)) + np.linspace(0, 0.01, p.blocks)) * np.ones((p.launches, p.blocks))
    records = [record(p, config, rng, drift, "c0ffee") for config in configs(p)]
    parallel = [r for r in records if r["config"]["backend"] != "serial"]
    if p.untimed and len(parallel) > 3:
        withhold(parallel[1], "failed", "does not conform: 12 pixels differ from the scalar specification")
        parallel[1]["verify"].update(conforms=False, differing_pixels=12)
        withhold(parallel[-1], "skipped", "more threads than CPUs, use --oversubscribe")
    if p.edit:
        p.edit(records)
    directory.mkdir(parents=True, exist_ok=True)
    about = context(p, records)
    if pictures:
        about["images"] = images(directory, p)
    (directory / "context.json").write_text(json.dumps(about, indent=1))
    (directory / "records.jsonl").write_text("".join(json.dumps(entry) + "\n" for entry in records))
    return directory
