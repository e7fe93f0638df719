"""``python -m tools.bench``: twins agree with kernels, the document keeps its contract."""

import io
import json
import math
import time
from pathlib import Path

import numpy as np
import pytest

from harness.episode.files import nav2_parameters, world_params
from harness.report.tables import report_console
from harness.storage.shipped import DEFAULT_WORLD, resolve, shipped
from navbench.cli.app import main
from navstack.errors import InputError, UnknownNameError
from tools.bench import breakdown, history, twins
from tools.bench.__main__ import bench
from tools.bench.component import TWIN, TwinError, require_agreement
from tools.bench.loops import INCREMENTAL, LOOPS, NAVFN, Course, drive
from tools.bench.measure import (
    COMPONENTS,
    CPP,
    NAMES,
    TWO_WORKERS,
    Effort,
    chosen,
    loop_row,
)
from tools.bench.tables import print_bench
from tools.bench.timing import PROCESSOR, Spread, readings

ROOT = Path(__file__).parents[2]
# seconds each
LONG = ("inflation, 4000 x 4000, 1 m", "likelihood field, 4000 x 4000", "NavFn A*, 4000 x 4000")
TINY = Effort(runs=2, fewest=1, budget=0.1, deliveries=2, shared=2, rounds=1, seconds=2.0)
LOOP = "nav2-stock incremental"
LIDAR = "lidar, 360 beams, 30 m"
WITHOUT_TWIN = (
    *("AMCL resampling, 500", "AMCL resampling, 2000"),
    *("NavFn Dijkstra, 4000 x 4000", "IncrementalNavfn replan, 4000 x 4000"),
)


@pytest.mark.parametrize("name", [name for name in COMPONENTS if name not in LONG])
def test_kernels_agree_with_their_twins(name: str) -> None:
    prepared = COMPONENTS[name].prepare()  # raises where they do not agree
    prepared.ours()
    assert (prepared.twin is None) == (name in WITHOUT_TWIN)


def test_a_wrong_kernel_is_not_timed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(twins, "cast", lambda *scan: np.zeros(360))
    with pytest.raises(TwinError, match="differ by"):
        COMPONENTS[LIDAR].prepare()


def test_disagreement_is_not_timed() -> None:
    require_agreement("x", (1.0, math.inf), (1.0 + 1e-9, math.inf), 1e-6)
    with pytest.raises(TwinError, match="differ by 0.5"):
        require_agreement("x", (1.0, 2.0), (1.0, 2.5), 1e-6)
    with pytest.raises(TwinError, match="finite in one only"):
        require_agreement("x", (1.0, math.inf), (1.0, 2.0), 1.0)
    with pytest.raises(TwinError, match="shape"):
        require_agreement("x", (1.0,), (1.0, 2.0))


def spin(seconds: float) -> None:
    """Keep the processor busy."""
    until = time.thread_time() + seconds
    while time.thread_time() < until:
        pass


def test_readings_are_taken_in_turn_and_short_steps_repeated() -> None:
    called: list[str] = []
    taken = readings(
        [lambda: called.append("a") or spin(0.004), lambda: called.append("b") or spin(0.008)],
        4,
        10.0,
    )
    assert taken.shape == (4, 2, 2)
    assert called[-8:] == ["a", "b", "b", "a", "a", "b", "b", "a"]
    assert taken[:, 0, PROCESSOR] == pytest.approx(0.004, rel=0.5)
    assert taken[:, 1, PROCESSOR] == pytest.approx(0.008, rel=0.5)
    short = readings([lambda: spin(2e-5)], 3, 10.0)
    assert short[:, 0, PROCESSOR] == pytest.approx(2e-5, rel=1.0)
    assert len(readings([lambda: spin(0.02)], 50, 0.05, fewest=2)) < 10


def test_spread_is_median_and_quartiles() -> None:
    assert Spread.of(np.array((5.0, 1.0, 2.0, 3.0, 4.0))) == Spread(3.0, 2.0, 4.0, 5)


def test_names_are_chosen_whole_by_group_or_by_part() -> None:
    assert chosen(()) == list(NAMES)
    assert chosen(("paper-gps",)) == ["paper-gps"]
    assert chosen(("dwb cycle",)) == ["DWB cycle, 480 x 480", "DWB cycle, 160 x 160"]
    assert chosen(("loops",)) == [*LOOPS, TWO_WORKERS]
    assert chosen(("components",)) == list(COMPONENTS)
    assert chosen(("paper-gps, components",)) == [*COMPONENTS, "paper-gps"]
    assert chosen(("cycle, 480",)) == ["DWB cycle, 480 x 480"]  # a comma of the name's own
    for nothing in ("", " ", "paper-gps,"):
        with pytest.raises(
            InputError, match="names nothing; give a name, a part of one, components or loops"
        ):
            chosen((nothing,))
    with pytest.raises(UnknownNameError, match="--only 'dbw'"):
        chosen(("dbw",))


def test_the_document_keeps_its_contract(capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    out, table = tmp_path / "bench.json", tmp_path / "history.md"
    with pytest.raises(SystemExit) as status:
        main(
            [
                "--only",
                "DWB cycle",
                "--only",
                "collision",
                "--quick",
                "--runs",
                "2",
                "--json",
                "--out",
                str(out),
                "--history",
                str(table),
            ],
            program=bench,
        )
    assert status.value.code == 0
    text = capfd.readouterr().out
    rows = json.loads(text)
    assert text == out.read_text()
    assert [(row["name"], row["reference"]) for row in rows] == [
        (name, reference)
        for name in (
            "DWB cycle, 480 x 480",
            "DWB cycle, 160 x 160",
            "collision monitor, approach, 360 points",
        )
        for reference in (CPP, TWIN)
    ]
    assert (CPP, TWIN) == ("nav2 c++ (recorded)", "numpy twin")
    for row in rows:
        assert row["ours_ms"] > 0.0 and row["n"] == 2
        assert row["low"] <= row["ratio"] <= row["high"]
        assert (row["met"] is None) == (row["target"] is None)
        assert row["reference"] == CPP or row["target"] is None
    assert rows[0]["ratio"] == pytest.approx(rows[0]["ours_ms"] / 22.0)
    assert rows[0]["target"] == 0.02 and rows[0]["met"] == (rows[0]["ratio"] <= 0.02)
    assert f"{rows[0]['ratio']:.3g}" in table.read_text().splitlines()[-1].split(" | ")


def test_tables_and_bad_names_on_the_command_line(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    with pytest.raises(SystemExit) as status:
        main(["--only", "collision", "--quick", "--runs", "1"], program=bench)
    printed = capsys.readouterr().out
    assert status.value.code == 0
    assert (
        "collision monitor, approach" in printed
        and "indicative" in printed
        and "numpy twin" in printed
    )
    for words, said in (
        (["--only", "nothing"], "unknown --only 'nothing'"),
        (["--out", str(tmp_path / "absent" / "x.json")], "its folder does not exist"),
        (["--runs", "0"], "--runs"),
    ):
        with pytest.raises(SystemExit) as status:
            main([*words], program=bench)
        assert status.value.code == 1
        assert said in capsys.readouterr().err


def test_without_golden_vectors_their_components_are_left_out(
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("NAVSTACK_GOLDEN", str(tmp_path))
    with pytest.raises(SystemExit) as status:
        main(["--only", "DWB cycle", "--quick"], program=bench)
    said = capsys.readouterr().err
    assert status.value.code == 1
    assert "left out: DWB cycle, 160 x 160" in said and "nothing could be measured" in said


def test_what_is_finished_is_kept_when_interrupted(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(name: str, *_: object) -> list[dict[str, object]]:
        if name.endswith("160 x 160"):
            raise KeyboardInterrupt
        return [{"name": name}]

    monkeypatch.setattr("tools.bench.measure.measure", interrupted)
    with pytest.raises(SystemExit) as status:
        main(["--only", "DWB cycle", "--json"], program=bench)
    assert status.value.code == 130
    assert json.loads(capsys.readouterr().out) == [{"name": "DWB cycle, 480 x 480"}]


def test_a_course_differs_from_the_shipped_stack_in_what_it_says(tmp_path: Path) -> None:
    task = Course(LOOPS["paper-gps incremental"], tmp_path, seconds=3.0).task(4)
    plain = Course(LOOPS["paper-gps"], tmp_path / "plain").task(4)
    theirs, ours = (Path(each.stack.nav2_file).read_text() for each in (task, plain))
    assert theirs == ours.replace(NAVFN, INCREMENTAL) != ours
    assert (
        nav2_parameters(task.stack.nav2_file, False).warnings
        == nav2_parameters(plain.stack.nav2_file, False).warnings
    )
    default = resolve(DEFAULT_WORLD, shipped("params") / "worlds", "world")
    assert Path(task.world) == Path(plain.world) == default
    assert world_params(plain.world, None).cargo.pieces > 0
    assert task.episode == 4 and "timeout: 3.0" in Path(task.rules).read_text()


@pytest.mark.slow
def test_the_row_of_a_closed_loop(tmp_path: Path) -> None:
    row = loop_row(LOOPS[LOOP], TINY, tmp_path)
    assert row["name"] == LOOP and row["n"] == 2
    assert row["low"] <= row["real_time_factor"] <= row["high"]
    assert row["simulated_s"] == pytest.approx(4.0, abs=0.1)
    assert row["target"] == 150.0
    assert row["met"] == (row["real_time_factor"] >= 150.0)
    parts = row["breakdown_ms_per_simulated_s"]
    expected = {
        "world physics",
        "lidar",
        "pedestrians",
        "cargo",
        "localizer",
        "local costmap",
        "planner",
        "controller",
    }
    assert expected | {"log", "rest"} <= set(parts)
    assert all(value >= 0.0 for value in parts.values())
    # 1 where the same deliveries take the same
    together = sum(parts.values()) * row["real_time_factor"] / 1000.0
    # another drive of a few seconds: what holds on a busy machine, and tells ms from s
    assert 0.05 < together < 20.0
    two = {
        **row,
        "name": TWO_WORKERS,
        "of_one_worker": Spread(1.93, 1.9, 1.95, 3).as_json(),
        "target": 1.9,
        "met": True,
    }
    assert len(history.history_row([row, two]).split(" | ")) == len(history.COLUMNS)
    printed = io.StringIO()
    print_bench([row, two], ["noted"], report_console(printed))
    lines = printed.getvalue().splitlines()
    assert any(
        line.startswith(TWO_WORKERS) and "1.93 (1.90 to 1.95)" in line and line.endswith("met")
        for line in lines
    )
    assert any(line.startswith("together") for line in lines) and lines[-1].strip() == "noted"


def test_parts_are_methods_that_exist_and_wrappers_come_off() -> None:
    for name, base, methods in breakdown.PARTS:
        for method in methods:
            assert any(method in vars(kind) for kind in breakdown._family(base)), (
                name,
                base,
                method,
            )
    before = [vars(base).copy() for _, base, _ in breakdown.PARTS]
    with breakdown.metered(breakdown.Meter()):
        assert [vars(base) for _, base, _ in breakdown.PARTS] != before
    assert [vars(base) for _, base, _ in breakdown.PARTS] == before


def test_a_part_does_not_count_what_it_calls() -> None:
    class Inner:
        def work(self) -> None:
            spin(0.03)

    class Outer:
        def work(self) -> None:
            spin(0.01)
            Inner().work()

    meter = breakdown.Meter()
    Inner.work = meter.timed("inner", Inner.work)  # type: ignore[method-assign]
    work = meter.timed(lambda itself: type(itself).__name__, Outer.work)
    Outer.work = work  # type: ignore[method-assign]
    Outer().work()
    assert meter.spent["inner"] == pytest.approx(0.03, rel=0.2)
    assert meter.spent["Outer"] == pytest.approx(0.01, rel=0.3)
    assert (meter.calls["inner"], meter.inner_calls["Outer"]) == (1, 1)
    within, around = breakdown.wrapper_cost()
    assert 0.0 <= within < 1e-4 and 0.0 <= around < 1e-4


def test_history_grows_by_a_row_and_spares_other_files(tmp_path: Path) -> None:
    file = tmp_path / "history.md"
    rows = [{"name": "DWB cycle, 160 x 160", "reference": CPP, "ratio": 0.0975, "ours_ms": 0.348}]
    history.append(file, rows)
    history.append(file, [])
    lines = file.read_text().splitlines()
    assert lines[-4] + "\n" + lines[-3] + "\n" == history.HEADER
    first, second = (line.strip("| ").split(" | ") for line in lines[-2:])
    assert len(first) == len(second) == len(history.COLUMNS)
    assert first[history.COLUMNS.index("DWB 160")] == "0.0975"
    assert first[2] == history.machine()
    assert set(second[3:]) == {"--"}
    other = tmp_path / "other.md"
    other.write_text("| a | b |\n")
    with pytest.raises(InputError, match="another table"):
        history.append(other, rows)
    assert other.read_text() == "| a | b |\n"


def test_a_wrong_history_is_refused_before_anything_is_measured(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "other.md").write_text("| a | b |\n")
    with pytest.raises(SystemExit) as status:
        main(["--history", str(tmp_path / "other.md")], program=bench)
    assert status.value.code == 1
    assert capsys.readouterr().err.count("\n") == 1


def test_the_shipped_history_can_be_continued() -> None:
    assert history.HEADER in (ROOT / "tools" / "bench" / "history.md").read_text()


def test_driving_gives_the_rows_of_the_program(tmp_path: Path) -> None:
    course = Course(LOOPS[LOOP], tmp_path, seconds=2.0)
    first, again = drive(course.task(1)), drive(course.task(1))
    assert first.row == again.row
    assert first.simulated == first.row["duration_s"] == pytest.approx(2.0, abs=0.05)
    assert 0.0 < again.processor and 0.0 < again.wall
    assert first.factor == first.simulated / first.processor
