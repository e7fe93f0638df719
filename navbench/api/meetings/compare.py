"""Two stacks of a folder by meetings."""

from harness.ablation.analysis import AblationDeclaration
from harness.ablation.meetings import MeetingsArms
from harness.meetings.kept import FILE
from harness.study.stored_run import folder_and_stack
from navbench.api.meetings.ablate import arms_of_folder
from navstack.errors import InputError


def is_by_meetings(given: str) -> bool:
    """Whether FOLDER or FOLDER:STACK is of missions whose meetings were driven."""
    folder, _ = folder_and_stack(given)
    return (folder / FILE).is_file()


def compare_by_meetings(first: str, second: str) -> MeetingsArms:
    """Two stacks that met the same people: second minus first.

    Args:
        first: FOLDER:STACK, the baseline.
        second: another stack of the same folder.

    Raises:
        InputError: two folders, or a stack that is missing.
    """
    (folder, name), (other, other_name) = folder_and_stack(first), folder_and_stack(second)
    if folder.resolve() != other.resolve():
        raise InputError(
            f"'{first}' and '{second}': meetings are the same within one folder only; give two "
            "stacks of it, or runs of whole deliveries"
        )
    for given, stack in ((first, name), (second, other_name)):
        if stack is None:
            raise InputError(f"'{given}' has several stacks; give {given}:STACK")
    if name == other_name:
        raise InputError(f"'{first}' is given twice; give another stack of its folder")
    names = str(name), str(other_name)
    return arms_of_folder(folder, AblationDeclaration(names[1], names[0]), names)
