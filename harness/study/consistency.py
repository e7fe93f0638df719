"""What in a run folder contradicts the rest of it, whatever its checksums say."""

import json
import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from pathlib import Path

import numpy as np

from harness.economics.accountings import COUNTED, PERSON
from harness.economics.contact_costs import injury_measures
from harness.economics.prices import Prices
from harness.episode.factory import Parts
from harness.episode.places import legs_of, street_mission
from harness.metrics.columns import EPISODE_COLUMNS, TIMING_COLUMNS, Row
from harness.metrics.contacts import PRICED_PROPERTY, PROPERTY_IMPULSE, was_counted
from harness.storage.files import BROKEN
from harness.storage.journal import records_in
from harness.storage.parameters import FOLDER
from harness.storage.rows import Rows
from harness.storage.run_folder import JOURNAL, MOST_LINE
from harness.storage.shipped import is_district
from harness.storage.tables import opened_table, read_rows
from harness.study.derived import in_economics, in_formulas, is_like, is_near
from harness.study.drive import TABLES, run_document, summarize_study
from harness.study.manifest import is_same_program
from harness.study.stored_run import StoredRun, leg_file
from harness.task.mission import Mission
from harness.task.study import EpisodeTask, Study
from navstack.errors import InputError
from navstack.params.strict import read_text

MOST_TOLD = 3  # of each kind
SETTLED = 0.5  # [m] of the start, where a recording begins
ASTRAY = 30.0  # [m] of the start, where the robot can believe to be at the beginning


def contradictions(folder: Path, study: Study, run: StoredRun, is_exact: bool) -> list[str]:
    """What cannot stand together, a line each.

    Args:
        folder: of a run.
        study: as its manifest tells it.
        run: as its tables tell it.
        is_exact: whether this machine computes as that of the run.
    """
    rows = read_rows(folder / "episodes.parquet", EPISODE_COLUMNS)
    finished = [row for stack in run.stacks for row in stack.rows]
    kinds = [
        _in_rows(folder, study, rows),
        _in_events(run, finished),
        _in_recordings(folder, study, finished),
        (f"{_name(row)} has {what}" for row, what in in_formulas(finished, run.prices())),
    ]
    is_packed = not (folder / FOLDER).is_dir()
    if is_packed:
        kinds.append(in_economics(run))
    else:
        kinds.append(_in_timings(folder, rows, run.has_legs))
    if not is_packed and not (folder / JOURNAL).exists():
        kinds.append(_in_summary(folder, study, rows))
    if is_exact:
        kinds.append(_in_missions(study, finished))
    return [line for kind in kinds for line in islice(kind, MOST_TOLD)]


def recording_files(folder: Path, row: Row) -> tuple[Path, Path]:
    """The recording of a delivery, and the table of its decisions."""
    recordings, name = folder / "recordings", f"{row['stack']}-{row['episode']}"
    return recordings / f"{name}.npz", recordings / f"{name}-decisions.parquet"


def _name(row: Row) -> str:
    return f"delivery {row['episode']} of {row['stack']}"


def _in_rows(folder: Path, study: Study, rows: Rows) -> Iterator[str]:
    """Rows of another study, rows that are missing, and rows that the journal does not have."""
    wanted = {(task.stack_number, task.episode) for task in study.tasks()}
    for row in rows:
        key, template = (row["stack_number"], row["episode"]), study.template
        here = (template.seed, Path(template.map_name).stem)
        if key not in wanted or row["stack"] != study.stacks[key[0]].name:
            yield f"{_name(row)} is not of this study"
        elif (row["seed"], row["map"]) != here:
            yield f"{_name(row)} has another seed or map than the study"
        wanted.discard(key)
    if not (folder / JOURNAL).exists():
        if wanted:
            yield f"{len(wanted)} of {study.total} deliveries are missing, and there is no journal"
        return
    journal = _journal_rows(folder)
    for row in rows:
        if journal.get((row["stack_number"], row["episode"])) != row:
            yield f"{_name(row)} is not as the journal tells it"


def _journal_rows(folder: Path) -> dict[tuple[int, int], Row]:
    with (folder / JOURNAL).open("rb") as journal:
        size = (folder / JOURNAL).stat().st_size
        lines = iter(lambda: journal.readline(MOST_LINE), b"")
        records = records_in(lines, size, TABLES, lambda _: None)
        rows = [record["row"] for record, _, _ in records]
    return {
        (row["stack_number"], row["episode"]): {name: row.get(name) for name in EPISODE_COLUMNS}
        for row in rows
    }


def _in_events(run: StoredRun, rows: Iterable[Row]) -> Iterator[str]:
    """Events of no row, and rows whose contacts are not those of their events."""
    events: dict[tuple[str, int], list[Row]] = {}
    for event in run.events:
        events.setdefault((event["stack"], event["episode"]), []).append(event)
    prices = run.prices()
    for row in rows:
        own = events.pop((row["stack"], row["episode"]), [])
        whole = [event for event in own if event["type"] != COUNTED]
        for each in own:
            if each["type"] == COUNTED and not any(_covers(event, each) for event in whole):
                yield f"{_name(row)} has a counted contact of no contact event"
        for name, value in _contacts(own, prices).items():
            if row[name] is not None and not is_near(row[name], value):
                yield f"{_name(row)} has {name} {row[name]:g}, and its events {value:g}"
    for stack, episode in events:
        yield f"there are events of delivery {episode} of {stack}, which did not end with a result"


def _contacts(events: Sequence[Row], prices: Prices) -> dict[str, float]:
    """Columns of a row that follow from its events."""
    counted = [event for event in events if event["type"] == COUNTED]
    people = [event["impulse_ns"] for event in counted if event["partner"] == PERSON]
    paid = [
        event["kind"]
        for event in counted
        if event["partner"] != PERSON and event["impulse_ns"] >= PROPERTY_IMPULSE
    ]
    whole = [event for event in events if event["type"] != COUNTED]
    soft = [event for event in whole if not any(_covers(event, each) for each in counted)]
    return {
        "soft_contacts": len(soft),
        "pedestrian_contacts": len(people),
        "collision_impulse_ns": sum(event["impulse_ns"] for event in counted),
        **{f"{kind}_contacts": paid.count(kind) for kind in PRICED_PROPERTY},
        **injury_measures(people, prices),
    }


def _covers(event: Row, counted: Row) -> bool:
    """Whether a counted contact is of a contact event."""
    partners = [(each["partner"], each["partner_id"]) for each in (event, counted)]
    moment = counted["stamp_s"], partners[1]
    return was_counted(event["stamp_s"], event["duration_s"], partners[0], [moment])


def _in_timings(folder: Path, rows: Rows, has_waits: bool) -> Iterator[str]:
    """Times that are not those of the rows.

    Args:
        folder: of a run.
        rows: of it.
        has_waits: deliveries wait at signals, which takes simulated time, but none of a computer's.
    """
    timings = read_rows(folder / "timings.parquet", TIMING_COLUMNS)
    if len(timings) != len(rows):
        yield f"there are {len(rows)} deliveries and {len(timings)} times"
        return
    for row, timing in zip(rows, timings, strict=True):
        if (row["stack"], row["episode"]) != (timing["stack"], timing["episode"]):
            yield f"the times of {_name(row)} are of another delivery"
        elif row["error"] is None:
            factor, told = row["duration_s"] / timing["wall_s"], timing["real_time_factor"]
            if not is_near(factor, told) and not (has_waits and told < factor):
                yield f"the times of {_name(row)} do not give its real-time factor"


def _in_summary(folder: Path, study: Study, rows: Rows) -> Iterator[str]:
    """A summary that is missing, or is not what the rows give, where the same program made it."""
    file = folder / "summary.json"
    if not file.is_file():
        yield f"{file.name} is missing"
        return
    timings = read_rows(folder / "timings.parquet", TIMING_COLUMNS)
    if len(timings) != len(rows):
        return
    results = summarize_study(study, rows, timings)
    ours = {"schema": 1, "runs": [run_document(result, study, None) for result in results]}
    try:
        stored = json.loads(read_text(file))
    except (InputError, ValueError, RecursionError):
        stored = None
    if is_same_program(folder) and not is_like(stored, ours):
        yield f"{file.name} does not follow from the deliveries"


def _in_recordings(folder: Path, study: Study, rows: Iterable[Row]) -> Iterator[str]:
    """Recordings that are missing, of other deliveries, or of none."""
    template = study.template
    known: set[Path] = set()
    for row in rows:
        recording, decisions = recording_files(folder, row)
        known.add(leg_file(folder, row))
        for is_kept, file, check in (
            (template.keep_trace, recording, _is_recording_of),
            (template.keep_decisions, decisions, _are_decisions_of),
        ):
            known.add(file)
            if is_kept and not file.is_file():
                yield f"recordings/{file.name} is missing"
            elif is_kept and not check(file, row):
                yield f"recordings/{file.name} is of another delivery, or damaged"
    for file in sorted((folder / "recordings").glob("*")):
        if file not in known:
            yield f"recordings/{file.name} is of no delivery"


def _is_recording_of(file: Path, row: Row) -> bool:
    try:
        with np.load(file, allow_pickle=False) as arrays:
            first, last = arrays["trace"][0], arrays["trace"][-1]
    except BROKEN:
        return False
    start = math.hypot(first[1] - row["start_x_m"], first[2] - row["start_y_m"])
    return bool(last[0] == row["duration_s"] and start < SETTLED)


def _are_decisions_of(file: Path, row: Row) -> bool:
    names = ["stamp_s", "believed_x_m", "believed_y_m"]
    try:
        with opened_table(file) as table:
            if not set(names) <= set(table.schema_arrow.names):
                return False
            found = table.read(columns=names).to_pylist()
    except BROKEN:
        return False
    if not found:
        return True
    (_, x, y), last = found[0].values(), found[-1]["stamp_s"]
    start = math.hypot(x - row["start_x_m"], y - row["start_y_m"])
    return bool(last <= row["duration_s"] and start < ASTRAY)


def _in_missions(study: Study, rows: Iterable[Row]) -> Iterator[str]:
    """Rows of other missions than their numbers have."""
    tasks = {task.episode: task for task in study.tasks()}
    known: dict[int, dict[str, float]] = {}
    for row in rows:
        task = tasks.get(row["episode"])
        if task is None:
            continue
        if task.episode not in known:
            mission = _mission_of(task)
            known[task.episode] = {
                "start_x_m": mission.start.x,
                "start_y_m": mission.start.y,
                "start_yaw_rad": mission.start.yaw,
                "goal_x_m": mission.goal.x,
                "goal_y_m": mission.goal.y,
                "shortest_path_m": mission.shortest_path,
            }
        other = [name for name, value in known[task.episode].items() if row[name] != value]
        if other:
            yield f"{_name(row)} comes out otherwise: {', '.join(other)}"


def _mission_of(task: EpisodeTask) -> Mission:
    if is_district(task.map_name):
        return street_mission(legs_of(task))
    return Parts(task).mission(task.generators()["mission"])
