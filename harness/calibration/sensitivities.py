"""How much each free parameter matters: each at its ends, all others as they are, on the same deliveries."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness.calibration.reading import INJURY, read_run
from harness.compare import Side, compare
from harness.durable_files import write_text
from harness.statistics import Interval, holm, wilson_interval
from harness.stored_run import StoredRun
from harness.valuation import OUTCOMES
from navstack.errors import InputError
from navstack.params.strict import read_text

COMPARED = (*OUTCOMES, INJURY, "avg_collision_impulse_ns", "avg_distance_km", "contribution_margin")
SURE = 0.05  # adjusted p below which an effect can hardly be chance


@dataclass(frozen=True, slots=True)
class Effect:
    """What one value of one parameter changes for one stack, present values being the other side."""

    key: str
    end: str  # name among :attr:`harness.calibration.declaration.Free.ends`
    value: Any
    stack: str
    pairs: int  # deliveries in common
    differences: dict[str, Interval]  # by key of COMPARED
    p: dict[str, float]  # likewise; 1 where no delivery differs


@dataclass(frozen=True, slots=True)
class Study:
    """All effects that were measured."""

    seed: int
    episodes: int
    present: dict[str, dict[str, Interval]]  # stack -> key of COMPARED -> how it is at present
    effects: tuple[Effect, ...]

    @property
    def sure(self) -> set[tuple[str, str, str, str]]:
        """Key, end, stack and quantity of the effects that are significant among all of the study (Holm)."""
        named = {(e.key, e.end, e.stack, name): p for e in self.effects for name, p in e.p.items() if p < 1.0}
        return {name for name, p in zip(named, holm(list(named.values())), strict=True) if p < SURE}


def measure(present: StoredRun, other: StoredRun, key: str, end: str, value: Any) -> Effect:
    """The effect of another value, delivery by delivery."""
    compared = compare(Side(present, present.stacks[0]), Side(other, other.stacks[0]), COMPARED)
    paired = {name: compared.differences[name].paired for name in COMPARED}
    return Effect(
        key=key,
        end=end,
        value=value,
        stack=present.stacks[0].name,
        pairs=compared.pairs,
        differences={name: each.difference for name, each in paired.items()},
        p={name: each.p if each.differs else 1.0 for name, each in paired.items()},
    )


def present_values(run: StoredRun) -> dict[str, Interval]:
    """The compared quantities of a run by themselves."""
    reading = read_run(run)
    shares = {outcome: wilson_interval(reading.counts[outcome], reading.n) for outcome in OUTCOMES}
    return {**shares, **{key: reading.means[key] for key in COMPARED if key in reading.means},
            "contribution_margin": reading.margin}  # fmt: skip


def save(study: Study, path: Path) -> None:
    """Keep a study, so that the document can be made where its runs are not."""
    document = {
        "schema": 1,
        "seed": study.seed,
        "episodes": study.episodes,
        "present": {stack: _intervals_json(values) for stack, values in study.present.items()},
        "effects": [
            {
                "key": effect.key,
                "end": effect.end,
                "value": effect.value,
                "stack": effect.stack,
                "pairs": effect.pairs,
                "differences": _intervals_json(effect.differences),
                "p": effect.p,
            }
            for effect in study.effects
        ],
    }
    write_text(path, json.dumps(document, indent=1, allow_nan=False) + "\n")


def load(path: Path) -> Study:
    """A study that :func:`save` kept.

    Raises:
        InputError: the file is absent or damaged.
    """
    try:
        document = json.loads(read_text(path))
        effects = [
            Effect(**{**entry, "differences": _intervals(entry["differences"])}) for entry in document["effects"]
        ]
        present = {stack: _intervals(values) for stack, values in document["present"].items()}
        return Study(document["seed"], document["episodes"], present, tuple(effects))
    except (ValueError, TypeError, KeyError, AttributeError):
        raise InputError(f"{path}: is damaged; make it anew with benchmarks/calibrate.py sensitivity") from None


def ranked(effects: Iterable[Effect], names: Sequence[str] = OUTCOMES) -> list[str]:
    """Keys of parameters, that with the largest mean effect on these quantities first."""
    largest: dict[str, float] = {}
    for effect in effects:
        size = max(abs(effect.differences[name].value or 0.0) for name in names)
        largest[effect.key] = max(largest.get(effect.key, 0.0), size)
    return sorted(largest, key=lambda key: -largest[key])


def _intervals_json(values: Mapping[str, Interval]) -> dict[str, Any]:
    return {name: interval.as_json() for name, interval in values.items()}


def _intervals(values: Mapping[str, Any]) -> dict[str, Interval]:
    return {name: Interval(**interval) for name, interval in values.items()}
