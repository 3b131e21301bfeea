"""The encoding of the generated types of interfaces/, compared with msgpack."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import interfaces
from tests.support.examples import examples
from tests.support.generated_types import modules_of, structs_of
from tests.support.wire_values import TOGETHER, Desk, packed, plain, struct_values, unpacked
from zenoh_ice import ObjectPrx

DESK = Desk()


def check_any_values(structs: list[type[msgspec.Struct]]) -> None:
    decoders = [msgspec.msgpack.Decoder(struct) for struct in structs]

    @settings(max_examples=examples(6))
    @given(st.tuples(*(struct_values(struct, DESK) for struct in structs)))
    def round_trip(values: tuple[msgspec.Struct, ...]) -> None:
        for value, decoder in zip(values, decoders, strict=True):
            assert unpacked(msgspec.msgpack.encode(value)) == plain(value)
            assert decoder.decode(packed(plain(value))) == value

    round_trip()


@pytest.mark.slow
def test_every_struct_crosses_the_wire_as_a_map_of_its_members() -> None:
    structs = structs_of(interfaces)
    for first in range(0, len(structs), TOGETHER):
        check_any_values(structs[first : first + TOGETHER])


def test_every_interface_has_a_proxy_and_a_servant() -> None:
    proxies = [
        value
        for module in modules_of(interfaces)
        for value in vars(module).values()
        if isinstance(value, type) and issubclass(value, ObjectPrx) and value.__module__ == module.__name__
    ]
    sources = "".join(path.read_text() for path in Path(interfaces.__path__[0]).glob("*.idl"))
    assert len(proxies) == len(re.findall(r"^\s*interface \w+", sources, re.MULTILINE))
    for proxy in proxies:
        servant = getattr(importlib.import_module(proxy.__module__), proxy.__name__.removesuffix("Prx"))
        assert servant.ice_interface is proxy.ice_interface
        for operation in proxy.ice_interface.operations:
            assert operation.name in servant.__abstractmethods__
            assert getattr(proxy, operation.name) is operation
            assert hasattr(servant, f"{operation.name}Publisher") == operation.streamed
