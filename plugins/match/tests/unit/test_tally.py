"""What is counted in a match."""

import pytest

from naoserver.soccer_field import Field
from visualhfsm_match._referee import PERIOD, Referee, Seen, Sight
from visualhfsm_match._rules import load_rules
from visualhfsm_match._tally import HEAD, Counter, Tally


class Match:
    """A match of one robot against one, which is told what is seen."""

    def __init__(self):
        self.referee = Referee(load_rules(), Field(), {"red": ("red1",), "blue": ("blue1",)}, 600.0)
        self.referee.begin(0.0)
        self.counter = Counter(self.referee)
        self.time = 0.0
        self.red, self.blue, self.ball = Seen(-0.75, 0.0), Seen(1.1, 0.0), (0.0, 0.0)
        self.go_on(6.0)

    def go_on(self, seconds):
        """Let everything be as it is for some seconds."""
        for _ in range(round(seconds / PERIOD)):
            self.time += PERIOD
            sight = Sight(self.time, self.ball, {"red1": self.red, "blue1": self.blue})
            self.referee.see(sight)
            self.counter.see(sight)

    def kick(self, x, y):
        """Let red kick the ball by so much in a period."""
        self.red = Seen(self.ball[0] - 0.2, self.ball[1])
        self.go_on(PERIOD)
        self.ball = (self.ball[0] + x, self.ball[1] + y)
        self.go_on(PERIOD)


@pytest.fixture
def match():
    return Match()


def test_who_falls_and_gets_up_is_counted_with_the_time_on_the_ground(match):
    match.red = Seen(-0.75, 0.0, lying=True)
    match.go_on(5.0)
    match.red = Seen(-0.75, 0.0)
    match.go_on(1.0)
    red, blue = match.counter.of["red"], match.counter.of["blue"]
    assert (red.falls, red.got_up, red.down) == (1, 1, pytest.approx(4.9))
    assert (blue.falls, blue.got_up, blue.down) == (0, 0, 0.0)


def test_who_is_taken_off_the_field_has_not_got_up(match):
    match.red = Seen(-0.75, 0.0, lying=True)
    match.go_on(21.0)
    assert match.referee.players["red1"].offense is not None
    match.red = Seen(-3.2, -3.3)
    match.go_on(60.0)
    red = match.counter.of["red"]
    assert (red.falls, red.got_up) == (1, 0)
    assert red.minutes < match.counter.of["blue"].minutes - 0.5


def test_a_kick_toward_the_goal_is_a_shot_and_one_aside_is_none(match):
    match.kick(0.1, 0.01)
    match.go_on(2.0)
    assert match.counter.of["red"].shots == 1
    match.kick(0.02, 0.1)
    match.go_on(2.0)
    assert match.counter.of["red"].shots == 1


def test_goals_are_those_of_the_referee(match):
    match.ball = (4.4, 0.0)
    match.kick(0.2, 0.0)
    assert match.counter.of["red"].goals == match.referee.score["red"] == 1


def test_a_table_has_counts_and_how_many_a_robot_and_minute():
    tally = Tally(goals=1, falls=3, down=30.0, minutes=4.0)
    tally.add(Tally(goals=2, minutes=2.0))
    assert dict(zip(HEAD, tally.cells, strict=True)) == {
        "goals": "3 (0.50)",
        "shots": "0 (0.00)",
        "falls": "3 (0.50)",
        "got up": "0 (0.00)",
        "s on the ground": "5.0",
    }
    assert Tally().cells[0] == "0 (0.00)"
