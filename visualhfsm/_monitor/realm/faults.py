"""What of the robot can fail, and what fails now, as a simulation or a fake robot serves it.

Any process may serve any names, so all of them are checked.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Final

import msgspec

from codegen.messages import Message
from hfsm_runtime.recording_file.messages import Fault
from interfaces import nao
from visualhfsm._base.recognition import recognized
from visualhfsm._monitor.realm.realm import Newest, PolledValue
from zenoh_ice import Communicator
from zenoh_ice.data.text import printable

FAULTS: Final = "Faults"
"""The identity of the servant; no real robot has it."""
_MOST_PARTS: Final = 1000
_MOST_KINDS: Final = 50
"""Of a part."""
_CALL_LIMIT: Final = 1000  # ms
_LONGEST_NAME: Final = 64
_LONGEST_TEXT: Final = 200


class FailureKind(msgspec.Struct, frozen=True):
    """A way to fail; the numbers are in its unit, which is empty for a kind without an amount."""

    name: str
    text: Message
    unit: str
    least: float
    greatest: float
    usual: float


class AlikeParts(msgspec.Struct, frozen=True):
    """Parts that can fail in the same ways."""

    parts: list[str]
    kinds: list[FailureKind]


class Failing(msgspec.Struct, frozen=True):
    """What can fail and what fails now: nothing where no `Faults` is served."""

    can: Sequence[AlikeParts] = ()
    now: Sequence[Fault] = ()


NOTHING: Final = Failing()


class FaultMonitor:
    """Listen to the `Faults` of a realm; `update` it a few times a second."""

    def __init__(self, communicator: Communicator) -> None:
        self._communicator = communicator
        proxy = nao.FaultsPrx.uncheckedCast(communicator.stringToProxy(FAULTS))
        self._kinds = PolledValue(proxy.getKinds.begin)
        self._state = Newest(proxy.getFaults.latest)
        self._known: nao.FaultKindsByPart | None = None
        self._can: Sequence[AlikeParts] = ()

    def update(self) -> None:
        """Ask what can fail of a robot that has appeared; forget that of one that has left."""
        if FAULTS not in self._communicator.identities():
            self._kinds.forget()
            self._state.forget()
        elif (kinds := self._kinds.poll()) is not None and kinds is not self._known:
            self._known, self._can = kinds, alike(kinds)

    def failing(self) -> Failing:
        """Return what can fail and what fails now, without waiting."""
        return NOTHING if self._kinds.value is None else Failing(self._can, self.now())

    def now(self) -> tuple[Fault, ...]:
        """Return what fails now, as far as is known, without waiting."""
        state = self._state()
        return () if state is None else sound_faults(state.value.faults)


def failing_now(communicator: Communicator) -> tuple[Fault, ...]:
    """Ask what fails now: nothing where no `Faults` is served. Raises ZenohIceError."""
    if FAULTS not in communicator.identities():
        return ()
    faults = nao.FaultsPrx.uncheckedCast(communicator.stringToProxy(FAULTS))
    return sound_faults(faults.ice_invocationTimeout(_CALL_LIMIT).getFaults().faults)


def alike(kinds: Mapping[str, Sequence[nao.FaultKind]]) -> list[AlikeParts]:
    """Return what can fail, parts that fail in the same ways together; what is not sound is left out."""
    found: dict[tuple[FailureKind, ...], list[str]] = {}
    for part, each in list(kinds.items())[:_MOST_PARTS]:
        ways = tuple(_sound_kinds(each[:_MOST_KINDS]))
        if ways and _is_name(part):
            found.setdefault(ways, []).append(part)
    return [AlikeParts(parts, list(ways)) for ways, parts in found.items()]


def _sound_kinds(kinds: Sequence[nao.FaultKind]) -> Iterator[FailureKind]:
    for kind in kinds:
        numbers = (kind.least, kind.greatest, kind.usual)
        if _is_name(kind.name) and all(map(math.isfinite, numbers)):
            text = recognized(printable(kind.text, _LONGEST_TEXT))
            yield FailureKind(kind.name, text, printable(kind.unit, _LONGEST_NAME), *numbers)


def sound_faults(faults: Sequence[Fault] | Sequence[nao.Fault]) -> tuple[Fault, ...]:
    """Return failures with names of parts and kinds, and amounts that are numbers."""
    return tuple(
        Fault(it.part, it.kind, it.amount)
        for it in faults[:_MOST_PARTS]
        if _is_name(it.part) and _is_name(it.kind) and math.isfinite(it.amount)
    )


def _is_name(text: str) -> bool:
    return bool(text) and printable(text, _LONGEST_NAME) == text
