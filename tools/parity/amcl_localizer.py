"""AMCL end to end: from map, odometry and scans to the weights of particles, as Nav2 computes them.

The localizer that drives is run, on the distances of Nav2's brush fire in place of the exact ones.
"""

from dataclasses import replace

import numpy as np

from navstack.costmap.occupancy_grid import OCCUPIED, OccupancyGrid
from navstack.localization.amcl import AmclLocalizer
from navstack.localization.amcl_sensor_models import SENSOR_MODELS
from navstack.localization.likelihood_field import LikelihoodField
from navstack.params.amcl import AmclParams
from navstack.params.strict import from_mapping
from navstack.types import Belief, LaserScan, Observation, Odometry, Pose2D, Twist2D
from tools.parity.amcl import (
    MAP,
    MODEL,
    POSES,
    SECOND,
    TOLERANCE,
    field_name,
    origin_of,
    resolution_of,
    scan_of,
)
from tools.parity.brush_fire import brush_fire
from tools.parity.comparison import Comparison
from tools.parity.part import Case

NUDGE = 1e-9  # [m] of odometry between two scans: the second one counts, and nothing moves
# every scan counts, and nothing is drawn: neither noise of a motion nor particles
WEIGHS_ONLY: dict[str, float] = {
    "update_min_d": 0.0,
    "resample_interval": 1000,
    **{f"alpha{number}": 0.0 for number in range(1, 6)},
}


class BrushFireAmcl(AmclLocalizer):
    """AMCL whose likelihood field has Nav2's distances."""

    def __init__(self, params: AmclParams, static_map: OccupancyGrid) -> None:
        super().__init__(params, static_map)
        farthest = params.laser_likelihood_max_dist
        distances = brush_fire(static_map.data >= OCCUPIED, static_map.resolution, farthest)
        self._field = LikelihoodField.of_distances(
            distances, static_map.resolution, static_map.origin, farthest
        )
        make = SENSOR_MODELS[params.laser_model_type]
        self._sensor_model = make(params, static_map, self._field)


def check_localizer(case: Case, comparison: Comparison) -> None:
    """The weights after a scan, and after the same scan again, from the map on."""
    facts, file = case.facts, case.file
    resolution = resolution_of(file, field_name(file, facts["max_dist"]))
    given = {name: facts[name] for name in MODEL}
    given |= {"laser_likelihood_max_dist": facts["max_dist"], **WEIGHS_ONLY}
    params = from_mapping(AmclParams, given, case.title)
    localizer = BrushFireAmcl(params, OccupancyGrid(file[MAP], resolution, origin_of(file)))
    start = Pose2D(*file["true_pose"].tolist()) if "true_pose" in file else Pose2D()
    localizer.reset(Belief(start), np.random.default_rng(0))
    particles = localizer.particles
    particles.poses = file[POSES].astype(np.float64)
    particles.weights = np.full(len(particles.poses), 1.0 / len(particles.poses))
    scan = scan_of(case)
    localizer.update(_observation(scan, 1.0, 0.0))
    comparison.near("weights", particles.weights, case["weights_norm"], TOLERANCE, relative=True)
    if SECOND in case:
        localizer.update(_observation(scan, 2.0, NUDGE))
        comparison.near(
            "weights after two scans", particles.weights, case[SECOND], TOLERANCE, relative=True
        )


def _observation(scan: LaserScan, stamp: float, x: float) -> Observation:
    """A scan and the odometry of its time [s]."""
    odometry = Odometry(stamp, Pose2D(x), Twist2D(), 0.0, 0.0)
    return Observation(stamp, odometry=odometry, scan=replace(scan, stamp=stamp))
