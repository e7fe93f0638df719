"""numba's ``njit``, whose compiled code is dropped when anything changes that it was compiled from.

numba keeps compiled code on disk for as long as the kernel's own file stays what it is. What the
kernel takes from other files, functions and constants, is compiled into it, too, but numba does not
look at those files (its documentation names this as a limit of the cache): after an edit or an
update a kernel would go on with the old values. Here the stamp by which compiled code is known
covers the kernel's file and every file of its own package and of this one that it imports, directly
or not. Stamps are of contents, so compiled code may be moved with its sources, also to another
machine: all x86-64 processors with AVX2 and FMA are compiled for as one, x86-64-v3.
"""

import hashlib
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from llvmlite.binding import get_host_cpu_features, get_host_cpu_name
from numba.core.caching import InTreeCacheLocator, UserProvidedCacheLocator, UserWideCacheLocator

Kernel = TypeVar("Kernel", bound=Callable[..., Any])

_PACKAGE = Path(__file__).resolve().parent
TARGET = "x86-64-v3"  # what servers and laptops have in common since about 2015
_TARGET_NEEDS = ("avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe")
_IMPORT = re.compile(
    r"^(?:from ([.\w]+) import (\([^)]*\)|[^\n]*)|import (\w[.\w]*))", re.MULTILINE
)
_NAME = re.compile(r"\w+")


def fix_processor() -> None:
    """Let numba compile for :data:`TARGET` where this machine can run that and ``NUMBA_CPU_NAME`` is not set."""
    config: Any = numba.config
    features = get_host_cpu_features()
    if not config.CPU_NAME and all(features.get(each) for each in _TARGET_NEEDS):
        config.CPU_NAME, config.CPU_FEATURES = TARGET, ""


def processor() -> str:
    """The kind of processor that numba compiles for."""
    config: Any = numba.config
    return str(config.CPU_NAME or get_host_cpu_name())


def njit(ahead: str = "", **options: Any) -> Callable[[Kernel], Kernel]:
    """``numba.njit`` with a cache on disk, in which compiled code is known by :func:`source_stamp`.

    Args:
        ahead: for a kernel that deliveries call from Python, the types of its arguments in numba's
            notation; named tuples as its module knows them. Nothing is compiled before the first
            call unless somebody asks for it.
        options: of numba.
    """
    decorate: Callable[[Kernel], Kernel] = numba.njit(**{"cache": True, **options})  # noqa: TID251

    def compiled(function: Kernel) -> Kernel:
        config: Any = numba.config
        before = config.CACHE_LOCATOR_CLASSES  # other people's kernels keep theirs
        config.CACHE_LOCATOR_CLASSES = before or _LOCATORS
        try:
            kernel: Any = decorate(function)
        finally:
            config.CACHE_LOCATOR_CLASSES = before
        kernel.ahead = ahead
        return cast(Kernel, kernel)

    return compiled


def tuple_of(kind: Any, params: Any, **more: float) -> Any:
    """A named tuple for kernels: of ``more``, and of the parameters that are named like its other fields."""
    return kind(
        **more, **{name: float(getattr(params, name)) for name in kind._fields if name not in more}
    )


@cache
def source_stamp(file: Path) -> bytes:
    """The hash (SHA-256) of a source file and of those that it imports, as they are when it is asked for first.

    Followed are imports at the beginning of a line, of the file's own package and of ``navstack``.
    """
    found, waiting = set(), {file.resolve()}
    while waiting:
        source = waiting.pop()
        found.add(source)
        waiting |= _imported(source) - found
    return hashlib.sha256(b"".join(_content(source) for source in sorted(found))).digest()


class _Stamped:
    """How compiled code is known, for numba's classes that say where it is."""

    _py_file: str

    def get_source_stamp(self) -> bytes:
        return source_stamp(Path(self._py_file))


class ProvidedFolder(_Stamped, UserProvidedCacheLocator):
    """In ``NUMBA_CACHE_DIR``."""


class BesideTheSource(_Stamped, InTreeCacheLocator):
    """In ``__pycache__``."""


class UserFolder(_Stamped, UserWideCacheLocator):
    """In the user's folder for caches."""


_LOCATORS = ",".join(
    [
        *(
            f"{each.__module__}.{each.__qualname__}"
            for each in (ProvidedFolder, BesideTheSource, UserFolder)
        ),
        "IPythonCacheLocator",
        "ZipCacheLocator",
    ]
)


@cache
def _content(source: Path) -> bytes:
    return hashlib.sha256(source.read_bytes()).digest()


@cache
def _imported(source: Path) -> frozenset[Path]:
    """The files that a file imports from its own package and from this one."""
    inner = source.parent
    while (inner.parent / "__init__.py").is_file():
        inner = inner.parent
    packages = {each.name: each for each in (inner, _PACKAGE) if (each / "__init__.py").is_file()}
    files: set[Path] = set()
    for match in _IMPORT.finditer(source.read_text(encoding="utf-8")):
        module, names, plain = match.groups()
        base = _folder(module or plain, source, packages)
        if base is not None:
            candidates = [base, *(base / name for name in _NAME.findall(names or ""))]
            files.update(file for each in candidates for file in _files(each))
    return frozenset(files)


def _folder(module: str, source: Path, packages: dict[str, Path]) -> Path | None:
    """Where a module is, without its suffix; None where its package is not followed."""
    dots = len(module) - len(module.lstrip("."))
    first, *rest = module.lstrip(".").split(".")
    if dots:
        return source.parents[dots - 1].joinpath(first, *rest)
    return packages[first].joinpath(*rest) if first in packages else None


def _files(module: Path) -> list[Path]:
    return [file for file in (module.with_suffix(".py"), module / "__init__.py") if file.is_file()]


fix_processor()
