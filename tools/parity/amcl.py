"""AMCL's map side: distance fields, and weights of particles on recorded ones."""

import math
import re
from collections.abc import Iterator

import numpy as np

from navstack.costmap.occupancy_grid import OCCUPIED, OccupancyGrid
from navstack.localization.amcl_sensor_models import LikelihoodFieldModel
from navstack.localization.likelihood_field import LikelihoodField
from navstack.params.amcl import AmclParams
from navstack.types import FloatArray, LaserScan, Pose2D
from tools.parity.brush_fire import brush_fire
from tools.parity.comparison import Comparison
from tools.parity.golden import GoldenFile
from tools.parity.part import Case, Shape, existing

MAP, POSES = "map_occ", "weights_poses"
FIELD = re.compile(r"occ_dist_.*_max([\d.]+)")
TOLERANCE = 1e-5  # of weights, relative
SINGLE = 1e-6  # [m] of distances, recorded in single precision
SECOND = "weights_norm_2nd_update"
MODEL = ("max_beams", "z_hit", "z_rand", "sigma_hit")  # parameters
# named as FIELD says
FIELDS = Shape(("occ_dist_{}", MAP), (), ("map",), "origin_corner", "occ_dist_{}")


def check_field(case: Case, comparison: Comparison) -> None:
    """Every distance: Nav2's brush fire gives the recorded ones, and ours are the exact ones."""
    (farthest,) = case.settings(FIELD)
    resolution = resolution_of(case.file, case.name)
    grid = OccupancyGrid(case.file[MAP], resolution, origin_of(case.file))
    field = LikelihoodField.of_map(grid, float(farthest))
    ours = field.distances[field.codes[1:-1, 1:-1]]
    recorded = case.file[case.name].astype(np.float64)
    upstreams = brush_fire(case.file[MAP] == OCCUPIED, resolution, float(farthest))
    comparison.near("distances of the brush fire [m]", upstreams, recorded, SINGLE)
    too_far = recorded - ours
    comparison.require(bool((too_far > -SINGLE).all()), "a recorded distance is below the exact")
    limit = case.file.facts(case.name).get("max_diff_vs_exact_edt_m", math.inf)
    found = float(too_far.max())
    comparison.require(found <= limit + SINGLE, f"a recorded distance is {found:.3f} m too far")
    if (too_far > SINGLE).any():
        comparison.allow(
            f"{int((too_far > SINGLE).sum())} of {too_far.size} cells: Nav2's brush fire "
            "misses the nearest obstacle, by what its own algorithm gives; ours are exact"
        )


def find_weights(file: GoldenFile) -> Iterator[Case]:
    """Scans ``<case>_ranges``, ``_bearings`` and ``_weights_norm`` of ``weights_poses``."""
    for base in file.bases("_weights_norm"):
        arrays = {f"{base}_{suffix}" for suffix in ("ranges", "bearings", "weights_norm")}
        facts = file.facts(base)
        if (
            arrays <= file.names
            and POSES in file
            and "max_dist" in facts
            and field_name(file, facts["max_dist"])
        ):
            more = existing(file, (f"{base}_{SECOND}", MAP, "true_pose"))
            yield Case(base, file, more | arrays | {POSES, field_name(file, facts["max_dist"])})


def check_weights(case: Case, comparison: Comparison) -> None:
    """The weights after a scan, their mean, and the weights after the same scan again."""
    facts = case.facts
    likelihoods = model_of(case).likelihoods(case.file[POSES], scan_of(case), False)
    weights = likelihoods / len(likelihoods)
    comparison.near(
        "mean weight", weights.mean(), facts["w_avg_unnormalised"], TOLERANCE, relative=True
    )
    weights /= weights.sum()
    comparison.near("weights", weights, case["weights_norm"], TOLERANCE, relative=True)
    if SECOND in case:
        again = weights * likelihoods
        comparison.near(
            "weights after two scans", again / again.sum(), case[SECOND], TOLERANCE, relative=True
        )


def model_of(case: Case) -> LikelihoodFieldModel:
    facts = case.facts
    name = field_name(case.file, facts["max_dist"])
    distances = case.file[name]
    field = LikelihoodField.of_distances(
        distances, resolution_of(case.file, name), origin_of(case.file), facts["max_dist"]
    )
    return LikelihoodFieldModel(AmclParams(**{name: facts[name] for name in MODEL}), field)


def scan_of(case: Case) -> LaserScan:
    bearings: FloatArray = case["bearings"]
    increment = float(bearings[-1] - bearings[0]) / (len(bearings) - 1)
    sensor = Pose2D(*case.file.meta.get("laser_pose_in_base", (0.0, 0.0, 0.0)))
    return LaserScan(
        0.0,
        case["ranges"],
        float(bearings[0]),
        increment,
        0.0,
        case.facts["range_max"],
        sensor,
    )


def field_name(file: GoldenFile, farthest: float) -> str:
    """The recorded distance field up to ``farthest`` [m]; empty: there is none."""
    for name in sorted(file.names):
        match = FIELD.fullmatch(name)
        if match is not None and float(match[1]) == farthest:
            return name
    return ""


def resolution_of(file: GoldenFile, field: str) -> float:
    """[m/cell], the first number of the fact, which is a text; of a field named ``res32`` rounded.

    Raises:
        ValueError: it holds none.
    """
    text = str(file.facts("map")["resolution"])
    number = re.search(r"\d+\.\d+", text)
    if number is None:
        raise ValueError(f"the map's resolution '{text}' holds no number")
    resolution = float(number[0])
    if "res32" in field:
        return float(np.float32(resolution))
    return resolution


def origin_of(file: GoldenFile) -> Pose2D:
    return Pose2D(*file.facts("map")["origin_corner"])
