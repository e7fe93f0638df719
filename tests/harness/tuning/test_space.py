"""Search spaces and paths into Nav2 files.

What is found, what is refused, and what a point writes.
"""

import dataclasses
import math
from functools import cache
from pathlib import Path

import pytest

from harness.storage.shipped import shipped
from harness.tuning.sampler import make_sampler
from harness.tuning.space.checking import check_space
from harness.tuning.space.constraint import parse_constraint
from harness.tuning.space.file import ListEdit, SpaceFile, read_spaces
from harness.tuning.space.fitting import fit_space
from harness.tuning.space.paths import (
    COMMA,
    AbsentError,
    NoPluginError,
    edited_list,
    is_list,
    locate,
    locate_list,
    with_absolute_files,
    with_values,
)
from harness.tuning.space.space import Space
from navstack.errors import InputError, ParameterError
from navstack.params.nav2_file.file import Nav2File, load_nav2
from navstack.params.nav2_file.yaml_text import load_text
from navstack.params.strict import dump_dataclass, from_mapping

SPACES = {
    "dwb_contact": "stock",
    "dwb_critics": "stock",
    "dwb_horizon": "stock",
    "dwb_sampling": "stock",
    "dwb_obstacles": "stock",
    "local_layers": "stock",
    "inflation": "mpc",
    "mpc_weights": "mpc",
    "mpc_limits": "mpc",
    "mppi": "mppi",
    "expected_cost": "expected_cost",
    "collision_monitor": "stock",
    "amcl": "amcl",
}
DWB = "controller_server.{dwb_core::DWBLocalPlanner}"


@cache
def nav2(name: str) -> Nav2File:
    return load_nav2(shipped("params") / "nav2" / f"{name}.yaml")


def space_of(folder: Path, text: str, file: str = "stock") -> Space:
    (folder / "own.yaml").write_text(f"title: own\n{text}")
    return fit_space(*read_spaces([folder / "own.yaml"]), nav2(file))


def holds_list(file: Nav2File, path: str) -> bool:
    return isinstance(file.value(*path.split(".", 1)), list)


def complaint(folder: Path, text: str) -> str:
    with pytest.raises(InputError) as raised:
        space_of(folder, text)
    assert "\n" not in str(raised.value)
    return str(raised.value)


def test_every_space_that_comes_with_the_program_is_tried_here() -> None:
    assert {path.stem for path in (shipped("params") / "search_spaces").glob("*.yaml")} == set(
        SPACES
    )


@pytest.mark.parametrize("name", SPACES)
def test_points_of_every_space_make_files_that_load(name: str) -> None:
    file = nav2(SPACES[name])
    space = fit_space(*read_spaces([shipped("params") / "search_spaces" / f"{name}.yaml"]), file)
    sampler = make_sampler("random", space, 1, 20, 1)
    sampler.tell(space.original, [0.0])
    for _ in range(2):
        point = sampler.ask()
        assert point is not None and space.allows(point)
        changed = with_values(file, space.values(point))
        for parameter in space.parameters:
            for path in parameter.paths if parameter.has_effect(point) else ():
                find = locate_list if holds_list(changed, path) else locate
                assert find(changed, path).value == point[parameter.name]
        sampler.tell(point, [0.0])
    assert space.values(space.original) == {}


def test_only_tuned_values_change_in_the_text() -> None:
    file = nav2("stock")
    values = {
        "controller_server.FollowPath.PathAlign.scale": 7.5,
        "velocity_smoother.max_velocity[0]": 1.25,
    }
    before, after = (each.document.text.splitlines() for each in (file, with_values(file, values)))
    changed = [(a, b) for a, b in zip(before, after, strict=True) if a != b]
    assert [b.strip() for _, b in changed] == [
        "PathAlign.scale: 7.5",
        "max_velocity: [1.25, 0.0, 1.5]",
    ]


def test_a_text_with_commas_is_a_list_where_the_parameter_is_one() -> None:
    assert [is_list(value) for value in ("a, b", "a", 3, True)] == [True, False, False, False]
    values = {
        "controller_server.FollowPath.critics": "Oscillation, GoalDist",
        "controller_server.note": "one, two",
    }
    changed = with_values(nav2("stock"), values, allow_unknown=True)
    assert changed.value("controller_server", "FollowPath.critics") == ["Oscillation", "GoalDist"]
    assert changed.value("controller_server", "note") == "one, two"


def test_a_plugin_is_found_by_its_type_also_below_a_rotation_shim() -> None:
    for name in ("stock", "tuned"):
        assert (
            locate(nav2(name), f"{DWB}.PathAlign.scale").path
            == "controller_server.FollowPath.PathAlign.scale"
        )


def test_paths_may_stand_as_in_the_file_and_absent_ones_have_nav2s_default() -> None:
    place = locate(
        nav2("stock"),
        "local_costmap.local_costmap.ros__parameters.inflation_layer.inflation_radius",
    )
    assert (place.path, place.value) == ("local_costmap.inflation_layer.inflation_radius", 0.8)
    assert locate(nav2("stock"), f"{DWB}.prune_distance").value == 2.0


@pytest.mark.parametrize(
    ("path", "said"),
    [
        (f"{DWB}.PathAlign.scales", "did you mean 'controller_server.FollowPath.PathAlign.scale'?"),
        (
            "controler_server.FollowPath.max_vel_x",
            "no node 'controler_server' that has an effect; did you mean ",
        ),
        (f"{DWB}.Twirling.scale", "has no such parameter"),
        (
            "controller_server.{dwb_core::DWBLocalPlaner}.sim_time",
            "did you mean 'dwb_core::DWBLocalPlanner'?",
        ),
        (
            "controller_server.{navstack::JerkLimitedMPC}.max_speed",
            "has no navstack::JerkLimitedMPC in controller_server",
        ),
        ("amcl.tf_broadcast", "has no effect here"),
        ("velocity_smoother.max_velocity", "give the path of a number, text or switch"),
        ("velocity_smoother.max_velocity[7]", "give the path of a number, text or switch"),
    ],
)
def test_what_is_not_there_is_an_error_with_the_nearest(path: str, said: str) -> None:
    with pytest.raises(ParameterError, match="path|controller_server|velocity_smoother") as raised:
        locate(nav2("stock"), path)
    assert said in str(raised.value)


def test_absent_ones_are_left_out_only_where_the_space_says_so(tmp_path: Path) -> None:
    entry = f"{{path: '{DWB}.Twirling.scale', low: 1.0, high: 9.0"
    other = f"  sim_time: {{path: '{DWB}.sim_time', low: 0.5, high: 3.0}}\n"
    space = space_of(tmp_path, f"parameters:\n  twirling: {entry}, optional: true}}\n{other}")
    assert [each.name for each in space.parameters] == ["sim_time"] and space.notes == (
        "own: left out, as stock.yaml has nothing of the kind: twirling",
    )
    assert "no such parameter" in complaint(
        tmp_path, f"parameters:\n  twirling: {entry}}}\n{other}"
    )


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        ("low: 1.0, hihg: 9.0", "unknown key 'hihg'; did you mean 'high'?"),
        ("low: 9.0, high: 1.0", "give low < high"),
        ("low: 0.0, high: 1.0, log: true", "begins above 0"),
        ("low: 1.0", "give low < high"),
        ("low: 1.0, high: 1.0", "give low < high"),
        ("low: 1.0, high: 2.0, step: 0.0", "does not fit"),
        ("low: 1.0, high: 2.0, switch: true", "give low and high, or levels"),
        ("choices: [a, b]", "'choices' is not the way"),
        ("low: 1.0, high: 2.0, step: 3.0", "does not fit"),
    ],
)
def test_bad_entries_are_refused_in_one_line(tmp_path: Path, entry: str, said: str) -> None:
    assert said in complaint(
        tmp_path, f"parameters:\n  sim_time: {{path: '{DWB}.sim_time', {entry}}}\n"
    )


def test_the_original_is_always_possible(tmp_path: Path) -> None:
    space = space_of(
        tmp_path,
        f"parameters:\n  sim_time: {{path: '{DWB}.sim_time', low: 2.0, high: 3.0, log: true}}\n"
        f"  samples: {{path: '{DWB}.vx_samples', levels: [5, 10]}}\n",
    )
    assert (space.parameters[0].low, space.parameters[0].high) == (1.7, 3.0)
    assert space.parameters[1].choices == (5, 10, 20) and len(space.notes) == 2


def test_a_range_without_end_and_a_space_without_another_value_are_refused(tmp_path: Path) -> None:
    path = "global_costmap.obstacle_layer.scan.obstacle_max_range"
    endless = nav2("stock").with_values({path: math.inf}, True)
    (tmp_path / "own.yaml").write_text(
        f"title: o\nparameters: {{r: {{path: '{path}', low: 1, high: 2}}}}\n"
    )
    with pytest.raises(ParameterError, match="is inf, which no range can hold; give it levels"):
        fit_space(*read_spaces([tmp_path / "own.yaml"]), endless)
    space = space_of(tmp_path, f"parameters: {{r: {{path: '{path}', levels: [10.0]}}}}\n")
    with pytest.raises(InputError, match="no parameter may have another value than the file's"):
        check_space(space, nav2("stock"), make_sampler("random", space, 1, 20, 1))


def test_a_range_that_is_widened_keeps_its_steps(tmp_path: Path) -> None:
    text = f"  t: {{path: '{DWB}.sim_time', low: 2.0, high: 3.0, step: 0.25}}\n"
    (parameter,) = space_of(tmp_path, f"parameters:\n{text}").parameters
    assert (parameter.low, parameter.high, parameter.original) == (1.5, 3.0, 1.7)
    fine = dataclasses.replace(parameter, low=1200.0, high=1204.0, step=0.5)
    assert [fine.rounded(value) for value in (1200.5, 1203.0)] == [1200.5, 1203.0]


def test_a_switch_that_launch_files_fill_in_begins_at_nav2s_default(tmp_path: Path) -> None:
    text = nav2("stock").document.text
    path = tmp_path / "robot.yaml"
    path.write_text(text.replace("stateful: true", "stateful: $(var stateful)", 1))
    place = locate(load_nav2(path, allow_unknown=True), "controller_server.goal_checker.stateful")
    assert (place.kind, place.value) == (bool, True)


NUMBERS = f"parameters:\n  sim_time: {{path: '{DWB}.sim_time', low: 0.5, high: 5.0}}\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            f"{NUMBERS}  again: {{path: controller_server.FollowPath.sim_time, low: 1, high: 2}}\n",
            "both set",
        ),
        (f"{NUMBERS}reads: {{sim_time: local_costmap.width}}\n", "in both parameters and reads"),
        (
            f"{NUMBERS}reads: {{width: local_costmap.widht}}\n",
            "own: width: path 'local_costmap.widht'",
        ),
        (f"{NUMBERS}reads: {{kind: velocity_smoother.feedback}}\n", "constraints are of numbers"),
        (f"{NUMBERS}  told: {{path: '{DWB}.acc_lim_x', low: 1, high: 2}}\n", "'told' is no name"),
        (
            f'{NUMBERS}  "\\e[31m": {{path: "{DWB}.acc_lim_x", low: 1, high: 2}}\n',
            "is no name for a parameter",
        ),
        (
            f"parameters:\n  n: {{path: '{DWB}.vx_samples', low: 1, high: 9, step: 0.5}}\n",
            "0.5 is no whole number",
        ),
        (
            "parameters:\n  speed: "
            f"{{path: '{DWB}.max_vel_x', also: ['{DWB}.vx_samples'], low: 1, high: 2}}\n",
            "of another kind",
        ),
    ],
)
def test_what_contradicts_itself_is_refused(tmp_path: Path, text: str, said: str) -> None:
    assert said in complaint(tmp_path, text)


def test_levels_stand_in_order_each_once_and_whole_steps_stay_whole(tmp_path: Path) -> None:
    space = space_of(
        tmp_path,
        f"parameters:\n  sim_time: {{path: '{DWB}.sim_time', levels: [2.5, 1.0, 2.5]}}\n"
        f"  samples: {{path: '{DWB}.vx_samples', low: 5, high: 40, step: 5}}\n",
    )
    assert space.parameters[0].choices == (1.0, 1.7, 2.5)
    for kind in ("grid", "random"):
        sampler = make_sampler(kind, space, 0, 30, 1)
        for _ in range(8):
            point = sampler.ask()
            assert point is not None and type(point["samples"]) is int and point["samples"] % 5 == 0
            sampler.tell(point, [0.0])


def test_a_space_is_tried_before_anything_is_driven(tmp_path: Path) -> None:
    text = "constraints: [sim_time <= 0.1]\n"
    space = space_of(tmp_path, f"{NUMBERS}{text}")
    with pytest.raises(
        InputError, match="no point was found beside the file's own that keeps the constraints"
    ):
        check_space(space, nav2("stock"), make_sampler("tpe", space, 0, 5, 1))
    anchored = nav2("stock").document.text.replace("sim_time: 1.7", "sim_time: &time 1.7")
    (tmp_path / "anchored.yaml").write_text(anchored)
    space, file = space_of(tmp_path, NUMBERS), load_nav2(tmp_path / "anchored.yaml")
    with pytest.raises(ParameterError, match="sim_time has a YAML anchor"):
        check_space(space, file, make_sampler("tpe", space, 0, 5, 1))


@pytest.mark.parametrize(
    ("entry", "told"),
    [
        (
            "  kind: {path: 'controller_server.FollowPath.PathDist.aggregation_type', "
            "choices: [sum, summ]}",
            r"kind: the file cannot be driven with 'summ': .*did you mean 'sum'",
        ),
        (
            "  critics: {path: controller_server.FollowPath.critics, lists: [{add: [Nonsense]}]}",
            r"critics: the file cannot be driven with '.*, Nonsense': .*critic 'Nonsense'",
        ),
    ],
)
def test_a_choice_that_cannot_be_driven_is_told_at_once(
    tmp_path: Path, entry: str, told: str
) -> None:
    (tmp_path / "own.yaml").write_text(f"title: own\nparameters:\n{entry}\n")
    space = fit_space(*read_spaces([tmp_path / "own.yaml"]), nav2("stock"), allow_unknown=True)
    with pytest.raises(InputError, match=told):
        check_space(space, nav2("stock"), make_sampler("tpe", space, 0, 5, 1), allow_unknown=True)


def test_what_a_space_does_beside_is_told(tmp_path: Path) -> None:
    text = nav2("stock").document.text.replace("max_velocity: [2.0,", "max_velocity: [1.5,")
    (tmp_path / "slow.yaml").write_text(text)
    (tmp_path / "own.yaml").write_text(
        "title: own\nparameters:\n  speed: "
        f"{{path: '{DWB}.max_vel_x', also: ['velocity_smoother.max_velocity[0]'], "
        f"low: 1, high: 2}}\n  gone: {{path: '{DWB}.Twirling.scale', low: 1, high: 2, optional: "
        f"true}}\n"
        "constraints: [speed <= gone]\n"
    )
    notes = fit_space(
        *read_spaces([tmp_path / "own.yaml"]), load_nav2(tmp_path / "slow.yaml")
    ).notes
    assert any("a change sets velocity_smoother.max_velocity[0], now 1.5" in note for note in notes)
    assert any("constraint speed <= gone is left out" in note for note in notes)


def test_a_node_that_the_files_release_lacks_is_not_tuned(tmp_path: Path) -> None:
    """Galactic brings up no velocity smoother: a limit written for it would be for a later one."""
    limit = "velocity_smoother.max_velocity[0]"
    text = f"title: own\nparameters:\n  speed: {{path: '{DWB}.max_vel_x', also: ['{limit}'], "
    (tmp_path / "own.yaml").write_text(text + "low: 1, high: 2}\n")
    of_stock = nav2("stock")
    entries = {**of_stock.parameters, "velocity_smoother": {}}
    older = dataclasses.replace(of_stock, parameters=entries, release="galactic")
    spaces = read_spaces([tmp_path / "own.yaml"])
    for file, paths_of in ((older, 1), (of_stock, 2)):
        (speed,) = fit_space(*spaces, file).parameters
        assert len(speed.paths) == paths_of
    with pytest.raises(NoPluginError, match="Nav2 galactic, which has no velocity_smoother"):
        locate(older, limit)


def test_points_that_max_points_overrides_are_not_tuned(tmp_path: Path) -> None:
    text = "collision_monitor:\n  ros__parameters:\n    polygons: [Zone]\n"
    text += "    observation_sources: [scan]\n    scan: {type: scan, topic: /scan}\n"
    text += "    Zone: {type: circle, radius: 0.3, action_type: stop, max_points: 5}\n"
    for key, counts in (("max_points", False), ("min_points", True)):
        (tmp_path / "nav2.yaml").write_text(text.replace("max_points", key))
        file = load_nav2(tmp_path / "nav2.yaml")
        if counts:
            assert locate(file, "collision_monitor.Zone.min_points").value == 5
        else:
            with pytest.raises(AbsentError):
                locate(file, "collision_monitor.Zone.min_points")


def test_constraints_bind_points_and_speak_of_numbers_that_stay(tmp_path: Path) -> None:
    space = space_of(
        tmp_path,
        f"parameters:\n  sim_time: {{path: '{DWB}.sim_time', low: 0.5, high: 5.0}}\n"
        f"reads: {{speed: '{DWB}.max_vel_x'}}\nconstraints: [sim_time * speed <= 3.0]\n",
    )
    assert space.allows({"sim_time": 1.5}) and not space.allows({"sim_time": 1.51})
    assert "itself breaks a constraint" in space.notes[0]
    sampler = make_sampler("random", space, 0, 5, 1)
    assert all(float((sampler.ask() or {})["sim_time"]) <= 1.5 for _ in range(30))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("__import__('os').system('x') <= 1", "only numbers, names"),
        ("a <= b", "unknown number in the constraint 'a <= b' of here: 'b'"),
        ("a", "is no constraint"),
        ("a <= 1 <= 2", "is no constraint"),
        ("a == 1", "is no constraint"),
        ("a ** 99999999 <= 1", "only numbers, names"),
        ("a <=", "is no constraint"),
    ],
)
def test_constraints_are_arithmetic_and_nothing_else(text: str, said: str) -> None:
    with pytest.raises(InputError) as raised:
        parse_constraint(text, ("a",), "here")
    assert said in str(raised.value)


def test_grid_has_levels_for_the_trials() -> None:
    file = nav2("mpc")
    space = fit_space(*read_spaces([shipped("params") / "search_spaces" / "mpc_limits.yaml"]), file)
    points = [make_sampler("grid", space, 0, 100, 1).ask() for _ in range(2)]
    assert points[0] == points[1] and points[0] is not None and space.allows(points[0])


def test_relative_masks_are_found_from_anywhere(tmp_path: Path) -> None:
    text = nav2("stock").document.text.replace(
        'yaml_filename: ""', 'yaml_filename: "maps/a.yaml"  # mine'
    )
    mask = '\nfilter_mask_server:\n  ros__parameters:\n    yaml_filename: "maps/b.yaml"\n'
    (tmp_path / "own.yaml").write_text(text + mask)
    moved = with_absolute_files(load_nav2(tmp_path / "own.yaml"))
    assert moved.value("filter_mask_server", "yaml_filename") == str(
        tmp_path.resolve() / "maps" / "b.yaml"
    )
    assert moved.document.text.startswith(text), "a map that is not read here stays as it is"


def test_absent_is_a_parameter_error() -> None:
    assert issubclass(AbsentError, ParameterError)


def paths(*names: str) -> list[Path]:
    return [shipped("params") / "search_spaces" / f"{name}.yaml" for name in names]


def space(*names: str, file: str = "stock") -> Space:
    return fit_space(*read_spaces(paths(*names)), nav2(file))


def test_spaces_are_searched_together_and_agree_on_what_both_have() -> None:
    joint = space("dwb_critics", "dwb_obstacles", "local_layers")
    names = [each.name for each in joint.parameters]
    assert joint.name == "dwb_critics+dwb_obstacles+local_layers" and joint.title.count(";") == 2
    assert len(names) == len(set(names)) and {
        "path_align",
        "layer_order",
        "obstacle_critic",
    } <= set(names)
    again = load_dataclass_text(
        dump_dataclass(read_spaces(paths("dwb_critics", "local_layers"))[1])
    )
    assert again == read_spaces(paths("dwb_critics", "local_layers"))[1], (
        "as the study's folder keeps it"
    )


def load_dataclass_text(text: str) -> SpaceFile:
    return from_mapping(SpaceFile, load_text(text, "here"), "here")


def test_spaces_that_contradict_each_other_are_refused(tmp_path: Path) -> None:
    one, other = tmp_path / "one.yaml", tmp_path / "other.yaml"
    one.write_text(
        f"title: one\nparameters:\n  speed: {{path: '{DWB}.max_vel_x', low: 1.0, high: 2.0}}\n"
    )
    other.write_text(
        f"title: other\nparameters:\n  speed: {{path: '{DWB}.max_vel_x', low: 1.0, high: 3.0}}\n"
    )
    with pytest.raises(
        ParameterError, match="--space one and other differ in 'speed'; give spaces that agree"
    ):
        fit_space(*read_spaces([one, other]), nav2("stock"))
    other.write_text(
        f"title: other\nparameters:\n  fast: {{path: '{DWB}.max_vel_x', low: 1.0, high: 2.0}}\n"
    )
    with pytest.raises(
        ParameterError, match="speed and fast both set controller_server.FollowPath.max_vel_x"
    ):
        fit_space(*read_spaces([one, other]), nav2("stock"))
    with pytest.raises(ParameterError, match="one is given twice"):
        fit_space(*read_spaces([one, one]), nav2("stock"))


def test_layers_are_put_in_order_and_comments_stay() -> None:
    joint, file = space("local_layers"), nav2("stock")
    order = next(each for each in joint.parameters if each.name == "layer_order")
    assert order.original == "voxel_layer, inflation_layer, static_layer, keepout_filter"
    assert order.choices[1:] == ("static_layer, voxel_layer, keepout_filter, inflation_layer",)
    changed = with_values(file, joint.values({**joint.original, "layer_order": order.choices[1]}))
    assert changed.value("local_costmap", "plugins") == str(order.choices[1]).split(", ")
    before, after = (each.document.text.splitlines() for each in (file, changed))
    assert [(a, b) for a, b in zip(before, after, strict=True) if a != b] == [
        (
            '      plugins: ["voxel_layer", "inflation_layer", "static_layer", "keepout_filter"]',
            '      plugins: ["static_layer", "voxel_layer", "keepout_filter", "inflation_layer"]',
        )
    ]
    last = space("local_layers", file="tuned").parameters[0]
    assert last.choices[1] == "obstacle_layer, inflation_layer, static_layer, keepout_filter"


def test_a_critic_in_the_place_of_another_brings_its_parameters() -> None:
    joint, file = space("dwb_critics", "dwb_obstacles"), nav2("stock")
    old, new = next(each for each in joint.parameters if each.name == "obstacle_critic").choices
    point = {**joint.original, "base_obstacle": 0.5, "obstacle_footprint": 0.25}
    assert joint.values(point) == {"controller_server.FollowPath.BaseObstacle.scale": 0.5}
    point["obstacle_critic"] = new
    changed = with_values(file, joint.values(point))
    assert changed.value("controller_server", "FollowPath.critics")[2] == "ObstacleFootprint"
    assert locate(changed, f"{DWB}.ObstacleFootprint.scale").value == 0.25
    assert "BaseObstacle.scale: 0.02" in changed.document.text and old != new


def test_a_critic_that_is_added_comes_last_and_brings_its_parameters() -> None:
    joint, file = space("dwb_contact"), nav2("stock")
    old, new = next(each for each in joint.parameters if each.name == "critics").choices
    assert new == f"{old}, ExpectedContact"
    point = {**joint.original, "contact_scale": 50.0}
    assert joint.values(point) == {}, "without the critic its scale does nothing"
    changed = with_values(file, joint.values({**point, "critics": new}))
    assert changed.value("controller_server", "FollowPath.critics") == str(new).split(", ")
    assert locate(changed, f"{DWB}.ExpectedContact.scale").value == 50.0
    place = locate_list(changed, f"{DWB}.critics")
    assert (
        edited_list(changed, place, ListEdit(add=("GoalDist", "Twirling"))) == f"{new}, Twirling"
    ), "no name comes twice"


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        (
            f"path: '{DWB}.critics', lists: "
            f"[{{order: [GoalDist], replace: {{PathDist: GoalDist}}}}]",
            "has one of order",
        ),
        (
            f"path: '{DWB}.critics', lists: [{{replace: {{PathDist: GoalDist}}, add: [Twirling]}}]",
            "has one of order",
        ),
        (f"path: '{DWB}.critics', lists: [{{}}]", "has one of order, replace and add"),
        (
            f"path: '{DWB}.critics', lists: [{{add: [GoalDist]}}]",
            "none of the lists changes anything",
        ),
        (
            f"path: '{DWB}.critics', lists: [{{replace: {{Twirling: GoalDist}}}}]",
            "none of the lists changes anything",
        ),
        (
            f"path: '{DWB}.sim_time', lists: [{{replace: {{a: b}}}}]",
            "give the path of a list of names",
        ),
        (f"path: '{DWB}.critics', lists: [{{replace: {{GoalDist: GoalDits}}}}]", "GoalDits"),
    ],
)
def test_lists_that_cannot_be_are_refused(tmp_path: Path, entry: str, said: str) -> None:
    assert said in complaint(tmp_path, f"parameters:\n  critics: {{{entry}}}\n")


def edited(folder: Path, old: str, new: str) -> Nav2File:
    """The stock file with another text in place of one."""
    text = nav2("stock").document.text
    assert text.count(old) == 1
    (folder / "edited.yaml").write_text(text.replace(old, new))
    return load_nav2(folder / "edited.yaml")


def test_the_controller_that_drives_is_tuned_not_the_first_of_its_type(tmp_path: Path) -> None:
    """Profiles before FollowPath, for which the default tree asks; one has a type of its own."""
    idle = (
        '    controller_plugins: ["Slow", "Other", "FollowPath"]\n'
        '    Slow: {plugin: "dwb_core::DWBLocalPlanner", critics: [GoalDist], max_vel_x: 0.3}\n'
        '    Other: {plugin: "nav2_mppi_controller::MPPIController", critics: [GoalCritic]}\n'
    )
    file = edited(tmp_path, '    controller_plugins: ["FollowPath"]\n', idle)
    place = locate(file, f"{DWB}.max_vel_x")
    assert place == locate(nav2("stock"), f"{DWB}.max_vel_x")
    assert place.path == "controller_server.FollowPath.max_vel_x"
    with pytest.raises(NoPluginError, match="has no nav2_mppi_controller::MPPIController in"):
        locate(file, "controller_server.{nav2_mppi_controller::MPPIController}.time_steps")
    with pytest.raises(AbsentError, match="has no effect here"):
        locate(file, "controller_server.Slow.max_vel_x")


def test_the_planner_that_plans_is_tuned_not_the_first_of_its_type(tmp_path: Path) -> None:
    idle = (
        '    planner_plugins: ["Other", "GridBased"]\n'
        '    Other: {plugin: "nav2_navfn_planner::NavfnPlanner", tolerance: 9.0}\n'
    )
    file = edited(tmp_path, '    planner_plugins: ["GridBased"]\n', idle)
    place = locate(file, "planner_server.{nav2_navfn_planner::NavfnPlanner}.tolerance")
    assert place.path == "planner_server.GridBased.tolerance"


def test_an_entry_of_a_list_that_the_file_leaves_out_is_set_in_nav2s_default(
    tmp_path: Path,
) -> None:
    file = edited(tmp_path, "    max_velocity: [2.0, 0.0, 1.5]\n", "")
    assert locate(file, "velocity_smoother.max_velocity[2]").value == 2.5
    changed = with_values(file, {"velocity_smoother.max_velocity[2]": 1.0})
    assert changed.value("velocity_smoother", "max_velocity") == [0.5, 0.0, 1.0]


def test_a_critic_that_the_file_has_already_takes_no_others_place(tmp_path: Path) -> None:
    critics = COMMA.join(
        f'"{name}"' for name in nav2("stock").value("controller_server", "FollowPath.critics")
    )
    both = edited(tmp_path, f"[{critics}]", f'[{critics}, "ObstacleFootprint"]')
    place = locate_list(both, f"{DWB}.critics")
    for old, new in (("BaseObstacle", "ObstacleFootprint"), ("ObstacleFootprint", "BaseObstacle")):
        assert edited_list(both, place, ListEdit(replace={old: new})) == place.value


def test_dwb_samples_what_the_costmap_shows_and_the_smoother_passes() -> None:
    space = fit_space(
        *read_spaces([shipped("params") / "search_spaces" / "dwb_sampling.yaml"]), nav2("stock")
    )
    good = {**space.original, "sim_time": 1.4, "max_vel_theta": 1.5}
    assert space.allows(good), (
        "2.8 m of the 3 m that lie ahead; turns to the right pass at 1.5 rad/s"
    )
    assert not space.allows({**good, "sim_time": 1.6}) and not space.allows(
        {**good, "max_vel_theta": 1.6}
    )


def test_the_mpc_plans_no_turn_that_the_smoother_cuts() -> None:
    space = fit_space(
        *read_spaces([shipped("params") / "search_spaces" / "mpc_limits.yaml"]), nav2("mpc")
    )
    assert space.allows(space.original) and not space.allows(
        {**space.original, "max_yaw_rate": 1.3}
    )
