"""Which distribution of Nav2 a file was written for."""

from collections import Counter
from collections.abc import Iterable, Mapping

from navstack.params.nav2_file.findings import (
    RENAMED,
    Known,
    Notice,
    Parameters,
    Visit,
    value_of,
)
from navstack.params.nav2_file.ros_yaml import ParameterEntry, Value
from navstack.params.registry.defaults import MODELLED, differing
from navstack.params.registry.entry import AlgorithmEntry
from navstack.params.registry.releases import RELEASES, Declared, span

VELOCITY_SMOOTHER = "velocity_smoother"
UNLIMITED = 1e9  # [m/s], [rad/s], [m/s2], [rad/s2], [s]
# of robot_model_type: each -> the distributions that have it
MODEL_TYPES = dict.fromkeys(("differential", "omnidirectional"), RELEASES[:2])
# families whose plugins have a name with a slash until Iron, and their class's since
SLASHED = ("planners", "behaviors", "navigators")
MOST_SHOWN = 4  # names of other distributions in one line


def releases_of_value(key: str, declared: Declared, entry: ParameterEntry) -> tuple[str, ...]:
    """The distributions that have a parameter, and the value that a file gives it."""
    if key == "robot_model_type":
        return MODEL_TYPES.get(str(entry.value), declared.releases)
    return declared.releases


def releases_of_plugin(family: str, given: str, entry: AlgorithmEntry) -> tuple[str, ...]:
    """The distributions that have a plugin, under the name that the file gives if it does."""
    if not given or family not in SLASHED:
        return entry.releases
    having = RELEASES[:4] if "/" in given else RELEASES[4:]
    return tuple(release for release in entry.releases if release in having)


def looks_like(names: Iterable[Known]) -> tuple[str, ...]:
    """The distributions that have most of a file's names, oldest first; all where it has none."""
    known = Counter(release for name in names for release in name.releases)
    most = max(known.values(), default=0)
    return tuple(release for release in RELEASES if known[release] == most)


def release_of(names: Iterable[Known]) -> str:
    """The distribution of a file: of those that it reads like, the one next to Jazzy."""
    here = RELEASES.index(MODELLED)
    return min(looks_like(names), key=lambda release: abs(RELEASES.index(release) - here))


def without_own_names(
    notices: Iterable[Notice], names: Iterable[Known], release: str
) -> tuple[Notice, ...]:
    """The findings less those that a name is another release's where that is the file's own."""
    own = {name.path for name in names if release in name.releases}
    return tuple(each for each in notices if each.id != RENAMED or each.path not in own)


def other_defaults(
    release: str, entries: Mapping[str, ParameterEntry], visits: Iterable[Visit]
) -> dict[str, ParameterEntry]:
    """What a node leaves out and a distribution sets otherwise than Jazzy, on line 0."""
    return {
        f"{visit.prefix}{name}": _default(value)
        for visit in visits
        for name, value in differing(visit.params, release).items()
        if f"{visit.prefix}{name}" not in entries
    }


def no_smoother(parameters: Parameters) -> dict[str, ParameterEntry]:
    """The parameters of a velocity smoother that passes every command on, on line 0.

    Nav2 brings one up since Humble.
    """
    rates = (
        value_of(parameters.get("controller_server", {}), "controller_frequency", 20.0),
        value_of(parameters.get("behavior_server", {}), "cycle_frequency", 10.0),
    )
    numbers = [rate for rate in rates if isinstance(rate, int | float)]
    values: dict[str, Value] = {
        "smoothing_frequency": max(numbers, default=20.0),
        "max_velocity": [UNLIMITED] * 3,
        "min_velocity": [-UNLIMITED] * 3,
        "max_accel": [UNLIMITED] * 3,
        "max_decel": [-UNLIMITED] * 3,
        "velocity_timeout": UNLIMITED,
    }
    return {name: _default(value) for name, value in values.items()}


def _default(value: Value) -> ParameterEntry:
    return ParameterEntry(value, 0, 0, 0, 0)


def release_notices(names: Iterable[Known]) -> list[Notice]:
    """One line about the names that the distribution of a file does not have."""
    names = list(names)
    likely = looks_like(names)
    others = [name for name in names if not set(likely) & set(name.releases)]
    if not others:
        return []
    shown = [f"{name.path} ({span(name.releases)})" for name in others[:MOST_SHOWN]]
    if len(others) > MOST_SHOWN:
        shown.append(f"{len(others) - MOST_SHOWN} more")
    message = f"looks like a file of Nav2 {' or '.join(likely)}, which lacks {', '.join(shown)}"
    return [Notice("release", "", message, line=others[0].line)]
