"""The benchmark study: what another checkout goes on from, and what is kept beside it."""

import argparse
import importlib.util
import sys
import tarfile
from pathlib import Path
from types import ModuleType

import pytest

SCRIPT = Path(__file__).parents[3] / "benchmarks" / "tuning_study.py"


@pytest.fixture(scope="module")
def script() -> ModuleType:
    spec = importlib.util.spec_from_file_location("tuning_study", SCRIPT)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["tuning_study"] = module
    spec.loader.exec_module(module)
    return module


def test_another_checkout_goes_on_from_the_archive(script: ModuleType, tmp_path: Path) -> None:
    driven, archive, elsewhere = tmp_path / "driven", tmp_path / "kept" / "study.tar.xz", tmp_path / "elsewhere"
    (driven / "study" / "params").mkdir(parents=True)
    (driven / "study" / "journal.jsonl").write_text("{}\n")
    (driven / "study" / "params" / "tuning.yaml").write_text("a: 1\n")
    (driven / "study" / "history.png").write_text("no need of it")
    with pytest.raises(KeyboardInterrupt), script.kept(driven, archive):
        raise KeyboardInterrupt
    script.unpack(elsewhere, archive)
    files = sorted(str(each.relative_to(elsewhere)) for each in elsewhere.rglob("*") if each.is_file())
    assert files == ["study/journal.jsonl", "study/params/tuning.yaml"]
    (elsewhere / "study" / "journal.jsonl").write_text("{}\n{}\n")
    script.unpack(elsewhere, archive)
    assert (elsewhere / "study" / "journal.jsonl").read_text() == "{}\n{}\n", "what is driven here goes first"
    with tarfile.open(archive) as content:
        assert {member.uname for member in content} == {""}


def test_spaces_and_objective_of_a_question_can_be_exchanged(script: ModuleType, tmp_path: Path) -> None:
    asked = argparse.Namespace(
        space=None, objective=None, unraced=True, budget="50m", trials=9, episodes=8, finalists=2, final_episodes=4,
        test_episodes=6, waterfall=0, seed=0, world="easy",
    )  # fmt: skip
    question = script.QUESTIONS["critics"]
    line = " ".join(script.arguments_of(asked, question, Path("a.yaml"), tmp_path))
    assert "--space dwb_critics --space local_layers --objective shared_margin --no-racing" in line
    assert "--final-episodes 4" in line and "--budget 50m" in line
    asked.space, asked.objective = ["inflation"], "margin"
    other = " ".join(script.arguments_of(asked, question, Path("a.yaml"), tmp_path))
    assert "--space inflation --objective margin" in other and "dwb_critics" not in other
