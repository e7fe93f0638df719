"""Every command in README.md and docs/*.md is executed, shortened as shortened.py declares.

All options are known.
"""

import ast
import contextlib
import functools
import io
import re
import runpy
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

import click
import pytest
from ruamel.yaml import YAML

from harness.execution.process_cache import forget
from navbench.cli.app import app, main
from tools.parity.__main__ import parity

from .blocks import LANGUAGES, PAGES, ROOT, Block, Command, blocks_of, commands_of, inline_commands
from .given import (
    GIVEN,
    drive_runs,
    forget_installed,
    furnish,
    in_this_process,
    install,
    merge,
    status_of,
    wait_for_a_new_second,
    write_block,
)
from .shortened import EXCHANGED, IN_FILES, NOT_EXECUTED, Reason, reason_not_to, shortened

BLOCKS = {page: blocks_of(page) for page in PAGES}
COMMANDS = {
    page: [c for b in blocks if b.language == "sh" for c in commands_of(b)]
    for page, blocks in BLOCKS.items()
}
INLINE = {page: inline_commands(page) for page in PAGES}
# page -> file of which its yaml without a name is a part
SNIPPETS = {"add_a_critic.md": "comfort.yaml"}
NO_DASK = "the package distributed (extra 'dask') is not installed"
PLACEHOLDER = re.compile(r"\[|\.\.\.|…|^[A-Z_]{2,}(:\w+)?$")


def names(pages: list[Path]) -> list[str]:
    return [str(page.relative_to(ROOT)) for page in pages]


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Finished runs that pages take for granted; deliveries are driven in this process."""
    folder = tmp_path_factory.mktemp("runs")
    with in_this_process():
        drive_runs(folder)
        yield folder


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The folder in which commands are executed."""
    monkeypatch.chdir(tmp_path)
    # all of the project's take half a minute
    monkeypatch.setenv("NAVSTACK_GOLDEN", str(tmp_path / "my_vectors"))
    yield tmp_path
    forget_installed(tmp_path)


@pytest.mark.parametrize("page", PAGES, ids=names(PAGES))
def test_fences_say_what_they_hold(page: Path) -> None:
    for block in BLOCKS[page]:
        assert block.language in LANGUAGES, (
            f"{block.where}: mark the block as one of {', '.join(LANGUAGES)}"
        )
        shell = re.search(r"(?m)^(navbench|python -m tools|make|pip) ", block.text)
        assert block.language == "sh" or not shell, (
            f"{block.where}: a command in a block that is not marked sh"
        )
        if block.language == "yaml":
            YAML(typ="safe").load(block.text)
        if block.language == "python":
            compile(block.text, block.where, "exec")


def runnable(page: Path) -> list[Command]:
    return [command for command in COMMANDS[page] if reason_not_to(str(command)) is None]


DRIVEN = [page for page in PAGES if runnable(page)]
FIRST_READ = ("README.md", "quick_start.md")


def is_read_later(page: Path) -> bool:
    return page.name not in FIRST_READ


@pytest.mark.parametrize(
    "page",
    [
        *(pytest.param(page, id=page.name) for page in DRIVEN if not is_read_later(page)),
        *(
            pytest.param(page, id=page.name, marks=pytest.mark.slow)
            for page in DRIVEN
            if is_read_later(page)
        ),
    ],
)
def test_commands_of_a_page_work_one_after_the_other(page: Path, runs: Path, place: Path) -> None:
    forget()
    executed = 0
    furnish(place, runs, GIVEN.get(page.name, ()))
    for block in BLOCKS[page]:  # files first: pages name them before or after the command
        if block.file:
            write_block(block, place)
    for block in BLOCKS[page]:
        if block.language == "sh":
            for command in commands_of(block):
                executed += execute(command, place)
        elif block.language == "yaml" and not block.file and page.name in SNIPPETS:
            merge(block, place / SNIPPETS[page.name])
            forget()
    assert executed == len(runnable(page))


def execute(command: Command, place: Path) -> bool:
    """Execute a command, unless shortened.py says why not.

    Returns whether it was executed, and ended well.
    """
    if reason_not_to(str(command)) is not None:
        return False
    if command.words[0] != "navbench":
        forget()  # files that it changes are read anew, as by the next process
    match command.words:
        case ("navbench", *_):
            wait_for_a_new_second(place / "results")
            words = shortened(command.words)
            assert status_of(words) == 0, f"{command.block.where}: {command} (as {' '.join(words)})"
        case ("cp", source, target):
            shutil.copy(place / source, place / target)
        case ("pip", "install", package) if package.startswith("./"):
            install(place / package)
        case ("python", "-m", "tools.parity", *words):
            with pytest.raises(SystemExit) as ended:
                main(words, program=parity)
            assert ended.value.code == 0, f"{command.block.where}: {command}"
        case ("python", script, *words):
            run_script(place / script, words)
        case _:
            pytest.fail(
                f"{command.block.where}: '{command}' is neither executed nor listed in shortened.py"
            )
    return True


def run_script(script: Path, words: list[str]) -> None:
    """Execute a script as ``python`` does, in this process."""
    before = sys.argv
    sys.argv = [str(script), *words]
    try:
        runpy.run_path(str(script), run_name="__main__")
    except SystemExit as ended:
        assert not ended.code, f"{script.name}: {ended.code}"
    finally:
        sys.argv = before


@pytest.mark.parametrize("page", PAGES, ids=names(PAGES))
def test_the_program_knows_every_option(page: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    for command in COMMANDS[page]:
        match command.words:
            case ("navbench", *words):
                parse(words, command.block.where)
            case ("dask", name, *words):
                dask = pytest.importorskip(f"distributed.cli.dask_{name}", reason=NO_DASK)
                dask.main.make_context(name, list(words))
            case ("python", "-m", module, *words):
                known_to(module, words, command.block.where)
            case ("python", script, *_):
                assert (ROOT / script).is_file() or any(
                    block.file == script for block in BLOCKS[page]
                ), command
            case ("make", target, *_):
                assert re.search(
                    rf"(?m)^{target}:", (ROOT / "Makefile").read_text(encoding="utf-8")
                ), target
    for words in INLINE[page]:
        if words[0] == "navbench" and not any(PLACEHOLDER.search(word) for word in words):
            parse(list(words[1:]), f"{page.name}: {' '.join(words)}", is_whole=False)
        elif words[:2] == ("python", "-m") and words[2].startswith("tools."):
            known_to(words[2], list(words[3:]), f"{page.name}: {' '.join(words)}")


def parse(words: list[str], where: str, is_whole: bool = True) -> None:
    """Hold a command line against the program's parser, without doing anything."""
    context: click.Context = click.Context(app, info_name="navbench")
    command: click.Command = app
    while isinstance(command, click.Group) and words and words[0] != "--help":
        _, found, words = command.resolve_command(context, words)
        assert found is not None, where
        command = found
    try:
        command.make_context(
            command.name, list(words), parent=context, resilient_parsing=not is_whole
        )
    except click.exceptions.Exit as ended:  # --help
        assert ended.exit_code == 0, where
    except click.BadParameter as error:  # a file that only the page's reader has
        assert "does not exist" in error.format_message(), f"{where}: {error.format_message()}"
    except click.UsageError as error:
        pytest.fail(f"{where}: {error.format_message()}")


@functools.cache
def help_of(module: str) -> str:
    """What a tool says of its options; its source, too, if it has sub-commands.

    Of one without a parser that.
    """
    source = source_of(module).read_text(encoding="utf-8")
    if "argparse" not in source and "click" not in source:
        return source
    output, before = io.StringIO(), sys.argv
    sys.argv = [module, "--help"]
    try:
        with contextlib.redirect_stdout(output), pytest.raises(SystemExit) as ended:
            runpy.run_module(module, run_name="__main__")
    finally:
        sys.argv = before
    assert ended.value.code == 0
    return output.getvalue() + (source if "add_subparsers" in source else "")


def source_of(module: str) -> Path:
    """The file that ``python -m`` runs."""
    path = ROOT / module.replace(".", "/")
    return path / "__main__.py" if path.is_dir() else path.with_suffix(".py")


def known_to(module: str, words: list[str], where: str) -> None:
    """Hold the options and sub-commands of a tool against its help."""
    assert source_of(module).is_file(), where
    text, words = help_of(module), [word.strip("[]") for word in words]
    for word, before in zip(words, ["", *words], strict=False):
        is_value = (
            before.startswith("-")
            or PLACEHOLDER.search(word)
            or re.fullmatch(r"[\d.]+|.+/.+", word)
        )
        if word.startswith("-") or not is_value:
            assert word in text, f"{where}: {module} does not know '{word}'"


def test_nothing_is_declared_in_vain() -> None:
    everything = [str(command) for commands in COMMANDS.values() for command in commands]
    for pattern in NOT_EXECUTED:
        assert any(re.fullmatch(pattern, command) for command in everything), (
            f"no page has '{pattern}' any more"
        )
    words = {
        word for commands in COMMANDS.values() for command in commands for word in command.words
    }
    assert words >= set(EXCHANGED)
    assert {block.file for blocks in BLOCKS.values() for block in blocks} >= set(IN_FILES)
    for page, given in GIVEN.items():
        text = (ROOT / page if page == "README.md" else ROOT / "docs" / page).read_text(
            encoding="utf-8"
        )
        unused = [name for name in given if name not in text and name != "my_vectors"]
        assert not unused, f"{page} does not speak of {', '.join(unused)}"


@pytest.mark.parametrize("reason", [reason for reason in NOT_EXECUTED.values() if reason.test])
def test_what_is_executed_elsewhere_is(reason: Reason) -> None:
    path, _, name = reason.test.partition("::")
    tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))
    assert name in {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}, reason


@pytest.mark.parametrize(
    "line",
    [
        "navbench run --stcak nav2-gps",
        "navbench fly",
        "navbench tune --trials many",
        "navbench map old",
    ],
)
def test_what_the_program_does_not_know_fails(line: str) -> None:
    with pytest.raises((pytest.fail.Exception, AssertionError, click.UsageError)):
        parse(line.split()[1:], line)


def test_a_new_command_that_is_in_no_list_fails(tmp_path: Path) -> None:
    block = Block(ROOT / "README.md", 1, "sh", "rm -r results\n", "")
    with pytest.raises(pytest.fail.Exception, match="neither executed nor listed"):
        execute(commands_of(block)[0], tmp_path)
