"""Where a camera is, by what it says of its pixels."""

import numpy as np
import pytest

from naoserver.eyes._shot import take
from naoserver.eyes.looks import read_looks
from naoserver.fake import FakeRobot
from tests.support.local_camera import local_cameras


def test_pixels_are_where_the_camera_says_they_are():
    camera = local_cameras(FakeRobot())["Camera"]
    image = camera.getImageData("RGB8")
    shot = take("Camera", image, camera.getCameraDescription(), camera.getFloorPoint, read_looks().field)
    assert shot is not None
    for u, v in ((20.0, 230.0), (200.0, 180.0)):
        there, place = camera.getFloorPoint(u, v, 0.1), shot.at_height(u, v, 0.1)
        assert place == pytest.approx((there.x, there.y, 0.1), abs=1e-6)
        assert np.linalg.norm(place - shot.eye) == pytest.approx(there.distance)
