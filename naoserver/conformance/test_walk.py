"""The walk."""

import math
from collections.abc import Iterator

import pytest

from interfaces.jderobot import MotorsPrx
from interfaces.nao import HealthPrx, SafetyPrx
from naoserver.bodies.capabilities import STILL, Odometry, Walker, WalkVelocity
from naoserver.conformance._robot import ROOM, WALK, RobotClient, needs

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


def test_a_walk_that_nobody_renews_ends_and_frees_its_joints(rest: RobotClient, walker: Walker) -> None:
    """A walk ends when its client does not renew it, which is counted; then its joints are free."""
    health = rest.proxy(HealthPrx, "Health")
    before = health.getHealth().velocityTimeouts
    rest.proxy(MotorsPrx, "Motors").setV(0.3 * walker.limits.forward)
    rest.until(lambda: walker.commanded() == STILL, "a walk ends that nobody renews")
    rest.until(lambda: health.getHealth().velocityTimeouts == before + 1, "it is counted")
    rest.until(lambda: rest.is_free(walker.joints[0]), f"{walker.joints[0]} is free when it stands")


def test_an_emergency_stop_ends_the_walk(rest: RobotClient, walker: Walker) -> None:
    """An emergency stop ends the walk, during which its joints belong to it, and leaves it upright."""
    motors, joint = rest.proxy(MotorsPrx, "Motors"), walker.joints[0]
    rest.until(
        lambda: motors.setV(0.3 * walker.limits.forward) == 0 and not rest.is_free(joint),
        f"{joint} belongs to the walk",
    )
    rest.proxy(SafetyPrx, "Safety").emergencyStop("enough")
    rest.until(lambda: not walker.walking, "an emergency stop ends the walk")
    assert not rest.robot.state().fallen, "it fell when it was stopped"
