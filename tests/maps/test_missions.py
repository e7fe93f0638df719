"""Missions: drawn by the published rules, always feasible, measured along the navigation mesh."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy import ndimage

from harness.episode.factory import Parts
from harness.task.mission import (
    CLEARANCE,
    Mission,
    MissionSampler,
    check_footprint_free,
    check_pose_free,
)
from harness.task.study import make_study
from harness.world.map.scene_io import load_scene
from navstack.costmap.map_io import save_map
from navstack.costmap.occupancy_grid import FREE, OccupancyGrid
from navstack.errors import InputError, MapError
from navstack.types import FloatArray, Pose2D

MISSIONS = 150


@pytest.fixture(scope="module")
def mesh() -> OccupancyGrid:
    return load_scene("sidewalk").navigation_mesh


@pytest.fixture(scope="module")
def clearance(mesh: OccupancyGrid) -> FloatArray:
    """Distance [m] of cells' centres from what is not free."""
    distance: FloatArray = (
        ndimage.distance_transform_edt(np.pad(mesh.data == FREE, 1))[1:-1, 1:-1] * mesh.resolution
    )
    return distance


@pytest.fixture(scope="module")
def missions(mesh: OccupancyGrid) -> list[Mission]:
    return draw(mesh, "published")


def draw(mesh: OccupancyGrid, sampling: str) -> list[Mission]:
    sampler, rng = MissionSampler(mesh, sampling), np.random.default_rng(2)
    return [sampler.sample(rng) for _ in range(MISSIONS)]


@pytest.fixture(autouse=True)
def cache_elsewhere(
    tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NAVSTACK_CACHE", str(tmp_path_factory.getbasetemp() / "mission-cache"))


def room(height: int, width: int, resolution: float = 0.1) -> OccupancyGrid:
    data = np.zeros((height, width), dtype=np.int8)
    return OccupancyGrid(data, resolution, Pose2D(-2.0, 3.0))


def test_start_and_goal_keep_their_distance(clearance: FloatArray, missions: list[Mission]) -> None:
    for mission in missions:
        for pose in (mission.start, mission.goal):
            row, column = int((pose.y + 100.0) / 0.05), int((pose.x + 100.0) / 0.05)
            assert clearance[row, column] >= CLEARANCE
        crow = math.dist((mission.start.x, mission.start.y), (mission.goal.x, mission.goal.y))
        assert crow >= 20.0 - 0.2
        assert mission.shortest_path >= crow - 1e-6


def test_distribution(missions: list[Mission]) -> None:
    lengths = [mission.shortest_path for mission in missions]
    assert np.mean(lengths) == pytest.approx(102.0, rel=0.15)  # the published mean
    headings = np.array([mission.start.yaw for mission in missions])
    resultant = abs(np.exp(1j * headings).mean())  # Rayleigh test of uniform headings
    assert resultant < math.sqrt(7.0 / len(headings))


@pytest.mark.slow
def test_uniform_goals_are_farther_and_lie_anywhere(
    mesh: OccupancyGrid,
    clearance: FloatArray,
    missions: list[Mission],
) -> None:
    uniform = draw(mesh, "uniform")
    lengths = [mission.shortest_path for mission in uniform]
    assert np.mean(lengths) == pytest.approx(129.0, rel=0.15)  # what the paper's map gives
    assert np.mean(lengths) > np.mean([mission.shortest_path for mission in missions])
    rows, columns = np.nonzero(clearance >= CLEARANCE)
    centre = np.array((columns.mean(), rows.mean())) * mesh.resolution - 100.0
    for ends in (
        [(m.start.x, m.start.y) for m in uniform],
        [(m.goal.x, m.goal.y) for m in uniform],
    ):
        # four standard errors of a mean of places spread by 55 m
        assert np.mean(ends, axis=0) == pytest.approx(centre, abs=4.0 * 55.0 / math.sqrt(MISSIONS))


def test_a_goal_projected_to_the_nearest_walkable_point_lacks_the_clearance(
    mesh: OccupancyGrid, clearance: FloatArray
) -> None:
    """Why goals off the mesh are drawn anew instead of being projected first."""
    free = mesh.data == FREE
    off_mesh = np.argwhere(~free)
    rows, columns = ndimage.distance_transform_edt(
        ~free, return_distances=False, return_indices=True
    )
    drawn = off_mesh[np.random.default_rng(0).integers(len(off_mesh), size=2000)].T
    assert clearance[rows[tuple(drawn)], columns[tuple(drawn)]].max() < 0.1 * CLEARANCE


def test_given_poses_may_stand_on_ground_that_the_mesh_leaves_out() -> None:
    ground, mesh = room(100, 100), room(100, 100)
    mesh.data[:4] = 100  # 0.4 m drawn in front of the wall
    start, goal = Pose2D(0.0, 3.25), Pose2D(6.0, 8.0)
    assert MissionSampler(mesh, ground=ground).mission(start, goal).start == start
    with pytest.raises(InputError, match="occupied or unknown cell"):
        MissionSampler(mesh).mission(start, goal)
    with pytest.raises(InputError, match="did you mean 'uniform'"):
        MissionSampler(mesh, "unifrom")


def test_same_seed_same_missions(mesh: OccupancyGrid, missions: list[Mission]) -> None:
    sampler, rng = MissionSampler(mesh), np.random.default_rng(2)
    assert [sampler.sample(rng) for _ in range(5)] == missions[:5]


def test_given_poses_and_the_length_round_a_wall() -> None:
    grid = room(100, 100)
    grid.data[:80, 50] = 100  # a wall with a gap of 2 m at its upper end
    mission = MissionSampler(grid).mission(Pose2D(0.05, 4.05, 1.0), Pose2D(6.05, 4.05, 2.0))
    assert (mission.start, mission.goal) == (Pose2D(0.05, 4.05, 1.0), Pose2D(6.05, 4.05, 2.0))
    # past the wall's end (3.0..3.1, 11.0) at 0.4 m
    around = math.hypot(2.95, 7.35) + 0.1 + math.hypot(2.95, 7.35)
    assert mission.shortest_path == pytest.approx(around, abs=0.5)


def test_no_way_through_a_gap_narrower_than_the_robot() -> None:
    grid = room(100, 100)
    grid.data[:, 50] = 100
    grid.data[40:47, 50] = 0  # 0.7 m
    with pytest.raises(InputError, match=r"no path of 0\.8 m width"):
        MissionSampler(grid).mission(Pose2D(0.0, 8.0), Pose2D(6.0, 8.0))
    grid.data[40:51, 50] = 0  # 1.1 m
    assert MissionSampler(grid).mission(
        Pose2D(0.0, 7.5), Pose2D(6.0, 7.5)
    ).shortest_path == pytest.approx(6.0, abs=0.4)


def test_small_rooms_have_missions_too() -> None:
    mission = MissionSampler(room(80, 120)).sample(np.random.default_rng(0))
    assert -1.0 <= mission.start.x <= 9.0
    assert mission.shortest_path > 1.0


def test_the_goals_heading_is_that_of_the_way() -> None:
    sampler, rng = MissionSampler(room(80, 600)), np.random.default_rng(0)
    for _ in range(10):
        mission = sampler.sample(rng)
        direct = math.atan2(mission.goal.y - mission.start.y, mission.goal.x - mission.start.x)
        assert abs(math.remainder(mission.goal.yaw - direct, 2 * math.pi)) < 0.1


def test_poses_that_users_give() -> None:
    grid = room(50, 50)
    grid.data[10:20, 10:20] = 100
    check_pose_free(grid, Pose2D(0.0, 3.5), "start")
    with pytest.raises(InputError) as error:
        # 0.35 m right of the block's left edge at x = -1
        check_pose_free(grid, Pose2D(-0.65, 4.5), "goal")
    told = "lies in an occupied or unknown cell; nearest free cell is 0.40 m away"
    assert str(error.value) == f"goal (-0.7, 4.5) m {told}"
    with pytest.raises(
        InputError, match=r"start \(9\.0, 9\.0\) m lies outside the map; allowed: x -2\.0\.\.3\.0"
    ):
        check_pose_free(grid, Pose2D(9.0, 9.0), "start")
    with pytest.raises(InputError, match="finite"):
        check_pose_free(grid, Pose2D(math.nan, 0.0), "start")


def test_a_footprint_that_a_coarse_cell_reaches_is_refused() -> None:
    grid = room(10, 10, 1.0)
    grid.data[:, :1] = 100
    square = np.array(((0.4, 0.3), (0.4, -0.3), (-0.4, -0.3), (-0.4, 0.3)))
    clear = Pose2D(grid.origin.x + 1.5, grid.origin.y + 5.0)
    check_footprint_free(grid, clear, square)
    with pytest.raises(InputError, match="footprint reaches into an obstacle"):
        check_footprint_free(grid, Pose2D(clear.x - 0.4, clear.y), square)


def test_no_mission_leads_through_a_wall_beside_its_start() -> None:
    grid = room(200, 200, 0.05)
    grid.data[:, 14] = 100  # a closet of 0.7 m
    start, goal = Pose2D(grid.origin.x + 0.4, 5.0), Pose2D(grid.origin.x + 8.0, 5.0)
    with pytest.raises(InputError, match=r"no path of 0.8 m width leads from start"):
        MissionSampler(grid).mission(start, goal)
    mission = MissionSampler(grid).mission(Pose2D(start.x + 1.0, 5.0), goal)
    assert mission.shortest_path >= 6.6


def test_maps_without_room_are_refused() -> None:
    with pytest.raises(MapError, match="no room to draw missions"):
        MissionSampler(room(15, 15)).sample(np.random.default_rng(0))
    turned = OccupancyGrid(np.zeros((100, 100), dtype=np.int8), 0.1, Pose2D(0.0, 0.0, 0.5))
    with pytest.raises(MapError, match="yaw"):
        MissionSampler(turned).sample(np.random.default_rng(0))


def test_no_drawn_delivery_is_over_before_it_begins(tmp_path: Path) -> None:
    # 8 m x 8 m: of uniform draws one in six is within 2 m
    save_map(room(80, 80), tmp_path / "yard.yaml")
    tasks = make_study(
        stacks=["parked"],
        episodes=60,
        map_name=str(tmp_path / "yard.yaml"),
        missions="uniform",
    ).tasks()
    for each in tasks:
        mission = Parts(each).mission(each.generators()["mission"])
        assert math.hypot(mission.goal.x - mission.start.x, mission.goal.y - mission.start.y) > 2.0
