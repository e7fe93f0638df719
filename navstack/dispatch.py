"""One variant of the compiled loops on every processor, chosen before libraries are loaded.

numpy and OpenBLAS pick loops by the processor they run on; AVX-512 loops round differently from
those for AVX2 and FMA. Results then depend on the machine. The variables below let both choose what
every x86-64-v3 processor has (Intel since 2013, AMD since 2015). numba's kernels are compiled for
the same level (:mod:`navstack.jit`). The C library picks by itself at program start: AVX2 and FMA
where the processor has them.
"""

import os
import platform
import sys
from collections.abc import Mapping
from functools import cache
from pathlib import Path

LEVEL = "x86-64-v3"  # what servers and laptops have in common since about 2015
LEVEL_NEEDS: Mapping[str, str] = {  # features by LLVM's name -> Linux's
    "avx2": "avx2",
    "bmi": "bmi1",
    "bmi2": "bmi2",
    "f16c": "f16c",
    "fma": "fma",
    "lzcnt": "abm",
    "movbe": "movbe",
}
PINS: Mapping[str, str] = {
    "NPY_DISABLE_CPU_FEATURES": (
        "X86_V4 AVX512_ICL AVX512_SPR "  # numpy 2.4 and newer
        # before that; unknown names have no effect
        "AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL"
    ),
    "OPENBLAS_CORETYPE": "Haswell",
    # its sine and exponential round differently from the C library's
    "NUMBA_DISABLE_INTEL_SVML": "1",
}
_ASKS_FOR_MORE = "NPY_ENABLE_CPU_FEATURES"
TUNABLES = "GLIBC_TUNABLES"
_MASKS_FEATURES = "glibc.cpu.hwcaps"
_CPU_INFO = Path("/proc/cpuinfo")


@cache
def processor() -> str:
    """Model of the processor, e.g. ``AMD EPYC 7763``.

    The architecture where the system does not say.
    """
    return _cpu_info().get("model name") or platform.processor() or platform.machine()


@cache
def features() -> frozenset[str]:
    """Features of the processor as Linux names them, e.g. ``avx2``.

    Empty where the system does not say.
    """
    return frozenset(_cpu_info().get("flags", "").split())


def is_pinnable() -> bool:
    """Whether the processor has what :data:`PINS` chooses: all of :data:`LEVEL`."""
    return features() >= set(LEVEL_NEEDS.values())


def pin() -> None:
    """Set :data:`PINS`: for this process where numpy is not loaded yet, and for those it starts."""
    if is_pinnable():
        os.environ.pop(_ASKS_FOR_MORE, None)  # numpy refuses to load where both are set
        os.environ.update(PINS)


def hides_features() -> bool:
    """Whether ``GLIBC_TUNABLES`` hides features of the processor from the C library."""
    return _shown_tunables() != os.environ.get(TUNABLES, "")


def restart_unmasked() -> None:
    """Start this program once more where :func:`hides_features`, without that entry.

    The C library reads the variable before the first line of Python.
    """
    if hides_features():
        environment = {**os.environ, TUNABLES: _shown_tunables()}
        os.execve(sys.executable, [sys.executable, *sys.orig_argv[1:]], environment)


def _shown_tunables() -> str:
    entries = os.environ.get(TUNABLES, "").split(":")
    return ":".join(entry for entry in entries if not entry.startswith(_MASKS_FEATURES))


def _cpu_info() -> dict[str, str]:
    """Entries of the first processor; empty where there is no such file."""
    try:
        text = _CPU_INFO.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return {}
    first, _, _ = text.partition("\n\n")
    pairs = (line.partition(":") for line in first.splitlines())
    return {key.strip(): value.strip() for key, _, value in pairs}
