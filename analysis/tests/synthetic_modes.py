"""A synthetic accuracy study: many numeric modes on several scenes, with the verdicts that harness/records.md describes."""

from __future__ import annotations

import json
import zlib
from dataclasses import dataclass
from typing import Any, Callable

import numpy as np

from ..statistics import intervals
from . import synthetic


@dataclass(frozen=True)
class Mode:
    time: float  # relative to f32 in the same kernel
    wrong: float  # pixels a megapixel
    steps: float | None
    bounded: bool = True
    scalar: bool = False  # has no vector form: only kernels that need none carry it


MODES = {
    "two_product": Mode(1.6, 600, 4120, bounded=False, scalar=True), "f32": Mode(1.0, 3, 40.2), "f32_plane": Mode(0.99, 1060, 104),
    "f32_incremental": Mode(1.3, 130, 74), "f64": Mode(1.45, 0, 0.5), "fixed_4": Mode(0.95, 5400, 31000), "fixed_8": Mode(0.97, 330, 19058),
    "fixed_12": Mode(1.05, 15, 1190), "filtered": Mode(1.06, 0, 39.8), "exact": Mode(2.9, 0, 39.8, scalar=True),
    "filtered-f64": Mode(1.25, 0, 0.5), "filtered-f64r": Mode(1.22, 0, 1.0), "filtered-unorm16": Mode(1.06, 900, 255),
    "filtered-unorm24": Mode(1.063, 0, 1.5), "filtered-unorm32": Mode(1.1, 0, 39.9), "filtered-reversed_f32": Mode(1.07, 0, 33),
    "filtered-inverse_w": Mode(1.09, 0, 21), "fixed_8-unorm24": Mode(0.98, 330, 19058), "f32-rcp": Mode(0.985, 3, 115),
    "f32-rcp_newton": Mode(0.995, 3, 41), "f32-fma": Mode(0.96, 5, 38), "f32_plane-fma": Mode(0.955, 1100, 99),
    "two_product-fma": Mode(1.5, 640, 4200, bounded=False, scalar=True), "f32-fastmath": Mode(0.93, 6, 44, bounded=False),
    "two_product-fastmath": Mode(1.45, 650, 4300, bounded=False, scalar=True)}
SCENES = {"ldraw_racer": (69000, 60.0, [1920, 1080]), "city_street": (210000, 150.0, [1920, 1080]), "dungeon": (31000, 80.0, [1920, 1080]),
          "teapot_43k": (43000, 45.0, [1920, 1080]), "confetti_heavy": (120000, 240.0, [1920, 1080])}
HARDNESS = (1.0, 3.0, 0.2, 0.7, 8.0)  # how many pixels each scene gets wrong, relative to the table


def verify(mode: str, known: Mode, hardness: float, size: list[int]) -> dict[str, Any]:
    """The verdicts on one mode; counts are whole and the classes add up."""
    pixels = size[0] * size[1]
    wrong = round(known.wrong * hardness * pixels / 1e6)
    edge = 0 if not known.bounded else wrong * 4 // 5
    end = round(wrong + 40 * hardness)
    oracle = {"pixels": pixels, "wrong": wrong, "false_positives": wrong // 4, "false_negatives": wrong // 5, "exact_ties": 0, "edge": edge,
              "depth": wrong - edge if known.bounded else 0, "unexplained": 0, "unbounded": 0 if known.bounded else wrong,
              "predicted": 3 * wrong + 12 if known.bounded else -1, "worst_distance_px": 2.4e-5 * wrong**0.5,
              "max_depth_error_steps": known.steps, "max_depth_error_world": None if known.steps is None else known.steps * 1e-7,
              "silhouette_hausdorff_px": 1.0 if wrong else 0.0, "colours_changed": wrong // 2, "colours_changed_8": wrong // 3,
              "psnr_db": 72.6 if wrong else None, "within_bound": True, "coverage_fallbacks": 3, "depth_fallbacks": 1, "seconds": 0.4}
    if mode.startswith("fixed"):
        oracle |= {"wrong_on_snapped": 0, "edge_on_snapped": 0}
    embree = {"version": "3.13.5", "identical": pixels - 41, "edge_ties": 38, "depth_ties": 3, "errors": 0, "build_ms": 31.0,
              "trace_ms": 412.0, "robust": True}
    return {"conforms": True, "checked_against": "scalar specification", "differing_pixels": 0,
            "oracle": None if mode == "ray_cast" else oracle, "embree": embree,
            "end_to_end": {"pixels": pixels, "identical": pixels - end, "wrong": end, "ambiguous": 2, "edge_ties": end - 1, "depth_ties": 1,
                           "unbounded": 0, "errors": 0, "max_depth_error_steps": known.steps, "multiprecision_pixels": 210, "seconds": 2.0},
            "bound": {"bounded": known.bounded, "text": "within 4u X px of an edge" if known.bounded else "unbounded",
                      "source": "Higham, 3.1" if known.bounded else "none: nothing is promised"}}


def spread(modes: dict[str, Mode], kernels: tuple[str, ...] = ("bounding_box", "tile_parallel"), rays: bool = True,
           hardness: tuple[float, ...] = HARDNESS) -> Callable[[list[dict[str, Any]]], None]:
    """Turns a study of f32 into one of these modes: all_pixels keeps the literal program only."""
    def edit(records: list[dict[str, Any]]) -> None:
        plain = [json.loads(json.dumps(entry)) for entry in records]
        scenes = list(dict.fromkeys(entry["config"]["scene"] for entry in plain))
        records.clear()
        for entry in plain:
            kernel, size = entry["config"]["kernel"], entry["config"]["size"]
            hard = hardness[scenes.index(entry["config"]["scene"]) % len(hardness)]
            serial = entry["config"]["backend"] == "serial"
            carried = {"two_product": modes["two_product"]} if kernel == "all_pixels" and serial and "two_product" in modes else {}
            if kernel in kernels:
                carried = {name: mode for name, mode in modes.items() if kernel == "bounding_box" or not mode.scalar}
            for name, mode in carried.items():
                records.append(twin(entry, name, mode, hard))
            if rays and kernel == kernels[-1] and serial:
                traced = twin(entry, "ray_cast", Mode(9.0, 11, None), hard)
                traced["config"]["kernel"] = "ray_cast"
                traced["verify"]["end_to_end"]["wrong"] = 11
                records.append(traced)

    return edit


def twin(entry: dict[str, Any], name: str, mode: Mode, hardness: float) -> dict[str, Any]:
    made = json.loads(json.dumps(entry))
    made["config"]["numeric"] = name
    made["name"], made["id"] = synthetic.name(made["config"]), synthetic.digest([entry["id"], name])
    made["verify"] = verify(name, mode, hardness, made["config"]["size"])
    # Noise of its own (a seed that is the same in every run), on the drift that all points of a block share.
    noise = np.random.default_rng(zlib.crc32(made["id"].encode())).normal(0, 0.006, len(entry["samples_ms"]))
    scale = mode.time * np.exp(noise)
    made["samples_ms"] = (np.array(entry["samples_ms"]) * scale).tolist()
    made["stages_ms"] = {stage: None if times is None else (np.array(times) * scale).tolist() for stage, times in entry["stages_ms"].items()}
    made["median_ms"] = float(np.median(made["samples_ms"])) if made["samples_ms"] else None
    bounds = intervals.order_interval(made["samples_ms"]) if made["samples_ms"] else None
    made["interval_ms"] = list(bounds) if bounds else None
    return made


def plan(**changes: Any) -> synthetic.Plan:
    standard = dict(scenes=SCENES, kernels=["all_pixels", "bounding_box", "tile_parallel"], schedules=[("openmp", "dynamic", 1)], threads=[2],
                    noise=0.006, untimed=False, edit=spread(MODES))
    return synthetic.plan(**(standard | changes))
