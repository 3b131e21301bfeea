"""What the generated types of interfaces/ put on the wire, against msgpack as reference."""

from __future__ import annotations

import importlib
import pkgutil
import re
from collections.abc import Iterator
from enum import IntEnum
from pathlib import Path
from typing import Any

import msgpack
import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import inspect

import interfaces
from zenoh_ice import ObjectPrx, UserException
from zenoh_ice.operation import Interface


def modules() -> Iterator[Any]:
    for package in pkgutil.walk_packages(interfaces.__path__, "interfaces."):
        yield importlib.import_module(package.name)


def generated_structs() -> list[type[msgspec.Struct]]:
    """Return every struct, every exception's members, and the arguments and results of every operation."""
    found: dict[str, type[msgspec.Struct]] = {}
    for module in modules():
        for value in vars(module).values():
            if isinstance(value, Interface):
                for operation in value.operations:
                    for struct in (operation.arguments.struct, operation.result.struct):
                        found[f"{struct.__module__}.{struct.__qualname__}"] = struct
            elif isinstance(value, type) and value.__module__ == module.__name__:
                kind = value.Members if issubclass(value, UserException) else value
                if issubclass(kind, msgspec.Struct):
                    found[f"{kind.__module__}.{value.__qualname__}"] = kind
    return [found[name] for name in sorted(found)]


def values(kind: inspect.Type) -> st.SearchStrategy[Any]:
    """Return a strategy of values of a type."""
    match kind:
        case inspect.BoolType():
            return st.booleans()
        case inspect.IntType(ge=lowest, le=highest):
            return st.integers(lowest, highest)
        case inspect.FloatType():
            return st.floats(allow_nan=False)
        case inspect.StrType():
            return st.text(max_size=5)
        case inspect.BytesType():
            return st.binary(max_size=5)
        case inspect.EnumType(cls=cls):
            return st.sampled_from(list(cls))
        case inspect.ListType(item_type=item):
            return st.lists(values(item), max_size=3)
        case inspect.DictType(key_type=key, value_type=value):
            return st.dictionaries(values(key), values(value), max_size=3)
        case inspect.StructType(cls=cls, fields=fields):
            return st.builds(cls, *(values(field.type) for field in fields))
    raise AssertionError(f"no strategy for {kind}")


def plain(value: Any) -> Any:
    """Return a value as a dynamic language without our types would hold it."""
    if isinstance(value, msgspec.Struct):
        return {
            field.encode_name: plain(getattr(value, field.name)) for field in msgspec.structs.fields(value)
        }
    if isinstance(value, IntEnum):
        return int(value)
    if isinstance(value, list):
        return [plain(item) for item in value]
    if isinstance(value, dict):
        return {plain(key): plain(item) for key, item in value.items()}
    return value


@pytest.mark.parametrize("struct", generated_structs(), ids=lambda struct: struct.__qualname__)
def test_a_struct_crosses_the_wire_as_a_map_of_its_members(struct: type[msgspec.Struct]) -> None:
    decoder = msgspec.msgpack.Decoder(struct)

    @settings(max_examples=15)
    @given(values(inspect.type_info(struct)))
    def round_trip(value: msgspec.Struct) -> None:
        payload = msgspec.msgpack.encode(value)
        assert msgpack.unpackb(payload, strict_map_key=False) == plain(value)
        assert decoder.decode(msgpack.packb(plain(value))) == value

    round_trip()


def test_every_interface_has_a_proxy_and_a_servant() -> None:
    proxies = [
        value
        for module in modules()
        for value in vars(module).values()
        if isinstance(value, type) and issubclass(value, ObjectPrx) and value.__module__ == module.__name__
    ]
    sources = "".join(path.read_text() for path in Path(interfaces.__file__).parent.glob("*.idl"))
    assert len(proxies) == len(re.findall(r"^\s*interface \w+", sources, re.MULTILINE))
    for proxy in proxies:
        servant = getattr(importlib.import_module(proxy.__module__), proxy.__name__.removesuffix("Prx"))
        assert servant.ice_interface is proxy.ice_interface
        for operation in proxy.ice_interface.operations:
            assert operation.name in servant.__abstractmethods__
            assert hasattr(proxy, f"{operation.name}Async")
            assert hasattr(servant, f"{operation.name}Publisher") == operation.streamed
