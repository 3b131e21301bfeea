"""Payloads in pieces: they are the same bytes as in one piece."""

from __future__ import annotations

from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.any_text import any_text
from tests.support.wire_values import Desk
from zenoh_ice import MarshalException, ObjectPrx
from zenoh_ice.data.codec import Codec, Parted, Pieces, encode
from zenoh_ice.data.values import Struct


class Shape(Struct):
    width: int
    mask: bytes


class Image(Struct):
    shape: Shape
    pixels: bytes
    comment: str


class Arguments(Struct):
    image: Image
    others: list[bytes]
    note: bytes | None = None


LARGE = 8  # so that examples stay small
APART = range(LARGE, 1 << 32)
CODEC = Codec(Arguments, APART)


sizes = st.sampled_from([0, 1, LARGE - 1, LARGE, LARGE + 1, 3 * LARGE])
byte_sequences = st.builds(lambda size, fill: bytes([fill]) * size, sizes, st.integers(0, 255))


@given(
    st.builds(
        Arguments,
        image=st.builds(
            Image,
            shape=st.builds(Shape, width=st.integers(0, 9), mask=byte_sequences),
            pixels=byte_sequences,
            comment=any_text(max_size=9),
        ),
        others=st.lists(byte_sequences, max_size=2),
        note=st.none() | byte_sequences,
    )
)
def test_pieces_together_are_the_value(value: Arguments) -> None:
    gathered = CODEC.gather_result((value.image, value.others, value.note), "it")
    assert len(gathered) == len(bytes(gathered))
    large = [data for data in (value.image.shape.mask, value.image.pixels) if len(data) >= LARGE]
    taken = gathered.large if isinstance(gathered, Pieces) else []
    assert [id(data) for data in taken] == [id(data) for data in large]
    if isinstance(gathered, Pieces):
        parted = Parted(gathered.without_large(), gathered.places, gathered.large)
        assert CODEC.unpack(parted, "it") == value
    assert CODEC.unpack(bytes(gathered), "it") == value


def test_pieces_together_are_what_msgspec_encodes() -> None:
    large = 1 << 16
    codec = Codec(Arguments)
    for size in (0, large - 1, large, large + 1):
        value = Arguments(Image(Shape(1, b"m" * size), b"p" * size, "c"), [b"o" * size], None)
        gathered = codec.gather_result((value.image, value.others, value.note), "it")
        assert isinstance(gathered, Pieces) is (size >= large)
        assert bytes(gathered) == msgspec.msgpack.encode(value)


def test_the_value_keeps_its_bytes() -> None:
    image = Image(Shape(1, b""), b"x" * LARGE, "")
    CODEC.gather_result((image, [], None), "it")
    assert image.pixels == b"x" * LARGE


@pytest.mark.parametrize("pixels", [bytearray(LARGE), memoryview(bytes(LARGE)), np.zeros(LARGE, np.uint8)])
def test_what_may_change_is_copied_at_once(pixels: object) -> None:
    gathered = CODEC.gather_result((Image(Shape(1, b""), pixels, ""), [], None), "it")  # type: ignore[arg-type]
    assert isinstance(gathered, bytes)
    assert CODEC.unpack(gathered, "it").image.pixels == bytes(LARGE)


def test_what_is_no_struct_is_left_to_the_receiver() -> None:
    assert msgspec.msgpack.decode(bytes(CODEC.gather_result((None, [], None), "it")))["image"] is None


def test_a_struct_of_another_type_is_left_to_the_receiver() -> None:
    packed = bytes(CODEC.gather_result((Shape(1, b"x" * LARGE), [], None), "it"))
    assert msgspec.msgpack.decode(packed)["image"] == {"width": 1, "mask": b"x" * LARGE}


def test_more_bytes_than_messagepack_can_hold_do_not_travel_apart() -> None:
    codec = Codec(Arguments, range(LARGE, 2 * LARGE + 1))

    def travels_apart(size: int) -> bool:
        image = Image(Shape(1, b""), b"x" * size, "")
        return isinstance(codec.gather_result((image, [], None), "it"), Pieces)

    assert [travels_apart(2 * LARGE), travels_apart(2 * LARGE + 1)] == [True, False]


@pytest.mark.parametrize(
    "array",
    [np.arange(24, dtype=np.uint8).reshape(4, 6), np.arange(24, dtype=np.uint8).reshape(4, 6)[:, ::2]],
    ids=["contiguous", "with gaps"],
)
def test_an_array_of_bytes_is_a_byte_sequence(array: np.ndarray) -> None:
    assert msgspec.msgpack.decode(encode(array, "it")) == array.tobytes()


@pytest.mark.parametrize(("array", "value"), [(np.array([1.5, 2.0]), [1.5, 2.0]), (np.array(5, np.uint8), 5)])
def test_another_array_is_a_list_or_a_number(array: np.ndarray, value: object) -> None:
    assert msgspec.msgpack.decode(encode(array, "it")) == value


def parted(places: tuple[int, ...], *large: bytes) -> Parted:
    """Return arguments without their byte sequences, and some beside them."""
    gathered = CODEC.gather_result((Image(Shape(1, b""), b"", ""), [], None), "it")
    return Parted(bytes(gathered), places, large)


def test_large_bytes_come_to_their_places() -> None:
    image = CODEC.unpack(parted((0, 1), b"mask", b"pixels"), "it").image
    assert (image.shape.mask, image.pixels) == (b"mask", b"pixels")


@pytest.mark.parametrize("place", [-1, 2])
def test_large_bytes_for_a_place_that_is_not_there_are_refused(place: int) -> None:
    with pytest.raises(MarshalException, match=r"^it: large bytes where there are none$"):
        CODEC.unpack(parted((place,), b"x"), "it")


def test_as_many_large_bytes_as_places_are_wanted() -> None:
    with pytest.raises(ValueError, match="argument 2 is shorter"):
        CODEC.unpack(parted((0, 1), b"mask"), "it")


class Picture(Struct):
    pixels: bytes
    camera: ObjectPrx | None


def test_a_proxy_beside_large_bytes_arrives() -> None:
    desk: Any = Desk()
    camera = desk.stringToProxy("Camera")
    codec = Codec(Picture, APART)
    gathered = codec.gather_result((b"x" * LARGE, camera), "it")
    assert isinstance(gathered, Pieces)
    arrived = Parted(gathered.without_large(), gathered.places, gathered.large)
    assert codec.unpack(arrived, "it", desk.stringToProxy) == Picture(b"x" * LARGE, camera)
