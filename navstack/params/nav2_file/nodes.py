"""Which sections of a file belong to which node: namespaces, wildcards, older names."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace

from navstack.errors import ParameterError, did_you_mean
from navstack.params.nav2_file.catalog import nearly_equal, node_block, node_kind, node_names
from navstack.params.nav2_file.findings import (
    MISSPELT,
    RENAMED,
    UNKNOWN_KEY,
    Findings,
    Notice,
    Parameters,
)
from navstack.params.nav2_file.ros_yaml import Document, NodeText, ParameterEntry
from navstack.params.registry import bindings, nodes
from navstack.params.registry.block import OPEN

MONITOR = "collision_monitor"
COSTMAPS = ("local_costmap", "global_costmap")  # each in a namespace of its own name
LIKE_A_NODE = 0.75  # similarity from which an unknown node is taken for a misspelt one
DEFAULT_TREES = (
    "navigate_to_pose_w_replanning_and_recovery.xml",
    "navigate_w_replanning_and_recovery.xml",
)


def is_wildcard(text: NodeText) -> bool:
    """Whether a section stands for several nodes, as ``/**`` does.

    That of ``/**/amcl`` is one node's, in whatever namespace.
    """
    return "*" in text.path[-1]


def node_name(text: NodeText) -> str:
    """The node of a section without wildcard, by today's name."""
    return nodes.NODE_ALIASES.get(text.path[-1], text.path[-1])


def default_path(node: str) -> tuple[str, ...]:
    """Where a node stands in a file of one robot."""
    if node in COSTMAPS:
        return (node, node)
    return (node,)


def new_path(document: Document, node: str) -> tuple[str, ...]:
    """Where a node that a file lacks would stand: in the namespace that all its others are in."""
    namespaces = set()
    for text in document.nodes:
        name = node_name(text)
        if not is_wildcard(text) and name in nodes.NODES:
            namespaces.add(text.path[: -len(default_path(name))])
    common = namespaces.pop() if len(namespaces) == 1 else ()
    if any("*" in part for part in common):  # which also stands for a costmap's own
        return (*common, node)
    return (*common, *default_path(node))


def sections_of(document: Document, node: str) -> list[NodeText]:
    """The sections that set parameters of a node, in the order of the file.

    In ROS 2 the last one wins. A section under today's name hides those under an older one. Of
    several robots' nodes it is the last one's.
    """
    own = [text for text in document.nodes if not is_wildcard(text) and node_name(text) == node]
    own = [text for text in own if text.path[-1] == node] or own
    # a namespace without wildcards goes before the others
    named = [text for text in own if not any("*" in part for part in text.path)] or own
    path = default_path(node)
    if named:
        path = named[-1].path
    full_name = "/" + "/".join(part for part in path if "*" not in part)
    return [
        text
        for text in document.nodes
        if (text in own or is_wildcard(text)) and _stands_for(text, full_name)
    ]


def owner_of(document: Document, node: str, dotted: str, is_shared: bool) -> tuple[str, ...]:
    """The path of the section in which a node's parameter stands, or should.

    Args:
        document: the file.
        node: by today's name.
        dotted: name of the parameter in the file.
        is_shared: whether other nodes read it there, too; then the node gets a value of its own.
    """
    sections = sections_of(document, node)
    holding = [text for text in sections if dotted in text.entries]
    own = [text for text in sections if not is_wildcard(text)]
    if is_shared and holding and is_wildcard(holding[-1]):
        if not own:
            holding = []
        elif sections.index(own[-1]) > sections.index(holding[-1]):
            holding = own
    for found in (holding, own):
        if found:
            return found[-1].path
    return new_path(document, node)


def entries_of(document: Document, node: str) -> dict[str, ParameterEntry]:
    """The parameters that a file sets for a node."""
    entries: dict[str, ParameterEntry] = {}
    for text in sections_of(document, node):
        entries |= text.entries
    return entries


def nodes_to_check(document: Document) -> list[str]:
    """The nodes of the file and those that this program reads.

    With a wildcard, every node of Nav2.
    """
    in_file = [node_name(text) for text in document.nodes if not is_wildcard(text)]
    names = [*in_file, *bindings.NODES]
    if any(is_wildcard(text) for text in document.nodes):
        names += nodes.NODES
    return list(dict.fromkeys(names))


def in_file(document: Document, node: str) -> bool:
    """Whether the file has a section of the node's own."""
    return any(node_name(text) == node for text in document.nodes if not is_wildcard(text))


def require_nodes(document: Document, where: str) -> None:
    """Check that a file holds a node of Nav2, without which every file drives by Nav2's defaults.

    Raises:
        ParameterError: it holds none; the message begins with ``where``.
    """
    own = [text for text in document.nodes if not is_wildcard(text)]
    if any(node_kind(node_name(text)) is not None for text in own):
        return
    if any(sections_of(document, node) for node in nodes.NODES):
        return
    first, *others = document.nodes
    more = f" and {len(others)} more" if others else ""
    hint = did_you_mean(first.path[-1], node_names())
    raise ParameterError(
        f"{where}: no node of Nav2 in it, but '{'/'.join(first.path)}'{more}{hint}"
    )


def node_notices(document: Document) -> list[Notice]:
    """Findings about the sections themselves."""
    notices: list[Notice] = []
    seen: dict[str, NodeText] = {}
    for text in document.nodes:
        if is_wildcard(text):
            continue
        path, name = "/".join(text.path), node_name(text)
        if node_block(name) is None:
            notices.append(_unknown_node(text))
            continue
        if name != text.path[-1]:
            notices.append(
                Notice(RENAMED, path, f"is an older name; read as '{name}'", line=text.line)
            )
        if name in COSTMAPS and len(text.path) == 1:
            message = f"Nav2 reads this node at {name}: {name}: ros__parameters"
            notices.append(
                Notice("costmap-namespace", path, message, "nest it twice", line=text.line)
            )
        if name in seen and "*" not in path + "/".join(seen[name].path):  # else both count
            before = "/".join(seen[name].path)
            message = f"{name} is given as {before} and as {path}; the last one is read"
            notices.append(Notice("several-namespaces", path, message, line=text.line))
        seen[name] = text
    return notices


def _unknown_node(text: NodeText) -> Notice:
    """A misspelt node of Nav2, or one of another package that shares the file."""
    path, name = "/".join(text.path), text.path[-1]
    if nearly_equal(name, [*nodes.NODES, *nodes.NODE_ALIASES], LIKE_A_NODE):
        hint = did_you_mean(name, node_names())
        return Notice("unknown-node", path, f"no node of Nav2{hint}", line=text.line, is_error=True)
    return Notice(
        "foreign-node", path, "no node of Nav2; its parameters are not read", line=text.line
    )


def tree_notices(parameters: Parameters) -> list[Notice]:
    """A behavior tree other than the one that runs here."""
    name = "default_nav_to_pose_bt_xml"
    entry = parameters.get("bt_navigator", {}).get(name)
    if entry is None:
        return []
    file = str(entry.value).rpartition("/")[2]
    if file in ("", *DEFAULT_TREES):
        return []
    message = f"'{file}' is not read; Nav2's {DEFAULT_TREES[0]} runs"
    return [Notice("behavior-tree", f"bt_navigator: {name}", message, line=entry.line)]


def joined_notices(document: Document, found: Mapping[str, Findings]) -> list[Notice]:
    """The findings of all nodes.

    One about a wildcard's line counts only if every node it stands for has it, but for those to
    which users add names.
    """
    notices: list[Notice] = []
    wildcards = {
        entry.line: text
        for text in document.nodes
        if is_wildcard(text)
        for entry in text.entries.values()
    }
    matched = {text.path: _matched(document, text, found) for text in wildcards.values()}
    for node, findings in found.items():
        for notice in findings.notices:
            text = wildcards.get(notice.line)
            if text is None:
                notices.append(notice)
                continue
            name = notice.path.partition(": ")[2]
            closed = [other for other in matched[text.path] if name not in found[other].added]
            if node == closed[0] and _all_have(notice, [found[other] for other in closed]):
                notices.append(replace(notice, path=f"/{'/'.join(text.path)}: {name}"))
    return notices


def _matched(document: Document, text: NodeText, found: Iterable[str]) -> list[str]:
    """The nodes that a wildcard stands for and whose parameters are known."""
    known = [node for node in found if not (node_block(node) or OPEN).is_open]
    return [node for node in known if text in sections_of(document, node)]


def _all_have(notice: Notice, findings: Iterable[Findings]) -> bool:
    return all(any(_same(notice, each) for each in some.notices) for some in findings)


def _same(one: Notice, other: Notice) -> bool:
    """Whether two findings are the same but for their node.

    What one node takes for misspelt, another may not know.
    """
    ids = {one.id, other.id}
    is_alike = len(ids) == 1 or ids == {UNKNOWN_KEY, MISSPELT}
    names = {each.path.partition(":")[2] for each in (one, other)}
    return is_alike and one.line == other.line and len(names) == 1


def _stands_for(text: NodeText, full_name: str) -> bool:
    """Whether a wildcard section stands for a node (rclcpp's parameter_map.cpp)."""
    pattern = "/" + "/".join(text.path)
    pattern = re.escape(pattern).replace(r"/\*\*", r"(/\w+)*").replace(r"/\*", r"(/\w+)")
    return re.fullmatch(pattern, full_name) is not None
