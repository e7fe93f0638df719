"""What the auditor found."""

from collections.abc import Sequence

from harness.audit.auditor import Audit
from harness.audit.findings import Check
from harness.report.blocks import Block, Table, Text, declared


def audit_sentence(audit: Audit) -> str:
    """Whether the auditor flags the second of two stacks."""
    if audit.flagged:
        return f"THE AUDITOR FLAGS: {', '.join(check.gap.title for check in audit.flagged)}."
    examined = sum(check.is_examined for check in audit.checks)
    if examined:
        return f"The auditor flags nothing ({examined} of {len(audit.checks)} checks examined)."
    return f"The auditor could examine nothing: {audit.checks[0].says}."


def audit_table(checks: Sequence[Check]) -> Table:
    """What checks found that were examined, and what to do where they raise an alarm."""
    rows = [
        (check.gap.title, check.state.replace("flagged", "FLAGGED"), check.says)
        for check in checks
        if check.is_examined
    ]
    others = [check.gap.title for check in checks if not check.is_examined]
    lines = [
        f"{check.gap.title}: a gap, because {check.gap.why}. What to do: {check.gap.advice}."
        for check in checks
        if check.is_flagged
    ]
    if rows and others:
        lines.append(f"Not examined: {', '.join(others)}.")
    return declared("audit", rows, *lines)


def audit_blocks(audit: Audit) -> list[Block]:
    """The sentence, and the checks that raise an alarm."""
    if audit.flagged:
        return [audit_table(audit.flagged), Text(audit_sentence(audit))]
    return [Text(audit_sentence(audit))]
