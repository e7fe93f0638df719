"""Popcorn held to account: how much spills at a given shake, and what simulating it only when shaken leaves out.

Usage: python benchmarks/check_cargo.py dose [--seeds 20]
       python benchmarks/check_cargo.py gate [--episodes 100] [--stack NAME ...]

``dose`` brakes and strikes a standing bucket; every seed has a heap and a direction of its own. ``gate`` drives
deliveries, keeps those with a contact or a hard brake, and shakes two buckets alike with the recorded motion: one
simulated while something happens, as in a study, and one simulated always. Where either loses a piece, buckets whose
pieces begin a micrometre beside are simulated always as well: what they lose otherwise is chaos, below which no two
ways of simulating can agree.
"""

import argparse
import copy
import dataclasses
import math
from collections.abc import Iterator

import numpy as np
from options import parsed

from harness.episode.episode import run_episode
from harness.statistics.bootstrap import bootstrap_mean
from harness.statistics.interval import Interval, wilson_interval
from harness.task.study import make_study
from harness.world.cargo import Cargo
from harness.world.world_params import CargoParams
from navstack.types import FloatArray

DT, GRAVITY = 1.0 / 120.0, 9.81  # [s], [m/s2]
LEVEL, STILL = (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
FILLS = (0.6, 0.8, 1.0)
SPOILED = 0.05  # [-] share of the pieces beyond which a delivery is spoiled
HARD_BRAKE = 3.5  # [m/s2] mean over BRAKE_TIME
BRAKE_TIME = 0.1  # [s]
ALWAYS = 1e-9  # [m/s2] a threshold that every motion passes
NUDGE, NUDGES = 1e-6, 3  # [m] per axis, and how many buckets are nudged


def lost(cargo: Cargo, seed: int, accelerations: np.ndarray, calm: float = 1.2) -> float:
    """Share of the pieces that is lost after accelerations (n,) [m/s2] along a direction of the seed's choice."""
    rng = np.random.default_rng(seed)
    cargo.reset(rng)
    direction = rng.uniform(-math.pi, math.pi)
    for a in accelerations.tolist():
        cargo.step((-a * math.cos(direction), -a * math.sin(direction), 0.0), LEVEL, STILL)
    for _ in range(round(calm / DT)):
        cargo.step(STILL, LEVEL, STILL)
    return cargo.state.lost_fraction


def doses() -> dict[str, np.ndarray]:
    """Accelerations (n,) [m/s2], one per physics step."""
    brakes = {f"braking {a:g} m/s2, 0.5 s": np.full(round(0.5 / DT), float(a)) for a in (4, 6, 8)}
    shocks = {f"shock {v:g} m/s": np.array((v / DT,)) for v in (0.5, 1.0, 2.0, 3.0)}
    return {**brakes, **shocks}


def dose_response(seeds: int) -> None:
    """Print the share of lost pieces and of spoiled buckets per dose and fill."""
    print(f"pieces lost [%], mean and 95 % bootstrap interval; buckets spoiled (> 5 %), Wilson; n = {seeds}")
    print(f"{'dose':<24}" + "".join(f"{f'fill {fill}':>40}" for fill in FILLS))
    buckets = [Cargo(dataclasses.replace(CargoParams(), fill=fill), GRAVITY, DT) for fill in FILLS]
    for name, accelerations in doses().items():
        cells = []
        for bucket in buckets:
            shares = np.array([lost(bucket, seed, accelerations) for seed in range(seeds)])
            mean = bootstrap_mean(100.0 * shares, np.random.default_rng(0))
            spoiled = wilson_interval(int((shares > SPOILED).sum()), seeds)
            cells.append(f"{told(mean, 1)} {told(spoiled, 2)}")
        print(f"{name:<24}" + "".join(f"{cell:>40}" for cell in cells), flush=True)


def told(interval: Interval, digits: int) -> str:
    """A value with its interval."""
    return f"{interval.value:.{digits}f} [{interval.low:.{digits}f}, {interval.high:.{digits}f}]"


class NudgedCargo(Cargo):
    """A bucket whose pieces begin a little beside."""

    nudge = 0  # number of the choice of displacements

    def _build(self, heap: FloatArray) -> None:
        rng = np.random.default_rng(self.nudge)
        super()._build(heap + rng.normal(0.0, NUDGE, heap.shape))


@dataclasses.dataclass
class Shaken:
    """One delivery's bucket: what moved it, and the pieces lost when simulated while something happens."""

    name: str
    gated: int
    motion: list[tuple]  # per physics step: acceleration [m/s2], orientation, spin [rad/s]
    generator: np.random.Generator

    @property
    def brakes_hard(self) -> bool:
        """Whether the bucket was accelerated horizontally by HARD_BRAKE, averaged over BRAKE_TIME."""
        window = round(BRAKE_TIME / DT)
        horizontal = np.array([acceleration[:2] for acceleration, _, _ in self.motion])
        sums = np.cumsum(np.vstack((np.zeros(2), horizontal)), axis=0)
        return bool((np.hypot(*(sums[window:] - sums[:-window]).T) / window).max() >= HARD_BRAKE)

    def always(self, cargo: Cargo) -> int:
        """The pieces lost by a bucket that is simulated throughout."""
        cargo.reset(copy.deepcopy(self.generator))
        for step in self.motion:
            cargo.step(*step)
        return cargo.state.pieces_outside


def eventful(stacks: list[str], wanted: int, seed: int, pedestrians: int) -> Iterator[Shaken]:
    """Drive deliveries until ``wanted`` had a contact or a hard brake."""
    motion: list[tuple] = []
    undisturbed = Cargo.step

    def recorded(cargo: Cargo, *step: tuple) -> None:
        motion.append(step)
        undisturbed(cargo, *step)

    found = 0
    study = make_study(stacks=stacks, episodes=20 * wanted, seed=seed, pedestrians=pedestrians, world="easy")
    by_episode = sorted(study.tasks(), key=lambda task: (task.episode, task.stack_number))
    for task in by_episode:
        motion.clear()
        Cargo.step = recorded  # type: ignore[method-assign]
        delivery = run_episode(task)
        Cargo.step = undisturbed  # type: ignore[method-assign]
        name = f"{task.stack.name} {task.episode}"
        shaken = Shaken(name, delivery.row["pieces_lost"], list(motion), task.generators()["cargo"])
        if delivery.events or shaken.brakes_hard:
            found += 1
            yield shaken
        if found == wanted:
            return


def gate(stacks: list[str], wanted: int, seed: int, pedestrians: int) -> None:
    """Print how far apart the two ways of simulating are."""
    params = dataclasses.replace(CargoParams(), wake_acceleration=ALWAYS)
    throughout, nudged = Cargo(params, GRAVITY, DT), NudgedCargo(params, GRAVITY, DT)
    limit = SPOILED * params.pieces
    apart: list[int] = []
    chaos: list[int] = []
    missed = 0
    for shaken in eventful(stacks, wanted, seed, pedestrians):
        always = shaken.always(throughout)
        apart.append(abs(shaken.gated - always))
        missed += shaken.gated <= limit < always
        others: list[int] = []
        if shaken.gated or always:
            for nudged.nudge in range(NUDGES):
                others.append(shaken.always(nudged))
            chaos += [abs(other - always) for other in others]
        beside = f", nudged {others}" if others else ""
        print(f"{shaken.name:<20} lost {shaken.gated} while something happens, {always} always{beside}", flush=True)
    print(
        f"{len(apart)} deliveries with a contact or a hard brake: pieces lost differ by more than one in "
        f"{sum(d > 1 for d in apart)}, at most by {max(apart)}; spoiled but called intact: {missed}\n"
        f"of {len(chaos)} nudged buckets {sum(d > 1 for d in chaos)} differ by more than one, "
        f"at most by {max(chaos, default=0)}"
    )


def main() -> None:
    """Read the arguments and check."""
    parser, stacks = argparse.ArgumentParser(), ["nav2-stock", "paper-gps", "parked"]
    parser.add_argument("what", choices=("dose", "gate"))
    arguments = parsed(__doc__, parser, seeds=20, seed=0, episodes=100, pedestrians=100, stack=stacks)
    if arguments.what == "dose":
        dose_response(arguments.seeds)
    else:
        gate(arguments.stack, arguments.episodes, arguments.seed, arguments.pedestrians)


if __name__ == "__main__":
    main()
