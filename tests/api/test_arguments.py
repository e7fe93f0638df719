"""Whatever Python callers give: it is taken as its annotation says, or refused in one line."""

import inspect
import pickle
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import NoneType
from typing import Annotated, Any, Literal, get_origin, get_type_hints

import numpy as np
import pytest

import navbench
from navbench.arguments import _kinds, checked
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
        ("count", np.array(3), 3),
        ("is_so", np.True_, True),
        ("size", None, None),
        ("way", "b", "b"),
    ],
)
def test_what_a_caller_means_is_taken(name: str, value: object, taken: object) -> None:
    assert checked(given)(**{name: value})[name] == taken


@pytest.mark.parametrize(
    ("name", "value", "wanted"),
    [
        ("text", 3, "a text"),
        ("path", 3, "a Path or None"),
        ("either", 3, "a text or a list of a text"),
        ("count", 2.5, "a whole number"),
        ("count", "3", "a whole number"),
        ("count", True, "a whole number"),
        ("is_so", "yes", "True or False"),
        ("place", "abc", "a list of a number or None"),
        ("pair", (1.0, 2.0, 3.0), "2 values, each a number"),
        ("count", None, "a whole number"),
        ("size", "3", "a number or None"),
        ("values", 3, "a Mapping or None"),
        ("way", "c", "'a' or 'b'"),
    ],
)
def test_what_cannot_be_meant_is_one_line(name: str, value: object, wanted: str) -> None:
    with pytest.raises(InputError) as refused:
        checked(given)(**{name: value})
    assert str(refused.value) == f"{name}={value!r} is of another kind; give {wanted}"


def test_numbers_are_those_of_python() -> None:
    taken = checked(given)(size=np.float32(0.5), place=np.zeros(3, np.float32))
    assert type(taken["size"]) is float
    assert list(map(type, taken["place"])) == [float] * 3


def test_a_value_of_many_lines_is_one_line() -> None:
    with pytest.raises(InputError) as refused:
        checked(given)(count=np.zeros((40, 3)))
    assert "\n" not in str(refused.value) and len(str(refused.value)) < 140


def test_options_of_one_kind_are_taken_as_it_says() -> None:
    def more(first: int = 0, **others: int | None) -> dict[str, int | None]:
        return others

    assert checked(more)(1, test_episodes=5.0, other=None) == {"test_episodes": 5, "other": None}
    with pytest.raises(InputError, match=r"^other='3' is of another kind; give a whole number or"):
        checked(more)(other="3")


def test_functions_are_found_by_their_names() -> None:
    for name in ("run", "load", "resume_tuning"):
        function = getattr(navbench, name)
        assert pickle.loads(pickle.dumps(function)) is function


@pytest.mark.parametrize("options", [{"stacks": ["parked"]}, {"map_name": "sidewalk"}])
def test_what_a_function_sets_itself_is_no_option(options: dict[str, Any]) -> None:
    with pytest.raises(InputError, match="^run has no option '"):
        navbench.run("parked", **options)


def test_the_distance_of_missions_is_two_numbers() -> None:
    with pytest.raises(InputError, match="give 2 values, each a number or None$"):
        navbench.run("parked", distance=[5])


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
            for kinds in map(_kinds, get_type_hints(function).values()):
                plain = [kind for kind in kinds if get_origin(kind) is None and kind is not Any]
                assert not isinstance(None, tuple(plain)) or NoneType in kinds, name
