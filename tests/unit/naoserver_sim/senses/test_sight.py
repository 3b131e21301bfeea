"""What a simulated robot's eyes see, compared with where things are and with what its pictures show."""

import math

import msgspec
import numpy as np
import pytest

from naoserver_sim.arena import Arena
from naoserver_sim.world import RobotPlace, load_world, parse_world
from tests.support.present import present
from zenoh_ice import VirtualClock

pytestmark = pytest.mark.sim

SOCCER = load_world("soccer")
HERE = RobotPlace(name="red", position=(-1.5, 0.0), shirt=(0.9, 0.1, 0.1))
OPPOSITE = RobotPlace(name="blue", position=(0.3, 0.3), heading=math.pi, shirt=(0.1, 0.1, 0.9))


@pytest.fixture
def look():
    """Return a function that lets the first robot of a world look, for a second of simulation."""
    made = []

    def see(world=SOCCER, *places, who=0, **options):
        clock = VirtualClock()
        robots = places or (HERE,)
        arena = Arena(msgspec.structs.replace(world, robots=robots), clock=clock, skin=False, **options)
        made.append(arena)
        arena.start()
        clock.advance(1.0)
        return arena.robots[who], arena.robots[who].eyes.look()

    yield see
    for arena in made:
        arena.close()


def of(reading, kind, camera="Camera"):
    return [thing for thing in reading.things if (thing.kind, thing.camera) == (kind, camera)]


def with_box(at, size):
    text = f'[[boxes]]\nname = "Wall"\nposition = [{at}, 0.0]\nsize = [0.05, {size}, {size}]\n'
    return msgspec.structs.replace(SOCCER, boxes=parse_world(text, "box").boxes)


def test_a_ball_is_seen_by_its_color_where_it_lies(look):
    robot, reading = look()
    (ball,) = of(reading, "ball")
    x, y, heading = 1.5, 0.0, robot.stage.truth().torso.heading
    assert (ball.name, ball.x, ball.y) == ("orange", pytest.approx(x, abs=0.02), pytest.approx(y, abs=0.03))
    assert ball.pan == pytest.approx(-heading, abs=0.01)
    assert reading.time == robot.read().time


@pytest.mark.gl
def test_it_is_where_the_picture_shows_it(look):
    robot, reading = look(SOCCER, msgspec.structs.replace(HERE, heading=0.3))
    (ball,) = of(reading, "ball")
    pixels = robot.capture("Camera", 640, 480).pixels.astype(int)
    rows, columns = np.nonzero((pixels[..., 0] > 150) & (pixels[..., 2] < 80))
    focal = robot.body.cameras[0].focal_length(640)
    shown = focal * -math.tan(ball.left) + 319.5, focal * math.tan(ball.down) + 239.5
    assert shown == pytest.approx(
        ((columns.min() + columns.max()) / 2, (rows.min() + rows.max()) / 2), abs=2.0
    )


def test_what_a_box_hides_is_not_seen_and_what_it_hides_in_part_is(look):
    assert not of(look(with_box(-0.5, 0.4))[1], "ball")
    (ball,) = of(look(with_box(-0.1, 0.05))[1], "ball")
    assert ball.certainty < of(look()[1], "ball")[0].certainty


def test_a_head_that_turns_away_sees_it_no_more(look):
    robot, _ = look()
    robot.command_positions({"HeadYaw": 1.5}, {"HeadYaw": 3.0})
    robot.clock.advance(1.5)
    assert not of(robot.eyes.look(), "ball")


def test_another_robot_is_seen_with_the_color_of_its_shirt(look):
    _, reading = look(SOCCER, HERE, OPPOSITE)
    (other,) = of(reading, "robot")
    assert other.name == "blue"
    assert (other.x, other.y) == pytest.approx((1.8, 0.3), abs=0.08)


def test_each_robot_of_a_world_sees_all_of_it(look):
    _, reading = look(SOCCER, OPPOSITE, HERE, who=1)
    assert {thing.kind for thing in reading.things} >= {"ball", "robot", "line"}


def test_lines_crossings_and_posts_of_the_field_are_where_they_are(look):
    robot, reading = look(SOCCER, msgspec.structs.replace(HERE, position=(2.0, 0.0)))
    place, turn = robot.stage.truth().torso, robot.stage.truth().torso.heading
    field = present(SOCCER.field)

    def on_field(thing):
        x = place.position[0] + math.cos(turn) * thing.x - math.sin(turn) * thing.y
        return x, place.position[1] + math.sin(turn) * thing.x + math.cos(turn) * thing.y

    crossings = of(reading, "crossing")
    known = {(x, y): kind for x, y, kind in field.crossings}
    assert {thing.name for thing in crossings} >= {"T", "mark"}
    for thing in crossings:
        nearest = min(known, key=lambda each: math.dist(each, on_field(thing)))
        assert (math.dist(nearest, on_field(thing)) < 0.01, known[nearest]) == (True, thing.name)
    posts = [on_field(thing) for thing in of(reading, "goalpost")]
    assert sorted(y for _, y in posts) == pytest.approx([-0.8, 0.8], abs=0.01)
    assert all(x == pytest.approx(4.5, abs=0.01) for x, _ in posts)
    lines = of(reading, "line")
    assert 10 < len(lines) <= 30


def test_without_noise_the_error_is_none_and_with_it_grows_with_the_distance(look):
    assert of(look()[1], "ball")[0].distance_error == 0.0
    (near,) = of(look(noise=True, seed=3)[1], "ball")
    (far,) = of(
        look(SOCCER, msgspec.structs.replace(HERE, position=(-3.0, 0.0)), noise=True, seed=3)[1], "ball"
    )
    assert 0.0 < 2.0 * near.distance_error < far.distance_error


def test_noise_misses_invents_and_moves_things_and_a_seed_makes_it_the_same(look):
    def looks(seed):
        robot, reading = look(noise=True, seed=seed)
        found = [reading]
        for _ in range(60):
            robot.clock.advance(0.1)
            found.append(robot.eyes.look())
        return found

    first, second = looks(7), looks(7)
    assert first == second != looks(8)
    distances = [ball.distance for reading in first for ball in of(reading, "ball")]
    assert 0.005 < np.std(distances) < 0.2
    missed = [reading for reading in first if not of(reading, "ball")]
    assert 0 < len(missed) < 12


def test_it_looks_again_with_the_next_picture_only(look):
    robot, reading = look()
    robot.clock.advance(0.02)
    assert robot.eyes.look() is reading
    robot.clock.advance(0.06)
    assert robot.eyes.look().time > reading.time
