"""Pictures of a run: few, evenly distributed, and of the stated size."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from interfaces.jderobot import ImageData, ImageDescription, Time
from visualhfsm.watch.telemetry import Album, Picture, picture_from


def fill(album: Album, seconds: float, step: float = 0.1) -> list[float]:
    for number in range(round(seconds / step)):
        if album.due(number * step):
            album.add(Picture(number * step, "", 1, 1, b"abc"))
    return [picture.time for picture in album.pictures]


@given(st.floats(1, 5000), st.sampled_from([0.1, 0.3, 1.7]))
def test_an_album_is_bounded_and_evenly_spread(seconds, step):
    times = fill(Album(), seconds, step)
    assert 1 <= len(times) <= 8
    gaps = [later - earlier for earlier, later in pairwise(times)]
    assert not gaps or max(gaps) <= 3 * min(gaps)
    assert times[0] == 0


def image(width: int, height: int, size: int) -> ImageData:
    return ImageData(ImageDescription(width, height, size, "RGB8"), Time(0, 0), bytes(size))


def test_a_picture_has_the_pixels_of_its_image():
    picture = picture_from(image(4, 2, 24), 1.5, "here", [(1.0, 0.5)])
    assert picture is not None
    assert (picture.width, picture.height, len(picture.pixels), picture.marks) == (4, 2, 24, [(1.0, 0.5)])


@pytest.mark.parametrize(("width", "height", "size"), [(4, 2, 23), (0, 0, 0), (-4, -2, 24), (4, 2, 8)])
def test_an_image_of_another_size_than_it_claims_is_no_picture(width, height, size):
    assert picture_from(image(width, height, size), 0.0, "") is None
