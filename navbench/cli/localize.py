"""The command ``navbench localize``."""

import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from harness.storage.shipped import is_file
from navbench.cli.driving import INTERRUPTED
from navbench.cli.options import JSON, STRICT
from navbench.cli.streams import print_json
from navbench.cli.values import Finite

if TYPE_CHECKING:
    from harness.recorded.command import Localized
    from harness.recorded.trajectory import Errors
    from navbench.api.localize import Worth

NO_RPE = "none: the reference has no headings, or no two poses are that far apart"


@click.command()
@click.option(
    "--bag",
    "bags",
    multiple=True,
    required=True,
    type=click.Path(path_type=Path),
    help="A .bag, .mcap or .db3 file or a folder of ROS 2; repeatable for a log in several files.",
)
@click.option(
    "--map", "map_name", help="A map_server YAML file or a built-in map; for amcl and amcl-gps."
)
@click.option("--params", required=True, help="A Nav2 parameter file, or a name of params/nav2.")
@click.option(
    "--localizer", required=True, help="Such as gps-ekf or amcl; docs/localization.md lists them."
)
@click.option(
    "--out",
    required=True,
    type=click.Path(path_type=Path),
    help="Trajectory to write, in TUM's format.",
)
@click.option(
    "--static-tf",
    multiple=True,
    metavar="TEXT",
    help="Where a sensor is: 'PARENT CHILD x y yaw' or 'PARENT CHILD x y z roll pitch yaw', "
    "[m] and [rad]; "
    "repeatable.",
)
@click.option(
    "--remap",
    multiple=True,
    metavar="USUAL:=ACTUAL",
    help="Another topic, e.g. /scan:=/front/scan.",
)
@click.option(
    "--reference", metavar="TOPIC|FILE", help="Poses to compare with: of a topic, or of a TUM file."
)
@click.option(
    "--hold-out",
    "is_held_out",
    is_flag=True,
    help="Of a reference that the localizer reads, every other message is only compared with.",
)
@click.option(
    "--align",
    "alignment",
    type=click.Choice(("none", "start", "se2")),
    default="none",
    show_default=True,
    help="How the trajectory is laid on the reference before the APE is taken.",
)
@click.option(
    "--interval",
    type=Finite(min=0.0, max=1e6, min_open=True),
    default=1.0,
    show_default=True,
    help="Of the RPE, in [s].",
)
@click.option(
    "--initial-pose",
    metavar="x,y,yaw[,std_xy,std_yaw]",
    help="Where the robot starts; default: the file's, for amcl, else 0,0,0.",
)
@click.option(
    "--global", "is_global", is_flag=True, help="Start anywhere on the map; for amcl and amcl-gps."
)
@click.option(
    "--datum",
    metavar="LAT,LON[,HEADING]",
    help="Origin of the local frame, [rad] of its x axis from east; "
    "default: such that the first fix is where the robot starts.",
)
@click.option("--base-frame", help="Frame of the robot; default: the odometry's child frame.")
@click.option(
    "--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of the particles."
)
@STRICT
@JSON
def localize(as_json: bool, **choices: Any) -> None:
    """Run one of the robot's localizers over a recorded ROS 1 or ROS 2 bag, without ROS.

    Reads LaserScan, Imu, NavSatFix, Odometry and the frames of tf_static; writes the believed
    poses; prints the errors (APE, RPE) against a reference. docs/recorded_logs.md describes it.

    \b
    Examples:
      navbench localize --bag drive.bag --params stock --localizer gps-ekf --out drive.tum \\
          --reference /fix --hold-out
      navbench localize --bag rosbag2_drive --map office.yaml --params my_nav2.yaml \\
          --localizer amcl --out drive.tum
      navbench localize --bag drive.mcap --params stock --localizer odom_imu --out drive.tum \\
          --static-tf "base_link imu_link 0 0 0.5 1.5708 0 -1.5708" --remap /imu/data:=/xsens/imu

    Exit status: 0 done; 1 bad input, or a log that breaks off (what was computed is kept); 130
    interrupted (likewise).
    """
    from harness.recorded.bag_file import BagError
    from harness.recorded.command import Request
    from navbench.api.localize import localize, sources, worth
    from navbench.api.progress import say

    found = localize(Request(**choices))
    if len(found.trajectory):
        value = worth(found)
        if as_json:
            print_json({**found.as_json(), "worth": value and value.as_json()})
        else:
            lines = [_setup_line(found, sources(found.request))]
            lines += [*_reference_lines(found), *_worth_lines(value), *_lines(found)]
            lines += _next_lines(found)
            sys.stdout.write("".join(f"{line}\n" for line in lines))
    if found.is_interrupted:
        say(found.trouble)
        sys.exit(INTERRUPTED)
    if found.trouble:
        raise BagError(found.trouble)


def _setup_line(found: "Localized", sources: Sequence[str]) -> str:
    """What ran over what, with parameters from where: one line."""
    request = found.request
    bags = ", ".join(map(str, request.bags))
    on = f", map {request.map_name}" if request.map_name else ""
    return "; ".join([f"{request.localizer} over {bags}{on}", *sources])


def _reference_lines(found: "Localized") -> list[str]:
    """What speaks against the figures, as that they compare with the localizer's own input."""
    request = found.request
    if found.doubt:
        return [f"{found.doubt}: errors are left out before --static-tf gives it"]
    if request.reference is None:
        return ["without a reference nobody knows what the error costs: --reference TOPIC or FILE"]
    if not found.is_reference_input:
        return []
    if request.is_held_out:
        return [
            f"every other message of {request.reference} was kept from {request.localizer} and is "
            "compared with: their own noise counts, errors that all of them share do not"
        ]
    return [
        f"{request.reference} is an input of {request.localizer}: below is how closely it follows "
        "its own input, not how far off it is, so that it has no price; --hold-out compares with "
        "messages that it never had"
    ]


def _next_lines(found: "Localized") -> list[str]:
    """The command that says what this localizer earns; none where the file has only a name."""
    request = found.request
    if found.doubt or not is_file(request.params):
        return []
    arms = f"ground_truth,{request.localizer}"
    return [f"next: navbench ablate --stack {shlex.quote(request.params)} --localizers {arms}"]


def _lines(found: "Localized") -> list[str]:
    request, stamps, poses = found.request, found.trajectory.stamps, found.trajectory.poses
    x, y, yaw = poses[-1]
    lasted = stamps[-1] - stamps[0]  # [s]
    lines = [
        f"{len(poses)} poses over {lasted:.1f} s in {request.out}; "
        f"the last: x {x:.3f} m, y {y:.3f} m, yaw {yaw:.4f} rad"
    ]
    if found.degraded or found.lost:
        lines.append(f"health: DEGRADED for {found.degraded:.1f} s, LOST for {found.lost:.1f} s")
    if found.ape is not None and not found.doubt:
        reference = f"{request.reference}, alignment {request.alignment}"
        lines.append(f"APE against {reference}: {_text(found.ape)}")
        rpe = NO_RPE if found.rpe is None else _text(found.rpe)
        lines.append(f"RPE over {request.interval:g} s: {rpe}")
    return lines


def _worth_lines(value: "Worth | None") -> list[str]:
    """What the error costs, and whether it is good enough to arrive."""
    if value is None:
        return []
    usd = f"{value.usd_per_run:z.2f} [{value.low_usd:z.2f}, {value.high_usd:z.2f}] USD a delivery"
    text = f"an error of {value.rmse_m:.2f} m (RMSE) costs about {usd} ({value.study})"
    if value.is_beyond:
        text = (
            f"an error of {value.rmse_m:.2f} m (RMSE) has no measured price; one of "
            f"{value.largest_m:g} m, the largest that has, costs {usd} ({value.study})"
        )
    lines = [text]
    if value.goal_tolerance_m is not None and value.share_within is not None:
        lines.append(
            f"{100.0 * value.share_within:.0f} % of the poses are near enough to the reference to "
            f"arrive: within the file's goal tolerance of {value.goal_tolerance_m:g} m"
        )
    return lines


def _text(errors: "Errors") -> str:
    values: dict[str, Any] = errors.as_json()
    metres = [f"{name} {values[f'{name}_m']:.3f} m" for name in ("median", "rmse", "p95", "max")]
    text = f"{', '.join(metres)}, n {values['n']}"
    if errors.yaws is not None:
        text += f"; heading median {values['yaw_median_rad']:.4f} rad"
    return text
