"""Every parameter of the world: fixed with its source, or free within a range. One file of ``params/calibration``."""

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from harness.outcome import Rules
from harness.resources import resolve, shipped
from harness.world.robot import RobotParams
from harness.world.sensors import SensorParams
from harness.world.world_params import WorldParams
from navstack.errors import InputError, ParameterError, UnknownNameError
from navstack.params.strict import from_mapping, load_dataclass, load_yaml

CLASSES: dict[str, type[Any]] = {  # first part of a parameter's key -> what its file holds
    "world": WorldParams,
    "robot": RobotParams,
    "sensors": SensorParams,
    "rules": Rules,
}
SHIPPED = {"world": "worlds/costnav", "robot": "robots/segway_e1", "sensors": "sensors/published",
           "rules": "rules/costnav"}  # of params/: the published world as it stands  # fmt: skip
_SECTIONS = ("fixed", "unused", "code", "free")


@dataclass(frozen=True, slots=True)
class Fixed:
    """A parameter that nothing may be fitted with."""

    value: Any
    source: str


@dataclass(frozen=True, slots=True)
class Free:
    """A parameter that is not published: a range of numbers, or choices."""

    value: Any  # at present
    unit: str
    reason: str  # why this range, with its source
    range: tuple[float, float] | None = None
    choices: tuple[Any, ...] = ()

    @property
    def ends(self) -> dict[str, Any]:
        """The values at which sensitivities are taken, by name; those that differ from the present one."""
        if self.range is not None:
            number = type(self.value)  # a count stays one
            named: dict[str, Any] = {"low": number(self.range[0]), "high": number(self.range[1])}
        else:
            named = {f"choice{place}": choice for place, choice in enumerate(self.choices, start=1)}
        return {name: value for name, value in named.items() if value != self.value}

    def allows(self, value: Any) -> bool:
        """Whether a value is defensible."""
        if self.range is None:
            return value in self.choices
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        return is_number and self.range[0] <= value <= self.range[1]

    @property
    def allowed(self) -> str:
        """What is defensible, in words."""
        if self.range is not None:
            return f"{self.range[0]:g} to {self.range[1]:g}"
        return " or ".join(value_text(choice) for choice in self.choices)


@dataclass(frozen=True, slots=True)
class Declaration:
    """All parameters, by key such as ``world.people.speed``."""

    fixed: dict[str, Fixed]
    unused: dict[str, str]  # key, or the beginning of keys -> why nothing rests on it
    code: dict[str, Fixed]  # constants of modules, by their dotted names
    free: dict[str, Free]

    def require_free(self, key: str) -> Free:
        """The free parameter of a key.

        Raises:
            InputError: it is fixed, or there is none.
        """
        if key in self.free:
            return self.free[key]
        if key in self.fixed:
            raise InputError(f"{key} is not free: {self.fixed[key].source}; params/calibration lists what is free")
        raise UnknownNameError("free parameter", key, list(self.free))


def load_declaration(name_or_file: str = "costnav") -> Declaration:
    """Read which parameters are fixed and which are free.

    Raises:
        InputError: an unknown name, or a file of another form.
    """
    path = resolve(name_or_file, shipped("params") / "calibration", "calibration")
    content = load_yaml(path)
    if not isinstance(content, Mapping) or set(content) != set(_SECTIONS):
        raise ParameterError(f"{path}: expected the keys {', '.join(_SECTIONS)}")
    sections = {name: _section(content[name], f"{path}: {name}") for name in _SECTIONS}
    return Declaration(
        fixed={key: _fixed(entry, f"{path}: {key}") for key, entry in sections["fixed"].items()},
        unused={key: str(reason) for key, reason in sections["unused"].items()},
        code={key: _fixed(entry, f"{path}: {key}") for key, entry in sections["code"].items()},
        free={key: _free(entry, f"{path}: {key}") for key, entry in sections["free"].items()},
    )


def shipped_parameters(kind: str) -> Any:
    """What the program ships of a kind of :data:`CLASSES`."""
    return load_dataclass(CLASSES[kind], shipped("params") / f"{SHIPPED[kind]}.yaml")


def leaves(kind: str, parameters: Any) -> dict[str, Any]:
    """Every single value of a parameter object by key, lists as one value."""
    return dict(_leaves(dataclasses.asdict(parameters), kind))


def present_leaves() -> dict[str, Any]:
    """Every value of the published world as it stands, by key."""
    return {key: value for kind in CLASSES for key, value in leaves(kind, shipped_parameters(kind)).items()}


def is_below(key: str, prefix: str) -> bool:
    """Whether a key is ``prefix`` or lies in it."""
    return key == prefix or key.startswith(f"{prefix}.")


def plain(value: Any) -> Any:
    """A value as YAML or JSON has it: tuples become lists."""
    return [plain(item) for item in value] if isinstance(value, tuple | list) else value


def value_text(value: Any) -> str:
    """A parameter's value for a table."""
    if isinstance(value, tuple | list):
        return f"[{', '.join(value_text(item) for item in value)}]"
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, float) else str(value)


def _leaves(content: Mapping[str, Any], path: str) -> Iterator[tuple[str, Any]]:
    for name, value in content.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{path}.{name}")
        else:
            yield f"{path}.{name}", plain(value)


def _section(content: Any, where: str) -> Mapping[str, Any]:
    if not isinstance(content, Mapping):
        raise ParameterError(f"{where}: {content!r} is not a mapping of parameters")
    return content


def _fixed(entry: Any, where: str) -> Fixed:
    if not isinstance(entry, Mapping) or set(entry) != {"value", "source"}:
        raise ParameterError(f"{where}: expected the keys value and source")
    return Fixed(plain(entry["value"]), str(entry["source"]))


def _free(entry: Any, where: str) -> Free:
    if not isinstance(entry, Mapping) or "value" not in entry:
        raise ParameterError(f"{where}: expected a mapping with 'value'")
    rest = {key: value for key, value in entry.items() if key not in ("value", "choices")}
    bounds = from_mapping(_Bounds, rest, where)
    free = Free(plain(entry["value"]), bounds.unit, bounds.reason, bounds.range, tuple(plain(entry.get("choices", ()))))
    if (free.range is None) == (not free.choices):
        raise ParameterError(f"{where}: give either a range or choices")
    if not free.allows(free.value):
        raise ParameterError(f"{where}: value {value_text(free.value)} is not allowed: {free.allowed}")
    return free


@dataclass(frozen=True, slots=True)
class _Bounds:
    """What of a free parameter has a type."""

    unit: str
    reason: str
    range: tuple[float, float] | None = None
