"""Localizers, by the names that stack files use."""

from collections.abc import Mapping
from dataclasses import dataclass

from navstack.params.registry.entry import AlgorithmEntry

ODOMETRY, IMU, FIX, SCAN = INPUTS = ("odometry", "imu", "fix", "scan")
OWN_NODE = "localizer"  # of a Nav2 file, for the parameters of a localizer of another package
_AMCL_KERNELS = (
    "navstack.costmap.distances",
    "navstack.localization.amcl_kernels",
    "navstack.localization.kld",
    "navstack.localization.motion_model",
)
_EKF_KERNELS = ("navstack.localization.gps_ekf_kernels",)


@dataclass(frozen=True, slots=True)
class LocalizerEntry(AlgorithmEntry):
    """A localizer; ``make`` takes the parameters of each of its nodes, then what it needs."""

    nodes: tuple[str, ...] = ()  # of a Nav2 file
    inputs: tuple[str, ...] = ()  # of INPUTS, without which it cannot work
    uses: tuple[str, ...] = ()  # of INPUTS, which it takes where they are

    @property
    def uses_map(self) -> bool:
        """Whether it compares scans with a map."""
        return SCAN in self.inputs


LOCALIZERS: Mapping[str, LocalizerEntry] = {
    "gps": LocalizerEntry(
        make="navstack.localization.gps:GpsLocalizer", inputs=(FIX,), uses=(IMU,)
    ),
    "gps-ekf": LocalizerEntry(
        make="navstack.localization.gps_ekf:GpsEkfLocalizer",
        needs=("static_map",),
        kernels=_EKF_KERNELS,
        nodes=("gps_ekf",),
        inputs=(ODOMETRY, FIX),
        uses=(IMU,),
    ),
    "odom_imu": LocalizerEntry(
        make="navstack.localization.gps_ekf:DeadReckoningLocalizer",
        kernels=_EKF_KERNELS,
        nodes=("gps_ekf",),
        inputs=(ODOMETRY, IMU),
    ),
    "amcl": LocalizerEntry(
        make="navstack.localization.amcl:AmclLocalizer",
        needs=("static_map",),
        kernels=_AMCL_KERNELS,
        nodes=("amcl",),
        inputs=(ODOMETRY, SCAN),
    ),
    "amcl-gps": LocalizerEntry(
        make="navstack.localization.amcl_gps:AmclGpsLocalizer",
        needs=("static_map",),
        kernels=_AMCL_KERNELS,
        nodes=("amcl", "amcl_gps"),
        inputs=(ODOMETRY, SCAN, FIX),
        uses=(IMU,),
    ),
}
