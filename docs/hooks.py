"""What the site shows beside docs/: the pages of the studies in results/baseline, each with its figures."""

from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

BASELINE = Path(__file__).resolve().parents[1] / "results" / "baseline"
STUDIES = ("study", "evasive_study")


def on_files(files: Files, *, config: Any) -> Files:
    """Add the studies' pages and figures to those of docs/."""
    for name in STUDIES:
        page = (BASELINE / name / "index.md").read_text(encoding="utf-8")
        files.append(File.generated(config, f"{name}.md", content=page.replace("](figures/", f"]({name}/")))
        for figure in sorted((BASELINE / name / "figures").glob("*.png")):
            files.append(File.generated(config, f"{name}/{figure.name}", abs_src_path=str(figure)))
    return files


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Links to a study in the repository lead to its page on the site."""
    for name in STUDIES:
        markdown = markdown.replace(f"../results/baseline/{name}/index.md", f"{name}.md")
    return markdown
