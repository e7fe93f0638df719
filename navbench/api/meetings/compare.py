"""Two stacks of a folder by meetings."""

from pathlib import Path

from harness.ablation.analysis import AblationDeclaration
from harness.ablation.meetings import MeetingsArms
from harness.meetings.kept import FILE
from navbench.api.meetings.ablate import arms_of_folder
from navstack.errors import InputError


def is_by_meetings(given: str) -> bool:
    """Whether FOLDER or FOLDER:STACK is of missions whose meetings were driven."""
    return (_folder(given) / FILE).is_file()


def compare_by_meetings(first: str, second: str) -> MeetingsArms:
    """Two stacks that met the same people: second minus first.

    Args:
        first: FOLDER:STACK, the baseline.
        second: another stack of the same folder.

    Raises:
        InputError: two folders, or a stack that is missing.
    """
    folder, other = _folder(first), _folder(second)
    if folder.resolve() != other.resolve():
        raise InputError(
            f"'{first}' and '{second}': meetings are the same within one folder only; give two "
            "stacks of it, or runs of whole deliveries"
        )
    names = first.rpartition(":")[2], second.rpartition(":")[2]
    for given in (first, second):
        if Path(given).is_dir():
            raise InputError(f"'{given}' has several stacks; give {given}:STACK")
    if names[0] == names[1]:
        raise InputError(f"'{first}' is given twice; give another stack of its folder")
    return arms_of_folder(folder, AblationDeclaration(names[1], names[0]), names)


def _folder(given: str) -> Path:
    if Path(given).is_dir():
        return Path(given)
    return Path(given.rpartition(":")[0])
