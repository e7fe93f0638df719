"""What Python callers give to the functions of :mod:`navbench`, as their annotations ask for it."""

import contextlib
import functools
import inspect
import operator
import os
from collections.abc import Callable, Collection, Iterable, Sequence
from numbers import Real
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from navstack.errors import InputError, did_you_mean
from navstack.type_hints import hints_of

MOST_SHOWN = 80  # characters of a value that is refused
SET_BY_ALL = ("stacks", "map_name", "workers")  # of make_study, by whoever hands options on
_LISTS = (Sequence, Collection, Iterable, list, tuple)


def checked(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, which takes a path for a text, a text for a path, and one for a list of one.

    What it cannot take is refused in one line, with an InputError. ``navbench`` has it by its name.
    """

    @functools.wraps(function)
    def call(*given: Any, **named: Any) -> Any:
        try:
            bound = inspect.signature(function).bind(*given, **named)
        except TypeError as error:
            raise InputError(f"{function.__name__}: {error}{_near(function, named)}") from None
        hints = hints_of(function)
        rest = _rest_of(function)
        for name, value in bound.arguments.items():
            if name != rest:
                bound.arguments[name] = _taken(name, value, hints[name])
        options = bound.arguments.get(rest, {})
        if options:
            bound.arguments[rest] = _options(function, options, hints[rest])
        return function(*bound.args, **bound.kwargs)

    call.__module__ = "navbench"  # where pickle finds it
    return call


def _near(function: Callable[..., Any], named: Iterable[str]) -> str:
    """The nearest option to one that a function does not have."""
    known = inspect.signature(function).parameters
    unknown = [name for name in named if name not in known]
    return did_you_mean(unknown[0], known) if unknown else ""


def _rest_of(function: Callable[..., Any]) -> str:
    """The name of the parameter that takes all options that have none; empty: there is none."""
    for name, parameter in inspect.signature(function).parameters.items():
        if parameter.kind is inspect.Parameter.VAR_KEYWORD:
            return name
    return ""


def _options(function: Callable[..., Any], options: dict[str, Any], hint: Any) -> dict[str, Any]:
    """The options that a function hands on: of any kind to ``make_study``, which says which."""
    if hint is not Any:
        return {name: _taken(name, value, hint) for name, value in options.items()}
    return study_options(function, options)


def study_options(
    function: Callable[..., Any], options: dict[str, Any], without: Collection[str] = ()
) -> dict[str, Any]:
    """Options that a function or class hands on to ``make_study``, as that asks for them.

    Args:
        function: that was given them.
        options: by name.
        without: names of options that it does not have.

    Raises:
        InputError: there is no such option, or it is of another kind.
    """
    from harness.task.study import make_study

    hints = {**hints_of(make_study), "map": str}
    for name in (*SET_BY_ALL, *without):
        del hints[name]
    taken = {}
    for name, value in options.items():
        if name not in hints:
            known = [*inspect.signature(function).parameters, *hints]
            raise InputError(
                f"{function.__name__} has no option '{name}'{did_you_mean(name, known)}"
            )
        taken[name] = _taken(name, value, hints[name])
    return taken


def _taken(name: str, value: Any, hint: Any) -> Any:
    """A value as one of the kinds that an annotation names.

    Raises:
        InputError: it is of another kind.
    """
    try:
        return _as_any(hint, value)
    except TypeError:
        names = " or ".join(_name(kind) for kind in _kinds(hint))
        given = " ".join(repr(value).split())[:MOST_SHOWN]
        raise InputError(f"{name}={given} is of another kind; give {names}") from None


def _kinds(hint: Any) -> tuple[Any, ...]:
    return get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)


def _as_any(hint: Any, value: Any) -> Any:
    """A value as the first of an annotation's kinds that it can be.

    Raises:
        TypeError: it can be none.
    """
    kinds = _kinds(hint)
    if Any in kinds:
        return value
    for kind in kinds:
        with contextlib.suppress(TypeError):
            return _as(kind, value)
    raise TypeError


def _name(kind: Any) -> str:
    elements = get_args(kind)
    if get_origin(kind) is tuple and ... not in elements:
        return f"{len(elements)} values, each {_name(elements[0])}"
    if get_origin(kind) in _LISTS:
        return f"a list of {_name(elements[0])}"
    known = {
        str: "a text",
        int: "a whole number",
        float: "a number",
        bool: "True or False",
        NoneType: "None",
    }
    if get_origin(kind) is Literal:
        return " or ".join(map(repr, get_args(kind)))
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
    if kind is bool and getattr(value, "dtype", None) == "bool":
        return bool(value)
    if get_origin(kind) is Literal:
        is_right = value in get_args(kind)
    else:
        is_right = isinstance(value, get_origin(kind) or kind)
    if not is_right:
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
    if isinstance(value, bool):
        raise TypeError
    with contextlib.suppress(TypeError):
        return operator.index(value)
    if not isinstance(value, Real) or (kind is int and value % 1):
        raise TypeError
    return kind(value)
