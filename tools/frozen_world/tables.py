"""Tables of what was driven in the published world, beside the published rows."""

from dataclasses import dataclass

from scipy.stats import fisher_exact

from harness.analysis.compare import compare, side_of
from harness.analysis.rare import reach_of
from harness.economics.unseen import margin_admitting_unseen
from harness.economics.valuation import Valuation, margins, missions, value
from harness.report.markdown import table
from harness.report.numbers import interval_text
from harness.report.published import load_published
from harness.statistics.interval import Interval, wilson_interval
from harness.statistics.paired import holm, together
from harness.study.stored_run import StoredRun, load_run
from harness.world.outcome import OUTCOMES
from tools.frozen_world.cells import EARNING, GEOMETRY, METHODS, PLACES, Cell

FAMILIES = (  # of shares that are tested together: a stack for each published row
    ("paper-gps", "paper-amcl"),
    ("paper-gps", GEOMETRY),
    ("paper-gps-seen", "paper-amcl-seen"),
    ("paper-gps",),  # where nothing else was driven
)
LEVEL = 0.05  # p below which equality is rejected
PREDICTED = (  # key, decimals, allowed ours / published; None: reported
    ("pedestrian_injury_usd_per_run", 2, (1 / 1.5, 1.5)),
    ("avg_collision_impulse_ns", 1, None),
    ("avg_distance_km", 4, (0.75, 1.25)),
    ("avg_velocity_mps", 2, None),
    ("avg_runtime_h", 4, None),
)
STANDING = 172.0  # [s] that the published NavDP, which hardly moves, takes for a run


@dataclass(frozen=True, slots=True)
class Delivered:
    """What a cell's deliveries came to."""

    run: StoredRun
    outcomes: list[str]
    came_to: Valuation


def read(name: str) -> Delivered:
    """The deliveries of a cell that is driven, by the name of its run."""
    run = load_run(name)
    (stack,) = run.stacks
    outcomes = [row["outcome"] for row in stack.rows]
    return Delivered(run, outcomes, value(stack.rows, stack, run.prices(), run.seed))


def p_text(p: float) -> str:
    """A p value, in bold where equality is rejected."""
    text = f"p = {p:.3f}"
    if p < 0.001:
        text = "p < 0.001"
    if p < LEVEL:
        text = f"**{text}**"
    return text


def shares(driven: dict[Cell, Delivered]) -> str:
    """Fisher's exact test of every outcome share, a family's eight adjusted together (Holm)."""
    methods = load_published().methods
    lines: list[list[str]] = []
    for place in PLACES:
        for family in FAMILIES:
            cells = [Cell(stack, place) for stack in family]
            if not all(cell in driven for cell in cells):
                continue
            counts = [
                (cell, outcome, driven[cell].outcomes) for cell in cells for outcome in OUTCOMES
            ]
            p_values = []
            for cell, outcome, ours in counts:
                method = methods[METHODS[cell.stack]]
                theirs = round(getattr(method.measured, outcome) * method.episodes)
                k, n = ours.count(outcome), len(ours)
                p_values.append(
                    float(fisher_exact([[k, n - k], [theirs, method.episodes - theirs]]).pvalue)
                )
            parts = [
                f"{interval_text(wilson_interval(ours.count(outcome), len(ours)), 3)}, {p_text(p)}"
                for (_, outcome, ours), p in zip(counts, holm(p_values), strict=True)
            ]
            rows = [[place, cell.stack, *parts[4 * k : 4 * k + 4]] for k, cell in enumerate(cells)]
            known = [line[:2] for line in lines]
            lines += [row for row in rows if row[:2] not in known]
    for name, method in methods.items():
        if name in METHODS.values():
            lines.append(
                [
                    "published",
                    name,
                    *(f"{getattr(method.measured, outcome):.2f}" for outcome in OUTCOMES),
                ]
            )
    return table(["place", "stack", "SLA", "spoiled", "time-out", "assistance"], lines)


def predictions(driven: dict[Cell, Delivered]) -> str:
    """What the published rows tell beyond outcomes.

    Ours, and its ratio to the published, in bold where not allowed.
    """
    lines = []
    for cell, delivered in driven.items():
        if cell.stack not in METHODS:
            continue
        line = [cell.place, cell.stack]
        method = load_published().methods[METHODS[cell.stack]]
        for key, decimals, gate in PREDICTED:
            ours = interval_text(delivered.came_to.intervals[key], decimals)
            ratio = f"{mean_of(delivered, key) / getattr(method.measured, key):.2f}"
            if gate is not None and not gate[0] <= float(ratio) <= gate[1]:
                ratio = f"**{ratio}**"
            line.append(f"{ours}: {ratio}")
        lines.append(line)
    heading = ["injuries [USD]", "impulse [N s]", "distance [km]", "speed [m/s]", "time [h]"]
    return table(["place", "stack", *heading], lines)


def mean_of(delivered: Delivered, key: str) -> float:
    """A mean over deliveries that is defined."""
    mean = delivered.came_to.intervals[key].value
    assert mean is not None, key
    return mean


def standing(driven: dict[Cell, Delivered]) -> str:
    """What it costs to stand for as long as the published NavDP takes."""
    theirs = load_published().methods["navdp"].measured.pedestrian_injury_usd_per_run
    lines = []
    for cell, delivered in driven.items():
        if cell.stack != "parked":
            continue
        cost = delivered.came_to.intervals["pedestrian_injury_usd_per_run"]
        share = STANDING / (3600.0 * mean_of(delivered, "avg_runtime_h"))
        value, low, high = (
            None if each is None else each * share for each in (cost.value, cost.low, cost.high)
        )
        scaled = interval_text(Interval(value, low, high, cost.n), 2)
        ratio = mean_of(delivered, "pedestrian_injury_usd_per_run") * share / theirs
        lines.append([cell.place, scaled, f"{ratio:.2f}"])
    return table(
        ["place", f"injuries in {STANDING:g} s of standing [USD]", "of the published"], lines
    )


def earnings(driven: dict[Cell, Delivered]) -> str:
    """Who earns money, and the differences on the same missions, adjusted (Holm)."""
    cells = [cell for cell in driven if cell.stack in EARNING]
    against = {cell: Cell(EARNING[0], cell.place) for cell in cells if cell.stack != EARNING[0]}
    pairs = {
        cell: compare(
            side_of(driven[other].run), side_of(driven[cell].run), ["contribution_margin"]
        )
        for cell, other in against.items()
        if other in driven
    }
    found = {cell: pair.differences["contribution_margin"].paired for cell, pair in pairs.items()}
    adjusted = dict(zip(found, together(list(found.values())), strict=True))
    lines = []
    for cell in cells:
        outcomes, means = driven[cell].outcomes, driven[cell].came_to.intervals
        texts = [interval_text(wilson_interval(outcomes.count("sla"), len(outcomes)), 3)]
        stored = driven[cell].run
        rows = stored.stacks[0].rows
        texts.append(interval_text(means["contacts_per_1000_km"], 0))
        texts.append(interval_text(means["pedestrian_injury_usd_per_run"], 2))
        margin = margins(rows, stored.prices())
        assert margin is not None, "cargo is simulated here"
        admitting = margin_admitting_unseen(margin, reach_of(stored), missions(rows), stored.seed)
        texts += [interval_text(means["contribution_margin"], 2), interval_text(admitting, 2)]
        paired = "--"
        if cell in found:
            each = adjusted[cell]
            paired = f"{interval_text(each.difference, 2)}, {p_text(each.p_holm)}"
        lines.append([cell.place, cell.stack, *texts, paired])
    heading = ["SLA", "contacts per 1000 km", "injuries [USD]", "margin [USD]"]
    heading += ["admitting an unseen loss", f"minus {EARNING[0]} [USD], p (Holm)"]
    return table(["place", "stack", *heading], lines)
