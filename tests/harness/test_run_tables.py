"""What is said of a run below its tables."""

from pathlib import Path

import pytest

from harness.report.run_tables import _world_of
from harness.task.study import make_study


@pytest.mark.parametrize("named", ["on the command line", "in the world file"])
def test_recorded_people_are_told_by_their_recording_and_not_by_a_number(
    named: str, tmp_path: Path
) -> None:
    recording = tmp_path / "plaza.csv"
    recording.write_text(
        "id,t,x,y\n" + "".join(f"{n},{t},{t - 80.0},-70\n" for n in range(3) for t in (0.0, 1.0))
    )
    if named == "on the command line":
        study = make_study(stacks=["parked"], episodes=1, workers=1, people=str(recording))
    else:
        world = tmp_path / "world.yaml"
        world.write_text("people: {model: replay, replay: {file: plaza.csv}}\n", encoding="utf-8")
        study = make_study(stacks=["parked"], episodes=1, workers=1, world=str(world))
    assert (
        _world_of(study)
        == "map sidewalk, published missions, seed 0, people replayed from plaza.csv"
    )
    few = make_study(stacks=["parked"], episodes=1, workers=1, pedestrians=7)
    assert _world_of(few) == "map sidewalk, published missions, seed 0, 7 people (random_walk)"
