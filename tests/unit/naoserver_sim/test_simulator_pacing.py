import math

import pytest

from naoserver_sim._simulator import MAX_LAG, Pacer

PERIOD = 0.01


class Wall:
    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


def simulate(pacer, wall, seconds, cost=0.0, oversleep=0.0):
    """Run a simulator whose ticks take `cost` and whose waits are `oversleep` too long; return its time."""
    ticks = 0
    pacer.start(0.0, PERIOD)
    end = wall.now + seconds
    while wall.now < end:
        due = pacer.due(ticks * PERIOD, 10)
        if due:
            wall.now += cost * due
            ticks += due
            pacer.record(ticks * PERIOD)
        else:
            wall.now += pacer.wait_time(ticks * PERIOD) + oversleep
    return ticks * PERIOD


@pytest.mark.parametrize("speed", [0.5, 1.0, 5.0, 20.0])
def test_time_runs_at_its_speed(speed):
    wall = Wall()
    pacer = Pacer(speed, wall)
    assert simulate(pacer, wall, 10.0, cost=0.0001) == pytest.approx(
        10 * speed, abs=2 * PERIOD + 0.002 * speed
    )
    assert pacer.real_time_factor == pytest.approx(speed, rel=0.02)


def test_waits_of_a_wrong_length_do_not_add_up():
    wall = Wall()
    assert simulate(Pacer(1.0, wall), wall, 60.0, oversleep=0.003) == pytest.approx(60, abs=2 * PERIOD)


def test_lag_is_the_longest_delay_of_the_last_second():
    wall = Wall()
    pacer = Pacer(1.0, wall)
    simulate(pacer, wall, 3.0, oversleep=0.004)
    assert pacer.lag == pytest.approx(0.004, abs=1e-6)


def test_real_time_factor_shows_when_the_computer_is_too_slow():
    wall = Wall()
    pacer = Pacer(1.0, wall)
    simulate(pacer, wall, 5.0, cost=0.02)
    assert pacer.real_time_factor == pytest.approx(0.5, abs=0.05)


def test_a_speed_that_the_computer_does_not_keep_up_with_is_logged_each_time_it_begins(caplog):
    wall = Wall()
    pacer = Pacer(5.0, wall)
    for cost, logged in ((0.0001, 0), (0.01, 1), (0.0001, 1), (0.01, 2)):
        simulate(pacer, wall, 5.0, cost=cost)
        assert len(caplog.messages) == logged
    assert "does not keep up with speed 5: robot time slips, it runs at 0.99" in caplog.messages[0]


def test_what_is_lost_in_a_long_stop_is_not_caught_up():
    wall = Wall()
    pacer = Pacer(1.0, wall)
    simulate(pacer, wall, 1.0)
    wall.now += 10 * MAX_LAG
    assert pacer.due(1.0, 1000) == 1
    assert pacer.due(1.0 + PERIOD, 1000) == 0
    assert pacer.slips == 1


def test_a_short_stop_is_caught_up():
    wall = Wall()
    pacer = Pacer(1.0, wall)
    pacer.start(0.0, PERIOD)
    wall.now += 0.105
    assert pacer.due(0.0, 1000) == 10


def test_at_full_speed_there_is_always_something_due():
    pacer = Pacer(math.inf, Wall())
    pacer.start(0.0, PERIOD)
    assert pacer.due(0.0, 7) == 7


@pytest.mark.parametrize("speed", [0.0, -1.0, math.nan])
def test_a_speed_that_is_none_is_refused(speed):
    with pytest.raises(ValueError, match="speed"):
        Pacer(speed)
