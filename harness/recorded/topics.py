"""Which topics of a bag are read: the user's, the only one of a type, or the usual name."""

from collections.abc import Iterable, Mapping

from harness.recorded.ros_messages import (
    COMMAND_TYPES,
    FIX,
    IMU,
    ODOMETRY,
    POSE_COVARIANCE,
    SCAN,
    TRANSFORM_TYPES,
    TWIST,
)
from navstack.errors import InputError, UnknownNameError, did_you_mean

# The name that a remapping replaces comes first; then the names that are taken where several topics
# have the type.
USUAL_NAMES: dict[str, tuple[str, ...]] = {
    SCAN: ("/scan", "/base_scan", "/laser_scan", "/scan_raw"),
    ODOMETRY: ("/odom", "/wheel_odom", "/odometry"),
    IMU: ("/imu/data", "/imu", "/imu/data_raw"),
    FIX: ("/fix", "/gps/fix", "/navsat/fix"),
    TWIST: ("/cmd_vel", "/cmd_vel_smoothed", "/cmd_vel_nav", "/cmd_vel_unstamped"),
    POSE_COVARIANCE: ("/amcl_pose", "/belief", "/pose"),
}
# types that stand for each other
SAME_USE: dict[str, tuple[str, ...]] = {TWIST: COMMAND_TYPES}
# of poses that a localizer is told, not its own; taken only where the user says so
STARTS = ("/initialpose", "/set_pose")
TF, TF_STATIC = "/tf", "/tf_static"


class Topics:
    """The topics of a bag, with the user's remappings."""

    def __init__(
        self,
        types: Mapping[str, str],
        counts: Mapping[str, int],
        remaps: Iterable[str],
    ) -> None:
        """Read the remappings.

        Args:
            types: the type of each topic.
            counts: how many messages each topic has.
            remaps: ``usual:=actual`` each, or ``actual:=usual``, as one gives them to a node or to
                a player.

        Raises:
            InputError: a remapping has another form, or names no topic of the bag.
        """
        self._types, self._counts = types, counts
        self._chosen: dict[str, str] = {}
        known = {names[0] for names in USUAL_NAMES.values()} | {TF, TF_STATIC}
        for text in remaps:
            left, arrow, right = text.partition(":=")
            if not arrow or not left or not right:
                raise InputError(f"--remap '{text}' is not USUAL:=ACTUAL, e.g. /scan:=/front/scan")
            usual, actual = (self._name(left), self._name(right))
            if actual in known and usual in types and usual not in known:
                usual, actual = actual, usual
            if usual not in known:
                raise UnknownNameError("topic to remap", usual, known)
            self._chosen[usual] = self.require(actual)

    def require(self, name: str) -> str:
        """A topic of the bag, with or without the slash that it begins with.

        Raises:
            InputError: the bag has no such topic.
        """
        name = self._name(name)
        if name not in self._types:
            known = ", ".join(sorted(self._types)[:20]) or "none"
            raise InputError(
                f"topic '{name}' is not in the bag{did_you_mean(name, self._types)}; it has: "
                f"{known}"
            )
        return name

    def _name(self, name: str) -> str:
        if name in self._types or name.startswith("/"):
            return name
        return f"/{name}"

    def is_chosen(self, name: str) -> bool:
        """Whether the user gave a topic for another."""
        return name in self._chosen.values()

    def type_of(self, name: str) -> str:
        """The type of a topic of the bag."""
        return self._types[name]

    def transforms(self) -> list[tuple[str, bool]]:
        """The topics of transforms, and whether they are static ones."""
        static, moving = self._chosen.get(TF_STATIC), self._chosen.get(TF)
        names = [name for name, kind in self._types.items() if kind in TRANSFORM_TYPES]
        topics = []
        for name in sorted(names):
            if name in (static, moving) or name.rsplit("/", 1)[-1] in ("tf", "tf_static"):
                topics.append((name, name == static or name.endswith("tf_static")))
        return topics

    def find(self, kind: str, apart_from: str | None) -> str | None:
        """The topic of a type to read; None: the bag has none.

        Args:
            kind: the type of its messages.
            apart_from: a topic that is read for another purpose and is taken only if there is no
                other.

        Raises:
            InputError: the topic that the user chose has another type, or there are several to
                choose from.
        """
        usual = USUAL_NAMES[kind]
        kinds = SAME_USE.get(kind, (kind,))
        if usual[0] in self._chosen:
            name = self._chosen[usual[0]]
            if self._types[name] not in kinds:
                raise InputError(
                    f"topic {name} is of the type {self._types[name]}, not {kind}; remap another "
                    "one"
                )
            return name
        names = sorted(name for name, its in self._types.items() if its in kinds)
        if kind == POSE_COVARIANCE:
            names = [name for name in names if not f"/{name}".endswith(STARTS)]
        names = [name for name in names if self._counts[name] > 0] or names[:1]
        names = [name for name in names if name != apart_from] or names
        if not names:
            return None
        if len(names) == 1:
            return names[0]
        for ending in usual:
            same = [name for name in names if f"/{name.lstrip('/')}" == ending]
            if same:
                return same[0]
            candidates = [name for name in names if name.endswith(ending)]
            if len(candidates) == 1:
                return candidates[0]
        shown = ", ".join(names[:20])
        raise InputError(
            f"the bag has several topics of {kind}: {shown}; choose one with --remap "
            f"{usual[0]}:=TOPIC"
        )
