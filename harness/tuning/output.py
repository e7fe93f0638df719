"""What a study leaves in its folder.

The tuned file, how it differs, a stack that drives it, the trials.
"""

import dataclasses
import difflib
import json
import shlex
from collections import Counter
from pathlib import Path

from harness.metrics.columns import Row
from harness.storage.documents import write_document
from harness.storage.files import write_text, writing
from harness.storage.new_run import TUNED_STACK, TUNING_DOCUMENT
from harness.storage.tables import write_table
from harness.task.stack import Stack
from harness.tuning.declaration import SIZES, StudyDeclaration
from harness.tuning.evaluation import Value, unseen_seed
from harness.tuning.result import FAILED, StudyResult, Trial
from harness.tuning.space.file import OF_TRIAL
from harness.tuning.space.paths import AbsentError, locate, with_values
from harness.tuning.space.space import Parameter
from navstack.errors import InputError
from navstack.params.nav2_file.file import Nav2File
from navstack.params.strict import dump_dataclass, load_dataclass, read_text

TUNED, STACK, DIFF = "tuned.nav2.yaml", TUNED_STACK, "tuned.diff"
FRONT = "front"  # folder with the file of every trial of a Pareto front
STRICT = "--strict"  # option of navbench run
TRIALS, DOCUMENT = "trials.parquet", TUNING_DOCUMENT
REQUEST = "resume.json"  # what --resume was asked for, until that is done


def write_files(
    result: StudyResult,
    nav2: Nav2File,
    stack: Stack,
    declaration: StudyDeclaration,
    folder: Path,
) -> None:
    """Write everything but the document; ``stack`` is the original, which drives ``nav2``.

    Raises:
        InputError: the folder cannot be written.
    """
    allow_unknown = STRICT not in declaration.options
    tuned = with_values(nav2, result.incumbent.values, allow_unknown).document.text
    driven = dataclasses.replace(
        stack,
        name="",
        title=f"{stack.title}; tuned for {declaration.objective} in the space {declaration.space}",
        nav2_file=TUNED,
        sensors=declaration.sensors,
        robot=declaration.robot,
        body="",
    )
    with writing(folder):
        write_text(folder / TUNED, tuned)
        write_text(folder / DIFF, _difference(nav2.document.text, tuned))
        write_text(folder / STACK, dump_dataclass(driven))
        write_table(
            folder / TRIALS,
            _columns(result),
            (_trial_row(trial, result) for trial in result.trials),
        )
        # of trials that others have beaten since
        for file in (folder / FRONT).glob("trial-*.nav2.yaml"):
            file.unlink()
        for number in result.front if len(result.objectives) > 1 else ():
            (folder / FRONT).mkdir(exist_ok=True)
            values = result.trials[number].candidate.values
            text = with_values(nav2, values, allow_unknown).document.text
            write_text(folder / FRONT / f"trial-{number}.nav2.yaml", text)


def _difference(before: str, after: str) -> str:
    """A unified diff that ``patch`` takes, also of a file whose last line has no end."""
    lines = difflib.unified_diff(
        before.splitlines(keepends=True),
        after.splitlines(keepends=True),
        "original.nav2.yaml",
        TUNED,
    )
    return "".join(
        line if line.endswith("\n") else f"{line}\n\\ No newline at end of file\n" for line in lines
    )


def run_command(declaration: StudyDeclaration, folder: Path) -> tuple[str, ...]:
    """``navbench run`` with the tuned file, without seed and number of deliveries."""
    return ("navbench", "run", "--stack", str(folder / STACK), *declaration.options)


def test_command(declaration: StudyDeclaration, seed: int, folder: Path) -> str:
    """The line that drives the incumbent's test again."""
    count = declaration.test_episodes or declaration.episodes
    which = seed
    if declaration.test_episodes:
        which = unseen_seed(seed)
    return shlex.join(
        (*run_command(declaration, folder), "--seed", str(which), "--episodes", str(count))
    )


def study_document(
    result: StudyResult,
    nav2: Nav2File,
    declaration: StudyDeclaration,
    scores: Row,
    lint: Row,
    folder: Path,
) -> Row:
    """Content of ``tune.json``.

    Args:
        result: of the study.
        nav2: the user's file.
        declaration: what was asked for, its numbers of missions those that were driven.
        scores: of :func:`harness.tuning.scores.scores_document`.
        lint: what the tuned file's check found.
        folder: of the study.
    """
    driven = sum(len(trial.missions) for trial in result.trials)
    number = next(
        trial.number for trial in result.trials if trial.candidate.key == result.incumbent.key
    )
    every = sum(len(result.train_missions) for trial in result.trials if trial.state != FAILED)
    return {
        "schema": 1,
        "stack": declaration.stack,
        "space": {
            "name": result.space.name,
            "parameters": [_parameter(each) for each in result.space.parameters],
        },
        "objectives": list(result.objectives),
        "sampler": declaration.sampler,
        "seed": result.seed,
        "test_seed": unseen_seed(result.seed),
        "trials_asked": declaration.trials,
        "trials": dict(sorted(Counter(trial.state for trial in result.trials).items())),
        "training_episodes": {
            "missions": len(result.train_missions),
            "driven": driven,
            "without_racing": every,
        },
        "incumbent": {"trial": number, "changes": _changes(result, nav2)},
        "finals": [each.as_json() for each in result.finals],
        "front": [
            {"trial": number, "values": list(result.trials[number].values)}
            for number in result.front
        ],
        **scores,
        "lint": lint,
        "files": {"tuned": TUNED, "stack": STACK, "diff": DIFF, "trials": TRIALS},
        "sizes": {name: getattr(declaration, name) for name in SIZES},
        "command": test_command(declaration, result.seed, folder),
        "folder": str(folder),
    }


@dataclasses.dataclass(frozen=True, slots=True)
class Ended:
    """How far a finished study went."""

    trials: int  # that were driven beside the original
    sizes: dict[str, int]  # of SIZES; empty where an older document does not tell them


def ended(folder: Path) -> Ended | None:
    """How far the study of a folder went; None: it is not finished.

    Raises:
        InputError: its document is damaged.
    """
    file = folder / DOCUMENT
    if not file.is_file():
        return None
    try:
        document = json.loads(read_text(file))
        trials = sum(document["trials"].values()) - 1
        sizes = {name: int(count) for name, count in document.get("sizes", {}).items()}
        return Ended(trials, {name: sizes[name] for name in SIZES if name in sizes})
    except (ValueError, KeyError, AttributeError, TypeError, RecursionError):
        raise InputError(f"'{file}' is damaged; remove it, and the study goes on") from None


@dataclasses.dataclass(frozen=True, slots=True)
class Request:
    """What a study is asked for; None: what it declared or came to."""

    budget: float | None = None  # [s] of wall time
    test_episodes: int | None = None
    final_episodes: int | None = None
    waterfall_missions: int | None = None

    @property
    def sizes(self) -> dict[str, int]:
        """Those of SIZES that are asked for."""
        found = {name: getattr(self, name) for name in SIZES}
        return {name: count for name, count in found.items() if count is not None}

    def extended(self, **now: float | None) -> "Request":
        """The same with what is asked for now."""
        given = {name: value for name, value in now.items() if value is not None}
        return dataclasses.replace(self, **given)  # type: ignore[arg-type]


def requested(folder: Path) -> Request:
    """What an earlier session was asked for and did not finish.

    Raises:
        InputError: its file is damaged.
    """
    file = folder / REQUEST
    if not file.is_file():
        return Request()
    return load_dataclass(Request, file)


def keep_request(folder: Path, request: Request) -> None:
    """Let later sessions know what was asked for.

    Raises:
        InputError: the file cannot be written.
    """
    if request != requested(folder):
        write_document(folder / REQUEST, dataclasses.asdict(request))


def forget_request(folder: Path) -> None:
    """What was asked for is done."""
    (folder / REQUEST).unlink(missing_ok=True)


def _columns(result: StudyResult) -> dict[str, str]:
    objectives = {f"objective_{name}": "double" for name in result.objectives}
    parameters = {each.name: _arrow_type(each.original) for each in result.space.parameters}
    return {**OF_TRIAL, **objectives, **parameters}


def _arrow_type(value: Value) -> str:
    if isinstance(value, bool):
        return "bool"
    if isinstance(value, str):
        return "string"
    return "double"


def _trial_row(trial: Trial, result: StudyResult) -> Row:
    return {
        "trial": trial.number,
        "state": trial.state,
        "missions": len(trial.missions),
        "told": trial.told[0] if trial.told else None,
        "p": trial.p,
        "reason": trial.reason,
        **{
            f"objective_{name}": value
            for name, value in zip(result.objectives, trial.values, strict=False)
        },
        **{
            name: float(value) if type(value) is int else value
            for name, value in trial.point.items()
        },
    }


def _parameter(parameter: Parameter) -> Row:
    allowed: Row = {"choices": list(parameter.choices)}
    if not parameter.choices:
        allowed = {
            "low": parameter.low,
            "high": parameter.high,
            "log": parameter.is_log,
            "step": parameter.step,
        }
    return {
        "name": parameter.name,
        "paths": list(parameter.paths),
        "original": parameter.original,
        **allowed,
    }


def _changes(result: StudyResult, nav2: Nav2File) -> list[Row]:
    changed = result.incumbent.values.items()
    return [
        {"path": path, "from": _before(path, result, nav2), "to": value} for path, value in changed
    ]


def _before(path: str, result: StudyResult, nav2: Nav2File) -> Value:
    """What stood there; of a parameter that another choice of a list brings, Nav2's default."""
    owner = next(each for each in result.space.parameters if path in each.paths)
    try:
        if path == owner.paths[0]:
            return owner.original
        return locate(nav2, path).value
    except AbsentError:
        return owner.original
