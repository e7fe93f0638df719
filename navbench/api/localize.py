"""A recorded log through one of the robot's localizers."""

from harness.recorded.command import Localized, Request
from harness.recorded.command import localize as replay
from navbench.api.progress import share_shown


def localize(request: Request) -> Localized:
    """Run a localizer over a recorded ROS 1 or ROS 2 bag, and write the trajectory.

    Args:
        request: bags, parameters, localizer, file to write and more.

    Returns:
        The trajectory, its errors, and why it ends early where the log breaks off.

    Raises:
        InputError: something given cannot be used.
    """
    return replay(request, lambda: share_shown("messages"))
