"""``navbench plan`` on a small map, and the independent check of paths."""

import contextlib
import json
import math
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
import shapely
import yaml

from harness.plan import question as planning
from harness.plan.path_check import REACH, Obstacles, placements_along
from harness.plan.question import NAMES, cost_of, make_planner, make_smoother
from harness.storage.shipped import shipped
from navstack.costmap.costmap import Costmap
from navstack.errors import ParameterError, UnknownNameError
from navstack.params.nav2_file.file import load_nav2
from navstack.params.nav2_file.views import read_planners
from navstack.params.planners import STATE_SPACES, OmplParams
from navstack.planning.ompl_planner import OmplPlanner
from navstack.planning.planner import RobotShape
from navstack.types import Path as Plan
from navstack.types import Pose2D
from tests.command import status

TUNED = shipped("params") / "nav2" / "tuned.yaml"
MAP = (
    "image: map.pgm\nresolution: 0.05\norigin: [0, 0, 0]\noccupied_thresh: 0.65\n"
    "free_thresh: 0.25\nnegate: 0\n"
)
WIDTH, HEIGHT = 280, 200  # [cells] 14 x 10 m
START, GOAL = "2.5,2.5,0", "11.5,2.5,0"
BODY = np.array(((0.14, 0.25), (0.14, -0.25), (-0.607, -0.25), (-0.607, 0.25)))


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A map with a wall that leaves a way at the top."""
    pixels = np.full((HEIGHT, WIDTH), 254, dtype=np.uint8)
    pixels[70:, 136:144] = 0  # row 0 is the top
    folder = tmp_path_factory.mktemp("room")
    (folder / "map.pgm").write_bytes(f"P5 {WIDTH} {HEIGHT} 255\n".encode() + pixels.tobytes())
    (folder / "map.yaml").write_text(MAP, encoding="utf-8")
    return folder / "map.yaml"


def plan(*arguments: str) -> int:
    return status("plan", *arguments)


def document(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict:
    assert plan(*arguments, "--json") == 0
    return json.loads(capsys.readouterr().out)


@pytest.mark.parametrize("has_ground", [False, True])
@pytest.mark.parametrize("allows", [True, False])
def test_the_file_says_whether_a_plan_crosses_unknown_cells(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, allows: bool, has_ground: bool
) -> None:
    """As in Nav2; but where the map's walkable ground was given, that holds."""
    pixels = np.full((HEIGHT, WIDTH), 254, dtype=np.uint8)
    pixels[:, 136:144] = 0
    pixels[120:180, 136:144] = 150  # neither free nor occupied
    image = f"P5 {WIDTH} {HEIGHT} 255\n".encode()
    (tmp_path / "map.pgm").write_bytes(image + pixels.tobytes())
    (tmp_path / "map.yaml").write_text(MAP, encoding="utf-8")
    if has_ground:
        closed = np.where(pixels == 254, np.uint8(254), np.uint8(0))
        (tmp_path / "map_walkable.pgm").write_bytes(image + closed.tobytes())
        ground = MAP.replace("map.pgm", "map_walkable.pgm")
        (tmp_path / "map_walkable.yaml").write_text(ground, encoding="utf-8")
    parameters = yaml.safe_load(TUNED.read_text(encoding="utf-8"))
    costmap = parameters["global_costmap"]["global_costmap"]["ros__parameters"]
    costmap["track_unknown_space"] = True
    planner = parameters["planner_server"]["ros__parameters"]["GridBased"]
    planner["allow_unknown"] = allows
    file = tmp_path / "mine.yaml"
    file.write_text(yaml.safe_dump(parameters), encoding="utf-8")
    given = ("--map", str(tmp_path / "map.yaml"), "--start", START, "--goal", GOAL)
    crosses = plan(*given, "--params", str(file), "--planner", "NavFn") == 0
    assert ("no path" in capsys.readouterr().out) != crosses
    assert crosses == (allows and not has_ground)


def test_every_planner_answers_with_a_path_that_touches_nothing(
    capsys: pytest.CaptureFixture[str], room: Path, tmp_path: Path
) -> None:
    params = tmp_path / "nav2.yaml"
    text = TUNED.read_text(encoding="utf-8")
    params.write_text(
        text.replace(
            'planner_plugins: ["GridBased"]', 'planner_plugins: ["GridBased", "Sampled"]'
        ).replace(
            "    GridBased:\n",
            "    Sampled:\n      plugin: navstack::OmplPlanner\n"
            "      max_iterations: 1500\n    GridBased:\n",
        ),
        encoding="utf-8",
    )
    arguments = ("--map", str(room), "--start", START, "--goal", GOAL, "--planner", ",".join(NAMES))
    arguments = (*arguments, "--params", str(params))
    answer = document(capsys, *arguments)
    assert answer["start"] == [2.5, 2.5, 0.0]
    assert answer["goal"] == [11.5, 2.5, 0.0]
    assert [row["planner"] for row in answer["planners"]] == list(NAMES)
    shortest = 2.0 * math.hypot(4.3, 4.0)  # around the wall's end
    for row in answer["planners"]:
        assert row["found"], row["why"]
        assert shortest < row["length_m"] < 1.3 * shortest
        assert row["clearance_m"] > 0.0
        assert not row["touches"]
        assert row["cost"] >= row["length_m"]
        assert row["time_ms"] > 0.0
        path = np.array(row["path"])
        assert np.hypot(*np.diff(path[:, :2], axis=0).T).sum() == pytest.approx(
            row["length_m"], abs=1e-3
        )
    again = document(capsys, *arguments)
    assert [row["path"] for row in again["planners"]] == [row["path"] for row in answer["planners"]]


def test_table_picture_and_smoother(
    capsys: pytest.CaptureFixture[str],
    room: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    told: list[str] = []

    @contextlib.contextmanager
    def counted(what: str, total: int) -> Iterator[Callable[[], None]]:
        told.append(f"{total} {what}")
        yield lambda: told.append("one more")

    monkeypatch.setattr("navbench.api.plan.count_shown", counted)
    picture = tmp_path / "plan.png"
    arguments = (
        "--map",
        str(room),
        "--start",
        START,
        "--goal",
        GOAL,
        "--planner",
        "NavFn",
        "--planner",
        "RRTConnect",
    )
    assert plan(*arguments, "--smoother", "SimpleSmoother", "--picture", str(picture)) == 0
    shown = capsys.readouterr().out
    assert told == ["2 planners", "one more", "one more"]
    assert "smoothed by" in shown
    assert all(word in shown for word in ("NavFn", "RRTConnect", "Clearance [m]", str(picture)))
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_auto_draws_the_same_mission_for_the_same_seed(
    capsys: pytest.CaptureFixture[str], room: Path
) -> None:
    first = document(capsys, "--map", str(room), "--seed", "4", "--planner", "NavFn")
    again = document(capsys, "--map", str(room), "--seed", "4", "--planner", "RRTConnect")
    other = document(capsys, "--map", str(room), "--seed", "5", "--planner", "NavFn")
    assert (first["start"], first["goal"]) == (again["start"], again["goal"])
    assert first["goal"] != other["goal"]
    one = document(
        capsys, "--map", str(room), "--seed", "4", "--start", START, "--planner", "NavFn"
    )
    assert one["start"] == [2.5, 2.5, 0.0]


def test_a_costmap_that_moves_with_the_robot_is_centred_on_the_start(
    capsys: pytest.CaptureFixture[str], room: Path, tmp_path: Path
) -> None:
    window = {"rolling_window": True, "width": 8, "height": 8}
    nav2 = load_nav2(TUNED).with_values(
        {f"global_costmap.{name}": value for name, value in window.items()}
    )
    nav2.dump(tmp_path / "nav2.yaml")
    arguments = ("--map", str(room), "--start", "9,5,0", "--goal", "12,5,0", "--planner", "NavFn")
    (row,) = document(capsys, *arguments, "--params", str(tmp_path / "nav2.yaml"))["planners"]
    assert row["length_m"] == pytest.approx(3.0, abs=0.1)


def test_both_state_spaces_are_compiled_before_the_first_planner_starts(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    spaces = []

    def make(params: OmplParams, shape: RobotShape) -> OmplPlanner:
        spaces.append(params.state_space)
        return planner(params, shape)

    planner = OmplPlanner
    monkeypatch.setattr("navstack.planning.ompl_planner.OmplPlanner", make)
    planning.compile_first(RobotShape(BODY, 0.14))
    assert spaces == list(STATE_SPACES)


def test_a_time_budget_is_kept_and_improvement_reported(
    capsys: pytest.CaptureFixture[str], room: Path
) -> None:
    arguments = (
        "--map",
        str(room),
        "--start",
        START,
        "--goal",
        GOAL,
        "--planner",
        "RRTstar",
        "--time",
        "0.4",
    )
    (row,) = document(capsys, *arguments)["planners"]
    assert row["time_ms"] > 350.0
    costs = [cost for _, cost in row["improvement"]]
    assert costs == sorted(costs, reverse=True)


@pytest.mark.parametrize(
    ("goal", "planner", "words"),
    [
        ("7.0,2.5,0", "RRTConnect", "goal (7, 2.5) m lies in an occupied cell"),
        ("99,2.5,0", "NavFn", "goal (99, 2.5) m lies outside the costmap"),
    ],
)
def test_why_there_is_no_path(
    capsys: pytest.CaptureFixture[str],
    room: Path,
    tmp_path: Path,
    goal: str,
    planner: str,
    words: str,
) -> None:
    params = tmp_path / "nav2.yaml"
    params.write_text(
        TUNED.read_text(encoding="utf-8").replace(
            '      plugin: "nav2_navfn_planner::NavfnPlanner"\n      tolerance: 0.5\n'
            "      use_astar: false\n",
            '      plugin: "navstack::OmplPlanner"\n      tolerance: 0.1\n',
        ),
        encoding="utf-8",
    )
    arguments = (
        "--map",
        str(room),
        "--start",
        START,
        "--goal",
        goal,
        "--planner",
        planner,
        "--params",
        str(params),
    )
    assert plan(*arguments) == 1
    assert words in capsys.readouterr().out
    assert plan(*arguments, "--json") == 1
    (row,) = json.loads(capsys.readouterr().out)["planners"]
    assert (row["found"], row["path"], row["length_m"]) == (False, [], None)
    assert words in row["why"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--planner", "RRTStar"), ("RRTStar", "did you mean 'RRTstar'")),
        (("--planner", "NavFn,NavFn"), ("NavFn twice",)),
        (("--planner", ","), ("names no planner",)),
        (("--smoother", "Smooth"), ("Smooth", "SimpleSmoother")),
        (("--start", "1,2"), ("1,2", "x,y,yaw")),
        (("--time", "0"), ("--time", "0")),
        (("--seed", "-1"), ("--seed", "-1")),
        (("--params", "tunde"), ("tunde", "tuned")),
        (
            (
                "--start",
                START,
                "--goal",
                GOAL,
                "--planner",
                "NavFn",
                "--picture",
                "no/such/folder.png",
            ),
            ("no/such",),
        ),
        (
            ("--start", START, "--goal", GOAL, "--planner", "NavFn", "--picture", "plan.bag"),
            ("ends with .png",),
        ),
    ],
)
def test_bad_input(
    capsys: pytest.CaptureFixture[str],
    room: Path,
    arguments: tuple[str, ...],
    words: tuple[str, ...],
) -> None:
    assert plan("--map", str(room), *arguments) == 1
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert all(word in error for word in words), error


def test_the_file_selects_planners_and_the_smoother(tmp_path: Path) -> None:
    text = TUNED.read_text(encoding="utf-8")
    (tmp_path / "nav2.yaml").write_text(
        text.replace("      max_its: 1000\n", "      max_its: 7\n"), encoding="utf-8"
    )
    nav2 = load_nav2(tmp_path / "nav2.yaml")
    assert make_smoother("SimpleSmoother", nav2)._params.max_its == 7
    assert [plugin.name for plugin in read_planners(nav2)] == ["GridBased"]
    with pytest.raises(UnknownNameError):
        make_planner("AStar", nav2, RobotShape(BODY, 0.2), 0.0)
    constrained = "nav2_constrained_smoother::ConstrainedSmoother"
    foreign = text.replace("nav2_smoother::SimpleSmoother", constrained)
    (tmp_path / "nav2.yaml").write_text(foreign, encoding="utf-8")
    with pytest.raises(
        ParameterError, match=f"{constrained} is a Nav2 plugin that is not available here"
    ):
        make_smoother("SimpleSmoother", load_nav2(tmp_path / "nav2.yaml"))


def squares_with(*cells: tuple[int, int]) -> Obstacles:
    taken = np.zeros((200, 200), dtype=np.bool_)
    for row, column in cells:
        taken[row, column] = True
    return Obstacles(taken, 0.05, -5.0, -5.0)


def test_clearance_of_a_straight_drive_and_of_a_turn() -> None:
    obstacle = squares_with((114, 100))  # y 0.70..0.75 m, x 0..0.05 m
    line = np.array(((-3.0, 0.0), (3.0, 0.0)))
    assert obstacle.clearance(line, Pose2D(), Pose2D(), BODY) == pytest.approx(0.45)
    turned = np.array(((-3.0, 0.0), (0.02, 0.0), (0.02, -3.0)))  # its rear swings out to the left
    reach = math.hypot(0.607, 0.25)
    expected = 0.7 - reach
    assert obstacle.clearance(turned, Pose2D(), Pose2D(yaw=-math.pi / 2), BODY) == pytest.approx(
        expected, abs=2e-3
    )
    assert (
        squares_with((110, 100)).clearance(turned, Pose2D(), Pose2D(yaw=-math.pi / 2), BODY) == 0.0
    )
    assert squares_with((110, 100)).clearance(line, Pose2D(), Pose2D(), BODY) == pytest.approx(0.25)
    assert squares_with((0, 0)).clearance(line, Pose2D(), Pose2D(), BODY) < REACH
    assert squares_with().clearance(line, Pose2D(), Pose2D(), BODY) == REACH


@pytest.mark.parametrize("x", [-6.0, 6.0])
def test_a_path_beyond_the_map_keeps_its_distance_from_the_map(x: float) -> None:
    """As one within a global costmap that moves with the robot."""
    full = Obstacles(np.ones((200, 200), dtype=np.bool_), 0.05, -5.0, -5.0)
    line = np.array(((x, -2.0), (x, 2.0)))
    ahead = math.pi / 2
    found = full.clearance(line, Pose2D(yaw=ahead), Pose2D(yaw=ahead), BODY)
    assert found == pytest.approx(1.0 - BODY[:, 1].max())


def test_clearance_is_the_same_however_far_apart_the_points_of_a_path_are() -> None:
    taken = np.zeros((100, 600), dtype=np.bool_)
    taken[60, 300] = True  # 1 m beside the middle of a drive of 58 m
    obstacle = Obstacles(taken, 0.1, 0.0, 0.0)
    for number in (2, 3, 200):
        line = np.column_stack((np.linspace(1.0, 59.0, number), np.full(number, 5.0)))
        found = obstacle.clearance(line, Pose2D(1.0, 5.0), Pose2D(59.0, 5.0), BODY)
        assert found == pytest.approx(1.0 - BODY[:, 1].max()), number


def test_clearance_equals_shapely_on_fine_placements() -> None:
    rng = np.random.default_rng(2)
    taken = rng.random((200, 200)) < 0.0004
    squares = shapely.MultiPolygon(
        [
            shapely.box(c * 0.05 - 5, r * 0.05 - 5, c * 0.05 - 4.95, r * 0.05 - 4.95)
            for r, c in np.argwhere(taken)
        ]
    )
    for _ in range(10):
        points = rng.uniform(-3.0, 3.0, (4, 2))
        ours = Obstacles(taken, 0.05, -5.0, -5.0).clearance(points, Pose2D(), Pose2D(), BODY)
        least = math.inf
        fine = np.vstack(
            [np.linspace(a, b, 300)[:-1] for a, b in zip(points[:-1], points[1:], strict=True)]
        )
        for x, y, yaw in placements_along(np.vstack((fine, points[-1:])), 0.0, 0.0):
            cos, sin = math.cos(yaw), math.sin(yaw)
            body = shapely.Polygon(BODY @ np.array(((cos, -sin), (sin, cos))).T + (x, y))
            least = min(least, shapely.distance(body, squares))
        assert ours == pytest.approx(least, abs=0.01)
        assert ours <= least + 1e-9


def test_who_starts_inside_an_obstacle_touches_it() -> None:
    taken = np.ones((200, 200), dtype=np.bool_)
    line = np.array(((-0.1, 0.0), (0.1, 0.0)))
    assert Obstacles(taken, 0.05, -5.0, -5.0).clearance(line, Pose2D(), Pose2D(), BODY) == 0.0


def test_cost_is_length_where_nothing_costs() -> None:
    costmap = Costmap(np.zeros((100, 100), dtype=np.uint8), 0.1, 0.0, 0.0)
    path = Plan(np.array(((1.0, 1.0, 0.0), (4.0, 5.0, 0.0))))
    assert cost_of(path, costmap) == pytest.approx(5.0)
    costmap.data[:] = 126
    assert cost_of(path, costmap) == pytest.approx(15.0)


def test_a_picture_takes_no_file_of_the_map(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    image, file = tmp_path / "map.png", tmp_path / "map.yaml"
    file.write_text(MAP.replace("map.pgm", "map.png"))
    image.write_bytes(b"mine")
    assert plan("--map", str(file), "--picture", str(image)) == 1
    assert "--picture" in (said := capsys.readouterr().err) and "is a file that is read" in said
    assert image.read_bytes() == b"mine"


MASKED = """
costmap_filter_info_server:
  ros__parameters: {type: 0, filter_info_topic: /keepout_costmap_filter_info, mask_topic: /mask}
filter_mask_server:
  ros__parameters: {topic_name: /mask, yaml_filename: mask.yaml}
"""


def test_paths_keep_clear_of_the_files_own_mask(
    capsys: pytest.CaptureFixture[str], room: Path, tmp_path: Path
) -> None:
    stock = (shipped("params") / "nav2" / "stock.yaml").read_text(encoding="utf-8")
    (tmp_path / "nav2.yaml").write_text(stock + MASKED, encoding="utf-8")
    asked = ("--map", str(room), "--start", START, "--goal", GOAL, "--planner", "ThetaStar")
    asked += ("--params", str(tmp_path / "nav2.yaml"))
    (free,) = document(capsys, *asked)["planners"]
    assert plan(*asked) == 0
    assert "its mask mask.yaml is not here; the world's own is used" in capsys.readouterr().err
    # coarser, from elsewhere: a wall at x = 4 to 4.4 m with a way of 1.6 m
    pixels = np.full((60, 90), 254, dtype=np.uint8)
    pixels[:, 25:27] = 0
    pixels[24:32, 25:27] = 254
    (tmp_path / "mask.pgm").write_bytes(b"P5 90 60 255\n" + pixels.tobytes())
    about = MAP.replace("map.pgm", "mask.pgm").replace("0.05", "0.2", 1)
    (tmp_path / "mask.yaml").write_text(about.replace("[0, 0, 0]", "[-1, -1, 0]"))
    (masked,) = document(capsys, *asked)["planners"]
    assert masked["found"] and masked["clearance_m"] < 0.6 < free["clearance_m"]
