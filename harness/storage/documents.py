"""Results as JSON documents."""

import dataclasses
import json
from collections.abc import Mapping
from typing import Any


def json_text(document: Mapping[str, Any]) -> str:
    """A document as the text of its file."""
    return json.dumps(document, indent=2, sort_keys=True, allow_nan=False) + "\n"


def as_json(value: Any) -> Any:
    """A value as JSON has it: a dataclass is an object of its fields, unless its own ``as_json`` says otherwise."""
    if hasattr(value, "as_json"):
        return value.as_json()
    if dataclasses.is_dataclass(value):
        return {field.name: as_json(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, Mapping):
        return {key: as_json(entry) for key, entry in value.items()}
    return [as_json(entry) for entry in value] if isinstance(value, list | tuple) else value
