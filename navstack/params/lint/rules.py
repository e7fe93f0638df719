"""The table of all rules, and the check of a file against them."""

from collections.abc import Iterator

from navstack.params.lint import (
    costmaps,
    dwb_limits,
    dwb_scoring,
    goal,
    layers,
    localization,
    mppi,
    plugins,
    robot,
    safety,
    speed,
    tree,
)
from navstack.params.lint.reader import MEANINGS, reader_notices
from navstack.params.lint.rule import Rule, RuleGroup
from navstack.params.lint.subject import RobotLimits, Subject
from navstack.params.nav2_file.file import Nav2File
from navstack.params.nav2_file.findings import Notice
from navstack.params.nav2_file.release import release_notices

_MODULES = (
    tree,
    plugins,
    dwb_limits,
    dwb_scoring,
    mppi,
    goal,
    speed,
    safety,
    layers,
    costmaps,
    localization,
    robot,
)
GROUPS: tuple[RuleGroup, ...] = tuple(module.RULES for module in _MODULES)
RULES: tuple[Rule, ...] = tuple(rule for group in GROUPS for rule in group.rules)


def lint(nav2: Nav2File, limits: RobotLimits | None = None) -> tuple[Notice, ...]:
    """All findings about a file, the reader's and the rules': errors first, then by line.

    Args:
        nav2: the file; it may have errors: rules that need what cannot be read find nothing.
        limits: the robot's body, to hold the file against; None: not asked for.
    """
    found = list(_rule_notices(Subject(nav2, limits)))
    notices = [*reader_notices(nav2, found), *found, *release_notices(nav2.names)]
    return tuple(sorted(notices, key=lambda notice: (not notice.is_error, notice.line)))


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


def _rule_notices(subject: Subject) -> Iterator[Notice]:
    for rule in RULES:
        for node, finding in rule.findings(subject):
            message, line = f"{finding.found}; {rule.why}", subject.line(node, finding.name)
            yield Notice(
                rule.id, f"{node}: {finding.name}", message, finding.advice, line, rule.is_error
            )
