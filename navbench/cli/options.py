"""Options that several commands have."""

import functools
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from harness.meetings.estimators import DELIVERIES, ESTIMATORS
from harness.storage.shipped import DEFAULT_WORLD
from harness.study.places import EXECUTORS, Where
from navbench.cli.values import Finite, Numbers, Pose, names_of, settings_of
from navstack.errors import InputError


def completed(kind: str) -> Callable[[click.Context, click.Parameter, str], list[str]]:
    """Lets a shell complete names of a kind, as ``navbench list`` has them."""

    def complete(_: click.Context, __: click.Parameter, begun: str) -> list[str]:
        from navbench.api.listing import listing

        names = (each.name.partition(" ")[0] for each in listing(kind))
        return [name for name in names if name.startswith(begun)]

    return complete


def path_option(name: str, shown: str, about: str, required: bool = False) -> Callable[..., Any]:
    """An option that takes a file or folder; ``shown`` stands for it in the help."""
    kind = click.Path(path_type=Path)
    return click.option(name, type=kind, metavar=shown, help=about, required=required)


RETRY_ERRORS = click.option(
    "--retry-errors",
    "retries_errors",
    is_flag=True,
    help="With --resume: also drive what ended in an error, as a map that was missing.",
)
ESTIMATOR = click.option(
    "--estimator",
    type=click.Choice(ESTIMATORS),
    default=DELIVERIES,
    show_default=True,
    help="deliveries: whole ones; meetings: less of them, and meetings with people.",
)
ANY_ESTIMATOR = click.option(
    "--estimator",
    type=click.Choice(ESTIMATORS),
    help="deliveries: whole ones; meetings: less of them, and meetings with people, the default "
    "where people react to nobody.",
)
PRICES = click.option(
    "--prices",
    default="costnav",
    shell_complete=completed("prices"),
    help="Prices: a name of params/prices or a YAML file.",
)
JSON = click.option(
    "--json", "as_json", is_flag=True, help="One JSON document on standard output, nothing else."
)
FULL = click.option("--full", "is_full", is_flag=True, help="Print everything that was found.")
OTHER_PRICES = click.option(
    "--prices", help="Prices: a name of params/prices or a file; default: the run's own."
)
SETTINGS = click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="KEY=VALUE",
    callback=lambda _, __, texts: settings_of(texts),
    help="Another value of one price, e.g. delivery_fee=4.99; repeatable.",
)
TERMS = click.option(
    "--with",
    "terms",
    multiple=True,
    metavar="TERM[,TERM]",
    callback=lambda _, __, texts: names_of(texts),
    help="Costs that the paper leaves out: mapping_survey, operator, operator_shift, "
    "remote_assistance, on_site_assistance, battery_wear, distance_fee, idle_power.",
)
LOCALIZER = click.option(
    "--localizer",
    shell_complete=completed("localizers"),
    help="Localizer instead of the stack's own, such as gps-ekf or amcl; "
    "docs/localization.md lists them.",
)
_WHERE = (
    click.option(
        "--workers",
        type=int,
        help=(
            "Processes, or deliveries at a time on a cluster; default: one per core, or per "
            "worker of it."
        ),
    ),
    click.option(
        "--episode-timeout",
        type=Finite(0.0, 1e9, min_open=True),
        default=Where().time_limit,
        show_default=True,
        help="Wall time in [s] after which a delivery counts as hung; it is tried twice.",
    ),
    click.option(
        "--executor",
        type=click.Choice(EXECUTORS),
        default=EXECUTORS[0],
        show_default=True,
        help=(
            "Where deliveries are driven: local, processes of this machine; dask, a cluster "
            "that runs."
        ),
    ),
    click.option(
        "--scheduler", metavar="ADDRESS", help="Of the Dask cluster, e.g. tcp://host:8786."
    ),
)
BESIDE_RESUME = (  # they change no row
    *("resume", "workers", "episode_timeout", "executor", "scheduler", "as_json"),
    *("against", "budget"),
)

_EPISODES = click.option(
    "--episodes", type=int, default=20, show_default=True, help="Deliveries per stack, at least 1."
)
_ONLY = click.option(
    "--only",
    type=int,
    multiple=True,
    metavar="NUMBER",
    help="Of the deliveries only this one; repeatable. Then --episodes does not count.",
)
_RECORD = click.option(
    "--record",
    default="events",
    show_default=True,
    help="events; decisions: also why each command was given; full: trajectories too.",
)
_CONDITIONS = (
    click.option(
        "--seed",
        type=int,
        default=0,
        show_default=True,
        help="Same seed, same deliveries; 0 or more.",
    ),
    click.option(
        "--map",
        shell_complete=completed("maps"),
        default="sidewalk",
        show_default=True,
        help="A built-in map, a map_server YAML file, or a folder of navbench map osm.",
    ),
    click.option(
        "--pedestrians", type=int, help="Number of people; default: the world's own (20)."
    ),
    click.option(
        "--people",
        help="How they walk: random_walk, social_force, replay, or a recording (CSV with columns "
        "id, t, x, y; obsmat.txt); default: the world's own.",
    ),
    click.option(
        "--world",
        shell_complete=completed("worlds"),
        default=DEFAULT_WORLD,
        show_default=True,
        help="A name of params/worlds or a YAML file.",
    ),
    click.option(
        "--rules",
        default="costnav",
        show_default=True,
        help="How deliveries end: a name of params/rules or a YAML file.",
    ),
    click.option(
        "--missions",
        default="published",
        show_default=True,
        help="How they are drawn: published (nearer goals more often) or uniform; on a district "
        "osm, from shops to homes.",
    ),
    click.option(
        "--distance",
        type=Numbers(),
        metavar="LEAST,MOST",
        help="On a district: least distance of start and goal, most length of the route [km].  "
        "[default: 0.3,2.5]",
    ),
    click.option(
        "--robot",
        shell_complete=completed("robots"),
        help="A name of params/robots or a file, instead of the stack's own.",
    ),
    click.option(
        "--sensors",
        shell_complete=completed("sensors"),
        help="A name of params/sensors or a file, instead of the stack's own.",
    ),
    click.option(
        "--start",
        type=Pose(),
        metavar="TEXT",
        help="x,y,yaw [m, m, rad] of every start, instead of sampled ones.",
    ),
    click.option(
        "--goal",
        type=Pose(),
        metavar="TEXT",
        help="x,y,yaw [m, m, rad] of every goal, instead of sampled ones.",
    ),
    PRICES,
)
STRICT = click.option(
    "--strict",
    "allow_unknown",
    is_flag=True,
    flag_value=False,
    default=True,
    help="Refuse keys unknown to Nav2 in its file; else they are ignored, as Nav2 does.",
)

SUBSTITUTE = click.option(
    "--substitute",
    "substitutes",
    multiple=True,
    metavar="NAME=TYPE",
    help="Put another plugin in the place of the Nav2 file's own, e.g. "
    "FollowPath=dwb_core::DWBLocalPlanner; repeatable.",
)


def where_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command the options that decide where deliveries are driven.

    It takes them as ``where``.
    """

    @functools.wraps(command)
    def placed(
        *given: Any,
        executor: str,
        scheduler: str | None,
        workers: int | None,
        episode_timeout: float,
        **choices: Any,
    ) -> Any:
        return command(
            *given, where=Where(executor, scheduler, workers, episode_timeout), **choices
        )

    return _with(placed, _WHERE)


def study_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command the options that decide which deliveries are driven, how and where."""
    options = (_EPISODES, _ONLY, *_CONDITIONS, _RECORD, STRICT, SUBSTITUTE, JSON)
    return _with(where_options(command), options)


def condition_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command :func:`study_options` but for the number of deliveries and the record."""
    return _with(where_options(command), (*_CONDITIONS, STRICT, SUBSTITUTE, JSON))


def _with(command: Callable[..., Any], options: Sequence[Callable[..., Any]]) -> Callable[..., Any]:
    for option in reversed(options):
        command = option(command)
    return command


def refuse_others(
    context: click.Context,
    *allowed: str,
    beside: Sequence[str] = BESIDE_RESUME,
    why: str = "--resume takes the study from its folder",
) -> None:
    """Check that nothing was given beside --resume that would make another study of it.

    Args:
        context: of the command.
        allowed: parameters of this command that would not.
        beside: those of any command that would not.
        why: the others cannot count.

    Raises:
        InputError: something was.
    """
    given = [
        parameter.opts[0] if isinstance(parameter, click.Option) else parameter.human_readable_name
        for parameter in context.command.params
        if parameter.name not in (*beside, *allowed)
        and context.get_parameter_source(str(parameter.name)) is not ParameterSource.DEFAULT
    ]
    if given:
        raise InputError(f"{why}; leave out {', '.join(given)}")
