"""The published rules, judged on hand-made truths."""

import dataclasses

import numpy as np
import pytest

from harness.storage.shipped import shipped
from harness.world.outcome import Outcome, Rules
from harness.world.truth import CargoState, CountedContact, Partner, Truth
from navstack.params.strict import load_dataclass
from navstack.types import Pose2D, Twist2D

GOAL = Pose2D(10.0, 0.0)
UNDERWAY = Truth(
    stamp=50.0,
    pose=Pose2D(0.0, 0.0),
    tilt=0.0,
    twist=Twist2D(),
    pedestrians=np.empty((0, 4)),
    counted_contacts=(),
    contacts=(),
    cargo=CargoState(50, 0),
)


@pytest.fixture(scope="module")
def rules() -> Rules:
    return load_dataclass(Rules, shipped("params") / "rules" / "costnav.yaml")


def counted(*impulses: float) -> tuple[CountedContact, ...]:
    return tuple(
        CountedContact(1.0, Partner.PEDESTRIAN, "pedestrian", 0, 0.0, 0.0, impulse, 1.0, 1.0)
        for impulse in impulses
    )


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, None),
        ({"pose": Pose2D(8.0, 0.0)}, Outcome.SLA),
        ({"pose": Pose2D(7.99, 0.0)}, None),
        # exactly 5 % is not more than 5 %
        ({"pose": Pose2D(9.0, 0.0), "cargo": CargoState(40, 2)}, Outcome.SLA),
        ({"pose": Pose2D(9.0, 0.0), "cargo": CargoState(40, 3)}, Outcome.SPOILED),
        ({"pose": Pose2D(9.0, 0.0), "cargo": None}, Outcome.ARRIVED),
        ({"stamp": 241.0}, Outcome.TIMEOUT),
        ({"stamp": 241.0, "pose": Pose2D(9.0, 0.0)}, Outcome.SLA),
        ({"tilt": 0.51}, Outcome.PHYSICAL_ASSISTANCE),
        ({"tilt": 0.49}, None),
        ({"counted_contacts": counted(177.7)}, None),
        ({"counted_contacts": counted(100.0, 77.8)}, Outcome.PHYSICAL_ASSISTANCE),
        # arrival goes first, as in the published code
        ({"counted_contacts": counted(100.0, 77.8), "pose": Pose2D(9.0, 0.0)}, Outcome.SLA),
        ({"tilt": 0.51, "pose": Pose2D(9.0, 0.0)}, Outcome.SLA),
    ],
)
def test_rules(rules: Rules, changes: dict[str, object], expected: Outcome | None) -> None:
    verdict = rules.judge(dataclasses.replace(UNDERWAY, **changes), GOAL)
    assert (verdict.outcome if verdict else None) is expected


def test_a_truth_that_says_nothing_of_it_has_cost_no_energy() -> None:
    assert UNDERWAY.motion_energy == 0.0
