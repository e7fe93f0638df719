"""The folder in which a page's commands are executed.

A checkout, and what ``GIVEN`` says of the page's reader.
"""

import importlib.util
import shutil
import sys
import time
import tomllib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from io import StringIO
from pathlib import Path

import numpy as np
from PIL import Image
from ruamel.yaml import YAML

from harness.execution.executors import InProcess
from harness.execution.workers import Workers
from navbench.cli.app import main
from navstack.params.extensions import extensions
from navstack.types import Pose2D
from tests.street.town import small_town

from .blocks import ROOT, Block
from .shortened import IN_FILES, SHORT_RULES, SHORT_TIMEOUT, SMALL_MAP

# What pages take for granted beside a checkout, where no command of theirs makes it. Tutorials are
# not among them.
GIVEN = {
    # an overview
    "commands.md": (
        "my_robot_nav2.yaml",
        "my_new_nav2.yaml",
        "my_map.yaml",
        "my_vectors",
        "map.osm",
        "drive.bag",
        "latest",
        "a",
        "b",
    ),
    "street.md": ("map.osm",),
    "check.md": ("my_robot_nav2.yaml", "my_new_nav2.yaml", "before", "after"),
    "README.md": ("my_robot_nav2.yaml", "drive.bag"),
    "quick_start.md": ("latest",),  # driven by its make run
    # finished runs of the reader's
    "money.md": ("my_prices.yaml", "latest", "before", "after", "both"),
    "parity.md": ("my_vectors",),  # recorded on another machine
    "pedestrians.md": ("recorded.csv",),  # a data set
    # of another project; a made-up log of the same kind stands in
    "recorded_logs.md": ("test1.bag",),
    # driven by mpiexec, which tests/execution/test_cluster_examples.py does
    "scaling.md": ("mpi",),
}
RUNS = {  # folders in results, and the names of their stacks
    "latest": ("nav2-gps",),
    "before": ("nav2-gps",),
    "after": ("nav2-gps",),
    "a": ("nav2-gps",),
    "b": ("nav2-gps",),
    "both": ("nav2-gps", "parked"),
    "mpi": ("nav2-gps",),
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
    """Run folders without a name of their own are called by the second.

    Readers are not as fast as a test.
    """
    while any(results.glob(f"{time.strftime('%Y%m%d-%H%M%S')}-*")):
        time.sleep(0.05)


def short_rules() -> str:
    """The published rules with a timeout that a test can wait for."""
    text = (ROOT / "params" / "rules" / "costnav.yaml").read_text(encoding="utf-8")
    assert "timeout: 241.0" in text
    return text.replace("timeout: 241.0", f"timeout: {SHORT_TIMEOUT}")


def make_short(folder: Path) -> None:
    """The rules and the map of shortened commands."""
    (folder / SHORT_RULES).write_text(short_rules(), encoding="utf-8")
    (folder / SMALL_MAP).parent.mkdir()
    make_map(folder / SMALL_MAP, 60.0, 40.0)


def drive_runs(folder: Path) -> None:
    """Drive what ``RUNS`` needs, once."""
    make_short(folder)
    for stacks in set(RUNS.values()):
        named = [word for stack in stacks for word in ("--stack", stack)]
        out = ["--out", str(folder / "-".join(stacks))]
        short = [
            "--rules",
            str(folder / SHORT_RULES),
            "--map",
            str(folder / SMALL_MAP),
            "--workers",
            "1",
        ]
        assert status_of(["run", *named, "--episodes", "2", "--record", "full", *out, *short]) == 0


def furnish(folder: Path, runs: Path, given: Iterable[str]) -> None:
    """A checkout as its reader has it, and what else is given.

    ``runs`` is the folder of :func:`drive_runs`.
    """
    make_short(folder)
    for name in ("params", "tests", "tools"):
        (folder / name).symlink_to(ROOT / name)
    (folder / "docs").mkdir()
    (folder / "docs" / "examples").symlink_to(ROOT / "docs" / "examples")
    for name in given:
        if name in RUNS:
            (folder / "results").mkdir(exist_ok=True)
            shutil.copytree(runs / "-".join(RUNS[name]), folder / "results" / f"run-{name}")
            (folder / "results" / name).symlink_to(f"run-{name}")
        else:
            MAKERS[name](folder / name)


def copy_of(*parts: str) -> Callable[[Path], object]:
    """Makes a file that is a copy of one in the project."""
    return lambda path: path.write_bytes(ROOT.joinpath(*parts).read_bytes())


def make_vectors(path: Path) -> None:
    """A folder of golden vectors."""
    path.mkdir()
    shutil.copy(ROOT / "tests" / "golden" / "inflation.npz", path)


def make_recording(path: Path) -> None:
    """People who were recorded."""
    path.write_text("id,t,x,y\n1,0.0,-60.0,-70.0\n1,30.0,-60.0,-40.0\n", encoding="utf-8")


def make_map(path: Path, length: float = 30.0, width: float = 10.0) -> None:
    """A hall; its sides are given in [m]."""
    pixels = np.full((round(width / 0.05), round(length / 0.05)), 254, dtype=np.uint8)
    pixels[:4] = pixels[-4:] = pixels[:, :4] = pixels[:, -4:] = 0
    Image.fromarray(pixels).save(path.with_suffix(".png"))
    text = f"image: {path.stem}.png\nresolution: 0.05\norigin: [0.0, 0.0, 0.0]\nnegate: 0\n"
    path.write_text(f"{text}occupied_thresh: 0.65\nfree_thresh: 0.25\n", encoding="utf-8")


def make_log(path: Path) -> None:
    """A bag of ROS 1: 2 s straight on with wheels, an inertial unit and fixes."""
    specification = importlib.util.spec_from_file_location(
        "writing", ROOT / "tests" / "recorded" / "writing.py"
    )
    assert specification is not None and specification.loader is not None
    writing = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(writing)
    entries = []
    for t in np.arange(0.0, 2.0, 0.02):
        stamp = writing.START + t
        entries += [
            writing.odometry(stamp, Pose2D(t, 0.0, 0.0), 1.0, 0.0),
            writing.imu(stamp, 0.0, 0.0),
        ]
    entries += [writing.fix(writing.START + t, t, 0.0) for t in np.arange(0.0, 2.0, 0.2)]
    writing.write(path, sorted(entries, key=lambda entry: entry.stamp), "ros1")


MAKERS: dict[str, Callable[[Path], object]] = {
    "my_robot_nav2.yaml": copy_of("params", "nav2", "stock.yaml"),
    "my_new_nav2.yaml": copy_of("params", "nav2", "starter.yaml"),
    "my_prices.yaml": copy_of("params", "prices", "costnav.yaml"),
    "my_map.yaml": make_map,
    "my_vectors": make_vectors,
    "map.osm": lambda path: small_town().write(path),
    "recorded.csv": make_recording,
    "drive.bag": make_log,
    "test1.bag": make_log,
}


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
    """As ``pip install`` of a package of plain modules.

    Importable, with its entry points, and without an index.
    """
    project = tomllib.loads((package / "pyproject.toml").read_text(encoding="utf-8"))
    modules = project["tool"]["setuptools"]["py-modules"]
    assert all((package / f"{module}.py").is_file() for module in modules)
    about = project["project"]
    info = package / f"{about['name'].replace('-', '_')}-{about['version']}.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(
        f"Metadata-Version: 2.1\nName: {about['name']}\nVersion: {about['version']}\n"
    )
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
