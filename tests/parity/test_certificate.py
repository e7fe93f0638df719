"""The certificate: nothing is skipped silently, and what it compares it does compare.

Bad folders are refused.
"""

import dataclasses
import json
import math
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from navbench.cli.app import main
from navstack.costmap import inflation
from navstack.costmap.inflation import Inflation
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.localization.likelihood_field import LikelihoodField
from navstack.params.costmap import InflationLayerParams
from navstack.types import Pose2D
from tools.parity.__main__ import parity
from tools.parity.amcl import MAP
from tools.parity.certificate import PARTS, UNREAD, certify, compare, discover, passes
from tools.parity.comparison import Comparison
from tools.parity.golden import META, GoldenFile, read_folder

GOLDEN = Path(__file__).parents[1] / "golden"

MOVED = "motion_seq_end_seed5_alphas_costnav_pose1.2_2.15_1.0_delta.2_.15_.3"

# part -> a case of it and its recorded outputs; a change of any of them must be noticed
OUTPUTS = {
    "inflation_curves": ("curve_local", "curve_local_cost curve_local_cost_cells footprint_local"),
    "inflation": ("border", "border_out_legacy"),
    "inflation_main": ("border", "border_out_exact_sqrt"),
    "obstacle_layer": (
        "roll120_nofp",
        "roll120_nofp_s3_{obst_grid,master,map_origin,bounds_x0_xn_y0_yn}",
    ),
    "navfn": ("near_goal_astar", "near_goal_astar_{potential,navfn_cost,path,navfn_path_cells}"),
    "simple_smoother": ("sm_short5", "sm_short5_out"),
    "dwb": (
        "goal_slowing",
        "goal_slowing_{vel,raw,total,illegal_critic,npose,last_pose,poses,times,grid_GoalAlign,"
        "grid_PathAlign,grid_PathDist,grid_GoalDist}",
    ),
    "dwb_jazzy": (
        "corridor",
        "corridor_s1_{transformed_plan,vel,raw,total,illegal_critic,npose,last_pose,poses}",
    ),
    "dwb_velocities": ("twists_hol_lim_1", "twists_hol_lim_1"),
    "dwb_plan": ("adjust_gap3", "adjust_gap3_out"),
    "rpp": ("arc", "arc_cmd"),
    "rotation_shim": ("rsj_rotate_once", "rsj_rotate_once"),
    "rotation_shim_main": ("rs_neg", "rs_neg_cmd"),
    "velocity_smoother": ("vs_deadband", "vs_deadband_out"),
    "collision_monitor": ("cm_time_mp4_dt0.1_tb2.0", "cm_time_mp4_dt0.1_tb2.0"),
    "collision_monitor_edges": ("cm_edge", "cm_edge_inside"),
    "amcl_field": ("occ_dist_res64_max2.0", "occ_dist_res64_max2.0"),
    "amcl_localizer": ("n720_b360", "n720_b360_{weights_norm,weights_norm_2nd_update}"),
    "amcl_weights": ("n720_b360", "n720_b360_{weights_norm,weights_norm_2nd_update}"),
    "amcl_generator": ("drand48_seed42_first20", "drand48_seed42_first20"),
    "amcl_motion": (MOVED, MOVED),
    "amcl_limits": ("kld_limit_costnav", "kld_limit_costnav"),
    "amcl_resampling": ("resample_sp0.2_out_poses_seed9", "resample_sp0.2_out_poses_seed9"),
    "amcl_clusters": ("cluster", "cluster_poses cluster_w"),
}


class Altered(GoldenFile):
    """A file of which one array reads differently."""

    altered = ""

    def __getitem__(self, name: str) -> np.ndarray:
        array = super().__getitem__(name)
        return (
            np.where(array > 0, array - 1, array + 1).astype(array.dtype)
            if name == self.altered
            else array
        )


def outputs() -> list[tuple[str, str, str]]:
    found = []
    for part, (case, names) in OUTPUTS.items():
        stem, brace, listed = names.partition("{")
        parts = (
            [stem + suffix for suffix in listed.rstrip("}").split(",")] if brace else names.split()
        )
        found += [(part, case, array) for array in parts]
    return found


@pytest.mark.parametrize(("part_name", "case_name", "array"), outputs())
def test_every_recorded_output_is_compared(part_name: str, case_name: str, array: str) -> None:
    part = next(part for part in PARTS if part.name == part_name)
    path = next(file.path for file in read_folder(GOLDEN) if array in file)
    file = Altered(path)
    case = next(case for case in part.find(file) if case.name == case_name)
    assert array in case.arrays
    assert compare(part, case).wrong == []
    file.altered = array
    assert compare(part, case).wrong != []


def test_a_path_of_navfn_is_compared_pose_by_pose() -> None:
    class Displaced(GoldenFile):
        """A file of which one pose in the middle of a path is a centimetre off."""

        def __getitem__(self, name: str) -> np.ndarray:
            array = super().__getitem__(name).copy()
            if name == "empty60_dijkstra_path":
                array[50, 0] += 0.01
            return array

    part = next(part for part in PARTS if part.name == "navfn")
    case = next(
        case
        for case in part.find(Displaced(GOLDEN / "navfn_small.npz"))
        if case.name == "empty60_dijkstra"
    )
    (wrong,) = compare(part, case).wrong
    assert wrong.startswith("positions [m]: 1 of 206 differ, first at [50, 0]")


def test_parts_that_can_be_compared_are_all_listed_above() -> None:
    # no array holds what was recorded
    from_facts = {"collision_monitor_overflow", "amcl_moments", "amcl_spread"}
    assert set(OUTPUTS) | from_facts == {part.name for part in PARTS}


def test_the_vectors_of_the_project_belong_to_parts() -> None:
    if "NAVSTACK_GOLDEN" in os.environ:
        pytest.skip("another folder is tested")
    results = {result.part: result.cases for result in certify(read_folder(GOLDEN))}
    assert UNREAD not in results
    assert set(results) == {part.name for part in PARTS}
    assert sum(results.values()) >= 130


def store(path: Path, meta: object = None, **arrays: np.ndarray) -> Path:
    np.savez(path, **arrays, **({} if meta is None else {META: np.array(json.dumps(meta))}))
    return path


def test_arrays_of_no_part_and_halves_of_cases_are_reported(tmp_path: Path) -> None:
    store(
        tmp_path / "odd.npz",
        {"a": {}},
        a_out_legacy=np.zeros(3),
        riddle=np.zeros(3),
        costmap480=np.zeros(3),
    )
    (result,) = certify(read_folder(tmp_path))
    assert (result.part, result.cases, result.equal, result.largest_deviation) == (
        UNREAD,
        2,
        0,
        None,
    )
    assert [deviation.case for deviation in result.deviations] == ["odd/a_out_legacy", "odd/riddle"]
    assert not passes([result])


def test_an_array_of_a_case_that_its_comparison_does_not_read_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = GoldenFile(GOLDEN / "amcl.npz")
    arrays = {name: source[name] for name in ("cluster_poses", "cluster_w")}
    store(tmp_path / "amcl.npz", {"cluster_stats": source.meta["cluster_stats"]}, **arrays)
    assert passes(certify(read_folder(tmp_path)))
    (part,) = (part for part in PARTS if part.name == "amcl_clusters")
    half = dataclasses.replace(part, check=lambda case, comparison: case["poses"])
    monkeypatch.setattr("tools.parity.certificate.PARTS", (half,))
    *_, unread = certify(read_folder(tmp_path))
    assert [deviation.case for deviation in unread.deviations] == ["amcl/cluster_w"]
    assert not passes([unread])


def test_a_distance_that_no_brush_fire_gives_is_told(tmp_path: Path) -> None:
    source = GoldenFile(GOLDEN / "amcl.npz")
    name = "occ_dist_res64_max0.5"
    distances = source[name].copy()
    facts = {"map": source.meta["map"], name: source.meta[name]}
    exact = LikelihoodField.of_map(OccupancyGrid(source[MAP], 0.05, Pose2D()), 0.5)
    ours = exact.distances[exact.codes[1:-1, 1:-1]]
    # the exact distance where the fire gives a larger one
    row, column = np.argwhere(distances > ours + 1e-3)[0]
    distances[row, column] = ours[row, column]
    store(tmp_path / "amcl.npz", facts, **{MAP: source[MAP], name: distances})
    (field,) = certify(read_folder(tmp_path))
    (deviation,) = field.deviations
    assert not deviation.is_explained
    assert "distances of the brush fire [m]: 1 of 32000 differ" in deviation.why


def test_a_case_whose_facts_are_incomplete_counts_as_not_compared(tmp_path: Path) -> None:
    store(
        tmp_path / "half.npz",
        {"a": {"inflation_radius": 1.0}},
        a_in=np.zeros((3, 3)),
        a_out=np.zeros((3, 3)),
    )
    (result,) = certify(read_folder(tmp_path))
    (deviation,) = result.deviations
    assert "cannot be compared (KeyError" in deviation.why
    assert (result.cases, result.equal) == (1, 0)
    assert (deviation.is_explained, deviation.is_compared) == (False, False)
    assert not passes([result])


@pytest.mark.filterwarnings("error")
def test_numbers_beyond_single_precision_are_neither_equal_nor_different(tmp_path: Path) -> None:
    source = GoldenFile(GOLDEN / "inflation.npz")
    facts = {**source.facts("border"), "cost_scaling_factor": -1e300}
    store(
        tmp_path / "far.npz",
        {"a": facts},
        a_in=source["border_in"],
        a_out_legacy=source["border_out_legacy"],
    )
    clusters = GoldenFile(GOLDEN / "amcl.npz")
    poses, weights = np.full_like(clusters["cluster_poses"], 1e300), clusters["cluster_w"]
    store(
        tmp_path / "clusters.npz",
        {"cluster_stats": clusters.facts("cluster_stats")},
        cluster_poses=poses,
        cluster_w=weights,
    )
    results = certify(read_folder(tmp_path))
    assert [result.part for result in results] == ["inflation", "amcl_clusters"]
    assert not any(result.equal for result in results)
    assert not any(deviation.is_compared for result in results for deviation in result.deviations)


def test_a_window_and_missing_facts_of_inflation_are_understood(tmp_path: Path) -> None:
    source = GoldenFile(GOLDEN / "inflation.npz")
    facts = {
        key: value
        for key, value in source.facts("single").items()
        if not key.startswith("inflate_")
    }
    whole, given = source["single_out_legacy"], source["single_in"]
    part = given.copy()
    part[10:60, 20:70] = whole[10:60, 20:70]
    both = {"whole": facts, "part": {**facts, "window": [20, 10, 70, 60]}}
    arrays = {
        "whole_in": given,
        "whole_out_legacy": whole,
        "part_in": given,
        "part_out_legacy": part,
    }
    store(tmp_path / "windows.npz", both, **arrays)
    (result,) = certify(read_folder(tmp_path))
    assert (result.part, result.cases, result.equal) == ("inflation", 2, 2)


@pytest.mark.parametrize("rounding", [round, math.floor, lambda cells: math.ceil(cells) + 1])
def test_a_radius_that_is_not_rounded_up_is_noticed(
    rounding: Callable[[float], int], monkeypatch
) -> None:
    assert not _inflation_failures()
    monkeypatch.setattr(
        inflation, "cell_distance", lambda distance, resolution: rounding(distance / resolution)
    )
    assert len(_inflation_failures()) > 5


def _inflation_failures() -> list[str]:
    results = certify([GoldenFile(GOLDEN / "inflation.npz")])
    found = [
        deviation
        for result in results
        for deviation in result.deviations
        if not deviation.is_explained
    ]
    return [deviation.case for deviation in found]


def test_a_cost_that_is_an_integer_but_for_rounding_is_named_as_such(tmp_path: Path) -> None:
    source = GoldenFile(GOLDEN / "inflation.npz")
    name, factor = "single", 252.0 / 126.0  # 252 exp(-k d) is 126 at d = ln 2 / k
    facts = dict(source.facts(name))
    inscribed, resolution = facts["inscribed_circumscribed"][0], facts["resolution"]
    cells = 8
    facts["cost_scaling_factor"] = float(np.log(factor) / (cells * resolution - inscribed))
    grid = source[f"{name}_in"]
    given = {key: facts[key] for key in ("inflation_radius", "cost_scaling_factor")}
    params = InflationLayerParams(**given)
    ours = grid.copy()
    Inflation(params, resolution, inscribed).apply(ours, 0, grid.shape[1], 0, grid.shape[0])
    ((row, column),) = np.argwhere(grid == 254)
    theirs = ours.copy()
    at = (row, column + cells)
    assert ours[at] in (125, 126)
    theirs[at] = 251 - ours[at]  # the other of the two
    for worse, is_explained in ((0, True), (1, False)):
        theirs[row, column + 5] = ours[row, column + 5] - worse
        store(tmp_path / "round.npz", {"a": facts}, a_in=grid, a_out_legacy=theirs)
        (result,) = certify(read_folder(tmp_path))
        assert [deviation.is_explained for deviation in result.deviations] == [is_explained]


def test_a_cell_that_jazzys_search_gives_to_a_farther_source_is_explained(tmp_path: Path) -> None:
    facts = dict(GoldenFile(GOLDEN / "inflation.npz").facts("single"))
    inscribed, resolution = facts["inscribed_circumscribed"][0], facts["resolution"]
    given = {key: facts[key] for key in ("inflation_radius", "cost_scaling_factor")}
    params = InflationLayerParams(**given)
    grid = np.zeros((40, 40), dtype=np.uint8)
    grid[20, 18] = grid[20, 23] = 254
    inflated = grid.copy()
    Inflation(params, resolution, inscribed).apply(inflated, 0, 40, 0, 40)
    for column, is_explained in ((23 - 1 + 8, True), (23 - 1 + 6, False)):
        theirs = inflated.copy()
        cell, other = (20, 18 + 7), (20, column)  # two cells from the nearest, seven from the other
        theirs[cell] = inflated[other]
        assert theirs[cell] < inflated[cell]
        store(tmp_path / "farther.npz", {"a": facts}, a_in=grid, a_out_legacy=theirs)
        (result,) = certify(read_folder(tmp_path))
        assert [deviation.is_explained for deviation in result.deviations] == [is_explained]


def test_cases_are_found_by_content_whatever_files_and_scenes_are_called(tmp_path: Path) -> None:
    source = GoldenFile(GOLDEN / "dwb_a.npz")
    arrays = {
        name.replace("rest_straight", "x_grid"): source[name]
        for name in source.names
        if "rest" in name
    }
    meta = {**source.meta, "x_grid": source.meta["rest_straight"]}
    store(tmp_path / "whatever.npz", meta, **arrays)
    cases = discover(read_folder(tmp_path))
    assert [(part.name, case.name) for part, case in cases] == [("dwb", "x_grid")]
    (result,) = certify(read_folder(tmp_path))
    assert result.equal == 1


def test_nearness_counts_what_it_cannot_compare() -> None:
    for ours, theirs in ((np.nan, 1.0), (np.inf, 1.0), (1.0, np.nan), ([1.0, 2.0], [1.0])):
        comparison = Comparison()
        comparison.near("value", ours, theirs, 1e3)
        assert comparison.wrong
        assert np.isfinite(comparison.largest)
    comparison = Comparison()
    comparison.angles("angle", [3.14], [-3.14], 0.01)
    comparison.near("infinite", [np.inf], [np.inf], 0.01)
    comparison.near("relative", [1.001], [1.0], 0.01, relative=True)
    assert comparison.is_equal
    assert comparison.largest == pytest.approx(2 * np.pi - 6.28)


def complaint(capsys: pytest.CaptureFixture[str], folder: Path) -> str:
    with pytest.raises(SystemExit) as leaving:
        main(["--golden", str(folder)], program=parity)
    assert leaving.value.code == 1
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1, captured.err
    return captured.err


def test_folders_and_files_that_cannot_be_used(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "nowhere' is not a folder; give a folder of .npz files" in complaint(
        capsys, tmp_path / "nowhere"
    )
    assert "holds no .npz file" in complaint(capsys, tmp_path)
    file = tmp_path / "a.npz"
    whole = (GOLDEN / "inflation.npz").read_bytes()
    for content in (b"", b"not a zip", whole[:1000], whole[: len(whole) // 2]):
        file.write_bytes(content)
        assert "a.npz: is not a readable .npz file" in complaint(capsys, tmp_path)
    with file.open("wb") as stream:
        np.save(stream, np.zeros(3))
    assert "single array" in complaint(capsys, tmp_path)
    store(file, a=np.zeros(3))
    assert "holds no 'meta_json'" in complaint(capsys, tmp_path)
    store(file, ["a"], a=np.zeros(3))
    assert "no mapping" in complaint(capsys, tmp_path)
    np.savez(file, **{META: np.array([{}], dtype=object)})
    assert "cannot be read" in complaint(capsys, tmp_path)
    store(file, {})
    assert "holds no case" in complaint(capsys, tmp_path)


def test_facts_of_the_wrong_kind_are_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    start = np.zeros((2, 3))
    moved = "motion_seq_end_seed1_alphas_a_pose0_0_0_delta1_0_0"
    store(tmp_path / "amcl.npz", {"motion_moments": 5}, motion_seq_start=start, **{moved: start})
    assert "holds facts in which no case of amcl_moments can be looked for" in complaint(
        capsys, tmp_path
    )
    unusable = (
        [7],
        {"set": 1},
        [{"set": "a"}],
        [{"set": "a", "alphas": "wide"}],
        [{"set": "a", "alphas": [0.1] * 9}],
    )
    for facts in unusable:
        store(
            tmp_path / "amcl.npz",
            {"motion_moments": facts},
            motion_seq_start=start,
            **{moved: start},
        )
        with pytest.raises(SystemExit) as leaving:
            main(["--golden", str(tmp_path), "--json"], program=parity)
        assert leaving.value.code == 1


def test_moments_are_given_in_standard_errors() -> None:
    units = {part.name: part.unit for part in PARTS if part.unit}
    assert units == {"amcl_moments": "standard errors", "amcl_spread": "standard errors"}


def test_a_damaged_array_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    meta = {"a": {"inflation_radius": 1.0}}
    file = store(tmp_path / "a.npz", meta, a_in=np.full((50, 50), 7.0), a_out=np.zeros((50, 50)))
    content = bytearray(file.read_bytes())
    content[content.index(np.full(3, 7.0).tobytes())] ^= 1
    file.write_bytes(bytes(content))
    assert "damaged at array 'a_in'" in complaint(capsys, tmp_path)


def test_the_document(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    for name in ("dwb_a", "navfn_small"):
        (tmp_path / f"{name}.npz").symlink_to(GOLDEN / f"{name}.npz")
    with pytest.raises(SystemExit) as leaving:
        main(["--golden", str(tmp_path), "--json"], program=parity)
    assert not leaving.value.code
    parts = json.loads(capsys.readouterr().out)["parts"]
    assert [part["part"] for part in parts] == ["navfn", "dwb"]
    for part in parts:
        assert part["cases"] == part["equal"] + len(part["deviations"])
        assert part["largest_deviation"] < 1e-5
        assert all(deviation["explained"] for deviation in part["deviations"])
    with pytest.raises(SystemExit):
        main(["--golden", str(tmp_path)], program=parity)
    printed = capsys.readouterr().out
    assert "goal_in_obstacle_tol0_astar" in printed
    assert "equal, or its deviation explained" in printed
