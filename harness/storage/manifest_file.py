"""The manifest of a run folder: read, changed, and what it says of changes by others."""

import contextlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from harness.storage.checksums import CHECKSUMS, changed_files, is_noted, write_checksums
from harness.storage.documents import json_text
from harness.storage.files import (
    locked,
    require_real_folders,
    sync_folder,
    write_text,
    writing,
)
from harness.storage.new_run import (
    ABLATION,
    CHECK,
    MANIFEST,
    MEETINGS_FILE,
    TUNED_STACK,
    TUNING,
    TUNING_DOCUMENT,
)
from harness.storage.parameters import FOLDER, parameter_folder
from harness.storage.rows import Row
from harness.storage.run_folder import JOURNAL
from harness.storage.texts import quoted
from navstack.errors import InputError
from navstack.params.strict import read_text

NEXT = "run.json.next"  # a manifest on its way
# entry of a manifest: deliveries of each stack by its name, where not all have as many
COUNTS = "episodes_of"
WITHIN = "within_usd"
EXTENDED = "extended_from"  # entry of a manifest: deliveries a stack before each extension
OTHER_STUDIES = {
    ABLATION: ("an ablation", "ablate"),
    CHECK: ("a check", "check"),
    TUNING: ("a tuning study", "tune"),
}


def other_study(folder: Path) -> tuple[str, str] | None:
    """What a folder holds that looks like a run and is more.

    Its kind, and the command that goes on with it.
    """
    parameters = parameter_folder(folder)
    return next(
        (known for mark, known in OTHER_STUDIES.items() if (parameters / mark).is_file()),
        None,
    )


def require_study(folder: Path, mark: str) -> None:
    """Check that a folder holds a study of one kind, given by its file of ``OTHER_STUDIES``.

    Raises:
        InputError: it holds another kind, or a run; the message names the command for that.
    """
    if (folder / FOLDER / mark).is_file():
        return
    wanted, _ = OTHER_STUDIES[mark]
    kind = wanted.partition(" ")[2]
    if other := other_study(folder):
        found, command = other
        way_on = f"it is {found}, so go on with navbench {command} --resume {quoted(folder)}"
    else:
        way_on = f"{FOLDER}/{mark} is missing; use navbench run --resume"
    raise InputError(f"'{folder}' is no {kind}: {way_on}")


def require_stack_name(name: str, where: str) -> None:
    """Check that a stack's name cannot lead into another folder: files are called by it.

    Raises:
        InputError: it can; names ``where`` it was found.
    """
    if Path(name).name != name or "\0" in name:
        raise InputError(f"{where}: stacks: {name!r} is not the name of a stack")


def no_run(folder: Path) -> str | None:
    """What a study without a table of deliveries is, and what to do; None: it is none."""
    known = other_study(folder)
    if known is None:
        return None
    kind, command = known
    if (folder / MEETINGS_FILE).is_file():
        stack = f"{quoted(folder)}:STACK"
        return (
            f"'{folder}' is {kind} by meetings, without a table of deliveries; navbench compare "
            f"{stack} {stack} compares two of its stacks"
        )
    if not (folder / TUNING_DOCUMENT).is_file():
        text = (
            f"'{folder}' is {kind}, not a run with its table; navbench {command} --resume "
            f"{quoted(folder)} finishes it"
        )
        if beside := newest_run(folder.resolve().parent):
            text += f"; the newest run beside it is {folder.parent / beside}"
        return text
    runs = sorted(manifest.parent for manifest in folder.glob(f"*/*/*/{MANIFEST}"))
    advice = f"navbench run --stack {quoted(folder / TUNED_STACK)} makes a run of its file"
    if runs:
        advice = f"give {runs[0]}, the deliveries on which its two files differ most"
    return f"'{folder}' is {kind} that is finished, and no run; {advice}"


def newest_run(parent: Path) -> str:
    """Name of the run whose table was written last in a folder; empty: there is none."""
    tables = [table for table in parent.glob("*/episodes.parquet") if not table.parent.is_symlink()]
    if not tables:
        return ""
    return str(max(tables, key=lambda table: table.stat().st_mtime).parent.name)


def read_manifest(folder: Path) -> dict[str, Any]:
    """Content of a run folder's ``run.json``; empty: it is damaged.

    Raises:
        InputError: there is none.
    """
    if not (folder / MANIFEST).is_file():
        runs = sorted(manifest.parent for manifest in folder.glob(f"*/{MANIFEST}"))
        advice = "give the folder that a run wrote"
        if runs:
            advice = f"give one of its {len(runs)} runs, e.g. {runs[0]}"
        raise InputError(f"'{folder}' holds no run: {MANIFEST} is missing; {advice}")
    try:
        content = json.loads(read_text(folder / MANIFEST))
    except (ValueError, RecursionError):
        return {}
    if not isinstance(content, dict):
        return {}
    return content


def extend_run(path: Path, episodes: int, seen: int | None = None) -> None:
    """Let a run have more episodes than it was made for; those that it has stay as they are.

    Args:
        path: of a run that :func:`create_run` made.
        episodes: of each stack, from now on.
        seen: of each stack, at which somebody has looked before deciding on more; None: nobody.

    Raises:
        InputError: the folder is in use, cannot be written, or holds no run.
    """
    require_real_folders(path)
    changes: Row = {"episodes": episodes}
    if seen is not None:
        changes[EXTENDED] = [*extended_from(path), seen]
    with writing(path), locked(path):
        _rewrite(path, changes)


def share_out(path: Path, counts: Mapping[str, int], within: float) -> None:
    """Let each stack of a run have so many episodes, none fewer than it has.

    Args:
        path: of a run that :func:`create_run` made.
        counts: by the stacks' names; at most as many as the run was made for.
        within: [USD] that each stack's margin may lie off; until then more is shared out.

    Raises:
        InputError: the folder is in use, cannot be written, or holds no run.
    """
    require_real_folders(path)
    with writing(path), locked(path):
        _rewrite(path, {COUNTS: dict(counts), WITHIN: within})


def shared_within(path: Path) -> float | None:
    """The ``within`` of :func:`share_out`; None: nothing was shared out."""
    noted = read_manifest(path).get(WITHIN)
    if isinstance(noted, int | float):
        return float(noted)
    return None


def extended_from(path: Path) -> list[int]:
    """With how many deliveries a stack a run was looked at before it got more; by its manifest."""
    noted = read_manifest(path).get(EXTENDED, [])
    if not isinstance(noted, list):
        return []
    return [count for count in noted if isinstance(count, int)]


def require_unchanged(path: Path) -> None:
    """Check that a run folder is as the program left it.

    Raises:
        InputError: it was changed.
    """
    if (path / NEXT).exists():  # a program was killed
        with contextlib.suppress(OSError, InputError), locked(path):
            finish_rewriting(path)
    if changed := changed_files(path, not (path / JOURNAL).exists()):
        way_on = f"go on with --resume {quoted(path)} --force, which marks the run as mixed"
        marks = {f"{FOLDER}/{mark}" for mark in OTHER_STUDIES}
        if other_study(path) or marks & {*changed}:  # whose commands take no --force
            way_on = "begin anew in another folder"
        raise InputError(
            f"run folder '{path}' was changed since it was written: {', '.join(changed[:3])}; "
            f"restore it, or {way_on}"
        )


def accept_changes(path: Path) -> None:
    """Take a run folder as it is, and let its manifest say what was changed."""
    if changed := changed_files(path, not (path / JOURNAL).exists()):
        with locked(path):
            _rewrite(path, {"mixed": sorted({*mixed_files(path), *changed})})


def mixed_files(path: Path) -> list[str]:
    """Files of a run that were changed, and taken as they were; by its manifest."""
    noted = read_manifest(path).get("mixed", [])
    if not isinstance(noted, list):
        return []
    return [str(name) for name in noted]


def _rewrite(path: Path, changes: Row) -> None:
    """Change entries of a manifest, in a folder that is locked.

    Raises:
        InputError: it is damaged.
    """
    content = read_manifest(path)
    if not content:
        raise InputError(f"'{path / MANIFEST}' is damaged; restore it, or begin a new run")
    manifest = json_text({**content, **changes})
    if not (path / CHECKSUMS).exists():
        write_text(path / MANIFEST, manifest)
        return
    try:
        write_text(path / NEXT, manifest)
        write_checksums(path, {MANIFEST: manifest})
    finally:
        finish_rewriting(path)


def finish_rewriting(path: Path) -> None:
    """Put a manifest in its place that an interrupt or a full disk left beside it, if it is due."""
    if not (path / NEXT).is_file():
        return
    if is_noted(path, MANIFEST, (path / NEXT).read_bytes()):
        (path / NEXT).replace(path / MANIFEST)
        sync_folder(path)
    else:
        (path / NEXT).unlink()
