"""STOP: a robot is stopped until it confirms that it is, and says that it is still."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Future
from typing import Any, Final

import msgspec

from codegen.messages import NO_MESSAGE, Message
from codegen.reasons import reason
from interfaces.jderobot import MotorsPrx
from interfaces.nao import JointsPrx, PoseHeadPrx
from visualhfsm._monitor.messages import USUAL_LIMITS, PartLimits
from zenoh_ice import Communicator, ObjectPrx, TimeoutException, ZenohIceError
from zenoh_ice.application.emergency_stop import SAFETY, RobotStop, begin_stop
from zenoh_ice.data.text import sentence

_STOP_PERIOD: Final = 0.1
"""Wall seconds between two stops."""
_REASON: Final = sentence("STOP was pressed in the editor")
_BODY: Final = "Body"


class StopReport(msgspec.Struct, frozen=True, rename="camel"):
    """The result of stopping the robot: the servants that have stopped, and why the others have not."""

    stopped: list[str]
    failed: dict[str, Message]


Outcomes = dict[str, Message]
"""Why each servant has not stopped, by identity; empty for one that has."""

_STOPS: Final[Mapping[str, Callable[[ObjectPrx], Future[Any]]]] = {
    "Head": lambda proxy: PoseHeadPrx.uncheckedCast(proxy).stop.begin(),
    _BODY: lambda proxy: JointsPrx.uncheckedCast(proxy).stop.begin(),
    "Motors": lambda proxy: MotorsPrx.uncheckedCast(proxy).stop.begin(),
}


async def stop_robot(
    communicator: Communicator, begun: float, limits: PartLimits = USUAL_LIMITS
) -> StopReport:
    """Stop a robot, again and again until it confirms its emergency stop and its joints are still.

    A robot without an emergency stop has to confirm everything else. The report says what was not confirmed
    8 s after the moment `begun` of the event loop, or goes on moving; it is blank if there is no robot. Until
    `reset_robot` the robot refuses commands.
    """
    loop = asyncio.get_running_loop()
    robot = RobotStop()
    outcomes: Outcomes = {}
    while outcomes := await stop_once(communicator, limits, outcomes):
        if not (outcomes[SAFETY] if SAFETY in outcomes else any(outcomes.values())):
            robot.confirm()
        if robot.confirmed:
            velocities = await _velocities(communicator, limits) if _BODY in outcomes else []
            robot.observe(velocities, None, limits.standstill, answered=velocities is not None)
            if robot.over:
                if robot.moving and robot.speed is not None:
                    outcomes[_BODY] = Message(
                        "its joints still move, the fastest at {speed:.1f} rad/s: look at the robot",
                        speed=robot.speed,
                    )
                break
        elif loop.time() - begun >= limits.stop_repetition:
            outcomes = {
                identity: why
                and Message("{why} (STOP was repeated for {time:g} s)", why=why, time=limits.stop_repetition)
                for identity, why in outcomes.items()
            }
            break
        await asyncio.sleep(_STOP_PERIOD)
    # As long as the emergency stop is latched, that is published with `RobotMonitor.stop_reason`.
    stopped = [identity for identity, why in outcomes.items() if not why]
    return StopReport(
        [identity for identity in stopped if identity != SAFETY] or stopped,
        {identity: why for identity, why in outcomes.items() if why},
    )


async def stop_once(communicator: Communicator, limits: PartLimits, known: Iterable[str] = ()) -> Outcomes:
    """Stop a robot by its emergency stop, the head, the joints and the walk, all at once.

    Takes a second at most. Missing servants are skipped unless they are `known` from before.
    """
    present = {*communicator.identities(), *known}
    # The emergency stop is sent even if no robot is known: under a flood of tokens its own may be late.
    emergency_stop = begin_stop(communicator, _REASON, communicator.settings.timeout)
    answers: dict[str, asyncio.Future[Any]] = {SAFETY: asyncio.wrap_future(emergency_stop)}
    outcomes: Outcomes = {}
    for identity in sorted(present & _STOPS.keys()):
        try:
            answers[identity] = asyncio.wrap_future(_STOPS[identity](communicator.stringToProxy(identity)))
        except ZenohIceError as error:
            outcomes[identity] = reason(error)
    await asyncio.wait(answers.values(), timeout=limits.stop_answer)
    for identity, answer in answers.items():
        if not answer.done():
            answer.cancel()
            outcomes[identity] = Message(
                "it did not confirm within {time:g} s that it has stopped", time=limits.stop_answer
            )
        else:
            failure = answer.exception()
            outcomes[identity] = NO_MESSAGE if failure is None else reason(failure)
    if outcomes[SAFETY] and SAFETY not in present:
        del outcomes[SAFETY]
    return outcomes


async def _velocities(communicator: Communicator, limits: PartLimits) -> list[float] | None:
    """Return the velocities of the joints in rad/s, none if the robot cannot say them; None if it is late."""
    body = JointsPrx.uncheckedCast(communicator.stringToProxy(_BODY))
    try:
        async with asyncio.timeout(limits.stop_answer):
            return (await asyncio.wrap_future(body.getJointState.begin())).velocities
    except (TimeoutError, TimeoutException):
        return None
    except ZenohIceError:
        return []
