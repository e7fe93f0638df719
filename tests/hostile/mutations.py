"""Valid inputs with one random change each.

What nobody thought of ends in one clear line, or is a valid input, too.

Usage: python -m tests.hostile.mutations [--number N] [--seed S]: tries them and tells which of them
harm.
"""

import argparse
import random
import re
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from .case import MAP_TEXT, RULES, good_pgm, put, shipped_text
from .yaml_attacks import COMMANDS, Command

NUMBER = re.compile(r"(?:(?<=[:,] )|(?<=\[))-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?=\s*(?:[,\]}#\n]|$))")
KEY = re.compile(r"^( *)([a-z_]+):", re.MULTILINE)
Change = Callable[[str, random.Random], str]


@dataclass(frozen=True)
class Mutant:
    """A changed input."""

    title: str
    is_impossible: bool  # no program may take it for a valid one
    make: Callable[[Path], list[str]]  # as of Case


def _number(value: str) -> Change:
    def change(text: str, rng: random.Random) -> str:
        numbers = list(NUMBER.finditer(text))
        if not numbers:
            return text.replace(": ", f": [{value}], ", 1)
        found = rng.choice(numbers)
        return text[: found.start()] + value.replace("{}", found[0]) + text[found.end() :]

    return change


def _line(change: Callable[[list[str], int], list[str]]) -> Change:
    def changed(text: str, rng: random.Random) -> str:
        lines = text.splitlines(keepends=True)
        return "".join(change(lines, rng.randrange(len(lines))))

    return changed


def _misspelt(text: str, rng: random.Random) -> str:
    found = rng.choice(list(KEY.finditer(text)))
    at = found.start(2) + rng.randrange(len(found[2]))
    return text[:at] + text[at + 1 :]


def _cut(text: str, rng: random.Random) -> str:
    return text[: rng.randrange(len(text))]


def _flipped(text: str, rng: random.Random) -> str:
    at = rng.randrange(len(text))
    return text[:at] + chr(rng.randrange(256)) + text[at + 1 :]


# what is done -> how, and whether the result cannot be valid
CHANGES: dict[str, tuple[Change, bool]] = {
    "a number is not a number": (_number(".nan"), True),
    "a number is infinite": (_number(".inf"), True),
    "a number is a text": (_number("heavy"), True),
    "a number is a list": (_number("[1, [2]]"), True),
    "a number is a mapping": (_number("{a: 1}"), True),
    "a number is nothing": (_number(""), False),  # a list only grows shorter
    "a number is negative": (_number("-{}"), False),
    "a number is astronomic": (_number("{}e+30"), False),
    "a number is zero": (_number("0"), False),
    "a number is a truth": (_number("yes"), False),
    "a key is misspelt": (_misspelt, False),
    "a line is missing": (_line(lambda lines, n: lines[:n] + lines[n + 1 :]), False),
    "a line is there twice": (_line(lambda lines, n: lines[: n + 1] + lines[n:]), False),
    "a line is indented": (
        _line(lambda lines, n: [*lines[:n], "   " + lines[n], *lines[n + 1 :]]),
        False,
    ),
    "the end is missing": (_cut, False),
    "a character is another": (_flipped, False),
}
VALID: dict[str, Callable[[], str]] = {  # kind of COMMANDS -> a valid file
    "map": lambda: MAP_TEXT,
    "shown map": lambda: MAP_TEXT,
    "stack": lambda: shipped_text("stacks", "nav2-gps"),
    "Nav2 file": lambda: shipped_text("nav2", "gps_ekf"),
    "linted file": lambda: shipped_text("nav2", "gps_ekf"),
    "sensors": lambda: shipped_text("sensors", "rtk_good"),
    "robot": lambda: shipped_text("robots", "segway_e1"),
    "world": lambda: shipped_text("worlds", "easy"),
    "rules": lambda: RULES,
    "prices": lambda: shipped_text("prices", "costnav"),
}
FREE = ("Nav2 file", "linted file")  # Nav2 takes infinity, and ignores what it does not read


def mutants(number: int, seed: int) -> Iterator[Mutant]:
    """So many changed inputs, of every kind in turn."""
    rng = random.Random(seed)
    kinds = tuple(VALID)
    for n in range(number):
        kind = kinds[n % len(kinds)]
        what = rng.choice(list(CHANGES))
        change, is_impossible = CHANGES[what]
        content = change(VALID[kind](), rng)
        yield Mutant(
            f"{n} {kind}: {what}",
            is_impossible and kind not in FREE,
            _writes(COMMANDS[kind], content, kind),
        )


def _writes(command: Command, content: str, kind: str) -> Callable[[Path], list[str]]:
    def make(folder: Path) -> list[str]:
        arguments = command(folder, put(folder / "given.yaml", content))
        if "map" in kind:
            put(folder / "map.pgm", good_pgm())
        return arguments

    return make


def main() -> None:
    """Try them; 1 if any of them harms."""
    from .trial import try_mutants

    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--number", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as root:
        results = try_mutants(given.number, given.seed, Path(root))
    told = Counter(each.verdict for each in results)
    for each in results:
        if each.is_bad:
            sys.stdout.write(f"{each.title}: {each.verdict}: {each.said.strip()[-300:]}\n")
    sys.stdout.write(
        ", ".join(f"{count} {verdict}" for verdict, count in sorted(told.items())) + "\n"
    )
    sys.exit(any(each.is_bad for each in results))


if __name__ == "__main__":
    main()
