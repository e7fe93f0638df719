"""A rule about plugins that run here and nowhere else."""

import itertools
from collections.abc import Iterator, Mapping

from navstack.params.lint.rule import Finding, RuleGroup
from navstack.params.lint.subject import Subject
from navstack.params.nav2_file.file import Nav2File
from navstack.params.nav2_file.findings import names_in
from navstack.params.registry.bindings import CRITICS, nested_params
from navstack.params.registry.entry import Params
from navstack.params.registry.nav2 import NAV2
from navstack.params.registry.nodes import FAMILIES

RULES = RuleGroup("Plugins")


def _own_plugins() -> Iterator[tuple[Params, str]]:
    """Parameters and type of each algorithm that Nav2 does not have."""
    for family, entries in FAMILIES.items():
        nested: Mapping[str, Params] = {}
        if family in CRITICS:
            nested = nested_params(CRITICS[family])
        for kind, entry in entries.items():
            params = entry.params or nested.get(kind)
            is_ours = not entry.releases and kind not in NAV2["families"][family]
            if params is not None and is_ours:
                yield params, kind


OWN: Mapping[Params, str] = dict(_own_plugins())
# a package of docs/examples that has a class of some
PACKAGE, PACKAGED = "nav2_contact_critic", ("ExpectedContact", "ExpectedContactCritic")


def own_plugins_of(nav2: Nav2File) -> list[str]:
    """The types of a file's plugins that Nav2 does not have."""
    visits = itertools.chain.from_iterable(nav2.visits.values())
    return sorted({OWN[visit.params] for visit in visits if visit.params in OWN})


@RULES.warning
def not_in_nav2(subject: Subject) -> Iterator[Finding]:
    """A plugin is this program's own.

    Why: Nav2 has no class of this name, so the server that lists it does not start on a robot; here
    it runs.
    """
    for node, visits in subject.nav2.visits.items():
        for visit in visits:
            if visit.params not in OWN:
                continue
            kind, name = OWN[visit.params], visit.prefix.removesuffix(".")
            advice = "on a robot, one of Nav2's in its place"
            if kind in PACKAGED:
                owner = name.rpartition(".")[0]
                known = subject.nav2.value(node, f"{owner}.default_critic_namespaces")
                if PACKAGE in names_in(known):
                    continue
                advice += f", or the package of docs/examples/{PACKAGE}"
            yield Finding(name, f"{kind} is this program's own", advice, node)
