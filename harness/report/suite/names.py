"""What the parts of a suite are called in tables and figures."""

from collections.abc import Sequence
from pathlib import Path

from harness.study.suite import Condition

COSTS = {  # fields of harness.economics.cost_model.Economics -> words
    "pedestrian_safety": "injuries",
    "service_compensation": "refunds",
    "repair": "repair",
    "property_damage": "property",
    "electricity": "electricity",
}
OUTCOMES = {
    "sla": "in time, intact",
    "spoiled": "spoiled",
    "timeout": "timeout",
    "physical_assistance": "assistance",
}


def label_of(condition: Condition, among: Sequence[Condition]) -> str:
    """A condition in few words: the map, and what else varies among them all."""
    parts = [Path(condition.map_name).stem]
    if len({each.world for each in among}) > 1:
        parts.append(Path(condition.world).stem)
    if len({each.pedestrians for each in among}) > 1:
        parts.append("own people" if condition.pedestrians is None else f"{condition.pedestrians} people")
    return ", ".join(parts)
