"""``navbench lint`` as a user meets it."""

import json
import os
import re
from pathlib import Path

import pytest

from harness.storage.shipped import shipped
from navbench.api.lint import robot_limits
from navbench.cli.app import main
from navstack.lint import lint
from navstack.params.nav2_file.file import load_nav2

ROBOT = (Path(__file__).parent / "lint" / "robot.yaml").read_text(encoding="utf-8")
MISSPELT = ROBOT.replace("decel_lim_theta:", "decel_lim_thetaa:")
FOLDER = os.environ.get("NAVSTACK_DATA")
REAL = sorted((Path(FOLDER) / "nav2_params").glob("*.yaml")) if FOLDER else []
KEYS = ["id", "path", "line", "message", "advice"]


@pytest.fixture
def run(capsys, tmp_path):
    """Status, standard output and standard error of ``navbench lint`` on a text."""

    def _run(text, *options):
        path = tmp_path / "robot.yaml"
        path.write_text(text)
        with pytest.raises(SystemExit) as leaving:
            main(["lint", str(path), *options])
        return leaving.value.code or 0, *capsys.readouterr()

    return _run


def test_a_good_file(run):
    status, out, err = run(ROBOT)
    assert (status, err) == (0, "")
    first, last = out.splitlines()
    assert "robot.yaml: 0 errors, 0 warnings, " in first
    assert last.startswith("next: navbench lint ") and last.endswith(" --full")
    _, out, _ = run(ROBOT, "--robot", "jackal")
    assert out.splitlines()[-1].endswith(" --robot jackal --full")


def test_errors_and_warnings_as_text(run):
    text = MISSPELT.replace("max_decel: [-2.5", "max_decel: [-1.0")
    status, out, err = run(text, "--strict")
    first, *found, _ = out.splitlines()
    assert status == 1 and "1 error, " in first and len(found) <= 23
    assert found[0].startswith("error, line ") and found[0].endswith("[misspelt-key]")
    (softer,) = (line for line in found if line.endswith(" [smoother-is-softer]"))
    assert "> max_decel: [-2.5, 0.0, -3.2]" in softer
    status, out, err = run(text, "--strict", "--full")
    assert status == 1
    assert err.count("\n") == 1
    assert "did you mean 'decel_lim_theta'?" in err
    assert (
        out.index("Errors")
        < out.index("misspelt-key")
        < out.index("Warnings")
        < out.index("smoother-is-softer")
    )
    assert "> max_decel: [-2.5, 0.0, -3.2]" in out


@pytest.mark.parametrize(
    "text",
    [
        "move_group:\n  ros__parameters:\n    robot_description: arm\n",
        "slam_toolbox:\n  ros__parameters:\n    mode: mapping\n",
        "/*/move_group:\n  ros__parameters:\n    use_sim_time: true\n",
    ],
)
def test_a_file_without_a_node_of_nav2_is_no_file_of_defaults(run, text):
    status, out, err = run(text)
    assert status == 1 and err.count("\n") == 1
    assert "no node of Nav2 in it, but '" in err
    assert out.splitlines()[1].startswith("error: no node of Nav2 in it")


def test_several_errors_are_counted_apart_from_the_first(run):
    text = ROBOT.replace("resolution: 0.05", "resolution: fine")
    status, out, err = run(text)
    assert status == 1 and "2 errors, " in out
    assert "'fine' is not a number (and 1 more); correct it" in err


def test_the_document(run):
    changed = MISSPELT.replace("smoothing_frequency: 20.0", "smoothing_frequency: 5.0")
    status, out, _ = run(changed, "--json", "--strict")
    document = json.loads(out)
    assert status == 1
    assert list(document) == ["errors", "warnings", "ignored", "releases"]
    (error,) = document["errors"]
    assert list(error) == KEYS
    assert (error["id"], error["path"]) == (
        "misspelt-key",
        "controller_server: FollowPath.decel_lim_thetaa",
    )
    assert "decel_lim_thetaa" in changed.splitlines()[error["line"] - 1]
    warnings = {each["id"]: each for each in document["warnings"]}
    assert warnings["smoother-is-slower"]["advice"] == "smoothing_frequency: 20.0"
    assert "amcl" in document["ignored"] or any(
        each.startswith("amcl: ") for each in document["ignored"]
    )


@pytest.mark.parametrize(
    ("kind", "text"),
    [
        ("misspelt-key", MISSPELT),
        (
            "unknown-key",
            ROBOT.replace("decel_lim_theta:", "wheel_diameter: 0.2\n      decel_lim_theta:"),
        ),
    ],
)
def test_a_name_that_nav2_lets_pass_is_a_warning_unless_strict(run, kind, text):
    status, out, err = run(text, "--json")
    assert (status, err) == (0, "")
    assert kind in {each["id"] for each in json.loads(out)["warnings"]}
    status, out, _ = run(text, "--json", "--strict")
    assert status == 1
    assert [each["id"] for each in json.loads(out)["errors"]] == [kind]


@pytest.mark.parametrize("text", ["amcl: [1,", "", "just words", "amcl:\n  alpha1: 2\n"])
def test_a_file_that_cannot_be_read_is_an_error_with_a_document(run, text):
    status, out, err = run(text, "--json")
    assert status == 1
    assert [each["id"] for each in json.loads(out)["errors"]] == ["unreadable-file"]
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["tunde"], 1, ("tunde", "did you mean 'tuned'")),
        (["no/such/file.yaml"], 1, ("no/such/file.yaml", "does not exist")),
        (["tuned", "--robot", "segwy"], 1, ("segwy", "segway_e1")),
        ([], 2, ("FILE",)),
    ],
)
def test_bad_arguments(capsys, arguments, code, words):
    with pytest.raises(SystemExit) as leaving:
        main(["lint", *arguments])
    assert leaving.value.code == code
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert all(word in err for word in words)


def test_a_robot_to_hold_the_file_against(run):
    status, out, _ = run(ROBOT, "--robot", "segway_e1", "--json")
    warnings = {each["id"]: each for each in json.loads(out)["warnings"]}
    assert status == 0
    assert "segway_e1 sticks out" in warnings["larger-than-footprint"]["message"]
    assert robot_limits("segway_e1").max_speed == pytest.approx(3.56)
    assert not {"larger-than-footprint", "faster-than-robot"} & {
        notice.id
        for notice in lint(
            load_nav2(shipped("params") / "nav2" / "tuned.yaml"), robot_limits("segway_e1")
        )
    }


# What is found in the real files, each looked at by hand; none is a false alarm.
EXPECTED = {
    r"ROBOTIS.*param_(burger|waffle)\.yaml": {"short-stop-zone", "hidden-slow-zone"},
    r"clearpath.*(_a200_|cleanup)": {"centre-only", "short-reach"},
    r"clearpath.*_w200_": {"short-reach"},
    r"clearpath.*_j100_": {"centre-only", "smoother-caps"},
    r"cyberbotics.*_epuck_": {"demanding-progress", "drowned-obstacles", "large-cells"},
    r"linorobot__humble__": {"flat-inflation", "never-cleared"},
}
READER = {"substitute", "renamed", "release", "duplicate", "unavailable-plugin"}


@pytest.mark.parametrize("path", REAL or [None], ids=lambda path: path.name if path else "none")
def test_real_files_have_no_errors_and_no_false_alarms(path):
    if path is None:
        pytest.skip("NAVSTACK_DATA is not set: no real Nav2 files here")
    expected = next((ids for name, ids in EXPECTED.items() if re.match(name, path.name)), set())
    notices = lint(load_nav2(path))
    assert not [str(notice) for notice in notices if notice.is_error]
    assert {notice.id for notice in notices} - READER == expected


def test_the_tutorials_file_has_nothing_to_warn_of():
    file = load_nav2(shipped("params") / "nav2" / "starter.yaml")
    assert [str(notice) for notice in lint(file, robot_limits("segway_e1"))] == []
