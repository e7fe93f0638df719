"""What a recorded drive cost."""

from dataclasses import dataclass
from typing import Any

from harness.economics.prices import load_prices
from harness.identify.drive_cost import DriveCost, cost_of_drive
from harness.recorded.log import DriveLog, LogRequest, read_log
from harness.storage.shipped import DEFAULT_WORLD, resolve, shipped
from harness.world.map.scene_io import load_scene
from harness.world.physics.robot import RobotParams
from harness.world.world_params import WorldParams
from navbench.api.progress import say
from navstack.params.strict import load_dataclass


@dataclass(frozen=True, slots=True)
class PricedLog:
    """A recorded drive with its events and dollars."""

    log: DriveLog
    cost: DriveCost
    prices: str
    map_name: str

    def as_json(self) -> dict[str, Any]:
        """As ``navbench cost-log --json`` prints it."""
        cost = self.cost
        kilometres = max(1e-3 * cost.distance, 1e-9)
        kinds = ("contact", "near_miss", "hard_brake", "intervention")
        counts = {kind: cost.count(kind) for kind in kinds}
        return {
            "schema": 1,
            "bag": self.log.files,
            "map": self.map_name,
            "prices": self.prices,
            "duration_s": cost.duration,
            "distance_m": cost.distance,
            "energy_kwh": cost.energy,
            "spilled_share": cost.spilled,
            "events": [event.as_json() for event in cost.events],
            "counts": counts,
            "per_km": {kind: count / kilometres for kind, count in counts.items()},
            "contact_threshold_ns": cost.threshold,
            "false_alarms_per_h": cost.false_alarms,
            "contacts_from": cost.source,
            "costs_usd": dict(cost.terms),
            "total_usd": cost.total,
            "total_usd_per_km": cost.total / kilometres,
        }


def cost_log(
    request: LogRequest,
    robot: str,
    map: str,  # noqa: A002 - as the option is called
    *,
    prices: str = "costnav",
    world: str = DEFAULT_WORLD,
) -> PricedLog:
    """Find what happened on a recorded drive, and price it.

    Args:
        request: bags, remappings and frames.
        robot: that drove: a name of params/robots or a file, as ``navbench identify`` writes it.
        map: a built-in map or a map_server YAML file, in whose frame the log's poses are.
        prices: a name of params/prices or a file.
        world: a name of params/worlds or a file: the cargo, and the contacts that count.

    Raises:
        InputError: something given cannot be used.
    """
    params = shipped("params")
    body = load_dataclass(RobotParams, resolve(robot, params / "robots", "robot"))
    rules = load_dataclass(WorldParams, resolve(world, params / "worlds", "world"))
    paid_by = load_prices(prices)
    scene = load_scene(map)
    log = read_log(request, lambda text: say(f"warning: {text}"))
    return PricedLog(log, cost_of_drive(log, body, scene, rules, paid_by), prices, map)
