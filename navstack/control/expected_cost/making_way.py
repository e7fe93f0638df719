"""Who makes way for the robot, inferred from how people move when it is near.

A robot that expects nobody to make way freezes among people who do (Trautman & Krause 2010, IROS).
Here two models of a person compete: one goes on as if there were no robot, the other feels its
social force. How likely each is follows from what was seen, by Bayes' rule (as in Fisac et al.
2018, RSS, arXiv 1806.00109). The prior comes from the others: places are of two kinds, and those
who were met tell which one this is.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from navstack.control.contact_risk import RobotBox
from navstack.types import FloatArray, Pose2D, Track

# of the social force of a robot, fitted to people (Agrawal et al. 2024, arXiv 2409.14844):
# acceleration [m/s2] at a touch, the distance [m] over which it falls to 1/e, and the time [s] over
# which people come back to their own velocity
_STRENGTH = 7.93
_RANGE = 0.99
_RELAXATION = 0.6
# [-] share of people who make way where hardly anybody does, and where most do: there 7.3 % look at
# a telephone (Thompson et al. 2013, doi 10.1136/injuryprev-2012-040601)
_FEW, _MOST = 0.02, 0.9
_LOOK = 0.4  # [s] over which a change of somebody's velocity is measured
_LEAST = 0.1  # [m/s] of change by the robot below which a look says nothing
_ALONE = 1.5  # [m] to the nearest other person; below it a look says nothing about the robot
# Fitted to tracked people who notice the robot, and who do not:
_SHARE = 0.4  # of the change that the force makes
_SHARE_STD = 0.25  # of that change, by which people differ
_STD = 0.1  # [m/s] along x and y, beside that change
_OTHERWISE = 0.3  # [-] of looks at which somebody turns or slows for another reason
_OTHERWISE_STD = 0.3  # [m/s] then
_BOUND = 3.0  # of the log-odds seen of one person
_SURE = 20.0  # of the log-odds of the place
_ANYTHING = 1e-300  # of the density of any change of velocity, so that none is impossible
_PAUSE = 0.5  # [s] between two cycles from which on looks begin anew


@dataclass(slots=True)
class _Look:
    """A look at somebody that began at ``stamp``."""

    stamp: float  # [s]
    velocity: tuple[float, float]  # [m/s] then
    felt: tuple[float, float]  # [m/s] what the force had changed then
    change: tuple[float, float]  # [m/s] what it has changed by now
    is_alone: bool  # whether nobody else was near


class MakingWay:
    """How likely each tracked person makes way."""

    def __init__(self, body: RobotBox, prior: float) -> None:
        """Know nobody.

        Args:
            body: the robot, base frame.
            prior: [-] how likely the place is one where most people make way.
        """
        self._centre = body.centre
        self._radius = math.hypot(body.half_length, body.half_width)
        self._prior = prior
        self.reset()

    def reset(self) -> None:
        """Forget everybody, for a new delivery."""
        self._odds: dict[int, float] = {}  # log-odds seen of each track
        self._looks: dict[int, _Look] = {}
        self._stamp = -math.inf  # [s] of the last cycle

    def observe(self, tracks: Sequence[Track], pose: Pose2D, stamp: float) -> None:
        """Look at everybody, with the robot at ``pose``, both in the map frame at ``stamp`` [s]."""
        elapsed = stamp - self._stamp
        self._stamp = stamp
        before = self._looks
        if not elapsed < _PAUSE:
            before = {}
        self._looks = {}
        x = pose.x + self._centre * math.cos(pose.yaw)
        y = pose.y + self._centre * math.sin(pose.yaw)
        for track, apart in zip(tracks, distances_apart(tracks), strict=True):
            is_alone = bool(apart > _ALONE)
            look = before.get(track.id)
            velocity = (track.vx, track.vy)
            ax, ay = force_on(track.x - x, track.y - y, self._radius + track.radius)
            if look is None:
                felt = (_RELAXATION * ax, _RELAXATION * ay)  # as if nothing had changed for long
                self._looks[track.id] = _Look(stamp, velocity, felt, felt, is_alone)
                continue
            look.is_alone = look.is_alone and is_alone
            look.change = (
                look.change[0] + elapsed * (ax - look.change[0] / _RELAXATION),
                look.change[1] + elapsed * (ay - look.change[1] / _RELAXATION),
            )
            if stamp - look.stamp >= _LOOK:
                self._judge(track, look)
                look = _Look(stamp, velocity, look.change, look.change, is_alone)
            self._looks[track.id] = look

    def chances(self, tracks: Sequence[Track]) -> FloatArray:
        """How likely each of the tracks (n,) makes way."""
        place = math.log(self._prior / (1.0 - self._prior))
        for odds in self._odds.values():
            place += of_the_place(odds)
        found = np.empty(len(tracks))
        for i, track in enumerate(tracks):
            odds = self._odds.get(track.id, 0.0)
            # by the others alone, or a person's movement would count twice
            others = min(max(place - of_the_place(odds), -_SURE), _SURE)
            most = 1.0 / (1.0 + math.exp(-others))
            share = _FEW + most * (_MOST - _FEW)
            found[i] = 1.0 / (1.0 + (1.0 - share) / share * math.exp(-odds))
        return found

    def _judge(self, track: Track, look: _Look) -> None:
        """Add to somebody's odds what a finished look says."""
        expected = (
            _SHARE * (look.change[0] - look.felt[0]),
            _SHARE * (look.change[1] - look.felt[1]),
        )
        if not look.is_alone or math.hypot(*expected) < _SHARE * _LEAST:
            return
        change = (track.vx - look.velocity[0], track.vy - look.velocity[1])
        odds = self._odds.get(track.id, 0.0) + log_likelihood_ratio(change, expected)
        self._odds[track.id] = min(max(odds, -_BOUND), _BOUND)


def force_on(dx: float, dy: float, radii: float) -> tuple[float, float]:
    """Acceleration [m/s2] of who is at (dx, dy) [m] from the robot, by its social force.

    ``radii`` [m] are those of both together.
    """
    distance = max(math.hypot(dx, dy), 1e-6)
    strength = _STRENGTH * math.exp(-max(distance - radii, 0.0) / _RANGE) / distance
    return strength * dx, strength * dy


def log_likelihood_ratio(change: tuple[float, float], expected: tuple[float, float]) -> float:
    """Log-odds, by a change of velocity [m/s], that somebody changes it as ``expected`` [m/s]."""
    off = math.hypot(change[0] - expected[0], change[1] - expected[1])
    std = math.hypot(_STD, _SHARE_STD / _SHARE * math.hypot(*expected))
    return math.log(_density(off, std) / _density(math.hypot(*change), _STD))


def of_the_place(odds: float) -> float:
    """Log-odds that most people make way, by the log-odds of one who was met."""
    ratio = math.exp(odds)
    return math.log((_MOST * ratio + 1.0 - _MOST) / (_FEW * ratio + 1.0 - _FEW))


def distances_apart(tracks: Sequence[Track]) -> FloatArray:
    """Distance (n,) [m] from each of the tracks to the nearest other one; infinite: none."""
    places = np.array([(track.x, track.y) for track in tracks]).reshape(-1, 2)
    apart = np.hypot(*(places[:, None] - places).transpose(2, 0, 1))
    np.fill_diagonal(apart, math.inf)
    nearest: FloatArray = apart.min(axis=1, initial=math.inf)
    return nearest


def _density(off: float, std: float) -> float:
    """How dense changes of velocity are ``off`` [m/s] from the expected one, times 2 pi."""
    usual = (1.0 - _OTHERWISE) * math.exp(-0.5 * (off / std) ** 2) / std**2
    otherwise = _OTHERWISE * math.exp(-0.5 * (off / _OTHERWISE_STD) ** 2) / _OTHERWISE_STD**2
    return usual + otherwise + _ANYTHING
