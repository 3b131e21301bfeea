"""Pixel formats, read back by independent libraries."""

import io

import numpy as np
import pytest
from PIL import Image

from naoserver.serving.camera import PIXEL_FORMATS, STREAMED_FORMAT

WIDTH, HEIGHT = 64, 48


@pytest.fixture(scope="module")
def picture():
    """A smooth picture with every hue."""
    x, y = np.meshgrid(np.linspace(0.0, 6.28, WIDTH), np.linspace(0.0, 1.0, HEIGHT))
    channels = [255 * y * (0.5 + 0.5 * np.sin(x + turn)) for turn in (0.0, 2.09, 4.19)]
    return np.stack(channels, axis=2).astype(np.uint8)


def difference(one, other):
    return np.abs(one.astype(float) - other.astype(float)).mean()


def test_the_format_of_the_stream_is_the_first():
    assert next(iter(PIXEL_FORMATS)) == STREAMED_FORMAT


def test_jpeg_is_the_same_picture_in_fewer_bytes(picture):
    data = PIXEL_FORMATS["JPEG"](picture)
    with Image.open(io.BytesIO(data)) as image:
        assert (image.format, image.size, image.mode) == ("JPEG", (WIDTH, HEIGHT), "RGB")
        assert difference(np.asarray(image), picture) < 3.0
    assert len(data) < picture.size / 4


def test_yuv422_is_the_same_picture_in_two_bytes_a_pixel(picture):
    cv2 = pytest.importorskip("cv2", reason="OpenCV is what reads it: pip install 'visualhfsm[vision]'")
    data = PIXEL_FORMATS["YUV422"](picture)
    assert len(data) == 2 * WIDTH * HEIGHT
    packed = np.frombuffer(data, np.uint8).reshape(HEIGHT, WIDTH, 2)
    assert difference(cv2.cvtColor(packed, cv2.COLOR_YUV2RGB_YUYV), picture) < 3.0


@pytest.mark.parametrize("value", [0, 255])
def test_black_and_white_do_not_run_over(value):
    even = np.full((2, 4, 3), value, np.uint8)
    luma, chroma = (16, 128) if value == 0 else (235, 128)
    assert PIXEL_FORMATS["YUV422"](even) == bytes([luma, chroma] * 8)
    assert PIXEL_FORMATS["GRAY8"](even) == bytes([value] * 8)
