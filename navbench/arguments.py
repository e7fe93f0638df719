"""What Python callers give to the functions of :mod:`navbench`, as their annotations ask for it."""

import contextlib
import functools
import inspect
import os
from collections.abc import Callable, Collection, Iterable, Sequence
from numbers import Integral, Real
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

from navstack.errors import InputError, did_you_mean

_LISTS = (Sequence, Collection, Iterable, list, tuple)


def checked(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, which takes a path for a text, a text for a path, and one for a list of one.

    What it cannot take is refused in one line, with an InputError.
    """

    @functools.wraps(function)
    def call(*given: Any, **named: Any) -> Any:
        try:
            bound = inspect.signature(function).bind(*given, **named)
        except TypeError as error:
            raise InputError(f"{function.__name__}: {error}{_near(function, named)}") from None
        hints = _hints(function)
        for name, value in bound.arguments.items():
            if name in hints:
                bound.arguments[name] = _taken(name, value, hints[name])
        _check_options(function, bound)
        return function(*bound.args, **bound.kwargs)

    return call


def _near(function: Callable[..., Any], named: Iterable[str]) -> str:
    """The nearest option to one that a function does not have."""
    known = inspect.signature(function).parameters
    unknown = [name for name in named if name not in known]
    return did_you_mean(unknown[0], known) if unknown else ""


def _hints(function: Callable[..., Any]) -> dict[str, Any]:
    hints = get_type_hints(function, include_extras=False)
    variable = inspect.Parameter.VAR_KEYWORD
    for name, parameter in inspect.signature(function).parameters.items():
        if parameter.kind is variable:
            hints.pop(name, None)
    return hints


def _check_options(function: Callable[..., Any], bound: inspect.BoundArguments) -> None:
    """Check the options that a function hands on to :func:`harness.task.study.make_study`."""
    (rest,) = [
        name
        for name, parameter in bound.signature.parameters.items()
        if parameter.kind is inspect.Parameter.VAR_KEYWORD
    ] or [""]
    options = bound.arguments.get(rest)
    if not options:
        return
    from harness.task.study import make_study

    hints = {**_hints(make_study), "map": str}
    for name, value in options.items():
        if name not in hints:
            known = [*bound.signature.parameters, *hints]
            raise InputError(
                f"{function.__name__} has no option '{name}'{did_you_mean(name, known)}"
            )
        options[name] = _taken(name, value, hints[name])


def _taken(name: str, value: Any, hint: Any) -> Any:
    """A value as one of the kinds that an annotation names.

    Raises:
        InputError: it is of another kind.
    """
    try:
        return _as_any(hint, value)
    except TypeError:
        names = " or ".join(_name(kind) for kind in _kinds(hint) if kind is not NoneType)
        raise InputError(f"{name}={value!r} is of another kind; give {names}") from None


def _kinds(hint: Any) -> tuple[Any, ...]:
    return get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)


def _as_any(hint: Any, value: Any) -> Any:
    """A value as the first of an annotation's kinds that it can be.

    Raises:
        TypeError: it can be none.
    """
    kinds = _kinds(hint)
    if value is None or Any in kinds:
        return value
    for kind in kinds:
        with contextlib.suppress(TypeError):
            return _as(kind, value)
    raise TypeError


def _name(kind: Any) -> str:
    if get_origin(kind) in _LISTS:
        return f"a list of {_name(get_args(kind)[0])}"
    known = {str: "a text", int: "a whole number", float: "a number", bool: "True or False"}
    return known.get(kind) or f"a {getattr(kind, '__name__', kind)}"


def _as(kind: Any, value: Any) -> Any:
    """A value as one of a kind.

    Raises:
        TypeError: it is none.
    """
    if get_origin(kind) is Annotated:
        kind = get_args(kind)[0]
    if get_origin(kind) in _LISTS:
        return _as_list(get_args(kind), value)
    if kind is Path and isinstance(value, str | os.PathLike):
        return Path(value)
    if kind is str and isinstance(value, os.PathLike):
        return os.fspath(value)
    if kind in (int, float):
        return _as_number(kind, value)
    if isinstance(kind, type) and get_origin(kind) is None and not isinstance(value, kind):
        raise TypeError
    return value


def _as_list(elements: tuple[Any, ...], value: Any) -> Any:
    """A value as a list, or as so many values of their own kinds."""
    is_one = isinstance(value, str | os.PathLike) or (
        isinstance(elements[0], type) and isinstance(value, elements[0])
    )
    found = [value] if is_one else list(value)
    if len(elements) == 1 or elements[1:] == (...,):
        elements = (elements[0],) * len(found)
    if len(found) != len(elements):
        raise TypeError
    return tuple(_as_any(kind, each) for each, kind in zip(found, elements, strict=True))


def _as_number(kind: type, value: Any) -> Any:
    is_number = isinstance(value, Real) and not isinstance(value, bool)
    if not is_number or (kind is int and not isinstance(value, Integral) and value % 1):
        raise TypeError
    return int(value) if kind is int else value
