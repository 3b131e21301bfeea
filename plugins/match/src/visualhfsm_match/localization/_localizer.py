"""Localization of a robot on a soccer field, from odometry and what `Sight` shows of lines and goals.

A look gives places on white lines, crossings of lines, and directions to goal posts. An iterative fit finds
the pose that explains them best, given the odometry; that is the new estimate, with its covariance. Such
fits are due to Lauer, Lange and Riedmiller ("Calculating the perfect match", RoboCup 2005). The fit also
learns the lean of the camera, which the robot's senses measure only to about a degree: 15 cm on the floor
2 m away.

Unlike a particle filter, it needs no random numbers, so that recorded runs replay identically, and less than
a millisecond a look. But it follows a single hypothesis, so it needs the robot's start, or looks to all
sides, in which `panorama` finds it. Only the start resolves which half is which, because a field looks the
same after half a turn.

Poses are x and y in m and the heading in rad, in the frame of `naoserver.soccer_field`.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable
from typing import Final

import numpy as np

from naoserver.soccer_field import Array, Field, FieldLines
from visualhfsm_match.localization._panorama import Found, Mask, Panorama
from visualhfsm_match.localization._view import Crossings, Pose, Seen, View, leans, turn, views_of, wrapped

_FARTHEST_POINT: Final = 4.0
"""Distance in m up to which places on lines and crossings are used."""
_BEHIND: Final = 0.15
"""Distance in m behind a goal line, up to as much beside the goal, from which what is white is its net."""

# -- errors: standard deviations
_LEAN: Final = 0.02
"""Lasting error in rad of the camera's pitch and roll."""
_SWAY: Final = 0.001
"""Change in rad of the lasting error from one picture to the next."""
_TILT: Final = 0.01
"""Error in rad of pitch, roll and yaw in a single picture, shared by all its points: the robot may walk."""
_RAY: Final = 0.003
"""Error in rad of the direction to a point, in addition."""
_POINT: Final = 0.02
"""Additional error in m of a point of a line."""
_BEARING: Final = 0.02
"""Error in rad of the direction to a post."""
_APART: Final = 0.35
"""Largest angle in rad between a post that is seen and the one that it may be."""
_CROSSING: Final = 0.8
"""Largest distance in m between a crossing that is seen and the one that it may be."""
_INDEPENDENT: Final = 15.0
"""Maximum weight of one picture, in points: they share the same tilt."""
_SLIP: Final = 0.1, 0.1, 0.05
"""Errors of the odometry: m in a m, rad in a rad, rad in a m."""
_TURNS: Final = 1.0, 0.0, 0.0, 0.0, 0.0, 1.0
"""By how much a post's bearing falls with the heading, both leans, and a picture's pitch, roll and yaw."""
_GATE: Final = 3.0
"""Standard deviations beyond which an observation is attributed to another object."""
_LEAP: Final = 26.0
"""Most squares of standard deviations by which a picture may move the estimate: more is no chance."""
_ROUNDS: Final = 8
_REMEMBERED: Final = 20
"""Readings of the odometry among which that of a look is searched."""

# -- confidence
_AGREES: Final = 2.0
"""Standard deviations up to which a point is explained by a line."""
_ENOUGH: Final = 12
"""Minimum number of points or places in a picture for it to count."""
_CHANCE: Final = 0.5
"""Share of the points that lie near some line wherever the robot is taken to be."""
_NEWEST: Final = 0.2
"""Share of the newest picture in the confidence."""
_CERTAIN: Final = 0.8
"""Confidence from which the estimate is kept as a guess, for when the robot is lost."""
_FOUND: Final = 0.6
"""Minimum share of the lines that must agree with a pose that is found without a guess."""
_AS_GOOD: Final = 0.08
"""Difference in that share up to which a pose nearer to the estimate is preferred."""
_FIX: Final = 0.08, 0.08, 0.05
"""Errors of such a pose: m, m, rad."""
_CARRIED: Final = 0.4, 2.1
"""Spread of where and how a lost robot stands: m, of a Cauchy distribution, as it may be far away; rad."""
_VAGUE: Final = 0.3
"""Standard deviation in m of a place that halves the confidence."""


class Localizer:
    """Estimate the pose of a robot on a field.

    For each look, call `move` with the odometry, then `see` with what `Sight` shows. Not thread-safe.
    """

    def __init__(
        self,
        field: Field,
        start: tuple[float, float, float],
        error: tuple[float, float, float] = (0.1, 0.1, 0.1),
    ) -> None:
        """Begin at `start`, the pose at the origin of the odometry, with standard deviations `error`."""
        self._lines = FieldLines(field)
        self._mouth = field.length / 2 + _BEHIND, field.goal_width / 2 + _BEHIND
        self._posts = np.array(field.posts)
        self._odometry = Pose(0.0, 0.0, 0.0)
        self._way: Final[deque[tuple[float, Pose]]] = deque(maxlen=_REMEMBERED)
        # x, y and heading, then the lean of the camera in excess of the measured one: back, and to the left.
        self._x: Array = np.array((*start, 0.0, 0.0), np.float64)
        self._covariance: Array = np.diag(np.square((*error, _LEAN, _LEAN)))
        self._known: Array = self._x[:3].copy()  # by the odometry alone since the estimate was certain
        self._agreement = 1.0
        self._crossings = Crossings(field)
        self._panorama = Panorama(field, self._lines, self._crossings)
        self._looks_around = False

    @property
    def pose(self) -> Pose:
        """The estimate."""
        return Pose(float(self._x[0]), float(self._x[1]), wrapped(float(self._x[2])))

    @property
    def covariance(self) -> Array:
        """The covariance of x and y in m and heading in rad, given that the estimate is near the truth."""
        return self._covariance[:3, :3].copy()

    @property
    def confidence(self) -> float:
        """Confidence in the estimate, from 0 to 1: below one half, the robot is lost.

        It is the share of what recent looks show of lines and crossings that agrees with the estimate, beyond
        what would by chance; it is lower when the place is known only to some decimeters.
        """
        variance = float(self._covariance[0, 0] + self._covariance[1, 1])
        return self._agreement / (1.0 + variance / _VAGUE**2)

    def move(self, x: float, y: float, heading: float, time: float = 0.0) -> None:
        """Follow the odometry: the robot's pose in the frame of its start, in m and rad, at a time in s."""
        before, self._odometry = self._odometry, Pose(x, y, heading)
        self._way.append((time, self._odometry))
        there = turn(-before.heading) @ (x - before.x, y - before.y)
        way, turned = float(np.hypot(*there)), wrapped(heading - before.heading)
        step = turn(float(self._x[2])) @ there
        self._x[:3] += (*step, turned)
        self._known += (*(turn(float(self._known[2])) @ there), turned)
        jacobian = np.eye(5)
        jacobian[:2, 2] = -step[1], step[0]
        sliding, turning, bending = _SLIP
        slip = (sliding * way, sliding * way, math.hypot(turning * turned, bending * way), 0.0, 0.0)
        self._covariance = jacobian @ self._covariance @ jacobian.T + np.diag(np.square(slip))

    def see(self, things: Iterable[Seen], age: float = 0.0) -> None:
        """Correct the estimate by the things of one look of all cameras; other kinds may be among them.

        `age` is how old the look was when the newest odometry was read, in s: the robot may have turned
        since. A look that shows neither lines nor posts changes nothing.
        """
        then = self._odometry_before(age)
        for view in views_of(things, self._odometry, then, _FARTHEST_POINT):
            if self._looks_around:
                self._panorama.views.append(view)
            explained = self._fit(view)
            if len(explained) >= _ENOUGH:
                beyond_chance = max(0.0, (float(explained.mean()) - _CHANCE) / (1.0 - _CHANCE))
                self._agreement += _NEWEST * (beyond_chance - self._agreement)
        if self.confidence > _CERTAIN:
            self._known = self._x[:3].copy()

    def look_around(self) -> None:
        """Begin to collect what pictures show, for `find`: the robot is lost, and looks to all sides."""
        self._panorama.views.clear()
        self._looks_around = True

    def find(self) -> bool:
        """Move the estimate to the pose that explains the pictures since `look_around`, if one does.

        It needs no guess. But of poses that explain them equally well, such as the two that differ by half a
        turn of the field, it takes the one nearest to where the odometry leads from the last certain one.
        Returns whether one was found.
        """
        self._looks_around = False
        found = self._panorama.poses(self._odometry)
        if not found or found[0].share < _FOUND:
            return False
        near = min((each for each in found if each.share > found[0].share - _AS_GOOD), key=self._surprise)
        self._x[:] = *near.pose, 0.0, 0.0
        self._covariance = np.diag(np.square((*_FIX, _LEAN, _LEAN)))
        self._agreement = near.share
        self._known = self._x[:3].copy()
        return True

    def change_halves(self) -> None:
        """Turn the estimate half round the center of the field: something else shows which half is which."""
        x, y, heading = self.pose
        self._x[:3] = -x, -y, heading + math.pi
        mirror = np.diag((-1.0, -1.0, 1.0, 1.0, 1.0))
        self._covariance = mirror @ self._covariance @ mirror
        self._known = self._x[:3].copy()

    def _odometry_before(self, age: float) -> Pose:
        """Return the odometry of some seconds before the newest, as far as it is known."""
        if not self._way:
            return self._odometry
        times = [time for time, _ in self._way]
        x, y, heading = (
            float(np.interp(times[-1] - age, times, [pose[axis] for _, pose in self._way]))
            for axis in range(3)
        )
        return Pose(x, y, heading)

    def _surprise(self, found: Found) -> float:
        """Return how unlikely a pose is, given the last certain one and the odometry since then."""
        x, y, heading = found.pose
        way, angle = _CARRIED
        off = math.hypot(x - self._known[0], y - self._known[1]) / way
        turned = wrapped(heading - float(self._known[2])) / angle
        return math.log1p(off**2) + turned**2

    def _fit(self, view: View) -> Mask:
        """Move the estimate to the pose that explains most; return which points it explains."""
        points = view.points[~self._in_net(view.points)]
        corners, goals = self._crossings.near(view, self._x[:3], _CROSSING)
        posts = self._known_posts(view.posts)
        count = len(points)
        points = np.concatenate((points, corners, corners))
        ahead = np.repeat(((1.0, 0.0), (0.0, 1.0)), len(corners), axis=0)
        before = np.zeros((8, 8))  # of the estimate, and of pitch, roll and yaw in this look
        before[:5, :5] = self._covariance + np.diag((0.0, 0.0, 0.0, _SWAY**2, _SWAY**2))
        before[5:, 5:] = _TILT**2 * np.eye(3)
        x = np.concatenate((self._x, np.zeros(3)))
        prior, mean = np.linalg.inv(before), x.copy()
        squares = np.sum(np.square(points), axis=1)
        leaning = leans(points)
        for _ in range(_ROUNDS):
            rotation = turn(float(x[2] + x[7]))
            there = (points + leaning @ (x[3:5] + x[5:7])) @ rotation.T
            off, normal = self._offsets(there + x[:2], count, goals, ahead)
            turning = normal[:, 1] * there[:, 0] - normal[:, 0] * there[:, 1]
            bent = np.einsum("ni,ij,njk->nk", normal, rotation, leaning)
            jacobian = np.column_stack((normal, turning, bent, bent, turning))
            shift = np.sum(np.square(bent), axis=1) + squares  # in m/rad, of a look that is tilted
            variance = _POINT**2 + _RAY**2 * shift
            weight = _weights(off, variance, jacobian, before)
            weight *= min(1.0, _INDEPENDENT / max(1, int(np.count_nonzero(weight))))

            to_post = posts[:, 1:] - x[:2]
            square: Array = np.sum(np.square(to_post), axis=1)
            bearing = np.arctan2(to_post[:, 1], to_post[:, 0]) - x[2] - x[7]
            post_off = np.remainder(posts[:, 0] - bearing + math.pi, math.tau) - math.pi
            zero = np.zeros(len(posts))
            columns = (-to_post[:, 1] / square, to_post[:, 0] / square, *[zero + turns for turns in _TURNS])
            post_jacobian, post_variance = np.column_stack(columns), zero + _BEARING**2
            post_weight = _weights(post_off, post_variance, post_jacobian, before)

            weights = np.concatenate((weight / variance, post_weight / post_variance))
            jacobian = np.vstack((jacobian, post_jacobian))
            weighted = jacobian.T * weights
            information = prior + weighted @ jacobian
            misfit = prior @ (x - mean) + weighted @ np.concatenate((off, post_off))
            step = np.linalg.solve(information, misfit)
            x -= step
            if np.abs(step).max() < 1e-4:
                break
        if (x - mean) @ prior @ (x - mean) < _LEAP:
            self._x, self._covariance = x[:5], np.linalg.inv(information)[:5, :5]
        else:
            x = mean
        there = (points + leaning @ x[3:5]) @ turn(float(x[2])).T  # as if this look were not tilted
        off, _ = self._offsets(there + x[:2], count, goals, ahead)
        explained = np.abs(off) < _AGREES * np.sqrt(_POINT**2 + _TILT**2 * shift)
        # A crossing that is none of the field is not explained either.
        strange = np.zeros(len(view.crossings) - len(corners), bool)
        return np.concatenate((explained, strange))

    def _offsets(self, there: Array, count: int, goals: Array, ahead: Array) -> tuple[Array, Array]:
        """Return how far points are off in m, and unit vectors along that.

        The first `count` are off the nearest line, the others off their crossings along an axis.
        """
        off, normal = self._lines.offsets(there[:count])
        aside = np.sum((there[count:] - np.concatenate((goals, goals))) * ahead, axis=1)
        return np.concatenate((off, aside)), np.concatenate((normal, ahead))

    def _known_posts(self, seen: Array) -> Array:
        """Return the bearing of each post that is seen, and x and y of the one that it may be."""
        bearings = np.arctan2(*(self._posts - self._x[:2]).T[::-1]) - self._x[2]
        found = []
        for x, y in seen.tolist():
            bearing = math.atan2(y, x)
            off = np.abs(np.remainder(bearings - bearing + math.pi, math.tau) - math.pi)
            far = np.hypot(*(self._posts - self._x[:2]).T)
            off = np.where(np.abs(far - math.hypot(x, y)) < max(1.0, 0.3 * far.min()), off, math.inf)
            nearest = int(off.argmin())
            if off[nearest] < _APART:
                found.append((bearing, *self._posts[nearest]))
        return np.array(found, np.float64).reshape(-1, 3)

    def _in_net(self, points: Array) -> Mask:
        """Return which points, in the robot's frame, are seen behind a goal line, between the posts."""
        there = np.abs(points @ turn(float(self._x[2])).T + self._x[:2])
        behind, beside = self._mouth
        return np.asarray((there[:, 0] > behind) & (there[:, 1] < beside))


def _weights(off: Array, variance: Array, jacobian: Array, covariance: Array) -> Array:
    """Return Tukey's weights, from 0 to 1, of residuals, given their variance and the estimate's."""
    spread = variance + np.sum(jacobian @ covariance * jacobian, axis=1)
    return np.asarray(np.square(np.clip(1.0 - np.square(off) / (_GATE**2 * spread), 0.0, 1.0)))
