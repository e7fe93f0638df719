"""Algorithms of other packages, found through the entry-point group ``navstack.plugins``.

A package declares an entry point of the group for each of its algorithms; the name is free, the object is an
:class:`Extension`. From then on Nav2 files may name its type as they name one of Nav2's.
"""

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any, TypeVar

from navstack.errors import NavstackError, ParameterError
from navstack.params.nav2_file.bindings import Params
from navstack.params.nav2_file.schema import nodes

GROUP = "navstack.plugins"
FAMILIES = ("controllers", "dwb_critics", "planners")  # to which a package can add

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Extension:
    """One algorithm of another package.

    ``make`` is called as those of this program are: a controller with its parameters, the padded footprint (V, 2) in
    [m], the control frequency in [Hz] and the goal checker's xy tolerance in [m]; a critic of DWB with its parameters
    and DWB's; a planner with its parameters and the robot's shape.
    """

    family: str  # of FAMILIES
    type: str  # its name in a Nav2 file, with the package: my_robot::Cautious
    params: Params  # frozen dataclass whose fields are the parameters, with defaults
    make: Callable[..., Any]

    def __post_init__(self) -> None:
        """Check what other packages may get wrong.

        Raises:
            ParameterError: an unknown family, a type without package or one that Nav2 has, or no dataclass.
        """
        if self.family not in FAMILIES:
            raise ParameterError(f"'{self.type}': unknown family '{self.family}'; known: {', '.join(FAMILIES)}")
        if not all(self.type.partition("::")) or self.type in nodes.FAMILIES[self.family]:
            raise ParameterError(f"'{self.type}' is no name of a plug-in's own; give package::Class, e.g. mine::Slow")
        if not (isinstance(self.params, type) and dataclasses.is_dataclass(self.params)):
            raise ParameterError(f"'{self.type}': params is {self.params!r}; give a dataclass of its parameters")


@cache
def extensions() -> tuple[Extension, ...]:
    """What the installed packages bring, in the order of their types.

    Raises:
        ParameterError: an entry point cannot be used; the line names it and the package.
    """
    found: dict[tuple[str, str], Extension] = {}
    for point in sorted(entry_points(group=GROUP), key=lambda each: (each.value, each.name)):
        extension = _loaded(point)
        key = extension.family, extension.type
        if found.setdefault(key, extension) is not extension:
            raise ParameterError(f"{_named(point)}: '{extension.type}' is there twice; uninstall one of the packages")
    return tuple(found[key] for key in sorted(found))


def plugin_packages() -> list[str]:
    """Names of the installed packages that declare entry points of the group, ascending; none is imported."""
    return sorted({point.dist.name for point in entry_points(group=GROUP) if point.dist is not None})


def with_extensions(family: str, own: Mapping[str, T]) -> Mapping[str, T]:
    """A family's name table, joined with what other packages bring for it."""
    added: dict[str, Any] = {each.type: _maker(each) for each in extensions() if each.family == family}
    return {**own, **added}


def extension_params() -> dict[str, dict[str, Params]]:
    """The dataclasses of what other packages bring, by family and type."""
    table: dict[str, dict[str, Params]] = {}
    for each in extensions():
        table.setdefault(each.family, {})[each.type] = each.params
    return table


def _maker(extension: Extension) -> Callable[..., Any]:
    """What makes the algorithm; its mistakes become one line."""

    def make(*given: Any) -> Any:
        try:
            return extension.make(*given)
        except NavstackError:
            raise
        except Exception as error:  # whatever a package of somebody else does
            raise ParameterError(f"'{extension.type}' cannot be made ({error!r}); mend its package") from error

    return make


def _loaded(point: EntryPoint) -> Extension:
    try:
        extension = point.load()
    except Exception as error:  # whatever a package of somebody else does when it is imported
        raise ParameterError(f"{_named(point)} cannot be loaded ({error!r}); mend or uninstall the package") from error
    if not isinstance(extension, Extension):
        raise ParameterError(f"{_named(point)} is {type(extension).__name__}; it has to be an {Extension.__name__}")
    return extension


def _named(point: EntryPoint) -> str:
    package = f" of package {point.dist.name}" if point.dist is not None else ""
    return f"entry point '{point.name} = {point.value}'{package}"
