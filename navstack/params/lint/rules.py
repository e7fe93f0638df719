"""The table of all rules."""

from collections.abc import Iterator

from navstack.params.lint import (
    costmaps,
    dwb_limits,
    dwb_scoring,
    filters,
    goal,
    layers,
    localization,
    mppi,
    never,
    plugins,
    robot,
    safety,
    speed,
    tree,
)
from navstack.params.lint.reader import MEANINGS
from navstack.params.lint.rule import Rule, RuleGroup
from navstack.params.lint.subject import Subject
from navstack.params.nav2_file.findings import Notice

_MODULES = (
    tree,
    plugins,
    never,
    dwb_limits,
    dwb_scoring,
    mppi,
    goal,
    speed,
    safety,
    layers,
    filters,
    costmaps,
    localization,
    robot,
)
GROUPS: tuple[RuleGroup, ...] = tuple(module.RULES for module in _MODULES)
RULES: tuple[Rule, ...] = tuple(rule for group in GROUPS for rule in group.rules)


def catalog() -> str:
    """Every finding there is, as Markdown: what it means, or what it does to a real robot."""
    groups = {
        **{title: list(meanings.items()) for title, meanings in MEANINGS.items()},
        **{group.title: [(rule.id, _meaning(rule)) for rule in group.rules] for group in GROUPS},
    }
    sections = (
        f"## {title}\n\n" + "".join(f"- **`{each}`** {text}\n" for each, text in findings)
        for title, findings in groups.items()
    )
    return "\n".join(sections)


def _meaning(rule: Rule) -> str:
    text = f"{rule.title}: {rule.why}."
    if rule.is_error:
        text += " (Error)"
    return text


def rule_notices(subject: Subject) -> Iterator[Notice]:
    """What the rules find in a file; see :func:`navstack.lint.lint`."""
    for rule in RULES:
        for node, finding in rule.findings(subject):
            message, line = f"{finding.found}; {rule.why}", subject.line(node, finding.name)
            yield Notice(
                rule.id, f"{node}: {finding.name}", message, finding.advice, line, rule.is_error
            )
