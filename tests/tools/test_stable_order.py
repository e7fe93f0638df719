"""Which of equal values an order takes first must not depend on the processor's sorting network."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FOLDERS = ("navstack", "harness", "navbench", "tools")


def unstable_orders(source: str) -> Iterator[int]:
    """Lines with an order of indices by numpy that is not stable."""
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.Attribute | ast.Name | ast.Call):
            continue
        name = _name_of(node.func if isinstance(node, ast.Call) else node)
        if name == "argpartition":
            yield node.lineno
        elif name == "argsort" and isinstance(node, ast.Call):
            kinds = [each.value for each in node.keywords if each.arg in ("kind", "stable")]
            if [ast.unparse(kind) for kind in kinds] not in (["'stable'"], ["True"]):
                yield node.lineno


def _name_of(node: ast.expr) -> str:
    if isinstance(node, ast.Attribute):
        return node.attr
    return node.id if isinstance(node, ast.Name) else ""


@pytest.mark.parametrize("folder", FOLDERS)
def test_every_order_of_the_product_is_stable(folder: str) -> None:
    found = [
        f"{path.relative_to(ROOT)}:{line}"
        for path in sorted((ROOT / folder).rglob("*.py"))
        for line in unstable_orders(path.read_text(encoding="utf-8"))
    ]
    assert not found, f'give kind="stable": {", ".join(found)}'


@pytest.mark.parametrize(
    ("source", "is_found"),
    [
        ("np.argsort(a)", True),
        ("a.argsort()[:3]", True),
        ("np.argsort(a, kind='quicksort')", True),
        ("np.argsort(a, axis=0)", True),
        ("np.argpartition(a, 3)", True),
        ("from numpy import argsort\nargsort(a)", True),
        ("order = np.argpartition", True),
        ("np.argsort(a, kind='stable')", False),
        ("(-a).argsort(stable=True)", False),
        ("np.sort(a)", False),
    ],
)
def test_what_counts_as_unstable(source: str, is_found: bool) -> None:
    assert bool(list(unstable_orders(source))) == is_found
