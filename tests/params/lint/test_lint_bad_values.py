"""What the linter says of a file with a value that cannot be read."""

from pathlib import Path

import pytest

from navstack.lint import lint

ROBOT = (Path(__file__).parent / "robot.yaml").read_text(encoding="utf-8")


@pytest.mark.parametrize("value", ['"2,0"', "true", "[2.0]"])
@pytest.mark.parametrize("name", ["max_vel_x", "max_obstacle_height", "controller_frequency"])
def test_no_rule_takes_a_default_for_the_value_that_cannot_be_read(inspect, name, value):
    head, key, tail = ROBOT.partition(f"{name}: ")
    number = tail.split()[0].rstrip("},")
    text = f"{head}{key}{value}{tail.removeprefix(number)}"
    nav2 = inspect(text, allow_unknown=True)
    about = [notice for notice in lint(nav2) if notice.path.endswith(name)]
    assert [notice.id for notice in about] == ["bad-value"]


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ("Laserscan", "'Laserscan' is neither LaserScan nor PointCloud2"),
        ("PointCloud", "did you mean 'PointCloud2'?"),
        ("[LaserScan]", "['LaserScan'] is neither"),
        ("2.5", "2.5 is neither"),
    ],
)
def test_a_source_of_a_type_that_nav2_refuses_is_an_error(inspect, value, said):
    text = ROBOT.replace("data_type: LaserScan", f"data_type: {value}")
    (notice,) = [each for each in lint(inspect(text, allow_unknown=True)) if each.is_error]
    assert (notice.id, notice.line) == ("bad-value", 47)
    assert notice.path == "local_costmap: obstacle_layer.scan.data_type"
    assert said in notice.message


def test_a_footprint_with_a_line_end_is_told_in_one_line(inspect):
    folded = "footprint: >\n        [[0.3, 0.2], [0.3, -0.2],\n        [-0.3, 0.0]]\n"
    text = ROBOT.replace("robot_radius: 0.22", folded, 1)
    notices = lint(inspect(text, allow_unknown=True))
    (notice,) = [each for each in notices if each.id == "unreadable-footprint"]
    assert "[-0.3, 0.0]]\\n' is not a list" in notice.message and "\n" not in notice.message
