"""What an absent parameter means: a default that changes changes what other people's files say."""

import dataclasses
import importlib
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from navstack.params.extensions import algorithms
from navstack.params.gps_ekf import GpsEkfParams
from navstack.params.registry import bindings, nodes

HERE = Path(__file__).parent
WORLD = (
    "map.map_import",
    "map.scene",
    "outcome",
    "people.pedestrian_params",
    "physics.robot",
    "sensors.gps_receiver",
    "sensors.inertial_unit",
    "sensors.lidar",
    "sensors.sensors",
    "sensors.wheel_odometry",
    "world_params",
)


def classes() -> dict[str, type[Any]]:
    """Every dataclass that is read from a Nav2 file, with those in its fields, by name."""
    kinds = [entry.params for family in nodes.FAMILIES for entry in algorithms(family).values()]
    waiting = [
        GpsEkfParams,
        *bindings.NODES.values(),
        *(kind for kind in kinds if kind is not None),
    ]
    found: dict[str, type[Any]] = {}
    while waiting:
        kind = waiting.pop()
        if kind.__name__ not in found:
            found[kind.__name__] = kind
            factories = [field.default_factory for field in dataclasses.fields(kind)]
            waiting += [each for each in factories if dataclasses.is_dataclass(each)]
    return found


def defaults(kind: type[Any]) -> dict[str, Any]:
    """Name and default of each field that has a plain one."""
    plain = (bool, int, float, str, tuple, type(None))
    given = {
        field.name: field.default
        for field in dataclasses.fields(kind)
        if isinstance(field.default, plain)
    }
    return {
        name: list(value) if isinstance(value, tuple) else value for name, value in given.items()
    }


def of_the_world() -> dict[str, type[Any]]:
    """The dataclasses of a simulated world's parameters, by name."""
    modules = [importlib.import_module(f"harness.world.{name}") for name in WORLD]
    own = [
        each
        for module in modules
        for each in vars(module).values()
        if getattr(each, "__module__", "") == module.__name__
    ]
    return {
        kind.__name__: kind for kind in own if dataclasses.is_dataclass(kind) and defaults(kind)
    }


def test_defaults_are_as_they_were() -> None:
    stored = YAML(typ="safe").load(HERE / "defaults.yaml")
    assert {name: defaults(kind) for name, kind in sorted(classes().items())} == stored
    assert "GpsEkfParams" in stored and "ExpectedCostParams" in stored


def test_defaults_of_the_world_are_as_they_were() -> None:
    stored = YAML(typ="safe").load(HERE / "world_defaults.yaml")
    assert {name: defaults(kind) for name, kind in sorted(of_the_world().items())} == stored
    assert "GpsParams" in stored and "CargoParams" in stored
