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
    reason = why_no_meetings(study)
    if reason:
        raise InputError(f"{reason}; {INSTEAD}")


def why_no_meetings(study: Study) -> str:
    """Why meetings cannot be drawn or driven; empty: they can."""
    if not can_copy():
        return "this system cannot copy a running process"
    if is_district(study.template.map_name):
        return "meetings are not drawn on districts yet"
    for stack in study.stacks:
        if stack.is_policy or stack.navigator == ROS2:
            return f"'{stack.name}' is driven by another process, which cannot be copied"
    if not study.stacks[0].nav2_file:
        return f"'{study.stacks[0].name}' plans no way along which people could be met"
    parts = Parts(study.template)
    if parts.params.cargo.pieces == 0:
        return "this world does not model the cargo, so that no mission has a margin"
    people = parts.params.people
    if people.model == "replay":
        return "the people of this world are a recording, and meetings need people who walk on"
    if people.beginning != "stationary":
        return (
            "the people of this world all set out at once, and meetings need 'beginning: "
            "stationary', as in paper_loose_bucket"
        )
    if people.count == 0:
        return "there is nobody to meet"
    return ""


def why_deliveries(study: Study) -> str:
    """Why whole deliveries are the better choice; empty: meetings are."""
    reason = why_no_meetings(study)
    if not reason and Parts(study.template).params.people.model == "social_force":
        reason = (
            "of people who make way, meetings are not proved to hit as many (docs/check.md); "
            "--estimator meetings draws them all the same"
        )
    return reason
