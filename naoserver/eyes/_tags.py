"""ArUco's tags in a picture."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Any, Final

import cv2
import numpy as np

from naoserver.bodies.sight import Thing
from naoserver.eyes._shot import Found, Shot
from naoserver.eyes.looks import Looks

_ERROR: Final = 0.03
"""Error of a distance by the size, as a share of it."""


@cache
def _detector() -> Any:  # noqa: ANN401 - of OpenCV
    given = cv2.aruco.DetectorParameters()
    given.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    return cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_250), given)


def find_tags(shot: Shot, looks: Looks) -> Iterator[Found]:
    """Yield the tags; the longest of its sides, which are seen obliquely, says how far one is."""
    corners, numbers, _ = _detector().detectMarkers(cv2.cvtColor(shot.pixels, cv2.COLOR_RGB2GRAY))
    found = [] if numbers is None else np.ravel(numbers).tolist()  # in a column, or a row since OpenCV 5
    for square, number in zip(np.reshape(corners, (-1, 4, 2)), found, strict=True):
        side = float(np.hypot(*(square - np.roll(square, 1, axis=0)).T).max())
        away = looks.tags.size * shot.focal / side
        u, v = square.mean(axis=0).tolist()
        middle = shot.at_distance(u, v, away)
        yield Found(Thing("tag", str(number), 1.0, error=_ERROR * away), middle, middle * (1.0, 1.0, 0.0))
