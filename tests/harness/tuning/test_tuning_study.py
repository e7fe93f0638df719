"""The benchmark study: what another checkout goes on from, and what is kept beside it."""

import importlib
import tarfile
from pathlib import Path
from types import ModuleType

import pytest

from navbench.cli.tune import tune


@pytest.fixture(scope="module")
def script() -> ModuleType:
    return importlib.import_module("tools.tuning_study")


def test_another_checkout_goes_on_from_the_archive(script: ModuleType, tmp_path: Path) -> None:
    driven, archive, elsewhere = (
        tmp_path / "driven",
        tmp_path / "kept" / "study.tar.xz",
        tmp_path / "elsewhere",
    )
    (driven / "study" / "params").mkdir(parents=True)
    (driven / "study" / "journal.jsonl").write_text("{}\n")
    (driven / "study" / "params" / "tuning.yaml").write_text("a: 1\n")
    (driven / "study" / "history.png").write_text("no need of it")
    with pytest.raises(KeyboardInterrupt), script.kept(driven, archive):
        raise KeyboardInterrupt
    script.unpack(elsewhere, archive)
    files = sorted(
        str(each.relative_to(elsewhere)) for each in elsewhere.rglob("*") if each.is_file()
    )
    assert files == ["study/journal.jsonl", "study/params/tuning.yaml"]
    (elsewhere / "study" / "journal.jsonl").write_text("{}\n{}\n")
    script.unpack(elsewhere, archive)
    assert (elsewhere / "study" / "journal.jsonl").read_text() == "{}\n{}\n", (
        "what is driven here goes first"
    )
    with tarfile.open(archive) as content:
        assert {member.uname for member in content} == {""}


def test_spaces_and_objective_of_a_question_can_be_exchanged(
    script: ModuleType, tmp_path: Path
) -> None:
    def options(*given: str) -> dict[str, object]:
        words = script.arguments_of(
            given, script.QUESTIONS["critics"], Path("a.yaml"), tmp_path / "study"
        )
        with tune.make_context("tune", words) as context:
            return context.params

    own = options("--final-episodes", "4", "--budget", "50m", "--no-racing")
    assert own["spaces"] == ("dwb_critics", "local_layers") and own["objective"] == "shared_margin"
    assert (own["final_episodes"], own["budget"], own["is_raced"]) == (4, "50m", False)
    other = options("--space", "inflation", "--objective", "margin")
    assert other["spaces"] == ("inflation",) and other["objective"] == "margin"
