"""Turn the head of a Nao from side to side.

Start a robot first, `naoserver-sim`, then `python examples/turn_head.py`.
"""

from __future__ import annotations

import sys

from interfaces.nao import PoseHeadPrx
from zenoh_ice import ZenohIceError, initialize

SIDES = (0.6, -0.6, 0.0)  # rad, positive to the left
FRACTION = 0.3  # of the head's full speed
LIMIT = 5.0  # s


def main() -> None:
    """Turn to each side and wait until the head is there."""
    with initialize() as communicator:
        head = PoseHeadPrx.checkedCast(communicator.stringToProxy("Head"))
        for pan in SIDES:
            head.setPose(pan, 0.0, FRACTION)
            started = communicator.clock.now()
            for sample in head.getPose.samples(timeout=1.0):  # the newest pose, as often as it changes
                if abs(sample.value.pan - pan) < 0.02:
                    print(f"at {sample.value.pan:+.2f} rad after {communicator.clock.now() - started:.1f} s")
                    break
                if communicator.clock.now() - started > LIMIT:
                    print(f"still at {sample.value.pan:+.2f} rad after {LIMIT:g} s")
                    break


if __name__ == "__main__":
    try:
        main()
    except ZenohIceError as error:  # it says what is missing and what to do
        sys.exit(str(error))
    except KeyboardInterrupt:
        sys.exit(130)
