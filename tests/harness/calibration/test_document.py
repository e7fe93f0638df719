"""Attempts, sensitivities and the document, from made-up runs; the script is benchmarks/calibrate.py."""

import importlib.util
import json
import re
from pathlib import Path

import pytest

from harness.calibration import attempts, sensitivities
from harness.calibration.candidate import acts_on, candidate_study, changes, finished_run, write_candidate
from harness.calibration.declaration import load_declaration
from harness.calibration.reading import INJURY
from harness.manifest import parameters
from harness.stored_run import load_run
from navstack.errors import InputError

ROOT = Path(__file__).parents[3]
FAST = {"world.people.speed": 1.4}


@pytest.fixture(scope="module")
def script():
    specification = importlib.util.spec_from_file_location("calibrate", ROOT / "benchmarks" / "calibrate.py")
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def hurts(row):
    row["pedestrian_injury_usd"] += 10.0


def test_a_run_tells_in_what_its_world_differs(write_world_run):
    settings = {"world.people.speed": 1.4, "world.cargo.friction": 0.2, "sensors.lidar.rate": 20.0}
    assert changes(load_run(str(write_world_run("changed", settings=settings)))) == settings
    parked = load_run(str(write_world_run("parked", "parked", settings=settings)))
    assert changes(parked) == {key: settings[key] for key in ("world.people.speed", "world.cargo.friction")}


def test_less_friction_wakes_the_pieces_earlier(tmp_path):
    text = Path(write_candidate({"world.cargo.friction": 0.2}, tmp_path)["world"]).read_text(encoding="utf-8")
    assert "wake_acceleration: 1.8" in text  # below 0.2 g
    text = Path(write_candidate({"world.cargo.friction": 0.8}, tmp_path)["world"]).read_text(encoding="utf-8")
    assert "wake_acceleration: 4.5" in text


def test_the_parked_robot_is_spared_what_cannot_matter():
    assert not acts_on("sensors.lidar.rate", "parked")
    assert not acts_on("robot.compute_latency", "parked")
    assert acts_on("robot.footprint", "parked")
    assert acts_on("sensors.lidar.rate", "paper-gps")


def test_a_folder_of_another_world_is_not_taken_for_this_one(write_world_run, tmp_path):
    folder = write_world_run("run", episodes=5, seed=1000, settings=FAST)
    files = write_candidate({}, tmp_path / "shipped")
    with pytest.raises(InputError, match=r"was driven with episodes 5, not 6; choose another --out"):
        finished_run(candidate_study("paper-gps", files, 6, 1000, 1), folder)
    with pytest.raises(InputError, match=r"was driven with other world parameters"):
        finished_run(candidate_study("paper-gps", files, 5, 1000, 1), folder)


def test_a_folder_whose_numbers_are_written_otherwise_is_the_same(write_world_run, tmp_path):
    folder = write_world_run("run", episodes=5, seed=1000)
    study = candidate_study("paper-gps", write_candidate({}, tmp_path / "shipped"), 5, 1000, 1)
    for name, text in parameters(study).items():
        (folder / "params" / name).write_text(text, encoding="utf-8")
    file = folder / "params" / "paper-gps-nav2.yaml"
    text = file.read_text(encoding="utf-8")
    assert "width: 24\n" in text
    file.write_text(text.replace("width: 24\n", "width: 24.0\n"), encoding="utf-8")
    finished_run(study, folder)
    file.write_text(text.replace("width: 24\n", "width: 25\n"), encoding="utf-8")
    with pytest.raises(InputError, match=r"was driven with other nav2 parameters"):
        finished_run(study, folder)


def test_attempts_are_logged_in_order_and_never_overwritten(script, write_world_run, tmp_path):
    log = ["--kept", str(tmp_path / "kept")]
    for number, settings in enumerate(({}, FAST)):
        folder = write_world_run(f"run{number}", seed=1000, settings=settings)
        script.main(["attempt", f"try {number}", "--runs", str(folder), *log])
    first, second = attempts.load_attempts(tmp_path / "kept" / "attempts.jsonl")
    assert (first.name, first.settings, first.outside) == ("try 0", {}, [])
    assert (second.settings, second.seed, second.stacks["paper-gps"]["n"]) == (FAST, 1000, 40)
    shares = [second.stacks["paper-gps"][key] / 40 for key in ("sla", "spoiled", "timeout", "physical_assistance")]
    published = (0.46, 0.29, 0.03, 0.22)
    assert second.share_distance == pytest.approx(sum(abs(a - b) for a, b in zip(shares, published, strict=True)) / 4)
    with pytest.raises(SystemExit, match="has an attempt 'try 0' already"):
        script.main(["attempt", "try 0", "--runs", str(folder), *log])


def test_an_indefensible_world_is_logged_as_such(script, write_world_run, tmp_path):
    folder = write_world_run("run", seed=1000, settings={"world.people.speed": 1.9})
    script.main(["attempt", "too fast", "--runs", str(folder), "--kept", str(tmp_path / "kept")])
    (entry,) = attempts.load_attempts(tmp_path / "kept" / "attempts.jsonl")
    assert entry.outside == ["world.people.speed"]


@pytest.mark.parametrize(
    ("seed", "settings", "complaint"),
    [(0, [{}], "not of seed 0"), (1000, [{}, FAST], "were driven in different worlds")],
)
def test_attempts_with_the_test_deliveries_or_of_two_worlds_are_refused(
    script, write_world_run, tmp_path, seed, settings, complaint
):
    stacks = ("paper-gps", "paper-amcl")
    runs = [
        str(write_world_run(stack, stack, seed=seed, settings=each))
        for stack, each in zip(stacks, settings, strict=False)
    ]
    with pytest.raises(SystemExit, match=complaint):
        script.main(["attempt", "mine", "--runs", *runs, "--kept", str(tmp_path / "kept")])
    assert not (tmp_path / "kept").exists()


def effects_of(write_world_run):
    present = load_run(str(write_world_run("present", seed=1000)))
    other = load_run(str(write_world_run("other", seed=1000, settings=FAST, change=hurts)))
    effect = sensitivities.measure(present, other, "world.people.speed", "high", 1.4)
    same = sensitivities.measure(present, present, "world.people.goals", "low", 20)
    return sensitivities.Study(1000, 40, {"paper-gps": sensitivities.present_values(present)}, (effect, same))


def test_a_paired_effect_is_found_and_survives_the_disk(write_world_run, tmp_path):
    study = effects_of(write_world_run)
    effect, same = study.effects
    assert effect.differences[INJURY].value == pytest.approx(10.0)
    assert effect.differences["sla"].value == 0.0
    assert set(same.p.values()) == {1.0}
    assert ("world.people.speed", "high", "paper-gps", INJURY) in study.sure
    sensitivities.save(study, tmp_path / "study.json")
    assert sensitivities.load(tmp_path / "study.json") == study


def test_a_damaged_study_is_refused(tmp_path):
    (tmp_path / "study.json").write_text(json.dumps({"seed": 1}), encoding="utf-8")
    with pytest.raises(InputError, match="is damaged"):
        sensitivities.load(tmp_path / "study.json")


def test_the_document_of_nothing_says_so(script, tmp_path):
    script.main(["document", "--kept", str(tmp_path), "--document", str(tmp_path / "calibration.md")])
    text = (tmp_path / "calibration.md").read_text(encoding="utf-8")
    assert "No world is frozen yet" in text
    assert all(f"`{key}`" in text for key in load_declaration().free)


def test_the_document_tells_all_that_is_kept(script, write_world_run, tmp_path):
    kept = tmp_path / "kept"
    kept.mkdir()
    sensitivities.save(effects_of(write_world_run), kept / "sensitivity.json")
    folder = write_world_run("run", seed=1000, settings=FAST)
    script.main(["attempt", "faster | people", "--runs", str(folder), "--kept", str(kept)])
    for stack in ("paper-gps", "paper-amcl", "parked"):
        write_world_run(f"kept/{stack}", stack, settings=FAST)
    (kept / "notes.md").write_text("What follows from it.\n", encoding="utf-8")
    script.main(["document", "--kept", str(kept), "--document", str(tmp_path / "calibration.md")])
    text = (tmp_path / "calibration.md").read_text(encoding="utf-8")
    assert "attempts: 1." in text
    assert "`world.people.speed` = 1.4" in text
    assert "Of 8 outcome shares" in text
    assert "injuries in 172 s of standing" in text
    assert "What follows from it." in text
    for block in re.findall(r"(?:^\|.*\|\n)+", text, flags=re.MULTILINE):
        assert len({len(line) for line in block.splitlines()}) == 1  # aligned
        assert len({len(re.findall(r"(?<!\\)\|", line)) for line in block.splitlines()}) == 1
