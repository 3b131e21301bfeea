"""Any bytes at any entry point are accepted, or refused with an error that explains why."""

from __future__ import annotations

import pytest

from tests.support.examples import examples
from tests.support.hostile_bytes import HostileBytes, bombs
from tests.support.wire_doors import DOORS, Door, find_door


@pytest.fixture(params=DOORS)
def door(request: pytest.FixtureRequest) -> Door:
    return find_door(request.param)


@pytest.mark.slow
def test_what_is_sound_is_taken(door: Door) -> None:
    for sound in door.sound:
        assert door.take(sound)


@pytest.mark.slow
def test_hostile_input_is_taken_or_refused_with_a_reason(door: Door) -> None:
    hostile = HostileBytes(0)
    for _ in range(examples(400)):
        door.take(hostile.next_input(door.sound))


def test_bombs_are_refused(door: Door) -> None:
    for bomb in bombs():
        door.take(bomb)
