"""The published world beside the published rows; see ``python -m tools.frozen_world --help``."""
