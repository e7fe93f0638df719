"""The verdict on a changed stack from meetings, as a screen."""

import shlex
from collections.abc import Callable

from harness.analysis.meetings_check import NOT_SEEN, MeetingsChecked
from harness.meetings.estimators import DELIVERIES
from harness.meetings.looks import NUMBERS
from harness.meetings.results import ArmResult, MeetingsResult
from harness.report.blocks import Block, Table, Text
from harness.report.markdown import markdown_text
from harness.report.numbers import count_text, counted, interval_text, number_text
from harness.report.short.check import code_text, told_verdict
from harness.report.short.findings import lines_of
from harness.report.short.run import aligned
from harness.report.verdict import without
from harness.statistics.interval import Interval
from harness.storage.manifest_file import read_manifest
from harness.storage.texts import quoted

METHOD = (
    "estimator meetings: a delivery among nobody, less what meetings cost that are drawn from the "
    "crowd alone"
)
LIMIT = (
    "The bound (95 %) holds at all looks together, after "
    f"{', '.join(map(str, NUMBERS[:5]))} and so on missions. It assumes that a mission's "
    "difference could as well have the other sign."
)
# quantity -> of an arm, decimals
QUANTITIES: dict[str, tuple[Callable[[ArmResult], float | Interval], int]] = {
    "Margin ($/delivery)": (lambda arm: arm.margin, 2),
    "Among nobody ($/delivery)": (lambda arm: arm.margin_alone, 2),
    "People hit (1/delivery)": (lambda arm: arm.hits, 3),
    "Contacts (1/1000 km)": (lambda arm: arm.contacts, 0),
}


def short_meetings(checked: MeetingsChecked) -> list[Block]:
    """Who was checked, the verdict, what both come to, the method and what it cannot see."""
    declaration = checked.declaration
    lines = [
        f"NEW {declaration.new} against OLD {declaration.old}; {checked.where}",
        sentence(checked),
    ]
    result = checked.result
    if result is not None:
        lines += aligned([("", "OLD", "NEW"), *_quantities(result)])
        lines.append(f"{METHOD}; {driven_text(result)}")
    if checked.apart:
        lines.append("missions that differ most:")
    for mission in checked.apart:
        old, new = (f"{each:.2f}" for each in mission.hits)
        lines.append(
            f"  {mission.episode}: {mission.difference:+.2f} USD; a delivery of OLD hits {old} "
            f"people, of NEW {new}"
        )
    lines += [_left_out(checked), blind_spots(), LIMIT, _next(checked)]
    return lines_of(lines)


def meetings_markdown(checked: MeetingsChecked) -> str:
    """A comment for a pull request, as :func:`harness.report.short.check.check_markdown`."""
    old, new = code_text(checked.declaration.old), code_text(checked.declaration.new)
    verdict, _, told = sentence(checked).partition(": ")
    blocks: list[Block] = [
        Text(f"navbench check: {new} against {old}", "heading"),
        Text(f"**{verdict}**: {told}"),
        Text(checked.where),
    ]
    result = checked.result
    if result is not None:
        blocks.append(Table("What they earn", ("Mean", "OLD", "NEW"), _quantities(result)))
        blocks.append(Text(f"{METHOD}; {driven_text(result)}"))
    if missing := _left_out(checked):
        blocks.append(Text(missing))
    missions = [
        (str(each.episode), f"{each.difference:+.2f}", *(f"{hits:.2f}" for hits in each.hits))
        for each in checked.apart
    ]
    heads = ("Mission", "NEW - OLD [$]", "OLD hits (1/delivery)", "NEW hits (1/delivery)")
    blocks.append(Table("Missions that differ most", heads, missions))
    return markdown_text([*blocks, Text(blind_spots()), Text(LIMIT)])


def _left_out(checked: MeetingsChecked) -> str:
    """How many missions have no result; empty: all have one."""
    if not checked.errors:
        return ""
    return f"{counted(checked.errors, 'mission')} left out, which ended in an error"


def blind_spots() -> str:
    """What the estimator cannot see."""
    return f"not seen: {'; '.join(NOT_SEEN)}"


def sentence(checked: MeetingsChecked) -> str:
    """The verdict with its bound, and what would decide."""
    more = ""
    if checked.more_needed is not None:
        more = f"; about {count_text(checked.more_needed)} missions more would decide"
    if checked.result is not None and checked.bound.value is None:
        driven = len(checked.result.margins)
        first = f"the first look comes after {NUMBERS[0]} missions"
        return f"not decided: {first}; finished so far: {driven}{more}"
    return told_verdict(checked.bound, checked.verdict, checked.declaration.within, more)


def _next(checked: MeetingsChecked) -> str:
    """The command that comes next."""
    if checked.verdict == "undecided":
        return f"next: navbench check --resume {quoted(checked.folder)} --budget 30m"
    declaration = checked.declaration
    words = ["navbench", "check", declaration.old, declaration.new]
    typed = read_manifest(checked.folder).get("command", [])
    if typed[:2] == words[:2]:
        words = without(typed, ("--estimator", "--out"))
    return f"next: {shlex.join([*words, '--estimator', DELIVERIES])}"


def _quantities(result: MeetingsResult) -> list[tuple[str, ...]]:
    rows = []
    for title, (of_arm, decimals) in QUANTITIES.items():
        texts = [quantity_text(of_arm(arm), decimals) for arm in result.arms]
        rows.append((title, *texts))
    return rows


def quantity_text(value: float | Interval, decimals: int) -> str:
    """A quantity of an arm, with its interval if it has one."""
    if not isinstance(value, Interval):
        return number_text(value, decimals)
    return interval_text(value, decimals, absent="")


def driven_text(result: MeetingsResult) -> str:
    """How many meetings there were."""
    per_delivery = sum(each.per_delivery for each in result.strata)
    return (
        f"{counted(result.meetings, 'meeting')} of each, of {per_delivery:.2f} a delivery "
        "within 4 m of the way"
    )
