"""The command line program ``navbench``."""

import errno
import sys
from pathlib import Path
from typing import Any

import click

from harness.cli.ablate import ablate
from harness.cli.bench import bench
from harness.cli.explain import explain
from harness.cli.help import (
    COMPARE_HELP,
    HELP,
    LINT_HELP,
    MAP_HELP,
    PARITY_HELP,
    PRICE_HELP,
    RUN_HELP,
    SCENARIO_HELP,
    SENSITIVITY_HELP,
    SUITE_HELP,
)
from harness.cli.localize import localize
from harness.cli.options import JSON, PRICES, refuse_others, study_options, where_options
from harness.cli.plan import plan
from harness.cli.replay import replay
from harness.cli.report import report
from harness.cli.signals import stop_like_ctrl_c
from harness.cli.streams import lost_output, provide_streams
from harness.cli.tune import tune
from harness.storage.shipped import keep_compiled_code
from harness.study.places import Where
from navstack.errors import InputError, NavstackError

OTHER_PRICES = click.option("--prices", help="Prices: a name of params/prices or a file; default: the run's own.")
SETTINGS = click.option("--set", "settings", multiple=True, metavar="KEY=VALUE",
                        help="Another value of one price, e.g. delivery_fee=4.99; repeatable.")  # fmt: skip
TERMS = click.option("--with", "terms", multiple=True, metavar="TERM[,TERM]",
                     help="Costs that the paper leaves out: mapping_survey, operator, remote_assistance, "
                     "on_site_assistance, battery_wear.")  # fmt: skip
NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EIO)
UNWRITABLE = "standard output cannot be written; make room, or send it to another place"
LONGEST_LINE = 1000  # [characters] of a complaint


@click.group(help=HELP, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="navbench", prog_name="navbench", message="%(prog)s %(version)s")
def app() -> None:
    """Group the commands."""


@app.command()
@PRICES
@JSON
def paper(prices: str, as_json: bool) -> None:
    """Print the paper's two tables from its published measurements, and its thresholds."""
    from harness.cli.paper import run_paper

    run_paper(prices, as_json)


@app.command(help=RUN_HELP, short_help="Drive deliveries; print what they did and what they cost.")
@click.option("--stack", "stacks", multiple=True, default=("nav2-gps",), show_default=True,
              help="A name of params/stacks, a stack file or a Nav2 parameter file; repeatable.")  # fmt: skip
@click.option("--localizer", help="ground_truth, gps, gps-ekf, odom_imu, amcl or amcl-gps, instead of the stack's own.")
@study_options
@click.option("--out", type=click.Path(path_type=Path), help="Run folder; default: results/<time>-<stack>.")
@click.option("--resume", type=click.Path(path_type=Path), metavar="DIR",
              help="Go on with a run that was cut off, from its folder alone.")  # fmt: skip
@click.pass_context
def run(
    context: click.Context, out: Path | None, resume: Path | None, where: Where, as_json: bool, **choices: Any
) -> None:
    """Drive a study; see ``RUN_HELP``."""
    from harness.cli.run import resume_command, run_command
    from harness.task.study import make_study

    if resume is not None:
        refuse_others(context)
        sys.exit(resume_command(resume, where, as_json))
    sys.exit(run_command(make_study(workers=where.workers, **choices), out, where, as_json))


@app.command(help=SUITE_HELP, short_help="Drive a declared study: stacks x maps x worlds x densities x seeds.")
@click.argument("file", required=False)
@click.option("--stack", "stacks", multiple=True, help="Drive this stack of the suite only; repeatable. Default: all.")
@click.option("--map", "maps", multiple=True, help="Drive on this map of the suite only; repeatable. Default: all.")
@click.option("--episodes", type=int, help="Drive the first so many deliveries of each cell only. Default: all.")
@click.option("--world", help="A name of params/worlds or a YAML file, instead of the suite's own.")
@where_options
@click.option("--out", type=click.Path(path_type=Path),
              help="Folder; one that holds the suite is added to. "
              "Default: results/<time>-<name of the file>.")  # fmt: skip
@click.option("--resume", type=click.Path(path_type=Path), metavar="DIR",
              help="Go on with a suite from its folder alone.")  # fmt: skip
@JSON
@click.pass_context
def suite(
    context: click.Context,
    file: str | None,
    stacks: tuple[str, ...],
    maps: tuple[str, ...],
    episodes: int | None,
    world: str | None,
    where: Where,
    out: Path | None,
    resume: Path | None,
    as_json: bool,
) -> None:
    """Drive a suite; see ``SUITE_HELP``."""
    from harness.cli.suite import resume_suite_command, suite_command
    from harness.study.suite import Portion

    portion = Portion(stacks, maps, episodes)
    if resume is not None:
        refuse_others(context, "stacks", "maps", "episodes")
        sys.exit(resume_suite_command(resume, portion, where, as_json))
    if file is None:
        raise InputError("no suite is given; give its file, or --resume DIR")
    sys.exit(suite_command(file, world, portion, where, out, as_json))


@app.command(help=COMPARE_HELP, short_help="Compare two runs mission by mission.")
@click.argument("first", metavar="A")
@click.argument("second", metavar="B")
@click.option("--metric", "metrics", multiple=True, help="Compare this one only; repeatable. Default: all.")
@JSON
def compare(first: str, second: str, metrics: tuple[str, ...], as_json: bool) -> None:
    """Compare B with A; see ``COMPARE_HELP``."""
    from harness.cli.compare import compare_command

    compare_command(first, second, metrics, as_json)


@app.command(help=PRICE_HELP, short_help="Price a finished run again, without simulating.")
@click.argument("run_folder", metavar="RUN")
@OTHER_PRICES
@SETTINGS
@TERMS
@JSON
def price(
    run_folder: str, prices: str | None, settings: tuple[str, ...], terms: tuple[str, ...], as_json: bool
) -> None:
    """Price a run again; see ``PRICE_HELP``."""
    from harness.cli.price import price_command

    price_command(run_folder, prices, settings, terms, as_json)


@app.command(help=SENSITIVITY_HELP, short_help="Show which prices a finished run's profit hangs on.")
@click.argument("run_folder", metavar="RUN")
@OTHER_PRICES
@SETTINGS
@TERMS
@click.option("--map", "maps", multiple=True, metavar="X,Y",
              help="Two prices, or groups such as injury.costs, to vary together; repeatable.")  # fmt: skip
@click.option("--out", type=click.Path(path_type=Path), help="Folder for the figures (PDF and PNG); default: none.")
@JSON
def sensitivity(
    run_folder: str,
    prices: str | None,
    settings: tuple[str, ...],
    terms: tuple[str, ...],
    maps: tuple[str, ...],
    out: Path | None,
    as_json: bool,
) -> None:
    """Vary the prices; see ``SENSITIVITY_HELP``."""
    from harness.cli.sensitivity import sensitivity_command

    sensitivity_command(run_folder, prices, settings, terms, maps, out, as_json)


@app.command(help=PARITY_HELP, short_help="Compare with Nav2's own C++, case by case.")
@click.option("--golden", "folder", type=click.Path(path_type=Path),
              help="Folder of golden vectors (.npz); default: $NAVSTACK_GOLDEN, else tests/golden.")  # fmt: skip
@JSON
def parity(folder: Path | None, as_json: bool) -> None:
    """Certify the parity; see ``PARITY_HELP``."""
    from harness.cli.parity import parity_command

    sys.exit(parity_command(folder, as_json))


@app.command(help=LINT_HELP, short_help="Check a Nav2 parameter file.")
@click.argument("file")
@click.option("--robot", help="A name of params/robots or a file, to hold the file against.")
@click.option("--allow-unknown", is_flag=True, help="Unknown keys are warnings, not errors.")
@JSON
def lint(file: str, robot: str | None, allow_unknown: bool, as_json: bool) -> None:
    """Check a file; see ``LINT_HELP``."""
    from harness.cli.lint import lint_command

    lint_command(file, robot, allow_unknown, as_json)


@app.command(help=SCENARIO_HELP, short_help="Drive situations written down as data; check what comes of them.")
@click.argument("files", nargs=-1, type=click.Path(path_type=Path))
@click.option("--all", "everything", is_flag=True, help="Every file of tests/scenarios.")
@JSON
def scenario(files: tuple[Path, ...], everything: bool, as_json: bool) -> None:
    """Drive scenarios; see ``SCENARIO_HELP``."""
    from harness.cli.scenario import scenario_command

    sys.exit(scenario_command(files, everything, as_json))


@app.group(name="map", help=MAP_HELP, short_help="Make a sidewalk world, or show and measure a map.")
def map_group() -> None:
    """Group the commands about maps; see ``MAP_HELP``."""


@map_group.command("new")
@click.option("--seed", type=int, default=0, show_default=True, help="Same seed, same world; 0 or more.")
@click.option("--name", required=True, help="The map's name: NAME.yaml and the files beside it.")
@click.option("--out", type=click.Path(path_type=Path), default=Path(), help="Folder; default: the current one.")
def map_new(seed: int, name: str, out: Path) -> None:
    """Generate a sidewalk world like the paper's and save it as a map; its path goes to standard output."""
    from harness.cli.map import new_command

    new_command(seed, name, out)


@map_group.command("show")
@click.argument("map_name", metavar="MAP")
@click.option("--out", type=click.Path(path_type=Path), help="Picture to write (PNG, PDF or SVG).")
@click.option("--view", default="zones", show_default=True, help="What the picture shows: zones, navmesh or keepout.")
@click.option("--samples", type=int, default=200, show_default=True, help="Missions drawn to measure their paths.")
@click.option("--seed", type=int, default=0, show_default=True, help="Of those missions.")
@JSON
def map_show(map_name: str, out: Path | None, view: str, samples: int, seed: int, as_json: bool) -> None:
    """Measure MAP, a built-in map or a map_server YAML file, beside the paper's; draw its picture with --out."""
    from harness.cli.map import show_command

    show_command(map_name, out, view, samples, seed, as_json)


app.add_command(ablate)
app.add_command(bench)
app.add_command(explain)
app.add_command(localize)
app.add_command(plan)
app.add_command(replay)
app.add_command(report)
app.add_command(tune)


def main(arguments: list[str] | None = None) -> None:
    """Run the program; leaves with one of the statuses that ``HELP`` lists."""
    provide_streams()
    stdout = sys.stdout
    try:
        status: int | str | None = _status(arguments)
    except SystemExit as leaving:
        status = leaving.code if sys.stdout is stdout else 0  # click replaces it where a reader has left
    lost = lost_output()
    if lost is not None and not isinstance(lost, BrokenPipeError):  # to leave early, as head does, is no error
        status = _complain(f"{UNWRITABLE} ({lost.strerror})", 1)
    sys.exit(status)


def _status(arguments: list[str] | None) -> int:
    stop_like_ctrl_c()
    keep_compiled_code()
    try:
        app(arguments, standalone_mode=False)
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message())
    except (click.BadParameter, click.BadOptionUsage) as error:  # a missing parameter is a BadParameter, too
        return _complain(error.format_message(), 1)
    except click.UsageError as error:
        return _complain(f"{error.format_message()} See 'navbench --help'.", 2)
    except NavstackError as error:
        return _complain(str(error), 1)
    except OSError as error:  # files say by themselves that they cannot be written
        if error.errno not in NO_ROOM:
            raise
        return _complain(f"{UNWRITABLE} ({error.strerror})", 1)
    except (KeyboardInterrupt, click.Abort):
        return _complain("interrupted", 130)
    return 0


def _complain(message: str, status: int) -> int:
    line = " ".join(message.split())
    if len(line) > LONGEST_LINE:  # a message quotes what was given, which may be a whole file
        line = f"{line[: LONGEST_LINE // 2]} ... {line[-LONGEST_LINE // 2 :]}"
    sys.stderr.write(f"navbench: {line}\n")
    return status
