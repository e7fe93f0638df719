"""The page of ``navbench ablate``: the answer first, then every table."""

from collections.abc import Sequence
from pathlib import Path

from harness.ablation.analysis import Ablation
from harness.report.ablations.screen import ablation_blocks
from harness.report.blocks import Chart, Text
from harness.report.markdown import markdown_text
from harness.report.short.findings import ablation_answer, ablation_setup
from harness.storage.files import write_text, writing

PAGE = "ablation.md"
CAPTION = "What each localizer knows of its position, and what it earns."


def write_ablation(ablation: Ablation, figures: Sequence[Path], folder: Path) -> Path:
    """Write what an ablation found as Markdown into its run folder; returns the page's path.

    Raises:
        InputError: it cannot be written.
    """
    about = ablation_setup(ablation, folder)
    answer = [Text(f"**{line}**") for line in ablation_answer(ablation)]
    pictures = [Chart(figure.name, CAPTION) for figure in figures if figure.suffix == ".png"]
    blocks = [*answer, Text(about), *pictures, *ablation_blocks(ablation, (), folder)]
    title = about.partition(";")[0]
    with writing(folder / PAGE):
        write_text(folder / PAGE, f"# Localizers: {title}\n\n{markdown_text(blocks)}")
    return folder / PAGE
