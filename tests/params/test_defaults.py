"""What an absent parameter means: a default that changes changes what other people's files say."""

import dataclasses
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from navstack.params.extensions import algorithms
from navstack.params.gps_ekf import GpsEkfParams
from navstack.params.registry import bindings, nodes

STORED = Path(__file__).with_name("defaults.yaml")


def classes() -> dict[str, type[Any]]:
    """Every dataclass that is read from a Nav2 file, with those in its fields, by name."""
    kinds = [entry.params for family in nodes.FAMILIES for entry in algorithms(family).values()]
    waiting = [GpsEkfParams, *bindings.NODES.values(), *(kind for kind in kinds if kind is not None)]
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
    given = {field.name: field.default for field in dataclasses.fields(kind) if isinstance(field.default, plain)}
    return {name: list(value) if isinstance(value, tuple) else value for name, value in given.items()}


def test_defaults_are_as_they_were() -> None:
    stored = YAML(typ="safe").load(STORED)
    assert {name: defaults(kind) for name, kind in sorted(classes().items())} == stored
    assert "GpsEkfParams" in stored and "ExpectedCostParams" in stored
