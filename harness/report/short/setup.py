"""What drove, where and among whom, by the names of the files that come with the program.

A run folder keeps the content of its parameter files. A name is found by comparing this content
with every shipped file, so that a changed copy is never called by the name of the original.
"""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from harness.analysis.unlike import different_values
from harness.economics.prices import Prices, load_prices
from harness.report.numbers import range_text
from harness.storage.manifest_file import extended_from, read_manifest
from harness.storage.parameters import parameter_folder
from harness.storage.shipped import DEFAULT_WORLD, names, resolve, shipped
from harness.study.stored_run import StoredRun, loaded
from harness.task.stack import load_stack
from harness.task.study import is_recording
from harness.world.outcome import Rules
from harness.world.physics.robot import RobotParams
from harness.world.sensors.suite import SensorParams
from harness.world.world_params import WorldParams
from navstack.errors import NavstackError
from navstack.params.strict import load_dataclass

# folder of params -> the file there with which the paper's rows belong
PUBLISHED = {
    "worlds": DEFAULT_WORLD,
    "rules": "costnav",
    "prices": "costnav",
    "sensors": "published",
    "robots": "segway_e1",
}
USUAL_SENSORS = "rtk_good"  # of the shipped stacks
FEW = 3  # differences that are named one by one
UNKNOWN = "unknown"  # file of another version of the program


def _loader(kind: Any) -> Callable[[Path], Any]:
    return lambda path: load_dataclass(kind, path)


LOADERS: Mapping[str, Callable[[Path], Any]] = {
    "worlds": _loader(WorldParams),
    "rules": _loader(Rules),
    "prices": lambda path: load_prices(str(path)),
    "sensors": _loader(SensorParams),
    "robots": _loader(RobotParams),
}


@dataclasses.dataclass(frozen=True, slots=True)
class Setting:
    """A parameter file of a run, by the shipped file that it is nearest to."""

    name: str
    differences: tuple[str, ...] = ()  # "key own (shipped)"

    def __str__(self) -> str:
        if not self.differences:
            return self.name
        if len(self.differences) > FEW:
            return f"{self.name} with {len(self.differences)} other values"
        return f"{self.name} with {', '.join(self.differences)}"


def _content(folder: str, path: Path) -> Mapping[str, Any]:
    return dataclasses.asdict(loaded(LOADERS[folder], path))


def nearest(folder: str, path: Path) -> Setting:
    """The shipped file that a run's own is, or has the fewest other values than.

    Args:
        folder: of ``params``, a key of :data:`LOADERS`.
        path: the run's own file.
    """
    published = PUBLISHED[folder]
    known = sorted(names(shipped("params") / folder), key=lambda name: (name != published, name))
    found: list[Setting] = []
    try:
        own = _content(folder, path)
        for name in known:
            theirs = _content(folder, resolve(name, shipped("params") / folder, folder))
            setting = Setting(name, tuple(different_values(own, theirs, "{a} ({b})")))
            if not setting.differences:
                return setting
            found.append(setting)
    except NavstackError:
        return Setting(UNKNOWN)
    return min(found, key=lambda each: len(each.differences))


def condition(run: StoredRun, folder: str) -> Setting:
    """World, rules or prices of a run; of a world without how many people walk how."""
    name = {"worlds": "world"}.get(folder, folder)
    setting = nearest(folder, parameter_folder(run.folder) / f"{name}.yaml")
    if folder != "worlds":
        return setting
    told = ("people.count ", "people.model ", "people.replay")
    kept = (each for each in setting.differences if not each.startswith(told))
    return Setting(setting.name, tuple(kept))


def people_of(run: StoredRun) -> str:
    """How many walk by which model, or which recording of them is replayed."""
    world = run.condition("world")
    people = world.get("people") if isinstance(world, Mapping) else None
    if not isinstance(people, Mapping):
        people = {}
    if people.get("model") != "replay":
        return f"{people.get('count', '?')} ({people.get('model', '?')})"
    replay, name = people.get("replay"), run.about.get("people")
    # a world's own recording is in the run folder under another name
    if not (isinstance(name, str) and is_recording(name)):
        name = replay.get("file") if isinstance(replay, Mapping) else None
    return f"replayed from {Path(str(name)).name}"


@dataclasses.dataclass(frozen=True, slots=True)
class Driver:
    """A stack with what it drives."""

    name: str
    file: str  # its Nav2 file; empty: none
    robot: str
    localizer: str
    sensors: str

    @property
    def title(self) -> str:
        """Its name, and the file where that is called otherwise."""
        if self.file and Path(self.file).stem != self.name:
            return f"{self.name} ({self.file})"
        return self.file or self.name


def drivers_of(run: StoredRun) -> list[Driver]:
    """The stacks of a run."""
    parameters = parameter_folder(run.folder)
    stored = {
        str(stack.get("name")): stack
        for stack in read_manifest(run.folder).get("stacks", ())
        if isinstance(stack, Mapping)
    }
    return [
        Driver(
            stack.name,
            _file_of(stack.name, str(stored.get(stack.name, {}).get("title", ""))),
            _robot(parameters / f"{stack.name}-robot.yaml"),
            stack.localizer,
            str(nearest("sensors", parameters / f"{stack.name}-sensors.yaml")),
        )
        for stack in run.stacks
    ]


def _robot(path: Path) -> str:
    """A robot's name, or its size and mass where it is like none that comes with the program."""
    found = nearest("robots", path)
    if len(found.differences) <= FEW:
        return str(found)
    body = load_dataclass(RobotParams, path)
    length, width = (2.0 * half for half in body.half_size)
    return f"of {length:.2f} m x {width:.2f} m and {body.mass:.1f} kg"


def _file_of(name: str, title: str) -> str:
    """Of a user's file its name, of a shipped stack that of its Nav2 file."""
    if title.startswith("Nav2 file "):
        return title.removeprefix("Nav2 file ")
    if name in names(shipped("params") / "stacks"):
        stack = load_stack(name)
        if stack.title == title:
            return Path(stack.nav2_file).name
    return ""


def setup_line(run: StoredRun) -> str:
    """What drove, with which localizer and sensors, where and among whom: one line."""
    drivers = drivers_of(run)
    shared = {
        key: {getattr(driver, key) for driver in drivers}
        for key in ("robot", "localizer", "sensors")
    }
    common = []
    for key, values in shared.items():
        if len(values) == 1:
            common.append(f"{key} {values.pop()}")
            if common[-1] == f"sensors {USUAL_SENSORS}":
                common[-1] += " (paper: without error)"
    each = []
    for driver in drivers:
        own = [getattr(driver, key) for key, values in shared.items() if values]
        each.append(" ".join((driver.title, *(f"[{', '.join(own)}]" for _ in own[:1]))))
    return f"{', '.join([_listed(each), *common])}; {where_line(run)}"


def delivery_line(run: StoredRun, episode: int) -> str:
    """What drove a delivery, and where: one line.

    Args:
        run: with one stack.
        episode: number of the delivery.
    """
    return f"{setup_line(run)}; episode {episode}"


def where_line(run: StoredRun) -> str:
    """World, map and people of a run, and how many deliveries each stack drove."""
    count = range_text([len(stack.rows) for stack in run.stacks] or [0])
    if seen := extended_from(run.folder):
        count += f" (first looked at with {', '.join(map(str, seen))})"
    world = f"world {condition(run, 'worlds')}, map {run.map_name}, people {people_of(run)}"
    return f"{world}; n = {count}, seed {run.seed}"


def _listed(titles: Sequence[str], most: int = 4) -> str:
    if len(titles) > most:
        return f"{len(titles)} stacks"
    *others, last = titles
    return " and ".join([", ".join(others), last] if others else [last])


def unlike_published(run: StoredRun) -> dict[str, str]:
    """What differs from the setting of the paper's rows, by what it is; empty: nothing.

    The map is another one in every run: the paper's is not shipped.
    """
    unlike = {}
    for folder, what in (("worlds", "world"), ("rules", "rules"), ("prices", "prices")):
        setting = condition(run, folder)
        if setting != Setting(PUBLISHED[folder]):
            unlike[what] = str(setting)
    drivers = drivers_of(run)
    for folder, what in (("robots", "robot"), ("sensors", "sensors")):
        others = {getattr(driver, what) for driver in drivers} - {PUBLISHED[folder]}
        if others:
            unlike[what] = ", ".join(sorted(others))
    missions = run.about.get("missions", "published")
    if missions != "published":
        unlike["missions"] = str(missions)
    if run.about.get("distance") is not None:
        least, most = run.about["distance"]
        unlike["distance"] = f"{least:g} to {most:g} km"
    return unlike


def unlike_line(unlike: Mapping[str, str]) -> str:
    """What :func:`unlike_published` found, in one line; empty: nothing."""
    if not unlike:
        return ""
    differences = "; ".join(f"{what} {value}" for what, value in unlike.items())
    return f"not as in the paper: {differences}"


def robot_price_line(run: StoredRun, prices: Prices) -> str:
    """What break-even pays for, where another robot than the paper's drives; empty: none does."""
    if {driver.robot for driver in drivers_of(run)} <= {PUBLISHED["robots"], UNKNOWN}:
        return ""
    cost = prices.robot_cost
    told = f"a robot of {cost.value:,.0f} USD ({cost.source})"
    return f"break-even pays for {told}, whichever robot drives"
