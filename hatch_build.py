"""Kernels compiled ahead for the wheel: whoever installs it drives the first delivery at once.

``make wheel`` builds such a wheel, with the numba that is to run it. Where numba is missing, as in
pip's own build environment, the wheel has no compiled kernels, and they are compiled before the
first delivery.
"""

import importlib.util
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

PACKAGES = ("navstack", "harness")
# numba's cache, and the list of what is in it
COMPILED = ("*.nbi", "*.nbc", "navbench-compiled.txt")
COMPILE = (
    "from harness.study.compile_ahead import compile_new, every_module; compile_new(every_module())"
)


class CompiledKernels(BuildHookInterface[Any]):
    """Compiles the kernels of copied packages and puts numba's cache beside the wheel's sources."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Called by hatch before it writes a wheel."""
        if version == "editable" or importlib.util.find_spec("numba") is None:
            return
        self._copy = Path(tempfile.mkdtemp(prefix="navbench-kernels-"))
        for package in PACKAGES:
            source = Path(self.root, package)
            shutil.copytree(
                source, self._copy / package, ignore=shutil.ignore_patterns("__pycache__")
            )
        environment = {**os.environ, "PYTHONPATH": str(self._copy)}
        environment.pop("NUMBA_CACHE_DIR", None)
        subprocess.run([sys.executable, "-c", COMPILE], cwd=self._copy, env=environment, check=True)
        files = [file for pattern in COMPILED for file in self._copy.rglob(pattern)]
        build_data["force_include"].update(
            {str(file): str(file.relative_to(self._copy)) for file in files}
        )

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Called by hatch when the wheel is written."""
        if hasattr(self, "_copy"):
            shutil.rmtree(self._copy)
