"""CasADi functions as compiled C, kept on disk between runs.

The library's name is a hash of the generated source, the compiler and its flags, in the folder of
:func:`~navstack.costmap.field_cache.cache_folder`. Any number of processes may start at once: each
compiles into a file of its own and renames it, which replaces an equal one. At its end a library
has a CRC-32 of all before it: to load one that was cut off ends the process. A library is loaded
only where it and its folder are this user's and nobody else can write them: else each process
compiles for itself. Whatever goes wrong, there is no library, and CasADi's virtual machine runs the
function instead.
"""

import atexit
import contextlib
import os
import platform
import shutil
import subprocess
import tempfile
import warnings
from functools import cache
from pathlib import Path

import casadi as ca

from navstack.costmap.field_cache import cache_folder, content_key
from navstack.errors import NavstackWarning
from navstack.files import check_of, is_private, is_whole

_FLAGS = ("-O2", "-fPIC", "-shared", "-ffp-contract=off")
_LONGEST = 120.0  # [s] that a compiler may take
_EXTENSION = ".so"  # what CasADi's loader takes on Linux and macOS alike


def compiled(function: ca.Function) -> ca.Function | None:
    """The function, compiled; None where there is no compiler, or compiling or loading fails."""
    compiler = find_compiler()
    if compiler is None:
        return None
    name = function.name()
    generator = ca.CodeGenerator(f"{name}.c")
    generator.add(function)
    source = generator.dump()
    key = content_key(
        "casadi-c-1",
        source,
        compiler,
        " ".join(_FLAGS),
        platform.platform(),
        ca.CasadiMeta.version(),
    )
    library = _folder() / f"{key}{_EXTENSION}"
    loaded = _load(name, library)
    if loaded is None and _compile(compiler, source, library):
        loaded = _load(name, library)
    return loaded


@cache
def find_compiler() -> str | None:
    """The path of the C compiler: $CC, or the first of cc, gcc and clang; None: there is none."""
    for name in (os.environ.get("CC") or "cc", "cc", "gcc", "clang"):
        found = shutil.which(name)
        if found:
            return found
    return None


def _folder() -> Path:
    """Where libraries are kept: the cache, or a private folder where others can write that."""
    folder = cache_folder()
    with contextlib.suppress(OSError):
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    if is_private(folder) or not folder.is_dir():
        return folder
    return _own_folder(folder)


@cache
def _own_folder(instead_of: Path) -> Path:
    warnings.warn(
        f"{instead_of} can be written by others, so no code is loaded from it; "
        "set NAVSTACK_CACHE to a folder of yours",
        NavstackWarning,
        stacklevel=4,
    )
    folder = Path(tempfile.mkdtemp(prefix="navbench-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


def _load(name: str, library: Path) -> ca.Function | None:
    if not is_private(library) or not is_whole(library):
        return None
    try:
        return ca.external(name, str(library))
    except RuntimeError:  # of another machine
        return None


def _compile(compiler: str, source: str, library: Path) -> bool:
    """Compile beside the place and rename; whether that worked."""
    try:
        with tempfile.TemporaryDirectory(dir=library.parent, prefix="compile-") as folder:
            text = Path(folder) / "source.c"
            partial = Path(folder) / "library.so"
            text.write_text(source, encoding="utf-8")
            command = [compiler, *_FLAGS, "-o", str(partial), str(text), "-lm"]
            subprocess.run(command, check=True, capture_output=True, timeout=_LONGEST)
            check = check_of(partial.read_bytes())
            with partial.open("ab") as file:
                file.write(check)
            partial.chmod(0o700)  # whatever the umask lets others do
            os.replace(partial, library)
    except (OSError, subprocess.SubprocessError):
        return False
    return True
