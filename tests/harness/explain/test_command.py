"""The command: tables, figures, JSON, and what it refuses."""

import json
from pathlib import Path

import pytest

from harness.metrics.columns import EVENT_COLUMNS
from harness.storage.checksums import write_checksums
from harness.storage.tables import write_table
from harness.study.manifest import map_digest
from harness.world.map.scene_io import load_scene
from navbench.cli.app import main

from .made_up import contact

ROOT = Path(__file__).parents[3]


def explain(*arguments):
    with pytest.raises(SystemExit) as ended:
        main(["explain", *arguments])
    return ended.value.code


@pytest.mark.slow
def test_the_command_tells_and_draws_a_recorded_delivery(folder, tmp_path, capsys, rendering):
    out, plot = tmp_path / "out", tmp_path / "one.svg"
    assert explain(str(folder), "0", "--full", "--plot", str(plot), "--out", str(out)) == 0
    printed = capsys.readouterr().out
    assert "from its recording" in printed
    assert "it hit person 1 with 80 N s" in " ".join(printed.split())
    head = next(line for line in printed.splitlines() if "v [m/s]" in line)
    assert "pose off [m]" in head and "rejected" in head
    assert (
        len(
            [
                line
                for line in printed.splitlines()
                if "DWBLocalPlanner" in line and line.startswith(" ")
            ]
        )
        == 22
    )
    names = {
        "explanation.json",
        "explanation.txt",
        *(f"event-{n}.{kind}" for n in (1, 2) for kind in ("png", "pdf")),
    }
    assert {path.name for path in out.iterdir()} == names
    assert all(path.stat().st_size > 500 for path in out.iterdir())
    assert "event 2: contact" in plot.read_text(encoding="utf-8")
    document = json.loads((out / "explanation.json").read_text(encoding="utf-8"))
    assert [event["cost_usd"] for event in document["events"]] == [20.0, 30.0]
    first = document["events"][0]["instants"][0]
    assert (first["time_to_event_s"], first["distance_m"]) == (
        pytest.approx(-5.0),
        pytest.approx(7.5, abs=0.6),
    )
    assert first["track_error_m"] is None


@pytest.mark.slow
def test_a_delivery_of_a_packed_run_is_driven_again(capsys):
    """Its parameter files are packed into one."""
    packed = ROOT / "results" / "baseline" / "urban" / "sidewalk_1"
    assert explain(f"{packed}:mpc-gps-ekf", "273") == 0
    assert "person 18 hit it with 100 N s" in " ".join(capsys.readouterr().out.split())


def test_a_map_that_has_changed_is_not_drawn_behind_a_figure(folder, tmp_path, capsys, monkeypatch):
    scenes = []
    monkeypatch.setattr("navbench.api.explain.draw_seconds", lambda *given: scenes.append(given[2]))
    about = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    for digest in (about["map_sha256"], map_digest(load_scene("sidewalk"))):
        (folder / "run.json").write_text(
            json.dumps({**about, "map_sha256": digest}), encoding="utf-8"
        )
        assert explain(str(folder), "0", "--event", "1", "--plot", str(tmp_path / "a.png")) == 0
    err = capsys.readouterr().err
    assert (
        err.count("note: the explanation has no map: map 'sidewalk' has changed since the run") == 1
    )
    assert [scene is None for scene in scenes] == [True, False]


def test_one_event_as_json(folder, capsys):
    assert explain(f"{folder}:mine", "0", "--event", "2", "--before", "2", "--json") == 0
    document = json.loads(capsys.readouterr().out)
    (event,) = document["events"]
    assert (event["number"], len(event["instants"]), document["source"]) == (2, 5, "recording")
    assert document["rewind"] is None


def test_a_delivery_that_cost_nothing_points_to_others(folder, capsys):
    assert explain(str(folder), "1") == 0
    where, said, following = capsys.readouterr().out.splitlines()
    assert where.endswith("; episode 1") and "world " in where
    assert said == "episode 1 of mine has no event that cost anything; episodes that have some: 0"
    assert following == f"next: navbench replay {folder}:mine 1"
    assert explain(str(folder), "1", "--json") == 0
    assert json.loads(capsys.readouterr().out)["costly_episodes"] == [0]


def test_no_episode_is_named_where_none_lost_anything(write_run, capsys):
    def change(row):
        row |= {"outcome": "sla", "pedestrian_injury_usd": 0.0}

    run = write_run("well", change=change)
    write_table(run / "events.parquet", EVENT_COLUMNS, [])
    write_checksums(run)
    assert explain(str(run), "--json") == 0
    nothing = {"schema": 1, "stack": "mine", "episode": None, "events": [], "costly_episodes": []}
    assert json.loads(capsys.readouterr().out) == nothing


def test_other_costly_episodes_are_named_the_dearest_first(write_run, capsys):
    def change(row):
        row |= {"outcome": "sla", "pedestrian_injury_usd": float(row["episode"])}

    run = write_run("many", episodes=12, change=change)
    paid = [contact(1.0, float(number), number) | {"episode": number} for number in range(1, 12)]
    write_table(run / "events.parquet", EVENT_COLUMNS, paid)
    write_checksums(run)
    assert explain(str(run), "0") == 0
    _, said, _ = capsys.readouterr().out.splitlines()
    assert said.endswith("episodes that have some: 11, 10, 9, 8, 7, 6, 5, 4 and 3 more")


def test_what_cannot_be_explained_is_said_in_one_line(folder, tmp_path, capsys, write_run):
    two = write_run("two", stacks=("a", "b"), episodes=2)
    (tmp_path / "file").write_text("")
    for arguments, said in (
        ((str(folder), "9"), "finished no episode 9"),
        ((str(folder), "1", "--rewind", "nope=1"), "nothing in delivery 1 cost anything"),
        ((str(folder), "0", "--event", "3"), "--event 3: the delivery has 2; give 1 to 2"),
        ((str(folder), "0", "--event", "0"), "0 is not in the range"),
        ((str(folder), "0", "--before", "0"), "range"),
        ((str(folder), "0", "--plot", str(tmp_path / "a.gif")), "give a name that ends with .png"),
        ((str(folder), "0", "--plot", str(tmp_path / "no" / "a.png")), "its folder does not exist"),
        ((str(folder), "0", "--out", str(tmp_path / "file" / "x")), "cannot be written"),
        ((str(two), "9"), "no episode 9 finished"),
        ((str(two), "0", "--stack", "c"), "'c'"),
        ((str(tmp_path), "0"), "holds no run"),
    ):
        assert explain(*arguments) == 1
        err = capsys.readouterr().err
        assert (said in err, err.count("\n")) == (True, 1), err


def test_recordings_that_are_damaged_are_named(folder, capsys):
    (folder / "recordings" / "mine-0-decisions.parquet").write_bytes(b"nothing")
    assert explain(str(folder), "0") == 1
    err = capsys.readouterr().err
    assert "mine-0-decisions.parquet: is damaged" in err
    assert err.count("\n") == 1
