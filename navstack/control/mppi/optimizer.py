"""Sample control sequences around the last one, score and average them (``optimizer.cpp``)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from navstack.control.controller import limited_share
from navstack.control.decision import CriticScore
from navstack.control.mppi import control_sequence
from navstack.control.mppi.critic import MppiCritic
from navstack.control.mppi.rollouts import MppiRollouts, add_noise, drift, limit_changes, roll_out
from navstack.control.mppi.scene import MppiScene
from navstack.errors import NoLegalVelocity, ParameterError
from navstack.params.mppi import OMNI, MppiParams
from navstack.types import Float32Array, Twist2D

# [s] by which model_dt and control period may differ where they are meant to be equal
_SAME_PERIOD = 1e-6
_FLOAT = np.float32


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """What came out of a cycle."""

    # (A, T) chosen, of each axis; the command is one of their first two values
    sequences: Float32Array
    command: Twist2D
    # trajectories of the last update, by the critics that found them in collision
    colliding: dict[str, int]


class Noise(NamedTuple):
    """What is added to the sequences."""

    values: Float32Array  # (A, T, B) of each axis
    largest_w: float  # [rad/s] absolute


class Axis(NamedTuple):
    """A velocity that is sampled: forward [m/s], turning [rad/s] or sideways [m/s]."""

    std: float  # of the noise
    least: float
    most: float
    fall: float  # [1/s] least change, negative
    rise: float  # [1/s] most change


def axes_of(params: MppiParams) -> tuple[Axis, ...]:
    """The velocities of a motion model: v, w and, of one that drives sideways, vy."""
    p = params
    axes = (
        Axis(p.vx_std, p.vx_min, p.vx_max, -abs(p.ax_min), p.ax_max),
        Axis(p.wz_std, -p.wz_max, p.wz_max, -p.az_max, p.az_max),
    )
    if p.motion_model != OMNI:
        return axes
    return (*axes, Axis(p.vy_std, -p.vy_max, p.vy_max, -abs(p.ay_min), p.ay_max))


class Optimizer:
    """Model predictive path integral control (Williams et al., IEEE T-RO 34, 2018) as in Nav2."""

    def __init__(self, params: MppiParams, critics: Sequence[MppiCritic], period: float) -> None:
        """Make the optimizer.

        Args:
            params: sampling and limits.
            critics: in the order of evaluation.
            period: control period in [s].

        Raises:
            ParameterError: a model step is shorter than a control period.
        """
        if params.model_dt < period - _SAME_PERIOD:
            raise ParameterError(
                f"MPPI: model_dt {params.model_dt:g} s is shorter than a control period "
                f"({period:g} s); make it as long"
            )
        self._params = params
        self._critics = critics
        # one value of the sequence is used per cycle
        self._shifts = abs(params.model_dt - period) < _SAME_PERIOD
        self._axes = axes_of(params)
        self._rollouts = MppiRollouts.empty(params.time_steps, params.batch_size, len(self._axes))
        self._single = MppiRollouts.empty(params.time_steps, 1, len(self._axes))
        self._no_noise = Noise(np.zeros((len(self._axes), params.time_steps, 1), dtype=_FLOAT), 0.0)
        self._rng: np.random.Generator | None = None
        self._share = 1.0  # of the largest velocities that a speed limit leaves
        self.reset()

    def seed(self, rng: np.random.Generator) -> None:
        """Draw all noise from ``rng`` from now on."""
        self._rng = rng

    def reset(self) -> None:
        """Forget the sequences and the noise."""
        self._sequences = np.zeros((len(self._axes), self._params.time_steps), dtype=_FLOAT)
        # commands of late
        self._history = np.zeros((len(self._axes), control_sequence.HISTORY), dtype=_FLOAT)
        self._noise: Noise | None = None

    def limit_speed(self, limit: float, is_percentage: bool) -> None:
        """Lower the largest velocities, the yaw rate too, to ``limit`` [m/s] or [%].

        0 lifts the limit.
        """
        self._share = min(limited_share(self._params.vx_max, limit, is_percentage), 1.0)

    def solve(self, scene: MppiScene) -> Solution:
        """The command of this cycle.

        Raises:
            NoLegalVelocity: all trajectories collide, in every attempt, or state or costs are no
                finite numbers.
        """
        for _ in range(self._params.retry_attempt_limit + 1):
            colliding = self._optimize(scene)
            if self._params.batch_size not in colliding.values():
                return self._conclude(colliding)
            self.reset()
        raise NoLegalVelocity(colliding)

    def score_alone(self, solution: Solution, scene: MppiScene) -> tuple[CriticScore, ...]:
        """The chosen sequence's scores, without numbers of a critic that did not count."""
        rollouts = self._roll_out(self._single, solution.sequences, self._no_noise, scene)
        found: list[CriticScore] = []
        for critic in self._critics:
            scores = critic.score(rollouts, scene)
            raw = weighted = None
            if scores is not None:
                raw = float(scores.raw[0])
                weighted = float(critic.weighted(scores.raw)[0])
            found.append(
                CriticScore(critic.name, raw, weighted, solution.colliding.get(critic.name, 0))
            )
        return tuple(found)

    def _optimize(self, scene: MppiScene) -> dict[str, int]:
        """Update the sequence; returns the numbers of trajectories in collision by critic.

        Costs add up over the updates of a cycle. After a critic that finds all in collision no
        other is asked.
        """
        params = self._params
        costs = np.zeros(params.batch_size, dtype=_FLOAT)
        for _ in range(params.iteration_count):
            colliding: dict[str, int] = {}
            rollouts = self._roll_out(self._rollouts, self._sequences, self._next_noise(), scene)
            for critic in self._critics:
                scores = critic.score(rollouts, scene)
                if scores is None:
                    continue
                costs += critic.weighted(scores.raw)
                if scores.colliding:
                    colliding[critic.name] = scores.colliding
                if scores.colliding == params.batch_size:
                    return colliding
            if not self._update(rollouts, costs):
                return {"no finite cost": params.batch_size}
        return colliding

    def _next_noise(self) -> Noise:
        """The same until the next reset, or new."""
        params = self._params
        if self._noise is None or params.regenerate_noises:
            assert self._rng is not None, (
                "an MPPI controller is given its generator before its first cycle"
            )
            shape = (len(self._axes), params.time_steps, params.batch_size)
            values = self._rng.standard_normal(shape, dtype=_FLOAT)
            for row, axis in zip(values, self._axes, strict=True):
                row *= _FLOAT(axis.std)
            self._noise = Noise(values, float(np.abs(values[1]).max()))
        return self._noise

    def _roll_out(
        self,
        into: MppiRollouts,
        sequences: Float32Array,
        noise: Noise,
        scene: MppiScene,
    ) -> MppiRollouts:
        """Drive noisy sequences from the measured velocity."""
        dt = self._params.model_dt
        now = scene.velocity
        measured = (now.linear_x, now.angular_z, now.linear_y)
        for i, axis in enumerate(self._axes):
            add_noise(sequences[i], noise.values[i], into.controls[i])
            limit_changes(
                into.controls[i],
                _FLOAT(measured[i]),
                _FLOAT(axis.rise * dt),
                _FLOAT(axis.fall * dt),
            )
        largest = max(abs(now.angular_z), float(np.abs(sequences[1]).max()) + noise.largest_w)
        roll_out(into, _FLOAT(scene.yaw), _FLOAT(dt), _FLOAT(largest * dt))
        if into.vy is not None:
            drift(into, _FLOAT(scene.yaw), _FLOAT(dt))
        return into

    def _update(self, rollouts: MppiRollouts, costs: Float32Array) -> bool:
        """Make the samples' mean by merit the new sequence, within the limits.

        False: costs are not finite.
        """
        params = self._params
        for controls, sequence, axis in zip(
            rollouts.controls, self._sequences, self._axes, strict=True
        ):
            control_sequence.add_control_costs(
                controls, sequence, _FLOAT(params.gamma / axis.std**2), costs
            )
        # nan in one of them, or inf in all: limits would make full speed of that
        if not np.isfinite(costs.min()):
            return False
        shares = control_sequence.softmax(costs, _FLOAT(params.temperature))
        for controls, sequence in zip(rollouts.controls, self._sequences, strict=True):
            control_sequence.weighted_mean(controls, shares, sequence)
        self._limit(self._sequences)
        return True

    def _limit(self, sequences: Float32Array) -> None:
        params = self._params
        dt = self._params.model_dt
        share = self._share
        for sequence, axis in zip(sequences, self._axes, strict=True):
            least = _FLOAT(axis.least * share)
            most = _FLOAT(axis.most * share)
            control_sequence.limit(
                sequence, least, most, _FLOAT(axis.fall * dt), _FLOAT(axis.rise * dt)
            )
        if params.motion_model == "Ackermann" and params.AckermannConstraints.min_turning_r > 0.0:
            v, w = sequences
            control_sequence.limit_curvature(
                v, w, _FLOAT(params.AckermannConstraints.min_turning_r)
            )

    def _conclude(self, colliding: dict[str, int]) -> Solution:
        """Smooth the sequences, take the command from them and prepare for the next cycle."""
        for sequence, history in zip(self._sequences, self._history, strict=True):
            control_sequence.smooth(sequence, history)
        at = int(self._shifts)
        self._history[:, :-1] = self._history[:, 1:]
        self._history[:, -1] = self._sequences[:, at]
        command = self._sequences[:, at : at + 1].copy()
        self._limit(command)  # smoothing may overshoot
        v, w, vy = (*command[:, 0].tolist(), 0.0)[:3]
        solution = Solution(self._sequences.copy(), Twist2D(v, vy, w), colliding)
        if self._shifts:
            self._sequences[:, :-1] = self._sequences[:, 1:]  # the last value is repeated
        return solution
