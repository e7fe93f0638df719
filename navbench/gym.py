"""Deliveries as a Gymnasium environment.

Same world, same missions, same dollars as ``navbench run``.

    import gymnasium

    env = gymnasium.make("navbench.gym:navbench/Delivery-v0", stack="nav2-gps-ekf")

Several run in processes of their own with ``gymnasium.make_vec(..., vectorization_mode="async")``.
"""

import dataclasses
import operator
from pathlib import Path
from typing import Any, SupportsIndex

import numpy as np
import numpy.typing as npt

from harness.episode.dollars import Dollars
from harness.episode.episode import RunningDelivery
from harness.episode.factory import Parts
from harness.execution.arithmetic import warn_of_other_arithmetic
from harness.execution.process_cache import forget
from harness.policy.brain import SteeredBrain
from harness.policy.interface import ROUTE_POINTS, Image, PolicyObservation
from harness.storage.shipped import DEFAULT_WORLD, is_district
from harness.task.camera_params import CameraParams
from harness.task.study import make_study
from harness.world.sensors.suite import SensorParams
from navbench.arguments import study_options
from navstack.errors import InputError
from navstack.params.strict import load_dataclass
from navstack.types import FloatArray, Twist2D

try:
    import gymnasium
    from gymnasium import spaces
except ModuleNotFoundError:
    raise InputError(
        "navbench.gym needs gymnasium, which is not installed; pip install 'navbench[gym]'"
    ) from None

warn_of_other_arithmetic()

ID = "navbench/Delivery-v0"
MOST_PEOPLE = 8  # nearest ones, in the observation
FAR = 1e4  # [m] that no map exceeds
FASTEST = 100.0  # [m/s] or [rad/s] that nothing exceeds
MOST_DRAWN = 2**31  # seeds, where none is given
NOT_OF_AN_ENVIRONMENT = ("episodes", "only", "record")  # options of a run
Observed = dict[str, npt.NDArray[np.float32] | Image]


class DeliveryEnv(gymnasium.Env[Any, Any]):
    """One delivery per episode.

    A step lasts as long as the stack's ``policy.rate`` says, 0.1 s by default.

    Observation, in the robot's base frame: ``goal`` x, y [m], yaw [rad]; ``route`` (10, 2) [m], the
    path planned at the start, 1, 2, ... m ahead; ``velocity`` [m/s], [rad/s]; ``scan`` (beams,)
    [m], range_max where nothing returned; with ``sees_people`` also ``people`` (8, 4), the nearest
    ones' x, y [m], vx, vy [m/s], zeros where there is nobody. Action: forward velocity and yaw rate
    as shares of the robot's highest, ``fastest``, in [-1, 1]. Reward: dollars, see
    :class:`harness.episode.dollars.Dollars`; ``info["dollars"]`` has them by term. A delivery that
    is over is terminated, never truncated: being late costs.
    """

    metadata = {"render_modes": []}  # noqa: RUF012 - as Gymnasium wants it

    def __init__(
        self,
        stack: str = "nav2-gps-ekf",
        *,
        map: str = "sidewalk",  # noqa: A002 - as the option is called
        world: str = DEFAULT_WORLD,
        sees_people: bool = False,
        camera: CameraParams | None = None,
        render_mode: None = None,
        **options: Any,
    ) -> None:
        """Make the world.

        Args:
            stack: whose robot, sensors, localizer and planner there are; who steps the environment
                drives.
            map: a built-in map or a map_server YAML file.
            world: a name of params/worlds or a YAML file.
            sees_people: whether the observation has people.
            camera: whose pictures the observation has as ``image``, e.g. ``CameraParams(160,
                120)``; None: that of the stack's file, which may have none.
            render_mode: None: nothing is drawn.
            options: as of :func:`navbench.run`, such as ``pedestrians`` or ``prices``; deliveries
                and records are not chosen here.

        Raises:
            InputError: something that was given cannot be used.
        """
        if render_mode is not None:
            raise InputError(
                f"render_mode={render_mode!r}: an environment draws nothing; leave it out, and "
                "look at deliveries with navbench replay"
            )
        options = study_options(DeliveryEnv, options, NOT_OF_AN_ENVIRONMENT)
        forget()  # files may have changed since another environment
        study = make_study(
            stacks=[stack], episodes=1, map_name=map, world=world, workers=1, **options
        )
        if is_district(map):
            raise InputError(
                f"'{map}' is a district, whose missions have legs; give a map for one environment"
            )
        given = study.template.stack
        if not given.nav2_file:
            raise InputError(f"stack '{given.name}' does not drive; give one with a Nav2 file")
        policy = dataclasses.replace(
            given.policy, sees_people=sees_people, camera=camera or given.policy.camera
        )
        self._task = dataclasses.replace(
            study.template, stack=dataclasses.replace(given, policy=policy), episode=-1
        )
        parts = Parts(self._task)
        self._world = parts.new_world()
        self._brain = SteeredBrain(parts.senses(self._world), policy.rate)
        lidar = load_dataclass(SensorParams, Path(given.sensors)).lidar
        self._no_scan = np.full(lidar.beams, lidar.range_max)
        self._sees_people = sees_people
        self.fastest = np.array((parts.robot.max_speed, parts.robot.max_yaw_rate))  # [m/s], [rad/s]
        self.action_space = spaces.Box(-1.0, 1.0, (2,))
        seen: dict[str, spaces.Space[Any]] = {
            "goal": spaces.Box(-FAR, FAR, (3,)),
            "route": spaces.Box(-FAR, FAR, (ROUTE_POINTS, 2)),
            "velocity": spaces.Box(-FASTEST, FASTEST, (2,)),
            "scan": spaces.Box(0.0, lidar.range_max, (lidar.beams,)),
        }
        if sees_people:
            seen["people"] = spaces.Box(-FAR, FAR, (MOST_PEOPLE, 4))
        if policy.camera.is_there:
            seen["image"] = spaces.Box(
                0, 255, (policy.camera.height, policy.camera.width, 3), np.uint8
            )
        self.observation_space = spaces.Dict(seen)
        self.delivery: RunningDelivery | None = None
        self._is_over, self._is_closed = True, False
        self._has_seed = "seed" in options

    @property
    def seen(self) -> PolicyObservation:
        """What a policy of a stack would see now, in full precision."""
        return self._brain.view()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observed, dict[str, Any]]:
        """Begin a delivery: number 0 of a new ``seed``, else the next one.

        ``options={"episode": k}`` chooses. Where nobody ever chose a seed it is drawn from the
        machine's entropy, as Gymnasium has it, so that environments side by side differ; ``info``
        tells it.

        Raises:
            InputError: a seed or number that is out of range.
        """
        self._require_open()
        if seed is not None and seed < 0:
            raise InputError(f"seed={seed}: give 0 or more")
        super().reset(seed=seed)
        known = self._task
        if seed is None and not options and not self._has_seed:
            seed = int(self.np_random.integers(MOST_DRAWN))
        episode = 0
        if seed is None:
            seed, episode = known.seed, known.episode + 1
        if options:
            episode = _episode_of(options)
        self._has_seed = True
        self._task = dataclasses.replace(known, seed=seed, episode=episode)
        self.delivery = RunningDelivery(self._task, lambda parts, world: self._brain, self._world)
        self._dollars = Dollars(self.delivery.parts.prices, self.delivery.truth)
        self._brain.sense(self.delivery.observation)
        self._is_over = False
        return self._observed(), {"seed": self._task.seed, "episode": episode}

    def step(self, action: FloatArray) -> tuple[Observed, float, bool, bool, dict[str, Any]]:
        """Drive until the next action is due, or the delivery is over.

        Then ``info`` has its row and events.

        Raises:
            InputError: no delivery has begun, or the action is not two finite numbers.
        """
        self._require_open()
        delivery, brain = self.delivery, self._brain
        numbers = _numbers_of(action)
        if delivery is None or self._is_over:
            raise InputError("the delivery is over, or none has begun; call reset()")
        if numbers.shape != (2,) or not np.isfinite(numbers).all():
            raise InputError(
                f"action {action!r} is not two finite numbers: shares of the highest velocity and "
                "yaw rate"
            )
        speed, yaw_rate = (np.clip(numbers, -1.0, 1.0) * self.fastest).tolist()
        brain.command = Twist2D(speed, 0.0, yaw_rate)
        delivery.drive(brain.command)
        while delivery.verdict is None and not self._is_due(delivery):
            delivery.drive(brain.command)
        verdict = delivery.verdict
        dollars = self._dollars.since(delivery.truth)
        info: dict[str, Any] = {"dollars": dollars}
        if verdict is not None:
            self._is_over = True
            finished = delivery.finish()
            self._is_due(delivery)  # what arrived in the last tick
            for term, amount in self._dollars.settle(finished).items():
                dollars[term] += amount
            info |= {
                "outcome": verdict.outcome.value,
                "row": finished.row,
                "events": finished.events,
            }
        return self._observed(), sum(dollars.values()), verdict is not None, False, info

    def _is_due(self, delivery: RunningDelivery) -> bool:
        """Take in what arrived; whether an action is due, or the stack's senses failed."""
        try:
            return self._brain.sense(delivery.observation)
        except Exception as error:  # whatever a localizer raises
            delivery.fail(error)
            return True

    def close(self) -> None:
        """Free the world; the environment cannot be used afterwards."""
        self._world.close()
        self._is_closed = True

    def __getstate__(self) -> Any:
        """Refuse copies and pickles, which would drive in the same world.

        Raises:
            InputError: always.
        """
        raise InputError("an environment cannot be copied or pickled; make another one")

    def _require_open(self) -> None:
        if self._is_closed:
            raise InputError("the environment is closed; make another one")

    def _observed(self) -> Observed:
        view = self._brain.view()
        seen = {"goal": view.goal, "route": view.route, "velocity": view.velocity}
        seen["scan"] = view.ranges if len(view.ranges) else self._no_scan
        if self._sees_people:
            seen["people"] = np.zeros((MOST_PEOPLE, 4))
            nearest = view.people[:MOST_PEOPLE]
            seen["people"][: len(nearest)] = nearest
        observed: Observed = {name: values.astype(np.float32) for name, values in seen.items()}
        return {**observed, "image": view.image} if view.image.size else observed


def _episode_of(options: dict[str, Any]) -> int:
    """The number of a delivery that the options of ``reset`` choose.

    Raises:
        InputError: they are others, or it is none.
    """
    given = options.get("episode")
    if set(options) != {"episode"} or isinstance(given, bool):
        raise InputError(f"options {options!r}; give {{'episode': k}} or none")
    number = -1
    if isinstance(given, SupportsIndex):  # also numpy's integers
        number = operator.index(given)
    if number < 0:
        raise InputError(f"options: episode {given!r}; give a whole number of 0 or more")
    return number


def _numbers_of(action: Any) -> FloatArray:
    """An action as an array of any shape; of what holds no numbers an empty one."""
    try:
        return np.asarray(action, dtype=np.float64)
    except (TypeError, ValueError):
        return np.empty(0)


gymnasium.register(ID, entry_point="navbench.gym:DeliveryEnv")
