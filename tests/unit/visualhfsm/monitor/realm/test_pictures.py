"""Former pictures of the cameras: which one belongs to a moment, and that they take bounded memory."""

from __future__ import annotations

import pytest

from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._monitor.realm.pictures import Pictures, encode_jpeg


def test_the_picture_of_a_moment_is_the_last_one_before_it() -> None:
    pictures = Pictures()
    for second in range(3):
        pictures.add("Camera", 100.0 + second, bytes([second]))
        pictures.add("CameraBottom", 100.0 + second, b"other")
    assert pictures.at("Camera", 101.9) == b"\x01"
    assert pictures.at("Camera", 99.9) is None
    assert pictures.at("CameraOutside", 101.0) is None


def test_a_picture_of_long_before_is_none_of_the_moment() -> None:
    pictures = Pictures()
    pictures.add("Camera", 100.0, b"old")
    assert pictures.at("Camera", 101.0) == b"old"
    assert pictures.at("Camera", 110.0) is None


def test_some_pictures_of_a_second_are_kept_also_when_the_clock_is_set_back() -> None:
    pictures = Pictures()
    for number in range(10):
        pictures.add("Camera", 100.0 + number / 10, bytes([number]))
    assert [pictures.at("Camera", 100.0 + number / 10) for number in (0, 4, 5, 9)] == [
        b"\0",
        b"\0",
        b"\5",
        b"\5",
    ]
    pictures.add("Camera", 50.0, b"earlier")
    assert pictures.at("Camera", 50.0) == b"earlier"


def test_the_oldest_pictures_give_way() -> None:
    pictures = Pictures(most_bytes=3000)
    for second in range(10):
        pictures.add("Camera", 100.0 + second, bytes(1000))
    assert pictures.at("Camera", 106.5) is None
    assert pictures.at("Camera", 107.5) is not None


def test_pictures_are_spread_evenly_over_the_run() -> None:
    pictures = Pictures()
    for second in range(100):
        pictures.add("Camera", float(second), bytes([second]))
        pictures.add("Camera", second + 0.1, b"too soon")
    spread = pictures.spread(10, 0.0, 99.5)["Camera"]
    assert spread == [(float(second), bytes([second])) for second in range(0, 100, 10)]
    assert len(pictures.spread(1000, 0.0, 99.5)["Camera"]) == 100
    assert [time for time, _ in pictures.spread(10, 20.0, 22.5)["Camera"]] == [20.0, 21.0, 22.0]
    assert Pictures().spread(10, 0.0, 99.5) == {}


@pytest.mark.parametrize(("width", "height", "size"), [(4, 2, 23), (0, 0, 0), (-4, -2, 24), (4, 2, 8)])
def test_an_image_of_another_size_than_it_claims_is_no_picture(width: int, height: int, size: int) -> None:
    with pytest.raises(VisualHfsmError, match=f"an image of {width} x {height} has {size} bytes"):
        encode_jpeg(width, height, bytes(size))
