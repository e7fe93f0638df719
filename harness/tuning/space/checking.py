"""Whether a search space can be tried on a file, before anything is driven."""

import contextlib

from harness.tuning.sampler import Sampler
from harness.tuning.space.paths import AbsentError, locate, with_values
from harness.tuning.space.space import Space
from navstack.errors import InputError
from navstack.lint import refusals
from navstack.params.nav2_file.file import Nav2File


def check_space(
    space: Space,
    nav2: Nav2File,
    sampler: Sampler,
    allow_unknown: bool = False,
) -> None:
    """Check before anything is driven that a search space has points, and that a file takes them.

    Raises:
        InputError: no point keeps the constraints, or a parameter cannot be set where it stands.
    """
    if all(each.is_fixed for each in space.parameters):
        raise InputError(
            f"{space.name}: no parameter may have another value than the file's; give more levels, "
            "choices or wider ranges"
        )
    if sampler.ask() is None:
        raise InputError(
            f"{space.name}: no point was found beside the file's own that keeps the constraints; "
            "loosen them"
        )
    own = {}
    for path in (path for each in space.parameters for path in each.paths):
        with contextlib.suppress(AbsentError):  # another choice of a list brings it
            own[path] = locate(nav2, path).value
    with_values(nav2, own, allow_unknown)
    _check_choices(space, nav2, allow_unknown)


def _check_choices(space: Space, nav2: Nav2File, allow_unknown: bool) -> None:
    """Check that the file can be driven with each text that a parameter may have.

    What another choice of a list brings is left out.

    Raises:
        InputError: it cannot.
    """
    own = set(map(str, refusals(nav2)))
    for parameter in space.parameters:
        texts = [choice for choice in parameter.choices if isinstance(choice, str)]
        for text in [] if parameter.needs else texts:
            changed = with_values(nav2, dict.fromkeys(parameter.paths, text), allow_unknown)
            found = [each for each in map(str, refusals(changed)) if each not in own]
            if found:
                raise InputError(
                    f"{space.name}: {parameter.name}: the file cannot be driven with "
                    f"'{text}': {found[0]}"
                )
