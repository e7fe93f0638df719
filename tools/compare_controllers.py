"""Four controllers on the same 400 deliveries.

What each earns, and each against DWB mission by mission.

Usage: python -m tools.compare_controllers [--episodes N] [--seed S] [--workers N] [--map NAME]
           [--world NAME] [--stack NAME ... | --parts NAME] --out FOLDER

The first stack is the one that the others are held against. Deliveries that FOLDER holds already
are not driven again, so a study that was interrupted goes on with the same command. The tables are
printed as Markdown and kept in FOLDER/controllers.md; ``navbench compare FOLDER:A FOLDER:B`` shows
all other metrics.

--parts holds a stack against itself with one part of its controller changed at a time;
FOLDER/params has the changed Nav2 files.
"""

import argparse
import dataclasses
import json
import sys
import tempfile
from pathlib import Path

from harness.analysis.compare import Comparison, compare
from harness.analysis.side import Side
from harness.report.markdown import table
from harness.report.numbers import interval_text
from harness.statistics.interval import wilson_interval
from harness.storage.shipped import shipped
from harness.study.places import Where
from harness.study.stored_run import load_run
from harness.task.study import make_study
from harness.world.outcome import OUTCOMES
from navbench.api.driving import begin
from navbench.api.run import drive_rest
from navbench.cli.driving import print_driven
from navbench.cli.signals import run_script
from navstack.errors import NavstackError
from navstack.params.nav2_file.edit import set_value
from navstack.params.nav2_file.ros_yaml import Value
from navstack.params.strict import load_yaml

STACKS = ("nav2-gps-ekf", "mpc-gps-ekf", "mppi-gps-ekf", "rpp-gps-ekf")
MARGIN = "contribution_margin"
PAIRED = {  # key of navbench compare -> heading
    MARGIN: "margin [USD]",
    "sla": "SLA",
    "spoiled": "spoiled",
    "timeout": "timeout",
    "physical_assistance": "assistance",
    "pedestrian_safety": "injuries [USD]",
    "avg_pedestrian_contacts": "contacts with people",
    "avg_soft_contacts": "soft contacts",
    "avg_velocity_mps": "speed [m/s]",
}
STACK = "stack."  # begins parameters of the stack file, not of the Nav2 file
PARTS: dict[str, dict[str, dict[str, Value]]] = load_yaml(Path(__file__).with_name("parts.yaml"))


def what_each_does(comparisons: dict[str, Comparison], sides: list[Side]) -> str:
    """Means of every stack; shares of deliveries with Wilson's interval."""
    means = [key for key in PAIRED if key not in OUTCOMES]
    rows = []
    for side in sides:
        outcomes = [row["outcome"] for row in side.stack.rows]
        shares = [
            interval_text(wilson_interval(outcomes.count(key), len(outcomes)), 3)
            for key in OUTCOMES
        ]
        if side.stack.name in comparisons:
            values = {
                key: entry.second for key, entry in comparisons[side.stack.name].differences.items()
            }
        else:
            values = {
                key: entry.first
                for key, entry in next(iter(comparisons.values())).differences.items()
            }
        rows.append(
            [side.stack.name, str(len(outcomes)), *shares, *(f"{values[key]:.3f}" for key in means)]
        )
    return table(["stack", "n", *(PAIRED[key] for key in (*OUTCOMES, *means))], rows)


def against_the_first(comparisons: dict[str, Comparison], sides: list[Side]) -> str:
    """Paired differences with 95 % intervals.

    The margin's also without the mission of the dearest injuries.
    """
    rows = [
        [title, *(difference_text(comparison, key) for comparison in comparisons.values())]
        for key, title in PAIRED.items()
    ]
    first, *others = without_the_dearest(sides)
    fewer = [compare(first, other, [MARGIN]) for other in others]
    rows.append(
        [
            f"{PAIRED[MARGIN]} without the dearest mission",
            *(difference_text(each, MARGIN) for each in fewer),
        ]
    )
    return table(["", *comparisons], rows)


def without_the_dearest(sides: list[Side]) -> list[Side]:
    """All stacks without the one mission in which injuries cost any of them most."""
    all_rows = (row for side in sides for row in side.stack.rows)
    dearest = max(all_rows, key=lambda row: row["pedestrian_injury_usd"])["episode"]
    kept = [[row for row in side.stack.rows if row["episode"] != dearest] for side in sides]
    return [
        Side(side.run, dataclasses.replace(side.stack, rows=tuple(rows)))
        for side, rows in zip(sides, kept, strict=True)
    ]


def difference_text(comparison: Comparison, key: str) -> str:
    """A paired difference with its interval and its p value."""
    entry = comparison.differences.get(key)
    if entry is None:
        return "--"
    return (
        f"{interval_text(entry.paired.difference, 3)}, p = {entry.paired.p:.4f}"
        if entry.differs
        else "none"
    )


def tables(folder: Path) -> str:
    """Both tables of a finished study."""
    run = load_run(str(folder))
    sides = [Side(run, stack) for stack in run.stacks]
    comparisons = {side.stack.name: compare(sides[0], side) for side in sides[1:]}
    about = f"{len(sides[0].stack.rows)} missions, seed {run.seed}, map {run.map_name}"
    return (
        f"{about}\n\n{what_each_does(comparisons, sides)}\n\n"
        f"Minus {sides[0].stack.name}, paired, 95 % "
        f"intervals:\n\n{against_the_first(comparisons, sides)}\n"
    )


def with_variants(name: str, folder: Path) -> list[str]:
    """A stack, and stack files in a folder that change one part of its Nav2 file each."""
    stack = load_yaml(shipped("params") / "stacks" / f"{name}.yaml")
    original = (shipped("params") / "nav2" / f"{stack['nav2_file']}.yaml").read_text(
        encoding="utf-8"
    )
    files = []
    for variant, changes in PARTS[name].items():
        text, fields = (
            original,
            {**stack, "title": f"{name}, {variant}", "nav2_file": f"{variant}-nav2.yaml"},
        )
        for path, value in changes.items():
            node, _, parameter = path.partition(".")
            if path.startswith(STACK):
                fields[parameter] = value
            else:
                text = set_value(text, (node,), parameter, value, f"{variant}: {path}")
        (folder / f"{variant}-nav2.yaml").write_text(text, encoding="utf-8")
        # YAML, too
        (folder / f"{variant}.yaml").write_text(
            json.dumps(fields, indent=2) + "\n", encoding="utf-8"
        )
        files.append(str(folder / f"{variant}.yaml"))
    return [name, *files]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--episodes", type=int, default=400)
    parser.add_argument("--seed", type=int, default=2000)
    parser.add_argument("--workers", type=int)
    parser.add_argument("--map", default="sidewalk")
    parser.add_argument("--world", default="easy")
    parser.add_argument("--stack", nargs="+", default=list(STACKS))
    parser.add_argument("--parts", choices=tuple(PARTS))
    parser.add_argument("--out", type=Path, required=True)
    asked = parser.parse_args()
    try:
        if (asked.out / "run.json").exists():
            driven = drive_rest(asked.out, Where(workers=asked.workers))
        else:
            with tempfile.TemporaryDirectory() as variants:
                study = make_study(
                    stacks=with_variants(asked.parts, Path(variants))
                    if asked.parts
                    else asked.stack,
                    episodes=asked.episodes,
                    seed=asked.seed,
                    map_name=asked.map,
                    world=asked.world,
                    workers=asked.workers,
                )
                driven = begin(study, asked.out, Where())
        status = print_driven(driven, as_json=False)
        if status:
            sys.exit(status)
        text = tables(asked.out)
    except NavstackError as error:
        sys.exit(str(error))
    (asked.out / "controllers.md").write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    run_script(main)
