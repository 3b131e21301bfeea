"""Show angles of some joints of a Nao, twice a second, until Ctrl-C.

Start a robot first, `naoserver-sim`, then `python examples/watch_joints.py HeadYaw HeadPitch`.
"""

from __future__ import annotations

import sys

from interfaces.nao import JointsPrx
from zenoh_ice import ZenohIceError, initialize

PERIOD = 0.5  # s of the robot's time


def main(*wanted: str) -> None:
    """Follow the stream of the joints' states."""
    with initialize() as communicator:
        body = JointsPrx.checkedCast(communicator.stringToProxy("Body"))
        names = body.getJointNames()
        if unknown := set(wanted) - set(names):
            sys.exit(f"there is no joint {', '.join(sorted(unknown))}; there are {', '.join(names)}")
        columns = [names.index(name) for name in wanted or ("HeadYaw", "HeadPitch")]
        while True:
            state = body.getJointState.wait(timeout=2.0).value
            angles = "  ".join(f"{names[i]} {state.positions[i]:+.3f} rad" for i in columns)
            print(f"{state.time:8.2f} s  {angles}", flush=True)
            communicator.clock.sleep(PERIOD)


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except ZenohIceError as error:  # it says what is missing and what to do
        sys.exit(str(error))
    except KeyboardInterrupt:
        sys.exit(130)
