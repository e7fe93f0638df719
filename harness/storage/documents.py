"""Results as JSON documents, and their files."""

import dataclasses
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from harness.storage.files import write_text, writing


def json_text(document: Mapping[str, Any]) -> str:
    """A document as the text of its file."""
    return json.dumps(document, indent=2, sort_keys=True, allow_nan=False) + "\n"


def as_json(value: Any) -> Any:
    """A value as JSON has it: a dataclass is an object of its fields, or its own ``as_json``."""
    if hasattr(value, "as_json"):
        return value.as_json()
    if dataclasses.is_dataclass(value):
        return {
            field.name: as_json(getattr(value, field.name)) for field in dataclasses.fields(value)
        }
    if isinstance(value, Mapping):
        return {key: as_json(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [as_json(entry) for entry in value]
    return value


def write_document(path: Path, document: Mapping[str, Any]) -> None:
    """Write a JSON document.

    Raises:
        InputError: it cannot be written.
    """
    write_file(path, json_text(document))


def write_file(path: Path, text: str) -> None:
    """Write a text file; its folder is made where it is missing.

    Raises:
        InputError: it cannot be written.
    """
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_text(path, text)
