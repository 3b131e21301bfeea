"""The services and topics of a T1 on DDS."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Annotated, Any, Final

import msgspec
from cyclonedds.qos import Policy, Qos
from cyclonedds.util import duration

from naoserver.protocol.jobs import JobThreads
from naoserver.protocol.robot import Robot
from naoserver.serving.assembly import Assembly
from visualhfsm_makers._booster._joints import Joints
from visualhfsm_makers._booster._loco import CODES, Loco
from visualhfsm_makers._booster._types import FallDownState, LowCmd, LowState, Odometer, RpcReqMsg, RpcRespMsg
from visualhfsm_makers._dds import NEWEST, Wire, Writer
from visualhfsm_makers._programs import Programs, Refusal

_LOW_PERIOD: Final = 0.002
_PERIOD: Final = 0.02
"""Wall seconds between two messages about the joints, and about the rest."""
_SILENT: Final = "rt/LocoApiOperationEvent"
"""Each client of the maker's newest package reads it, even if it calls nothing that has such events."""
CALLS: Final = Qos(
    Policy.Reliability.Reliable(duration(seconds=1)), Policy.Durability.Volatile, Policy.History.KeepLast(10)
)
"""As the maker's programs have it."""


class _Header(msgspec.Struct):
    api_id: Annotated[int, msgspec.Meta(ge=0, lt=2**31)]


@contextmanager
def serve(robot: Robot, assembly: Assembly, url: str) -> Iterator[str]:
    """Serve a robot in a `with` block, which gets the URL. Raises RobotError for a domain it cannot join."""
    programs = Programs(robot, assembly, "Booster", CODES)
    loco = Loco(programs)
    joints = Joints(programs, loco)

    def tell(topic: str, text: str, number: int) -> None:
        if topic != _SILENT:
            programs.warn(f"unserved {number}", text)

    with Wire(url, "Booster", programs.renew, programs.drop, programs.heard) as wire:
        wire.unserved = tell
        answers = wire.writer("rt/LocoApiTopicResp", RpcRespMsg, CALLS)
        wire.listen("rt/LocoApiTopicReq", RpcReqMsg, _answering(programs, loco, answers), CALLS)
        wire.listen("rt/joint_ctrl", LowCmd, joints.obey, NEWEST, raw=True)
        publications = [
            wire.publish("rt/low_state", LowState, _LOW_PERIOD, joints.state),
            wire.publish("rt/odometer_state", Odometer, _PERIOD, joints.odometer),
            wire.publish("rt/fall_down", FallDownState, _PERIOD, joints.fall),
        ]
        with JobThreads(publications):
            wire.start()
            yield url


def _answering(programs: Programs, loco: Loco, answers: Writer) -> Callable[[Any, str], None]:
    """Return what performs the calls of programs, and answers them."""

    def answer(call: Any, client: str) -> None:  # noqa: ANN401 - cyclonedds has no types
        try:
            number = programs.read(call.header, _Header).api_id
        except Refusal as refusal:
            code, result = programs.refused(refusal.code, str(refusal)), ""
        else:
            code, result = programs.answer(loco.operations, number, call.body, client)
        answers.send(RpcRespMsg(call.uuid, json.dumps({"status": code}), result or "{}"))

    return answer
