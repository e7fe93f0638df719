"""What drove, where and among whom is named by content; what is unlike the paper's setting is."""

import dataclasses
from collections.abc import Callable
from pathlib import Path

import pytest

from harness.economics.price import with_values
from harness.report.short import setup
from harness.report.short.run import summary_blocks
from harness.report.short.setup import (
    LOADERS,
    PUBLISHED,
    nearest,
    people_of,
    setup_line,
    unlike_line,
    unlike_published,
)
from harness.storage.shipped import names, resolve, shipped
from harness.study.stored_run import load_run
from harness.world.physics.robot import RobotParams
from navstack.params.strict import dump_dataclass, load_dataclass, load_yaml

FILES = [(kind, name) for kind in LOADERS for name in names(shipped("params") / kind)]
WriteRun = Callable[..., Path]


@pytest.mark.parametrize(("kind", "name"), FILES)
def test_every_shipped_file_is_known_by_its_content(kind, name, tmp_path):
    content = LOADERS[kind](resolve(name, shipped("params") / kind, kind))
    (tmp_path / "own.yaml").write_text(dump_dataclass(content), encoding="utf-8")
    assert str(nearest(kind, tmp_path / "own.yaml")) == name


@pytest.mark.parametrize(
    ("kind", "key", "value"),
    [("rules", "timeout", 10.0), ("robots", "mass", 51.5), ("worlds", "cargo", {"fill": 0.7})],
)
def test_a_changed_copy_is_not_called_by_the_name_alone(kind, key, value, tmp_path):
    file = resolve(PUBLISHED[kind], shipped("params") / kind, kind)
    known = load_yaml(file)
    if isinstance(value, dict):
        value = {**known.get(key, {}), **value}
    changed = tmp_path / "own.yaml"
    changed.write_text(dump_dataclass(LOADERS[kind](file)), encoding="utf-8")
    own = load_yaml(changed) | {key: value}
    if isinstance(value, dict):
        own[key] = {**load_yaml(changed)[key], **value}
    import yaml

    changed.write_text(yaml.safe_dump(own), encoding="utf-8")
    setting = nearest(kind, changed)
    assert setting.name == PUBLISHED[kind]
    assert len(setting.differences) == 1 and setting.differences[0].startswith(key)


def test_recorded_people_are_told_by_their_recording_and_not_by_a_number(
    write_run,
):
    run = load_run(str(write_run("one", episodes=1)))
    assert people_of(run) == "20 (random_walk)"
    world = run.folder / "params" / "world.yaml"
    text = world.read_text(encoding="utf-8").replace("model: random_walk", "model: replay")
    world.write_text(f"{text}\n", encoding="utf-8")
    about = {**run.about, "people": "plaza.csv"}
    asked = dataclasses.replace(load_run(str(run.folder)), about=about)
    assert people_of(asked) == "replayed from plaza.csv"


def test_a_line_says_what_drove_where(write_run):
    run = load_run(str(write_run("one", ("a", "b"), episodes=3, pedestrians=7)))
    line = setup_line(run)
    for words in ("a and b", "localizer gps", "world easy", "map sidewalk", "people 7 (", "n = 3"):
        assert words in line
    assert "world easy" in unlike_line(unlike_published(run))


@pytest.mark.parametrize("count", [1, 2, 3, 7, 24])
def test_a_run_of_any_number_of_stacks_fits_in_25_lines(write_run, count):
    stacks = tuple(f"s{number}" for number in range(count))
    blocks = summary_blocks(load_run(str(write_run("many", stacks, episodes=4))))
    assert len(blocks) < 25
    text = "\n".join(getattr(block, "text", "") for block in blocks)
    assert "paper w/ GPS" in text and "Contacts per 1000 km" in text
    assert all(stack in text for stack in stacks[:15])


def test_a_robot_like_none_that_is_shipped_is_told_by_size_and_mass(tmp_path: Path) -> None:
    body = load_dataclass(RobotParams, shipped("params") / "robots" / "jackal.yaml")
    wide = tuple((x, 2.0 * y) for x, y in body.footprint)
    other = dataclasses.replace(body, footprint=wide, mass=30.0, max_speed=1.1, max_yaw_rate=1.3)
    (tmp_path / "robot.yaml").write_text(dump_dataclass(other), encoding="utf-8")
    length, width = (2.0 * half for half in other.half_size)
    said = f"of {length:.2f} m x {width:.2f} m and 30.0 kg"
    assert setup._robot(tmp_path / "robot.yaml") == said


def test_a_run_says_whose_price_break_even_pays(write_run):
    run = load_run(str(write_run("one")))
    prices = run.prices()
    own = run.folder / "params" / f"{run.stacks[0].name}-robot.yaml"
    for name in ("segway_e1", "jackal"):
        assert setup.robot_price_line(run, prices) == "", "unknown, then the paper's"
        file = resolve(name, shipped("params") / "robots", "robots")
        own.write_text(dump_dataclass(load_dataclass(RobotParams, file)), encoding="utf-8")
    told = "8,000 USD (P_Robot: retail price of the Segway E1 sidewalk delivery robot), whichever"
    text = "\n".join(getattr(block, "text", "") for block in summary_blocks(run))
    assert f"break-even pays for a robot of {told} robot drives" in text
    own_price = with_values(prices, {"robot_cost": 21_000.0})
    assert "a robot of 21,000 USD (set by the user" in setup.robot_price_line(run, own_price)
