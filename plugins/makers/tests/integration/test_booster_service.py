"""The service and topics of a T1 on DDS, with cyclonedds and, where it is installed, the maker's own package."""

from __future__ import annotations

import random
import signal
import struct
from functools import partial
from importlib.util import find_spec
from itertools import islice

import psutil
import pytest

from naoserver.errors import RobotError
from plugins.makers.tests.integration.test_maker_services import T1, served
from plugins.makers.tests.support.dds import free_domain
from tests.support.present import present
from tests.support.processes import REPOSITORY, ComponentProcess, module
from tests.support.soak import repeated
from tests.support.waiting import until
from visualhfsm_makers import BOOSTER

pytest.importorskip("cyclonedds", reason="the extra booster is not installed")
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from plugins.makers.tests.support.booster import ELBOW, Program
from visualhfsm_makers._booster import _types

DOMAIN = free_domain()
t1 = partial(served, T1, DOMAIN)
LONG = "600"
"""Seconds in which DDS alone would notice that a program was killed."""
NO_SDK = pytest.mark.skipif(
    find_spec("booster_robotics_sdk_python") is None, reason="the maker's package is not installed"
)


def test_a_call_is_answered():
    with t1():
        assert Program(DOMAIN).ask(2017) == (0, {"mode": 2})


def test_a_call_without_an_operation_is_refused():
    with t1():
        program = Program(DOMAIN)
        for header in ("", "{}", "[" * 4000, '{"api_id": -1}', '{"api_id": "2001"}'):
            assert program.send(header, "{}") == (400, {}), header[:20]


@pytest.mark.parametrize("service", ["rt/LightControlApiTopic", "rt/X5CameraControl"])
def test_the_calls_of_services_that_are_not_served_are_refused_at_once(service):
    with t1() as (_robot, assembly):
        assert Program(DOMAIN, service).call(2000, {"r": 255, "g": 0, "b": 0}) == 501
        assert f"the simulation has no service {service}" in assembly.events.snapshot()[0][-1].message


def test_a_program_that_hangs_while_it_sends_walks_no_further(monkeypatch):
    monkeypatch.setattr("visualhfsm_makers._programs._LEAST_TIME", 0.0)
    flood = ComponentProcess(module("plugins.makers.tests.support.booster", str(DOMAIN), "flood", LONG))
    with t1() as (robot, assembly), flood as program:
        program.wait_for("answered 0")
        until(lambda: robot.read().positions[ELBOW] > 0.4)
        program.process.send_signal(signal.SIGSTOP)
        until(lambda: robot.walker.commanded().forward == 0.0)
        assert any("sent regularly" in each.message for each in assembly.events.snapshot()[0])
        program.process.kill()


def test_a_topic_that_is_not_served_is_an_event_unless_every_client_reads_it():
    with t1() as (_robot, assembly):
        program = Program(DOMAIN)
        of = program.participant
        names = ("rt/LocoApiOperationEvent", "rt/battery_state")
        kept = [DataReader(of, Topic(of, name, _types.RpcRespMsg)) for name in names]

        def said():
            return [each.message for each in assembly.events.snapshot()[0]]

        until(
            lambda: any("rt/battery_state, which a program reads, is not served" in each for each in said())
        )
        assert not any("LocoApiOperationEvent" in each for each in said())
        del kept


def test_low_states_are_in_the_order_of_the_joints():
    with t1() as (robot, _assembly):
        robot.place({"Left_Elbow_Pitch": 0.3})
        state = next(Program(DOMAIN).read("rt/low_state", _types.LowState))
    assert len(state.motor_state_serial) == len(state.motor_state_parallel) == len(robot.joints)
    assert state.motor_state_serial[ELBOW].q == pytest.approx(0.3)
    assert state.imu_state.acc == pytest.approx([0.0, 0.0, 9.81])


def test_odometry_and_falls_are_there():
    with t1():
        program = Program(DOMAIN)
        program.call(2031, {"x": 1.0, "y": 2.0, "theta": 0.5})
        place = next(islice(program.read("rt/odometer_state", _types.Odometer), 1, None))
        fall = next(program.read("rt/fall_down", _types.FallDownState))
    assert (place.x, place.y, place.theta) == pytest.approx((1.0, 2.0, 0.5))
    assert (fall.fall_down_state, fall.is_recovery_available) == (0, False)


def test_hostile_messages_move_nothing_and_take_no_memory():
    draw = random.Random(55)
    with t1() as (robot, _assembly):
        program = Program(DOMAIN)
        calls, low = program.writer("rt/LocoApiTopicReq", _types.RpcReqMsg), None
        low = program.writer("rt/joint_ctrl", _types.LowCmd)
        before = psutil.Process().memory_info().rss
        for _ in range(repeated(300, soak=10_000)):
            text = draw.randbytes(draw.randrange(200)).decode("latin-1").replace("\0", "")
            calls.write(_types.RpcReqMsg(text, draw.choice([text, '{"api_id": 2001}']), text))
            numbers = [struct.unpack("<f", draw.randbytes(4))[0] for _ in range(6)]
            low.write(_types.LowCmd(1, [_types.MotorCmd(0, *numbers)] * draw.randrange(60)))
        assert program.ask(2017) == (0, {"mode": 2})
        assert psutil.Process().memory_info().rss - before < 20e6
        assert robot.walker.commanded().forward == 0.0


def test_a_domain_that_is_none():
    with pytest.raises(RobotError, match="dds:233 is no domain of DDS"), t1() as (robot, assembly):
        present(BOOSTER.serve)(robot, assembly, {"dds_domain": 233}).__enter__()


@NO_SDK
def test_the_makers_own_package_calls_reads_and_commands():
    sdk = ComponentProcess(module("plugins.makers.tests.support.booster_sdk", str(DOMAIN), "calls"))
    with t1() as (robot, _assembly), sdk as program:
        robot.place({robot.joints[3].name: -0.75})
        program.wait_for(
            r"statuses \[0, 0, 0, 501, 0, 409\] state \[-0.75, 9.81\] place \[0\.\d+, 0.0, 0.0\]"
        )
        until(lambda: robot.read().positions[ELBOW] == pytest.approx(0.5, abs=0.02))
        program.process.kill()


@NO_SDK
@pytest.mark.skipif(find_spec("booster_robotics_sdk") is not None, reason="that package reads no profile")
def test_a_program_of_the_makers_package_that_names_no_interface_takes_the_profile_of_the_page(tmp_path):
    page = (REPOSITORY / "docs" / "reference" / "booster.md").read_text("utf-8")
    profile = tmp_path / "loopback.xml"
    profile.write_text(page.split("```xml\n")[1].split("```")[0])
    command = module("plugins.makers.tests.support.booster_sdk", str(DOMAIN), "walk", "")
    with t1(), ComponentProcess(command, {"FASTRTPS_DEFAULT_PROFILES_FILE": str(profile)}) as program:
        program.wait_for("walks")
        program.process.kill()


@NO_SDK
def test_a_killed_program_of_the_makers_package_walks_no_further():
    with t1() as (robot, _assembly):
        for _ in range(repeated(1, soak=100)):
            with ComponentProcess(
                module("plugins.makers.tests.support.booster_sdk", str(DOMAIN), "walk")
            ) as program:
                program.wait_for("walks")
                assert robot.walker.commanded().forward > 0.0
                program.process.kill()
                until(lambda: robot.walker.commanded().forward == 0.0)
