"""Situations written down as data, driven and judged."""

from collections.abc import Iterable
from pathlib import Path

from harness.scenarios.runner import Result, run_scenario


def scenario(files: Iterable[Path]) -> list[Result]:
    """Drive scenario files one after the other and check what comes of them.

    Raises:
        InputError: a file, or something that it names, cannot be used.
    """
    return [run_scenario(path) for path in files]
