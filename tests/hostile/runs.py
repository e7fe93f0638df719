"""Run folders: manifest, parameters, journal and tables of a run that others made, or damaged."""

import contextlib
import functools
import json
import re
import shutil
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from harness.execution.executors import InProcess
from harness.execution.workers import Workers
from harness.storage.checksums import CHECKSUMS
from harness.storage.new_run import create_run
from harness.storage.run_folder import RunFolder
from harness.study.drive import TABLES, drive_missing, finish
from harness.study.manifest import about, load_study, parameters
from harness.task.study import make_study

from .case import RULES, Case, Make, pipe, put, write_map

Change = Callable[[Path], object]  # of a folder with a run
_HUGE = "9" * 400


@functools.cache
def valid_run(episodes: int) -> Path:
    """A run of two deliveries, the first ``episodes`` of them finished, made once per process."""
    root = Path(tempfile.mkdtemp(dir=Path.cwd().parent))  # beside the folders of the cases
    rules, world = put(root / "rules.yaml", RULES), write_map(root)
    study = make_study(
        stacks=["parked"],
        episodes=2,
        map_name=str(world),
        pedestrians=0,
        rules=str(rules),
        start=(2.0, 2.0, 0.0),
        goal=(8.0, 8.0, 0.0),
    )
    create_run(root / "run", about(study, ["navbench"]), parameters(study))
    study = load_study(root / "run", 1)

    def on_finished(finished: object, record: object) -> None:
        if len(folder.rows) == episodes < study.total:
            raise KeyboardInterrupt

    with RunFolder(root / "run", TABLES, study.total) as folder, Workers(1, InProcess) as workers:
        with contextlib.suppress(KeyboardInterrupt):
            drive_missing(study, folder, workers, on_finished)
        finish(study, folder)
    return root / "run"


def _manifest(change: Callable[[dict[str, Any]], object]) -> Change:
    def apply(run: Path) -> None:
        content = json.loads((run / "run.json").read_text())
        change(content)
        put(run / "run.json", json.dumps(content))

    return apply


def _text(name: str, content: str | bytes) -> Change:
    return lambda run: put(run / name, content)


def _link(name: str) -> Change:
    """A link in the folder to a file outside it, which writing would destroy."""

    def apply(run: Path) -> None:
        victim = put(run.parent / "victim.txt", "dear" if name != "journal.jsonl" else "{")
        (run / name).unlink(missing_ok=True)
        (run / name).symlink_to(victim)

    return apply


def _replaced(name: str, make: Callable[[Path], object]) -> Change:
    def apply(run: Path) -> None:
        (run / name).unlink()
        make(run / name)

    return apply


def _stack(**values: Any) -> Change:
    return _manifest(lambda content: content["stacks"][0].update(values))


def _rows(name: str, **columns: Any) -> Change:
    """A table with columns replaced by constant ones."""

    def apply(run: Path) -> None:
        table = pq.read_table(run / name)
        for key, value in columns.items():
            table = table.set_column(
                table.schema.get_field_index(key), key, pa.array([value] * len(table))
            )
        pq.write_table(table, run / name)

    return apply


def _many_rows(run: Path) -> None:
    """A small file that unpacks to three million rows."""
    schema = pa.schema(
        [(name, pa.type_for_alias(kind)) for name, kind in TABLES["episodes"].items()]
    )
    block = pa.table(
        {
            name: pa.nulls(50_000, kind)
            for name, kind in zip(schema.names, schema.types, strict=True)
        }
    )
    with pq.ParquetWriter(run / "episodes.parquet", schema, compression="zstd") as writer:
        for _ in range(60):
            writer.write_table(block)


def _long_texts(run: Path) -> None:
    """A small file whose texts unpack to 80 GB."""
    table = pq.read_table(run / "episodes.parquet").take(pa.array([0] * 20_000))
    texts = pa.DictionaryArray.from_arrays(pa.array([0] * 20_000), pa.array(["x" * (1 << 22)]))
    place = table.schema.get_field_index("reason")
    pq.write_table(
        table.set_column(place, "reason", texts), run / "episodes.parquet", compression="zstd"
    )


def _journal(old: str, new: str) -> Change:
    """The journal with one text for another, as an earlier version wrote it: without checksums."""

    def change(run: Path) -> None:
        text = re.sub(r', "crc": "[0-9a-f]{8}"}', "}", (run / "journal.jsonl").read_text())
        put(run / "journal.jsonl", text.replace(old, new))

    return change


def _time(value: float | None) -> Change:
    """The timings of a finished run with another factor."""

    def apply(run: Path) -> None:
        table = pq.read_table(run / "timings.parquet")
        place = table.schema.get_field_index("real_time_factor")
        factors = pa.array([value] * len(table), pa.float64())
        pq.write_table(
            table.set_column(place, "real_time_factor", factors), run / "timings.parquet"
        )

    return apply


def _linked_folder(run: Path) -> None:
    (run.parent / "elsewhere").mkdir()
    (run / "recordings").symlink_to(run.parent / "elsewhere")


MANIFESTS: dict[str, tuple[Change, str]] = {
    "is missing": (lambda run: (run / "run.json").unlink(), "run.json"),
    "is empty": (_text("run.json", ""), "run.json"),
    "is binary": (_text("run.json", bytes(range(256))), "run.json"),
    "is cut off": (
        lambda run: put(run / "run.json", (run / "run.json").read_text()[:300]),
        "run.json",
    ),
    "is a list": (_text("run.json", "[]"), "run.json"),
    "is a number of 100 000 digits": (_text("run.json", "9" * 100_000), "run.json"),
    "is nested 100 000 deep": (_text("run.json", "[" * 100_000), "run.json"),
    "has ten million characters": (
        _text("run.json", '{"a": "' + "x" * 10_000_000 + '"}'),
        "run.json",
    ),
    "is a pipe": (_replaced("run.json", pipe), "run.json"),
    "is a device": (_replaced("run.json", lambda path: path.symlink_to("/dev/zero")), "run.json"),
    "is a link to itself": (
        _replaced("run.json", lambda path: path.symlink_to(path.name)),
        "run.json",
    ),
    "has no versions": (_manifest(lambda m: m.pop("versions")), "run.json"),
    "has no stacks": (_manifest(lambda m: m.update(stacks=[])), "stacks"),
    "has numbers for stacks": (_manifest(lambda m: m.update(stacks=[1, 2])), "stacks"),
    "has a stack that climbs": (_stack(name="../../evil"), "../../evil"),
    "has a stack of another kind": (_stack(carries=5), "run.json"),
    "has a stack with a foreign key": (_stack(surprise=1), "surprise"),
    "has a seed that is a text": (_manifest(lambda m: m.update(seed="zero")), "seed"),
    "has a seed of 400 digits": (_manifest(lambda m: m.update(seed=int(_HUGE))), "seed"),
    "has a seed below zero": (_manifest(lambda m: m.update(seed=-1)), "seed"),
    "has no map": (_manifest(lambda m: m.pop("map_name")), "map_name"),
    "has a map that is a number": (_manifest(lambda m: m.update(map_name=5)), "map_name"),
    "has a map elsewhere": (_manifest(lambda m: m.update(map_name="/etc/passwd")), "passwd"),
    "has a map that is a device": (
        _manifest(lambda m: m.update(map_name="/dev/zero")),
        "/dev/zero",
    ),
    "has a map with a NUL": (_manifest(lambda m: m.update(map_name="a\x00.yaml")), "map"),
    "has an unknown map": (_manifest(lambda m: m.update(map_name="sidewlak")), "sidewalk"),
    "has another map's digest": (_manifest(lambda m: m.update(map_sha256="0" * 64)), "map"),
    "has a start that is no number": (
        _manifest(lambda m: m.update(start={"x": float("nan"), "y": 2, "yaw": 0})),
        "start",
    ),
    "has a start beyond the sky": (
        _manifest(lambda m: m.update(start={"x": 1e300, "y": 2, "yaw": 0})),
        "start",
    ),
    "has a goal that is a list": (_manifest(lambda m: m.update(goal=[1, 2])), "goal"),
    "has episodes of 400 digits": (_manifest(lambda m: m.update(episodes=int(_HUGE))), "episodes"),
    "has episodes below one": (_manifest(lambda m: m.update(episodes=0)), "episodes"),
    "has half an episode": (_manifest(lambda m: m.update(episodes=0.5)), "episodes"),
    "has unknown missions": (_manifest(lambda m: m.update(missions="hard")), "missions"),
}
FILES: dict[str, tuple[Change, str]] = {
    "lacks its parameters": (lambda run: shutil.rmtree(run / "params"), "params"),
    "has rules that are cut off": (_text("params/rules.yaml", "timeout: 'x"), "rules.yaml"),
    "has rules that are a pipe": (_replaced("params/rules.yaml", pipe), "rules.yaml"),
    "has a robot that runs a program": (
        _text("params/parked-robot.yaml", "!!python/object/apply:os.abort []"),
        "parked-robot.yaml",
    ),
    "has a world of recorded people elsewhere": (
        _text("params/world.yaml", "people: {model: replay, replay: {file: /dev/zero}}"),
        "/dev/zero",
    ),
    "has a journal of another run": (_journal('"episode": 0', '"episode": 77'), "delivery 77"),
    "has recordings that are a link to another folder": (_linked_folder, "recordings"),
    "has a journal that is a pipe": (_replaced("journal.jsonl", pipe), "run folder"),
    "has a journal that is a link to another file": (_link("journal.jsonl"), "run folder"),
    "has a lock that is a link to another file": (_link("run.lock"), "run folder"),
    "has a journal that is a folder": (
        _replaced("journal.jsonl", lambda path: path.mkdir()),
        "run folder",
    ),
}
TABLE_CHANGES: dict[str, tuple[Change, str]] = {
    "is missing": (lambda run: (run / "episodes.parquet").unlink(), "run folder"),
    "is empty": (_text("episodes.parquet", b""), "damaged"),
    "is a text": (_text("episodes.parquet", "PAR1 no table PAR1"), "damaged"),
    "is cut off": (
        lambda run: put(run / "episodes.parquet", (run / "episodes.parquet").read_bytes()[:-300]),
        "damaged",
    ),
    "has damaged bytes": (
        lambda run: put(run / "episodes.parquet", _damaged(run / "episodes.parquet")),
        "damaged",
    ),
    "is a pipe": (_replaced("episodes.parquet", pipe), "episodes.parquet"),
    "is a folder": (_replaced("episodes.parquet", lambda path: path.mkdir()), "episodes.parquet"),
    "has no columns": (
        lambda run: pq.write_table(pa.table({"a": [1, 2]}), run / "episodes.parquet"),
        "run",
    ),
    "has texts for numbers": (_rows("episodes.parquet", distance_m="far"), "run"),
    "has distances that are no numbers": (
        _rows("episodes.parquet", distance_m=float("nan")),
        "distance_m",
    ),
    "has lists for texts": (_rows("episodes.parquet", outcome=["sla"]), "run"),
    "has a stack that is not there": (_rows("episodes.parquet", stack="nobody"), "run"),
    "has three million rows": (_many_rows, "run"),
    "has texts of 80 GB": (_long_texts, "run"),
    "is a pickle": (_text("episodes.parquet", b"cposix\nsystem\n(S'touch hacked'\ntR."), "damaged"),
}


def _damaged(path: Path) -> bytes:
    content = path.read_bytes()
    return content[:40] + bytes(300) + content[340:]


def cases() -> Iterator[Case]:
    """Runs to go on with, and finished ones to read."""
    for what, (change, says) in {**MANIFESTS, **FILES}.items():
        yield Case(f"run to resume: {what}", says, _resumed(change))
    for what, (change, _) in MANIFESTS.items():
        if what.startswith("is ") or "for stacks" in what or "of another kind" in what:
            yield Case(f"priced run: manifest {what}", "run.json", _read(change, "price"))
    for command in ("price", "compare", "sensitivity"):
        for what, (change, says) in TABLE_CHANGES.items():
            yield Case(f"{command}: table {what}", says, _read(change, command))
    for what, (change, says) in TABLE_CHANGES.items():
        if what != "is missing":  # then the run begins anew
            yield Case(f"finished run to resume: table {what}", says, _finished(change))
    yield Case(
        "finished run to resume: a time is missing", "real_time_factor", _finished(_time(None))
    )
    yield Case(
        "finished run to resume: a time is no number",
        "real_time_factor",
        _finished(_time(float("nan"))),
    )


def copy_of(folder: Path, episodes: int = 2) -> Path:
    """A copy of the run in a folder."""
    shutil.copytree(valid_run(episodes), folder / "run")
    return folder / "run"


def _copy(folder: Path, change: Change, episodes: int) -> Path:
    run = copy_of(folder, episodes)
    # as a run of an earlier version: else that it was changed is all that is said
    (run / CHECKSUMS).unlink()
    change(run)
    return run


def _resumed(change: Change) -> Make:
    return lambda folder: ["run", "--resume", str(_copy(folder, change, 1)), "--workers", "1"]


def _finished(change: Change) -> Make:
    return lambda folder: ["run", "--resume", str(_copy(folder, change, 2)), "--workers", "1"]


def _read(change: Change, command: str) -> Make:
    def make(folder: Path) -> list[str]:
        run = str(_copy(folder, change, 2))
        return [command, run, run] if command == "compare" else [command, run]

    return make
