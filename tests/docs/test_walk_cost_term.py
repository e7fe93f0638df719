"""A stranger's walk: add a cost term, in a copy of the tree, and find it wherever money is shown."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from .blocks import ROOT

RUN = f"{ROOT / 'results' / 'baseline' / 'controllers'}:nav2-gps-ekf"
MOST_FILES = 3  # of the product that a new term may touch
FEE = 0.25  # [USD/km]

FORMULA = '''
def _insurance(given: CostInputs) -> Quantity:
    """Fee of an insurance by distance."""
    return given.prices.insurance_fee.value * given.measured.avg_distance_km


# By key, in the order of the paper's table'''
ENTRY = """    "insurance": CostTerm(title="Insurance Fee", label="insurance", formula=_insurance),
    "mapping_survey": CostTerm("""
PRICE_FIELD = """    robot_mass: Price = _price("kg", positive=True)
    insurance_fee: Price = _price("USD/km")
"""
PRICE = f"""insurance_fee:
  value: {FEE}
  unit: USD/km
  source: "assumed"

property_damage:"""

# file -> where to add, and what stands there afterwards
EDITS = {
    "harness/economics/cost_terms.py": (
        ("\n# By key, in the order of the paper's table", FORMULA),
        ('    "mapping_survey": CostTerm(', ENTRY),
    ),
    "harness/economics/prices.py": (
        ('    robot_mass: Price = _price("kg", positive=True)\n', PRICE_FIELD),
    ),
    "params/prices/costnav.yaml": (("\nproperty_damage:", f"\n{PRICE}"),),
}


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the harness and the parameters in which the term was added."""
    copy = tmp_path_factory.mktemp("tree")
    for folder in ("harness", "params"):
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / folder, copy / folder, ignore=ignored)
    (copy / "maps").symlink_to(ROOT / "maps")
    for name, edits in EDITS.items():
        text = (copy / name).read_text(encoding="utf-8")
        for before, after in edits:
            assert text.count(before) == 1, before
            text = text.replace(before, after)
        (copy / name).write_text(text, encoding="utf-8")
    return copy


def navbench(tree: Path, *words: str) -> str:
    """What a command of the copy prints."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join((str(tree), str(ROOT)))}
    command = [sys.executable, "-m", "navbench", *words]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, cwd=tree)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_a_cost_term_touches_at_most_three_files() -> None:
    assert len(EDITS) <= MOST_FILES


def test_the_term_stands_in_the_table_and_the_document_of_a_stored_run(tree: Path) -> None:
    printed = navbench(tree, "price", RUN, "--prices", "costnav", "--full")
    assert "\n  Insurance Fee " in printed
    (run,) = json.loads(navbench(tree, "price", RUN, "--prices", "costnav", "--json"))["runs"]
    economics, measured = run["economics"], run["measured"]
    assert economics["insurance"] == pytest.approx(FEE * measured["avg_distance_km"])
    assert run["intervals"]["insurance"]["value"] == pytest.approx(economics["insurance"])
    repeated = json.loads(navbench(ROOT, "price", RUN, "--prices", "costnav", "--json"))
    (before,) = repeated["runs"]
    more = economics["opex"] - before["economics"]["opex"]
    assert more == pytest.approx(economics["insurance"])


def test_the_term_stands_in_the_papers_table(tree: Path) -> None:
    assert "\n  Insurance Fee " in navbench(tree, "paper")
    methods = json.loads(navbench(tree, "paper", "--json"))["methods"]
    assert all(method["economics"]["insurance"] >= 0.0 for method in methods.values())
