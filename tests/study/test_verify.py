"""Run folders tell whether they were changed, and whether their deliveries repeat."""

import json
import shutil
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from harness.metrics.columns import EPISODE_COLUMNS
from harness.storage.checksums import changed_files, write_checksums
from harness.storage.new_run import create_run
from harness.storage.run_folder import RunFolder
from harness.storage.shipped import shipped
from harness.storage.tables import read_rows
from harness.study.consistency import _in_timings, _is_recording_of
from harness.study.drive import TABLES
from harness.study.verification import _are_told, _is_recorded
from navbench.cli.app import main
from tests.command import navbench


@pytest.fixture(autouse=True)
def quick(in_process: None) -> None:
    """Deliveries are driven in this process."""


@pytest.fixture(scope="module")
def driven(
    tmp_path_factory: pytest.TempPathFactory,
    driven_in_process: Callable[[], AbstractContextManager[None]],
) -> Path:
    """A run of three short deliveries of a robot that stands."""
    folder = tmp_path_factory.mktemp("verified")
    rules = (shipped("params") / "rules" / "costnav.yaml").read_text(encoding="utf-8")
    (folder / "short.yaml").write_text(rules.replace("timeout: 241.0", "timeout: 3.0"))
    options = [
        "--episodes",
        "3",
        "--pedestrians",
        "2",
        "--workers",
        "1",
        "--rules",
        str(folder / "short.yaml"),
    ]
    with pytest.raises(SystemExit) as leaving, driven_in_process():
        main(["run", "--stack", "parked", "--out", str(folder / "run"), *options])
    assert not leaving.value.code
    return folder / "run"


@pytest.fixture
def run(driven: Path, tmp_path: Path) -> Path:
    """A copy of it."""
    return Path(shutil.copytree(driven, tmp_path / "run"))


def test_a_run_as_it_was_written_repeats(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, out, _ = navbench(capsys, "verify", str(run), "--sample", "2", "--json")
    (found,) = json.loads(out)["runs"]
    assert status == 0 and json.loads(out)["sound"]
    assert (len(found["repeated"]), found["changed"], found["other"]) == (2, [], {})


def test_a_delivery_that_comes_out_otherwise_is_told(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table = pq.read_table(run / "episodes.parquet")
    place = table.schema.get_field_index("shortest_path_m")
    pq.write_table(
        table.set_column(place, "shortest_path_m", pa.array([1.0, 2.0, 3.0])),
        run / "episodes.parquet",
    )
    write_checksums(run)
    status, out, _ = navbench(capsys, "verify", str(run), "--sample", "3")
    assert (
        status == 1
        and out.count("parked") >= 3
        and out.count("comes out otherwise: shortest_path_m") >= 3
    )


def test_a_changed_run_goes_on_only_when_that_is_forced(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rules = run / "params" / "rules.yaml"
    rules.write_text(rules.read_text().replace("timeout: 3.0", "timeout: 4.0"))
    status, _, error = navbench(capsys, "run", "--resume", str(run))
    assert status == 1 and error.count("\n") == 1 and "params/rules.yaml; restore it" in error
    status, _, error = navbench(capsys, "run", "--resume", str(run), "--force")
    assert status == 0 and json.loads((run / "run.json").read_text())["mixed"] == [
        "params/rules.yaml"
    ]
    _, _, error = navbench(capsys, "price", str(run))
    assert "is mixed: params/rules.yaml were changed after it had begun" in error
    assert navbench(capsys, "run", "--resume", str(run))[0] == 0, "said once, it is as it is"
    assert navbench(capsys, "verify", str(run), "--sample", "0")[0] == 1, "but not what it was"


def test_a_damaged_manifest_is_told_however_one_goes_on(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    manifest = run / "run.json"
    manifest.write_text(manifest.read_text()[:300])
    for more in ((), ("--force",)):
        status, _, error = navbench(capsys, "run", "--resume", str(run), *more)
        assert status == 1 and error.count("\n") == 1 and "run.json" in error
    assert "is damaged; restore it" in error


def test_runs_of_a_suite_that_have_not_begun_to_drive_are_passed_over(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    begun = run.parent / "begun"
    shutil.copytree(run, begun)
    for table in begun.glob("*.parquet"):
        table.unlink()
    status, out, error = navbench(capsys, "verify", str(run.parent), "--sample", "1", "--json")
    assert status == 0 and len(json.loads(out)["runs"]) == 1
    assert f"note: '{begun}' has no deliveries yet, and is left out" in error


def test_force_alone_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert "--force goes with --resume" in navbench(capsys, "run", "--force")[2]


@pytest.mark.parametrize(
    ("column", "values", "says"),
    [
        ("duration_s", [3.0, -1.0, 3.0], "row 2: duration_s -1 is no measurement"),
        ("outcome", ["timeout", "timeout", "won"], "row 3: outcome 'won'; known are sla"),
        ("episode", [0, 1, 1], "row 3: delivery 1 of 'parked' is there twice"),
    ],
)
def test_impossible_rows_are_refused_with_file_row_and_value(
    run: Path,
    capsys: pytest.CaptureFixture[str],
    column: str,
    values: list[object],
    says: str,
) -> None:
    table = pq.read_table(run / "episodes.parquet")
    place = table.schema.get_field_index(column)
    pq.write_table(table.set_column(place, column, pa.array(values)), run / "episodes.parquet")
    status, _, error = navbench(capsys, "price", str(run))
    assert status == 1 and f"episodes.parquet: {says}" in error and "Traceback" not in error


def test_what_is_changed_while_a_run_is_driven_is_noticed(tmp_path: Path) -> None:
    create_run(tmp_path / "run", {"command": ["x"]}, {"rules.yaml": "timeout: 3.0\n"})
    with RunFolder(tmp_path / "run", TABLES, 1):
        (tmp_path / "run" / "params" / "rules.yaml").write_text("timeout: 4.0\n")
    assert changed_files(tmp_path / "run", is_finished=True) == ["params/rules.yaml"]


def test_a_row_of_another_machine_is_not_comparable_here(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """No alarm, no praise: it is counted; a planted edit of a file is still found."""
    manifest = json.loads((run / "run.json").read_text())
    manifest["machine"]["arithmetic"]["numpy"] = "0" * 12
    manifest["machine"]["processor"] = "Another One"
    (run / "run.json").write_text(json.dumps(manifest))
    table = pq.read_table(run / "episodes.parquet")
    place = table.schema.get_field_index("shortest_path_m")
    edited = table.set_column(place, "shortest_path_m", pa.array([1.0, 2.0, 3.0]))
    pq.write_table(edited, run / "episodes.parquet")
    write_checksums(run)
    status, out, _ = navbench(capsys, "verify", str(run), "--json")
    (found,) = json.loads(out)["runs"]
    assert (status, found["sound"], len(found["not_comparable"])) == (1, False, 3)
    assert "summary.json does not follow" in found["wrong"][0]
    assert found["repeated"] == [] and found["other"] == {}
    _, out, _ = navbench(capsys, "verify", str(run))
    assert "3 not comparable here: the run began elsewhere: on Another One" in out
    (run / "params" / "rules.yaml").write_text("timeout: 4.0")
    assert navbench(capsys, "verify", str(run))[0] == 1


def test_a_run_on_a_map_that_is_not_here_is_not_comparable(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    manifest = json.loads((run / "run.json").read_text())
    (run / "run.json").write_text(json.dumps({**manifest, "map_name": "/nowhere/town.yaml"}))
    write_checksums(run)
    status, out, _ = navbench(capsys, "verify", str(run), "--sample", "2", "--json")
    (found,) = json.loads(out)["runs"]
    assert (status, found["sound"], len(found["not_comparable"])) == (1, None, 2)
    assert "town.yaml" in found["reasons"][0]


def test_nothing_is_called_sound_that_was_not_compared(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status, out, _ = navbench(capsys, "verify", str(run), "--sample", "0", "--json")
    assert status == 0 and json.loads(out)["sound"] is None


@pytest.mark.parametrize("content", [b"", b"half an archive", b"PK\x03\x04" + bytes(90)])
def test_a_damaged_recording_is_of_no_delivery(tmp_path: Path, content: bytes) -> None:
    file = tmp_path / "parked-0.npz"
    file.write_bytes(content)
    row = {"duration_s": 3.0, "start_x_m": 0.0, "start_y_m": 0.0}
    assert not _is_recording_of(file, row)
    assert not _is_recorded({"trace": np.zeros((1, 11))}, file)
    assert not _are_told({"stamp_s": "double"}, [], file)


@pytest.mark.parametrize(
    ("share", "has_waits", "told"),
    [(0.5, False, 3), (0.5, True, 0), (1.5, False, 3), (1.5, True, 3)],
)
def test_waits_at_signals_take_no_computer_time(
    run: Path, share: float, has_waits: bool, told: int
) -> None:
    table = pq.read_table(run / "timings.parquet")
    place = table.schema.get_field_index("real_time_factor")
    factors = pa.array([share * each for each in table["real_time_factor"].to_pylist()])
    pq.write_table(table.set_column(place, "real_time_factor", factors), run / "timings.parquet")
    rows = read_rows(run / "episodes.parquet", EPISODE_COLUMNS)
    assert len(list(_in_timings(run, rows, has_waits))) == told
