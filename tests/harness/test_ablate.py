"""``navbench ablate`` from end to end on deliveries of a few seconds."""

import io
import json
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from rich.console import Console

from harness.ablation.arms import arms_of, parameter_sources
from harness.report.figures import SUFFIXES
from harness.report.page.entries import notes_of
from harness.report.tables import print_table, report_table
from harness.storage.journal import KEYS, line_of
from harness.storage.new_run import ABLATION
from harness.storage.run_folder import JOURNAL, RunFolder
from harness.storage.shipped import shipped
from harness.study.drive import TABLES
from harness.study.stored_run import StoredRun, load_run
from harness.task.stack import load_stack
from harness.world.sensors.suite import SensorParams
from navbench.cli.app import main
from navstack.params.strict import load_dataclass
from tests import command
from tests.rules import short_rules

RULES = short_rules(2.0)
ARMS = ["ground_truth", "gps", "position=0.5"]
# whatever the machine does
SAME = ("episodes.parquet", "events.parquet", "summary.json", "ablation.json")


def navbench(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    return command.navbench(capsys, "ablate", *arguments)


@pytest.fixture
def given(tmp_path: Path, hall: Path, in_process: None) -> list[str]:
    (tmp_path / "short.yaml").write_text(RULES)
    chosen = [
        "--localizers",
        "ground_truth,gps",
        "--inject",
        "position=0.5",
        "--rules",
        str(tmp_path / "short.yaml"),
    ]
    return [
        *chosen,
        "--map",
        str(hall),
        "--episodes",
        "2",
        "--pedestrians",
        "2",
        "--seed",
        "5",
        "--workers",
        "1",
    ]


def cut_off(path: Path, total: int = 2 * len(ARMS)) -> None:
    """Put a finished ablation back to after its first delivery."""
    with RunFolder(path, TABLES, total) as folder:
        record = {"row": folder.rows[0], "events": [], "timing": folder.timings[0]}
    for file in [*path.glob("*.parquet"), path / "summary.json", *path.glob("ablation.*")]:
        file.unlink()
    (path / JOURNAL).write_text(json.dumps(record) + "\n")


@pytest.mark.slow
def test_an_ablation_is_driven_cut_off_and_driven_on(
    tmp_path: Path,
    given: list[str],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    rendering: None,
) -> None:
    out = tmp_path / "out"
    status, text, _ = navbench(capsys, *given, "--out", str(out), "--json")
    assert status == 0
    document = json.loads(text)
    assert (document["stack"], document["against"], document["episodes"]) == (
        "nav2-amcl",
        "ground_truth",
        2,
    )
    by_arm = {arm["arm"]: arm for arm in document["arms"]}
    assert list(by_arm) == ARMS
    assert by_arm["ground_truth"]["localization_error_median_m"]["value"] == 0.0
    assert by_arm["position=0.5"]["localization_error_median_m"]["value"] > 0.05
    assert by_arm["position=0.5"]["injected"] == {
        "position_m": 0.5,
        "heading_deg": 0.0,
        "correlation_time_s": 10.0,
    }
    assert (by_arm["gps"]["capex_usd"], by_arm["gps"]["sensors"]) == (13_000.0, ["lidar", "gps"])
    assert (by_arm["position=0.5"]["capex_usd"], by_arm["position=0.5"]["is_buildable"]) == (
        None,
        False,
    )
    assert by_arm["gps"]["outcomes"]["timeout"]["value"] == 1.0
    assert by_arm["gps"]["contribution_margin_usd"]["value"] == pytest.approx(-3.49, abs=0.01)
    assert {(each["arm"], each["metric"]) for each in document["differences"]} >= {
        ("gps", "contribution_margin")
    }
    assert document["price_of_error"]["position"]["levels_m"] == [0.0, 0.5]
    assert document["price_of_error"]["position"]["usd_per_run_per_m"]["n"] == 2
    figures = [out / f"ablation{suffix}" for suffix in SUFFIXES]
    assert document["figures"] == [str(figure) for figure in figures]
    assert all(figure.stat().st_size > 5000 for figure in figures)

    rows = pq.read_table(out / "episodes.parquet").to_pylist()
    missions = {name: [r["shortest_path_m"] for r in rows if r["stack"] == name] for name in ARMS}
    assert missions["gps"] == missions["ground_truth"] == missions["position=0.5"]

    kept = {name: (out / name).read_bytes() for name in SAME}
    cut_off(out)
    (tmp_path / "short.yaml").unlink()
    status, again, said = navbench(capsys, "--resume", str(out), "--workers", "1", "--json")
    assert status == 0 and "going on after 1 of 6 deliveries" in said
    assert json.loads(again) == document
    assert {name: (out / name).read_bytes() for name in SAME} == kept

    monkeypatch.setattr("navbench.api.ablate.draw_ablation", lambda *_: figures)  # they are there
    status, short, _ = navbench(capsys, "--resume", str(out), "--against", "gps")
    lines = short.splitlines()
    assert status == 0 and len(lines) <= 25
    assert "robot segway_e1" in lines[0] and "map hall" in lines[0]
    assert "sensors rtk_good" in lines[0]
    (head,) = (line for line in lines if "Sensors" in line)
    (gps,) = (line for line in lines if line.startswith("gps "))
    assert head.endswith("CAPEX ($)") and gps.endswith("13,000") and "lidar + gps" in gps
    assert "parameters from amcl.yaml: gps_ekf" not in short, "no arm has the filter"
    assert lines[-1] == f"page: {out / 'ablation.html'}; next: navbench explain {out}"
    page = (out / "ablation.md").read_text()
    title, answer = page.split("\n\n")[:2]
    who = "nav2-amcl, robot segway_e1, sensors rtk_good, with ground_truth, gps"
    assert title.startswith(f"# Localizers: {who}")
    assert answer.startswith("**ground_truth earned the same as gps on all 2 missions")
    assert "(ablation.png)" in page and "## " in page
    assert (out / "ablation.html").stat().st_size > 50_000
    status, report, _ = navbench(capsys, "--resume", str(out), "--against", "gps", "--full")
    assert status == 0 and "not buildable" in report and "Error [m]" in report
    assert "ground_truth less gps, localization error [m]: -" in report
    assert "price of position error" in report and "ablation.png" in report
    status, short, _ = navbench(capsys, "--resume", str(out), "--episodes", "3")
    assert status == 0 and "n = 3 (first looked at with 2), seed 5" in short.splitlines()[0]
    assert pq.read_table(out / "episodes.parquet").num_rows == 3 * len(ARMS)


def test_an_arm_drives_on_alone(
    tmp_path: Path,
    given: list[str],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def counts(run: StoredRun, within: float, most: int) -> dict[str, int]:
        """The arm with gps drives all, the others once."""
        return {stack.name: most if stack.name == "gps" else 1 for stack in run.stacks}

    out = tmp_path / "out"
    monkeypatch.setattr("navbench.api.ablate.FIRST", 1)
    monkeypatch.setattr("navbench.api.ablate.counts_wanted", counts)
    monkeypatch.setattr("navbench.api.ablate.draw_ablation", lambda *_: [])
    status, text, said = navbench(capsys, *given, "--within", "2", "--out", str(out), "--json")
    assert status == 0 and "margin not known to within 2 USD yet: gps\n" in said
    document = json.loads(text)
    driven = {arm["arm"]: arm["episodes"] for arm in document["arms"]}
    assert driven == {"ground_truth": 1, "gps": 2, "position=0.5": 1}
    assert (document["within_usd"], document["episodes"]) == (2.0, 2)
    run = load_run(str(out))
    assert run.is_whole and notes_of([run]) == []
    assert not list(out.glob(JOURNAL)), "nothing is missing"

    status, again, said = navbench(capsys, "--resume", str(out), "--json")
    assert status == 0 and json.loads(again) == document
    assert "is complete, with 4 deliveries" in said
    with pytest.raises(SystemExit) as leaving:
        main(["verify", str(out), "--sample", "0"])
    assert not leaving.value.code, capsys.readouterr().out
    capsys.readouterr()
    status, text, _ = navbench(capsys, "--resume", str(out), "--episodes", "3", "--json")
    driven = {arm["arm"]: arm["episodes"] for arm in json.loads(text)["arms"]}
    assert driven == {"ground_truth": 1, "gps": 3, "position=0.5": 1}


def test_arms_that_drove_as_often_drive_on_alone(
    tmp_path: Path,
    given: list[str],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    out = tmp_path / "out"
    monkeypatch.setattr("navbench.api.ablate.draw_ablation", lambda *_: [])
    monkeypatch.setattr(
        "navbench.api.ablate.counts_wanted",
        lambda run, within, most: {
            stack.name: 2 if stack.name == "gps" else 1 for stack in run.stacks
        },
    )
    status, _, _ = navbench(
        capsys, *given[:-4], "--workers", "1", "--episodes", "1", "--out", str(out)
    )
    assert status == 0
    more = ("--within", "2", "--episodes", "2")
    status, text, _ = navbench(capsys, "--resume", str(out), *more, "--json")
    driven = {arm["arm"]: arm["episodes"] for arm in json.loads(text)["arms"]}
    assert status == 0 and driven == {"ground_truth": 1, "gps": 2, "position=0.5": 1}
    status, text, _ = navbench(capsys, "--resume", str(out), "--json")
    assert json.loads(text)["within_usd"] == 2.0, "it holds until another one is given"


@pytest.mark.slow
def test_what_ended_in_an_error_is_driven_again_on_request(
    tmp_path: Path,
    given: list[str],
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    out = tmp_path / "out"
    monkeypatch.setattr("navbench.api.ablate.draw_ablation", lambda *_: [])
    arguments = [*given[:2], *given[4:], "--episodes", "1", "--out", str(out)]
    assert navbench(capsys, *arguments)[0] == 0
    before = (out / "episodes.parquet").read_bytes()
    with RunFolder(out, TABLES, 2) as folder:
        rows = list(folder.rows)
    lost = {key: rows[1][key] for key in KEYS} | {"error": "there is no map"}
    record = {"row": lost, "events": [], "timing": {}}
    cut_off(out, 2)
    with (out / JOURNAL).open("ab") as journal:
        journal.write(line_of(record))
    for options, driven in ((), 0), (("--retry-errors",), 1):
        status, text, said = navbench(capsys, "--resume", str(out), *options, "--json")
        assert [arm["episodes"] for arm in json.loads(text)["arms"]] == [1, driven], said
        assert (status == 0) is (driven == 1)
    assert (out / "episodes.parquet").read_bytes() == before
    assert "--retry-errors goes with --resume" in navbench(capsys, "--retry-errors")[2]


@pytest.mark.parametrize(
    ("stack", "localizers", "told"),
    [
        (
            "nav2-amcl",
            ("amcl", "amcl-gps"),
            ["from amcl.yaml: amcl;", "no parameters for amcl_gps", "program's defaults"],
        ),
        ("nav2-gps-ekf", ("gps-ekf",), ["parameters from gps_ekf.yaml: gps_ekf"]),
        ("evasive-gps-ekf", ("gps-ekf", "amcl"), ["from expected_cost.yaml: amcl, gps_ekf"]),
        ("nav2-gps-ekf", ("gps", "ground_truth"), []),
    ],
)
def test_where_the_localizers_parameters_are_from_is_told(
    stack: str,
    localizers: tuple[str, ...],
    told: list[str],
) -> None:
    loaded = load_stack(stack)
    arms = arms_of(loaded, [*localizers, *(["gps"] if len(localizers) == 1 else [])], ())
    sources = "; ".join(parameter_sources(loaded, arms, True))
    assert all(words in sources for words in told) and bool(sources) == bool(told)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--localizers", "gps,amlc"), ("'amlc'", "did you mean 'amcl'")),
        (
            ("--localizers", "gps,amcl", "--against", "gsp"),
            ("localizer 'gsp'", "did you mean 'gps'"),
        ),
        (("--localizers", "gps,amcl", "heading=2"), ("heading=2", "--inject")),
        (("--inject", "position=0.1", "heading=-2"), ("heading: '-2'",)),
        (
            ("--correlation-time", "5"),
            ("--inject", "give both, or neither"),
        ),
        (
            ("--inject", "heading=2", "--correlation-time", "0"),
            ("correlation_time 0.0", "more than 0"),
        ),
        (
            ("--localizers", "gps,amcl", "--sensors", "rtk_god"),
            ("rtk_god", "did you mean 'rtk_good'"),
        ),
        (("--localizers", "gps,amcl", "--episodes", "0"), ("--episodes 0",)),
        (("--localizers", "gps,amcl", "--within", "0"), ("--within 0", "more than 0 USD")),
        (("--localizers", "gps,amcl", "--within", "nan"), ("--within nan", "more than 0 USD")),
        (
            ("--localizers", "gps,amcl", "--within", "1", "--estimator", "meetings"),
            ("--within is for whole deliveries", "leave it out"),
        ),
    ],
)
def test_what_cannot_be_ablated_is_one_line(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    arguments: tuple[str, ...],
    words: tuple[str, ...],
) -> None:
    status, out, line = navbench(capsys, *arguments, "--out", str(tmp_path / "out"))
    assert status == 1 and out == "" and line.count("\n") == 1
    assert all(word in line for word in words), line
    assert not (tmp_path / "out").exists()


def test_a_run_is_no_ablation(
    given: list[str],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(SystemExit):
        main(
            [
                "run",
                "--stack",
                "parked",
                "--sensors",
                "white_noise",
                *given[4:],
                "--out",
                str(tmp_path / "run"),
            ]
        )
    used = tmp_path / "run" / "params" / "parked-sensors.yaml"
    wanted = shipped("params") / "sensors" / "white_noise.yaml"
    assert load_dataclass(SensorParams, used) == load_dataclass(SensorParams, wanted)
    capsys.readouterr()
    status, out, line = navbench(capsys, "--resume", str(tmp_path / "run"))
    assert status == 1 and out == "" and "is no ablation" in line and line.count("\n") == 1


def test_run_does_not_take_an_ablation_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "params").mkdir()
    (tmp_path / "params" / ABLATION).write_text("stack: nav2-gps\nagainst: gps\n")
    with pytest.raises(SystemExit) as leaving:
        main(["run", "--resume", str(tmp_path)])
    assert leaving.value.code == 1
    assert "navbench ablate --resume" in capsys.readouterr().err


def test_tables_are_printed_whole() -> None:
    table = report_table()
    for number in range(20):
        table.add_column(f"column {number}", no_wrap=True)
    table.add_row(*(f"value {number}" for number in range(20)))
    console = Console(file=io.StringIO(), width=40)
    print_table(table, console)
    assert all(f"value {number}" in console.file.getvalue() for number in range(20))
    assert console.width == 40
