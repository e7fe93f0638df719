"""What a check of a parameter file works on, and what it finds."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

from navstack.params.nav2_file.ros_yaml import ParameterEntry, Value
from navstack.params.registry.entry import Params

Parameters = Mapping[str, Mapping[str, ParameterEntry]]  # node -> dotted name -> entry

UNKNOWN = "unknown-plugin"  # ids of notices
UNKNOWN_KEY, MISSPELT = "unknown-key", "misspelt-key"
RENAMED = "renamed"
# Nav2 does not look at what they name, and does not complain
IGNORED_BY_NAV2 = (MISSPELT, UNKNOWN_KEY, "unknown-node")


@dataclass(frozen=True, slots=True)
class Notice:
    """One finding about a file."""

    id: str
    path: str  # node: parameter
    message: str
    advice: str = ""
    line: int = 0  # in the file; 0: nowhere in particular
    is_error: bool = False

    def __str__(self) -> str:
        text = self.message
        if self.path:
            text = f"{self.path}: {text}"
        if self.line:
            text = f"line {self.line}: {text}"
        if self.advice:
            text = f"{text}; {self.advice}"
        return text


@dataclass(slots=True)
class ParameterSection:
    """A namespace of parameters."""

    values: dict[str, ParameterEntry] = field(default_factory=dict)
    sections: dict[str, "ParameterSection"] = field(default_factory=dict)

    @staticmethod
    def of(entries: Mapping[str, ParameterEntry]) -> "ParameterSection":
        """The tree of dotted names."""
        root = ParameterSection()
        for dotted, entry in entries.items():
            *parts, name = dotted.split(".")
            section = root
            for part in parts:
                section = section.sections.setdefault(part, ParameterSection())
            section.values[name] = entry
        return root

    def first_line(self) -> int:
        """The first line of the file that belongs to it."""
        lines = [entry.line for entry in self.values.values()]
        lines += [section.first_line() for section in self.sections.values()]
        return min(lines, default=0)


@dataclass(frozen=True, slots=True)
class Visit:
    """A namespace whose parameters a dataclass reads."""

    prefix: str  # dotted, empty for the node itself
    params: Params
    plugin: str = ""  # type of the plugin there, where the file leaves it to Nav2's default


class Known(NamedTuple):
    """A parameter or plugin of a file, and the distributions of Nav2 that have it."""

    path: str
    line: int
    releases: tuple[str, ...]


@dataclass(slots=True)
class Findings:
    """What the check of one node found."""

    notices: list[Notice] = field(default_factory=list)
    ignored: list[str] = field(default_factory=list)
    added: list[str] = field(default_factory=list)  # dotted names of what users may have added
    visits: list[Visit] = field(default_factory=list)
    # dotted name in the file -> today's dotted name
    renames: dict[str, str] = field(default_factory=dict)
    # today's dotted name -> the one in the file that was put in its place
    moved: dict[str, str] = field(default_factory=dict)
    names: list[Known] = field(default_factory=list)  # that Nav2 has

    def apply_renames(self, entries: dict[str, ParameterEntry]) -> None:
        """Give parameters today's names."""
        for old, new in self.renames.items():
            entry = entries.pop(old)
            if isinstance(entry.value, str) and new.endswith("_plugins"):  # one name became a list
                entry = replace(entry, value=list(names_in(entry.value)))
            entries[new] = entry


def is_told(message: str, notices: Iterable[Notice]) -> bool:
    """Whether a controller's message is about a critic that is refused as an unknown plugin."""
    refused = (
        notice.path.rpartition(".")[2]
        for notice in notices
        if notice.id == UNKNOWN and notice.is_error
    )
    return any(f"critics: '{name}' is not available" in message for name in refused)


def value_of(entries: Mapping[str, ParameterEntry], name: str, default: Value) -> Value:
    """A parameter of a node by its dotted name."""
    return entries[name].value if name in entries else default


def names_of(
    entries: Mapping[str, ParameterEntry], name: str, default: Iterable[str] = ()
) -> tuple[str, ...]:
    """The names in a list parameter of a node."""
    return names_in(value_of(entries, name, list(default)))


def names_in(value: Value | None) -> tuple[str, ...]:
    """The names in a list parameter: a list of texts, or one text with blanks between the names."""
    if isinstance(value, str):
        return tuple(value.split())
    if isinstance(value, list):
        return tuple(str(item) for item in value)
    return ()
