"""Where meetings can be driven."""

from harness.episode.factory import Parts
from harness.execution.copies import can_copy
from harness.storage.shipped import is_district
from harness.task.stack import ROS2
from harness.task.study import Study
from navstack.errors import InputError

INSTEAD = "leave out --estimator meetings"


def require_meetings(study: Study) -> None:
    """Check that a study's people, stacks and machine let meetings be drawn and driven.

    Raises:
        InputError: they do not.
    """
    if not can_copy():
        raise InputError(f"this system cannot copy a running process; {INSTEAD}")
    if is_district(study.template.map_name):
        raise InputError(f"meetings are not drawn on districts yet; {INSTEAD}")
    for stack in study.stacks:
        if stack.is_policy or stack.navigator == ROS2:
            raise InputError(
                f"'{stack.name}' is driven by another process, which cannot be copied; {INSTEAD}"
            )
    people = Parts(study.template).params.people
    if people.model != "random_walk":
        raise InputError(
            f"the people of this world ({people.model}) react to the robot or are a recording; "
            f"meetings need random_walk: {INSTEAD}"
        )
    if people.beginning != "stationary":
        raise InputError(
            f"the people of this world all set out at once; meetings need 'beginning: stationary', "
            f"as in paper_loose_bucket: {INSTEAD}"
        )
    if people.count == 0:
        raise InputError(f"there is nobody to meet; {INSTEAD}")
