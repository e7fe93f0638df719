"""Sample control sequences around the last one, score them, and take their mean by merit (``optimizer.cpp``)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from navstack.control.mppi import control_sequence
from navstack.control.mppi.critic import Critic
from navstack.control.mppi.rollouts import Rollouts, add_noise, limit_changes, roll_out
from navstack.control.mppi.scene import Scene
from navstack.errors import NoLegalVelocity, ParameterError
from navstack.params.mppi import MppiParams
from navstack.types import Float32Array, Twist2D

_SAME_PERIOD = 1e-6  # [s] by which model_dt and control period may differ where they are meant to be equal
_FLOAT = np.float32


@dataclass(frozen=True, slots=True, eq=False)
class Solution:
    """What came out of a cycle."""

    sequence_v: Float32Array  # (T,) [m/s] chosen; the command is one of its first two values
    sequence_w: Float32Array  # (T,) [rad/s]
    command: Twist2D
    colliding: dict[str, int]  # trajectories of the last update, by the critics that found them in collision


class Noise(NamedTuple):
    """What is added to the sequence."""

    v: Float32Array  # (T, B) [m/s]
    w: Float32Array  # (T, B) [rad/s]
    largest_w: float  # [rad/s] absolute


class Optimizer:
    """Model predictive path integral control: Williams et al., IEEE T-RO 34 (2018), as Nav2 has it."""

    def __init__(self, params: MppiParams, critics: Sequence[Critic], period: float) -> None:
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
                f"MPPI: model_dt {params.model_dt:g} s is shorter than a control period ({period:g} s); make it as long"
            )
        self._params, self._critics = params, critics
        self._shifts = abs(params.model_dt - period) < _SAME_PERIOD  # one value of the sequence is used per cycle
        self._rollouts = Rollouts.empty(params.time_steps, params.batch_size)
        self._single = Rollouts.empty(params.time_steps, 1)
        silence = np.zeros((params.time_steps, 1), dtype=_FLOAT)
        self._no_noise = Noise(silence, silence, 0.0)
        self._rng: np.random.Generator | None = None
        self._share = 1.0  # of the largest velocities that a speed limit leaves
        self.reset()

    def seed(self, rng: np.random.Generator) -> None:
        """Draw all noise from ``rng`` from now on."""
        self._rng = rng

    def reset(self) -> None:
        """Forget the sequence and the noise."""
        steps = self._params.time_steps
        self._v, self._w = np.zeros(steps, dtype=_FLOAT), np.zeros(steps, dtype=_FLOAT)
        self._history = np.zeros((2, control_sequence.HISTORY), dtype=_FLOAT)  # commands of late, v and w
        self._noise: Noise | None = None

    def limit_speed(self, limit: float, is_percentage: bool) -> None:
        """Lower the largest velocities, the yaw rate too, to ``limit`` [m/s] or [%]; 0 lifts the limit."""
        share = limit / 100.0 if is_percentage else limit / self._params.vx_max
        self._share = min(share, 1.0) if limit != 0.0 else 1.0

    def solve(self, scene: Scene) -> Solution:
        """The command of this cycle.

        Raises:
            NoLegalVelocity: all trajectories collide, in every attempt, or state or costs are no finite numbers.
        """
        for _ in range(self._params.retry_attempt_limit + 1):
            colliding = self._optimize(scene)
            if self._params.batch_size not in colliding.values():
                return self._conclude(colliding)
            self.reset()
        raise NoLegalVelocity(colliding)

    def score_alone(self, solution: Solution, scene: Scene) -> list[tuple[Critic, float | None, float | None]]:
        """Raw and weighted score of the chosen sequence per critic; None: the critic did not count."""
        rollouts = self._roll_out(self._single, solution.sequence_v, solution.sequence_w, self._no_noise, scene)
        told: list[tuple[Critic, float | None, float | None]] = []
        for critic in self._critics:
            scores = critic.score(rollouts, scene)
            if scores is None:
                told.append((critic, None, None))
            else:
                told.append((critic, float(scores.raw[0]), float(critic.weighted(scores.raw)[0])))
        return told

    def _optimize(self, scene: Scene) -> dict[str, int]:
        """Update the sequence; the answer counts the trajectories in collision by critic.

        Costs add up over the updates of a cycle, and a critic in whose eyes all collide is the last to be asked.
        """
        params = self._params
        costs = np.zeros(params.batch_size, dtype=_FLOAT)
        for _ in range(params.iteration_count):
            colliding: dict[str, int] = {}
            rollouts = self._roll_out(self._rollouts, self._v, self._w, self._next_noise(), scene)
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
            assert self._rng is not None, "an MPPI controller is given its generator before its first cycle"
            shape = (params.time_steps, params.batch_size)
            noise_v = self._rng.standard_normal(shape, dtype=_FLOAT) * _FLOAT(params.vx_std)
            noise_w = self._rng.standard_normal(shape, dtype=_FLOAT) * _FLOAT(params.wz_std)
            self._noise = Noise(noise_v, noise_w, float(np.abs(noise_w).max()))
        return self._noise

    def _roll_out(self, into: Rollouts, v: Float32Array, w: Float32Array, noise: Noise, scene: Scene) -> Rollouts:
        """Drive noisy sequences from the measured velocity."""
        params, dt = self._params, self._params.model_dt
        add_noise(v, noise.v, into.v)
        add_noise(w, noise.w, into.w)
        fall, rise = -abs(params.ax_min) * dt, params.ax_max * dt
        limit_changes(into.v, _FLOAT(scene.velocity.linear_x), _FLOAT(rise), _FLOAT(fall))
        change = params.az_max * dt
        limit_changes(into.w, _FLOAT(scene.velocity.angular_z), _FLOAT(change), _FLOAT(-change))
        largest = max(abs(scene.velocity.angular_z), float(np.abs(w).max()) + noise.largest_w)
        roll_out(
            *(into.v, into.w, _FLOAT(scene.yaw), _FLOAT(dt), _FLOAT(largest * dt)),
            *(into.x, into.y, into.yaw, into.cosine, into.sine),
        )
        return into

    def _update(self, rollouts: Rollouts, costs: Float32Array) -> bool:
        """Make the samples' mean by merit the new sequence, within the limits; False: it cannot be told."""
        params = self._params
        control_sequence.add_control_costs(rollouts.v, self._v, _FLOAT(params.gamma / params.vx_std**2), costs)
        control_sequence.add_control_costs(rollouts.w, self._w, _FLOAT(params.gamma / params.wz_std**2), costs)
        if not np.isfinite(costs.min()):  # nan in one of them, or inf in all: limits would make full speed of that
            return False
        shares = control_sequence.softmax(costs, _FLOAT(params.temperature))
        control_sequence.weighted_mean(rollouts.v, shares, self._v)
        control_sequence.weighted_mean(rollouts.w, shares, self._w)
        self._limit(self._v, self._w)
        return True

    def _limit(self, v: Float32Array, w: Float32Array) -> None:
        params, dt, share = self._params, self._params.model_dt, self._share
        fall, rise = _FLOAT(-abs(params.ax_min) * dt), _FLOAT(params.ax_max * dt)
        control_sequence.limit(v, _FLOAT(params.vx_min * share), _FLOAT(params.vx_max * share), fall, rise)
        turn, change = _FLOAT(params.wz_max * share), _FLOAT(params.az_max * dt)
        control_sequence.limit(w, -turn, turn, -change, change)
        if params.motion_model == "Ackermann" and params.AckermannConstraints.min_turning_r > 0.0:
            control_sequence.limit_curvature(v, w, _FLOAT(params.AckermannConstraints.min_turning_r))

    def _conclude(self, colliding: dict[str, int]) -> Solution:
        """Smooth the sequence, take the command from it and prepare for the next cycle."""
        for sequence, history in zip((self._v, self._w), self._history, strict=True):
            control_sequence.smooth(sequence, history)
        at = int(self._shifts)
        self._history[:, :-1] = self._history[:, 1:]
        self._history[:, -1] = self._v[at], self._w[at]
        v, w = self._v[at : at + 1].copy(), self._w[at : at + 1].copy()
        self._limit(v, w)  # smoothing may overshoot
        solution = Solution(self._v.copy(), self._w.copy(), Twist2D(float(v[0]), 0.0, float(w[0])), colliding)
        if self._shifts:
            control_sequence.shift(self._v)
            control_sequence.shift(self._w)
        return solution
