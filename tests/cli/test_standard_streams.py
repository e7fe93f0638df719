"""What the program does when its standard output is full, closed, or left by its reader."""

import errno
import os
import subprocess
import sys
from pathlib import Path

import click
import pytest

from harness.storage.files import replacing
from navbench.cli.app import main

NAVBENCH = [sys.executable, "-c", "from navbench.cli.app import main; main()"]
# more than fits into a buffer, and less, which is written when the program ends
PRINTED = [["paper"], ["--help"]]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full")
@pytest.mark.parametrize("words", PRINTED)
def test_a_full_disk_is_one_line(words: list[str]) -> None:
    with open("/dev/full", "w", encoding="utf-8") as full:
        done = subprocess.run(
            [*NAVBENCH, *words], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert done.returncode == 1
    assert (
        done.stderr.startswith("navbench: standard output cannot be written")
        and done.stderr.count("\n") == 1
    )


@pytest.mark.parametrize("words", PRINTED)
def test_a_reader_who_leaves_early_is_no_error(words: list[str]) -> None:
    end, beginning = os.pipe()
    os.close(end)
    done = subprocess.run(
        [*NAVBENCH, *words], stdout=beginning, stderr=subprocess.PIPE, text=True, check=False
    )
    os.close(beginning)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_character_that_has_no_bytes_is_written_as_its_escape() -> None:
    """A file's name or a key may be no text that an encoding has bytes for."""
    program = "import click\nfrom navbench.cli.app import main\n"
    program += "say = click.Command('say', callback=lambda: click.echo('a\\udcffb'))\nmain([], say)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, check=False)
    assert (done.returncode, done.stdout.strip(), done.stderr) == (0, rb"a\udcffb", b"")


def test_closed_streams_lead_to_nowhere(tmp_path: Path) -> None:
    """The next file would get the number of standard output, and with it what children print."""
    program = "import os, sys; os.close(1); os.close(2); sys.stdout = sys.stderr = None\n"
    program += "from navbench.cli.app import main\nmain(['paper'])"
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0
    program = program.replace("'paper'", "'nonsense'")
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 2


@pytest.mark.parametrize("trouble", [errno.ENOSPC, errno.EACCES, errno.ENOENT])
def test_a_file_that_cannot_be_written_is_named_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], trouble: int
) -> None:
    @click.command()
    def full() -> None:
        with replacing(tmp_path / "robot.yaml"):
            raise OSError(trouble, os.strerror(trouble))

    with pytest.raises(SystemExit) as leaving:
        main([], full)
    said = capsys.readouterr().err
    assert leaving.value.code == 1 and said.count("\n") == 1
    assert f"'{tmp_path / 'robot.yaml'}' cannot be used ({os.strerror(trouble)})" in said
