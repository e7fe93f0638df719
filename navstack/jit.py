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
from inspect import signature
from pathlib import Path
from typing import Annotated, Any, TypeVar, cast, get_args, get_origin, get_type_hints

import numba
import numpy as np
from llvmlite.binding import get_host_cpu_features, get_host_cpu_name
from numba import types
from numba.core.caching import InTreeCacheLocator, UserProvidedCacheLocator, UserWideCacheLocator

from navstack.dispatch import LEVEL, LEVEL_NEEDS
from navstack.kernel_cache import CheckedCacheFile

Kernel = TypeVar("Kernel", bound=Callable[..., Any])

_PACKAGE = Path(__file__).resolve().parent
_IMPORT = re.compile(r"^(?:from|import) (\.*)([\w.]*)", re.MULTILINE)


def fix_processor() -> None:
    """Let numba compile for :data:`~navstack.dispatch.LEVEL` where this machine can run that.

    ``NUMBA_CPU_NAME`` overrides it.
    """
    config: Any = numba.config
    features = get_host_cpu_features()
    if not config.CPU_NAME and all(features.get(each) for each in LEVEL_NEEDS):
        config.CPU_NAME, config.CPU_FEATURES = LEVEL, ""


def processor() -> str:
    """The kind of processor that numba compiles for."""
    config: Any = numba.config
    return str(config.CPU_NAME or get_host_cpu_name())


def njit(ahead: bool = False, **options: Any) -> Callable[[Kernel], Kernel]:
    """``numba.njit`` with a cache on disk, in which compiled code is known by :func:`source_stamp`.

    Args:
        ahead: whether deliveries call the kernel from Python, so that it may be compiled for
            :func:`argument_types` before the first call.
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
        _check_cache(getattr(kernel, "_cache", None))
        kernel.ahead = ahead
        return cast(Kernel, kernel)

    return compiled


def _check_cache(cache: Any) -> None:
    """Let a kernel's cache on disk check what it reads; a kernel may have none."""
    before = getattr(cache, "_cache_file", None)
    if before is None:
        return
    stamp = before._source_stamp
    make: Any = CheckedCacheFile  # untyped
    file = make(cache.cache_path, cache._impl.filename_base, stamp)
    # numba reads no index of another version, whose types may be gone by now
    file._version = (before._version, stamp)
    cache._cache_file = file


def argument_types(kernel: Any) -> tuple[types.Type, ...]:
    """The types with which a kernel is called from Python, by its annotations."""
    hints = get_type_hints(kernel.py_func, include_extras=True)
    return tuple(_numba_type(hints[name]) for name in signature(kernel.py_func).parameters)


def _numba_type(annotation: Any) -> Any:
    """The type of what an annotation stands for: a number, an array, or a tuple of such."""
    parts = get_args(annotation)
    join: Any = types.BaseTuple.from_types
    if get_origin(annotation) is Annotated:
        array, layout = parts
        (number,) = get_args(get_args(array)[1])
        element = numba.from_dtype(np.dtype(number))
        return types.Array(element, layout.dimensions, "C", readonly=layout.is_fixed)
    if get_origin(annotation) is tuple:
        return join([_numba_type(part) for part in parts])
    if hasattr(annotation, "_fields"):
        fields = get_type_hints(annotation, include_extras=True)
        return join([_numba_type(fields[name]) for name in annotation._fields], annotation)
    typeof: Any = numba.typeof
    return typeof(annotation())


def tuple_of(kind: Any, params: Any, **more: float) -> Any:
    """A named tuple for kernels: of ``more``, and of the parameters named like its other fields."""
    return kind(
        **more, **{name: float(getattr(params, name)) for name in kind._fields if name not in more}
    )


@cache
def source_stamp(file: Path) -> bytes:
    """The hash (SHA-256) of a source file and of those that it imports.

    They are read once in a process. Followed are imports at the beginning of a line, of the file's
    own package and of ``navstack``.
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
    """The files that a file imports from its own package and this one; of a package, all files."""
    own = source.parent
    while (own.parent / "__init__.py").is_file():
        own = own.parent
    packages = {each.name: each for each in (own, _PACKAGE)}
    files: set[Path] = set()
    for dots, module in _IMPORT.findall(source.read_text(encoding="utf-8")):
        first, *inner = module.split(".")
        if dots:
            base = source.parents[len(dots) - 1].joinpath(first, *inner)
        elif first in packages:
            base = packages[first].joinpath(*inner)
        else:
            continue
        if base.is_dir():
            files.update(base.glob("*.py"))
        else:
            files.add(base.with_suffix(".py"))
    return frozenset(files)


fix_processor()
