"""The log of attempts: every candidate world that was driven to come nearer to the published rows."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness.calibration.declaration import Declaration
from harness.calibration.reading import METHODS, STANDING, Reading, published_count
from harness.calibration.verification import SECONDS_PER_HOUR, share_tests
from harness.durable_files import write_text
from harness.report.published import Published
from harness.valuation import OUTCOMES
from navstack.errors import InputError
from navstack.params.strict import read_text

VERIFICATION_SEED = 0  # of the one run on the frozen world, which no attempt may use


@dataclass(frozen=True, slots=True)
class Attempt:
    """One candidate world and what came of it."""

    name: str
    settings: dict[str, Any]  # in which values it differs from the shipped world
    outside: list[str]  # keys among them that are not free, or out of their range
    seed: int
    stacks: dict[str, dict[str, Any]]  # stack -> what it measured
    share_distance: float | None  # mean absolute difference of the outcome shares from the published ones
    least_p_holm: float | None  # of the tests of these shares


def attempt(name: str, readings: Mapping[str, Reading], declaration: Declaration, published: Published) -> Attempt:
    """What to keep of a candidate.

    Args:
        name: under which the log has it.
        readings: by stack, at least one.
        declaration: which parameters are free.
        published: the rows to come near to.

    Raises:
        InputError: the runs are of different worlds, or drove the deliveries of the verification.
    """
    settings = settings_of(readings)
    seeds = {reading.seed for reading in readings.values()}
    if len(seeds) != 1 or VERIFICATION_SEED in seeds:
        raise InputError(f"attempt '{name}': its runs have seeds {sorted(seeds)}; give runs of one seed, not of seed 0")
    tests = share_tests(readings, published)
    return Attempt(
        name=name,
        settings=settings,
        outside=[key for key, value in settings.items() if not _is_allowed(key, value, declaration)],
        seed=seeds.pop(),
        stacks={stack: _measured(reading, published) for stack, reading in readings.items()},
        share_distance=share_distance(readings, published),
        least_p_holm=min((test.p_holm for test in tests), default=None),
    )


def settings_of(readings: Mapping[str, Reading]) -> dict[str, Any]:
    """In which values the world of these runs differs from the shipped one.

    Raises:
        InputError: the runs are of different worlds.
    """
    driving = [reading for stack, reading in readings.items() if stack != STANDING[0]] or list(readings.values())
    settings = driving[0].settings
    for reading in readings.values():
        own = {key: value for key, value in settings.items() if reading in driving or not key.startswith("sensors.")}
        if reading.settings != own:
            raise InputError(f"'{reading.folder}' and '{driving[0].folder}' were driven in different worlds")
    return settings


def share_distance(readings: Mapping[str, Reading], published: Published) -> float | None:
    """Mean absolute difference of the outcome shares from the published ones; None: no stack stands for one."""
    differences = [
        abs(readings[stack].share(outcome) - published_count(method, outcome) / method.episodes)
        for stack, method in ((stack, published.methods[name]) for stack, name in METHODS.items())
        if stack in readings
        for outcome in OUTCOMES
    ]
    return sum(differences) / len(differences) if differences else None


def load_attempts(path: Path) -> list[Attempt]:
    """The log, in the order in which it was written; empty where there is none.

    Raises:
        InputError: it is damaged.
    """
    if not path.is_file():
        return []
    try:
        return [Attempt(**json.loads(line)) for line in read_text(path).splitlines()]
    except (ValueError, TypeError):
        raise InputError(f"{path}: is damaged; every line should be one attempt") from None


def require_new(name: str, path: Path) -> None:
    """Check that the log has no attempt of this name: attempts are counted, none is overwritten.

    Raises:
        InputError: it has one.
    """
    if any(known.name == name for known in load_attempts(path)):
        raise InputError(f"{path} has an attempt '{name}' already; give this one another name")


def append(entry: Attempt, path: Path) -> None:
    """Add an attempt to the log."""
    require_new(entry.name, path)
    path.parent.mkdir(parents=True, exist_ok=True)
    before = read_text(path) if path.is_file() else ""
    document = {name: getattr(entry, name) for name in entry.__slots__}
    write_text(path, before + json.dumps(document, allow_nan=False) + "\n")


def _is_allowed(key: str, value: Any, declaration: Declaration) -> bool:
    return key in declaration.free and declaration.free[key].allows(value)


def _measured(reading: Reading, published: Published) -> dict[str, Any]:
    still = published.methods[STANDING[1]].measured.avg_runtime_h * SECONDS_PER_HOUR
    rate = reading.injury_per_second.value or 0.0
    return {
        "n": reading.n,
        "errors": reading.errors,
        **reading.counts,
        **{key: interval.value for key, interval in reading.means.items()},
        "property_contacts": reading.property_contacts,
        "injury_usd_while_navdp_stands": rate * still,
    }
