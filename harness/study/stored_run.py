"""A finished run as its folder tells of it, read without what simulates."""

import contextlib
import copy
import dataclasses
import functools
import hashlib
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from harness.economics.accountings import COUNTED, PERSON
from harness.economics.contact_costs import injury_measures
from harness.economics.prices import Prices, load_prices
from harness.metrics.columns import EPISODE_COLUMNS, EVENT_COLUMNS, Row
from harness.metrics.delivery_log import JOULES_PER_KWH
from harness.storage.checksums import changed_files
from harness.storage.manifest_file import (
    COUNTS,
    mixed_files,
    no_run,
    read_manifest,
    require_stack_name,
)
from harness.storage.new_run import MANIFEST, OF_STACKS
from harness.storage.parameters import parameter_folder
from harness.storage.rows import Rows, values
from harness.storage.run_folder import JOURNAL, count_finished
from harness.storage.shipped import is_district
from harness.storage.tables import read_rows
from harness.storage.texts import clean_text, quoted
from harness.study.stored_checks import check_events, check_plausible, check_whole
from navstack.errors import InputError, UnknownNameError
from navstack.files import check_regular
from navstack.params.strict import load_yaml

# files of params/ that two comparable runs have in common
CONDITIONS = ("world", "rules", "prices")
MOST_PEOPLE = 20_000_000  # [bytes] of a recording of people

Loaded = TypeVar("Loaded")


@dataclass(frozen=True, slots=True)
class StoredStack:
    """What of a stack matters once it has driven."""

    name: str
    carries: tuple[str, ...]  # sensors that have a price
    localizer: str
    errors: int  # deliveries without a result
    rows: Sequence[Row]  # of the finished deliveries, as in episodes.parquet
    data_collection: bool = False  # whether it is part of the CAPEX


@dataclass(frozen=True, slots=True)
class StoredRun:
    """A run folder's content."""

    folder: Path
    about: Mapping[str, Any]  # run.json
    stacks: tuple[StoredStack, ...]
    events: Sequence[Row]  # as in events.parquet

    @property
    def seed(self) -> int:
        """Of the run."""
        return int(self.about["seed"])

    @property
    def map_name(self) -> str:
        """Name of its map."""
        return Path(self.about["map_name"]).stem

    @property
    def first_stack(self) -> str:
        """Its first stack as commands take one, FOLDER:stack."""
        return f"{self.folder}:{self.stacks[0].name}"

    @property
    def has_legs(self) -> bool:
        """Whether its deliveries are missions in legs, also where their district is not here."""
        is_drawn_there = self.about.get("distance") or self.about.get("missions") == "osm"
        return (
            bool(is_drawn_there) or is_district(str(self.about["map_name"])) or self._keeps_legs()
        )

    def _keeps_legs(self) -> bool:
        rows = (row for stack in self.stacks for row in stack.rows)
        return any(leg_file(self.folder, row).is_file() for row in rows)

    @property
    def is_whole(self) -> bool:
        """Whether each stack has driven all deliveries that were asked for."""
        return all(
            len(stack.rows) + stack.errors >= self.asked_of(stack.name) for stack in self.stacks
        )

    def asked_of(self, stack: str) -> int:
        """How many deliveries of a stack were asked for; 0: its manifest does not say it."""
        asked, own = self.about.get("episodes"), self.about.get(COUNTS)
        if isinstance(own, Mapping):
            asked = own.get(stack, asked)
        return asked if isinstance(asked, int) else 0

    def prices(self) -> Prices:
        """The prices at which it was run."""
        return self._parameters("prices", load_prices)

    def condition(self, name: str) -> Any:
        """Content of one of the :data:`CONDITIONS`' files."""
        return copy.deepcopy(self._parameters(name, load_yaml))

    def _parameters(self, name: str, load: Callable[[Any], Loaded]) -> Loaded:
        """A file of params/, read once in each of its states."""
        file = parameter_folder(self.folder) / f"{name}.yaml"
        found: Loaded = loaded(load, file)
        return found

    def kept_condition(self, name: str) -> dict[str, Any]:
        """As :meth:`condition`; empty where an older program has not kept the file."""
        with contextlib.suppress(InputError):
            found = self.condition(name)
            return dict(found) if isinstance(found, Mapping) else {}
        return {}

    def seconds_a_delivery(self, stack: str) -> float | None:
        """Wall time [s] of a worker for a delivery of a stack, on average.

        None: its table is not there.
        """
        with contextlib.suppress(InputError):
            spent = read_rows(
                self.folder / "timings.parquet", {"stack": "string", "wall_s": "double"}
            )
            times = spent.where(stack.__eq__, "stack").values("wall_s")
            if times and None not in times:
                return float(sum(times) / len(times))
        return None

    def recorded_people(self) -> str:
        """SHA-256 of the recording whose people were replayed; empty: there is none.

        Raises:
            InputError: it is no regular file, or too large.
        """
        files = sorted(parameter_folder(self.folder).glob("people.*"))
        if not files:
            return ""
        digest = hashlib.sha256()
        for file in files:
            check_regular(file, MOST_PEOPLE)
            digest.update(file.read_bytes())
        return digest.hexdigest()

    def only(self, stack: str) -> "StoredRun":
        """The same run with one stack.

        Raises:
            UnknownNameError: the run has no such stack.
        """
        kept = tuple(each for each in self.stacks if each.name == stack)
        if not kept:
            raise UnknownNameError(
                f"stack of {self.folder}", stack, [each.name for each in self.stacks]
            )
        own = self.about.get(OF_STACKS, {}).get(stack, {})
        return dataclasses.replace(self, stacks=kept, about={**self.about, **own})


def loaded(load: Callable[[Any], Any], file: Path) -> Any:
    """Content of a file, read once in each of its states: another may stand in its place later."""
    return _loaded(load, file, file.stat().st_mtime_ns if file.is_file() else 0)


@functools.lru_cache(128)
def _loaded(load: Callable[[Any], Any], file: Path, changed: int) -> Any:
    """Content of a file as it was when it was ``changed`` last."""
    return load(file)


def load_run(folder_or_stack: str) -> StoredRun:
    """Read ``FOLDER``, or one stack of it with ``FOLDER:stack``.

    Raises:
        InputError: it holds no run that can be read; the message says what is wrong with it.
    """
    folder, stack = folder_and_stack(folder_or_stack)
    if stack is None:
        return _load(folder)
    return _load(folder).only(stack)


def folder_and_stack(given: str) -> tuple[Path, str | None]:
    """The parts of ``FOLDER:stack``; None: no stack is given.

    The names of both may have colons: the folder is the longest one that there is.
    """
    if Path(given).is_dir():
        return Path(given), None
    parts = given.split(":")
    for number in range(len(parts) - 1, 0, -1):
        folder = ":".join(parts[:number])
        if folder and Path(folder).is_dir():
            return Path(folder), ":".join(parts[number:])
    folder, colon, stack = given.rpartition(":")
    return (Path(folder), stack) if colon else (Path(given), None)


def leg_file(folder: Path, row: Row) -> Path:
    """The table of the legs of a mission on a district; on a map there is none."""
    return folder / "recordings" / f"{row['stack']}-{row['episode']}-legs.parquet"


def repriced(stack: StoredStack, events: Sequence[Row], prices: Prices) -> StoredStack:
    """The same deliveries with the columns that depend on prices worked out anew.

    As a run at these prices has them.

    Raises:
        InputError: rows and events are not of the same deliveries.
    """
    impulses: dict[int, list[float]] = {}
    for event in events:
        if event["type"] == COUNTED and event["partner"] == PERSON and event["stack"] == stack.name:
            impulses.setdefault(event["episode"], []).append(event["impulse_ns"])
    for episode, told in zip(
        *(values(stack.rows, key) for key in ("episode", "pedestrian_contacts")), strict=True
    ):
        there = len(impulses.get(episode, ()))
        if told is not None and told != there:
            raise InputError(
                f"episode {episode} of {stack.name} has {told} contacts with people in "
                f"episodes.parquet and {there} in events.parquet: they are of different states of "
                "the run; take a whole copy"
            )
    force = prices.rolling_resistance_force
    rows = Rows(EPISODE_COLUMNS)
    for row in stack.rows:
        injuries = injury_measures(impulses.get(row["episode"], ()), prices)
        rows.append(
            {**row, **injuries, "published_energy_kwh": force * row["distance_m"] / JOULES_PER_KWH}
        )
    return dataclasses.replace(stack, rows=rows)


def _load(folder: Path) -> StoredRun:
    about = _described(folder)
    if not (folder / "episodes.parquet").exists():
        if message := no_run(folder):
            raise InputError(message)
        unfinished = ""
        if (folder / JOURNAL).is_file():
            unfinished = f"; finish it with --resume {quoted(folder)}"
        raise InputError(f"run folder '{folder}' has no episodes.parquet{unfinished}")
    rows = read_rows(folder / "episodes.parquet", EPISODE_COLUMNS)
    if (waiting := count_finished(folder) - len(rows)) > 0:
        sys.stderr.write(
            f"note: {folder} has {waiting} more finished deliveries than its tables tell of: it is "
            "being driven, or was cut off; --resume it to have them all\n"
        )
    check_whole(rows, folder / "episodes.parquet")
    finished = rows.where(lambda error: error is None, "error")
    check_plausible(finished, folder)
    if mixed := mixed_files(folder):
        sys.stderr.write(
            f"note: {folder} is mixed: {', '.join(mixed)} were changed after it had begun\n"
        )
    if changed := changed_files(folder, not (folder / JOURNAL).exists()):
        sys.stderr.write(f"note: {folder} was changed since it was written: {', '.join(changed)}\n")
    stacks = tuple(
        StoredStack(
            name=name,
            carries=carries,
            localizer=localizer,
            errors=rows.values("stack").count(name) - finished.values("stack").count(name),
            rows=_in_order(finished.where(name.__eq__, "stack")),
            data_collection=is_trained,
        )
        for name, carries, localizer, is_trained in about["stacks"]
    )
    events = read_rows(folder / "events.parquet", EVENT_COLUMNS)
    check_events(events, folder / "events.parquet")
    return StoredRun(folder, about, stacks, events)


def _in_order(rows: Rows) -> Rows:
    """Rows by seed and episode.

    A table has them so, unless somebody shuffled it: random numbers of intervals and tests are
    drawn for rows in their order.
    """
    keys = list(zip(rows.values("seed"), rows.values("episode"), strict=True))
    places = [tuple((each is None, each) for each in key) for key in keys]
    return rows.take(sorted(range(len(rows)), key=places.__getitem__))


def _described(folder: Path) -> dict[str, Any]:
    """Content of ``run.json``, its stacks as name, sensors, localizer and if data was collected."""
    about = read_manifest(folder)
    try:
        stacks = [
            (
                clean_text(s["name"]),
                tuple(s["carries"]),
                s["localizer"],
                s.get("policy", {}).get("data_collection") is True,
            )
            for s in about["stacks"]
        ]
        sound = isinstance(about["seed"], int) and isinstance(about["map_name"], str)
        sound = sound and about["seed"] >= 0 and isinstance(about.get("versions", {}), dict)
        own = about.get(OF_STACKS, {})
        sound = sound and len({name for name, *_ in stacks}) == len(stacks)
        sound = sound and all(isinstance(said, dict) for said in (own, *own.values()))
        sound = sound and all(
            isinstance(text, str)
            for name, sensors, key, _ in stacks
            for text in (name, *sensors, key)
        )
    except (TypeError, KeyError, AttributeError):
        sound = False
    if not sound:
        raise InputError(
            f"{folder / MANIFEST}: is damaged; it should name the seed, the map and the stacks of "
            "a run"
        )
    for name, *_ in stacks:
        require_stack_name(name, str(folder / MANIFEST))
    return {**about, "stacks": stacks}


def require_different(runs: Sequence[StoredRun]) -> None:
    """Check that no stack of a run is given twice; its deliveries would count twice.

    Raises:
        InputError: one is.
    """
    known: set[tuple[Path, str]] = set()
    for run in runs:
        for stack in run.stacks:
            place = (run.folder.resolve(), stack.name)
            if place in known:
                raise InputError(f"'{run.folder}:{stack.name}' is given twice; give it once")
            known.add(place)
