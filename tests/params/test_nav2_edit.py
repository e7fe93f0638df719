import os
from difflib import unified_diff
from pathlib import Path

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from navstack.errors import ParameterError
from navstack.params.nav2_file.edit import format_value, set_value, set_values
from navstack.params.nav2_file.file import inspect_nav2, load_nav2
from navstack.params.nav2_file.ros_yaml import parse_document
from navstack.params.nav2_file.views import read_costmap, read_dwb, read_velocity_smoother

SHIPPED = sorted((Path(__file__).parents[2] / "params" / "nav2").glob("*.yaml"))
TUNED = next(path for path in SHIPPED if path.name == "tuned.yaml")
FOLDER = os.environ.get("NAVSTACK_DATA")
REAL = sorted((Path(FOLDER) / "nav2_params").glob("*.yaml")) if FOLDER else []


def changed_lines(before, after):
    return [line for line in after.splitlines() if line not in before.splitlines()]


def test_a_changed_value_is_the_only_changed_line():
    nav2 = load_nav2(TUNED)
    after = nav2.with_values(
        {"controller_server.FollowPath.max_vel_x": 2, "velocity_smoother.max_velocity": [2, 0, 1]}
    )
    assert read_dwb(after).max_vel_x == 2.0
    assert read_velocity_smoother(after).max_velocity == (2.0, 0.0, 1.0)
    assert changed_lines(nav2.document.text, after.document.text) == [
        "      max_vel_x: 2.0",
        "    max_velocity: [2.0, 0.0, 1.0]",
    ]
    assert read_dwb(nav2).max_vel_x == 3.0  # the original is unchanged


def test_line_ends_of_other_systems_are_kept(tmp_path):
    path = tmp_path / "robot.yaml"
    path.write_bytes(
        b"amcl:\r\n  ros__parameters:\r\n    alpha1: 0.1  # odometry\r\n    alpha2: 0.2\r\n"
    )
    nav2 = load_nav2(path)
    nav2.with_values({"amcl.alpha1": 0.3}).dump(path)
    assert path.read_bytes() == nav2.document.text.replace("0.1", "0.3").encode()
    assert path.read_bytes().count(b"\r\n") == 4


def test_added_lines_end_as_the_others(tmp_path):
    path = tmp_path / "robot.yaml"
    path.write_bytes(b"amcl:\r\n  ros__parameters:\r\n    alpha1: 0.1  # odometry\r\n")
    nav2 = load_nav2(path).with_values(
        {"amcl.alpha2": 0.3, "velocity_smoother.velocity_timeout": 2.0}
    )
    assert nav2.document.text.count("\n") == nav2.document.text.count("\r\n") == 8
    assert "\r\r" not in nav2.document.text
    assert nav2.value("amcl", "alpha2") == 0.3


def test_comments_between_entries_of_a_list_stay():
    text = (
        "n:\n  ros__parameters:\n    v:  # all\n      - 2.0  # forward\n      - 0\n"
        "    # turning\n      - 1.5\n"
    )
    after = set_value(text, ("n",), "v", [2.0, 0, 1], "here")
    assert after == text.replace("1.5", "1.0").replace("- 0\n", "- 0.0\n")
    assert "[1.0]" in set_value(text, ("n",), "v", [1.0], "here")


BLOCK = """\
controller_server:
  ros__parameters:
    FollowPath:
      critics :  # * of ours
        # turns first
        - "RotateToGoal"
        - GoalDist  # the last
      max_vel_x: 0.5
"""


def test_names_added_to_a_list_leave_its_comments():
    node, name = ("controller_server",), "FollowPath.critics"
    added = set_value(BLOCK, node, name, ["RotateToGoal", "GoalDist", "Oscillation", "X"], "f")
    lines = ['        - "Oscillation"', '        - "X"']
    assert added.splitlines() == [*BLOCK.splitlines()[:-1], *lines, BLOCK.splitlines()[-1]]
    changed = set_value(added, node, name, ["RotateToGoal", "PathDist", "Oscillation", "X"], "f")
    assert changed == added.replace("GoalDist", '"PathDist"')
    both = set_values(BLOCK, [(node, "FollowPath.a", 1), (node, name, ["A", "B", "C"])], "f")
    (text,) = parse_document(both, "f").nodes
    assert text.entries[name].value == ["A", "B", "C"] and text.entries["FollowPath.a"].value == 1
    flow = BLOCK[: BLOCK.index(" :")] + ': ["A", B]  # two\n'
    assert set_value(flow, node, name, ["A", "B", "C"], "f") == flow.replace("B]", 'B, "C"]')
    assert set_value(flow, node, name, ["C"], "f") == flow.replace('["A", B]', '["C"]')


def test_a_list_of_whole_numbers_becomes_decimal_as_one():
    """ROS refuses a file with a list of both."""
    text = "velocity_smoother:\n  ros__parameters:\n    max_velocity: [1, 0, 2]  # fast\n"
    node, name = ("velocity_smoother",), "max_velocity"
    assert "[0.8, 0.0, 2.0]  # fast" in set_value(text, node, name, [0.8, 0, 2], "f")
    assert "[3, 0, 2]  # fast" in set_value(text, node, name, [3, 0, 2], "f")


def test_a_node_is_added_before_the_end_of_the_document():
    text = "a:\n  ros__parameters:\n    b: 1\n...\n"
    after = set_value(text, ("c",), "d", 2, "f")
    assert after == text.replace("...", "\nc:\n  ros__parameters:\n    d: 2\n...")


@pytest.mark.parametrize(
    ("text", "added"),
    [
        ("robot1:\n  controller_server:\n    ros__parameters:\n      a: 1\n", "/robot1/"),
        ("/robot1/controller_server:\n  ros__parameters:\n    a: 1\n", "/robot1/"),
        ("/**:\n  controller_server:\n    ros__parameters:\n      a: 1\n", "/**/"),
        ("controller_server:\n  ros__parameters:\n    a: 1\n", ""),
        ("<robot>:\n  controller_server:\n    ros__parameters:\n      a: 1\n", "<robot>/"),
    ],
)
def test_a_new_node_joins_the_namespace_of_the_others(tmp_path, text, added):
    path = tmp_path / "nav2.yaml"
    path.write_text(text)
    nav2 = inspect_nav2(path, allow_unknown=True)
    after = nav2.with_values({"velocity_smoother.max_velocity": [0.8, 0.0, 2.5]}, True)
    assert f"\n{added}velocity_smoother:\n  ros__parameters:\n" in after.document.text
    assert after.value("velocity_smoother", "max_velocity") == [0.8, 0.0, 2.5]
    costmap = nav2.with_values({"local_costmap.width": 3}, True)
    assert costmap.value("local_costmap", "width") == 3
    if added == "/**/":
        assert "\n/**/local_costmap:\n  ros__parameters:\n" in costmap.document.text
    own = nav2.with_values({"controller_server.b": 2}, True)
    assert own.document.text.count("ros__parameters") == 1, "it goes to the section that is there"


def test_an_anchored_value_is_refused():
    text = "n:\n  ros__parameters:\n    a: &one 2.0\n    b: *one\n"
    for name, said in (("a", "a has a YAML anchor"), ("b", "b is a YAML alias")):
        with pytest.raises(ParameterError, match=said):
            set_value(text, ("n",), name, 3.0, "here")


def test_a_value_that_several_nodes_read_is_changed_for_one(inspect):
    """The inflation of both costmaps stands in one section."""
    nav2 = inspect(
        "/**:\n  ros__parameters:\n    plugins: [inflation_layer]\n    inflation_layer:\n"
        '      plugin: "nav2_costmap_2d::InflationLayer"\n      inflation_radius: 0.55\n'
    )
    radius = "inflation_layer.inflation_radius"
    local, both = {f"local_costmap.{radius}": 0.4}, {f"global_costmap.{radius}": 1.5}
    after = nav2.with_values(local)
    assert after.value("local_costmap", radius) == 0.4
    assert after.value("global_costmap", radius) == 0.55
    after = nav2.with_values(local | both)
    assert after.value("local_costmap", radius) == 0.4
    assert after.value("global_costmap", radius) == 1.5
    own = inspect(
        f"local_costmap: {{local_costmap: {{ros__parameters: {{}}}}}}\n{nav2.document.text}"
    )
    changed = own.with_values(local)
    assert changed.value("local_costmap", radius) == 0.4


@pytest.mark.parametrize(
    "second", ["b:\n  ros__parameters: *c\n", "b:\n  ros__parameters:\n    <<: *c\n"]
)
def test_a_value_in_a_section_that_an_alias_shares_is_refused(second):
    text = f"a:\n  ros__parameters: &c\n    r: 1.0\n{second}"
    for node in ("a", "b"):
        with pytest.raises(ParameterError, match="line 3: r is shared by a YAML alias"):
            set_value(text, (node,), "r", 2.0, "here")


def test_small_numbers_are_numbers_to_other_readers_too():
    for value in (1e-5, -2.5e-7, 1e16, 3.0):
        assert yaml.safe_load(format_value(value)) == value


def test_absent_parameters_are_added_in_their_namespace(inspect):
    nav2 = inspect(
        "controller_server:\n  ros__parameters:\n    FollowPath:\n      max_vel_x: 1.0  # [m/s]\n"
        "local_costmap: {local_costmap: {ros__parameters: {width: 3}}}"
    )
    after = nav2.with_values(
        {
            "controller_server.FollowPath.PathAlign.scale": 2.0,
            "controller_server.controller_frequency": 30.0,
            "local_costmap.robot_radius": 0.4,
            "global_costmap.robot_radius": 0.5,
            "velocity_smoother.feedback": "CLOSED_LOOP",
        }
    )
    assert (
        "      max_vel_x: 1.0  # [m/s]\n      PathAlign.scale: 2.0\n"
        "    controller_frequency: 30.0\n" in after.document.text
    )
    assert read_dwb(after).PathAlign.scale == 2.0
    assert after.value("controller_server", "controller_frequency") == 30.0
    assert read_costmap(after, "local_costmap").robot_radius == 0.4
    assert read_costmap(after, "global_costmap").robot_radius == 0.5
    assert read_velocity_smoother(after).feedback == "CLOSED_LOOP"
    assert not after.errors


def entries_by_node(text):
    return {
        node.path: {name: e.value for name, e in node.entries.items()}
        for node in parse_document(text, "f").nodes
    }


@pytest.mark.parametrize(
    "path", [*SHIPPED, *(REAL or [None])], ids=lambda path: path.name if path else "real files"
)
def test_a_parameter_can_be_added_to_every_section_of_a_file(path):
    if path is None:
        pytest.skip("NAVSTACK_DATA is not set: no real Nav2 files here")
    text = path.read_text()
    expected = entries_by_node(text)
    changes = []
    for node, entries in expected.items():
        sections = {name[: i + 1] for name in entries for i, char in enumerate(name) if char == "."}
        changes += [(node, f"{section}added_here", 1.5) for section in ("", *sorted(sections))]
        entries |= {name: value for each, name, value in changes if each == node}
    after = set_values(text, changes, path.name)
    assert entries_by_node(after) == expected
    assert [line for line in after.splitlines() if "added_here" not in line] == text.splitlines()


def test_lines_added_at_one_place_go_to_their_sections_in_the_order_given():
    text = "n:\n  ros__parameters:\n    a:\n      b:\n        c: 1\nm:\n  ros__parameters: {d: 1}\n"
    names = ["x", "a.x", "a.b.x", "a.b.y", "a.y", "y"]
    after = set_values(
        text, [*((("n",), name, 2) for name in names), (("m",), "x", 2), (("m",), "d", 3)], "f"
    )
    nested = (
        "      b:\n        c: 1\n        x: 2\n        y: 2\n      x: 2\n      y: 2\n    x: 2\n"
        "    y: 2\n"
    )
    assert (
        after == f"n:\n  ros__parameters:\n    a:\n{nested}m:\n  ros__parameters: {{x: 2, d: 3}}\n"
    )


def test_a_line_added_behind_a_block_list_stays_in_its_section():
    head = (
        "controller_server:\n  ros__parameters:\n    FollowPath:\n      critics:\n"
        "      - PathDist\n      - GoalDist"
    )
    tail = "\n\n    # at the goal\n    goal_checker:\n      stateful: true\n"
    after = set_value(head + tail, ("controller_server",), "FollowPath.max_vel_x", 0.5, "f")
    assert after == f"{head}\n      max_vel_x: 0.5{tail}"


@pytest.mark.parametrize("style", ["|", ">-"])
def test_the_line_end_behind_a_text_block_stays(style):
    text = f"n:\n  ros__parameters:\n    a: {style}\n      one\n      two\n\n    # next\n    b: 1\n"
    after = set_value(text, ("n",), "a", "three", "f")
    assert after == 'n:\n  ros__parameters:\n    a: "three"\n\n    # next\n    b: 1\n'
    without_b = text.replace("    b: 1\n", "")
    assert entries_by_node(set_value(without_b, ("n",), "c", 2, "f"))[("n",)]["c"] == 2


def test_a_value_added_within_braces_is_not_swallowed_by_a_comment():
    text = "n:\n  ros__parameters: {\n    a: 1,  # first\n    b: 2  # second\n  }\n"
    assert entries_by_node(set_value(text, ("n",), "c", 3, "f")) == {
        ("n",): {"a": 1, "b": 2, "c": 3}
    }


def test_a_value_added_beside_an_alias_stays_in_its_section():
    text = "m:\n  ros__parameters:\n    s: &one {a: 1}\nn:\n  ros__parameters:\n    s: *one\n"
    after = entries_by_node(set_value(text, ("n",), "s.b", 2, "f"))
    assert after == {("m",): {"s.a": 1}, ("n",): {"s.a": 1, "s.b": 2}}


def test_the_last_of_two_duplicates_is_changed(inspect):
    nav2 = inspect("amcl:\n  ros__parameters:\n    alpha1: 0.1\n    alpha1: 0.2\n")
    assert nav2.with_values({"amcl.alpha1": 0.3}).document.text.endswith(
        "    alpha1: 0.1\n    alpha1: 0.3\n"
    )


def test_a_value_behind_an_alias_is_not_changed(inspect):
    nav2 = inspect(
        "amcl:\n  ros__parameters:\n    alpha1: &noise 0.1\n    alpha2: *noise\n    alpha3: 0.3\n"
    )
    with pytest.raises(ParameterError, match="line 4: alpha2 is a YAML alias"):
        nav2.with_values({"amcl.alpha2": 0.2})
    assert nav2.with_values({"amcl.alpha3": 0.2}).value("amcl", "alpha3") == 0.2


def test_misspelt_changes_are_refused():
    nav2 = load_nav2(TUNED)
    with pytest.raises(ParameterError, match="did you mean 'max_vel_x'"):
        nav2.with_values({"controller_server.FollowPath.max_vel_xx": 1.0})
    with pytest.raises(ParameterError, match=r"is not node\.parameter"):
        nav2.with_values({"max_vel_x": 1.0})


SCALARS = st.one_of(
    st.booleans(),
    st.integers(-(2**31), 2**31),
    st.floats(allow_nan=False, width=64),
    st.text(st.characters(codec="utf-8", exclude_categories=("Cc", "Cs")), max_size=12),
)
NAMES = st.lists(
    st.sampled_from("alpha beta gamma delta eps zeta eta theta".split()),
    min_size=1,
    max_size=6,
    unique=True,
)
COMMENTS = st.sampled_from(["", "  # by hand", " # 0.5 was too fast: [a, b]"])
SPACINGS = st.sampled_from(["", "\n", "    # what follows is tuned\n", "\n  # off: 1\n\n"])


@st.composite
def files(draw):
    """A file of one node, and the names in it.

    It has nested, dotted and flow namespaces, comments and blank lines.
    """
    text, names = "amcl:  # the node\n  ros__parameters:\n", []
    for name in draw(NAMES):
        text += draw(SPACINGS)
        style = draw(st.sampled_from(["plain", "dotted", "nested", "flow", "list", "block list"]))
        value, comment = format_value(draw(SCALARS)), draw(COMMENTS)
        key, body = {
            "plain": (name, f"{name}: {value}{comment}"),
            "dotted": (f"{name}.inner", f"{name}.inner: {value}{comment}"),
            "nested": (f"{name}.inner", f"{name}:\n      inner: {value}{comment}\n      other: 1"),
            "flow": (f"{name}.inner", f"{name}: {{other: [1, 2], inner: {value}}}{comment}"),
            "list": (name, f"{name}: [{value}, 1.0]{comment}"),
            "block list": (name, f"{name}:\n    - {value}"),
        }[style]
        text += f"    {body}\n"
        names.append(key)
    return text + draw(SPACINGS), names


@settings(max_examples=150, deadline=None)
@given(files(), SCALARS, st.data())
def test_one_changed_value_is_one_changed_line(file, value, data):
    text, names = file
    name = data.draw(st.sampled_from(names))
    after = set_value(text, ("amcl",), name, value, "f")
    before_entries, entries = (parse_document(each, "f").nodes[0].entries for each in (text, after))
    assert list(entries) == list(before_entries)
    assert {key: entry.value for key, entry in entries.items() if key != name} == {
        key: entry.value for key, entry in before_entries.items() if key != name
    }
    was_decimal = isinstance(before_entries[name].value, float)
    expected = float(value) if was_decimal and type(value) is int else value
    assert (entries[name].value, type(entries[name].value)) == (expected, type(expected))
    removed, added = (_lines(text, after, sign) for sign in "-+")
    # a block list becomes one line
    assert len(added) == len(removed) <= 1 or (len(removed), len(added)) == (2, 1)


@settings(max_examples=100, deadline=None)
@given(files(), st.sampled_from(["new", "alpha.new", "beta.inner.new"]), SCALARS)
def test_an_added_value_is_one_added_line(file, name, value):
    text, _ = file
    after = set_value(text, ("amcl",), name, value, "f")
    assert parse_document(after, "f").nodes[0].entries[name].value == value
    removed, added = (_lines(text, after, sign) for sign in "-+")
    assert (len(removed), len(added)) in ((0, 1), (1, 1))  # within { } its line changes


def _lines(before, after, sign):
    differences = unified_diff(before.split("\n"), after.split("\n"), n=0, lineterm="")
    return [line for line in differences if line.startswith(sign) and not line.startswith(sign * 3)]
