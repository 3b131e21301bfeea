"""Several robots in one world."""

import math
from contextlib import closing

import msgspec
import numpy as np
import pytest

from naoserver.bodies.capabilities import WalkVelocity
from naoserver.errors import InvalidCommand, RobotError
from naoserver_sim.arena import Arena
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import RobotPlace, load_world, parse_world, side_by_side
from tests.support.present import present
from tests.support.soak import cases
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim

EMPTY = load_world("empty")
SOCCER = load_world("soccer")
FACING = (
    RobotPlace(name="red", position=(-0.35, 0.0), team="reds"),
    RobotPlace(name="blue", position=(0.35, 0.0), heading=math.pi, team="blues"),
)


@pytest.fixture
def clock():
    return VirtualClock()


@pytest.fixture
def put(clock):
    """Return a function that makes an arena of some places in a world."""
    made = []

    def make(*places, world=EMPTY, **options):
        arena = Arena(msgspec.structs.replace(world, robots=places), clock=clock, skin=False, **options)
        made.append(arena)
        return arena

    yield make
    for arena in made:
        arena.close()


def place_of(robot):
    return np.array(robot.stage.truth().torso.position)


def test_robots_have_names_and_teams(put):
    arena = put(*FACING)
    assert [(robot.name, robot.team) for robot in arena.robots] == [("red", "reds"), ("blue", "blues")]


def test_two_robots_stand_where_they_were_put(put, clock):
    red, blue = put(*FACING).robots
    clock.advance(10.0)
    for robot, x in ((red, -0.35), (blue, 0.35)):
        assert robot.state().torso_tilt < 0.3
        assert place_of(robot)[:2] == pytest.approx((x, 0.0), abs=0.05)


def test_a_robot_among_others_moves_as_if_it_were_alone(clock):
    world = side_by_side(SOCCER, 3)
    arena = Arena(world, clock=clock, skin=False, seed=4, noise=True)
    other_clock = VirtualClock()
    alone = SimulatedRobot(world=SOCCER, clock=other_clock, skin=False, seed=4, noise=True)
    for each, its_clock in ((arena.robots[0], clock), (alone, other_clock)):
        its_clock.advance(0.5)
        present(each.walker).command(WalkVelocity(0.15))
        its_clock.advance(2.0)
    assert place_of(arena.robots[0]) == pytest.approx(place_of(alone), abs=0.02)
    arena.close()
    alone.close()


def test_robots_that_walk_into_each_other_get_no_further(put, clock):
    red, blue = put(*FACING).robots
    for robot in (red, blue):
        present(robot.walker).command(WalkVelocity(0.2))
    clock.advance(15.0)
    assert not present(red.walker).walking or red.state().fallen
    apart = place_of(blue) - place_of(red)
    assert np.linalg.norm(apart[:2]) > 0.1, "they do not pass through each other"


def test_a_push_moves_the_one_that_is_pushed(put, clock):
    red, blue = put(*FACING).robots
    clock.advance(1.0)
    before = place_of(blue)
    red.stage.push((0.0, 60.0, 0.0), 0.2)
    clock.advance(3.0)
    assert red.state().fallen
    assert not blue.state().fallen
    assert place_of(blue) == pytest.approx(before, abs=0.005)


def test_motors_let_go_and_grow_warm_for_each_robot_alone(put, clock):
    red, blue = put(*FACING).robots
    clock.advance(2.0)
    names = [joint.name for joint in red.joints]
    red.command_stiffnesses(dict.fromkeys(names, 0.0), 0.0)
    clock.advance(2.0)
    assert red.state().fallen
    assert set(red.read().stiffnesses) == {0.0}
    assert not blue.state().fallen
    assert set(blue.read().stiffnesses) == {1.0}
    assert max(blue.read().temperatures) > max(red.read().temperatures)


@pytest.mark.parametrize("bodies", cases([("Cart", "H21", "T1")], [("H25", "T1"), ("T1", "H25", "G1")]))
def test_bodies_may_be_mixed(put, clock, bodies):
    arena = put(
        *(RobotPlace(name=f"r{at}", body=body, position=(0.0, 1.2 * at)) for at, body in enumerate(bodies))
    )
    assert [robot.body.name for robot in arena.robots] == list(bodies)
    clock.advance(1.0)
    for robot in arena.robots:
        present(robot.walker).command(WalkVelocity(0.15))
    clock.advance(4.0)
    for at, robot in enumerate(arena.robots):
        x, y, _ = place_of(robot)
        assert not robot.state().fallen
        assert x > 0.2
        assert y == pytest.approx(1.2 * at, abs=0.3)


def test_the_same_seed_gives_the_same_states_bit_by_bit():
    def states(seed):
        clock = VirtualClock()
        arena = Arena(side_by_side(SOCCER, 3), clock=clock, skin=False, seed=seed, noise=True)
        for robot in arena.robots:
            present(robot.walker).command(WalkVelocity(0.1, 0.0, 0.2))
        clock.advance(3.0)
        arena.close()
        return [repr((robot.read(), robot.senses.read(), robot.stage.truth())) for robot in arena.robots]

    first = states(1)
    assert states(1) == first
    assert states(2) != first


def test_noise_differs_from_robot_to_robot(put, clock):
    red, blue = put(*FACING, noise=True).robots
    clock.advance(0.5)
    assert red.senses.read().inertial.acceleration != blue.senses.read().inertial.acceleration


def test_a_sonar_hears_the_other_robot(put, clock):
    red, blue = put(*FACING).robots
    clock.advance(0.5)
    for robot in (red, blue):
        heard = robot.senses.read().sonar
        assert min(heard.left, heard.right) == pytest.approx(0.6, abs=0.1)
    blue.stage.place_robot(2.0, 2.0, 0.0)
    clock.advance(0.5)
    heard = red.senses.read().sonar
    assert heard.left == heard.right == math.inf


@pytest.mark.gl
@pytest.mark.parametrize("skin", [True, False], ids=["shell", "blocks"])
def test_a_camera_sees_the_shirt_of_the_other_robot(clock, skin):
    def blue_pixels(shirt):
        red, blue = FACING
        places = red, msgspec.structs.replace(blue, shirt=shirt)
        arena = Arena(msgspec.structs.replace(EMPTY, robots=places), clock=VirtualClock(), skin=skin)
        with closing(arena):
            frame = arena.robots[0].capture("Camera", 320, 240)
        pixels = np.array(frame.pixels).astype(int)
        return np.count_nonzero(pixels[..., 2] > 2 * pixels[..., :2].max(axis=2) + 30)

    assert blue_pixels((0.1, 0.1, 0.9)) > 300
    assert blue_pixels((0.9, 0.1, 0.1)) < 30


@pytest.mark.gl
def test_each_robot_has_cameras_of_its_own(put):
    red, blue = put(*FACING).robots
    assert not np.array_equal(red.capture("Camera", 320, 240).pixels, blue.capture("Camera", 320, 240).pixels)
    assert red.camera_pose("Camera")[0][0] < 0.0 < blue.camera_pose("Camera")[0][0]


def test_the_truth_names_all(put, clock):
    arena = put(*FACING, world=SOCCER)
    red, blue = arena.robots
    clock.advance(0.5)
    assert set(arena.truth().objects) == {"Ball", "red", "blue"}
    assert set(red.stage.truth().objects) == {"Ball", "blue"}
    assert red.stage.truth().objects["blue"] == blue.stage.truth().torso
    assert blue.stage.truth().objects["Ball"] == red.stage.truth().objects["Ball"]


def test_a_ball_is_one_ball(put, clock):
    arena = put(*FACING, world=SOCCER)
    red, blue = arena.robots
    blue.stage.place_object("Ball", (1.0, 1.0, 0.05))
    clock.advance(0.1)
    assert red.stage.truth().objects["Ball"].position == pytest.approx((1.0, 1.0, 0.05), abs=0.01)


def test_robots_are_placed_by_name(put, clock):
    arena = put(*FACING)
    red, blue = arena.robots
    arena.place("blue", 1.0, -1.0, 1.5)
    clock.advance(1.0)
    assert place_of(blue)[:2] == pytest.approx((1.0, -1.0), abs=0.05)
    assert place_of(red)[:2] == pytest.approx((-0.35, 0.0), abs=0.05)
    with pytest.raises(InvalidCommand, match="no robot 'green'; there are red, blue"):
        arena.place("green", 0.0, 0.0, 0.0)
    with pytest.raises(InvalidCommand, match="blue is in the way"):
        arena.place("red", 1.0, -1.0, 0.0)


def test_a_reset_is_for_one_robot_and_the_objects(put, clock):
    red, blue = put(*FACING, world=SOCCER).robots
    red.stage.place_robot(1.0, 1.0, 0.0)
    blue.stage.place_robot(2.0, 1.0, 0.0)
    red.stage.place_object("Ball", (0.5, -1.0, 0.05))
    clock.advance(0.5)
    red.stage.reset()
    clock.advance(0.5)
    assert place_of(red)[:2] == pytest.approx((-0.35, 0.0), abs=0.05)
    assert place_of(blue)[:2] == pytest.approx((2.0, 1.0), abs=0.05)
    assert red.stage.truth().objects["Ball"].position == pytest.approx((0.0, 0.0, 0.05), abs=0.01)
    red.stage.place_robot(1.0, 1.0, 0.0)
    clock.advance(0.1)
    blue.stage.place_robot(-0.35, 0.0, 0.0)
    clock.advance(0.1)
    with pytest.raises(InvalidCommand, match="blue is in the way"):
        red.stage.reset()


def test_robots_without_places_stand_side_by_side(clock):
    arena = Arena(side_by_side(SOCCER, 4, "gold"), clock=clock, skin=False)
    assert [robot.name for robot in arena.robots] == ["gold", "gold2", "gold3", "gold4"]
    assert [round(float(place_of(robot)[1])) for robot in arena.robots] == [0, 1, -1, 2]
    arena.close()


WORLD = """
[[robots]]
name = "{first}"
position = [1.0, 0.5]
heading = 1.5
body = "T1"
team = "red"
shirt = [0.8, 0.1, 0.1]

[[robots]]
name = "{second}"
"""


def test_a_world_lists_its_robots():
    first, second = parse_world(WORLD.format(first="one", second="two"), "w").robots
    assert first == RobotPlace(
        name="one", position=(1.0, 0.5), heading=1.5, body="T1", team="red", shirt=(0.8, 0.1, 0.1)
    )
    assert second == RobotPlace(name="two")


def test_a_robot_alone_starts_at_the_first_place(clock):
    world = parse_world(WORLD.format(first="one", second="two"), "w")
    robot = SimulatedRobot(world=world, clock=clock, skin=False)
    assert place_of(robot)[:2] == pytest.approx((1.0, 0.5), abs=0.02)
    robot.close()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (WORLD.format(first="one", second="one"), "one appears 2 times"),
        (WORLD.format(first="a/b", second="two"), "a realm is 1 to 64 letters"),
        ("[robot]\nheading = 1.0\n" + WORLD.format(first="one", second="two"), "write only one of them"),
    ],
)
def test_a_wrong_list_of_robots_is_refused(text, message):
    with pytest.raises(RobotError, match=message):
        parse_world(text, "w")
