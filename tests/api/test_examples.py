"""The examples beside the documents: a notebook, and a policy that is trained and driven."""

import json
import runpy
import shutil
import sys
from functools import partial
from pathlib import Path

import pytest

import navbench
from tests.rules import short_rules

pytestmark = pytest.mark.slow

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"


@pytest.fixture
def short(tmp_path: Path, hall: Path) -> dict[str, str]:
    """Options of deliveries of ten seconds in a hall."""
    (tmp_path / "short.yaml").write_text(short_rules(10.0))
    return {"map": str(hall), "rules": str(tmp_path / "short.yaml")}


def test_the_notebook_runs_from_the_first_cell_to_the_last(
    tmp_path: Path, short: dict[str, str], in_process: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    notebook = json.loads((EXAMPLES / "first_steps.ipynb").read_text(encoding="utf-8"))
    names: dict[str, object] = {"__name__": "__main__", "short": short}
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            source = "".join(cell["source"]).replace("episodes=4", "episodes=2, **short")
            exec(source.replace("episode=0", "episode=0, **short"), names)
            assert cell["outputs"] == [], "clear the outputs of the notebook before it is committed"
    assert names["run"].table().num_rows == 4  # type: ignore[attr-defined]
    assert len(names["way"]) > 100  # type: ignore[arg-type]


def test_a_policy_is_trained_and_driven(
    tmp_path: Path, short: dict[str, str], in_process: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("gymnasium", reason="gymnasium is not installed")
    for file in EXAMPLES.glob("tiny_policy.*"):
        shutil.copy(file, tmp_path)
    monkeypatch.syspath_prepend(str(EXAMPLES))
    out = tmp_path / "tiny_policy.json"
    monkeypatch.setattr(sys, "argv", ["train_policy.py", "--generations", "0", "--out", str(out)])
    runpy.run_path(str(EXAMPLES / "train_policy.py"), run_name="__main__")
    import train_policy  # type: ignore[import-not-found]

    in_hall = partial(train_policy.DeliveryEnv, **short)
    monkeypatch.setattr(train_policy, "DeliveryEnv", in_hall)
    earned = train_policy.dollars(train_policy.FIRST, "social_force", 7000, 1)
    train_policy.environment("social_force").close()
    assert -500.0 < earned < 4.0
    assert len(json.loads(out.read_text())) == len(train_policy.FIRST)
    stack = str(tmp_path / "tiny_policy.yaml")
    run = navbench.run(stack, 1, seed=7000, out=tmp_path / "run", **short)
    assert run.table()["error"].to_pylist() == [None]
