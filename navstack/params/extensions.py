"""Algorithms of other packages, found through the entry-point group ``navstack.plugins``.

A package declares an entry point of the group for each of its algorithms; the name is free, the
object is an
:class:`Extension`. From then on Nav2 files may name its type as they name one of Nav2's.
"""

import dataclasses
from collections.abc import Callable
from dataclasses import MISSING, dataclass
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from types import UnionType
from typing import Any, Union, get_args, get_origin

from navstack.errors import NavstackError, ParameterError
from navstack.params.registry.block import ParameterBlock
from navstack.params.registry.entry import AlgorithmEntry, Params
from navstack.params.registry.localizers import INPUTS, LOCALIZERS, OWN_NODE, LocalizerEntry
from navstack.params.registry.nodes import FAMILIES
from navstack.params.registry.releases import Declared
from navstack.type_hints import hints_of

GROUP = "navstack.plugins"
KINDS = (float, int, bool, str, type(None), ...)  # of fields that a Nav2 file can set
NEEDS = {  # family to which a package can add -> what its factories take behind the parameters
    "controllers": ("footprint", "control_frequency", "xy_goal_tolerance"),
    "dwb_critics": ("dwb",),
    "planners": ("robot_shape",),
    "localizers": ("static_map",),
}


@dataclass(frozen=True, slots=True)
class Extension:
    """One algorithm of another package.

    ``make`` is called as those of this program are: a controller with its parameters, the padded
    footprint (V, 2) in [m], the control frequency in [Hz] and the goal checker's xy tolerance in
    [m]; a critic of DWB with its parameters and DWB's; a planner with its parameters and the
    robot's shape; a localizer with its parameters, which stand in the file's node ``localizer``,
    and the occupancy grid that it may match scans against.
    """

    family: str  # of NEEDS
    # its name in a Nav2 file (a localizer's: in a stack file), with the package: my_robot::Cautious
    type: str
    params: Params  # frozen dataclass whose fields are the parameters, with defaults
    make: Callable[..., Any]
    inputs: tuple[str, ...] = ()  # of a localizer: what it cannot work without, of INPUTS

    def __post_init__(self) -> None:
        """Check what other packages may get wrong.

        Raises:
            ParameterError: an unknown family, a type without package or one that Nav2 has, or no
                dataclass.
        """
        if self.family not in NEEDS:
            raise ParameterError(
                f"'{self.type}': unknown family '{self.family}'; known: {', '.join(NEEDS)}"
            )
        if not all(self.type.partition("::")) or self.type in FAMILIES.get(self.family, {}):
            raise ParameterError(
                f"'{self.type}' is no name of a plug-in's own; give package::Class, e.g. mine::Slow"
            )
        if not (isinstance(self.params, type) and dataclasses.is_dataclass(self.params)):
            raise ParameterError(
                f"'{self.type}': params is {self.params!r}; give a dataclass of its parameters"
            )
        for field in dataclasses.fields(self.params):
            self._check_field(field)
        if not set(self.inputs) <= set(INPUTS):
            raise ParameterError(
                f"'{self.type}': inputs {self.inputs}; give some of: {', '.join(INPUTS)}"
            )

    def _check_field(self, field: "dataclasses.Field[Any]") -> None:
        """Check that a file can set a parameter, and leave it out."""
        where = f"'{self.type}': {self.params.__name__}.{field.name}"
        if field.default is MISSING and field.default_factory is MISSING:
            raise ParameterError(f"{where} has no default; give it one")
        kind = hints_of(self.params)[field.name]
        options = get_args(kind) if get_origin(kind) in (Union, UnionType) else (kind,)
        for option in options:
            parts = get_args(option) if get_origin(option) is tuple else (option,)
            if not all(part in KINDS or dataclasses.is_dataclass(part) for part in parts):
                raise ParameterError(
                    f"{where} is {kind}; give float, int, bool, str, or a tuple of them"
                )


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
            raise ParameterError(
                f"{_named(point)}: '{extension.type}' is there twice; uninstall one of the packages"
            )
    return tuple(found[key] for key in sorted(found))


def plugin_packages() -> list[str]:
    """Names of the installed packages that declare entry points of the group, ascending.

    None is imported.
    """
    return sorted(
        {point.dist.name for point in entry_points(group=GROUP) if point.dist is not None}
    )


def algorithms(family: str) -> dict[str, AlgorithmEntry]:
    """The algorithms of a family that run here, by type.

    This program's, then those of other packages.
    """
    own = {kind: entry for kind, entry in FAMILIES[family].items() if entry.is_available}
    return own | {each.type: _entry(each) for each in extensions() if each.family == family}


def localizers() -> dict[str, LocalizerEntry]:
    """The localizers by name: this program's, then those of other packages."""
    others = [each for each in extensions() if each.family == "localizers"]
    return {**LOCALIZERS, **{each.type: _localizer(each) for each in others}}


def uses_map(localizer: str) -> bool:
    """Whether a localizer compares scans with a map, which somebody has to survey.

    False for one that is unknown.
    """
    entry = localizers().get(localizer)
    return entry is not None and entry.uses_map


def _entry(extension: Extension) -> AlgorithmEntry:
    names = [field.name for field in dataclasses.fields(extension.params)]
    keys = ParameterBlock(dict.fromkeys((*names, "plugin", "class"), Declared()))
    return AlgorithmEntry(keys, _maker(extension), extension.params, NEEDS[extension.family])


def _localizer(extension: Extension) -> LocalizerEntry:
    return LocalizerEntry(
        make=_maker(extension),
        params=extension.params,
        needs=NEEDS["localizers"],
        nodes=(OWN_NODE,),
        inputs=extension.inputs,
        uses=tuple(each for each in INPUTS if each not in extension.inputs),
    )


def _maker(extension: Extension) -> Callable[..., Any]:
    """What makes the algorithm; its mistakes become one line."""

    def make(*given: Any) -> Any:
        try:
            return extension.make(*given)
        except NavstackError:
            raise
        except Exception as error:  # whatever a package of somebody else does
            raise ParameterError(
                f"'{extension.type}' cannot be made ({error!r}); mend its package"
            ) from error

    return make


def _loaded(point: EntryPoint) -> Extension:
    try:
        extension = point.load()
    except Exception as error:  # whatever a package of somebody else does when it is imported
        raise ParameterError(
            f"{_named(point)} cannot be loaded ({error!r}); mend or uninstall the package"
        ) from error
    if not isinstance(extension, Extension):
        raise ParameterError(
            f"{_named(point)} is {type(extension).__name__}; it has to be an {Extension.__name__}"
        )
    return extension


def _named(point: EntryPoint) -> str:
    package = f" of package {point.dist.name}" if point.dist is not None else ""
    return f"entry point '{point.name} = {point.value}'{package}"
