"""Where the maps and parameters that come with the program are."""

import os
import tempfile
import tomllib
from pathlib import Path
from typing import Any

from navstack.errors import InputError, UnknownNameError, few_of
from navstack.files import is_private

DEFAULT_WORLD = "paper_loose_bucket"
ABOUT = "about.toml"  # of a folder: what its files are for, and by which names they are known
# folder of params -> kind of navbench list
LISTED = {
    "stacks": "stacks",
    "worlds": "worlds",
    "robots": "robots",
    "sensors": "sensors",
    "search_spaces": "spaces",
    "prices": "prices",
}
ROUTE_GRAPH = "_graph.geojson"  # ending of a district's route graph
_PACKAGE = Path(__file__).resolve().parents[1]


def shipped(kind: str) -> Path:
    """The folder ``maps`` or ``params``.

    Inside the installed package, or beside it in a checkout.
    """
    installed = _PACKAGE / "_shipped" / kind
    if installed.is_dir():
        return installed
    return _PACKAGE.parent / kind


def is_file(name_or_file: str) -> bool:
    """Whether what a user gives is a file, by its suffix or a separator in it, and not a name."""
    given = Path(name_or_file)
    return given.suffix.lower() in (".yaml", ".yml") or len(given.parts) > 1


def is_district(folder: str) -> bool:
    """Whether a folder has a route graph of ``navbench map osm``."""
    return Path(folder).is_dir() and any(Path(folder).glob(f"*{ROUTE_GRAPH}"))


def district_files(folder: Path) -> list[Path]:
    """The files that ``navbench map osm`` wrote into a folder, by name."""
    names = [graph.name.removesuffix(ROUTE_GRAPH) for graph in folder.glob(f"*{ROUTE_GRAPH}")]
    found = {file for name in names for file in folder.glob(f"{name}*") if file.is_file()}
    return sorted(found)


def resolve(name_or_file: str, folder: Path, what: str) -> Path:
    """A file given by name (a YAML file of ``folder``) or by path (it has a suffix or a separator).

    Each name that ``about.toml`` gives a file is understood.

    Raises:
        InputError: neither; the message offers the nearest known name.
    """
    given = Path(name_or_file)
    if is_file(name_or_file):
        if not os.path.isfile(given):
            trouble = "is a folder" if os.path.isdir(given) else "does not exist"
            if os.path.exists(given) and not os.path.isdir(given):
                trouble = "is a pipe or a device"
            known = few_of(given.stem, names(folder), _list_command(folder))
            raise InputError(
                f"{what} file '{name_or_file}' {trouble}; give a YAML file or a name; {known}"
            )
        return given
    for known in (name_or_file, *synonyms(name_or_file, folder)):
        candidate = folder / f"{known}.yaml"
        if os.path.isfile(candidate):
            return candidate
    if os.path.exists(given):
        trouble = "is a folder" if os.path.isdir(given) else "has no suffix .yaml"
        raise InputError(f"{what} '{name_or_file}' {trouble}; give a YAML file or a name")
    raise UnknownNameError(what, name_or_file, names(folder), _list_command(folder))


def _list_command(folder: Path) -> str:
    """The command that tells of a folder's files; empty: none does."""
    kind = LISTED.get(folder.name)
    return f"navbench list {kind} --all" if kind else ""


def synonyms(name: str, folder: Path) -> tuple[str, ...]:
    """All names of a file of ``folder``, the foremost first; ``name`` alone where it has one."""
    for foremost, entry in about(folder).items():
        known = (foremost, *entry.get("also", ()))
        if name in known:
            return known
    return (name,)


def about(folder: Path) -> dict[str, Any]:
    """What is told of the files of a folder, by name; nothing where nothing is."""
    file = folder / ABOUT
    return tomllib.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}


def names(folder: Path) -> list[str]:
    """The foremost names of the files of a folder that :func:`resolve` knows."""
    return sorted(synonyms(path.stem, folder)[0] for path in folder.glob("*.yaml"))


def keep_compiled_code() -> None:
    """Let numba keep compiled code in another folder where the program's own cannot be written."""
    if "NUMBA_CACHE_DIR" in os.environ or os.access(_PACKAGE, os.W_OK):
        return
    # it takes numpy, which is a third of the time of --help
    from navstack.costmap.field_cache import cache_folder

    folder = cache_folder()
    if not _is_ours(folder):
        folder = Path(tempfile.gettempdir()) / f"navbench-{os.getuid()}"
    if not _is_ours(folder):
        folder = Path(tempfile.mkdtemp(prefix="navbench-"))
    os.environ["NUMBA_CACHE_DIR"] = str(folder / "numba")


def _is_ours(folder: Path) -> bool:
    """Whether a folder, made where it is missing, is this user's own.

    What lies there is loaded and run.
    """
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError:
        return False
    return is_private(folder) and os.access(folder, os.W_OK)


def compiled_code() -> Path:
    """The folder of compiled code, or one of those beside the sources, where numba keeps it."""
    return Path(os.environ.get("NUMBA_CACHE_DIR") or _PACKAGE / "__pycache__")
