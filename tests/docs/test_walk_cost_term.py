"""A stranger's walk: add a cost term by three files of a copy; it shows wherever money does."""

import json
import shutil

import pytest

from navbench.cli.app import main

from .blocks import ROOT
from .test_walks import Walk

pytestmark = pytest.mark.slow

RUN = f"{ROOT / 'results' / 'baseline' / 'urban' / 'sidewalk_1'}:nav2-gps-ekf"
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


PRICED = ("price", RUN, "--prices", "costnav")


@pytest.fixture(scope="module")
def printed(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """What commands print on a copy of the product in which the term was added."""
    walk = Walk(tmp_path_factory.mktemp("tree"))
    shutil.copytree(ROOT / "params", walk.folder / "params")
    (walk.folder / "maps").symlink_to(ROOT / "maps")
    for name, edits in EDITS.items():
        walk.edit(name, *edits)
    commands = ((*PRICED, "--full"), (*PRICED, "--json"), ("paper",), ("paper", "--json"))
    done = walk.navbench(*commands)
    assert [status for status, _ in done] == [0, 0, 0, 0]
    return [text for _, text in done]


def test_the_term_stands_in_the_table_and_the_document_of_a_stored_run(
    printed: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert "\n  Insurance Fee " in printed[0]
    (run,) = json.loads(printed[1])["runs"]
    economics, measured = run["economics"], run["measured"]
    assert economics["insurance"] == pytest.approx(FEE * measured["avg_distance_km"])
    assert run["intervals"]["insurance"]["value"] == pytest.approx(economics["insurance"])
    with pytest.raises(SystemExit):
        main([*PRICED, "--json"])
    (before,) = json.loads(capsys.readouterr().out)["runs"]
    more = economics["opex"] - before["economics"]["opex"]
    assert more == pytest.approx(economics["insurance"])


def test_the_term_stands_in_the_papers_table(printed: list[str]) -> None:
    assert "\n  Insurance Fee " in printed[2]
    methods = json.loads(printed[3])["methods"]
    assert all(method["economics"]["insurance"] > 0.0 for method in methods.values())
