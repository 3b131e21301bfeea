"""Faults of a robot's own hardware: motion ends, each is said with its joint, and nothing goes on by itself.

The robot is the one that `visualhfsm new --hardware` makes, its server a process of its own.
"""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import pytest

from interfaces.jderobot import CommandRefusedException, InvalidValueException
from interfaces.nao import HealthPrx, JointsPrx, SafetyPrx, Severity
from naoserver.hardware.sim_bus import SimBus
from tests.support.limits import CALL_LIMIT, MOVE_LIMIT, START_LIMIT
from tests.support.places import ROOT
from tests.support.processes import STEADY, ComponentProcess, free_endpoint, module
from tests.support.soak import cases
from tests.support.waiting import until
from zenoh_ice import Communicator, ZenohIceError, initialize

SERVER: Final = ROOT / "visualhfsm/_commands/template_hardware/server.py"
JOINTS: Final = ("pan", "tilt", "shoulder", "elbow")
REALM: Final = "own"
FRACTION: Final = 0.1
SPEED: Final = 0.4
"""Speed of the pan joint at that fraction in rad/s."""
FAR: Final = 1.4
"""Where it is on its way to in rad, while something fails."""
REST: Final = 0.6
"""Seconds for which a joint that stands has not moved: longer than a server waits for answers."""


@dataclass
class Rig:
    """A served robot on a bus, and a client of it; `bus` is None where that is a process of its own."""

    path: Path
    bus: Any
    endpoint: str
    state: Path
    server: ComponentProcess
    body: JointsPrx
    health: HealthPrx
    safety: SafetyPrx
    since: float = 0.0
    """The robot time from which on its events count, in s."""

    def starting(self) -> ComponentProcess:
        """Return another server of the same robot."""
        return serving(self.path, self.endpoint, self.state)

    def at(self, joint: str) -> float:
        state = self.body.getJointState()
        return state.positions[JOINTS.index(joint)]

    def says(self, text: str, source: str = "") -> bool:
        events = [event for event in self.health.getHealth().events if event.time >= self.since]
        return any(text in event.message and source in (event.source, "") for event in events)

    def wait_for(self, text: str, source: str = "") -> None:
        until(lambda: self.says(text, source), MOVE_LIMIT)

    def bring_back(self) -> None:
        """End every fault, hold all joints at 0, and forget the events until now."""
        self.bus.command("clear")
        until(lambda: not is_lost(self), MOVE_LIMIT)
        self.body.setStiffnesses(dict.fromkeys(JOINTS, 1.0), 0.0)
        until(lambda: min(self.body.getJointState().stiffnesses) > 0.5, MOVE_LIMIT)
        self.body.setJointPositions(dict.fromkeys(JOINTS, 0.0), 1.0)
        until(lambda: max(map(abs, places(self.bus))) < 0.02, MOVE_LIMIT)
        self.since = self.body.getJointState().time

    def move(self, joint: str, target: float) -> None:
        """Send a joint to a target, and wait until it has moved there."""
        self.body.setJointPositions({joint: target}, 1.0)
        until(lambda: abs(self.at(joint) - target) < 0.02, MOVE_LIMIT)


def serving(bus: Path, endpoint: str, state: Path) -> ComponentProcess:
    command = [sys.executable, str(SERVER), "--bus", str(bus), "--start", "stiffen", "--realm", REALM]
    environment = {**STEADY, "PYTHONPATH": str(ROOT), "XDG_STATE_HOME": str(state)}
    return ComponentProcess([*command, "--listen", endpoint], environment)


@contextmanager
def connected(endpoint: str) -> Iterator[Communicator]:
    with initialize(
        realm=REALM, connect=[endpoint], listen=["tcp/127.0.0.1:0"], timeout=CALL_LIMIT, lease=CALL_LIMIT
    ) as communicator:
        yield communicator


@contextmanager
def rig_at(path: Path, state: Path, bus: SimBus | None = None) -> Iterator[Rig]:
    endpoint = free_endpoint()
    with serving(path, endpoint, state) as server:
        server.wait_for("^ready")
        with connected(endpoint) as communicator:

            def find(kind, identity):
                return kind.checkedCast(communicator.stringToProxy(identity))

            body, health, safety = (
                find(JointsPrx, "Body"),
                find(HealthPrx, "Health"),
                find(SafetyPrx, "Safety"),
            )
            until(lambda: min(body.getJointState().stiffnesses) > 0.5, MOVE_LIMIT)
            yield Rig(path, bus, endpoint, state, server, body, health, safety)


@contextmanager
def rig_in(folder: Path) -> Iterator[Rig]:
    with closing(SimBus(len(JOINTS), folder / "tty")) as bus, rig_at(bus.path, folder / "state", bus) as rig:
        yield rig


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rig]:
    with rig_in(tmp_path_factory.mktemp("shared")) as rig:
        yield rig


@pytest.fixture(params=cases([1], range(2, 21)))
def rig(shared: Rig) -> Rig:
    """The robot of all tests after which its server goes on, at rest and without faults."""
    shared.bring_back()
    return shared


@pytest.fixture(params=cases([1], range(2, 21)))
def own_rig(tmp_path: Path) -> Iterator[Rig]:
    """A robot for a test that its server does not outlive."""
    with rig_in(tmp_path) as rig:
        yield rig


def places(bus: SimBus) -> list[float]:
    """Return where the servos of a bus are, whatever its server says."""
    return [float(word) for word in bus.command("where").split()[1:]]


@contextmanager
def ends_motion(rig: Rig) -> Iterator[None]:
    """Let something fail while the pan joint moves: it stands still within the way of 0.2 s."""
    rig.body.setJointPositions({"pan": FAR}, FRACTION)
    until(lambda: places(rig.bus)[0] > 0.1, MOVE_LIMIT)
    yield
    failed = seen = places(rig.bus)[0]
    since = time.monotonic()

    def rests() -> bool:
        nonlocal seen, since
        now, place = time.monotonic(), places(rig.bus)[0]
        if place != seen:
            seen, since = place, now
        return now - since > REST

    until(rests, MOVE_LIMIT)
    assert seen - failed < SPEED * 0.2


def is_lost(rig: Rig) -> bool:
    return bool(rig.safety.getSafetyState().lost)


def test_a_pulled_cable_ends_motion_is_said_and_nothing_goes_on_when_it_is_plugged_in(rig: Rig) -> None:
    with ends_motion(rig):
        rig.bus.command("unplug")
    rig.wait_for("lost the robot: Input/output error")
    with pytest.raises(CommandRefusedException, match="unreachable"):
        rig.body.setJointPositions({"tilt": 0.2}, 1.0)
    assert is_lost(rig)
    stood = places(rig.bus)
    rig.bus.command("plug")
    rig.wait_for("found the robot again")
    until(lambda: not is_lost(rig))
    rig.move("tilt", 0.2)
    assert places(rig.bus)[0] == pytest.approx(stood[0], abs=0.01), "its old goal is forgotten"


def test_answers_that_are_late_by_a_second_end_motion_and_are_said(rig: Rig) -> None:
    with ends_motion(rig):
        rig.bus.command("late 1.0")
    rig.wait_for("lost the robot: no servo has answered for 0.5 s")
    rig.bus.command("clear")
    rig.wait_for("found the robot again")
    rig.move("tilt", 0.2)


def test_a_servo_that_is_stuck_is_said_with_its_joint_and_the_others_go_on(rig: Rig) -> None:
    rig.bus.command("stuck 4")
    rig.body.setJointPositions({"elbow": -1.0}, 1.0)
    rig.wait_for("does not follow: 1.00 rad behind for 1.", "elbow")
    rig.move("pan", 0.3)
    rig.bus.command("clear")
    rig.wait_for("follows again", "elbow")


def test_an_overload_is_said_with_its_joint_and_the_others_go_on(rig: Rig) -> None:
    rig.bus.command("overload 4")
    rig.wait_for("overload: its torque is off", "elbow")
    until(lambda: rig.body.getJointState().stiffnesses[3] == 0.0)
    rig.move("pan", 0.3)
    rig.bus.command("clear")
    rig.wait_for("no fault any more", "elbow")
    rig.body.setStiffnesses({"elbow": 1.0}, 0.0)
    rig.move("elbow", -0.5)


def test_a_servo_lost_from_the_bus_is_refused_by_name_until_it_is_found_and_the_others_go_on(
    rig: Rig,
) -> None:
    rig.body.setJointPositions({"elbow": -1.9}, FRACTION)
    rig.bus.command("lose 4")
    rig.wait_for("lost: its servo does not answer", "elbow")
    with pytest.raises(InvalidValueException, match="elbow is not reached: lost") as refused:
        rig.body.setJointPositions({"pan": 0.1, "elbow": -0.5}, 1.0)
    assert refused.value.field == "elbow"
    rig.move("pan", 0.3)
    rig.bus.command("clear")
    rig.wait_for("found again", "elbow")
    stood = places(rig.bus)[3]
    rig.move("tilt", 0.2)
    assert places(rig.bus)[3] == pytest.approx(stood, abs=0.01), "its old goal is forgotten"
    rig.move("elbow", -0.5)


def test_a_server_that_is_killed_leaves_no_servo_on_its_way_and_the_next_one_starts_stopped(
    own_rig: Rig,
) -> None:
    with ends_motion(own_rig):
        own_rig.server.process.kill()
        own_rig.server.wait()
    stood = places(own_rig.bus)
    with own_rig.starting() as server:
        server.wait_for("the robot is still stopped: it stays as it is")
        server.wait_for("^ready")
        with connected(own_rig.endpoint) as communicator:
            safety = SafetyPrx.checkedCast(communicator.stringToProxy("Safety"))
            assert "ended without warning" in safety.getSafetyState().reason
        assert places(own_rig.bus) == pytest.approx(stood, abs=0.01)


def test_a_server_that_hangs_leaves_no_servo_on_its_way(own_rig: Rig) -> None:
    with ends_motion(own_rig):
        own_rig.server.freeze()
    own_rig.server.process.send_signal(signal.SIGCONT)
    until(lambda: answers(own_rig), START_LIMIT)


def answers(rig: Rig) -> bool:
    with suppress(ZenohIceError):
        return bool(rig.body.getJointNames())
    return False


CLIENT: Final = f"""
import threading
from interfaces.nao import JointsPrx
from zenoh_ice import initialize
with initialize() as communicator:
    JointsPrx.checkedCast(communicator.stringToProxy("Body")).setJointPositions({{"pan": {FAR}}}, {FRACTION})
    print("sent")
    threading.Event().wait()
"""


def test_what_a_killed_client_moves_is_held_and_said_with_its_joint(rig: Rig) -> None:
    environment = {
        "PYTHONPATH": str(ROOT),
        "VISUALHFSM_REALM": REALM,
        "VISUALHFSM_CONNECT": rig.endpoint,
    }
    with ComponentProcess([sys.executable, "-c", CLIENT], environment) as client:
        client.wait_for("sent")
        until(lambda: places(rig.bus)[0] > 0.1, MOVE_LIMIT)
        client.process.kill()
        rig.wait_for("stopped pan: the client that commanded it is gone")
    assert places(rig.bus)[0] < FAR


def test_a_driver_that_is_killed_is_said_and_the_next_one_is_found_limp(tmp_path: Path) -> None:
    path = tmp_path / "tty"
    driver = module("naoserver.hardware.sim_bus", str(path))
    environment = {"PYTHONPATH": str(ROOT)}
    with ComponentProcess(driver, environment) as first:
        first.wait_for("^ready")
        with rig_at(path, tmp_path / "state") as rig:
            rig.move("pan", 0.3)
            first.process.kill()
            rig.wait_for("lost the robot")
            assert is_lost(rig)
            with ComponentProcess(driver, environment):
                rig.wait_for("found the robot again")
                until(lambda: max(rig.body.getJointState().stiffnesses) == 0.0)
                assert rig.says("found the robot again")
                assert rig.health.getHealth().events[-1].level is not Severity.Error
