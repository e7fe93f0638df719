"""A flame graph: the program is looked at every millisecond of processor time, and what it was doing is drawn.

A kernel counts as the Python function that called it: it cannot be looked into while it runs.
"""

import contextlib
import html
import signal
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from types import FrameType

PERIOD = 0.001  # [s] of processor time between two looks
WIDTH, LINE, FONT = 1200.0, 17, 11  # [px]
NARROWEST = 0.4  # [px] of a function that is drawn
CHARACTER = 6.2  # [px] of a letter, about
COLOURS = {"navstack": "#7fb3d5", "harness": "#f5b971", "benchmarks": "#f5b971"}  # by package
OTHER = "#cccccc"

Stack = tuple[str, ...]  # from the outermost function inwards


@contextlib.contextmanager
def sampled(stacks: "Counter[Stack]") -> Iterator[None]:
    """Count the stacks of this process's main thread meanwhile."""

    def look(number: int, frame: FrameType | None) -> None:
        names = []
        while frame is not None:
            names.append(_name(frame))
            frame = frame.f_back
        stacks[tuple(reversed(names))] += 1

    before = signal.signal(signal.SIGPROF, look)
    signal.setitimer(signal.ITIMER_PROF, PERIOD, PERIOD)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def _name(frame: FrameType) -> str:
    module = str(frame.f_globals.get("__name__", "?"))
    return f"{module}:{frame.f_code.co_qualname}"


def below(stacks: "Counter[Stack]", root: str) -> "Counter[Stack]":
    """The parts of the stacks from the function whose name ends with ``root`` on; stacks without it are left out."""
    cut: Counter[Stack] = Counter()
    for stack, count in stacks.items():
        begins = next((i for i, name in enumerate(stack) if name.endswith(root)), None)
        if begins is not None:
            cut[stack[begins:]] += count
    return cut


def draw(stacks: "Counter[Stack]", title: str, file: Path) -> None:
    """Write the stacks as an SVG picture; a function's share and name show when the pointer is on it.

    Raises:
        OSError: the file cannot be written.
    """
    total = sum(stacks.values())
    depth = max((len(stack) for stack in stacks), default=0)
    height = (depth + 3) * LINE
    boxes = "\n".join(_boxes(stacks, 0, 0.0, total, height)) if total else ""
    file.write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{WIDTH:g}" height="{height}" '
        f'font-family="monospace" font-size="{FONT}">\n<rect width="100%" height="100%" fill="white"/>\n'
        f'<text x="4" y="{LINE}">{html.escape(title)}; {total} looks, one per ms of processor time</text>\n'
        f"{boxes}\n</svg>\n",
        encoding="utf-8",
    )


def _boxes(stacks: "Counter[Stack]", level: int, left: float, total: int, height: int) -> Iterator[str]:
    """One box for each function at a level of stacks that are alike above it, and those inside it."""
    inside: dict[str, Counter[Stack]] = {}
    for stack, count in stacks.items():
        if len(stack) > level:
            inside.setdefault(stack[level], Counter())[stack] += count
    for name, own in sorted(inside.items()):
        count = sum(own.values())
        width = WIDTH * count / total
        if width >= NARROWEST:
            yield _box(name, left, height - (level + 1) * LINE, width, count / total)
            yield from _boxes(own, level + 1, left, total, height)
        left += width


def _box(name: str, x: float, y: float, width: float, share: float) -> str:
    colour = COLOURS.get(name.split(".")[0], OTHER)
    short = name.split(":")[-1]
    text = html.escape(short[: int((width - 4.0) / CHARACTER)]) if width > 4.0 * CHARACTER else ""
    return (
        f"<g><title>{html.escape(name)}: {100.0 * share:.1f} %</title>"
        f'<rect x="{x:.1f}" y="{y}" width="{width:.1f}" height="{LINE - 1}" fill="{colour}" stroke="white"/>'
        f'<text x="{x + 2.0:.1f}" y="{y + LINE - 5}">{text}</text></g>'
    )
