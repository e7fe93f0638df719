"""Changing single values in the text of a parameter file.

Everything else stays as it is, comments included.
"""

import math
import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ruamel.yaml.error import YAMLError
from ruamel.yaml.nodes import MappingNode, ScalarNode, SequenceNode

from navstack.errors import ParameterError
from navstack.params.nav2_file.ros_yaml import (
    PARAMETERS,
    Document,
    NodeText,
    ParameterEntry,
    Value,
    end_index,
    is_alias,
    is_placeholder,
    parse_document,
)
from navstack.params.nav2_file.yaml_text import compose_text

_END = re.compile(r"^\.\.\.(?=\s|\Z)", re.MULTILINE)  # of a document
_DEEPEST = 1_000_000  # [characters] of an indent


class _Edit(NamedTuple):
    start: int
    end: int  # of the old text; nothing is taken out where it is the start
    new: str
    indent: int = 0  # of an added line: behind the same one the deeper comes first


def set_value(text: str, path: tuple[str, ...], name: str, value: Value, where: str) -> str:
    """:func:`set_values` with one change."""
    return set_values(text, [(path, name, value)], where)


def set_values(text: str, changes: Sequence[tuple[tuple[str, ...], str, Value]], where: str) -> str:
    """The text with parameters set: replaced where they stand, else added.

    Args:
        text: a parameter file.
        changes: of each parameter namespaces and name of its node, as nested in the file, its own
            dotted name, and the new value; a whole number stays a decimal where the file has one,
            and of a list what is between its entries stays, where there are as many as before.
        where: begins error messages.

    Raises:
        ParameterError: a value stands elsewhere, behind a YAML alias, or such an alias refers to
            it.
    """
    document = parse_document(text, where)
    replaced: dict[int, _Edit] = {}  # by where the old text begins
    added: list[_Edit] = []
    new_nodes: dict[tuple[str, ...], dict[str, Value]] = {}
    for path, name, value in changes:
        node = next((node for node in reversed(document.nodes) if node.path == path), None)
        if node is None or node.mapping is None or not node.mapping.value:
            new_nodes.setdefault(path, {})[name] = value
        elif name in node.entries:
            first, *more = _replacement(document, node, name, value, where)
            replaced[first.start] = first
            added += more
        else:
            added.append(_addition(document, node.mapping, name, value))
    edits = sorted([*replaced.values(), *added], key=lambda edit: (edit.start, -edit.indent))
    for start, end, new, _ in reversed(edits):
        text = text[:start] + new + text[end:]
    closing = _END.search(text)
    rest = "" if closing is None else text[closing.start() :]
    text = text.removesuffix(rest)
    for path, parameters in new_nodes.items():
        text += _new_node(text, path, parameters)
    return text + rest


def _new_node(text: str, path: tuple[str, ...], parameters: Mapping[str, Value]) -> str:
    """The lines of a node that a text does not have yet."""
    *namespace, name = path
    is_costmap = namespace == [name]
    root = "" if is_placeholder(path[0]) else "/"  # launch files put the slash in themselves
    keys = path if is_costmap or not namespace else (f"{root}{'/'.join(path)}",)
    indented = "".join(f"{'  ' * depth}{part}:\n" for depth, part in enumerate((*keys, PARAMETERS)))
    indent, added = "  " * (len(keys) + 1), f"\n{indented}"
    for name, value in parameters.items():
        added += f"{indent}{name}: {format_value(value)}\n"
    if text and not text.endswith("\n"):
        added = f"\n{added}"
    return added.replace("\n", _line_end(text))


def _replacement(
    document: Document, node: NodeText, name: str, value: Value, where: str
) -> list[_Edit]:
    """Another value for a parameter that the node has, and lines that are added to its list."""
    entry = node.entries[name]
    if entry.start < entry.name_end:
        raise ParameterError(
            f"{where}: line {entry.line}: {name} is a YAML alias; write its value out to change it"
        )
    if document.text[entry.start] == "&":
        advice = "which ROS refuses; write its value out to change it"
        raise ParameterError(f"{where}: line {entry.line}: {name} has a YAML anchor, {advice}")
    at = [each.start for other in document.nodes for each in other.entries.values()]
    if at.count(entry.start) > 1:
        raise ParameterError(
            f"{where}: line {entry.line}: {name} is shared by a YAML alias, which ROS refuses; "
            "write its value out to change it"
        )
    old = document.text[entry.start : entry.end]
    value = _kept_decimal(value, entry.value)
    known = entry.value
    if isinstance(value, list) and isinstance(known, list) and len(value) >= len(known):
        sequence = _sequence(old)
        if sequence is not None:
            items = _with_items(old, sequence, value, known)
            return [_Edit(entry.start, entry.end, items), *_lines(document, entry, sequence, value)]
    text = format_value(value)
    if old[:1].isspace() or not old:
        text = f" {text}"
    return [_Edit(entry.start, entry.end, text)]


def _with_items(old: str, sequence: SequenceNode, value: list[Value], known: list[Value]) -> str:
    """The text of a list with other entries in their places; those within brackets are added."""
    items = sequence.value
    if sequence.flow_style:
        more = "".join(f", {format_value(each)}" for each in value[len(known) :])
        end = items[-1].end_mark.index
        old = old[:end] + more + old[end:]
    for item, new, before in reversed(list(zip(items, value, known, strict=False))):
        if new != before or type(new) is not type(before):
            head, tail = old[: item.start_mark.index], old[item.end_mark.index :]
            old = head + format_value(new) + tail
    return old


def _lines(
    document: Document, entry: ParameterEntry, sequence: SequenceNode, value: list[Value]
) -> list[_Edit]:
    """The lines of what is added to a block list, behind the last one's comment."""
    if sequence.flow_style:
        return []
    end = _line_of(document.text, entry.end)
    begin = f"{_line_end(document.text)}{' ' * sequence.start_mark.column}- "
    more = value[len(sequence.value) :]
    # deeper than any parameter that is added behind the same line
    return [_Edit(end, end, "".join(f"{begin}{format_value(each)}" for each in more), _DEEPEST)]


def _line_of(text: str, index: int) -> int:
    """Where the line ends that has a character."""
    end = text.find("\n", index)
    if end < 0:
        end = len(text)
    return end - text[:end].endswith("\r")


def _sequence(old: str) -> SequenceNode | None:
    """A list's text as it is composed; None: it is something else, empty, or has aliases or lists.

    The text of a block list begins behind the colon.
    """
    try:
        root = compose_text(old)
    except YAMLError:  # an alias to what stands elsewhere
        return None
    if not isinstance(root, SequenceNode) or not root.value:
        return None
    starts = [item.start_mark.index for item in root.value]
    is_plain = all(isinstance(item, ScalarNode) for item in root.value)
    return root if is_plain and starts == sorted(set(starts)) else None


def _line_end(text: str) -> str:
    if "\r\n" in text:
        return "\r\n"
    return "\n"


def format_value(value: Value) -> str:
    """A value as ROS reads it back: decimals keep their point, texts are quoted."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float) and not math.isfinite(value):
        return {"inf": ".inf", "-inf": "-.inf", "nan": ".nan"}[str(value)]
    if isinstance(value, int | float):
        # YAML 1.1, by which launch files rewrite parameters, takes 1e-05 for a text
        return re.sub(r"^(-?\d+)e", r"\1.0e", repr(value))
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    return "[" + ", ".join(format_value(item) for item in value) + "]"


def _kept_decimal(new: Value, old: Value) -> Value:
    if isinstance(old, float) and isinstance(new, int) and not isinstance(new, bool):
        return float(new)
    if not (isinstance(old, list) and isinstance(new, list)):
        return new
    if any(isinstance(item, float) for item in (*old, *new)):
        return [_kept_decimal(item, 0.0) for item in new]  # ROS refuses a list of both
    return new


def _addition(document: Document, mapping: MappingNode, name: str, value: Value) -> _Edit:
    """A line below the last one of the innermost namespace that a node has for ``name``.

    Within braces it comes before the first entry: behind the last one a comment may follow.
    """
    text = document.text
    mapping, rest = _innermost(mapping, name)
    line = f"{rest}: {format_value(value)}"
    if mapping.flow_style:
        start = mapping.value[0][0].start_mark.index
        return _Edit(start, start, f"{line}, ")
    end = _line_of(text, end_index(mapping, text))
    indent = mapping.value[0][0].start_mark.column
    return _Edit(end, end, f"{_line_end(text)}{' ' * indent}{line}", indent)


def _innermost(mapping: MappingNode, name: str) -> tuple[MappingNode, str]:
    for key, child in reversed(mapping.value):
        is_section = isinstance(child, MappingNode) and child.value and not is_alias(key, child)
        if is_section and name.startswith(f"{key.value}."):
            return _innermost(child, name.removeprefix(f"{key.value}."))
    return mapping, name
