"""Where one simulated second goes.

Timed wrappers around the methods of each part, put on from outside.
"""

import contextlib
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from harness.episode.pedestrian_delay import PedestrianDelay
from harness.metrics.delivery_log import DeliveryLog
from harness.task.study import EpisodeTask
from harness.world.cargo.cargo import Cargo
from harness.world.people.crowd import Crowd
from harness.world.people.pedestrians import PedestrianModel
from harness.world.pybullet_world import PyBulletWorld
from harness.world.sensors.lidar import Lidar
from harness.world.sensors.suite import SensorSuite
from navstack.control.controller import Controller
from navstack.costmap.layered_costmap import LayeredCostmap
from navstack.localization.localizer import Localizer
from navstack.navigator import Navigator
from navstack.perception.tracker import Tracker
from navstack.planning.planner import Planner
from navstack.safety.collision_monitor import CollisionMonitor
from navstack.safety.velocity_smoother import VelocitySmoother
from tools.bench.loops import drive

REST = "rest"
TRIALS = 20_000  # calls by which a wrapper's own cost is estimated

Namer = Callable[[Any], str]


def _costmap(costmap: LayeredCostmap) -> str:
    return "local costmap" if costmap.params.rolling_window else "global costmap"


# What belongs to which part. A part's time is without that of parts that it calls; subclasses count
# with their base.
PARTS: tuple[tuple[str | Namer, type, tuple[str, ...]], ...] = (
    ("world physics", PyBulletWorld, ("step", "reset", "close_episode")),
    ("lidar", Lidar, ("measure",)),
    ("other sensors", SensorSuite, ("measure",)),
    ("pedestrians", Crowd, ("follow", "before_step", "after_step")),
    ("pedestrians", PedestrianModel, ("step", "steps", "see_robot")),
    ("cargo", Cargo, ("step", "reset")),
    ("localizer", Localizer, ("update",)),
    ("tracker", Tracker, ("observe", "tracks")),
    (_costmap, LayeredCostmap, ("observe_scan", "update", "reset")),
    ("planner", Planner, ("plan",)),
    ("controller", Controller, ("compute_velocity",)),
    ("smoother and monitor", VelocitySmoother, ("smooth",)),
    ("smoother and monitor", CollisionMonitor, ("receive", "process")),
    ("navigator", Navigator, ("tick",)),
    ("log", DeliveryLog, ("record", "measurements")),
    ("log", PedestrianDelay, ("record", "total")),
)


class Meter:
    """Adds up the processor time of parts, each without that of the parts inside."""

    def __init__(self) -> None:
        self.spent: defaultdict[str, float] = defaultdict(float)  # [s]
        self.calls: defaultdict[str, int] = defaultdict(int)
        self.inner_calls: defaultdict[str, int] = defaultdict(int)  # of other parts, from a part
        self._open: list[tuple[str, list[float]]] = []  # names and the time of what is inside each

    def timed(self, name: str | Namer, method: Callable[..., Any]) -> Callable[..., Any]:
        """A method that is timed whenever it is called."""
        clock, spent, calls, inner_calls, opened = (
            *(time.thread_time, self.spent, self.calls, self.inner_calls, self._open),
        )

        def wrapper(itself: Any, *given: Any, **named: Any) -> Any:
            part = name if isinstance(name, str) else name(itself)
            inside = [0.0]
            opened.append((part, inside))
            began = clock()
            try:
                return method(itself, *given, **named)
            finally:
                took = clock() - began
                opened.pop()
                spent[part] += took - inside[0]
                calls[part] += 1
                if opened:
                    opened[-1][1][0] += took
                    inner_calls[opened[-1][0]] += 1

        return wrapper


@contextlib.contextmanager
def metered(meter: Meter) -> Iterator[None]:
    """Put wrappers on every part, and take them off again."""
    kept: list[tuple[type, str, Any]] = []
    try:
        for name, base, methods in PARTS:
            for kind in _family(base):
                for method in methods:
                    if method in vars(kind):
                        kept.append((kind, method, vars(kind)[method]))
                        setattr(kind, method, meter.timed(name, vars(kind)[method]))
        yield
    finally:
        for kind, method, original in kept:
            setattr(kind, method, original)


def _family(base: type) -> list[type]:
    kinds = [base]
    children: list[type] = type.__subclasses__(base)
    for child in children:
        kinds += _family(child)
    return kinds


def wrapper_cost() -> tuple[float, float]:
    """What a wrapper adds to a call, in [s].

    To the part that is called, and to the one that calls it.
    """

    class Nothing:
        def work(self) -> None:
            """Do nothing."""

    meter, nothing = Meter(), Nothing()
    bare = _time_of(nothing.work)
    Nothing.work = meter.timed("nothing", Nothing.work)  # type: ignore[method-assign]
    whole = _time_of(nothing.work)
    inside = meter.spent["nothing"] / meter.calls["nothing"] - bare
    return max(inside, 0.0), max(whole - bare - inside, 0.0)


def _time_of(call: Callable[[], None]) -> float:
    began = time.thread_time()
    for _ in range(TRIALS):
        call()
    return (time.thread_time() - began) / TRIALS


def break_down(tasks: Sequence[EpisodeTask]) -> dict[str, Any]:
    """Drive some deliveries, after one that warms up.

    What each part took, without what the wrappers took.
    """
    drive(tasks[0])
    meter = Meter()
    with metered(meter):
        driven = [drive(task) for task in tasks]
    within, around = wrapper_cost()
    simulated, processor = (
        sum(each.simulated for each in driven),
        sum(each.processor for each in driven),
    )
    per_second = 1e3 / simulated
    parts = {
        name: per_second
        * max(spent - within * meter.calls[name] - around * meter.inner_calls[name], 0.0)
        for name, spent in meter.spent.items()
    }
    wrappers = per_second * (within + around) * sum(meter.calls.values())
    parts[REST] = max(per_second * processor - wrappers - sum(parts.values()), 0.0)
    return {
        "breakdown_ms_per_simulated_s": dict(
            sorted(parts.items(), key=lambda part: (part[0] == REST, -part[1]))
        ),
        "breakdown_wrappers_ms_per_simulated_s": wrappers,
    }
