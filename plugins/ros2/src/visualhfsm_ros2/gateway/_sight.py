"""What the cameras show as messages of vision_msgs, in the frames and with the stamps of their pictures."""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from interfaces import nao
from visualhfsm_ros2.gateway._messages import Fields, Stamps

_ANY: Final = math.pi**2
"""Variance of an angle that is not known, in rad2."""


def detections(camera: str, stamps: Stamps, header: Fields, reading: nao.SightReading) -> Fields:
    """Return a vision_msgs/msg/Detection3DArray of what a camera shows at a known distance.

    The header has the camera's optical frame, and the stamp of the newest picture of any camera: that of this
    one takes its place where it shows something.
    """
    seen = [thing for thing in reading.things if thing.camera == camera]
    if seen:
        header = {**header, "stamp": stamps.stamp(seen[0].time)}
    near = [thing for thing in seen if math.isfinite(thing.distance)]
    return {"header": header, "detections": [_detection(header, thing) for thing in near]}


def _detection(header: Fields, thing: nao.SeenThing) -> Fields:
    """Return a vision_msgs/msg/Detection3D: `Sight` knows neither how large nor how turned a thing is."""
    way = np.array((-math.tan(thing.left), math.tan(thing.down), 1.0))  # to the right, down and ahead
    way /= np.linalg.norm(way)
    pose = {"position": dict(zip("xyz", (thing.distance * way).tolist(), strict=True))}
    covariance = np.diag((0.0, 0.0, 0.0, _ANY, _ANY, _ANY))
    covariance[:3, :3] = thing.distanceError**2 * np.outer(way, way)
    name = f"{thing.kind}:{thing.name}" if thing.name else thing.kind
    found = {
        "hypothesis": {"class_id": name, "score": thing.certainty},
        "pose": {"pose": pose, "covariance": covariance.reshape(-1)},
    }
    return {"header": header, "results": [found], "bbox": {"center": pose}}
