"""Malformed inputs of every kind, made from valid ones by their structure, at the doors themselves.

What :mod:`.mutations` changes is text, and goes through whole commands. Here leaves of documents,
cells of tables, fields of records and bytes of files are replaced, and go to the function that
reads them: a thousand take a minute.

Usage: python -m tests.hostile.doors [--number N] [--seed S]
"""

import argparse
import copy
import dataclasses
import io
import json
import os
import random
import re
import resource
import shutil
import signal
import struct
import sys
import tempfile
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType
from typing import Any

import click
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import yaml
from PIL import Image

from harness.economics.prices import load_prices
from harness.economics.valuation import value
from harness.episode.files import rules_of, world_params
from harness.identify.urdf import read_urdf
from harness.policy.answers import AnswerError, packed, packed_error, received
from harness.recorded.bag import Bag
from harness.recorded.ros_messages import TYPES
from harness.recorded.trajectory import read_tum
from harness.scenarios.scenario import load_scenario
from harness.storage.checksums import CHECKSUMS, sealed
from harness.storage.run_folder import JOURNAL, RunFolder
from harness.street.graph_file import load_graph
from harness.study.drive import TABLES
from harness.study.manifest import load_study
from harness.study.stored_run import load_run
from harness.study.suite import load_suite
from harness.task.stack import load_stack
from harness.tuning.space.file import read_spaces
from harness.world.map.scene_io import load_scene
from harness.world.people.params import ReplayParams
from harness.world.people.replay_file import load_recording
from harness.world.physics.robot import RobotParams
from harness.world.sensors.suite import SensorParams
from navbench.cli.app import ALIASES, app
from navstack.errors import NavstackError
from navstack.params.strict import load_dataclass

from .bags import chunk, connection, head, message
from .case import MAP_TEXT, RULES, SIDE, good_pgm, put, run_arguments, shipped_text, write_map
from .runs import valid_run
from .streets import GRAPH, URDF
from .worker import attempt

TIME = 60  # [s] of one input, on a busy machine, with what is compiled
MEMORY = 3 << 30  # [bytes]
LONGEST = 1500  # [characters] of what is said
PEOPLE = "id,t,x,y\n" + "".join(
    f"{person},{t / 2},{2 + t / 10},{3 + person}\n" for person in range(3) for t in range(20)
)
NOT_NUMBERS = (
    float("nan"),
    "heavy",
    "1,5",
    "0x1g",
    [1, [2]],
    {"a": 1},
    b"\xff\xfe".decode("latin-1"),
)
ODD_NUMBERS = (-1, 0, -0.0, 0.5, 1e-300, 1e300, 2**63, 10**400, -(2**70), True, float("inf"), None)
ODD_TEXTS = (
    "",
    "\x00",
    "../../etc/passwd",
    "/dev/zero",
    "x" * 5000,
    "\ud83e",
    "{}",
    "nan",
    5,
    ["a"],
    None,
)


@dataclasses.dataclass(frozen=True)
class Attempt:
    """A malformed input."""

    title: str
    is_impossible: bool  # nothing may take it for valid
    run: Callable[[Path], object]  # in an empty folder


def _leaves(content: Any, at: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Where the values of a document are."""
    entries: Any = ()
    if isinstance(content, dict):
        entries = content.items()
    elif isinstance(content, list):
        entries = enumerate(content)
    for key, entry in entries:
        yield (*at, key)
        yield from _leaves(entry, (*at, key))


def changed(content: Any, rng: random.Random) -> tuple[Any, str, bool]:
    """A document with one leaf or branch another, what was done, and whether it cannot be valid."""
    content = copy.deepcopy(content)
    *path, last = rng.choice(list(_leaves(content)))
    inner = content
    for key in path:
        inner = inner[key]
    old = inner[last]
    where = ".".join(map(str, (*path, last)))
    way = rng.choice(("value", "value", "value", "gone", "renamed", "doubled"))
    if way == "gone" or (way == "renamed" and not isinstance(inner, dict)):
        del inner[last]
        return content, f"{where} is gone", False
    if way == "renamed":
        inner[f"{last}x"] = inner.pop(last)
        return content, f"{where} is misspelt", False
    if way == "doubled":
        inner[last] = [old, old]
        return content, f"{where} is there twice in a list", isinstance(old, float)
    if isinstance(old, int | float) and not isinstance(old, bool) and rng.random() < 0.5:
        inner[last] = rng.choice(NOT_NUMBERS)
        return content, f"{where} is {inner[last]!r:.40}", True
    inner[last] = rng.choice(ODD_NUMBERS if isinstance(old, int | float) else ODD_TEXTS)
    return content, f"{where} is {inner[last]!r:.40}", False


def damaged(content: bytes, rng: random.Random) -> tuple[bytes, str]:
    """A file with some of its bytes others, missing or added, and what was done."""
    bytes_ = bytearray(content)
    way = rng.choice(("flipped", "cut", "filled", "doubled", "noise"))
    at = rng.randrange(len(bytes_))
    if way == "flipped":
        for _ in range(rng.randint(1, 4)):
            bytes_[rng.randrange(len(bytes_))] = rng.randrange(256)
    elif way == "cut":
        del bytes_[at:]
    elif way == "filled":
        size = rng.choice((1, 4, 8))
        bytes_[at : at + size] = rng.choice((b"\xff", b"\x00")) * size
    elif way == "doubled":
        bytes_[at:at] = bytes_[at : at + 100]
    else:
        bytes_[at : at + 16] = rng.randbytes(16)
    return bytes(bytes_), way


def _yaml(file: Path, content: Any) -> Path:
    text = yaml.dump(content, sort_keys=False, allow_unicode=True)
    return put(file, text.encode("utf-8", "surrogatepass"))


Read = Callable[[Path], object]
DOCUMENTS: dict[str, tuple[Callable[[], str], Read]] = {
    "stack": (lambda: shipped_text("stacks", "nav2-gps"), lambda file: load_stack(str(file))),
    "robot": (
        lambda: shipped_text("robots", "segway_e1"),
        lambda file: load_dataclass(RobotParams, file),
    ),
    "sensors": (
        lambda: shipped_text("sensors", "rtk_urban"),
        lambda file: load_dataclass(SensorParams, file),
    ),
    "world": (
        lambda: shipped_text("worlds", "social"),
        lambda file: world_params(str(file), None, None),
    ),
    "rules": (lambda: RULES, lambda file: rules_of(str(file))),
    "prices": (lambda: shipped_text("prices", "costnav"), lambda file: load_prices(str(file))),
    "suite": (lambda: shipped_text("suites", "example"), load_suite),
    "space": (
        lambda: shipped_text("search_spaces", "dwb_critics"),
        lambda file: read_spaces([file]),
    ),
    "scenario": (
        lambda: (
            "title: It drives.\ndrawing: {letter: 0.5, rows: '" + "." * 40 + "'}\n"
            "start: {x: 2.0, y: 0.25, yaw: 0.0}\ngoal: {x: 18.0, y: 0.25, yaw: 0.0}\n"
            "people: [{waypoints: [[9.0, 0.25]]}]\nchecks: {no_collision: true}\n"
        ),
        load_scenario,
    ),
}


def _document(kind: str, rng: random.Random) -> Attempt:
    text, read = DOCUMENTS[kind]
    content, what, is_impossible = changed(yaml.safe_load(text()), rng)
    return Attempt(
        f"{kind}: {what}",
        is_impossible,
        lambda folder: read(_yaml(folder / "given.yaml", content)),
    )


def _map(rng: random.Random) -> Attempt:
    content, what, is_impossible = changed(yaml.safe_load(MAP_TEXT), rng)

    def run(folder: Path) -> None:
        put(folder / "map.pgm", good_pgm())
        load_scene(str(_yaml(folder / "map.yaml", content)))

    return Attempt(f"map: {what}", is_impossible, run)


def _image(suffix: str, rng: random.Random) -> Attempt:
    stream = io.BytesIO()
    Image.open(io.BytesIO(good_pgm())).save(stream, "PNG" if suffix == "png" else "PPM")
    content, what = damaged(stream.getvalue()[: SIDE * SIDE], rng)

    def run(folder: Path) -> None:
        put(folder / f"map.{suffix}", content)
        put(folder / "map.yaml", MAP_TEXT.replace("map.pgm", f"map.{suffix}"))
        load_scene(str(folder / "map.yaml"))

    return Attempt(f"{suffix}: {what}", False, run)


def _opened(folder: Path) -> None:
    """A run folder, by all that reads one."""
    study = load_study(folder)
    world_params(study.template.world, None, None)
    rules_of(study.template.rules)
    for stack in study.stacks:
        load_dataclass(SensorParams, Path(stack.sensors))
        load_dataclass(RobotParams, Path(stack.robot))
    run = load_run(str(folder))
    for each in run.stacks:
        if each.rows:
            value(each.rows, each, run.prices(), run.seed)
    with RunFolder(folder, TABLES, study.total):
        pass


def _run_file(rng: random.Random) -> Attempt:
    """A file of a run folder with other content, its checksums gone."""
    files = sorted(each for each in valid_run(2).rglob("*") if each.suffix in (".json", ".yaml"))
    file = rng.choice([each for each in files if each.name != CHECKSUMS])
    content, what, is_impossible = changed(yaml.safe_load(file.read_text()), rng)
    name = file.relative_to(valid_run(2))

    def run(folder: Path) -> None:
        copied = _copied(folder)
        if file.suffix == ".json":
            put(copied / name, json.dumps(content))
        else:
            _yaml(copied / name, content)
        _opened(copied)

    is_read = name.parts[0] == "params" or name.name == "run.json"
    return Attempt(f"run {name}: {what}", is_impossible and is_read and "machine" not in what, run)


def _copied(folder: Path, episodes: int = 2) -> Path:
    shutil.copytree(valid_run(episodes), folder / "run")
    (folder / "run" / CHECKSUMS).unlink()
    return folder / "run"


def _cell(rng: random.Random) -> Attempt:
    """A table with a column of odd values."""
    name = rng.choice(sorted(TABLES))
    column = rng.choice(sorted(TABLES[name]))
    odd = rng.choice([each for each in (*ODD_NUMBERS, *NOT_NUMBERS, *ODD_TEXTS) if each != 10**400])

    def run(folder: Path) -> None:
        file = _copied(folder) / f"{name}.parquet"
        table = pq.read_table(file)
        try:
            values = pa.array([odd] * len(table))
            field = table.schema.get_field_index(column)
            pq.write_table(table.set_column(field, column, values), file)
        except (pa.ArrowException, OverflowError, UnicodeEncodeError):
            raise NavstackError("no table holds it") from None
        _opened(folder / "run")

    return Attempt(f"{name}.parquet: {column} is {odd!r:.40}", False, run)


def _parquet(rng: random.Random) -> Attempt:
    name = rng.choice(sorted(TABLES))
    content, what = damaged((valid_run(2) / f"{name}.parquet").read_bytes(), rng)

    def run(folder: Path) -> None:
        put(_copied(folder) / f"{name}.parquet", content)
        _opened(folder / "run")

    return Attempt(f"{name}.parquet: bytes {what}", False, run)


def _journal(rng: random.Random) -> Attempt:
    """A record of a journal with another value and a sound checksum, or other bytes."""
    lines = (valid_run(1) / JOURNAL).read_bytes()
    content, what = damaged(lines, rng)
    if rng.random() < 0.7:
        record = json.loads(lines.splitlines()[0])
        del record["crc"]
        other, what, _ = changed(record, rng)
        content = sealed(json.dumps(other)) + lines

    def run(folder: Path) -> None:
        put(_copied(folder, 1) / JOURNAL, content)
        _opened(folder / "run")

    return Attempt(f"journal: {what}", False, run)


def _graph(rng: random.Random) -> Attempt:
    """A graph of ways with another value."""
    content, what, _ = changed(GRAPH, rng)
    text = json.dumps(content)
    return Attempt(
        f"graph: {what}", False, lambda folder: load_graph(put(folder / "graph.geojson", text))
    )


def _robot_description(rng: random.Random) -> Attempt:
    """A URDF with another number or other bytes."""
    content, what = damaged(URDF.encode(), rng)
    if rng.random() < 0.7:
        number = rng.choice(list(re.finditer(r"[\d.]+", URDF)))
        what = str(rng.choice((*ODD_NUMBERS, *NOT_NUMBERS)))
        content = f"{URDF[: number.start()]}{what}{URDF[number.end() :]}".encode()
    return Attempt(
        f"robot description: {what:.40}",
        False,
        lambda folder: read_urdf(put(folder / "cart.urdf", content)),
    )


def _answer(rng: random.Random) -> Attempt:
    sound = (packed(np.zeros(2)), packed(np.ones((5, 2))), packed_error("no"), packed(None))
    content, what = damaged(rng.choice(sound), rng)
    if rng.random() < 0.3:
        size = rng.randrange(0, 64, 8)
        content = struct.pack("<cI", rng.choice((b"V", b"W")), size) + rng.randbytes(size)

    def run(folder: Path) -> None:
        stream = io.BytesIO(content)

        def read(size: int) -> bytes:
            found = stream.read(size)
            if len(found) < size:
                raise AnswerError("the policy ended")
            return found

        answer = received(read)
        assert not isinstance(answer, np.ndarray) or np.abs(answer).max() <= 1e6

    return Attempt(f"answer: {what}", False, run)


def _bag(rng: random.Random) -> Attempt:
    content, what = damaged(
        head(500) + chunk(connection(0, b"/fix") + message(bytes(200)) * 3), rng
    )

    def run(folder: Path) -> None:
        with Bag([put(folder / "log.bag", content)], TYPES) as bag:
            for place in bag.places(["/fix"]):
                bag.read(place)

    return Attempt(f"bag: {what}", False, run)


def _text(kind: str, rng: random.Random) -> Attempt:
    """A table of text with other bytes."""
    tum = "".join(f"{n} {n} 0 0 0 0 0 1\n" for n in range(20))
    content, what = damaged((PEOPLE if kind == "people" else tum).encode(), rng)

    def run(folder: Path) -> None:
        if kind == "people":
            load_recording(ReplayParams(file=str(put(folder / "people.csv", content))))
        else:
            read_tum(put(folder / "ref.tum", content))

    return Attempt(f"{kind}: {what}", False, run)


ODD_VALUES = ("nan", "x", "", "-1", "1e400", "1,2", "../../etc/passwd", "/dev/zero", "é" * 3000)
NUMBERS = (click.types.FloatParamType, click.types.IntParamType)


def _of_run(*more: str) -> Callable[[Path], list[str]]:
    def arguments(folder: Path) -> list[str]:
        shutil.copytree(valid_run(2), folder / "run")
        return [more[0], str(folder / "run"), *more[1:]]

    return arguments


PROGRAMS: dict[str, Callable[[Path], list[str]]] = {  # a command -> arguments that it takes
    "run": run_arguments,
    "price": _of_run("price"),
    "sensitivity": _of_run("sensitivity"),
    "verify": _of_run("verify", "--sample", "0"),
    "report": _of_run("report"),
    "explain": _of_run("explain", "0"),
    "replay": _of_run("replay", "0"),
    "plan": lambda folder: ["plan", "--map", str(write_map(folder)), "--start", "2,2,0"],
    "lint": lambda folder: ["lint", str(put(folder / "f.yaml", shipped_text("nav2", "rpp")))],
    "paper": lambda _: ["paper"],
}


def _option(rng: random.Random) -> Attempt:
    """An odd value for an option of a command."""
    name, odd = rng.choice(sorted(PROGRAMS)), rng.choice(ODD_VALUES)
    command = app.get_command(click.Context(app), ALIASES.get(name, (name,))[0])
    assert command is not None
    option = rng.choice(
        [each for each in command.params if isinstance(each, click.Option) and not each.is_flag]
    )

    def run(folder: Path) -> None:
        os.chdir(folder)
        status, said, trace = attempt([*PROGRAMS[name](folder), option.opts[0], odd])
        os.chdir(folder.parent)
        if trace or status not in (0, 1, 2, 3):
            raise RuntimeError(f"{status} {trace}")
        complaints = [line for line in said.splitlines() if line.startswith("navbench: ")]
        if status in (1, 2) and len(complaints) != 1:
            raise RuntimeError(f"{status} {said}")
        if status:
            raise NavstackError(complaints[0] if complaints else "errors")

    is_impossible = isinstance(option.type, NUMBERS) and odd not in ("-1",)
    return Attempt(f"{name} {option.opts[0]} {odd:.20}", is_impossible, run)


DOORS: tuple[Callable[[random.Random], Attempt], ...] = (
    *(lambda rng, kind=kind: _document(kind, rng) for kind in DOCUMENTS),  # type: ignore[misc]
    _map,
    lambda rng: _image("pgm", rng),
    lambda rng: _image("png", rng),
    _run_file,
    _cell,
    _parquet,
    _journal,
    _graph,
    _robot_description,
    _answer,
    _bag,
    lambda rng: _text("people", rng),
    lambda rng: _text("trajectory", rng),
    _option,
    _option,
)


def verdict(attempt: Attempt, folder: Path) -> str:
    """What became of an input; empty: what may be."""

    def late(number: int, frame: FrameType | None) -> None:
        raise TimeoutError(f"more than {TIME} s")

    signal.signal(signal.SIGALRM, late)
    signal.alarm(TIME)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            attempt.run(folder)
    except (NavstackError, AnswerError) as error:
        said = str(error)
        if not said or "\n" in said or len(said) > LONGEST:
            return f"not one line: {said[:200]!r}"
        return ""
    except Exception:  # whatever escapes is what is looked for
        return traceback.format_exc(limit=-4)[-LONGEST:]
    finally:
        signal.alarm(0)
    return "accepted though impossible" if attempt.is_impossible else ""


def tried(number: int, seed: int, root: Path) -> Iterator[tuple[str, str]]:
    """So many inputs, of every door in turn: what they are, and what became of them."""
    rng = random.Random(seed)
    for n in range(number):
        attempt = DOORS[n % len(DOORS)](rng)
        folder = root / f"given-{n}"
        folder.mkdir()
        yield attempt.title, verdict(attempt, folder)
        shutil.rmtree(folder, ignore_errors=True)


def main() -> None:
    """Try them; 1 if any of them harms."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--number", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))
    told: Counter[bool] = Counter()
    with tempfile.TemporaryDirectory() as root:
        for title, trouble in tried(given.number, given.seed, Path(root)):
            told[bool(trouble)] += 1
            if trouble:
                sys.stdout.write(f"{title}: {trouble}\n")
    sys.stdout.write(f"{told[False]} sound, {told[True]} harm\n")
    sys.exit(bool(told[True]))


if __name__ == "__main__":
    main()
