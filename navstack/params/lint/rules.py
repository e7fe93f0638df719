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
    robot,
    safety,
    speed,
    tree,
)
from navstack.params.lint.reader import ERRORS, WARNINGS, reader_notices
from navstack.params.lint.rule import Rule
from navstack.params.lint.subject import RobotLimits, Subject
from navstack.params.nav2_file.file import Nav2File
from navstack.params.nav2_file.findings import Notice

GROUPS: dict[str, tuple[Rule, ...]] = {
    "Behavior tree": tree.RULES,
    "DWB: limits and samples": dwb_limits.RULES,
    "DWB: trajectories and critics": dwb_scoring.RULES,
    "MPPI": mppi.RULES,
    "Goal, progress and turning on the spot": goal.RULES,
    "Speed: smoother, recoveries, rates": speed.RULES,
    "Collision monitor": safety.RULES,
    "Costmap layers": layers.RULES,
    "Costmaps and frames": costmaps.RULES,
    "AMCL": localization.RULES,
    "With --robot": robot.RULES,
}
RULES: tuple[Rule, ...] = tuple(rule for group in GROUPS.values() for rule in group)


def lint(nav2: Nav2File, limits: RobotLimits | None = None) -> tuple[Notice, ...]:
    """All findings about a file: the reader's and the rules', errors first, then in the order of the file.

    Args:
        nav2: the file; it may have errors of its own, then rules that need what cannot be read keep silent.
        limits: the robot's body, to hold the file against; None: not asked for.
    """
    found = list(_rule_notices(Subject(nav2, limits)))
    return tuple(sorted([*reader_notices(nav2, found), *found], key=lambda notice: (not notice.is_error, notice.line)))


def catalog() -> str:
    """Every finding there is, as Markdown: what it means, or what it does to a real robot."""
    groups = {
        "Errors in reading": list(ERRORS.items()),
        "Warnings in reading": list(WARNINGS.items()),
        **{title: [(rule.id, _meaning(rule)) for rule in rules] for title, rules in GROUPS.items()},
    }
    sections = (
        f"## {title}\n\n" + "".join(f"- **`{each}`** {text}\n" for each, text in findings)
        for title, findings in groups.items()
    )
    return "\n".join(sections)


def _meaning(rule: Rule) -> str:
    return f"{rule.title}: {rule.why}." + (" (Error)" if rule.is_error else "")


def _rule_notices(subject: Subject) -> Iterator[Notice]:
    for rule in RULES:
        for finding in rule.check(subject):
            yield Notice(
                rule.id,
                f"{finding.node}: {finding.name}",
                f"{finding.found}; {rule.why}",
                finding.advice,
                subject.line(finding.node, finding.name),
                rule.is_error,
            )
