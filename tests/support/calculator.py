"""An interface as codegen would write it, with everything that the runtime has to carry."""

# ruff: noqa: N816 - as the IDL names it
from __future__ import annotations

from abc import abstractmethod
from concurrent.futures import Future
from typing import ClassVar, Final

from zenoh_ice.generated import (
    Current,
    Int,
    Interface,
    Object,
    ObjectPrx,
    Operation,
    Publisher,
    Struct,
    UserException,
    streamed,
)


class _Nothing(Struct):
    pass


class Reading(Struct):
    count: Int
    values: list[float]


class Node(Struct):
    value: Int
    next: Node | None


class CalculatorError(UserException):
    ice_type_id: ClassVar[str] = "::test::CalculatorError"

    class Members(Struct):
        what: str

    def __init__(self, what: str) -> None:
        super().__init__(what)
        self.what = what


class DivisionByZero(CalculatorError):
    ice_type_id: ClassVar[str] = "::test::DivisionByZero"

    class Members(CalculatorError.Members):
        dividend: float

    def __init__(self, what: str, dividend: float) -> None:
        super().__init__(what)
        self.dividend = dividend


class OtherError(UserException):
    ice_type_id: ClassVar[str] = "::test::OtherError"


class _Pair(Struct):
    a: float
    b: float


class _DoubleResult(Struct):
    returnValue: float


class _DivideResult(Struct):
    returnValue: float
    remainder: float


class _SplitArguments(Struct):
    values: list[float]


class _SplitResult(Struct):
    lower: list[float]
    upper: list[float]


class _TextArgument(Struct):
    text: str


class _SecondsArgument(Struct):
    seconds: float


class _IntResult(Struct):
    returnValue: Int


class _ReadingResult(Struct):
    returnValue: Reading


class _DataArgument(Struct):
    data: bytes


class _DataResult(Struct):
    returnValue: bytes


class _NodeArgument(Struct):
    head: Node


_add: Final[Operation[[float, float], float]] = Operation(
    "add", arguments=_Pair, result=_DoubleResult, idempotent=True
)
_divide: Final[Operation[[float, float], tuple[float, float]]] = Operation(
    "divide", arguments=_Pair, result=_DivideResult, exceptions=(CalculatorError,), idempotent=True
)
_split: Final[Operation[[list[float]], tuple[list[float], list[float]]]] = Operation(
    "split", arguments=_SplitArguments, result=_SplitResult
)
_fail: Final[Operation[[str], None]] = Operation(
    "fail", arguments=_TextArgument, result=_Nothing, exceptions=(CalculatorError,)
)
_sleep: Final[Operation[[float], None]] = Operation("sleep", arguments=_SecondsArgument, result=_Nothing)
_count: Final[Operation[[], int]] = Operation("count", arguments=_Nothing, result=_IntResult)
_total: Final[Operation[[Node], int]] = Operation("total", arguments=_NodeArgument, result=_IntResult)
_echo: Final[Operation[[bytes], bytes]] = Operation("echo", arguments=_DataArgument, result=_DataResult)
_who: Final[Operation[[], str]] = Operation(
    "who", arguments=_Nothing, result=type("_WhoResult", (Struct,), {"__annotations__": {"returnValue": str}})
)
_getReading: Final[Operation[[], Reading]] = Operation(
    "getReading", arguments=_Nothing, result=_ReadingResult, idempotent=True, streamed=True
)
_power: Final[Operation[[float, float], float]] = Operation("power", arguments=_Pair, result=_DoubleResult)

CALCULATOR: Final = Interface(
    "::test::Calculator",
    operations=(_add, _divide, _split, _fail, _sleep, _count, _total, _echo, _who, _getReading),
    fingerprint="c0ffee0000000001",
    module=__name__,
)
SCIENTIFIC: Final = Interface(
    "::test::Scientific",
    bases=(CALCULATOR,),
    operations=(_power,),
    fingerprint="c0ffee0000000002",
    module=__name__,
)
NEWER_CALCULATOR: Final = Interface(
    "::test::Calculator",
    operations=(_add,),
    fingerprint="c0ffee0000000003",
    module="tests.support.newer.calculator",
)


class CalculatorPrx(ObjectPrx):
    ice_interface: ClassVar[Interface] = CALCULATOR

    def add(self, a: float, b: float) -> float:
        return self.ice_invoke(_add, a, b)

    def addAsync(self, a: float, b: float) -> Future[float]:
        return self.ice_invokeAsync(_add, a, b)

    def divide(self, a: float, b: float) -> tuple[float, float]:
        return self.ice_invoke(_divide, a, b)

    def divideAsync(self, a: float, b: float) -> Future[tuple[float, float]]:
        return self.ice_invokeAsync(_divide, a, b)

    def split(self, values: list[float]) -> tuple[list[float], list[float]]:
        return self.ice_invoke(_split, values)

    def fail(self, text: str) -> None:
        return self.ice_invoke(_fail, text)

    def sleep(self, seconds: float) -> None:
        return self.ice_invoke(_sleep, seconds)

    def sleepAsync(self, seconds: float) -> Future[None]:
        return self.ice_invokeAsync(_sleep, seconds)

    def count(self) -> int:
        return self.ice_invoke(_count)

    def countAsync(self) -> Future[int]:
        return self.ice_invokeAsync(_count)

    def total(self, head: Node) -> int:
        return self.ice_invoke(_total, head)

    def echo(self, data: bytes) -> bytes:
        return self.ice_invoke(_echo, data)

    def echoAsync(self, data: bytes) -> Future[bytes]:
        return self.ice_invokeAsync(_echo, data)

    def who(self) -> str:
        return self.ice_invoke(_who)

    @streamed(_getReading)
    def getReading(self) -> Reading:
        """Return the newest reading."""
        return self.ice_invoke(_getReading)


class ScientificPrx(CalculatorPrx):
    ice_interface: ClassVar[Interface] = SCIENTIFIC

    def power(self, a: float, b: float) -> float:
        return self.ice_invoke(_power, a, b)


class NewerCalculatorPrx(ObjectPrx):
    ice_interface: ClassVar[Interface] = NEWER_CALCULATOR

    def add(self, a: float, b: float) -> float:
        return self.ice_invoke(_add, a, b)

    def addAsync(self, a: float, b: float) -> Future[float]:
        return self.ice_invokeAsync(_add, a, b)


class UnrelatedPrx(ObjectPrx):
    ice_interface: ClassVar[Interface] = Interface("::test::Unrelated", fingerprint="c0ffee0000000004")


class Calculator(Object):
    ice_interface: ClassVar[Interface] = CALCULATOR

    @abstractmethod
    def add(self, a: float, b: float, current: Current) -> float: ...
    @abstractmethod
    def divide(self, a: float, b: float, current: Current) -> tuple[float, float]: ...
    @abstractmethod
    def split(self, values: list[float], current: Current) -> tuple[list[float], list[float]]: ...
    @abstractmethod
    def fail(self, text: str, current: Current) -> None: ...
    @abstractmethod
    def sleep(self, seconds: float, current: Current) -> None: ...
    @abstractmethod
    def count(self, current: Current) -> int: ...
    @abstractmethod
    def total(self, head: Node, current: Current) -> int: ...
    @abstractmethod
    def echo(self, data: bytes, current: Current) -> bytes: ...
    @abstractmethod
    def who(self, current: Current) -> str: ...
    @abstractmethod
    def getReading(self, current: Current) -> Reading: ...

    @property
    def getReadingPublisher(self) -> Publisher[Reading]:
        return self.ice_publisher(_getReading)


class Scientific(Calculator):
    ice_interface: ClassVar[Interface] = SCIENTIFIC

    @abstractmethod
    def power(self, a: float, b: float, current: Current) -> float: ...
