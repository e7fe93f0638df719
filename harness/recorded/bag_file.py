"""What every kind of bag file offers: its topics, an index of its messages, and their bytes."""

from abc import ABC, abstractmethod
from array import array
from dataclasses import dataclass, replace
from pathlib import Path

from navstack.errors import InputError

MOST_TOPICS = 10_000
# of the types that are read, per file: 80 minutes at 1 kHz; 40 bytes of index each
MOST_MESSAGES = 5_000_000
LARGEST_MESSAGE = 64_000_000  # [bytes]
# of the index: topic, time of arrival [ns], and three numbers that say where the message is
COLUMNS = 5
LONGEST_NAME = 256  # [characters] of a topic, type or frame; ROS allows 255
LATEST = 2**62  # [ns] of a time of arrival: the year 2116


class BagError(InputError):
    """A bag cannot be used at all."""


class DamageError(InputError):
    """A bag cannot be read beyond some place; what stands before it is good."""


@dataclass(frozen=True, slots=True)
class Topic:
    """A series of messages of one type."""

    name: str
    type: str  # as ROS 2 spells it: sensor_msgs/msg/LaserScan
    encoding: str  # of its messages: ros1 or cdr
    digest: str = ""  # MD5 sum of the type's definition; ROS 1 only


class BagFile(ABC):
    """A file of messages: it is scanned once from the beginning to its end or the first damage.

    What is read of it is bounded by what stands in the file, never by what the file declares.
    """

    def __init__(self, path: Path, types: frozenset[str]) -> None:
        """Prepare to scan; only messages of ``types`` go into the index."""
        self.path = path
        self.types = types
        self.topics: list[Topic] = []
        self.index = array("q")  # rows of COLUMNS numbers
        self.damage: str | None = None  # one line: where the file broke off

    def scan(self) -> None:
        """Find the topics and messages; ``damage`` says what cannot be read.

        Raises:
            BagError: it is no such file, or holds too much.
        """
        try:
            self._scan()
        except DamageError as error:
            self.damage = f"{self.path}: {error}"
        except OSError as error:
            self.damage = f"{self.path}: cannot be read: {error.strerror or error}"

    @abstractmethod
    def _scan(self) -> None:
        """Fill ``topics`` and ``index``; DamageError where that is no longer possible."""

    @abstractmethod
    def read(self, *place: int) -> bytes:
        """The bytes of a message, from the three numbers that the index has of it.

        Raises:
            DamageError: they cannot be read.
        """

    @abstractmethod
    def close(self) -> None:
        """Let go of the file."""

    def add_topic(self, topic: Topic) -> int:
        """Enter a topic; returns its number."""
        if len(self.topics) >= MOST_TOPICS:
            raise BagError(
                f"bag '{self.path}' has more than {MOST_TOPICS} topics; it cannot be genuine"
            )
        self.topics.append(replace(topic, name=printable(topic.name), type=printable(topic.type)))
        return len(self.topics) - 1

    def add_message(self, topic: int, time: int, *place: int) -> None:
        """Enter a message of a topic of ``types``."""
        if not 0 <= time < LATEST:
            raise DamageError(f"a message with the impossible time of {time} ns")
        if len(self.index) >= MOST_MESSAGES * COLUMNS:
            raise BagError(
                f"bag '{self.path}' has more than {MOST_MESSAGES} messages to read; split it"
            )
        self.index.extend((topic, time, *place))


def printable(text: str) -> str:
    """A name from a bag as it may be shown on a terminal."""
    return "".join(char if char.isprintable() else "?" for char in text[:LONGEST_NAME])


def type_name(name: str) -> str:
    """A message type as ROS 2 spells it."""
    package, _, rest = name.partition("/")
    if not rest or "/" in rest:
        return name
    return f"{package}/msg/{rest}"
