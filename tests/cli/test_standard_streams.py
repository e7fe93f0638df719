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


@pytest.mark.parametrize("leaves", [True, False])
def test_work_and_answer_go_on_where_nobody_reads_what_is_said(leaves: bool) -> None:
    program = "import click\nfrom navbench.api.progress import count_shown, say\n"
    program += "from navbench.cli.app import main\n@click.command()\ndef work():\n"
    program += "    with count_shown('deliveries', 2) as step:\n        say('a note')\n"
    program += "        step()\n    say('x' * 100000)\n    click.echo('the answer')\n"
    program += "    raise SystemExit(3)\nmain([], work)"
    if leaves:
        end, beginning = os.pipe()
        os.close(end)
    else:
        beginning = os.open("/dev/full", os.O_WRONLY)
    done = subprocess.run(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=beginning, check=False
    )
    os.close(beginning)
    assert (done.returncode, done.stdout) == (3, b"the answer\n")


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
    opened = program.partition("main(['paper'])")[0]
    opened += "from navbench.cli.streams import provide_streams\nprovide_streams()\n"
    opened += f"raise SystemExit(open({str(tmp_path / 'run')!r}, 'w').fileno())"
    assert subprocess.run([sys.executable, "-c", opened], check=False).returncode > 2
    program = program.replace("'paper'", "'nonsense'")
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 2


@pytest.mark.parametrize(
    ("trouble", "told"),
    [
        (OSError(errno.EMFILE, os.strerror(errno.EMFILE)), "Too many open files"),
        (FileNotFoundError(errno.ENOENT, "No usable temporary directory"), "TMPDIR"),
        (MemoryError(), "fewer --workers"),
    ],
)
def test_what_the_system_refuses_is_one_line(
    capsys: pytest.CaptureFixture[str], trouble: Exception, told: str
) -> None:
    @click.command()
    def refused() -> None:
        raise trouble

    with pytest.raises(SystemExit) as leaving:
        main([], refused)
    said = capsys.readouterr().err
    assert leaving.value.code == 1 and said.count("\n") == 1
    assert told in said


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
