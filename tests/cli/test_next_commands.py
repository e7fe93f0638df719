"""Commands that the program prints for its user to paste into a shell."""

import re
from pathlib import Path

import harness
import navbench
from navbench.cli.app import COMMANDS

NAMES = "|".join(re.escape(name) for name in sorted(COMMANDS))
# a path that stands behind one of them without harness.storage.texts.quoted
BEFORE = rf"(--resume|--stack|--map|navbench ({NAMES}|map losses))"
UNQUOTED = re.compile(rf"{BEFORE} \{{(?!quoted\(|shlex)")


def test_a_path_in_a_printed_command_is_one_word_to_a_shell() -> None:
    found = []
    for package in (harness, navbench):
        for file in sorted(Path(str(package.__file__)).parent.rglob("*.py")):
            for line in file.read_text(encoding="utf-8").splitlines():
                if UNQUOTED.search(line):
                    found.append(f"{file.name}: {line.strip()}")
    assert not found
