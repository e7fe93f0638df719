"""The models of people beside real ones: speeds, separations and post-encroachment times.

Usage: python -m tools.compare_pedestrians [--figure PNG] [--seeds N]

Real people: UCY zara01 in $NAVSTACK_DATA/ucy_zara01 (Lerner, Chrysanthou & Lischinski 2007), a
pavement of which a camera sees about 16 m. Simulated people walk between random goals in a straight
corridor, as many of them as give the middle 16 m about as many people as the recording has. Nothing
is fitted: each model has the parameters of its world.
"""

import argparse
import dataclasses
import os
import sys
from pathlib import Path

import numpy as np

from harness.storage.shipped import shipped
from harness.world.people.models import make_pedestrians
from harness.world.people.params import ReplayParams
from harness.world.people.replay_file import Recording, load_recording
from harness.world.physics.robot import RobotParams
from harness.world.world_params import WorldParams
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.params.strict import load_dataclass
from navstack.types import FloatArray, Pose2D
from tools.pedestrian_statistics import (
    companions,
    mean_presence,
    post_encroachment_times,
    prediction_errors,
    record_states,
    separations,
    walking_speeds,
)

PERIOD = 0.4  # [s] of the recording
LENGTH, WIDTH = 120.0, 6.0  # [m] of the corridor
VIEW = 15.7  # [m] of its middle, as long as the recorded stretch
RUN_TIME, SETTLE_TIME = 360.0, 60.0  # [s] watched (as long as the recording), and before that
COUNT = 29  # people in the corridor
STEP = 1.0 / 60.0  # [s]
PERCENTILES = (1, 5, 25, 50, 75, 95)
WORLDS = {"random_walk": "easy", "social_force": "social", "measured": "measured"}


def corridor() -> OccupancyGrid:
    """A straight strip of walkable ground along x."""
    return OccupancyGrid(
        np.zeros((round(WIDTH / 0.1), round(LENGTH / 0.1)), dtype=np.int8), 0.1, Pose2D()
    )


def simulate(world: str, seed: int) -> Recording:
    """What a camera over the middle of the corridor sees."""
    params = shipped("params")
    people = load_dataclass(WorldParams, params / "worlds" / f"{world}.yaml").people
    robot = load_dataclass(RobotParams, params / "robots" / "segway_e1.yaml")
    model = make_pedestrians(dataclasses.replace(people, count=COUNT), corridor(), robot)
    model.reset(np.random.default_rng(seed), Pose2D(-1000.0, 0.0))
    states = []
    every = round(PERIOD / STEP)
    for k in range(round((SETTLE_TIME + RUN_TIME) / STEP)):
        model.step(STEP)
        if k * STEP >= SETTLE_TIME and k % every == 0:
            states.append(model.states)
    middle = 0.5 * LENGTH
    return record_states(np.array(states), PERIOD, (middle - 0.5 * VIEW, middle + 0.5 * VIEW))


def measure(recordings: list[Recording]) -> dict[str, FloatArray]:
    """Speeds [m/s], separations [m] and post-encroachment times [s] of several recordings."""
    return {
        "speed": np.concatenate([walking_speeds(r) for r in recordings]),
        "separation": np.concatenate([separations(r, PERIOD) for r in recordings]),
        "PET": np.concatenate([post_encroachment_times(r, PERIOD) for r in recordings]),
    }


def report(title: str, recordings: list[Recording], values: dict[str, FloatArray]) -> None:
    """Print one block of the table."""
    present = np.mean([mean_presence(r, PERIOD) for r in recordings])
    in_company = np.mean([(companions(r, PERIOD).sum(axis=1) > 1).mean() for r in recordings])
    print(
        f"\n{title}: {present:.1f} people in view on average, {in_company:.0%} of them in company"
    )
    print(f"{'':14}{'n':>7}" + "".join(f"{f'p{p}':>7}" for p in PERCENTILES) + f"{'mean':>8}")
    for name, unit in (("speed", "m/s"), ("separation", "m"), ("PET", "s")):
        v = values[name]
        row = "".join(f"{x:7.2f}" for x in np.percentile(v, PERCENTILES))
        print(f"{f'{name} [{unit}]':14}{len(v):>7}{row}{v.mean():8.2f}")
    overlapping = (values["separation"] < 0.5).mean()
    print(f"{'':14}nearer than 0.5 m: {overlapping:.2%} of the samples")


def draw(results: dict[str, dict[str, FloatArray]], path: Path) -> None:
    """Cumulative distributions, one panel each."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10.0, 3.0), dpi=150, layout="constrained")
    panels = figure.subplots(1, 3)
    styles = {
        "real people": ("black", 2.2),
        "random_walk": ("#d1242f", 1.5),
        "social_force": ("#0b6e4f", 1.5),
    }
    styles |= {"measured": ("#1f6feb", 1.5)}
    for axes, name, label, limit in (
        (panels[0], "speed", "speed [m/s]", 2.2),
        (panels[1], "separation", "distance to the nearest stranger [m]", 6.0),
        (panels[2], "PET", "post-encroachment time [s]", 5.0),
    ):
        for title, values in results.items():
            color, width = styles[title]
            v = np.sort(values[name])
            axes.plot(v, np.arange(1, len(v) + 1) / len(v), color=color, lw=width, label=title)
        axes.set(xlabel=label, ylabel="share below", xlim=(0.0, limit), ylim=(0.0, 1.0))
        axes.grid(alpha=0.3)
    panels[0].legend(frameon=False, fontsize=8)
    figure.savefig(path)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--figure", type=Path)
    parser.add_argument("--seeds", type=int, default=5)
    arguments = parser.parse_args()
    data = os.environ.get("NAVSTACK_DATA")
    if not data:
        sys.exit("NAVSTACK_DATA is not set; it names the folder that holds ucy_zara01/obsmat.txt")
    real = load_recording(ReplayParams(file=str(Path(data) / "ucy_zara01" / "obsmat.txt")))
    ade, fde, windows = prediction_errors(real)
    print(
        f"constant velocity on the recording: ADE {ade:.2f} m, FDE {fde:.2f} m ({windows} windows)"
    )
    results = {"real people": measure([real])}
    report("real people (UCY zara01)", [real], results["real people"])
    for model, world in WORLDS.items():
        recordings = [simulate(world, seed) for seed in range(arguments.seeds)]
        results[model] = measure(recordings)
        report(f"{model} (params/worlds/{world}.yaml)", recordings, results[model])
    if arguments.figure:
        draw(results, arguments.figure)


if __name__ == "__main__":
    main()
