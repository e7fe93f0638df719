"""Does ``navbench check`` find bad edits of a Nav2 file, and does it leave harmless ones alone?

Usage: python -m tools.check_trial --out FOLDER [--budget 10m] [--only NAME ...] [--workers 2]

Each edit of check_trial.yaml (12 bad ones of six kinds, 12 harmless ones) is checked for the
budget. What is in the folder is not driven again: the tool goes on where it stopped. At the end
each verdict, and how many edits of either sort were called worse, with Wilson's interval.

That a bad edit costs at least 3 USD and a harmless one less than 0.3 USD is for long runs to show:
navbench check --resume FOLDER/NAME --budget 10h
"""

import argparse
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from harness.statistics.interval import wilson_interval
from harness.storage.documents import write_document
from harness.storage.shipped import shipped
from harness.study.places import Where
from harness.tuning.declaration import parse_duration
from navbench.api.check import check
from navbench.cli.signals import run_script
from navstack.params.nav2_file.file import load_nav2
from navstack.params.nav2_file.ros_yaml import Value
from navstack.params.strict import load_yaml
from tools.options import parsed

EDITS = Path(__file__).with_suffix(".yaml")
ORIGINAL = "gps_ekf.yaml"  # of params/nav2
LOCALIZER = "gps-ekf"  # that its drivers have


def checked(name: str, changes: Mapping[str, Value], given: argparse.Namespace) -> dict[str, Any]:
    """The document of one edit's check, driven or kept."""
    folder = given.out / name
    kept = given.out / f"{name}.json"
    if kept.is_file():
        document: dict[str, Any] = json.loads(kept.read_text(encoding="utf-8"))
        return document
    old = shipped("params") / "nav2" / ORIGINAL
    new = given.out / f"{name}.yaml"
    given.out.mkdir(parents=True, exist_ok=True)
    load_nav2(old).with_values(changes).dump(new)
    found = check(
        str(old),
        str(new),
        budget=parse_duration(given.budget),
        out=folder,
        where=Where(workers=given.workers),
        localizer=LOCALIZER,
    )
    if found.is_interrupted:
        raise KeyboardInterrupt
    document = found.as_json()
    write_document(kept, document)
    return document


def main() -> None:
    """Check the edits and print what came of them."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--only", nargs="*")
    given = parsed(__doc__, parser, budget="10m", workers=2)
    for sort, edits in load_yaml(EDITS).items():
        worse = driven = 0
        for name, changes in edits.items():
            if given.only and name not in given.only:
                continue
            document = checked(name, changes, given)
            driven += 1
            worse += document["verdict"] == "worse"
            told = document["margin_difference"], document["more_needed"]
            print(f"{sort} {name}: {document['verdict']} {told[0]}, more needed {told[1]}")
        print(f"{sort}: called worse {worse} of {driven}: {wilson_interval(worse, driven)}")


if __name__ == "__main__":
    run_script(main)
