"""All that is wrong with a parameter file: what its reader, its parts and the rules say.

The parts are built on an empty map, so that what a constructor refuses is found, too.
"""

import contextlib
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from navstack.build import NavigatorParts, read_frequencies
from navstack.costmap.map_io import load_map
from navstack.costmap.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from navstack.errors import NavstackError, ParameterError
from navstack.params.lint.rules import rule_notices
from navstack.params.lint.subject import MaskFacts, RobotLimits, Subject
from navstack.params.nav2_file.file import Nav2File, inspect_nav2
from navstack.params.nav2_file.findings import Notice, is_told
from navstack.params.nav2_file.nodes import COSTMAPS
from navstack.params.nav2_file.release import release_notices
from navstack.params.nav2_file.ros_yaml import ParameterEntry
from navstack.params.nav2_file.values import KINDS
from navstack.params.nav2_file.views import Mask, read_costmap, read_masks
from navstack.types import Pose2D

# the parts of a navigator, each with the node of its parameters
PARTS = (
    ("planner_server", "planner"),
    ("controller_server", "controller"),
    ("controller_server", "goal_checker"),
    ("controller_server", "progress_checker"),
    ("velocity_smoother", "smoother"),
    ("collision_monitor", "monitor"),
    ("behavior_server", "behavior_server"),
    ("local_costmap", "local_costmap"),
    ("global_costmap", "global_costmap"),
)
NUMBERS = (KINDS[float], KINDS[int])  # end what is said of a value that should be a number
OFFER = "drive with another one by "  # of a plugin that is not available
_MAP = OccupancyGrid(np.full((200, 200), FREE, dtype=np.int8), 0.05, Pose2D(-5.0, -5.0, 0.0))


def lint(nav2: Nav2File, limits: RobotLimits | None = None) -> tuple[Notice, ...]:
    """All findings about a file: errors first, then by line.

    Args:
        nav2: the file; it may have errors: rules that need what cannot be read find nothing.
        limits: the robot's body, to hold the file against; None: not asked for.
    """
    no_numbers = {each.path for each in nav2.notices if each.message.endswith(NUMBERS)}
    rules = rule_notices(Subject(nav2, limits, list(_masks(nav2))))
    found = [notice for notice in rules if notice.path not in no_numbers]
    notices = [*_with_refusals(nav2, found), *found, *release_notices(nav2.names)]
    return tuple(sorted(notices, key=lambda notice: (not notice.is_error, notice.line)))


def refusals(nav2: Nav2File) -> tuple[Notice, ...]:
    """The findings for which a file is not driven; none: it can be."""
    return tuple(notice for notice in lint(nav2) if notice.is_error)


def require_usable(path: Path, allow_unknown: bool) -> None:
    """Refuse a parameter file for all its errors at once.

    Raises:
        ParameterError: it cannot be driven; one line says all that ``lint`` calls an error.
    """
    found = refusals(inspect_nav2(path, allow_unknown))
    if found:
        raise ParameterError(f"{path}: {'; also '.join(map(str, found))}")


def _masks(nav2: Nav2File) -> Iterator[MaskFacts]:
    """The masks of filters; one that cannot be read may have any value."""
    for node in COSTMAPS:
        masks: Mapping[str, Mask] = {}
        with contextlib.suppress(NavstackError):
            masks = read_masks(nav2, read_costmap(nav2, node))
        for name, mask in masks.items():
            values, yaw = tuple(range(FREE + 1, OCCUPIED + 1)), 0.0
            with contextlib.suppress(NavstackError):
                grid = load_map(mask.path)
                cells, yaw = np.unique(grid.data), grid.origin.yaw
                values = tuple(cells[cells > FREE].tolist())
            yield MaskFacts(node, name, mask.info_node, mask.info, values, yaw)


def _with_refusals(nav2: Nav2File, others: Iterable[Notice]) -> list[Notice]:
    """What the reader found, and why parts cannot be built.

    An unavailable plugin is an error if the file cannot be used without it. What ``others`` say is
    not said again.
    """
    notices = list(nav2.notices)
    for refusal in dict.fromkeys(_refused_parts(nav2)):
        text = f"{refusal.path}: {refusal.message}".removeprefix(": ")
        known = [i for i, notice in enumerate(notices) if notice.message.partition(" (")[0] in text]
        _, offered, way = text.partition(OFFER)
        for i in known:
            advice = notices[i].advice or f"{offered}{way}"
            notices[i] = replace(notices[i], is_error=True, advice=advice)
        is_said = any(other.message.partition("; ")[0] in text for other in others)
        if not known and not is_said and not is_told(text, notices):
            notices.append(refusal)
    return notices


def _refused_parts(nav2: Nav2File) -> Iterator[Notice]:
    """Why the parts of the file cannot be built."""
    parts = NavigatorParts(nav2, _MAP)
    for node, name in PARTS:
        try:
            getattr(parts, name)
        except NavstackError as error:
            yield _refusal(nav2, node, str(error))
    try:
        read_frequencies(nav2)
    except NavstackError as error:
        yield _refusal(nav2, "controller_server", str(error))


def _refusal(nav2: Nav2File, node: str, text: str) -> Notice:
    """The notice of an error, at the line of the parameter of which it speaks."""
    for prefix in (f"{nav2.path}: ", f"{nav2.path.name}: "):
        text = text.removeprefix(prefix)
    given, colon, message = text.partition(": ")
    if colon and given in nav2.parameters:
        node, text = given, message
    entries = nav2.parameters.get(node, {})
    named = [name for name in entries if _is_about(text, name, entries[name])]
    # a value tells apart parameters of the same name
    exact = [name for name in named if str(entries[name].value) in text]
    line = next((entries[name].line for name in (*exact, *named)), 0)
    return Notice("unusable", node, text, line=line, is_error=True)


def _is_about(text: str, name: str, entry: ParameterEntry) -> bool:
    """Whether a message has the last part of a parameter's name."""
    last = name.rpartition(".")[2]
    return bool(entry.line and re.search(rf"\b{re.escape(last)}\b", text))
