"""The navigator of a stack in a world, or the senses of its policy."""

import dataclasses
import math

import numpy as np

from harness.economics.contact_costs import injury_cost
from harness.economics.prices import Prices
from harness.policy.senses import Look, MakeRoute, People, Senses
from harness.storage.shipped import is_file
from harness.task.camera_params import CameraParams
from harness.task.stack import GEOMETRY, MESH, NO_MAP, TRUTH, Stack
from harness.world.map.scene import Scene
from harness.world.outcome import Rules
from harness.world.people.params import PedestrianParams
from harness.world.sensors.ground_truth import (
    GroundTruthLocalizer,
    GroundTruthTracker,
    InjectedErrorLocalizer,
)
from harness.world.world import World
from navstack.build import (
    build_global_costmap,
    build_localizer,
    build_navigator,
    build_planner,
    read_frequencies,
)
from navstack.costmap.map_io import load_map
from navstack.costmap.occupancy_grid import FREE, OccupancyGrid, align
from navstack.errors import PlanningError
from navstack.localization.localizer import Localizer
from navstack.navigator import Navigator
from navstack.params.expected_cost import DeliveryPrices
from navstack.params.nav2_file.file import Nav2File
from navstack.types import BoolArray, FloatArray, Path, Pose2D

CLOSING_SPEEDS = np.arange(6.0)  # [m/s] at which contacts are priced


def steps_per_tick(nav2: Nav2File, rate: float) -> int:
    """The longest tick, in physics steps, at which every part of the brain runs when due.

    ``rate`` [Hz] is that of the physics.
    """
    # what has 0 Hz never runs
    periods = [rate / frequency for frequency in read_frequencies(nav2) if frequency > 0.0]
    if any(abs(period - round(period)) > 1e-6 or period < 1.0 for period in periods):
        # some part fits no whole number of steps: it runs at the first step after it is due
        return 1
    return math.gcd(*(round(period) for period in periods))


def delivery_prices(prices: Prices, rules: Rules, counted_impulse: float) -> DeliveryPrices:
    """The prices of a study for a controller that minimises dollars.

    Contacts count from ``counted_impulse`` [N s] on. A person who walks on changes the robot's
    velocity by the closing speed.
    """
    counted_speed = counted_impulse / prices.robot_mass.value
    return DeliveryPrices(
        contact_usd=tuple(injury_cost(np.maximum(CLOSING_SPEEDS, counted_speed), prices).tolist()),
        counted_speed=counted_speed,
        late_usd=2.0 * prices.delivery_fee.value,  # not earned, and paid back
        time_limit=rules.time_limit,
    )


def navigator_on(
    scene: Scene,
    world: World,
    stack: Stack,
    nav2: Nav2File,
    prices: DeliveryPrices | None = None,
) -> Navigator:
    """The brain of a stack that drives, to be reset.

    Args:
        scene: what its maps show.
        world: where a localizer that knows the truth looks it up.
        stack: which localizer it has, and which map.
        nav2: its parameter file.
        prices: see :func:`delivery_prices`; None: those of the file hold.
    """
    localizer = localizer_on(scene, world, stack, nav2)
    stops = stack.when_lost == "stop"
    tracker = None
    if stack.tracker == TRUTH:
        tracker = GroundTruthTracker(lambda: world.truth.pedestrians, world.person_radius)
    return build_navigator(nav2, localizer, *planning_map(scene, stack), stops, prices, tracker)


def senses_on(
    scene: Scene,
    world: World,
    stack: Stack,
    nav2: Nav2File,
    persons: PedestrianParams,
) -> Senses:
    """What a policy of a stack sees in a world, ``persons`` among it, to be reset.

    See :func:`navigator_on`.
    """

    def people() -> tuple[Pose2D, FloatArray]:
        return world.truth.pose, world.truth.pedestrians

    seen: People | None = None
    if stack.policy.sees_people:
        seen = people
    look: Look | None = None
    if stack.policy.camera.is_there:
        look = _camera(scene, world, stack.policy.camera, persons)
    return Senses(
        localizer_on(scene, world, stack, nav2),
        _route(nav2, *planning_map(scene, stack)),
        seen,
        look,
    )


def _camera(scene: Scene, world: World, params: CameraParams, persons: PedestrianParams) -> Look:
    from harness.world.sensors.camera import Camera

    camera = Camera(scene, params, persons.radius, persons.height)
    return lambda: camera.picture(world.truth.pose, world.truth.pedestrians)


def _route(nav2: Nav2File, static_map: OccupancyGrid, keepout: BoolArray | None) -> MakeRoute:
    """Plans with the file's planner on its global costmap, without scans.

    Where that fails, straight to the goal.
    """
    costmap = build_global_costmap(nav2, static_map, keepout)
    planner = build_planner(nav2, costmap)

    def make_route(start: Pose2D, goal: Pose2D, rng: np.random.Generator) -> Path:
        costmap.reset()
        costmap.update(start, None, 0.0)
        planner.reset(rng)
        try:
            return planner.plan(start, goal, costmap.master)
        except PlanningError:
            return Path(np.array((start.as_array(), goal.as_array())))

    return make_route


def localizer_on(scene: Scene, world: World, stack: Stack, nav2: Nav2File) -> Localizer:
    """The localizer of a stack that drives, to be reset; see :func:`navigator_on`."""
    if stack.localizer != TRUTH:
        return build_localizer(stack.localizer, nav2, _localization_map(scene, stack))
    truth = GroundTruthLocalizer(lambda: world.truth.pose)
    if stack.injected.is_zero:
        return truth
    return InjectedErrorLocalizer(truth, stack.injected)


def planning_map(scene: Scene, stack: Stack) -> tuple[OccupancyGrid, BoolArray | None]:
    """What planner and controller take for the static map.

    And the mask of where not to go that the world has for it; None where it has none. Then the
    file's ``allow_unknown`` and ``track_unknown_space`` say whether unknown cells are closed.

    Raises:
        MapError: the stack names a file that is no map.
    """
    if is_file(stack.planning_map):
        return align(load_map(stack.planning_map)), None
    if stack.planning_map == MESH:
        return scene.navigation_mesh, None
    if stack.planning_map == NO_MAP:
        empty = np.full_like(scene.geometry.data, FREE)
        return dataclasses.replace(scene.geometry, data=empty), None
    keepout = None
    if scene.is_ground_given:
        keepout = scene.walkable.data != FREE
    return scene.geometry, keepout


def _localization_map(scene: Scene, stack: Stack) -> OccupancyGrid:
    name = stack.localization_map or stack.planning_map
    if is_file(name):
        return align(load_map(name))
    if name in (GEOMETRY, NO_MAP):  # without a map nobody looks at it
        return scene.mapped_geometry
    if name == MESH:
        return scene.navigation_mesh
    return scene.outlined_mesh
