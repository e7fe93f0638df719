"""Edits of a run folder that ``navbench verify`` notices and those it does not, as docs say."""

import gzip
import json
import random
import shutil
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from harness.storage.checksums import CHECKSUMS, write_checksums
from harness.storage.new_run import OF_STACKS
from harness.storage.parameters import write_packed
from harness.storage.shipped import shipped
from harness.study.verification import verify_run
from navbench.cli.app import main
from tools.pack_runs import pack

DELIVERIES = 2
SEED = "1"  # its starts lie 32 m apart, farther than a robot can believe to be astray
Edit = Callable[[Path, random.Random], None]


@pytest.fixture(scope="module")
def driven(
    tmp_path_factory: pytest.TempPathFactory,
    driven_in_process: Callable[[], AbstractContextManager[None]],
    hall: Path,
) -> Path:
    """A run of short deliveries among many people, with everything recorded."""
    folder = tmp_path_factory.mktemp("edited")
    rules = (shipped("params") / "rules" / "costnav.yaml").read_text(encoding="utf-8")
    (folder / "short.yaml").write_text(rules.replace("timeout: 241.0", "timeout: 2.5"))
    options = ["--episodes", str(DELIVERIES), "--pedestrians", "200", "--workers", "1"]
    options += ["--seed", SEED]
    options += ["--rules", str(folder / "short.yaml"), "--map", str(hall), "--record", "full"]
    with pytest.raises(SystemExit) as leaving, driven_in_process():
        main(["run", "--stack", "nav2-gps-ekf", "--out", str(folder / "run"), *options])
    assert not leaving.value.code
    assert pq.read_table(folder / "run" / "events.parquet").num_rows, "nobody was touched"
    return folder / "run"


def cell(name: str, column: str, change: Callable[[Any], Any]) -> Edit:
    """Change one value of a table."""

    def edit(run: Path, rng: random.Random) -> None:
        table = pq.read_table(run / name)
        values = table[column].to_pylist()
        place = rng.randrange(len(values))
        values[place] = change(values[place])
        field = table.schema.get_field_index(column)
        array = pa.array(values, table.schema.field(column).type)
        pq.write_table(table.set_column(field, table.schema.field(column), array), run / name)

    return edit


def rows(name: str, choose: Callable[[int, random.Random], list[int]]) -> Edit:
    """Keep some rows of a table, in an order."""

    def edit(run: Path, rng: random.Random) -> None:
        table = pq.read_table(run / name)
        pq.write_table(table.take(pa.array(choose(len(table), rng))), run / name)

    return edit


def without_one(count: int, rng: random.Random) -> list[int]:
    left_out = rng.randrange(count)
    return [number for number in range(count) if number != left_out]


def swapped(pattern: str) -> Edit:
    def edit(run: Path, rng: random.Random) -> None:
        one, other = rng.sample(sorted(run.glob(pattern)), 2)
        content = one.read_bytes()
        one.write_bytes(other.read_bytes())
        other.write_bytes(content)

    return edit


def cut(pattern: str) -> Edit:
    """The last bytes of a file."""

    def edit(run: Path, rng: random.Random) -> None:
        file = rng.choice(sorted(run.glob(pattern)))
        file.write_bytes(file.read_bytes()[:-3])

    return edit


def removed(pattern: str) -> Edit:
    return lambda run, rng: rng.choice(sorted(run.glob(pattern))).unlink()


def document(name: str, change: Callable[[dict[str, Any]], object]) -> Edit:
    def edit(run: Path, rng: random.Random) -> None:
        content = json.loads((run / name).read_text())
        change(content)
        (run / name).write_text(json.dumps(content))

    return edit


def text(name: str, old: str, new: str) -> Edit:
    def edit(run: Path, rng: random.Random) -> None:
        content = (run / name).read_text()
        assert old in content
        (run / name).write_text(content.replace(old, new))

    return edit


def added(name: str) -> Edit:
    return lambda run, rng: (run / name).write_bytes(b"")


def bit(pattern: str) -> Edit:
    def edit(run: Path, rng: random.Random) -> None:
        file = rng.choice(sorted(run.glob(pattern)))
        content = bytearray(file.read_bytes())
        content[rng.randrange(len(content))] ^= 1 << rng.randrange(8)
        file.write_bytes(content)

    return edit


def recorded(name: str) -> Edit:
    """Move one row of an array of a recording."""

    def edit(run: Path, rng: random.Random) -> None:
        file = rng.choice(sorted(run.glob("recordings/*.npz")))
        with np.load(file) as stored:
            arrays = {key: stored[key] for key in stored.files}
        arrays[name][len(arrays[name]) // 2] += 1
        np.savez_compressed(file, **arrays)

    return edit


def both(*edits: Edit) -> Edit:
    def edit(run: Path, rng: random.Random) -> None:
        for each in edits:
            each(run, rng)

    return edit


def more(value: float) -> float:
    return value * 1.1 + 0.1


COST = cell("episodes.parquet", "distance_m", more)
FOLLOWED: dict[str, Edit] = {  # edits that what else is in the folder contradicts
    "a distance": COST,
    "an outcome": cell("episodes.parquet", "outcome", lambda _: "sla"),
    "an injury": cell("episodes.parquet", "pedestrian_injury_usd", more),
    "an impulse": cell("episodes.parquet", "collision_impulse_ns", more),
    "a shortest path": cell("episodes.parquet", "shortest_path_m", more),
    "a start": cell("episodes.parquet", "start_x_m", more),
    "a seed": cell("episodes.parquet", "seed", lambda _: 7),
    "a stack": cell("episodes.parquet", "stack", lambda _: "nav2-best"),
    "a row less": rows("episodes.parquet", without_one),
    "an event less": rows("events.parquet", lambda n, rng: list(range(n))[1:]),
    "events of nobody": cell("events.parquet", "episode", lambda _: 77),
    "a wall time": cell("timings.parquet", "wall_s", more),
    "times less": rows("timings.parquet", without_one),
    "a summary": document("summary.json", lambda it: it["runs"][0].update(errors=3)),
    "no summary": removed("summary.json"),
    "swapped recordings": swapped("recordings/*.npz"),
    "a recording less": removed("recordings/*.npz"),
    "decisions less": removed("recordings/*.parquet"),
    "swapped decisions": swapped("recordings/*.parquet"),
    "an added recording": added("recordings/mine.npz"),
    "prices": text("params/prices.yaml", "value: 8000", "value: 4000"),
    "rules": text("params/rules.yaml", "timeout: 2.5", "timeout: 3.5"),
    "a study of more": document("run.json", lambda it: it.update(episodes=9)),
    "a study of another seed": document("run.json", lambda it: it.update(seed=5)),
    "another map": document("run.json", lambda it: it.update(map_sha256="0" * 64)),
    "another machine": both(document("run.json", lambda it: it.pop("machine")), COST),
    "an empty journal": both(added("journal.jsonl"), COST),
}
UNNOTICED: dict[str, Edit] = {  # unless the delivery is among those that are driven again
    "what was typed": document("run.json", lambda it: it["command"].append("--fair")),
    "a time of setting up": cell("timings.parquet", "setup_s", more),
    "the name of the processor": document(
        "run.json", lambda it: it["machine"].update(processor="x")
    ),
    "a distance left": cell("episodes.parquet", "goal_distance_m", more),
    "a place of an event": cell("events.parquet", "x_m", more),
    "a moment of a recording": recorded("crowd"),
    "a moment of a plan": recorded("plan_xy"),
}


def whole_column(name: str, value: Any) -> Edit:
    """A value in all rows."""

    def edit(run: Path, rng: random.Random) -> None:
        table = pq.read_table(run / "episodes.parquet")
        place = table.schema.get_field_index(name)
        array = pa.array([value] * len(table), table.schema.field(name).type)
        changed = table.set_column(place, table.schema.field(name), array)
        pq.write_table(changed, run / "episodes.parquet")

    return edit


def dearer(manifest: Any) -> None:
    manifest[OF_STACKS]["nav2-gps-ekf"]["economics"]["revenue"] += 1.0


def cheaper(run: Path, rng: random.Random) -> None:
    texts = json.loads(gzip.decompress((run / "parameters.json.gz").read_bytes()))
    before = texts["prices.yaml"]
    texts["prices.yaml"] = before.replace("value: 8000", "value: 4000")
    assert texts["prices.yaml"] != before
    write_packed(run, texts)


PACKED: dict[str, Edit] = {  # edits of a packed run, which has no summary
    "a published energy": cell("episodes.parquet", "published_energy_kwh", more),
    "a share of the way": cell("episodes.parquet", "spl", more),
    "a margin": document("run.json", dearer),
    "prices": cheaper,
}
PLAIN: dict[str, Edit] = {  # that a checksum tells
    "a bit of a table": bit("*.parquet"),
    "a bit of a recording": bit("recordings/*"),
    "a bit of a parameter": bit("params/*"),
    "a bit of the manifest": bit("run.json"),
    "a bit of the checksums": bit(CHECKSUMS),
    "a parameter less": removed("params/*"),
    "a parameter more": added("params/mine.yaml"),
    "no checksums": removed(CHECKSUMS),
    "no checksums and a distance": both(removed(CHECKSUMS), COST),
    "no table": removed("episodes.parquet"),
    "a table cut short": cut("events.parquet"),
}


def verdict(run: Path, capsys: pytest.CaptureFixture[str], sample: int = 0) -> tuple[int, str]:
    """Status and output, after so many deliveries were driven again."""
    with pytest.raises(SystemExit) as leaving:
        main(["verify", str(run), "--sample", str(sample)])
    told = capsys.readouterr()
    assert "Traceback" not in told.err
    return int(leaving.value.code or 0), told.out + told.err


def edited(driven: Path, tmp_path: Path, edit: Edit, title: str) -> Path:
    run = Path(shutil.copytree(driven, tmp_path / "run"))
    edit(run, random.Random(title))
    return run


def test_it_is_sound_before_and_its_digest_is_told(
    driven: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status, told = verdict(driven, capsys, sample=1)
    assert status == 0 and "1 of 1 deliveries driven again came out as stored" in told
    digest = told.partition("checksum ")[2].splitlines()[0]
    assert len(digest) == 64


@pytest.mark.parametrize("title", [*PLAIN, "no summary", "a recording less"])
def test_an_edit_is_noticed(
    driven: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    title: str,
) -> None:
    edit = (PLAIN | FOLLOWED)[title]
    status, told = verdict(edited(driven, tmp_path, edit, title), capsys)
    assert status == 1, told


@pytest.mark.slow
@pytest.mark.parametrize("title", FOLLOWED)
def test_an_edit_with_new_checksums_contradicts_the_rest(
    driven: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    title: str,
) -> None:
    run = edited(driven, tmp_path, FOLLOWED[title], title)
    write_checksums(run)
    status, told = verdict(run, capsys)
    assert status == 1, told


@pytest.mark.slow
@pytest.mark.parametrize("title", UNNOTICED)
def test_what_docs_name_goes_unnoticed_where_it_is_not_driven_again(
    driven: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    title: str,
) -> None:
    run = edited(driven, tmp_path, UNNOTICED[title], title)
    write_checksums(run)
    status, told = verdict(run, capsys)
    assert status == 0, told
    status, told = verdict(run, capsys, sample=DELIVERIES)
    never = "what was typed", "a time of setting up", "the name of the processor"
    assert (status == 0) == (title in never), told


@pytest.fixture
def packed(driven: Path, tmp_path: Path, hall: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The same run without its recordings, packed, and looked at from where its map is."""
    monkeypatch.chdir(hall.parent)
    without = document("run.json", lambda it: it.update(keep_trace=False, keep_decisions=False))
    pack([edited(driven, tmp_path, without, "")], tmp_path / "packed", "this")
    return tmp_path / "packed"


@pytest.mark.parametrize("title", PACKED)
def test_an_edit_of_a_packed_run_contradicts_the_rest(packed: Path, title: str) -> None:
    assert not verify_run(packed, 0, 0).wrong
    PACKED[title](packed, random.Random(title))
    write_checksums(packed)
    assert len(verify_run(packed, 0, 0).wrong) == 1


@pytest.mark.slow
@pytest.mark.parametrize("is_older", [True, False])
def test_a_column_that_no_program_of_that_time_stored_is_no_fault(
    driven: Path, tmp_path: Path, is_older: bool
) -> None:
    run = edited(driven, tmp_path, whole_column("jerk_p95_mps3", None), "")
    if is_older:
        document("run.json", lambda it: it.update(program_sha256="0" * 64))(run, random.Random(0))
    write_checksums(run)
    found = verify_run(run, 1, 0)
    told = [note for note in found.notes if "jerk_p95_mps3 not stored by the program" in note]
    assert bool(found.is_sound) == bool(told) == is_older
    assert bool(found.other) != is_older
