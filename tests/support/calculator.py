"""An interface as codegen would generate it, with everything that the runtime must support."""

# mypy: disable-error-code="empty-body"
from __future__ import annotations

from typing import Final

from zenoh_ice import generated as ice


class Reading(ice.Struct):
    count: ice.Int = 0
    values: list[float] = []  # noqa: RUF012


class Node(ice.Struct):
    value: ice.Int
    next: Node | None


class CalculatorError(ice.UserException, id="::test::CalculatorError"):
    what: str = ""


class DivisionByZero(CalculatorError, id="::test::DivisionByZero"):
    dividend: float = 0.0


class OtherError(ice.UserException, id="::test::OtherError"):
    pass


class CalculatorPrx(ice.ObjectPrx, id="::test::Calculator", fingerprint="c0ffee0000000001"):
    @ice.operation(idempotent=True)
    def add(self, a: float, b: float) -> float: ...

    @ice.operation(throws=(CalculatorError,), results=("returnValue", "remainder"), idempotent=True)
    def divide(self, a: float, b: float) -> tuple[float, float]: ...

    @ice.operation(results=("lower", "upper"))
    def split(self, values: list[float]) -> tuple[list[float], list[float]]: ...

    @ice.operation(throws=(CalculatorError,))
    def fail(self, text: str) -> None: ...

    @ice.operation()
    def sleep(self, seconds: float) -> None: ...

    @ice.operation()
    def count(self) -> ice.Int: ...

    @ice.operation()
    def total(self, head: Node) -> ice.Int: ...

    @ice.operation()
    def echo(self, data: bytes) -> bytes: ...

    @ice.operation()
    def who(self) -> str: ...

    @ice.stream(idempotent=True)
    def getReading(self) -> Reading:
        """Return the newest reading."""


class ScientificPrx(CalculatorPrx, id="::test::Scientific", fingerprint="c0ffee0000000002"):
    @ice.operation()
    def power(self, a: float, b: float) -> float: ...


class NewerCalculatorPrx(ice.ObjectPrx, id="::test::Calculator", fingerprint="c0ffee0000000003"):
    @ice.operation(idempotent=True)
    def add(self, a: float, b: float) -> float: ...


class UnrelatedPrx(ice.ObjectPrx, id="::test::Unrelated", fingerprint="c0ffee0000000004"):
    pass


CALCULATOR: Final = CalculatorPrx.ice_interface
SCIENTIFIC: Final = ScientificPrx.ice_interface
NEWER_CALCULATOR: Final = NewerCalculatorPrx.ice_interface
NEWER_CALCULATOR.module = "tests.support.newer.calculator"  # beside which its schema lies


class Calculator(ice.Object, proxy=CalculatorPrx):
    getReadingPublisher = ice.publisher(CalculatorPrx.getReading)

    @ice.abstractmethod
    def add(self, a: float, b: float, current: ice.Current) -> float: ...
    @ice.abstractmethod
    def divide(self, a: float, b: float, current: ice.Current) -> tuple[float, float]: ...
    @ice.abstractmethod
    def split(self, values: list[float], current: ice.Current) -> tuple[list[float], list[float]]: ...
    @ice.abstractmethod
    def fail(self, text: str, current: ice.Current) -> None: ...
    @ice.abstractmethod
    def sleep(self, seconds: float, current: ice.Current) -> None: ...
    @ice.abstractmethod
    def count(self, current: ice.Current) -> int: ...
    @ice.abstractmethod
    def total(self, head: Node, current: ice.Current) -> int: ...
    @ice.abstractmethod
    def echo(self, data: bytes, current: ice.Current) -> bytes: ...
    @ice.abstractmethod
    def who(self, current: ice.Current) -> str: ...
    @ice.abstractmethod
    def getReading(self, current: ice.Current) -> Reading: ...


class Scientific(Calculator, proxy=ScientificPrx):
    @ice.abstractmethod
    def power(self, a: float, b: float, current: ice.Current) -> float: ...
