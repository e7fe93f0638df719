"""What can be wrong with any YAML file, tried on every kind that is read."""

from collections.abc import Callable, Iterator
from pathlib import Path

from .case import Case, pipe, put, run_arguments, shipped_text, write_map

Command = Callable[[Path, Path], list[str]]  # folder, file -> arguments

LAUGHS = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]\n" for i in range(1, 12)
)
ATTACKS: dict[str, str | bytes] = {
    "is empty": b"",
    "is binary": bytes(range(256)) * 4,
    "is a list": "- 1\n- 2\n",
    "is a text": "nothing but text\n",
    "is a number": "1\n",
    "runs a program by a tag": "!!python/object/apply:os.system ['touch hacked']\n",
    "multiplies its anchors": LAUGHS,
    "has an anchor that contains itself": "a: &a [*a]\n",
    "has a mapping that contains itself": "a: &a {b: *a}\n",
    "merges itself": "a: &a\n  <<: *a\n",
    "has a list as key": "? [1, 2]\n: 3\n",
    "is nested 400 deep and closed": "a: " + "[" * 400 + "]" * 400 + "\n",
    "has five million characters": "# " + "x" * 5_000_000 + "\n",
    "has many keys": "".join(f"key_{i}: {i}\n" for i in range(25_000)),
    "has a number of 100 000 digits": "a: " + "9" * 100_000 + "\n",
    "gives a key twice": "a: 1\na: 2\n",
}
# what is no YAML at all: one of the kinds that a reader reads speaks for the others
SYNTAX: dict[str, str | bytes] = {
    "is Latin-1": "title: Gerät\n".encode("latin-1"),
    "is UTF-16": "title: x\n".encode("utf-16"),
    "has a NUL byte": b"title: a\x00b\n",
    "is cut off in a quoted text": 'title: "no end',
    "is cut off in a list": "a: [1, 2",
    "is indented with a tab": "a:\n\tb: 1\n",
    "is two documents": "a: 1\n---\na: 2\n",
    "makes an object by a tag": "a: !!python/object/new:subprocess.Popen [[touch, hacked]]\n",
    "has an unknown tag": "a: !surprise 1\n",
    "has an alias without anchor": "a: *nobody\n",
    "is nested 20 000 deep": "a: " + "[" * 20_000,  # half a second until it is refused
}
ONE_OF_EACH_READER = ("Nav2 file", "stack")


def _map(folder: Path, file: Path) -> list[str]:
    write_map(folder).unlink()
    return run_arguments(folder, map_name=file)


def _option(option: str) -> Command:
    return lambda folder, file: run_arguments(folder, option, str(file))


def _stack(folder: Path, file: Path) -> list[str]:
    return run_arguments(folder, stack=str(file))


def _nav2(folder: Path, file: Path) -> list[str]:
    own = put(
        folder / "mine.yaml",
        shipped_text("stacks", "nav2-gps").replace("nav2_file: gps_ekf", f"nav2_file: {file}"),
    )
    return run_arguments(folder, stack=str(own))


def _sensors(folder: Path, file: Path) -> list[str]:
    own = put(
        folder / "mine.yaml", shipped_text("stacks", "nav2-gps").replace("rtk_good", str(file))
    )
    return run_arguments(folder, stack=str(own))


COMMANDS: dict[str, Command] = {
    "map": _map,
    "shown map": lambda folder, file: ["map", "show", str(file), "--json"],
    "stack": _stack,
    "Nav2 file": _nav2,
    "linted file": lambda folder, file: ["lint", str(file)],
    "sensors": _sensors,
    "robot": _option("--robot"),
    "world": _option("--world"),
    "rules": _option("--rules"),
    "prices": _option("--prices"),
    "suite": lambda folder, file: ["suite", str(file), "--out", str(folder / "out")],
    "scenario": lambda folder, file: ["scenario", str(file)],
}


def cases() -> Iterator[Case]:
    """Every attack on every kind of file, and what is no file at all."""
    for kind, command in COMMANDS.items():
        for what, content in (ATTACKS | (SYNTAX if kind in ONE_OF_EACH_READER else {})).items():
            yield Case(f"{kind}: {what}", "given.yaml", _writes(command, content))
        yield Case(
            f"{kind}: does not exist",
            "given.yaml",
            lambda folder, c=command: c(folder, folder / "given.yaml"),
        )
        yield Case(f"{kind}: is a folder", "given.yaml", _folder(command))
        yield Case(
            f"{kind}: is a pipe",
            "given.yaml",
            lambda folder, c=command: c(folder, pipe(folder / "given.yaml")),
        )


def _writes(command: Command, content: str | bytes) -> Callable[[Path], list[str]]:
    return lambda folder: command(folder, put(folder / "given.yaml", content))


def _folder(command: Command) -> Callable[[Path], list[str]]:
    def make(folder: Path) -> list[str]:
        (folder / "given.yaml").mkdir()
        return command(folder, folder / "given.yaml")

    return make
