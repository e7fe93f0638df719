"""Calibration of the world: which free parameter matters how much, attempts, verification, and docs/calibration.md.

Usage: python benchmarks/calibrate.py COMMAND ...

  sensitivity [--only KEY ...]      each free parameter at the ends of its range, all others as shipped
  attempt NAME --set KEY=VALUE ...  drive a candidate world and log it (--runs FOLDER ...: log runs that were driven)
  verify                            the frozen world, params/worlds/published.yaml, on seed 0; then the document
  elsewhere                         the frozen world on the other maps and with social_force people; then the document
  document                          write docs/calibration.md from what is kept

All drive through the code of ``navbench run`` into run folders. A delivery that a folder holds already is not driven
again, so whatever was interrupted goes on with the same command. What the document needs is kept in results/baseline
(the runs of ``verify`` and ``elsewhere``, ``sensitivity.json``, ``attempts.jsonl``, and ``notes.md``, written by hand);
the other runs go to results/calibration.
"""

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from harness.calibration import attempts, sensitivities
from harness.calibration.candidate import (
    acts_on,
    candidate_study,
    finished_run,
    is_finished,
    parse_settings,
    write_candidate,
)
from harness.calibration.declaration import Declaration, load_declaration
from harness.calibration.document import Material, document
from harness.calibration.reading import STACKS, Reading, by_stack, read_run
from harness.cli_run import drive_run, say
from harness.durable_files import write_text
from harness.economics.prices import load_prices
from harness.manifest import about, load_study, parameters
from harness.preflight import check
from harness.report.published import load_published
from harness.runs import MANIFEST, create_run, require_usable
from harness.signals import run_script
from harness.stored_run import StoredRun, load_run
from harness.study import Study
from harness.study_workers import Where
from navstack.errors import InputError, NavstackError

ROOT = Path(__file__).resolve().parents[1]
RUNS, KEPT = ROOT / "results" / "calibration", ROOT / "results" / "baseline"
DOCUMENT = ROOT / "docs" / "calibration.md"
SENSITIVITY, ATTEMPTS, NOTES, ELSEWHERE = "sensitivity.json", "attempts.jsonl", "notes.md", "elsewhere"
SHIPPED = "shipped"  # folder of the world as it is
CALIBRATION_SEED = 1000
FROZEN = "published"  # of params/worlds
CONDITIONS = {
    "sidewalk_1": {"map_name": "sidewalk_1"},
    "sidewalk_2": {"map_name": "sidewalk_2"},
    "social_force": {"people": "social_force"},
}


def drive(study: Study, folder: Path) -> StoredRun:
    """Drive what a folder lacks of a study; leaves the program where it is interrupted."""
    if (folder / MANIFEST).is_file():
        run = finished_run(study, folder)
        if run is not None:
            return run
    else:
        require_usable(folder)
        check(study)
        create_run(folder, about(study, sys.argv), parameters(study))
    say(f"driving {folder}")
    _, is_interrupted = drive_run(load_study(folder, study.workers), folder, Where())
    if is_interrupted:
        sys.exit(130)
    return load_run(str(folder))


def drive_candidate(
    settings: Mapping[str, Any], folder: Path, stacks: Sequence[str], asked: argparse.Namespace
) -> dict[str, StoredRun]:
    """The runs of a candidate world by stack."""
    if not stacks:
        return {}
    files = write_candidate(settings, folder)
    return {
        stack: drive(candidate_study(stack, files, asked.episodes, CALIBRATION_SEED, asked.workers), folder / stack)
        for stack in stacks
    }


def sensitivity(asked: argparse.Namespace) -> None:
    """Drive every end of every free parameter, and keep the effects of all that is finished."""
    declaration, folder = load_declaration(), asked.out / "sensitivity"
    for key in asked.only or ():
        declaration.require_free(key)
    drive_candidate({}, folder / SHIPPED, asked.stacks, asked)
    for key in asked.only or declaration.free:
        stacks = [stack for stack in asked.stacks if acts_on(key, stack)]
        for end, value in declaration.free[key].ends.items():
            drive_candidate({key: value}, folder / f"{key}-{end}", stacks, asked)
    study = finished_effects(declaration, folder, asked)
    asked.kept.mkdir(parents=True, exist_ok=True)
    sensitivities.save(study, asked.kept / SENSITIVITY)
    say(f"{len(study.effects)} effects are kept in {asked.kept / SENSITIVITY}")


def finished_effects(declaration: Declaration, folder: Path, asked: argparse.Namespace) -> sensitivities.Study:
    """The effects of all runs that are finished, also of those that were driven before."""
    values, effects = {}, []
    for stack in STACKS:
        if not is_finished(folder / SHIPPED / stack):
            continue
        (shipped,) = drive_candidate({}, folder / SHIPPED, [stack], asked).values()
        values[stack] = sensitivities.present_values(shipped)
        for key, free in declaration.free.items():
            for end, value in free.ends.items():
                if is_finished(folder / f"{key}-{end}" / stack):
                    (run,) = drive_candidate({key: value}, folder / f"{key}-{end}", [stack], asked).values()
                    effects.append(sensitivities.measure(shipped, run, key, end, value))
    return sensitivities.Study(CALIBRATION_SEED, asked.episodes, values, tuple(effects))


def attempt(asked: argparse.Namespace) -> None:
    """Drive a candidate, or read the runs of one, and log it."""
    declaration, log = load_declaration(), asked.kept / ATTEMPTS
    attempts.require_new(asked.name, log)
    if asked.runs and asked.settings:
        raise InputError("--runs takes the settings from the runs; leave out --set")
    if asked.runs:
        runs = [load_run(str(folder)) for folder in asked.runs]
    else:
        settings = parse_settings(asked.settings, declaration)
        runs = list(drive_candidate(settings, asked.out / "attempts" / asked.name, asked.stacks, asked).values())
    entry = attempts.attempt(asked.name, by_stack(map(read_run, runs)), declaration, load_published())
    attempts.append(entry, log)
    say(f"attempt {len(attempts.load_attempts(log))}, {entry.name}: {entry.settings or 'as shipped'}")
    for stack, measured in entry.stacks.items():
        say(f"  {stack}: {', '.join(f'{key} {value:g}' for key, value in measured.items())}")
    say(f"  distance of the shares {entry.share_distance}, least p after Holm {entry.least_p_holm}")


def verify(asked: argparse.Namespace) -> None:
    """Drive the frozen world once, and write the document."""
    for stack in asked.stacks:
        drive(_frozen_study(stack, asked), asked.kept / stack)
    write_document(asked)


def elsewhere(asked: argparse.Namespace) -> None:
    """Drive the frozen world under the other conditions, and write the document."""
    for condition, choices in CONDITIONS.items():
        for stack in asked.stacks:
            drive(_frozen_study(stack, asked, **choices), asked.kept / ELSEWHERE / condition / stack)
    write_document(asked)


def write_document(asked: argparse.Namespace) -> None:
    """Write ``docs/calibration.md`` from what is kept."""
    kept, prices = asked.kept, load_prices("costnav")
    study = sensitivities.load(kept / SENSITIVITY) if (kept / SENSITIVITY).is_file() else None
    material = Material(
        declaration=load_declaration(),
        published=load_published(),
        attempts=attempts.load_attempts(kept / ATTEMPTS),
        study=study,
        readings=_kept_readings(kept),
        elsewhere={
            condition: found for condition in CONDITIONS if (found := _kept_readings(kept / ELSEWHERE / condition))
        },
        revenue=prices.delivery_fee.value,
        notes=(kept / NOTES).read_text(encoding="utf-8") if (kept / NOTES).is_file() else "",
    )
    write_text(asked.document, document(material))
    say(f"wrote {asked.document}")


def _frozen_study(stack: str, asked: argparse.Namespace, **conditions: str) -> Study:
    chosen = {"world": asked.world, "robot": asked.robot, "sensors": asked.sensors}
    files = {kind: file for kind, file in chosen.items() if file is not None}
    seed = attempts.VERIFICATION_SEED
    return candidate_study(stack, files, asked.episodes, seed, asked.workers, **conditions)


def _kept_readings(folder: Path) -> dict[str, Reading]:
    finished = [folder / stack for stack in STACKS if is_finished(folder / stack)]
    return by_stack(read_run(load_run(str(path))) for path in finished)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True)
    for name, function, episodes in (
        ("sensitivity", sensitivity, 100),
        ("attempt", attempt, 100),
        ("verify", verify, 400),
        ("elsewhere", elsewhere, 100),
        ("document", write_document, None),
    ):
        command = commands.add_parser(name, help=function.__doc__)
        command.set_defaults(function=function)
        command.add_argument("--kept", type=Path, default=KEPT, help="folder of what the document is made of")
        command.add_argument("--document", type=Path, default=DOCUMENT, help="the document")
        if episodes is not None:
            command.add_argument("--episodes", type=int, default=episodes, help="deliveries per stack")
            command.add_argument("--workers", type=int, help="processes; default: one per core")
            command.add_argument("--stacks", nargs="+", default=list(STACKS), choices=STACKS)
        if name in ("sensitivity", "attempt"):
            command.add_argument("--out", type=Path, default=RUNS, help="folder of runs that are not kept")
        if name in ("verify", "elsewhere"):
            command.add_argument("--world", default=FROZEN, help="name of params/worlds, or file")
            command.add_argument("--robot", help="name of params/robots, or file; default: the stack's own")
            command.add_argument("--sensors", help="name of params/sensors, or file; default: the stack's own")
        if name == "sensitivity":
            command.add_argument("--only", nargs="+", metavar="KEY", help="drive these parameters only")
        if name == "attempt":
            command.add_argument("name", help="under which it is logged")
            command.add_argument("--set", dest="settings", nargs="+", default=[], metavar="KEY=VALUE")
            command.add_argument("--runs", type=Path, nargs="+", help="runs of it, one stack each, already driven")
    return parser


def main(arguments: Sequence[str] | None = None) -> None:
    asked = _parser().parse_args(arguments)
    try:
        asked.function(asked)
    except NavstackError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    run_script(main)
