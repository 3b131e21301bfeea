"""The referee over balls and robots whose ways are written down, and over ways that chance makes."""

from __future__ import annotations

import math
from collections.abc import Iterator

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from interfaces.nao import MatchPhase, Offense
from naoserver.soccer_field import Field
from visualhfsm_match._errors import MatchError
from visualhfsm_match._referee import PERIOD, Put, Referee, Seen, Sight
from visualhfsm_match._rules import RULES, load_rules

TEAMS = {"red": ("red1", "red2"), "blue": ("blue1", "blue2")}
WALK = 0.3 * PERIOD  # m from sight to sight


class Match:
    """A match in which everything is where it was put, unless a test moves it."""

    def __init__(self, seconds: float = 600.0) -> None:
        self.referee = Referee(load_rules(), Field(), TEAMS, seconds)
        self.time = 0.0
        self.ball = (0.0, 0.0)
        self.robots = {name: Seen(0.0, 0.0) for names in TEAMS.values() for name in names}
        self.put(self.referee.begin(0.0))

    def put(self, puts: list[Put]) -> None:
        for put in puts:
            if put.name:
                self.robots[put.name] = Seen(put.x, put.y)
            else:
                self.ball = put.x, put.y

    def pass_time(self, seconds: float = PERIOD) -> None:
        for _ in range(round(seconds / PERIOD)):
            self.time = round(self.time + PERIOD, 6)
            self.put(self.referee.see(Sight(self.time, self.ball, dict(self.robots))))

    def whistle(self) -> Match:
        while self.referee.phase is not MatchPhase.Playing:
            self.pass_time()
        return self

    def kick(self, robot: str, x: float, y: float, speed: float = 2.0) -> None:
        """Put a robot beside the ball, which rolls to a place then."""
        self.robots[robot] = Seen(self.ball[0] - 0.2, self.ball[1])
        for _ in range(math.ceil(math.dist(self.ball, (x, y)) / (speed * PERIOD))):
            left = math.dist(self.ball, (x, y))
            share = min(1.0, speed * PERIOD / left)
            self.ball = self.ball[0] + share * (x - self.ball[0]), self.ball[1] + share * (y - self.ball[1])
            rolls = self.ball
            self.pass_time()
            if left <= speed * PERIOD or self.ball != rolls:  # it was put elsewhere
                break

    def kinds(self) -> list[str]:
        return [event.kind for event in self.referee.events]


def test_a_match_begins_with_a_kick_off_and_ends_by_the_clock():
    match = Match(seconds=30.0)
    referee = match.referee
    assert referee.phase is MatchPhase.Ready
    assert match.robots["red1"] == Seen(-0.75, 0.0)
    assert match.robots["blue1"] == Seen(1.1, 0.0)
    match.pass_time(2.0)
    assert referee.phase.name == "Set"
    assert not referee.may_play("red1")
    match.pass_time(3.0)
    assert referee.phase.name == "Playing"
    assert referee.may_play("red1")
    assert not referee.may_play("blue1")
    match.pass_time(10.0)
    assert referee.may_play("blue1")
    match.pass_time(15.0)
    assert referee.over
    assert referee.left == 0.0
    assert referee.winner == ""
    assert match.kinds() == ["kick-off", "whistle", "end"]


def test_a_whole_ball_behind_the_line_is_a_goal_and_the_others_have_the_kick_off():
    match = Match().whistle()
    match.kick("red1", 4.55, 0.3)  # it touches the line
    assert match.referee.score == {"red": 0, "blue": 0}
    match.kick("red1", 4.7, 0.3)
    assert match.referee.score == {"red": 1, "blue": 0}
    goal = next(event for event in match.referee.events if event.kind == "goal")
    assert (goal.team, goal.robot) == ("red", "red1")
    assert match.referee.kick_off == "blue"
    assert match.ball == (0.0, 0.0)
    assert match.robots["blue1"] == Seen(0.75, 0.0)
    assert match.robots["red1"] == Seen(-1.1, 0.0)


def test_an_own_goal_counts_for_the_others():
    match = Match().whistle()
    match.kick("red1", -4.8, 0.0)
    assert match.referee.score == {"red": 0, "blue": 1}
    assert "own goal" in next(event.text for event in match.referee.events if event.kind == "goal")


@pytest.mark.parametrize(
    ("way", "spot", "what"),
    [
        ((1.0, 3.3), (1.0, 3.0), "kick-in blue"),
        ((4.8, 1.5), (3.9, 1.1), "goal kick blue"),
        ((-4.8, -1.5), (-4.5, -3.0), "corner kick blue"),
    ],
)
def test_a_ball_that_was_out_is_put_back(way, spot, what):
    match = Match().whistle()
    match.kick("red1", *way)
    out = match.referee.events[-1]
    assert out.kind == "out"
    assert out.text == f"out by red1: {what}"
    assert match.ball == pytest.approx(spot, abs=0.05)
    assert match.referee.score == {"red": 0, "blue": 0}


def test_a_ball_that_has_no_room_is_put_back_once_it_has():
    match = Match().whistle()
    for number in range(12):
        match.ball = 1.0, 3.05 + 0.01 * number
        match.time = round(match.time + PERIOD, 6)
        puts = match.referee.see(Sight(match.time, match.ball, dict(match.robots)))
        assert [put for put in puts if not put.name] == ([Put("", 1.0, 3.0)] if number > 2 else [])
    match.put(puts)
    match.pass_time(1.0)
    assert match.kinds().count("out") == 1
    match.kick("red1", 1.0, 3.2)
    assert match.kinds().count("out") == 2


def test_ten_goals_of_difference_end_the_match():
    match = Match()
    for _ in range(10):
        match.whistle().kick("red2", 4.8, 0.0, speed=5.0)
    assert match.referee.phase is MatchPhase.Finished
    assert match.referee.winner == "red"
    assert match.referee.score["red"] == 10


def penalty_of(match: Match, robot: str) -> Offense | None:
    return match.referee.players[robot].offense


def test_who_leaves_the_carpet_waits_at_the_line_and_returns():
    match = Match().whistle()
    match.robots["blue2"] = Seen(2.4, 3.8)
    match.pass_time()
    assert penalty_of(match, "blue2") is Offense.LeavingTheField
    assert match.robots["blue2"].y == pytest.approx(3.3)
    match.pass_time(44.0)
    assert penalty_of(match, "blue2") is not None
    match.pass_time(1.5)
    assert penalty_of(match, "blue2") is None
    assert match.kinds()[-1] == "return"
    match.robots["blue1"] = Seen(2.4, 3.8)
    match.pass_time()
    assert match.referee.players["blue1"].left == 55.0  # the second one of its team


def test_who_lies_for_long_is_taken_off():
    match = Match().whistle()
    match.robots["red2"] = Seen(-2.0, 1.0, lying=True)
    match.pass_time(19.0)
    assert penalty_of(match, "red2") is None
    match.pass_time(2.0)
    assert penalty_of(match, "red2") is Offense.IncapableRobot


def test_who_falls_again_on_the_way_up_has_not_got_up():
    match = Match().whistle()
    for _ in range(2):
        match.robots["red2"] = Seen(-2.0, 1.0, lying=True)
        match.pass_time(8.0)
        match.robots["red2"] = Seen(-2.0, 1.0)
        match.pass_time(1.0)
    match.robots["red2"] = Seen(-2.0, 1.0, lying=True)
    match.pass_time(3.0)
    assert penalty_of(match, "red2") is Offense.IncapableRobot


def test_who_gets_up_in_time_is_not():
    match = Match().whistle()
    for _ in range(3):
        match.robots["red2"] = Seen(-2.0, 1.0, lying=True)
        match.pass_time(15.0)
        match.robots["red2"] = Seen(-2.0, 1.0)
        match.pass_time(3.0)
    assert penalty_of(match, "red2") is None


def together(match: Match, *, fall: bool, seconds: float, toward: float = WALK) -> None:
    """Let red2 come to blue2, which stands, and push it along; perhaps it falls."""
    match.robots["blue2"] = Seen(2.4, 1.5)
    match.robots["red2"] = Seen(1.4, 1.5)
    match.pass_time(11.0)
    x, other = 1.4, 2.4
    for _ in range(round((seconds + 2.5) / PERIOD)):
        if penalty_of(match, "red2") is not None:
            return
        x = min(x + toward, other - 0.3)
        match.robots["red2"] = Seen(x, 1.5)
        if fall and x >= other - 0.3:
            match.robots["blue2"] = Seen(other, 1.5, lying=True)
        match.pass_time()


def test_who_makes_an_opponent_fall_pushes():
    match = Match().whistle()
    together(match, fall=True, seconds=1.0)
    assert penalty_of(match, "red2") is Offense.Pushing
    assert penalty_of(match, "blue2") is None


def test_who_pushes_for_long_is_taken_off_but_not_who_stands():
    match = Match().whistle()
    together(match, fall=False, seconds=3.0)
    assert penalty_of(match, "red2") is None
    match.pass_time(4.0)
    assert penalty_of(match, "red2") is Offense.Pushing
    assert penalty_of(match, "blue2") is None


def test_who_meet_front_to_front_do_not_push():
    match = Match().whistle()
    for step in range(90):
        apart = max(0.3, 1.5 - 2 * WALK * step)
        match.robots["red2"] = Seen(2.0 - apart / 2, 1.5)
        match.robots["blue2"] = Seen(2.0 + apart / 2, 1.5)
        match.pass_time()
    assert penalty_of(match, "red2") is None
    assert penalty_of(match, "blue2") is None


def test_a_penalty_does_not_pass_while_all_stand_still():
    match = Match().whistle()
    match.robots["red2"] = Seen(-2.4, 3.8)
    match.pass_time()
    assert not match.referee.may_play("red2")
    assert match.referee.may_play("red1")
    match.kick("red1", 4.7, 0.0)
    match.pass_time(2.1)
    assert match.referee.phase.name == "Set"
    left = match.referee.players["red2"].left
    match.pass_time(2.0)
    assert match.referee.players["red2"].left == left
    match.pass_time(2.0)
    assert match.referee.players["red2"].left < left


def test_a_ball_counts_where_it_crossed_the_line():
    match = Match().whistle()
    match.ball = 4.4, 0.6
    match.pass_time()
    match.ball = 4.9, 0.85  # the middle of a post is at 0.8
    match.pass_time()
    assert match.referee.score == {"red": 1, "blue": 0}


def test_the_others_stay_out_of_the_circle_until_the_ball_is_free():
    match = Match().whistle()
    match.robots["blue1"] = Seen(0.5, 0.0)
    match.pass_time()
    assert penalty_of(match, "blue1") is Offense.IllegalPositioning
    match = Match().whistle()
    match.kick("red1", 0.5, 1.0)
    match.robots["blue1"] = Seen(0.5, 0.0)
    match.pass_time()
    assert penalty_of(match, "blue1") is None


def test_nobody_walks_while_all_stand_still():
    match = Match()
    match.pass_time(2.5)
    assert match.referee.phase is MatchPhase.Set
    match.robots["red2"] = Seen(-2.0, 0.9)
    match.pass_time()
    assert penalty_of(match, "red2") is Offense.MotionInSet


def test_a_ball_near_which_nobody_is_is_dropped():
    match = Match().whistle()
    match.kick("red1", 0.0, -2.0)
    match.robots["red1"] = Seen(-3.0, 2.0)
    match.pass_time(31.0)
    assert "stuck" in match.kinds()
    assert match.ball == (0.0, 0.0)


def test_a_team_may_lose_whatever_the_score_is():
    match = Match().whistle()
    match.kick("red1", 4.8, 0.0)
    match.referee.forfeit("red", "its document raised an error")
    assert match.referee.phase is MatchPhase.Finished
    assert match.referee.winner == "blue"
    match.pass_time(1.0)
    assert match.kinds()[-2:] == ["lost", "end"]


def test_time_does_not_run_backwards():
    match = Match().whistle()
    with pytest.raises(ValueError, match="back to 1 s"):
        match.referee.see(Sight(1.0, match.ball, match.robots))


def test_rules_that_are_wrong_name_their_line(tmp_path):
    path = tmp_path / "own.toml"
    path.write_text(RULES.read_text().replace("mercy = 10 ", "mercy = 0 "))
    with pytest.raises(MatchError, match=r"own\.toml:\d+: mercy"):
        load_rules(path)


def places(far: float) -> st.SearchStrategy[float]:
    return st.floats(-far, far, allow_nan=False)


SIGHTS = st.lists(
    st.tuples(
        st.sampled_from([0.1, 0.1, 0.1, 1.0, 20.0]),
        st.tuples(places(6.0), places(4.5)),
        st.fixed_dictionaries(
            {
                name: st.builds(Seen, places(6.0), places(4.5), st.booleans())
                for names in TEAMS.values()
                for name in names
            }
        ),
    ),
    max_size=60,
)


def history(sights) -> Iterator[tuple[Referee, list[Put]]]:
    referee = Referee(load_rules(), Field(), TEAMS, 300.0)
    time = 0.0
    yield referee, referee.begin(time)
    for passed, ball, robots in sights:
        time += passed
        yield referee, referee.see(Sight(time, ball, robots))


@settings(deadline=None)
@given(SIGHTS)
def test_whatever_happens_the_match_is_one(sights):
    left, score, finished, seen = 300.0, 0, False, 0
    for referee, puts in history(sights):
        goals = sum(referee.score.values())
        assert 0 <= goals - score <= 1
        assert referee.left <= left
        assert not finished or (referee.phase is MatchPhase.Finished and not puts)
        assert (referee.left > 0.0) or referee.phase is MatchPhase.Finished
        for player in referee.players.values():
            assert (player.offense is None) == (player.left <= 0.0)
            assert referee.phase is MatchPhase.Playing or not referee.may_play(player.name)
        for put in puts:
            assert abs(put.x) <= 5.2
            assert abs(put.y) <= 3.7
        left, score, finished = referee.left, goals, referee.phase is MatchPhase.Finished
        times = [event.time for event in referee.events]
        assert times == sorted(times)
        assert len(times) >= seen
        seen = len(times)


@pytest.mark.slow
@settings(deadline=None)
@given(SIGHTS)
def test_every_penalized_robot_returns(sights):
    *_, (referee, _) = history(sights)
    if referee.phase is MatchPhase.Finished:
        assert all(player.offense is None for player in referee.players.values())
        return
    out = [player for player in referee.players.values() if player.offense is not None]
    still = {player.name: Seen(*player.place[1:3]) for player in referee.players.values()}
    time = 400.0
    for _ in range(2000):
        time += PERIOD
        if referee.over or all(player.offense is None for player in out):
            break
        referee.see(Sight(time, (0.0, 0.0), still))
    assert all(player.offense is None for player in out)


@settings(deadline=None)
@given(SIGHTS)
def test_the_same_sights_give_the_same_match(sights):
    first, second = ([(puts, [*referee.events]) for referee, puts in history(sights)] for _ in range(2))
    assert first == second
