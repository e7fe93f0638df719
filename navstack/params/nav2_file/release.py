"""Which distribution of Nav2 a file was written for."""

from collections import Counter
from collections.abc import Iterable

from navstack.params.nav2_file.findings import Known, Notice
from navstack.params.registry.releases import RELEASES, span

MOST_SHOWN = 4  # names of other distributions in one line


def looks_like(names: Iterable[Known]) -> tuple[str, ...]:
    """The distributions that have most of a file's names, oldest first; all where it has none."""
    known = Counter(release for name in names for release in name.releases)
    most = max(known.values(), default=0)
    return tuple(release for release in RELEASES if known[release] == most)


def release_notices(names: Iterable[Known]) -> list[Notice]:
    """One line about the names that the distribution of a file does not have."""
    names = list(names)
    likely = looks_like(names)
    others = [name for name in names if not set(likely) & set(name.releases)]
    if not others:
        return []
    shown = [f"{name.path} ({span(name.releases)})" for name in others[:MOST_SHOWN]]
    if len(others) > MOST_SHOWN:
        shown.append(f"{len(others) - MOST_SHOWN} more")
    message = f"looks like a file of Nav2 {' or '.join(likely)}, which lacks {', '.join(shown)}"
    return [Notice("release", "", message, line=others[0].line)]
