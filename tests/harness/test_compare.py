"""Two runs mission by mission."""

import json
import math

import numpy as np
import pyarrow.parquet as pq
import pytest
from scipy.stats import ttest_rel

from harness.analysis.compare import compare, comparison_document, side_of
from harness.analysis.repricing import accounted_margins
from harness.economics.valuation import margins
from harness.metrics.columns import EPISODE_COLUMNS
from harness.storage.tables import read_rows
from harness.study.stored_run import load_run
from navbench.cli import compare as command
from navstack.errors import InputError


def compared(first, second, *metrics):
    comparison = compare(side_of(load_run(str(first))), side_of(load_run(str(second))), metrics)
    result = json.loads(json.dumps(comparison_document(comparison), allow_nan=False))
    return result


def faster(row):
    """Ten seconds less than the other, within a second, and always in time."""
    row["duration_s"] = (
        241.0 + row["episode"] - 10.0 + np.random.default_rng(row["episode"]).uniform(-0.5, 0.5)
    )
    row["outcome"] = "sla"


def slower(row):
    row["duration_s"] = 241.0 + row["episode"]
    row["outcome"] = "sla" if row["episode"] % 3 else "timeout"


def test_a_difference_is_found_with_sign_interval_and_p(write_run):
    result = compared(write_run("a", change=slower), write_run("b", change=faster))
    assert result["pairs"] == 40
    time = result["differences"]["avg_runtime_h"]
    assert time["value"] == pytest.approx(-10.0 / 3600.0, abs=2e-5)
    assert time["low"] < time["value"] < time["high"] < 0.0
    assert time["n"] == 40
    assert time["p"] == pytest.approx(1 / 10_001)
    assert time["p_holm"] is None, "not of the family, which has not been asked for"
    assert time["pairs_needed"] == 6
    sla = result["differences"]["sla"]
    assert (sla["a"], sla["b"]) == (pytest.approx(26 / 40), 1.0)
    assert sla["p"] == pytest.approx(2 / 2**14, abs=1e-4)  # 14 pairs disagree, all one way
    margin = result["differences"]["contribution_margin"]
    assert margin["p_holm"] == margin["p"], "it alone decides"
    assert sla["p_holm"] is None
    assert result["differences"]["revenue"]["value"] == pytest.approx(3.49 * 14 / 40)


def test_a_dollar_takes_as_many_pairs_as_a_test_needs_for_it(write_run):
    """A paired t-test of power 0.8 at 5 % on each side.

    It needs (1.96 + 0.84)^2 variances (Chow et al. 2008).
    """
    a, b = write_run("a"), write_run("b", change=faster)
    told = compared(a, b, "contribution_margin")["of_a_dollar"]
    runs = [load_run(str(run)) for run in (a, b)]
    first, second = (margins(run.stacks[0].rows, run.prices(), run.events) for run in runs)
    variance = float(np.var(second - first, ddof=1))
    assert told["pairs"] == math.ceil((1.959964 + 0.841621) ** 2 * variance)
    assert told["seconds"] == 2.0 * told["pairs"]
    (b / "timings.parquet").unlink()
    assert compared(a, b, "margin")["of_a_dollar"] == {**told, "seconds": None}
    assert compared(a, b, "sla")["of_a_dollar"] is None
    assert compared(a, a)["of_a_dollar"] is None


def test_deliveries_without_a_partner_count_for_the_margin_of_all(write_run, navbench):
    a, b = write_run("a", change=slower), write_run("b", episodes=15, change=faster)
    result = compared(a, b)
    assert (result["pairs"], result["a"]["left_out"]) == (15, 25)
    of_all = result["margin_of_all"]
    runs = [load_run(str(run)) for run in (a, b)]
    means = [margins(run.stacks[0].rows, run.prices()).mean() for run in runs]
    assert of_all["value"] == pytest.approx(means[1] - means[0])
    assert of_all["low"] < of_all["value"] < of_all["high"]
    assert of_all["deliveries"] == [40, 15]
    assert of_all["seconds"] == sum(of_all["of_a_dollar"]), "each lasts a second"
    assert compared(a, b, "sla")["margin_of_all"] is None
    status, text, _ = navbench("compare", a, b)
    more = "more" if of_all["value"] > 0.0 else "less"
    line = next(line for line in text.splitlines() if line.startswith("all 40 deliveries of A"))
    assert status == 0 and line.endswith(f"USD a delivery {more}")


@pytest.mark.parametrize("command", ["compare", "report"])
def test_a_run_that_is_given_twice_is_refused(write_run, navbench, tmp_path, command):
    run = write_run("a", episodes=6)
    (tmp_path / "link").symlink_to(run)
    status, out, error = navbench(command, run, f"{tmp_path / 'link'}:mine")
    assert (status, out) == (1, "") and "given twice; give it once" in error


def test_a_run_against_itself_differs_in_nothing(write_run):
    run = write_run("a")
    result = compared(run, run)
    assert {"contribution_margin", "sla"} <= set(result["differences"])
    assert all(
        entry["value"] == 0.0 and entry["p"] == 1.0 and entry["p_holm"] in (None, 1.0)
        for entry in result["differences"].values()
    )
    assert result["warnings"] == []


def test_two_stacks_of_one_folder(write_run):
    run = write_run("run", ("one", "two"))
    result = compared(f"{run}:one", f"{run}:two")
    assert (result["a"]["stack"], result["b"]["stack"], result["pairs"]) == ("one", "two", 40)
    rows = read_rows(run / "episodes.parquet", EPISODE_COLUMNS)
    one, two = (
        np.array([row["distance_m"] / 1000.0 for row in rows if row["stack"] == stack])
        for stack in ("one", "two")
    )
    told = result["differences"]["avg_distance_km"]
    assert (told["a"], told["b"]) == (pytest.approx(one.mean()), pytest.approx(two.mean()))
    assert told["value"] == pytest.approx((two - one).mean())
    assert told["p"] == pytest.approx(ttest_rel(two, one).pvalue, abs=0.02), (
        "a permutation test of many alike ones"
    )
    with pytest.raises(InputError, match=r"has 2 stacks; choose one of: .*run:one, .*run:two"):
        compared(run, run)


def test_the_order_of_a_table_tells_nothing(write_run):
    first = write_run("a", change=slower)
    before = compared(first, write_run("b", change=faster))
    file = first / "episodes.parquet"
    table = pq.read_table(file)
    pq.write_table(table.take(np.random.default_rng(1).permutation(len(table))), file)
    assert compared(first, first.parent / "b") == before


def test_names_of_folders_and_stacks_may_have_colons(write_run, navbench):
    run = write_run("at 12:30", ("nav2:10:15", "nav2"), episodes=6)
    for asked in ("compare", "check"):
        status, told, said = navbench(asked, f"{run}:nav2", f"{run}:nav2:10:15")
        assert (status, said) == (0, "")
        assert "nav2:10:15" in told
    assert load_run(f"{run}:nav2:10:15").first_stack == f"{run}:nav2:10:15"
    with pytest.raises(InputError, match="unknown stack of .*at 12:30 'nav2:10'"):
        load_run(f"{run}:nav2:10")


def test_other_recorded_people_are_named(write_run):
    runs = [write_run(name, episodes=4) for name in "ab"]
    for run, x in zip(runs, (1.0, 31.0), strict=True):
        (run / "params" / "people.csv").write_text(f"id,t,x,y\n1,0,{x},0\n")
    assert compared(*runs)["warnings"] == ["other people: the recordings that were replayed differ"]


def test_missions_without_a_partner_are_left_out_and_counted(write_run):
    def fail(row):
        row["error"] = "it broke" if row["episode"] in (2, 5) else None

    result = compared(write_run("a", episodes=12), write_run("b", episodes=10, change=fail))
    assert result["pairs"] == 8
    assert (result["a"]["left_out"], result["b"]["left_out"]) == (4, 0)


@pytest.mark.parametrize("command", ["compare", "check"])
def test_a_side_that_finished_nothing_is_told(write_run, navbench, command):
    def fail(row):
        row["error"] = "world: gone"

    runs = write_run("before", episodes=6), write_run("after", episodes=6, change=fail)
    status, _, said = navbench(command, *runs)
    assert (status, "after:mine has no finished delivery (6 ended in an error)" in said) == (
        1,
        True,
    )


def test_a_margin_that_no_side_has_is_undefined_and_not_unknown(write_run, navbench):
    def arrive(row):
        row["outcome"] = "arrived"

    run = write_run("run", ("a", "b"), episodes=6, change=arrive)
    status, _, said = navbench("compare", f"{run}:a", f"{run}:b", "--metric", "margin")
    assert (
        status == 1 and "contribution_margin is undefined on all common missions of run:a" in said
    )
    status, _, said = navbench("check", f"{run}:a", f"{run}:b")
    assert status == 1 and "run:a has no margin, as its cargo is not modelled" in said


def test_other_missions_cannot_be_compared(write_run):
    with pytest.raises(
        InputError, match="no finished mission in common; run both with the same --seed"
    ):
        compared(write_run("a", episodes=3), write_run("b", episodes=3, seed=1))


def test_undefined_values_leave_their_pairs_out(write_run):
    result = compared(write_run("a"), write_run("b", change=slower))
    assert result["differences"]["avg_min_time_to_collision_s"]["n"] == 26
    assert "fence_contacts" not in result["differences"]


def test_metrics_narrow_the_family(write_run):
    runs = write_run("a", change=slower), write_run("b", change=faster)
    few = compared(*runs, "sla", "avg_runtime_h")["differences"]
    assert list(few) == ["sla", "avg_runtime_h"]
    assert few["avg_runtime_h"]["p_holm"] == pytest.approx(2 / 10_001)
    assert list(compared(*runs, "margin")["differences"]) == ["contribution_margin"], (
        "as it is called elsewhere"
    )
    with pytest.raises(InputError, match="unknown metric 'slaa'; did you mean 'sla'"):
        compared(*runs, "slaa")


def test_margins_under_other_accountings_are_compared_when_asked_for(write_run):
    folders = write_run("a", crowd=3.0), write_run("b", crowd=1.0)
    key, runs = "contribution_margin_monotone", [load_run(str(folder)) for folder in folders]
    found = compared(*folders, key)["differences"][key]
    means = [accounted_margins(run, [(run, run.stacks[0])])["monotone"].value for run in runs]
    assert (found["a"], found["b"]) == (pytest.approx(means[0]), pytest.approx(means[1]))
    assert found["value"] > 0.0 and key not in compared(*folders)["differences"]


def test_what_is_not_comparable_is_said(write_run, tmp_path):
    from harness.storage.shipped import shipped

    text = (shipped("params") / "prices" / "costnav.yaml").read_text(encoding="utf-8")
    (tmp_path / "dear.yaml").write_text(
        text.replace("value: 3.49", "value: 4.99"), encoding="utf-8"
    )
    first = write_run("a", episodes=3)
    other = write_run(
        "b",
        episodes=3,
        prices=str(tmp_path / "dear.yaml"),
        pedestrians=40,
        map_sha256="1" * 64,
    )
    warnings = compared(first, other)["warnings"]
    assert len(warnings) == 3
    assert warnings[0].startswith("other map")
    assert "other world: people.count 20 and 40" in warnings
    assert "other prices: delivery_fee 3.49 and 4.99" in warnings


def test_tables_and_warnings(write_run, capsys):
    first, second = write_run("a", change=slower), write_run("b", change=faster, pedestrians=40)
    command.compare.callback(str(first), str(second), (), is_full=True, as_json=False)
    printed = capsys.readouterr()
    assert "note: not comparable: other world: people.count 20 and 40" in printed.err
    assert "B minus A over 40 common missions" in printed.out
    better = {
        line.split()[0]: line.split()[-1]
        for line in printed.out.splitlines()
        if line.startswith(("contribution_margin ", "sla ", "avg_")) and "[" in line
    }
    assert better["contribution_margin"] == "B"
    assert better["sla"] != "B" and better["avg_runtime_h"] != "B", "the margin alone decides"
    table = [line for line in printed.out.splitlines() if line.startswith(("avg", "sla", "opex"))]
    assert table and max(map(len, table)) <= 120
    command.compare.callback(str(first), str(second), (), is_full=True, as_json=True)
    assert json.loads(capsys.readouterr().out)["pairs"] == 40


def test_what_the_tables_lack_is_told(write_run, capsys):
    run = write_run("run", episodes=3)
    load_run(str(run))
    assert capsys.readouterr().err == ""
    (run / "journal.jsonl").write_text("{}\n" * 5, encoding="utf-8")
    load_run(str(run))
    (line,) = capsys.readouterr().err.splitlines()
    assert "2 more finished deliveries than its tables tell of" in line and "--resume" in line


def test_another_state_of_the_program_is_told(write_run):
    runs = [write_run(name) for name in "ab"]
    assert compared(*runs)["warnings"] == []
    for run, digest in zip(runs, "ab", strict=True):
        file = run / "run.json"
        file.write_text(json.dumps({**json.loads(file.read_text()), "program_sha256": 64 * digest}))
    (warning,) = compared(*runs)["warnings"]
    assert warning.startswith("other program: ")
