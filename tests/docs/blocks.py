"""The fenced blocks of the documents, and the commands in them."""

import re
import shlex
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
LANGUAGES = ("sh", "text", "yaml", "toml", "python")
FENCE = re.compile(r"^(?P<indent> *)```(?P<language>\S*) *$")
FILE_BEFORE = re.compile(r"`(?P<name>[\w./-]+\.\w+)`:\s*$")
INLINE = re.compile(r"`((?:navbench|python) [^`]*)`")


@dataclass(frozen=True)
class Block:
    """One fenced block."""

    page: Path
    line: int  # of its fence
    language: str
    text: str
    # name of the file whose content it is, as the line before says ("`name`:"); empty: none
    file: str

    @property
    def where(self) -> str:
        """Page and line, for messages."""
        return f"{self.page.relative_to(ROOT)}:{self.line}"


@dataclass(frozen=True)
class Command:
    """One command line."""

    block: Block
    words: tuple[str, ...]

    def __str__(self) -> str:
        return shlex.join(self.words)


def blocks_of(page: Path) -> list[Block]:
    """The fenced blocks of a page, those in lists included."""
    lines = page.read_text(encoding="utf-8").splitlines()
    blocks, start, before = [], None, ""
    for number, line in enumerate(lines):
        fence = FENCE.match(line)
        if fence and start is None:
            start, named = number, FILE_BEFORE.search(before)
            indent, language = len(fence["indent"]), fence["language"]
        elif fence and start is not None:
            text = "".join(f"{each[indent:]}\n" for each in lines[start + 1 : number])
            blocks.append(Block(page, start + 1, language, text, named["name"] if named else ""))
            start, before = None, ""
        elif line.strip():
            before = line
    assert start is None, f"{page.name}: the fence of line {start} is never closed"
    return blocks


def commands_of(block: Block) -> list[Command]:
    """The command lines of a shell block."""
    lines = block.text.replace("\\\n", " ").splitlines()
    words = [tuple(shlex.split(line, comments=True)) for line in lines]
    return [Command(block, each) for each in words if each]


def inline_commands(page: Path) -> list[tuple[str, ...]]:
    """Command lines within sentences; placeholders in capitals and all are kept as they stand."""
    text = page.read_text(encoding="utf-8")
    for block in blocks_of(page):
        text = text.replace(block.text, "")
    return [tuple(shlex.split(found)) for found in INLINE.findall(text.replace("\n", " "))]
