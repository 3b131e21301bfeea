"""Decoding: any bytes are of the declared type, or MarshalException says where they are not."""

from __future__ import annotations

import math
from contextlib import suppress
from typing import Any

import msgpack
import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.any_text import any_text
from tests.support.attachments import encode_call_attachment
from tests.support.calculator import Node
from tests.support.examples import examples
from tests.support.wire_values import pack
from zenoh_ice import MarshalException
from zenoh_ice.data.codec import Codec, encode
from zenoh_ice.data.wire import Attachment, decode_attachment, encode_sample_attachment
from zenoh_ice.generated import Byte, Int, Long, Short, Struct


class Inner(Struct):
    flag: bool
    name: str


class Everything(Struct):
    byte: Byte
    short: Short
    int_: Int
    long: Long
    number: float
    data: bytes
    inner: Inner
    many: list[Inner]
    table: dict[str, float]
    node: Node | None


class Empty(Struct):
    pass


class One(Struct):
    returnValue: float


class Two(Struct):
    returnValue: float
    out: str


def whole(low: int, high: int) -> st.SearchStrategy[int]:
    return st.integers(low, high)


inners = st.builds(Inner, st.booleans(), any_text(max_size=20))
everything = st.builds(
    Everything,
    whole(0, 255),
    whole(-(2**15), 2**15 - 1),
    whole(-(2**31), 2**31 - 1),
    whole(-(2**63), 2**63 - 1),
    st.floats(allow_nan=False),
    st.binary(max_size=50),
    inners,
    st.lists(inners, max_size=3),
    st.dictionaries(any_text(max_size=5), st.floats(allow_nan=False), max_size=3),
    st.recursive(st.none(), lambda node: st.builds(Node, whole(0, 9), node), max_leaves=5),
)
codec = Codec(Everything)


@settings(max_examples=examples(40))
@given(everything)
def test_what_is_packed_is_unpacked(value: Everything) -> None:
    unpacked = codec.unpack(pack(codec, tuple_of(value), "x"), "x")
    packed = pack(codec, msgspec.structs.astuple(unpacked), "x")
    assert codec.unpack(packed, "x") == value


@settings(max_examples=examples(40))
@given(everything)
def test_payload_is_a_map_by_parameter_name(value: Everything) -> None:
    read = msgpack.unpackb(pack(codec, tuple_of(value), "x"))
    assert list(read) == list(Everything.__struct_fields__)
    assert read["inner"] == {"flag": value.inner.flag, "name": value.inner.name}
    assert read["data"] == value.data


@pytest.mark.parametrize(
    ("changed", "message", "path"),
    [
        ({"number": "fast"}, "Head.setPose: number is float, not str", "$.number"),
        ({"number": None}, "Head.setPose: number is float, not None", "$.number"),
        ({"inner": {"flag": [], "name": ""}}, "Head.setPose: inner.flag is bool, not list", "$.inner.flag"),
        ({"table": {"x": "y"}}, "Head.setPose: table[...] is float, not str", "$.table[...]"),
    ],
)
def test_a_value_of_another_type_is_refused_in_plain_words(
    changed: dict[str, object], message: str, path: str
) -> None:
    value = Everything(1, 2, 3, 4, 0.5, b"", Inner(True, ""), [], {}, None)
    payload = msgpack.packb({**msgpack.unpackb(pack(codec, tuple_of(value), "x")), **changed})
    with pytest.raises(MarshalException) as refused:
        codec.unpack(payload, "Head.setPose")
    assert (str(refused.value), refused.value.path) == (message, path)


@given(st.binary(max_size=200))
def test_any_bytes_unpack_or_are_refused(payload: bytes) -> None:
    unpack_or_refuse(payload)


@settings(max_examples=examples(60))
@given(everything, st.data())
def test_cut_and_changed_payloads_unpack_or_are_refused(value: Everything, data: st.DataObject) -> None:
    payload = bytearray(pack(codec, tuple_of(value), "x"))
    place = data.draw(whole(0, len(payload) - 1))
    if data.draw(st.booleans()):
        del payload[place:]
    else:
        payload[place] = data.draw(whole(0, 255))
    unpack_or_refuse(bytes(payload))


@pytest.mark.parametrize(
    ("field", "value", "path"),
    [
        ("byte", 256, "$.byte"),
        ("byte", -1, "$.byte"),
        ("short", 1 << 15, "$.short"),
        ("int_", -(1 << 31) - 1, "$.int_"),
        ("long", 1 << 63, "$.long"),
        ("number", "1.0", "$.number"),
        ("data", "text", "$.data"),
        ("inner", {"flag": 1, "name": ""}, "$.inner.flag"),
        ("inner", {"flag": True}, "$.inner.name"),
        ("many", [{"flag": True, "name": ""}, 3], "$.many[1]"),
        ("table", {"HeadYaw": "wide"}, "$.table[...]"),
        ("node", {"value": 1, "next": {"value": 1}}, "$.node.next.next"),
    ],
)
def test_error_has_the_path(field: str, value: object, path: str) -> None:
    sound: dict[str, Any] = {
        "byte": 0,
        "short": 0,
        "int_": 0,
        "long": 0,
        "number": 0,
        "data": b"",
        "inner": {"flag": True, "name": ""},
        "many": [],
        "table": {},
        "node": None,
    }
    codec.unpack(msgpack.packb(sound), "x")
    with pytest.raises(MarshalException) as caught:
        codec.unpack(msgpack.packb({**sound, field: value}), "Head.setPose")
    assert caught.value.path == path
    assert path.removeprefix("$.") in str(caught.value)
    assert str(caught.value).startswith("Head.setPose: ")


def test_every_member_is_required() -> None:
    with pytest.raises(MarshalException) as caught:
        Codec(One).unpack(b"\x80", "x")
    assert caught.value.path == "$.returnValue"


def test_deep_nesting_is_reported() -> None:
    with pytest.raises(MarshalException, match="x: nested too deeply"):
        Codec(One).unpack(b"\x81\xa1u" + b"\x91" * 200_000, "x")


class ByInner(Struct):
    table: dict[Inner, int]


class ByList(Struct):
    table: dict[Key, int]


class Key(Struct):
    parts: list[int]


def test_keys_without_a_hash_are_refused() -> None:
    inner = msgpack.packb({"flag": True, "name": "a"})
    assert Codec(ByInner).unpack(b"\x81\xa5table\x81" + inner + b"\x01", "x").table == {Inner(True, "a"): 1}
    with pytest.raises(MarshalException, match="must be hashable"):
        Codec(ByList).unpack(b"\x81\xa5table\x81\x81\xa5parts\x90\x01", "x")


def test_not_a_number_passes() -> None:
    assert math.isnan(Codec(One).unpack_result(bytes(Codec(One).gather_result(math.nan, "x")), "x"))  # type: ignore[arg-type]


@pytest.mark.parametrize(("struct", "value"), [(Empty, None), (One, 1.5), (Two, (1.5, "a"))])
def test_results_of_none_one_and_many(struct: type[Struct], value: object) -> None:
    results = Codec(struct)
    assert results.unpack_result(bytes(results.gather_result(value, "x")), "x") == value


@pytest.mark.parametrize(
    ("struct", "value"), [(Empty, 1), (Two, None), (Two, 1.5), (Two, (1.5,)), (Two, (1.5, "a", 2))]
)
def test_result_of_the_wrong_shape_is_refused(struct: type[Struct], value: object) -> None:
    with pytest.raises(MarshalException, match="expected"):
        Codec(struct).gather_result(value, "x")


@pytest.mark.parametrize(
    ("struct", "value", "text"),
    [
        (Two, 1.5, "x: expected a tuple (returnValue, out), got float"),
        (Empty, 1, "x: expected None, got int"),
    ],
)
def test_a_result_of_the_wrong_shape_is_refused_with_the_right_one(
    struct: type[Struct], value: object, text: str
) -> None:
    with pytest.raises(MarshalException) as caught:
        Codec(struct).gather_result(value, "x")
    assert str(caught.value) == text


def test_what_cannot_be_encoded_is_refused_with_its_type() -> None:
    with pytest.raises(MarshalException) as caught:
        encode(object(), "x")
    assert str(caught.value) == "x: a object cannot be encoded"


def test_what_holds_itself_is_refused_with_the_reason() -> None:
    endless: list[object] = []
    endless.append(endless)
    with pytest.raises(MarshalException) as caught:
        encode(endless, "x")
    reason = "nested too deeply, or in a cycle: a value that holds itself cannot be encoded"
    assert str(caught.value) == f"x: {reason}"


def test_what_is_no_messagepack_is_refused_without_a_path() -> None:
    with pytest.raises(MarshalException) as caught:
        Codec(One).unpack(b"\x81", "x")
    assert caught.value.path == ""
    assert str(caught.value) == "x: Input data was truncated"


class ByName(Struct, kw_only=True):
    first: int
    second: int = 2


class TestByName:
    """Structs that Python makes of named values alone."""

    codec = Codec(ByName)

    def test_they_are_made_of_values_in_their_order(self) -> None:
        assert self.codec.make(5, 6) == ByName(first=5, second=6)

    def test_they_are_made_of_values_and_names(self) -> None:
        assert self.codec.make(5, second=6) == ByName(first=5, second=6)

    def test_what_has_a_default_value_may_be_left_out(self) -> None:
        assert self.codec.make(5) == ByName(first=5, second=2)

    def test_more_values_than_members_are_refused(self) -> None:
        with pytest.raises(TypeError, match=r"^3 values; 2 are expected$"):
            self.codec.make(5, 6, 7)


class Bulky(Struct):
    first: float
    nested: list[Everything]


class Lean(Struct):
    node: Node | None
    names: dict[str, list[str]]


def test_types_that_hold_bytes_are_recognized() -> None:
    assert Codec(Bulky).holds_bytes
    assert not Codec(Lean).holds_bytes


class TestAttachment:
    def test_call(self) -> None:
        about = decode_attachment(encode_call_attachment("f00d", 7, "abc", 2.0))
        assert (about.fingerprint, about.sequence, about.call_id) == ("f00d", 7, "abc/7")
        assert about.client == "abc"
        assert about.timeout == 2.0
        assert about.given_up == ()

    def test_a_call_names_those_that_are_given_up_if_there_are_any(self) -> None:
        about = decode_attachment(encode_call_attachment("f00d", 7, "abc", 2.0, (3, 5)))
        assert about.given_up == (3, 5)
        lengths = [
            len(msgpack.unpackb(encode_call_attachment("f00d", 7, "abc", 2.0, given_up)))
            for given_up in ((), (3,))
        ]
        assert lengths == [6, 7], "most calls are as short as they can be"

    def test_sample(self) -> None:
        about = decode_attachment(encode_sample_attachment("f00d", 7, 12.5))
        assert (about.sequence, about.robot_time, about.client) == (7, 12.5, "")
        assert about.timeout == 0.0

    def test_a_sample_may_have_been_sent_earlier(self) -> None:
        about = decode_attachment(encode_sample_attachment("f00d", 7, 12.5, wall_time=1000.0))
        assert about.wall_time == 1000.0

    @pytest.mark.parametrize(
        ("place", "value"),
        [
            (0, "x" * 129),
            (1, -1),
            (1, 0.5),
            (3, -1.0),
            (3, math.nan),
            (3, math.inf),
            (4, "x" * 129),
            (5, -0.1),
            (5, math.nan),
            (5, 1e300),
        ],
    )
    def test_what_nobody_could_go_by_is_refused(self, place: int, value: object) -> None:
        sound = ["f00d", 7, math.nan, 1.7e9, "abc/7", 2.0]
        decode_attachment(msgspec.msgpack.encode(sound))
        with pytest.raises(MarshalException, match="attachment: "):
            decode_attachment(msgspec.msgpack.encode([*sound[:place], value, *sound[place + 1 :]]))

    def test_more_bytes_than_any_has_are_refused(self) -> None:
        with pytest.raises(MarshalException, match="2049 bytes; at most 2048 are accepted"):
            decode_attachment(bytes(2049))


@given(st.binary(max_size=600))
def test_any_bytes_are_an_attachment_or_refused(data: bytes) -> None:
    with suppress(MarshalException):
        assert isinstance(decode_attachment(data), Attachment)


def unpack_or_refuse(payload: bytes) -> None:
    with suppress(MarshalException):
        assert isinstance(codec.unpack(payload, "x"), Everything)


def tuple_of(value: Struct) -> tuple[Any, ...]:
    return tuple(getattr(value, name) for name in value.__struct_fields__)
