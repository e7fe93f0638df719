"""Made-up runs of one stack with all the parameters that a run keeps."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from harness.calibration.candidate import write_candidate


@pytest.fixture
def write_world_run(write_run: Callable[..., Path], tmp_path: Path) -> Callable[..., Path]:
    """Write a run folder of random deliveries of one stack in a world with given settings."""

    def write(name: str, stack: str = "paper-gps", settings: dict[str, Any] | None = None, **choices: Any) -> Path:
        folder = write_run(name, (stack,), **choices)
        files = write_candidate(settings or {}, tmp_path / f"{name}-files")
        for kind, file in files.items():
            target = "world.yaml" if kind == "world" else f"{stack}-{kind}.yaml"
            (folder / "params" / target).write_bytes(Path(file).read_bytes())
        return folder

    return write
