"""All that a command does can be done by an import: each calls a function of ``navbench``."""

import ast
import inspect
from pathlib import Path

import pytest

import navbench
from navbench.cli.app import COMMANDS, module_of

ROOT = Path(navbench.__file__).parents[1]
NAMES = [name for names in COMMANDS.values() for name in names]
FUNCTIONS = {  # else called as the command
    "map": ("make_map", "import_map", "measure_map"),
    "list": ("listing",),
    "cost-log": ("cost_log",),
    "drive": ("drive_robot",),
}
# of navbench.api.run: what ``run`` and ``resume`` do, but for what they raise when interrupted
BELOW = {"run": "drive"}


def called(file: Path) -> set[tuple[str, str]]:
    """Module and name of every function of ``navbench.api`` that a file calls."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    known: dict[str, tuple[str, str]] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and str(node.module).startswith("navbench.api"):
            for each in node.names:
                known[each.asname or each.name] = (str(node.module), each.name)
    found = set()
    for node in ast.walk(tree):
        match node:
            case ast.Call(func=ast.Name(id=name)) if name in known:
                found.add(known[name])
            case ast.Call(func=ast.Attribute(value=ast.Name(id=alias), attr=name)):
                if alias in known:
                    found.add((".".join(known[alias]), name))
    return found


@pytest.mark.parametrize("command", NAMES)
def test_a_command_calls_its_function(command: str) -> None:
    calls = called(ROOT.joinpath(*module_of(command).split(".")).with_suffix(".py"))
    for name in FUNCTIONS.get(command, (command,)):
        module = inspect.unwrap(getattr(navbench, name)).__module__
        assert (module, BELOW.get(name, name)) in calls


def test_what_a_command_calls_is_found(tmp_path: Path) -> None:
    file = tmp_path / "fly.py"
    file.write_text(
        "from navbench.api import money\nfrom navbench.api.runs import load as read\n"
        "def fly():\n    money.price(read('a'))\n    other.price()\n"
    )
    assert called(file) == {("navbench.api.money", "price"), ("navbench.api.runs", "load")}
