"""Parameters of the Spatio-Temporal Voxel Layer (STVL).

Names and defaults are those of its ROS 2 release.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated

from navstack.ranges import Allowed, OpenQuantity, Parameters, Quantity, Whole, within

LINEAR, EXPONENTIAL = 0, 1  # values of decay_model; any other one keeps voxels for ever
DEPTH_CAMERA, LIDAR_3D = 0, 1  # values of model_type
SourceModel = Annotated[
    int, Allowed("0 (depth camera) or 1 (3D lidar)", (DEPTH_CAMERA, LIDAR_3D).__contains__)
]


@dataclass(frozen=True, slots=True)
class SpatioTemporalSourceParams(Parameters):
    """One of the layer's ``observation_sources``; here each is fed with the robot's one scan."""

    enabled: bool = True
    marking: bool = True
    clearing: bool = False  # its frustum speeds up the decay of what it covers
    obstacle_range: OpenQuantity = 2.5  # [m] farther returns do not mark
    min_z: OpenQuantity = 0.0  # [m] where the frustum begins
    max_z: OpenQuantity = 10.0  # [m] where it ends
    horizontal_fov_angle: Quantity = 1.04  # [rad] of the frustum about the robot's heading
    decay_acceleration: Quantity = 0.0  # [1/s^2] see navstack.costmap.spatio_temporal
    model_type: SourceModel = DEPTH_CAMERA  # the frustum's ends are planes; LIDAR_3D: arcs
    inf_is_valid: bool = False  # a beam without return counts as one that ended at range_max
    # [s] scans are applied again for so long; 0: the newest only
    observation_persistence: Quantity = 0.0
    # [s] between scans; the costmap is not current when they stay away; 0: any
    expected_update_rate: Quantity = 0.0
    clear_after_reading: bool = False  # a scan is applied once only


@dataclass(frozen=True, slots=True)
class SpatioTemporalLayerParams(Parameters):
    """``spatio_temporal_voxel_layer.cpp``."""

    enabled: bool = True
    # [m]; a scan's points are counted by voxels, whose numbers are whole
    voxel_size: Annotated[float, within(1e-3, 1e3)] = 0.05
    # [s] how long a voxel stays; a negative one vanishes with the next update
    voxel_decay: Quantity = -1.0
    decay_model: Whole = LINEAR
    track_unknown_space: bool = False  # cells without voxels say nothing; False: they are free
    update_footprint_enabled: bool = True  # cells under the robot are free in this layer
    combination_method: Whole = 1  # with the layers below: 0 overwrite, else maximum
    observation_sources: tuple[str, ...] = ()
    # by the names just above
    sources: Mapping[str, SpatioTemporalSourceParams] = field(default_factory=dict)

    @property
    def active_sources(self) -> tuple[SpatioTemporalSourceParams, ...]:
        """The enabled sources in their order.

        One that is named but not described has the defaults.
        """
        described = (
            self.sources.get(name, SpatioTemporalSourceParams())
            for name in self.observation_sources
        )
        return tuple(source for source in described if source.enabled)

    @property
    def footprint_clearing_enabled(self) -> bool:
        """What obstacle layers call it."""
        return self.update_footprint_enabled
