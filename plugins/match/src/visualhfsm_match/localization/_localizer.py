"""Localization of a robot on a soccer field, from odometry and the lines and goals in its pictures.

Each picture gives points of white lines on the floor and directions to goal posts. An iterative fit finds
the pose that explains them best, given the odometry; that is the new estimate, with its covariance. Such
fits are due to Lauer, Lange and Riedmiller ("Calculating the perfect match", RoboCup 2005). The fit also
learns the lean of the camera, which the robot's senses measure only to about a degree: 15 cm on the floor
2 m away.

Unlike a particle filter, it needs no random numbers, so that recorded runs replay identically, and only a
few milliseconds per picture. But it follows a single hypothesis, so it needs the robot's start, or pictures
of all sides, in which `panorama` finds it. Only the start resolves which half is which, because a field looks
the same after half a turn.

Poses are x and y in m and the heading in rad, in the frame of `naoserver.soccer_field`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from naoserver.soccer_field import POST_RADIUS, Array, Field, FieldLines
from visualhfsm_match.localization._obstacles import find_standing
from visualhfsm_match.localization._panorama import (
    Found,
    Mask,
    Panorama,
    Pose,
    View,
    expected_lines,
    leans,
    turn,
    wrapped,
)
from visualhfsm_match.localization._picture import horizon_of, on_floor, runs_of

# -- in a picture: colors as OpenCV's HSV, hues from 0 to 180 and the rest from 0 to 255
_GREEN: Final = (35, 60, 15), (90, 255, 255)
_STEP: Final = 4
"""Pixels from one searched row or column to the next."""
_BESIDE: Final = 2
"""Pixels from the edge of a line to the place where grass is expected."""
_WIDTHS: Final = 0.4, 2.2
"""Range of a line's width across a row or column, as shares of its true width."""
_FARTHEST_POINT: Final = 4.0
"""Distance in m up to which points of lines are used."""
_BEHIND: Final = 0.15
"""Distance in m behind a goal line, up to as much beside the goal, from which what is white is its net."""
_BAND: Final = 3, 9
"""Rows above the horizon where posts are searched: nothing else on the field is as high as the camera."""
_CONTRAST: Final = 6.0
"""Minimum difference in brightness, of 255, between a post and its neighborhood."""

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

# -- confidence
_AGREES: Final = 2.0
"""Standard deviations up to which a point is explained by a line."""
_ENOUGH: Final = 12
"""Minimum number of points or places in a picture for it to count."""
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


class Image(Protocol):
    """The result of `Camera.getImageData("RGB8")`."""

    description: Any
    pixelData: bytes


class FloorPoint(Protocol):
    """The result of `Camera.getFloorPoint`."""

    x: float
    y: float
    distance: float


class Localizer:
    """Estimate the pose of a robot on a field.

    For each picture, call `move` with the odometry, then `see` with the picture. Not thread-safe.
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
        # x, y and heading, then the lean of the camera in excess of the measured one: back, and to the left.
        self._x: Array = np.array((*start, 0.0, 0.0), np.float64)
        self._covariance: Array = np.diag(np.square((*error, _LEAN, _LEAN)))
        self._known: Array = self._x[:3].copy()  # by the odometry alone since the estimate was certain
        self._agreement = 1.0
        self._panorama = Panorama(field, self._lines)
        self._looks_around = False
        self._feet: Array = np.empty((0, 2))

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

        It is the share of the observed and the expected lines in recent pictures that agrees with the
        estimate; it is lower when the place is known only to some decimeters.
        """
        variance = float(self._covariance[0, 0] + self._covariance[1, 1])
        return self._agreement / (1.0 + variance / _VAGUE**2)

    @property
    def feet(self) -> Array:
        """Where something taller than a ball stands on the field, as far as the newest picture shows.

        A row for each column of the picture that shows some of it: x and y in m in the robot's frame of then.
        """
        return self._feet.copy()

    def move(self, x: float, y: float, heading: float) -> None:
        """Follow the odometry: the robot's pose in the frame of its start, in m and rad."""
        before, self._odometry = self._odometry, Pose(x, y, heading)
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

    def see(self, image: Image, floor_point: Callable[[float, float, float], FloorPoint]) -> None:
        """Correct the estimate by a picture: `getImageData("RGB8")` and `getFloorPoint` of one camera.

        A picture that shows no floor, or neither lines nor posts, changes nothing.
        """
        width, height = image.description.width, image.description.height
        pixels = np.frombuffer(image.pixelData, np.uint8).reshape(height, width, 3)
        self._feet = np.empty((0, 2))
        to_image = _projection(width, height, floor_point)
        if to_image is None:
            return
        grass, white = _colors(pixels)
        to_floor = np.asarray(np.linalg.inv(to_image), np.float64)
        hidden, self._feet = find_standing(grass, white, to_floor)
        grass, white = grass & ~hidden, white & ~hidden
        points = _line_points(grass, white, to_floor, self._lines.width)
        view = View(self._odometry, points, white, hidden, to_image)
        if self._looks_around:
            self._panorama.views.append(view)
        explained = self._fit(points, self._find_posts(pixels, to_image, to_floor))
        shares = [
            float(share.mean())
            for share in (explained, expected_lines(self._lines, self.pose, view, self._x[3:]))
            if len(share) >= _ENOUGH
        ]
        if shares:
            self._agreement += _NEWEST * (min(shares) - self._agreement)
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

    def _surprise(self, found: Found) -> float:
        """Return how unlikely a pose is, given the last certain one and the odometry since then."""
        x, y, heading = found.pose
        way, angle = _CARRIED
        off = math.hypot(x - self._known[0], y - self._known[1]) / way
        turned = wrapped(heading - float(self._known[2])) / angle
        return math.log1p(off**2) + turned**2

    def _fit(self, points: Array, posts: Array) -> Mask:
        """Move the estimate to the pose that explains most; return which points it explains.

        Each row of `points` is a point of a line in the robot's frame, each of `posts` the bearing of a post
        and its x and y on the field.
        """
        points = points[~self._in_net(points)]
        before = np.zeros((8, 8))  # of the estimate, and of pitch, roll and yaw in this picture
        before[:5, :5] = self._covariance + np.diag((0.0, 0.0, 0.0, _SWAY**2, _SWAY**2))
        before[5:, 5:] = _TILT**2 * np.eye(3)
        x = np.concatenate((self._x, np.zeros(3)))
        prior, mean = np.linalg.inv(before), x.copy()
        squares = np.sum(np.square(points), axis=1)
        leaning = leans(points)
        for _ in range(_ROUNDS):
            rotation = turn(float(x[2] + x[7]))
            there = (points + leaning @ (x[3:5] + x[5:7])) @ rotation.T
            off, normal = self._lines.offsets(there + x[:2])
            turning = normal[:, 1] * there[:, 0] - normal[:, 0] * there[:, 1]
            bent = np.einsum("ni,ij,njk->nk", normal, rotation, leaning)
            jacobian = np.column_stack((normal, turning, bent, bent, turning))
            shift = np.sum(np.square(bent), axis=1) + squares  # in m/rad, of a picture that is tilted
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
        there = (points + leaning @ x[3:5]) @ turn(float(x[2])).T  # as if this picture were not tilted
        off, _ = self._lines.offsets(there + x[:2])
        return np.asarray(np.abs(off) < _AGREES * np.sqrt(_POINT**2 + _TILT**2 * shift))

    def _in_net(self, points: Array) -> Mask:
        """Return which points, in the robot's frame, are seen behind a goal line, between the posts."""
        there = np.abs(points @ turn(float(self._x[2])).T + self._x[:2])
        behind, beside = self._mouth
        return np.asarray((there[:, 0] > behind) & (there[:, 1] < beside))

    def _find_posts(self, pixels: NDArray[np.uint8], to_image: Array, to_floor: Array) -> Array:
        """Return the bearing in the robot's frame, and x and y, of each post seen at a plausible place."""
        height, width, _ = pixels.shape
        columns = np.arange(width)
        horizon = horizon_of(to_floor, columns)
        rows = np.rint(horizon).astype(int) - np.arange(*_BAND)[:, None]
        if rows.min() < 0 or rows.max() >= height:
            return np.empty((0, 3))
        brightness = pixels[rows, columns].mean(axis=(0, 2))
        total = np.concatenate(([0.0], np.cumsum(brightness)))
        found = []
        for post in self._posts:
            there = turn(-float(self._x[2])) @ (post - self._x[:2])
            distance = float(np.hypot(*there))
            beside = POST_RADIUS / distance * np.array((-there[1], there[0]))
            left, right = (to_image @ (*(there + side * beside), 1.0) for side in (1, -1))
            if distance < 1.0 or min(left[2], right[2]) <= 0:
                continue
            begin, wide = left[0] / left[2], right[0] / right[2] - left[0] / left[2]
            # The lateral error of the estimate, in m at the post.
            variance = np.trace(self._covariance[:2, :2])
            variance += distance**2 * (_BEARING**2 + self._covariance[2, 2])
            reach = wide * min(2.0 * math.sqrt(variance), 0.6) / (2 * POST_RADIUS)
            size = max(2, round(wide))
            first, last = max(size, int(begin - reach)), min(width - 2 * size, int(begin + reach))
            if last < first:
                continue
            at = np.arange(first, last + 1)
            before, post_like, after = (total[at + (k + 1) * size] - total[at + k * size] for k in (-1, 0, 1))
            contrast = (post_like - np.maximum(before, after)) / size
            best = int(contrast.argmax())
            if contrast[best] >= _CONTRAST:
                u = at[best] + (size - 1) / 2
                x, y, _ = to_floor @ (u, np.interp(u, columns, horizon), 1.0)
                found.append((math.atan2(y, x), *post))
        return np.array(found, np.float64).reshape(-1, 3)


def _projection(
    width: int, height: int, floor_point: Callable[[float, float, float], FloorPoint]
) -> Array | None:
    """Return the matrix from x, y, 1 on the floor to pixels; None if a picture shows too little floor.

    The third number of the product is positive for points in front of the camera.
    """
    corners = [(u, height - 1.0) for u in (0.0, width - 1.0)]
    below = [floor_point(u, v, 0.0) for u, v in corners]
    for high in (0.0, height / 3, 2 * height / 3):
        above = [floor_point(u, high, 0.0) for u, _ in corners]
        if all(point.distance < _FARTHEST_POINT for point in above + below):
            floor = np.array([(point.x, point.y) for point in below + above], np.float32)
            pixels = np.array([*corners, *((u, high) for u, _ in corners)], np.float32)
            matrix = np.asarray(cv2.getPerspectiveTransform(floor, pixels), np.float64)
            return np.asarray(matrix * np.sign(matrix[2] @ (*floor[0], 1.0)), np.float64)
    return None


def _colors(pixels: NDArray[np.uint8]) -> tuple[Mask, Mask]:
    """Return masks of grass, and of pixels as white as a line, whatever the exposure."""
    hsv = cv2.cvtColor(cv2.blur(pixels, (3, 3)), cv2.COLOR_RGB2HSV)
    low, high = _GREEN
    some = hsv[::_STEP, ::_STEP]
    green = some[cv2.inRange(some, low, high) > 0]
    _, saturation, value = np.median(green, axis=0) if len(green) else (0.0, 0.0, 0.0)
    grass = cv2.inRange(hsv, (low[0], 0.75 * saturation, low[2]), high)
    return grass > 0, cv2.inRange(hsv, (0, 0, 0.9 * value), (180, 0.55 * saturation, 255)) > 0


def _line_points(grass: Mask, white: Mask, to_floor: Array, width: float) -> Array:
    """Return points on the floor where a row or column of the picture crosses a line `width` m wide."""
    found = []
    for columns in (False, True):
        lawn, bright = (mask.T[::_STEP] if columns else mask[::_STEP] for mask in (grass, white))
        at, begin, end = runs_of(bright)
        after = np.minimum(end - 1 + _BESIDE, lawn.shape[1] - 1)
        crossed = lawn[at, np.maximum(begin - _BESIDE, 0)] & lawn[at, after]
        at = _STEP * at[crossed]
        first, last = begin[crossed] - 0.5, end[crossed] - 0.5
        floor = [
            on_floor(to_floor, *((at, along) if columns else (along, at)))
            for along in (first, last, (first + last) / 2)
        ]
        wide = np.hypot(*(floor[1] - floor[0]).T) / width
        near = np.hypot(*floor[2].T) < _FARTHEST_POINT
        found.append(floor[2][near & (wide > _WIDTHS[0]) & (wide < _WIDTHS[1])])
    return np.concatenate(found)


def _weights(off: Array, variance: Array, jacobian: Array, covariance: Array) -> Array:
    """Return Tukey's weights, from 0 to 1, of residuals, given their variance and the estimate's."""
    spread = variance + np.sum(jacobian @ covariance * jacobian, axis=1)
    return np.asarray(np.square(np.clip(1.0 - np.square(off) / (_GATE**2 * spread), 0.0, 1.0)))
