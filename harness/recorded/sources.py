"""What is read of a bag: the topics that a localizer needs, and where the sensors are."""

import math
from dataclasses import dataclass

from harness.recorded.bag import Bag
from harness.recorded.bag_file import BagError
from harness.recorded.messages import pose_of
from harness.recorded.mountings import Mountings, frame_name
from harness.recorded.moving_frame import Edge, is_of_base, odometry_edges
from harness.recorded.ros_messages import (
    FIX,
    IMU,
    ODOMETRY,
    POSE,
    POSE_COVARIANCE,
    SCAN,
    first_messages,
)
from harness.recorded.topics import USUAL_NAMES, Topics
from navstack.errors import InputError
from navstack.params.extensions import localizers

# by the inputs of a localizer
MESSAGES = {"odometry": ODOMETRY, "imu": IMU, "fix": FIX, "scan": SCAN}
REFERENCES = (POSE, POSE_COVARIANCE, ODOMETRY, FIX)
MOST_TRANSFORMS = 3000  # messages of a topic of transforms that are looked at
_MOVED, _TURNED = 0.1, 0.1  # [m], [rad] of a robot that certainly moves


@dataclass(frozen=True, slots=True)
class Choice:
    """The topics that are read of a bag."""

    topics: dict[str, str]  # by type of message: those that go to the localizer
    reference: str | None = None  # of the poses to compare with
    # frames of the odometry where its topic is one of transforms
    edge: Edge | None = None
    # whether every other message of the reference stays from the localizer, to be compared with
    is_held_out: bool = False
    has_twist: bool = True  # whether messages of odometry tell velocities

    @property
    def is_reference_input(self) -> bool:
        """Whether the reference goes to the localizer, too."""
        return self.reference in self.topics.values()

    @property
    def names(self) -> set[str]:
        """All of them."""
        return {*self.topics.values(), *filter(None, (self.reference,))}


def choose(
    localizer: str,
    topics: Topics,
    bag: Bag,
    reference: str | None,
    is_held_out: bool = False,
    base: str | None = None,
) -> Choice:
    """The topics that a localizer needs and can use.

    Raises:
        InputError: a needed one is missing, several could be meant, the reference has no poses, or
            it is to be held out and no input.
    """
    if reference is not None and topics.type_of(reference) not in REFERENCES:
        known = ", ".join(REFERENCES)
        raise InputError(
            f"reference {reference} is of the type {topics.type_of(reference)}; it must be one of "
            f"{known}"
        )
    entry = localizers()[localizer]
    needed, used = ([MESSAGES[each] for each in inputs] for inputs in (entry.inputs, entry.uses))
    counts, chosen, edge = bag.counts(), {}, None
    for kind in (*needed, *used):
        name = topics.find(kind, reference)
        if name is not None and counts[name] > 0:
            chosen[kind] = name
        elif kind == ODOMETRY and (moving := moving_frame(bag, topics, base)) is not None:
            chosen[kind], edge = moving
        elif kind in needed:
            raise _missing(localizer, bag, kind, name)
    if not chosen:
        raise BagError(f"the bag has nothing that localizer {localizer} could use")
    has_twist = ODOMETRY not in chosen or edge is not None or _tells_twist(bag, chosen[ODOMETRY])
    choice = Choice(chosen, reference, edge, is_held_out, has_twist)
    if is_held_out and not choice.is_reference_input:
        raise InputError(
            f"--hold-out: the reference is no input of localizer {localizer}; leave --hold-out out"
        )
    return choice


def moving_frame(bag: Bag, topics: Topics, base: str | None) -> tuple[str, Edge] | None:
    """A topic of transforms that has odometry, and between which frames.

    Where several frames move in the odometry's, it is that of the base, else the first.
    """
    others: list[tuple[str, Edge]] = []
    for name in (name for name, is_static in topics.transforms() if not is_static):
        for _, message in first_messages(bag, name, MOST_TRANSFORMS):
            found = [(name, edge) for edge in odometry_edges(message)]
            of_base = [each for each in found if is_of_base(each[1], base)]
            if of_base:
                return of_base[0]
            others += found[: 1 - len(others)]
    return others[0] if others else None


def _tells_twist(bag: Bag, topic: str) -> bool:
    """Whether odometry tells velocities; not so where its poses move while all are zero."""
    first = None
    for _, message in first_messages(bag, topic, bag.counts()[topic]):
        twist, place = message.twist.twist, pose_of(message)
        if twist.linear.x or twist.linear.y or twist.angular.z:
            return True
        first = first or place
        if first is None or place is None:
            continue
        turned = math.remainder(place[2] - first[2], math.tau)
        if math.dist(place[:2], first[:2]) > _MOVED or abs(turned) > _TURNED:
            return False
    return True


def note_of_edge(topic: str, edge: Edge) -> str:
    """The note that odometry is taken from a topic of transforms."""
    frames = " -> ".join(map(frame_name, edge))
    return f"there is no topic of odometry: it is taken from {frames} in {topic}"


def odometry_frame(bag: Bag, choice: Choice) -> str | None:
    """The frame that the odometry is of; None: there is no odometry."""
    if choice.edge is not None:
        return choice.edge[1]
    if ODOMETRY not in choice.topics:
        return None
    odometry = first_messages(bag, choice.topics[ODOMETRY], 1)
    return next((message.child_frame_id for _, message in odometry), None)


def _missing(localizer: str, bag: Bag, kind: str, name: str | None) -> BagError:
    usual = USUAL_NAMES[kind][0]
    what = f"has no message of {name}"
    if name is None:
        what = f"has no topic of {kind} (usually {usual})"
    where = "the bag"
    if bag.damage:
        where = f"{bag.damage}; what stands before that"
    has = (
        ", ".join(f"{topic} ({its})" for topic, its in sorted(bag.topics.items())[:20])
        or "no topic"
    )
    return BagError(f"{where} {what}, which localizer {localizer} needs; it has: {has}")


def read_transforms(bag: Bag, topics: Topics, mountings: Mountings) -> None:
    """Enter the frames of a bag, static ones last so that they stand."""
    for name, is_static in sorted(topics.transforms(), key=lambda topic: topic[1]):
        for _, message in first_messages(bag, name, MOST_TRANSFORMS):
            mountings.take(message, is_static)
