"""A rule about plugins that run here and nowhere else."""

from collections.abc import Iterator, Mapping

from navstack.params.lint.rule import Finding, RuleGroup
from navstack.params.lint.subject import Subject
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


@RULES.warning
def not_in_nav2(subject: Subject) -> Iterator[Finding]:
    """A plugin is this program's own.

    Why: Nav2 has no class of this name, so the server that lists it does not start on a robot; here
    it runs.
    """
    for node, visits in subject.nav2.visits.items():
        for visit in visits:
            if visit.params in OWN:
                kind, name = OWN[visit.params], visit.prefix.removesuffix(".")
                yield Finding(
                    name,
                    f"{kind} is this program's own",
                    "on a robot, one of Nav2's in its place",
                    node,
                )
