"""The parameters of the people: ``people`` in a file of ``params/worlds``."""

from dataclasses import dataclass

from harness.task.study import MAX_PEDESTRIANS
from harness.world.ranges import POSITIVE, check_ranges
from navstack.errors import ParameterError, UnknownNameError
from navstack.types import Pose2D

MODEL_NAMES = ("random_walk", "social_force", "replay")
GOAL_CHOICES = ("random", "in_turn")
BEGINNINGS = ("setting_out", "stationary")
_PEOPLE = {
    "count": (0, MAX_PEDESTRIANS),
    "goals": (1, 10_000),
    "radius": (POSITIVE, 5.0),
    "height": (POSITIVE, 5.0),
    "speed": (POSITIVE, 20.0),
    "speed_std": (0.0, 20.0),
}


@dataclass(frozen=True, slots=True)
class SocialForceParams:
    """Accelerations of the social force model.

    The social part is Helbing & Molnar 1995 (Phys. Rev. E 51, 4282) with the values printed there;
    ``body_stiffness`` is the body compression of Helbing, Farkas & Vicsek 2000 (Nature 407, 487):
    1.2e5 kg/s2 over 80 kg.
    """

    relaxation_time: float = 0.5  # [s] in which somebody takes up the wanted velocity
    person_strength: float = 2.1  # [m2/s2] of the potential around a person
    person_range: float = 0.3  # [m] of the same
    look_ahead: float = 2.0  # [s] of the others' walking that the potential covers
    wall_strength: float = 10.0  # [m2/s2] of the potential along walls
    wall_range: float = 0.2  # [m] of the same
    sight_angle: float = 3.490659  # [rad] full angle (200 degrees) within which others count fully
    unseen_weight: float = 0.5  # [-] of those outside it
    top_speed: float = 1.3  # [-] of the own walking speed, at most
    body_stiffness: float = 1500.0  # [1/s2] of bodies that overlap
    # [-] weight of who is right behind, 1 of who is right ahead; None: by sight_angle
    anisotropy: float | None = None
    # [m2/s2] around the robot, on all sides alike; None: as around a person
    robot_strength: float | None = None
    robot_range: float | None = None  # [m] of the same; None: as around a person
    unaware: float = 0.0  # [-] share of people who do not notice the robot

    def __post_init__(self) -> None:
        """Check what the types cannot.

        Raises:
            ParameterError: a value out of range.
        """
        check_ranges(
            "social_force",
            self,
            positive="relaxation_time person_range wall_range top_speed",
            not_negative="person_strength look_ahead wall_strength sight_angle unseen_weight",
            shares="unaware",
            within={"body_stiffness": (0.0, 1e4)},  # which the physics step can still follow
        )
        if self.anisotropy is not None:
            check_ranges("social_force", self, shares="anisotropy")
        if (self.robot_strength is None) != (self.robot_range is None):
            raise ParameterError("social_force: give robot_strength and robot_range, or neither")
        if self.robot_range is not None:
            check_ranges(
                "social_force", self, positive="robot_range", not_negative="robot_strength"
            )


@dataclass(frozen=True, slots=True)
class ReplayParams:
    """A recording of people and where it is put."""

    file: str = ""  # CSV with columns id, t, x, y, or a UCY obsmat.txt; relative to the world file
    placement: Pose2D = Pose2D()  # of the recording's frame in the map frame
    frame_rate: float = 25.0  # [Hz] of the frame numbers of an obsmat.txt; UCY's videos
    # over and over, each delivery beginning at a random moment; false: once, from its beginning
    loop: bool = True

    def __post_init__(self) -> None:
        """Check what the types cannot.

        Raises:
            ParameterError: a value out of range.
        """
        check_ranges("replay", self, positive="frame_rate")


@dataclass(frozen=True, slots=True)
class PedestrianParams:
    """Who walks, and how; the values are those of the published evaluation unless noted.

    ``count`` and what follows ``height`` is not for a replay, whose recording says it all.
    """

    model: str = "random_walk"  # of MODEL_NAMES; random_walk: published
    count: int = 20
    radius: float = 0.3  # [m] of the body
    height: float = 1.7  # [m] of the body
    speed: float = 1.0  # [m/s] mean over people
    speed_std: float = 0.1  # [m/s] between people; ours, the published speed is "about 1 m/s"
    goals: int = 60  # random walkable points that all share; the published number is not known
    # 'random': any of them; 'in_turn': whoever sets out takes the next of the list
    goal_choice: str = "random"
    # 'setting_out': all do at once; 'stationary': each is somewhere along an errand
    beginning: str = "setting_out"
    pause_min: float = 2.0  # [s] standing at a goal
    pause_max: float = 5.0  # [s]
    agent_radius: float = 0.5  # [m] that paths keep from the edges of the walkable area
    start_clearance: float = 2.0  # [m] from the robot's start within which nobody starts; ours
    social_force: SocialForceParams = SocialForceParams()
    replay: ReplayParams = ReplayParams()

    def __post_init__(self) -> None:
        """Check what the types cannot.

        Raises:
            ParameterError: a value out of range.
            UnknownNameError: an unknown model, choice of goals or beginning.
        """
        for what, given, known in (
            ("model of people", self.model, MODEL_NAMES),
            ("goal_choice", self.goal_choice, GOAL_CHOICES),
            ("beginning", self.beginning, BEGINNINGS),
        ):
            if given not in known:
                raise UnknownNameError(what, given, known)
        if self.goal_choice == "in_turn" and self.model == "social_force":
            raise ParameterError(
                "pedestrians: goal_choice in_turn is for people who avoid nobody; where those of "
                "social_force go would "
                "hang on the robot: allowed with it is random"
            )
        check_ranges(
            "pedestrians",
            self,
            not_negative="pause_min agent_radius start_clearance",
            within=_PEOPLE,
        )
        if not self.pause_min <= self.pause_max:
            raise ParameterError(
                f"pedestrians: pause {self.pause_min}..{self.pause_max} s; it must be a range"
            )
