"""AMCL's map side: distance fields, and weights of particles on recorded ones."""

import re
from collections.abc import Iterator

import numpy as np

from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.localization.amcl_sensor_models import LikelihoodFieldModel
from navstack.localization.likelihood_field import LikelihoodField
from navstack.params.amcl import AmclParams
from navstack.types import FloatArray, LaserScan, Pose2D
from tools.parity.comparison import Comparison
from tools.parity.golden import GoldenFile
from tools.parity.part import Case, Shape, existing

MAP, POSES = "map_occ", "weights_poses"
FIELD = re.compile(r"occ_dist_.*_max([\d.]+)")
TOLERANCE = 1e-5  # of weights, relative
# [m] at most, by which Nav2's brush fire takes a cell for farther from an obstacle than it is
BRUSH_FIRE = 0.19
SECOND = "weights_norm_2nd_update"
# named as FIELD says
FIELDS = Shape(("occ_dist_{}", MAP), (), ("map",), "origin_corner", "occ_dist_{}")


def check_field(case: Case, comparison: Comparison) -> None:
    """Every distance.

    Nav2's are of a brush fire, which may pass a cell by an obstacle that is not the nearest.
    """
    (farthest,) = case.settings(FIELD)
    grid = OccupancyGrid(case.file[MAP], _resolution(case.file), _origin(case.file))
    field = LikelihoodField.of_map(grid, float(farthest))
    ours, recorded = (
        field.distances[field.codes[1:-1, 1:-1]],
        case.file[case.name].astype(np.float64),
    )
    too_far = recorded - ours
    comparison.require(
        ours.shape == recorded.shape, f"shape {ours.shape}, recorded {recorded.shape}"
    )
    comparison.require(
        bool((too_far > -1e-6).all()), "a recorded distance is less than the exact one"
    )
    limit = case.file.facts(case.name).get("max_diff_vs_exact_edt_m", BRUSH_FIRE)
    comparison.require(
        bool((too_far <= limit + 1e-6).all()),
        f"a recorded distance is {too_far.max():.3f} m too far",
    )
    if (too_far > 1e-6).any():
        comparison.allow(
            "Nav2's brush fire misses the nearest obstacle of some cells; ours are exact"
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
            and _field_name(file, facts["max_dist"])
        ):
            more = existing(file, (f"{base}_{SECOND}", "true_pose"))
            yield Case(base, file, more | arrays | {POSES, _field_name(file, facts["max_dist"])})


def check_weights(case: Case, comparison: Comparison) -> None:
    """The weights after a scan, their mean, and the weights after the same scan again."""
    facts = case.facts
    likelihoods = _model(case).likelihoods(case.file[POSES], _scan(case), False)
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


def _model(case: Case) -> LikelihoodFieldModel:
    facts = case.facts
    distances = case.file[_field_name(case.file, facts["max_dist"])]
    field = LikelihoodField.of_distances(
        distances, _resolution(case.file), _origin(case.file), facts["max_dist"]
    )
    names = ("max_beams", "z_hit", "z_rand", "sigma_hit")
    return LikelihoodFieldModel(AmclParams(**{name: facts[name] for name in names}), field)


def _scan(case: Case) -> LaserScan:
    bearings: FloatArray = case["bearings"]
    increment = float(bearings[-1] - bearings[0]) / (len(bearings) - 1)
    sensor = Pose2D(*case.file.meta.get("laser_pose_in_base", (0.0, 0.0, 0.0)))
    return LaserScan(
        0.0, case["ranges"], float(bearings[0]), increment, 0.0, case.facts["range_max"], sensor
    )


def _field_name(file: GoldenFile, farthest: float) -> str:
    """The recorded distance field up to ``farthest`` [m]; empty: there is none."""
    found = [(name, FIELD.fullmatch(name)) for name in sorted(file.names)]
    return next((name for name, match in found if match and float(match[1]) == farthest), "")


def _resolution(file: GoldenFile) -> float:
    """[m/cell], the first number of the fact, which is a text.

    Raises:
        ValueError: it holds none.
    """
    text = str(file.facts("map")["resolution"])
    number = re.search(r"\d+\.\d+", text)
    if number is None:
        raise ValueError(f"the map's resolution '{text}' holds no number")
    return float(number[0])


def _origin(file: GoldenFile) -> Pose2D:
    return Pose2D(*file.facts("map")["origin_corner"])
