"""The recorded deliveries of a page: which ones it carries, and what belongs to each."""

import dataclasses
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from harness.analysis.compare import side_of
from harness.analysis.dearest import earned_of
from harness.economics.cost_terms import COST_LABELS
from harness.report.page.deliveries import contacts, money_of, recording_of, rounded, trajectory
from harness.report.page.entries import PageEntry, entries_of
from harness.report.page.origin import shifted
from harness.report.page.recording_code import COARSE, Fineness, encode, load_recording
from harness.report.page.scenery import known_scene
from harness.report.replay import RecordedReplay, contacts_shown
from harness.storage.parameters import parameter_folder
from harness.storage.shipped import shipped
from harness.study.stored_run import StoredRun, loaded
from harness.world.outcome import Rules
from harness.world.physics.robot import RobotParams
from harness.world.world_params import WorldParams
from navstack.errors import InputError
from navstack.params.strict import load_dataclass

Json = dict[str, Any]

_load_robot = partial(load_dataclass, RobotParams)
_load_world = partial(load_dataclass, WorldParams)


@dataclasses.dataclass(frozen=True, slots=True)
class Recorded:
    """One delivery that has a recording."""

    number: int  # of its entry on the page
    entry: PageEntry
    index: int  # of its row among the entry's
    path: Path
    earned: float  # [USD] by which it is ranked; see :func:`earned_of`
    is_again: bool = False  # driven again for this page, as one of the dearest

    @property
    def row(self) -> Json:
        """Of ``episodes.parquet``."""
        return self.entry.stack.rows[self.index]


def has_dearest(recorded: Sequence[Recorded], entries: Sequence[PageEntry], number: int) -> bool:
    """Whether the dearest so many deliveries of all are among those that are recorded."""
    of_all = sorted(usd for entry in entries for usd in earned_of(entry.stack.rows, entry.margin))
    of_recorded = sorted(each.earned for each in recorded)
    return of_recorded[:number] == of_all[: min(number, len(of_recorded))]


# recordings of deliveries that were driven again: folder of the run, stack, episode -> file
Again = Mapping[tuple[Path, str, int], Path]


def recorded_of(entries: Sequence[PageEntry], again: Again | None = None) -> list[Recorded]:
    """Every delivery that has a recording, or was driven again."""
    found = []
    for number, entry in enumerate(entries):
        folder, name = entry.run.folder, entry.stack.name
        if Path(name).name != name:
            continue
        earned = earned_of(entry.stack.rows, entry.margin)
        for index, row in enumerate(entry.stack.rows):
            driven = (again or {}).get((folder, name, row["episode"]))
            path = driven or recording_of(entry, row["episode"])
            if path.is_file():
                found.append(
                    Recorded(number, entry, index, path, earned[index], driven is not None)
                )
    return found


def chosen(recorded: Sequence[Recorded], most: int) -> list[Recorded]:
    """At most that many of them, in the page's order.

    First those that were driven again for it; then stacks take turns, each with its costliest.
    """
    turns: Counter[int] = Counter()  # of each stack so far
    queue: list[tuple[bool, int, Recorded]] = []
    for each in sorted(recorded, key=lambda each: (each.earned, each.row["episode"])):
        queue.append((not each.is_again, turns[each.number], each))
        turns[each.number] += 1
    queue.sort(key=lambda waiting: waiting[:2])  # of one turn the costliest first
    taken = [each for _, _, each in queue[:most]]
    return sorted(taken, key=lambda each: (each.number, each.index))


def replay(recorded: Recorded, fineness: Fineness = COARSE) -> Json:
    """What the page needs to show a delivery.

    Its facts, contacts, costs, their reasons, and the recording itself.
    """
    entry, row, arrays = recorded.entry, recorded.row, load_recording(recorded.path)
    robot, radius = bodies(entry)
    return {
        "entry": recorded.number,
        "episode": row["episode"],
        "map": entry.map_label,
        "outcome": row["outcome"],
        "earned": rounded(recorded.earned, 4),
        "duration": rounded(row["duration_s"]),
        "start": [row["start_x_m"] - entry.origin[0], row["start_y_m"] - entry.origin[1]],
        "goal": [row["goal_x_m"] - entry.origin[0], row["goal_y_m"] - entry.origin[1]],
        "pieces": row["pieces_at_start"],
        "footprint": robot.polygon.tolist(),
        "personRadius": radius,
        "contacts": contacts(entry.events[row["episode"]], entry.origin),
        "money": {
            term: rounded(money_of(entry, term)[recorded.index], 4)
            for term in ("revenue", "opex", "contribution_margin", *COST_LABELS)
        },
        "reasons": _reasons(recorded, arrays),
        "history": row.get("navigator_history") or "",
        "data": encode(shifted(arrays, entry.origin), fineness),
    }


def _reasons(delivery: Recorded, arrays: Mapping[str, Any]) -> list[Json]:
    """Each event of a delivery that cost something, in the words of ``navbench explain``.

    When [s], cost [USD], words.

    Args:
        delivery: that was recorded.
        arrays: its recording.

    Returns:
        Times rounded as those of contacts. Nothing where no event cost anything.
    """
    # what explains can also drive a delivery again: simulator and brain are imported only where
    # there is a recording
    from harness.explain.document import explained
    from harness.explain.evidence import decisions_beside, events_of, recorded
    from harness.explain.moments import is_costly, moments_of
    from harness.explain.seconds import seconds_before

    entry, row = delivery.entry, delivery.row
    run, episode = dataclasses.replace(entry.run, stacks=(entry.stack,)), row["episode"]
    needed = (
        decisions_beside(delivery.path),
        parameter_folder(run.folder) / f"{entry.stack.name}-robot.yaml",
    )
    if not is_costly(row, events_of(run, episode)) or not all(file.is_file() for file in needed):
        return []
    try:
        evidence = recorded(run, episode, arrays, delivery.path)
        evidence = dataclasses.replace(evidence, scene=known_scene(run))
        moments = moments_of(
            evidence,
            load_dataclass(Rules, parameter_folder(run.folder) / "rules.yaml"),
            entry.prices,
        )
        told = explained(evidence, [seconds_before(evidence, moment) for moment in moments])
    # a damaged table of decisions, or a delivery that was over at once: the replay stands without
    except InputError:
        return []
    return [
        {"time": rounded(moment.stamp, 2), "cost": moment.cost, "words": each.words}
        for moment, each in zip(moments, told, strict=True)
    ]


def one_recorded(run: StoredRun, episode: int, path: Path) -> Recorded:
    """A delivery of a run with one stack, with its recording.

    Raises:
        InputError: the run has several stacks, or no such delivery.
    """
    stack = side_of(run).stack.name
    entry = entries_of([run])[0]
    for index, row in enumerate(entry.stack.rows):
        if row["episode"] == episode:
            earned = earned_of(entry.stack.rows, entry.margin)[index]
            return Recorded(0, entry, index, path, earned)
    raise InputError(
        f"{run.folder}: {stack} finished no episode {episode}; "
        f"it has {len(entry.stack.rows)} others"
    )


def shown(recorded: Recorded) -> RecordedReplay:
    """The delivery for all but a page.

    Raises:
        InputError: its recording is damaged.
    """
    entry, row = recorded.entry, recorded.row
    robot, radius = bodies(entry)
    contacts = contacts_shown(entry.events[row["episode"]])
    return RecordedReplay(load_recording(recorded.path), contacts, robot.polygon, radius)


def bodies(entry: PageEntry) -> tuple[RobotParams, float]:
    """The robot, and the radius of people [m], as the run has them."""
    own = parameter_folder(entry.run.folder) / f"{entry.stack.name}-robot.yaml"
    robot = loaded(
        _load_robot, own if own.is_file() else shipped("params") / "robots" / "segway_e1.yaml"
    )
    world = loaded(_load_world, parameter_folder(entry.run.folder) / "world.yaml")
    return robot, world.people.radius


def trajectories(recorded: Sequence[Recorded]) -> tuple[list[Recorded], list[list[Any]], list[str]]:
    """Readable recordings, the trajectory of each, and why the others cannot be read.

    One recording is in memory at a time: together they may have gigabytes.
    """
    readable, ways, troubles = [], [], []
    for each in recorded:
        try:
            trace = load_recording(each.path)["trace"]
        except InputError as error:
            troubles.append(str(error))
            continue
        readable.append(each)
        ways.append([each.number, each.row["episode"], trajectory(trace, each.entry.origin)])
    return readable, ways, troubles
