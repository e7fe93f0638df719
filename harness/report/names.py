"""What costs and outcomes are called in tables and figures."""

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
