"""Missions on an imported district: legs, the part of the district around each, a day of them."""

import dataclasses
import json
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import shapely

from harness.analysis.street_losses import lose, square_of
from harness.economics.prices import load_prices
from harness.economics.rates import EVENT_RATES, interventions
from harness.economics.valuation import margins, value
from harness.episode.episode import run_episode
from harness.episode.places import legs_of, way_there
from harness.episode.street_delivery import _of_legs, _pieces_lost, signal_wait
from harness.metrics.columns import EPISODE_COLUMNS
from harness.report.short.run import summary_blocks
from harness.storage.shipped import shipped
from harness.street.district import build_district, scene_of
from harness.street.graph_file import load_graph
from harness.street.missions import LEG, StreetMissions, parts_of
from harness.street.osm_file import GeoBox, read_extract
from harness.street.route_graph import RouteGraph, WayEdge
from harness.street.routes import draw_mission, find_route
from harness.street.saving import save_maps
from harness.study.stored_run import load_run
from harness.task.study import check_distance, make_study
from harness.world.map.shapes import Rect
from harness.world.map.tiles import load_part
from harness.world.outcome import Rules
from harness.world.pybullet_world import PyBulletWorld
from harness.world.world import Legacy
from navstack.errors import InputError, MapError
from navstack.navigator import Navigator
from navstack.params.strict import load_dataclass
from navstack.types import Belief, Generators, Observation, Pose2D, Twist2D
from tests.command import status
from tests.episode.test_stack_errors import Fails
from tests.street.town import BOX, small_town

pytest.importorskip("osmium", reason="needs osmium (pip install 'navbench[street]')")


@pytest.fixture(scope="module")
def streets(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("streets")
    file = small_town().write(folder / "map.osm")
    assert status("map", "osm", str(file), "--bbox", BOX, "--out", str(folder / "streets")) == 0
    return folder / "streets"


def test_what_fell_off_on_the_way_is_lost_for_the_mission() -> None:
    """A leg begins with what is left in the bucket: none of a bucket that fell."""

    def leg(at_start: int, lost: int) -> Any:
        return SimpleNamespace(row={"pieces_at_start": at_start, "pieces_lost": lost})

    assert _pieces_lost([leg(50, 0), leg(50, 3), leg(47, 0)]) == 3
    assert _pieces_lost([leg(50, 1), leg(0, 0), leg(0, 0)]) == 50
    assert _pieces_lost([SimpleNamespace(row={"pieces_lost": None})]) is None


def test_means_by_time_are_over_the_whole_mission() -> None:
    legs = [(1.0, 100.0)]  # another leg of 100 s had no track, and signals took 50 s
    assert _of_legs("ghost_tracks", legs, 250.0, 200.0) == 0.5
    assert _of_legs("personal_intrusion_percent", legs, 250.0, 200.0) == 0.4
    assert _of_legs("min_pedestrian_distance_m", [(2.0, 1.0), (1.5, 1.0)], 9.0, 2.0) == 1.5


def test_the_legs_of_a_route_join_and_end_off_its_crossings() -> None:
    points = np.array(((0, 0), (95, 0), (115, 0), (250, 0)), dtype=float)
    edges = [WayEdge("sidewalk", 2.5)] * 3
    edges[1] = WayEdge("crossing", 4.0, 0)
    graph = RouteGraph(points, np.array(((0, 1), (1, 2), (2, 3))), edges)
    route = find_route(graph, 0, 3)
    assert route is not None
    parts = parts_of(route, graph)
    assert len(parts) == 3
    assert [parts[0].start.x, parts[-1].goal.x] == [0.0, 250.0]
    assert all(before.goal == after.start for before, after in pairwise(parts))
    ends = [part.goal.x for part in parts]
    assert ends == pytest.approx([83.0, 167.0, 250.0], abs=1.0)
    # the middle of the crossing would be an end
    edges[1] = WayEdge("crossing", 4.0, 0, has_signals=True)
    longer = RouteGraph(np.array(((0, 0), (70, 0), (95, 0), (170, 0))), graph.pairs, edges)
    halves = find_route(longer, 0, 3)
    assert halves is not None
    assert not 70.0 < parts_of(halves, longer)[0].goal.x < 95.0
    assert sum(part.signals for part in parts_of(halves, longer)) == 1


def test_the_missions_of_a_seed_are_the_same_in_any_order(streets: Path) -> None:
    first, second = StreetMissions(streets, 3), StreetMissions(streets, 3)
    forwards = [first.legs(number) for number in range(4)]
    assert [second.legs(number) for number in reversed(range(4))] == forwards[::-1]
    assert StreetMissions(streets, 4).legs(0) != forwards[0]
    legs = [leg for mission in forwards for leg in mission]
    lengths = [np.hypot(leg.goal.x - leg.start.x, leg.goal.y - leg.start.y) for leg in legs]
    assert max(lengths) <= 5.0 / 3.0 * LEG


def test_missions_are_as_long_as_they_are_asked_for(streets: Path) -> None:
    missions = StreetMissions(streets, 3, distance=(0.1, 0.15))
    for number in range(6):
        legs = missions.legs(number)
        start, goal = legs[0].start, legs[-1].goal
        assert np.hypot(goal.x - start.x, goal.y - start.y) >= 100.0
        assert legs[0].way <= 150.0


def test_missions_of_osm_lead_from_shops_to_homes(streets: Path) -> None:
    missions = StreetMissions(streets, 3, is_by_places=True)
    for legs in (missions.legs(0), missions.legs(1)):
        start, goal = legs[0].start, legs[-1].goal
        assert np.hypot(start.x - 40.0, start.y - 106.0) < 15.0  # the bakery
        assert np.hypot(goal.x - 140.0, goal.y - 140.0) < 40.0  # the middle of the house
    graph = load_graph(streets / "map_graph.geojson")
    with pytest.raises(InputError, match="no shop of OpenStreetMap is near a way"):
        draw_mission(
            dataclasses.replace(graph, shops=None), 50.0, 500.0, np.random.default_rng(0), True
        )


def test_a_part_across_tiles_is_what_the_whole_map_has_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("harness.street.district.MAX_PIXELS", 5_000_000)
    monkeypatch.setattr("harness.street.district.TILE", 100.0)
    geo = GeoBox(*map(float, BOX.split(",")))
    district = build_district(read_extract(small_town().write(tmp_path / "t.osm"), geo), 0)
    assert len(save_maps(district, tmp_path, "town")) == 6  # two are strips at the edge
    window = Rect(60.0, 70.0, 150.0, 140.0)
    part = load_part(tmp_path, "town", window, (80.0, 96.0))
    whole = scene_of(district, window, "town")
    for name in ("geometry", "walkable", "navigation_mesh"):
        found, expected = getattr(part, name), getattr(whole, name)
        assert found.origin == expected.origin
        assert (found.data != expected.data).mean() < 1e-5  # cells on a tile's edge
    kinds = sorted(each.kind for each in part.obstacles)
    within = shapely.box(window.x0, window.y0, window.x1, window.y1)
    near = [
        each
        for each in district.obstacles
        if shapely.intersects(shapely.envelope(shapely.Polygon(each.polygon)), within)
    ]
    assert kinds == sorted(each.kind for each in near)  # none twice
    assert 0 < len(near) < len(district.obstacles)
    with pytest.raises(MapError, match="no map of town is at"):
        load_part(tmp_path, "town", Rect(900.0, 0.0, 950.0, 50.0), (920.0, 20.0))


@pytest.mark.slow
def test_from_an_extract_to_profit_per_day(
    streets: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], in_process: None
) -> None:
    assert status("map", "routes", str(streets / "map_graph.geojson"), "--distance", "0.1,1") == 0
    out = str(tmp_path / "legs")
    words = ["--map", str(streets), "--stack", "nav2-gps-ekf", "--episodes", "2", "--workers", "1"]
    words += ["--distance", "0.04,0.25"]
    capsys.readouterr()
    assert status("run", *words, "--out", out, "--json") == 0
    told = capsys.readouterr()
    assert "a delivery is a whole mission here" in told.err
    run = json.loads(told.out)["runs"][0]
    assert (run["map"], run["episodes"], run["errors"]) == ("streets", 2, 0)
    assert run["outcomes"]["sla"]["value"] >= 0.5
    told_of = run["intervals"]
    rates = [told_of[f"{what}_per_1000_{unit}"] for what in EVENT_RATES for unit in ("km", "h")]
    assert all(rate["low"] <= rate["value"] <= rate["high"] for rate in rates)
    margin, per_km = told_of["contribution_margin"], told_of["contribution_margin_usd_per_km"]
    assert margin["n"] == per_km["n"] == 2  # missions, not legs
    way = run["measured"]["avg_distance_km"]
    assert per_km["value"] == pytest.approx(margin["value"] / way)
    screen = [block.text for block in summary_blocks(load_run(out))]
    assert len(screen) <= 25
    for title in ("Contribution Margin ($/km)", "Interventions per 1000 km", "Contacts per 1000 h"):
        assert any(line.startswith(title) for line in screen)
    legs = sorted((Path(out) / "recordings").glob("nav2-gps-ekf-*-legs.parquet"))
    assert len(legs) == 2
    assert status("verify", out, "--sample", "1") == 0
    capsys.readouterr()
    picture = tmp_path / "losses.png"
    assert status("map", "losses", out, "--out", str(picture), "--json") == 0
    lost = json.loads(capsys.readouterr().out)
    assert picture.stat().st_size > 10_000 and lost["missions"] == 2
    assert lost["driven_km"] == pytest.approx(2.0 * way, rel=0.25)
    overview = next(streets.glob("*_picture.png"))
    assert status("map", "losses", out, "--out", str(overview)) == 1
    assert "is a file that is read" in capsys.readouterr().err
    day = ["--robots", "3", "--operators", "1", "--set", "orders_per_day=30", "--days", "2"]
    assert status("day", "--legs", out, *day, "--out", str(tmp_path / "day"), "--json") == 0
    stack = json.loads(capsys.readouterr().out)
    assert stack["settings"]["orders_per_day_per_day"] == 30.0
    page = tmp_path / "report.html"
    assert status("report", out, "--out", str(page)) == 0
    assert "nav2-gps-ekf" in page.read_text(encoding="utf-8")
    following = capsys.readouterr().out.splitlines()[-1].split()
    assert following[:4] == ["next:", "navbench", "map", "losses"]
    assert status(*following[2:], "--out", str(tmp_path / "losses.png")) == 0
    capsys.readouterr()
    assert status("replay", out, "0", "--html", str(page)) == 1
    error = capsys.readouterr().err
    assert "replay is for deliveries on one map" in error and error.count("\n") == 1


def test_what_a_district_cannot_do_is_one_line(
    streets: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["--map", str(streets), "--stack", "nav2-gps-ekf", "--episodes", "1"]
    assert status("run", *words, "--start", "1,2,3", "--out", str(tmp_path / "run")) == 1
    assert "missions on the district" in capsys.readouterr().err
    for name in ("a", "b"):
        (tmp_path / f"{name}_graph.geojson").touch()
    assert status("run", *words, "--record", "full", "--out", str(tmp_path / "run")) == 1
    assert "--record decisions and full are for one map" in capsys.readouterr().err
    for asked, why in (("1", "is not LEAST,MOST"), ("2,1", "give 0 < least < most")):
        assert status("run", *words, "--distance", asked) in (1, 2)
        assert why in capsys.readouterr().err
    assert status("run", "--map", "sidewalk", "--distance", "1,2") == 1
    assert "is for a folder of navbench map osm" in capsys.readouterr().err
    words[1] = str(tmp_path)
    assert status("run", *words, "--out", str(tmp_path / "run")) == 1
    assert "has 2 files NAME_graph.geojson" in capsys.readouterr().err


@pytest.mark.slow
def test_a_leg_begins_with_what_the_one_before_left(streets: Path) -> None:
    study = make_study(
        stacks=["nav2-gps-ekf"], episodes=2, seed=2, map_name=str(streets), workers=1, pedestrians=0
    )
    missions = StreetMissions(streets, 2)
    short = sorted(range(9), key=lambda mission: sum(leg.way for leg in missions.legs(mission)))
    number = next(mission for mission in short if len(missions.legs(mission)) > 1)
    other = next(mission for mission in short if mission != number)
    task = study.task(0, number)
    starts: list[Belief] = []
    ends: list[Belief] = []

    class Watched:
        """A navigator that tells from which belief it set out."""

        def __init__(self, navigator: Navigator) -> None:
            self._navigator = navigator

        def reset(self, goal: Pose2D, belief: Belief, rngs: Generators) -> None:
            starts.append(belief)
            self._navigator.reset(goal, belief, rngs)

        def tick(self, observation: Observation) -> Twist2D:
            command = self._navigator.tick(observation)
            ends[len(starts) - 1 :] = [self._navigator.belief]
            return command

        def __getattr__(self, name: str) -> object:
            return getattr(self._navigator, name)

    delivery = run_episode(task, lambda parts, world: Watched(parts.brain(world)))
    legs, row = list(delivery.legs), delivery.row
    assert len(legs) > 1
    for before, after in pairwise(range(len(legs))):
        assert starts[after].pose == ends[before].pose
        assert (starts[after].covariance == ends[before].covariance).all()
        error = np.hypot(
            starts[after].pose.x - legs[after]["start_x_m"],
            starts[after].pose.y - legs[after]["start_y_m"],
        )
        assert 0.0 < error < 1.0
        drift = np.hypot(
            legs[after]["start_x_m"] - legs[before]["goal_x_m"],
            legs[after]["start_y_m"] - legs[before]["goal_y_m"],
        )
        assert drift == pytest.approx(legs[before]["goal_distance_m"])
    assert row["distance_m"] == pytest.approx(sum(leg["distance_m"] for leg in legs))
    assert row["duration_s"] == legs[-1]["begin_s"] + legs[-1]["duration_s"]
    assert row["outcome"] == "sla"
    assert row["pieces_lost"] == sum(leg["pieces_lost"] for leg in legs)
    run_episode(dataclasses.replace(task, episode=other))
    assert run_episode(task).row == row  # whatever was driven before


@pytest.mark.slow
def test_the_way_back_adds_to_a_row_and_leaves_its_outcome(
    streets: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    taken_over: list[Legacy | None] = []
    reset = PyBulletWorld.reset

    def watched(world: PyBulletWorld, *given: Any) -> Observation:
        taken_over.append(given[2])
        return reset(world, *given)

    monkeypatch.setattr(PyBulletWorld, "reset", watched)
    study = make_study(
        stacks=["nav2-gps-ekf"], episodes=9, seed=2, map_name=str(streets), workers=1,
        pedestrians=0, rules="there_and_back", world="easy",
    )  # fmt: skip
    missions = StreetMissions(streets, 2)
    number = min(range(9), key=lambda mission: len(missions.legs(mission, True)))
    legs = legs_of(study.task(0, number))
    turn = len(way_there(legs))
    assert legs[turn].is_back and legs[turn].start.x == legs[turn - 1].goal.x
    assert (legs[-1].goal.x, legs[-1].goal.y) == (legs[0].start.x, legs[0].start.y)
    delivery = run_episode(study.task(0, number))
    row, driven = delivery.row, list(delivery.legs)
    there = sum(leg["distance_m"] for leg in driven[:turn])
    assert (row["outcome"], row["way_back"], len(driven)) == ("sla", "arrived", len(legs))
    for name in ("distance_m", "motion_energy_kwh", "plans"):
        assert row[name] == pytest.approx(sum(leg[name] for leg in driven))
    assert row["duration_s"] == driven[-1]["begin_s"] + driven[-1]["duration_s"]
    assert row["goal_distance_m"] == pytest.approx(driven[turn - 1]["goal_distance_m"])
    assert row["spl"] == pytest.approx(min(1.0, row["shortest_path_m"] / there))
    assert row["pieces_lost"] == sum(leg["pieces_lost"] for leg in driven[:turn])
    home = driven[-1]["end_x_m"] - row["start_x_m"], driven[-1]["end_y_m"] - row["start_y_m"]
    assert np.hypot(*home) < 3.0

    assert taken_over[0] is None
    later = [each for each in taken_over if each]
    assert len(later) == len(legs) - 1
    assert len({each.errors["odometry"] for each in later}) == 1  # its scale errors
    assert [each.pieces for each in later[turn - 1 :]] == [None] + [50] * (len(legs) - turn - 1)


class Bare:
    """What of a stack decides its costs."""

    carries, localizer, data_collection = ("lidar",), "gps", False


def test_a_way_back_that_fails_costs_its_repair_and_counts_as_an_intervention() -> None:
    prices = load_prices()
    row = dict.fromkeys(EPISODE_COLUMNS, 0.0) | {"episode": 4, "outcome": "sla"}
    home, failed = {**row, "way_back": "arrived"}, {**row, "way_back": "physical_assistance"}
    found = [margins([each], prices) for each in ({**row, "way_back": None}, home, failed)]
    assert found[0] == found[1]
    assert found[1] - found[2] == pytest.approx(prices.repair_per_physical_assistance)
    assert [len(interventions([each], prices)) for each in (home, failed)] == [0, 1]
    means = value([home, failed], Bare(), prices, 0).economics.running.amounts["repair"]
    assert means == pytest.approx(0.5 * prices.repair_per_physical_assistance)


def test_a_map_has_no_way_back(
    hall: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["run", "--map", str(hall), "--stack", "parked", "--rules", "there_and_back"]
    assert status(*words, "--episodes", "1", "--out", str(tmp_path / "run")) == 1
    assert "which a map has not" in capsys.readouterr().err


def test_limits_of_a_mission_grow_with_its_way_and_are_used_up() -> None:
    rules = load_dataclass(Rules, shipped("params") / "rules" / "costnav.yaml")
    assert rules.on_way(80.0) == rules
    way = rules.on_way(102.0 + 119.0)
    assert way.time_limit == pytest.approx(241.0 + 100.0)
    left = way.after(300.0, 100.0)
    assert left.time_limit == pytest.approx(41.0)
    assert left.impulse_health == pytest.approx(rules.impulse_health - 100.0)


def test_waits_at_signals_have_the_mean_of_a_uniform_arrival() -> None:
    rules = load_dataclass(Rules, shipped("params") / "rules" / "costnav.yaml")
    waits = signal_wait(20_000, rules, np.random.default_rng(1)) / 20_000
    cycle, green = rules.signal_cycle, rules.signal_green
    assert waits == pytest.approx((cycle - green) ** 2 / (2.0 * cycle), rel=0.02)
    assert signal_wait(0, rules, np.random.default_rng(1)) == 0.0
    always = dataclasses.replace(rules, signal_green=cycle)
    assert signal_wait(5, always, np.random.default_rng(1)) == 0.0


def test_losses_stand_where_they_arose_and_add_up(streets: Path) -> None:
    graph, prices = load_graph(streets / "map_graph.geojson"), load_prices()
    start, end = graph.points[0], graph.points[1]
    leg = dict(zip(("start_x_m", "start_y_m"), start, strict=True))
    leg |= dict(zip(("end_x_m", "end_y_m"), end, strict=True))
    row = dict.fromkeys(EPISODE_COLUMNS, 0.0)
    row |= {"episode": 4, "outcome": "timeout", "way_back": None}
    row |= {"mailbox_contacts": 1, "pedestrian_injury_usd": 7.0}
    place = {"x_m": 301.0, "y_m": 1.0}
    events = [{"episode": 4, "cost_usd": 5.0, **place}, {"episode": 9, "cost_usd": 3.0, **place}]
    found = lose([row], events, [[leg]], graph, prices)
    of_contacts = 7.0 + prices.property_damage.mailbox.value
    of_end = 2.0 * prices.delivery_fee.value  # missed, and paid back
    assert found.usd[square_of(301.0, 1.0)] == pytest.approx(of_contacts)
    assert found.usd[square_of(*end)] == pytest.approx(of_end)
    assert sum(found.usd.values()) == pytest.approx(of_contacts + of_end)


def test_a_district_that_is_not_here_is_a_missing_map(tmp_path: Path) -> None:
    with pytest.raises(MapError, match="is none, or is not here"):
        check_distance((1.0, 2.5), str(tmp_path / "city"))


@pytest.mark.parametrize("after", [-1.0, 0.0])
def test_a_stack_that_fails_at_once_needs_assistance(streets: Path, after: float) -> None:
    study = make_study(stacks=["parked"], episodes=1, map_name=str(streets), pedestrians=0)
    row = run_episode(study.task(0, 0), lambda parts, world: Fails(ValueError, after)).row
    assert (row["outcome"], row["stack_error"]) == (
        "physical_assistance",
        "ValueError: out of ideas",
    )
    assert row["duration_s"] < 100.0
