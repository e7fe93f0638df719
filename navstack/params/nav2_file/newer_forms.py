"""Parameters in the forms of Nav2 main, turned into Jazzy's, which this program reads."""

from dataclasses import replace
from typing import NamedTuple

from navstack.params.mppi import MOTION_MODELS
from navstack.params.nav2_file.catalog import plugin_type
from navstack.params.nav2_file.findings import Notice, names_of
from navstack.params.nav2_file.ros_yaml import ParameterEntry

CONTROLLER, MPPI = "controller_server", "nav2_mppi_controller::MPPIController"
USUAL_GROUP = "diff_drive"  # of a file that names no motion model (optimizer.cpp)
_MODELS = {f"mppi::{name}MotionModel": name for name in MOTION_MODELS}
# What controllers read up to Nav2 Kilted, and the path handler for them since
# (feasible_path_handler.cpp): the handler's name -> theirs.
_SEARCH = {"max_robot_pose_search_dist": "max_robot_pose_search_dist"}
_INVERSION = ("enforce_path_inversion", "inversion_xy_tolerance", "inversion_yaw_tolerance")
_OF_PATH_HANDLER = {
    MPPI: _SEARCH | {name: name for name in ("prune_distance", *_INVERSION)},
    "dwb_core::DWBLocalPlanner": {"prune_distance": "forward_prune_distance"},
    "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController": _SEARCH,
    "nav2_graceful_controller::GracefulController": _SEARCH,
}


class NewerForms(NamedTuple):
    """What a node's parameters in newer forms came to."""

    notices: list[Notice]  # of what has no form here
    moved: dict[str, str]  # Jazzy's dotted name -> the one in the file, whose value counts


def convert_newer_forms(node: str, entries: dict[str, ParameterEntry]) -> NewerForms:
    """Change a node's parameters to Jazzy's forms."""
    notices: list[Notice] = []
    moved: dict[str, str] = {}
    if node != CONTROLLER:
        return NewerForms(notices, moved)
    # the one path handler prunes the plan for all, whose own values do not count
    handlers = names_of(entries, "path_handler_plugins")[:1]
    for prefix, kind in _controllers(entries):
        if kind == MPPI:
            notices += _convert_motion_model(prefix, entries, moved)
        for name, own in _OF_PATH_HANDLER.get(kind, {}).items():
            for given in (f"{handler}.{name}" for handler in handlers):
                if given in entries:
                    entries[f"{prefix}{own}"] = entries[given]
                    moved[f"{prefix}{own}"] = given
    for given in set(moved.values()):
        entries.pop(given, None)
    return NewerForms(notices, moved)


def _controllers(entries: dict[str, ParameterEntry]) -> list[tuple[str, str]]:
    """Prefix and type of each controller: in its own section, or in its shim's."""
    found = []
    for key, entry in entries.items():
        section, _, name = key.rpartition(".")
        if name in ("plugin", "primary_controller"):
            found.append((f"{section}.", plugin_type(entry.value)))
    return found


def _convert_motion_model(
    prefix: str, entries: dict[str, ParameterEntry], moved: dict[str, str]
) -> list[Notice]:
    """Since #6076 ``motion_model`` names a group of parameters, whose plugin is the model."""
    key = f"{prefix}motion_model"
    chosen = str(entries[key].value) if key in entries else USUAL_GROUP
    notices = []
    for group in _plugin_groups(prefix, entries):
        is_chosen = group.removeprefix(prefix) == chosen
        kind = entries[f"{group}.plugin"]
        model = _MODELS.get(plugin_type(kind.value))
        if model is None and not is_chosen:
            continue
        radius = entries.pop(f"{group}.min_turning_r", None)
        del entries[f"{group}.plugin"]
        if is_chosen and radius is not None:
            entries[f"{prefix}AckermannConstraints.min_turning_r"] = radius
            moved[f"{prefix}AckermannConstraints.min_turning_r"] = f"{group}.min_turning_r"
        if is_chosen:
            moved[key] = f"{group}.plugin"
            entries[key] = replace(entries.get(key, kind), value=model or MOTION_MODELS[0])
        if model is None:
            message = f"motion model {kind.value} is not available here; take one of "
            path = f"{CONTROLLER}: {group}.plugin"
            message += ", ".join(_MODELS)
            notices.append(Notice("bad-value", path, message, line=kind.line, is_error=True))
    return notices


def _plugin_groups(prefix: str, entries: dict[str, ParameterEntry]) -> list[str]:
    """The sections just below a prefix that have a plugin."""
    paths = [key.rpartition(".")[0] for key in entries if key.endswith(".plugin")]
    return [
        path for path in paths if path.startswith(prefix) and "." not in path.removeprefix(prefix)
    ]
