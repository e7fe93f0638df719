"""Sets up drives with extreme values of a file's numbers, one after the other.

It says what came of each. A program of its own, so that whoever starts it may stop it:
python extremes.py SEED COUNT FILE..., where a count of 0 means all.
"""

import json
import math
import random
import resource
import sys
import tempfile
import time
import types
import typing
from collections.abc import Iterator
from pathlib import Path

import navstack  # noqa: F401 - before numpy
from harness.study import preflight
from harness.task.study import make_study
from navbench.api.lint import lint
from navstack.errors import NavstackError
from navstack.params.nav2_file import edit
from navstack.params.nav2_file.file import Nav2File, inspect_nav2
from navstack.params.registry.bindings import parameter_of

VALUES = (0, -1, 1e-9, 1e9, 2e9, math.nan, math.inf)


def number_kind(hint: object) -> type | None:
    """float or int where a hint, perhaps optional, is one; None for texts, lists and others."""
    if typing.get_origin(hint) is typing.Annotated:
        return number_kind(typing.get_args(hint)[0])
    if typing.get_origin(hint) in (typing.Union, types.UnionType):
        return next(filter(None, map(number_kind, typing.get_args(hint))), None)
    return hint if hint in (float, int) else None


def cases(nav2: Nav2File) -> Iterator[tuple[str, str, float]]:
    """Node, dotted name and value of every change."""
    for node, visits in nav2.visits.items():
        for visit in visits:
            for field, hint in typing.get_type_hints(visit.params, include_extras=True).items():
                kind = number_kind(hint)
                for value in VALUES if kind else ():
                    if kind is float or float(value).is_integer():
                        yield node, f"{visit.prefix}{parameter_of(field)}", kind(value)


def refusal(file: Path) -> str:
    """What ``navbench run`` says before anything drives; empty: it drives."""
    try:
        preflight.check(make_study(stacks=[str(file)], episodes=1, workers=1, pedestrians=0))
    except NavstackError as error:
        return str(error)
    return ""


def _say(*values: object) -> None:
    sys.stdout.write(json.dumps(values) + "\n")
    sys.stdout.flush()


def main(seed: int, count: int, *files: str) -> None:
    """Print one JSON line per case when it begins, and one when it has ended."""
    preflight.compile_ahead = lambda stacks: None
    chosen = []
    for file in files:
        nav2 = inspect_nav2(Path(file), allow_unknown=True)
        chosen += [(nav2, *case) for case in cases(nav2)]
    if count:
        chosen = random.Random(seed).sample(chosen, count)
    refusal(Path(files[0]))  # what all have in common is compiled and built
    with tempfile.TemporaryDirectory() as folder:
        for number, (nav2, node, name, value) in enumerate(chosen):
            _say(nav2.path.name, node, name, str(value))
            changed = Path(folder, f"{number}.yaml")  # files are kept by their paths
            place = nav2._owner_of(node, name)
            text = edit.set_values(nav2.document.text, [(place, name, value)], str(nav2.path))
            changed.write_text(text)
            before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            begin = time.process_time()
            errors = lint(str(changed)).errors
            refused = refusal(changed)
            seconds = time.process_time() - begin
            grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1e6  # [GB]
            lines = [error.line for error in errors]
            _say(refused, lines, seconds, grown)


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), *sys.argv[3:])
