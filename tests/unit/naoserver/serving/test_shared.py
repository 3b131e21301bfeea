"""What all servants of a robot do alike: streams of states, and refusals that name the field."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import pytest
from hypothesis import given
from hypothesis import strategies as st

from interfaces.jderobot import CommandRefusedException, InvalidValueException
from naoserver.errors import CommandRefused, InvalidCommand, RobotError
from naoserver.serving._shared import (
    MOST_QUOTED,
    StateStream,
    refusals_raised,
    require_finite,
    require_known,
    require_positive,
    require_within,
    to_time,
)
from tests.support.calculator import Reading
from tests.support.calculator_servant import CalculatorI


@dataclass
class Door:
    """A state of one moment."""

    time: float
    is_open: bool = False


class Listener:
    """An outlet that counts the samples."""

    listening: Final = True

    def __init__(self) -> None:
        self.samples = 0

    def put(self, payload: object, attachment: bytes) -> None:
        self.samples += 1

    def close(self) -> None:
        pass


def streamed(news: Callable[[Door], object] | None = None) -> tuple[StateStream[Door, Reading], Listener]:
    """Return the stream of a door, which nobody moves, and a listener of it."""
    publisher = CalculatorI().getReadingPublisher
    stream = StateStream(lambda: Door(3.0), publisher, lambda door: Reading(round(door.time), []), news=news)
    assert not stream.listening
    listener = Listener()
    publisher.attach(listener)
    assert stream.listening
    return stream, listener


def test_a_call_gets_the_newest_state() -> None:
    stream, _ = streamed()
    assert stream.now() == Reading(3, [])


def test_a_stream_without_news_sends_every_reading() -> None:
    stream, listener = streamed()
    for time in (0.0, 0.02, 0.04):
        stream.publish(Door(time))
    assert listener.samples == 3


def test_a_stream_with_news_sends_changes_and_reminds_new_listeners_twice_a_second() -> None:
    stream, listener = streamed(lambda door: door.is_open)
    seen = []
    for door in (Door(0.0), Door(0.3), Door(0.4, True), Door(0.6, True), Door(0.9, True), Door(1.0)):
        stream.publish(door)
        seen.append(listener.samples)
    assert seen == [1, 1, 2, 2, 3, 4]


def test_a_stream_goes_on_when_the_robots_time_begins_again() -> None:
    stream, listener = streamed(lambda door: door.is_open)
    stream.publish(Door(1000.0))
    stream.publish(Door(0.0))
    assert listener.samples == 2


@pytest.mark.parametrize(
    ("seconds", "whole", "micro"),
    [(0.0, 0, 0), (1.5, 1, 500_000), (1.999_999_9, 2, 0), (-0.25, -1, 750_000)],
)
def test_a_time_has_whole_seconds_and_microseconds(seconds: float, whole: int, micro: int) -> None:
    time = to_time(seconds)
    assert (time.seconds, time.useconds) == (whole, micro)


@given(st.floats(-1e9, 1e9))
def test_microseconds_are_less_than_a_second(seconds: float) -> None:
    time = to_time(seconds)
    assert 0 <= time.useconds < 1_000_000
    assert time.seconds + time.useconds / 1_000_000 == pytest.approx(seconds, abs=1e-6)


NOT_FINITE: Final = (math.nan, math.inf, -math.inf)


@pytest.mark.parametrize(
    ("check", "refused"),
    [
        (require_finite, NOT_FINITE),
        (lambda **values: require_positive(1.0, **values), (*NOT_FINITE, 0.0, -0.1, 1.1)),
        (lambda **values: require_within(-1.0, 1.0, **values), (*NOT_FINITE, -1.1, 1.1)),
    ],
    ids=["finite", "positive", "within"],
)
def test_a_value_out_of_its_domain_is_refused_by_its_name(
    check: Callable[..., None], refused: tuple[float, ...]
) -> None:
    check(x=0.5, y=1.0)
    for value in refused:
        with pytest.raises(InvalidValueException, match=r"^y is ") as error:
            check(x=0.5, y=value)
        assert error.value.field == "y"


def test_a_name_that_is_not_known_is_refused_with_those_that_are() -> None:
    known = {"Stand": 1, "Sit": 2}
    require_known("posture", "Sit", known)
    with pytest.raises(InvalidValueException, match=r"there is no posture 'Lie'; there are Stand, Sit"):
        require_known("posture", "Lie", known)
    with pytest.raises(InvalidValueException) as error:
        require_known("posture", "x" * 10_000, known)
    assert "x" * (MOST_QUOTED + 1) not in str(error.value)


@pytest.mark.parametrize(
    ("raised", "expected", "detail"),
    [
        (InvalidCommand("HeadYaw", "HeadYaw is unknown"), InvalidValueException, {"field": "HeadYaw"}),
        (CommandRefused("Ann has the lease", "Ann"), CommandRefusedException, {"holder": "Ann"}),
    ],
)
def test_refusals_of_a_robot_become_those_of_its_interface(
    raised: RobotError, expected: type[Exception], detail: dict[str, Any]
) -> None:
    with pytest.raises(expected, match=str(raised)) as error, refusals_raised():
        raise raised
    assert {name: getattr(error.value, name) for name in detail} == detail
