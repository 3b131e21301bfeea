"""The services and topics of a G1 on DDS."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from itertools import count
from typing import Any, Final

from naoserver.bodies.capabilities import BatteryReading
from naoserver.protocol.jobs import Job, JobThreads
from naoserver.protocol.robot import Robot
from naoserver.serving.assembly import Assembly
from visualhfsm_makers._dds import NEWEST, Wire, Writer
from visualhfsm_makers._programs import Operation, Programs
from visualhfsm_makers._unitree import _skills, _types
from visualhfsm_makers._unitree._arms import Arms
from visualhfsm_makers._unitree._joints import PERIOD, SOURCE, Joints
from visualhfsm_makers._unitree._loco import CODES, Loco

_INSTEAD: Final = {
    "rt/bmsstate": "rt/lf/bmsstate",
    "rt/lf/odommodestate": "rt/odommodestate",
    "rt/lf/sportmodestate": "rt/odommodestate",
    "rt/sportmodestate": "rt/odommodestate",
    "rt/user_lowcmd": "rt/lowcmd",
}
"""Topics that are served, for others of the maker's that are not."""
_BATTERY: Final = struct.Struct("<84xI8xi2B12h38x")
"""Voltage, current, charge, health and temperatures, among members that are 0."""
_SLOW_PERIOD: Final = 0.05
"""Wall seconds between two states of low frequency."""


@contextmanager
def serve(robot: Robot, assembly: Assembly, url: str) -> Iterator[str]:
    """Serve a robot in a `with` block, which gets the URL. Raises RobotError for a domain it cannot join."""
    programs = Programs(robot, assembly, SOURCE, CODES)
    loco, modes, streams = Loco(programs).operations, _skills.ModeSwitch(programs), _skills.Streams(programs)
    services = {
        "loco": loco,  # under both names, by which versions of the maker's program look for it
        "sport": loco,
        "arm": _skills.arm(programs),
        "voice": {**_skills.voice(programs), **streams.operations},
        "motion_switcher": modes.operations,
    }
    joints = Joints(programs, lambda: modes.walks)

    def tell(topic: str, text: str, number: int) -> None:
        hint = f": use {_INSTEAD[topic]}" if topic in _INSTEAD else ""
        programs.warn(f"unserved {number}", text + hint)

    with Wire(url, SOURCE, programs.renew, programs.drop, programs.heard) as wire:
        wire.unserved = tell
        for name, operations in services.items():
            writer = wire.writer(f"rt/api/{name}/response", _types.Response)
            answer = _answering(programs, operations, writer, streams)
            wire.listen(f"rt/api/{name}/request", _types.Request, answer)
        wire.listen("rt/lowcmd", _types.LowCmd, joints.obey, NEWEST, raw=True)
        wire.listen("rt/arm_sdk", _types.LowCmd, Arms(programs).obey, NEWEST, raw=True)
        with JobThreads(_publications(wire, robot, joints)):
            wire.start()
            yield url


def _answering(
    programs: Programs, operations: Mapping[int, Operation], writer: Writer, streams: _skills.Streams
) -> Callable[[Any, str], None]:
    """Return what performs the calls of a service, and answers them."""

    def answer(request: Any, client: str) -> None:  # noqa: ANN401 - cyclonedds has no types
        identity, streams.samples = request.header.identity, bytes(request.binary)
        code, data = programs.answer(operations, identity.api_id, request.parameter, client)
        if not request.header.policy.noreply:
            writer.send(_types.Response(_types.ResponseHeader(identity, _types.Status(code)), data, []))

    return answer


def _publications(wire: Wire, robot: Robot, joints: Joints) -> list[Job]:
    """Return the jobs that publish topics."""
    slow = round(1000.0 * _SLOW_PERIOD)
    ticks = count(slow, slow)
    return [
        wire.publish("rt/lowstate", _types.LowState, PERIOD, joints.state),
        wire.publish("rt/lf/lowstate", _types.LowState, _SLOW_PERIOD, lambda: joints.state(ticks)),
        wire.publish("rt/odommodestate", _types.SportModeState, PERIOD, joints.place),
        wire.publish("rt/lf/bmsstate", _types.BmsState, _SLOW_PERIOD, lambda: _battery(robot)),
    ]


def _battery(robot: Robot) -> bytes:
    """Return the state of the battery, in mV, mA and degrees Celsius."""
    facts, now = robot.body.battery, BatteryReading() if robot.senses is None else robot.senses.read().battery
    charge, warmth = (0.0 if math.isnan(each) else each for each in (now.charge, now.temperature))
    volts = facts.voltage if facts else 0.0
    values = (1000.0 * volts, 1000.0 * now.current, 100.0 * charge, 100, *[warmth] * 12)
    return _BATTERY.pack(*map(round, values))
