"""The expected-cost controller among people.

Its prices against plain numpy, its decisions against the MPC's.
"""

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from navstack.control.contact_risk import ContactRates, body_of, nearest
from navstack.control.controller import Controller, Surroundings
from navstack.control.expected_cost import motions as library
from navstack.control.expected_cost.clearance import map_clearance, with_obstacles
from navstack.control.expected_cost.expected_cost_controller import ExpectedCostController
from navstack.control.expected_cost.field import make_field
from navstack.control.expected_cost.motion_cost import Limits, Rates, Scene, price_all
from navstack.control.expected_cost.people import Spread, predict
from navstack.control.mpc.mpc_controller import JerkLimitedMpcController
from navstack.costmap.costmap import Costmap
from navstack.costmap.inflation import Inflation
from navstack.geometry import cover
from navstack.params.costmap import InflationLayerParams
from navstack.params.expected_cost import ExpectedCostParams
from navstack.params.mpc import MpcParams
from navstack.planning.cost_to_go import cost_to_go
from navstack.types import Path, Pose2D, RobotState, Track, Twist2D
from tools.bench import twin_expected_cost
from tools.bench.component import Component, Prepared, require_agreement

PARAMS = ExpectedCostParams()
FOOTPRINT = np.array(((0.14, 0.25), (0.14, -0.25), (-0.607, -0.25), (-0.607, 0.25)))  # [m]
FREQUENCY = 15.0  # [Hz]
GOAL = Pose2D(15.0, 28.0, 0.5 * math.pi)
GOAL_RADIUS = 0.5  # [m]
SPEED = 1.2  # [m/s] of the robot
MOMENTS = 45  # of a walk through the street; then it begins anew


def street() -> Costmap:
    """30 x 30 m, a street of 15 m along y between two walls."""
    data = np.zeros((600, 600), dtype=np.uint8)
    data[:, :150] = data[:, 450:] = 254
    floor = data.copy()
    floor.flags.writeable = False
    return Costmap(data, 0.05, 0.0, 0.0, floor)


def scene_of(rng: np.random.Generator, count: int) -> Scene:
    """A random situation among ``count`` people on the street, with something that no map shows."""
    world = street()
    seen = Costmap(np.ascontiguousarray(world.data[60:540, 60:540]), 0.05, 3.0, 3.0)
    seen.data[300:306, 200:210] = 254
    place = Pose2D(15.0 + rng.uniform(-6.5, 6.5), rng.uniform(6.0, 26.0))
    clearance = with_obstacles(
        map_clearance(world), seen, world, (place.x, place.y), np.zeros((0, 3))
    )
    people = nearest(crowd(rng, count, place, 2.0), place, 0.0, count, math.inf)
    spread = Spread(*(getattr(PARAMS, name) for name in Spread._fields))
    return Scene(
        np.array(
            (
                place.x,
                place.y,
                rng.uniform(-3.0, 3.0),
                rng.uniform(-1.0, 2.0),
                rng.uniform(-1.0, 1.0),
            )
        ),
        make_field(world, GOAL, 0.2, cost_to_go),
        clearance,
        predict(people, place.x, place.y, PARAMS.steps, PARAMS.step, spread, clearance),
        body_of(FOOTPRINT),
        *cover(FOOTPRINT, 4),
        Limits(
            goal_radius=GOAL_RADIUS, **{name: getattr(PARAMS, name) for name in Limits._fields[:-1]}
        ),
        Rates(*(float(getattr(PARAMS, name)) for name in Rates._fields)),
        ContactRates(*(getattr(PARAMS, name) for name in ContactRates._fields)),
        np.array(PARAMS.contact_usd),
        np.exp(-PARAMS.step * np.arange(1, PARAMS.steps + 1) / PARAMS.caution_time),
        PARAMS.step,
    )


def crowd(rng: np.random.Generator, count: int, place: Pose2D, away: float) -> tuple[Track, ...]:
    """People about ``away`` [m] from a place, who walk about 1 m/s in any direction."""
    offsets, velocities = rng.normal(0.0, away, (count, 2)), rng.normal(0.0, 1.0, (count, 2))
    covariance = np.diag((0.02, 0.02, 0.02, 0.02))
    return tuple(
        Track(k, 0.0, place.x + dx, place.y + dy, vx, vy, 0.3, covariance)
        for k, ((dx, dy), (vx, vy)) in enumerate(
            zip(offsets.tolist(), velocities.tolist(), strict=True)
        )
    )


def prices(count: int) -> Prepared:
    """All motions of a cycle, priced among ``count`` people."""
    scene = scene_of(np.random.default_rng(3), count)
    motions = np.concatenate(
        (
            library.few(PARAMS.max_speed),
            library.many(PARAMS.max_speed, PARAMS.max_reverse_speed, PARAMS.max_yaw_rate),
        )
    )
    costs, risks = np.empty(len(motions)), np.empty(len(motions))
    best = price_all(motions, scene, math.inf, costs, risks)
    expected = twin_expected_cost.terms(motions, scene).sum(axis=1)
    given_up = np.isinf(costs)
    require_agreement(
        "expected cost: motions that were not given up", costs[~given_up], expected[~given_up], 1e-5
    )
    require_agreement("expected cost: the least", costs[best], expected.min(), 1e-5)
    return Prepared(
        lambda: price_all(motions, scene, math.inf, costs, risks),
        lambda: twin_expected_cost.terms(motions, scene),
    )


def decisions(count: int) -> Prepared:
    """A decision among ``count`` people, and the MPC's on the same moments."""
    world = street()
    ours = ExpectedCostController(PARAMS, FOOTPRINT, FREQUENCY, GOAL_RADIUS, world, cost_to_go)
    around = Costmap(world.data.copy(), world.resolution, world.origin_x, world.origin_y)
    rows, columns = around.data.shape
    Inflation(
        InflationLayerParams(inflation_radius=1.5, cost_scaling_factor=3.0), 0.05, 0.25
    ).apply(around.data, 0, columns, 0, rows)
    mpc = JerkLimitedMpcController(MpcParams(), FOOTPRINT, FREQUENCY, GOAL_RADIUS)
    return Prepared(
        *(_walk(controller, count, near) for controller, near in ((ours, world), (mpc, around)))
    )


def _walk(controller: Controller, count: int, costmap: Costmap) -> Callable[[], object]:
    """Decides at the next moment of a walk up the street at every call."""
    plan = Path(np.array([(15.0, y, 0.5 * math.pi) for y in np.arange(5.0, GOAL.y, 0.05)]))
    people = crowd(np.random.default_rng(3), count, Pose2D(15.0, 13.0), 3.0)
    poses = [Pose2D(15.0, 9.0 + SPEED * k / FREQUENCY, 0.5 * math.pi) for k in range(MOMENTS)]
    twist, clock = Twist2D(SPEED), itertools.count()

    def decide() -> object:
        now = next(clock)
        stamp, t, pose = now / FREQUENCY, now % MOMENTS / FREQUENCY, poses[now % MOMENTS]
        seen = tuple(
            replace(one, stamp=stamp, x=one.x + one.vx * t, y=one.y + one.vy * t) for one in people
        )
        return controller.compute_velocity(
            RobotState(pose, twist, stamp, pose), plan, Surroundings(costmap, seen)
        )

    decide()
    return decide


COMPONENTS: Sequence[Component] = (
    Component("expected cost, all motions, 5 people", partial(prices, 5)),
    *(
        Component(
            f"expected-cost decision, {count} people",
            partial(decisions, count),
            reference="mpc decision",
            agrees="another controller's, measured in turn in this run",
        )
        for count in (0, 5)
    ),
)
