"""The best trajectory, without scoring all of them in full, where the ends of the trajectories tell the scores."""

from collections.abc import Mapping

import numpy as np

from navstack.control.dwb.bound_kernels import Grid
from navstack.control.dwb.choice_kernels import best_command
from navstack.control.dwb.critics.critic import Critic
from navstack.control.dwb.decision import Choice, Explanation
from navstack.control.dwb.end_score import NOTHING, OUTLINE_COST
from navstack.control.dwb.legality_kernels import count_rejections
from navstack.control.dwb.rollouts import RolloutGenerator
from navstack.control.dwb.scene import Scene
from navstack.types import FloatArray, Twist2D

_Terms = tuple[tuple[str, int, float, float], ...]  # name, kind, number and scale of each critic that counts


class EndChoice:
    """Makes the same choice as :func:`~navstack.control.dwb.decision.score_all`, many times faster."""

    def __init__(self, generator: RolloutGenerator, critics: Mapping[str, Critic]) -> None:
        self._generator = generator
        self._critics = dict(critics)
        self._set_terms(())
        self._last = 0  # index of the last choice, likely a good one again
        self._command: FloatArray = np.zeros(3)  # of the last choice: vx, vy, yaw rate

    def choose(self, scene: Scene) -> Choice | None:
        """The choice; None: it takes the scores of all trajectories to make it, or no trajectory is legal."""
        generator = self._generator
        terms = self._summarize(scene)
        if not terms or not generator.ends_suffice or scene.velocity.linear_y != 0.0:
            return None
        if terms != self._terms:
            self._set_terms(terms)
        robot, grid = _numbers_of(scene)
        index, total = best_command(
            robot,
            generator.sampler.axes,
            generator.sampler.counts,
            generator.sampler.speeds,
            generator.times,
            generator.limits,
            self._kinds,
            self._numbers,
            self._scales,
            scene.plan,
            scene.goal.x,
            scene.goal.y,
            scene.costmap.data,
            grid,
            scene.footprint,
            self._last,
            self._command,
            self._raw,
        )
        if index < 0:
            return None
        self._last = index
        return Choice(int(index), float(total), Twist2D(*self._command.tolist()))

    def explain(self, scene: Scene) -> Explanation | None:
        """What the scores of all trajectories would tell of the last choice, which was made in this ``scene``.

        None: it takes those scores to tell.
        """
        if OUTLINE_COST in self._kinds:
            return None
        generator = self._generator
        robot, grid = _numbers_of(scene)
        counts = count_rejections(
            robot,
            generator.sampler.axes,
            generator.sampler.counts,
            generator.sampler.speeds,
            generator.times,
            generator.limits,
            self._kinds,
            self._numbers,
            scene.costmap.data,
            grid,
        ).tolist()
        names, nothing = [name for name, _, _, _ in self._terms], dict.fromkeys(self._critics, 0.0)
        return Explanation(
            sum(counts),
            {name: count for name, count in zip(names, counts[:-1], strict=True) if count},
            nothing | dict(zip(names, self._raw.tolist(), strict=True)),
            nothing | dict(zip(names, (self._raw * self._scales).tolist(), strict=True)),
        )

    def _summarize(self, scene: Scene) -> _Terms | None:
        """What the critics score in this cycle; None: one of them cannot say it in short."""
        terms = []
        for name, critic in self._critics.items():
            scale = critic.scale(scene)
            if scale == 0.0:
                continue
            score = critic.end_score(scene)
            if score is None or scale < 0.0:  # what is not looked at yet must not lower a total
                return None
            if score.kind != NOTHING:
                terms.append((name, score.kind, score.number, scale))
        return tuple(terms)

    def _set_terms(self, terms: _Terms) -> None:
        self._terms = terms
        self._kinds = np.array([kind for _, kind, _, _ in terms], dtype=np.int64)
        self._numbers = np.array([number for _, _, number, _ in terms], dtype=np.float64)
        self._scales = np.array([scale for _, _, _, scale in terms], dtype=np.float32)
        self._raw: FloatArray = np.zeros(len(terms))  # scores of the last choice


def _numbers_of(scene: Scene) -> tuple[FloatArray, Grid]:
    """Pose and velocity (6,), and where the costmap lies."""
    pose, velocity, costmap = scene.pose, scene.velocity, scene.costmap
    robot = np.array(
        (pose.x, pose.y, pose.yaw, velocity.linear_x, velocity.linear_y, velocity.angular_z), dtype=np.float64
    )
    return robot, (costmap.origin_x, costmap.origin_y, costmap.resolution)
