"""The small faults that can be planted in a file: what :mod:`mutants` draws from."""

import ast
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
EQUIVALENT = Path(__file__).with_name("equivalent_mutants.txt")
ROUNDING = 1e-6  # floats up to this size only guard against rounding
COMPARED = {
    ast.Lt: ("<", "<="),
    ast.LtE: ("<=", "<"),
    ast.Gt: (">", ">="),
    ast.GtE: (">=", ">"),
    ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="),
}
OPERATED = {
    ast.Add: ("+", "-"),
    ast.Sub: ("-", "+"),
    ast.Mult: ("*", "/"),
    ast.Div: ("/", "*"),
    ast.FloorDiv: ("//", "/"),
    ast.Mod: ("%", "*"),
}
RENAMED = {
    "min": "max",
    "max": "min",
    "minimum": "maximum",
    "maximum": "minimum",
    "ceil": "floor",
    "floor": "ceil",
    "sin": "cos",
    "cos": "sin",
    "argmin": "argmax",
    "argmax": "argmin",
    "any": "all",
    "all": "any",
}


@dataclass(frozen=True, slots=True)
class Mutant:
    """One change of one file."""

    file: Path  # relative to the root
    line: int
    begin: int  # offsets into the file's bytes
    end: int
    text: str

    def applied(self, source: bytes) -> bytes:
        """The file with the change."""
        return source[: self.begin] + self.text.encode() + source[self.end :]

    @property
    def change(self) -> tuple[str, str, str]:
        """The file, and its line without and with the change, as EQUIVALENT has them."""
        source = (ROOT / self.file).read_bytes()
        start = source.rfind(b"\n", 0, self.begin) + 1
        lines = [
            text[start:].partition(b"\n")[0].decode().strip()
            for text in (source, self.applied(source))
        ]
        return str(self.file), f"- {lines[0]}", f"+ {lines[1]}"


class Finder(ast.NodeVisitor):
    """Collects the changes of a file: (node to replace or span, new text)."""

    def __init__(self, file: Path, source: bytes) -> None:
        self.file, self.source, self.found = file, source, list[Mutant]()
        self.starts = [0, *(match.end() for match in re.finditer(rb"\n", source))]

    def offset(self, line: int, column: int) -> int:
        """Where a place of the syntax tree stands in the file's bytes."""
        return self.starts[line - 1] + column

    def span(self, node: ast.expr) -> tuple[int, int]:
        """The bytes of an expression."""
        assert node.end_lineno is not None and node.end_col_offset is not None
        return self.offset(node.lineno, node.col_offset), self.offset(
            node.end_lineno, node.end_col_offset
        )

    def add(self, node: ast.expr, begin: int, end: int, text: str) -> None:
        self.found.append(Mutant(self.file, node.lineno, begin, end, text))

    def between(self, left: ast.expr, right: ast.expr, symbol: str, text: str) -> None:
        """Replace the operator between two operands."""
        begin, end = self.span(left)[1], self.span(right)[0]
        place = self.source.find(symbol.encode(), begin, end)
        if place >= 0 and b"#" not in self.source[begin:end]:
            self.add(left, place, place + len(symbol), text)

    def visit_Compare(self, node: ast.Compare) -> None:  # noqa: N802, D102
        left = node.left
        for operator, right in zip(node.ops, node.comparators, strict=True):
            if type(operator) in COMPARED:
                self.between(left, right, *COMPARED[type(operator)])
            left = right
        self.generic_visit(node)

    def visit_BinOp(self, node: ast.BinOp) -> None:  # noqa: N802, D102
        if type(node.op) in OPERATED and not (_is_text(node.left) or _is_text(node.right)):
            self.between(node.left, node.right, *OPERATED[type(node.op)])
        self.generic_visit(node)

    def visit_BoolOp(self, node: ast.BoolOp) -> None:  # noqa: N802, D102
        was, new = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
        self.between(node.values[0], node.values[1], was, new)
        self.generic_visit(node)

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:  # noqa: N802, D102
        if isinstance(node.op, ast.USub | ast.Not) and not isinstance(node.operand, ast.Constant):
            self.add(node, self.span(node)[0], self.span(node.operand)[0], "")
        self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> None:  # noqa: N802, D102
        begin, end = self.span(node.func)
        name = self.source[begin:end].decode().rpartition(".")[2]
        if name in RENAMED:
            self.add(node, end - len(name), end, RENAMED[name])
        elif name in ("abs", "fabs"):
            self.add(node, begin, end, "+")
        node.keywords = [each for each in node.keywords if each.arg != "strict"]
        self.generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> None:  # noqa: N802, D102
        text = _other_value(node.value)
        if text is not None:
            self.add(node, *self.span(node), text)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:  # noqa: N802, D102
        # not decorators and annotations
        for each in (*node.args.defaults, *node.args.kw_defaults, *node.body):
            if each is not None:
                self.visit(each)

    def visit_ClassDef(self, node: ast.ClassDef) -> None:  # noqa: N802, D102
        for each in node.body:
            self.visit(each)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:  # noqa: N802, D102
        if node.value is not None:
            self.visit(node.value)

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None:  # noqa: N802, D102
        """Leave messages as they are."""

    def visit_Raise(self, node: ast.Raise) -> None:  # noqa: N802, D102
        """Leave messages as they are."""


def _is_text(node: ast.expr) -> bool:
    return isinstance(node, ast.JoinedStr) or (
        isinstance(node, ast.Constant) and isinstance(node.value, str)
    )


def _other_value(value: object) -> str | None:
    if isinstance(value, bool):
        return str(not value)
    if isinstance(value, int):
        return str(value + 1)
    if isinstance(value, float) and math.isfinite(value) and not 0.0 < value <= ROUNDING:
        return repr(value * 1.5 if value else 1.0)
    return None


def read_equivalent() -> dict[tuple[str, str, str], str]:
    """Why no test could notice a mutant, by :attr:`Mutant.change`."""
    # the first one tells what this is
    blocks = EQUIVALENT.read_text(encoding="utf-8").split("\n\n")[1:]
    found = {}
    for block in blocks:
        file, before, after, *reason = block.splitlines()
        found[file, before, after] = " ".join(reason)
    return found


def find_mutants(paths: Sequence[str]) -> list[Mutant]:
    """Every mutant below files or folders, in their order."""
    files: list[Path] = []
    for path in paths:
        place = ROOT / path
        if place.is_file():
            files.append(place)
        else:
            files += place.rglob("*.py")
    found = []
    for file in sorted(files):
        source = file.read_bytes()
        finder = Finder(file.relative_to(ROOT), source)
        finder.visit(ast.parse(source))
        found += finder.found
    return found
