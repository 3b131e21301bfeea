"""The walk."""

import math
from collections.abc import Callable, Iterator
from functools import partial

import pytest

from interfaces.jderobot import CommandRefusedException, InvalidValueException, MotorsPrx
from interfaces.nao import ActionStatus, HealthPrx, JointsPrx, SafetyPrx, WalkPrx
from naoserver.bodies.capabilities import STILL, Odometry, Walker, WalkVelocity
from naoserver.conformance._robot import ROOM, WALK, RobotClient, free_joints, needs
from naoserver.protocol.robot import Robot

pytestmark = needs(WALK, ROOM)


@pytest.fixture
def walker(rest: RobotClient) -> Iterator[Walker]:
    """The walk of a robot that stands, and stands again after the test."""
    walker = rest.robot.walker
    assert walker is not None
    yield walker
    walker.command(STILL)
    rest.until(lambda: not walker.walking, "all 0 ends the walk")


def way(start: Odometry, now: Odometry) -> tuple[float, float, float]:
    """Return how far it has come: ahead and to the left in m, and turned to the left in rad."""
    x, y = now.x - start.x, now.y - start.y
    cosine, sine = math.cos(start.heading), math.sin(start.heading)
    return x * cosine + y * sine, y * cosine - x * sine, math.remainder(now.heading - start.heading, math.tau)


def test_it_walks_ahead_as_fast_as_commanded(rest: RobotClient, walker: Walker) -> None:
    """It walks ahead at the commanded velocity in m/s, straight, and its odometry says how far."""
    speed = min(0.5 * walker.limits.forward, 0.15)
    start, seen = walker.odometry(), [walker.odometry()]

    def as_fast() -> bool:
        now = walker.odometry()
        seen.append(now)
        far = [each for each in seen if math.dist((each.x, each.y), (now.x, now.y)) > 0.1][-1:]
        reached = [math.dist((each.x, each.y), (now.x, now.y)) / (now.time - each.time) for each in far]
        return any(abs(each - speed) < 0.25 * speed for each in reached)

    walker.command(WalkVelocity(forward=speed))
    assert walker.commanded() == WalkVelocity(forward=speed)
    rest.until(as_fast, f"it walks at {speed:.3g} m/s")
    _, left, turned = way(start, walker.odometry())
    assert abs(left) < 0.05, f"it does not walk straight ahead: {left:.2f} m to the left"
    assert abs(turned) < 0.15, f"it does not walk straight ahead: it turned by {turned:.2f} rad"


def test_it_turns_to_the_left_where_it_stands(rest: RobotClient, walker: Walker) -> None:
    """A positive turn, in rad/s, is to the left, where it stands; all 0 ends the walk."""
    start = walker.odometry()
    walker.command(WalkVelocity(turn=0.5 * walker.limits.turn))
    rest.until(lambda: way(start, walker.odometry())[2] > 0.3, "it turns to the left")
    ahead, left, _ = way(start, walker.odometry())
    assert math.hypot(ahead, left) < 0.15, "it turns where it stands"
    walker.command(STILL)
    rest.until(lambda: not walker.walking, "all 0 ends the walk")
    assert walker.commanded() == STILL


def test_clients_walk_in_si_units_within_its_limits(rest: RobotClient, walker: Walker) -> None:
    """Clients walk in m/s and rad/s both ways; what is too fast is limited, and the answer says so."""
    motors, limits = rest.proxy(MotorsPrx, "Motors"), walker.limits
    for sent, reached, highest in (
        (motors.setV, motors.getV, limits.forward),
        (motors.setL, motors.getL, limits.left),
        (motors.setW, motors.getW, limits.turn),
    ):
        for asked, limited, expected in ((0.5 * highest, 0, 0.5 * highest), (-9.0 - highest, 1, -highest)):
            check_is_driven(rest, partial(sent, asked), limited, reached, expected)
        sent(0.0)


def check_is_driven(
    nao: RobotClient, send: Callable[[], int], limited: int, reached: Callable[[], float], expected: float
) -> None:
    """Check what becomes of a velocity, which is sent until that is seen: it ends if it is not renewed."""
    nao.until(lambda: send() == limited and abs(reached() - expected) < 1e-3, f"it walks at {expected:.3g}")


def test_it_walks_to_a_place(rest: RobotClient, walker: Walker) -> None:
    """It walks to a place in its own frame, and says when it stands there."""
    walk, start = rest.proxy(WalkPrx, "Walk"), walker.odometry()
    walk.walkTo(0.15, 0.0, 0.3)
    rest.until(lambda: walk.getWalkState().status is not ActionStatus.Moving, "the walk to a place ends")
    ended = walk.getWalkState()
    assert (ended.status, ended.progress, ended.message) == (ActionStatus.Done, 1.0, "")
    ahead, left, turned = way(start, walker.odometry())
    assert math.hypot(ahead, left) == pytest.approx(0.15, abs=0.05)
    assert turned == pytest.approx(0.3, abs=0.15)


def test_a_walk_that_nobody_renews_ends_and_frees_its_joints(rest: RobotClient, walker: Walker) -> None:
    """A walk ends when its client does not renew it, which is counted; then its joints are free."""
    health = rest.proxy(HealthPrx, "Health")
    before = health.getHealth().velocityTimeouts
    rest.proxy(MotorsPrx, "Motors").setV(0.3 * walker.limits.forward)
    rest.until(lambda: walker.commanded() == STILL, "a walk ends that nobody renews")
    rest.until(lambda: health.getHealth().velocityTimeouts == before + 1, "it is counted")
    rest.until(lambda: rest.is_free(walker.joints[0]), f"{walker.joints[0]} is free when it stands")


def test_the_joints_of_the_walk_are_refused_and_others_are_free(rest: RobotClient, walker: Walker) -> None:
    """While it walks, clients may not move the joints of the walk, and may move the others."""
    motors, body, joint = rest.proxy(MotorsPrx, "Motors"), rest.proxy(JointsPrx, "Body"), walker.joints[0]
    here = {joint: rest.robot.read().commands[rest.robot.body.joint_names.index(joint)]}

    def is_refused() -> bool:
        motors.setV(0.3 * walker.limits.forward)
        try:
            body.setJointPositions(here, 0.1)
        except InvalidValueException as refusal:
            return "the walk" in str(refusal) and refusal.field == joint
        return False

    rest.until(is_refused, f"{joint} belongs to the walk")
    others = [each.name for each in free_joints(rest.robot.body) if each.name not in walker.joints]
    assert all(map(rest.is_free, others)), "the walk has taken joints that it does not move"


def test_an_emergency_stop_ends_the_walk(rest: RobotClient, walker: Walker) -> None:
    """An emergency stop ends the walk and leaves it upright; until it is reset the robot does not walk."""
    motors, safety, joint = rest.proxy(MotorsPrx, "Motors"), rest.proxy(SafetyPrx, "Safety"), walker.joints[0]
    stood, start = on_both_feet(rest.robot), walker.odometry()

    def walks_on() -> bool:
        motors.setV(min(0.5 * walker.limits.forward, 0.15))
        now = walker.odometry()
        return math.dist((now.x, now.y), (start.x, start.y)) > 0.05

    rest.until(walks_on, "it walks")
    assert not rest.is_free(joint), f"{joint} belongs to the walk"
    safety.emergencyStop("enough")
    assert motors.getV() == 0.0
    for command in (lambda: motors.setV(0.1), lambda: rest.proxy(WalkPrx, "Walk").walkTo(0.1, 0.0, 0.0)):
        with pytest.raises(CommandRefusedException, match="enough"):
            command()
    rest.until(lambda: not walker.walking, "an emergency stop ends the walk")
    assert not rest.robot.state().fallen, "it fell when it was stopped"
    if stood:
        rest.until(lambda: on_both_feet(rest.robot), "it stands on both feet when it was stopped")
    safety.resetEmergencyStop(True)
    rest.until(lambda: motors.setV(0.3 * walker.limits.forward) == 0 and walker.walking, "it walks again")


def on_both_feet(robot: Robot) -> bool:
    """Return whether a robot is upright, and each of its soles bears a part of its weight."""
    if robot.senses is None or robot.state().torso_tilt > 0.2:
        return False
    reading = robot.senses.read()
    return min(reading.left_foot.total, reading.right_foot.total) > 0.2 * 9.81 * robot.body.mass
