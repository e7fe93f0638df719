"""Touches of people that no price counts, on the screen of a run: none of its rows shows them."""

from collections import Counter, defaultdict
from collections.abc import Hashable

from harness.economics.accountings import COUNTED, EVENT, PERSON
from harness.metrics.contacts import was_counted
from harness.storage.parameters import parameter_folder
from harness.study.stored_run import StoredRun
from harness.world.physics.robot import RobotParams
from harness.world.world_params import WorldParams
from navstack.params.strict import load_dataclass


def uncounted_touches(run: StoredRun) -> Counter[str]:
    """How often robots and people touched without a counted contact, by stack."""
    counted: dict[Hashable, list[tuple[float, Hashable]]] = defaultdict(list)
    for event in run.events:
        if event["type"] == COUNTED and event["partner"] == PERSON:
            delivery = event["stack"], event["episode"]
            counted[delivery].append((event["stamp_s"], event["partner_id"]))
    found: Counter[str] = Counter()
    for event in run.events:
        if event["type"] != EVENT or event["partner"] != PERSON:
            continue
        delivery = event["stack"], event["episode"]
        when = event["stamp_s"], event["duration_s"] or 0.0
        if not was_counted(*when, event["partner_id"], counted[delivery]):
            found[event["stack"]] += 1
    return found


def touches_line(run: StoredRun) -> str:
    """How often people were touched without a price, and how hard that can be; empty: never."""
    touches = uncounted_touches(run)
    if not touches:
        return ""
    parameters = parameter_folder(run.folder)
    least = load_dataclass(WorldParams, parameters / "world.yaml").contacts.counted_impulse
    robots = [parameters / f"{stack.name}-robot.yaml" for stack in run.stacks]
    masses = {load_dataclass(RobotParams, robot).mass for robot in robots if robot.is_file()}
    told = ", ".join(f"{stack.name} {touches[stack.name]}" for stack in run.stacks)
    text = f"touches of people that do not count, below {least:g} N s in a step: {told}"
    if len(masses) == 1:
        (mass,) = masses
        text += f"; that is {least / mass:.1f} m/s of a robot of {mass:g} kg"
    return text
