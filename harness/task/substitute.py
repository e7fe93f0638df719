"""Plugins in the place of others, as ``--substitute NAME=TYPE`` asks for."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

from harness.storage.shipped import shipped
from harness.task.made_files import made_file
from harness.task.stack import Stack, absolute_files
from navstack.errors import InputError, did_you_mean
from navstack.params.nav2_file.catalog import LEFT_OUT, node_block, plugin_type
from navstack.params.nav2_file.file import Nav2File, inspect_nav2
from navstack.params.nav2_file.findings import names_in, names_of
from navstack.params.nav2_file.ros_yaml import Value
from navstack.params.registry import bindings
from navstack.params.registry.nodes import FAMILIES

CONTROLLERS = "controller_server"  # the node of those that drive
CRITICS = "critics"  # of a controller's section: names that only its kind knows
CRITICS_OF = {family: FAMILIES[family] for family in bindings.CRITICS}
DONORS = ("stock.yaml", "tuned.yaml")  # of params/nav2, asked before the others


def with_substitutes(stack: Stack, given: Sequence[str], allow_unknown: bool) -> Stack:
    """A stack whose Nav2 file has other plugins under the names that are given.

    What the file's own section says and the new plugin knows stays, such as the robot's speeds; the
    rest is taken from the first shipped file that has the plugin.

    Args:
        stack: of which there may be several.
        given: each NAME=TYPE, e.g. FollowPath=dwb_core::DWBLocalPlanner; none in place of a type
            leaves a costmap's layer out.
        allow_unknown: whether keys unknown to Nav2 are let pass.

    Raises:
        InputError: one of them is not NAME=TYPE, the stack has no Nav2 file or that no plugin of
            that name, or no such plugin runs here.
        ParameterError: the file cannot be used with them.
    """
    wanted = [_parsed(text) for text in given]
    if not wanted:
        return stack
    if not stack.nav2_file:
        raise InputError(
            f"--substitute '{given[0]}' cannot be done: stack '{stack.name}' has no Nav2 file; "
            "give "
            "stacks that have one"
        )
    path = Path(stack.nav2_file)
    nav2 = inspect_nav2(path, allow_unknown)
    changes: dict[str, Value] = {}
    for name, kind in wanted:
        changes |= _changes(nav2, name, kind)
    if stack.is_policy and any(change.startswith(f"{CONTROLLERS}.") for change in changes):
        raise InputError(
            f"--substitute '{given[0]}' cannot be done: a policy drives stack '{stack.name}', and "
            f"the {CONTROLLERS} of its Nav2 file is not used"
        )
    changes |= {f"{node}.yaml_filename": file for node, file in absolute_files(nav2).items()}
    changed = nav2.with_values(changes, allow_unknown)
    return dataclasses.replace(stack, nav2_file=str(made_file(path.name, changed.document.text)))


def _parsed(text: str) -> tuple[str, str]:
    """Name and type of a NAME=TYPE.

    Raises:
        InputError: it is none.
    """
    name, _, kind = (part.strip() for part in text.partition("="))
    if not (name and kind):
        raise InputError(
            f"--substitute '{text}' is not NAME=TYPE, e.g. FollowPath=dwb_core::DWBLocalPlanner"
        )
    return name, plugin_type(kind)


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
        if kind == LEFT_OUT:
            changes |= _without(nav2, node, name)
            continue
        if refusal := _refusal(nav2, node, name, kind):
            raise InputError(f"--substitute '{name}={kind}' cannot be done: {refusal}")
        for key, value in _donated(node, name, kind).items():
            is_list = key == f"{name}.{CRITICS}"
            if key not in own or (is_list and _are_others(own[key].value, value)):
                changes[f"{node}.{key}"] = value
        changes[f"{node}.{name}.plugin"] = kind
    return changes


def _are_others(critics: Value, new: Value) -> bool:
    """Whether critics are those of another kind of controller than the new ones."""
    own = _family_of(critics)
    return own != "" and own != _family_of(new)


def _family_of(critics: Value) -> str:
    """Whose critics most of some are; empty: nobody's here."""
    names = names_in(critics)
    counts = {family: sum(map(known.__contains__, names)) for family, known in CRITICS_OF.items()}
    most = max(counts, key=lambda family: counts[family])
    return most if counts[most] else ""


def _without(nav2: Nav2File, node: str, name: str) -> dict[str, Value]:
    """The node's lists of layers without a name.

    Raises:
        InputError: the name is not that of a layer.
    """
    block = node_block(node)
    lists = {} if block is None else block.plugins
    changes: dict[str, Value] = {}
    for key, plugins in lists.items():
        names = names_of(nav2.parameters[node], key, plugins.defaults)
        if plugins.family == "layers" and name in names:
            changes[f"{node}.{key}"] = [other for other in names if other != name]
    if not changes:
        raise InputError(
            f"--substitute '{name}={LEFT_OUT}' cannot be done: only a costmap's layers can be left "
            "out; give a type that runs here"
        )
    return changes


def _refusal(nav2: Nav2File, node: str, name: str, kind: str) -> str:
    """Why a plugin of a type cannot have a name in a node; empty if it can."""
    block = node_block(node)
    lists = {} if block is None else block.plugins
    families = [
        plugins.family
        for key, plugins in lists.items()
        if name in names_of(nav2.parameters[node], key, plugins.defaults)
    ]
    # of what no list names, such as the controller in another one, all that the node may have
    families = families or [plugins.family for plugins in lists.values()]
    refusals = [nav2.catalog.refusal(family, kind) for family in families]
    return refusals[0] if refusals and all(refusals) else ""


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
