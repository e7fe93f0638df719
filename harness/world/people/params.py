"""The parameters of the people: ``people`` in a file of ``params/worlds``."""

from dataclasses import dataclass
from typing import Annotated

from harness.task.study import MAX_PEDESTRIANS
from navstack.costmap.occupancy_grid import FREE, OccupancyGrid
from navstack.errors import ParameterError
from navstack.ranges import Known, NotNegative, Parameters, Positive, Share, up_to, within
from navstack.types import Pose2D

MODEL_NAMES = ("random_walk", "social_force", "replay")
GOAL_CHOICES = ("random", "in_turn")
BEGINNINGS = ("setting_out", "stationary")
SHIPPED_COUNT, AREA_PER_PERSON = 20, 630.0  # people on a shipped map, and its mesh [m2] for each


@dataclass(frozen=True, slots=True)
class SocialForceParams(Parameters, whose="social_force"):
    """Accelerations of the social force model.

    The social part is Helbing & Molnar 1995 (Phys. Rev. E 51, 4282) with the values printed there;
    ``body_stiffness`` is the body compression of Helbing, Farkas & Vicsek 2000 (Nature 407, 487):
    1.2e5 kg/s2 over 80 kg.
    """

    relaxation_time: Positive = 0.5  # [s] in which somebody takes up the wanted velocity
    person_strength: NotNegative = 2.1  # [m2/s2] of the potential around a person
    person_range: Positive = 0.3  # [m] of the same
    look_ahead: NotNegative = 2.0  # [s] of the others' walking that the potential covers
    wall_strength: NotNegative = 10.0  # [m2/s2] of the potential along walls
    wall_range: Positive = 0.2  # [m] of the same
    # [rad] full angle (200 degrees) within which others count fully
    sight_angle: NotNegative = 3.490659
    unseen_weight: NotNegative = 0.5  # [-] of those outside it
    top_speed: Positive = 1.3  # [-] of the own walking speed, at most
    # [1/s2] of bodies that overlap; the physics step can follow up to 1e4
    body_stiffness: Annotated[float, within(0, 1e4)] = 1500.0
    # [-] weight of who is right behind, 1 of who is right ahead; None: by sight_angle
    anisotropy: Share | None = None
    # [m2/s2] around the robot, on all sides alike; None: as around a person
    robot_strength: NotNegative | None = None
    robot_range: Positive | None = None  # [m] of the same; None: as around a person
    unaware: Share = 0.0  # [-] share of people who do not notice the robot

    def _check_together(self) -> None:
        if (self.robot_strength is None) != (self.robot_range is None):
            raise ParameterError("social_force: give robot_strength and robot_range, or neither")


@dataclass(frozen=True, slots=True)
class ReplayParams(Parameters, whose="replay"):
    """A recording of people and where it is put."""

    file: str = ""  # CSV with columns id, t, x, y, or a UCY obsmat.txt; relative to the world file
    placement: Pose2D = Pose2D()  # of the recording's frame in the map frame
    frame_rate: Positive = 25.0  # [Hz] of the frame numbers of an obsmat.txt; UCY's videos
    # over and over, each delivery beginning at a random moment; false: once, from its beginning
    loop: bool = True


@dataclass(frozen=True, slots=True)
class PedestrianParams(Parameters, whose="pedestrians"):
    """Who walks, and how; the values are those of the published evaluation unless noted.

    A replay has count, ways and speeds of its recording; of what follows ``height`` it uses the
    clearance about the start.
    """

    # published: random_walk
    model: Annotated[str, Known("model of people", MODEL_NAMES)] = "random_walk"
    count: Annotated[int, within(0, MAX_PEDESTRIANS)] = 20
    radius: Annotated[float, up_to(5)] = 0.3  # [m] of the body
    height: Annotated[float, up_to(5)] = 1.7  # [m] of the body
    speed: Annotated[float, up_to(20)] = 1.0  # [m/s] mean over people
    # [m/s] between people; ours, the published speed is "about 1 m/s"
    speed_std: Annotated[float, within(0, 20)] = 0.1
    # random walkable points that all share; the published number is not known
    goals: Annotated[int, within(1, 10_000)] = 60
    # 'random': any of them; 'in_turn': whoever sets out takes the next of the list
    goal_choice: Annotated[str, Known("goal_choice", GOAL_CHOICES)] = "random"
    # 'setting_out': all do at once; 'stationary': each is somewhere along an errand
    beginning: Annotated[str, Known("beginning", BEGINNINGS)] = "setting_out"
    pause_min: NotNegative = 2.0  # [s] standing at a goal
    pause_max: float = 5.0  # [s]
    agent_radius: NotNegative = 0.5  # [m] that paths keep from the edges of the walkable area
    # [m] from the robot's start within which nobody starts; ours
    start_clearance: NotNegative = 2.0
    social_force: SocialForceParams = SocialForceParams()
    replay: ReplayParams = ReplayParams()

    def _check_together(self) -> None:
        if self.goal_choice == "in_turn" and self.model == "social_force":
            raise ParameterError(
                "pedestrians: goal_choice in_turn is for people who avoid nobody; where those of "
                "social_force go would hang on the robot: allowed with it is random"
            )
        if self.beginning == "stationary" and self.goals == 1 and self.pause_max == 0.0:
            raise ParameterError(
                "pedestrians: goals 1 and pause 0 s: errands take no time, of which beginning "
                "stationary draws a moment; allowed with it are more goals or pauses"
            )
        if not self.pause_min <= self.pause_max:
            raise ParameterError(
                f"pedestrians: pause {self.pause_min}..{self.pause_max} s; it must be a range"
            )


def people_on(mesh: OccupancyGrid, count: int) -> int:
    """How many people walk on a navigation mesh where ``count`` would on a shipped map's."""
    area = float((mesh.data == FREE).sum()) * mesh.resolution**2
    return round(count * area / (SHIPPED_COUNT * AREA_PER_PERSON))
