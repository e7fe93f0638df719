"""What comes with the program, by name, with a line each."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from harness.storage.shipped import DEFAULT_WORLD, about, names, resolve, shipped
from harness.task.stack import ROS2, TRUTH
from navstack.errors import UnknownNameError
from navstack.params.extensions import localizers
from navstack.params.strict import load_yaml, read_text

# stacks of a robot that can be built, one for each controller and localizer; the others with --all
FOREMOST = (
    *("nav2-stock", "nav2-gps-ekf", "nav2-amcl", "rpp-gps-ekf"),
    *("mppi-gps-ekf", "graceful-gps-ekf", "mpc-gps-ekf", "evasive-gps-ekf"),
)
LONGEST = 110  # [characters] of a description


@dataclass(frozen=True, slots=True)
class Listed:
    """One thing that has a name."""

    name: str
    what: str  # a line


@dataclass(frozen=True, slots=True)
class ListedWorld:
    """A world as the table of worlds has it."""

    name: str
    purpose: str
    people: str
    source: str
    also: tuple[str, ...]  # other names, which are understood

    @property
    def is_default(self) -> bool:
        """Whether a command takes it where none is named."""
        return self.name == DEFAULT_WORLD


def listing(kind: str, is_all: bool = True) -> list[Listed]:
    """What of a kind comes with the program.

    Args:
        kind: of :data:`KINDS`.
        is_all: whether stacks for special uses are among them.

    Raises:
        UnknownNameError: there is no such kind.
    """
    if kind not in KINDS:
        raise UnknownNameError("kind", kind, KINDS)
    found = KINDS[kind].find()
    if kind == "stacks" and not is_all:
        known = {each.name: each for each in found}
        return [known[name] for name in FOREMOST]
    return found


def worlds() -> list[ListedWorld]:
    """The worlds, the default one first."""
    folder = shipped("params") / "worlds"
    told = about(folder)
    found = []
    for name in sorted(names(folder), key=lambda name: (name != DEFAULT_WORLD, name)):
        entry = told.get(name, {})
        purpose = entry.get("purpose") or first_sentence(resolve(name, folder, "world"))
        found.append(
            ListedWorld(
                name,
                purpose,
                entry.get("people", ""),
                entry.get("source", ""),
                tuple(entry.get("also", ())),
            )
        )
    return found


def first_sentence(file: Path) -> str:
    """The first sentence of the comment at the head of a file, shortened."""
    lines = []
    for line in read_text(file).splitlines():
        if not line.startswith("#"):
            break
        lines.append(line.lstrip("# "))
    text = re.split(r"(?<=[a-z\d)])[.:;](?:\s|$)", " ".join(lines))[0]
    return _shortened(text)


def _shortened(text: str) -> str:
    if len(text) <= LONGEST:
        return text
    return text[:LONGEST].rsplit(" ", 1)[0] + " ..."


def _described(folder: str) -> Callable[[], list[Listed]]:
    """Files that say in their first sentence what they are."""
    place = shipped("params") / folder
    return lambda: [Listed(name, first_sentence(place / f"{name}.yaml")) for name in names(place)]


def _stacks() -> list[Listed]:
    """Stacks that drive here; that of ``navbench serve`` is driven elsewhere."""
    return [each for each in _titled("stacks")() if each.name != ROS2]


def _titled(folder: str) -> Callable[[], list[Listed]]:
    """Files with a title."""
    place = shipped("params") / folder
    return lambda: [
        Listed(name, _shortened(load_yaml(place / f"{name}.yaml")["title"]))
        for name in names(place)
    ]


def _worlds() -> list[Listed]:
    return [
        Listed(
            world.name + (" (default)" if world.is_default else ""),
            "; ".join(filter(None, (world.purpose, world.people, world.source))),
        )
        for world in worlds()
    ]


def _localizers() -> list[Listed]:
    found = [Listed(TRUTH, "the true pose, which no robot can have")]
    for name, entry in localizers().items():
        text = f"from {', '.join(entry.inputs)}"
        if entry.uses:
            text += f"; takes {', '.join(entry.uses)} where it is there"
        if entry.uses_map:
            text += "; needs a map"
        found.append(Listed(name, text))
    return found


def _maps() -> list[Listed]:
    layers = ("_navmesh", "_walkable")
    known = [name for name in names(shipped("maps")) if not name.endswith(layers)]
    return [Listed(name, "generated after the paper's statistics") for name in known]


@dataclass(frozen=True, slots=True)
class Kind:
    """Things that have names, and the option that takes one."""

    option: str
    find: Callable[[], list[Listed]]


KINDS = {
    "stacks": Kind("--stack", _stacks),
    "worlds": Kind("--world", _worlds),
    "robots": Kind("--robot", _described("robots")),
    "sensors": Kind("--sensors", _described("sensors")),
    "localizers": Kind("--localizer", _localizers),
    "spaces": Kind("--space", _titled("search_spaces")),
    "prices": Kind("--prices", _described("prices")),
    "maps": Kind("--map", _maps),
}
