"""Pictures in NAOqi's sizes and colour spaces."""

import math

import numpy as np
import pytest

pytest.importorskip("qi")

from naoserver.bodies.nao import H25
from naoserver.errors import InvalidCommand
from naoserver.robot import Frame
from visualhfsm_naoqi._names import IMAGE_SIZES
from visualhfsm_naoqi.programs._video import COLOR_SPACES, LAYERS, ALVideoDevice, shrunk, source_size

TOP = H25.cameras[0]
COLORS = {
    # By ITU-R BT.601, video range: Y, U, V.
    (255, 255, 255): (235, 128, 128),
    (0, 0, 0): (16, 128, 128),
    (255, 0, 0): (82, 90, 240),
    (0, 255, 0): (145, 54, 34),
    (0, 0, 255): (41, 240, 110),
}


@pytest.mark.parametrize("space", COLOR_SPACES)
def test_every_colour_space_has_its_bytes(space):
    rgb = np.zeros((4, 6, 3), np.uint8)
    assert len(COLOR_SPACES[space](rgb)) == 4 * 6 * LAYERS[space]


@pytest.mark.parametrize(("color", "expected"), COLORS.items())
def test_yuv(color, expected):
    rgb = np.full((2, 2, 3), color, np.uint8)
    assert list(COLOR_SPACES[10](rgb)[:3]) == pytest.approx(expected, abs=2)


def test_yuv_has_the_chromas_of_each_two_pixels():
    rgb = np.array([[(255, 0, 0), (255, 255, 255)]], np.uint8)
    y1, u, y2, v = COLOR_SPACES[9](rgb)
    assert COLOR_SPACES[10](rgb) == bytes((y1, u, v, y2, u, v))


def test_bgr_turns_the_bytes_round():
    rgb = np.array([[(1, 2, 3)]], np.uint8)
    assert COLOR_SPACES[11](rgb) == b"\1\2\3"
    assert COLOR_SPACES[13](rgb) == b"\3\2\1"


def test_small_pictures_come_from_the_smallest_that_is_a_multiple():
    assert source_size(TOP, IMAGE_SIZES[0]) == (320, 240)
    assert source_size(TOP, IMAGE_SIZES[2]) == (640, 480)
    assert source_size(TOP, (7, 5)) is None


def test_a_pixel_of_a_small_picture_is_the_mean_of_those_it_stands_for():
    pixels = np.zeros((4, 4, 3), np.uint8)
    pixels[:2, 2:] = [[(10, 0, 0), (30, 0, 0)], [(50, 0, 0), (70, 0, 0)]]
    small = shrunk(Frame("Camera", 0.0, 4, 4, pixels), (2, 2))
    assert small[:, :, 0].tolist() == [[0, 40], [0, 0]]


@pytest.mark.parametrize(("x", "y"), [(0.5, 0.5), (0.0, 0.0), (0.25, 0.9), (1.0, 0.3)])
def test_angles_of_a_place_are_those_of_the_camera_s_lens(rig, x, y):
    video, focal = rig.access.service(ALVideoDevice), TOP.focal_length(320)
    # To the left and downwards, as ALMotion turns the head.
    angles = [math.atan((160 - 320 * x) / focal), math.atan((240 * y - 120) / focal)]
    assert video.getAngularPositionFromImagePosition(0, [x, y]) == pytest.approx(angles)
    assert video.getImagePositionFromAngularPosition(0, angles) == pytest.approx([x, y])


def test_a_size_in_the_middle_is_the_angle_between_its_edges(rig):
    video = rig.access.service(ALVideoDevice)
    left, top = video.getAngularPositionFromImagePosition(0, [0.4, 0.2])
    size = video.getAngularSizeFromImageSize(0, [0.2, 0.6])
    assert size == pytest.approx([2 * left, -2 * top])
    assert video.getImageSizeFromAngularSize(0, size) == pytest.approx([0.2, 0.6])
    whole = [video.getHorizontalAperture(0), video.getVerticalAperture(0)]
    assert video.getAngularSizeFromImageSize(0, [1, 1]) == pytest.approx(whole)
    assert video.getImageInfoFromAngularInfo(0, [0.0, 0.0, *whole]) == pytest.approx([0.5, 0.5, 1.0, 1.0])
    info = video.getImageInfoFromAngularInfoWithResolution(0, [0.0, 0.0, *whole], 2)
    assert info == pytest.approx([320, 240, 640, 480])


@pytest.mark.parametrize(
    "arguments",
    [(2, [0.5, 0.5]), (0, [0.5]), (0, [0.5, 0.5, 0.5]), (0, 0.5), (0, [0.5, "x"]), (0, [math.nan, 0.5])],
)
def test_what_is_no_place_of_a_picture(rig, arguments):
    with pytest.raises(InvalidCommand):
        rig.access.service(ALVideoDevice).getAngularPositionFromImagePosition(*arguments)
