"""Draw docs/architecture.svg: the rooms of the packages, layer by layer, as .importlinter has them.

Usage: python -m tools.draw_architecture

What the contracts say is checked against the imports by ``make check``; a room's line is the
beginning of its docstring.
"""

import ast
import configparser
import html
import re
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PICTURE = ROOT / "docs" / "architecture.svg"
COLUMNS = (  # contract, folder, what the heading says
    ("harness-layers", "harness", "everything around the robot"),
    ("brain-layers", "navstack", "the robot's brain"),
)
WIDTH, HEIGHT = 940, 40  # [px] of the picture; of a room
LEFT, GAP, TOP = 20, 6, 120
COLUMN = (WIDTH - 3 * LEFT) // 2
LONGEST = {1: 62, 2: 28, 3: 17, 4: 13}  # characters of a room's line, by rooms beside each other
FILL, EDGE = (
    {"harness": "#e6edf8", "navstack": "#e8f3ea"},
    {"harness": "#2f5fb3", "navstack": "#2f7d43"},
)


@dataclass(frozen=True)
class Room:
    """A box of the picture."""

    x: int
    y: int
    width: int
    title: str
    line: str
    package: str

    def drawn(self) -> str:
        """Its SVG."""
        middle = self.x + self.width // 2
        return (
            f'<rect x="{self.x}" y="{self.y}" width="{self.width}" height="{HEIGHT}" rx="4" '
            f'fill="{FILL[self.package]}" stroke="{EDGE[self.package]}"/>\n'
            f'<text x="{middle}" y="{self.y + 17}" text-anchor="middle" font-weight="bold" '
            f'fill="#111827">{html.escape(self.title)}</text>'
            f'<text x="{middle}" y="{self.y + 33}" text-anchor="middle" font-size="11" '
            f'fill="#374151">{html.escape(self.line)}</text>'
        )


def layers(contract: str) -> list[list[str]]:
    """The rooms of a contract, from the top; those side by side in one list."""
    rules = configparser.ConfigParser()
    rules.read(ROOT / ".importlinter", encoding="utf-8")
    lines = rules[f"importlinter:contract:{contract}"]["layers"].strip().splitlines()
    return [re.findall(r"\w+", line) for line in lines]


def line_of(package: str, room: str, longest: int) -> str:
    """The beginning of a room's docstring, cut at a mark; empty where none fits."""
    file = ROOT / package / f"{room}.py"
    if not file.is_file():
        file = ROOT / package / room / "__init__.py"
    text = ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or ""
    whole = text.partition("\n")[0].rstrip(".").replace("`", "")
    parts = [whole, *(whole.partition(mark)[0] for mark in (":", ";", ","))]
    return next((part for part in parts if len(part) <= longest), "")


def rooms(contract: str, package: str, left: int) -> list[Room]:
    """The boxes of one package."""
    found = []
    for row, names in enumerate(layers(contract)):
        width = (COLUMN - GAP * (len(names) - 1)) // len(names)
        for place, name in enumerate(names):
            x = left + place * (width + GAP)
            y = TOP + row * (HEIGHT + GAP)
            line = line_of(package, name, LONGEST[len(names)])
            found.append(Room(x, y, width, name, line, package))
    return found


def picture() -> str:
    """The whole picture."""
    front = Room(
        LEFT,
        40,
        WIDTH - 2 * LEFT,
        "navbench",
        "what users touch: api, commands, gym",
        "harness",
    )
    boxes = [front.drawn()]
    lowest = 0
    for number, (contract, package, what) in enumerate(COLUMNS):
        left = LEFT + number * (COLUMN + LEFT)
        heading = f'<tspan font-weight="bold">{package}/</tspan>  {html.escape(what)}'
        boxes.append(
            f'<text x="{left}" y="{TOP - 14}" font-size="15" fill="#1f2937">{heading}</text>'
        )
        own = rooms(contract, package, left)
        boxes += [room.drawn() for room in own]
        lowest = max(lowest, own[-1].y + HEIGHT)
    notes = "Each room imports only rooms below it; harness imports navstack, never the other way."
    boxes.append(f'<text x="{LEFT}" y="26" font-size="13" fill="#4b5563">{notes}</text>')
    size = f"0 0 {WIDTH} {lowest + LEFT}"
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{size}" font-family="sans-serif" '
        f'font-size="13" role="img" aria-label="{notes}">\n'
        '<rect width="100%" height="100%" fill="#ffffff"/>\n' + "\n".join(boxes) + "\n</svg>\n"
    )


if __name__ == "__main__":
    PICTURE.write_text(picture(), encoding="utf-8")
    sys.stdout.write(f"{PICTURE}\n")
