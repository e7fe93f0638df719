"""All malformed inputs."""

from . import (
    bags,
    files,
    maps,
    people,
    recordings,
    runs,
    streets,
    vectors,
    yaml_attacks,
)
from .case import Case

CASES: tuple[Case, ...] = tuple(
    case
    for module in (
        yaml_attacks,
        maps,
        people,
        files,
        runs,
        recordings,
        vectors,
        bags,
        streets,
    )
    for case in module.cases()
)
