"""The command ``navbench cost-log``."""

from dataclasses import replace
from pathlib import Path

import click

from harness.storage.shipped import DEFAULT_WORLD
from navbench.cli.logs.bag_options import bag_options
from navbench.cli.options import FULL, JSON, PRICES, completed, path_option
from navbench.cli.streams import print_json


@click.command("cost-log")
@bag_options
@click.option(
    "--robot",
    required=True,
    shell_complete=completed("robots"),
    help="That drove: a file of navbench identify, or a name of params/robots.",
)
@click.option(
    "--map",
    "map_name",
    required=True,
    shell_complete=completed("maps"),
    help="A built-in map or a map_server YAML file, in the frame of the log's poses.",
)
@click.option(
    "--world",
    default=DEFAULT_WORLD,
    show_default=True,
    shell_complete=completed("worlds"),
    help="Cargo, and contacts that count: a name of params/worlds or a YAML file.",
)
@path_option(
    "--nav2", "FILE", "Drive the log's mission again in the world by this Nav2 parameter file."
)
@click.option(
    "--sensors",
    shell_complete=completed("sensors"),
    help="Of these drives; default: the file that navbench identify wrote beside the robot's.",
)
@click.option(
    "--against",
    multiple=True,
    type=click.Path(path_type=Path),
    metavar="BAG",
    help="Another drive of this robot here, to be compared with; its parts in turn.",
)
@path_option("--html", "FILE.html", "A page with costs, events and a replay on the map.")
@PRICES
@FULL
@JSON
def cost_log(
    bags: tuple[Path, ...],
    static_tf: tuple[str, ...],
    remap: tuple[str, ...],
    base_frame: str | None,
    robot: str,
    map_name: str,
    world: str,
    nav2: Path | None,
    sensors: str | None,
    against: tuple[Path, ...],
    html: Path | None,
    prices: str,
    is_full: bool,
    as_json: bool,
) -> None:
    """Say what happened on a recorded drive, and what it cost.

    Contacts are changes of velocity that the drive cannot have made; near misses come from the
    scans and the map, where the log has the localizer's poses (/amcl_pose). Whether the delivery
    came in time no log says. With --nav2 the mission is driven again in the world: how well the
    simulator is the robot. docs/your_robot.md describes it.

    \b
    Examples:
      navbench cost-log drive.mcap --robot my_robot.yaml --map my_map.yaml
      navbench cost-log drive.mcap --robot my_robot.yaml --map my_map.yaml --prices city_fleet
      navbench cost-log drive.mcap --robot my_robot.yaml --map depot.yaml --nav2 my_nav2.yaml
      navbench cost-log after.mcap --against before.mcap --robot my_robot.yaml --map depot.yaml
      navbench cost-log rosbag2_drive --robot jackal --map office.yaml --json

    Exit status: 0 done; 1 bad input.
    """
    from harness.recorded.copies import require_each_once
    from harness.recorded.log import LogRequest
    from harness.report.priced_log import difference_blocks, priced_log_blocks
    from harness.report.tables import print_blocks, report_console
    from navbench.api.cost_log import comparison_json, cost_log

    require_each_once((*bags, *against))
    request = LogRequest(bags, static_tf, remap, base_frame)
    found = cost_log(
        request,
        robot,
        map_name,
        prices=prices,
        world=world,
        nav2=nav2,
        sensors=sensors,
        html=html,
    )
    other = None
    if against:
        beside = replace(request, bags=against)
        other = cost_log(beside, robot, map_name, prices=prices, world=world)
    if as_json:
        print_json(comparison_json(found, other) if other else found.as_json())
        return
    if other:
        blocks = difference_blocks(found.log, found.cost, other.log, other.cost, found.twin)
        print_blocks(blocks, report_console())
        return
    blocks = priced_log_blocks(found.log, found.cost, found.twin, prices, is_full)
    print_blocks(blocks, report_console())
