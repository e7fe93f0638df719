"""Recordings of people: CSV files and obsmat.txt."""

from collections.abc import Callable, Iterator
from pathlib import Path

from .case import Case, Make, pipe, put, run_arguments

RECORDINGS: dict[str, Callable[[], str | bytes]] = {
    "is empty": lambda: "",
    "is binary": lambda: bytes(range(256)) * 3,
    "is UTF-16": lambda: "id,t,x,y\n1,0,5,5\n".encode("utf-16"),
    "has a header only": lambda: "id,t,x,y\n",
    "has no header": lambda: "1,0,5,5\n1,1,6,5\n",
    "has a column twice": lambda: "id,t,x,x\n1,0,5,5\n",
    "lacks a column": lambda: "id,t,x\n1,0,5\n",
    "has a short row": lambda: "id,t,x,y\n1,0,5\n",
    "has a long row": lambda: "id,t,x,y\n1,0,5,5,5\n",
    "is cut off in a quoted field": lambda: 'id,t,x,y\n1,0,"5,5\n1,1,6,5\n',
    "has a NUL": lambda: "id,t,x,y\n1,0,5\x00,5\n",
    "has words": lambda: "id,t,x,y\n1,zero,5,5\n",
    "has a time that is no number": lambda: "id,t,x,y\n1,nan,5,5\n",
    "has an infinite place": lambda: "id,t,x,y\n1,0,inf,5\n",
    "has a place of 400 digits": lambda: f"id,t,x,y\n1,0,{'9' * 400},5\n",
    "has astronomic places": lambda: "id,t,x,y\n1,0,5,5\n1,1,1e300,-1e300\n",
    "has astronomic times": lambda: "id,t,x,y\n1,-1e308,5,5\n1,1e308,6,5\n",
    "has somebody in two places": lambda: "id,t,x,y\n1,0,5,5\n1,0,6,5\n",
    "has a teleport": lambda: "id,t,x,y\n1,0,5,5\n1,1e-6,10,5\n",
    "goes back in time": lambda: "id,t,x,y\n1,1,5,5\n1,0,6,5\n",
    "lies off the map": lambda: "id,t,x,y\n1,0,500,500\n1,1,501,500\n",
    "has a field of 200 000 characters": lambda: f"id,t,x,y\n1,0,{'5' * 200_000},5\n",
    "has 100 000 people": lambda: "id,t,x,y\n" + "".join(f"{i},0,5,5\n" for i in range(100_000)),
    "has 100 MB": lambda: b"id,t,x,y\n" + b"1,0,5,5\n" * 12_500_000,
}
OBSMATS: dict[str, Callable[[], str | bytes]] = {
    "has seven columns": lambda: "1 1 5 0 5 0 0\n",
    "has words": lambda: "1 1 five 0 5 0 0 0\n",
    "has no lines": lambda: "\n\n",
}


def cases() -> Iterator[Case]:
    """Everything with ``--people FILE``."""
    for what, content in RECORDINGS.items():
        yield Case(
            f"people: CSV {what}",
            "off the map" if "off the map" in what else "people.csv",
            _given(content, "people.csv"),
        )
    for what, content in OBSMATS.items():
        yield Case(f"people: obsmat {what}", "obsmat.txt", _given(content, "obsmat.txt"))
    yield Case(
        "people: CSV does not exist",
        "people.csv",
        lambda folder: _arguments(folder, folder / "people.csv"),
    )
    yield Case(
        "people: CSV is a pipe",
        "people.csv",
        lambda folder: _arguments(folder, pipe(folder / "people.csv")),
    )
    yield Case(
        "people: CSV is a device", "/dev/zero", lambda folder: _arguments(folder, Path("/dev/zero"))
    )


def _given(content: Callable[[], str | bytes], name: str) -> Make:
    return lambda folder: _arguments(folder, put(folder / name, content()))


def _arguments(folder: Path, recording: Path) -> list[str]:
    return run_arguments(folder, "--people", str(recording), pedestrians=())
