"""A tuning study from a shipped stack to its proof: tuned file against the original and against a third one.

Usage: python benchmarks/tuning_study.py critics|weights --out FOLDER [--trials N] [--episodes N] [--test-episodes N]
           [--waterfall N] [--seed S] [--workers N] [--world NAME]

``critics`` tunes DWB's critics of Nav2's stock file and holds the result against the paper's hand-tuned file too;
``weights`` tunes those of the jerk-limited MPC. All drive with ``navstack::IncrementalNavfn`` as planner. FOLDER gets
the files as they are driven (``stacks``), the folder of ``navbench tune`` (``study``), the third file's deliveries
(``rival``), and ``proof.md``: what all do on the test missions, and the paired differences. What was interrupted goes
on with the same command.
"""

import argparse
import dataclasses
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from harness.calibration.markdown import interval_text, table
from harness.cli import main as navbench
from harness.execution import Workers
from harness.manifest import load_study
from harness.metrics import Row
from harness.stack import load_stack
from harness.statistics import bootstrap_mean, compare_pairs, wilson_interval
from harness.tuning.evaluation import MARGIN, Candidate
from harness.tuning.journal import Journal
from harness.tuning.stack_evaluator import StackEvaluator
from harness.tuning.study import finish, load_tuning, run_search
from navstack.errors import NavstackError
from navstack.params.strict import dump_dataclass, read_text
from navstack.types import FloatArray

EXACT, INCREMENTAL = "nav2_navfn_planner::NavfnPlanner", "navstack::IncrementalNavfn"
OUTCOMES = ("sla", "spoiled", "timeout", "physical_assistance")


@dataclasses.dataclass(frozen=True, slots=True)
class Question:
    """What is tuned, how, and what the result is also held against."""

    stack: str
    localizer: str
    space: str
    rival: str  # a stack; empty: none


QUESTIONS = {
    "critics": Question("nav2-stock", "gps-ekf", "dwb_critics", "nav2-gps-ekf"),
    "weights": Question("mpc-gps-ekf", "gps-ekf", "mpc_weights", ""),
}


def incremental(name: str, localizer: str, folder: Path) -> Path:
    """Write a shipped stack with the incremental planner into a folder; returns its stack file.

    Raises:
        NavstackError: the stack has no planner to exchange.
    """
    stack = load_stack(name, localizer)
    text = read_text(Path(stack.nav2_file))
    if EXACT not in text:
        raise NavstackError(f"{stack.nav2_file}: no planner is {EXACT}; this study exchanges it")
    folder.mkdir(parents=True, exist_ok=True)
    written = dataclasses.replace(
        stack,
        name="",
        title=f"{stack.title}; {INCREMENTAL}",
        nav2_file=f"{name}.nav2.yaml",
        sensors=Path(stack.sensors).stem,
        robot=Path(stack.robot).stem,
    )
    (folder / written.nav2_file).write_text(text.replace(EXACT, INCREMENTAL), encoding="utf-8")
    (folder / f"{name}.yaml").write_text(dump_dataclass(written), encoding="utf-8")
    return folder / f"{name}.yaml"


def tune(arguments: Sequence[str]) -> None:
    """``navbench tune``; leaves the program where it does not finish."""
    try:
        navbench(["tune", *arguments])
    except SystemExit as ended:
        if ended.code:
            raise


def test_rows(folder: Path, rival: str, rival_folder: Path, workers: int | None) -> dict[str, Sequence[Row]]:
    """Rows of original, tuned file and rival (a stack file, or empty) on the test missions.

    Those of the first two are in the study's journal; the rival's are driven, but for those that its folder has.
    """
    base = load_study(folder, workers)
    study = load_tuning(folder, base, None)
    with Workers(base.workers) as pool:
        with Journal(folder) as journal:
            with StackEvaluator(study.template, pool, journal, lambda candidate, row: None) as evaluator:
                result = finish(study, run_search(study, evaluator, journal, lambda trial, best: None), evaluator)
        sides = dict(zip(("original", "tuned"), result.test_rows, strict=True))
        if rival:
            rival_folder.mkdir(exist_ok=True)
            stack = load_stack(rival)
            template = dataclasses.replace(study.template, stack=stack)
            with Journal(rival_folder) as journal, StackEvaluator(template, pool, journal, tell) as evaluator:
                sides[stack.name] = evaluator.rows(Candidate(stack.name, {}), result.test_missions)
    return sides


def tell(candidate: Candidate, row: Row) -> None:
    """A line of progress."""
    sys.stderr.write(f"{candidate.name}: delivery {row['episode']} {row.get('outcome') or row.get('error')}\n")


def column(rows: Sequence[Row], key: str) -> FloatArray:
    """A measured column as numbers, or a share of outcomes as 0 and 1."""
    if key in OUTCOMES:
        return np.array([float(row["outcome"] == key) for row in rows])
    return np.array([float(row[key]) for row in rows])


def proof(sides: dict[str, Sequence[Row]], seed: int) -> str:
    """Markdown: what each file does, and the tuned one minus each other, mission by mission."""
    shown = {MARGIN: "margin [USD]", **{key: key for key in OUTCOMES}, "pedestrian_contacts": "contacts with people"}
    paired = [
        index for index in range(len(sides["tuned"])) if all(rows[index].get("outcome") for rows in sides.values())
    ]
    kept = {name: [rows[index] for index in paired] for name, rows in sides.items()}
    rng = np.random.default_rng(seed)
    lines = []
    for name, rows in kept.items():
        shares = [
            interval_text(wilson_interval(int(column(rows, key).sum()), len(rows)), 3)
            if key in OUTCOMES
            else interval_text(bootstrap_mean(column(rows, key), rng), 3)
            for key in shown
        ]
        lines.append([name, str(len(rows)), *shares])
    differences = []
    clusters = np.arange(len(paired))
    for name in [each for each in kept if each != "tuned"]:
        cells = []
        for key in shown:
            found = compare_pairs(
                column(kept[name], key), column(kept["tuned"], key), clusters, rng, is_share=key in OUTCOMES
            )
            cells.append(f"{interval_text(found.difference, 3)}, p = {found.p:.4f}" if found.differs else "none")
        differences.append([name, *cells])
    whole = table(["", "n", *shown.values()], lines)
    return f"{whole}\n\n{table(['tuned minus', *shown.values()], differences)}\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("question", choices=QUESTIONS)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--trials", type=int, default=100)
    parser.add_argument("--episodes", type=int, default=32)
    parser.add_argument("--test-episodes", type=int, default=400)
    parser.add_argument("--waterfall", type=int, default=40)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int)
    parser.add_argument("--world", default="costnav")
    asked = parser.parse_args()
    question, out = QUESTIONS[asked.question], asked.out
    try:
        original = incremental(question.stack, question.localizer, out / "stacks")
        rival = incremental(question.rival, question.localizer, out / "stacks") if question.rival else ""
        workers = ["--workers", str(asked.workers)] if asked.workers else []
        if (out / "study" / "run.json").exists():
            tune(["--resume", str(out / "study"), *workers])
        else:
            options = ("trials", "episodes", "test_episodes", "waterfall", "seed", "world")
            given = [part for key in options for part in (f"--{key.replace('_', '-')}", str(getattr(asked, key)))]
            tune(["--stack", str(original), "--space", question.space, "--out", str(out / "study"), *given, *workers])
        text = proof(test_rows(out / "study", str(rival), out / "rival", asked.workers), asked.seed)
    except NavstackError as error:
        sys.exit(str(error))
    (out / "proof.md").write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
