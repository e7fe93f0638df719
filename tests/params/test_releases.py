"""What the registry knows of Nav2's distributions, beside this program's defaults and Nav2's files.

The facts stand in ``navstack/params/registry/nav2``, read from Nav2's sources.
"""

import dataclasses
import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

from harness.episode.wall_time import on_wall_time
from navstack.lint import lint
from navstack.params.lint.subject import Subject
from navstack.params.nav2_file.file import load_nav2
from navstack.params.nav2_file.findings import IGNORED_BY_NAV2, Known
from navstack.params.nav2_file.release import looks_like, release_notices, release_of
from navstack.params.nav2_file.views import read_velocity_smoother
from navstack.params.registry import bindings, nodes, releases
from navstack.params.registry.bindings import NAMED_SECTIONS, nested_params, parameter_of
from navstack.params.registry.defaults import differing
from navstack.params.registry.releases import RELEASES, Declared, span
from navstack.safety.velocity_smoother import VelocitySmoother
from navstack.types import Twist2D

DATA = Path(os.environ.get("NAVSTACK_DATA", ""), "nav2_defaults")
LIVING = ("humble", "jazzy", "kilted", "lyrical", "main")
MODELLED = "jazzy"
FILES = {
    "local_costmap": "costmap",
    "global_costmap": "costmap",
    "filter_mask_server": "map_server",
}

needs_files = pytest.mark.skipif(
    not (DATA / "main.yaml").exists(), reason="NAVSTACK_DATA has no nav2_defaults"
)

# Values that Jazzy computes, or that stand in headers, where the reader of sources does not see
# them; ours are those of the code named.
COMPUTED = {
    "plugins": "costmap_2d_ros.hpp",
    "observation_sources": "an empty text there, an empty list here",
    "lethal_override_cost": "MAX_NON_OBSTACLE (keepout_filter.cpp)",
    "mode": "FORWARD_PREFERENCE (path_angle_critic.cpp)",
    "max_robot_pose_search_dist": "half the local costmap's width",
    "source_timeout": "the monitor's own",
    "lattice_filepath": "a file of nav2_smac_planner; a lattice is made instead",
}


def read_by() -> Iterator[tuple[str, type[Any], Mapping[str, Any]]]:
    """Place, dataclass and Jazzy's defaults of all that this program reads of Nav2's own."""
    facts = releases.load(MODELLED)
    for node, params in {**bindings.NODES, **bindings.FILTER_NODES}.items():
        declared = facts["nodes"].get(FILES.get(node, node))
        if declared:
            yield from namespaces(node, params, declared, "")
    for family, entries in nodes.FAMILIES.items():
        critics = nested_params(bindings.CRITICS[family]) if family in bindings.CRITICS else {}
        for kind, entry in entries.items():
            params = entry.params or critics.get(kind)
            declared = facts["plugins"][family].get(kind) if family in facts["plugins"] else None
            if params and declared and not entry.keys.is_open:
                yield from namespaces(kind, params, declared, "")


def namespaces(
    place: str,
    params: type[Any],
    declared: Mapping[str, Any],
    prefix: str,
) -> Iterator[tuple[str, type[Any], Mapping[str, Any]]]:
    below = {
        name[len(prefix) :]: each for name, each in declared.items() if name.startswith(prefix)
    }
    yield f"{place}: {prefix}", params, below
    for name, inner in nested_params(params).items():
        is_named = name in NAMED_SECTIONS.get(params, {})
        deeper = f"{prefix}{name}.*." if is_named else f"{prefix}{name}."
        if any(each.startswith(deeper) for each in declared):
            yield from namespaces(place, inner, declared, deeper)


def test_defaults_are_those_of_jazzy() -> None:
    compared, differing = 0, []
    for place, params, declared in read_by():
        for field in dataclasses.fields(params):
            name, ours = parameter_of(field.name), field.default
            nav2 = declared.get(name)
            if name not in declared or ours is dataclasses.MISSING or name.endswith("_plugins"):
                continue
            if isinstance(ours, tuple):
                ours = list(ours)
            if isinstance(nav2, dict):  # has no default: absent, or the empty text
                continue
            compared += 1
            if ours != nav2 and name not in COMPUTED:
                differing.append(f"{place}{name}: {ours!r}, in Nav2 {nav2!r}")
    assert differing == []
    assert compared > 380


@pytest.mark.parametrize("release", RELEASES)
def test_a_distributions_facts_name_their_commit(release: str) -> None:
    facts = releases.load(release)
    assert re.fullmatch("[0-9a-f]{40}", facts["commit"])
    assert facts["nodes"]["amcl"]["sigma_hit"] == 0.2
    assert "nav2_navfn_planner::NavfnPlanner" in facts["plugins"]["planners"]


def test_kinds_and_releases_of_a_parameter() -> None:
    entry = nodes.FAMILIES["controllers"]["nav2_mppi_controller::MPPIController"]
    assert entry.keys.keys["model_delay_vx"] == Declared(("lyrical", "main"), frozenset({"double"}))
    assert entry.keys.keys["reset_period"].releases == ("humble",)
    assert entry.keys.keys["batch_size"].kinds == {"integer"}
    assert entry.releases == RELEASES[2:]
    polygons = nodes.NODES["collision_monitor"].named["polygons"]
    assert polygons.named["velocity_polygons"].keys["theta_min"].kinds == {"double"}
    assert not nodes.FAMILIES["planners"]["navstack::OmplPlanner"].releases


@pytest.mark.parametrize(
    ("having", "text"),
    [
        (RELEASES[5:], "since kilted"),
        (RELEASES[:3], "until humble"),
        (RELEASES[2:5], "humble to jazzy"),
        (RELEASES[2:3], "of humble"),
        (RELEASES[:1], "of foxy"),
        (RELEASES[-1:], "since main"),
        ((RELEASES[2], RELEASES[4]), "of humble, jazzy"),
    ],
)
def test_the_span_of_releases(having: tuple[str, ...], text: str) -> None:
    assert span(having) == text


@needs_files
@pytest.mark.parametrize("release", LIVING)
def test_nav2s_own_files_are_read_without_a_false_word(release: str) -> None:
    nav2 = load_nav2(DATA / f"{release}.yaml")
    assert not [each for each in lint(nav2) if each.id in IGNORED_BY_NAV2 or each.is_error]
    likely = looks_like(nav2.names)
    assert release in likely
    assert set(likely) <= {release, "lyrical", "main"}
    assert not release_notices(nav2.names)


MIXED = """
controller_server:
  ros__parameters:
    search_window: 2.0
    FollowPath:
      plugin: "nav2_mppi_controller::MPPIController"
      prune_distance: 1.5
      inversion_xy_tolerance: 0.2
      enforce_path_inversion: true
      critics: ["ConstraintCritic"]
    near: {plugin: "nav2_controller::AxisGoalChecker"}
    goal_checker_plugins: [near]
"""


def test_names_of_other_releases_are_told_in_one_line(inspect: Any) -> None:
    nav2 = inspect(MIXED)
    (notice,) = release_notices(nav2.names)
    assert notice.line == 4
    assert notice.message == (
        "looks like a file of Nav2 humble or iron or jazzy or kilted, which lacks "
        "controller_server: search_window (since lyrical), "
        "controller_server: near (nav2_controller::AxisGoalChecker) (since lyrical)"
    )


PLUGINS = """
controller_server:
  ros__parameters:
    FollowPath:
      plugin: "{controller}"
      critics: [{critic}]
behavior_server:
  ros__parameters:
    behavior_plugins: [backup]
    backup: {{plugin: "nav2_behaviors::BackUp"}}
"""
MPPI = {"controller": "nav2_mppi_controller::MPPIController", "critic": "PathAngleCritic"}
DWB = {"controller": "dwb_core::DWBLocalPlanner", "critic": "PathDist"}


@pytest.mark.parametrize(
    ("release", "controller", "name", "default"),
    [
        ("galactic", DWB, "controller_server.FollowPath.prune_distance", 1.0),
        ("jazzy", DWB, "controller_server.FollowPath.prune_distance", None),
        ("humble", MPPI, "controller_server.FollowPath.PathAngleCritic.cost_weight", 2.0),
        ("jazzy", MPPI, "controller_server.FollowPath.PathAngleCritic.cost_weight", None),
        ("kilted", DWB, "behavior_server.backup.minimum_speed", 0.1),
        ("lyrical", DWB, "controller_server.FollowPath.path_length_tolerance", 1.0),
    ],
)
def test_what_a_file_leaves_out_has_the_default_of_its_distribution(
    inspect: Any,
    monkeypatch: Any,
    release: str,
    controller: Any,
    name: str,
    default: float | None,
) -> None:
    monkeypatch.setattr("navstack.params.nav2_file.file.release_of", lambda names: release)
    text = PLUGINS.format(**controller)
    nav2 = inspect(text)
    node, _, dotted = name.partition(".")
    assert nav2.value(node, dotted) == default
    assert nav2.release == release
    assert (f"{node}: {dotted} {default}" in nav2.release_defaults) == (default is not None)
    assert bool(nav2.release_defaults) == (release != "jazzy")
    given = nav2.with_values({name: 0.7})
    assert given.value(node, dotted) == 0.7


def test_the_distribution_of_a_file_is_the_one_next_to_jazzy() -> None:
    names = [Known("controller_server: x", 1, releases) for releases in (RELEASES[:3], RELEASES)]
    assert looks_like(names) == ("foxy", "galactic", "humble")
    assert release_of(names) == "humble"
    assert release_of([Known("x", 1, RELEASES[5:])]) == "kilted"
    assert release_of([]) == "jazzy"


def test_a_merged_file_has_the_same_values_whatever_it_reads_like(
    inspect: Any, monkeypatch: Any
) -> None:
    humble = "navstack.params.nav2_file.file.release_of", lambda names: "humble"
    monkeypatch.setattr(*humble)
    nav2 = inspect(PLUGINS.format(**MPPI))
    merged = nav2.dump_merged()
    critic = nav2.merged()["controller_server"]["ros__parameters"]["FollowPath"]["PathAngleCritic"]
    assert critic["max_angle_to_furthest"] == 1.2
    for release in RELEASES:
        monkeypatch.setattr(humble[0], lambda names, release=release: release)
        again = inspect(merged)
        assert (again.release_defaults, again.dump_merged()) == ((), merged)


def test_a_robot_of_galactic_has_no_velocity_smoother(inspect: Any, monkeypatch: Any) -> None:
    """Its launch files bring none up: what the controller says is driven."""
    monkeypatch.setattr("navstack.params.nav2_file.file.release_of", lambda names: "galactic")
    text = PLUGINS.format(**DWB).replace(
        "FollowPath:", "controller_frequency: 30.0\n    FollowPath:"
    )
    nav2 = inspect(text)
    params = read_velocity_smoother(nav2)
    assert params.smoothing_frequency == 30.0
    fast = Twist2D(3.0, 0.0, -2.9)
    smoother = VelocitySmoother(params)
    assert smoother.smooth(fast, Twist2D(), 0.0) == fast
    assert smoother.smooth(None, Twist2D(), 60.0) == fast
    assert smoother.smooth(Twist2D(), Twist2D(), 60.1) == Twist2D()
    assert on_wall_time(nav2, 0.5) is nav2
    assert Subject(nav2).smoother is None
    own = nav2.with_values({"velocity_smoother.max_velocity": [0.8, 0.0, 1.0]})
    assert read_velocity_smoother(own).max_accel == (2.5, 0.0, 3.2)
    bad = inspect(text.replace("30.0", "often"))
    assert len(bad.errors) == 1 and "'often' is not a number" in bad.errors[0]


def test_since_humble_a_robot_has_nav2s_velocity_smoother(inspect: Any) -> None:
    text = PLUGINS.format(**MPPI).replace("critics:", "vx_max: 1.5\n      critics:")
    nav2 = inspect(text)
    assert read_velocity_smoother(nav2).max_velocity[0] == 0.5
    (notice,) = [each for each in lint(nav2) if each.id == "smoother-caps"]
    assert "0.5 m/s, Nav2's default as the file leaves it out" in notice.message


def test_the_defaults_that_differ_from_jazzys() -> None:
    found = {
        f"{release} {params.__name__}.{name} {value}"
        for release in LIVING
        for _, params, _ in read_by()
        for name, value in differing(params, release).items()
    }
    assert found == {
        "humble GracefulParams.beta 0.2",
        "humble GracefulParams.k_delta 2.0",
        "humble GracefulParams.k_phi 3.0",
        "humble MppiParams.reset_period 1.0",
        "humble ObstaclesParams.collision_cost 10000.0",
        "humble PathAngleParams.cost_weight 2.0",
        "humble PathAngleParams.max_angle_to_furthest 1.2",
        "humble RotationShimParams.angular_disengage_threshold 0.785",
        "lyrical DwbParams.path_length_tolerance 1.0",
        "main DwbParams.path_length_tolerance 1.0",
    }
