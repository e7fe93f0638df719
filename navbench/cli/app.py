"""The command line program ``navbench``."""

import errno
import importlib
import os
import sys
import tomllib
import warnings
from pathlib import Path
from typing import Any

import click

from harness.storage.shipped import keep_compiled_code
from navbench.cli.signals import stop_like_ctrl_c, was_told_to_stop
from navbench.cli.streams import lost_output, provide_streams
from navstack.dispatch import restart_unmasked
from navstack.errors import NavstackError, NavstackWarning

COMMANDS = tomllib.loads(Path(__file__).with_name("commands.toml").read_text(encoding="utf-8"))
# former name of a command -> what it is called now, with the options that make it the same
ALIASES = {"sensitivity": ("price", "--sensitivity")}
# command -> folder of navbench.cli that it is in, where it is in one
FOLDERS = {
    "serve": "ros2",
    "drive": "ros2",
    "identify": "logs",
    "cost-log": "logs",
    "day": "street",
}
NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EIO)
UNWRITABLE = "standard output cannot be written; make room, or send it to another place"
# errors without a file name: a resource of the system is exhausted or not permitted
REFUSED = (
    *(errno.EMFILE, errno.ENFILE, errno.EAGAIN, errno.ENOMEM, errno.EROFS, errno.ENOSYS),
    errno.ENOENT,  # no folder for temporary files
)
MORE_OF_IT = "raise its limits (ulimit -a), and let /dev/shm and a folder in TMPDIR be written"
LONGEST_LINE = 1000  # [characters] of a complaint


def module_of(command: str) -> str:
    """The module that a command is in."""
    parts = ("navbench.cli", FOLDERS.get(command), command.replace("-", "_"))
    return ".".join(filter(None, parts))


class Commands(click.Group):
    """Commands, each imported when it is asked for."""

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """A command; None: there is none of this name."""
        if cmd_name not in self.commands:
            return None
        name = cmd_name.replace("-", "_")
        command: click.Command = getattr(importlib.import_module(module_of(cmd_name)), name)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """A command by its name or a former one, and what follows it."""
        if args and (alias := ALIASES.get(args[0])):
            args = [*alias, *args[1:]]
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List them in the help."""
        for heading, commands in COMMANDS.items():
            with formatter.section(heading):
                formatter.write_dl(list(commands.items()))


@click.group(
    "navbench",
    cls=Commands,
    commands={name: click.Command(name) for commands in COMMANDS.values() for name in commands},
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.version_option(package_name="navbench", prog_name="navbench", message="%(prog)s %(version)s")
def app() -> None:
    """Drive delivery robots through a physical sidewalk world, and price every delivery.

    \b
    Examples:
      navbench run --stack nav2-gps --episodes 20 --seed 0
      navbench run --stack my_robot_nav2.yaml --map my_map.yaml --episodes 5
      navbench tune --stack my_robot_nav2.yaml --budget 30m
      navbench explain results/latest

    Exit status: 0 done; 1 bad input; 2 unknown command or option, or a missing argument; 3 done,
    but some deliveries ended in an error; 130 interrupted, finished deliveries kept.
    """


def main(arguments: list[str] | None = None, program: click.Command = app) -> None:
    """Run the program, or another one likewise; leaves with one of the statuses of its help."""
    if arguments is None:
        restart_unmasked()
    provide_streams()
    stdout = sys.stdout
    try:
        status: int | str | None = _status(arguments, program)
    except SystemExit as leaving:
        # click replaces it where a reader has left
        status = leaving.code if sys.stdout is stdout else 0
    lost = lost_output()
    # to leave early, as head does, is no error
    if lost is not None and not isinstance(lost, BrokenPipeError):
        status = _complain(f"{UNWRITABLE} ({lost.strerror})", 1)
    sys.exit(status)


def _status(arguments: list[str] | None, program: click.Command = app) -> int:
    stop_like_ctrl_c()
    os.environ["MPLBACKEND"] = "agg"  # no window: a user's other choice may not be installed here
    warnings.showwarning = _show
    try:
        keep_compiled_code()
        program(arguments, standalone_mode=False)
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message())
    except click.NoSuchOption as error:
        return _complain(f"{_no_option(error)} See '{_path(error, program)} --help'.", 2)
    except click.UsageError as error:
        if isinstance(error, click.BadParameter) and not isinstance(error, click.MissingParameter):
            return _complain(error.format_message(), 1)
        return _complain(f"{error.format_message()} See '{_path(error, program)} --help'.", 2)
    except NavstackError as error:
        return _complain(str(error), 1)
    except (KeyboardInterrupt, click.Abort):  # which is a RuntimeError
        return _complain("interrupted", 130)
    except Exception as error:
        message = _of_the_system(error)
        if message:
            return _complain(message, 1)
        if was_told_to_stop():  # and a library made another error of it
            return _complain("interrupted", 130)
        raise
    return 0


def _no_option(error: click.NoSuchOption) -> str:
    """What is wrong with an option that there is not, the best fitting one first."""
    text = f"No such option '{error.option_name}'"
    if not error.possibilities:
        return f"{text}."
    best, *others = error.possibilities
    more = f" (or {', '.join(others)})" if others else ""
    return f"{text}; did you mean {best}?{more}"


def _path(error: click.UsageError, program: click.Command) -> str:
    """The command that was misused, as one types it."""
    if error.ctx is None:
        return str(program.name)
    names = []
    context: click.Context | None = error.ctx
    while context is not None:
        names.append(str(context.command.name))
        context = context.parent
    return " ".join(reversed(names))


def _of_the_system(error: Exception) -> str:
    """What a user can do about a file that no place of ours expected to fail, or a full disk.

    Empty: it is a fault of the program.
    """
    if isinstance(error, OSError) and error.filename is not None:
        return f"'{error.filename}' cannot be used ({error.strerror}); give another name or path"
    if isinstance(error, OSError) and error.errno in NO_ROOM:
        return f"{UNWRITABLE} ({error.strerror})"
    if isinstance(error, OSError) and error.errno in REFUSED:
        return f"the system refused a process, a file or memory ({error.strerror}); {MORE_OF_IT}"
    if isinstance(error, MemoryError):
        return "there is not enough memory; free some, or give fewer --workers"
    is_loop = str(error).startswith("Symlink loop")  # so says pathlib before Python 3.13
    return f"{error}; give another path" if is_loop else ""


def _show(*details: Any, **_: Any) -> None:
    """Print a warning; the details are those of :func:`warnings.showwarning`."""
    message, category = details[:2]
    if category is NavstackWarning:
        text = f"note: {message}\n"
    else:
        text = warnings.formatwarning(*details[:4])
    sys.stderr.write(text)


def _complain(message: str, status: int) -> int:
    line = " ".join(message.split())
    if len(line) > LONGEST_LINE:  # a message quotes what was given, which may be a whole file
        line = f"{line[: LONGEST_LINE // 2]} ... {line[-LONGEST_LINE // 2 :]}"
    sys.stderr.write(f"navbench: {line}\n")
    return status
