"""The figures of a run."""

import pytest

from tests.support.component import ball_variables, dance_and_follow, snapshot
from visualhfsm.watch.automata import Automata
from visualhfsm.watch.recording import Ball, Recording, RobotReading
from visualhfsm.watch.summary import in_middle_third, summarize


def record(until: float, ball_at, robot: RobotReading | None = None) -> Recording:
    recording = Recording(Automata(dance_and_follow()))
    for tenth in range(round(until * 10)):
        recording.add(snapshot(tenth / 10, ball_at(tenth / 10)), robot or RobotReading())
    return recording


def test_the_first_two_seconds_of_each_time_of_following_do_not_count():
    def off_center_at_first(time: float) -> dict[str, str]:
        beginning = max(start for start in (0, 8, 20, 26) if start <= time)
        return ball_variables(150.0 if time - beginning < 2 else 5.0, 0.0)

    summary = summarize(record(30, off_center_at_first), 320, 240)
    assert summary.centered == 1.0
    # Followed from 0 to 8, 8 to 10, 20 to 26 and 26 to 30 s, ten times a second.
    assert summary.centered_of == 60 + 0 + 40 + 20


def test_a_ball_out_of_sight_counts_as_outside():
    def lost_after_four_seconds(time: float) -> dict[str, str]:
        return ball_variables(0.0, 0.0, seen=time < 4)

    assert summarize(record(6, lost_after_four_seconds), 320, 240).centered == 0.5


def test_without_a_ball_there_is_no_share():
    assert summarize(record(1, lambda time: {}), 320, 240).centered is None


@pytest.mark.parametrize(
    ("u", "v", "centered"),
    [(0, 0, True), (53.3, 40.0, True), (53.4, 0, False), (0, -40.1, False), (-53.3, -40.0, True)],
)
def test_the_middle_third_is_a_sixth_to_each_side(u, v, centered):
    assert in_middle_third(Ball("red", u, v, seen=True, following_since=0.0), 320, 240) is centered


def test_means_and_maxima_are_of_what_is_known():
    recording = record(
        1, lambda time: {}, RobotReading(real_time_factor=0.9, lag=0.01, torso_tilt=0.05, camera_rate=10)
    )
    recording.add(snapshot(1.0), RobotReading(real_time_factor=1.2, lag=0.03))
    recording.add(snapshot(1.1), RobotReading())
    summary = summarize(recording, 320, 240)
    assert summary.real_time_factor == pytest.approx((10 * 0.9 + 1.2) / 11)
    assert (summary.typical_lag, summary.largest_lag) == (0.01, 0.03)
    assert (summary.torso_tilt, summary.camera_rate) == (0.05, 10)
    assert summary.snapshots == 12
    assert summary.duration == pytest.approx(1.1)


def test_an_empty_recording_has_a_summary():
    summary = summarize(Recording(Automata(dance_and_follow())), 320, 240)
    assert (summary.duration, summary.centered, summary.largest_lag, summary.cycles) == (0.0, None, None, 0)
