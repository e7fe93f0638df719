"""What of a stack goes by wall time while the simulation may be slower."""

from navstack.params.nav2_file.file import Nav2File
from navstack.params.nav2_file.release import VELOCITY_SMOOTHER
from navstack.params.safety import VelocitySmootherParams


def on_wall_time(nav2: Nav2File, real_time_factor: float) -> Nav2File:
    """A file whose velocity smoother works on wall time, as Nav2's ``create_wall_timer`` does.

    In a simulation that takes longer than it lasts the smoother runs more often per simulated
    second, and each time it allows the same change. Here it allows more each time.

    Args:
        nav2: the file.
        real_time_factor: [-] simulated seconds per second of wall time.
    """
    if real_time_factor == 1.0 or not nav2.runs(VELOCITY_SMOOTHER):
        return nav2
    smoother = nav2.read(VelocitySmootherParams, VELOCITY_SMOOTHER)
    limits = {"max_accel": smoother.max_accel, "max_decel": smoother.max_decel}
    return nav2.with_values(
        {
            f"{VELOCITY_SMOOTHER}.{name}": [each / real_time_factor for each in values]
            for name, values in limits.items()
        },
        allow_unknown=True,
    )
