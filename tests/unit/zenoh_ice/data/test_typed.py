"""Types that several threads decode for the first time: msgspec would end the process."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from types import ModuleType
from typing import Any

import msgspec
import pytest

from tests.support.limits import EVENT_LIMIT
from zenoh_ice.data import typed
from zenoh_ice.data.codec import Codec
from zenoh_ice.generated import Struct

SOURCE = """
class Inner(Struct):
    first: "reading(int)"
    second: "str"

class Outer(Struct):
    inner: "Inner"
"""
CONTENT = {"inner": {"first": 1, "second": "two"}}


@pytest.fixture
def module() -> Iterator[ModuleType]:
    """A module with two structs, of which nobody has read the annotations."""
    made = ModuleType("types_of_a_test")
    vars(made).update(Struct=Struct, reading=lambda kind: kind)
    sys.modules[made.__name__] = made
    try:
        exec(SOURCE, vars(made))
        yield made
    finally:
        del sys.modules[made.__name__]


def by_codec(outer: type[Any]) -> Any:
    return Codec(outer).unpack(msgspec.msgpack.encode(CONTENT), "x")


def by_typed(outer: type[Any]) -> Any:
    return typed.from_json(msgspec.json.encode(CONTENT), outer)


@pytest.mark.parametrize("first", [by_codec, by_typed])
@pytest.mark.parametrize("second", [by_codec, by_typed])
def test_a_type_whose_annotations_another_thread_reads_is_decoded_after_that(
    module: ModuleType, first: Callable[[Any], Any], second: Callable[[Any], Any]
) -> None:
    found: list[Any] = []
    thread = threading.Thread(target=lambda: found.append(second(module.Outer)))

    def reading(kind: type[Any]) -> type[Any]:
        if thread.ident is None:
            thread.start()
            thread.join(0.1)  # time to decode what this thread is not done with
        return kind

    vars(module)["reading"] = reading
    found.append(first(module.Outer))
    thread.join(EVENT_LIMIT)
    assert [(each.inner.first, each.inner.second) for each in found] == [(1, "two")] * 2
