"""The services and topics of a G1 on DDS, with cyclonedds and, where it is installed, the maker's own package."""

from __future__ import annotations

import importlib
import random
from functools import partial
from itertools import islice, pairwise

import psutil
import pytest

from plugins.makers.tests.integration.test_maker_services import G1, follows, served
from plugins.makers.tests.support.dds import free_domain
from tests.support.processes import ComponentProcess, module
from tests.support.soak import repeated
from tests.support.waiting import until

pytest.importorskip("cyclonedds", reason="the extra unitree is not installed")
from cyclonedds._clayer import ddspy_write
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from plugins.makers.tests.support.unitree import CONTINUOUS, ELBOW, Program, Wiretap, low_command
from visualhfsm_makers._unitree import _types

DOMAIN = free_domain()
g1 = partial(served, G1, DOMAIN)
GROWTH = 32 << 20
"""Bytes by which a process may seem to grow whose memory does not."""
LEASE = "60"
"""Seconds in which DDS itself would notice that a program was killed: longer than a test waits."""


def test_a_call_is_answered_under_both_names():
    with g1():
        for service in ("loco", "sport"):
            answer = Program(DOMAIN, service).call(1)
            assert (answer.header.status.code, answer.data) == (0, "1.0.0.0"), service


def test_each_other_service_says_its_version():
    versions = {"arm": "1.0.0.14", "voice": "1.0.0.0", "motion_switcher": "1.0.0.1"}
    with g1():
        assert {service: Program(DOMAIN, service).call(1).data for service in versions} == versions


def test_a_stream_of_sound_arrives_with_its_samples():
    """The maker's g1_audio_client_play_wav.py sends chunks of 96000 bytes."""
    sent = random.Random(1).randbytes(96_000)
    with g1() as (robot, _assembly):
        program = Program(DOMAIN, "voice")
        assert program.call(1003, '{"app_name": "example", "stream_id": "1"}', sent).header.status.code == 0
        until(lambda: robot.loudspeaker.playback().samples)
        now = robot.loudspeaker.playback()
        assert now.samples == sent[2 * now.place :][: len(now.samples)]
        program.call(1004, '{"app_name": "example"}')
        assert not robot.loudspeaker.playback().playing


def test_arms_of_a_killed_program_go_back_while_the_walk_of_another_goes_on():
    killed = ComponentProcess(module("plugins.makers.tests.support.unitree", str(DOMAIN), "arms", LEASE))
    with g1() as (robot, assembly), killed as program:
        before = robot.read().positions[ELBOW]
        until(lambda: robot.read().positions[ELBOW] == pytest.approx(1.0, abs=0.02))
        other = Program(DOMAIN)
        assert other.call(7105, CONTINUOUS).header.status.code == 0
        program.process.kill()
        until(lambda: not follows(assembly, robot.joints[ELBOW].name))
        until(lambda: robot.read().positions[ELBOW] == pytest.approx(before, abs=0.02))
        assert robot.walker.commanded().forward > 0.0


def test_what_a_program_uses_in_vain_is_an_event():
    with g1() as (_robot, assembly):
        program = Program(DOMAIN)

        def told(text):
            return [event.message for event in assembly.events.snapshot()[0]].count(text) == 1

        made = [
            DataWriter(program.participant, Topic(program.participant, "rt/dex3/left/cmd", _types.LowCmd)),
            DataReader(
                program.participant, Topic(program.participant, "rt/sportmodestate", _types.SportModeState)
            ),
        ]
        until(lambda: told("rt/dex3/left/cmd, which a program writes, is not served"))
        until(lambda: told("rt/sportmodestate, which a program reads, is not served: use rt/odommodestate"))
        del made


def test_a_program_is_the_same_at_each_door():
    with g1() as (_robot, assembly):
        program = Program(DOMAIN)
        low, command = program.writer("rt/lowcmd", _types.LowCmd), low_command(ELBOW, 0.5)
        assembly.gate.stop("a test")
        until(lambda: low.write(command) or "stopped: a test" in assembly.events.snapshot()[0][-1].message)
        assembly.gate.reset()
        assert program.call(7105, CONTINUOUS).header.status.code == 7301
        assert Program(DOMAIN).call(7105, CONTINUOUS).header.status.code == 0


def test_states_arrive_in_their_order():
    with g1():
        states = list(islice(Program(DOMAIN).read("rt/lowstate", _types.LowState), 50))
    ticks = [state.tick for state in states]
    assert ticks == sorted(ticks)


def test_states_of_low_frequency_are_numbered_by_their_own_time():
    with g1() as (robot, _assembly):
        program = Program(DOMAIN)
        fast = program.read("rt/lowstate", _types.LowState)
        next(fast)
        slow = list(islice(program.read("rt/lf/lowstate", _types.LowState), 3))
        steps = [two.tick - one.tick for one, two in pairwise(slow)]
        assert all(step >= 50 and step % 50 == 0 for step in steps)
        assert slow[-1].motor_state[ELBOW].q == pytest.approx(robot.read().positions[ELBOW])


def test_the_battery_and_the_odometry_are_there():
    with g1() as (robot, _assembly):
        program = Program(DOMAIN)
        battery = next(program.read("rt/lf/bmsstate", _types.BmsState))
        place = next(program.read("rt/odommodestate", _types.SportModeState))
        assert battery.soc == round(100 * robot.senses.read().battery.charge)
    assert place.position[:2] == [0.0, 0.0]


@pytest.mark.parametrize(
    ("package", "kind"),
    [
        ("api", _types.Request),
        ("api", _types.Response),
        ("go", _types.SportModeState),
        ("hg", _types.BmsState),
        ("hg", _types.LowCmd),
        ("hg", _types.LowState),
    ],
    ids=lambda each: getattr(each, "__name__", each),
)
def test_the_types_are_those_of_the_makers_package(package, kind):
    theirs = f"unitree_sdk2py.idl.unitree_{package}.msg.dds_"
    pytest.importorskip(theirs, reason="the maker's package is not installed")
    made = getattr(importlib.import_module(theirs), kind.__idl_typename__.rpartition(".")[2])
    assert kind.__idl__.get_type_info() == made.__idl__.get_type_info()


def test_the_checksums_are_those_of_the_makers_package():
    package = "unitree_sdk2py.idl.unitree_hg.msg.dds_"
    theirs = pytest.importorskip(package, reason="the maker's package is not installed")
    maker = importlib.import_module("unitree_sdk2py.utils.crc").CRC()
    command = low_command(ELBOW, 0.3)
    with g1():
        state = next(Program(DOMAIN).read("rt/lowstate", _types.LowState))
    for message, kind in ((command, theirs.LowCmd_), (state, theirs.LowState_)):
        own = kind.deserialize(message.serialize(use_version_2=False))
        assert maker.Crc(own) == message.crc


def test_hostile_messages_end_nothing_and_move_nothing_beyond_its_range():
    draw, process = random.Random(55), psutil.Process()
    with g1() as (robot, _assembly), Wiretap(DOMAIN) as tap:
        program = Program(DOMAIN)
        calls = program.writer("rt/api/loco/request", _types.Request)
        low = program.writer("rt/lowcmd", _types.LowCmd)
        arms = program.writer("rt/arm_sdk", _types.LowCmd)
        command = low_command(ELBOW, 0.2).serialize(use_version_2=False)
        resident, many = 0, repeated(300, soak=10_000)
        for number in range(many):
            match number % 3:
                case 0:
                    calls.write(random_call(draw))
                case 1:
                    place = draw.randrange(4, len(command))
                    changed = command[:place] + draw.randbytes(8) + command[place + 8 :]
                    ddspy_write(draw.choice([low, arms])._ref, changed)
                case _:
                    tap.resend(draw)
            if number == many // 3:
                resident = process.memory_info().rss
        assert program.call(1).data == "1.0.0.0"
        for facts, at in zip(robot.joints, robot.read().positions, strict=True):
            assert facts.lower - 1e-6 <= at <= facts.upper + 1e-6
        assert process.memory_info().rss - resident < GROWTH


def random_call(draw: random.Random):
    """Return a call of an operation of ours, or of none, whose parameter is changed, long or not JSON at all."""
    whole = '{"velocity": [0.1, 0, 0], "duration": 1, "data": 200}'
    place = draw.randrange(len(whole))
    parameter = draw.choice(
        [
            whole[:place] + chr(draw.randrange(1, 0xD7FF)) + whole[place + draw.randrange(4) :],
            "[" * draw.randrange(9000),
            "\U0001f916" * draw.randrange(2000),
            f'{{"data": {draw.choice([0, 1, 2, 4, 200, 702, 706, 2**32 - 1, "1e999", "NaN", "-0"])}}}',
        ]
    )
    operation = draw.choice([1, 7001, 7005, 7101, 7102, 7104, 7105, 7106, draw.getrandbits(62), -1])
    header = _types.RequestHeader(
        _types.Identity(draw.getrandbits(62), operation),
        _types.Lease(draw.getrandbits(62)),
        _types.Policy(draw.getrandbits(30), noreply=draw.random() < 0.5),
    )
    return _types.Request(header, parameter, [7] * draw.choice([0, 0, 3, 50_000]))
