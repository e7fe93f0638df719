"""The end of a screen: what there is to say of the input, then the next command."""

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from harness.report.blocks import Block


def print_with_notes(blocks: Sequence["Block"], notes: Sequence[str]) -> None:
    """Print blocks, with notes on standard error before the last one."""
    from harness.report.tables import print_blocks, report_console
    from navbench.api.driving import say_notes

    print_blocks(blocks[:-1], report_console())
    sys.stdout.flush()
    say_notes(notes)
    print_blocks(blocks[-1:], report_console())
