"""Failures of a fake robot: injected, healed and over; and what its senses report meanwhile."""

import math

import numpy as np
import pytest
from msgspec.structs import replace

from naoserver.bodies import find_body
from naoserver.errors import InvalidCommand
from naoserver.fake import FakeRobot
from naoserver.protocol.faults import Faults
from zenoh_ice import VirtualClock


@pytest.fixture
def clock():
    return VirtualClock()


@pytest.fixture
def robot(clock):
    return FakeRobot(clock)


def angle(robot, joint="HeadYaw"):
    return robot.read().positions[robot.body.joint_names.index(joint)]


def turn(robot, clock, to, seconds=1.0):
    robot.command_positions({"HeadYaw": to}, {"HeadYaw": 3.0})
    clock.advance(seconds)
    return angle(robot)


# -- which there are --------------------------------------------------------------------------------------------


def test_a_failure_lasts_until_it_is_healed(robot, clock):
    fault = robot.faults.inject("HeadYaw", "stuck")
    clock.advance(1000.0)
    assert [*robot.faults.current().values()] == [fault]
    robot.faults.heal("HeadYaw")
    assert not robot.faults.current()


def test_a_failure_ends_by_itself_at_its_time(robot, clock):
    robot.faults.inject("Camera", "black", seconds=0.5)
    clock.advance(0.4)
    assert robot.faults.of("Camera", "black")
    clock.advance(0.1)
    assert not robot.faults.current()


def test_healing_a_part_leaves_the_others(robot):
    robot.faults.inject("HeadYaw", "stuck")
    robot.faults.inject("HeadYaw", "noisy")
    kept = robot.faults.inject("HeadPitch", "limp")
    robot.faults.heal("HeadYaw")
    assert [*robot.faults.current().values()] == [kept]
    robot.faults.heal()
    assert not robot.faults.current()


def test_the_newest_of_a_part_and_kind_counts(robot, clock):
    robot.faults.inject("HeadYaw", "offset", 0.1)
    clock.advance(1.0)
    newest = robot.faults.inject("HeadYaw", "offset", 0.2)
    assert [*robot.faults.current().values()] == [newest]
    assert newest.amount == 0.2


def test_an_amount_is_as_usual_if_none_is_given(robot):
    (usual,) = (kind.usual for kind in robot.faults.kinds["Camera"] if kind.name == "late")
    assert robot.faults.inject("Camera", "late").amount == usual


@pytest.mark.parametrize(
    ("given", "field", "said"),
    [
        (("Knee", "stuck"), "part", "there is no part 'Knee' that can fail; there are HeadYaw, Head"),
        (("HeadYaw", "bent"), "kind", "HeadYaw cannot be 'bent': it can be stuck, limp, slow"),
        (("HeadYaw", "offset", 2.0), "amount", "the amount is 2, and must be from -0.5 to 0.5 rad"),
        (("HeadYaw", "offset", math.nan), "amount", "must be from -0.5 to 0.5 rad"),
        (("Battery", "low", 1.1), "amount", "must be from 0 to 1 share"),
        (("HeadYaw", "stuck", None, 0.0), "seconds", "seconds is 0: it must be above 0"),
        (("HeadYaw", "weak"), "kind", "cannot be 'weak'"),  # there are no forces
    ],
)
def test_what_cannot_fail_so_is_refused_with_what_can(robot, given, field, said):
    with pytest.raises(InvalidCommand) as refusal:
        robot.faults.inject(*given)
    assert (refusal.value.field, said in str(refusal.value)) == (field, True)
    assert not robot.faults.current()


def test_healing_a_part_that_there_is_not_is_refused(robot):
    with pytest.raises(InvalidCommand, match="there is no part 'Knee'"):
        robot.faults.heal("Knee")


@pytest.mark.parametrize("name", ["H25", "H21", "T1", "G1", "Cart"])
def test_each_body_can_fail_in_what_it_has(clock, name):
    body = find_body(name)
    kinds = Faults(body, clock, physics=True).kinds
    movable = {joint.name for joint in body.joints if not joint.passive}
    assert movable <= kinds.keys()
    assert {camera.name for camera in body.cameras} <= kinds.keys()
    assert ("Sonar" in kinds, "Battery" in kinds) == (body.sonar is not None, body.battery is not None)
    hot = {part for part, each in kinds.items() if any(kind.name == "hot" for kind in each)}
    assert hot == (movable if body.motor_heat else set())
    assert kinds["Robot"]
    assert not Faults(replace(body, mounted=True), clock, physics=True).kinds.get("Robot")  # to its stand


# -- joints -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["stuck", "limp"])
def test_a_joint_that_does_not_turn_stays_and_goes_on_once_healed(robot, clock, kind):
    robot.faults.inject("HeadYaw", kind)
    assert turn(robot, clock, 0.5) == pytest.approx(0.0, abs=1e-6)
    robot.faults.heal()
    clock.advance(1.0)
    assert angle(robot) == pytest.approx(0.5, abs=1e-3)


def test_a_slow_joint_goes_a_share_of_its_way(robot, clock):
    robot.faults.inject("HeadYaw", "slow", 0.02)
    fastest = robot.body.joint["HeadYaw"].max_velocity
    assert turn(robot, clock, 1.0) == pytest.approx(0.02 * fastest, abs=0.01)


def test_a_joint_with_backlash_stops_short_from_either_side(robot, clock):
    robot.faults.inject("HeadYaw", "backlash", 0.1)
    angle(robot)
    assert turn(robot, clock, 0.5) == pytest.approx(0.45, abs=1e-3)
    assert turn(robot, clock, 0.0) == pytest.approx(0.05, abs=1e-3)


def test_an_encoder_is_wrong_by_its_offset(robot, clock):
    robot.faults.inject("HeadYaw", "offset", 0.1)
    assert turn(robot, clock, 0.5) == pytest.approx(0.6, abs=1e-3)


def test_a_frozen_encoder_reports_one_angle(robot, clock):
    turn(robot, clock, 0.2)
    robot.faults.inject("HeadYaw", "frozen")
    before = angle(robot)
    assert turn(robot, clock, 0.7) == before
    robot.faults.heal()
    assert angle(robot) == pytest.approx(0.7, abs=1e-3)


def test_a_noisy_encoder_scatters(robot, clock):
    robot.faults.inject("HeadYaw", "noisy", 0.05)
    found = []
    for _ in range(200):
        clock.advance(0.01)
        found.append(angle(robot))
    assert np.std(found) == pytest.approx(0.05, rel=0.2)


def test_a_hot_motor_says_so(robot):
    robot.faults.inject("HeadYaw", "hot", 91.0)
    assert robot.read().temperatures[robot.body.joint_names.index("HeadYaw")] == 91.0
    heat = robot.body.motor_heat
    assert heat.hot < robot.faults.inject("HeadYaw", "hot").amount < heat.too_hot


# -- senses -----------------------------------------------------------------------------------------------------


def test_a_dead_inertial_unit_reports_zeros(robot):
    robot.faults.inject("InertialUnit", "dead")
    assert robot.senses.read().inertial.acceleration == (0.0, 0.0, 0.0)


def test_the_pitch_of_an_inertial_unit_drifts(robot, clock):
    clock.advance(2.0)
    robot.faults.inject("InertialUnit", "drifting", 0.1)
    assert robot.senses.inertial().pitch == 0.0
    clock.advance(3.0)
    inertial = robot.senses.inertial()
    assert inertial.pitch == pytest.approx(0.3)
    assert inertial.angular_velocity == pytest.approx((0.0, 0.1, 0.0))


def test_dead_soles_feel_no_load_and_stuck_ones_what_they_felt(robot):
    before = robot.senses.read().left_foot
    assert before.total > 1.0
    robot.faults.inject("FootPressure", "stuck")
    robot.senses.read()
    robot.senses.feel(left_foot=type(before)())
    assert robot.senses.read().left_foot == before
    robot.faults.heal()
    assert robot.senses.read().left_foot.total == 0.0
    robot.senses.feel(left_foot=before)
    robot.faults.inject("FootPressure", "dead")
    assert robot.senses.read().left_foot.total == 0.0


def test_a_sonar_is_dead_or_stuck(robot):
    near = type(robot.senses.read().sonar)(0.4, 0.5)
    robot.senses.feel(sonar=near)
    robot.faults.inject("Sonar", "stuck")
    robot.senses.read()
    robot.senses.feel(sonar=type(near)(2.0, 2.0))
    assert robot.senses.read().sonar == near
    robot.faults.inject("Sonar", "dead")
    assert robot.senses.read().sonar.left == math.inf


def test_a_touch_sensor_is_dead_or_stays_pressed(robot):
    robot.senses.feel(touched=frozenset({"HeadFront"}))
    robot.faults.inject("HeadFront", "dead")
    robot.faults.inject("HeadRear", "stuck")
    robot.faults.inject("HeadYaw", "stuck")  # no sensor of touch
    assert robot.senses.read().touched == {"HeadRear"}


def test_a_low_battery(robot):
    robot.faults.inject("Battery", "low")
    assert robot.senses.read().battery.charge == 0.05
    robot.faults.inject("Battery", "low", 0.03)
    assert robot.senses.read().battery.charge == 0.03


# -- cameras and eyes -------------------------------------------------------------------------------------------


def picture(robot):
    return robot.capture("Camera", 160, 120)


def balls(robot):
    return [thing for thing in robot.eyes.look().things if thing.camera == "Camera"]


def test_a_black_camera_shows_nothing(robot):
    assert balls(robot)
    robot.faults.inject("Camera", "black")
    assert not picture(robot).pixels.any()
    assert not balls(robot)


def test_a_frozen_camera_shows_the_past(robot, clock):
    robot.faults.inject("Camera", "frozen")
    frame, seen = picture(robot), balls(robot)
    turn(robot, clock, 0.3)
    again = picture(robot)
    assert again.time == frame.time
    assert np.array_equal(again.pixels, frame.pixels)
    assert balls(robot) == seen


def test_what_is_seen_has_the_time_of_the_newest_picture(robot, clock):
    clock.advance(1.0)
    robot.faults.inject("Camera", "frozen")
    robot.eyes.look()
    clock.advance(1.0)
    assert robot.eyes.look().time == 2.0  # of the other camera
    robot.faults.inject("CameraBottom", "frozen")
    robot.eyes.look()
    clock.advance(1.0)
    assert robot.eyes.look().time == 2.0
    robot.faults.heal("Camera")
    assert robot.eyes.look().time == 3.0


def test_late_pictures_are_as_old_as_that(robot, clock):
    robot.faults.inject("Camera", "late", 0.5)
    for _ in range(20):
        clock.advance(0.1)
        frame, seen = picture(robot), balls(robot)
    assert clock.now() - frame.time == pytest.approx(0.5, abs=0.01)
    assert clock.now() - seen[0].time == pytest.approx(0.5, abs=0.01)


def test_a_camera_of_half_its_rate_repeats_itself(robot, clock):
    (camera,) = (camera for camera in robot.cameras if camera.name == "Camera")
    period = 1.0 / max(camera.rates)
    robot.faults.inject("Camera", "halved", 0.5)
    times = []
    for _ in range(20):
        clock.advance(period)
        times.append(picture(robot).time)
    assert len(set(times)) == 10


def test_what_is_seen_comes_at_the_rate_of_a_halved_camera(robot, clock):
    robot.eyes.look()
    robot.faults.inject("Camera", "halved", 0.01)
    seen = balls(robot)
    turn(robot, clock, 0.3)
    assert balls(robot) == seen
    clock.advance(10.0)
    assert balls(robot)[0].left < seen[0].left - 0.2


@pytest.mark.parametrize("kind", ["frozen", "halved", "late"])
def test_each_size_of_pictures_fails_by_itself(robot, kind):
    robot.faults.inject("Camera", kind)
    for width, height in [(160, 120), (320, 240), (160, 120)]:
        assert robot.capture("Camera", width, height).pixels.shape == (height, width, 3)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_blurred_camera_loses_edges_but_no_light(robot, axis):
    sharp = picture(robot).pixels.astype(float)
    robot.faults.inject("Camera", "blurred", 3.0)
    blurred = picture(robot).pixels.astype(float)
    assert np.abs(np.diff(blurred, axis=axis)).max() < 0.4 * np.abs(np.diff(sharp, axis=axis)).max()
    assert blurred.mean() == pytest.approx(sharp.mean(), rel=0.02)


def test_a_blurred_camera_sees_less_far(robot):
    (ball,) = (device for device in robot.mechanisms if device.name == "BallRed")
    ball.place({"BallRedDistance": 2.5})
    assert len(balls(robot)) == 2
    robot.faults.inject("Camera", "blurred", 12.0)
    assert [thing.name for thing in balls(robot)] == ["green"]


# -- expression -------------------------------------------------------------------------------------------------


def test_nobody_hears_a_silent_robot(robot, clock):
    robot.faults.inject("Speech", "silent")
    robot.faults.inject("Sounds", "silent")
    robot.voice.say("hello")
    robot.loudspeaker.play_samples("song", b"\1\2" * 20000)
    clock.advance(0.5)
    said, played = robot.voice.utterance(), robot.loudspeaker.playback()
    assert (said.text, said.speaking) == ("", True)
    assert (played.loudness, any(played.samples), len(played.samples) > 0) == (0.0, False, True)


def test_dark_lights_shine_again_once_healed(robot):
    robot.lights.set("LeftEye", (1.0, 0.0, 0.0), 0.0)
    robot.faults.inject("Leds", "dark")
    assert set(robot.lights.colors().values()) == {(0.0, 0.0, 0.0)}
    robot.faults.heal()
    assert robot.lights.colors()["LeftEye"] == (1.0, 0.0, 0.0)
