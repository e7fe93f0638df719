"""What the site shows beside docs/.

The studies in results/baseline, all metrics, all rules of lint.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

from harness.metrics.catalog import FACTS, GROUPS, RUN_METRICS
from harness.metrics.metric import Metric
from navbench.api.listing import worlds
from navstack.params.lint.rules import catalog

BASELINE = Path(__file__).resolve().parents[1] / "results" / "baseline"
STUDIES = ("study", "hard", "measured", "published_3", "helsinki")
LINK_TO_CATALOG = "[`catalog.toml`](../harness/metrics/catalog.toml)"


def on_files(files: Files, *, config: Any) -> Files:
    """Add the studies' pages and figures to those of docs/."""
    for name in STUDIES:
        page = (BASELINE / name / "index.md").read_text(encoding="utf-8")
        page = page.replace("](figures/", f"]({name}/").replace("](../../../docs/", "](")
        files.append(File.generated(config, f"{name}.md", content=page))
        for figure in sorted((BASELINE / name / "figures").glob("*.png")):
            files.append(File.generated(config, f"{name}/{figure.name}", abs_src_path=str(figure)))
    return files


def on_page_markdown(markdown: str, *, page: Any, **_: Any) -> str:
    """Links to a study lead to its page on the site; three pages get their tables."""
    for name in STUDIES:
        markdown = markdown.replace(f"../results/baseline/{name}/index.md", f"{name}.md")
    if page.file.src_uri == "worlds.md":
        return f"{markdown}\n{world_table()}"
    if page.file.src_uri == "lint.md":
        return f"{markdown}\n{catalog()}"
    if page.file.src_uri == "metrics.md":
        return (
            markdown.replace(LINK_TO_CATALOG, "`harness/metrics/catalog.toml`")
            + "\n"
            + "\n".join(metric_tables())
        )
    return markdown


def world_table() -> str:
    """A row for each world: what it is for, what people do, and where it is from."""
    rows = []
    for each in worlds():
        name = f"`{each.name}`{' (default)' if each.is_default else ''}"
        also = ", ".join(f"`{other}`" for other in each.also)
        rows.append(f"| {name} | {also} | {each.purpose} | {each.people} | {each.source} |")
    return "\n".join(("| world | also | what for | people | source |", "| --- " * 5 + "|", *rows))


def metric_tables() -> Iterator[str]:
    """The lines of a table for every group of metrics, and one of the other columns."""
    for group, metrics in (*GROUPS.items(), ("Of a run only", RUN_METRICS)):
        yield from (f"## {group}", "", *_table(metrics), "")
    yield from ("## Columns that are no metrics", "", "| column | meaning |", "| --- | --- |")
    yield from (f"| `{key}` | {meaning} |" for key, (_, meaning) in FACTS.items())


def _table(metrics: Sequence[Metric]) -> Iterator[str]:
    yield from (
        "| metric | unit | better | definition | source | null when | mean as |",
        "| --- " * 7 + "|",
    )
    for metric in metrics:
        mean = f"`{metric.mean_key}`" if metric.mean_key else ""
        cells = (
            metric.unit,
            metric.better.value,
            metric.meaning,
            metric.source,
            metric.undefined or "never",
            mean,
        )
        yield f"| `{metric.key}` | {' | '.join(cells)} |"
