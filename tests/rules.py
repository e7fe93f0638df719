"""Rules of a delivery with a timeout that a test can wait for."""

_RULES = """arrival_radius: 2.0
timeout: {timeout}
max_tilt: 0.5
impulse_health: 177.78
spoiled_fraction: 0.05
"""


def short_rules(timeout: float) -> str:
    """The text of a file of rules; the timeout is in [s]."""
    return _RULES.format(timeout=timeout)
