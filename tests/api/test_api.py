"""``import navbench``: what its functions give is what the commands print."""

import json
import multiprocessing
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import navbench
from harness.episode.files import nav2_parameters, rules_of
from harness.task.study import Study
from navbench.cli.app import app
from tests.rules import short_rules


@pytest.fixture(scope="module")
def run(
    tmp_path_factory: pytest.TempPathFactory,
    driven_in_process: Callable[[], AbstractContextManager[None]],
    hall: Path,
) -> navbench.Run:
    folder = tmp_path_factory.mktemp("api") / "run"
    given = {"map": str(hall), "pedestrians": 3, "seed": 5}
    with driven_in_process():
        return navbench.run(["nav2-gps", "parked"], 2, workers=1, out=folder, **given)


def test_everything_that_is_promised_is_there() -> None:
    for name in navbench.__all__:
        assert getattr(navbench, name) is not None
    assert set(dir(navbench)) == set(navbench.__all__)
    with pytest.raises(AttributeError, match="no attribute 'drive'; it has"):
        navbench.drive  # noqa: B018


def test_tables_and_stacks(run: navbench.Run) -> None:
    assert run.stacks == ("nav2-gps", "parked")
    assert run.table().num_rows == 4
    one = run["parked"]
    assert one.stacks == ("parked",)
    assert set(one.table("timings")["stack"].to_pylist()) == {"parked"}
    assert max(one.table()["distance_m"].to_pylist()) < 1.0
    with pytest.raises(navbench.InputError, match="unknown table 'rows'; known: episodes"):
        run.table("rows")
    with pytest.raises(navbench.InputError, match="unknown stack"):
        run["nav3"]


def test_a_run_is_found_from_another_folder(
    run: navbench.Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(run.folder.parent)
    same = navbench.load(run.folder.name)
    monkeypatch.chdir(tmp_path)
    assert same.table().num_rows == 4 and same.margins == run.margins


def test_a_daemon_is_told_that_it_may_start_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    daemon = SimpleNamespace(daemon=True, name="daemon")
    monkeypatch.setattr(multiprocessing, "current_process", lambda: daemon)
    with pytest.raises(navbench.InputError, match="daemonic process, as of multiprocessing.Pool"):
        navbench.run("parked", 1)


def test_money_is_what_the_program_stored(run: navbench.Run) -> None:
    stored = json.loads((run.folder / "summary.json").read_text())["runs"]
    for each in stored:
        assert run.margins[each["stack"]].as_json() == each["intervals"]["contribution_margin"]
        assert run.valuations[each["stack"]].economics.opex == each["economics"]["opex"]


def test_compare_is_the_second_less_the_first(run: navbench.Run) -> None:
    margins = {stack: run.margins[stack].value for stack in run.stacks}
    paired = (
        navbench.compare(run["parked"], run["nav2-gps"], ["margin"])
        .differences["contribution_margin"]
        .paired
    )
    assert paired.difference.value == pytest.approx(
        (margins["nav2-gps"] or 0.0) - (margins["parked"] or 0.0)
    )


def test_other_prices(run: navbench.Run) -> None:
    doubled = navbench.price(
        run, settings={"delivery_fee": 2.0 * run.stored.prices().delivery_fee.value}
    )
    own = navbench.price(run)
    for stack in run.stacks:
        revenue = own[stack].valuation.economics.revenue
        assert revenue is not None
        assert doubled[stack].valuation.economics.revenue == pytest.approx(2.0 * revenue)
    assert "nobody" not in own and own.get("nobody") is None


def test_planners_answer_as_the_command_does(capsys: pytest.CaptureFixture[str]) -> None:
    answers = navbench.plan(planners=["NavFn"], start=(-67.9, -71.9, 0.0), goal=(-89.7, -63.5, 0.0))
    with pytest.raises(SystemExit) as ended:
        app(
            [
                "plan",
                "--planner",
                "NavFn",
                "--start=-67.9,-71.9,0",
                "--goal=-89.7,-63.5,0",
                "--json",
            ]
        )
    assert ended.value.code == 0
    (printed,) = json.loads(capsys.readouterr().out)["planners"]
    path = answers["NavFn"].path
    assert path is not None
    assert path.length == pytest.approx(printed["length_m"], abs=1e-6)


def test_a_world_made_again_reads_a_changed_file(tmp_path: Path, hall: Path) -> None:
    stack = tmp_path / "mine.yaml"
    for rate in (20.0, 10.0):
        stack.write_text(
            f"controller_server: {{ros__parameters: {{controller_frequency: {rate}}}}}"
        )
        delivery = navbench.make_world(str(stack), map=str(hall), pedestrians=0)
        read = nav2_parameters(delivery.task.stack.nav2_file, True)
        assert read.value("controller_server", "controller_frequency") == rate
        delivery.world.close()


def test_a_changed_file_is_read_anew(
    tmp_path: Path, hall: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A session may edit its files between two runs."""
    read = []

    def begun(study: Study, *_: object) -> None:
        read.append(rules_of(study.template.rules).timeout)
        raise KeyboardInterrupt

    monkeypatch.setattr("navbench.api.run.begin", begun)
    rules = tmp_path / "short.yaml"
    for seconds in (1.0, 12.0):
        rules.write_text(short_rules(seconds))
        with pytest.raises(KeyboardInterrupt):
            navbench.run("parked", map=str(hall), rules=str(rules), episodes=1)
    assert read == [1.0, 12.0]


def test_a_world_stepped_by_hand_gives_the_row_of_the_run(run: navbench.Run, hall: Path) -> None:
    given = {"map": str(hall), "pedestrians": 3, "seed": 5, "episode": 1}
    delivery = navbench.make_world("nav2-gps", **given)
    other = navbench.make_world("parked", **given)  # two at once in a process
    with pytest.raises(ValueError, match="goes on"):
        delivery.finish()
    while delivery.verdict is None:
        delivery.drive(delivery.brain.tick(delivery.observation))
        if other.truth.stamp < 5.0:
            other.drive(navbench.Twist2D(0.5, 0.0, 0.0))
    row = delivery.finish().row
    stored = run["nav2-gps"].table().to_pylist()[1]
    assert {key: stored[key] for key in row} == row
    moved = np.hypot(
        other.truth.pose.x - other.mission.start.x, other.truth.pose.y - other.mission.start.y
    )
    assert 1.5 < moved < 2.7
    delivery.world.close()
    other.world.close()


def test_a_folder_is_loaded(run: navbench.Run) -> None:
    assert navbench.load(run.folder).stacks == run.stacks
    assert navbench.load(f"{run.folder}:parked").stacks == ("parked",)
    with pytest.raises(navbench.InputError):
        navbench.load(Path("nowhere"))


def test_an_interval_reads_well() -> None:
    assert str(navbench.Interval(1.234, 0.5, 2.0, 20)) == "1.234 [0.5, 2] (n = 20)"
    assert str(navbench.Interval(1.5, None, None, 3)) == "1.5 (n = 3)"
    assert str(navbench.Interval(None, None, None, 0)) == "undefined (n = 0)"
