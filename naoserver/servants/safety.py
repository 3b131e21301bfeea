"""Servant of the gate in front of every command: emergency stop and lease."""

from __future__ import annotations

from interfaces.nao import Safety, SafetyState
from naoserver.gate import Gate
from naoserver.servants.shared import refusals_raised
from zenoh_ice import Current


class SafetyI(Safety):
    """Stop the robot for everybody, or hold it for one client."""

    ice_concurrent = True  # a stop waits for nobody

    def __init__(self, gate: Gate) -> None:
        self._gate = gate

    def emergencyStop(self, reason: str, current: Current) -> None:
        """Stop all that moves and refuse every command until resetEmergencyStop."""
        try:
            self._gate.stop(reason)
        finally:
            self.publish()

    def resetEmergencyStop(self, current: Current) -> None:
        """Accept commands again."""
        self._gate.reset()
        self.publish()

    def acquireLease(self, holder: str, seconds: float, current: Current) -> None:
        """Hold the robot for the caller, or renew.

        Raises CommandRefusedException while another client holds it, InvalidValueException.
        """
        with refusals_raised():
            self._gate.acquire(current.client, holder, seconds)
        self.publish()

    def releaseLease(self, current: Current) -> None:
        """Give the caller's lease back."""
        if self._gate.release(current.client):
            self.publish()

    def getSafetyState(self, current: Current) -> SafetyState:
        """Return who may command the robot."""
        return self._gate.state()

    def publish(self) -> None:
        """Publish who may command the robot."""
        if self.getSafetyStatePublisher.listening:
            state = self._gate.state()
            self.getSafetyStatePublisher.publish(state, time=state.time)

    def drop_client(self, client: str) -> None:
        """Give the lease of a lost client back."""
        if self._gate.release(client):
            self.publish()
