"""Serve the lamp of interfaces/lamp.idl: `python lamp.py`."""

from __future__ import annotations

from interfaces.home import Lamp

from zenoh_ice import Current, initialize


class LampI(Lamp):
    """A lamp that prints whether it is on."""

    def __init__(self) -> None:
        self.on = False

    def setOn(self, on: bool, current: Current) -> None:
        """Switch it on or off."""
        self.on = on
        print("on" if on else "off", flush=True)
        self.isOnPublisher.publish(on)

    def isOn(self, current: Current) -> bool:
        """Return whether it is on."""
        return self.on


def main() -> None:
    """Serve until Ctrl-C."""
    with initialize() as communicator:
        adapter = communicator.createObjectAdapter("Home")
        adapter.add(LampI(), "Lamp")
        adapter.activate()
        print("ready", flush=True)
        communicator.waitForShutdown()


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        pass
