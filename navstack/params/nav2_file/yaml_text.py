"""YAML within bounds: whatever could make it endless is refused while it is being read."""

import copy
from collections.abc import Callable
from functools import lru_cache
from typing import Any, TypeVar

from ruamel.yaml import YAML
from ruamel.yaml.composer import Composer, ComposerError
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import AliasEvent
from ruamel.yaml.nodes import Node
from ruamel.yaml.scanner import Scanner

from navstack.errors import ParameterError

T = TypeVar("T")

MAX_CHARACTERS = 400_000  # a Nav2 file has about 10 kB
MAX_DEPTH = 40  # levels of nesting; a Nav2 file has about eight
MAX_VALUES = 20_000  # keys and values, after expanding aliases; a Nav2 file has about a thousand
_ENDS = "\0\r\n#"  # what ends a plain scalar behind blanks
_DIGITS = "Exceeds the limit"  # begins what Python says of an endless integer


class _BoundedComposer(Composer):
    """Refuses deep nesting, too many values, and aliases that multiply or contain themselves."""

    def __init__(self, loader: Any = None) -> None:
        super().__init__(loader)
        self._level = 0
        self._values = 0
        self._sizes: dict[str, int] = {}  # values of each finished anchor

    def compose_node(self, parent: Any, index: Any) -> Any:
        event = self.parser.peek_event()
        before = self._values
        self._level += 1
        if self._level > MAX_DEPTH:
            raise _refusal(event, f"nested too deeply; at most {MAX_DEPTH} levels are read")
        node = super().compose_node(parent, index)
        self._level -= 1
        if isinstance(event, AliasEvent) and event.anchor not in self._sizes:
            raise _refusal(event, "an anchor contains itself; write the values out")
        self._values += self._sizes[event.anchor] if isinstance(event, AliasEvent) else 1
        if self._values > MAX_VALUES:
            raise _refusal(event, f"more than {MAX_VALUES} values after expanding aliases")
        if event.anchor is not None:
            self._sizes[event.anchor] = self._values - before
        return node


class _TabScanner(Scanner):
    """Takes tabs between tokens of a line, as libyaml does, by which ROS 2 reads its files.

    They never indent.
    """

    def scan_to_next_token(self) -> None:
        """Pass over blanks, comments and line breaks."""
        super().scan_to_next_token()
        while not self.allow_simple_key and self.reader.peek() == "\t":
            self.reader.forward()
            super().scan_to_next_token()

    def scan_plain_spaces(self, indent: Any, start_mark: Any) -> Any:
        """Blanks within a plain scalar, or those that end it."""
        length = 0
        while self.reader.peek(length) in (" ", "\t"):
            length += 1
        blanks = self.reader.prefix(length)
        if "\t" not in blanks:
            return super().scan_plain_spaces(indent, start_mark)
        self.reader.forward(length)
        if self.reader.peek() in _ENDS:
            return super().scan_plain_spaces(indent, start_mark)
        return [blanks]


def _refusal(event: Any, problem: str) -> ComposerError:
    return ComposerError(None, None, problem, event.start_mark)


def load_text(text: str, where: str) -> Any:
    """A YAML text as plain Python values; ``where`` begins every message.

    Raises:
        ParameterError: it is not YAML, or out of bounds.
    """
    if len(text) > MAX_CHARACTERS:
        raise ParameterError(f"{where}: {len(text)} characters; at most {MAX_CHARACTERS} are read")
    return copy.deepcopy(guarded(lambda: _values_of(text), where))


@lru_cache(maxsize=64)
def _values_of(text: str) -> Any:
    """The plain values of a YAML text; one that is read again is not parsed again."""
    return _reader().load(text)


@lru_cache(maxsize=8)  # files; what edits one reads the same text again
def compose_text(text: str) -> Node | None:
    """The nodes of a YAML text, with their places, which nobody changes.

    To be called within :func:`guarded`.
    """
    node: Node | None = _reader().compose(text)
    return node


def guarded(read: Callable[[], T], where: str) -> T:
    """What ``read`` returns.

    Raises:
        ParameterError: it found no valid YAML.
    """
    try:
        return read()
    except MarkedYAMLError as error:
        line = "?"
        if error.problem_mark:
            line = str(error.problem_mark.line + 1)
        problem = error.problem or error.context
        if error.problem_mark and "'\\t'" in str(problem):
            problem = "a tab stands where the line's indentation is; indent with spaces"
        raise ParameterError(f"{where}: line {line} is not valid YAML: {problem}") from None
    except (YAMLError, ValueError) as error:
        reason = _first_line(error)
        if reason.startswith(_DIGITS):
            reason = "a number with thousands of digits"
        raise ParameterError(f"{where}: is not valid YAML: {reason}") from None


def _reader() -> YAML:
    yaml = YAML(typ="safe", pure=True)
    yaml.Composer = _BoundedComposer
    yaml.Scanner = _TabScanner
    return yaml


def _first_line(error: Exception) -> str:
    return next(iter(str(error).splitlines()), type(error).__name__)
