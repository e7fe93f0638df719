"""What the reader of parameter files finds, and what keeps a file from being used here."""

import tomllib
from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace
from pathlib import Path

from navstack.errors import ParameterError
from navstack.params.lint.subject import SHIM
from navstack.params.nav2_file import views
from navstack.params.nav2_file.file import Nav2File
from navstack.params.nav2_file.findings import Notice, is_told

# What each of the reader's findings means, by title and id; the rules have others.
MEANINGS: dict[str, dict[str, str]] = tomllib.loads(
    Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
)


def reader_notices(nav2: Nav2File, others: Iterable[Notice] = ()) -> list[Notice]:
    """What the reader found.

    An unavailable plugin is an error if the file cannot be used without it.

    Why a file cannot be used is not said again where ``others`` say it.
    """
    notices = list(nav2.notices)
    for message in dict.fromkeys(_refusals(nav2)):
        known = [
            i for i, notice in enumerate(notices) if notice.message.partition(" (")[0] in message
        ]
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
    if plugin.type == SHIM:
        return views.read_primary_controller(nav2, plugin)
    return plugin


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
