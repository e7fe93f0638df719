"""A tuning study from a shipped stack to its proof.

Tuned file against the original and against others.

Usage: python -m tools.tuning_study critics|weights [--unraced] [--beside NAME] [--name NAME]
           [--workers N] [options of navbench tune: --space NAME ... --objective NAME --trials N
           --episodes N --finalists N --final-episodes N --test-episodes N --waterfall N --budget
           TIME --seed S --world NAME]

``critics`` tunes DWB's critics and the layers that it sees people through, from Nav2's stock file,
and holds the result against the paper's hand-tuned file, too; ``weights`` tunes those of the
jerk-limited MPC. All drive with ``navstack::IncrementalNavfn`` as planner. ``--unraced`` drives
every trial to the end, under a name of its own; ``--beside critics`` then sets the tuned file of
that study beside this one's, on the same test missions.

``results/baseline/tuning/NAME`` gets what is kept: ``proof.md`` (what all do on the test missions,
and the paired differences), the report's tables, the tuned file and its difference, the trials, and
``study.tar.xz`` with everything that the study goes on from, written every ten minutes and at the
end. The study itself is driven in ``results/tuning/NAME``. What was interrupted goes on with the
same command, in another checkout, too.
"""

import argparse
import contextlib
import dataclasses
import json
import os
import re
import shutil
import sys
import tarfile
import threading
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from harness.execution.workers import Workers
from harness.metrics.columns import Row
from harness.report.markdown import table
from harness.report.numbers import interval_text
from harness.statistics.bootstrap import bootstrap_mean
from harness.statistics.interval import wilson_interval
from harness.statistics.paired import compare_pairs
from harness.storage.run_folder import JOURNAL
from harness.study.manifest import load_study
from harness.task.stack import load_stack
from harness.tuning.budget import Budget
from harness.tuning.evaluation import MARGIN, Candidate
from harness.tuning.journal import Journal
from harness.tuning.output import DIFF, DOCUMENT, STACK, TRIALS, TUNED
from harness.tuning.stack_evaluator import StackEvaluator
from harness.tuning.study import finish, load_tuning, run_search
from harness.world.outcome import OUTCOMES
from navbench.cli.app import main as navbench
from navstack.errors import NavstackError
from navstack.params.strict import dump_dataclass, read_text
from navstack.types import FloatArray

EXACT, INCREMENTAL = "nav2_navfn_planner::NavfnPlanner", "navstack::IncrementalNavfn"
KEPT, DRIVEN = Path("results/baseline/tuning"), Path("results/tuning")
ARCHIVE, PERIOD = "study.tar.xz", 600.0  # [s] between writings
NEEDED = ("study/run.json", "study/params", f"study/{JOURNAL}", f"rival/{JOURNAL}")  # to go on from


@dataclasses.dataclass(frozen=True, slots=True)
class Question:
    """What is tuned, how, and what the result is also held against."""

    stack: str
    localizer: str
    spaces: tuple[str, ...]
    objective: str
    rival: str  # a stack; empty: none


QUESTIONS = {
    "critics": Question(
        "nav2-stock", "gps-ekf", ("dwb_critics", "local_layers"), "shared_margin", "nav2-gps-ekf"
    ),
    "weights": Question("mpc-gps-ekf", "gps-ekf", ("mpc_weights",), "shared_margin", ""),
}


def incremental(name: str, localizer: str, folder: Path) -> Path:
    """Write a shipped stack with the incremental planner and the MPC's quick solver.

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
    changed = text.replace(EXACT, INCREMENTAL)
    (folder / written.nav2_file).write_text(changed, encoding="utf-8")
    (folder / f"{name}.yaml").write_text(dump_dataclass(written), encoding="utf-8")
    return folder / f"{name}.yaml"


def unpack(driven: Path, archive: Path) -> None:
    """Bring back a study that another checkout began."""
    if not (driven / "study").exists() and archive.is_file():
        with tarfile.open(archive) as content:
            content.extractall(driven, filter="data")


def pack(driven: Path, archive: Path) -> None:
    """Write what a study goes on from.

    A last line of a journal that is cut off there is driven again.
    """
    archive.parent.mkdir(parents=True, exist_ok=True)
    new = archive.with_suffix(".new")
    with tarfile.open(new, "w:xz") as content:
        for name in NEEDED:
            if (driven / name).exists():
                content.add(driven / name, name, filter=anonymous)
    os.replace(new, archive)


def anonymous(member: tarfile.TarInfo) -> tarfile.TarInfo:
    """A file without its owner."""
    member.uid = member.gid = 0
    member.uname = member.gname = ""
    return member


@contextlib.contextmanager
def kept(driven: Path, archive: Path) -> Iterator[None]:
    """Pack now and then meanwhile, and at the end, however it comes."""
    stopped = threading.Event()

    def run() -> None:
        while not stopped.wait(PERIOD):
            pack(driven, archive)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    try:
        yield
    finally:
        stopped.set()
        thread.join()
        pack(driven, archive)


def tune(arguments: Sequence[str]) -> None:
    """``navbench tune``; leaves the program where it does not finish."""
    try:
        navbench(["tune", *arguments])
    except SystemExit as ended:
        if ended.code:
            raise


def test_rows(
    folder: Path,
    rival: str,
    rival_folder: Path,
    workers: int | None,
) -> dict[str, Sequence[Row]]:
    """Rows of original, tuned file and rival (a stack file, or empty) on the test missions.

    Those of the first two are in the study's journal; the rival's are driven, but for those that
    its folder has.
    """
    base = load_study(folder, workers)
    study = load_tuning(folder, base)
    with Workers(base.workers) as pool, TemporaryDirectory() as files:
        with Journal(folder) as journal:
            evaluator = StackEvaluator(
                study.template, pool, journal, lambda candidate, row: None, Path(files)
            )
            budget = Budget(None, journal)
            search = run_search(study, evaluator, journal, lambda trial, best: None, budget)
            result = finish(study, search, evaluator, journal, budget)
        sides = dict(zip(("original", "tuned"), result.test_rows, strict=True))
        if rival:
            rival_folder.mkdir(exist_ok=True)
            stack = load_stack(rival)
            template = dataclasses.replace(study.template, stack=stack)
            with Journal(rival_folder) as journal:
                evaluator = StackEvaluator(template, pool, journal, tell, Path(files))
                sides[stack.name] = evaluator.rows(Candidate(stack.name, {}), result.test_missions)
    return sides


def tell(candidate: Candidate, row: Row) -> None:
    """A line of progress."""
    sys.stderr.write(
        f"{candidate.name}: delivery {row['episode']} {row.get('outcome') or row.get('error')}\n"
    )


def column(rows: Sequence[Row], key: str) -> FloatArray:
    """A measured column as numbers, or a share of outcomes as 0 and 1."""
    if key in OUTCOMES:
        return np.array([float(row["outcome"] == key) for row in rows])
    return np.array([float(row[key]) for row in rows])


def proof(sides: dict[str, Sequence[Row]], seed: int) -> str:
    """Markdown: what each file does, and the tuned one minus each other, mission by mission."""
    shown = {
        MARGIN: "margin [USD]",
        **{key: key for key in OUTCOMES},
        "pedestrian_contacts": "contacts with people",
    }
    paired = [
        index
        for index in range(len(sides["tuned"]))
        if all(rows[index].get("outcome") for rows in sides.values())
    ]
    both = {name: [rows[index] for index in paired] for name, rows in sides.items()}
    rng = np.random.default_rng(seed)
    lines = []
    for name, rows in both.items():
        shares = [
            interval_text(wilson_interval(int(column(rows, key).sum()), len(rows)), 3)
            if key in OUTCOMES
            else interval_text(bootstrap_mean(column(rows, key), rng), 3)
            for key in shown
        ]
        lines.append([name, str(len(rows)), *shares])
    differences = []
    clusters = np.arange(len(paired))
    for name in [each for each in both if each != "tuned"]:
        cells = []
        for key in shown:
            found = compare_pairs(
                column(both[name], key),
                column(both["tuned"], key),
                clusters,
                rng,
            )
            cells.append(
                f"{interval_text(found.difference, 3)}, p = {found.p:.4f}"
                if found.differs
                else "none"
            )
        differences.append([name, *cells])
    whole = table(["", "n", *shown.values()], lines)
    return f"{whole}\n\n{table(['tuned minus', *shown.values()], differences)}\n"


def effort(document: Row) -> str:
    """A sentence of what the search drove."""
    driven, trials = document["training_episodes"], document["trials"]
    states = ", ".join(f"{count} {state}" for state, count in trials.items())
    return (
        f"Objective {', '.join(document['objectives'])}, space {document['space']['name']}, seed "
        f"{document['seed']}: "
        f"trials {states}; {driven['driven']} training deliveries ({driven['without_racing']} "
        "without racing), "
        f"{sum(each['missions'] for each in document['finals'])} of the final choice.\n\n"
    )


def keep(driven: Path, folder: Path, text: str) -> None:
    """Write what is kept beside the archive, without figures and this machine's paths."""
    for name in (TUNED, STACK, DIFF, TRIALS):
        shutil.copyfile(driven / "study" / name, folder / name)
    report = read_text(driven / "study" / "report.md")
    for path in ((driven / "study").resolve(), driven / "study"):
        report = report.replace(str(path), str(folder))
    lines = [line for line in report.splitlines() if not line.startswith(("![", "*"))]
    text_only = re.sub(r"\n{3,}", "\n\n", "\n".join(lines))
    (folder / "report.md").write_text(f"{text_only}\n", encoding="utf-8")
    (folder / "proof.md").write_text(text, encoding="utf-8")


def arguments_of(
    given: Sequence[str],
    question: Question,
    original: Path,
    study: Path,
) -> list[str]:
    """Of ``navbench tune``: the question's, then those that are given, which win."""
    if (study / "run.json").exists():
        return ["--resume", str(study)]
    spaces: list[str] = []
    if "--space" not in given:
        for space in question.spaces:
            spaces += ["--space", space]
    own = ["--objective", question.objective, "--world", "easy"]
    return ["--stack", str(original), "--out", str(study), *spaces, *own, *given]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("question", choices=QUESTIONS)
    parser.add_argument("--unraced", action="store_true")
    for name in ("beside", "name"):
        parser.add_argument(f"--{name}")
    parser.add_argument("--workers", type=int)
    asked, given = parser.parse_known_args()
    question, name = QUESTIONS[asked.question], asked.question
    if asked.unraced:
        given.append("--no-racing")
        name += "-unraced"
    name = asked.name or name
    driven, folder = DRIVEN / name, KEPT / name
    try:
        unpack(driven, folder / ARCHIVE)
        original = incremental(question.stack, question.localizer, driven / "stacks")
        rival, workers = "", []
        if question.rival:
            rival = str(incremental(question.rival, question.localizer, driven / "stacks"))
        if asked.workers:
            workers = ["--workers", str(asked.workers)]
        with kept(driven, folder / ARCHIVE):
            tune([*arguments_of(given, question, original, driven / "study"), *workers])
            sides = test_rows(driven / "study", rival, driven / "rival", asked.workers)
        if asked.beside:
            unpack(DRIVEN / asked.beside, KEPT / asked.beside / ARCHIVE)
            other = test_rows(DRIVEN / asked.beside / "study", "", driven, asked.workers)
            sides[f"tuned, {asked.beside}"] = other["tuned"]
    except NavstackError as error:
        sys.exit(str(error))
    document = json.loads(read_text(driven / "study" / DOCUMENT))
    text = effort(document) + proof(sides, document["seed"])
    keep(driven, folder, text)
    print(text)


if __name__ == "__main__":
    main()
