"""The command line program ``navbench``."""

import signal
import sys
from pathlib import Path
from types import FrameType
from typing import Any

import click

from harness.resources import keep_compiled_code
from navstack.errors import NavstackError

PRICES = click.option("--prices", default="costnav", help="Prices: a name of params/prices or a YAML file.")
JSON = click.option("--json", "as_json", is_flag=True, help="One JSON document on standard output, nothing else.")


HELP = """Drive delivery robots through a physical sidewalk world, and price every delivery.

\b
Examples:
  navbench run --stack nav2-gps --episodes 20 --seed 0
  navbench run --stack nav2-gps --stack parked --episodes 10 --out results/first
  navbench run --stack my_robot_nav2.yaml --map my_map.yaml --episodes 5 --json
  navbench paper

Exit status: 0 done; 1 bad input; 2 unknown command or option; 3 done, but some deliveries ended in an error; 130
interrupted, finished deliveries kept.
"""
RUN_HELP = """Drive deliveries and print what they did and what they cost.

\b
Examples:
  navbench run --stack nav2-gps --episodes 20
  navbench run --stack nav2-gps --localizer ground_truth --pedestrians 0 --episodes 5
  navbench run --start 10,4.5,0 --goal 60,30,0 --episodes 3
"""


@click.group(help=HELP, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="navbench", prog_name="navbench", message="%(prog)s %(version)s")
def app() -> None:
    """Group the commands."""


@app.command()
@PRICES
@JSON
def paper(prices: str, as_json: bool) -> None:
    """Print the paper's two tables from its published measurements, and its thresholds."""
    from harness.cli_paper import run_paper

    run_paper(prices, as_json)


@app.command(help=RUN_HELP, short_help="Drive deliveries; print what they did and what they cost.")
@click.option("--stack", "stacks", multiple=True, default=("nav2-gps",), show_default=True,
              help="A name of params/stacks, a stack file or a Nav2 parameter file; repeatable.")  # fmt: skip
@click.option("--episodes", type=int, default=20, show_default=True, help="Deliveries per stack, at least 1.")
@click.option("--seed", type=int, default=0, show_default=True, help="Same seed, same deliveries; 0 or more.")
@click.option("--map", "map_name", default="sidewalk", show_default=True,
              help="A built-in map or a map_server YAML file.")  # fmt: skip
@click.option("--pedestrians", type=int, help="Number of people; default: the world's own (20).")
@click.option("--localizer", help="ground_truth or gps, instead of the stack's own.")
@click.option("--robot", help="A name of params/robots or a file, instead of the stack's own.")
@click.option("--start", help="x,y,yaw [m, m, rad] of every start, instead of sampled ones.")
@click.option("--goal", help="x,y,yaw [m, m, rad] of every goal, instead of sampled ones.")
@click.option("--workers", type=int, help="Processes; default: one per core.")
@click.option("--out", type=click.Path(path_type=Path), help="Run folder; default: results/<time>-<stack>.")
@PRICES
@click.option("--record", default="events", show_default=True, help="events, or full: trajectories too.")
@click.option("--allow-unknown", is_flag=True, help="Unknown keys in a Nav2 file are warnings, not errors.")
@JSON
def run(out: Path | None, as_json: bool, **choices: Any) -> None:
    """Drive a study; see ``RUN_HELP``."""
    from harness.cli_run import run_command
    from harness.study import make_study

    sys.exit(run_command(make_study(**choices), out, as_json))


def main(arguments: list[str] | None = None) -> None:
    """Run the program; leaves with one of the statuses that ``HELP`` lists."""
    sys.exit(_status(arguments))


def _interrupt(number: int, frame: FrameType | None) -> None:
    raise KeyboardInterrupt


def _status(arguments: list[str] | None) -> int:
    for name in ("SIGTERM", "SIGHUP"):  # a batch system's or a closing terminal's way to say Ctrl-C
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is signal.SIG_DFL:  # nohup's wish stands
            signal.signal(number, _interrupt)
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
    except (KeyboardInterrupt, click.Abort):
        return _complain("interrupted", 130)
    return 0


def _complain(message: str, status: int) -> int:
    line = " ".join(message.split())
    sys.stderr.write(f"navbench: {line}\n")
    return status
