"""Declarations of parameters in a C++ or Python text of Nav2."""

import ast
import math
import re
from collections.abc import Iterator
from typing import Any, NamedTuple

_DECLARE = re.compile(
    r"\b(declare_or_get_parameter|declare_parameter_if_not_declared|declare_parameter"
    r"|declareParameter|add_parameter|searchAndGetParam|loadParameterWithDeprecation)"
    r"\s*(?:<([^<>]*(?:<[^<>]*>)?)>)?\s*\("
)
_GETTER = re.compile(r"auto\s+(\w+)\s*=\s*[\w.>()-]+getParamGetter\(([^;]*)\);")
_ALIAS = re.compile(r"(?:std::string|auto)\s+(\w+)\s*=\s*([^;]*\"[^;]*);")
_COMMENT = re.compile(r'//[^\n]*|/\*.*?\*/|("(?:\\.|[^"\\])*")', re.DOTALL)
_TEXT = re.compile(r'"((?:\\.|[^"\\])*)"')
_NUMBER = re.compile(r"(?<![\w.])((?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)[fFuUlL]*(?![\w.])")
# C++ types -> ROS's
_TYPES = {
    "double": "double",
    "float": "double",
    "bool": "bool",
    "int": "integer",
    "int64_t": "integer",
    "std::string": "string",
    "std::vector<std::string>": "string_array",
    "std::vector<double>": "double_array",
}
_WRAPPED = re.compile(
    r"^(?:rclcpp::ParameterValue|static_cast<(\w+)>|std::string)\s*[({](.*)[)}]$", re.DOTALL
)
_LIST = re.compile(r"^(std::vector<[\w:]+>)\s*[({]+(.*?)[)}]+$", re.DOTALL)
_CONSTANTS = {
    "M_PI": str(math.pi),
    "math.pi": str(math.pi),
    "std::numeric_limits<double>::infinity()": "1e999",
    "std::numeric_limits<float>::infinity()": "1e999",
}


class Declaration(NamedTuple):
    """One parameter."""

    name: str  # dotted; of a variable, its name in angle brackets
    default: Any  # {"type": ROS's} if it has none, None if neither is known
    is_relative: bool  # to the namespace of the plugin that declares it


def declarations(text: str, is_python: bool) -> Iterator[Declaration]:
    """The parameters that a text declares, in its order."""
    if is_python:
        yield from _of_python(text)
        return
    text = _COMMENT.sub(lambda found: found.group(1) or " ", text)
    given = list(_ALIAS.finditer(text))
    for found in _DECLARE.finditer(text):
        before = [each for each in given if each.end() <= found.start()]
        aliases = {each.group(1): _joined(each.group(2), {}) for each in before}
        arguments = _arguments(text, found.end())
        name = next((i for i, each in enumerate(arguments) if _is_name(each, aliases)), None)
        if name is not None:
            value = "".join(arguments[name + 1 : name + 2])
            is_relative = found.group(1) == "declareParameter"
            default = _default(value, found.group(2))
            dotted = _joined(arguments[name], aliases).rstrip(".")
            yield Declaration(dotted, default, is_relative)
    for found in _GETTER.finditer(text):
        prefix = _joined(found.group(2), {}).rstrip(".")
        for call in re.finditer(rf"\b{found.group(1)}\s*\(", text):
            arguments = _arguments(text, call.end())
            name_text = ".".join(filter(None, (prefix, _joined(arguments[1], {}))))
            yield Declaration(name_text, _default(arguments[2], None), False)


def _of_python(text: str) -> Iterator[Declaration]:
    for node in ast.walk(ast.parse(text)):
        is_call = isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)
        if is_call and node.func.attr == "declare_parameter" and len(node.args) > 1:
            name, default = node.args[:2]
            if isinstance(name, ast.Constant):
                value = _number(ast.unparse(default))
                if isinstance(default, ast.Constant):
                    value = default.value
                yield Declaration(str(name.value), value, False)


def _is_name(argument: str, aliases: dict[str, str]) -> bool:
    return '"' in argument or argument.partition(" ")[0] in aliases


def _joined(expression: str, aliases: dict[str, str]) -> str:
    """The dotted name of a sum of texts and variables: ``<polygon_name_>.points``.

    A missing dot behind a variable is a slip of the source (``navigate_to_pose.cpp`` of main).
    """
    name = ""
    for part in expression.split("+"):
        text = _TEXT.search(part)
        variable = part.strip().removeprefix("this->")
        if text:
            name += text.group(1)
        else:
            name += aliases.get(variable, f"<{variable}>" if variable else "")
    return name.replace(">", ">.").replace("..", ".").lstrip(".")


def _default(text: str, template: str | None) -> Any:
    """The value of an expression, or its type."""
    text = " ".join(text.split())
    kind = _TYPES.get(template or "")
    while (wrapped := _WRAPPED.match(text)) is not None:
        kind = _TYPES.get(wrapped.group(1) or "", kind)
        text = wrapped.group(2).strip()
    vector = _LIST.match(text)
    if vector:
        items = [_default(each, None) for each in _split(vector.group(2))]
        is_plain = all(not isinstance(item, dict) and item is not None for item in items)
        return items if items and is_plain else {"type": _TYPES.get(vector.group(1))}
    if re.fullmatch(r"rclcpp::(ParameterType::)?PARAMETER_\w+", text):
        return {"type": text.rpartition("PARAMETER_")[2].lower()}
    quoted = _TEXT.fullmatch(text)
    if quoted:
        return quoted.group(1)
    if text in ("true", "false"):
        return text == "true"
    if text == "" and kind == "string":
        return {"type": kind} if template else ""
    value = _number(text)
    if value is None:
        return {"type": kind} if kind else None
    return float(value) if kind == "double" else value


def _number(text: str) -> int | float | None:
    for name, value in _CONSTANTS.items():
        text = text.replace(name, value)
    text = re.sub(r"\b0x([0-9a-fA-F]+)\b", lambda found: str(int(found.group(1), 16)), text)
    is_single = re.search(r"\d[fF]\b", text) is not None
    plain = _NUMBER.sub(r"\1", text)
    if not re.fullmatch(r"[\d\s.eE+*/()-]+", plain) or not re.search(r"\d", plain):
        return None
    try:
        value = eval(plain, {"__builtins__": {}})  # numbers and signs only
    except (SyntaxError, TypeError, ZeroDivisionError, NameError):
        return None
    return float(value) if is_single else value


def _arguments(text: str, start: int) -> list[str]:
    """The arguments of a call, from behind its bracket."""
    depth, end, quote = 1, start, False
    while depth and end < len(text):
        char = text[end]
        if char == '"' and text[end - 1] != "\\":
            quote = not quote
        elif not quote:
            depth += (char in "([{") - (char in ")]}")
        end += 1
    return _split(text[start : end - 1])


def _split(text: str) -> list[str]:
    """The parts between commas at the outermost level."""
    parts, depth, begin, quote = [], 0, 0, False
    for i, char in enumerate(text):
        if char == '"' and text[i - 1 : i] != "\\":
            quote = not quote
        elif not quote:
            depth += (char in "([{<") - (char in ")]}") - (char == ">" and text[i - 1 : i] != "-")
            if char == "," and depth == 0:
                parts.append(text[begin:i].strip())
                begin = i + 1
    rest = text[begin:].strip()
    return [*parts, rest] if rest else parts
