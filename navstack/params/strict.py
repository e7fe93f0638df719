"""Our own small YAML files, read into frozen dataclasses.

A misspelt key at any depth is an error.
"""

import dataclasses
import io
import math
import types
from collections.abc import Mapping
from pathlib import Path
from typing import Any, TypeVar, Union, get_args, get_origin

from ruamel.yaml import YAML

from navstack.errors import InputError, ParameterError, did_you_mean
from navstack.files import check_regular
from navstack.params.nav2_file.yaml_text import load_text
from navstack.ranges import KEPT_OUT
from navstack.type_hints import hints_of

T = TypeVar("T")

# magnitude of a number other than 0: no quantity here is smaller or larger
LEAST, MOST = 1e-12, 1e12
MAX_FILE_BYTES = 4_000_000  # a parameter file larger than this is a mistake


def read_text(path: Path) -> str:
    """The text of a small file.

    Raises:
        ParameterError: the file is absent, unreadable, too large or not UTF-8.
    """
    try:
        check_regular(path, MAX_FILE_BYTES)
        with path.open(encoding="utf-8", newline="") as stream:  # line ends stay as they are
            return stream.read()
    except OSError as error:
        raise ParameterError(f"{path}: cannot be read ({error.strerror}); check the path") from None
    except UnicodeDecodeError:
        raise ParameterError(
            f"{path}: is not a text file in UTF-8; a YAML file is expected, saved as UTF-8"
        ) from None


def load_yaml(path: Path) -> Any:
    """The content of a YAML file as plain Python values.

    Raises:
        ParameterError: the file cannot be read, is not YAML, or out of bounds.
    """
    return load_text(read_text(path), str(path))


def load_dataclass(cls: type[T], path: Path) -> T:
    """Read a YAML file into a dataclass; see :func:`from_mapping`.

    Raises:
        ParameterError: as there, or a value that is not allowed; the message names the file.
    """
    mapping = load_yaml(path)
    try:
        return from_mapping(cls, mapping, str(path))
    except InputError as error:
        if str(error).startswith(str(path)):
            raise
        raise ParameterError(f"{path}: {error}") from None


def from_mapping(cls: type[T], mapping: Any, where: str) -> T:
    """Build the dataclass ``cls`` from a mapping, checking names and types at every depth.

    Raises:
        ParameterError: an unknown or missing key, or a value of the wrong type; the message names
            its path.
    """
    if not isinstance(mapping, Mapping):
        found = "is empty" if mapping is None else f"{mapping!r} is not a mapping"
        raise ParameterError(f"{where}: {found}; expected the keys {_known(cls)}")
    hints = hints_of(cls)
    names = [field.name for field in dataclasses.fields(cls)]  # type: ignore[arg-type]
    for key in mapping:
        if key not in names:
            raise ParameterError(
                f"{where}: unknown key '{key}'{did_you_mean(str(key), names)}; known: {_known(cls)}"
            )
    values = {
        name: _convert(hints[name], mapping[name], f"{where}: {name}")
        for name in names
        if name in mapping
    }
    for field in dataclasses.fields(cls):  # type: ignore[arg-type]
        required = (
            field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING
        )
        if required and field.name not in values:
            raise ParameterError(f"{where}: key '{field.name}' is missing")
    return cls(**values)


def dump_dataclass(value: Any) -> str:
    """A dataclass as YAML text that :func:`load_dataclass` reads back.

    Every field stands in it, but one that is ``KEPT_OUT`` and has its default: a field that
    came later.
    """
    text = io.StringIO()
    writer = YAML(typ="rt", pure=True)  # keeps the order of the fields
    writer.default_flow_style = False
    content = dataclasses.asdict(value)
    for entry in dataclasses.fields(value):
        if _is_left_out(entry, value):
            del content[entry.name]
    writer.dump(_plain(content), text)
    return text.getvalue()


def _is_left_out(entry: "dataclasses.Field[Any]", value: Any) -> bool:
    if not KEPT_OUT.items() <= entry.metadata.items():
        return False
    default = entry.default
    if entry.default_factory is not dataclasses.MISSING:
        default = entry.default_factory()
    return bool(getattr(value, entry.name) == default)


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, tuple | list):
        return [_plain(item) for item in value]
    return value


def _known(cls: type[Any]) -> str:
    return ", ".join(sorted(field.name for field in dataclasses.fields(cls)))


def _convert(kind: Any, value: Any, where: str) -> Any:
    origin = get_origin(kind)
    if origin in (Union, types.UnionType):
        return _convert_union(kind, value, where)
    if dataclasses.is_dataclass(kind) and isinstance(kind, type):
        return from_mapping(kind, value, where)
    if origin is tuple:
        return _convert_tuple(get_args(kind), value, where)
    if origin is dict:
        return _convert_dict(get_args(kind), value, where)
    return _convert_scalar(kind, value, where)


def _convert_union(kind: Any, value: Any, where: str) -> Any:
    if value is None and type(None) in get_args(kind):
        return None
    others = [option for option in get_args(kind) if option is not type(None)]
    return _convert(others[0], value, where)


def _convert_tuple(kinds: tuple[Any, ...], value: Any, where: str) -> tuple[Any, ...]:
    if not isinstance(value, list | tuple):
        raise ParameterError(f"{where}: {value!r} is not a list")
    if kinds[-1] is Ellipsis:
        return tuple(_convert(kinds[0], item, f"{where}[{i}]") for i, item in enumerate(value))
    if len(value) != len(kinds):
        raise ParameterError(f"{where}: {value!r} has {len(value)} entries; expected {len(kinds)}")
    return tuple(
        _convert(kind, item, f"{where}[{i}]")
        for i, (kind, item) in enumerate(zip(kinds, value, strict=True))
    )


def _convert_dict(kinds: tuple[Any, ...], value: Any, where: str) -> dict[str, Any]:
    if not isinstance(value, Mapping):
        raise ParameterError(f"{where}: {value!r} is not a mapping")
    return {str(key): _convert(kinds[1], item, f"{where}.{key}") for key, item in value.items()}


def _convert_scalar(kind: Any, value: Any, where: str) -> Any:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if is_number and _is_endless(kind, value):
        raise ParameterError(
            f"{where}: {value!r} is out of range; "
            f"allowed is 0 or {LEAST:g} to {MOST:g}, either sign"
        )
    if kind is float and is_number and math.isfinite(value):
        return float(value)
    is_switch = isinstance(value, bool)
    if kind is not float and isinstance(value, kind) and not (kind is int and is_switch):
        return value
    expected = {
        float: "a finite number",
        int: "a whole number",
        str: "a text",
        bool: "true or false",
    }
    raise ParameterError(f"{where}: {value!r} is not {expected.get(kind, kind.__name__)}")


def _is_endless(kind: type, value: float) -> bool:
    """Whether a finite number is larger or smaller than anything of its kind can be.

    The integers are seeds, too.
    """
    if kind is int:
        return abs(value) >= 2**63
    return value != 0 and abs(value) < math.inf and not LEAST <= abs(value) <= MOST
