"""Serve a robot: its servants on an adapter, and the threads that stream and watch."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Annotated

import typer

from interfaces.nao import SafetyPrx
from naoserver.options import ServerOptions
from naoserver.protocol.jobs import JobThreads
from naoserver.protocol.robot import Robot
from naoserver.safety.latch import Latch
from naoserver.serving.assembly import Assembly
from naoserver.serving.medium import Membership, StreamMedium
from zenoh_ice import BusyException, Communicator, ObjectAdapter, SystemException, WallClock

_CAP = (
    "Cap every joint's speed at a fraction of its full speed."
    " Without it: full speed, less by the rules of its body, as for a Nao's arms while its legs are straight."
)
JointSpeed = Annotated[float | None, typer.Option(min=0.05, max=1.0, metavar="FRACTION", help=_CAP)]
"""The option of the robot servers for `naoserver.options.capped`."""

ResumeAfterReset = Annotated[
    bool,
    typer.Option(
        "--resume-after-reset",
        help="Let all that an emergency stop paused or refused go on after each reset, without a person.",
    ),
]
"""The option of the robot servers for `ServerOptions.resume_after_reset`."""

TeamName = Annotated[
    str,
    typer.Option(
        "--team",
        metavar="NAME",
        help="Hear the other robots of a team, and agree with them on who does what.",
    ),
]
"""The option of the robot servers for `ServerOptions.team`."""


@contextmanager
def serve(
    robot: Robot, adapter: ObjectAdapter, options: ServerOptions | None = None, *, latch: Latch | None = None
) -> Iterator[Assembly]:
    """Serve a started robot on an adapter in a `with` block, whose end stops motion and threads.

    Yields the assembly between the robot and its clients: other interfaces use its guards too. The
    caller activates the adapter, and closes the robot afterwards. With a `latch`, which is open, the robot is
    stopped at first if it was when the former server ended, or if that one ended without warning.
    Raises RobotError for options that the robot does not support.
    """
    options = options or ServerOptions()
    communicator = adapter.getCommunicator()
    with ExitStack() as steps:  # all run, the last first, whatever they raise
        medium = StreamMedium(communicator.transport) if options.team else None
        if medium is not None:
            steps.callback(medium.close)
        member = Membership(communicator.realm, options.team, medium)
        assembly = Assembly(robot, options, WallClock(), latch, member=member)
        threads = JobThreads(assembly.jobs, options.limits)
        assembly.on_wake, assembly.hanging = threads.wake, threads.hanging
        served: list[str] = []
        steps.callback(threads.close)
        clients = communicator.onClientLost(assembly.drop_client)
        steps.callback(clients.close)
        assembly.gate.is_lost = clients.is_lost
        steps.callback(adapter.removeAll, served)
        steps.callback(assembly.close)
        steps.callback(threads.stop)
        for identity, servant in assembly.servants.items():
            adapter.add(servant, identity)
            served.append(identity)
        if assembly.link is not None:
            assembly.link.impair = adapter.impair
        threads.start()
        yield assembly


def problem_of(communicator: Communicator, assembly: Assembly) -> str:
    """Return what keeps a served robot from working, or nothing; takes at most the limit of an answer, 5 s.

    Its jobs must get on, and a call must be answered, which goes through Zenoh, the pool and the servant that
    stops the robot.
    """
    if hanging := assembly.hanging():
        return f"{', '.join(hanging)} hangs"
    if assembly.link is not None and assembly.link.loses_calls:
        return ""  # ours would be lost, too
    limit = assembly.options.limits.answer
    safety = SafetyPrx.uncheckedCast(communicator.stringToProxy("Safety"))
    try:
        # Not called at once: a call within the process would not pass through Zenoh.
        safety.getSafetyState.begin().result(limit)
    except BusyException:
        return ""  # an answer, too
    except TimeoutError:  # as no thread is left for the answer, either
        return f"a call to the servant Safety was not answered within {limit:g} s"
    except SystemException as error:
        return f"a call to the servant Safety failed: {error}"
    return ""
