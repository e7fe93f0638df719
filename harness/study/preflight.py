"""What is looked at before a study begins: bad input, and what the user should know."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import shapely

from harness.episode.factory import Parts
from harness.episode.files import rules_of
from harness.episode.places import legs_of, way_there
from harness.policy.brain import PolicyBrain
from harness.policy.interface import PolicyError
from harness.storage.shipped import is_district, shipped
from harness.storage.texts import quoted
from harness.study.compile_ahead import compile_ahead
from harness.task.made_files import is_made
from harness.task.mission import CLEARANCE
from harness.task.stack import GEOMETRY, MESH, NO_MAP, ROS2, Stack
from harness.task.study import RECORDS, Study
from harness.world.map.scene import Scene
from harness.world.people.params import AREA_PER_PERSON
from harness.world.physics.robot import RobotParams
from harness.world.sensors import glass, sky
from harness.world.sensors.suite import SensorParams
from navstack.costmap.occupancy_grid import FREE
from navstack.errors import InputError
from navstack.geometry import footprint_radii
from navstack.lint import require_usable
from navstack.params.costmap import robot_footprint
from navstack.params.nav2_file.file import Nav2File
from navstack.params.nav2_file.filters import keepout_filters_without_mask
from navstack.params.nav2_file.findings import IGNORED_BY_NAV2, UNKNOWN_KEY
from navstack.params.nav2_file.views import read_costmap
from navstack.params.strict import load_dataclass

CROWDED = 5.0  # times that density from which it is told
# why a planning map brings no mask
_WITHOUT_MASK = {
    GEOMETRY: "the map has no _walkable map beside it",
    MESH: "the mesh is walkable ground",
    NO_MAP: "there is no map",
}
MOST_MISSPELT = 3  # names told in a note; lint tells all
# [m] by which the simulated robot may reach beyond a Nav2 file's unmentioned
BODY_TOLERANCE = 0.05


def check(study: Study) -> list[str]:
    """Set up the first delivery of every stack, so that bad input is found before anything runs.

    Returns notes.

    Raises:
        InputError: something that the user gave cannot be used.
    """
    notes = [f"{stack.name} {stack.body}" for stack in study.stacks if stack.body]
    deliveries = [_first_delivery(study, number) for number in range(len(study.stacks))]
    compile_ahead(study.stacks)  # bad input is one line, at once; what follows takes most kernels
    if study.template.start is None:
        notes += start_notes(study.stacks, [parts.robot for parts in deliveries])
    for stack, parts in zip(study.stacks, deliveries, strict=True):
        _try_out(parts)
        if parts is deliveries[0]:
            notes += crowd_notes(study, parts) + leg_notes(study)
        notes += sensor_notes(stack, parts.scene) + lidar_notes(stack, parts.robot)
        if stack.is_nav2:
            nav2 = parts.nav2
            notes += notes_on_file(nav2, stack.name)
            notes += filter_notes(nav2, stack, parts.scene)
            if not stack.body:
                notes += footprint_notes(nav2, parts.robot, stack.name)
    return notes


def _try_out(parts: Parts) -> None:
    """Make what drives.

    Raises:
        InputError: it cannot be made, or is a policy that cannot be loaded.
    """
    try:
        brain = parts.brain(parts.world())
    except PolicyError as error:
        raise InputError(str(error)) from None
    if isinstance(brain, PolicyBrain):
        brain.let_go()


def _first_delivery(study: Study, number: int) -> Parts:
    """The parts of a stack's first delivery, whose file and mission can be used.

    Raises:
        InputError: they cannot.
    """
    stack = study.stacks[number]
    task = dataclasses.replace(study.template, stack=stack, stack_number=number)
    if stack.navigator == ROS2 and study.workers > 1:
        raise InputError(
            f"stack '{stack.name}' drives over ROS 2, in one world at a time; --workers "
            f"{study.workers} is given, give --workers 1"
        )
    if stack.is_nav2:
        require_usable(Path(stack.nav2_file), task.allow_unknown)
    parts = Parts(task)
    parts.mission(task.generators()["mission"])
    return parts


def crowd_notes(study: Study, parts: Parts) -> list[str]:
    """A note where the world's number of people, meant for part of a town, crowds a small map."""
    people, mesh = parts.params.people, parts.scene.navigation_mesh
    area = float((mesh.data == FREE).sum()) * mesh.resolution**2
    if (
        study.template.pedestrians is not None
        or people.model == "replay"
        or not people.count
        or not area
    ):
        return []
    times = AREA_PER_PERSON * people.count / area
    if times < CROWDED:
        return []
    return [
        f"on this map {people.count} people share {area:,.0f} m2, "
        f"{times:.0f} times as densely as on the shipped ones; "
        f"--pedestrians {max(1, round(area / AREA_PER_PERSON))} would be theirs"
    ]


def leg_notes(study: Study) -> list[str]:
    """A note of what a delivery is on a district.

    Raises:
        InputError: it is to be recorded; or a map has no way back.
    """
    template = study.template
    peers = [stack.name for stack in study.stacks if stack.navigator == ROS2]
    if peers and is_district(template.map_name):
        raise InputError(
            f"stack '{peers[0]}' drives over ROS 2, on one map; give one of the district "
            f"'{template.map_name}', NAME.yaml"
        )
    if not is_district(template.map_name):
        if rules_of(template.rules).way_back:
            raise InputError(
                f"rules '{template.rules}' have a way_back, which a map has not; give other "
                "--rules, or a folder of navbench map osm"
            )
        return []
    if template.keep_trace or template.keep_decisions:
        raise InputError(
            f"--record {RECORDS[1]} and {RECORDS[2]} are for one map; on the district "
            f"'{template.map_name}' leave it out, or give one of its maps"
        )
    legs = legs_of(dataclasses.replace(template, episode=study.numbers[0]))
    there = way_there(legs)
    note = (
        f"a delivery is a whole mission here, in legs of about 100 m; "
        f"the first has {len(there)} legs and {there[0].way:.0f} m"
    )
    if len(there) < len(legs):
        note += ", and as many back"
    return [note]


def start_notes(stacks: Sequence[Stack], robots: Sequence[RobotParams]) -> list[str]:
    """A note where a robot reaches farther than missions are drawn from what is solid."""
    reaches = {
        stack.name: float(np.hypot(*robot.polygon.T).max())
        for stack, robot in zip(stacks, robots, strict=True)
    }
    long = max(reaches, key=lambda name: reaches[name])
    if reaches[long] <= CLEARANCE:
        return []
    return [
        f"the robot of {long} reaches {reaches[long]:.2f} m from where it starts, and missions "
        f"keep only {CLEARANCE:g} m from obstacles: some may begin inside one; --start X,Y,YAW "
        "chooses a place"
    ]


def sensor_notes(stack: Stack, scene: Scene) -> list[str]:
    """A note where a preset's errors come from buildings, and the map has none that make them."""
    sensors = load_dataclass(SensorParams, Path(stack.sensors))
    missing = []
    if sensors.gps.depends_on_sky and all(
        obstacle.height < sky.TALL for obstacle in scene.obstacles
    ):
        missing.append(f"nothing of {sky.TALL:g} m or more hides satellites")
    if sensors.lidar.glass_transmission > 0.0 and all(
        obstacle.kind not in glass.KINDS for obstacle in scene.obstacles
    ):
        missing.append("nothing is of glass")
    if not missing:
        return []
    return [
        f"{stack.name}: on this map {' and '.join(missing)}: "
        f"{Path(stack.sensors).stem} has no such errors here"
    ]


def lidar_notes(stack: Stack, robot: RobotParams) -> list[str]:
    """A note on a lidar that does not stand where its file says, or stands beside the robot."""
    if stack.body:
        return []
    preset, name = Path(stack.sensors).stem, Path(stack.robot).stem
    if is_made(stack.sensors):
        return [
            f"{stack.name}: {preset} is made for another robot than {name}, whose lidar stands in "
            "its middle"
        ]
    mount = load_dataclass(SensorParams, Path(stack.sensors)).lidar.mount
    off = np.abs(np.array((mount.x, mount.y)) - robot.center)
    if (off <= robot.half_size).all():
        return []
    return [
        f"{stack.name}: the lidar of {preset} stands beside {name}, at {mount.x:g} m ahead and "
        f"{mount.y:g} m to the left of the base"
    ]


def filter_notes(nav2: Nav2File, stack: Stack, scene: Scene) -> list[str]:
    """Notes where filters have no mask: a file's own is not there, or nobody has one."""
    notes = [f"{stack.name}: {notice}" for notice in masks_missing(nav2)]
    names = keepout_filters_without_mask(nav2.parameters, nav2.path.parent)
    has_mask = stack.planning_map == GEOMETRY and scene.is_ground_given
    if has_mask or not names:
        return notes
    why = _WITHOUT_MASK.get(stack.planning_map, "a map file brings none")
    notes.append(f"{stack.name}: without a mask, hence without effect: {', '.join(names)} ({why})")
    return notes


def masks_missing(nav2: Nav2File) -> list[str]:
    """What the notices of a user's file say of masks that are not there."""
    if nav2.path.is_relative_to(shipped("params")):
        return []
    return [str(notice) for notice in nav2.notices if notice.id == "no-mask"]


def footprint_notes(nav2: Nav2File, robot: RobotParams, stack: str) -> list[str]:
    """A note where the robot that drives here reaches beyond the one that a Nav2 file knows."""
    outline = robot_footprint(read_costmap(nav2, "local_costmap"))
    covered = shapely.Polygon(outline).buffer(BODY_TOLERANCE)
    if covered.contains(shapely.Polygon(robot.polygon)):
        return []
    known, real = footprint_radii(outline), footprint_radii(robot.polygon)
    return [
        f"{stack}: the file's robot reaches {known[0]:.2f} to {known[1]:.2f} m from its "
        f"centre, the one that drives here {real[0]:.2f} to {real[1]:.2f} m: it may touch what "
        "its costmap shows free"
    ]


def notes_on_file(nav2: Nav2File, stack: str) -> list[str]:
    """At most one line on a user's file; nobody can change those that come with the program."""
    if nav2.path.is_relative_to(shipped("params")):
        return []
    otherwise = [f"{stack}: {line}" for line in file_notes(nav2)] + default_notes(nav2, stack)
    notes = otherwise + ([f"{stack}: {ignored_keys(nav2)}"] if nav2.ignored else [])
    if len(notes) < 2:
        return notes
    told = []
    if otherwise:
        told.append(f"what is read otherwise than by Nav2 ({len(otherwise)})")
    if nav2.ignored:
        told.append(f"what has no effect here ({len(nav2.ignored)})")
    first = _first_misspelt(nav2)
    return [f"{stack}: navbench lint {quoted(nav2.path)} --full lists {' and '.join(told)}{first}"]


def file_notes(nav2: Nav2File) -> list[str]:
    """What a user should know of a Nav2 file that is used.

    Names that Nav2 does not know in one line.
    """
    unknown = [notice for notice in nav2.notices if notice.id in IGNORED_BY_NAV2]
    notes = [str(notice) for notice in nav2.notices if notice not in unknown]
    if unknown:
        notes.append(
            f"Nav2 does not know {len(unknown)} of the names in this file, "
            f"and ignores them as we do{_first_misspelt(nav2)}; "
            f"navbench lint {quoted(nav2.path)} tells of each"
        )
    return notes


def _first_misspelt(nav2: Nav2File) -> str:
    """Names of a file that are near to one that Nav2 knows, a few of them."""
    misspelt = [
        notice
        for notice in nav2.notices
        if notice.id in IGNORED_BY_NAV2 and notice.id != UNKNOWN_KEY
    ]
    return "".join(f"; {notice}" for notice in misspelt[:MOST_MISSPELT])


def default_notes(nav2: Nav2File, stack: str) -> list[str]:
    """A note where a file leaves out what its distribution of Nav2 sets otherwise than Jazzy."""
    if not nav2.release_defaults:
        return []
    taken = ", ".join(nav2.release_defaults)
    return [f"{stack}: reads like a file of Nav2 {nav2.release}, whose defaults are taken: {taken}"]


def ignored_keys(nav2: Nav2File) -> str:
    """What of a Nav2 file is not modelled: whole nodes by name, single keys by their number."""
    names = [key for key in nav2.ignored if ": " not in key]
    keys = len(nav2.ignored) - len(names)
    if keys:
        names.append(f"{keys} keys")
    return f"not modelled here: {', '.join(names)}; the run folder lists them in params/"
