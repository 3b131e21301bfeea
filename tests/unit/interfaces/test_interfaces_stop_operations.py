"""Every command can be stopped, by the operation marked with ["stop"], and declares that it may be refused."""

import importlib
import pkgutil
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

import interfaces
from interfaces.jderobot import CommandRefusedException, Motors, Pose3DMotors, Pose3DMotorsData
from interfaces.nao import Joints, Motions, PoseHead, Postures, Sounds, Speech, Walk
from naoserver.fake import FakeRobot
from naoserver.options import SafetyOptions, ServerOptions
from naoserver.serving.assembly import Assembly
from tests.support.present import present
from zenoh_ice import Object, VirtualClock
from zenoh_ice.data.interface import Interface, Operation

MOVES_NOTHING = {
    "::jderobot::Camera": "takes images; others may be watching when a component ends",
    "::jderobot::ArDroneExtra": "no robot of ours has it; whether a drone should land is for its pilot",
    "::jderobot::Pose3D": "no robot of ours has it; saying where a robot is moves nothing",
    "::nao::Faults": "lets parts of a simulation fail until somebody heals them; no behavior asks for it",
    "::nao::Leds": "a light moves nothing, a fade ends by itself, and the last color shows how it ended",
    "::nao::Safety": "refuses commands, and stops the robot itself",
    "::nao::Scene": "sets the stage of a simulation; a push and a press end by themselves",
    "::nao::Team": "says something and moves nothing; a role that is not claimed again ends within a second",
    "::hfsm::HfsmMonitor": "steers a component, which stops what it has commanded when it ends",
}
"""The interfaces that change something and need no stop, each with the reason."""

_DATA = Pose3DMotorsData.__struct_fields__


def _defined() -> dict[str, Interface]:
    """Return every interface of the project by its type id."""
    found = {}
    for package in pkgutil.walk_packages(interfaces.__path__, "interfaces."):
        for value in vars(importlib.import_module(package.name)).values():
            if isinstance(value, type) and issubclass(value, Object) and value is not Object:
                found[value.ice_interface.type_id] = value.ice_interface
    return found


INTERFACES = _defined()


def only_reads(operation: Operation[..., Any]) -> bool:
    """Return whether an operation commands nothing, as far as its declaration shows."""
    return operation.idempotent and bool(operation.result.fields) and operation.name.startswith("get")


@pytest.mark.parametrize("type_id", INTERFACES)
def test_an_interface_that_commands_something_has_a_stop_or_a_reason_for_none(type_id):
    interface = INTERFACES[type_id]
    commands = [name for name, each in interface.all_operations.items() if not only_reads(each)]
    stoppable = bool(interface.stop_operations)
    assert stoppable + (type_id in MOVES_NOTHING) == bool(commands), (
        f"{type_id} has {commands}: mark the operation that stops it with "
        '["stop"] in the IDL, or add it to MOVES_NOTHING with the reason'
    )


# -- what a robot that is stopped, held by others or lost refuses ---------------------------------------------

NEVER_REFUSED = {
    "::jderobot::Camera": "takes images; a lost robot's fail",
    "::nao::Scene": "sets the stage of a simulation, except for its push",
    "::hfsm::HfsmMonitor": "steers a component, which is no robot",
}
"""The interfaces with operations that neither a stop, nor a lease, nor a loss concerns, each with the reason."""


@pytest.mark.parametrize("type_id", sorted(INTERFACES.keys() - NEVER_REFUSED.keys()))
def test_every_command_declares_that_the_robot_may_refuse_it(type_id):
    operations = INTERFACES[type_id].all_operations.values()
    commands = [each for each in operations if not each.idempotent]
    undeclared = [each.name for each in commands if CommandRefusedException not in each.exceptions]
    assert not undeclared, f"{type_id}: add CommandRefusedException to what {undeclared} throws in the IDL"


def test_no_reason_is_left_of_an_interface_that_is_gone():
    assert MOVES_NOTHING.keys() | NEVER_REFUSED.keys() <= INTERFACES.keys()


# -- what the servers of a robot do --------------------------------------------------------------------------


class Rig:
    """A robot without physics with its servants, in virtual time; a velocity lasts."""

    def __init__(self) -> None:
        self.clock = VirtualClock()
        self.robot = FakeRobot(self.clock)
        options = SafetyOptions(velocity_timeout=60.0)
        served = ServerOptions(safety=options, mechanism_safety=options)
        self.assembly = Assembly(self.robot, served, self.clock)

    def live(self, seconds: float) -> None:
        """Let some time pass."""
        for _ in range(round(seconds / 0.02)):
            self.clock.advance(0.02)
            self.assembly.player.tick()
            if self.assembly.walk_to is not None:
                self.assembly.walk_to.tick()
            for watched in self.assembly.watched:
                watched.watch()

    def is_busy(self) -> bool:
        """Return whether a joint's setpoint moves, or the robot walks or is heard, in the next 0.2 s."""
        devices = (self.robot, *self.robot.mechanisms)
        before = [device.read().commands for device in devices]
        self.live(0.2)
        moved = [device.read().commands for device in devices] != before
        heard = (
            present(self.robot.voice).utterance().speaking,
            present(self.robot.loudspeaker).playback().playing,
        )
        return moved or present(self.robot.walker).walking or any(heard)


def _move_hinge(servant: Pose3DMotors, current: Any) -> None:
    """Send each axis to the limit that is farther away, slowly; of the neck in speed the speed counts."""
    now, limits = servant.getPose3DMotorsData(current), servant.getPose3DMotorsParams(current)
    data = dict.fromkeys(_DATA, 0.0) | {"panSpeed": 0.05, "tiltSpeed": 0.05}
    for axis in ("x", "y", "z", "pan", "tilt", "roll"):
        lower, upper = (getattr(limits, side + axis.capitalize()) for side in ("min", "max"))
        data[axis] = lower if getattr(now, axis) > (lower + upper) / 2 else upper
    servant.setPose3DMotorsData(Pose3DMotorsData(**data), current)


COMMANDS: dict[type[Object], Callable[[Any, Any], object]] = {
    Joints: lambda body, current: body.setJointPositions({"LShoulderPitch": -1.0}, 0.05, current),
    Motions: lambda motions, current: motions.play("wave", 1.0, current),
    Motors: lambda walk, current: walk.setV(0.05, current),
    Pose3DMotors: _move_hinge,
    PoseHead: lambda head, current: head.setPose(1.0, 0.1, 0.05, current),
    Postures: lambda postures, current: postures.goToPosture("Crouch", 0.1, current),
    Sounds: lambda sounds, current: sounds.playTone(440.0, 5.0, 0.0, current),
    Speech: lambda voice, current: voice.say("This takes quite some time to be said. " * 20, current),
    Walk: lambda walk, current: walk.walkTo(5.0, 0.0, 0.0, current),
}
"""How each actuating interface lets something move for a while."""

STOPPABLE = [
    identity for identity, servant in Rig().assembly.servants.items() if servant.ice_interface.stop_operations
]


@pytest.mark.parametrize("identity", STOPPABLE)
def test_a_servant_that_is_stopped_moves_nothing_any_more(identity):
    rig = Rig()
    servant = rig.assembly.servants[identity]
    (begin,) = (COMMANDS[kind] for kind in type(servant).__mro__ if kind in COMMANDS)
    begin(servant, SimpleNamespace(client="a component"))
    rig.live(0.1)
    assert rig.is_busy()
    for operation in servant.ice_interface.stop_operations:
        getattr(servant, operation.method)(SimpleNamespace(client="a component"))
    rig.live(0.04)
    assert not rig.is_busy()


def test_every_hinge_ball_and_neck_can_be_stopped():
    assert {"LeftShoulderMotors", "RightHandMotors", "NeckSpeed", "BallRedMotors"} <= set(STOPPABLE)
