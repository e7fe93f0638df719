"""How far people are from where the controller of least expected cost predicts them.

Usage: python -m tools.check_predictions [--stack NAME] [--map NAME] [--world NAME]
           [--pedestrians N] [--episodes N] [--seed N]

Tracked people within the controller's range are predicted straight on, twice a second, and compared
with where they are later. Who stands (below 0.3 m/s) is told apart. Printed are quantiles of the
error to the side of the walk, the standard deviation that the controller states of who walks on
straight, and the shares of errors beyond what it states for 68 % and for 95 % of all people.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.special import erf

from harness.episode.episode import RunningDelivery
from harness.metrics.ghost_tracks import SAME_BODY, in_true_frame
from harness.task.study import make_study
from navstack.control.contact_risk import nearest
from navstack.control.expected_cost.people import Spread, walk_std
from navstack.jit import tuple_of
from navstack.params.expected_cost import ExpectedCostParams
from navstack.types import FloatArray
from tools.options import parsed

PARAMS = ExpectedCostParams()
SPREAD: Spread = tuple_of(Spread, PARAMS)
PERIOD = 0.5  # [s] between two predictions
AHEAD = (0.5, 1.0, 1.5, 2.0, 3.0, 4.0)  # [s]


class Look(NamedTuple):
    """What is predicted at a time."""

    tick: int
    places: FloatArray  # (k, 2) [m] of the tracks, in the true map frame
    rows: FloatArray  # (k, FIELDS) of contact_risk.nearest


def drive(delivery: RunningDelivery) -> tuple[list[Look], FloatArray, float]:
    """Looks at a delivery, all people's places (T, n, 2) [m], and the period [s] between them."""
    looks: list[Look] = []
    people: list[FloatArray] = []
    due = 0.0
    while delivery.verdict is None:
        truth = delivery.truth
        belief = delivery.brain.belief
        people.append(truth.pedestrians[:, :2].copy())
        if truth.stamp >= due and delivery.brain.tracks and belief is not None:
            due = truth.stamp + PERIOD
            rows = nearest(
                delivery.brain.tracks, belief.pose, truth.stamp, PARAMS.max_tracks, PARAMS.range
            )
            places = in_true_frame(rows[:, :2], belief.pose.as_array(), truth.pose.as_array())
            looks.append(Look(len(people) - 1, places, rows))
        delivery.drive_tick()
    return looks, np.array(people), delivery.truth.stamp / len(people)


def errors(
    looks: list[Look],
    people: FloatArray,
    period: float,
) -> Iterator[tuple[float, float, float, float]]:
    """Seconds ahead, speed [m/s], error to the side [m] and stated standard deviation [m]."""
    for look in looks:
        now = people[look.tick]
        for place, row in zip(look.places, look.rows, strict=True):
            away = np.nan_to_num(np.hypot(*(now - place).T), nan=np.inf)
            person = int(away.argmin())
            if away[person] > SAME_BODY:
                continue
            speed = float(np.hypot(row[2], row[3]))
            for ahead in AHEAD:
                tick = look.tick + round(ahead / period)
                if tick >= len(people):
                    break
                off = people[tick, person] - (place + ahead * row[2:4])
                side = float(row[2] * off[1] - row[3] * off[0]) / max(speed, 1e-6)
                stated = walk_std(row, ahead, SPREAD)
                if speed < SPREAD.standing_speed:
                    stated = SPREAD.position_std + SPREAD.standing_std * ahead
                yield ahead, speed, abs(side), stated


def within(errors: FloatArray, ahead: float, stated: FloatArray, walks: bool) -> FloatArray:
    """The probability (n,) that the controller gives to smaller errors to the side."""
    straight = erf(errors / stated / np.sqrt(2.0))
    if not walks:
        return straight
    deviating = erf(errors / (stated + SPREAD.deviating_std * ahead) / np.sqrt(2.0))
    return straight + SPREAD.deviating_weight * (deviating - straight)


def main() -> None:
    asked = parsed(
        __doc__,
        stack="evasive-gps-ekf",
        map="sidewalk_2",
        world="published_3",
        pedestrians=60,
        episodes=10,
        seed=6100,
    )
    study = make_study(
        stacks=[asked.stack],
        episodes=asked.episodes,
        seed=asked.seed,
        world=asked.world,
        map_name=asked.map,
        pedestrians=asked.pedestrians,
        workers=1,
    )
    found = np.array(
        [row for task in study.tasks() for row in errors(*drive(RunningDelivery(task)))]
    )
    print("| who | s ahead | n | median [m] | 68 % | 95 % | stated [m] | beyond 68 % | 95 % |")
    print("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |")
    stands = found[:, 1] < PARAMS.standing_speed
    for who, is_meant in (("walks", ~stands), ("stands", stands)):
        for ahead in AHEAD:
            _, _, side, stated = found[is_meant & (found[:, 0] == ahead)].T
            if not len(side):
                continue
            chance = within(side, ahead, stated, who == "walks")
            middle, most, nearly_all = np.quantile(side, (0.5, 0.68, 0.95))
            print(
                f"| {who} | {ahead} | {len(side)} | {middle:.2f} | {most:.2f} | {nearly_all:.2f} "
                f"| {np.median(stated):.2f} | {np.mean(chance > 0.68):.2f} "
                f"| {np.mean(chance > 0.95):.2f} |"
            )


if __name__ == "__main__":
    main()
