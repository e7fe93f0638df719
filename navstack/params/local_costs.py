"""What a controller's parameters hold of the local costmap's section."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from navstack.params.costmap import InflationLayerParams


@dataclass(frozen=True, slots=True)
class LocalCosts:
    """What controllers that look for obstacles know of how the local costmap is made."""

    # by name, in their order
    inflation_layers: Mapping[str, InflationLayerParams] = field(default_factory=dict)
    tracks_unknown: bool = False  # unknown cells are no obstacles
    is_round: bool = False  # the robot is given by its radius
    ends_inflated: bool = False  # nothing marks cells after the inflation layer

    def inflation(self, name: str) -> InflationLayerParams | None:
        """The inflation layer of a name, for an empty one the first; None: there is none."""
        if name:
            return self.inflation_layers.get(name)
        return next(iter(self.inflation_layers.values()), None)

    @property
    def last_inflation(self) -> InflationLayerParams | None:
        """The last inflation layer; None: there is none."""
        return next(reversed(list(self.inflation_layers.values())), None)
