"""The verdict on a changed stack: as a screen, and as a comment on a pull request."""

import shlex
from collections.abc import Sequence

from harness.analysis.check import (
    SIDES,
    CheckDeclaration,
    Checked,
    Driven,
    Mission,
    replay_command,
)
from harness.metrics.columns import Row
from harness.report.blocks import Block, Table, Text
from harness.report.markdown import markdown_text
from harness.report.numbers import bounds_text, count_text, counted, number_text
from harness.report.short.findings import lines_of
from harness.report.short.run import aligned
from harness.report.short.setup import drivers_of, where_line
from harness.report.texts import OUTCOMES
from harness.statistics.interval import Interval, fewest_missions
from harness.storage.new_run import CHECK
from harness.storage.parameters import parameter_folder
from harness.storage.rows import values
from harness.storage.texts import quoted

MARKDOWN = (".md", ".markdown")  # suffixes of a comment's file
MEANS = {  # column of a delivery -> how its mean is called, decimals
    "pedestrian_injury_usd": ("Injuries ($/delivery)", 2),
    "pedestrian_contacts": ("People hit (1/delivery)", 3),
    "duration_s": ("Duration [s]", 1),
}
SAME = "alike: both drive by the same parameters, so that no delivery can differ"


def short_check(checked: Checked | None, declaration: CheckDeclaration) -> list[Block]:
    """Who was checked, the verdict, means of both, and the missions that differ most.

    Args:
        checked: what was found; None: both drive by the same parameters.
        declaration: how the sides were given.
    """
    lines = [f"NEW {declaration.new} against OLD {declaration.old}"]
    if checked is None:
        return lines_of([*lines, SAME])
    lines[0] += f", {_setting(checked)}"
    lines.append(sentence(checked))
    if checked.bound.n:
        lines += aligned([("", "OLD", "NEW", "NEW - OLD"), *mean_rows(checked)])
    lines.append(_left_out(checked))
    if checked.apart:
        lines.append("missions that differ most:")
    for mission in checked.apart:
        told = "; ".join(f"{name} {text}" for name, text in zip(SIDES, _told(mission), strict=True))
        lines.append(f"  {mission.episode}: {mission.difference:+.2f} USD; {told}")
        lines += [f"    {shlex.join(words)}" for words in _replays(checked, mission)[1:]]
    return lines_of([*lines, _limit(checked), _next(checked)])


def _setting(checked: Checked) -> str:
    """Robot, localizer, world, map and people of both sides; each once where they share it."""
    runs = checked.first.run, checked.second.run
    old, new = (drivers_of(run)[0] for run in runs)
    drivers = ", ".join(
        f"{what} {_both(getattr(old, what), getattr(new, what))}" for what in ("robot", "localizer")
    )
    return f"{drivers}; {_both(*map(where_line, runs))}"


def _both(old: str, new: str) -> str:
    if old == new:
        return old
    return f"{old} (OLD) and {new} (NEW)"


def sentence(checked: Checked) -> str:
    """The verdict with its bound, and what would decide."""
    bound = checked.bound
    more = "; more than 1000 times as many would be needed"
    if bound.n < fewest_missions():
        more = f"; fewer than {fewest_missions()} missions decide nothing"
    elif checked.more_needed is not None:
        more = f"; about {count_text(checked.more_needed)} missions more would decide"
    return told_verdict(bound, checked.verdict, checked.within, more)


def told_verdict(bound: Interval, verdict: str, within: float, more: str) -> str:
    """A verdict with its bound; ``more`` is added where it is not decided."""
    if bound.value is None:
        return "not decided: no mission is finished"
    span = f"{number_text(bound.value, 2, True)} {bounds_text(bound, 2, True)} USD a delivery"
    told = f"NEW less OLD is {span} over {counted(bound.n, 'mission')}"
    if verdict == "alike":
        return f"alike within {within:g} USD a delivery: {told}"
    if verdict != "undecided":
        return f"{verdict}: {told}"
    return f"not decided: {told}{more}"


def mean_rows(checked: Checked) -> list[tuple[str, ...]]:
    """Quantity, old, new and difference, as texts."""
    both = checked.old, checked.new
    means = {
        "Margin ($/delivery)": ([float(side.margins.mean()) for side in both], 2),
        "In time, intact": ([_share(side, "sla") for side in both], 3),
    }
    for key, (title, decimals) in MEANS.items():
        columns = [values(side.rows, key) for side in both]
        means[title] = ([sum(column) / len(column) for column in columns], decimals)
    return [
        (title, *(number_text(each, decimals) for each in (*pair, pair[1] - pair[0])))
        for title, (pair, decimals) in means.items()
    ]


def check_markdown(checked: Checked | None, declaration: CheckDeclaration) -> str:
    """A comment for a pull request.

    Names come from the files that are checked; they stand in code, where they can be no markup.
    """
    old, new = code_text(declaration.old), code_text(declaration.new)
    blocks: list[Block] = [Text(f"navbench check: {new} against {old}", "heading")]
    if checked is None:
        return markdown_text([*blocks, Text(SAME)])
    verdict, _, told = sentence(checked).partition(": ")
    blocks += [Text(f"**{verdict}**: {told}"), Text(_setting(checked))]
    if checked.bound.n:
        heads = ("Mean", "OLD", "NEW", "NEW - OLD")
        blocks.append(Table("What they earn", heads, mean_rows(checked)))
    if missing := _left_out(checked):
        blocks.append(Text(missing))
    missions = []
    for mission in checked.apart:
        difference = f"{mission.difference:+.2f}"
        replay = code_text(shlex.join(_replays(checked, mission)[1]))
        missions.append((str(mission.episode), difference, *_told(mission), replay))
    columns = ("Mission", "NEW - OLD [$]", "OLD", "NEW", "Replay")
    blocks.append(Table("Missions that differ most", columns, missions))
    return markdown_text([*blocks, Text(_limit(checked))])


def _limit(checked: Checked) -> str:
    """What the bound holds for."""
    return (
        "The bound (95 %) holds at every look, so that the check may stop at any time; on a "
        f"mission a difference beyond {checked.reach:,.0f} USD counts as {checked.reach:,.0f}."
    )


def _left_out(checked: Checked) -> str:
    """How many deliveries have no result; empty: all have one."""
    if not checked.left_out:
        return ""
    return f"{counted(checked.left_out, 'delivery')} ended in an error; such missions are left out"


def _told(mission: Mission) -> tuple[str, str]:
    return _happened(mission.old), _happened(mission.new)


def _happened(row: Row) -> str:
    hit = ""
    if row["pedestrian_contacts"]:
        hit = f", {row['pedestrian_contacts']} hit"
    return f"{OUTCOMES.get(row['outcome'], row['outcome'])} after {row['duration_s']:.0f} s{hit}"


def _replays(checked: Checked, mission: Mission) -> Sequence[Sequence[str]]:
    return [replay_command(side, mission) for side in (checked.first, checked.second)]


def _share(side: Driven, outcome: str) -> float:
    return values(side.rows, "outcome").count(outcome) / len(side.rows)


def code_text(text: str) -> str:
    """A text as code in Markdown."""
    plain = "".join(each if each.isprintable() else " " for each in text)
    return f"`{plain.replace('`', ' ')}`"


def _next(checked: Checked) -> str:
    """The command that comes next."""
    folder, other = checked.first.run.folder, checked.second.run.folder
    is_check = folder == other and (parameter_folder(folder) / CHECK).is_file()
    if is_check and checked.verdict == "undecided":
        return f"next: navbench check --resume {quoted(folder)} --budget 30m"
    sides = f"{folder}:{checked.first.stack.name}", f"{other}:{checked.second.stack.name}"
    return f"next: navbench compare {shlex.join(sides)}"
