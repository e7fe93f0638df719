"""In what two runs differ beside their stacks: program, map, conditions, versions."""

from collections.abc import Mapping, Sequence
from typing import Any

from harness.study.stored_run import CONDITIONS, StoredRun

SHOWN_VALUES = 3  # differing parameters that a line names


def unlike(a: StoredRun, b: StoredRun) -> list[str]:
    """Why two runs might differ for other reasons than their stacks, a line each."""
    lines = []
    programs = [run.about.get("program_sha256") for run in (a, b)]
    if None not in programs and programs[0] != programs[1]:
        lines.append("other program: its code, parameters or maps have changed in between")
    if a.folder.resolve() == b.folder.resolve():
        return lines
    if a.about.get("map_sha256") != b.about.get("map_sha256"):
        lines.append(f"other map: {a.map_name} and {b.map_name} differ in content")
    for name in CONDITIONS:
        if different := different_values(a.condition(name), b.condition(name)):
            lines.append(f"other {name}: {_shortened(different)}")
    if a.recorded_people() != b.recorded_people():
        lines.append("other people: the recordings that were replayed differ")
    for key, title in (("seed", "seed"), ("missions", "way to draw missions")):
        if a.about.get(key) != b.about.get(key):
            lines.append(f"other {title}: {a.about.get(key)} and {b.about.get(key)}")
    versions = different_values(a.about.get("versions", {}), b.about.get("versions", {}))
    if versions:
        lines.append(f"other versions: {'; '.join(versions)}")
    return lines


def _shortened(different: Sequence[str]) -> str:
    """The first few of what differs, and how many more there are."""
    text = "; ".join(different[:SHOWN_VALUES])
    if len(different) > SHOWN_VALUES:
        text += f" and {len(different) - SHOWN_VALUES} more"
    return text


def different_values(a: Any, b: Any, both: str = "{a} and {b}", path: str = "") -> list[str]:
    """The leaves in which two nested mappings differ, each with both values.

    How a price is sourced is none.

    Args:
        a: the first mapping.
        b: the second.
        both: how the two values of a leaf are written.
        path: of the mappings in a larger one.
    """
    if isinstance(a, Mapping) and isinstance(b, Mapping):
        keys = [key for key in {**a, **b} if key != "source"]
        return [
            line
            for key in keys
            for line in different_values(a.get(key), b.get(key), both, f"{path}.{key}".strip("."))
        ]
    if a == b:
        return []
    return [f"{path.removesuffix('.value')} {both.format(a=a, b=b)}"]
