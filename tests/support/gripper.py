"""An interface as codegen would write it, with what tests of calls need."""

# mypy: disable-error-code="empty-body"
from __future__ import annotations

import threading
from typing import Final

from zenoh_ice import generated as ice
from zenoh_ice.generated import Current

__all__ = ["GRIPPER", "Gripper", "GripperI", "GripperPrx", "Slipped"]


class Slipped(ice.UserException, id="::test::Slipped"):
    force: float = 0.0


class GripperPrx(ice.ObjectPrx, id="::test::Gripper", fingerprint="c0ffee0000000010"):
    @ice.operation(throws=(Slipped,))
    def close(self, force: float) -> float: ...

    @ice.operation()
    def move(self, position: float) -> None: ...

    @ice.operation(idempotent=True)
    def positions(self) -> list[float]: ...

    @ice.operation()
    def text(self, size: int) -> str: ...

    @ice.operation(idempotent=True)
    def who(self) -> str: ...

    @ice.operation(idempotent=True, stop=True)
    def stop(self) -> None: ...


GRIPPER: Final = GripperPrx.ice_interface
GRIPPER.module = ""  # it has no schema


class Gripper(ice.Object, proxy=GripperPrx):
    @ice.abstractmethod
    def close(self, force: float, current: Current) -> float: ...
    @ice.abstractmethod
    def move(self, position: float, current: Current) -> None: ...
    @ice.abstractmethod
    def positions(self, current: Current) -> list[float]: ...
    @ice.abstractmethod
    def text(self, size: int, current: Current) -> str: ...
    @ice.abstractmethod
    def who(self, current: Current) -> str: ...
    @ice.abstractmethod
    def stop(self, current: Current) -> None: ...


class GripperI(Gripper):
    """Remembers where it was moved, and returns the name under which it was called."""

    def __init__(self, name: str = "") -> None:
        self.name = name
        self.moved: list[float] = []
        self.texts = 0
        self.stopped = 0
        self.currents: list[Current] = []
        self.entered = threading.Semaphore(0)
        self.leave = threading.Event()
        self.leave.set()

    def close(self, force: float, current: Current) -> float:
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
