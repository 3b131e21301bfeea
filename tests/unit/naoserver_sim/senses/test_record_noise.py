"""The imperfections of the senses: their size and delay, and that a seed reproduces them."""

import dataclasses
import math

import numpy as np
import pytest

from naoserver_sim._senses.record import Errors, SenseNoise
from naoserver_sim.robot import SimulatedRobot
from tests.support.physics import Lab
from zenoh_ice.threads.clock import VirtualClock

pytestmark = pytest.mark.sim


def trace(**options):
    """Return what a robot feels for a second at each tick."""
    clock = VirtualClock()
    robot = SimulatedRobot(clock=clock, skin=False, **options)
    readings = []
    for _ in range(100):
        clock.advance(0.01)
        readings.append(robot.senses.read())
    return readings


def test_the_same_seed_gives_the_same_readings_bit_by_bit():
    first, second, other = (trace(noise=True, seed=seed) for seed in (5, 5, 6))
    assert first == second
    assert first[-1].inertial != other[-1].inertial


def test_without_noise_nothing_is_late_and_a_robot_at_rest_reads_the_same():
    readings = trace()
    assert readings[-1].time == pytest.approx(1.0)
    forces = np.array([reading.inertial.acceleration for reading in readings[50:]])
    assert forces.std(axis=0).max() < 0.02


def test_with_noise_all_is_late_by_a_tick():
    assert trace(noise=True, seed=1)[-1].time == pytest.approx(0.99)


def test_with_noise_the_joints_are_reported_as_encoders_read_them():
    exact, coarse = (SimulatedRobot(clock=VirtualClock(), skin=False, noise=noise) for noise in (False, True))
    angles = np.array(exact.read().positions)
    reported = np.array(coarse.read().positions)
    assert np.abs(angles - reported).max() <= math.tau / 4096 / 2 + 1e-12
    assert (reported / (math.tau / 4096)).round(6) == pytest.approx((reported / (math.tau / 4096)).round())
    assert (angles != reported).any()


def measured(noise, looks=2000):
    """Return what a robot that does not move at all feels again and again."""
    lab = Lab(noise=noise)
    readings = []
    for _ in range(looks):
        lab.record.sample(0.0)
        readings.append((lab.record.newest.inertial, *lab.record.feet(), lab.record.loads()))
    return readings


def test_the_noise_is_as_large_as_it_says():
    noise = SenseNoise()
    inertial = [reading[0] for reading in measured(noise)]
    for field, expected in (("acceleration", noise.acceleration), ("angular_velocity", noise.turning)):
        deviations = np.std([getattr(reading, field) for reading in inertial], axis=0)
        assert deviations == pytest.approx(expected, rel=0.1)
    for field in ("roll", "pitch"):
        assert np.std([getattr(reading, field) for reading in inertial]) == pytest.approx(noise.tilt, rel=0.1)


def test_the_offsets_stay_and_are_as_large_as_they_say():
    quiet = dataclasses.replace(SenseNoise(), acceleration=0.0, turning=0.0, tilt=0.0, pressure=0.0)
    errors = [Errors(quiet, np.random.default_rng(seed)) for seed in range(100)]
    offsets = [each.next() for each in errors]
    assert [each.next() for each in errors] == offsets
    reported = (
        [quiet.acceleration_offset] * 3 + [quiet.turning_offset] * 3 + [quiet.tilt_offset] * 2 + [0.0] * 8
    )
    assert np.std(offsets, axis=0) == pytest.approx(reported, rel=0.3)


def test_the_feet_have_gains_and_an_end_of_their_range():
    gains = dataclasses.replace(SenseNoise(), pressure=0.0, pressure_gain=0.2)
    exact, noisy = (measured(noise, looks=1)[0] for noise in (None, gains))
    assert noisy[1].total == pytest.approx(exact[1].total, rel=0.5)
    assert noisy[1].front_left / exact[1].front_left != pytest.approx(noisy[1].rear_left / exact[1].rear_left)
    assert noisy[3] == pytest.approx((noisy[1].total, noisy[2].total))
    low = dataclasses.replace(gains, most_pressure=3.0)
    assert measured(low, looks=1)[0][1].total == 12.0
