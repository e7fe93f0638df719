"""Write the figures of README.md, and of the page of streets, from stored deliveries.

Usage: python -m tools.readme_figures [--check]

Those of README.md are of results/baseline/WORLD, where WORLD is the default world, or the newest
stored version of the paper's world as long as the default has none: 400 deliveries of each stack on
each map that all of them have driven, and on the paper's own map. The page of streets is
results/baseline/helsinki/index.md, that of harder cities results/baseline/hard/index.md. --check
writes nothing, and fails where a page has other figures.
"""

import argparse
import sys

from harness.analysis.rare import difference_with_unseen
from harness.economics.valuation import missions
from harness.report.markdown import table, wrapped
from harness.report.numbers import interval_text, number_text
from harness.report.published import PublishedMethod, load_published
from harness.storage.rows import values
from harness.storage.shipped import DEFAULT_WORLD, shipped, synonyms
from harness.study.stored_run import StoredRun, load_run
from harness.world.outcome import OUTCOMES
from tools.hard_cities import PAGE, page_figures, summary
from tools.stored_figures import (
    BASELINE,
    MAPS,
    ROOT,
    margin_text,
    margins_of,
    pooled,
    rate_text,
    share,
    speed_text,
    stacks_at,
)

README = ROOT / "README.md"
STREETS = BASELINE / "helsinki"  # packed runs, by their sensors
PAPERS_MAP = "costnav"  # the paper's own, imported; it is not shipped
STACKS = ("evasive-gps-ekf", "mppi-contact-gps-ekf", "mpc-gps-ekf", "nav2-gps-ekf")
GPS, AMCL = "paper-gps", "paper-amcl"  # the paper's stacks, as this program drives them
BEGIN = "<!-- tools/readme_figures.py writes what follows -->"
END = "<!-- figures end -->"
NO_CONTACT_RATE = "–"
STREET_HEAD = [
    *("sensors", "stack", "in time, intact", "margin [USD/delivery]"),
    *("contacts per 1000 km", "interventions per 1000 km", "mean speed [m/s]"),
]
HEAD = ["stack", "margin [USD/delivery]", "in time, intact", "contacts per 1000 km"]


def stored_world() -> str:
    """The folder of the default world, or of the newest version of the paper's that was driven."""
    worlds = sorted(path.name for path in BASELINE.glob("published_*"))
    driven = [world for world in worlds if maps_of(world)]
    return next((world for world in driven if world_name(world) == DEFAULT_WORLD), driven[-1])


def world_name(folder: str) -> str:
    """The name of the world that a stored folder is of."""
    return synonyms(folder, shipped("params") / "worlds")[0]


def maps_of(world: str) -> tuple[str, ...]:
    """The shipped maps on which all of the stacks have driven."""
    return tuple(name for name in MAPS if set(STACKS) <= set(stacks_at(world, name)))


def study_row(run: StoredRun) -> list[str]:
    """What a stack did, as README has it."""
    return [
        f"`{run.stacks[0].name}`",
        margin_text(run),
        share(run, "sla"),
        rate_text(run, "contacts_per_1000_km"),
    ]


def street_row(run: StoredRun) -> list[str]:
    """What a stack did on streets, as its page has it."""
    return [
        f"`{run.folder.name}`",
        f"`{run.stacks[0].name}`",
        share(run, "sla"),
        margin_text(run),
        rate_text(run, "contacts_per_1000_km"),
        rate_text(run, "interventions_per_1000_km"),
        speed_text(run),
    ]


def street_figures() -> str:
    """What stacks did on streets, the best under each kind of sensors first."""
    rows, counts = [], set()
    for manifest in sorted(STREETS.glob("*/run.json")):
        stored = load_run(str(manifest.parent))
        runs = [stored.only(stack.name) for stack in stored.stacks]
        runs.sort(key=lambda run: -margins_of(run).mean())
        rows += map(street_row, runs)
        counts |= {len(run.stacks[0].rows) for run in runs}
    (count,) = counts  # all have driven as many
    intro = wrapped(f"{count} missions of each stack under each sensors, seed {stored.seed}:")
    return f"{intro}\n\n{table(STREET_HEAD, rows)}"


def published_row(method: PublishedMethod, margin: float) -> list[str]:
    """What the paper says of a method."""
    return [
        f"paper: {method.title}",
        f"{margin:.2f}",
        f"{method.measured.sla:.3f}",
        NO_CONTACT_RATE,
    ]


def figures() -> str:
    """The study and the paper's rows, as Markdown."""
    from harness.economics.cost_model import price

    world = stored_world()
    maps = maps_of(world)
    runs = {stack: pooled(world, stack, maps) for stack in STACKS}
    best, baseline = runs[STACKS[0]], runs[STACKS[-1]]
    published = load_published()
    method = published.methods["nav2_gps"]
    economics = price(method.measured, method.sensors, method.data_collection, best.prices())
    margin = economics.contribution_margin
    assert margin is not None
    rows = [*map(study_row, runs.values()), published_row(method, margin)]
    clusters = missions(best.stacks[0].rows)
    gain = margins_of(best) - margins_of(baseline)
    difference = difference_with_unseen(baseline, best, gain, clusters)
    n = len(best.stacks[0].rows)
    default = ""
    if world_name(world) != DEFAULT_WORLD:
        default = f" (the default, `{DEFAULT_WORLD}`, is not driven yet)"
    where = ", ".join(f"`{name}`" for name in maps)
    word = "maps"
    if len(maps) == 1:
        word = "map"
    intro = wrapped(
        f"**World `{world_name(world)}`{default}, {word} {where}, {n} deliveries of "
        f"each stack on the same missions.** In brackets: [95 % "
        "intervals](docs/tables.md#how-to-read-an-interval). [More "
        "stacks](results/baseline/study/index.md)."
    )
    verdict = wrapped(
        f"`{STACKS[0]}` earns {interval_text(difference)} USD a delivery more than `{STACKS[-1]}`."
    )
    return f"{intro}\n\n{table(HEAD, rows)}\n\n{verdict}\n\n{summary()}\n{papers_rows(world)}\n"


def injury_text(run: StoredRun) -> str:
    """What injuries cost on average [USD/run]."""
    costs = values(run.stacks[0].rows, "pedestrian_injury_usd")
    return number_text(sum(costs) / len(costs))


def papers_rows(world: str) -> str:
    """What of the paper's rows is met and what is missed, in three lines."""
    published = load_published().methods
    gps, amcl = (pooled(world, stack, (PAPERS_MAP,)) for stack in (GPS, AMCL))
    theirs = {name: published[name].measured for name in ("nav2_gps", "nav2_amcl")}
    lines = [
        f"Met, on the paper's own map (not shipped), n = {len(gps.stacks[0].rows)}: injuries of "
        f"`{GPS}`, {injury_text(gps)} USD a delivery against "
        f"{theirs['nav2_gps'].pedestrian_injury_usd_per_run:.2f}.",
        f"Missed there: {share(gps, OUTCOMES[0])} in time and intact against "
        f"{theirs['nav2_gps'].sla:.2f}; {share(gps, OUTCOMES[1])} spoiled against "
        f"{theirs['nav2_gps'].spoiled:.2f}.",
        f"AMCL on the filled mesh: {share(amcl, OUTCOMES[0])} in time and intact against "
        f"{theirs['nav2_amcl'].sla:.2f} ([why](docs/calibration.md)).",
    ]
    return "\n".join(wrapped(f"- {line}").replace("\n", "\n  ") for line in lines)


def filled(text: str, content: str) -> str:
    """A text with other content between the marks.

    Raises:
        ValueError: it has no marks.
    """
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise ValueError(f"a page has no '{BEGIN}' with '{END}' after it; put both in")
    return f"{before}{begin}\n\n{content}\n{end}{after}"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--check", action="store_true", help="write nothing")
    asked = parser.parse_args()
    pages = {
        README: figures(),
        STREETS / "index.md": street_figures(),
        PAGE: page_figures(),
    }
    for page, content in pages.items():
        text = page.read_text(encoding="utf-8")
        wanted = filled(text, content)
        if asked.check and wanted != text:
            sys.exit(f"{page.name} has other figures than the data: python -m tools.readme_figures")
        if not asked.check:
            page.write_text(wanted, encoding="utf-8")


if __name__ == "__main__":
    main()
