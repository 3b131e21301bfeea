"""A working calculator that misbehaves on request."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING

from tests.support.calculator import CalculatorError, DivisionByZero, Node, OtherError, Reading, Scientific
from zenoh_ice import Current
from zenoh_ice.objects._servant import ServedObject

if TYPE_CHECKING:
    import pytest  # the processes of servers do not need it


class Mute(Exception):
    """Cannot even say what went wrong."""

    def __str__(self) -> str:
        raise ValueError("no text")


class CalculatorI(Scientific):
    """Neither calls the constructor of its base: servants need not."""

    def __init__(self) -> None:
        self.counted = 0
        self.running = 0
        self.most_running = 0
        self.entered = threading.Event()
        self.leave = threading.Event()
        self.lock = threading.Lock()

    def add(self, a: float, b: float, current: Current) -> float:
        return a + b

    def divide(self, a: float, b: float, current: Current) -> tuple[float, float]:
        if b == 0:
            raise DivisionByZero("the divisor is 0", a)
        return a // b, a % b

    def split(self, values: list[float], current: Current) -> tuple[list[float], list[float]]:
        middle = len(values) // 2
        return values[:middle], values[middle:]

    def fail(self, text: str, current: Current) -> None:
        class Unheard(CalculatorError):
            ice_type_id = "::test::Unheard"

        match text:
            case "declared":
                raise CalculatorError("as declared")
            case "derived":
                raise DivisionByZero("derived", 2.5)
            case "unheard":
                error = Unheard("of a class that the client does not know")
                # The client shares our process here: let its search for known subclasses miss this one.
                Unheard.ice_type_id = "::test::Unheard"
                raise error
            case "undeclared":
                raise OtherError
            case "exit":
                raise SystemExit(3)
            case "cancelled":
                from asyncio import CancelledError  # which takes long to import, too

                raise CancelledError
            case "generator":
                raise GeneratorExit
            case "mute":
                raise Mute
            case _:
                raise RuntimeError(text)

    def sleep(self, seconds: float, current: Current) -> None:
        """Let others in, and stay until `leave` or for some seconds."""
        with self.lock:
            self.running += 1
            self.most_running = max(self.most_running, self.running)
        self.entered.set()
        self.leave.wait(seconds)
        with self.lock:
            self.running -= 1

    def count(self, current: Current) -> int:
        self.counted += 1
        return self.counted

    def total(self, head: Node, current: Current) -> int:
        node: Node | None = head
        total = 0
        while node is not None:
            total += node.value
            node = node.next
        return total

    def echo(self, data: bytes, current: Current) -> bytes:
        return data

    def who(self, current: Current) -> str:
        return current.client

    def getReading(self, current: Current) -> Reading:
        return Reading(self.counted, [float(self.counted)])

    def power(self, a: float, b: float, current: Current) -> float:
        result: float = a**b
        return result


def drains(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Return a list that notes for each withdrawn servant how many s its running calls are waited for."""
    noted: list[float] = []
    drain = ServedObject.drain

    def noting(served: ServedObject, deadline: float) -> None:
        noted.append(max(0.0, deadline - time.monotonic()))
        drain(served, deadline)

    monkeypatch.setattr(ServedObject, "drain", noting)
    return noted
