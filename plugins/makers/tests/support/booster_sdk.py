"""A program for the maker's own package, either of the two:

    python -m plugins.makers.tests.support.booster_sdk DOMAIN calls|walk [INTERFACE]

It says what each call was answered, and what it read; then it commands the left elbow until it is killed.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterable
from typing import Any, Final

import booster_robotics_sdk_python as sdk

from tests.support.limits import EVENT_LIMIT, FOREVER

OPEN: Final = getattr(sdk, "HandAction", None) or sdk.B1HandAction
CALLS: Final[list[tuple[str, tuple[Any, ...]]]] = [
    ("Move", (0.1, 0.0, 0.0)),
    ("RotateHead", (0.1, 0.2)),
    ("WaveHand", (OPEN.kHandOpen,)),
    ("LieDown", ()),
    ("ChangeMode", (sdk.RobotMode.kPrepare,)),
    ("Move", (0.1, 0.0, 0.0)),
]


def status(client: Any, name: str, *arguments: Any) -> int:
    """Call; return the status: one package raises it in a message, the other returns it."""
    try:
        return int(getattr(client, name)(*arguments) or 0)
    except RuntimeError as error:
        return int(str(error).rpartition("=")[2])


def connected() -> Any:
    """Return a client whose calls are answered."""
    client = sdk.B1LocoClient()
    client.Init()
    deadline = time.monotonic() + EVENT_LIMIT
    while status(client, *CALLS[0][:1], *CALLS[0][1]) == 100:
        assert time.monotonic() < deadline, "no call is answered"
    return client


def main() -> None:
    sdk.ChannelFactory.Instance().Init(int(sys.argv[1]), *(sys.argv[3:] or ["127.0.0.1"]))
    client = connected()
    if sys.argv[2] == "walk":
        sys.stdout.write("walks\n")
        threading.Event().wait(FOREVER)
    statuses = [status(client, name, *arguments) for name, arguments in CALLS]
    state = first(
        sdk.B1LowStateSubscriber, lambda each: (each.motor_state_serial[3].q, each.imu_state.acc[2])
    )
    place = first(sdk.B1OdometerStateSubscriber, lambda each: (each.x, each.y, each.theta))
    sys.stdout.write(f"statuses {statuses} state {rounded(state)} place {rounded(place)}\n")
    if fall := getattr(sdk, "B1FallDownStateSubscriber", None):
        assert first(fall, lambda each: (int(each.fall_down_state.value), each.is_recovery_available)) == (
            0,
            0,
        )
    status(client, "ChangeMode", sdk.RobotMode.kCustom)
    publisher, command = sdk.B1LowCmdPublisher(), sdk.LowCmd()
    publisher.InitChannel()
    motors = [sdk.MotorCmd() for _ in range(23)]
    motors[4].q, motors[4].kp, motors[4].kd, motors[4].weight = 0.5, 50.0, 2.0, 1.0
    command.cmd_type, command.motor_cmd = sdk.LowCmdType.SERIAL, motors
    while True:
        publisher.Write(command)
        time.sleep(0.02)


def first(subscriber: Any, of: Callable[[Any], Any]) -> Any:
    """Return what the first message of a topic has: later, it is no longer valid."""
    read, found = threading.Event(), []

    def take(message: Any) -> None:
        found.append(of(message))
        read.set()

    channel = subscriber(take)
    channel.InitChannel()
    assert read.wait(EVENT_LIMIT), f"nothing is read by {subscriber.__name__}"
    channel.CloseChannel()
    return found[0]


def rounded(values: Iterable[float]) -> list[float]:
    return [round(value, 2) for value in values]


if __name__ == "__main__":
    main()
