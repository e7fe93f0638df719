"""What several stacks earn by meetings, as a screen."""

from harness.ablation.meetings import MeetingsArms
from harness.report.ablations.screen import price_sentence, sentence
from harness.report.blocks import Block
from harness.report.numbers import counted
from harness.report.short.findings import lines_of
from harness.report.short.meetings import (
    METHOD,
    QUANTITIES,
    blind_spots,
    driven_text,
    quantity_text,
)
from harness.report.short.run import aligned
from harness.statistics.interval import fewest_missions
from harness.storage.new_run import CHECK
from harness.storage.texts import quoted

MORE = 4  # times as many missions, where those driven decide nothing


def short_arms(found: MeetingsArms) -> list[Block]:
    """What was driven, how the arms differ, what each comes to, the method and its limits."""
    lines = [
        f"{found.declaration.stack}, {counted(found.missions, 'mission')} by each of "
        f"{len(found.arms)}; {found.where}",
        *map(sentence, found.differences),
    ]
    result = found.result
    if result is not None:
        rows = [
            (stack.name, *(quantity_text(of(arm), places) for of, places in QUANTITIES.values()))
            for stack, arm in zip(found.arms, result.arms, strict=True)
        ]
        lines += aligned([("", *QUANTITIES), *rows])
        lines += [*map(price_sentence, found.prices), f"{METHOD}; {driven_text(result)}"]
    if found.errors:
        lines.append(f"{counted(found.errors, 'mission')} left out, which ended in an error")
    lines += [blind_spots(), *found.declaration.sources]
    return lines_of(lines)


def next_command(found: MeetingsArms) -> str:
    """As many missions as would decide the open differences, but not many times those driven."""
    if (found.folder / "params" / CHECK).is_file():
        return f"navbench check --resume {quoted(found.folder)} --budget 30m"
    needed = [
        each.paired.needed or each.paired.fewest
        for each in found.differences
        if not each.paired.is_significant and each.paired.differs
    ]
    most = MORE * max(found.episodes, fewest_missions(1))
    more = min(max(needed, default=most), most)
    episodes = max(more, found.episodes + 1)
    return f"navbench ablate --resume {quoted(found.folder)} --episodes {episodes}"
