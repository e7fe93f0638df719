"""What holds where a file names no critics of DWB: what Foxy set by itself."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from navstack.params.dwb import FALLBACK_SCALES, DwbParams
from navstack.params.nav2_file.findings import Notice, Visit, value_of
from navstack.params.nav2_file.ros_yaml import ParameterEntry
from navstack.params.registry.bindings import nested_params


def fallback_scales(
    entries: Mapping[str, ParameterEntry], prefix: str
) -> dict[str, ParameterEntry]:
    """The critics' scales that a file left to Foxy, on line 0; none where it names its critics.

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


def missing_critics(
    node: str, entries: Mapping[str, ParameterEntry], visits: Iterable[Visit]
) -> Iterator[Notice]:
    """What Nav2 since Galactic does not start without: DWB's critics."""
    for visit in visits:
        plugin = entries.get(f"{visit.prefix}plugin")
        name = f"{visit.prefix}critics"
        if visit.params is DwbParams and plugin is not None and name not in entries:
            message = "is missing; since Galactic Nav2's controller server needs it to start"
            advice = f"list them, as in critics: [{', '.join(DwbParams().critics)}]"
            yield Notice("missing-value", f"{node}: {name}", message, advice, plugin.line)


def unnamed_critics(visit: Visit, values: Mapping[str, Any]) -> list[Visit]:
    """The critics of DWB's namespace that run where the file names none."""
    if visit.params is not DwbParams or f"{visit.prefix}critics" in values:
        return []
    critics = nested_params(DwbParams)
    return [Visit(f"{visit.prefix}{name}.", critics[name]) for name in DwbParams().critics]
