"""What the reader of parameter files finds by itself, and what keeps a file from being used here."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

from navstack.errors import ParameterError
from navstack.params.lint.subject import SHIM
from navstack.params.nav2_file import views
from navstack.params.nav2_file.file import Nav2File
from navstack.params.nav2_file.findings import Notice, is_told

# Errors and warnings by id; the rules have others.
ERRORS = {
    "unreadable-file": "The file cannot be read, is not YAML, or holds no node with ros__parameters.",
    "misspelt-key": "Nav2 has no such parameter in this place, but one that is spelt almost alike. Nav2 does not "
    "complain; it goes on with the default of the one that was meant.",
    "unknown-node": "All but the name of a node of Nav2: its parameters are read by nobody.",
    "unknown-plugin": "No plugin of Nav2 or of an installed package has this type. A warning if it is of another "
    "package and the file can be used without it.",
    "missing-plugin": "A list names a plugin whose type is missing; Nav2 refuses to configure the node.",
    "bad-value": "A value of the wrong type, or one that cannot be.",
    "unusable": "Something else for which `navbench run` refuses the file.",
}
WARNINGS = {
    "unknown-key": "Nav2 has no such parameter in this place: it belongs to another release, node or plugin. Nav2 "
    "ignores it. An error with `--strict`.",
    "unavailable-plugin": "A real plugin of Nav2 that does not exist here; an error if the file cannot run without it.",
    "substitute": "A plugin or sensor that runs as something simpler here.",
    "renamed": "A name of another release, read as Nav2 Jazzy's. Other releases of Nav2 do not read it.",
    "older-form": "A value in the form of an older release, read as today's. Newer releases of Nav2 refuse it.",
    "duplicate": "A key is given twice; the last one counts, in ROS as here.",
    "empty": "A key without a value, or a node without parameters; ROS refuses such a file.",
    "alias": "YAML anchors and aliases; ROS's own reader refuses them.",
    "whole-number": "A whole number where Nav2 wants a decimal one: the node fails to start.",
    "decimal-number": "A decimal number where Nav2 wants a whole one: the node fails to start.",
    "replaced-value": "A number that stands for none of Nav2's choices; Nav2 warns and takes its default.",
    "placeholder": "A switch that a launch file fills in; Nav2's default is read.",
    "foreign-node": "A node of another package; nothing here reads it.",
    "several-namespaces": "The same node in several namespaces; the last one is read.",
    "costmap-namespace": "A costmap that is nested once; Nav2 looks for it in a namespace of its own name.",
    "behavior-tree": "Another behavior tree than Nav2's default; the default runs here.",
    "no-mask": "A speed filter whose mask the file does not name.",
    "filter-type": "A filter whose info is of another type.",
    "filter-scale": "A keepout filter with base and multiplier, which it does not use.",
}


def reader_notices(nav2: Nav2File, others: Iterable[Notice] = ()) -> list[Notice]:
    """What the reader found; an unavailable plugin is an error if the file cannot be used without it.

    Why a file cannot be used is not said again where ``others`` say it.
    """
    notices = list(nav2.notices)
    for message in dict.fromkeys(_refusals(nav2)):
        known = [i for i, notice in enumerate(notices) if notice.message.partition(" (")[0] in message]
        for i in known:
            notices[i] = replace(notices[i], is_error=True)
        if known or is_told(message, notices):
            continue
        if not any(other.message.partition("; ")[0] in message for other in others):
            notices.append(Notice("unusable", "", message, is_error=True))
    return notices


def _refusals(nav2: Nav2File) -> Iterator[str]:
    """Why the parts of the file cannot be built."""
    for view in VIEWS:
        try:
            view(nav2)
        except ParameterError as error:
            yield str(error).removeprefix(f"{nav2.path.name}: ")


def _read_controllers(nav2: Nav2File) -> object:
    plugin = views.read_controller(nav2)
    return views.read_primary_controller(nav2, plugin) if plugin.type == SHIM else plugin


VIEWS: tuple[Callable[[Nav2File], object], ...] = (
    views.read_planner,
    _read_controllers,
    views.read_goal_checker,
    views.read_progress_checker,
    views.read_velocity_smoother,
    views.read_collision_monitor,
    views.read_behavior_server,
    lambda nav2: views.read_costmap(nav2, "local_costmap"),
    lambda nav2: views.read_costmap(nav2, "global_costmap"),
)
