"""The types of a dataclass's fields and of a function's arguments, worked out once."""

import typing
from collections.abc import Mapping
from functools import cache
from types import MappingProxyType
from typing import Any


def hints_of(kind: Any, include_extras: bool = False) -> Mapping[str, Any]:
    """As :func:`typing.get_type_hints`, which evaluates every annotation anew each time.

    Args:
        kind: a class or a function.
        include_extras: whether ``Annotated`` types stay as they are.
    """
    return _evaluated(kind, include_extras)


@cache
def _evaluated(kind: Any, include_extras: bool) -> Mapping[str, Any]:
    return MappingProxyType(typing.get_type_hints(kind, include_extras=include_extras))
