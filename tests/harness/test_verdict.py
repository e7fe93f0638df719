"""Sentences that say what deliveries prove, and what they do not."""

import dataclasses

import numpy as np
import pytest

from harness.ablation.analysis import ArmDifference
from harness.analysis.compare import compare, side_of
from harness.analysis.rare import difference_with_unseen, reach_of
from harness.analysis.side import Side
from harness.economics.cost_terms import MARGIN
from harness.economics.unseen import margin_admitting_unseen
from harness.report.ablations.screen import sentence
from harness.report.comparison import comparison_blocks, winner
from harness.report.numbers import number_text
from harness.report.short.findings import short_comparison
from harness.report.tuning.summary import _verdict
from harness.report.verdict import earnings, rankings, repeated, undecided
from harness.statistics.interval import Interval
from harness.study.stored_run import load_run


def late(every):
    def change(row):
        row["outcome"] = "timeout" if row["episode"] % every == 0 else "sla"

    return change


def party(run, margin):
    side = side_of(load_run(str(run)))
    return run.name, side, Interval(margin, margin - 1.0, margin + 1.0, len(side.stack.rows))


@pytest.mark.parametrize(
    ("bounds", "admitting", "said"),
    [
        ((0.1, 2.0), (0.05, 2.0), "it earns money"),
        ((0.1, 2.0), (-0.1, 2.0), "it earned money on these missions; an unseen loss could undo"),
        ((-2.0, -0.1), (-3.0, -0.1), "it loses money"),
        ((-2.0, -0.1), (-3.0, 0.1), "these deliveries do not tell"),
        ((-1.0, 1.0), (-2.0, 1.0), "these deliveries do not tell"),
    ],
)
def test_what_a_stack_earns_is_said_by_the_interval_that_is_shown(
    write_run, monkeypatch, bounds, admitting, said
):
    side = side_of(load_run(str(write_run("one"))))
    unseen = Interval(0.5, *admitting, 20)
    monkeypatch.setattr("harness.report.verdict.margin_with_unseen", lambda *_: unseen)
    (line,) = earnings([("mine", side, Interval(0.5, *bounds, 20)), ("without cargo", side, None)])
    low, high = admitting
    assert line.startswith(f"mine: 0.50 [{low:.2f}, {high:.2f}] USD a delivery (n = 20): {said}")


@pytest.mark.parametrize(("episodes", "doubts"), [(20, True), (4000, False)])
def test_a_gain_is_doubted_until_a_loss_that_has_not_happened_could_not_undo_it(
    write_run,
    episodes,
    doubts,
):
    def alike(row):
        row.update(
            outcome="sla",
            pedestrian_injury_usd=0.0,
            collision_delta_v_mps=0.0,
            pedestrian_contacts=0,
        )
        row.update({key: 0 for key in row if key.endswith("_contacts")})

    run = load_run(str(write_run("one", episodes=episodes, change=alike, crowd=0.0)))
    (line,) = earnings([("mine", side_of(run), Interval(3.49, None, None, episodes))])
    told = (
        ": all earned 3.49; an unseen loss could undo that; about "
        if doubts
        else ": it earns money"
    )
    assert f"] USD a delivery (n = {episodes}){told}" in line
    assert line.startswith("mine: 3.49 [-" if doubts else "mine: 3.49 [")


def lossless(row):
    row.update(outcome="sla", distance_m=50.0, duration_s=100.0, average_speed_mps=0.5)
    row.update(pedestrian_injury_usd=0.0, collision_delta_v_mps=0.0)
    row.update({key: 0 for key in row if key.endswith("_contacts")})


def test_stacks_that_lost_nothing_get_an_answer_and_the_command_that_decides(write_run):
    run = write_run("run", ("one", "two"), episodes=20, change=lossless, crowd=0.0)
    first, second = good_and_bad(run)
    parties = [(each.stack.name, each, Interval(3.49, None, None, 20)) for each in (first, second)]
    (told,) = rankings(parties)
    start = "one and two earn the same on all 20 missions: 3.49 USD a delivery, the whole fee. "
    assert told.startswith(start)
    far = compare(first, second, [MARGIN]).unseen.high
    assert f"a difference of up to {far:.2f} USD possible" in told and far > 1.0
    needed = int(told.rpartition("--episodes ")[2])
    wanted = f"; about {needed:,d} missions without a loss would leave less than 1 USD, "
    assert f"{wanted}{needed - 20:,d} more:" in told
    assert told.endswith(f":\n  navbench run --resume {run} --episodes {needed}")

    def open_after(n):
        return difference_with_unseen(first.run, second.run, np.zeros(n), np.arange(n)).high

    assert open_after(needed) == pytest.approx(1.0, rel=0.05) and open_after(20) == far


def test_stacks_that_no_unseen_loss_sets_apart_are_alike(write_run, monkeypatch):
    run = write_run("run", ("one", "two"), episodes=20, change=lossless, crowd=0.0)
    monkeypatch.setattr("harness.report.verdict.WORTH_FINDING", 100.0)
    margin = Interval(3.49, None, None, 20)
    (told,) = rankings([(each.stack.name, each, margin) for each in good_and_bad(run)])
    assert told.endswith("3.49 USD a delivery, the whole fee")


def test_a_stack_alone_is_told_how_many_deliveries_would_tell(write_run):
    run = load_run(str(write_run("one", episodes=20, change=lossless, crowd=0.0)))
    side = side_of(run)
    (line,) = earnings([("mine", side, Interval(3.49, None, None, 20))])
    needed = int(line.rpartition("--episodes ")[2])
    assert f"about {needed} deliveries without a loss would show that it earns:\n" in line
    reach, all_alike = reach_of(run), np.full(needed, 3.49)
    low = margin_admitting_unseen(all_alike, reach, np.arange(needed), run.seed).low
    assert low == pytest.approx(0.0, abs=0.2)
    (line,) = earnings([("mine", side, Interval(1.0, -1.0, 3.0, 20))])
    command = f"navbench run --resume {run.folder} --episodes 164"
    assert line.endswith(f"about 164 would decide, 144 more:\n  {command}")


def test_no_command_is_told_for_more_deliveries_than_anybody_would_drive(write_run):
    side = side_of(load_run(str(write_run("one", episodes=20, change=lossless, crowd=0.0))))
    (line,) = earnings([("mine", side, Interval(0.1, -2.9, 3.1, 20))])
    assert line.endswith("whether it earns; more than 10,000 would be needed")
    change = worse_in(3, "physical_assistance")
    good, bad = good_and_bad(write_run("run", ("good", "bad"), 9, change=change, crowd=0.0))
    paired = dataclasses.replace(margin_of(compare(good, bad)).paired, variance=1e12)
    assert undecided(paired, good.run) == "; more than 10,000 missions would be needed"


def test_the_verdict_of_a_comparison_has_the_numbers_of_its_row(write_run):
    change = worse_in(3, "physical_assistance")
    good, bad = good_and_bad(write_run("run", ("good", "bad"), 9, change=change, crowd=0.0))
    comparison = compare(good, bad)
    lines = [block.text for block in short_comparison(comparison)]
    (verdict,) = (line for line in lines if "cannot rank" in line)
    (row,) = (line.split() for line in lines if line.startswith("Contribution margin"))
    paired = margin_of(comparison).paired
    assert f"missions, p {paired.p:.3f}; about" in verdict, "the margin alone decides"
    assert f"about {paired.needed} missions would decide, a guess by so few, " in verdict
    means = Interval(2.0, None, None, 9), Interval(1.0, None, None, 9)
    (of_run,) = rankings([("good", good, means[0]), ("bad", bad, means[1])])
    of_runs, of_compares = (line.split(" earned ")[1] for line in (of_run, verdict))
    assert of_runs == of_compares, "run and compare have one rule"
    value = paired.difference.value
    assert number_text(value) in row and f"A earned {number_text(abs(value))} [" in verdict


def test_the_best_is_ranked_where_the_missions_tell(write_run):
    good, bad, near = (
        write_run(name, change=late(every))
        for name, every in (("good", 99), ("bad", 2), ("near", 39))
    )
    other = write_run("elsewhere", seed=9)
    parties = [party(bad, -1.0), party(good, 3.0), party(near, 2.9), party(other, 0.0)]
    first, second = rankings(parties)
    assert first.startswith("These deliveries cannot rank good and near: ")
    assert second.startswith("good earned more than bad on these missions: ")
    doubt = "over 40 missions, p <.001 adjusted for 3 comparisons; an unseen loss could undo that"
    assert second.endswith(doubt) and " [-" in second
    assert rankings(parties[:1]) == []


def worse_in(count, outcome="sla"):
    """The stack ``bad`` pays some dollars more than ``good`` in so many missions.

    It ends there with an outcome.
    """

    def change(row):
        row.update({key: 0 for key in row if key.endswith("_contacts")})
        row.update(outcome="sla", distance_m=50.0, duration_s=100.0, average_speed_mps=0.5)
        row.update(pedestrian_injury_usd=1.0, collision_delta_v_mps=0.0)
        if row["stack"] == "bad" and row["episode"] < count:
            row["pedestrian_injury_usd"] += 3.0 + 0.1 * row["episode"]
            row["outcome"] = outcome

    return change


def good_and_bad(run):
    loaded = load_run(str(run))
    first, second = (Side(loaded, stack) for stack in loaded.stacks)
    return first, second


def margin_of(comparison):
    return comparison.differences[MARGIN]


@pytest.mark.parametrize(("count", "is_significant"), [(5, False), (6, True)])
def test_every_screen_flips_with_the_test(write_run, count, is_significant):
    """Five missions of one sign have p 0.0625, and six 0.03125.

    All screens turn there, and the interval, too.
    """
    run = write_run("run", ("good", "bad"), episodes=9, change=worse_in(count), crowd=0.0)
    good, bad = good_and_bad(run)
    comparison = compare(good, bad, [MARGIN])
    paired = margin_of(comparison).paired
    assert paired.p == 2.0 / 2**count and paired.is_significant == is_significant
    assert (paired.difference.sign != 0) == is_significant
    margin = Interval(0.0, None, None, 9)
    (ranking,) = rankings([("good", good, margin), ("bad", bad, Interval(-1.0, None, None, 9))])
    assert ranking.startswith(
        "good earned more than" if is_significant else "These deliveries cannot"
    )
    assert winner(margin_of(comparison), "A", "B") == ("A" if is_significant else "")
    notes = " ".join(str(block) for block in comparison_blocks(comparison))
    assert ("contribution_margin: not significant" in notes) != is_significant
    words = sentence(ArmDifference("bad", "good", MARGIN, paired))
    assert ("not significant" in words) != is_significant
    assert _verdict(paired.difference, None) == ("a loss" if is_significant else "not significant")


@pytest.mark.parametrize(("count", "better"), [(6, ""), (7, "A")])
def test_among_two_metrics_a_difference_takes_a_mission_more(write_run, count, better):
    """Of margin and SLA, both asked for, the better p counts twice (Holm)."""
    change = worse_in(count, "physical_assistance")
    good, bad = good_and_bad(write_run("run", ("good", "bad"), 9, change=change, crowd=0.0))
    comparison = compare(good, bad, [MARGIN, "sla"])
    for key in comparison.family:
        entry = comparison.differences[key]
        assert winner(entry, "A", "B") == better
        assert bool(entry.paired.difference.sign) == bool(better)


def test_fewer_than_six_missions_decide_nothing_and_the_command_that_would_is_told(write_run):
    run = write_run("run", ("good", "bad"), episodes=5, change=worse_in(5), crowd=0.0)
    good, bad = good_and_bad(run)
    margins = [Interval(value, value - 0.5, value + 0.5, 5) for value in (2.0, -2.0)]
    parties = [("good", good, margins[0]), ("bad", bad, margins[1])]
    told = "fewer than 6 missions decide nothing; about 6 missions would decide, 1 more:"
    command = f"navbench run --resume {run} --episodes 6"
    assert rankings(parties)[0].endswith(f"{told}\n  {command}")
    assert all("fewer than 6 deliveries decide nothing" in line for line in earnings(parties))


@pytest.mark.parametrize(
    ("typed", "again"),
    [
        ("navbench run --stack a b.yaml", "navbench run --stack a b.yaml --episodes 9"),
        ("navbench run --episodes 5 --out x --seed 1", "navbench run --seed 1 --episodes 9"),
        ("navbench ablate --episodes=5 --only=3", "navbench ablate --episodes 9"),
        ("navbench suite example", ""),
        ("python drive.py", ""),
    ],
)
def test_a_run_is_repeated_with_more_deliveries(write_run, typed, again):
    folder = write_run("run", episodes=2)
    run = load_run(str(folder))
    run = dataclasses.replace(run, about={**run.about, "command": typed.split()})
    longer = f"navbench {typed.split()[1]} --resume {folder} --episodes 9"
    assert repeated(run, 9) == (longer if again else "")
    chosen = dataclasses.replace(run, about={**run.about, "only": [3, 4]})
    assert repeated(chosen, 9) == again, "it goes on with no other deliveries"
