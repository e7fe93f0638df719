"""A worker that would drive differently is refused with what differs and what to do."""

import dataclasses
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from harness.episode import factory as setup
from harness.episode import files
from harness.execution import worker_check
from harness.execution.executors import Place
from harness.execution.process_cache import Kept, forget, kept
from harness.execution.worker_check import look, trouble
from harness.execution.workers import Workers
from harness.storage.shipped import shipped
from harness.study.manifest import LIBRARIES
from harness.study.places import Where, files_of
from harness.task.study import make_study
from navbench.cli.app import main
from navstack.costmap.map_io import save_map
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.errors import InputError
from navstack.types import Pose2D
from tests.rules import short_rules

RULES = short_rules(2.0)
DASK = ("--executor", "dask", "--scheduler")
TLS = "distributed.comm.tls"


def test_a_process_finds_no_trouble_with_itself(tmp_path: Path) -> None:
    (tmp_path / "map.yaml").write_text("image: map.png")
    here = look(LIBRARIES, [str(tmp_path / "map.yaml"), str(tmp_path / "absent")])
    assert (
        trouble(here, look(LIBRARIES, [str(tmp_path / "map.yaml"), str(tmp_path / "absent")])) == ""
    )
    assert len(here.project) == 64 and all(here.versions.values())


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"threads": 4}, "has 4 threads.*--nthreads 1"),
        ({"versions": {"numpy": "1.0"}}, "has Python not at all, here it is 3.*install the same"),
        (
            {"arithmetic": {"c_library": "0", "numpy": "0"}},
            r"computes otherwise \(blas, c_library, numpy\).*--preload-nanny navbench, or .*Has",
        ),
        ({"project": "0" * 64}, "same checkout on every machine and restart its workers"),
        (
            {"code": "0" * 64},
            "runs code of this program from before it was changed there: restart its workers",
        ),
        ({"files": {}}, "has no file '.*here.yaml': put it"),
        ({"files": {"FILE": "0" * 64}}, "has another file '.*here.yaml'"),
    ],
)
def test_what_differs_is_named(tmp_path: Path, change: dict[str, Any], words: str) -> None:
    file = str(tmp_path / "here.yaml")
    Path(file).write_text("free_thresh: 0.2")
    here = look(("numpy",), [file])
    if "files" in change:
        change = {
            "files": {key.replace("FILE", file): value for key, value in change["files"].items()}
        }
    line = trouble(here, dataclasses.replace(here, **change))
    assert "\n" not in line
    with pytest.raises(InputError, match=words):
        raise InputError(line)


@pytest.fixture
def worker(monkeypatch: pytest.MonkeyPatch) -> Iterator[SimpleNamespace]:
    """A Dask worker as far as looking at it goes."""
    monkeypatch.setattr(worker_check, "give_memory_back", lambda: None)
    yield SimpleNamespace(state=SimpleNamespace(nthreads=1), nanny=None)
    forget()


def save_hall(path: Path, length: float) -> None:
    """A square hall, the length of its sides in [m]."""
    cells = np.zeros((round(length / 0.1),) * 2, dtype=np.int8)
    cells[[0, -1]], cells[:, [0, -1]] = 100, 100
    save_map(OccupancyGrid(cells, 0.1, Pose2D()), path)


def test_a_worker_that_lives_on_drives_what_it_is_seen_with(
    tmp_path: Path, worker: SimpleNamespace
) -> None:
    """Files that change between two studies are read anew, and worlds and brains are built anew."""
    hall, rules, people = tmp_path / "hall.yaml", tmp_path / "rules.yaml", tmp_path / "world.yaml"
    world = (shipped("params") / "worlds" / "easy.yaml").read_text(encoding="utf-8")
    made = []
    for length, timeout, count in ((20.0, 2.0, 1), (10.0, 3.0, 2)):
        save_hall(hall, length)
        rules.write_text(short_rules(timeout))
        people.write_text(world.replace("count: 20", f"count: {count}"))
        look((), [str(hall), str(rules), str(people)], worker)
        study = make_study(
            stacks=["paper-gps"],
            episodes=1,
            map_name=str(hall),
            rules=str(rules),
            world=str(people),
            missions="uniform",
        )
        task = study.template
        built = setup.Parts(task).world()
        made.append(
            (
                setup.Parts(task).mission(np.random.default_rng(0)),
                built,
                setup.Parts(task).brain(built),
            )
        )
        assert setup.scene_of(str(hall)).geometry.width == round(length / 0.1)
        assert files.rules_of(task.rules).timeout == timeout
        assert files.world_params(task.world, None, None).people.count == count
        assert setup.Parts(task).world() is built and setup.Parts(task).brain(built) is made[-1][2]
    assert all(before is not after for before, after in zip(*made, strict=True))
    assert made[0][0].start != made[1][0].start
    assert max(abs(made[1][0].start.x), abs(made[1][0].start.y)) < 10.0


def test_looking_without_driving_for_others_forgets_nothing(
    tmp_path: Path, worker: SimpleNamespace
) -> None:
    (tmp_path / "rules.yaml").write_text(RULES)
    rules = files.rules_of(str(tmp_path / "rules.yaml"))
    look((), [])
    assert files.rules_of(str(tmp_path / "rules.yaml")) is rules
    look((), [], worker)
    assert files.rules_of(str(tmp_path / "rules.yaml")) is not rules


def test_everything_that_deliveries_keep_of_files_can_be_forgotten() -> None:
    keeping = {name: each for name, each in vars(setup).items() if hasattr(each, "cache_clear")}
    assert len(keeping) >= 10 and all(isinstance(each, Kept) for each in keeping.values())


def test_what_is_being_read_when_it_is_to_be_forgotten_is_not_kept() -> None:
    """A delivery that nobody waits for any more may still be reading the old files."""
    content, began, may_end = ["old"], threading.Event(), threading.Event()

    @kept(2)
    def read(name: str) -> str:
        """What is there."""
        seen = content[0]
        began.set()
        may_end.wait(10.0)
        return seen

    reading = threading.Thread(target=read, args=("file",))
    reading.start()
    began.wait(10.0)
    content[0] = "new"
    forget()
    may_end.set()
    reading.join()
    assert read("file") == "new" and read.__doc__ == "What is there."


@pytest.fixture
def as_new(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[], None]]:
    """What makes this process look as a new one does."""
    caches = (worker_check._code_digest, worker_check._version)

    def begin() -> None:
        for each in caches:
            each.cache_clear()

    begin()
    yield begin
    monkeypatch.undo()
    begin()


def test_facts_of_nav2_are_part_of_the_program() -> None:
    names = {path.name for path in worker_check._code()}
    assert {"jazzy.json", "humble.json", "catalog.toml", "stack.py"} <= names


def test_code_that_changes_on_disk_asks_for_a_restart(
    as_new: Callable[[], None],
    worker: SimpleNamespace,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    source = tmp_path / "source.py"
    source.write_text("SPEED = 1.0")
    monkeypatch.setattr(worker_check, "_code", lambda: [source])
    before = look((), [], worker)
    source.write_text("SPEED = 2.0")
    lives_on = look((), [], worker)
    as_new()
    here = look((), [])
    assert "from before it was changed there: restart its workers" in trouble(here, lives_on)
    assert "use the same checkout on every machine and restart its workers" in trouble(here, before)
    assert trouble(here, look((), [], worker)) == ""


def test_a_library_that_is_replaced_on_disk_counts_as_the_one_that_is_imported(
    as_new: Callable[[], None],
    worker: SimpleNamespace,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(worker_check, "version", lambda name: "1.0")
    look(("numpy",), [], worker)
    monkeypatch.setattr(worker_check, "version", lambda name: "2.0")
    lives_on = look(("numpy",), [], worker)
    as_new()
    assert "has numpy 1.0, here it is 2.0" in trouble(look(("numpy",), []), lives_on)


def test_the_files_of_a_run_are_its_parameters_and_maps(tmp_path: Path) -> None:
    for file in (shipped("maps")).glob("sidewalk*"):
        (tmp_path / file.name.replace("sidewalk", "mine")).write_bytes(file.read_bytes())
    metadata = tmp_path / "mine.yaml"
    metadata.write_text(metadata.read_text().replace("sidewalk", "mine"))
    study = make_study(stacks=["paper-gps"], episodes=1, map_name=str(metadata))
    (tmp_path / "run" / "params").mkdir(parents=True)
    (tmp_path / "run" / "params" / "world.yaml").touch()
    names = {path.name for path in files_of(tmp_path / "run", study)}
    assert {
        "run.json",
        "world.yaml",
        "mine.yaml",
        "mine.png",
        "mine.geojson",
        "mine_navmesh.png",
    } <= names


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (["--executor", "dask"], "needs a scheduler; give --scheduler"),
        (["--scheduler", "tcp://host:8786"], "is for --executor dask"),
        (["--executor", "slurm"], "'slurm' is not one of"),
        (["--episode-timeout", "nan"], "'--episode-timeout': nan is not a number"),
        (
            [*DASK, "tcp://host"],
            "--scheduler 'tcp://host' is no address of a Dask scheduler; give SCHEME://HOST:PORT",
        ),
        ([*DASK, "host"], "'host' is no address"),
        ([*DASK, "tcp://:8786"], "'tcp://:8786' is no address"),
        ([*DASK, "tcp://host:0"], "port 1 to 65535"),
        ([*DASK, "tcp://host:65536"], "port 1 to 65535"),
        ([*DASK, "tcp://ho\nst:1"], "is no address"),
        ([*DASK, "tcp://::1:8786"], "IPv6 in brackets"),
        ([*DASK, "http://host:8786"], "tcp, tls, ws or wss"),
    ],
)
@pytest.mark.parametrize("command", ["run", "suite", "ablate", "tune"])
def test_options_that_do_not_fit_are_refused(
    command: str,
    given: list[str],
    words: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(SystemExit) as leaving:
        main([command, *given, "--out", str(tmp_path / "out")])
    said = capsys.readouterr()
    assert leaving.value.code == 1 and not said.out and not (tmp_path / "out").exists()
    assert words in said.err and said.err.count("\n") == 1


@pytest.mark.parametrize(
    ("scheduler", "configured", "words"),
    [
        (
            "tls://host:8786",
            {},
            "tls://host:8786 needs TLS; set it in Dask's configuration, distributed.comm.tls",
        ),
        ("wss://host:8786", {}, "needs TLS"),
        ("host:8786", {"distributed.comm.default-scheme": "tls"}, "needs TLS"),
        (
            "tls://host:8786",
            {f"{TLS}.ca-file": "/absent", f"{TLS}.client.cert": "/absent"},
            "No such file",
        ),
        ("tcp://host:8786", {f"{TLS}.min-version": "9"}, "min-version='9' is not supported"),
        (
            "tcp://host:8786",
            {"distributed.comm.require-encryption": True},
            "has no TLS, which Dask's require-encryp",
        ),
    ],
)
def test_what_dask_is_not_configured_for_is_refused(
    scheduler: str,
    configured: dict[str, Any],
    words: str,
) -> None:
    pytest.importorskip(
        "distributed", reason="the package distributed (extra 'dask') is not installed"
    )
    import dask

    with dask.config.set(configured), pytest.raises(InputError) as refused:
        Where("dask", scheduler)
    assert words in str(refused.value) and "\n" not in str(refused.value)


@pytest.mark.parametrize(
    "scheduler", ["tcp://host:8786", "host:1", "tcp://[::1]:65535", "ws://10.0.0.1:8786"]
)
def test_addresses_of_schedulers(scheduler: str) -> None:
    pytest.importorskip(
        "distributed", reason="the package distributed (extra 'dask') is not installed"
    )
    assert Where("dask", scheduler).scheduler == scheduler


def test_a_missing_package_is_named_before_anything_is_created(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delitem(sys.modules, "harness.execution.dask_security", raising=False)
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(
        InputError, match="needs the package distributed.*pip install 'navbench\\[dask\\]'"
    ):
        Where("dask", "tcp://host:8786")


def test_where_is_this_machine_unless_told() -> None:
    pytest.importorskip(
        "distributed", reason="the package distributed (extra 'dask') is not installed"
    )
    assert Where().is_local and not Where("dask", "tcp://host:8786").is_local


def test_room_that_changes_is_kept_to() -> None:
    """Never more tasks at a time than there is room for; all of them in the end."""
    from concurrent.futures import ThreadPoolExecutor

    rooms = iter([0, 1, 2, 0, 1, *[3] * 1000])
    with ThreadPoolExecutor(4) as pool:
        with Workers(2, lambda: Place(pool.submit), room=lambda: next(rooms)) as workers:
            assert sorted(item.result for item in workers.run(abs, range(-4, 0))) == [1, 2, 3, 4]
        assert pool.submit(abs, -5).result() == 5  # places leave what they are in as it is
