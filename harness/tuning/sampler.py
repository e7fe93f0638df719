"""Where to look next: Optuna's samplers by ask and tell, in a reproducible order.

Optuna (Akiba et al. 2019) keeps its study in memory; a study that was cut off is asked and told
again from its journal. Every question has a generator of its own, drawn from the study's seed and
the question's number, so that the answers depend on what was told and on nothing else.
"""

import itertools
import math
import warnings
from collections.abc import Iterator, Sequence
from typing import Any, Protocol

import numpy as np
import optuna
from optuna.distributions import (
    BaseDistribution,
    CategoricalDistribution,
    FloatDistribution,
    IntDistribution,
)
from optuna.trial import TrialState, create_trial

from harness.tuning.evaluation import Value
from harness.tuning.space.space import Parameter, Space
from navstack.errors import InputError, UnknownNameError

STARTUP = 10  # random trials before TPE has anything to model; Optuna's default
ATTEMPTS = 1000  # at a point that keeps the constraints
ASKED, SHUFFLED = 1, 2  # kinds of generators

Point = dict[str, Value]


class Sampler(Protocol):
    """Chooses points."""

    def ask(self) -> Point | None:
        """A point of the space that keeps its constraints; None: there is none left."""

    def tell(self, point: Point, values: Sequence[float] | None) -> None:
        """What came of a point, the last one asked for or any other.

        None: it could not be driven.
        """


class OptunaSampler:
    """Multivariate TPE, CMA-ES or random points.

    TPE: Bergstra et al. 2011, multivariate: Falkner et al. 2018. CMA-ES: Hansen 2016.
    """

    def __init__(self, kind: str, space: Space, seed: int, objectives: int) -> None:
        """Ask nothing yet.

        Args:
            kind: a name of :data:`SAMPLERS` except grid.
            space: where to look.
            seed: of the study.
            objectives: their number.

        Raises:
            InputError: the kind cannot do that.
        """
        if kind == "cmaes" and (objectives > 1 or any(each.choices for each in space.parameters)):
            raise InputError(
                "--sampler cmaes wants one objective and ranges only, no choices; give --sampler "
                "tpe"
            )
        self._kind, self._space, self._seed = kind, space, seed
        self._distributions = distributions_of(space)
        optuna.logging.set_verbosity(optuna.logging.ERROR)
        self._study = optuna.create_study(
            directions=["maximize"] * objectives, sampler=self._make(0)
        )
        self._asked: optuna.trial.Trial | None = None

    def ask(self) -> Point | None:
        """As :class:`Sampler` has it."""
        for _ in range(ATTEMPTS):
            trial = self._ask()
            point = {
                each.name: each.rounded(trial.params[each.name]) for each in self._space.parameters
            }
            if self._space.allows(point):
                self._asked = trial
                return point
            self._study.tell(trial, state=TrialState.FAIL)
        return None

    def tell(self, point: Point, values: Sequence[float] | None) -> None:
        """As :class:`Sampler` has it."""
        asked, self._asked = self._asked, None
        if asked is not None:
            self._study.tell(
                asked, values, TrialState.FAIL if values is None else TrialState.COMPLETE
            )
        elif values is not None:
            params = possible_point(self._space, point)
            self._study.add_trial(
                create_trial(params=params, distributions=self._distributions, values=values)
            )

    def _ask(self) -> optuna.trial.Trial:
        number = len(self._study.get_trials(deepcopy=False))
        self._study.sampler = self._make(number)
        with warnings.catch_warnings():
            # what Optuna calls experimental, and how CMA-ES falls back
            warnings.simplefilter("ignore")
            return self._study.ask(self._distributions)

    def _make(self, number: int) -> optuna.samplers.BaseSampler:
        seed = int(np.random.SeedSequence((self._seed, ASKED, number)).generate_state(1)[0])
        if self._kind == "random":
            return optuna.samplers.RandomSampler(seed=seed)
        with warnings.catch_warnings():
            # TPE's multivariate is called experimental, CMA-ES's start deprecated
            warnings.simplefilter("ignore")
            if self._kind == "cmaes":
                start = {
                    each.name: _possible(each, each.original) for each in self._space.parameters
                }
                return optuna.samplers.CmaEsSampler(
                    x0=start,
                    seed=seed,
                    warn_independent_sampling=False,
                )
            return optuna.samplers.TPESampler(
                seed=seed,
                n_startup_trials=STARTUP,
                multivariate=True,
            )


class GridSampler:
    """Every combination of levels that keeps the constraints, shuffled by the seed.

    Each range has as many levels as let the grid have at most ``trials`` points, at least two.
    """

    def __init__(self, space: Space, seed: int, trials: int) -> None:
        levels = _grid(space, 2)
        most = max(100 * trials, *map(len, levels))
        for count in range(3, trials + 1):
            finer = _grid(space, count)
            if math.prod(map(len, finer)) > trials:
                break
            levels = finer
        if (size := math.prod(map(len, levels))) > most:
            raise InputError(
                f"--sampler grid: {len(levels)} parameters make {size} points even with two levels "
                f"each, for {trials} "
                "trials; give --sampler tpe or random, or a smaller space"
            )
        names = [each.name for each in space.parameters]
        points = [dict(zip(names, point, strict=True)) for point in itertools.product(*levels)]
        allowed = [point for point in points if space.allows(point) and point != space.original]
        order = np.random.default_rng(np.random.SeedSequence((seed, SHUFFLED))).permutation(
            len(allowed)
        )
        self._points: Iterator[Point] = (allowed[i] for i in order)

    def ask(self) -> Point | None:
        """The next one."""
        return next(self._points, None)

    def tell(self, point: Point, values: Sequence[float] | None) -> None:
        """A grid learns nothing."""


SAMPLERS = ("tpe", "cmaes", "random", "grid")


def make_sampler(kind: str, space: Space, seed: int, trials: int, objectives: int) -> Sampler:
    """A sampler by name.

    Raises:
        InputError: there is none of this name, or it cannot do what is asked for.
    """
    if kind not in SAMPLERS:
        raise UnknownNameError("--sampler", kind, SAMPLERS)
    if kind == "grid":
        return GridSampler(space, seed, trials)
    return OptunaSampler(kind, space, seed, objectives)


def distributions_of(space: Space) -> dict[str, BaseDistribution]:
    """Where Optuna may look, by parameter."""
    return {each.name: _distribution(each) for each in space.parameters}


def possible_point(space: Space, point: Point) -> dict[str, Any]:
    """The nearest point that Optuna could have chosen."""
    return {each.name: _possible(each, point[each.name]) for each in space.parameters}


def _distribution(parameter: Parameter) -> BaseDistribution:
    if parameter.choices:
        return CategoricalDistribution(parameter.choices)
    if parameter.is_int:
        step = int(parameter.step or 1)
        high = parameter.low + (parameter.high - parameter.low) // step * step
        return IntDistribution(int(parameter.low), int(high), parameter.is_log, step)
    if parameter.step is None:
        return FloatDistribution(parameter.low, parameter.high, parameter.is_log)
    steps = math.floor((parameter.high - parameter.low) / parameter.step + 1e-9)
    return FloatDistribution(
        parameter.low, parameter.low + steps * parameter.step, step=parameter.step
    )


def _possible(parameter: Parameter, value: Value) -> Any:
    """The nearest value that a sampler could have chosen.

    A file's own may lie between the steps.
    """
    distribution: Any = _distribution(parameter)
    if isinstance(distribution, CategoricalDistribution) or distribution._contains(
        distribution.to_internal_repr(value)
    ):
        return value
    step, low, high = float(parameter.step or 1.0), distribution.low, distribution.high
    nearest = min(max(low + round((float(value) - low) / step) * step, low), high)
    if parameter.is_int:
        return int(nearest)
    return nearest


def _grid(space: Space, count: int) -> list[tuple[Value, ...]]:
    """The choices of each parameter, or ``count`` levels of its range."""
    return [each.choices or _levels(each, count) for each in space.parameters]


def _levels(parameter: Parameter, count: int) -> tuple[Value, ...]:
    """Evenly spaced values of a range, each once."""
    low, high = parameter.low, parameter.high
    if parameter.is_log:
        spaced = np.geomspace(low, high, count)
    else:
        spaced = np.linspace(low, high, count)
    values = (parameter.rounded(_possible(parameter, float(value))) for value in spaced)
    return tuple(
        dict.fromkeys(round(float(value)) if parameter.is_int else value for value in values)
    )
