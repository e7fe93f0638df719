"""Where rules about limits begin to fire, and what they say of each limit."""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest

from navstack.errors import ParameterError
from navstack.params.costmap import ObservationSourceParams
from navstack.params.dwb import MOST_SAMPLES, DwbParams
from navstack.params.lint.costmap_view import INFLATION, STATIC, VOXEL
from navstack.params.lint.costmaps import late_costmap, sees_too_late
from navstack.params.lint.dwb_limits import few_samples
from navstack.params.lint.layers import endless_beams, not_inflated
from navstack.params.lint.mppi import mppi_biased_noise, mppi_capped_speed
from navstack.params.lint.robot import MORE, faster_than_robot, harder_than_robot
from navstack.params.lint.rule import above, below, decimal, whole_above
from navstack.params.lint.speed import large_deadband
from navstack.params.lint.subject import DrivingPlugin, RobotLimits, Subject
from navstack.params.mppi import MppiParams
from navstack.params.safety import VelocitySmootherParams

BODY = RobotLimits(
    "testbot",
    np.array([[0.2, 0.1], [0.2, -0.1], [-0.2, 0.0]]),
    1.0,
    2.0,
    3.0,
    2.5,
    4.0,
)
DRIVE = DrivingPlugin("DWB", "FollowPath")
AT_THE_LIMIT = DwbParams(
    max_vel_theta=MORE * 2.0,
    acc_lim_x=MORE * 3.0,
    decel_lim_x=-MORE * 2.5,
    acc_lim_theta=MORE * 4.0,
    decel_lim_theta=-MORE * 4.0,
)


@pytest.mark.parametrize(
    ("key", "value", "told", "advice"),
    [
        ("acc_lim_x", 3.5, "3.5 m/s2, but testbot can do 3 m/s2", "acc_lim_x: 3.0"),
        ("decel_lim_x", -3.0, "-3 m/s2, but testbot can do -2.5 m/s2", "decel_lim_x: -2.5"),
        ("acc_lim_theta", 5.0, "5 rad/s2, but testbot can do 4 rad/s2", "acc_lim_theta: 4.0"),
        (
            "decel_lim_theta",
            -4.5,
            "-4.5 rad/s2, but testbot can do -4 rad/s2",
            "decel_lim_theta: -4.0",
        ),
    ],
)
def test_accelerations_are_held_against_the_robots(key, value, told, advice):
    assert not [*harder_than_robot.check(BODY, AT_THE_LIMIT, DRIVE)]
    (finding,) = harder_than_robot.check(
        BODY, dataclasses.replace(AT_THE_LIMIT, **{key: value}), DRIVE
    )
    assert (finding.name, finding.found, finding.advice) == (f"FollowPath.{key}", told, advice)


@pytest.mark.parametrize(
    ("top_speed", "yaw_rate", "told"),
    [
        (MORE, MORE * 2.0, []),
        (1.25, 2.0, [("speed", "1.25 m/s, but testbot can do 1 m/s", "speed: 1.0")]),
        (
            1.0,
            2.5,
            [
                (
                    "FollowPath.max_vel_theta",
                    "2.5 rad/s, but testbot can do 2 rad/s",
                    "max_vel_theta: 2.0",
                )
            ],
        ),
    ],
)
def test_speeds_are_held_against_the_robots(top_speed, yaw_rate, told):
    dwb = dataclasses.replace(AT_THE_LIMIT, max_vel_theta=yaw_rate)
    subject = SimpleNamespace(speed_name="speed", drive=DRIVE, dwb=dwb)
    found = [*faster_than_robot.check(subject, BODY, top_speed)]
    assert [(each.name, each.found, each.advice) for each in found] == told


@pytest.mark.parametrize(
    ("given", "keys"),
    [
        ({"vx_samples": 2, "max_vel_x": 0.5, "min_vel_x": 0.4}, ["vx_samples"]),
        ({"vx_samples": 2, "max_vel_x": 0.5, "min_vel_x": 0.5}, []),
        ({"vy_samples": 1, "max_vel_y": 0.1, "min_vel_y": -0.1}, ["vy_samples"]),
        ({"vy_samples": 1, "max_vel_y": 0.0, "min_vel_y": 0.0}, []),
        ({"vtheta_samples": 2, "max_vel_theta": 0.6}, ["vtheta_samples"]),
        ({"vtheta_samples": 3, "max_vel_theta": 0.6}, []),
        ({"vtheta_samples": 2, "max_vel_theta": 0.0}, []),
    ],
)
def test_an_axis_that_moves_needs_three_samples(given, keys):
    many = {"vx_samples": 9, "vy_samples": 9, "vtheta_samples": 9}
    found = [*few_samples.check(DwbParams(**{**many, **given}), DRIVE)]
    assert [each.name for each in found] == [f"FollowPath.{key}" for key in keys]
    for each, key in zip(found, keys, strict=True):
        assert each.found == f"{key} is {given[key]}"
        assert each.advice == f"{key}: {getattr(DwbParams(), key)} (Nav2's default)"


@pytest.mark.parametrize(
    ("top_speed", "linear", "angular", "count"),
    [
        (2.0, 0.5, 0.4, 0),
        (2.0, 0.51, 0.4, 1),
        (0.0, 0.51, 0.4, 0),
        (2.0, 0.5, 0.41, 1),
        (2.0, 0.6, 0.6, 2),
    ],
)
def test_a_deadband_is_large_beyond_a_quarter_of_the_top_speed(top_speed, linear, angular, count):
    subject = SimpleNamespace(
        number=lambda node, name, usual: usual, has=lambda node: True, smooths_behaviors=True
    )
    smoother = VelocitySmootherParams(deadband_velocity=(linear, 0.0, angular))
    assert len([*large_deadband.check(subject, smoother, top_speed)]) == count


@pytest.mark.parametrize(("reach", "fires"), [(5.0, False), (5.01, True)])
def test_beams_without_a_return_matter_beyond_five_metres(reach, fires):
    source = ObservationSourceParams(clearing=True, obstacle_max_range=reach)
    view = SimpleNamespace(node="local_costmap", sources=lambda: [("obstacle_layer.scan", source)])
    subject = SimpleNamespace(value=lambda node, name, usual: usual)
    assert bool([*endless_beams.check(subject, view)]) == fires


@pytest.mark.parametrize("axis", range(3))
def test_samples_are_as_many_as_fit_into_memory(axis):
    counts = np.roll((MOST_SAMPLES // 10, 10, 0), axis).tolist()
    names = ("vx_samples", "vy_samples", "vtheta_samples")
    DwbParams(**dict(zip(names, counts, strict=True)))
    counts[axis] += 1
    with pytest.raises(ParameterError, match="100,010 trajectories; at most 100,000 are allowed"):
        DwbParams(**dict(zip(names, counts, strict=True)))


@pytest.mark.parametrize(
    ("reach", "window", "rolling", "marking", "speed", "told"),
    [
        # 2^2 / (2 * 4) + 2 (1 / 4 + 1 / 2) + 0.25 to the bumper
        (2.25, 9.0, True, True, 2.0, None),
        (
            2.2,
            9.0,
            True,
            True,
            2.0,
            ("layer.scan.obstacle_max_range", "2.2", "obstacle_max_range: 3.0"),
        ),
        (9.0, 2.25, True, True, 2.0, None),
        (9.0, 2.2, True, True, 2.0, ("width", "2.2", "width: 6")),
        (9.0, 2.0, False, True, 2.0, None),
        (2.0, 9.0, True, False, 2.0, None),
        (0.1, 9.0, True, True, 0.0, None),
    ],
)
def test_obstacles_are_seen_from_where_the_robot_can_still_brake(
    reach,
    window,
    rolling,
    marking,
    speed,
    told,
):
    source = ObservationSourceParams(marking=marking, obstacle_max_range=reach)
    local = SimpleNamespace(
        sources=lambda: [("layer.scan", source)],
        half_window=window,
        params=SimpleNamespace(rolling_window=rolling, update_frequency=4.0),
        footprint=np.array([[0.25, 0.5], [-0.75, 0.0]]),
    )
    found = [*sees_too_late.check(local, 4.0, SimpleNamespace(controller_frequency=2.0), speed)]
    said = "m from the base, but stopping from 2 m/s at 4 m/s2 with 0.75 s delay takes 2.25 m"
    expected = (
        [] if told is None else [(told[0], f"obstacles are seen up to {told[1]} {said}", told[2])]
    )
    assert [(each.name, each.found, each.advice) for each in found] == expected


@pytest.mark.parametrize(
    ("timeout", "advice"),
    [
        (0.26, []),
        (0.25, ["update_frequency: 6.0, or costmap_update_timeout: 0.5 in the controller server"]),
        (0.0, ["costmap_update_timeout: 0.5 in the controller server"]),
    ],
)
def test_a_costmap_is_late_from_the_timeout_on(timeout, advice):
    subject = SimpleNamespace(
        number=lambda node, name, usual: timeout,
        default_note=lambda node, name: "",
        waits_for_costmaps=False,
    )
    local = SimpleNamespace(params=SimpleNamespace(update_frequency=4.0))
    assert [each.advice for each in late_costmap.check(subject, local, None)] == advice
    for release, waits in (("humble", True), ("iron", True), ("jazzy", False), ("main", False)):
        nav2 = SimpleNamespace(release=release)
        assert Subject.waits_for_costmaps.fget(SimpleNamespace(nav2=nav2)) is waits
    subject.waits_for_costmaps = True
    assert [*late_costmap.check(subject, local, None)] == [], "no timeout before Jazzy"


def test_layers_are_put_in_order_with_the_last_inflation_behind_all_others():
    kinds = {
        "near": INFLATION,
        "voxels": VOXEL,
        "map": STATIC,
        "far": INFLATION,
        "scans": VOXEL,
        "keepout": "",
    }
    view = SimpleNamespace(
        layers=[SimpleNamespace(name=name, type=kind) for name, kind in kinds.items()]
    )
    (finding,) = not_inflated.check(view)
    assert (finding.found, finding.advice) == (
        "scans after far",
        "plugins: [map, voxels, scans, keepout, far]",
    )


@pytest.mark.parametrize(
    ("ax_max", "ax_min", "fires"),
    [
        (7.5, -9.0, True),
        (9.0, -7.5, True),
        (9.0, 7.5, True),
        (8.0, -9.0, False),  # 8 x 0.0625 s is twice the deviation of 0.25 m/s
        (4.0, -4.375, False),
        (4.0, -4.5, True),
        (2.0, -2.0, False),
    ],
)
def test_noise_is_biased_where_unequal_limits_are_met(ax_max, ax_min, fires):
    mppi = MppiParams(
        ax_max=ax_max,
        ax_min=ax_min,
        model_dt=0.0625,
        vx_std=0.25,
        critics=("PathFollowCritic",),
    )
    expected = [
        (
            f"{ax_min:g} m/s2, but ax_max is {ax_max:g} m/s2",
            f"ax_min: {-ax_max}; the velocity smoother may ",
        )
    ]
    found = [*mppi_biased_noise.check(mppi, DRIVE)]
    assert [(each.found, each.advice[: len(expected[0][1])]) for each in found] == (
        expected if fires else []
    )


@pytest.mark.parametrize(
    ("vx_max", "advice"), [(1.31, []), (1.32, ["vx_std: 0.26"]), (3.0, ["vx_std: 0.38"])]
)
def test_a_speed_is_capped_where_following_gains_less_than_control_costs(vx_max, advice):
    """5 / m x 0.0625 s x (0.25 m/s)^2 / 0.015 = 1.302 m/s, of which a hundredth may be missing."""
    mppi = MppiParams(
        vx_max=vx_max,
        model_dt=0.0625,
        vx_std=0.25,
        gamma=0.015,
        critics=("PathFollowCritic",),
    )
    assert [each.advice for each in mppi_capped_speed.check(mppi, DRIVE)] == advice


@pytest.mark.parametrize(
    ("value", "number"), [(3, 3.0), (2.5, 2.5), (True, 7.0), ("4", 7.0), (None, 7.0), ([1.0], 7.0)]
)
def test_what_is_no_number_counts_as_the_default(value, number):
    subject = Subject(SimpleNamespace(value=lambda node, name, default: value))
    assert subject.number("amcl", "z_hit", 7.0) == number


def test_numbers_are_written_as_a_file_wants_them():
    assert [decimal(value) for value in (2, 0.12345, -0.0001, -2.5)] == [
        "2.0",
        "0.123",
        "0.0",
        "-2.5",
    ]
    assert [above(value) for value in (1.2, 1.21, -1.29)] == ["1.2", "1.3", "-1.2"]
    assert [above(2.01, 0), below(2.99, 0), below(0.129), below(-0.121)] == [
        "3.0",
        "2.0",
        "0.12",
        "-0.13",
    ]
    assert [above(math.inf), below(1e300), whole_above(2.1), whole_above(1e300)] == [
        "inf",
        "1e+300",
        "3",
        f"{10**9}",
    ]
