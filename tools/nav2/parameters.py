"""Writes what one distribution of Nav2 declares into ``navstack/params/registry/nav2/NAME.json``.

    python -m tools.nav2.parameters PATH/TO/navigation2 jazzy
    python -m tools.nav2.parameters PATH/TO/navigation2 rolling-next --name next

Reads the sources of a branch of a git repository, bare or not, without checking it out. The file
holds facts only: names, defaults, and the commit. For a new release: run it and review the diff.
"""

import argparse
import json
import math
import re
import subprocess
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from pathlib import Path, PurePosixPath
from typing import Any, NamedTuple

from tools.nav2 import places
from tools.nav2.calls import Declaration, declarations

FOLDER = Path(__file__).parents[2] / "navstack/params/registry/nav2"
_BASE = re.compile(r"\bclass\s+(\w+)\s*(?:final\s*)?:\s*public\s+(?:\w+::)*(\w+)")
_VARIABLE = re.compile(r"<([^<>]*)>")
_WORD_START = re.compile(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")

Parameters = dict[str, Any]  # dotted name -> default


class Plugin(NamedTuple):
    """A class that a plugin description declares."""

    family: str
    type: str  # as a parameter file names it
    package: str  # folder at the top of the repository
    is_alone: bool  # its package has no other plugin


class Sources:
    """The text files of one commit."""

    def __init__(self, repository: Path, reference: str) -> None:
        self._repository = repository
        self.commit = self._git("rev-parse", f"{reference}^{{commit}}").strip()
        names = self._git("ls-tree", "-r", "--name-only", self.commit).splitlines()
        read = [name for name in names if name.endswith((".cpp", ".hpp", ".py", ".xml"))]
        self.names = [name for name in read if not places.NOT_READ.search(name)]
        self._texts: dict[str, str] = {}

    def matching(self, pattern: str) -> Iterator[str]:
        """The names that a regular expression matches from their begin."""
        return (name for name in self.names if re.match(pattern, name))

    def text(self, name: str) -> str:
        """The text of a file."""
        if name not in self._texts:
            self._texts[name] = self._git("show", f"{self.commit}:{name}")
        return self._texts[name]

    def _git(self, *arguments: str) -> str:
        command = ("git", "-C", str(self._repository), *arguments)
        found = subprocess.run(command, check=True, capture_output=True)
        return found.stdout.decode("utf-8", errors="replace")


def read_distribution(sources: Sources) -> dict[str, Any]:
    """Commit, nodes and plugins of a distribution."""
    nodes = {node: _of_node(sources, patterns) for node, patterns in places.NODES.items()}
    plugins: dict[str, dict[str, Parameters]] = {}
    of_hosts: dict[str, Parameters] = {}
    for plugin in _plugins(sources):
        own, of_host = _of_plugin(sources, plugin)
        plugins.setdefault(plugin.family, {})[plugin.type] = own
        host = places.HOSTS.get(plugin.family, "")
        of_hosts[host] = {**of_hosts.get(host, {}), **of_host}
    for table in (nodes, *plugins.values()):
        for name in table.keys() & of_hosts.keys():
            table[name] = {**of_hosts[name], **table[name]}
    there = {node: found for node, found in nodes.items() if found}
    return {"commit": sources.commit, "nodes": there, "plugins": plugins}


def _of_node(sources: Sources, patterns: list[str]) -> Parameters:
    found: Parameters = {}
    for pattern in patterns:
        for name in sources.matching(pattern):
            found |= {_dotted(each.name): each.default for each in _declared(sources, name)}
    return found


def _of_plugin(sources: Sources, plugin: Plugin) -> tuple[Parameters, Parameters]:
    """What a plugin declares in its own namespace, and what in its host's."""
    own: Parameters = {}
    of_host: Parameters = {}
    for name in _files_of(sources, plugin):
        for each in _declared(sources, name):
            variables = set(_VARIABLE.findall(each.name))
            if plugin.family in places.HOSTS:
                variables -= set(places.OF_HOST)
            if each.is_relative or variables:
                own[_dotted(each.name)] = each.default
            elif plugin.family in places.HOSTS:
                of_host[_dotted(each.name)] = each.default
    return own, of_host


def _dotted(name: str) -> str:
    """A name with ``polygons.*`` and the like in place of variables."""
    return _VARIABLE.sub(lambda found: _list_of(found.group(1)), name).strip(".").replace("..", ".")


def _list_of(variable: str) -> str:
    return next((list_ for part, list_ in places.LISTS if part in variable), "")


def _declared(sources: Sources, name: str) -> Iterator[Declaration]:
    for each in declarations(sources.text(name), name.endswith(".py")):
        if not places.NO_PARAMETERS.search(each.name):
            yield each


def _files_of(sources: Sources, plugin: Plugin) -> list[str]:
    """The files that declare a plugin's parameters: its bases' first, then its own."""
    package = f"{plugin.package}/"
    files = [name for name in sources.names if name.startswith(package)]
    files = [name for name in files if name.endswith((".cpp", ".hpp"))]
    extra = places.WHOLE_FOLDERS.get(plugin.type)
    if extra:
        return [name for name in files if re.search(extra, name)]
    if plugin.is_alone:
        return files
    bases = dict(pair for name in files for pair in _BASE.findall(sources.text(name)))
    lineage = [plugin.type.rpartition("::")[2]]
    if lineage[0] not in bases:
        lineage[0] += places.CRITIC
    while bases.get(lineage[-1]):
        lineage.append(bases.pop(lineage[-1]))
    stems = [_stem(kind) for kind in reversed(lineage)]
    stems[:0] = places.SHARED.get(plugin.family, ())
    return [name for stem in stems for name in files if _is_of(name, stem)]


def _is_of(name: str, stem: str) -> bool:
    found = PurePosixPath(name).stem.removesuffix("_impl")
    return found in (stem, *(stem.removesuffix(end) for end in places.LEFT_OUT))


def _stem(kind: str) -> str:
    """``SmacPlanner2D`` becomes ``smac_planner_2d``."""
    return (
        re.sub(r"(?<=[a-z])(\d)", r"_\1", _WORD_START.sub("_", kind)).replace("_2_D", "_2d").lower()
    )


def _plugins(sources: Sources) -> Iterator[Plugin]:
    for name in sources.matching(r".*\.xml$"):
        if "base_class_type" not in sources.text(name):
            continue
        package = name.partition("/")[0]
        classes = list(
            ElementTree.fromstring(f"<all>{_body(sources.text(name))}</all>").iter("class")
        )
        for each in classes:
            family = places.FAMILIES.get(each.get("base_class_type", "").strip())
            if family and _is_there(sources, package, each.get("type", "")):
                kind = each.get("type", "").replace("<>", "").replace("/", "::").strip()
                kind = places.as_named(family, kind)
                yield Plugin(family, kind, package, package in places.ONE_PLUGIN)


def _is_there(sources: Sources, package: str, kind: str) -> bool:
    """Whether a package has the class that its description names; some outlived theirs."""
    name = re.sub(r"<.*|.*(?:::|/)", "", kind.strip())
    files = (each for each in sources.names if each.startswith(package))
    pattern = rf"\b(class|using)\s+{name}\b|EXPORT_CLASS\([^)]*\b{name}\b"
    return any(re.search(pattern, sources.text(each)) for each in files)


def _body(text: str) -> str:
    """An XML file without its declaration."""
    return re.sub(r"<\?xml[^>]*\?>", "", text)


def plain(value: Any) -> Any:
    """A value as JSON has it: endless numbers are texts."""
    if isinstance(value, float) and not math.isfinite(value):
        return {"double": repr(value)}
    return value


def main() -> None:
    """Write the file of one branch."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("repository", type=Path)
    parser.add_argument("branch")
    parser.add_argument("--name", help="of the distribution, if it is not the branch's")
    given = parser.parse_args()
    found = read_distribution(Sources(given.repository, given.branch))
    path = FOLDER / f"{given.name or given.branch}.json"
    path.write_text(json.dumps(found, indent=1, sort_keys=True, allow_nan=False) + "\n")


if __name__ == "__main__":
    main()
