"""``navbench day``: from run folders to a page."""

import dataclasses
import json
import os

import pytest

from harness.economics.prices import load_prices
from harness.fleet.legs import library_of
from harness.metrics.columns import LEG_COLUMNS
from harness.storage.tables import write_table
from harness.study.stored_run import leg_file, load_run
from navstack.errors import InputError


def with_a_way(row):
    """Rows drawn at random have ways of a metre."""
    row["shortest_path_m"] = 0.9 * row["distance_m"]


SMALL = ("--robots", 3, "--operators", 1, "--set", "orders_per_day=30", "--days", 3)


def test_a_day_is_told_in_25_lines_with_a_page(navbench, write_run, tmp_path, rendering):
    odd = os.fsdecode(b"odd-\xff")  # a name that is not UTF-8
    run = write_run(odd, change=with_a_way)
    status, out, _ = navbench("day", "--legs", run, *SMALL, "--out", tmp_path / "day")
    lines = out.splitlines()
    assert status == 0 and len(lines) <= 25
    assert lines[0].startswith("3 robots, 1 operator, 30 orders a day from 10 to 22 h, 3 days")
    assert "USD per robot and day" in lines[1] and "break-even" in lines[2]
    assert lines[-1] == f"next: open {tmp_path / 'day' / 'index.html'}"
    page = (tmp_path / "day" / "index.html").read_text()
    assert page.count("Robots wait for an operator (min)") == 3 and "image/png" in page
    assert "Operators' shifts" in page and "fleeteurope.com" in page


def test_the_document_has_estimates_curves_and_the_difference(navbench, write_run, tmp_path):
    run = write_run("both", stacks=("one", "two"), change=with_a_way)
    words = ("--legs", f"{run}:one", "--legs-b", f"{run}:two", *SMALL, "--json")
    status, out, _ = navbench("day", *words, "--out", tmp_path / "a")
    found = json.loads(out)
    assert status == 0
    assert json.loads((tmp_path / "a" / "day.json").read_text()) == found
    first, second = found["libraries"]
    assert (first["stack"], second["stack"], first["legs"]) == ("one", "two", 40)
    profits = [each["estimates"]["profit_per_robot_usd"] for each in (first, second)]
    gain = found["difference"]["profit_per_robot_usd"]
    assert gain["value"] == pytest.approx(profits[1]["value"] - profits[0]["value"])
    assert gain["low"] <= gain["high"]
    money = sum(first["money"].values())
    assert money == pytest.approx(profits[0]["value"])
    assert [point["operators"] for point in first["by_operators"]] == [1, 2]
    assert found["settings"]["robots_robot"] == 3
    again = json.loads(navbench("day", *words, "--out", tmp_path / "b")[1])
    assert {**again, "folder": ""} == {**found, "folder": ""}


def test_the_picture_of_many_robots_says_that_it_shows_some(navbench, write_run, tmp_path):
    run = write_run("mine", change=with_a_way)
    for robots, told in ((40, "what each robot does"), (41, "what the first 40 robots do")):
        out = tmp_path / str(robots)
        words = ("--robots", robots, "--days", 1, "--set", "orders_per_day=1", "--out", out)
        assert navbench("day", "--legs", run, *words)[0] == 0
        assert told in (out / "index.md").read_text()


def test_two_runs_of_one_stack_are_told_apart(navbench, write_run, tmp_path):
    """As before and after a change."""
    runs = [write_run(name, change=with_a_way) for name in ("before", "after")]
    words = ("--legs", runs[0], "--legs-b", runs[1], *SMALL, "--out", tmp_path / "day")
    status, out, _ = navbench("day", *words)
    stack = load_run(str(runs[0])).stacks[0].name
    assert status == 0 and f"after:{stack} in place of before:{stack}:" in out
    found = json.loads((tmp_path / "day" / "day.json").read_text())
    assert [library["stack"] for library in found["libraries"]] == [stack, stack]


def test_legs_are_grouped_by_the_people_among_whom_they_were_driven(write_run):
    runs = [load_run(str(write_run(f"r{n}", pedestrians=n, seed=n))) for n in (40, 5, 20)]
    library = library_of(runs, load_prices())
    assert [group.people for group in library.groups] == [5.0, 20.0, 40.0]
    assert library.size == 120
    assert [library.group_at(crowd) for crowd in (0.0, 0.2, 0.55, 1.0)] == [0, 0, 1, 2]


def test_legs_are_what_the_rows_say(write_run):
    run = load_run(str(write_run("mine")))
    prices = load_prices()
    (legs,) = library_of([run], prices).groups
    rows = run.stacks[0].rows
    efficiency = prices.inverter_efficiency.value * prices.motor_efficiency.value
    for number, row in enumerate(rows):
        assert legs.seconds[number] == row["duration_s"]
        assert legs.energy[number] == pytest.approx(1000.0 * row["motion_energy_kwh"] / efficiency)
        assert legs.contacts[number, 0] == pytest.approx(row["pedestrian_injury_usd"])
        left = row["goal_distance_m"] if row["outcome"] in ("timeout", "physical_assistance") else 0
        assert legs.progress[number] == pytest.approx(
            max(row["shortest_path_m"] - left, 0.0) / 1000.0
        )
        assert legs.is_late[number] == (row["outcome"] == "timeout")


def test_other_prices_price_contacts_anew(write_run):
    run = load_run(str(write_run("mine")))
    published, insurer = (library_of([run], load_prices(name)) for name in ("costnav", "insurer"))
    assert published.groups[0].contacts[:, 0].sum() != insurer.groups[0].contacts[:, 0].sum()


def test_legs_of_several_stacks_are_refused(write_run):
    run = load_run(str(write_run("both", stacks=("one", "two"))))
    with pytest.raises(InputError, match="2 stacks .one, two.; choose one as FOLDER:stack"):
        library_of([run], load_prices())


def test_each_run_must_have_legs_of_its_own(write_run):
    run = load_run(str(write_run("mine", episodes=4)))
    failed = dataclasses.replace(run.stacks[0], errors=1)
    empty = dataclasses.replace(run.stacks[0], rows=[])
    for runs, told in (
        ([run, run], "given twice"),
        ([dataclasses.replace(run, stacks=(failed,))], "1 of 5 deliveries have no result"),
        ([dataclasses.replace(run, stacks=(empty,))], "has no finished delivery"),
    ):
        with pytest.raises(InputError, match=told):
            library_of(runs, load_prices())


def test_legs_that_lead_nowhere_are_refused(navbench, write_run):
    run = write_run("slow", change=lambda row: row.update(shortest_path_m=0.5))
    status, out, errors = navbench("day", "--legs", run, *SMALL)
    assert (status, out) == (1, "")
    assert "hardly move" in errors and len(errors.strip().splitlines()) == 1


def test_legs_that_lead_nowhere_when_they_are_resampled_are_refused(navbench, write_run):
    def only_one_arrives(row):
        row.update(shortest_path_m=0.5, goal_distance_m=1.0, outcome="timeout")
        if row["episode"] == 0:
            row.update(shortest_path_m=1000.0, outcome="sla")

    status, out, errors = navbench(
        "day", "--legs", write_run("once", change=only_one_arrives), *SMALL
    )
    assert (status, out) == (1, "")
    assert "as 40 legs are resampled" in errors and len(errors.strip().splitlines()) == 1


@pytest.mark.parametrize(
    ("words", "status", "told"),
    [
        (("--robots", "0"), 1, "robots 0 must be a whole number, 1 to 10000"),
        (("--set", "robotz=3"), 1, "did you mean"),
        (("--set", "robots=3", "--robots", "4"), 1, "--set robots and --robots are the same"),
        (("--set", "delivery_fee=-1"), 1, "delivery_fee"),
        (
            ("--set", "deliveries_per_day_run_per_day=9"),
            1,
            "no effect on a day; give orders_per_day",
        ),
        (("--set", "remote_assistance_rate=1e9"), 1, "3e+11 calls; at most 2000000 a day"),
        (("--set", "distance_fee=1"), 1, "no effect on a day"),
        (("--days", "0"), 1, "give 1 to"),
        (("--settings", "village"), 1, "village"),
        (("--seed", "-1"), 1, "negative"),
        (("--fly",), 2, "No such option"),
    ],
)
def test_what_cannot_be_simulated_is_told_in_one_line(navbench, write_run, words, status, told):
    found, out, errors = navbench("day", "--legs", write_run("mine", episodes=4), *words)
    assert (found, out) == (status, "")
    assert told in errors and len(errors.strip().splitlines()) == 1


def test_legs_must_be_given(navbench):
    assert navbench("day")[0] == 2


@pytest.mark.parametrize("of_stacks", [None, [], {"one": 5}])
def test_a_manifest_with_a_stack_twice_or_other_notes_of_stacks_is_damaged(write_run, of_stacks):
    run = write_run("twice", stacks=("one", "two"))
    about = json.loads((run / "run.json").read_text())
    if of_stacks is None:
        about["stacks"].append(about["stacks"][0])
    else:
        about["of_stacks"] = of_stacks
    (run / "run.json").write_text(json.dumps(about))
    with pytest.raises(InputError, match=r"run\.json: is damaged"):
        load_run(str(run))


@pytest.mark.parametrize("distance", [None, [0.3, 2.5]])
def test_a_run_on_streets_without_a_missions_legs_is_refused(navbench, write_run, distance):
    """Whole missions would be taken for legs, the way back of some for a longer way there."""
    folder = write_run("streets", episodes=4, change=with_a_way)
    about = json.loads((folder / "run.json").read_text())
    (folder / "run.json").write_text(json.dumps({**about, "distance": distance}))
    if distance is None:
        row = load_run(str(folder)).stacks[0].rows[0]
        file = leg_file(folder, row)
        file.parent.mkdir(exist_ok=True)
        write_table(file, LEG_COLUMNS, [{**row, "begin_s": 0.0}])
    status, out, errors = navbench("day", "--legs", folder, *SMALL)
    assert (status, out) == (1, "")
    assert "-legs.parquet is missing, a mission's legs; give the run folder" in errors


def test_losses_of_a_run_whose_district_was_moved(navbench, write_run):
    folder = write_run("streets", episodes=1)
    status, _, errors = navbench("map", "losses", folder)
    assert status == 1 and "was not driven on a folder" in errors
    about = json.loads((folder / "run.json").read_text())
    moved = {**about, "map_name": "/nowhere/streets", "distance": [0.3, 2.5]}
    (folder / "run.json").write_text(json.dumps(moved))
    status, _, errors = navbench("map", "losses", folder)
    assert status == 1 and "its district /nowhere/streets is not here" in errors


def test_legs_of_the_way_back_are_legs_once(write_run):
    """The rows of missions hold the same ways; days are made of the legs alone."""
    run = load_run(str(write_run("streets", episodes=4)))
    parts = (0.3, 0.2, 0.5)  # there, there, back
    for row in run.stacks[0].rows:
        shares = {
            name: row[name] for name in ("distance_m", "motion_energy_kwh", "shortest_path_m")
        }
        legs = [{**row, **{name: part * shares[name] for name in shares}} for part in parts]
        for number, leg in enumerate(legs):
            leg["begin_s"] = 1000.0 * number  # all contacts are of the first
            if number:
                leg["pedestrian_contacts"] = 0
        file = leg_file(run.folder, row)
        file.parent.mkdir(exist_ok=True)
        write_table(file, LEG_COLUMNS, legs)
    (legs,) = library_of([run], load_prices()).groups
    assert len(legs.seconds) == 3 * 4 and legs.clusters.tolist() == sorted([0, 1, 2, 3] * 3)
    driven = sum(row["distance_m"] for row in run.stacks[0].rows)
    assert 1000.0 * legs.distance.sum() == pytest.approx(driven)
