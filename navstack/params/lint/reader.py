"""What each finding of the reader of parameter files means, by title and id."""

import tomllib
from pathlib import Path

MEANINGS: dict[str, dict[str, str]] = tomllib.loads(
    Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
)
