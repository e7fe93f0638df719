"""One malformed input, and the valid ones that most of them are made from."""

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness.storage.shipped import shipped
from tests.rules import short_rules

Make = Callable[[Path], list[str]]

MAP_TEXT = (
    "image: map.pgm\nresolution: 0.1\norigin: [0.0, 0.0, 0.0]\nnegate: 0\n"
    "occupied_thresh: 0.65\nfree_thresh: 0.2\n"
)
SIDE = 100  # [pixels] of the valid map: 10 m
RULES = short_rules(1.0)
POSES = ("--start", "2,2,0", "--goal", "8,8,0")


@dataclass(frozen=True)
class Case:
    """An input and what must be said of it."""

    title: str  # what is wrong with it
    says: str  # part of the one line: the file, key or value that it names
    make: Make  # writes the files into an empty folder; returns the arguments of navbench

    @property
    def group(self) -> str:
        """What kind of input it is: the title up to the colon."""
        return self.title.partition(":")[0]


def good_pgm(side: int = SIDE) -> bytes:
    """Free ground within a wall."""
    row = b"\x00" + b"\xfe" * (side - 2) + b"\x00"
    return b"P5\n%d %d\n255\n" % (side, side) + b"\x00" * side + row * (side - 2) + b"\x00" * side


def write_map(folder: Path, text: str | bytes = MAP_TEXT, **files: bytes) -> Path:
    """A map with its image; ``files`` by name with ``__`` for the dot replace or join them."""
    put(folder / "map.yaml", text)
    put(folder / "map.pgm", good_pgm())
    for name, content in files.items():
        put(folder / name.replace("__", "."), content)
    return folder / "map.yaml"


def put(path: Path, content: str | bytes) -> Path:
    """Write a file, whatever it is made of."""
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def run_arguments(
    folder: Path,
    *more: str,
    stack: str = "parked",
    map_name: Path | None = None,
    pedestrians: tuple[str, ...] = ("--pedestrians", "0"),
) -> list[str]:
    """One delivery of a second on the valid map, or another."""
    if "--rules" not in more:
        more = (*more, "--rules", str(put(folder / "rules.yaml", RULES)))
    chosen = map_name or write_map(folder)
    options = (
        "--stack",
        stack,
        "--map",
        str(chosen),
        "--episodes",
        "1",
        "--workers",
        "1",
        *pedestrians,
    )
    return ["run", *options, *POSES, "--out", str(folder / "out"), *more]


def shipped_text(kind: str, name: str) -> str:
    """A parameter file of the program."""
    return (shipped("params") / kind / f"{name}.yaml").read_text()


def changed(text: str, changes: Mapping[str, Any]) -> str:
    """A text with each key of ``changes`` replaced by its value; every key must be there."""
    for old, new in changes.items():
        assert old in text, f"the valid input has no {old!r}"
        text = text.replace(old, str(new), 1)
    return text


def pipe(path: Path) -> Path:
    """A pipe into which nobody writes: opening it waits for ever."""
    os.mkfifo(path)
    return path
