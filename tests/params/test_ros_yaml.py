import math

import pytest

from navstack.errors import ParameterError
from navstack.params.nav2_file.ros_yaml import (
    MAX_BYTES,
    load_document,
    parse_document,
    parse_scalar,
)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("yes", True),
        ("Off", False),
        ("y", True),
        ("NO", False),
        ("0x1F", 31),
        ("010", 8),
        ("08", 8.0),
        ("-3", -3),
        ("1e-10", 1e-10),
        ("1.", 1.0),
        (".5", 0.5),
        ("6e9", 6e9),
        ("6000000000", 6_000_000_000),
        ("99999999999999999999", 1e20),
        ("9223372036854775807", 2**63 - 1),
        ("9223372036854775808", 2.0**63),
        ("-9223372036854775808", -(2**63)),
        ("-9223372036854775809", -(2.0**63)),
        (".inf", math.inf),
        ("-.INF", -math.inf),
        ("1_000", "1_000"),
        ("12:30", "12:30"),
        ("dwb_core::DWBLocalPlanner", "dwb_core::DWBLocalPlanner"),
    ],
)
def test_scalars_read_as_rcl_reads_them(text, value):
    read = parse_scalar(text)
    assert read == value
    assert type(read) is type(value)


def test_quoted_scalars_stay_texts():
    assert parse_scalar("5", quoted=True) == "5"
    entries = (
        parse_document('a: {ros__parameters: {p: "yes", q: yes, r: [1.0, 2]}}', "f")
        .nodes[0]
        .entries
    )
    assert entries["p"].value == "yes"
    assert entries["q"].value is True
    assert entries["r"].value == [1.0, 2]


def test_dotted_and_nested_names_are_the_same():
    dotted = (
        parse_document("n:\n  ros__parameters:\n    a.b.c: 1\n    a.d: 2\n", "f").nodes[0].entries
    )
    nested = (
        parse_document("n:\n  ros__parameters:\n    a:\n      b: {c: 1}\n      d: 2\n", "f")
        .nodes[0]
        .entries
    )
    assert (
        {k: v.value for k, v in dotted.items()}
        == {k: v.value for k, v in nested.items()}
        == {"a.b.c": 1, "a.d": 2}
    )


def test_duplicates_last_one_wins_across_both_spellings():
    document = parse_document(
        "n:\n  ros__parameters:\n    p: 1\n    p: 2\n    a.b: 3\n    a: {b: 4}\n", "f"
    )
    entries = document.nodes[0].entries
    assert (entries["p"].value, entries["a.b"].value) == (2, 4)
    assert [(kind, line) for kind, line, _ in document.remarks] == [
        ("duplicate", 4),
        ("duplicate", 6),
    ]
    assert "n: p is given twice, in lines 3 and 4" in document.remarks[0][2]


def test_aliases_and_merge_keys_are_resolved_with_a_remark():
    text = "n:\n  ros__parameters:\n    a: &a {x: 1, y: 2}\n    b: {<<: *a, y: 3}\n"
    document = parse_document(text, "f")
    assert {k: v.value for k, v in document.nodes[0].entries.items()} == {
        "a.x": 1,
        "a.y": 2,
        "b.x": 1,
        "b.y": 3,
    }
    assert {kind for kind, _, _ in document.remarks} == {"alias"}


def _bomb():
    levels = [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 12)]
    return "n: {ros__parameters: {a0: &a0 [1, 1], " + ", ".join(levels) + "}}"


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("", "is empty"),
        ("# only a comment\n", "is empty"),
        ("- 1\n- 2\n", "a mapping of nodes"),
        ("just words", "a mapping of nodes"),
        ("a: [1,", "not valid YAML"),
        ("a:\n\tb: 1\n", "line 2 is not valid YAML: a tab stands where"),
        ("a: \x00", "not valid YAML"),
        ("a: &x\n  b: *x\n", "contains itself"),
        ("a: {ros__parameters: {q: &x [1, *x]}}", "contains itself"),
        (_bomb(), "after expanding aliases"),
        ("[" * 5000, "nested too deeply"),
        ("a: " + "{a: " * 5000, "nested too deeply"),
        ("amcl:\n  ros_parameters:\n    alpha1: 2\n", "did you mean 'ros__parameters'?"),
        ("amcl:\n  alpha1: 2\n", "line 2: 'amcl.alpha1' stands outside ros__parameters"),
        ("ros__parameters:\n  alpha1: 2\n", "without a node name"),
        ("amcl:\n  ros__parameters: [1]\n", "is not a mapping"),
        ("a:\n  ros__parameters:\n    b: [{c: 1}]\n", "list of mappings"),
        ("a: {ros__parameters: {? [1] : 2}}", "a name is expected"),
        ("---\na: 1\n---\nb: 2\n", "not valid YAML"),
    ],
)
def test_malformed_text_is_one_clear_line(text, part):
    with pytest.raises(ParameterError) as error:
        parse_document(text, "robot.yaml")
    message = str(error.value)
    assert message.startswith("robot.yaml: ")
    assert part in message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("b: 0.26\t# m/s\nc:\t1", {"b": 0.26, "c": 1}),
        ("b:\t\nc: 'x\ty'\t\nd: x\ty \t", {"c": "x\ty", "d": "x\ty"}),
        ("b: [1\t,\t2\t]\t# two\r\nc: [3,\n\t4]", {"b": [1, 2], "c": [3, 4]}),
        ("b: x\n   y\t# of two lines", {"b": "x y"}),
    ],
)
def test_tabs_between_the_words_of_a_line_are_read_as_libyaml_reads_them(text, values):
    indented = text.replace("\n", "\n    ")
    document = parse_document(f"a:\t# node\n  ros__parameters:\n    {indented}\n", "f")
    assert {name: entry.value for name, entry in document.nodes[0].entries.items()} == values


@pytest.mark.parametrize("text", ["b: 1\n\tc: 2", "b:\n    -\t1", "b: 1\n\t# x\n    c: 2"])
def test_tabs_that_indent_are_refused_as_libyaml_refuses_them(text):
    with pytest.raises(ParameterError, match="indent with spaces"):
        parse_document(f"a:\n  ros__parameters:\n    {text}\n", "f")


def test_unusable_files_are_one_clear_line(tmp_path):
    binary, huge = tmp_path / "binary.yaml", tmp_path / "huge.yaml"
    binary.write_bytes(bytes(range(256)))
    huge.write_text("#" * (MAX_BYTES + 1))
    for path, part in (
        (binary, "not a text file in UTF-8"),
        (huge, "at most"),
        (tmp_path / "none.yaml", "cannot be read"),
    ):
        with pytest.raises(ParameterError, match=part):
            load_document(path)


def test_empty_values_are_remarked():
    document = parse_document(
        "amcl:\n  ros__parameters:\n    alpha1:\n    alpha2: 0.1\nmap_server:\n", "f"
    )
    assert [line for kind, line, _ in document.remarks if kind == "empty"] == [3, 5]
    assert list(document.nodes[0].entries) == ["alpha2"]


def test_what_ros_refuses_a_file_for_is_remarked():
    text = (
        "robot-1/n:\n  ros__parameters:\n    a: []\n    b: {}\n    c: [0.1, 0, 1.0]\n"
        "    d: [1, 2]\n"
    )
    document = parse_document(text, "f")
    assert [(kind, line) for kind, line, _ in document.remarks] == [
        ("node-name", 1),
        ("empty", 3),
        ("empty", 4),
        ("mixed-list", 5),
    ]
    assert document.nodes[0].entries["a"].value == []
    names = "<robot_namespace>:\n  /**/n_$(var id):\n    ros__parameters: {a: 1}\n"
    names += "m:\n  ros__parameters: {a: [$(var vmax), 0.0, 1.0]}\n"
    assert not parse_document(names, "f").remarks
