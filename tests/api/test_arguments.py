"""Whatever Python callers give: it is taken as its annotation says, or refused in one line."""

import inspect
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import pytest

import navbench
from navbench.arguments import checked
from navstack.errors import InputError

Numbers = Sequence[float]


def given(
    text: str = "",
    path: Path | None = None,
    either: str | Sequence[str] = "",
    files: Sequence[Path] = (),
    count: int = 0,
    size: Annotated[float | None, "m"] = None,
    is_so: bool = False,
    place: Numbers | None = None,
    pair: tuple[float, float] = (0.0, 0.0),
    values: Mapping[str, float] | None = None,
    way: Literal["a", "b"] = "a",
) -> dict[str, Any]:
    """What it got."""
    return dict(locals())


@pytest.mark.parametrize(
    ("name", "value", "taken"),
    [
        ("text", Path("a.yaml"), "a.yaml"),
        ("path", "a.yaml", Path("a.yaml")),
        ("path", None, None),
        ("either", Path("a"), "a"),
        ("either", [Path("a"), "b"], ("a", "b")),
        ("files", "a", (Path("a"),)),
        ("files", ["a", Path("b")], (Path("a"), Path("b"))),
        ("count", np.int64(3), 3),
        ("count", 3.0, 3),
        ("size", 3, 3),
        ("place", np.array([1.0, 2.0, 3.0]), (1.0, 2.0, 3.0)),
        ("pair", [1, 2.5], (1, 2.5)),
        ("values", {"a": 1.0}, {"a": 1.0}),
        ("way", "b", "b"),
    ],
)
def test_what_a_caller_means_is_taken(name: str, value: object, taken: object) -> None:
    assert checked(given)(**{name: value})[name] == taken


@pytest.mark.parametrize(
    ("name", "value", "wanted"),
    [
        ("text", 3, "a text"),
        ("path", 3, "a Path"),
        ("either", 3, "a text or a list of a text"),
        ("count", 2.5, "a whole number"),
        ("count", "3", "a whole number"),
        ("count", True, "a whole number"),
        ("size", "3", "a number"),
        ("is_so", "yes", "True or False"),
        ("place", "abc", "a list of a number"),
        ("pair", (1.0, 2.0, 3.0), "a list of a number"),
    ],
)
def test_what_cannot_be_meant_is_one_line(name: str, value: object, wanted: str) -> None:
    with pytest.raises(InputError) as refused:
        checked(given)(**{name: value})
    assert str(refused.value) == f"{name}={value!r} is of another kind; give {wanted}"


def test_an_option_that_there_is_not_is_one_line() -> None:
    with pytest.raises(InputError, match="^given: .*'cont'; did you mean 'count'\\?$"):
        checked(given)(cont=3)
    with pytest.raises(InputError, match="^run has no option 'localiser'; did you mean 'local"):
        navbench.run("parked", localiser="amcl")
    with pytest.raises(InputError, match="^pedestrians='4' is of another kind; give a whole"):
        navbench.run("parked", pedestrians="4")


def test_nothing_is_written_before_a_value_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=r"^episodes=2\.5 is of another kind"):
        navbench.run("parked", episodes=2.5)  # type: ignore[arg-type]
    assert not list(tmp_path.iterdir())


def test_every_function_says_what_it_takes() -> None:
    for name in navbench.__all__:
        function = getattr(navbench, name)
        if inspect.isfunction(function):
            assert function.__doc__, name
