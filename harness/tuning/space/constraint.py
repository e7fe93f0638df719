"""Limits that bind parameters together, such as ``sim_time * max_vel_x <= 3.0``.

Numbers, names, + - * / and brackets on both sides of one of <= < >= >: nothing else is understood,
and nothing is ever run as Python.
"""

import ast
import operator
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass

from harness.tuning.evaluation import Value
from navstack.errors import ParameterError, UnknownNameError

LONGEST = 200  # [characters]
_ARITHMETIC: Mapping[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}
_COMPARE: Mapping[type[ast.cmpop], Callable[[float, float], bool]] = {
    ast.LtE: operator.le,
    ast.Lt: operator.lt,
    ast.GtE: operator.ge,
    ast.Gt: operator.gt,
}


@dataclass(frozen=True, slots=True)
class Constraint:
    """One limit."""

    text: str
    tree: ast.Compare

    @property
    def names(self) -> frozenset[str]:
        """The parameters that it binds."""
        return frozenset(node.id for node in ast.walk(self.tree) if isinstance(node, ast.Name))

    def holds(self, point: Mapping[str, Value]) -> bool:
        """Whether a point keeps it; a division by zero does not."""
        try:
            left, right = (
                _value(side, point) for side in (self.tree.left, self.tree.comparators[0])
            )
        except ZeroDivisionError:
            return False
        return _COMPARE[type(self.tree.ops[0])](left, right)


def parse_constraint(text: str, names: Collection[str], where: str) -> Constraint:
    """Read a limit.

    Args:
        text: e.g. ``sim_time * max_vel_x <= 3.0``.
        names: of the numbers that it may speak of.
        where: begins error messages.

    Raises:
        ParameterError: it is none, or speaks of something else.
    """
    try:
        tree = None
        if len(text) <= LONGEST:
            tree = ast.parse(text, mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        tree = None
    if not isinstance(tree, ast.Compare) or len(tree.ops) != 1 or type(tree.ops[0]) not in _COMPARE:
        raise ParameterError(
            f"{where}: '{text}' is no constraint; write e.g. sim_time * max_vel_x <= 3.0"
        )
    for side in (tree.left, tree.comparators[0]):
        _check(side, text, names, where)
    return Constraint(text, tree)


def _check(node: ast.expr, text: str, names: Collection[str], where: str) -> None:
    if isinstance(node, ast.BinOp) and type(node.op) in _ARITHMETIC:
        _check(node.left, text, names, where)
        _check(node.right, text, names, where)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        _check(node.operand, text, names, where)
    elif isinstance(node, ast.Name):
        if node.id not in names:
            raise UnknownNameError(f"number in the constraint '{text}' of {where}:", node.id, names)
    elif not isinstance(node, ast.Constant) or type(node.value) not in (int, float):
        raise ParameterError(
            f"{where}: '{text}': only numbers, names of numbers, + - * / and brackets may stand "
            "there"
        )


def _value(node: ast.expr, point: Mapping[str, Value]) -> float:
    if isinstance(node, ast.BinOp):
        return _ARITHMETIC[type(node.op)](_value(node.left, point), _value(node.right, point))
    if isinstance(node, ast.UnaryOp):
        return -_value(node.operand, point)
    return float(point[node.id] if isinstance(node, ast.Name) else ast.literal_eval(node))
