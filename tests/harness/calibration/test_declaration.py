"""Every parameter of the world is declared once, and as it is."""

import importlib
from pathlib import Path

import pytest

from harness.calibration.candidate import parse_settings, write_candidate
from harness.calibration.declaration import (
    CLASSES,
    is_below,
    leaves,
    load_declaration,
    plain,
    present_leaves,
)
from harness.resources import shipped
from navstack.errors import InputError, ParameterError, UnknownNameError
from navstack.params.strict import load_dataclass

DECLARATION = load_declaration()
FREE = [(key, end) for key, free in DECLARATION.free.items() for end in free.ends]


def test_every_parameter_is_declared_once():
    for key in present_leaves():
        places = [key in DECLARATION.fixed, key in DECLARATION.free]
        places.append(any(is_below(key, prefix) for prefix in DECLARATION.unused))
        assert sum(places) == 1, key


def test_nothing_else_is_declared():
    present = present_leaves()
    assert not [key for key in (*DECLARATION.fixed, *DECLARATION.free) if key not in present]
    assert all(any(is_below(key, prefix) for key in present) for prefix in DECLARATION.unused)


def test_the_declared_values_are_the_shipped_ones():
    present = present_leaves()
    declared = {**DECLARATION.fixed, **DECLARATION.free}
    assert {key: entry.value for key, entry in declared.items()} == {key: present[key] for key in declared}


@pytest.mark.parametrize("name", DECLARATION.code)
def test_constants_of_the_code_are_as_declared(name):
    module, _, constant = name.rpartition(".")
    assert plain(getattr(importlib.import_module(module), constant)) == DECLARATION.code[name].value


@pytest.mark.parametrize(("key", "end"), FREE, ids=lambda text: text)
def test_the_world_takes_every_end(key, end, tmp_path):
    value = DECLARATION.free[key].ends[end]
    kind = key.split(".")[0]
    path = Path(write_candidate({key: value}, tmp_path)[kind])
    assert leaves(kind, load_dataclass(CLASSES[kind], path))[key] == value


def test_every_free_parameter_says_why_and_has_somewhere_to_go():
    assert all(free.reason and free.ends for free in DECLARATION.free.values())
    assert all(fixed.source for fixed in (*DECLARATION.fixed.values(), *DECLARATION.code.values()))


@pytest.mark.parametrize(
    "text",
    [
        "rules.timeout=300",
        "rules.arrival_radius=3",
        "rules.spoiled_fraction=0.1",
        "world.contacts.counted_impulse=40",
        "world.people.count=10",
    ],
)
def test_what_is_published_cannot_be_set(text):
    with pytest.raises(InputError, match=f"{text.split('=')[0]} is not free: published"):
        parse_settings([text], DECLARATION)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("world.people.speed=2", "defensible is 0.9 to 1.4 m/s"),
        ("world.people.speed=true", "defensible is 0.9 to 1.4 m/s"),
        ("world.contacts.per=step", "defensible is partner or point"),
        ("world.people.speed", "is not KEY=VALUE"),
    ],
)
def test_what_is_not_defensible_cannot_be_set(text, complaint):
    with pytest.raises(InputError, match=complaint):
        parse_settings([text], DECLARATION)


def test_an_unknown_parameter_cannot_be_set():
    with pytest.raises(UnknownNameError, match="did you mean 'world.people.speed'"):
        parse_settings(["world.people.sped=1"], DECLARATION)


def test_a_parameter_cannot_be_set_twice():
    with pytest.raises(InputError, match="world.people.speed is given twice"):
        parse_settings(["world.people.speed=1.2", "world.people.speed=1.3"], DECLARATION)


def test_settings_are_read():
    texts = ["world.people.speed=1.2", "robot.bucket=[0.0, 0.0, 0.33]", "world.contacts.per=point"]
    expected = {"world.people.speed": 1.2, "robot.bucket": [0.0, 0.0, 0.33], "world.contacts.per": "point"}
    assert parse_settings(texts, DECLARATION) == expected


@pytest.mark.parametrize(
    ("entry", "complaint"),
    [
        ("{value: 1.0, unit: m, reason: why}", "give either a range or choices"),
        ("{value: 1.0, unit: m, reason: why, range: [2.0, 3.0]}", "value 1 is not allowed: 2 to 3"),
        ("{value: 1.0, unit: m, range: [0.0, 3.0]}", "key 'reason' is missing"),
        ("{value: 1.0, unit: m, reason: why, rnge: [0.0, 3.0]}", "unknown key 'rnge'"),
        ("{unit: m, reason: why, range: [0.0, 3.0]}", "expected a mapping with 'value'"),
    ],
)
def test_a_careless_declaration_is_refused(entry, complaint, tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text(f"fixed: {{}}\nunused: {{}}\ncode: {{}}\nfree:\n  world.people.speed: {entry}\n", encoding="utf-8")
    with pytest.raises(ParameterError, match=complaint):
        load_declaration(str(path))


def test_the_frozen_world_differs_in_free_parameters_only():
    path = shipped("params") / "worlds" / "published.yaml"
    if not path.is_file():
        pytest.skip("no world is frozen yet")
    frozen, present = leaves("world", load_dataclass(CLASSES["world"], path)), present_leaves()
    for key, value in frozen.items():
        followed = key == "world.cargo.wake_acceleration"
        assert value == present[key] or followed or DECLARATION.require_free(key).allows(value), key
