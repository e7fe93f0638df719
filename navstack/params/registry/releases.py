"""Nav2's distributions, and what each of them declares: one file of facts for each."""

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

# oldest first
RELEASES = ("foxy", "galactic", "humble", "iron", "jazzy", "kilted", "lyrical", "main")
_FOLDER = Path(__file__).with_name("nav2")
# ROS's kinds of parameters by Python's
_KINDS = {bool: "bool", int: "integer", float: "double", str: "string"}


@dataclass(frozen=True, slots=True)
class Declared:
    """A parameter as Nav2 declares it."""

    releases: tuple[str, ...] = ()  # of RELEASES; none: not Nav2's own, or of any release
    kinds: frozenset[str] = frozenset()  # of ROS: double, integer, bool, string, double_array ...

    def wants(self, kind: type[int] | type[float], value: object) -> bool:
        """Whether a number, or one in a list, has a point and should not, or the other way."""
        name = _KINDS[kind]
        values = value if isinstance(value, list) else [value]
        is_declared_so = self.kinds in ({name}, {f"{name}_array"})
        return is_declared_so and any({type(each), kind} == {int, float} for each in values)

    def misfit(self, value: object) -> str:
        """What a value should be and is not; empty if it is, or if nothing is known."""
        is_switch = isinstance(value, bool)
        if self.kinds == {"bool"} and not is_switch:
            return "true or false"
        is_number = isinstance(value, int | float) and not is_switch
        if self.kinds and self.kinds <= {"double", "integer"} and not is_number:
            return "a number"
        return ""


def load(release: str) -> dict[str, Any]:
    """Commit, nodes and plugins of a distribution, as its file has them."""
    found: dict[str, Any] = json.loads(_FOLDER.joinpath(f"{release}.json").read_text())
    return found


_ALL = {release: load(release) for release in RELEASES}


def lacks(release: str, node: str) -> bool:
    """Whether a node of Nav2 is of other distributions only."""
    return node in node_names() and node not in _ALL[release]["nodes"]


def of_node(node: str) -> dict[str, Declared]:
    """The parameters of a node by dotted name; ``*`` stands for a name in a list."""
    return _joined({release: found["nodes"].get(node, {}) for release, found in _ALL.items()})


def node_names() -> set[str]:
    """The nodes of any release."""
    return {node for found in _ALL.values() for node in found["nodes"]}


def plugins_of(
    family: str, renamed: Mapping[str, str]
) -> dict[str, tuple[tuple[str, ...], dict[str, Declared]]]:
    """The releases that have each of a family's plugins, and its parameters by dotted name.

    ``renamed`` are the older names of packages.
    """
    given: dict[str, dict[str, Mapping[str, Any]]] = {}
    for release in RELEASES:
        for kind, parameters in plugins_in(release, family, renamed).items():
            given.setdefault(kind, {})[release] = parameters
    return {kind: (tuple(found), _joined(found)) for kind, found in given.items()}


def plugins_in(
    release: str, family: str, renamed: Mapping[str, str]
) -> dict[str, Mapping[str, Any]]:
    """The plugins of a family in one release, each with its parameters' defaults."""
    found = {}
    for kind, parameters in _ALL[release]["plugins"].get(family, {}).items():
        package, _, name = kind.rpartition("::")
        found["::".join(filter(None, (renamed.get(package, package), name)))] = parameters
    return found


def declared(default: Any, release: str = "", before: Declared | None = None) -> Declared:
    """A parameter with a default in a release; ``before``: in others."""
    known = before or Declared()
    having = (*known.releases, *filter(None, (release,)))
    return Declared(having, known.kinds.union(_kinds(default)))


def span(releases: Iterable[str]) -> str:
    """``since kilted``, ``until humble``, or the names of releases with others between."""
    given = [each for each in RELEASES if each in releases]
    first, last = RELEASES.index(given[0]), RELEASES.index(given[-1])
    if len(given) <= last - first:
        return f"of {', '.join(given)}"
    if last == len(RELEASES) - 1:
        return f"since {given[0]}"
    if first == last:
        return f"of {given[0]}"
    return f"until {given[-1]}" if first == 0 else f"{given[0]} to {given[-1]}"


def _joined(by_release: Mapping[str, Mapping[str, Any]]) -> dict[str, Declared]:
    found: dict[str, Declared] = {}
    for release, parameters in by_release.items():
        for name, default in parameters.items():
            found[name] = declared(default, release, found.get(name))
    return found


def _kinds(default: Any) -> Iterator[str]:
    if isinstance(default, dict):
        yield default["type"]
    elif isinstance(default, list):
        yield f"{_KINDS[type(default[0])]}_array"
    elif default is not None:
        yield _KINDS[type(default)]
