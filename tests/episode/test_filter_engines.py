"""The two ways to compute the GPS-EKF, over a whole delivery."""

import dataclasses

import pytest

from harness.episode.episode import run_episode
from harness.storage.shipped import shipped
from harness.task.study import make_study
from navstack.params.nav2_file.file import load_nav2


@pytest.mark.slow
def test_filterpy_drives_the_same_delivery(tmp_path):
    nav2 = load_nav2(shipped("params") / "nav2" / "gps_ekf.yaml")
    path = tmp_path / "filterpy.yaml"
    nav2.with_values({"gps_ekf.engine": "filterpy"}).dump(path)
    *_, task = make_study(stacks=["nav2-gps-ekf"], episodes=4, seed=42).tasks()
    other = dataclasses.replace(task, stack=dataclasses.replace(task.stack, nav2_file=str(path)))
    rows = [run_episode(each).row for each in (task, other)]
    assert rows[0]["outcome"] == rows[1]["outcome"] == "sla"
    assert rows[0]["localization_error_mean_m"] > 0.0
    for key in (
        "duration_s",
        "distance_m",
        "localization_error_mean_m",
        "localization_error_max_m",
    ):
        assert rows[0][key] == pytest.approx(rows[1][key], abs=1e-9)
