"""The controller that minimises expected dollars: this project's own plugin."""

import dataclasses
import math
from collections.abc import Sequence

import numpy as np

from navstack.control.contact_risk import ContactRates, body_of, nearest_of, rows_of
from navstack.control.controller import Controller, Surroundings, finite, limited_speed
from navstack.control.decision import Alternative, DecisionRecord, Option
from navstack.control.expected_cost import decision_report
from navstack.control.expected_cost.clearance import Clearance, map_clearance, with_obstacles
from navstack.control.expected_cost.decision_report import Cycle
from navstack.control.expected_cost.field import CostToGo
from navstack.control.expected_cost.goal_field import GoalField
from navstack.control.expected_cost.making_way import MakingWay
from navstack.control.expected_cost.motion_cost import (
    TERMS,
    MotionScene,
    Rates,
    price_one,
)
from navstack.control.expected_cost.motion_search import MotionSearch
from navstack.control.expected_cost.motions import later
from navstack.control.expected_cost.people import Spread, predict
from navstack.control.expected_cost.rollout import MotionLimits
from navstack.costmap.costmap import Costmap
from navstack.geometry import cover
from navstack.jit import tuple_of
from navstack.params.expected_cost import DeliveryPrices, ExpectedCostParams
from navstack.types import FloatArray, Path, RobotState, Track, Twist2D

_CIRCLES = 4  # that cover the robot
_STALE = 0.5  # [s] after which what was chosen last is of no use
_OFF = (0.3, 0.4)  # [m/s], [rad/s] between command and odometry from which on odometry is believed
_GOT_ON = 1.0  # [m] by which the cost to go must fall to count as progress
_ROUNDING = 1e-9  # [s]
_ROOT_TWO_PI = math.sqrt(2.0 * math.pi)


class ExpectedCostController(Controller):
    """Compares many short motions in every cycle by their expected dollars; begins the best.

    The dollars: chance of touching each tracked person times what that costs at the closing speed,
    walls, shaking the load, and delay along a cost-to-go field of its own. It follows no path: the
    plan only says where the goal is and whether the field is out of date.
    """

    wants_tracks = True

    def __init__(
        self,
        params: ExpectedCostParams,
        footprint: FloatArray,
        controller_frequency: float,
        xy_goal_tolerance: float,
        world: Costmap,
        cost_to_go: CostToGo,
        prices: DeliveryPrices | None = None,
    ) -> None:
        """Make the controller.

        Args:
            params: its parameters.
            footprint: padded polygon (V, 2) in [m], base frame; its bounding box counts.
            controller_frequency: control cycles per second, in [Hz].
            xy_goal_tolerance: of the goal checker in [m].
            world: the global costmap, on which the field is made.
            cost_to_go: makes it.
            prices: take the place of those in ``params``; None: those hold.
        """
        if prices:
            params = dataclasses.replace(params, **dataclasses.asdict(prices))
        self._params = given = params
        self._period = 1.0 / controller_frequency  # [s]
        self._goal_field = GoalField(given, world, cost_to_go)
        self._map_clearance = map_clearance(world)
        self.acts_at_rest = given.evades_at_rest
        self._body = body_of(footprint)
        self._circles, self._circle_radius = cover(footprint, _CIRCLES)
        self._limits: MotionLimits = tuple_of(MotionLimits, given, goal_radius=xy_goal_tolerance)
        self._spread: Spread = tuple_of(Spread, given)
        self._rates: Rates = tuple_of(Rates, given)
        self._touch: ContactRates = tuple_of(ContactRates, given)
        self._contact_usd = np.array(given.contact_usd)
        self._care = np.exp(-given.step * np.arange(1, given.steps + 1) / given.caution_time)
        self._making_way = MakingWay(self._body, given.yielding_prior)
        self._search = MotionSearch(given, self._limits)
        self.seed(np.random.default_rng(0))
        self.reset()

    def seed(self, rng: np.random.Generator) -> None:
        """See the base class."""
        self._search.seed(rng)
        self._began: float | None = None  # [s] the first cycle towards the goal
        # least cost to go so far [m], and when it was reached [s]
        self._nearest = math.inf
        self._got_on = 0.0
        self._goal_field.reset()
        self._making_way.reset()
        self._clearance: Clearance | None = None
        self._seen = -math.inf  # [s] when the local costmap was looked at

    def reset(self) -> None:
        """See the base class."""
        self._plan: Path | None = None
        self._last: FloatArray | None = None  # (FIELDS,) chosen last
        self._stamp = -math.inf  # [s] of the last cycle
        self._motion = (0.0, 0.0)  # commanded last [m/s], [rad/s]
        self._cycle: Cycle | None = None

    def set_speed_limit(self, limit: float, is_percentage: bool) -> None:
        """Drive no faster than ``limit`` [m/s], or [%] of the largest speed, from now on.

        0 lifts the limit.
        """
        largest = self._params.max_speed
        self._limits = self._limits._replace(
            max_speed=min(largest, limited_speed(largest, limit, is_percentage))
        )
        self._search.set_limits(self._limits)

    def compute_velocity(
        self, state: RobotState, plan: Path, surroundings: Surroundings
    ) -> Twist2D:
        """The first step of the cheapest motion.

        Raises:
            InvalidPathError: the plan is empty.
        """
        if plan is not self._plan:
            if self._goal_field.take(plan, state):
                self._nearest = math.inf
            self._plan = plan
        scene = self._scene(state, surroundings)
        last = None
        elapsed = state.stamp - self._stamp
        if self._last is not None and elapsed < _STALE:
            last = later(self._last, elapsed)
        motions, chosen = self._search.choose(scene, last)
        states = np.empty((self._params.steps, 7))
        price_one(chosen, scene, np.empty(len(TERMS)), states)
        share = min(1.0, self._period / self._params.step)
        v, w = (scene.start[3:] + share * (states[0, 3:5] - scene.start[3:])).tolist()
        self._last = chosen
        self._stamp = state.stamp
        self._motion = (v, w)
        command = Twist2D(v, 0.0, w)
        self._cycle = Cycle(state.stamp, scene, motions, chosen, command)
        return command

    def _scene(self, state: RobotState, surroundings: Surroundings) -> MotionScene:
        given = self._params
        pose = state.pose
        tracks = surroundings.tracks
        rows = rows_of(tracks, state.stamp)
        near = nearest_of(rows, pose, given.max_tracks, given.range)
        if (
            self._clearance is None
            or state.stamp - self._seen >= given.clearance_period - _ROUNDING
        ):
            around = np.array([(each.x, each.y, each.radius) for each in tracks]).reshape(-1, 3)
            margin = given.map_margin_stds * state.position_std
            self._clearance = with_obstacles(
                self._map_clearance, surroundings.costmap, (pose.x, pose.y), around, margin
            )
            self._seen = state.stamp
        self._goal_field.look(tracks, state, self._clearance)
        predicted = predict(
            rows[near],
            self._yielding(tracks, state)[near],
            pose.x,
            pose.y,
            given.steps,
            given.step,
            self._spread,
            self._clearance,
        )
        return MotionScene(
            start=self._start(state),
            field=self._goal_field.followed,
            clearance=self._clearance,
            people=predicted,
            body=self._body,
            circles=self._circles,
            circle_radius=self._circle_radius,
            limits=self._limits._replace(max_speed=self._sure_speed(state)),
            rates=self._rates._replace(second_usd=self._second_usd(state)),
            touch=self._touch,
            contact_usd=self._contact_usd,
            care=self._care,
            step=given.step,
        )

    def _yielding(self, tracks: Sequence[Track], state: RobotState) -> FloatArray:
        """By how much (n,) each of the tracks counts less, for it may make way."""
        if self._params.yielding_prior == 0.0:
            return np.zeros(len(tracks))
        self._making_way.observe(tracks, state.pose, state.stamp)
        return self._params.yielding_share * self._making_way.chances(tracks)

    def _start(self, state: RobotState) -> FloatArray:
        """The state (5,) from which to decide: the believed pose and the commanded motion.

        The command has no noise. Odometry counts where it is very different, or after a pause.
        """
        v, w = self._motion
        measured = state.twist
        off = abs(measured.linear_x - v) > _OFF[0] or abs(measured.angular_z - w) > _OFF[1]
        if off or not state.stamp - self._stamp < _STALE:
            v = finite(measured.linear_x)
            w = finite(measured.angular_z)
        return np.array((state.pose.x, state.pose.y, state.pose.yaw, v, w))

    def _sure_speed(self, state: RobotState) -> float:
        """The largest speed [m/s] that suits the spread of the believed place.

        At ``unsure_std`` it is half of the limit.
        """
        unsure = state.position_std / self._params.unsure_std
        return self._limits.max_speed / (1.0 + unsure * unsure)

    def _second_usd(self, state: RobotState) -> float:
        """What a second of delay costs [USD/s].

        That is its own price, and the rise of the probability to be late. The price grows with the
        time in which the robot has come no nearer to the goal.
        """
        given = self._params
        if self._began is None:
            self._began = self._got_on = state.stamp
        left = self._goal_field.way_left(state.pose)
        if left < self._nearest - _GOT_ON:
            self._nearest = left
            self._got_on = state.stamp
        held_up = (state.stamp - self._got_on) / given.impatience_time
        slack = given.time_limit - (state.stamp - self._began) - left / given.max_speed
        z = max(slack, 0.0) / given.lateness_std
        late = given.late_usd * math.exp(-0.5 * z * z) / (_ROOT_TWO_PI * given.lateness_std)
        return given.second_usd * (1.0 + held_up) + late

    @property
    def decision(self) -> DecisionRecord | None:
        """See the base class; the scores are dollars."""
        if self._cycle is None:
            return None
        return decision_report.record(self._cycle)

    @property
    def alternatives(self) -> tuple[Alternative, ...]:
        """See the base class; totals are dollars."""
        if self._cycle is None:
            return ()
        return decision_report.alternatives(self._cycle)

    @property
    def options(self) -> tuple[Option, ...]:
        """See the base class; totals are dollars."""
        if self._cycle is None:
            return ()
        return decision_report.options(self._cycle)
