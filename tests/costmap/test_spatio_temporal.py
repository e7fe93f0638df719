"""The Spatio-Temporal Voxel Layer against a dictionary of voxels, one at a time."""

import math

import numpy as np
import pytest

from navstack.costmap.layered_costmap import LayeredCostmap
from navstack.costmap.spatio_temporal import is_inside
from navstack.params.costmap import CostmapParams
from navstack.params.spatio_temporal import (
    DEPTH_CAMERA,
    LIDAR_3D,
    SpatioTemporalLayerParams,
    SpatioTemporalSourceParams,
)
from navstack.types import LaserScan, Pose2D

SIZE = 0.1  # [m] of voxels and of cells
BEAMS = 90
STEP = 0.5  # [s] between updates


def make_costmap(**given) -> LayeredCostmap:
    sources = given.pop("sources")
    names = tuple(f"source_{k}" for k in range(len(sources)))
    layer = SpatioTemporalLayerParams(
        voxel_size=SIZE,
        observation_sources=names,
        sources=dict(zip(names, sources, strict=True)),
        **given,
    )
    params = CostmapParams(
        width=8.0,
        height=6.0,
        resolution=SIZE,
        origin_x=-3.0,
        origin_y=-2.0,
        plugins=("stvl",),
        layers={"stvl": layer},
    )
    return LayeredCostmap(params)


def scan(rng: np.random.Generator, stamp: float) -> LaserScan:
    ranges = rng.uniform(0.3, 4.0, BEAMS)
    ranges[rng.random(BEAMS) < 0.3] = math.inf
    return LaserScan(
        stamp=stamp,
        angle_min=-math.pi,
        angle_increment=2.0 * math.pi / BEAMS,
        range_min=0.1,
        range_max=10.0,
        ranges=ranges,
        sensor_pose=Pose2D(0.1, 0.0, 0.0),
    )


class Twin:
    """Voxels by their column and row, each with its mark."""

    def __init__(self, params: SpatioTemporalLayerParams) -> None:
        self.params, self.marks = params, {}

    def update(self, pose: Pose2D, seen: LaserScan, now: float) -> set[tuple[int, int]]:
        """The voxels to be seen now; the returns of this scan count from the next time on."""
        x = pose.x + 0.1 * math.cos(pose.yaw)
        y = pose.y + 0.1 * math.sin(pose.yaw)
        for voxel, mark in list(self.marks.items()):
            age = now - mark
            decay = self.params.voxel_decay
            left = {0: decay - age, 1: decay * math.exp(-age)}.get(self.params.decay_model, decay)
            dx, dy = (voxel[0] + 0.5) * SIZE - x, (voxel[1] + 0.5) * SIZE - y
            for source in self.params.active_sources:
                if (
                    source.clearing
                    and is_inside(source, np.array([dx]), np.array([dy]), pose.yaw)[0]
                ):
                    aged = source.decay_acceleration * age**3 / 6.0
                    left -= aged
                    self.marks[voxel] = mark - aged
                    break
            if left < 0.0:
                del self.marks[voxel]
        shown = set(self.marks)
        for source in self.params.active_sources:
            for k, distance in enumerate(seen.ranges):
                if source.marking and distance <= source.obstacle_range:
                    bearing = pose.yaw + seen.angle_min + k * seen.angle_increment
                    place = (x + distance * math.cos(bearing), y + distance * math.sin(bearing))
                    self.marks[math.floor(place[0] / SIZE), math.floor(place[1] / SIZE)] = now
        return shown


@pytest.mark.parametrize("decay_model", [0, 1, -1])
def test_voxels_come_and_go_as_those_of_a_dictionary_do(decay_model):
    sources = [
        SpatioTemporalSourceParams(obstacle_range=3.0),
        SpatioTemporalSourceParams(
            marking=False,
            clearing=True,
            min_z=0.5,
            max_z=2.0,
            horizontal_fov_angle=2.0,
            decay_acceleration=0.4,
            model_type=LIDAR_3D,
        ),
        SpatioTemporalSourceParams(marking=False, clearing=True, max_z=3.0, decay_acceleration=5.0),
        SpatioTemporalSourceParams(enabled=False, obstacle_range=4.0),
    ]
    costmap = make_costmap(
        sources=sources,
        voxel_decay=3.0,
        decay_model=decay_model,
        update_footprint_enabled=False,
    )
    twin = Twin(costmap.params.layers["stvl"])
    rng = np.random.default_rng(5)
    counts = []
    for k in range(20):
        now = k * STEP
        pose = Pose2D(0.05 * k, 0.3 * math.sin(k), 0.4 * k)
        seen = scan(rng, now)
        costmap.update(pose, seen, now)
        shown = twin.update(pose, seen, now)
        rows, columns = np.nonzero(costmap.master.data)
        # the costmap's first cell is the voxel (-30, -20); what lies beyond its edges is not seen
        inside = {(x, y) for x, y in shown if -30 <= x < 50 and -20 <= y < 40}
        assert {
            (x - 30, y - 20) for x, y in zip(columns.tolist(), rows.tolist(), strict=True)
        } == inside
        counts.append(len(inside))
    assert counts[0] == 0
    assert max(counts) > 100
    if decay_model == 0:
        assert any(later < earlier for earlier, later in zip(counts, counts[1:], strict=False))


def test_a_negative_decay_drops_a_voxel_with_the_next_update_and_clearing_forgets_all():
    costmap = make_costmap(sources=[SpatioTemporalSourceParams()], voxel_decay=-1.0)
    rng = np.random.default_rng(1)
    for k in range(3):
        costmap.update(Pose2D(0.0, 0.0, 0.0), scan(rng, k * STEP), k * STEP)
        assert not costmap.master.data.any()
    lasting = make_costmap(sources=[SpatioTemporalSourceParams()], voxel_decay=60.0)
    for k in range(3):
        lasting.update(Pose2D(0.0, 0.0, 0.0), scan(rng, k * STEP), k * STEP)
    assert lasting.master.data.any()
    lasting.clear_entirely()
    assert not lasting.master.data.any()


def test_a_reading_counts_once_where_it_is_cleared_after_reading():
    rng = np.random.default_rng(1)
    seen = scan(rng, 0.0)
    once, again = (
        make_costmap(
            sources=[SpatioTemporalSourceParams(clear_after_reading=clear)], voxel_decay=1.0
        )
        for clear in (True, False)
    )
    for k in range(6):  # without a new scan
        for costmap in (once, again):
            costmap.update(Pose2D(0.0, 0.0, 0.0), seen if k == 0 else None, k * STEP)
    assert not once.master.data.any()
    assert again.master.data.any()


def test_a_camera_sees_between_two_planes_and_a_lidar_between_two_arcs():
    dx, dy = np.array([2.0, 1.9, 0.4, 2.0]), np.array([0.0, 1.0, 0.0, -1.9])
    camera = SpatioTemporalSourceParams(
        min_z=0.5,
        max_z=2.0,
        horizontal_fov_angle=1.2,
        model_type=DEPTH_CAMERA,
    )
    lidar = SpatioTemporalSourceParams(
        min_z=0.5,
        max_z=2.0,
        horizontal_fov_angle=6.29,
        model_type=LIDAR_3D,
    )
    assert is_inside(camera, dx, dy, 0.0).tolist() == [True, True, False, False]
    assert is_inside(lidar, dx, dy, 0.0).tolist() == [True, False, False, False]
    assert not is_inside(camera, dx, dy, math.pi).any()


@pytest.mark.parametrize(("angle", "sees"), [(6.27, False), (6.2701, True)])
def test_a_lidar_that_sees_nearly_all_around_has_no_sides(angle, sees):
    lidar = SpatioTemporalSourceParams(max_z=2.0, horizontal_fov_angle=angle, model_type=LIDAR_3D)
    assert is_inside(lidar, np.array([-1.0]), np.array([0.001]), 0.0)[0] == sees


def test_a_frustum_turns_with_the_robot_and_holds_its_edges():
    camera = SpatioTemporalSourceParams(
        min_z=0.5,
        max_z=2.0,
        horizontal_fov_angle=1.2,
        model_type=DEPTH_CAMERA,
    )
    ahead, aside = (
        np.array([0.5, 2.0, 0.499, 2.001, 1.0, 1.0, 1.0]),
        np.array([0, 0, 0, 0, 0.684, -0.684, -0.685]),
    )
    dx, dy = (
        ahead * math.cos(2.0) - aside * math.sin(2.0),
        ahead * math.sin(2.0) + aside * math.cos(2.0),
    )
    dx[:2], dy[:2] = dx[:2] * (1.0 + 1e-9, 1.0 - 1e-9), dy[:2] * (1.0 + 1e-9, 1.0 - 1e-9)
    # tan 0.6 = 0.6841
    assert is_inside(camera, dx, dy, 2.0).tolist() == [True, True, False, False, True, True, False]
    edges = np.array([0.5, 2.0])
    assert is_inside(camera, edges, np.zeros(2), 0.0).all()
