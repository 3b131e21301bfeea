"""The robot's time, and which clock a component goes by."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, ClassVar, Final

from ..exceptions import (
    ConnectionLostException,
    MarshalException,
    ObjectNotExistException,
    TimeoutException,
)
from ..generated import Interface, ObjectPrx, Operation, Struct, streamed
from ..streams.stream import Sample
from .clock import Clock, WallClock
from .estimated_clock import EstimatedClock

if TYPE_CHECKING:
    from ..communicator import Communicator

__all__ = ["RobotClock", "choose_clock"]

_IDENTITY: Final = "Clock"

_logger = logging.getLogger(__name__)

# What this package needs of interfaces/clock.idl: it may not import what is generated from it. Without a
# fingerprint it reads every version that has these members.


class _ClockReading(Struct):
    time: float
    rate: float
    simulated: bool


class _Arguments(Struct):
    pass


class _Result(Struct):
    returnValue: _ClockReading


_GET_TIME: Final[Operation[[], _ClockReading]] = Operation(
    "getTime", arguments=_Arguments, result=_Result, idempotent=True, streamed=True
)


class _ClockPrx(ObjectPrx):
    ice_interface: ClassVar[Interface] = Interface("::nao::Clock", operations=(_GET_TIME,))

    @streamed(_GET_TIME)
    def getTime(self) -> _ClockReading:
        return self.ice_invoke(_GET_TIME)


class RobotClock(EstimatedClock):
    """Follow the stream of the realm's servant `Clock`.

    Raises ObjectNotExistException, ConnectionLostException or TimeoutException when there is none yet, and
    MarshalException when it shows what no clock can.
    """

    def __init__(self, communicator: Communicator) -> None:
        proxy = _ClockPrx.uncheckedCast(communicator.stringToProxy(_IDENTITY))
        first = proxy.getTime()
        super().__init__(first.time, first.rate, first.simulated)
        self._subscription = proxy.getTime.subscribe(self._take)

    def close(self) -> None:
        """Stop following; every sleeper is let go."""
        super().close()
        self._subscription.close()

    def _take(self, sample: Sample[_ClockReading]) -> None:
        reading = sample.value
        self.update(reading.time, reading.rate, reading.simulated)


def choose_clock(communicator: Communicator) -> Clock:
    """Return the clock that the communicator's settings ask for.

    `sim` follows the robot's clock, `wall` is steady wall time, and `auto` follows the robot's clock if there
    is one and its time is simulated. Raises, for `sim` alone, what RobotClock raises.
    """
    choice = communicator.settings.clock
    if choice == "sim":
        return RobotClock(communicator)
    if choice == "auto":
        try:
            clock = RobotClock(communicator)
        except (
            ObjectNotExistException,
            ConnectionLostException,
            TimeoutException,
            MarshalException,
        ) as error:
            _logger.info("going by the wall's clock: %s", error)
            return WallClock()
        if clock.simulated:
            return clock
        clock.close()
    return WallClock()
