"""Touches of people that no price counts, on the screen of a run: none of its rows shows them."""

from collections import defaultdict
from collections.abc import Hashable

from harness.economics.accountings import COUNTED, EVENT, PERSON
from harness.metrics.contacts import was_counted
from harness.storage.parameters import parameter_folder
from harness.study.stored_run import StoredRun
from harness.world.physics.robot import RobotParams
from harness.world.world_params import WorldParams
from navstack.params.strict import load_dataclass


def uncounted_touches(run: StoredRun) -> dict[str, list[float | None]]:
    """Touches of robots and people without a counted contact, by stack.

    Of each the most [N s] of a physics step, all its points together; None: an older run does not
    tell.
    """
    counted: dict[Hashable, list[tuple[float, Hashable]]] = defaultdict(list)
    for event in run.events:
        if event["type"] == COUNTED and event["partner"] == PERSON:
            delivery = event["stack"], event["episode"]
            counted[delivery].append((event["stamp_s"], event["partner_id"]))
    found: dict[str, list[float | None]] = defaultdict(list)
    for event in run.events:
        if event["type"] != EVENT or event["partner"] != PERSON:
            continue
        delivery = event["stack"], event["episode"]
        when = event["stamp_s"], event["duration_s"] or 0.0
        if not was_counted(*when, event["partner_id"], counted[delivery]):
            found[event["stack"]].append(event["peak_step_impulse_ns"])
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
    told = ", ".join(f"{stack.name} {len(touches.get(stack.name, ()))}" for stack in run.stacks)
    peaks = [peak for own in touches.values() for peak in own if peak is not None]
    text = f"touches of people that do not count: {told}"
    if len(peaks) < sum(map(len, touches.values())):
        return text
    soft = f"below {least:g} N s in a step"
    if len(masses) == 1:
        (mass,) = masses
        soft += f", {least / mass:.1f} m/s of a robot of {mass:g} kg"
    hard = sum(peak >= least for peak in peaks)
    if not hard:
        return f"{text}; all {soft}"
    return (
        f"{text}; {len(peaks) - hard} {soft}, the others up to {max(peaks):.0f} N s: no point of "
        "them counts, or they come right after one that does"
    )
