"""What drove, where and among whom is named by content, and what is unlike the paper's setting is."""

import dataclasses
from collections.abc import Callable
from pathlib import Path

import pytest

from harness.metrics.contact_rate import contacts_per_1000_km
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
from harness.statistics.rates import poisson_rate
from harness.storage.shipped import names, shipped
from harness.study.stored_run import load_run
from navstack.params.strict import dump_dataclass, load_yaml

FILES = [(kind, name) for kind in LOADERS for name in names(shipped("params") / kind)]
WriteRun = Callable[..., Path]


@pytest.mark.parametrize(("kind", "name"), FILES)
def test_every_shipped_file_is_known_by_its_content(kind, name, tmp_path):
    content = LOADERS[kind](shipped("params") / kind / f"{name}.yaml")
    (tmp_path / "own.yaml").write_text(dump_dataclass(content), encoding="utf-8")
    assert str(nearest(kind, tmp_path / "own.yaml")) == name


@pytest.mark.parametrize(
    ("kind", "key", "value"),
    [("rules", "timeout", 10.0), ("robots", "mass", 51.5), ("worlds", "cargo", {"fill": 0.7})],
)
def test_a_changed_copy_is_not_called_by_the_name_alone(kind, key, value, tmp_path):
    file = shipped("params") / kind / f"{PUBLISHED[kind]}.yaml"
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
    if "model: replay" in text:
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
    assert "paper: Nav2 w/ GPS" in text and "Contacts per 1000 km" in text
    assert all(stack in text for stack in stacks[:15])


@pytest.mark.parametrize(
    ("count", "low", "high"), [(0, 0.0, 3.689), (1, 0.0253, 5.572), (10, 4.795, 18.390)]
)
def test_intervals_of_counts_are_those_of_tables(count, low, high):
    """Limits of a Poisson mean as printed, e.g., by Ulm 1990 (Am J Epidemiol 131, 373)."""
    rate = poisson_rate(count, 2.0)
    assert rate.value == count / 2.0
    assert (rate.low, rate.high) == (
        pytest.approx(low / 2.0, abs=1e-3),
        pytest.approx(high / 2.0, abs=1e-3),
    )
    assert poisson_rate(count, 0.0).value is None


def test_contacts_are_those_that_are_paid_for_over_the_way_driven(write_run):
    rows = load_run(str(write_run("one", episodes=30))).stacks[0].rows
    kinds = ("pedestrian", "mailbox", "trash_bin", "building_glass", "bollard", "plant", "fence")
    count = sum(row[f"{kind}_contacts"] or 0 for row in rows for kind in kinds)
    kilometres = sum(row["distance_m"] for row in rows) / 1000.0
    assert count > 0
    assert contacts_per_1000_km(rows).value == pytest.approx(1000.0 * count / kilometres)
