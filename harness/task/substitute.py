"""Plugins in the place of others, as ``--substitute NAME=TYPE`` asks for."""

import atexit
import dataclasses
import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from harness.storage.shipped import shipped
from harness.task.stack import Stack, absolute_files
from navstack.errors import InputError, did_you_mean
from navstack.params.nav2_file.catalog import plugin_type
from navstack.params.nav2_file.file import Nav2File, inspect_nav2
from navstack.params.nav2_file.ros_yaml import Value

DONORS = ("stock.yaml", "tuned.yaml")  # of params/nav2, asked before the others


def with_substitutes(stack: Stack, given: Sequence[str], allow_unknown: bool) -> Stack:
    """A stack whose Nav2 file has other plugins under the names that are given.

    What the file's own section says and the new plugin knows stays, such as the robot's speeds; the
    rest is taken from the first shipped file that has the plugin.

    Args:
        stack: of which there may be several.
        given: each NAME=TYPE, e.g. FollowPath=dwb_core::DWBLocalPlanner.
        allow_unknown: whether keys unknown to Nav2 are let pass.

    Raises:
        InputError: one of them is not NAME=TYPE, or the file has no plugin of that name.
        ParameterError: the file cannot be used with them.
    """
    if not given or not stack.nav2_file:
        return stack
    path = Path(stack.nav2_file)
    nav2 = inspect_nav2(path, allow_unknown)
    changes: dict[str, Value] = {}
    for text in given:
        name, found, kind = text.partition("=")
        if not (name and found and kind):
            raise InputError(
                f"--substitute '{text}' is not NAME=TYPE, e.g. FollowPath=dwb_core::DWBLocalPlanner"
            )
        changes |= _changes(nav2, name, plugin_type(kind))
    changes |= {f"{node}.yaml_filename": file for node, file in absolute_files(nav2).items()}
    return dataclasses.replace(
        stack, nav2_file=_kept(nav2.with_values(changes, allow_unknown), path.name)
    )


def _changes(nav2: Nav2File, name: str, kind: str) -> dict[str, Value]:
    """What to set for a plugin of another type, in every node that has one of that name."""
    nodes = [node for node, entries in nav2.parameters.items() if f"{name}.plugin" in entries]
    if not nodes:
        known = sorted(
            key[: -len(".plugin")]
            for each in nav2.parameters.values()
            for key in each
            if ".plugin" in key
        )
        raise InputError(
            f"--substitute: {nav2.path.name} has no plugin '{name}'{did_you_mean(name, known)}"
        )
    changes: dict[str, Value] = {}
    for node in nodes:
        own = nav2.parameters[node]
        changes |= {
            f"{node}.{key}": value
            for key, value in _donated(node, name, kind).items()
            if key not in own
        }
        changes[f"{node}.{name}.plugin"] = kind
    return changes


def _donated(node: str, name: str, kind: str) -> dict[str, Value]:
    """The parameters of a plugin of a type in a shipped file, under another name.

    Empty: Nav2's defaults.
    """
    folder = shipped("params") / "nav2"
    first = [folder / donor for donor in DONORS]
    for path in (*first, *sorted(set(folder.iterdir()) - set(first))):
        entries = inspect_nav2(path).parameters.get(node, {})
        owner = next(
            (
                key[: -len("plugin")]
                for key, entry in entries.items()
                if _is_of(key, entry.value, kind)
            ),
            None,
        )
        if owner is not None:
            return {
                name + key[len(owner) - 1 :]: e.value
                for key, e in entries.items()
                if key.startswith(owner)
            }
    return {}


def _is_of(key: str, value: Value, kind: str) -> bool:
    return key.endswith(".plugin") and plugin_type(value) == kind


@cache
def _folder() -> Path:
    """Where changed files stand until the run's folder has them."""
    folder = tempfile.TemporaryDirectory(prefix="navbench-substitute-")
    atexit.register(folder.cleanup)
    return Path(folder.name)


def _kept(nav2: Nav2File, name: str) -> str:
    path = _folder() / name
    nav2.dump(path)
    return str(path)
