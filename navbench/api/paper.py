"""The cost model applied to what the paper measured."""

import dataclasses
from dataclasses import dataclass
from typing import Any

from harness.economics.break_even import Thresholds, thresholds
from harness.economics.cost_model import price
from harness.economics.prices import Prices, load_prices
from harness.report.published import Published, PublishedMethod, load_published


@dataclass(frozen=True)
class Paper:
    """The paper's measurements at some prices."""

    published: Published
    prices: Prices
    thresholds: Thresholds

    def as_json(self) -> dict[str, Any]:
        """Economics of the seven methods and of the real robot, and the thresholds."""
        methods = self.published.methods.items()
        real = self.published.real_world_canvas.method
        return {
            "methods": {name: {"economics": self._economics(method)} for name, method in methods},
            "real_world_canvas": {"economics": self._economics(real)},
            "thresholds": dataclasses.asdict(self.thresholds),
        }

    def _economics(self, method: PublishedMethod) -> dict[str, float | None]:
        measured = method.measured, method.sensors, method.data_collection
        return price(*measured, self.prices).as_json()


def paper(prices: str = "costnav") -> Paper:
    """The paper's tables from its published measurements.

    Args:
        prices: a name of params/prices or a file.

    Raises:
        InputError: the prices cannot be used.
    """
    loaded = load_prices(prices)
    return Paper(load_published(), loaded, thresholds(loaded))
