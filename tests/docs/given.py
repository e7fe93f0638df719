"""The folder in which a page's commands are executed: what its reader is taken to have."""

import shutil
import sys
import time
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from io import StringIO
from pathlib import Path

import numpy as np
from PIL import Image
from ruamel.yaml import YAML

from harness.cli import main
from harness.execution import InProcess, Workers
from navstack.params.extensions import extensions

from .blocks import ROOT, Block
from .shortened import IN_FILES, SHORT_RULES, SHORT_TIMEOUT

NAV2_FILES = ("my_nav2.yaml", "my_robot_nav2.yaml")
RUNS = {  # folders that pages take for granted, and the names of their stacks
    "latest": ("nav2-gps",),
    "before": ("nav2-gps",),
    "after": ("nav2-gps",),
    "a": ("nav2-gps",),
    "b": ("nav2-gps",),
    "both": ("nav2-gps", "parked"),
    "other": ("rpp-gps",),
}


@contextmanager
def in_this_process() -> Iterator[None]:
    """Deliveries are driven in this process, which saves starting others."""
    before = Workers.__init__.__defaults__
    assert before is not None
    Workers.__init__.__defaults__ = (InProcess, *before[1:])  # type: ignore[misc]
    try:
        yield
    finally:
        Workers.__init__.__defaults__ = before  # type: ignore[misc]


def status_of(words: list[str]) -> int | str | None:
    """How navbench ends."""
    try:
        main(words)
    except SystemExit as ended:
        return ended.code
    raise AssertionError("navbench returned")


def wait_for_a_new_second(results: Path) -> None:
    """Run folders without a name of their own are called by the second: readers are not as fast as a test."""
    while any(results.glob(f"{time.strftime('%Y%m%d-%H%M%S')}-*")):
        time.sleep(0.05)


def short_rules() -> str:
    """The published rules with a timeout that a test can wait for."""
    text = (ROOT / "params" / "rules" / "costnav.yaml").read_text(encoding="utf-8")
    assert "timeout: 241.0" in text
    return text.replace("timeout: 241.0", f"timeout: {SHORT_TIMEOUT}")


def drive_runs(folder: Path) -> None:
    """Drive what ``RUNS`` needs, once."""
    (folder / SHORT_RULES).write_text(short_rules(), encoding="utf-8")
    for stacks in set(RUNS.values()):
        named = [word for stack in stacks for word in ("--stack", stack)]
        out = ["--out", str(folder / "-".join(stacks))]
        rules = ["--rules", str(folder / SHORT_RULES), "--workers", "1"]
        assert status_of(["run", *named, "--episodes", "2", *out, *rules]) == 0


def furnish(folder: Path, runs: Path) -> None:
    """Put into a folder what pages take for granted; ``runs`` is the folder of :func:`drive_runs`."""
    (folder / SHORT_RULES).write_text(short_rules(), encoding="utf-8")
    for name in ("params", "tests", "benchmarks"):
        (folder / name).symlink_to(ROOT / name)
    (folder / "docs").mkdir()
    for name in NAV2_FILES:
        shutil.copy(ROOT / "params" / "nav2" / "stock.yaml", folder / name)
    (folder / "my_prices.yaml").write_bytes((ROOT / "params" / "prices" / "costnav.yaml").read_bytes())
    (folder / "my_vectors").mkdir()
    shutil.copy(ROOT / "tests" / "golden" / "inflation.npz", folder / "my_vectors")
    (folder / "results").mkdir()
    for name, stacks in RUNS.items():
        shutil.copytree(runs / "-".join(stacks), folder / "results" / f"run-{name}")
        (folder / "results" / name).symlink_to(f"run-{name}")
    (folder / "recorded.csv").write_text("id,t,x,y\n1,0.0,-60.0,-70.0\n1,30.0,-60.0,-40.0\n", encoding="utf-8")
    pixels = np.full((200, 600), 254, dtype=np.uint8)
    pixels[:4] = pixels[-4:] = pixels[:, :4] = pixels[:, -4:] = 0
    Image.fromarray(pixels).save(folder / "my_map.png")
    text = "image: my_map.png\nresolution: 0.05\norigin: [0.0, 0.0, 0.0]\nnegate: 0\n"
    text += "occupied_thresh: 0.65\nfree_thresh: 0.25\n"
    (folder / "my_map.yaml").write_text(text, encoding="utf-8")


def write_block(block: Block, folder: Path) -> None:
    """Write the file whose content a block is."""
    text = block.text
    for old, new in IN_FILES.get(block.file, ()):
        assert old in text, f"{block.where}: shortened.py exchanges '{old}', which is not there"
        text = text.replace(old, new)
    path = folder / block.file
    path.parent.mkdir(exist_ok=True)
    path.write_text(text, encoding="utf-8")


def merge(block: Block, path: Path) -> None:
    """Set in a Nav2 file what a block shows of it."""
    yaml = YAML()
    whole, part = yaml.load(path.read_text(encoding="utf-8")), yaml.load(block.text)
    stack = [(whole, part)]
    while stack:
        old, new = stack.pop()
        for key, value in new.items():
            if isinstance(value, dict) and isinstance(old.get(key), dict):
                stack.append((old[key], value))
            else:
                old[key] = value
    stream = StringIO()
    yaml.dump(whole, stream)
    path.write_text(stream.getvalue(), encoding="utf-8")


def install(package: Path) -> None:
    """As ``pip install`` of a package of plain modules: importable, with its entry points, and without an index."""
    project = tomllib.loads((package / "pyproject.toml").read_text(encoding="utf-8"))
    modules = project["tool"]["setuptools"]["py-modules"]
    assert all((package / f"{module}.py").is_file() for module in modules)
    about = project["project"]
    info = package / f"{about['name'].replace('-', '_')}-{about['version']}.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {about['name']}\nVersion: {about['version']}\n")
    lines = []
    for group, points in about["entry-points"].items():
        lines += [f"[{group}]", *(f"{name} = {value}" for name, value in points.items())]
    (info / "entry_points.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
    sys.path.insert(0, str(package))
    extensions.cache_clear()


def forget_installed(folder: Path) -> None:
    """Undo :func:`install` for all packages below a folder."""
    for path in [each for each in sys.path if Path(each).is_relative_to(folder)]:
        sys.path.remove(path)
        for module in Path(path).glob("*.py"):
            sys.modules.pop(module.stem, None)
    extensions.cache_clear()
