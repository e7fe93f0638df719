"""The functions of ``import navbench``.

What the commands do, with tables and numbers in place of printed text.
"""

import dataclasses
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pyarrow as pa
import pyarrow.parquet as pq

from harness.analysis.compare import Comparison, side_of
from harness.analysis.compare import compare as compare_sides
from harness.analysis.repricing import Repriced, choose, reprice
from harness.economics.valuation import Valuation, value
from harness.execution.arithmetic import warn_of_other_arithmetic
from harness.plan.question import Answer
from harness.statistics.interval import Interval
from harness.storage.shipped import DEFAULT_WORLD
from harness.study.stored_run import StoredRun, load_run
from navstack.errors import InputError

if TYPE_CHECKING:
    from harness.episode.episode import RunningDelivery

warn_of_other_arithmetic()

TABLES = ("episodes", "events", "timings")


@dataclasses.dataclass(frozen=True)
class Run:
    """A run folder: one or several stacks on the same deliveries."""

    stored: StoredRun

    @property
    def folder(self) -> Path:
        """Where it is."""
        return self.stored.folder

    @property
    def stacks(self) -> tuple[str, ...]:
        """The names of its stacks."""
        return tuple(stack.name for stack in self.stored.stacks)

    def __getitem__(self, stack: str) -> "Run":
        """The same run with one of its stacks.

        Raises:
            UnknownNameError: it has no such stack.
        """
        return Run(self.stored.only(stack))

    def table(self, name: str = "episodes") -> pa.Table:
        """A table as Arrow has it.

        ``.to_pandas()`` makes a data frame of it where pandas is installed.

        Args:
            name: ``episodes``, a row per delivery; ``events``, a row per contact; ``timings``, wall
                times.

        Raises:
            InputError: there is no such table.
        """
        if name not in TABLES:
            raise InputError(f"unknown table '{name}'; known: {', '.join(TABLES)}")
        table = pq.read_table(self.folder / f"{name}.parquet")
        is_own = [stack in self.stacks for stack in table["stack"].to_pylist()]
        return table.filter(pa.array(is_own, pa.bool_()))

    @property
    def valuations(self) -> dict[str, Valuation]:
        """What the deliveries of each stack come to.

        Stacks without a finished delivery are left out.
        """
        prices, seed = self.stored.prices(), self.stored.seed
        return {
            stack.name: value(stack.rows, stack, prices, seed)
            for stack in self.stored.stacks
            if stack.rows
        }

    @property
    def margins(self) -> dict[str, Interval]:
        """The contribution margin [USD/run] of each stack.

        Those whose cargo is not modelled are left out.
        """
        found = {
            stack: each.intervals.get("contribution_margin")
            for stack, each in self.valuations.items()
        }
        return {stack: margin for stack, margin in found.items() if margin is not None}


def run(
    stack: str | Sequence[str] = "nav2-gps",
    episodes: int = 20,
    *,
    seed: int = 0,
    map: str = "sidewalk",  # noqa: A002 - as the option is called
    world: str = DEFAULT_WORLD,
    out: str | Path | None = None,
    workers: int | None = None,
    **options: Any,
) -> Run:
    """Drive deliveries, as ``navbench run`` does; progress goes to standard error.

    Args:
        stack: a name of params/stacks, a stack file or a Nav2 parameter file; several drive the
            same deliveries.
        episodes: deliveries per stack.
        seed: same seed, same deliveries.
        map: a built-in map or a map_server YAML file.
        world: a name of params/worlds or a YAML file.
        out: run folder; None: ``results/<time>-<stack>``.
        workers: processes; None: one per core.
        options: the other options of the command, such as ``pedestrians``, ``people``,
            ``localizer``, ``sensors``, ``robot``, ``prices``, ``rules``, ``missions``, ``start``,
            ``goal``, ``record``, ``substitutes``.

    Raises:
        InputError: something that was given cannot be used.
        KeyboardInterrupt: interrupted; what is finished is kept in the folder.
    """
    from harness.storage.shipped import keep_compiled_code
    from harness.study.manifest import load_study
    from harness.study.places import Where
    from harness.task.study import make_study
    from navbench.cli.driving import drive_folder, make_folder

    keep_compiled_code()
    stacks = [stack] if isinstance(stack, str) else list(stack)
    choices = {"seed": seed, "map_name": map, "world": world, "workers": workers, **options}
    study = make_study(stacks=stacks, episodes=episodes, **choices)
    path = make_folder(study, None if out is None else Path(out))
    _, is_interrupted = drive_folder(load_study(path, study.workers), path, Where(workers=workers))
    if is_interrupted:
        raise KeyboardInterrupt
    return load(path)


def load(folder: str | Path) -> Run:
    """A finished run by its folder, or one stack of it as ``FOLDER:stack``.

    Raises:
        InputError: it holds no run that can be read.
    """
    return Run(load_run(str(folder)))


def compare(first: Run, second: Run, metrics: Collection[str] = ()) -> Comparison:
    """Two runs of one stack each, mission by mission: second minus first.

    Args:
        first: the one that is there.
        second: the one that is held against it.
        metrics: keys such as ``margin`` and ``sla``; none: all.

    Raises:
        InputError: several stacks in one, no mission in common, or an unknown metric.
    """
    return compare_sides(side_of(first.stored), side_of(second.stored), metrics)


def price(
    run: Run,
    prices: str | None = None,
    settings: Mapping[str, float] | None = None,
    terms: Sequence[str] = (),
) -> dict[str, Repriced]:
    """A run at other prices, without driving again; by stack.

    Args:
        run: the run.
        prices: a name of params/prices or a file; None: the run's own.
        settings: other values of single prices, such as ``{"delivery_fee": 4.99}``.
        terms: costs that the paper leaves out, such as ``operator``.

    Raises:
        InputError: a price file, setting or term that cannot be used.
    """
    texts = [f"{key}={number}" for key, number in (settings or {}).items()]
    return {
        each.stack.name: each
        for each in reprice(run.stored, choose(run.stored, prices, texts, terms))
    }


def plan(
    map: str = "sidewalk",  # noqa: A002 - as the option is called
    planners: Sequence[str] = ("NavFn", "SmacHybrid", "BITstar"),
    *,
    start: Sequence[float] | None = None,
    goal: Sequence[float] | None = None,
    seed: int = 0,
    params: str | None = None,
) -> dict[str, Answer]:
    """Ask planners for a path; by planner.

    Args:
        map: a built-in map or a map_server YAML file.
        planners: their names, as in docs/planning.md.
        start: x [m], y [m], yaw [rad]; None: drawn.
        goal: likewise.
        seed: of what is drawn.
        params: a Nav2 parameter file, or a name of params/nav2; None: the tuned one.

    Raises:
        InputError: an unknown name, or a pose that cannot be used.
    """
    from harness.plan.question import ask_all, task_of

    begin, end = (
        None if pose is None else ",".join(str(float(number)) for number in pose)
        for pose in (start, goal)
    )
    _, _, answers = ask_all(task_of(map, begin, end, seed, params), planners)
    return {answer.planner: answer for answer in answers}


def make_world(
    stack: str = "nav2-gps",
    *,
    seed: int = 0,
    episode: int = 0,
    map: str = "sidewalk",  # noqa: A002 - as the option is called
    world: str = DEFAULT_WORLD,
    **options: Any,
) -> "RunningDelivery":
    """A delivery that is stepped by hand.

    Look at ``observation`` and ``truth``, call ``drive``, until ``verdict``.

    Args:
        stack: whose robot and sensors drive; its navigator is there as ``brain``, and need not be
            asked.
        seed: of the deliveries.
        episode: the delivery's number, as in a run.
        map: a built-in map or a map_server YAML file.
        world: a name of params/worlds or a YAML file.
        options: as of :func:`run`.

    Raises:
        InputError: something that was given cannot be used.
    """
    from harness.episode.episode import RunningDelivery
    from harness.episode.factory import Parts
    from harness.task.study import make_study

    study = make_study(
        stacks=[stack], episodes=1, seed=seed, map_name=map, world=world, workers=1, **options
    )
    task = dataclasses.replace(study.template, episode=episode)
    return RunningDelivery(task, world=Parts(task).new_world())
