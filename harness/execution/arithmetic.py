"""How this process rounds: equal rows need results that are equal to the last bit.

They come from the C library, numpy and OpenBLAS. Versions alone do not say how those round: each
of the three picks its loops by the processor. So each is tried on fixed numbers, and a digest of
the results stands in a run's manifest. Runs are comparable where the digests agree.
"""

import ctypes
import hashlib
import importlib
import math
import platform
import warnings
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from navstack.dispatch import (
    LEVEL,
    PINS,
    TUNABLES,
    features,
    hides_features,
    is_pinnable,
    processor,
)
from navstack.errors import NavstackWarning
from navstack.types import FloatArray

DIGITS = 12  # of a digest
NOTED_FEATURES = ("avx", "avx2", "fma", "avx512f", "avx512dq", "avx512bw", "avx512vl")
_TITLES = {"c_library": "C library", "numpy": "numpy", "blas": "OpenBLAS"}
_AVX512_LEVELS = ("X86_V4", "AVX512_SKX")  # as numpy 2.4 calls the first, and older ones
_PINNED_CORES = ("", PINS["OPENBLAS_CORETYPE"], "Zen")  # Zen has Haswell's loops
_CORE_NAME = "scipy_openblas_get_corename64_"  # in the library that numpy's wheels bring
_POINTS = 2001
_MATRIX_SIZE = 24
_OF_ONE = (math.sin, math.cos, math.tan, math.atan, math.exp, math.tanh)
_OF_POSITIVE = (math.log, math.log1p, math.sqrt)
_OF_TWO = (math.atan2, math.hypot, math.pow)
_NUMPY_OF_ONE = (np.sin, np.cos, np.tan, np.arctan, np.exp, np.tanh)
_NUMPY_OF_POSITIVE = (np.log, np.log1p, np.sqrt)
_NUMPY_OF_TWO = (np.arctan2, np.hypot, np.power)


@cache
def arithmetic() -> Mapping[str, str]:
    """A digest of the results of each library: ``c_library``, ``numpy`` and ``blas``."""
    values = np.linspace(-17.3, 19.1, _POINTS)
    positive = np.linspace(1e-3, 7.7, _POINTS)
    return {
        "c_library": _digest(_c_library(values, positive)),
        "numpy": _digest(_numpy(values, positive)),
        "blas": _digest(_blas(values)),
    }


def machine() -> dict[str, Any]:
    """What a manifest says of the machine.

    Processor, features, C library, Python and :func:`arithmetic`.
    """
    return {
        "processor": processor(),
        "features": [name for name in NOTED_FEATURES if name in features()],
        "c_library": " ".join(platform.libc_ver()),
        "python": platform.python_version(),
        "arithmetic": dict(arithmetic()),
    }


def other_arithmetic(recorded: Any) -> str:
    """How a recorded :func:`machine` computes otherwise than this process; empty: it does not.

    Args:
        recorded: content of a manifest; anything else counts as unknown.
    """
    if not isinstance(recorded, dict) or not isinstance(recorded.get("arithmetic"), dict):
        where = recorded.get("processor") if isinstance(recorded, dict) else None
        return f"on {where or 'an unknown processor'}, and how that computes was not noted"
    there = recorded["arithmetic"]
    differing = [name for name, digest in arithmetic().items() if there.get(name) != digest]
    if differing:
        names = ", ".join(_TITLES[name] for name in differing)
        return f"on {recorded.get('processor')} the last bits differ ({names})"
    python = str(recorded.get("python"))
    if _minor(python) != _minor(platform.python_version()):
        return f"with Python {python}, this is {platform.python_version()}"
    return ""


def _minor(python: str) -> list[str]:
    return python.split(".")[:2]


@cache
def warn_of_other_arithmetic() -> None:
    """Warn, once a process, where it computes otherwise than the program: what follows, what to do.

    The program sets up its own process and its workers; a process that imports it may have loaded
    numpy before.
    """
    if told := trouble_of_this_process():
        warnings.warn(
            f"{told}; rows driven in this process differ in last bits",
            NavstackWarning,
            stacklevel=3,
        )


def trouble_of_this_process() -> str:
    """Why this process does not compute as the program does; empty: it does."""
    if not is_pinnable():
        return f"this processor is not {LEVEL}"
    if hides_features():
        return f"{TUNABLES} hides the processor's features from the C library: unset it"
    if _numpy_runs_avx512():
        setting = f"NPY_DISABLE_CPU_FEATURES='{PINS['NPY_DISABLE_CPU_FEATURES']}'"
        return (
            f"numpy was loaded before navbench, with AVX-512: "
            f"import navbench first, or set {setting}"
        )
    if blas_core() not in _PINNED_CORES:
        setting = f"OPENBLAS_CORETYPE={PINS['OPENBLAS_CORETYPE']}"
        return (
            f"numpy was loaded before navbench, with OpenBLAS for {blas_core()}: import navbench "
            f"first, or set {setting}"
        )
    return ""


def blas_core() -> str:
    """The processor for which numpy's OpenBLAS runs its loops, e.g. ``Haswell``; empty: unknown."""
    try:
        lines = Path("/proc/self/maps").read_text(encoding="utf-8").splitlines()
    except OSError:
        return ""
    libraries = {line.split()[-1] for line in lines if "openblas64" in line and "numpy" in line}
    for library in libraries:
        loaded = ctypes.CDLL(library)
        if hasattr(loaded, _CORE_NAME):
            ask = getattr(loaded, _CORE_NAME)
            ask.restype = ctypes.c_char_p
            return str(ask().decode())
    return ""


def _numpy_runs_avx512() -> bool:
    loops: Any = importlib.import_module("numpy._core._multiarray_umath")
    return any(loops.__cpu_features__.get(name) for name in _AVX512_LEVELS)


def _c_library(values: FloatArray, positive: FloatArray) -> FloatArray:
    plain, above = values.tolist(), positive.tolist()
    results = [function(value) for function in _OF_ONE for value in plain]
    results += [function(value) for function in _OF_POSITIVE for value in above]
    results += [function(a, b) for function in _OF_TWO for a, b in zip(above, plain, strict=True)]
    return np.array(results)


def _numpy(values: FloatArray, positive: FloatArray) -> FloatArray:
    results = [function(values) for function in _NUMPY_OF_ONE]
    results += [function(positive) for function in _NUMPY_OF_POSITIVE]
    results += [function(positive, values) for function in _NUMPY_OF_TWO]
    results += [np.cumsum(values), np.array([values.sum(), positive.mean(), values.std()])]
    return np.concatenate(results)


def _blas(values: FloatArray) -> FloatArray:
    cells = _MATRIX_SIZE * _MATRIX_SIZE
    square = values[:cells].reshape(_MATRIX_SIZE, _MATRIX_SIZE) + 40.0 * np.eye(_MATRIX_SIZE)
    symmetric = square @ square.T
    right = values[-_MATRIX_SIZE:]
    parts = (
        symmetric,
        np.linalg.inv(square),
        np.linalg.solve(square, right),
        np.linalg.eigvalsh(symmetric),
    )
    return np.concatenate([part.ravel() for part in parts])


def _digest(results: FloatArray) -> str:
    return hashlib.sha256(np.ascontiguousarray(results).tobytes()).hexdigest()[:DIGITS]
