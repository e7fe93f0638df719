"""What there is to tell of one delivery: from its recording, or driven again."""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np

from harness.episode.episode import Delivery, run_episode
from harness.episode.factory import Parts
from harness.explain.brains import Watched, Weighed
from harness.metrics.columns import Row
from harness.metrics.decisions import CRITIC_COLUMNS, DECISION_COLUMNS
from harness.metrics.encounters import Body
from harness.metrics.replay_log import plans_of, tracks_of
from harness.storage.parameters import parameter_folder
from harness.storage.tables import names_of_columns, read_rows, write_table
from harness.storage.texts import quoted
from harness.study.manifest import load_study
from harness.study.stored_run import StoredRun
from harness.task.brain import Brain
from harness.task.stack import ROS2
from harness.task.study import EpisodeTask
from harness.world.map.scene import Scene
from harness.world.physics.robot import RobotParams
from harness.world.world import World
from harness.world.world_params import WorldParams
from navstack.errors import InputError
from navstack.navigator import Navigator
from navstack.params.strict import load_dataclass
from navstack.types import FloatArray

RECORDING, DRIVEN_AGAIN = "recording", "driven again"
WEIGHTED = "_weighted"  # end of the columns with a critic's share in the total


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """One delivery with everything that is known of it; arrays have a row per trace time."""

    row: Row  # of episodes.parquet
    events: tuple[Row, ...]  # of events.parquet, in order of time
    trace: FloatArray  # (T, 11) harness.metrics.replay_log.TRACE_COLUMNS
    crowd: FloatArray  # (T, n, 2) [m]
    pieces_lost: FloatArray  # (T,)
    # T arrays (k, 6): id, x, y [m], vx, vy [m/s], radius [m], map frame as believed
    tracks: tuple[FloatArray, ...]
    plans: tuple[tuple[float, FloatArray], ...]  # since when [s], and corners (N, 2) [m]
    decisions: tuple[Row, ...]  # of the table of decisions; none: nothing decides in this stack
    weighed: Weighed | None  # None: not recorded
    body: Body  # the robot as people meet it
    footprint: FloatArray  # (V, 2) [m], base frame
    source: str  # RECORDING or DRIVEN_AGAIN
    scene: Scene | None = None  # None: its map is not known, or has changed

    @property
    def stamps(self) -> FloatArray:
        """Of the trace (T,) [s]."""
        stamps: FloatArray = self.trace[:, 0]
        return stamps


def delivery_row(run: StoredRun, episode: int) -> Row:
    """The row of a delivery of a run with one stack.

    Raises:
        InputError: the run finished no such delivery.
    """
    stack = run.stacks[0]
    row = next((row for row in stack.rows if row["episode"] == episode), None)
    if row is None:
        raise InputError(
            f"{run.folder}: {stack.name} finished no episode {episode}; it has {len(stack.rows)} "
            "others"
        )
    return row


def events_of(run: StoredRun, episode: int) -> tuple[Row, ...]:
    """The events of a delivery of a run with one stack, in order of time."""
    name = run.stacks[0].name
    own = (event for event in run.events if (event["stack"], event["episode"]) == (name, episode))
    return tuple(sorted(own, key=lambda event: (event["stamp_s"] is None, event["stamp_s"])))


def recording_file(run: StoredRun, episode: int) -> Path:
    """Where the recording of a delivery of a run with one stack would be."""
    return run.folder / "recordings" / f"{run.stacks[0].name}-{episode}.npz"


def decisions_beside(recording: Path) -> Path:
    """Where the table of a recorded delivery's decisions would be."""
    return recording.with_name(f"{recording.stem}-decisions.parquet")


def read_decisions(path: Path) -> tuple[Row, ...]:
    """A recorded table of decisions.

    Raises:
        InputError: it cannot be read.
    """
    try:
        names = names_of_columns(path)
    except (OSError, ValueError) as error:
        raise InputError(
            f"{path}: is damaged ({error}); make the run again with --record full"
        ) from None
    critics = {
        name: CRITIC_COLUMNS[end]
        for name in names
        if (end := name.rpartition("_")[2]) in CRITIC_COLUMNS
    }
    return tuple(read_rows(path, critics | DECISION_COLUMNS))


def recorded(run: StoredRun, episode: int, arrays: Mapping[str, Any], recording: Path) -> Evidence:
    """The evidence of a recording, of which ``arrays`` are."""
    file = decisions_beside(recording)
    decisions: tuple[Row, ...] = ()
    if file.is_file():
        decisions = read_decisions(file)
    row, events = delivery_row(run, episode), events_of(run, episode)
    return evidence_of(run, row, events, arrays, decisions, None, RECORDING)


def require_one_map(run: StoredRun, what: str) -> None:
    """Check that a run's deliveries can be driven again and watched.

    Raises:
        InputError: they are missions on a district, of which only legs are known.
    """
    if run.has_legs:
        losses = f"navbench map losses {quoted(run.first_stack)}"
        raise InputError(
            f"{run.folder}: {what} is for deliveries on one map; navbench explain tells of a "
            f"district's legs, and {losses} draws what was lost"
        )


def task_of(run: StoredRun, episode: int) -> EpisodeTask:
    """A delivery to be driven again as its run folder describes it, with all recorded.

    Raises:
        InputError: the folder is none of this version, or its map has changed.
    """
    name = run.stacks[0].name
    tasks = load_study(run.folder, 1).tasks()
    task = next(
        (task for task in tasks if (task.stack.name, task.episode) == (name, episode)), None
    )
    if task is None:
        raise InputError(f"{run.folder}: the study has no episode {episode} of {name}")
    if task.stack.navigator == ROS2:
        raise InputError(
            f"{run.folder}: its deliveries were driven over ROS 2 and cannot be driven again; make "
            "the run with --record full"
        )
    return dataclasses.replace(task, keep_trace=True, keep_decisions=True)


def drive_again(run: StoredRun, episode: int) -> Evidence:
    """Drive a delivery anew, in memory, and check that it is the same.

    Raises:
        InputError: it comes out otherwise than its row says, or cannot be driven.
    """
    stored, task = delivery_row(run, episode), task_of(run, episode)
    watched: list[Watched] = []

    def make(parts: Parts, world: World) -> Brain:
        brain = parts.brain(world)
        if not isinstance(brain, Navigator):
            return brain
        watched.append(Watched(brain))
        return cast(Brain, watched[0])

    delivery = run_episode(task, make)
    check_same(stored, delivery.row, run.folder, episode)
    assert delivery.recording is not None
    weighed = {}
    if watched:
        weighed = watched[0].weighed
    recording, events = delivery.recording, events_of(run, episode)
    decisions = decisions_of(delivery)
    return evidence_of(run, stored, events, recording, decisions, weighed, DRIVEN_AGAIN)


def decisions_of(delivery: Delivery) -> tuple[Row, ...]:
    """The decisions of a delivery that recorded them, each with all columns."""
    assert delivery.decisions is not None
    columns, rows = delivery.decisions
    return tuple({**dict.fromkeys(columns), **row} for row in rows)


def record_again(run: StoredRun, episode: int, folder: Path, keep_decisions: bool = True) -> Path:
    """Drive a delivery anew and keep its recording, and its decisions beside it, in a folder.

    Args:
        run: with one stack.
        episode: number of the delivery.
        folder: for the files.
        keep_decisions: whether decisions are recorded, which takes longer than driving.

    Returns:
        The file of the recording.

    Raises:
        InputError: it comes out otherwise than its row says, or cannot be driven.
    """
    stored = delivery_row(run, episode)
    task = dataclasses.replace(task_of(run, episode), keep_decisions=keep_decisions)
    delivery = run_episode(task)
    check_same(stored, delivery.row, run.folder, episode)
    assert delivery.recording is not None
    path = folder / f"{run.stacks[0].name}-{episode}.npz"
    np.savez(path, **delivery.recording)
    if delivery.decisions is not None:
        write_table(decisions_beside(path), *delivery.decisions)
    return path


def check_same(stored: Row, driven: Row, folder: Path, episode: int) -> None:
    """Check that a delivery came out as its row says.

    Raises:
        InputError: it did not.
    """
    other = next((key for key, value in driven.items() if stored[key] != value), None)
    if other is not None:
        raise InputError(
            f"{folder}: episode {episode} comes out otherwise when it is driven again ({other} "
            f"{driven[other]}, stored "
            f"{stored[other]}): other libraries, or another kind of machine; explain it where it "
            "was driven"
        )


def evidence_of(
    run: StoredRun,
    row: Row,
    events: Sequence[Row],
    arrays: Mapping[str, Any],
    decisions: tuple[Row, ...],
    weighed: Weighed | None,
    source: str,
) -> Evidence:
    """The evidence of a delivery.

    Args:
        run: with one stack.
        row: of the delivery.
        events: of it, in order of time.
        arrays: its recording.
        decisions: of its table of decisions.
        weighed: what the brain chose from; None: not recorded.
        source: RECORDING or DRIVEN_AGAIN.
    """
    params = parameter_folder(run.folder)
    robot = load_dataclass(RobotParams, params / f"{run.stacks[0].name}-robot.yaml")
    people = load_dataclass(WorldParams, params / "world.yaml").people
    return Evidence(
        row=row,
        events=tuple(events),
        trace=np.asarray(arrays["trace"]),
        crowd=np.asarray(arrays["crowd"], dtype=np.float64),
        pieces_lost=np.asarray(arrays["pieces_lost"], dtype=np.float64),
        tracks=tuple(tracks_of(arrays)),
        plans=tuple(plans_of(arrays)),
        decisions=decisions,
        weighed=weighed,
        body=Body(robot.center, robot.half_size, people.radius),
        footprint=robot.polygon,
        source=source,
    )
