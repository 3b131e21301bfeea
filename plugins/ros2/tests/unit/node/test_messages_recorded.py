"""Bytes and type hashes are those that rclpy, rosidl and Cyclone DDS were recorded to make (plugins/ros2/tests/data/ros2)."""

from __future__ import annotations

import random
from typing import Any, Final

import pytest

from plugins.ros2.tests.support.ros_peers import recorded_types
from tests.support.examples import examples
from tests.support.malformed_cdr import malformed
from zenoh_ros2 import MessageError, Types

RECORDED: Final = recorded_types()
HASHES: Final[dict[str, str]] = RECORDED["hashes"]
DEFINITIONS: Final[dict[str, dict[str, Any]]] = RECORDED["definitions"]
MESSAGES: Final[list[dict[str, Any]]] = RECORDED["cdr"]
PADDING: Final = 32
"""Fast CDR estimates the size of a message in advance, and rclpy returns that many bytes: some more than it needs,
such as 4 for each empty sequence of doubles."""


@pytest.fixture(scope="module")
def types() -> Types:
    types = Types("jazzy")
    waiting = {name: each["text"] for name, each in DEFINITIONS.items() if name not in types}
    for name in sorted(waiting, key=lambda name: (name != "duration_msgs/msg/Span", "/msg/" not in name)):
        types.add(name, waiting[name])
    return types


def test_hashes_are_those_of_the_wheels(types: Types) -> None:
    assert {name: types.hash(name) for name in HASHES} == HASHES


def test_hashes_are_those_of_rosidl(types: Types) -> None:
    # That of an action as a whole stands in no key.
    expected = {
        part: each
        for name, definition in DEFINITIONS.items()
        for part, each in definition["hashes"].items()
        if "/action/" not in name or part != name
    }
    assert {part: types.hash(part) for part in expected} == expected


@pytest.mark.slow
def test_bytes_are_those_of_other_implementations(types: Types) -> None:
    for recorded in MESSAGES:
        name, data = recorded["type"], bytes.fromhex(recorded["cdr"])
        message = types.make(name, recorded["values"])
        written = types.encode(message)
        assert written == data[: len(written)], name
        assert len(data) - len(written) < PADDING, name
        assert not any(data[len(written) :]), name
        assert types.encode(types.decode(data[: len(written)], name)) == written, name


def test_padding_may_have_any_bytes(types: Types) -> None:
    """Fast CDR leaves in padding what is in memory."""
    data = bytearray(types.encode(types.make("lifecycle_msgs/msg/State", id=3, label="active")))
    data[5:8] = b"\x55\xaa\x7f"
    decoded = types.decode(bytes(data), "lifecycle_msgs/msg/State")
    assert (decoded.id, decoded.label) == (3, "active")


@pytest.mark.slow
def test_malformed_bytes_are_refused_by_name(types: Types) -> None:
    """Of 25,000 payloads, cut, changed or random ones, each is decoded or refused with the name of its type."""
    chance = random.Random(17)
    samples = [(each["type"], bytes.fromhex(each["cdr"])) for each in MESSAGES if len(each["cdr"]) > 8]
    refused, unnamed = 0, []
    count = examples(25_000)
    for _ in range(count):
        name, data = chance.choice(samples)
        try:
            message = types.decode(malformed(data, chance), name)
        except MessageError as error:
            refused += 1
            if name not in str(error):
                unnamed.append(str(error))
        else:
            assert isinstance(message, types[name])
    assert not unnamed
    assert refused > count // 2
