"""One delivery with each of other people's Nav2 files, of which docs/bring_your_own.md shows the table.

Usage: python benchmarks/foreign_files.py FILE ... [--substitute NAME=TYPE ...]

A substitute is taken where the file is refused without it. Columns: the file, how the delivery ended and after how
long, notes told before it began, and what was done.
"""

import argparse
import sys
import tempfile
from pathlib import Path

from harness.episode.episode import run_episode
from harness.report.markdown import table
from harness.study.preflight import check
from harness.task.study import Study, make_study
from navstack.errors import NavstackError


def prepared(file: Path, substitutes: list[str]) -> tuple[Study | None, int, str]:
    """The study of one delivery with a file (None: it is refused), the number of notes, and what was done."""
    said = ""
    for given in ([], substitutes):
        try:
            study = make_study(stacks=[str(file)], episodes=1, substitutes=given, world="easy")
            return study, len(check(study)), f"`--substitute {given[0]}`" if given else ""
        except NavstackError as error:
            said = str(error).removeprefix(f"{file}: ").removeprefix(f"{file.name}: ")
    return None, 0, f"refused: {said}"


def written_back(file: Path) -> bool:
    """Whether the file is written as it was read, byte by byte, and its merged form merges to itself."""
    from navstack.params.nav2_file.file import inspect_nav2

    with tempfile.TemporaryDirectory() as folder:
        copy, merged = Path(folder) / "copy.yaml", Path(folder) / "merged.yaml"
        nav2 = inspect_nav2(file, True)
        nav2.dump(copy)
        merged.write_text(nav2.dump_merged(), encoding="utf-8")
        again = inspect_nav2(merged, True).dump_merged()
        return copy.read_bytes() == file.read_bytes() and again == merged.read_text(encoding="utf-8")


def main() -> None:
    """Drive and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--substitute", action="append", default=[])
    arguments = parser.parse_args()
    rows, driven, kept = [], 0, 0
    for file in arguments.files:
        study, notes, done = prepared(file, arguments.substitute)
        outcome, seconds = "-", "-"
        if study is not None:
            row = run_episode(next(study.tasks())).row
            outcome, seconds, driven = row["outcome"], f"{row['duration_s']:.0f}", driven + 1
        kept += written_back(file)
        rows.append([file.stem, outcome, seconds, str(notes), done])
        print(f"{len(rows)} of {len(arguments.files)}", file=sys.stderr)
    print(table(["file", "outcome", "time [s]", "notes", ""], rows))
    print(f"\n{driven} of {len(rows)} files drive; {kept} are written back as they were read.")


if __name__ == "__main__":
    main()
