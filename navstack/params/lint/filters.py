"""Rules about the masks of costmap filters."""

from collections.abc import Iterator

from navstack.params.filters import SPEED_ABSOLUTE, SPEED_PERCENT, FilterInfoServerParams
from navstack.params.lint.rule import Finding, RuleGroup
from navstack.params.lint.subject import Subject

RULES = RuleGroup("Costmap filters")


@RULES.warning
def lifted_speed_limit(subject: Subject) -> Iterator[Finding]:
    """A value of a speed mask lifts the limit.

    Why: Nav2 takes a limit of 0 or less, and one above 100 %, for none: the robot drives at full
    speed where the mask is to slow it down most.
    """
    for mask in subject.masks:
        lifted = [value for value in mask.values if _lifts(mask.info, value)]
        if lifted:
            info = mask.info
            limit = info.base + info.multiplier * lifted[-1]
            unit = " %" if info.type == SPEED_PERCENT else " m/s"
            yield Finding(
                mask.filter,
                f"its mask's value {lifted[-1]} is a limit of {info.base:g} + "
                f"{info.multiplier:g} x {lifted[-1]} = {limit:g}{unit}",
                f"base and multiplier of {mask.info_node} so that every value gives more than 0 "
                "and at most 100 %",
                mask.node,
            )


@RULES.warning
def turned_mask(subject: Subject) -> Iterator[Finding]:
    """A filter's mask is turned by the yaw of its origin.

    Why: Nav2's costmaps leave the yaw out, of masks and maps alike; RViz draws them turned. Here
    they stand turned.
    """
    for mask in subject.masks:
        if mask.yaw != 0.0:
            yield Finding(
                mask.filter,
                f"the origin of its mask has a yaw of {mask.yaw:g} rad, which Nav2 leaves out",
                "an origin with a yaw of 0, and the mask's picture turned",
                mask.node,
            )


def _lifts(info: FilterInfoServerParams, value: int) -> bool:
    """Whether a value between free and lethal gives no limit (``speed_filter.cpp``)."""
    limit = info.base + info.multiplier * value
    if info.type == SPEED_PERCENT:
        return not 0.0 < limit <= 100.0
    return info.type == SPEED_ABSOLUTE and limit <= 0.0
