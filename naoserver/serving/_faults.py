"""Servant of what fails in a simulation and in a fake robot."""

from __future__ import annotations

from typing import Final

from interfaces import nao
from naoserver.bodies.faults import Fault
from naoserver.protocol.faults import Faults
from naoserver.safety._gate import Gate
from naoserver.serving._shared import StateStream, refusals_raised, require_finite
from zenoh_ice import Current
from zenoh_ice.data.text import sentence


class FaultsI(nao.Faults):
    """Let parts of the robot fail, report which do, and note each in the events of its health."""

    def __init__(self, faults: Faults, gate: Gate) -> None:
        self._faults: Final = faults
        self._gate: Final = gate
        self.stream: Final = StateStream(
            self._state, self.getFaultsPublisher, lambda state: state, news=lambda state: state.faults
        )

    def getKinds(self, current: Current) -> nao.FaultKindsByPart:
        return {
            part: [nao.FaultKind(*kind) for kind in kinds]
            for part, kinds in self._faults.kinds.items()
            if kinds
        }

    def getFaults(self, current: Current) -> nao.FaultState:
        return self.stream.now()

    def inject(
        self, part: str, kind: str, amount: float | None, seconds: float | None, current: Current
    ) -> nao.Fault:
        require_finite(amount=amount or 0.0, seconds=seconds or 0.0)
        with refusals_raised():
            self._gate.require(current.client, begun=True)
            fault = self._faults.inject(part, kind, amount, seconds)
        message = sentence(f"made to fail: {fault.kind}")
        self._gate.events.add(nao.Severity.Warning, fault.part, message, message)
        return _fault(fault)

    def heal(self, part: str | None, current: Current) -> None:
        with refusals_raised():
            self._faults.heal(part)

    def _state(self) -> nao.FaultState:
        present = self._faults.current().values()
        return nao.FaultState(time=self._faults.now(), faults=[_fault(fault) for fault in present])


def _fault(fault: Fault) -> nao.Fault:
    return nao.Fault(part=fault.part, kind=fault.kind, amount=fault.amount, end=fault.end)
