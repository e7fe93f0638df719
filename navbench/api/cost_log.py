"""What a recorded drive cost."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from harness.economics.prices import load_prices
from harness.episode.episode import run_episode
from harness.execution.process_cache import forget_changed
from harness.identify.drive_cost import DriveCost, cost_of_drive
from harness.identify.drive_difference import KINDS, differences, kilometres
from harness.identify.drive_events import doubt_of_map
from harness.identify.robot_file import sensors_beside
from harness.identify.twin import Place, Twin, mission_of, real_drive, simulated_drive
from harness.recorded.drive_log import DriveLog
from harness.recorded.log import LogRequest, read_log
from harness.report.page.log_page import log_page, require_shown
from harness.report.priced_log import priced_log_blocks
from harness.storage.files import require_writable, write_text, writing
from harness.storage.shipped import DEFAULT_WORLD, resolve, shipped
from harness.study.preflight import check
from harness.task.study import make_study
from harness.world.map.scene_io import load_scene
from harness.world.outcome import ARRIVALS, Rules
from harness.world.physics.robot import RobotParams
from harness.world.sensors.suite import SensorParams
from harness.world.world_params import WorldParams
from navbench.api.progress import count_shown, say
from navbench.api.report import PAGES, today
from navstack.errors import InputError
from navstack.params.extensions import uses_map
from navstack.params.nav2_file.file import load_nav2
from navstack.params.strict import load_dataclass

DRIVES = 5  # of the log's mission, which differ in the sensors' noise


@dataclass(frozen=True, slots=True)
class PricedLog:
    """A recorded drive with its events and dollars."""

    log: DriveLog
    cost: DriveCost
    prices: str
    map_name: str
    twin: Twin | None = None  # None: not asked for

    def as_json(self) -> dict[str, Any]:
        """As ``navbench cost-log --json`` prints it."""
        cost = self.cost
        driven = kilometres(cost)
        counts = {kind: cost.count(kind) for kind in KINDS}
        return {
            "schema": 1,
            "bag": self.log.files,
            "map": self.map_name,
            "prices": self.prices,
            "duration_s": cost.duration,
            "distance_m": cost.distance,
            "energy_kwh": cost.energy,
            "spilled_share": cost.spilled,
            "events": [event.as_json() for event in cost.events],
            "counts": counts,
            "per_km": {kind: count / driven for kind, count in counts.items()},
            "contact_threshold_ns": cost.threshold,
            "false_alarms_per_h": cost.false_alarms,
            "contacts_from": cost.source,
            "costs_usd": dict(cost.terms),
            "total_usd": cost.total,
            "total_usd_per_km": cost.total / driven,
            "simulator": self.twin and self.twin.as_json(),
        }


def comparison_json(drive: PricedLog, other: PricedLog) -> dict[str, Any]:
    """As ``navbench cost-log --against --json`` prints it: the drive, the other, differences."""
    found = differences(drive.cost, other.cost)
    more = {key: each.as_json() for key, each in found.items()}
    return drive.as_json() | {"against": other.as_json(), "differences": more}


def cost_log(
    request: LogRequest,
    robot: str,
    map: str,  # noqa: A002 - as the option is called
    *,
    prices: str = "costnav",
    world: str = DEFAULT_WORLD,
    nav2: Path | None = None,
    sensors: str | None = None,
    html: Path | None = None,
) -> PricedLog:
    """Find what happened on a recorded drive, and price it.

    Args:
        request: bags, remappings and frames.
        robot: that drove: a name of params/robots or a file, as ``navbench identify`` writes it.
        map: a built-in map or a map_server YAML file, in whose frame the log's poses are.
        prices: a name of params/prices or a file.
        world: a name of params/worlds or a file: the cargo, and the contacts that count.
        nav2: the Nav2 parameter file by which the log's mission is driven again in the world, with
            nobody about; None: it is not.
        sensors: of these drives: a name of params/sensors or a file; None: the file that
            ``navbench identify`` wrote beside the robot's, else as of a run.
        html: a page with all this and a replay of the drive; None: none.

    Raises:
        InputError: something given cannot be used.
    """
    forget_changed()
    if html is not None:
        require_writable("page", html, PAGES)
    if sensors is not None and nav2 is None:
        raise InputError(
            f"--sensors {sensors} is of the drives by --nav2 FILE, which is not given; give both, "
            "or neither"
        )
    params = shipped("params")
    body = load_dataclass(RobotParams, resolve(robot, params / "robots", "robot"))
    rules = load_dataclass(WorldParams, resolve(world, params / "worlds", "world"))
    paid_by = load_prices(prices)
    scene = load_scene(map)
    if nav2 is not None:
        # refused before the log is read, which takes longer
        load_nav2(nav2, allow_unknown=True)
    log = read_log(request, lambda text: say(f"note: {text}"))
    if doubt := doubt_of_map(log, scene):
        say(f"note: {doubt}")
    if html is not None:
        require_shown(log)
    mission = nav2 and mission_of(log)  # refused before the fit of events, which takes longer
    cost = cost_of_drive(log, body, scene, rules, paid_by)
    twin = None
    if nav2 is not None and mission:
        twin = _twin(log, mission, nav2, sensors or _beside(robot), robot, map)
    if html is not None:
        blocks = priced_log_blocks(log, cost, twin, prices, True)
        radius = rules.people.radius
        page = log_page(blocks, log, cost, scene, body, radius, today())
        with writing(html):
            write_text(html, page)
    return PricedLog(log, cost, prices, map, twin)


def _beside(robot: str) -> str | None:
    """The sensors file that ``navbench identify`` writes beside a robot file."""
    sensors = sensors_beside(Path(robot))
    return str(sensors) if sensors.is_file() else None


def _twin(
    log: DriveLog,
    mission: tuple[Place, Place],
    nav2: Path,
    sensors: str | None,
    robot: str,
    map_name: str,
) -> Twin:
    """The log's mission, driven in the world."""
    start, goal = mission
    study = make_study(
        stacks=[str(nav2)],
        episodes=DRIVES,
        map_name=map_name,
        pedestrians=0,
        robot=robot,
        sensors=sensors,
        start=start,
        goal=goal,
        workers=1,
        record="full",
    )
    for note in check(study):
        say(f"note: {note}")
    way = math.hypot(goal[0] - start[0], goal[1] - start[1])
    say(
        f"driving the log's mission, {way:.0f} m in {log.duration:.0f} s, {DRIVES} times in the "
        f"world by '{nav2}'"
    )
    rules = load_dataclass(Rules, Path(study.template.rules))
    stack, noise = study.template.stack, None
    if uses_map(stack.localizer):
        noise = load_dataclass(SensorParams, Path(stack.sensors)).gps.position_std
    real = real_drive(log, goal, rules.arrival_radius, noise)
    drives, arrived = [], 0
    with count_shown("drives", DRIVES) as tell:
        for task in study.tasks():
            delivery = run_episode(task)
            if delivery.row["stack_error"] is not None:
                raise InputError(f"the Nav2 file '{nav2}' fails: {delivery.row['stack_error']}")
            assert delivery.recording is not None  # the study asks for it
            trace = np.asarray(delivery.recording["trace"], dtype=np.float64)
            drives.append(simulated_drive(trace))
            arrived += delivery.row["outcome"] in {outcome.value for outcome in ARRIVALS}
            tell()
    return Twin(start, goal, real, tuple(drives), arrived)
