"""An interface as codegen would write it, of a servant that may answer later, and is called oneway, too."""

from __future__ import annotations

import threading
from abc import abstractmethod
from concurrent.futures import Future
from typing import ClassVar, Final

from zenoh_ice.generated import (
    Current,
    Dispatched,
    Interface,
    Object,
    ObjectPrx,
    Operation,
    Struct,
    UserException,
)

__all__ = ["Gripper", "GripperI", "GripperPrx", "Slipped"]


class Slipped(UserException):
    ice_type_id: ClassVar[str] = "::test::Slipped"

    class Members(Struct):
        force: float

    def __init__(self, force: float) -> None:
        super().__init__(force)
        self.force = force


class _Nothing(Struct):
    pass


class _Force(Struct):
    force: float


class _Position(Struct):
    position: float


class _Size(Struct):
    size: int


class _DoubleResult(Struct):
    returnValue: float


class _DoublesResult(Struct):
    returnValue: list[float]


class _TextResult(Struct):
    returnValue: str


_close: Final[Operation[[float], float]] = Operation(
    "close", arguments=_Force, result=_DoubleResult, exceptions=(Slipped,), amd=True
)
_move: Final[Operation[[float], None]] = Operation("move", arguments=_Position, result=_Nothing)
_positions: Final[Operation[[], list[float]]] = Operation(
    "positions", arguments=_Nothing, result=_DoublesResult, idempotent=True
)
_text: Final[Operation[[int], str]] = Operation("text", arguments=_Size, result=_TextResult)
_who: Final[Operation[[], str]] = Operation("who", arguments=_Nothing, result=_TextResult, idempotent=True)
_stop: Final[Operation[[], None]] = Operation(
    "stop", arguments=_Nothing, result=_Nothing, idempotent=True, stop=True
)

GRIPPER: Final = Interface(
    "::test::Gripper",
    operations=(_close, _move, _positions, _text, _who, _stop),
    fingerprint="c0ffee0000000010",
)


class GripperPrx(ObjectPrx):
    ice_interface: ClassVar[Interface] = GRIPPER

    def close(self, force: float) -> float:
        return self.ice_invoke(_close, force)

    def closeAsync(self, force: float) -> Future[float]:
        return self.ice_invokeAsync(_close, force)

    def move(self, position: float) -> None:
        return self.ice_invoke(_move, position)

    def moveAsync(self, position: float) -> Future[None]:
        return self.ice_invokeAsync(_move, position)

    def positions(self) -> list[float]:
        return self.ice_invoke(_positions)

    def text(self, size: int) -> str:
        return self.ice_invoke(_text, size)

    def who(self) -> str:
        return self.ice_invoke(_who)

    def stop(self) -> None:
        return self.ice_invoke(_stop)


class Gripper(Object):
    ice_interface: ClassVar[Interface] = GRIPPER

    @abstractmethod
    def close(self, force: float, current: Current) -> Dispatched[float]: ...
    @abstractmethod
    def move(self, position: float, current: Current) -> None: ...
    @abstractmethod
    def positions(self, current: Current) -> list[float]: ...
    @abstractmethod
    def text(self, size: int, current: Current) -> str: ...
    @abstractmethod
    def who(self, current: Current) -> str: ...
    @abstractmethod
    def stop(self, current: Current) -> None: ...


class GripperI(Gripper):
    """Remembers where it was moved, and tells under what name it was called."""

    def __init__(self, name: str = "") -> None:
        self.name = name
        self.moved: list[float] = []
        self.texts = 0
        self.stopped = 0
        self.currents: list[Current] = []
        self.entered = threading.Semaphore(0)
        self.leave = threading.Event()
        self.leave.set()

    def close(self, force: float, current: Current) -> Dispatched[float]:
        if force < 0:
            raise Slipped(force)
        return 2 * force

    def move(self, position: float, current: Current) -> None:
        self.currents.append(current)
        self.entered.release()
        self.leave.wait()
        self.moved.append(position)

    def positions(self, current: Current) -> list[float]:
        return self.moved

    def text(self, size: int, current: Current) -> str:
        self.texts += 1
        return "x" * size

    def who(self, current: Current) -> str:
        self.currents.append(current)
        return f"{self.name}:{current.identity}"

    def stop(self, current: Current) -> None:
        self.stopped += 1
