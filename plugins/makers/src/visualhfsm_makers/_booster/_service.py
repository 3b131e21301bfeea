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
from visualhfsm_makers._booster._loco import CODES, REFUSED, Loco
from visualhfsm_makers._booster._types import FallDownState, LowCmd, LowState, Odometer, RpcReqMsg, RpcRespMsg
from visualhfsm_makers._dds import NEWEST, Wire, Writer
from visualhfsm_makers._programs import Programs, Refusal

_LOW_PERIOD: Final = 0.002
_PERIOD: Final = 0.02
"""Wall seconds between two messages about the joints, and about the rest."""
_CALLED: Final = "rt/LocoApiTopic"
"""The service of the walk; programs write to the topic `Req` of a service, and read its `Resp`."""
_REFUSED: Final = (
    *(f"rt/{name}ApiTopic" for name in ("Ai", "Camera", "HandEyeCalib", "LightControl", "Lui", "Vision")),
    "rt/X5CameraControl",
)
"""The maker's other services: a client of one without an answer waits for 5 s in each call."""
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
        for service in (_CALLED, *_REFUSED):
            answers = wire.writer(f"{service}Resp", RpcRespMsg, CALLS)
            answer = _answering(programs, loco if service == _CALLED else service, answers)
            wire.listen(f"{service}Req", RpcReqMsg, answer, CALLS)
        wire.listen("rt/joint_ctrl", LowCmd, joints.obey, NEWEST, raw=True)
        publications = [
            wire.publish("rt/low_state", LowState, _LOW_PERIOD, joints.state),
            wire.publish("rt/odometer_state", Odometer, _PERIOD, joints.odometer),
            wire.publish("rt/fall_down", FallDownState, _PERIOD, joints.fall),
        ]
        with JobThreads(publications):
            wire.start()
            yield url


def _answering(programs: Programs, service: Loco | str, answers: Writer) -> Callable[[Any, str], None]:
    """Return what performs the calls of the walk, or refuses those of another service, and answers them."""

    def answer(call: Any, client: str) -> None:  # noqa: ANN401 - cyclonedds has no types
        try:
            if isinstance(service, str):
                raise Refusal(REFUSED, f"the simulation has no service {service}")
            number = programs.read(call.header, _Header).api_id
        except Refusal as refusal:
            code, result = programs.refused(refusal.code, str(refusal)), ""
        else:
            code, result = programs.answer(service.operations, number, call.body, client)
        answers.send(RpcRespMsg(call.uuid, json.dumps({"status": code}), result or "{}"))

    return answer
