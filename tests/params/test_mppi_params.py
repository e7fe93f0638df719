"""MPPI's parameters: what is refused, with one finding that names the line and what is allowed."""

import pytest

from navstack.errors import ParameterError
from navstack.lint import lint
from navstack.params.mppi import CRITICS
from navstack.params.nav2_file.file import inspect_nav2, load_nav2

FILE = """controller_server:
  ros__parameters:
    FollowPath:
      plugin: "nav2_mppi_controller::MPPIController"
      critics: ["ConstraintCritic", "CostCritic"]
      CHANGED
"""
LIST = '["ConstraintCritic", "CostCritic"]'


@pytest.fixture
def with_line(tmp_path):
    """The path of a file with one more line."""

    def _with_line(line, critics=LIST):
        path = tmp_path / "robot.yaml"
        path.write_text(FILE.replace("CHANGED", line).replace(LIST, critics))
        return path

    return _with_line


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("temperature: 1.0e-300", "temperature 1e-300 must be 1e-06 to 1e+06"),
        ("temperature: .inf", "temperature inf must be 1e-06 to 1e+06"),
        ("temperature: .nan", "nan is not a number"),
        ("gamma: .inf", "gamma inf must be 0 to 1000"),
        ("reset_period: .inf", "reset_period inf must be"),
        ("vx_min: -.inf", "vx_min -inf must be"),
        ("vx_std: 1.0e-30", "vx_std 1e-30 must be 0.001 to 1000"),
        ("model_dt: 1.5", "model_dt 1.5 must be 0.001 to 1"),
        ("prune_distance: 0.0", "prune_distance 0.0 must be 0.01 to 10000"),
        ("ax_max: 0.0", "ax_max 0.0 must be 0.001 to 1000"),
        ("ax_min: 0.0", "ax_min 0.0 must be 0.001 to 1000, either sign"),
        ("az_max: 0.0", "az_max 0.0 must be 0.001 to 1000"),
        (
            "iteration_count: 100",
            "1,000 x time_steps 56 x iteration_count 100 are 5,600,000 poses; at most 4,000,000",
        ),
        ("retry_attempt_limit: 1000000", "retry_attempt_limit 1000000 must be 0 to 100"),
        ("AckermannConstraints: {min_turning_r: .inf}", "min_turning_r inf must be 0 to 10000"),
        ("ConstraintCritic.cost_power: -1", "cost_power -1 must be 0 to 10"),
        ("ConstraintCritic: {cost_power: 500}", "cost_power 500 must be 0 to 10"),
        ("ConstraintCritic.cost_weight: .inf", "cost_weight inf must be 0 to 1e+06"),
        (
            "CostCritic.trajectory_point_step: 1000000",
            "trajectory_point_step 1000000 must be 1 to 10000",
        ),
        (
            "PathAlignCritic.offset_from_furthest: 1000000",
            "offset_from_furthest 1000000 must be 0 to 10000",
        ),
        ("VelocityDeadbandCritic.deadband_velocities: [0.0, .inf, 0.0]", "must be finite numbers"),
        (
            "GoalAngleCritic: 5",
            "GoalAngleCritic: 5 is not a section of keys; write its parameters below",
        ),
        ("CostCritic: true", "CostCritic: True is not a section of keys"),
    ],
)
def test_one_finding_gives_line_and_range(with_line, line, said):
    path = with_line(line)
    notices = [notice for notice in lint(inspect_nav2(path)) if notice.is_error]
    assert [(notice.id, notice.line) for notice in notices] == [("bad-value", 6)], notices
    assert said in str(notices[0])
    with pytest.raises(ParameterError) as error:
        load_nav2(path)
    assert said in str(error.value) and "more)" not in str(error.value)


@pytest.mark.parametrize(
    ("critics", "said"),
    [
        ("[]", "critics is empty; name at least one of ConstraintCritic, CostCritic,"),
        ('"CostCritic"', "FollowPath.critics: 'CostCritic' is not a list"),
        ("5", "FollowPath.critics: 5 is not a list"),
        ('["CostCritic", "CostCritic"]', "critics: 'CostCritic' stands there twice"),
        (
            '["CostCritic", "PathAlignLegacyCritic"]',
            "critics: 'PathAlignLegacyCritic' is not available here",
        ),
    ],
)
def test_the_list_of_critics(with_line, critics, said):
    errors = [
        notice
        for notice in lint(inspect_nav2(with_line("vx_max: 0.5", critics)))
        if notice.is_error
    ]
    assert [(notice.id, notice.line) for notice in errors] == [("bad-value", 5)], errors
    assert said in str(errors[0])


def test_dwb_wants_a_list_of_critics_too(tmp_path):
    path = tmp_path / "robot.yaml"
    text = 'plugin: "dwb_core::DWBLocalPlanner", critics: "PathDist GoalDist"'
    path.write_text(f"controller_server: {{ros__parameters: {{FollowPath: {{{text}}}}}}}")
    with pytest.raises(
        ParameterError, match=r"FollowPath.critics: 'PathDist GoalDist' is not a list"
    ):
        load_nav2(path)


def test_an_unknown_critic_is_told_those_that_run_here(with_line):
    path = with_line("vx_max: 0.5", '["CostCritic", "BogusCritic"]')
    (unknown,) = (notice for notice in lint(inspect_nav2(path)) if notice.is_error)
    assert unknown.id == "unknown-plugin"
    assert (
        unknown.message.endswith("available: " + ", ".join(sorted(CRITICS))) and unknown.line == 5
    )


def test_an_unknown_critic_is_refused_among_unknown_plugins_that_are_let_pass(with_line):
    file = inspect_nav2(
        with_line("vx_max: 0.5", '["CostCritic", "BogusCritic"]'), allow_unknown=True
    )
    assert [notice.id for notice in lint(file) if notice.is_error] == ["bad-value"]


@pytest.mark.parametrize("value", ["1.0e-6", "1.0e+6"])
def test_the_ends_of_a_range_are_allowed(with_line, value):
    assert not inspect_nav2(with_line(f"temperature: {value}")).errors


def test_a_layer_of_no_costmap_is_told_only_of_critics_that_count(with_line):
    costmap = """local_costmap:
  local_costmap:
    ros__parameters:
      plugins: ["inflation_layer"]
      inflation_layer: {plugin: "nav2_costmap_2d::InflationLayer"}
"""
    found = {}
    for critic in ("CostCritic", "ObstaclesCritic"):
        path = with_line(f'{critic}.inflation_layer_name: "bogus"')
        path.write_text(path.read_text() + costmap)
        found[critic] = [
            notice for notice in lint(inspect_nav2(path)) if notice.id == "mppi-no-such-layer"
        ]
    assert not found["ObstaclesCritic"]  # the list does not name it
    assert (
        "'bogus', but the inflation layers of local_costmap are: inflation_layer;"
        in found["CostCritic"][0].message
    )
    assert found["CostCritic"][0].line == 6
