"""The command line as a user meets it: bad input ends in one clear line and the right status."""

import json
import math
import re
from pathlib import Path

import pytest

from harness.storage.shipped import shipped
from harness.study.preflight import file_notes
from navstack.params.nav2_file.file import load_nav2
from tests.command import status

FACTS = json.loads(
    (Path(__file__).parents[1] / "economics" / "facts.json").read_text(encoding="utf-8")
)
TUNED = (shipped("params") / "nav2" / "tuned.yaml").read_text(encoding="utf-8")
MAP = (
    "image: map.pgm\nresolution: 0.05\norigin: [0, 0, 0]\noccupied_thresh: 0.65\n"
    "free_thresh: 0.25\nnegate: 0\n"
)
PGM = b"P5 200 200 255\n" + bytes([254]) * 40_000


def complaint(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The one line on standard error of a command that must fail with status 1."""
    assert status(*arguments) == 1
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1, captured.err
    return captured.err


def run_with(folder: Path, **files: str | bytes) -> list[str]:
    """Write files and return the arguments of a short run that uses them."""
    for name, content in files.items():
        path = folder / name.replace("_", ".")
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
    arguments = ["run", "--episodes", "1", "--workers", "1", "--out", str(folder / "run")]
    if "map_yaml" in files:
        arguments += ["--map", str(folder / "map.yaml")]
    if "nav2_yaml" in files:
        arguments += ["--stack", str(folder / "nav2.yaml")]
    return arguments


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--episodes", "0"), ("--episodes 0", "give 1 to")),
        (("--episodes", "-3"), ("--episodes -3", "give 1 to")),
        (("--episodes", "many"), ("many", "integer")),
        (("--seed", "-1"), ("--seed -1", "0 to")),
        (("--seed", "99999999999999999999999"), ("out of range",)),
        (("--pedestrians", "-1"), ("--pedestrians -1", "0 to")),
        (("--workers", "0"), ("--workers 0", "at least 1")),
        (("--map", "sidewlak"), ("sidewlak", "sidewalk")),
        (("--map", "no/such/map.yaml"), ("no/such/map.yaml",)),
        (("--localizer", "gsp"), ("gsp", "ground_truth")),
        (("--robot", "segway"), ("segway", "segway_e1")),
        (("--prices", "costnva"), ("costnva", "did you mean 'costnav'")),
        (("--start", "1,2"), ("1,2", "x,y,yaw")),
        (("--goal", "a,b,c"), ("a,b,c", "x,y,yaw")),
        (("--record", "evnts"), ("evnts", "events")),
        (("--stack", "parked", "--stack", "parked"), ("parked", "more than once")),
    ],
)
def test_bad_options(
    capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], words: tuple[str, ...]
) -> None:
    line = complaint(capsys, "run", *arguments)
    assert all(word in line for word in words), line


@pytest.mark.parametrize(
    ("files", "words"),
    [
        ({"map_yaml": MAP}, ("map.pgm",)),
        ({"map_yaml": MAP, "map_pgm": b"P5 100 100 255\nshort"}, ("map.pgm",)),
        ({"map_yaml": MAP, "map_pgm": b"\x00\x01not an image"}, ("map.pgm",)),
        ({"map_yaml": MAP.replace("resolution: 0.05\n", ""), "map_pgm": PGM}, ("resolution",)),
        ({"map_yaml": "just a text"}, ("map.yaml",)),
        ({"map_yaml": MAP.replace("0.05", "-1"), "map_pgm": PGM}, ("resolution", "-1")),
        ({"nav2_yaml": "ros__parameters: [1, 2\n"}, ("nav2.yaml", "YAML")),
        (
            {"nav2_yaml": TUNED.replace("dwb_core::DWBLocalPlanner", "dwb_core::DWBLocalPlaner")},
            ("DWBLocalPlaner",),
        ),
        (
            {
                "nav2_yaml": TUNED.replace(
                    "controller_frequency: 30.0", "controller_frequency: fast"
                )
            },
            ("fast", "number"),
        ),
        ({"nav2_yaml": "title: x\nnavigater: nav2\n"}, ("navigater", "navigator")),
    ],
)
def test_bad_files(
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    files: dict[str, str | bytes],
    words: tuple[str, ...],
) -> None:
    line = complaint(capsys, *run_with(tmp_path, **files))
    assert all(word in line for word in words), line


def test_keys_that_nav2_does_not_know_are_told_in_one_line_and_refused_with_strict(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    text = TUNED.replace("max_vel_x:", "wheel_diameter: 0.2\n      max_vel_xx:")
    words = run_with(tmp_path, nav2_yaml=text)
    line = complaint(capsys, *words, "--strict")
    assert "wheel_diameter" in line and "max_vel_xx" in line
    line = complaint(capsys, *words, "--prices", "none")  # the file is not what is wrong
    assert "wheel_diameter" not in line
    (note,) = (
        each
        for each in file_notes(load_nav2(tmp_path / "nav2.yaml", True))
        if "does not know" in each
    )
    assert (
        "does not know 2 of the names" in note
        and "did you mean 'max_vel_x'" in note
        and "wheel" not in note
    )


@pytest.mark.parametrize("option", ["--start", "--goal"])
def test_a_pose_in_an_obstacle_names_the_nearest_free_cell(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, option: str
) -> None:
    pixels = bytearray(PGM)
    header = len(PGM) - 40_000
    for row in range(80, 120):
        pixels[header + row * 200 + 80 : header + row * 200 + 120] = bytes(40)
    line = complaint(
        capsys,
        *run_with(tmp_path, map_yaml=MAP, map_pgm=bytes(pixels)),
        "--pedestrians",
        "0",
        option,
        "5,5,0",
    )
    assert option.strip("-") in line
    assert "nearest free" in line


def test_a_start_whose_footprint_reaches_into_a_wall(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    pixels = bytearray(PGM)
    header = len(PGM) - 40_000
    for row in range(200):
        pixels[header + row * 200 : header + row * 200 + 20] = bytes(20)  # a wall 1 m thick
    arguments = run_with(tmp_path, map_yaml=MAP, map_pgm=bytes(pixels))
    line = complaint(capsys, *arguments, "--pedestrians", "0", "--start", "1.2,5,1.57")
    assert "footprint" in line


def test_a_folder_that_cannot_be_written(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("")
    assert (
        status(
            "run", "--stack", "parked", "--episodes", "1", "--out", str(tmp_path / "file" / "run")
        )
        == 1
    )
    assert "cannot be written" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "words"), [(["rnu"], "run"), (["run", "--epsiodes", "3"], "--episodes")]
)
def test_unknown_names_are_status_2(
    capsys: pytest.CaptureFixture[str], arguments: list[str], words: str
) -> None:
    assert status(*arguments) == 2
    assert words in capsys.readouterr().err


def test_help_opens_with_examples(capsys: pytest.CaptureFixture[str]) -> None:
    assert status("--help") == 0
    shown = capsys.readouterr().out
    assert shown.index("navbench run --stack nav2-gps") < shown.index("Options:")


def test_paper_prints_one_json_document(capsys: pytest.CaptureFixture[str]) -> None:
    assert status("paper", "--json") == 0
    document = json.loads(capsys.readouterr().out)
    columns = {name: method["economics"] for name, method in document["methods"].items()}
    assert set(columns) == set(FACTS["economics_usd_per_run"])
    columns["real"] = document["real_world_canvas"]["economics"]
    published = {**FACTS["economics_usd_per_run"], "real": FACTS["real_world_canvas_economics"]}
    for name, expected in published.items():
        for key, value in expected.items():
            if value is None:
                assert columns[name][key] is None, (name, key)
            else:
                assert math.isclose(columns[name][key], value, rel_tol=1e-9), (name, key)


def test_a_world_is_found_by_each_of_its_names(capsys: pytest.CaptureFixture[str]) -> None:
    for name in ("costnav", "published_3", "paper_loose_bucket", "measured"):
        assert status("run", "--world", name, "--missions", "far") == 1, "for the missions"
        (error,) = capsys.readouterr().err.splitlines()
        assert "'far'" in error


@pytest.mark.parametrize(
    ("command", "told"),
    [
        ("run --stack {}", "unknown stack"),
        ("run --world {}", "unknown world"),
        ("report {} --out x.html", "File name too long"),
        ("verify {}", "File name too long"),
        ("lint {}.yaml", "Nav2 file"),
    ],
)
def test_a_name_that_no_file_can_have_is_one_line(
    capsys: pytest.CaptureFixture[str], command: str, told: str
) -> None:
    assert told in complaint(capsys, *command.format("a" * 300).split())


def test_a_link_to_itself_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    assert "loop" in complaint(capsys, "ablate", "--resume", str(tmp_path / "loop"))


@pytest.mark.parametrize(
    ("name", "value", "told"),
    [
        ("footprint_padding", "1.0e+308", "1e+308 must be -1e+09 to 1e+09"),
        ("cost_scaling_factor", ".inf", "inf is out of range; at most 1e+09 is allowed"),
    ],
)
def test_numbers_beyond_all_measure_are_errors(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, value: str, told: str
) -> None:
    (tmp_path / "nav2.yaml").write_text(re.sub(rf"{name}: \S+", f"{name}: {value}", TUNED))
    assert status("lint", str(tmp_path / "nav2.yaml")) == 1
    assert f"{name} {told}" in "".join(capsys.readouterr())


def test_of_wrong_options_the_best_fitting_one_comes_first(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert status("run", "--worker", "2") == 2
    assert "'--worker'; did you mean --workers? (or --world, --force)" in capsys.readouterr().err
    assert status("run", "--zzzz") == 2
    assert "No such option '--zzzz'. See 'navbench run --help'." in capsys.readouterr().err


def test_of_many_names_the_nearest_eight_are_told_and_who_shows_all(
    capsys: pytest.CaptureFixture[str],
) -> None:
    line = complaint(capsys, "run", "--stack", "nav2-gsp")
    assert "did you mean 'nav2-gps'" in line
    assert line.rstrip().endswith("; navbench list stacks --all shows all")
    nearest = line.partition("nearest: ")[2].partition(";")[0].split(", ")
    assert len(nearest) == 8 and nearest[0] == "nav2-gps"
    assert "navbench list stacks --all" in complaint(capsys, "run", "--stack", "none.yaml")
    assert "known: barn, easy, " in complaint(capsys, "run", "--world", "esay")


def test_a_folder_in_place_of_a_map_is_told_what_a_map_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    line = complaint(capsys, "run", "--map", str(tmp_path))
    assert f"map '{tmp_path}' is a folder; give the YAML file that map_server's map_saver" in line
    (tmp_path / "nav2.yaml").write_text("amcl: {}")
    (tmp_path / "ward.yaml").write_text(MAP)
    assert f"is a folder; give its file {tmp_path / 'ward.yaml'}" in complaint(
        capsys, "run", "--map", str(tmp_path)
    )
