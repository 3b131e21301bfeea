"""Joints and readings."""

import math
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import pytest

from interfaces.nao import HealthPrx, JointsPrx
from naoserver.bodies.parts import Joint
from naoserver.conformance._robot import (
    JOINT,
    RobotClient,
    free_joints,
    needs,
    speed_of,
    step_of,
    target_of,
    tolerance_of,
)
from naoserver.moves.motion_file import load_motions
from naoserver.protocol.robot import JointReading

TOLERANCE = 0.05
"""Radians by which a joint may be away from its setpoint: one that carries a load, or has some play."""
AT_ONCE = 0.005
"""Seconds in which what does not block returns; a transfer on a bus of servos takes longer."""


def test_it_has_what_its_body_describes(nao: RobotClient) -> None:
    """What its body describes, the robot has, and serves by its name."""
    robot, body = nao.robot, nao.robot.body
    of_parts: dict[str, object] = {
        **dict.fromkeys(("Body", "Clock", "Description", "Health", "Safety", "Team"), True),
        **dict.fromkeys(("Encoders", "Motors", "Walk"), body.walk),
        **dict.fromkeys(("Head", "NeckSpeed"), body.neck),
        **dict.fromkeys(("Sounds", "Speech"), body.voice),
        "Battery": body.battery,
        "Leds": body.lights,
        "Sonar": body.sonar,
        "Touch": body.touch,
        "InertialUnit": body.inertial_unit,
        "Motions": load_motions(body),
        "Postures": body.postures,
        "FootPressure": any(sole.pressure for sole in body.soles),
    }
    names = [*body.hinges, *(mechanism.name for mechanism in robot.mechanisms)]
    described = {name for name, part in of_parts.items() if part} | {camera.name for camera in body.cameras}
    described |= {f"{name}{kind}" for name in names for kind in ("Motors", "Encoders")}
    missing = ", ".join(sorted(described - nao.assembly.servants.keys()))
    assert not missing, f"its body describes what the robot does not have: {missing}"


def test_the_joints_are_those_of_the_body_in_order(nao: RobotClient) -> None:
    """Its joints are those of its body, in order, with their limits; they are within them, in rad or m."""
    facts = [(joint.name, joint.lower, joint.upper, joint.max_velocity) for joint in nao.robot.body.joints]
    own = [(joint.name, joint.lower, joint.upper, joint.max_velocity) for joint in nao.robot.joints]
    served = nao.proxy(JointsPrx, "Body").getJointLimits()
    assert own == facts, "the joints of the robot are not those of its body"
    assert [(each.name, each.lower, each.upper, each.maxVelocity) for each in served] == facts
    for joint, at in zip(nao.robot.joints, nao.robot.read().positions, strict=True):
        within = joint.lower - TOLERANCE <= at <= joint.upper + TOLERANCE
        assert within, f"{joint.name} is at {at:.3g}, and its range is {joint.lower:.3g} to {joint.upper:.3g}"


def test_a_reading_has_a_number_for_each_joint(nao: RobotClient) -> None:
    """A reading, which nobody can change, has a finite number for each joint."""
    reading = nao.robot.read()
    for kind in ("positions", "velocities", "commands", "torques", "stiffnesses", "temperatures"):
        values = getattr(reading, kind)
        assert isinstance(values, tuple), f"the {kind} of a reading are a {type(values).__name__}"
        assert len(values) == len(nao.robot.joints), f"the {kind} of a reading are {len(values)} values"
        assert all(map(math.isfinite, values)), f"the {kind} of a reading are not all numbers: {values}"
    assert all(0.0 <= each <= 1.0 for each in reading.stiffnesses), "a stiffness is from 0 to 1"
    assert all(-20.0 < each < 100.0 for each in reading.temperatures), "they are in degrees Celsius"


@needs(JOINT)
def test_each_value_is_that_of_its_joint(rest: RobotClient) -> None:
    """Readings are in the order of the joints: the joint that is commanded moves, and no other."""
    robot, names = rest.robot, [joint.name for joint in rest.robot.joints]
    free = free_joints(robot.body)
    others = {joint.name for joint in free}  # what keeps it upright may move its legs
    for joint in free:
        before, place = robot.read().commands, names.index(joint.name)
        target = target_of(joint, before[place])

        def moved(
            reading: JointReading, before: tuple[float, ...] = before, least: float = step_of(joint) / 10
        ) -> list[str]:
            pairs = zip(names, reading.commands, before, strict=True)
            return [name for name, now, then in pairs if name in others and abs(now - then) > least]

        def there(
            reading: JointReading, joint: Joint = joint, place: int = place, target: float = target
        ) -> bool:
            off = abs(reading.positions[place] - target)
            return off < tolerance_of(joint) and abs(reading.commands[place] - target) < 1e-3

        robot.command_positions({joint.name: target}, {joint.name: 2.0 * speed_of(joint)})
        begun = rest.readings(moved, f"the setpoint of {joint.name} moves")[-1]
        assert moved(begun) == [joint.name], f"{joint.name} was commanded, and {moved(begun)} moved"
        reached = rest.readings(there, f"{joint.name} and its setpoint come to {target:.3g}")[-1]
        assert moved(reached) == [joint.name], f"{joint.name} was commanded, and {moved(reached)} moved"


def shortest(call: Callable[[], object]) -> float:
    """Return the shortest time in s that a call takes: what else the machine does is not counted."""
    times = []
    for _ in range(20):
        begin = time.perf_counter()
        call()
        times.append(time.perf_counter() - begin)
    return min(times)


def test_nothing_blocks(rest: RobotClient) -> None:
    """`read` and `state` are snapshots that never block; `command_*` store the command and return at once."""
    robot = rest.robot
    pairs = zip(robot.joints, robot.read().commands, strict=True)
    here = dict([(joint.name, at) for joint, at in pairs if joint.max_torque > 0.0][:1])
    for what, call in {
        "read": robot.read,
        "state": robot.state,
        "command_positions": lambda: robot.command_positions(here, dict.fromkeys(here, 0.1)),
        "command_velocities": lambda: robot.command_velocities(dict.fromkeys(here, 0.0)),
        "command_stiffnesses": lambda: robot.command_stiffnesses(dict.fromkeys(here, 1.0), 0.1),
    }.items():
        assert (took := shortest(call)) < AT_ONCE, f"{what} blocks: it took {took:.2f} s at best"


def test_any_thread_may_read_and_time_goes_on(nao: RobotClient) -> None:
    """Any thread may read at any time; readings have the time of the robot's clock, which never goes back."""

    def times(_: int) -> list[float]:
        return [nao.robot.read().time for _ in range(50)]

    with ThreadPoolExecutor(4) as threads:
        for seen in threads.map(times, range(4)):
            assert seen == sorted(seen), "a reading is older than the one before"
    first = nao.robot.read().time
    last = nao.readings(lambda reading: reading.time > first, "the time of a reading goes on")[-1].time
    assert last == pytest.approx(nao.robot.clock.now(), abs=2.0), "readings have the time of another clock"
    stream = nao.proxy(JointsPrx, "Body").getJointState
    nao.until(lambda: stream.wait(timeout=nao.limit).time >= last, "the stream has the time of readings")
    streamed = [stream.wait(timeout=nao.limit).time for _ in range(3)]
    assert streamed == sorted(streamed), "a streamed reading is older than the one before"


def test_the_state_says_how_far_the_torso_tilts(nao: RobotClient) -> None:
    """Its state says how far the torso tilts, and that it has fallen beyond the tilt of `Body.lying_tilt`."""
    state = nao.robot.state()
    assert 0.0 <= state.torso_tilt <= math.pi
    lies = state.torso_tilt > nao.robot.body.lying_tilt
    assert state.fallen == lies, f"it tilts by {state.torso_tilt:.2f} rad, and `fallen` is {state.fallen}"
    assert min(state.real_time_factor, state.lag) >= 0.0
    report = nao.proxy(HealthPrx, "Health").getHealth.wait(timeout=nao.limit).value
    assert report.fallen == state.fallen
    assert report.torsoTilt == pytest.approx(state.torso_tilt, abs=TOLERANCE)
    assert report.cameraRates.keys() >= {camera.name for camera in nao.robot.cameras}
    assert report.uptime > 0.0
