"""What arms earn and how they differ, from meetings with people."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.ablation.analysis import (
    AblationDeclaration,
    ArmDifference,
    ErrorPrice,
    compared_pairs,
    error_price,
    injected_levels,
)
from harness.ablation.document import difference_document, price_document
from harness.analysis.meetings_check import NOT_SEEN
from harness.economics.cost_terms import MARGIN
from harness.economics.valuation import CENT
from harness.meetings.estimators import MEETINGS
from harness.meetings.results import MeetingsResult, unseen_loss
from harness.metrics.columns import Row
from harness.statistics.interval import Interval, interval_json
from harness.statistics.paired import PairedDifference, compare_pairs, together
from harness.task.stack import Stack


@dataclass(frozen=True, slots=True)
class MeetingsArms:
    """What the meetings of several stacks say of each, and of their differences."""

    declaration: AblationDeclaration
    arms: tuple[Stack, ...]
    folder: Path  # of the run
    where: str  # world, map and people, in words
    episodes: int  # missions asked for
    seed: int
    result: MeetingsResult | None  # None: no mission is finished
    errors: int = 0  # missions that ended in one, which are left out
    is_interrupted: bool = False
    notes: tuple[str, ...] = ()  # on the file, the robot and the map

    @property
    def has_errors(self) -> bool:
        """Whether missions ended in an error of the machine."""
        return self.errors > 0

    @property
    def missions(self) -> int:
        """Those that every arm has driven."""
        if self.result is None:
            return 0
        return len(self.result.margins)

    @property
    def differences(self) -> list[ArmDifference]:
        """Of the margins [USD a delivery], adjusted as one family."""
        if self.result is None:
            return []
        pairs = compared_pairs(self.arms, self.declaration.against)
        margins = dict(zip(self._names, self.result.margins.T, strict=True))
        clusters = np.arange(self.missions)
        found = [  # each by the same signs, so that it does not depend on the other arms
            compare_pairs(
                margins[other], margins[name], clusters, np.random.default_rng(self.seed), CENT
            )
            for name, other in pairs
        ]
        return [
            ArmDifference(*pair, MARGIN, paired, self._admitting(paired))
            for pair, paired in zip(pairs, together(found), strict=True)
        ]

    @property
    def prices(self) -> list[ErrorPrice]:
        """What each kind of injected error costs."""
        if self.result is None:
            return []
        margins, clusters = self.result.margins, np.arange(self.missions)
        return [
            error_price(kind, levels, margins[:, self._columns(list(levels))], clusters, self.seed)
            for kind, levels in injected_levels(self.arms).items()
        ]

    def _admitting(self, paired: PairedDifference) -> Interval | None:
        """A difference between losses on either side that nobody has seen [USD]."""
        difference = paired.difference
        if self.result is None or difference.value is None:
            return None
        result = self.result
        unseen = unseen_loss(result.unseen_weight, self.missions, paired.tests, result.hit)
        low, high = difference.value - unseen, difference.value + unseen
        return Interval(difference.value, low, high, difference.n)

    @property
    def _names(self) -> list[str]:
        return [arm.name for arm in self.arms]

    def _columns(self, names: Sequence[str]) -> list[int]:
        return [self._names.index(name) for name in names]

    def comparison_json(self) -> Row:
        """As ``navbench compare A B --json`` prints it of two stacks, B less A."""
        sides = {
            key: {"folder": str(self.folder), "stack": stack.name}
            for key, stack in zip("ab", self.arms, strict=True)
        }
        differences = self.differences  # one, or none where no mission is finished
        return {
            **self.as_json(),
            **sides,
            "pairs": self.missions,
            "differences": {each.metric: difference_document(each) for each in differences},
            "margin_with_unseen": interval_json(differences[0].unseen if differences else None),
            "warnings": list(self.notes),
        }

    def as_json(self) -> Row:
        """As ``navbench ablate --estimator meetings --json`` prints it."""
        document: Row = {
            "schema": 1,
            "estimator": MEETINGS,
            "folder": str(self.folder),
            "stack": self.declaration.stack,
            "against": self.declaration.against,
            "episodes": self.episodes,
            "missions": self.missions,
            "errors": self.errors,
            "not_seen": list(NOT_SEEN),
            "arms": [],
            "differences": [difference_document(each) for each in self.differences],
            "price_of_error": {each.kind: price_document(each) for each in self.prices},
        }
        if self.result is None:
            return document
        document["meetings"] = self.result.meetings
        document["farthest_off_planned_way_m"] = self.result.farthest_off
        document["arms"] = [
            {
                "arm": stack.name,
                "localizer": stack.localizer,
                "contribution_margin_usd": arm.margin.as_json(),
                "margin_alone_usd": arm.margin_alone,
                "people_hit_per_delivery": arm.hits.as_json(),
                "contacts_per_1000_km": arm.contacts.as_json(),
            }
            for stack, arm in zip(self.arms, self.result.arms, strict=True)
        ]
        return document
