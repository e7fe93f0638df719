"""What the image is built from is what the package needs."""

import shlex
import tomllib
from pathlib import Path

from .blocks import ROOT


def copied() -> set[str]:
    """The files and folders that the Dockerfile copies."""
    lines = (ROOT / "Dockerfile").read_text(encoding="utf-8").splitlines()
    words = [shlex.split(line)[1:-1] for line in lines if line.startswith("COPY ")]
    return {word for line in words for word in line}


def test_every_file_that_the_package_names_is_copied() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    wheel = project["tool"]["hatch"]["build"]["targets"]["wheel"]
    needed = {project["project"]["readme"], *project["project"].get("license-files", [])}
    needed |= {"hatch_build.py", "pyproject.toml", *wheel["packages"]}
    needed |= {Path(each).parts[0] for each in wheel.get("force-include", {})}
    assert needed <= copied()
    assert all((ROOT / name).exists() for name in copied())
