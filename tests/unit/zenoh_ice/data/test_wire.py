"""Exceptions on the wire."""

from __future__ import annotations

from typing import Any

import msgpack
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.any_text import any_text
from tests.support.calculator import CalculatorError, DivisionByZero, OtherError
from tests.support.examples import examples
from tests.support.wire_values import Desk
from zenoh_ice import (
    BusyException,
    CommunicatorDestroyedException,
    InterfaceMismatchException,
    MarshalException,
    ObjectNotExistException,
    ObjectPrx,
    UnknownException,
    UserException,
    ZenohIceError,
)
from zenoh_ice.data.wire import decode_error, encode_error, unknown_exception


def test_members_and_bases_travel() -> None:
    assert msgpack.unpackb(encode_error(DivisionByZero("why", 2.0))) == {
        "exception": "::test::DivisionByZero",
        "bases": ["::test::CalculatorError"],
        "members": {"what": "why", "dividend": 2.0},
    }


def test_declared_base_admits_derived_exceptions() -> None:
    error = decode_error(encode_error(DivisionByZero("why", 2.0)), (CalculatorError,), "call")
    assert isinstance(error, DivisionByZero)
    assert (error.what, error.dividend) == ("why", 2.0)


def test_unknown_derived_exception_arrives_as_its_declared_base() -> None:
    members = {"what": "x", "y": 1}
    wire = {"exception": "::test::Newer", "bases": ["::test::CalculatorError"], "members": members}
    error = decode_error(msgpack.packb(wire), (CalculatorError,), "call")
    assert type(error) is CalculatorError
    assert error.what == "x"


def test_exception_that_is_not_declared_is_unknown() -> None:
    error = decode_error(encode_error(OtherError()), (CalculatorError,), "Calculator.add")
    assert isinstance(error, UnknownException)
    assert "Calculator.add raised ::test::OtherError" in str(error)


def test_members_of_the_wrong_type_are_refused() -> None:
    wire = msgpack.packb({"exception": "::test::CalculatorError", "members": {"what": 3}})
    error = decode_error(wire, (CalculatorError,), "call")
    assert isinstance(error, MarshalException)
    assert error.path == "$.what"


def test_members_that_cannot_be_encoded_make_it_unknown() -> None:
    error = decode_error(encode_error(CalculatorError(object())), (CalculatorError,), "call")  # type: ignore[arg-type]
    assert isinstance(error, UnknownException)
    assert "::test::CalculatorError could not be encoded" in str(error)


@pytest.mark.parametrize(
    "error",
    [
        ObjectNotExistException("gone"),
        BusyException("busy"),
        MarshalException("bad", "$.a.b"),
        InterfaceMismatchException("other", "aa", "bb", "member x"),
    ],
)
def test_system_exceptions_travel_whole(error: ZenohIceError) -> None:
    arrived = decode_error(encode_error(error), (), "call")
    assert type(arrived) is type(error)
    assert str(arrived) == str(error)
    assert vars(arrived) == vars(error)


def test_own_affairs_of_the_server_are_unknown_to_the_client() -> None:
    arrived = decode_error(encode_error(CommunicatorDestroyedException("ours")), (), "call")
    assert isinstance(arrived, UnknownException)
    assert str(arrived) == "CommunicatorDestroyedException: ours"


def test_long_texts_are_cut() -> None:
    arrived = decode_error(encode_error(unknown_exception(ValueError("x" * 100_000))), (), "call")
    assert len(str(arrived)) == 4096


def test_a_text_that_utf8_cannot_hold_travels_all_the_same() -> None:
    for error in (unknown_exception(OSError("no file \udcff")), MarshalException("\udcff", "$.\udcff")):
        assert "\\udcff" in str(decode_error(encode_error(error), (), "call"))


@pytest.mark.parametrize("name", ["UnknownException", "MarshalException", "InterfaceMismatchException"])
def test_an_error_without_a_text_gets_one(name: str) -> None:
    error = decode_error(msgpack.packb({"exception": f"::zenoh_ice::{name}"}), (), "Head.stop")
    assert str(error) == "Head.stop failed, and the servant gives no reason"


def test_an_exception_without_a_text_has_its_name() -> None:
    assert str(unknown_exception(ValueError())) == "ValueError"


def test_a_declared_exception_where_it_is_not_declared_has_its_type_id() -> None:
    assert str(unknown_exception(CalculatorError("why"))) == "::test::CalculatorError: why"


@pytest.mark.parametrize("problem", [KeyError, SystemExit])
def test_an_exception_whose_text_fails_says_so(problem: type[BaseException]) -> None:
    class Broken(Exception):
        def __str__(self) -> str:
            raise problem

    assert str(unknown_exception(Broken())) == f"Broken: its text failed with {problem.__name__}"


def test_an_unknown_type_id_is_cut() -> None:
    error = decode_error(msgpack.packb({"exception": "x" * 10_000}), (), "Head.stop")
    assert str(error) == f"Head.stop raised {'x' * 253}..., which the operation does not declare"


class Lost(UserException, id="::test::Lost"):
    last: ObjectPrx | None


def test_a_proxy_in_an_exception_arrives() -> None:
    desk: Any = Desk()
    wire = encode_error(Lost(desk.stringToProxy("Head")))
    error = decode_error(wire, (Lost,), "call", desk.stringToProxy)
    assert isinstance(error, Lost)
    assert error.last == desk.stringToProxy("Head")


HOSTILE = "\x1b]0;owned\x07\x1b[2J\nERROR forged\u202e\x00" + "x" * 100_000


@pytest.mark.parametrize(
    "wire",
    [
        {"exception": f"::zenoh_ice::{name}", "message": HOSTILE, **members}
        for name, members in {
            "UnknownException": {},
            "MarshalException": {"path": HOSTILE},
            "InterfaceMismatchException": {"expected": HOSTILE, "found": HOSTILE, "member": HOSTILE},
        }.items()
    ]
    + [
        {"exception": HOSTILE},
        {"exception": "::test::CalculatorError", "members": {"what": HOSTILE}},
        {"exception": "::test::DivisionByZero", "members": {"what": HOSTILE, "dividend": 1.0}},
    ],
)
def test_remote_text_is_cut_and_made_printable(wire: dict[str, object]) -> None:
    error = decode_error(msgpack.packb(wire), (CalculatorError,), "call")
    texts = [str(error)]
    if not isinstance(error, UserException):
        texts += [text for text in vars(error).values() if text]
    else:
        assert error.what == HOSTILE  # type: ignore[attr-defined]
    for text in texts:
        assert text.isprintable()
        assert 0 < len(text) <= 4200


def test_an_error_may_have_a_mebibyte() -> None:
    wire = {"exception": "::zenoh_ice::BusyException", "message": ""}
    length = (1 << 20) - len(msgpack.packb(wire)) - 4  # a text of that length has a header of 5 bytes, not 1
    data = msgpack.packb({**wire, "message": "x" * length})
    assert len(data) == 1 << 20
    assert isinstance(decode_error(data, (), "call"), BusyException)


def test_error_that_is_too_large_is_not_copied() -> None:
    class Large:
        def __len__(self) -> int:
            return (1 << 20) + 1

    error = decode_error(Large(), (CalculatorError,), "call")  # type: ignore[arg-type]
    assert isinstance(error, MarshalException)
    assert "error of call: 1048577 bytes; at most" in str(error)


@given(st.binary(max_size=300))
def test_any_bytes_make_an_exception(data: bytes) -> None:
    assert isinstance(decode_error(data, (CalculatorError,), "call"), ZenohIceError)


@settings(max_examples=examples(40))
@given(
    st.dictionaries(
        st.sampled_from(["exception", "bases", "members", "message", "path", "member"]),
        st.recursive(
            st.none() | st.integers() | any_text() | st.sampled_from(["::test::CalculatorError"]),
            lambda inner: st.lists(inner) | st.dictionaries(any_text(), inner),
            max_leaves=5,
        ),
    )
)
def test_any_map_makes_an_exception(wire: dict[str, object]) -> None:
    try:
        data = msgpack.packb(wire)
    except OverflowError:
        return
    assert isinstance(decode_error(data, (CalculatorError,), "call"), ZenohIceError)
