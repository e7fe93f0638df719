"""Parameter files as ROS 2 reads them (rcl_yaml_param_parser).

Nodes, dotted names, YAML 1.1 scalars.

The text is parsed into marked values, so that messages name lines and edits leave everything else
untouched.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from navstack.errors import ParameterError, did_you_mean
from navstack.params.nav2_file.yaml_text import compose_text, guarded
from navstack.params.strict import read_text

Scalar = bool | int | float | str
Value = Scalar | list["Value"]

MAX_BYTES = 400_000  # a Nav2 file has about 10 kB
PARAMETERS = "ros__parameters"

_TRUE = frozenset(("Y", "y", "yes", "Yes", "YES", "true", "True", "TRUE", "on", "On", "ON"))
_FALSE = frozenset(("N", "n", "no", "No", "NO", "false", "False", "FALSE", "off", "Off", "OFF"))
_INTEGER = re.compile(r"[+-]?(0[xX][0-9a-fA-F]+|0[0-7]*|[1-9][0-9]*)")
_DECIMAL = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_PLACEHOLDER = re.compile(r"\$\(.*\)|\$?\{.*\}|<.*>|[A-Z][A-Z0-9]*(_[A-Z0-9]+)+")
_NAME = re.compile(r"\w+|\*\*?", re.ASCII)  # of a node or namespace; * and ** stand for any
_TO_FILL_IN = re.compile(r"[$<{]")  # in a name: what launch files replace
_SPECIAL = re.compile(r"[+-]?\.?(inf|nan)", re.IGNORECASE)


def parse_scalar(text: str, quoted: bool = False) -> Scalar:
    """One scalar as rcl reads it: octal integers, ``1e-3`` a float, ``yes`` and ``on`` true."""
    if quoted:
        return text
    if text in _TRUE or text in _FALSE:
        return text in _TRUE
    if _INTEGER.fullmatch(text):
        return _integer(text)
    if _DECIMAL.fullmatch(text):
        return float(text)
    if _SPECIAL.fullmatch(text):
        return float(text.replace(".", ""))
    return text


def is_placeholder(value: object) -> bool:
    """Whether launch files replace a text.

    ``$(var x)``, ``${X}``, ``{{ x }}``, ``<namespace>`` and ``KEEPOUT_ENABLED`` are such.
    """
    return isinstance(value, str) and _PLACEHOLDER.fullmatch(value) is not None


def _integer(text: str) -> int | float:
    digits, base = text.lstrip("+-"), 10
    if digits[:2] in ("0x", "0X"):
        base = 16
    elif digits[0] == "0":
        base = 8
    value = int(digits, base)
    if text[0] == "-":
        value = -value
    if -(2**63) <= value < 2**63:
        return value
    return float(text)


@dataclass(frozen=True, slots=True)
class ParameterEntry:
    """One parameter of a file."""

    value: Value
    line: int  # counted from 1
    start: int  # [characters] where the value's text begins; of a block list, behind the colon
    end: int  # [characters] one past the value's text
    name_end: int  # [characters] one past the name; a value that starts before it is an alias


@dataclass(frozen=True, slots=True)
class NodeText:
    """What a file says about one node."""

    path: tuple[str, ...]  # namespaces and name, as nested in the file
    entries: dict[str, ParameterEntry]  # by dotted name
    line: int
    mapping: MappingNode | None  # below ros__parameters; None: nothing there


@dataclass(slots=True)
class Document:
    """A parameter file."""

    text: str
    nodes: list[NodeText] = field(default_factory=list)  # in the order of the file
    remarks: list[tuple[str, int, str]] = field(default_factory=list)  # kind, line, text


def load_document(path: Path) -> Document:
    """Read a parameter file.

    Raises:
        ParameterError: the file is not readable, not YAML, or not a mapping of nodes to
            ``ros__parameters``.
    """
    text = read_text(path)
    if len(text) > MAX_BYTES:
        raise ParameterError(
            f"{path}: {len(text)} characters; a Nav2 parameter file has at most {MAX_BYTES}"
        )
    return parse_document(text, str(path))


def parse_document(text: str, where: str) -> Document:
    """The document of a file's text; ``where`` begins every message."""
    return guarded(_Reader(text, where).read, where)


class _Reader:
    """Walks the YAML nodes of one file."""

    def __init__(self, text: str, where: str) -> None:
        self._where = where
        self._document = Document(text)
        self._met: set[int] = set()  # nodes that were read: a second visit is by an alias

    def read(self) -> Document:
        root = compose_text(self._document.text)
        if root is None or (isinstance(root, ScalarNode) and not root.value):
            raise ParameterError(f"{self._where}: is empty; nodes with {PARAMETERS} are expected")
        if not isinstance(root, MappingNode):
            raise ParameterError(
                f"{self._where}: line 1: a mapping of nodes to {PARAMETERS} is expected"
            )
        self._read_nodes((), root)
        if not self._document.nodes:
            raise ParameterError(f"{self._where}: no node with {PARAMETERS} in it")
        return self._document

    def _read_nodes(self, path: tuple[str, ...], mapping: MappingNode) -> None:
        for name, key, value in self._pairs(mapping, "".join(f"{part}/" for part in path)):
            line = key.start_mark.line + 1
            here = (*path, *(part for part in name.split("/") if part))
            self._check_names(here[len(path) :], line)
            if name == PARAMETERS:
                self._read_parameters(path, value, line)
            elif isinstance(value, MappingNode):
                self._read_nodes(here, value)
            elif _is_empty(value):
                self._remark(
                    "empty", line, f"{'/'.join(here)} has no content; ROS refuses such a file"
                )
            else:
                hint = ""
                if path:
                    hint = did_you_mean(path[-1], [PARAMETERS])
                raise ParameterError(
                    f"{self._where}: line {line}: '{'.'.join(here)}' stands outside {PARAMETERS}"
                    ", where ROS reads no value and refuses the file"
                    f"; expected <node>: {PARAMETERS}: <parameters>{hint}"
                )

    def _check_names(self, parts: tuple[str, ...], line: int) -> None:
        for part in parts:
            if not (_NAME.fullmatch(part) or _TO_FILL_IN.search(part)):
                message = f"'{part}' is no name of a node or namespace: letters, digits and _ are"
                self._remark("node-name", line, f"{message}; ROS refuses such a file")

    def _read_parameters(self, path: tuple[str, ...], value: Node, line: int) -> None:
        if not path:
            raise ParameterError(
                f"{self._where}: line {line}: {PARAMETERS} stands without a node name above it"
            )
        entries: dict[str, ParameterEntry] = {}
        mapping = None
        if isinstance(value, MappingNode):
            mapping = value
            self._flatten("", mapping, entries, "/".join(path))
        elif _is_empty(value):
            self._remark(
                "empty", line, f"{'/'.join(path)} has no parameters; ROS refuses such a file"
            )
        else:
            raise ParameterError(
                f"{self._where}: line {line}: {PARAMETERS} of {'/'.join(path)} is not a mapping"
            )
        self._document.nodes.append(NodeText(path, entries, line, mapping))

    def _flatten(
        self, prefix: str, mapping: MappingNode, entries: dict[str, ParameterEntry], node: str
    ) -> None:
        for name, key, value in self._pairs(mapping, f"{node}: {prefix}"):
            dotted, line = f"{prefix}{name}", key.start_mark.line + 1
            if isinstance(value, MappingNode | SequenceNode) and not value.value:
                kind = "section" if isinstance(value, MappingNode) else "list"
                message = f"{node}: {dotted} is an empty {kind}, which ROS takes for no value"
                self._remark("empty", line, f"{message}; nodes with it fail to start")
            if isinstance(value, MappingNode):
                self._flatten(f"{dotted}.", value, entries, node)
            elif _is_empty(value):
                self._remark(
                    "empty", line, f"{node}: {dotted} has no value; ROS refuses such a file"
                )
            else:
                if dotted in entries:
                    self._duplicate(f"{node}: {dotted}", line, entries.pop(dotted).line)
                start = value.start_mark.index
                is_block_list = isinstance(value, SequenceNode) and not value.flow_style
                if is_block_list and not is_alias(key, value):
                    start = self._document.text.index(":", key.end_mark.index) + 1
                read = self._value(value, f"{node}: {dotted}")
                end = end_index(value, self._document.text)
                entries[dotted] = ParameterEntry(read, line, start, end, key.end_mark.index)

    def _pairs(self, mapping: MappingNode, prefix: str) -> Iterator[tuple[str, ScalarNode, Node]]:
        """The last occurrence of each key of a mapping, merge keys resolved.

        ``prefix`` begins the names in remarks.
        """
        self._meet(mapping)
        last: dict[str, tuple[ScalarNode, Node]] = {}
        merged: list[tuple[str, ScalarNode, Node]] = []
        for key, value in mapping.value:
            line = key.start_mark.line + 1
            if not isinstance(key, ScalarNode):
                raise ParameterError(f"{self._where}: line {line}: a name is expected before ':'")
            if key.value == "<<" and isinstance(value, MappingNode):
                merged += self._pairs(value, prefix)
                continue
            if key.value in last:
                self._duplicate(
                    f"{prefix}{key.value}", line, last[key.value][0].start_mark.line + 1
                )
            last[key.value] = (key, value)
        yield from ((name, key, value) for name, key, value in merged if name not in last)
        yield from ((name, key, value) for name, (key, value) in last.items())

    def _value(self, node: Node, where: str) -> Value:
        self._meet(node)
        if isinstance(node, ScalarNode):
            return parse_scalar(node.value, quoted=node.style is not None)
        if isinstance(node, SequenceNode):
            values = [self._value(item, where) for item in node.value]
            if len({type(value) for value in values if not is_placeholder(value)}) > 1:
                message = f"{where} is a list of several kinds, such as 1 and 0.5"
                line = node.start_mark.line + 1
                self._remark("mixed-list", line, f"{message}; ROS refuses such a file")
            return values
        raise ParameterError(
            f"{self._where}: line {node.start_mark.line + 1}: {where} is a list of mappings"
        )

    def _meet(self, node: Node) -> None:
        """Note a visit, and a second one as an alias."""
        if id(node) in self._met:
            self._remark(
                "alias",
                node.start_mark.line + 1,
                "YAML aliases are in use; ROS's own reader refuses them",
            )
        self._met.add(id(node))

    def _duplicate(self, name: str, line: int, before: int) -> None:
        self._remark(
            "duplicate",
            line,
            f"{name} is given twice, in lines {before} and {line}; the last one is read",
        )

    def _remark(self, kind: str, line: int, text: str) -> None:
        if (kind, line, text) not in self._document.remarks:
            self._document.remarks.append((kind, line, text))


def end_index(node: Node, text: str) -> int:
    """One past the text of a node.

    Marks of block styles lie behind the line ends, blank lines and comments after it.

    Aliases within a block mapping count with their names: what they refer to stands elsewhere.
    """
    if isinstance(node, MappingNode) and not node.flow_style and node.value:
        return max(
            key.end_mark.index if is_alias(key, child) else end_index(child, text)
            for key, child in node.value
        )
    if isinstance(node, SequenceNode) and not node.flow_style and node.value:
        return end_index(node.value[-1], text)
    start, end = int(node.start_mark.index), int(node.end_mark.index)
    if isinstance(node, ScalarNode) and node.style in ("|", ">"):
        return start + len(text[start:end].rstrip())
    return max(start, end)


def is_alias(key: Node, value: Node) -> bool:
    """Whether the value of a key is a YAML alias: its text stands before the key."""
    return bool(value.start_mark.index < key.end_mark.index)


def _is_empty(node: Node) -> bool:
    return isinstance(node, ScalarNode) and node.style is None and not node.value
