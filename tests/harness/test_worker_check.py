"""A worker that would drive differently is refused with what differs and what to do."""

import dataclasses
from pathlib import Path
from typing import Any

import pytest

from harness.cli import main
from harness.execution import Place, Workers
from harness.manifest import LIBRARIES
from harness.resources import shipped
from harness.study import make_study
from harness.study_workers import Where, files_of
from harness.worker_check import look, trouble
from navstack.errors import InputError


def test_a_process_finds_no_trouble_with_itself(tmp_path: Path) -> None:
    (tmp_path / "map.yaml").write_text("image: map.png")
    here = look(LIBRARIES, [str(tmp_path / "map.yaml"), str(tmp_path / "absent")])
    assert trouble(here, look(LIBRARIES, [str(tmp_path / "map.yaml"), str(tmp_path / "absent")])) == ""
    assert len(here.project) == 64 and all(here.versions.values())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"threads": 4}, "has 4 threads.*--nthreads 1"),
        ({"versions": {"numpy": "1.0"}}, "has Python not at all, here it is 3.*install the same"),
        ({"project": "0" * 64}, "same checkout"),
        ({"files": {}}, "has no file '.*here.yaml': put it"),
        ({"files": {"FILE": "0" * 64}}, "has another file '.*here.yaml'"),
    ],
)
def test_what_differs_is_named(tmp_path: Path, change: dict[str, Any], words: str) -> None:
    file = str(tmp_path / "here.yaml")
    Path(file).write_text("free_thresh: 0.2")
    here = look(("numpy",), [file])
    if "files" in change:
        change = {"files": {key.replace("FILE", file): value for key, value in change["files"].items()}}
    line = trouble(here, dataclasses.replace(here, **change))
    assert "\n" not in line
    with pytest.raises(InputError, match=words):
        raise InputError(line)


def test_the_files_of_a_run_are_its_parameters_and_maps(tmp_path: Path) -> None:
    for file in (shipped("maps")).glob("sidewalk*"):
        (tmp_path / file.name.replace("sidewalk", "mine")).write_bytes(file.read_bytes())
    metadata = tmp_path / "mine.yaml"
    metadata.write_text(metadata.read_text().replace("sidewalk", "mine"))
    study = make_study(stacks=["paper-gps"], episodes=1, map_name=str(metadata))
    (tmp_path / "run" / "params").mkdir(parents=True)
    (tmp_path / "run" / "params" / "world.yaml").touch()
    names = {path.name for path in files_of(tmp_path / "run", study)}
    assert {"run.json", "world.yaml", "mine.yaml", "mine.png", "mine.geojson", "mine_navmesh.png"} <= names


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (["--executor", "dask"], "needs a scheduler; give --scheduler"),
        (["--scheduler", "tcp://host:8786"], "is for --executor dask"),
        (["--executor", "slurm"], "'slurm' is not one of"),
    ],
)
@pytest.mark.parametrize("command", ["run", "suite", "ablate", "tune"])
def test_options_that_do_not_fit_are_refused(
    command: str, given: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as leaving:
        main([command, *given])
    assert leaving.value.code == 1
    assert words in capsys.readouterr().err


def test_where_is_this_machine_unless_told() -> None:
    assert Where().is_local and not Where("dask", "tcp://host:8786").is_local


def test_room_that_changes_is_kept_to() -> None:
    """Never more tasks at a time than there is room for; all of them in the end."""
    from concurrent.futures import ThreadPoolExecutor

    rooms = iter([0, 1, 2, 0, 1, *[3] * 1000])
    with ThreadPoolExecutor(4) as pool:
        with Workers(2, lambda: Place(pool.submit), room=lambda: next(rooms)) as workers:
            assert sorted(item.result for item in workers.run(abs, range(-4, 0))) == [1, 2, 3, 4]
        assert pool.submit(abs, -5).result() == 5  # places leave what they are in as it is
