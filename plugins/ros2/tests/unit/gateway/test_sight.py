"""What is seen as messages of vision_msgs."""

import math
from typing import Any

import numpy as np
import pytest

from interfaces.nao import SeenThing, SightReading
from visualhfsm_ros2.gateway._messages import Stamps
from visualhfsm_ros2.gateway._sight import detections
from zenoh_ros2 import Types

STAMPS = Stamps(simulated=True, frame_prefix="bob/")
DETECTIONS = "vision_msgs/msg/Detection3DArray"


def thing(**known):
    """Return a red ball 2 m ahead of the camera, 0.1 rad to the left and 0.2 rad below it, but for what is given."""
    usual: dict[str, Any] = {
        "kind": "ball", "name": "red", "certainty": 0.9, "camera": "Camera", "time": 1.5, "left": 0.1, "down": 0.2,
        "distance": 2.0, "distanceError": 0.1,
    }  # fmt: skip
    return SeenThing(**(usual | known))


def sent(*things, time=1.5):
    """Return what a subscription of the detections of `Camera` gets."""
    types, header = Types(), STAMPS.header(time, "CameraTop_optical_frame")
    fields = detections("Camera", STAMPS, header, SightReading(time=time, things=[*things]))
    return types.decode(types.encode(types.make(DETECTIONS, fields)), DETECTIONS)


def test_a_thing_is_where_its_direction_and_distance_lead_from_the_camera():
    (ball,) = sent(thing()).detections
    (result,) = ball.results
    place = result.pose.pose.position
    assert math.hypot(place.x, place.y, place.z) == pytest.approx(2.0)
    assert (math.atan2(-place.x, place.z), math.atan2(place.y, place.z)) == pytest.approx((0.1, 0.2))
    assert ball.bbox.center.position == place
    assert result.pose.pose.orientation.w == 1.0


def test_its_distance_errs_along_the_way_to_it_and_its_turn_is_unknown():
    (ball,) = sent(thing()).detections
    pose = ball.results[0].pose
    place = pose.pose.position
    way = np.array((place.x, place.y, place.z)) / 2.0
    covariance = pose.covariance.reshape(6, 6)
    assert way @ covariance[:3, :3] @ way == pytest.approx(0.1**2)
    assert np.trace(covariance[:3, :3]) == pytest.approx(0.1**2)
    assert (covariance.diagonal()[3:] > 9.0).all()
    size = ball.bbox.size
    assert (size.x, size.y, size.z) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("kind", "name", "class_id"),
    [("ball", "red", "ball:red"), ("tag", "68", "tag:68"), ("goalpost", "", "goalpost")],
)
def test_its_class_is_its_kind_and_its_name(kind, name, class_id):
    hypothesis = sent(thing(kind=kind, name=name)).detections[0].results[0].hypothesis
    assert (hypothesis.class_id, hypothesis.score) == (class_id, 0.9)


def test_things_have_the_frame_and_the_time_of_the_camera_s_own_picture():
    message = sent(thing(time=1.25), thing(camera="CameraBottom", time=1.5))
    (ball,) = message.detections
    assert ball.header == message.header
    assert (message.header.stamp.sec, message.header.stamp.nanosec) == (1, 250_000_000)
    assert message.header.frame_id == "bob/CameraTop_optical_frame"


def test_that_nothing_is_seen_is_told_and_what_is_at_no_known_distance_is_nowhere():
    nothing = sent(time=2.0)
    assert (nothing.header.stamp.sec, nothing.detections) == (2, [])
    far = thing(kind="robot", distance=math.inf, distanceError=math.inf)
    assert sent(far).detections == []
