"""What Nav2 sets by itself where a file names no critics of DWB."""

from collections.abc import Mapping
from typing import Any

from navstack.params.dwb import FALLBACK_SCALES, DwbParams
from navstack.params.nav2_file.findings import Visit, value_of
from navstack.params.nav2_file.ros_yaml import ParameterEntry
from navstack.params.registry.bindings import nested_params


def fallback_scales(
    entries: Mapping[str, ParameterEntry], prefix: str
) -> dict[str, ParameterEntry]:
    """The critics' scales that a file leaves to Nav2, on line 0; none where it names its critics.

    Args:
        entries: the controller server's parameters by dotted name.
        prefix: of DWB's namespace, ending in a dot.
    """
    if f"{prefix}critics" in entries:
        return {}
    found = {}
    for critic, (older, scale) in FALLBACK_SCALES.items():
        bias = value_of(entries, f"{prefix}{older}", scale)
        # anything else is reported where it stands
        if isinstance(bias, int | float) and not isinstance(bias, bool):
            found[f"{prefix}{critic}.scale"] = ParameterEntry(float(bias), 0, 0, 0, 0)
    return {name: entry for name, entry in found.items() if name not in entries}


def unnamed_critics(visit: Visit, values: Mapping[str, Any]) -> list[Visit]:
    """The critics of DWB's namespace that Nav2 loads where the file names none."""
    if visit.params is not DwbParams or f"{visit.prefix}critics" in values:
        return []
    critics = nested_params(DwbParams)
    return [Visit(f"{visit.prefix}{name}.", critics[name]) for name in DwbParams().critics]
